//! Numbers of the settings. A row beside each field, in `settings`, states the allowed values and the slider of the viewer that sets it.
//! The check, its message, the slider, its name for screen readers and the line of docs/settings.md follow from the row.

use super::region::depth_offset;
use super::{Edge, Layout, Mode, Scene, SceneError, Settings, Shading, refuse};
use glam::DVec3;

/// The largest length of a setting, mm. With the smallest one this allows scenes of any size: from a thousandth of the smallest voxel that a volume
/// may have to a thousand times the largest.
pub(super) const LARGEST: f64 = 1e9;
pub(super) const LENGTH: Allowed = Allowed::Range(1e-9, LARGEST);
pub(super) const LENGTH_OR_0: Allowed = Allowed::Range(0.0, LARGEST);
/// Allowed coordinates of a place, mm.
pub(super) const PLACE: Allowed = Allowed::Range(-1e10, 1e10);
/// Allowed angles, degrees.
pub(super) const ANGLE: Allowed = Allowed::Range(-360.0, 360.0);
pub(super) const SHARE: Allowed = Allowed::Range(0.0, 1.0);
/// Numbers from 0 to infinity; infinity is allowed, and has a meaning.
pub(super) const NOT_NEGATIVE: Allowed = Allowed::Range(0.0, f64::INFINITY);

/// Which values a number of the settings may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Allowed {
    /// Every number; checks of several settings together may exclude some.
    Any,
    Range(f64, f64),
    /// 0, which switches something off, or a value in this range.
    OffOr(f64, f64),
    /// An odd number in this range.
    Odd(f64, f64),
    /// 0, which switches something off, or an odd number in this range.
    OffOrOdd(f64, f64),
    OneOf(&'static [f64]),
}

impl Allowed {
    fn has(self, value: f64) -> bool {
        let within = |low, high| value >= low && value <= high;
        match self {
            Allowed::Any => true,
            Allowed::Range(low, high) => within(low, high),
            Allowed::OffOr(low, high) => value == 0.0 || within(low, high),
            Allowed::Odd(low, high) => value % 2.0 == 1.0 && within(low, high),
            Allowed::OffOrOdd(low, high) => value == 0.0 || Allowed::Odd(low, high).has(value),
            Allowed::OneOf(values) => values.contains(&value),
        }
    }

    fn words(self) -> String {
        let range = |low, high| format!("{}..={}", short(low), short(high));
        match self {
            Allowed::Any => String::new(),
            Allowed::Range(low, f64::INFINITY) => format!("at least {}", short(low)),
            Allowed::Range(low, high) => range(low, high),
            Allowed::OffOr(low, high) => format!("0 or {}", range(low, high)),
            Allowed::Odd(low, high) => format!("odd, {}", range(low, high)),
            Allowed::OffOrOdd(low, high) => format!("0 or odd, {}", range(low, high)),
            Allowed::OneOf(values) => {
                let words: Vec<String> = values.iter().map(f64::to_string).collect();
                words.split_last().map_or(String::new(), |(last, before)| format!("{} or {last}", before.join(", ")))
            }
        }
    }
}

/// A number without many zeros.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

/// A group of sliders in the panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    Image,
    Surface,
    Volume,
    Light,
    Planes,
    Filters,
    Quality,
}

/// Gives each value of a number that is there.
type Each = fn(&Settings, &mut dyn FnMut(f64));

/// A slider of the viewer, which changes one or several settings.
#[derive(Clone, Copy, Debug)]
pub struct Slider {
    /// Path of the setting that the slider changes, or a name of its own if it changes several.
    pub key: &'static str,
    pub name: &'static str,
    /// What the slider does, as a sentence for the user.
    pub hint: &'static str,
    /// Unit of the value; may be empty.
    pub unit: &'static str,
    pub group: Group,
    /// Range of the slider for any volume. [`Slider::range_in`] narrows it for one scene.
    pub range: [f64; 2],
    /// How much a key press changes the value.
    pub step: f64,
    /// Values below are 0.
    least: f64,
    applies: fn(&Settings) -> bool,
    each: Each,
    put: fn(&mut Settings, f64),
    limits: fn(&Scene) -> [f64; 2],
}

