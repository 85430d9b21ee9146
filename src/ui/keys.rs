//! Keys as they are pressed: the commands that they give.

use crate::command::Command;
use crate::input::{Input, Key, Modifiers};
use crate::texts::keys::{Binding, KEY_BINDINGS};
use Key::Char;

/// The binding of a key pressed with these modifiers; None if there is none.
pub(crate) fn binding(key: Key, modifiers: Modifiers) -> Option<&'static Binding> {
    // Whether a sign needs shift depends on the keyboard layout.
    let is_sign = matches!(key, Char(c) if !c.is_alphanumeric());
    let modifiers = Modifiers { shift: modifiers.shift && !is_sign, ..modifiers };
    KEY_BINDINGS.iter().find(|b| b.key == key && b.modifiers == modifiers)
}

/// The command of a key with these modifiers.
#[cfg(test)]
fn command(key: Key, modifiers: Modifiers) -> Option<Command> {
    binding(key, modifiers).map(|b| b.command)
}

/// The keys that are held down, so that a command that toggles something is not repeated.
#[derive(Clone, Debug, Default)]
pub(crate) struct HeldKeys {
    pub(crate) modifiers: Modifiers,
    held: Vec<Key>,
}

impl HeldKeys {
    pub(crate) fn is_held(&self, key: Key) -> bool {
        self.held.contains(&key)
    }

    /// The command that an input of the keyboard gives; None if it gives none.
    pub(crate) fn input(&mut self, input: &Input) -> Option<Command> {
        match *input {
            Input::Modifiers(modifiers) => self.modifiers = modifiers,
            Input::FocusLost => *self = HeldKeys::default(),
            Input::Key { key, pressed: false } => self.held.retain(|held| *held != key),
            Input::Key { key, pressed: true } => {
                let again = self.held.contains(&key);
                if !again {
                    self.held.push(key);
                }
                return binding(key, self.modifiers).filter(|b| b.repeats || !again).map(|b| b.command);
            }
            _ => {}
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Tool;
    use crate::scene::{Layout, Mode, PlaneName};
    use crate::texts::keys::{help, key_label};

    #[test]
    fn no_key_is_bound_twice() {
        for (i, a) in KEY_BINDINGS.iter().enumerate() {
            assert!(
                !KEY_BINDINGS[..i].iter().any(|b| (b.key, b.modifiers) == (a.key, a.modifiers)),
                "{}",
                key_label(a)
            );
            assert_eq!(command(a.key, a.modifiers), Some(a.command), "{} cannot be reached", key_label(a));
        }
    }

    /// Prevents files that someone writes who meant to type a text.
    #[test]
    fn no_letter_alone_writes_a_file() {
        let writes = [Command::SavePicture, Command::SaveLoop, Command::SaveMeasures, Command::SaveWorkspace];
        let bound: Vec<_> = KEY_BINDINGS.iter().filter(|b| writes.contains(&b.command)).collect();
        assert!(bound.len() >= 3 && bound.iter().all(|b| b.modifiers.control), "{bound:?}");
    }

    #[test]
    fn every_mode_layout_tool_and_plane_has_a_key() {
        use Mode::*;
        let modes = [Volume, Surface, Mixed, Mip, MinIp, Mean, Plane, Orthogonal, Tomography, Cube].map(Command::Mode);
        let tools = [
            Tool::Rotate,
            Tool::Light,
            Tool::Region,
            Tool::Clip,
            Tool::Cut,
            Tool::Brush,
            Tool::Plane,
            Tool::Curve,
            Tool::BodyMark,
            Tool::Labels,
        ]
        .map(Command::Tool);
        let layouts = [Layout::Single, Layout::Four, Layout::Beside, Layout::Pair].map(Command::Layout);
        let planes = [PlaneName::A, PlaneName::B, PlaneName::C].map(Command::Plane);
        for command in modes.iter().chain(&tools).chain(&layouts).chain(&planes) {
            assert!(KEY_BINDINGS.iter().any(|b| b.command == *command), "{command:?}");
        }
    }

    #[test]
    fn the_help_has_a_line_for_every_command() {
        let lines: Vec<_> = help().collect();
        assert!(lines.contains(&("H, F1".into(), "this help")));
        assert!(lines.contains(&("Shift+X".into(), "nothing cut from the front")));
        let mut descriptions: Vec<_> = lines.iter().map(|(_, description)| description).collect();
        descriptions.sort();
        assert!(descriptions.windows(2).all(|w| w[0] != w[1]), "the same description in two places");
    }

    #[test]
    fn a_held_key_repeats_only_if_its_binding_says_so() {
        let mut keys = HeldKeys::default();
        let mut press = |key, pressed| keys.input(&Input::Key { key, pressed });
        assert_eq!(press(Key::Space, true), Some(Command::Freeze));
        assert_eq!(press(Key::Space, true), None);
        assert_eq!(press(Key::Space, false), None);
        assert_eq!(press(Key::Space, true), Some(Command::Freeze));
        assert_eq!(press(Key::Right, true), Some(Command::StepCine(1)));
        assert_eq!(press(Key::Right, true), Some(Command::StepCine(1)));
        keys.input(&Input::Modifiers(Modifiers { shift: true, ..Modifiers::default() }));
        let sign = Input::Key { key: Char('+'), pressed: true };
        assert_eq!(keys.input(&sign), Some(Command::Zoom(1.1)));
    }
}
