//! `echolume view` in a build without the feature `view`: says how to have it.

use crate::terminal::{Failure, input};
use std::ffi::OsString;
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct View {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    _arguments: Vec<OsString>,
}

impl View {
    pub fn run(self) -> Result<(), Failure> {
        Err(input("view: this program was built without the feature `view`; build it with `cargo build --release`"))
    }

    /// The configuration is not read.
    pub fn log(&self) -> Option<(PathBuf, u64, u32)> {
        None
    }
}
