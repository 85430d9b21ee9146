//! The results of measurements: their quantities with units, a label, and all of them as CSV.

use super::contours;
use super::shapes::{self, Ellipse};
use crate::scene::{MeasureKind, Measurement};
use crate::segment::sections::Arrangement;
use crate::text::csv_quoted;
use crate::tree::ToNode;
use glam::DVec3;
use std::fmt::Write as _;

/// A measured quantity.
#[derive(Clone, Debug, PartialEq, ToNode)]
pub struct Quantity {
    pub name: &'static str,
    pub value: f64,
    /// Unit of the value: mm, cm2, cm3 or deg; empty for an echo, whose range is 0..=255.
    pub unit: &'static str,
}

impl Quantity {
    fn of(name: &'static str, value: f64, unit: &'static str) -> Quantity {
        Quantity { name, value, unit }
    }

    /// Value and unit for users: mm and degrees to a tenth, cm^2 and cm^3 to a hundredth, an echo as a whole number.
    pub fn shown(&self) -> String {
        let value = self.value;
        match self.unit {
            "mm" => format!("{value:.1} mm"),
            "deg" => format!("{value:.1}°"),
            "cm2" => format!("{value:.2} cm²"),
            "cm3" => format!("{value:.2} cm³"),
            // An echo of 0..=255, as the colour bar has it.
            _ => format!("{value:.0}"),
        }
    }
}

fn places(points: &[[f64; 3]]) -> Vec<DVec3> {
    points.iter().map(|point| DVec3::from(*point)).collect()
}

/// The quantities that a measurement gives, the most important one first; empty for texts and arrows.
///
/// # Errors
/// One line: the reason why its points give no result.
pub fn quantities(measured: &Measurement) -> Result<Vec<Quantity>, &'static str> {
    let points = places(&measured.points);
    Ok(match (measured.kind, &points[..]) {
        (MeasureKind::Distance, [from, to]) => vec![Quantity::of("distance", from.distance(*to), "mm")],
        (MeasureKind::Angle, [leg, vertex, other]) => {
            let angle = shapes::angle(*leg, *vertex, *other).ok_or("a leg of the angle has no length")?;
            vec![Quantity::of("angle", angle, "deg")]
        }
        (MeasureKind::Ellipse, [from, to, side]) => {
            let ellipse = Ellipse::of([*from, *to, *side]).ok_or("an axis of the ellipse has no length")?;
            let [long, short] = ellipse.axes();
            vec![
                Quantity::of("area", ellipse.area() / 100.0, "cm2"),
                Quantity::of("circumference", ellipse.circumference(), "mm"),
                Quantity::of("long axis", long, "mm"),
                Quantity::of("short axis", short, "mm"),
            ]
        }
        (MeasureKind::Trace, [_, _, _, ..]) => vec![
            Quantity::of("area", shapes::area(&points) / 100.0, "cm2"),
            Quantity::of("circumference", shapes::perimeter(&points), "mm"),
        ],
        (MeasureKind::Surface, [from, .., to]) => vec![
            Quantity::of(measured.way(), shapes::length(&points), "mm"),
            Quantity::of("straight", from.distance(*to), "mm"),
        ],
        (MeasureKind::Volume, _) => {
            let contours: Vec<Vec<DVec3>> = measured.contours.iter().map(|contour| places(contour)).collect();
            let (mm3, how) = contours::volume(&contours)?;
            let name = match how {
                Arrangement::Parallel { .. } => "volume by parallel contours",
                Arrangement::Rotated { .. } => "volume by rotated contours",
            };
            vec![Quantity::of(name, mm3 / 1000.0, "cm3")]
        }
        (MeasureKind::Threshold, _) => {
            let counted = measured.counted.ok_or("no voxels were counted")?;
            let volume = |name, mm3| Quantity::of(name, mm3 / 1000.0, "cm3");
            let first = match measured.interval {
                Some([low, high]) => {
                    vec![volume("volume by echoes", counted), volume("95 % from", low), volume("95 % to", high)]
                }
                None => vec![volume("volume by threshold", counted)],
            };
            let threshold = measured.threshold.map(|share| Quantity::of("threshold", share * 255.0, ""));
            first.into_iter().chain(threshold).collect()
        }
        (MeasureKind::Text | MeasureKind::Arrow, _) => Vec::new(),
        _ => return Err("points are missing"),
    })
}

/// The label of a measurement on the picture: its number (in the list, from 1), its text and its first quantity, or `-` without a result. Texts and
/// arrows have only their text.
pub fn label(number: usize, measured: &Measurement) -> String {
    if matches!(measured.kind, MeasureKind::Text | MeasureKind::Arrow) {
        return measured.text.clone();
    }
    let found = match quantities(measured) {
        Ok(found) => found.first().map_or(String::new(), Quantity::shown),
        Err(_) => "-".into(),
    };
    // A length along a curved plane is no straight one, which the same two points have on other planes.
    let is_along = measured.kind == MeasureKind::Surface && !measured.on_surface;
    let found = if is_along { format!("{found} {}", measured.way()) } else { found };
    match measured.text.is_empty() {
        true => format!("{number}: {found}"),
        false => format!("{number}: {} {found}", measured.text),
    }
}

