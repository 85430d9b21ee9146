//! The `echolume` program: it runs the command line of the library.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    echolume::run()
}
