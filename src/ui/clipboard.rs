//! The clipboard of the desktop. A monitor without a desktop has none.

use arboard::Clipboard as Desktop;

/// The clipboard, connected with the first text. What was copied stays as long as this does.
#[derive(Default)]
pub(super) struct Clipboard {
    desktop: Option<Desktop>,
}

impl Clipboard {
    /// Puts a text on the clipboard.
    ///
    /// # Errors
    /// One line: there is no desktop, or its clipboard refuses.
    pub(super) fn copy(&mut self, text: String) -> Result<(), String> {
        let desktop = match &mut self.desktop {
            Some(desktop) => desktop,
            place => place.insert(Desktop::new().map_err(|e| e.to_string())?),
        };
        desktop.set_text(text).map_err(|e| e.to_string())
    }
}
