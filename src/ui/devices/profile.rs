//! Classifies a device by its abilities.

use super::keymap::{meaning, pen_meaning};
use evdev::{AbsoluteAxisCode as Abs, KeyCode, RelativeAxisCode as Rel};
use std::collections::{BTreeMap, BTreeSet};

/// The range of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) low: i32,
    pub(super) high: i32,
}

impl Span {
    /// The position of a value in the range, 0 to 1.
    pub(super) fn fraction(&self, value: i32) -> f64 {
        ((f64::from(value) - f64::from(self.low)) / self.length()).clamp(0.0, 1.0)
    }

    /// Length of the range, at least 1.
    pub(super) fn length(&self) -> f64 {
        (f64::from(self.high) - f64::from(self.low)).max(1.0)
    }
}

/// The abilities of a device, by the kernel's codes.
#[derive(Clone, Debug, Default)]
pub(super) struct Abilities {
    pub(super) keys: BTreeSet<u16>,
    pub(super) relative: BTreeSet<u16>,
    pub(super) absolute: BTreeMap<u16, Span>,
    /// A touch screen: what is touched is what is shown there.
    pub(super) is_direct: bool,
    pub(super) is_accelerometer: bool,
}

/// How a device points. Axes are horizontal and vertical.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pointing {
    /// It moves the pointer relative to its position, if at all.
    Relative,
    /// It sets the position of the pointer: a pen, or the tablet that a virtual machine uses as a mouse.
    Absolute([Span; 2]),
    /// A touch pad: a finger moves the pointer relative to its position.
    Pad([Span; 2]),
    /// A touch screen for one finger.
    Finger([Span; 2]),
    /// A touch screen for several fingers, each in a slot.
    Fingers([Span; 2]),
}

/// The kind of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Profile {
    pub(super) pointing: Pointing,
    /// Its wheel also reports fractions of notches.
    pub(super) has_fine_wheel: bool,
}

impl Profile {
    /// Classifies a device. None if it gives no inputs, such as a joystick, a power button or a lid switch.
    pub(super) fn of(abilities: &Abilities) -> Option<Profile> {
        if abilities.is_accelerometer {
            return None;
        }
        let axes = |x: Abs, y: Abs| {
            let spans = [*abilities.absolute.get(&x.0)?, *abilities.absolute.get(&y.0)?];
            spans.iter().all(|span| span.low < span.high).then_some(spans)
        };
        let has = |key: KeyCode| abilities.keys.contains(&key.0);
        let moves = |axis: Rel| abilities.relative.contains(&axis.0);
        let is_pen = has(KeyCode::BTN_TOOL_PEN) || has(KeyCode::BTN_STYLUS);
        let is_pad = has(KeyCode::BTN_TOOL_FINGER) && !is_pen && !abilities.is_direct;
        let is_touched = abilities.is_direct || has(KeyCode::BTN_TOUCH);
        let one = axes(Abs::ABS_X, Abs::ABS_Y);
        let several = axes(Abs::ABS_MT_POSITION_X, Abs::ABS_MT_POSITION_Y)
            .filter(|_| abilities.absolute.contains_key(&Abs::ABS_MT_SLOT.0));
        let pointing = match (one, several) {
            (Some(spans), _) if is_pen => Pointing::Absolute(spans),
            (Some(spans), _) if is_pad => Pointing::Pad(spans),
            (_, Some(spans)) if is_touched && !is_pen && !is_pad => Pointing::Fingers(spans),
            (Some(spans), _) if abilities.is_direct => Pointing::Finger(spans),
            (Some(spans), _) if has(KeyCode::BTN_LEFT) => Pointing::Absolute(spans),
            (Some(spans), _) if is_touched => Pointing::Finger(spans),
            _ => Pointing::Relative,
        };
        let means = |code: &u16| match pointing {
            Pointing::Absolute(_) => pen_meaning(*code).is_some(),
            _ => meaning(*code).is_some(),
        };
        let has_wheel = moves(Rel::REL_WHEEL) || moves(Rel::REL_WHEEL_HI_RES);
        let is_mouse = (moves(Rel::REL_X) && moves(Rel::REL_Y)) || has_wheel;
        let is_any = pointing != Pointing::Relative || is_mouse || abilities.keys.iter().any(means);
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
    fn every_kind_of_device_is_classified() {
        use KeyCode as K;
        let spans = [Span { low: 0, high: 4095 }; 2];
        let (xy, slots) =
            ([Abs::ABS_X, Abs::ABS_Y], [Abs::ABS_MT_SLOT, Abs::ABS_MT_POSITION_X, Abs::ABS_MT_POSITION_Y]);
        let both = [&xy[..], &slots[..]].concat();
        let pad = [K::BTN_LEFT, K::BTN_TOUCH, K::BTN_TOOL_FINGER, K::BTN_TOOL_DOUBLETAP];
        for (what, abilities, pointing) in [
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
            assert_eq!(Profile::of(&abilities).map(|p| p.pointing), pointing, "{what}");
        }
    }

    #[test]
    fn an_axis_without_length_is_ignored() {
        let mut flat = can(&[KeyCode::BTN_TOUCH], &[], &[Abs::ABS_X, Abs::ABS_Y], true);
        flat.absolute.insert(Abs::ABS_Y.0, Span { low: 7, high: 7 });
        assert_eq!(Profile::of(&flat), None);
        let odd = Span { low: i32::MAX, high: i32::MIN };
        assert!((0.0..=1.0).contains(&odd.fraction(0)));
    }
}
