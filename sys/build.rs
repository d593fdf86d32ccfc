//! Finds Embree 4, generates the bindings to it and links it.

use std::env;
use std::panic;
use std::path::{Path, PathBuf};

#[path = "build/discover.rs"]
mod discover;

use discover::{Embree, Places};

fn main() {
    // Cargo shows only these lines to a user whose machine lacks a dependency.
    if let Err(message) = build() {
        for line in message.lines().filter(|line| !line.is_empty()) {
            println!("cargo::error={line}");
        }
    }
}

fn build() -> Result<(), String> {
    let package = PathBuf::from(variable("CARGO_MANIFEST_DIR"));
    let deps = package.parent().unwrap_or(&package).join(".deps/embree");
    let multiarch = multiarch(&variable("TARGET"));

    println!("cargo::rustc-check-cfg=cfg(without_bindings)");
    let places = Places {
        embree_dir: user_path("EMBREE_DIR"),
        include_dir: user_path("EMBREE_INCLUDE_DIR"),
        lib_dir: user_path("EMBREE_LIB_DIR"),
        deps: deps.clone(),
        system: discover::system_prefixes(Path::new("/")),
        multiarch: multiarch.clone(),
    };
    let embree = match discover::discover(&places) {
        // docs.rs sets this variable and has no Embree. The page there documents the crate without
        // bindings.
        Err(_) if env::var_os("DOCS_RS").is_some() => {
            println!("cargo::rustc-cfg=without_bindings");
            return Ok(());
        }
        found => found?,
    };
    watch(&embree, &deps);
    link(&embree, &multiarch);
    bind(&embree)
}

/// Declares the inputs of this script to Cargo.
fn watch(embree: &Embree, deps: &Path) {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-env-changed=LIBCLANG_PATH");

    // bindgen declares each header as an input. The folder of the headers also changes at an
    // upgrade, even if the package manager sets dates older than the last build.
    let headers = embree.include_dir.join("embree4");
    let library = embree.lib_dir.join(embree.library);
    println!("cargo::rerun-if-changed={}", headers.display());
    println!("cargo::rerun-if-changed={}", library.display());

    // An Embree in the project's folder takes precedence as soon as it exists. Cargo treats a
    // missing path as changed every time, so until then its parent folder is watched.
    let nearest = deps.ancestors().take(2).find(|path| path.exists());
    if let Some(path) = nearest {
        println!("cargo::rerun-if-changed={}", path.display());
    }
}

fn link(embree: &Embree, multiarch: &str) {
    let lib_dir = embree.lib_dir.display();
    println!("cargo::rustc-link-search=native={lib_dir}");
    // The linker derives a file name from `embree4`, but not the name of a versioned file.
    match embree.library {
        "libembree4.so" | "libembree4.dylib" => println!("cargo::rustc-link-lib=dylib=embree4"),
        versioned => println!("cargo::rustc-link-lib=dylib:+verbatim={versioned}"),
    }

    // An rpath set here applies only to this crate's tests. Dependent crates read the metadata
    // `rpath` and set an rpath themselves.
    let rpath = if discover::needs_rpath(&embree.lib_dir, multiarch) {
        lib_dir.to_string()
    } else {
        String::new()
    };
    if !rpath.is_empty() {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{rpath}");
    }
    println!("cargo::metadata=lib_dir={lib_dir}");
    println!("cargo::metadata=rpath={rpath}");
    println!("cargo::metadata=version={}", embree.version);
}

fn bind(embree: &Embree) -> Result<(), String> {
    require_libclang()?;
    let rust = bindgen::RustTarget::stable(85, 0).map_err(|error| error.to_string())?;
    let bindings = bindgen::builder()
        .header("wrapper.h")
        .clang_arg(format!("-I{}", embree.include_dir.display()))
        // Embree's comments are not marked as documentation, but are useful as such.
        .clang_arg("-fparse-all-comments")
        .allowlist_item("(rtc|RTC).*")
        // Do not generate Rust enums: a value that the header does not name would be undefined
        // behaviour.
        .newtype_enum("RTC.*")
        .bitfield_enum("RTC.*Flags")
        .layout_tests(true)
        .use_core()
        .rust_target(rust)
        .rust_edition(bindgen::RustEdition::Edition2024)
        // Unlike rustfmt, prettyplease needs no installed program.
        .formatter(bindgen::Formatter::Prettyplease)
        .parse_callbacks(Box::new(bindgen::CargoCallbacks::new()))
        .generate()
        .map_err(|error| {
            format!(
                "The headers in {} cannot be bound.\n{error}\n{LIBCLANG}",
                embree.include_dir.display()
            )
        })?;
    let file = PathBuf::from(variable("OUT_DIR")).join("bindings.rs");
    bindings
        .write_to_file(&file)
        .map_err(|error| format!("cannot write {}: {error}", file.display()))
}

const LIBCLANG: &str = "\
libclang reads Embree's headers, with the help of some that come with it. How to get them:
  apt-get install libclang-dev      on Debian and Ubuntu
  LIBCLANG_PATH=/folder             names the folder of one that is not in a usual place
To build without Embree:
  cargo build --no-default-features --features cli";

/// Returns an error if libclang is missing. bindgen would panic, so this check comes before bindgen
/// and suppresses the panic message.
fn require_libclang() -> Result<(), String> {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let version = panic::catch_unwind(bindgen::clang_version);
    panic::set_hook(hook);
    version.map(|_| ()).map_err(|cause| {
        let cause = cause
            .downcast_ref::<String>()
            .map_or("libclang cannot be loaded", |cause| cause);
        format!("{cause}\n{LIBCLANG}")
    })
}

/// Debian's name for a target: Rust's name without the vendor.
fn multiarch(target: &str) -> String {
    match target.split('-').collect::<Vec<_>>()[..] {
        [arch, _vendor, os, env] => format!("{arch}-{os}-{env}"),
        _ => target.into(),
    }
}

/// Path in the environment variable `name`, which the user may set. An empty path counts as unset.
fn user_path(name: &str) -> Option<PathBuf> {
    println!("cargo::rerun-if-env-changed={name}");
    env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from)
}

/// Value of the environment variable `name`, which Cargo sets.
fn variable(name: &str) -> String {
    env::var(name).unwrap_or_else(|error| panic!("Cargo sets {name}: {error}"))
}
