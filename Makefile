# The commands of this project; `make` alone lists them.

# Where rustup puts cargo: a shell opened before rustup ran does not have it in PATH yet.
export PATH := $(PATH):$(or $(CARGO_HOME),$(HOME)/.cargo)/bin

CARGO  ?= cargo
TARGET := $(or $(CARGO_TARGET_DIR),target)

# The feature sets that `make test` runs, each compiled once. For one more: a name here, and its flags below.
#
# `all` has what this machine can have, and every test. `obvhs` has no Embree: of tests/it it runs what traces rays by its own backend or names it
# (IT_obvhs). Lobes, textures, files and sampling are the same code in both. A build without any backend, `none`, is linted alone.
#
# Unit tests of the renderer are short, and compiled with little optimisation. So is the renderer itself where it lacks Embree. The main crate and the
# tests of that set are not optimised: they run half as long again, which is less than compiling saves. Packages that a set does not use are named with
# it: bindgen of embree4-sys, and Open Image Denoise, ask more of procedural macros than others do, and without them all that uses such macros would be
# compiled once more.
FEATURE_SETS := all obvhs
OPT_1        := --config profile.dev.package.embrasure-core.opt-level=1
OPT_0        := --config profile.dev.package.embrasure.opt-level=0
SMALL        := -p embrasure -p embrasure-embree-sys --no-default-features $(OPT_1) $(OPT_0)
FEATURES_all  = --features "$(call optional,obvhs,HAS_OBVHS) $(call optional,oidn,HAS_OIDN)"
FLAGS_all     = --workspace --exclude embrasure-core --exclude embrasure-oidn $(FEATURES_all)
FLAGS_core    = -p embrasure-core -p embrasure-embree-sys --features "embrasure-core/embree embrasure-core/tobj $(subst embrasure/,embrasure-core/,$(call optional,obvhs,HAS_OBVHS) $(call optional,oidn,HAS_OIDN))" $(OPT_1)
FLAGS_none   := $(SMALL) --features embrasure/cli
FLAGS_obvhs   = $(SMALL) $(if $(call optional,oidn,HAS_OIDN),-p embrasure-oidn) --features "embrasure/cli embrasure/obvhs"
IT_obvhs     := backends:: check::memory_is_forecast closed_forms:: command_line:: motion:: surfaces::

# The obvhs crate needs Rust 1.88, denoising Open Image Denoise, and the Python tests packages from pip. Without them their tests are left out with a
# word, which is a failure where EMBRASURE_REQUIRE_OBVHS, EMBRASURE_REQUIRE_OIDN or EMBRASURE_REQUIRE_PYTHON is set, as in CI.
HAS_OBVHS  := rustc --version | awk '{ split($$2, v, "."); exit !(v[1] > 1 || v[2] >= 88) }'
HAS_OIDN   := scripts/setup oidn >/dev/null
HAS_PYTHON := scripts/setup-python
optional   = $(shell if $($(2)); then echo embrasure/$(1); fi)
with_obvhs = @if $(HAS_OBVHS); then echo '$(1)' && $(1); else \
	  echo 'skipped: $(1): the obvhs crate needs Rust 1.88'; [ -z "$$EMBRASURE_REQUIRE_OBVHS" ]; fi

# The features with which all targets are linted and documented. Of the features that are the default, and of none, the library is enough; the example
# brings the features of dependencies that tests have, so that these are checked once.
LINTED = embrasure/oidn $(call optional,obvhs,HAS_OBVHS)

# One step at a time, also under `make -j`: cargo itself uses all the cores.
.NOTPARALLEL:
.DEFAULT_GOAL := help
.PHONY: help setup demo lint test $(FEATURE_SETS:%=test-%) test-long test-farm test-view screenshots python test-python sanitize fuzz random-renders bench bench-peers gallery first-pictures guide test-guide install uninstall dist wheel deb package clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-14s  %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## install what the build needs (Embree 4, libclang, a C compiler, Rust) where it is missing
	@scripts/setup

demo: setup ## build (with Open Image Denoise where its library can be had), and render scenes/cornell-box.toml to out/cornell-box.exr and .png
	$(CARGO) build --release --locked --features "$(call optional,oidn,HAS_OIDN)"
	mkdir -p out
	$(TARGET)/release/embrasure render scenes/cornell-box.toml --quality good --spp 64 -o out/cornell-box.exr -o out/cornell-box.png
	@echo 'Look at out/cornell-box.png. Next: $(TARGET)/release/embrasure render YOUR.obj -o YOUR.png'

lint: setup ## check formatting, words, the public interface, clippy and rustdoc; any warning is an error
	scripts/words
	@if command -v python3 >/dev/null; then scripts/public-api; else echo 'skipped: public interface: there is no python3'; fi
	$(CARGO) fmt --all --check
	$(CARGO) fmt --manifest-path tests/fuzz/Cargo.toml --check
	$(CARGO) clippy --workspace --all-targets --locked --features "$(LINTED)" -- -D warnings
	$(CARGO) clippy -p embrasure -p embrasure-core --lib --example made_in_code --locked -- -D warnings
	$(CARGO) clippy -p embrasure-core $(SMALL) --lib --example made_in_code --locked -- -D warnings
	$(CARGO) clippy $(FLAGS_none) --all-targets --locked -- -D warnings
	$(call with_obvhs,$(CARGO) clippy $(FLAGS_obvhs) --lib --test it --locked -- -D warnings)
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --workspace --exclude embrasure-python --no-deps --document-private-items --locked --features "$(LINTED)"

