//! The source of `echolume view`: that of its flags, or one of the recordings and workspaces that were given as arguments or opened in the
//! window.

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
    /// True if it was given with the flags, which then apply to it.
    pub is_given: bool,
}

impl Shown {
    /// The source that the flags select. `file`: a recording or a workspace that replaces it.
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

    /// The source of a file that was opened in the window. The geometry flags do not apply to it.
    pub fn opened(flags: &SourceArgs, file: &Path) -> Result<Shown, Failure> {
        Ok(Shown { is_given: false, ..Shown::of(&flags.of_file(file), None)? })
    }
}

/// Refuses a missing file that would be shown later. A pattern of names is checked only when it is opened.
pub fn check_later(file: &Path) -> Result<(), Failure> {
    let is_pattern = file.to_string_lossy().contains(['*', '?']);
    match std::fs::metadata(file) {
        Err(e) if !is_pattern => Err(input(InputError::unreadable(file, &e))),
        _ => Ok(()),
    }
}

/// The source that was opened last in the window, and the list of open ones.
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
    /// Prepares the next console to show this source. `shown`: None for the source that the program was started with.
    pub fn next(&self, shown: Option<Shown>, source: Box<dyn Live>) -> Opened {
        let current = self.current.clone();
        Box::new(move || (*locked(&current.source), *locked(&current.shown)) = (Some(source), shown))
    }

    pub fn is_some(&self) -> bool {
        locked(&self.current.shown).is_some()
    }

    /// The source that was opened last.
    pub fn shown(&self) -> Option<Shown> {
        locked(&self.current.shown).clone()
    }

    /// Takes the open source of what was opened last. It is there only once.
    pub fn take_source(&self) -> Option<Box<dyn Live>> {
        locked(&self.current.source).take()
    }
}