/// All results as CSV: the names of the columns, then a line for each quantity, with the conditions of the measurement if they are known. Values and
/// times have a decimal point and four decimals. `recording`: name of the recording; empty for live volumes.
pub fn csv(all: &[Measurement], recording: &str) -> String {
    csv_with(all, recording, "", |_| String::new())
}

/// The results as CSV as [`csv`] writes them, with further columns: their names, and their values for the measurement with a number (from 1), each
/// behind a comma.
pub(crate) fn csv_with(all: &[Measurement], recording: &str, names: &str, more: impl Fn(usize) -> String) -> String {
    const COLUMNS: &str = "number,measurement,text,quantity,value,unit,recording,volume,time,plane,settings";
    let mut text = format!("{COLUMNS}{names}\n");
    let recording = csv_quoted(recording);
    for (n, measured) in all.iter().enumerate() {
        let made = measured.made.as_ref();
        let volume = made.map_or(String::new(), |made| made.volume.to_string());
        let time = made.and_then(|made| made.time).map_or(String::new(), |time| format!("{time:.4}"));
        let [plane, settings] = made.map_or([""; 2], |made| [&made.plane, &made.settings]).map(csv_quoted);
        let on = format!("{recording},{volume},{time},{plane},{settings}{}", more(n + 1));
        for Quantity { name, value, unit } in quantities(measured).unwrap_or_default() {
            let (kind, label) = (measured.title(), csv_quoted(&measured.text));
            let _ = writeln!(text, "{},{kind},{label},{name},{value:.4},{unit},{on}", n + 1);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Made;

    fn of(kind: MeasureKind, points: &[[f64; 3]]) -> Measurement {
        Measurement { kind, points: points.to_vec(), ..Measurement::default() }
    }

    fn shown(measured: &Measurement) -> Vec<String> {
        quantities(measured).expect("results").iter().map(Quantity::shown).collect()
    }

    #[test]
    fn every_kind_has_its_results_in_the_units_of_the_field() {
        let points = [[0.0, 10.0, 0.0], [30.0, 10.0, 0.0], [30.0, 30.0, 0.0]];
        assert_eq!(shown(&of(MeasureKind::Distance, &points[..2])), ["30.0 mm"]);
        assert_eq!(shown(&of(MeasureKind::Angle, &points)), ["90.0°"]);
        assert_eq!(shown(&of(MeasureKind::Trace, &points)), ["3.00 cm²", "86.1 mm"]);
        assert_eq!(shown(&of(MeasureKind::Surface, &points)), ["50.0 mm", "36.1 mm"]);
        let round = [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 0.0, 10.0]];
        assert_eq!(shown(&of(MeasureKind::Ellipse, &round)), ["3.14 cm²", "62.8 mm", "20.0 mm", "20.0 mm"]);
        let square =
            |depth: f64| [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]].map(|[x, z]| [x, depth, z]).to_vec();
        let contours = vec![square(5.0), square(10.0)];
        let volume = Measurement { kind: MeasureKind::Volume, contours, ..Measurement::default() };
        assert_eq!(shown(&volume), ["1.00 cm³"]);
        let counted = Measurement { counted: Some(1234.0), ..of(MeasureKind::Threshold, &points[..2]) };
        assert_eq!(shown(&counted), ["1.23 cm³"]);
        let found = Measurement { interval: Some([1200.0, 1300.0]), threshold: Some(0.4), ..counted };
        assert_eq!(shown(&found), ["1.23 cm³", "1.20 cm³", "1.30 cm³", "102"]);
        assert!(shown(&of(MeasureKind::Text, &points[..1])).is_empty());
        assert!(quantities(&of(MeasureKind::Angle, &points[..2])).is_err());
    }

    #[test]
    fn labels_and_csv_have_the_numbers_of_the_list() {
        let nose = Measurement {
            text: "nose, \"long\"".into(),
            ..of(MeasureKind::Distance, &[[0.0; 3], [0.0, 12.3456, 0.0]])
        };
        let note = Measurement { text: "cord".into(), ..of(MeasureKind::Text, &[[0.0; 3]]) };
        assert_eq!(label(1, &nose), "1: nose, \"long\" 12.3 mm");
        assert_eq!(label(2, &note), "cord");
        assert_eq!(label(3, &of(MeasureKind::Distance, &[])), "3: -");
        let made =
            Made { volume: 7, time: Some(1.25), plane: "A at 0.0, 5.0, 0.0 mm".into(), settings: "Plane 1f".into() };
        let other = Measurement { made: Some(made), ..nose.clone() };
        let lines = [
            "number,measurement,text,quantity,value,unit,recording,volume,time,plane,settings",
            "2,Caliper,\"nose, \"\"long\"\"\",distance,12.3456,mm,\"a,b.mha\",,,\"\",\"\"",
            "3,Caliper,\"nose, \"\"long\"\"\",distance,12.3456,mm,\"a,b.mha\",7,1.2500,\"A at 0.0, 5.0, 0.0 mm\",\"Plane 1f\"",
        ];
        assert_eq!(csv(&[note, nose, other], "a,b.mha").lines().collect::<Vec<_>>(), lines);
    }
}
