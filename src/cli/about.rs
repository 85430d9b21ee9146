//! `echolume completions` and `echolume man`: completion scripts for shells, and manual pages.

use crate::args::make_folder;
use crate::files;
use crate::terminal::{self, Failure, failed, say};
use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  echolume completions bash >~/.local/share/bash-completion/completions/echolume\n  \
                        echolume completions zsh >~/.zfunc/_echolume\n  \
                        echolume completions fish >~/.config/fish/completions/echolume.fish"
)]
pub struct Completions {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

impl Completions {
    /// Prints the completion script for `program` to standard output.
    pub fn run(&self, mut program: Command) -> Result<(), Failure> {
        let name = program.get_name().to_string();
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut program, name, &mut script);
        terminal::write(&script);
        Ok(())
    }
}

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  echolume man | man -l -\n  echolume man -o ~/.local/share/man/man1")]
pub struct ManPages {
    /// Write the page of every command into this folder (echolume.1, echolume-render.1, ...) [default: the page of the program, to
    /// standard output]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

impl ManPages {
    /// Writes the manual page of every command of `program` into the requested folder. Without a folder, prints the page of the program alone.
    pub fn run(&self, mut program: Command) -> Result<(), Failure> {
        program.build();
        let Some(folder) = &self.output else {
            terminal::write(&page(&program)?);
            return Ok(());
        };
        make_folder(folder)?;
        let count = write(&program, folder)?;
        say!("man pages: {}, {count} of them", folder.display());
        Ok(())
    }
}

/// The page of one command.
fn page(command: &Command) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    Man::new(command.clone()).render(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

/// Writes the page of a command, and of those below it. Returns their number.
fn write(command: &Command, folder: &Path) -> Result<usize, Failure> {
    let name = command.get_display_name().unwrap_or(command.get_name());
    files::replace_shared(&folder.join(format!("{name}.1")), &page(command)?).map_err(failed)?;
    let mut count = 1;
    for below in command.get_subcommands().filter(|below| !below.is_hide_set() && below.get_name() != "help") {
        count += write(below, folder)?;
    }
    Ok(count)
}
