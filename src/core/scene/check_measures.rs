//! Checks of measurements and annotations: their numbers of points, and their texts.

use super::{
    MAX_ALL_POINTS, MAX_CONTOURS, MAX_MADE, MAX_MEASURES, MAX_POINTS, MAX_TEXT, MeasureKind, Measurement, SceneError,
    refuse,
};
use std::ops::RangeInclusive;

pub(super) fn check_measures(all: &[Measurement]) -> Result<(), SceneError> {
    if all.len() > MAX_MEASURES {
        return refuse("measure", format!("has {} entries, at most {MAX_MEASURES}", all.len()));
    }
    let count: usize = all.iter().map(Measurement::count).sum();
    if count > MAX_ALL_POINTS {
        return refuse("measure", format!("has {count} points in all, at most {MAX_ALL_POINTS}"));
    }
    all.iter().enumerate().try_for_each(|(n, measured)| check(n + 1, measured))
}

fn check(number: usize, measured: &Measurement) -> Result<(), SceneError> {
    let Measurement { kind, points, contours, text, .. } = measured;
    let allowed = match (kind.complete_at(), kind) {
        (Some(count), _) => count..=count,
        (None, MeasureKind::Volume) => 0..=0,
        (None, MeasureKind::Trace) => 3..=MAX_POINTS,
        (None, _) => 2..=MAX_POINTS,
    };
    let limits = |what: &str, count: usize, allowed: RangeInclusive<usize>| match allowed.contains(&count) {
        true => Ok(()),
        false => {
            let (least, most) = allowed.into_inner();
            let allowed = if least == most { format!("{least}") } else { format!("{least} to {most}") };
            refuse("measure", format!("entry {number} ({}): has {count} {what}, must have {allowed}", kind.title()))
        }
    };
    limits("points", points.len(), allowed)?;
    limits("contours", contours.len(), if *kind == MeasureKind::Volume { 2..=MAX_CONTOURS } else { 0..=0 })?;
    contours.iter().try_for_each(|contour| limits("points in a contour", contour.len(), 3..=MAX_POINTS))?;
    let line = |field: &'static str, words: &str, most: usize| {
        let letters = words.chars().count();
        match letters > most || words.chars().any(char::is_control) {
            true => {
                refuse(field, format!("entry {number}: must be one line of at most {most} characters, has {letters}"))
            }
            false => Ok(()),
        }
    };
    line("measure.text", text, MAX_TEXT)?;
    if measured.interval.is_some_and(|[low, high]| low > high) {
        return refuse("measure.interval", format!("entry {number}: the lower end is above the upper one"));
    }
    let mut made = measured.made.iter().flat_map(|made| [&made.plane, &made.settings]);
    made.try_for_each(|words| line("measure.made", words, MAX_MADE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Made;

    fn of(kind: MeasureKind, count: usize) -> Measurement {
        Measurement { kind, points: vec![[1.0, 2.0, 3.0]; count], ..Measurement::default() }
    }

    #[test]
    fn wrong_measurements_are_refused_in_one_line_that_names_them() {
        for kind in MeasureKind::ALL {
            let right = match kind {
                MeasureKind::Volume => {
                    Measurement { contours: vec![vec![[0.0; 3]; 3]; 2], ..of(MeasureKind::Volume, 0) }
                }
                kind => of(kind, kind.complete_at().unwrap_or(3)),
            };
            assert!(check_measures(std::slice::from_ref(&right)).is_ok(), "{kind:?}");
            let fault = check_measures(&[right, of(kind, 1000)]).expect_err("too many points").to_string();
            assert!(fault.contains("entry 2") && fault.contains("1000"), "{fault}");
        }
        let long = Measurement { text: "a\nb".into(), ..of(MeasureKind::Text, 1) };
        assert!(check_measures(&[long]).is_err());
        let made = Some(Made { plane: "A".repeat(201), ..Made::default() });
        assert!(check_measures(&[Measurement { made, ..of(MeasureKind::Text, 1) }]).is_err());
        assert!(check_measures(&vec![of(MeasureKind::Text, 1); 65]).is_err());
    }
}
