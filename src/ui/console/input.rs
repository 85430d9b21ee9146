//! Input of the user: whom keys, pointers and fingers are for.

use super::Console;
use crate::ui::command::Command;
use crate::ui::input::{Input, Key};
use crate::ui::picking::Viewport;
use std::time::Instant;

/// Longest text that the help is searched for, characters.
const MAX_SEARCH: usize = 40;

impl Console {
    /// Handles an input.
    pub fn input(&mut self, input: &Input) {
        let now = Instant::now();
        // egui panics at coordinates that are not finite.
        let Some(input) = &input.sanitized() else { return };
        self.user_acts(now);
        if self.fixed.overlay {
            self.panels.input(input);
            self.needs_redraw = true;
        }
        if let (Some(exit), Input::Key { key, pressed: true }) = (&self.fixed.exit, input)
            && exit.is(*key, self.keys.modifiers())
        {
            self.request.exit = true;
        }
        let is_search = self.search_help(input);
        let is_of_panels = self.key_of_panels(input);
        let typed = if is_of_panels { Some(Vec::new()) } else { self.typed(input) };
        if typed.is_some() {
            // The keys go on to be held, and give nothing else.
            self.keys.input(input);
            typed.iter().flatten().for_each(|command| self.execute(command, now));
        } else if let Some(command) = self.keys.input(input).filter(|_| !is_search) {
            let command = if self.asks_to_leave { answer(input) } else { Some(command) };
            command.iter().for_each(|command| self.execute(command, now));
        }
        let area = self.picture_area();
        let at = match input {
            Input::Moved(at) | Input::Touch { at, .. } => Some(*at),
            _ => None,
        };
        let measures = self.controls.measures().to_vec();
        let body_marks = self.controls.body_marks().to_vec();
        let start_line = self.controls.start_line().to_vec();
        let is_over_panel = at.or(self.gestures.pointer()).is_some_and(|at| self.panels.covers(at));
        let on = Viewport {
            corner: area.0.map(f64::from),
            size: area.1.map(f64::from),
            scene: self.stream.scene(),
            measures: &measures,
            body_marks: &body_marks,
            start_line: &start_line,
            has_work: self.controls.work().is_some() || self.controls.line().is_some(),
            is_covered: self.asks_to_leave || (is_over_panel && self.fixed.overlay),
            now: now.saturating_duration_since(self.started),
        };
        for command in self.gestures.input(input, &on, self.controls.tool(), self.keys.modifiers()) {
            self.execute(&command, now);
        }
    }

    /// Takes a key for the control that has the keyboard. True if it is none of the view's own.
    fn key_of_panels(&mut self, input: &Input) -> bool {
        let Input::Key { key, pressed: true } = *input else { return false };
        let has_keys_of_its_own = self.asks_to_leave || self.controls.typing().is_some();
        self.fixed.overlay && !has_keys_of_its_own && self.panels.key(key, self.keys.modifiers())
    }

    /// Takes a key for the search of the help. True if it is none of the view's own.
    fn search_help(&mut self, input: &Input) -> bool {
        let (true, Input::Key { key, pressed: true }) = (self.shows_help && !self.asks_to_leave, input) else {
            return false;
        };
        let modifiers = self.keys.modifiers();
        match (&mut self.help_search, key) {
            (None, Key::Char('/')) => self.help_search = Some(String::new()),
            (Some(text), key) if !modifiers.control && !modifiers.alt => return edit_search(text, *key),
            _ => return false,
        }
        true
    }
}

/// Takes a key for the text that the help is searched for. False if it is none of a text's.
fn edit_search(text: &mut String, key: Key) -> bool {
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

/// The command of a key while the console asks whether to save the loop before it leaves.
fn answer(input: &Input) -> Option<Command> {
    match input {
        Input::Key { key: Key::Enter, .. } => Some(Command::SaveAndExit),
        Input::Key { key: Key::Char('l'), .. } => Some(Command::Discard),
        Input::Key { key: Key::Escape, .. } => Some(Command::Back),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a search that grows while a key is held.
    #[test]
    fn the_search_of_the_help_has_a_longest_text() {
        let mut text = String::new();
        for key in [Key::Char('ä'), Key::Space, Key::Char('b')].into_iter().cycle().take(3 * MAX_SEARCH) {
            assert!(edit_search(&mut text, key));
        }
        assert_eq!(text.chars().count(), MAX_SEARCH);
        (0..MAX_SEARCH + 1).for_each(|_| assert!(edit_search(&mut text, Key::Backspace)));
        assert!(text.is_empty() && !edit_search(&mut text, Key::Escape));
    }
}
