//! The program `embrasure`. It calls the command line of the library.

#[cfg(not(feature = "cli"))]
compile_error!(
    "the program needs the feature `cli`: add it to --features. The library alone is built by `cargo build --lib`."
);

#[cfg(feature = "cli")]
fn main() -> std::process::ExitCode {
    embrasure::cli::main()
}

#[cfg(not(feature = "cli"))]
fn main() {}
