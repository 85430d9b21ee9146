//! What `echolume view` shows: the source of its flags, or a recording or workspace that was opened in the window.

use crate::args::SourceArgs;
use crate::scene::load::Layers;
use crate::source::live::Live;
use crate::terminal::{Failure, input};
use crate::workspace::{self, Workspace};
use std::path::Path;
use std::sync::{Mutex, MutexGuard};

/// A source, and the settings of the workspace that named it.
#[derive(Clone)]
pub struct Shown {
    pub source: SourceArgs,
    pub workspace: Option<Layers>,
}

impl Shown {
    /// What flags ask for. `file`: a recording or a workspace in place of their source.
    pub fn of(source: &SourceArgs, file: Option<&Path>) -> Result<Shown, Failure> {
        let named = file.unwrap_or(source.path());
        if workspace::is_named(named) {
            let workspace = Workspace::read(named).map_err(input)?;
            let source = source.of_workspace(named, &workspace)?;
            return Ok(Shown { source, workspace: Some(workspace.layers) });
        }
        Ok(Shown { source: file.map_or_else(|| source.clone(), |file| source.at_file(file)), workspace: None })
    }
}

/// What was opened in the window.
#[derive(Default)]
pub struct Opened {
    shown: Mutex<Option<Shown>>,
    /// Its source, until the console takes it.
    source: Mutex<Option<Box<dyn Live>>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}

impl Opened {
    /// Opens a recording or a workspace. What was shown before stays if it cannot be opened.
    pub fn open(&self, flags: &SourceArgs, file: &Path) -> Result<(), Failure> {
        // The geometry of the flags is that of their own recording.
        let shown = Shown::of(&flags.of_file(file), None)?;
        let source = shown.source.open()?;
        (*locked(&self.source), *locked(&self.shown)) = (Some(source), Some(shown));
        Ok(())
    }

    pub fn is_some(&self) -> bool {
        locked(&self.shown).is_some()
    }

    /// What was opened last.
    pub fn shown(&self) -> Option<Shown> {
        locked(&self.shown).clone()
    }

    /// The source of what was opened last, once.
    pub fn take_source(&self) -> Option<Box<dyn Live>> {
        locked(&self.source).take()
    }
}
