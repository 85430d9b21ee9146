//! The pointer by keyboard ("mouse keys"): while it is on, keys move a pointer over the picture, click, and hold the left button. It produces the
//! inputs of a mouse, so that every gesture can be made by keys.

use super::input::{Button, Input, Key, Modifiers};
use super::keys::HeldKeys;

/// A step of the pointer, as a share of the shorter edge of the picture: from edge to edge in two seconds while a key repeats.
const STEP: f64 = 0.02;
const ARROWS: [(Key, [f64; 2]); 4] =
    [(Key::Left, [-1.0, 0.0]), (Key::Right, [1.0, 0.0]), (Key::Up, [0.0, -1.0]), (Key::Down, [0.0, 1.0])];

/// The area of the picture: upper left corner and size, pixels of the window.
pub(super) type PictureArea = ([u32; 2], [u32; 2]);

/// An input of the mouse, with the modifiers that count as held.
pub(super) type Pointed = (Input, Modifiers);

/// How the pointer that keys move is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PointerMark {
    /// Position of the pointer, pixels of the window.
    pub(super) at: [f64; 2],
    /// True if keys moved the pointer last. After a motion of the mouse only a ring shows that keys can move it.
    pub(super) has_arrow: bool,
    pub(super) is_held: bool,
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct KeyboardPointer {
    pub(super) is_on: bool,
    /// Position, pixels of the window.
    at: Option<[f64; 2]>,
    /// Whether a key holds the left button.
    is_held: bool,
    has_arrow: bool,
    /// Last position of the mouse. A windowing system reports it again when the window gets the focus.
    mouse: Option<[f64; 2]>,
}

impl KeyboardPointer {
    /// True while a key holds the pointer's button down, so that a drag may pause between two keys.
    pub(super) fn is_held(&self) -> bool {
        self.is_on && self.is_held
    }

    /// Turns the pointer on at its last position, or off; a button that is held is then cancelled. Returns the mouse inputs that stand for this.
    pub(super) fn toggle(&mut self, pointer: Option<[f64; 2]>, picture: PictureArea) -> Vec<Pointed> {
        if self.is_on {
            let given_up = if self.is_held { self.give_up(picture) } else { Vec::new() };
            self.is_on = false;
            return given_up;
        }
        (self.is_on, self.is_held, self.has_arrow) = (true, false, true);
        self.at = pointer.or(self.at).filter(|at| is_within(*at, picture));
        vec![plain(Input::Moved(self.place(picture)))]
    }

    /// Notes an input of a mouse, a finger or the window system.
    pub(super) fn other_input(&mut self, input: &Input) {
        match *input {
            Input::Moved(at) if self.mouse != Some(at) => {
                (self.mouse, self.at, self.has_arrow) = (Some(at), Some(at), false);
            }
            // Buttons belong to who presses last.
            Input::Button { .. } | Input::Touch { .. } | Input::FocusLost => self.is_held = false,
            _ => {}
        }
    }

    /// The mouse inputs that a pressed key stands for; None if the key does not move the pointer. `held`: the keys that were held before.
    pub(super) fn key(&mut self, key: Key, held: &HeldKeys, picture: PictureArea) -> Option<Vec<Pointed>> {
        let modifiers = held.modifiers;
        if !self.is_on || modifiers.alt {
            return None;
        }
        let again = held.is_held(key);
        match key {
            Key::Enter if modifiers.control => None,
            Key::Enter | Key::Space if again => Some(Vec::new()),
            Key::Space => Some(self.hold_or_release(modifiers, picture)),
            Key::Enter if self.is_held => Some(self.hold_or_release(modifiers, picture)),
            Key::Enter => Some(self.click(if modifiers.shift { 2 } else { 1 }, picture)),
            Key::Escape if self.is_held => Some(self.give_up(picture)),
            _ if modifiers.control => None,
            _ => self.moved(key, held, picture),
        }
    }

    /// Moves by an arrow, and by those that are held with it: two of them go aslant.
    fn moved(&mut self, key: Key, held: &HeldKeys, (corner, size): PictureArea) -> Option<Vec<Pointed>> {
        let (_, alone) = ARROWS.iter().find(|(arrow, _)| *arrow == key)?;
        let all = ARROWS.iter().filter(|(arrow, _)| *arrow == key || held.is_held(*arrow));
        let sum = all.fold([0.0; 2], |sum, (_, way)| [sum[0] + way[0], sum[1] + way[1]]);
        let [x, y] = if sum == [0.0; 2] { *alone } else { sum };
        let edge = f64::from(size[0].min(size[1]));
        let step = if held.modifiers.shift { 1.0 } else { (STEP * edge).round().max(1.0) };
        let from = self.place((corner, size));
        self.at = Some([from[0] + x * step, from[1] + y * step]);
        self.at = Some(self.place((corner, size)));
        self.has_arrow = true;
        Some(vec![plain(Input::Moved(self.place((corner, size))))])
    }

