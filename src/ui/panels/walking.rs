//! Walking through a list by keys: arrows, Home, End, Page up and Page down move the keyboard focus between its entries, and Enter chooses the
//! focused one.

use crate::input::Key as InputKey;
use egui::{FocusDirection, Id, Key, Response, Ui};

/// Entries that Page up and Page down pass.
const PAGE: usize = 10;

/// The key of egui for a key that moves the focus through a list; None for other keys. In a grid, left and right do it, too.
pub(super) fn key(key: InputKey, is_grid: bool) -> Option<Key> {
    Some(match key {
        InputKey::Up => Key::ArrowUp,
        InputKey::Down => Key::ArrowDown,
        InputKey::Left if is_grid => Key::ArrowLeft,
        InputKey::Right if is_grid => Key::ArrowRight,
        InputKey::Home => Key::Home,
        InputKey::End => Key::End,
        InputKey::PageUp => Key::PageUp,
        InputKey::PageDown => Key::PageDown,
        _ => return None,
    })
}

/// A list in this layout through which keys can move the focus.
pub(super) struct Walk {
    id: Id,
    /// The entry that gets the keyboard focus now.
    wanted: Option<usize>,
}

impl Walk {
    /// Call it before the entries are shown. `count`: number of entries; `columns`: number of entries side by side.
    pub(super) fn new(ui: &Ui, title: &str, count: usize, columns: usize) -> Walk {
        let id = Id::new(("walk", title));
        // Where the keyboard was in the layout before; an entry that still has it says so again.
        let at = ui.data_mut(|data| data.remove_temp::<usize>(id));
        let wanted = ui.input(|input| {
            let pressed = |key| input.key_pressed(key);
            let last = count.checked_sub(1)?;
            let step = |back: bool, by: usize| match at {
                None if back => last,
                None => 0,
                Some(at) if back => at.saturating_sub(by),
                Some(at) => (at + by).min(last),
            };
            Some(match () {
                () if pressed(Key::ArrowDown) => step(false, columns),
                () if pressed(Key::ArrowUp) => step(true, columns),
                () if columns > 1 && pressed(Key::ArrowRight) => step(false, 1),
                () if columns > 1 && pressed(Key::ArrowLeft) => step(true, 1),
                () if pressed(Key::PageDown) => step(false, PAGE),
                () if pressed(Key::PageUp) => step(true, PAGE),
                () if pressed(Key::Home) => 0,
                () if pressed(Key::End) => last,
                () => return None,
            })
        });
        Walk { id, wanted }
    }

    /// Call it after the n-th entry was shown.
    pub(super) fn entry(&self, n: usize, entry: &Response) {
        if self.wanted == Some(n) {
            entry.request_focus();
            entry.scroll_to_me(None);
            // egui would go on from there to what lies in the direction of the arrow.
            entry.ctx.memory_mut(|memory| memory.move_focus(FocusDirection::None));
        }
        if entry.has_focus() {
            entry.ctx.data_mut(|data| data.insert_temp(self.id, n));
        }
    }
}
