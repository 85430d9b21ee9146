//! The transfer function and the colour maps as tables, computed in f64.

use super::settings::{ColourMap, Compositing, Transfer, TransferName, TransferPoint, Volume};

/// Entries of the transfer table, unless the setting or points close to each other require more. The shader interpolates between them.
pub const ENTRIES: usize = 256;
/// Smallest and largest table that can be asked for.
const ENTRIES_RANGE: [usize; 2] = [16, 4096];
/// Largest table of pre-integrated compositing, which has its square: 16 MiB.
const MAX_PRE_INTEGRATED: usize = 1024;

/// Absorption of opacity 1 over one reference length, in place of the infinite -ln(1 - a): e^-1e6 is 0 in any float format.
pub const OPAQUE: f64 = 1e6;

/// Absorption kappa of opacity a over one reference length: min(-ln(1 - a), 1e6). `ln_1p` keeps all digits of a small a, unlike
/// GLSL's pow(1 - a, x).
pub fn absorption(opacity: f64) -> f64 {
    (-(-opacity.clamp(0.0, 1.0)).ln_1p()).min(OPAQUE)
}

/// The rule by which an opacity of the transfer function becomes absorption. Tables and exact integrals of rays use the same rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Absorption {
    /// Absorption where the opacity is 1, 1/mm; elsewhere in proportion to the opacity. None: opacities are those of one `reference_length`.
    pub extinction: Option<f64>,
    /// The length that opacities refer to where `extinction` is None, and over which [`Absorption::over_length`] gives the absorption, mm.
    pub reference_length: f64,
}

impl Absorption {
    /// The rule for opacities that refer to one reference length, mm.
    pub fn of_length(reference_length: f64) -> Absorption {
        Absorption { extinction: None, reference_length }
    }

    /// The rule that the settings of volume rendering ask for (`volume.extinction`). `reference_length`: mm.
    pub fn of(volume: &Volume, reference_length: f64) -> Absorption {
        Absorption { extinction: volume.extinction, reference_length }
    }

    /// Absorption over one reference length for an opacity in 0..1; at most [`OPAQUE`].
    pub fn over_length(self, opacity: f64) -> f64 {
        match self.extinction {
            Some(extinction) => (opacity * extinction * self.reference_length).min(OPAQUE),
            None => absorption(opacity),
        }
    }

    /// The opacity from which on the absorption is [`OPAQUE`], its maximum; above 1 if no opacity reaches it.
    pub fn opaque_from(self) -> f64 {
        self.extinction.map_or(1.0, |extinction| OPAQUE / (extinction * self.reference_length))
    }
}

/// Opacity of a step whose optical depth is y: 1 - exp(-y). A step of length ds has y = kappa ds / ds0, with the absorption kappa over one reference
/// length ds0.
pub fn opacity(y: f64) -> f64 {
    -(-y).exp_m1()
}

/// The control points of a transfer function; for a named one, those of that name.
pub fn resolved(transfer: &Transfer) -> Vec<TransferPoint> {
    match transfer {
        Transfer::Named(name) => named(*name),
        Transfer::Points(points) => points.clone(),
    }
}

/// The control points of volume rendering's transfer function (`volume.transfer`), with the colours and the opacities of other named functions where
/// `volume.colour` and `volume.opacity` are set.
pub fn of(volume: &Volume) -> Vec<TransferPoint> {
    let whole = resolved(&volume.transfer);
    if volume.colour.is_none() && volume.opacity.is_none() {
        return whole;
    }
    let [colours, opacities] = [volume.colour, volume.opacity].map(|name| name.map_or_else(|| whole.clone(), named));
    // Both are linear between the points of either.
    let mut places: Vec<f64> = colours.iter().chain(&opacities).map(|point| point.at).collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let point = |value: f64| {
        let ([r, g, b, _], [.., opacity]) = (at(&colours, value), at(&opacities, value));
        TransferPoint { at: value, colour: [r, g, b], opacity }
    };
    places.into_iter().map(point).collect()
}