    fn click(&mut self, times: usize, picture: PictureArea) -> Vec<Pointed> {
        self.has_arrow = true;
        let click = [true, false].map(|pressed| plain(Input::Button { button: Button::Left, pressed }));
        let place = plain(Input::Moved(self.place(picture)));
        // The pointer may have left the window since.
        [place].into_iter().chain(click.into_iter().cycle().take(2 * times)).collect()
    }

    /// Presses the button with the modifiers that are held, or releases it.
    fn hold_or_release(&mut self, modifiers: Modifiers, picture: PictureArea) -> Vec<Pointed> {
        (self.is_held, self.has_arrow) = (!self.is_held, true);
        let button = Input::Button { button: Button::Left, pressed: self.is_held };
        vec![plain(Input::Moved(self.place(picture))), (button, modifiers)]
    }

    /// Ends a drag as if the window lost the focus.
    fn give_up(&mut self, picture: PictureArea) -> Vec<Pointed> {
        self.is_held = false;
        vec![plain(Input::FocusLost), plain(Input::Moved(self.place(picture)))]
    }

    /// Where the pointer is: within the picture, at first in its middle.
    fn place(&self, (corner, size): PictureArea) -> [f64; 2] {
        std::array::from_fn(|n| {
            let (low, length) = (f64::from(corner[n]), f64::from(size[n]));
            let at = self.at.map_or(low + length / 2.0, |at| at[n]);
            // Whole pixels, as a mouse has them.
            at.floor().clamp(low, low + (length - 1.0).max(0.0))
        })
    }

    /// How the pointer is drawn; None while it is off.
    pub(super) fn mark(&self, picture: PictureArea) -> Option<PointerMark> {
        let at = self.place(picture);
        self.is_on.then_some(PointerMark { at, has_arrow: self.has_arrow, is_held: self.is_held })
    }
}

fn plain(input: Input) -> Pointed {
    (input, Modifiers::default())
}