impl Slider {
    /// A slider that changes several settings by the functions `each` (gives their values) and `put` (sets them).
    pub const fn of_several(
        [key, name, unit, hint]: [&'static str; 4],
        group: Group,
        range: [f64; 2],
        step: f64,
        each: Each,
        put: fn(&mut Settings, f64),
    ) -> Slider {
        Slider {
            key,
            name,
            hint,
            unit,
            group,
            range,
            step,
            least: f64::NEG_INFINITY,
            applies: |_| true,
            each,
            put,
            limits: |_| [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// The same slider, which has an effect only with settings for which `applies` is true.
    pub const fn when(self, applies: fn(&Settings) -> bool) -> Slider {
        Slider { applies, ..self }
    }

    /// The same slider, whose range is limited to what `limits` gives for a scene.
    pub const fn within(self, limits: fn(&Scene) -> [f64; 2]) -> Slider {
        Slider { limits, ..self }
    }

    /// True if the slider affects the picture with these settings.
    pub fn applies(&self, settings: &Settings) -> bool {
        (self.applies)(settings)
    }

    /// The present value of the slider's setting, or the first value if it changes several. It may be outside the range if a scene file set it so. 0
    /// if the setting is absent.
    pub fn get(&self, settings: &Settings) -> f64 {
        let mut found = None;
        (self.each)(settings, &mut |value| found = found.or(Some(value)));
        found.unwrap_or(0.0)
    }

    /// Sets the slider's setting to the value, clamped to `range`. A value too small to be anything but off becomes 0, which removes an optional
    /// setting. NaN changes nothing.
    pub fn set(&self, settings: &mut Settings, value: f64) {
        if !value.is_nan() {
            let value = value.clamp(self.range[0], self.range[1]);
            (self.put)(settings, if value < self.least { 0.0 } else { value });
        }
    }

    /// Lowest and highest value for this scene; never empty.
    pub fn range_in(&self, scene: &Scene) -> [f64; 2] {
        let [low, high] = (self.limits)(scene);
        let low = self.range[0].max(low).min(self.range[1]);
        [low, self.range[1].min(high).max(low)]
    }

    /// True if the slider is shown as a switch: 0 is off and 1 is on.
    pub fn is_switch(&self) -> bool {
        self.range == [0.0, 1.0] && self.step == 1.0
    }
}

/// A number of the settings, or several numbers of one meaning, such as the coordinates of a point.
#[derive(Clone, Copy, Debug)]
pub struct Number {
    /// Path of the number in a scene file, such as `ray.step`.
    pub key: &'static str,
    /// Unit of the values; may be empty.
    pub unit: &'static str,
    allowed: Allowed,
    pub slider: Option<Slider>,
    each: Each,
    put: fn(&mut Settings, f64),
}

impl Number {
    pub(super) const fn new(
        [key, unit]: [&'static str; 2],
        allowed: Allowed,
        each: Each,
        put: fn(&mut Settings, f64),
    ) -> Number {
        Number { key, unit, allowed, slider: None, each, put }
    }

    /// The same number with a slider. `applies`: with which settings the slider affects the picture; `hint`: what it does.
    pub(super) const fn slider(
        self,
        group: Group,
        name: &'static str,
        range: [f64; 2],
        step: f64,
        applies: fn(&Settings) -> bool,
        hint: &'static str,
    ) -> Number {
        let slider = Slider::of_several([self.key, name, self.unit, hint], group, range, step, self.each, self.put);
        Number { slider: Some(slider.when(applies)), ..self }
    }

    /// The slider, which must have been given before a method changes it: a constant table without it does not compile.
    const fn its_slider(self) -> Slider {
        self.slider.expect("the row has no slider yet")
    }

    /// The same number, whose slider sets values below `least` to 0, or removes an optional value.
    pub(super) const fn off_below(self, least: f64) -> Number {
        Number { slider: Some(Slider { least, ..self.its_slider() }), ..self }
    }

    /// The same number, whose slider is limited to what `limits` gives for a scene.
    pub(super) const fn within(self, limits: fn(&Scene) -> [f64; 2]) -> Number {
        Number { slider: Some(self.its_slider().within(limits)), ..self }
    }

    /// The same number, whose slider sets more than this number, by `put`.
    pub(super) const fn set_by(self, put: fn(&mut Settings, f64)) -> Number {
        Number { slider: Some(Slider { put, ..self.its_slider() }), ..self }
    }

    /// The allowed values with their unit, for messages and docs; empty if all are allowed.
    pub fn allowed(&self) -> String {
        match (self.allowed.words(), self.unit) {
            (words, _) if words.is_empty() => words,
            (words, unit) => words + &suffix(unit),
        }
    }

    pub(super) fn check(&self, settings: &Settings) -> Result<(), SceneError> {
        let mut wrong = None;
        (self.each)(settings, &mut |value| {
            if !self.allowed.has(value) {
                wrong.get_or_insert(value);
            }
        });
        let Some(value) = wrong else { return Ok(()) };
        let verb = match self.allowed {
            Allowed::Range(_, high) if high.is_finite() => "lie in",
            _ => "be",
        };
        let unit = if value.is_finite() { suffix(self.unit) } else { String::new() };
        refuse(self.key, format!("is {}{unit}, must {verb} {}", short(value), self.allowed()))
    }
}

/// A unit behind a number.
fn suffix(unit: &str) -> String {
    if unit.is_empty() || unit == "°" { unit.to_string() } else { format!(" {unit}") }
}

/// What a slider depends on.
impl Settings {
    pub(super) fn renders_rays(&self) -> bool {
        !self.mode.is_flat()
    }

    /// True if the mode can start rendering at the fluid (`unveil`).
    pub(super) fn can_unveil(&self) -> bool {
        self.renders_rays() && self.mode != Mode::Cube
    }

    /// True if the settings allow each pixel steps of its own (`ray.tolerance`).
    pub(super) fn can_tolerate(&self) -> bool {
        let is_alone = self.mode == Mode::Volume && self.volume.shading != Shading::FirstHit && self.still.is_none();
        is_alone && self.ray.sliding == 0 && !self.ray.adaptive
    }

    pub(super) fn shows_planes(&self) -> bool {
        self.mode.is_flat() || self.layout.has_planes()
    }

    pub(super) fn is_cube(&self) -> bool {
        self.mode == Mode::Cube
    }

    /// True if volume rendering is shown with a surface (mode mixed, layout pair), so that it has a window, a threshold and a start depth of its own.
    pub fn has_own_volume(&self) -> bool {
        self.mode == Mode::Mixed || self.layout == Layout::Pair
    }

    pub(super) fn is_first_hit(&self) -> bool {
        self.mode == Mode::Volume && self.volume.shading == Shading::FirstHit
    }

    pub(super) fn is_lit(&self) -> bool {
        matches!(self.mode, Mode::Surface | Mode::Mixed) || self.is_first_hit()
    }

    /// True if a light volume lights what is composited.
    pub(super) fn is_lit_inside(&self) -> bool {
        self.light.volume.is_some() && matches!(self.mode, Mode::Volume | Mode::Mixed)
    }

    pub(super) fn has_light(&self) -> bool {
        self.is_lit() || self.is_lit_inside()
    }
}

/// Lowest and highest start depth, mm below the probe's face, that leaves at least 1 mm of the region. The lowest is -infinity: no limit.
pub fn start_depths(scene: &Scene) -> [f64; 2] {
    [f64::NEG_INFINITY, scene.high.y - depth_offset(&scene.geometry) - 1.0]
}

/// A type of settings that consists of numbers.
pub(super) trait Numeric: Sized {
    /// Calls `take` with each of its numbers.
    fn each(&self, take: &mut dyn FnMut(f64));

    /// The value for one number. None for types of several numbers.
    fn of(_number: f64) -> Option<Self> {
        None
    }
}

/// Implements [`Numeric`] for types of one number, with the value for a number.
macro_rules! numeric {
    ($($of:ty: |$number:ident| $value:expr;)+) => {$(
        impl Numeric for $of {
            fn each(&self, take: &mut dyn FnMut(f64)) {
                take(f64::from(*self));
            }

            fn of($number: f64) -> Option<$of> {
                Some($value)
            }
        }
    )+};
}

numeric! {
    f64: |number| number;
    u32: |number| number.round() as u32;
    bool: |number| number >= 0.5;
}

/// 0 stands for no value.
impl<T: Numeric> Numeric for Option<T> {
    fn each(&self, take: &mut dyn FnMut(f64)) {
        self.iter().for_each(|value| value.each(take));
    }

    fn of(number: f64) -> Option<Option<T>> {
        if number > 0.0 { T::of(number).map(Some) } else { Some(None) }
    }
}

impl<T: Numeric, const N: usize> Numeric for [T; N] {
    fn each(&self, take: &mut dyn FnMut(f64)) {
        self.iter().for_each(|value| value.each(take));
    }
}

impl<T: Numeric> Numeric for Vec<T> {
    fn each(&self, take: &mut dyn FnMut(f64)) {
        self.iter().for_each(|value| value.each(take));
    }
}

impl Numeric for DVec3 {
    fn each(&self, take: &mut dyn FnMut(f64)) {
        self.to_array().each(take);
    }
}

impl Numeric for Edge {
    fn each(&self, take: &mut dyn FnMut(f64)) {
        if let Edge::Length(mm) = self {
            take(*mm);
        }
    }
}

/// Sets a value to a number; nothing changes if the type consists of several numbers.
pub(super) fn put<T: Numeric>(value: &mut T, number: f64) {
    if let Some(new) = T::of(number) {
        *value = new;
    }
}

/// Makes the [`Number`] of a setting from its path, its unit and the allowed values. In the path, `=>` follows a table that may be absent, or a list.
/// `[part]` before the path names a field of the settings whose keys stand beside theirs. After `;` follows its slider, if it has one: group, name, range, step, with which settings it affects pictures, and a hint.
macro_rules! number {
    ($first:ident $(. $field:ident)* $(=> $table:ident $(. $below:ident)*)*, $unit:expr, $allowed:expr; $($slider:expr),+) => {
        number!($first $(. $field)* $(=> $table $(. $below)*)*, $unit, $allowed).slider($($slider),+)
    };
    (@each $of:expr, $take:expr, $($field:ident).+) => {
        $crate::scene::number::Numeric::each(&$of.$($field).+, &mut *$take)
    };
    (@each $of:expr, $take:expr, $($field:ident).+ => $($rest:tt)+) => {
        for inner in $of.$($field).+.iter() { number!(@each inner, $take, $($rest)+) }
    };
    (@put $of:expr, $value:expr, $($field:ident).+) => {
        $crate::scene::number::put(&mut $of.$($field).+, $value)
    };
    (@put $of:expr, $value:expr, $($field:ident).+ => $($rest:tt)+) => {
        for inner in $of.$($field).+.iter_mut() { number!(@put inner, $value, $($rest)+) }
    };
    ($([$part:ident])? $first:ident $(. $field:ident)* $(=> $table:ident $(. $below:ident)*)*, $unit:expr, $allowed:expr) => {
        $crate::scene::number::Number::new(
            [concat!(stringify!($first) $(, ".", stringify!($field))* $(, ".", stringify!($table) $(, ".", stringify!($below))*)*), $unit],
            $allowed,
            |s, take| number!(@each s$(.$part)?, take, $first $(. $field)* $(=> $table $(. $below)*)*),
            |s, value| number!(@put s$(.$part)?, value, $first $(. $field)* $(=> $table $(. $below)*)*),
        )
    };
}
pub(super) use number;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Bilateral, BodyMark, Measurement, Slices, numbers};

    #[test]
    fn a_number_beyond_its_limits_is_refused_in_one_line_that_names_them() {
        let mark = BodyMark { probe: [0.0, f64::NAN], ..BodyMark::default() };
        let point = Measurement { points: vec![[0.0; 3], [2e6, 0.0, 0.0]], ..Measurement::default() };
        let filter = Bilateral { pixels: 2.0, mm: None, distance: -1.0, repeat: 1 };
        let mut all = [(); 6].map(|()| Settings::default());
        all[0].drawn.body_marks = vec![BodyMark::default(), mark];
        all[1].drawn.measure = vec![Measurement { points: vec![[0.0; 3]; 2], ..Measurement::default() }, point];
        all[2].distance.bilateral = Some(filter);
        all[3].ray.sliding = 4;
        all[4].ray.brick = Some(3);
        all[5].slices = Slices { estimator_edge: -1.0, ..Slices::default() };
        let said = all.map(|settings| settings.check().expect_err("refused").to_string());
        assert_eq!(
            said,
            [
                "scene: body_marks.probe: is NaN, must lie in -1..=1",
                "scene: measure.points: is 2e6 mm, must lie in -1e6..=1e6 mm",
                "scene: distance.bilateral.distance: is -1 mm, must lie in 1e-9..=1e9 mm",
                "scene: ray.sliding: is 4, must be 0, 3 or 5",
                "scene: ray.brick: is 3, must be 0 or 4..=64",
                "scene: slices.estimator_edge: is -1, must be at least 0",
            ]
        );
        assert!(Settings::default().check().is_ok());
    }

    #[test]
    fn a_key_has_one_row() {
        let mut keys: Vec<&str> = numbers().map(|number| number.key).collect();
        keys.sort_unstable();
        assert!(keys.windows(2).all(|two| two[0] != two[1]), "{keys:?}");
    }
}
