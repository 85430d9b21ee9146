//! Checks of body marks.

use super::check::within;
use super::{BODY_MARK_SIZES, BodyMark, MAX_BODY_MARKS, SceneError, refuse};

pub(super) fn check_body_marks(all: &[BodyMark]) -> Result<(), SceneError> {
    if all.len() > MAX_BODY_MARKS {
        return refuse("body_marks", format!("has {} entries, at most {MAX_BODY_MARKS}", all.len()));
    }
    for mark in all {
        mark.at.iter().try_for_each(|share| within("body_marks.at", *share, 0.0, 1.0))?;
        mark.probe.iter().try_for_each(|share| within("body_marks.probe", *share, -1.0, 1.0))?;
        within("body_marks.size", mark.size, BODY_MARK_SIZES[0], BODY_MARK_SIZES[1])?;
        within("body_marks.angle", mark.angle, -360.0, 360.0)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_body_marks_are_refused_in_one_line_that_names_the_setting() {
        let right = BodyMark::default();
        assert!(check_body_marks(&[right; MAX_BODY_MARKS]).is_ok());
        for (name, wrong) in [
            ("body_marks.at", BodyMark { at: [0.5, 1.1], ..right }),
            ("body_marks.probe", BodyMark { probe: [f64::NAN, 0.0], ..right }),
            ("body_marks.size", BodyMark { size: 0.0, ..right }),
            ("body_marks.angle", BodyMark { angle: f64::INFINITY, ..right }),
        ] {
            let fault = check_body_marks(&[right, wrong]).expect_err(name);
            assert_eq!(fault.field, name);
            assert!(!fault.to_string().contains('\n'), "{fault}");
        }
        assert!(check_body_marks(&[right; MAX_BODY_MARKS + 1]).is_err());
    }
}
