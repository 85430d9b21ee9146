//! What every key does, and the words for it.

use super::command::{Command, Tool};
use super::input::{Input, Key, Modifiers};
use super::sliders::{GAIN, THRESHOLD};
use crate::scene::{ColourMap, Layout, Mode, PlaneName, TransferName};
use Key::{Char, Function};

/// A key and what it asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binding {
    pub key: Key,
    pub modifiers: Modifiers,
    pub words: &'static str,
    pub what: Command,
    /// Does it again and again while the key is held.
    pub repeats: bool,
}

const NONE: Modifiers = Modifiers { shift: false, control: false, alt: false };
const SHIFT: Modifiers = Modifiers { shift: true, ..NONE };

const fn on(key: Key, words: &'static str, what: Command) -> Binding {
    Binding { key, modifiers: NONE, words, what, repeats: false }
}

/// With shift.
const fn shift(key: Key, words: &'static str, what: Command) -> Binding {
    Binding { modifiers: SHIFT, ..on(key, words, what) }
}

impl Binding {
    const fn held(self) -> Binding {
        Binding { repeats: true, ..self }
    }
}

/// Far beyond any volume, mm.
const ALL: f64 = 1e5;

/// All keys, those together that belong together. Several with the same words one after another are one line of the help.
pub const KEYS: &[Binding] = &[
    on(Char('1'), "surface", Command::Mode(Mode::Surface)),
    on(Char('2'), "volume", Command::Mode(Mode::Volume)),
    on(Char('3'), "surface behind a veil", Command::Mode(Mode::Mixed)),
    on(Char('4'), "largest echoes (MIP)", Command::Mode(Mode::Mip)),
    on(Char('5'), "smallest echoes (MinIP)", Command::Mode(Mode::MinIp)),
    on(Char('6'), "X-ray", Command::Mode(Mode::Mean)),
    on(Char('7'), "one plane", Command::Mode(Mode::Plane)),
    on(Char('8'), "three planes", Command::Mode(Mode::Orthogonal)),
    on(Char('9'), "tomography", Command::Mode(Mode::Tomography)),
    on(Char('0'), "block", Command::Mode(Mode::Cube)),
    on(Key::Tab, "three planes and the rendering", Command::Layout(Layout::Four)),
    on(Function(4), "three planes and the rendering", Command::Layout(Layout::Four)),
    shift(Key::Tab, "one picture", Command::Layout(Layout::Single)),
    shift(Function(4), "one picture", Command::Layout(Layout::Single)),
    // What a drag does.
    on(Char('t'), "drag turns", Command::Tool(Tool::Turn)),
    on(Char('l'), "drag moves the light", Command::Tool(Tool::Light)),
    on(Char('g'), "drag moves the region's faces", Command::Tool(Tool::Region)),
    on(Char('x'), "drag cuts from the front", Command::Tool(Tool::Clip)),
    on(Char('s'), "drag moves the planes (sections)", Command::Tool(Tool::Plane)),
    shift(Char('x'), "nothing cut from the front", Command::Clip(-ALL)),
    // The view.
    shift(Key::Left, "turn", Command::Turn([-5.0, 0.0])).held(),
    shift(Key::Right, "turn", Command::Turn([5.0, 0.0])).held(),
    shift(Key::Up, "turn", Command::Turn([0.0, 5.0])).held(),
    shift(Key::Down, "turn", Command::Turn([0.0, -5.0])).held(),
    on(Char(','), "roll", Command::Roll(-5.0)).held(),
    on(Char('.'), "roll", Command::Roll(5.0)).held(),
    on(Char('+'), "closer", Command::Zoom(1.1)).held(),
    on(Char('='), "closer", Command::Zoom(1.1)).held(),
    on(Char('-'), "farther", Command::Zoom(1.0 / 1.1)).held(),
    on(Key::Backspace, "all as at the start", Command::Reset),
    // Planes.
    on(Char('a'), "plane A: as the probe sees", Command::Plane(PlaneName::A)),
    on(Char('b'), "plane B: across the frames", Command::Plane(PlaneName::B)),
    on(Char('c'), "plane C: at one depth", Command::Plane(PlaneName::C)),
    on(Key::PageUp, "plane by 1 mm", Command::PlaneBy(-1.0)).held(),
    on(Key::PageDown, "plane by 1 mm", Command::PlaneBy(1.0)).held(),
    shift(Key::PageUp, "plane by 5 mm", Command::PlaneBy(-5.0)).held(),
    shift(Key::PageDown, "plane by 5 mm", Command::PlaneBy(5.0)).held(),
    // The look.
    on(Key::Up, "threshold", Command::Nudge(THRESHOLD, 1)).held(),
    on(Key::Down, "threshold", Command::Nudge(THRESHOLD, -1)).held(),
    on(Char('['), "gain", Command::Nudge(GAIN, -1)).held(),
    on(Char(']'), "gain", Command::Nudge(GAIN, 1)).held(),
    on(Char('d'), "shadow (darker)", Command::Shadow(true)),
    shift(Char('d'), "no shadow", Command::Shadow(false)),
    on(Function(5), "volume in grey", Command::Transfer(TransferName::Grey)),
    on(Function(6), "volume in sepia", Command::Transfer(TransferName::Sepia)),
    on(Function(7), "volume as skin", Command::Transfer(TransferName::Skin)),
    on(Function(8), "volume as bone", Command::Transfer(TransferName::Bone)),
    on(Function(9), "volume in blue", Command::Transfer(TransferName::Cool)),
    on(Function(10), "volume in red", Command::Transfer(TransferName::Warm)),
    shift(Function(5), "picture in grey", Command::ColourMap(ColourMap::Grey)),
    shift(Function(6), "picture in sepia", Command::ColourMap(ColourMap::Sepia)),
    shift(Function(7), "picture as skin", Command::ColourMap(ColourMap::Skin)),
    shift(Function(8), "picture in ice", Command::ColourMap(ColourMap::Ice)),
    shift(Function(9), "picture in its own colours", Command::ColourMap(ColourMap::None)),
    // Time. The caller knows how many volumes are kept: beyond the last is the last.
    on(Key::Space, "freeze, go on", Command::Freeze),
    on(Key::Left, "one volume back, forth", Command::Cine(-1)).held(),
    on(Key::Right, "one volume back, forth", Command::Cine(1)).held(),
    on(Key::Home, "oldest volume", Command::CineAt(0)),
    on(Key::End, "newest volume", Command::CineAt(usize::MAX)),
    on(Key::Enter, "play over and over", Command::CinePlay),
    on(Char('p'), "save the picture", Command::SavePicture),
    on(Char('r'), "save the recording", Command::SaveLoop),
    // The screen.
    on(Char('h'), "this help", Command::Help),
    on(Function(1), "this help", Command::Help),
    on(Function(2), "times of the passes", Command::Hud),
    on(Function(3), "sliders", Command::Panels),
    on(Function(11), "full screen", Command::FullScreen),
    on(Key::Escape, "end", Command::Exit),
    on(Char('q'), "end", Command::Exit),
];

