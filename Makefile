# Commands of this project; `make` alone lists them.

# The folder where rustup installs cargo: a shell opened before rustup ran does not have it in PATH.
export PATH := $(PATH):$(or $(CARGO_HOME),$(HOME)/.cargo)/bin

CARGO  ?= cargo
TARGET := $(or $(CARGO_TARGET_DIR),target)

# Features available on this machine. `make demo` and `make test` share the features and one
# profile, so that both use one build of the renderer. Only its unit tests compile it again. The obvhs crate needs Rust 1.88, denoising needs Open
# Image Denoise (which `make setup` gets), and the Python tests need packages from pip. If one of
# them is missing, its tests are skipped with a message. With EMBRASURE_REQUIRE_OBVHS,
# EMBRASURE_REQUIRE_OIDN or EMBRASURE_REQUIRE_PYTHON, as in CI, that is a failure.
HAS_OBVHS  := rustc --version | awk '{ split($$2, v, "."); exit !(v[1] > 1 || v[2] >= 88) }'
HAS_OIDN   := scripts/setup has-oidn
HAS_PYTHON := scripts/setup-python
optional    = $(shell if $($(2)); then echo $(3)/$(1); fi)
features    = $(call optional,obvhs,HAS_OBVHS,$(1)) $(call optional,oidn,HAS_OIDN,$(1))
FEATURES    = --locked --features "$(call features,embrasure)"
with_obvhs  = @if $(HAS_OBVHS); then echo '$(1)' && $(1); else \
	  echo 'skipped: $(1): the obvhs crate needs Rust 1.88'; [ -z "$$EMBRASURE_REQUIRE_OBVHS" ]; fi

# Unit tests of the renderer. They are short, so they are compiled with little optimisation.
UNITS   = -p embrasure-core -p embrasure-embree-sys --lib --locked --features "embrasure-core/embree embrasure-core/tobj $(call features,embrasure-core)"
OPT_1   = --config profile.$(1).package.embrasure-core.opt-level=1
# Builds without C libraries. They run only the modules of tests/it that trace rays with the own
# backend or use its name. Lobes, textures, files and sampling are the same code in all builds. The
# packages of the C libraries are listed, although they build nothing here: bindgen enables features
# of procedural macros, and without them all users of these macros would be compiled again.
NO_C        = -p embrasure -p embrasure-embree-sys $(if $(call optional,oidn,HAS_OIDN,x),-p embrasure-oidn) --locked --no-default-features
FLAGS_obvhs = $(NO_C) $(call OPT_1,dev) --config profile.dev.package.embrasure.opt-level=0 --features "embrasure/cli embrasure/obvhs"
IT_obvhs   := backends:: check::memory_is_forecast closed_forms:: command_line:: motion:: surfaces::

# One step at a time, also with `make -j`: cargo itself uses all cores.
.NOTPARALLEL:
.DEFAULT_GOAL := help
.PHONY: help setup demo lint test test-one reference test-all test-long test-obvhs test-farm test-view screenshots python test-python sanitize fuzz random-renders bench bench-peers gallery first-pictures guide test-guide install uninstall dist wheel deb package clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-14s  %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## install what the build needs (Embree 4, Open Image Denoise, libclang, a C compiler, Rust) where it is missing
	@scripts/setup
	@scripts/setup oidn || { echo 'setup: going on without Open Image Denoise'; [ -z "$$EMBRASURE_REQUIRE_OIDN" ]; }

demo: setup ## build, and render scenes/cornell-box.toml to out/cornell-box.exr and .png
	$(CARGO) build --release $(FEATURES)
	mkdir -p out
	$(TARGET)/release/embrasure render scenes/cornell-box.toml --quality good --spp 64 -o out/cornell-box.exr -o out/cornell-box.png
	@echo 'Look at out/cornell-box.png. Next: $(TARGET)/release/embrasure render YOUR.obj -o YOUR.png'

# Two more tests than processors, because some tests wait for files, signals and connections
THREADS := $(or $(RUST_TEST_THREADS),$(shell expr 2 + $$(nproc 2>/dev/null || getconf _NPROCESSORS_ONLN || echo 2)))
test: export RUST_TEST_THREADS = $(THREADS)
test: setup ## run the quick tests; some minutes
	$(CARGO) test --release --no-fail-fast $(FEATURES) || { $(CARGO) test --release $(UNITS) $(call OPT_1,release); exit 1; }
	$(CARGO) test --release $(UNITS) $(call OPT_1,release)