/// Number of entries of the transfer function's table: as set; otherwise [`ENTRIES`], or more if two points are so close that the table would miss
/// what lies between them: the fewest that meet every point, or four between the closest points.
///
/// # Errors
/// The end of a sentence: the size is out of its range, or two points are closer than one entry of the largest table or of the size set.
pub fn entries(volume: &Volume) -> Result<usize, String> {
    let [least, most] = ENTRIES_RANGE;
    let pairs = matches!(volume.compositing, Compositing::PreIntegrated | Compositing::Exponential);
    let most = if pairs { MAX_PRE_INTEGRATED } else { most };
    let points = of(volume);
    let gaps = points.windows(2).enumerate().map(|(n, pair)| (n + 1, pair[1].at - pair[0].at));
    let (first, gap) = gaps.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((1, 1.0));
    // The slack is that of rounding: points at neighbouring entries are an entry apart.
    let resolves = |entries: usize| gap * (entries - 1) as f64 >= 1.0 - 1e-6;
    let narrow = |entries: usize, advice: &str| {
        let (next, width) = (first + 1, 1.0 / (entries - 1) as f64);
        format!(
            "points {first} and {next} are {gap:.2e} apart, less than one of {entries} entries ({width:.2e}): {advice}"
        )
    };
    if let Some(set) = volume.entries {
        let entries = set as usize;
        return match entries {
            n if n < least || n > most => Err(format!("is {set}, must lie in {least}..={most}")),
            n if !resolves(n) => Err(narrow(n, "leave volume.entries out, or raise it")),
            n => Ok(n),
        };
    }
    if resolves(ENTRIES) {
        return Ok(ENTRIES);
    }
    let meets = |entries: &usize| {
        let off = |at: f64| (at * (*entries - 1) as f64 - (at * (*entries - 1) as f64).round()).abs();
        resolves(*entries) && points.iter().all(|p| off(p.at) < 1e-6)
    };
    let four = (4.0 / gap).ceil() + 1.0;
    match (ENTRIES..=most).find(meets) {
        Some(entries) => Ok(entries),
        None if four <= most as f64 => Ok(four as usize),
        None => Err(narrow(most, "move them apart")),
    }
}

/// Red, green, blue and absorption over one reference length at `entries` (at least 2) equidistant sample values from 0 to 1. Below `threshold` the
/// absorption is 0.
pub fn table(points: &[TransferPoint], threshold: f64, entries: usize) -> Vec<[f64; 4]> {
    table_by(points, threshold, entries, Absorption::of_length(1.0))
}

/// The table of volume rendering's settings: red, green, blue and absorption over one reference length at equidistant sample values from 0 to 1, by
/// [`Volume::extinction`] if it is set, and 0 below the threshold. `reference_length`: mm.
pub(crate) fn table_of(volume: &Volume, reference_length: f64, entries: usize) -> Vec<[f64; 4]> {
    table_by(&of(volume), volume.threshold, entries, Absorption::of(volume, reference_length))
}

fn table_by(points: &[TransferPoint], threshold: f64, entries: usize, absorption: Absorption) -> Vec<[f64; 4]> {
    (0..entries)
        .map(|i| {
            let value = i as f64 / (entries - 1) as f64;
            let [r, g, b, a] = at(points, value);
            [r, g, b, if value < threshold { 0.0 } else { absorption.over_length(a) }]
        })
        .collect()
}

/// The pre-integrated table: mean absorption, and mean colour weighted by it, over the sample values between entries `front` (row) and
/// `back` (column) of a piecewise linear table. It holds for a step along which the value changes linearly.
pub fn pre_integrated(table: &[[f64; 4]]) -> Vec<[f64; 4]> {
    // Integrals from entry 0: absorption, and colour times absorption. The product of two linear functions is a parabola.
    let mut integrals = vec![[0.0; 4]];
    for pair in table.windows(2) {
        let [low, high] = [pair[0], pair[1]];
        let last = integrals[integrals.len() - 1];
        let colour = |c: usize| {
            let (l, h) = (low[c], high[c]);
            (2.0 * l * low[3] + l * high[3] + h * low[3] + 2.0 * h * high[3]) / 6.0
        };
        integrals.push(std::array::from_fn(|c| last[c] + if c < 3 { colour(c) } else { (low[3] + high[3]) / 2.0 }));
    }
    let between = |front: usize, back: usize| {
        let (low, high) = (front.min(back), front.max(back));
        let absorbed = integrals[high][3] - integrals[low][3];
        // Without absorption the colour is that of the middle entry; it has no effect.
        if low == high || absorbed <= 0.0 {
            let [r, g, b, here] = table[(low + high) / 2];
            return [r, g, b, absorbed / (high - low).max(1) as f64 + if low == high { here } else { 0.0 }];
        }
        let colour = |c: usize| (integrals[high][c] - integrals[low][c]) / absorbed;
        [colour(0), colour(1), colour(2), absorbed / (high - low) as f64]
    };
    let n = table.len();
    (0..n * n).map(|i| between(i / n, i % n)).collect()
}

/// What is wrong with an invalid transfer function, as the end of a sentence. None if it is valid.
pub fn fault(transfer: &Transfer) -> Option<String> {
    let Transfer::Points(points) = transfer else { return None };
    if points.is_empty() {
        return Some("needs at least one point".into());
    }
    let unit = |v: f64| (0.0..=1.0).contains(&v);
    for (i, p) in points.iter().enumerate() {
        if !unit(p.at) || !unit(p.opacity) || !p.colour.iter().all(|c| unit(*c)) {
            return Some(format!("point {}: at, colour and opacity must lie in 0..1", i + 1));
        }
        if i > 0 && points[i - 1].at >= p.at {
            return Some(format!("point {}: `at` must rise from point to point", i + 1));
        }
    }
    None
}

