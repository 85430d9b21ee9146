//! What a device is, of what it says that it can do.

use super::keymap::{meaning, of_pen};
use evdev::{AbsoluteAxisCode as Abs, KeyCode, RelativeAxisCode as Rel};
use std::collections::{BTreeMap, BTreeSet};

/// What the values of an axis lie between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    pub low: i32,
    pub high: i32,
}

impl Span {
    /// Where a value lies in it, 0 to 1.
    pub fn share(&self, value: i32) -> f64 {
        ((f64::from(value) - f64::from(self.low)) / self.length()).clamp(0.0, 1.0)
    }

    /// At least 1.
    pub fn length(&self) -> f64 {
        (f64::from(self.high) - f64::from(self.low)).max(1.0)
    }
}

/// What a device says that it can do, by the kernel's codes.
#[derive(Clone, Debug, Default)]
pub struct Abilities {
    pub keys: BTreeSet<u16>,
    pub relative: BTreeSet<u16>,
    pub absolute: BTreeMap<u16, Span>,
    /// What is touched is what is shown there.
    pub is_direct: bool,
    pub is_accelerometer: bool,
}

/// What its places are. Axes are across and down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pointing {
    /// None: it moves the pointer from where that is, if at all.
    Relative,
    /// Of the pointer: a pen's, or those of the tablet that a virtual machine has for a mouse.
    Absolute([Span; 2]),
    /// Of a finger on a pad, that moves the pointer from where it is.
    Pad([Span; 2]),
    /// Of the only finger on the screen.
    Finger([Span; 2]),
    /// Of several fingers, each in a slot.
    Fingers([Span; 2]),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Profile {
    pub pointing: Pointing,
    /// Its wheel says parts of notches too.
    pub has_fine_wheel: bool,
}

impl Profile {
    /// None of a device that means nothing to us, such as a joystick, a power button or a lid.
    pub fn of(can: &Abilities) -> Option<Profile> {
        if can.is_accelerometer {
            return None;
        }
        let axes = |x: Abs, y: Abs| {
            let spans = [*can.absolute.get(&x.0)?, *can.absolute.get(&y.0)?];
            spans.iter().all(|span| span.low < span.high).then_some(spans)
        };
        let has = |key: KeyCode| can.keys.contains(&key.0);
        let moves = |axis: Rel| can.relative.contains(&axis.0);
        let is_pen = has(KeyCode::BTN_TOOL_PEN) || has(KeyCode::BTN_STYLUS);
        let is_pad = has(KeyCode::BTN_TOOL_FINGER) && !is_pen && !can.is_direct;
        let is_touched = can.is_direct || has(KeyCode::BTN_TOUCH);
        let one = axes(Abs::ABS_X, Abs::ABS_Y);
        let several = axes(Abs::ABS_MT_POSITION_X, Abs::ABS_MT_POSITION_Y)
            .filter(|_| can.absolute.contains_key(&Abs::ABS_MT_SLOT.0));
        let pointing = match (one, several) {
            (Some(spans), _) if is_pen => Pointing::Absolute(spans),
            (Some(spans), _) if is_pad => Pointing::Pad(spans),
            (_, Some(spans)) if is_touched && !is_pen && !is_pad => Pointing::Fingers(spans),
            (Some(spans), _) if can.is_direct => Pointing::Finger(spans),
            (Some(spans), _) if has(KeyCode::BTN_LEFT) => Pointing::Absolute(spans),
            (Some(spans), _) if is_touched => Pointing::Finger(spans),
            _ => Pointing::Relative,
        };
        let means = |code: &u16| match pointing {
            Pointing::Absolute(_) => of_pen(*code).is_some(),
            _ => meaning(*code).is_some(),
        };
        let turns = moves(Rel::REL_WHEEL) || moves(Rel::REL_WHEEL_HI_RES);
        let is_mouse = (moves(Rel::REL_X) && moves(Rel::REL_Y)) || turns;
        let is_any = pointing != Pointing::Relative || is_mouse || can.keys.iter().any(means);
        is_any.then_some(Profile { pointing, has_fine_wheel: moves(Rel::REL_WHEEL_HI_RES) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn can(keys: &[KeyCode], relative: &[Rel], absolute: &[Abs], is_direct: bool) -> Abilities {
        Abilities {
            keys: keys.iter().map(|k| k.0).collect(),
            relative: relative.iter().map(|r| r.0).collect(),
            absolute: absolute.iter().map(|a| (a.0, Span { low: 0, high: 4095 })).collect(),
            is_direct,
            is_accelerometer: false,
        }
    }

    #[test]
    fn every_kind_of_device_is_known_for_what_it_is() {
        use KeyCode as K;
        let spans = [Span { low: 0, high: 4095 }; 2];
        let (xy, slots) =
            ([Abs::ABS_X, Abs::ABS_Y], [Abs::ABS_MT_SLOT, Abs::ABS_MT_POSITION_X, Abs::ABS_MT_POSITION_Y]);
        let both = [&xy[..], &slots[..]].concat();
        let pad = [K::BTN_LEFT, K::BTN_TOUCH, K::BTN_TOOL_FINGER, K::BTN_TOOL_DOUBLETAP];
        for (what, can, pointing) in [
            ("keyboard", can(&[K::KEY_A, K::KEY_ENTER], &[], &[], false), Some(Pointing::Relative)),
            ("pedal", can(&[K::KEY_B], &[], &[], false), Some(Pointing::Relative)),
            ("mouse", can(&[K::BTN_LEFT], &[Rel::REL_X, Rel::REL_Y], &[], false), Some(Pointing::Relative)),
            ("wheel", can(&[], &[Rel::REL_WHEEL], &[], false), Some(Pointing::Relative)),
            ("QEMU's tablet", can(&[K::BTN_LEFT], &[Rel::REL_WHEEL], &xy, false), Some(Pointing::Absolute(spans))),
            ("pen", can(&[K::BTN_TOOL_PEN, K::BTN_TOUCH], &[], &xy, true), Some(Pointing::Absolute(spans))),
            ("touch pad", can(&pad, &[], &both, false), Some(Pointing::Pad(spans))),
            ("touch screen", can(&[K::BTN_TOUCH], &[], &both, true), Some(Pointing::Fingers(spans))),
            ("touch screen of one finger", can(&[K::BTN_TOUCH], &[], &xy, false), Some(Pointing::Finger(spans))),
            (
                "touch screen without slots",
                can(&[K::BTN_TOUCH], &[], &[&xy[..], &slots[1..]].concat(), true),
                Some(Pointing::Finger(spans)),
            ),
            ("joystick", can(&[K::BTN_TRIGGER], &[], &xy, false), None),
            ("power button", can(&[K::KEY_POWER], &[], &[], false), None),
            ("nothing", Abilities::default(), None),
            ("accelerometer", Abilities { is_accelerometer: true, ..can(&[K::KEY_A], &[], &xy, false) }, None),
        ] {
            assert_eq!(Profile::of(&can).map(|p| p.pointing), pointing, "{what}");
        }
    }

    #[test]
    fn an_axis_that_has_no_length_is_none() {
        let mut flat = can(&[KeyCode::BTN_TOUCH], &[], &[Abs::ABS_X, Abs::ABS_Y], true);
        flat.absolute.insert(Abs::ABS_Y.0, Span { low: 7, high: 7 });
        assert_eq!(Profile::of(&flat), None);
        let odd = Span { low: i32::MAX, high: i32::MIN };
        assert!((0.0..=1.0).contains(&odd.share(0)));
    }
}