/// What a key does with these modifiers.
pub fn binding(key: Key, modifiers: Modifiers) -> Option<&'static Binding> {
    // Signs lie on the shifted half of a key in one country and not in the next.
    let is_sign = matches!(key, Char(c) if !c.is_alphanumeric());
    let modifiers = Modifiers { shift: modifiers.shift && !is_sign, ..modifiers };
    KEYS.iter().find(|b| b.key == key && b.modifiers == modifiers)
}

pub fn command(key: Key, modifiers: Modifiers) -> Option<Command> {
    binding(key, modifiers).map(|b| b.what)
}

/// Keys as they are written, such as "Shift+Left, Shift+Right", and what they do; in the order of [`KEYS`].
pub fn help() -> impl Iterator<Item = (String, &'static str)> {
    KEYS.chunk_by(|a, b| a.words == b.words).filter_map(|same| {
        let keys: Vec<String> = same.iter().map(written).collect();
        Some((keys.join(", "), same.first()?.words))
    })
}

fn written(binding: &Binding) -> String {
    let Modifiers { shift, control, alt } = binding.modifiers;
    let held = [(control, "Ctrl+"), (alt, "Alt+"), (shift, "Shift+")];
    let held: String = held.iter().filter(|(is_held, _)| *is_held).map(|(_, name)| *name).collect();
    let key = match binding.key {
        Char(c) => c.to_uppercase().to_string(),
        Function(n) => format!("F{n}"),
        Key::PageUp => "Page up".into(),
        Key::PageDown => "Page down".into(),
        other => format!("{other:?}"),
    };
    held + &key
}

