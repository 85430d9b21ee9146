//! The clipboard of the desktop. There is none on a monitor without a desktop.

use arboard::Clipboard as Desktop;

/// The desktop's clipboard. The connection is made with the first text; a copied text is available as long as this value exists.
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