fn is_within(at: [f64; 2], (corner, size): PictureArea) -> bool {
    (0..2).all(|n| at[n] >= f64::from(corner[n]) && at[n] < f64::from(corner[n] + size[n]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: PictureArea = ([100, 20], [400, 300]);

    /// A pointer with its keys, for tests.
    struct Desk {
        pointer: KeyboardPointer,
        keys: HeldKeys,
    }

    impl Desk {
        fn new() -> Desk {
            let mut pointer = KeyboardPointer::default();
            assert_eq!(pointer.toggle(None, PICTURE), [plain(Input::Moved([300.0, 170.0]))], "the middle");
            Desk { pointer, keys: HeldKeys::default() }
        }

        fn down(&mut self, key: Key) -> Option<Vec<Input>> {
            let pointed = self.pointer.key(key, &self.keys, PICTURE);
            self.keys.input(&Input::Key { key, pressed: true });
            pointed.map(|all| all.into_iter().map(|(input, _)| input).collect())
        }

        fn up(&mut self, key: Key) {
            self.keys.input(&Input::Key { key, pressed: false });
        }

        fn press(&mut self, key: Key) -> Option<Vec<Input>> {
            let inputs = self.down(key);
            self.up(key);
            inputs
        }

        fn hold(&mut self, shift: bool, control: bool) {
            self.keys.input(&Input::Modifiers(Modifiers { shift, control, alt: false }));
        }
    }

    fn moved(x: f64, y: f64) -> Option<Vec<Input>> {
        Some(vec![Input::Moved([x, y])])
    }

    fn button(pressed: bool) -> Input {
        Input::Button { button: Button::Left, pressed }
    }

    #[test]
    fn arrows_move_it_within_the_picture() {
        let mut desk = Desk::new();
        assert_eq!(desk.down(Key::Right), moved(306.0, 170.0), "2 % of 300 pixels");
        assert_eq!(desk.down(Key::Right), moved(312.0, 170.0), "it repeats");
        assert_eq!(desk.down(Key::Up), moved(318.0, 164.0), "two go aslant");
        desk.up(Key::Right);
        assert_eq!(desk.down(Key::Up), moved(318.0, 158.0));
        assert_eq!(desk.down(Key::Down), moved(318.0, 164.0), "the later of two that are opposite");
        [Key::Up, Key::Down].into_iter().for_each(|key| desk.up(key));
        desk.hold(true, false);
        assert_eq!(desk.press(Key::Left), moved(317.0, 164.0), "one pixel");
        desk.hold(false, false);
        (0..200).for_each(|_| _ = desk.press(Key::Left));
        assert_eq!(desk.press(Key::Left), moved(100.0, 164.0));
        (0..200).for_each(|_| _ = [Key::Right, Key::Down].map(|key| desk.press(key)));
        assert_eq!(desk.press(Key::Down), moved(499.0, 319.0));
        assert_eq!(desk.press(Key::Right), moved(499.0, 319.0));
    }

    #[test]
    fn enter_clicks_and_space_holds() {
        let mut desk = Desk::new();
        let at = Input::Moved([300.0, 170.0]);
        let (down, up) = (button(true), button(false));
        assert_eq!(desk.down(Key::Enter), Some(vec![at, down, up]));
        assert_eq!(desk.down(Key::Enter), Some(Vec::new()), "a key that is held clicks once");
        desk.up(Key::Enter);
        desk.hold(true, false);
        assert_eq!(desk.press(Key::Enter), Some(vec![at, down, up, down, up]), "twice");
        desk.hold(false, false);
        assert_eq!(desk.down(Key::Space), Some(vec![at, down]));
        assert_eq!(desk.down(Key::Space), Some(Vec::new()));
        desk.up(Key::Space);
        assert!(desk.pointer.is_held() && desk.pointer.mark(PICTURE).is_some_and(|mark| mark.is_held));
        desk.press(Key::Right);
        assert_eq!(desk.press(Key::Space), Some(vec![Input::Moved([306.0, 170.0]), up]));
        desk.press(Key::Space);
        assert_eq!(desk.press(Key::Enter), Some(vec![Input::Moved([306.0, 170.0]), up]), "Enter releases too");
        // The modifiers of a drag are those of its press.
        desk.hold(false, true);
        let held = desk.pointer.key(Key::Space, &desk.keys, PICTURE).expect("a press");
        assert_eq!(held[1], (down, Modifiers { control: true, ..Modifiers::default() }));
    }

    #[test]
    fn a_drag_is_given_up_and_other_keys_stay_as_they_are() {
        let mut desk = Desk::new();
        assert_eq!(desk.press(Key::Escape), None, "nothing is held");
        desk.press(Key::Space);
        assert_eq!(desk.press(Key::Escape), Some(vec![Input::FocusLost, Input::Moved([300.0, 170.0])]));
        assert!(!desk.pointer.is_held());
        for key in [Key::Char('m'), Key::PageUp, Key::Tab, Key::Function(2), Key::Backspace] {
            assert_eq!(desk.press(key), None, "{key:?}");
        }
        desk.hold(false, true);
        for key in [Key::Left, Key::Enter, Key::Char('z')] {
            assert_eq!(desk.press(key), None, "Ctrl+{key:?}");
        }
        desk.hold(false, false);
        desk.press(Key::Space);
        let ended = desk.pointer.toggle(None, PICTURE);
        assert_eq!(ended.first(), Some(&plain(Input::FocusLost)), "leaving gives up too");
        assert_eq!((desk.press(Key::Left), desk.pointer.mark(PICTURE)), (None, None));
    }

    #[test]
    fn a_mouse_takes_it_over_and_keys_go_on_from_there() {
        let mut desk = Desk::new();
        desk.press(Key::Left);
        desk.pointer.other_input(&Input::Moved([400.0, 200.0]));
        let mark = |desk: &Desk| desk.pointer.mark(PICTURE).expect("it is on");
        assert_eq!(mark(&desk), PointerMark { at: [400.0, 200.0], has_arrow: false, is_held: false });
        assert_eq!(desk.press(Key::Left), moved(394.0, 200.0));
        assert!(mark(&desk).has_arrow);
        desk.pointer.other_input(&Input::Moved([400.0, 200.0]));
        assert_eq!(mark(&desk).at, [394.0, 200.0], "the mouse has not moved");
        desk.press(Key::Space);
        desk.pointer.other_input(&Input::FocusLost);
        assert!(!desk.pointer.is_held());
        // It begins where the pointer is, if that is on the picture.
        for (pointer, expected) in [([120.0, 33.0], [120.0, 33.0]), ([5.0, 33.0], [300.0, 170.0])] {
            let mut pointed = KeyboardPointer::default();
            assert_eq!(pointed.toggle(Some(pointer), PICTURE), [plain(Input::Moved(expected))]);
        }
    }
}
