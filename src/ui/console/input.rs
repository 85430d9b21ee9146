//! Input of the user: whom keys, pointers and fingers are for.

use super::Console;
use crate::command::Command;
use crate::input::{Input, Key, Modifiers};
use crate::keyboard_pointer::Pointed;
use crate::picking::Viewport;
use crate::texts::keys;
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
        self.keyboard_pointer.other_input(input);
        let is_search = self.search_help(input);
        let is_of_panels = self.key_of_panels(input);
        let is_taken = is_of_panels || (!is_search && self.key_of_pointer(input, now));
        let typed = if is_taken { Some(Vec::new()) } else { self.typed(input) };
        if typed.is_some() {
            // The keys go on to be held, and give nothing else.
            self.keys.input(input);
            typed.iter().flatten().for_each(|command| self.execute(command, now));
        } else if let Some(command) = self.keys.input(input).filter(|_| !is_search) {
            let command = if self.asks_to_leave { answer(input) } else { Some(command) };
            command.iter().for_each(|command| self.execute(command, now));
        }
        self.gesture(input, self.keys.modifiers(), now);
    }

    /// Executes what an input does on the picture.
    fn gesture(&mut self, input: &Input, modifiers: Modifiers, now: Instant) {
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
        for command in self.gestures.input(input, &on, self.controls.tool(), modifiers) {
            self.execute(&command, now);
        }
    }

    /// Turns the pointer by keyboard on or off. Without panels nobody would see it.
    pub(super) fn toggle_keyboard_pointer(&mut self, now: Instant) {
        if !self.fixed.overlay {
            return;
        }
        let pointed = self.keyboard_pointer.toggle(self.gestures.pointer(), self.picture_area());
        self.point(&pointed, now);
        let is_on = self.keyboard_pointer.is_on();
        self.notify(if is_on { keys::POINTER_IS_ON } else { keys::POINTER_IS_OFF }, false);
    }

    /// Takes a key for the pointer by keyboard. True if it is none of the view's own.
    fn key_of_pointer(&mut self, input: &Input, now: Instant) -> bool {
        let Input::Key { key, pressed: true } = *input else { return false };
        if !self.keyboard_pointer.is_on() || self.asks_to_leave || self.controls.typing().is_some() || self.shows_list()
        {
            return false;
        }
        let was_held = self.keyboard_pointer.is_held();
        if let Some(pointed) = self.keyboard_pointer.key(key, &self.keys, self.picture_area()) {
            if self.keyboard_pointer.is_held() && !was_held {
                self.controls.seal();
            }
            self.point(&pointed, now);
            return true;
        }
        let modifiers = self.keys.modifiers();
        let ends = modifiers == Modifiers { control: true, ..Modifiers::default() } && key == Key::Enter;
        let command = self.what_enter_ends().filter(|_| ends);
        command.iter().for_each(|command| self.execute(command, now));
        command.is_some()
    }

    /// Does what the pointer by keyboard does, as if a mouse did it.
    fn point(&mut self, pointed: &[Pointed], now: Instant) {
        for (input, modifiers) in pointed {
            self.panels.input(input);
            self.gesture(input, *modifiers, now);
        }
        self.needs_redraw = true;
    }

    /// Takes a key for the control that has the keyboard. True if it is none of the view's own.
    fn key_of_panels(&mut self, input: &Input) -> bool {
        let Input::Key { key, pressed: true } = *input else { return false };
        let (modifiers, shows_list) = (self.keys.modifiers(), self.shows_list());
        let has_keys_of_its_own = self.asks_to_leave || self.controls.typing().is_some();
        if !self.fixed.overlay || has_keys_of_its_own || (shows_list && key == Key::Escape) {
            return false;
        }
        let walks = shows_list && !self.presets.is_naming();
        (walks && self.panels.walk(key, modifiers, self.presets.is_shown())) || self.panels.key(key, modifiers)
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
