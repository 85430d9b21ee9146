//! The command line, and nothing else.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    echolume::run()
}
