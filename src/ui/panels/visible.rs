//! What the user chose to see: panels, lists and texts over the picture, each opened and closed by a command.

use super::rail::Rail;
use crate::command::Command;
use crate::input::{Key, Modifiers};

/// Longest text that the help is searched for, characters.
const MAX_SEARCH: usize = 40;

/// What is to be seen besides the picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Visible {
    /// Sliders and buttons.
    pub panels: bool,
    pub help: bool,
    /// What the help is searched for; none while it is not.
    pub search: Option<String>,
    /// The display of times.
    pub times: bool,
    /// The list of formats.
    pub exports: bool,
    pub rail: Rail,
}

impl Visible {
    /// Executes a command that opens or closes something; false if it is another one.
    pub(crate) fn apply(&mut self, command: &Command, has_drawer: bool) -> bool {
        match *command {
            Command::ToggleHelp => (self.help, self.search) = (!self.help, None),
            Command::SearchHelp => self.search = Some(String::new()),
            Command::ToggleTimes => self.times = !self.times,
            Command::Exports => self.exports = !self.exports,
            _ => return self.rail.apply(command, has_drawer),
        }
        true
    }

    /// True if something is open that the user may want to close.
    pub(crate) fn is_any_open(&self, has_drawer: bool) -> bool {
        self.help || self.times || self.exports || (self.rail.is_open && has_drawer)
    }

    /// Closes the list of formats. False if it is not open.
    pub(crate) fn close_exports(&mut self) -> bool {
        std::mem::take(&mut self.exports)
    }

    /// Ends the search of the help, or else closes the help. False if neither is open.
    pub(crate) fn close_help(&mut self) -> bool {
        self.search.take().is_some() || std::mem::take(&mut self.help)
    }

    /// Closes the display of times. False if it is not open.
    pub(crate) fn close_times(&mut self) -> bool {
        std::mem::take(&mut self.times)
    }

    /// Closes the drawer. False if it is not open, or the window has none.
    pub(crate) fn close_drawer(&mut self, has_drawer: bool) -> bool {
        has_drawer && std::mem::take(&mut self.rail.is_open)
    }

    /// Takes a key for the search of the help. True if it is none of the view's own.
    pub(crate) fn search(&mut self, key: Key, modifiers: Modifiers) -> bool {
        match (&mut self.search, key) {
            _ if !self.help => return false,
            (None, Key::Char('/')) => self.search = Some(String::new()),
            (Some(text), key) if !modifiers.control && !modifiers.alt => return edit(text, key),
            _ => return false,
        }
        true
    }
}

/// Takes a key for the text that the help is searched for. False if it is none of a text's.
fn edit(text: &mut String, key: Key) -> bool {
    let letter = match key {
        Key::Char(letter) => letter,
        Key::Space => ' ',
        Key::Backspace => {
            text.pop();
            return true;
        }
        _ => return false,
    };
    if text.chars().count() < MAX_SEARCH {
        text.push(letter);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a search that grows while a key is held, and one that takes the keys of the view.
    #[test]
    fn the_search_of_the_help_has_a_longest_text_and_begins_with_a_slash() {
        let (mut visible, plain) = (Visible::default(), Modifiers::default());
        assert!(!visible.search(Key::Char('/'), plain), "the help is not open");
        assert!(visible.apply(&Command::ToggleHelp, false) && !visible.search(Key::Char('a'), plain));
        assert!(visible.search(Key::Char('/'), plain));
        for key in [Key::Char('ä'), Key::Space, Key::Char('b')].into_iter().cycle().take(3 * MAX_SEARCH) {
            assert!(visible.search(key, plain));
        }
        assert!(!visible.search(Key::Char('s'), Modifiers { control: true, ..plain }));
        assert_eq!(visible.search.as_ref().map(|text| text.chars().count()), Some(MAX_SEARCH));
        (0..MAX_SEARCH + 1).for_each(|_| assert!(visible.search(Key::Backspace, plain)));
        assert!(visible.search.as_deref() == Some("") && !visible.search(Key::Escape, plain));
    }

    /// Prevents an Escape that closes two things, and a drawer that no window shows keeping it from the others.
    #[test]
    fn each_thing_closes_once_and_the_search_before_the_help() {
        let mut visible = Visible::default();
        assert!(!visible.is_any_open(true));
        for command in [Command::ToggleHelp, Command::SearchHelp, Command::ToggleTimes, Command::Exports] {
            assert!(visible.apply(&command, true) && visible.is_any_open(true), "{command:?}");
        }
        assert!(visible.apply(&Command::ToggleDrawer, true) && !visible.apply(&Command::Freeze, true));
        assert!(visible.close_exports() && !visible.close_exports());
        assert!(visible.close_help() && visible.help && visible.close_help() && !visible.close_help());
        assert!(visible.close_times() && !visible.close_times());
        assert!(!visible.is_any_open(false) && !visible.close_drawer(false));
        assert!(visible.close_drawer(true) && !visible.is_any_open(true) && !visible.close_drawer(true));
    }
}