/// Red, green, blue and opacity of a sample value: linear between two points, constant beyond the first and the last.
pub fn at(points: &[TransferPoint], value: f64) -> [f64; 4] {
    let rgba = |p: &TransferPoint| [p.colour[0], p.colour[1], p.colour[2], p.opacity];
    let after = points.partition_point(|p| p.at <= value);
    match (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) {
        (Some(low), Some(high)) => {
            let share = (value - low.at) / (high.at - low.at);
            let (low, high) = (rgba(low), rgba(high));
            std::array::from_fn(|c| low[c] + (high[c] - low[c]) * share)
        }
        (Some(end), None) | (None, Some(end)) => rgba(end),
        (None, None) => [0.0; 4],
    }
}

fn named(name: TransferName) -> Vec<TransferPoint> {
    let points: &[(f64, [f64; 3], f64)] = match name {
        TransferName::Grey => &[(0.0, [0.0; 3], 0.0), (0.1, [0.1; 3], 0.0), (1.0, [1.0; 3], 0.2)],
        TransferName::Sepia => &[
            (0.0, [0.05, 0.02, 0.0], 0.0),
            (0.12, [0.25, 0.13, 0.05], 0.0),
            (0.5, [0.75, 0.5, 0.28], 0.05),
            (1.0, [1.0, 0.93, 0.78], 0.25),
        ],
        TransferName::Skin => &[
            (0.0, [0.15, 0.03, 0.01], 0.0),
            (0.2, [0.5, 0.2, 0.12], 0.0),
            (0.5, [0.85, 0.55, 0.42], 0.06),
            (1.0, [1.0, 0.9, 0.82], 0.35),
        ],
        TransferName::Cool => &[
            (0.0, [0.0, 0.02, 0.08], 0.0),
            (0.15, [0.05, 0.18, 0.4], 0.0),
            (0.5, [0.3, 0.6, 0.85], 0.06),
            (1.0, [0.95, 1.0, 1.0], 0.3),
        ],
        TransferName::Warm => &[
            (0.0, [0.08, 0.0, 0.0], 0.0),
            (0.15, [0.4, 0.08, 0.03], 0.0),
            (0.5, [0.9, 0.45, 0.12], 0.06),
            (1.0, [1.0, 0.97, 0.7], 0.3),
        ],
        TransferName::Bone => &[
            (0.0, [0.0, 0.0, 0.0], 0.0),
            (0.25, [0.25, 0.12, 0.08], 0.0),
            (0.5, [0.7, 0.6, 0.45], 0.05),
            (0.75, [0.95, 0.9, 0.8], 0.3),
            (1.0, [1.0, 1.0, 0.97], 0.6),
        ],
    };
    points.iter().map(|&(at, colour, opacity)| TransferPoint { at, colour, opacity }).collect()
}

