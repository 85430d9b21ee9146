//! What is shown besides the picture: panels, lists and texts, each opened and closed by a command; and what is typed into them.

use super::Room;
use super::inspector::Inspector;
use crate::command::Command;
use crate::input::{Key, Modifiers};
use crate::palette;

/// Longest text that is searched for, and longest number, characters.
const MAX_SEARCH: usize = 40;
const MAX_NUMBER: usize = 10;

/// The search of all commands and controls: its text and the selected result.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Search {
    pub text: String,
    /// The index of the selected result of the search.
    pub chosen: usize,
}

/// Which panels are shown besides the picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Visible {
    /// True if bars and inspector are shown.
    pub panels: bool,
    pub help: bool,
    pub search: Option<Search>,
    /// True if the display of times is shown.
    pub times: bool,
    /// True if the list of export formats is shown.
    pub exports: bool,
    pub inspector: Inspector,
    /// The index of the slider whose value is being typed, and the typed text; None if none is.
    pub value: Option<(usize, String)>,
}

impl Visible {
    /// Executes a command that opens or closes something; returns false for other commands.
    pub(crate) fn apply(&mut self, command: &Command, room: &Room) -> bool {
        match *command {
            Command::ToggleHelp => self.help = !self.help,
            Command::Find => {
                self.search = if self.search.is_some() { None } else { Some(Search::default()) };
                self.value = None;
            }
            Command::ToggleTimes => self.times = !self.times,
            Command::Exports => self.exports = !self.exports,
            Command::TypeValue(number) => self.value = Some((number, String::new())),
            _ => return self.inspector.apply(command, room),
        }
        true
    }

    /// True if something is open that the user can close.
    pub(crate) fn is_any_open(&self, room: &Room) -> bool {
        self.help || self.times || self.exports || self.search.is_some() || self.inspector.is_drawn_over(room)
    }

    /// Closes the list of export formats. Returns false if it is not shown.
    pub(crate) fn close_exports(&mut self) -> bool {
        std::mem::take(&mut self.exports)
    }

    /// Closes the first of these that is open: a value being typed, the search, the help. Returns false if none is.
    pub(crate) fn close_help(&mut self) -> bool {
        self.value.take().is_some() || self.search.take().is_some() || std::mem::take(&mut self.help)
    }

    /// Closes the display of times. Returns false if it is not shown.
    pub(crate) fn close_times(&mut self) -> bool {
        std::mem::take(&mut self.times)
    }

    /// Closes the inspector if it is an open drawer. Returns false if it is not.
    pub(crate) fn close_drawer(&mut self, room: &Room) -> bool {
        let is_open = self.inspector.is_drawn_over(room);
        self.inspector.is_open &= !is_open;
        is_open
    }

    /// The commands of a key that belongs to a value being typed or to the search; None if it belongs to something else.
    pub(crate) fn key(&mut self, key: Key, modifiers: Modifiers) -> Option<Vec<Command>> {
        if modifiers.control || modifiers.alt {
            return None;
        }
        if let Some((number, text)) = &mut self.value {
            match key {
                Key::Char(letter) if letter.is_ascii_digit() || "+-.,".contains(letter) => {
                    if text.chars().count() < MAX_NUMBER {
                        text.push(if letter == ',' { '.' } else { letter });
                    }
                }
                Key::Backspace => _ = text.pop(),
                Key::Enter => {
                    let typed = text.parse::<f64>().ok().filter(|value| value.is_finite());
                    let number = *number;
                    self.value = None;
                    return Some(typed.map(|value| Command::SetShown(number, value)).into_iter().collect());
                }
                _ => return None,
            }
            return Some(Vec::new());
        }
        let search = self.search.as_mut()?;
        let last = || palette::found(&search.text).len().saturating_sub(1);
        match key {
            Key::Down => search.chosen = (search.chosen + 1).min(last()),
            Key::Up => search.chosen = search.chosen.saturating_sub(1),
            Key::Enter => {
                let command = palette::found(&search.text).get(search.chosen).map(|entry| entry.command);
                self.search = None;
                return Some(command.into_iter().collect());
            }
            Key::Char(letter) => search.push(letter),
            Key::Space => search.push(' '),
            Key::Backspace => {
                _ = search.text.pop();
                search.chosen = 0;
            }
            _ => return None,
        }
        Some(Vec::new())
    }
}