T ?=
test-one: setup ## run the tests of tests/it whose name contains T, such as T=bsdf::
	$(CARGO) test --release $(FEATURES) --test it -- $(T)

reference: setup ## write the schema of scene files and the pages of the reference that the program generates
	EMBRASURE_WRITE_DOCS=1 $(CARGO) test --release $(FEATURES) --lib documentation

lint: setup ## check formatting, width of comments, the public interface, clippy and rustdoc; any warning is an error
	scripts/comment-width
	@if command -v python3 >/dev/null; then scripts/public-api; else echo 'skipped: public interface: there is no python3'; fi
	$(CARGO) fmt --all --check
	$(CARGO) fmt --manifest-path tests/fuzz/Cargo.toml --check
	$(CARGO) clippy --workspace --all-targets $(FEATURES) --features "$(call optional,obvhs,HAS_OBVHS,embrasure-benches)" -- -D warnings
	$(CARGO) clippy $(NO_C) --features embrasure/cli --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --workspace --exclude embrasure-python --no-deps --document-private-items $(FEATURES)

# The profile dev checks overflows and debug assertions. It optimises tests a little, which saves
# time if all of them run.
CHECKED      = --workspace --exclude embrasure-benches --exclude embrasure-core --exclude embrasure-oidn $(FEATURES)

test-all: setup ## run all tests with checks of overflow, also of the Python module and the page, and those of a build without Embree; half an hour
	@$(HAS_PYTHON) || { echo 'skipped: tests of the Python module'; [ -z "$$EMBRASURE_REQUIRE_PYTHON" ]; }
	EMBRASURE_LONG=1 $(CARGO) test $(CHECKED)
	$(CARGO) test $(UNITS) $(call OPT_1,dev)
	$(MAKE) test-obvhs

test-long: setup ## run tests/it with all the samples of statistical tests, of which other targets take a part, and every command of the guide
	EMBRASURE_LONG=1 EMBRASURE_ALL_SAMPLES=1 EMBRASURE_GUIDE=all $(CARGO) test $(FEATURES) --test it

test-obvhs: setup ## run the tests of ray queries in a build without Embree
	$(call with_obvhs,EMBRASURE_LONG=1 $(CARGO) test $(FLAGS_obvhs) --test it -- $(IT_obvhs))

python: setup ## build the Python module, and the program, for use in place: PYTHONPATH=out/python
	$(CARGO) build --release -p embrasure -p embrasure-python $(FEATURES) --features "$(call features,embrasure-python)"
	scripts/python-package $(TARGET)/release/libembrasure_python.so out/python

test-python: setup ## test the Python module against the program, with its types, notebooks and page
	$(HAS_PYTHON)
	$(CARGO) build $(CHECKED) --bin embrasure --test pytest
	$(CARGO) test $(CHECKED) --test pytest -- --nocapture

test-view: setup ## test the page of `embrasure view`, in headless Chromium where it is there, and its server
	EMBRASURE_LONG=1 $(CARGO) test --release $(FEATURES) --test view -- --nocapture

screenshots: setup ## write the pictures of the viewer for the guide into the folder SCREENSHOTS (docs/guide/images)
	$(CARGO) bench $(FEATURES) --bench viewer -- screenshots $(abspath $(or $(SCREENSHOTS),docs/guide/images))

test-farm: setup ## render on a Slurm cluster of this machine alone, with parts that are killed, and compare the bits
	scripts/farm/test

sanitize: setup ## look for memory errors and leaks, by sanitizers (nightly Rust) and valgrind; takes ten minutes
	scripts/sanitize

fuzz: setup ## feed the readers of files with made-up ones, each kind for FUZZ_SECONDS (1800); needs nightly Rust
	scripts/fuzz

gallery: setup ## render the pictures of docs/gallery (some need ../shared/scenes), and make those of README from them
	scripts/gallery