/// Control points of a colour map at equidistant brightness from dark to bright, red, green and blue in 0..1; between them it is linear.
/// [`ColourMap::None`] has those of [`ColourMap::Grey`].
pub fn colour_map(map: ColourMap) -> [[f64; 3]; 5] {
    match map {
        ColourMap::None | ColourMap::Grey => std::array::from_fn(|i| [i as f64 / 4.0; 3]),
        ColourMap::Sepia => [[0.0; 3], [0.3, 0.19, 0.1], [0.62, 0.44, 0.27], [0.88, 0.72, 0.5], [1.0, 0.96, 0.86]],
        ColourMap::Skin => [[0.0; 3], [0.36, 0.15, 0.09], [0.71, 0.4, 0.28], [0.93, 0.68, 0.52], [1.0, 0.94, 0.87]],
        ColourMap::Ice => [[0.0; 3], [0.06, 0.16, 0.33], [0.2, 0.42, 0.64], [0.56, 0.76, 0.87], [0.95, 1.0, 1.0]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(table: &[(f64, [f64; 3], f64)]) -> Vec<TransferPoint> {
        table.iter().map(|&(at, colour, opacity)| TransferPoint { at, colour, opacity }).collect()
    }

    #[test]
    fn colours_and_opacities_are_chosen_apart() {
        let whole = Volume { transfer: Transfer::Named(TransferName::Skin), ..Volume::default() };
        assert_eq!(of(&whole), named(TransferName::Skin));
        let mixed = Volume { colour: Some(TransferName::Warm), opacity: Some(TransferName::Bone), ..whole.clone() };
        let (skin, warm, bone) = (of(&whole), named(TransferName::Warm), named(TransferName::Bone));
        for value in (0..=1000).map(|n| f64::from(n) / 1000.0) {
            let [r, g, b, a] = at(&of(&mixed), value);
            let ([wr, wg, wb, _], [.., ba]) = (at(&warm, value), at(&bone, value));
            assert!([r - wr, g - wg, b - wb, a - ba].iter().all(|off| off.abs() < 1e-12), "{value}");
            let [.., a] = at(&of(&Volume { colour: None, ..mixed.clone() }), value);
            let [r, ..] = at(&of(&Volume { opacity: None, ..mixed.clone() }), value);
            assert!((a - ba).abs() < 1e-12 && (r - wr).abs() < 1e-12);
            let coloured = at(&of(&Volume { colour: None, ..mixed.clone() }), value);
            assert!((coloured[0] - at(&skin, value)[0]).abs() < 1e-12, "{value}");
        }
    }

    #[test]
    fn a_small_opacity_keeps_its_digits_and_full_opacity_stays_finite() {
        for a in [1e-7, 1e-4, 0.5, 0.999] {
            assert!((opacity(absorption(a)) / a - 1.0).abs() < 1e-12, "{a}");
        }
        assert_eq!(absorption(1.0), OPAQUE);
        assert_eq!(opacity(absorption(1.0)), 1.0);
        assert_eq!(opacity(0.0), 0.0);
    }

    #[test]
    fn a_table_runs_through_its_points_and_stays_level_beyond_them() {
        let transfer =
            Transfer::Points(points(&[(0.2, [0.0, 0.0, 0.0], 0.0), (0.6, [1.0, 0.5, 0.0], 0.5), (0.7, [0.0; 3], 1.0)]));
        assert_eq!(fault(&transfer), None);
        let table = table(&resolved(&transfer), 0.0, ENTRIES);
        assert_eq!(table[0], [0.0, 0.0, 0.0, 0.0]);
        assert!((table[102][0] - 0.5).abs() < 1e-9, "{:?}", table[102]);
        assert_eq!(table[255], [0.0, 0.0, 0.0, OPAQUE]);
    }

    /// Prevents a spike between two entries, which draws nothing.
    #[test]
    fn narrow_points_get_the_table_that_meets_them_or_are_refused() {
        let spike = |half: f64| {
            let transfer = Transfer::Points(points(&[
                (0.5 - half, [1.0; 3], 0.0),
                (0.5, [1.0; 3], 0.5),
                (0.5 + half, [1.0; 3], 0.0),
            ]));
            Volume { transfer, ..Volume::default() }
        };
        assert_eq!(entries(&Volume::default()), Ok(ENTRIES));
        assert_eq!(entries(&spike(0.01)), Ok(ENTRIES));
        assert_eq!(entries(&spike(0.001)), Ok(1001));
        let tallest =
            |volume: &Volume, count: usize| table(&of(volume), 0.0, count).iter().map(|e| e[3]).fold(0.0, f64::max);
        assert_eq!(tallest(&spike(0.001), 1001), absorption(0.5));
        // What the default table made of it.
        assert_eq!(tallest(&spike(0.001), ENTRIES), 0.0);
        // No table meets these; four entries lie between two points.
        assert_eq!(entries(&spike(0.001_357_913)), Ok(2947));
        let said = entries(&spike(1e-5)).expect_err("too narrow for any table");
        assert!(said.contains("points 2 and 3") && said.contains("1.00e-5") && said.contains("4096"), "{said}");
        let set = |count: u32, half: f64| entries(&Volume { entries: Some(count), ..spike(half) });
        assert_eq!((set(16, 0.1), set(2001, 0.001)), (Ok(16), Ok(2001)));
        assert!(set(256, 0.001).expect_err("set too small").contains("volume.entries"));
        assert!(set(15, 0.1).is_err() && set(4097, 0.1).is_err());
        let pairs =
            |count| entries(&Volume { entries: count, compositing: Compositing::PreIntegrated, ..spike(0.001) });
        assert_eq!((pairs(None), pairs(Some(1024)), pairs(Some(1025)).is_err()), (Ok(1001), Ok(1024), true));
    }

    #[test]
    fn points_that_fall_or_leave_the_range_are_refused() {
        let falling = points(&[(0.5, [0.0; 3], 0.0), (0.5, [0.0; 3], 0.1)]);
        assert!(fault(&Transfer::Points(falling)).is_some());
        assert!(fault(&Transfer::Points(points(&[(0.5, [0.0; 3], f64::NAN)]))).is_some());
        assert!(fault(&Transfer::Points(vec![])).is_some());
    }
}
