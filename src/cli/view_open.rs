//! What `echolume view` shows: the source of its flags, or one of the recordings and workspaces that it was given or that were opened in the window.

use crate::args::SourceArgs;
use crate::files::InputError;
use crate::scene::load::Layers;
use crate::source::live::Live;
use crate::terminal::{Failure, input};
use crate::ui::console::Opened;
use crate::ui::recordings::OpenRecordings;
use crate::workspace::{self, Workspace};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard};

/// A source, and the settings of the workspace that named it.
#[derive(Clone)]
pub struct Shown {
    pub source: SourceArgs,
    pub workspace: Option<Layers>,
    /// It was given with the flags, which are about it too.
    pub is_given: bool,
}

impl Shown {
    /// What flags ask for. `file`: a recording or a workspace in place of their source.
    pub fn of(source: &SourceArgs, file: Option<&Path>) -> Result<Shown, Failure> {
        let named = file.unwrap_or(source.path());
        if workspace::is_named(named) {
            let workspace = Workspace::read(named).map_err(input)?;
            let source = source.of_workspace(named, &workspace)?;
            return Ok(Shown { source, workspace: Some(workspace.layers), is_given: true });
        }
        let source = file.map_or_else(|| source.clone(), |file| source.at_file(file));
        Ok(Shown { source, workspace: None, is_given: true })
    }

    /// A file that was opened in the window. The geometry of the flags is that of their own recordings.
    pub fn opened(flags: &SourceArgs, file: &Path) -> Result<Shown, Failure> {
        Ok(Shown { is_given: false, ..Shown::of(&flags.of_file(file), None)? })
    }
}

/// Refuses a file that is shown later and is not there. A pattern of names is looked at when it is opened.
pub fn check_later(file: &Path) -> Result<(), Failure> {
    let is_pattern = file.to_string_lossy().contains(['*', '?']);
    match std::fs::metadata(file) {
        Err(e) if !is_pattern => Err(input(InputError::unreadable(file, &e))),
        _ => Ok(()),
    }
}

/// What was opened in the window, and what else is open there.
#[derive(Default)]
pub struct OpenedInWindow {
    current: Arc<Current>,
    pub recordings: OpenRecordings,
}

#[derive(Default)]
struct Current {
    /// None: what the program was started with.
    shown: Mutex<Option<Shown>>,
    /// Its source, until the console takes it.
    source: Mutex<Option<Box<dyn Live>>>,
}

pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}

impl OpenedInWindow {
    /// What makes the next console show this. `shown`: none for what the program was started with.
    pub fn next(&self, shown: Option<Shown>, source: Box<dyn Live>) -> Opened {
        let current = self.current.clone();
        Box::new(move || (*locked(&current.source), *locked(&current.shown)) = (Some(source), shown))
    }

    pub fn is_some(&self) -> bool {
        locked(&self.current.shown).is_some()
    }

    /// What was opened last.
    pub fn shown(&self) -> Option<Shown> {
        locked(&self.current.shown).clone()
    }

    /// The source of what was opened last, once.
    pub fn take_source(&self) -> Option<Box<dyn Live>> {
        locked(&self.current.source).take()
    }
}
