//! Marks while a picture is kept: the settings ask for another one, which is not drawn yet.

use super::shown::Shown;
use super::*;
use crate::panels::colours::MEASURE;
use crate::panels::drawn::{Area, Drawn, Kind};

impl Shown {
    /// What is drawn over the picture in this area, points: marks, but neither panels nor messages.
    fn marks_in(&self, area: Area) -> Vec<Drawn> {
        let is_inside = |clip: &Area| {
            clip[0] >= area[0] - 0.5 && clip[1] >= area[1] - 0.5 && clip[2] <= area[2] + 0.5 && clip[3] <= area[3] + 0.5
        };
        self.drawn.iter().filter(|drawn| is_inside(&drawn.clip)).cloned().collect()
    }

    fn picture_area(&self) -> Area {
        let ([x, y], [w, h]) = crate::panels::picture_area(self.size, 1.0, true);
        [x, y, x + w, y + h].map(|n| n as f32)
    }
}

/// Requirement: letters, rulers, bars, axes, colours and measurements of the new view never lie over the old picture. Ten changes, one after the other, each
/// while its picture is held up; then the picture comes.
#[test]
fn marks_of_a_new_view_come_with_its_picture() {
    let caliper = "\nmeasure=[{ kind = 'distance', points = [[-20, 60, 0], [20, 60, 0]] }]";
    let mut shown = Shown::new(&format!("mode='plane'\nplanes.position=[0,60,0]\nmarks.lateral='right-left'{caliper}"));
    let changes: [(&str, Command); 10] = [
        ("layout", Command::Layout(Layout::Four)),
        ("mode of 4-up", Command::Mode(Mode::Mip)),
        ("mode", Command::Mode(Mode::Orthogonal)),
        ("plane", Command::StepPlane(7.0)),
        ("zoom", Command::Zoom(2.0)),
        ("tomography", Command::Mode(Mode::Tomography)),
        ("other slices", Command::Plane(PlaneName::C)),
        ("pair", Command::Layout(Layout::Pair)),
        ("view", Command::Rotate([40.0, 10.0])),
        ("opacities", Command::Mode(Mode::Volume)),
    ];
    let mut others = 0;
    for (what, command) in changes {
        let area = shown.picture_area();
        let before = shown.marks_in(area);
        shown.kept = Some(shown.scene.clone());
        shown.apply(command);
        // A turning view is followed by several drawings of the panels.
        shown.settle();
        assert!(shown.marks_in(area) == before, "{what}: marks of another picture");
        shown.kept = None;
        shown.settle();
        others += usize::from(shown.marks_in(area) != before);
    }
    assert!(others >= 7, "only {others} changes change marks");
}

/// Prevents marks of the new size over a picture of the old one: they stay at the pixels of the picture that is shown, as far as these are in sight.
#[test]
fn marks_stay_at_the_pixels_of_a_picture_of_another_size() {
    let caliper = "\nmeasure=[{ kind = 'distance', points = [[-9, 60, 0], [9, 60, 0]] }]";
    for size in [[1400, 900], [1200, 780]] {
        let mut shown = Shown::new(&format!("mode='plane'\nplanes.position=[0,60,0]{caliper}"));
        let ends = |shown: &Shown| -> Vec<[[f32; 2]; 2]> {
            let area = shown.picture_area();
            let lines = shown.marks_in(area).into_iter().filter_map(|drawn| match drawn.kind {
                Kind::Line { ends, colour, .. } if colour == MEASURE.to_array() => Some(ends),
                _ => None,
            });
            lines.collect()
        };
        let before = ends(&shown);
        assert!(before.len() >= 4, "the caliper");
        shown.kept = Some(shown.scene.clone());
        shown.size = size;
        shown.controls.resize(crate::panels::picture_area(size, 1.0, true).1);
        shown.settle();
        assert_eq!(ends(&shown), before, "{size:?}");
    }
}
