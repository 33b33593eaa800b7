//! The `muslin` program; everything is in the library.

fn main() -> std::process::ExitCode {
    muslin::cli::main()
}
