//! The source of `echolume view`: that of its flags, or one of the recordings and workspaces that were given as arguments or opened in the
//! window.

use crate::args::SourceArgs;
use crate::files::InputError;
use crate::scene::load::Layers;
use crate::source::live::Live;
use crate::sync::locked;
use crate::terminal::{Failure, input};
use crate::ui::console::Opened;
use crate::ui::recordings::OpenRecordings;
use crate::workspace::{self, Workspace};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// A source that the viewer shows, and the settings of the workspace that named it, if there was one.
#[derive(Clone)]
pub struct Shown {
    pub source: SourceArgs,
    pub workspace: Option<Layers>,
    /// Path of the segmentation that the workspace names; None if there is none.
    pub labels: Option<PathBuf>,
    /// True if the source was given on the command line, so that its flags apply.
    pub is_given: bool,
}

impl Shown {
    /// The source that the command line selects: `file`, a recording or a workspace, or without it that of the flags in `source`. An error if a
    /// workspace cannot be read, names no recording, or has a depth axis that is not valid.
    pub fn of(source: &SourceArgs, file: Option<&Path>) -> Result<Shown, Failure> {
        let named = file.unwrap_or(source.path());
        if workspace::is_named(named) {
            let workspace = Workspace::read(named).map_err(input)?;
            let source = source.of_workspace(named, &workspace)?;
            let labels = workspace.origin.labels;
            return Ok(Shown { source, workspace: Some(workspace.layers), labels, is_given: true });
        }
        let source = file.map_or_else(|| source.clone(), |file| source.at_file(file));
        Ok(Shown { source, workspace: None, labels: None, is_given: true })
    }

    /// The source for a recording or a workspace that was opened in the window. The flags of geometry and of freehand volumes do not apply to it. An
    /// error as of [`Shown::of`].
    pub fn opened(flags: &SourceArgs, file: &Path) -> Result<Shown, Failure> {
        Ok(Shown { is_given: false, ..Shown::of(&flags.of_file(file), None)? })
    }
}

/// Checks that a file that is to be shown later exists. A pattern of names is checked only when it is opened.
pub fn check_later(file: &Path) -> Result<(), Failure> {
    let is_pattern = file.to_string_lossy().contains(['*', '?']);
    match std::fs::metadata(file) {
        Err(e) if !is_pattern => Err(input(InputError::unreadable(file, &e))),
        _ => Ok(()),
    }
}

/// The source that was opened last in the window, and the list of open recordings.
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

impl OpenedInWindow {
    /// Returns a function that, when it is called, makes the next console show this source. `shown`: how it was selected; None for the source with
    /// which the program was started.
    pub fn next(&self, shown: Option<Shown>, source: Box<dyn Live>) -> Opened {
        let current = self.current.clone();
        Box::new(move || (*locked(&current.source), *locked(&current.shown)) = (Some(source), shown))
    }

    pub fn is_some(&self) -> bool {
        locked(&self.current.shown).is_some()
    }

    /// How the source was selected that was opened last in the window. None if none was, or if [`OpenedInWindow::next`] got None for it.
    pub fn shown(&self) -> Option<Shown> {
        locked(&self.current.shown).clone()
    }

    /// Takes the open source that was opened last in the window. None if it was taken before or none was opened.
    pub fn take_source(&self) -> Option<Box<dyn Live>> {
        locked(&self.current.source).take()
    }
}
