//! The `embrasure` program: parse, run, exit code.

fn main() -> std::process::ExitCode {
    embrasure::cli::main()
}