impl Search {
    fn push(&mut self, letter: char) {
        if self.text.chars().count() < MAX_SEARCH {
            self.text.push(letter);
        }
        self.chosen = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::InspectorTab;

    const PLAIN: Modifiers = Modifiers { shift: false, control: false, alt: false };

    /// A window in which the inspector is a drawer.
    fn small() -> Room {
        Room::of([640, 480], 1.0, true)
    }

    /// Prevents a search that grows while a key is held, and one that takes keys with Ctrl.
    #[test]
    fn the_search_has_a_longest_text_and_enter_gives_the_chosen_command() {
        let mut visible = Visible::default();
        assert_eq!(visible.key(Key::Char('a'), PLAIN), None, "the search is not open");
        assert!(visible.apply(&Command::Find, &small()));
        for key in [Key::Char('ä'), Key::Space, Key::Char('b')].into_iter().cycle().take(3 * MAX_SEARCH) {
            assert_eq!(visible.key(key, PLAIN), Some(vec![]));
        }
        assert_eq!(visible.key(Key::Char('s'), Modifiers { control: true, ..PLAIN }), None);
        assert_eq!(visible.search.as_ref().map(|search| search.text.chars().count()), Some(MAX_SEARCH));
        (0..MAX_SEARCH + 1).for_each(|_| assert_eq!(visible.key(Key::Backspace, PLAIN), Some(vec![])));
        "three planes".chars().for_each(|letter| _ = visible.key(Key::Char(letter), PLAIN));
        let found = palette::found("three planes");
        assert!(found.len() > 1);
        for key in [Key::Down, Key::Up, Key::Up, Key::Down] {
            assert_eq!(visible.key(key, PLAIN), Some(vec![]));
        }
        assert_eq!(visible.key(Key::Enter, PLAIN), Some(vec![found[1].command]));
        assert!(visible.search.is_none());
        visible.apply(&Command::Find, &small());
        "no such thing".chars().for_each(|letter| _ = visible.key(Key::Char(letter), PLAIN));
        assert_eq!(visible.key(Key::Down, PLAIN), Some(vec![]));
        assert_eq!(visible.key(Key::Enter, PLAIN), Some(vec![]), "nothing is found, and nothing happens");
    }

    #[test]
    fn a_number_is_typed_for_a_slider() {
        let mut visible = Visible::default();
        let mut typed = |text: &str| {
            visible.apply(&Command::TypeValue(4), &small());
            text.chars().for_each(|letter| _ = visible.key(Key::Char(letter), PLAIN));
            let commands = visible.key(Key::Enter, PLAIN);
            assert!(visible.value.is_none());
            commands
        };
        assert_eq!(typed("-1,25"), Some(vec![Command::SetShown(4, -1.25)]));
        assert_eq!(typed("31"), Some(vec![Command::SetShown(4, 31.0)]));
        for wrong in ["", "-", "1.2.3", "12345678901234567890"] {
            let commands = typed(wrong).expect("its key");
            assert!(commands.iter().all(|command| *command == Command::SetShown(4, 1_234_567_890.0)), "{wrong}");
            assert_eq!(commands.is_empty(), wrong.len() < 9, "{wrong}");
        }
        visible.apply(&Command::TypeValue(4), &small());
        assert_eq!(visible.key(Key::Char('x'), PLAIN), None, "no letter of a number");
        assert!(visible.close_help() && visible.value.is_none());
    }

    /// Prevents an Escape that closes two things, and a drawer that no window shows keeping it from the others.
    #[test]
    fn each_thing_closes_once_and_the_search_before_the_help() {
        let (mut visible, small, large) = (Visible::default(), small(), Room::of([1920, 1080], 1.0, true));
        assert!(!visible.is_any_open(&small));
        for command in [Command::ToggleHelp, Command::Find, Command::ToggleTimes, Command::Exports] {
            assert!(visible.apply(&command, &small) && visible.is_any_open(&small), "{command:?}");
        }
        assert!(visible.apply(&Command::InspectorTab(InspectorTab::Planes), &small));
        assert!(visible.inspector.is_open && !visible.apply(&Command::Freeze, &small));
        assert!(visible.close_exports() && !visible.close_exports());
        assert!(visible.close_help() && visible.help && visible.close_help() && !visible.close_help());
        assert!(visible.close_times() && !visible.close_times());
        assert!(!visible.is_any_open(&large) && !visible.close_drawer(&large));
        assert!(visible.close_drawer(&small) && !visible.is_any_open(&small) && !visible.close_drawer(&small));
    }
}
