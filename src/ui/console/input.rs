//! Passes keys, pointers and fingers to the part of the console that they are for.

use super::Console;
use crate::command::Command;
use crate::input::{Input, Key, Modifiers};
use crate::keyboard_pointer::Pointed;
use crate::picking::Viewport;
use crate::scene::Scene;
use crate::texts::keys;
use std::time::Instant;

impl Console {
    /// Handles an input event.
    pub fn input(&mut self, input: &Input) {
        let now = Instant::now();
        // egui panics at coordinates that are not finite.
        let Some(input) = &input.sanitized() else { return };
        self.user_acts(now);
        if self.fixed.overlay {
            self.panels.input(input);
            self.presentation.redraw();
        }
        if let (Some(exit), Input::Key { key, pressed: true }) = (&self.fixed.exit, input)
            && exit.is(*key, self.hands.keys.modifiers)
        {
            self.request.exit = true;
        }
        self.hands.pointer.other_input(input);
        let typed = self.key_of_search(input).or_else(|| {
            let is_taken = self.key_of_panels(input) || self.key_of_pointer(input, now);
            if is_taken { Some(Vec::new()) } else { self.typed(input) }
        });
        if typed.is_some() {
            // The keys go on to be held, and give nothing else.
            self.hands.keys.input(input);
            typed.iter().flatten().for_each(|command| self.execute(command, now));
        } else if let Some(command) = self.hands.keys.input(input) {
            let command = if self.leaving.asks() { answer(input) } else { Some(command) };
            command.iter().for_each(|command| self.execute(command, now));
        }
        self.gesture(input, self.hands.keys.modifiers, now);
    }

    /// Executes what an input does on the picture.
    fn gesture(&mut self, input: &Input, modifiers: Modifiers, now: Instant) {
        let is_over_panel = self.hands.place(input).is_some_and(|at| self.panels.covers(at));
        let (mut hands, tool) = (std::mem::take(&mut self.hands), self.controls.tool());
        let commands = hands.gestures.input(input, &self.viewport(is_over_panel, now), tool, modifiers);
        self.hands = hands;
        commands.iter().for_each(|command| self.execute(command, now));
    }

    /// The picture as an input meets it.
    fn viewport(&self, is_over_panel: bool, now: Instant) -> Viewport<'_> {
        let (corner, size) = self.room().picture;
        // What is clicked is what is seen, also while the settings already ask for another picture.
        let scene = self.presentation.shown().map(|picture| &picture.scene);
        Viewport {
            corner: corner.map(f64::from),
            size: scene.map_or(size, Scene::picture_size).map(f64::from),
            scene,
            volume: self.presentation.shown().map(|picture| picture.volume),
            measures: self.controls.measures(),
            body_marks: self.controls.body_marks(),
            start_line: self.controls.start_line(),
            has_work: self.controls.work().is_some() || self.controls.line().is_some(),
            is_covered: self.leaving.asks() || (is_over_panel && self.fixed.overlay),
            now: now.saturating_duration_since(self.fixed.started),
        }
    }

    /// The command that sets the position of a text, when the user types a letter with the text tool.
    pub(super) fn place_of_text(&self) -> Option<Command> {
        let is_over_panel = self.hands.place(&Input::FocusLost).is_some_and(|at| self.panels.covers(at));
        self.hands.place_of_text(&self.viewport(is_over_panel, Instant::now()))
    }

    /// Turns moving the pointer by keys on or off. Without panels it stays off, because the pointer would be invisible.
    pub(super) fn toggle_keyboard_pointer(&mut self, now: Instant) {
        if !self.fixed.overlay {
            return;
        }
        let pointed = self.hands.toggle_pointer(self.room().picture);
        self.point(&pointed, now);
        self.notify(if self.hands.pointer.is_on { keys::POINTER_IS_ON } else { keys::POINTER_IS_OFF }, false);
    }

    /// Takes a key for the pointer by keyboard. True if it is none of the view's own.
    fn key_of_pointer(&mut self, input: &Input, now: Instant) -> bool {
        let Input::Key { key, pressed: true } = *input else { return false };
        if !self.hands.pointer.is_on || self.leaving.asks() || self.controls.typing().is_some() || self.shows_list() {
            return false;
        }
        let was_held = self.hands.pointer.is_held();
        if let Some(pointed) = self.hands.point(key, self.room().picture) {
            if self.hands.pointer.is_held() && !was_held {
                self.controls.seal();
            }
            self.point(&pointed, now);
            return true;
        }
        let modifiers = self.hands.keys.modifiers;
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
        self.presentation.redraw();
    }

    /// Takes a key for the search, or for a number that is typed: what it does, or none if it is another one's key.
    fn key_of_search(&mut self, input: &Input) -> Option<Vec<Command>> {
        let Input::Key { key, pressed: true } = *input else { return None };
        if self.leaving.asks() { None } else { self.visible.key(key, self.hands.keys.modifiers) }
    }

    /// Takes a key for the control that has the keyboard. True if it is none of the view's own.
    fn key_of_panels(&mut self, input: &Input) -> bool {
        let Input::Key { key, pressed: true } = *input else { return false };
        let (modifiers, shows_list) = (self.hands.keys.modifiers, self.shows_list());
        let has_keys_of_its_own = self.leaving.asks() || self.controls.typing().is_some() || self.opening.is_typing();
        if !self.fixed.overlay || has_keys_of_its_own || (shows_list && key == Key::Escape) {
            return false;
        }
        let walks = shows_list && !self.presets.is_naming();
        (walks && self.panels.walk(key, modifiers, self.presets.is_shown)) || self.panels.key(key, modifiers)
    }
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