test: setup lint $(FEATURE_SETS:%=test-%) ## lint, then run the tests with each feature set

test-all: setup
	@$(HAS_OBVHS) || { echo 'skipped: tests of obvhs: the crate needs Rust 1.88'; [ -z "$$EMBRASURE_REQUIRE_OBVHS" ]; }
	@$(HAS_OIDN) || { echo 'skipped: tests of Open Image Denoise: it cannot be had'; [ -z "$$EMBRASURE_REQUIRE_OIDN" ]; }
	@$(HAS_PYTHON) || { echo 'skipped: tests of the Python module'; [ -z "$$EMBRASURE_REQUIRE_PYTHON" ]; }
	$(CARGO) test --locked $(FLAGS_all)
	$(CARGO) test --locked $(FLAGS_core) --lib

test-obvhs: setup
	$(call with_obvhs,$(CARGO) test --locked $(FLAGS_obvhs) --test it -- $(IT_obvhs))

# The Python module has the features of the program that `make demo` builds, so that both are made of one compiled library.
python       = $(subst embrasure/,embrasure-python/,$(1))
PYTHON_NEEDS = $(call optional,oidn,HAS_OIDN)

python: setup ## build the Python module, and the program, for use in place: PYTHONPATH=out/python
	$(CARGO) build --release --locked -p embrasure -p embrasure-python --features "$(PYTHON_NEEDS) $(call python,$(PYTHON_NEEDS))"
	scripts/python-package $(TARGET)/release/libembrasure_python.so out/python

test-python: setup ## test the Python module against the program, with its types, notebooks and page; part of `make test`
	$(HAS_PYTHON)
	$(CARGO) build --locked $(FLAGS_all) --bin embrasure --test pytest
	$(CARGO) test --locked $(FLAGS_all) --test pytest -- --nocapture

test-view: setup ## test the page of `embrasure view` in headless Chromium, and its server; part of `make test` where Chromium is there
	$(CARGO) test --locked $(FLAGS_all) --test view -- --nocapture

screenshots: setup ## write the pictures of the viewer for the guide into the folder EMBRASURE_SCREENSHOTS
	$(CARGO) test --locked $(FLAGS_all) --test view -- --include-ignored --skip figures

# Statistical tests take a quarter of their samples in `make test` (tests/support).
test-long: setup ## run tests/it, and every command of the guide, with all the samples of statistical tests
	EMBRASURE_LONG=1 EMBRASURE_GUIDE=all $(CARGO) test --locked $(FLAGS_all) --test it

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

test-guide: setup ## run every command of the guide, also those that take longer than `make test` likes
	EMBRASURE_GUIDE=all $(CARGO) test --locked $(FLAGS_all) --test it -- guide:: --nocapture

bench-peers: setup ## render the comparison suite by Mitsuba, Cycles, LuxCore and this program; rewrites table and plot of docs/benchmarks.md
	scripts/bench-peers

random-renders: setup ## render RANDOM_RENDERS (0..20000) random products of scenes, materials and flags; each must end well
	EMBRASURE_RANDOM_RENDERS=$(or $(RANDOM_RENDERS),0..20000) $(CARGO) test --release --locked --features obvhs --test random_renders -- --nocapture

bench: setup ## measure ray rates of all backends on all scenes there are, and rewrite the tables of docs/benchmarks.md
	scripts/bench

PREFIX ?= /usr/local

install: ## install the program that `make demo` built, with its libraries, manual pages and scenes, below PREFIX (/usr/local)
	scripts/install $(TARGET)/release/embrasure $(PREFIX)

uninstall: ## remove what `make install` put below PREFIX
	scripts/install --remove $(PREFIX)

VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml)
# The processor that `dist`, `wheel` and `deb` build for, by the name that `uname -m` has for it; docs/guide/how-to/install.md has what another one needs.
ARCH    ?= $(shell uname -m)
TRIPLE  := $(ARCH)-unknown-linux-gnu
CROSS   := $(filter-out $(shell uname -m),$(ARCH))
DIST    := embrasure-$(VERSION)-$(ARCH)-linux
LINKER   = CARGO_TARGET_$(shell echo $(TRIPLE) | tr a-z- A-Z_)_LINKER=$(ARCH)-linux-gnu-gcc
BUILD    = EMBRASURE_MOVABLE=1 $(if $(CROSS),$(LINKER)) $(CARGO) build --profile dist --locked $(if $(CROSS),--target $(TRIPLE))
BUILT   := $(TARGET)/$(if $(CROSS),$(TRIPLE)/)dist
# scripts/setup gets Open Image Denoise for this machine's processor alone.
HAS_SHIPPED_OIDN := $(if $(CROSS),$(if $(OIDN_DIR),true,false),$(HAS_OIDN))
SHIPPED  = $(call optional,oidn,HAS_SHIPPED_OIDN) $(call optional,obvhs,HAS_OBVHS)
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
	$(BUILD) -p embrasure-python --features "$(call python,$(SHIPPED))"
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