first-pictures: setup ## render the OBJ files of ../shared/scenes as they are, to the sheet and table of docs/guide/explanation/first-pictures.md
	scripts/first-pictures

guide: ## build the guide to out/guide/index.html; gets mdBook where it is missing
	@scripts/guide

test-guide: setup ## run every command of the guide
	EMBRASURE_LONG=1 EMBRASURE_GUIDE=all $(CARGO) test --release $(FEATURES) --test it -- guide:: --nocapture

bench-peers: setup ## render the comparison suite by Mitsuba, Cycles, LuxCore and this program; adds table and plot to the notebook of the month
	scripts/bench-peers

random-renders: setup ## render RANDOM_RENDERS (0..20000) random products of scenes, materials and flags; each must end well
	EMBRASURE_RANDOM_RENDERS=$(or $(RANDOM_RENDERS),0..20000) $(CARGO) test --release $(FEATURES) --test random_renders -- --nocapture

bench: setup ## measure ray rates of all backends on all scenes there are, and add the tables to the notebook of the month
	scripts/bench

PREFIX ?= /usr/local

install: ## install the program that `make demo` built, with its libraries, manual pages and scenes, below PREFIX (/usr/local)
	scripts/install $(TARGET)/release/embrasure $(PREFIX)

uninstall: ## remove what `make install` put below PREFIX
	scripts/install --remove $(PREFIX)

VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml)
# Target processor of `dist`, `wheel` and `deb`, as printed by `uname -m`;
# docs/guide/how-to/install.md lists the needs of other processors.
ARCH    ?= $(shell uname -m)
TRIPLE  := $(ARCH)-unknown-linux-gnu
CROSS   := $(filter-out $(shell uname -m),$(ARCH))
DIST    := embrasure-$(VERSION)-$(ARCH)-linux
LINKER   = CARGO_TARGET_$(shell echo $(TRIPLE) | tr a-z- A-Z_)_LINKER=$(ARCH)-linux-gnu-gcc
BUILD    = EMBRASURE_MOVABLE=1 $(if $(CROSS),$(LINKER)) $(CARGO) build --profile dist --locked $(if $(CROSS),--target $(TRIPLE))
BUILT   := $(TARGET)/$(if $(CROSS),$(TRIPLE)/)dist
# scripts/setup gets Open Image Denoise only for the processor of this machine.
HAS_SHIPPED_OIDN := $(if $(CROSS),$(if $(OIDN_DIR),true,false),$(HAS_OIDN))
SHIPPED  = $(call optional,oidn,HAS_SHIPPED_OIDN,embrasure) $(call optional,obvhs,HAS_OBVHS,embrasure)
# Licences of the crates
NOTICES  = share/doc/embrasure/THIRD-PARTY

dist: setup ## build the fastest program, which runs from any folder, and pack it with all that it needs into out/
	$(BUILD) --features "$(SHIPPED)"
	rm -rf out/$(DIST)
	scripts/install --self-contained $(BUILT)/embrasure $(CURDIR)/out/$(DIST)
	scripts/notices "$(SHIPPED)" $(TRIPLE) out/$(DIST)/$(NOTICES)
	tar -C out -czf out/$(DIST).tar.gz $(DIST)
	@echo "-> out/$(DIST).tar.gz"

wheel: dist ## pack the same and the Python module as a wheel, which pip installs without a compiler or root, into out/
	$(BUILD) -p embrasure-python --features "$(subst embrasure/,embrasure-python/,$(SHIPPED))"
	scripts/python-package $(BUILT)/libembrasure_python.so out/wheel
	scripts/wheel out/$(DIST) $(VERSION) out/wheel/embrasure out

deb: dist ## pack the same as a package for Debian and Ubuntu into out/; DEBFULLNAME and DEBEMAIL name who packs it
	rm -rf out/deb
	DESTDIR=$(CURDIR)/out/deb scripts/install $(BUILT)/embrasure /usr
	cp out/$(DIST)/$(NOTICES) out/deb/usr/$(NOTICES)
	scripts/deb out/deb $(VERSION) $(ARCH) out

package: setup ## pack the crates, and build each, with its documentation, from its package alone
	scripts/package

clean: ## remove what builds and renders made (.deps stays)
	rm -rf $(TARGET) out