/// The keys that are held: a toggle must not flicker under a finger that rests on its key.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    modifiers: Modifiers,
    held: Vec<Key>,
}

impl Keys {
    pub fn modifiers(&self) -> Modifiers {
        self.modifiers
    }

    pub fn input(&mut self, input: &Input) -> Option<Command> {
        match *input {
            Input::Modifiers(modifiers) => self.modifiers = modifiers,
            Input::Left => *self = Keys::default(),
            Input::Key { key, pressed: false } => self.held.retain(|held| *held != key),
            Input::Key { key, pressed: true } => {
                let again = self.held.contains(&key);
                if !again {
                    self.held.push(key);
                }
                return binding(key, self.modifiers).filter(|b| b.repeats || !again).map(|b| b.what);
            }
            _ => {}
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_is_bound_twice() {
        for (i, a) in KEYS.iter().enumerate() {
            assert!(!KEYS[..i].iter().any(|b| (b.key, b.modifiers) == (a.key, a.modifiers)), "{}", written(a));
            assert_eq!(command(a.key, a.modifiers), Some(a.what), "{} is out of reach", written(a));
        }
    }

    #[test]
    fn every_mode_layout_tool_and_plane_has_a_key() {
        use Mode::*;
        let modes = [Volume, Surface, Mixed, Mip, MinIp, Mean, Plane, Orthogonal, Tomography, Cube].map(Command::Mode);
        let tools = [Tool::Turn, Tool::Light, Tool::Region, Tool::Clip, Tool::Plane].map(Command::Tool);
        let layouts = [Layout::Single, Layout::Four].map(Command::Layout);
        let planes = [PlaneName::A, PlaneName::B, PlaneName::C].map(Command::Plane);
        for wish in modes.iter().chain(&tools).chain(&layouts).chain(&planes) {
            assert!(KEYS.iter().any(|b| b.what == *wish), "{wish:?}");
        }
    }

    #[test]
    fn the_help_has_a_line_for_every_wish() {
        let lines: Vec<_> = help().collect();
        assert!(lines.contains(&("H, F1".into(), "this help")));
        assert!(lines.contains(&("Shift+X".into(), "nothing cut from the front")));
        let mut words: Vec<_> = lines.iter().map(|(_, words)| words).collect();
        words.sort();
        assert!(words.windows(2).all(|w| w[0] != w[1]), "the same words in two places");
    }

    #[test]
    fn a_key_that_is_held_repeats_only_what_is_meant_to() {
        let mut keys = Keys::default();
        let mut press = |key, pressed| keys.input(&Input::Key { key, pressed });
        assert_eq!(press(Key::Space, true), Some(Command::Freeze));
        assert_eq!(press(Key::Space, true), None);
        assert_eq!(press(Key::Space, false), None);
        assert_eq!(press(Key::Space, true), Some(Command::Freeze));
        assert_eq!(press(Key::Right, true), Some(Command::Cine(1)));
        assert_eq!(press(Key::Right, true), Some(Command::Cine(1)));
        keys.input(&Input::Modifiers(Modifiers { shift: true, ..Modifiers::default() }));
        let sign = Input::Key { key: Char('+'), pressed: true };
        assert_eq!(keys.input(&sign), Some(Command::Zoom(1.1)));
    }
}
