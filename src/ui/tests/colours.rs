//! Contrast of everything that the panels draw, by WCAG 2.2 (AA): 4.5 for text, 3 for large text (from 24 px on), for boundaries of controls, their
//! states, lines and marks; of what cannot be used it demands none. And colours that have a meaning, as people with each kind of dichromacy see them.

use super::shown::Shown;
use super::*;
use crate::measure::overlay;
use crate::panels::accesskit::Role;
use crate::panels::colours::{
    ABSENT, ACCENT, AXES, BACKGROUND, BUTTON, EDGE, FAULT, FOCUS, FOCUS_EDGE, GOOD, MEASURE, OUTLINE, PANEL, SELECTED,
    START, WARNING, of_scene,
};
use crate::panels::drawn::{Area, Colour, Drawn, Kind};
use crate::panels::{Banner, Note};
use crate::scene::planes::{CURVE_COLOUR, colour};

const OF_TEXT: f64 = 4.5;
const OF_LARGE_TEXT: f64 = 3.0;
const OF_GRAPHICS: f64 = 3.0;
/// 18 pt are 24 px.
const LARGE: f32 = 24.0;
/// What a picture may show behind a mark: fluid, tissue, bone, and the colour of skin.
const PICTURES: [[f64; 3]; 4] = [[0.0; 3], [128.0; 3], [255.0; 3], [233.0, 190.0, 150.0]];

fn linear(channel: f64) -> f64 {
    let share = channel / 255.0;
    if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
}

/// Contrast ratio of two opaque colours, 0..=255 a channel (WCAG 2.2, "contrast ratio").
fn contrast(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [a, b] = [a, b].map(|[r, g, b]| 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

/// A premultiplied colour over an opaque one.
fn over([r, g, b, a]: Colour, behind: [f64; 3]) -> [f64; 3] {
    let left = 1.0 - f64::from(a) / 255.0;
    let new = [r, g, b].map(f64::from);
    std::array::from_fn(|n| new[n] + behind[n] * left)
}

fn opaque([r, g, b, _]: Colour) -> [f64; 3] {
    [r, g, b].map(f64::from)
}

#[allow(clippy::manual_range_contains)] // Millions of calls, of code that is not optimised.
fn holds([left, top, right, bottom]: Area, [x, y]: [f32; 2]) -> bool {
    left <= x && x <= right && top <= y && y <= bottom
}

fn middle([left, top, right, bottom]: Area) -> [f32; 2] {
    [(left + right) / 2.0, (top + bottom) / 2.0]
}

/// What is behind a place before the n-th thing is drawn, the picture being of one colour.
fn behind(shown: &Shown, n: usize, at: [f32; 2], picture: [f64; 3]) -> [f64; 3] {
    let ([x, y], [w, h]) = crate::panels::picture_area(shown.size, 1.0, shown.visible.panels);
    let is_on_picture = holds([x as f32, y as f32, (x + w) as f32, (y + h) as f32], at);
    let from = if is_on_picture { picture } else { opaque(BACKGROUND.to_array()) };
    shown.drawn[..n].iter().filter(|drawn| holds(drawn.clip, at)).fold(from, |below, drawn| match &drawn.kind {
        Kind::Rect { area, fill, .. } if holds(*area, at) => over(*fill, below),
        Kind::Circle { centre, radius, fill, .. } if (at[0] - centre[0]).hypot(at[1] - centre[1]) < *radius => {
            over(*fill, below)
        }
        _ => below,
    })
}

/// The dark edge around text: the same letters drawn before in all eight directions.
fn edge_of_text(shown: &Shown, n: usize) -> Option<Colour> {
    let Kind::Text { area, text, .. } = &shown.drawn[n].kind else { return None };
    let at = middle(*area);
    let mut directions = [false; 8];
    for drawn in &shown.drawn[..n] {
        if let Kind::Text { area, text: same, colours, .. } = &drawn.kind
            && same == text
            && colours.iter().all(|colour| *colour == OUTLINE.to_array())
        {
            let away = [0, 1].map(|a| middle(*area)[a] - at[a]);
            if (0.5..2.5).contains(&away[0].hypot(away[1])) {
                let eighth = (away[1].atan2(away[0]) / std::f32::consts::FRAC_PI_4).round() as i32;
                directions[eighth.rem_euclid(8) as usize] = true;
            }
        }
    }
    directions.iter().all(|is| *is).then(|| OUTLINE.to_array())
}

/// The dark edge along a line: the same line drawn before, at least a pixel wider on each side.
fn edge_of_line(shown: &Shown, n: usize) -> Option<Colour> {
    let Kind::Line { ends, width, .. } = shown.drawn[n].kind else { return None };
    shown.drawn[..n].iter().find_map(|drawn| match drawn.kind {
        Kind::Line { ends: same, width: wider, colour } if same == ends && wider >= width + 1.9 => Some(colour),
        _ => None,
    })
}

/// Every text, line and mark against what is next to it, whatever the picture shows.
fn check(shown: &Shown, what: &str) {
    let off: Vec<Area> = shown.tree.values().filter(|node| node.is_disabled()).filter_map(bounds).collect();
    for (n, Drawn { clip, kind }) in shown.drawn.iter().enumerate() {
        for picture in PICTURES {
            let check = |colour: Colour, at: [f32; 2], edge: Option<Colour>, least: f64, name: &str| {
                if !holds(*clip, at) || colour[3] == 0 || off.iter().any(|area| holds(*area, at)) {
                    return;
                }
                let behind = behind(shown, n, at, picture);
                let next = edge.map_or(behind, |edge| over(edge, behind));
                let found = contrast(over(colour, behind), next);
                assert!(
                    found >= least,
                    "{what}: {name} at {at:?} on {picture:?}: {colour:?} has {found:.2}, not {least}"
                );
            };
            match kind {
                Kind::Text { area, text, size, colours } => {
                    let least = if *size >= LARGE { OF_LARGE_TEXT } else { OF_TEXT };
                    let edge = edge_of_text(shown, n);
                    let [left, top, right, bottom] = *area;
                    for colour in colours.iter().filter(|c| **c != OUTLINE.to_array() && **c != ABSENT.to_array()) {
                        // Also where a backing may not reach.
                        for at in [middle(*area), [left, top], [right, bottom]] {
                            check(*colour, at, edge, least, text);
                        }
                    }
                }
                Kind::Line { ends: [from, to], colour, .. } if *colour != OUTLINE.to_array() => {
                    let at = [0, 1].map(|a| (from[a] + to[a]) / 2.0);
                    check(*colour, at, edge_of_line(shown, n), OF_GRAPHICS, "a line");
                }
                Kind::Circle { centre, fill, edge, .. } if fill[..3] != [0; 3] => {
                    // Either shows where it is.
                    let best = [*fill, *edge].into_iter().max_by(|a, b| {
                        let of = |c: Colour| {
                            contrast(over(c, behind(shown, n, *centre, picture)), behind(shown, n, *centre, picture))
                        };
                        of(*a).total_cmp(&of(*b))
                    });
                    best.iter().for_each(|best| check(*best, *centre, None, OF_GRAPHICS, "a mark"));
                }
                Kind::Polygon { corners, fill } if corners.len() == 3 => {
                    let at = [0, 1].map(|a| corners.iter().map(|c| c[a]).sum::<f32>() / 3.0);
                    check(*fill, at, None, OF_GRAPHICS, "a sign");
                }
                _ => {}
            }
        }
    }
    check_boundaries(shown, what);
}

fn bounds(node: &crate::panels::accesskit::Node) -> Option<Area> {
    node.bounds().map(|b| [b.x0, b.y0, b.x1, b.y1].map(|n| n as f32))
}

/// Every control is told from what is around it by a boundary or by its text alone.
fn check_boundaries(shown: &Shown, what: &str) {
    for node in shown.tree.values().filter(|node| !node.is_disabled()) {
        let (Some(area), name) = (bounds(node), node.label().unwrap_or_default()) else { continue };
        let is_near = |other: Area| (0..4).all(|k| (other[k] - area[k]).abs() < 2.0);
        let is_inside = |other: Area| holds(area, [other[0], other[1]]) && holds(area, [other[2], other[3]]);
        let at = middle(area);
        // The name of a switch is in its row: where that is not in sight, the row is scrolled under the bar below.
        let names_it = |drawn: &&Drawn| matches!(&drawn.kind, Kind::Text { area: at, text, .. } if text == name && holds(area, middle(*at)));
        if node.role() == Role::Switch && !shown.drawn.iter().filter(names_it).any(|drawn| holds(drawn.clip, at)) {
            continue;
        }
        let rects = shown.drawn.iter().enumerate().filter_map(|(n, drawn)| match drawn.kind {
            Kind::Rect { area: rect, fill, edge } if holds(drawn.clip, at) && (fill[3] > 0 || edge[3] > 0) => {
                Some((n, rect, fill, edge))
            }
            _ => None,
        });
        let boundary: Vec<_> = match node.role() {
            Role::Button => rects.filter(|(_, rect, ..)| is_near(*rect)).collect(),
            Role::Switch => rects.filter(|(_, rect, ..)| is_inside(*rect) && rect[2] - rect[0] < 50.0).collect(),
            // The rail.
            Role::Slider => rects.filter(|(_, rect, ..)| is_inside(*rect) && rect[3] - rect[1] < 14.0).collect(),
            _ => continue,
        };
        if boundary.is_empty() {
            // A row that is its text, or one that is scrolled out of sight.
            let inside =
                shown.drawn.iter().filter(|drawn| holds(drawn.clip, at)).filter_map(|drawn| match &drawn.kind {
                    Kind::Text { area: text, .. } if holds(area, middle(*text)) => Some(true),
                    Kind::Rect { area: rect, .. } if holds(area, middle(*rect)) => Some(false),
                    _ => None,
                });
            let inside: Vec<bool> = inside.collect();
            let is_text = node.role() == Role::Button && inside.contains(&true);
            assert!(is_text || inside.is_empty(), "{what}: {name:?} has no boundary");
            continue;
        }
        // A fill and its edge may be drawn one after the other.
        let best = boundary.iter().flat_map(|(n, rect, fill, edge)| {
            let outside = behind(shown, *n, [rect[0] - 2.0, at[1]], PICTURES[0]);
            [*fill, *edge].map(|colour| contrast(over(colour, outside), outside))
        });
        let best = best.fold(0.0, f64::max);
        assert!(best >= OF_GRAPHICS, "{what}: the boundary of {name:?} has {best:.2}");
    }
}

/// Prevents text, a mark or a control that some users cannot see, in any mode, state or list.
#[test]
fn everything_that_is_drawn_has_the_contrast_that_wcag_demands() {
    for mode in Mode::ALL {
        for layout in [Layout::Single, Layout::Four, Layout::Beside, Layout::Pair] {
            let mut shown = Shown::new("marks.lateral='right-left'\nmarks.elevation='head-feet'");
            shown.apply(Command::Mode(mode));
            shown.apply(Command::Layout(layout));
            check(&shown, &format!("{mode:?} {layout:?}"));
        }
    }
    let mut shown = Shown::new("mode='surface'\nlayout='four'\nplanes.smooth={lateral=1,depth=1}\ncamera.azimuth=30");
    shown.apply(Command::Tool(Tool::Region));
    check(&shown, "the box of the region");
    // A window in which no control is half out of sight.
    let four = "mode='surface'\nlayout='four'\nplanes.smooth={lateral=1,depth=1}";
    let mut shown = Shown::sized(four, [1280, 1200], 1.0);
    shown.apply(Command::Tool(Tool::Region));
    shown.apply(Command::ToggleStartCurve);
    check(&shown, "the start line of the region");
    let mut shown = Shown::new("mode='plane'\nplanes.reference=true");
    shown.apply(Command::Tool(Tool::Measure(crate::scene::MeasureKind::Distance)));
    for point in [[0.0, 30.0, 0.0], [0.0, 40.0, 0.0], [0.0, 50.0, 0.0]] {
        shown.apply(Command::Point(point, false));
    }
    check(&shown, "measurements, and one in work");
    shown.apply(Command::Mode(Mode::Tomography));
    check(&shown, "slices");
    let mut shown =
        Shown::new("mode='orthogonal'\nplanes.curve={points=[[-20,40],[0,60],[25,45]]}\nmarks.lateral='right-left'");
    shown.apply(Command::Tool(Tool::Curve));
    check(&shown, "a curved plane");
    shown.apply(Command::CurvePoint(PlaneName::A, [-9.0, 50.0]));
    shown.apply(Command::CurvePoint(PlaneName::A, [5.0, 70.0]));
    check(&shown, "a line in work");
    let mut shown = Shown::new("mode='surface'");
    shown.timeliness.is_frozen = true;
    shown.pointers.of_mouse = Some([600.0, 400.0]);
    shown.budget = Some(Duration::from_millis(16));
    shown.times.passes = vec![("surface", 1.0, 3), ("shade", 0.5, 3)];
    for (n, what) in ["help", "times", "exports", "the question"].into_iter().enumerate() {
        shown.open(n);
        for picture in [Duration::from_millis(5), Duration::from_secs(1)] {
            // The first is within the budget; with the second the 95th percentile is over it.
            shown.times.pictures.add(picture);
            shown.settle();
            check(&shown, what);
        }
    }
    shown.close();
    shown.files = Some(("/data".into(), vec!["a.mha".into(), "b.toml".into()]));
    shown.settle();
    check(&shown, "files");
    shown.files = None;
    for naming in [None, Some("12 weeks".to_string())] {
        shown.presets = Some((vec!["Profile".into(), "12 weeks, thin".into()], naming));
        shown.settle();
        check(&shown, "presets");
    }
    shown.presets = None;
    shown.recordings = ["a.mha", "b.mha"].map(String::from).to_vec();
    for share in [None, Some(0.6), Some(1.0)] {
        let text = share.map_or(String::new(), |share| format!("{:.0} %", share * 100.0));
        shown.reading = Some(crate::panels::Reading { name: "c.mha".into(), share, text });
        shown.settle();
        check(&shown, "reading");
    }
    shown.reading = None;
    for is_fault in [true, false] {
        let (title, text) = ("No frames from the probe".to_string(), "Connection refused".to_string());
        shown.banner = Some(Banner { title, text, is_fault });
        shown.notes = vec![Note { text: "Saved a.png".into(), is_fault }];
        for has_drawn in [true, false] {
            shown.has_drawn = has_drawn;
            shown.settle();
            check(&shown, &format!("messages, fault {is_fault}, picture {has_drawn}"));
        }
    }
    shown.panels.toggle_focus();
    shown.settle();
    check(&shown, "the keyboard");
}

/// Prevents a choice, a place of the keyboard or a switch that is told by a shade that some cannot tell.
#[test]
fn states_are_told_apart() {
    for (a, b, what) in [
        (SELECTED, BUTTON, "a chosen button and another"),
        (SELECTED, PANEL, "the filled part of a rail"),
        (EDGE, PANEL, "a boundary, from outside"),
        (EDGE, BUTTON, "a boundary, from inside"),
        (EDGE, BACKGROUND, "a boundary in a message"),
        (FOCUS, FOCUS_EDGE, "the frame of the keyboard, on anything"),
    ] {
        let found = contrast(opaque(a.to_array()), opaque(b.to_array()));
        assert!(found >= OF_GRAPHICS, "{what}: {found:.2}");
    }
}

/// Kinds of colour vision: what the three types of dichromacy see of a colour in linear RGB. G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, "A
/// Physiologically-based Model for Simulation of Color Vision Deficiency", IEEE TVCG 15(6), 2009, table 1, severity 1.0.
const VISIONS: [(&str, [[f64; 3]; 3]); 4] = [
    ("usual", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    ("protanopia", [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]),
    (
        "deuteranopia",
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    ),
    ("tritanopia", [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]),
];

/// Least distance in CIELAB (CIE76) of colours that alone tell two meanings apart. At a third of a degree, 3.5 mm at 60 cm, half of all observers notice a
/// difference of 7.3 in L*, 10.0 in a* and 14.0 in b*: M. Stone, D. A. Szafir, V. Setlur, "An Engineering Model for Color Difference as a Function of
/// Size", Color and Imaging Conference 2014, ND(50 %, s) = 5.079 + 0.751/s, 5.339 + 1.541/s, 5.349 + 2.871/s. Twice the largest.
const TOLD_APART: f64 = 28.0;

/// CIELAB under D65 of a colour as a kind of vision has it.
fn lab(colour: [f64; 3], vision: &[[f64; 3]; 3]) -> [f64; 3] {
    let from = colour.map(linear);
    let times = |m: &[[f64; 3]; 3], v: [f64; 3]| m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
    let seen = times(vision, from).map(|c| c.clamp(0.0, 1.0));
    let to_xyz =
        [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]];
    let [x, y, z] = times(&to_xyz, seen);
    let f = |t: f64| if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 };
    let [x, y, z] = [x / 0.95047, y, z / 1.08883].map(f);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn distance(a: [f64; 3], b: [f64; 3], vision: &[[f64; 3]; 3]) -> f64 {
    let [a, b] = [a, b].map(|colour| lab(colour, vision));
    (0..3).map(|n| (a[n] - b[n]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn the_formulas_have_their_known_answers() {
    assert!((contrast([0.0; 3], [255.0; 3]) - 21.0).abs() < 1e-9);
    // The lightest grey that AA allows on white.
    assert!((contrast([118.0; 3], [255.0; 3]) - 4.54).abs() < 0.005);
    let [_, (_, protan), (_, deutan), (_, tritan)] = &VISIONS;
    let [red, green] = [[255.0, 0.0, 0.0], [0.0, 255.0, 0.0]];
    assert!((lab([255.0; 3], &VISIONS[0].1)[0] - 100.0).abs() < 0.01);
    // CIELAB of sRGB red: 53.24, 80.09, 67.20.
    assert!(lab(red, &VISIONS[0].1).iter().zip([53.24, 80.09, 67.20]).all(|(got, want)| (got - want).abs() < 0.02));
    for vision in [protan, deutan, tritan] {
        let [_, a, b] = lab([128.0; 3], vision);
        assert!(a.hypot(b) < 0.1, "grey stays grey: {a} {b}");
    }
    let usual = distance(red, green, &VISIONS[0].1);
    assert!([protan, deutan].iter().all(|vision| distance(red, green, vision) < 0.6 * usual));
    assert!(distance(red, green, tritan) > 0.6 * usual);
}

/// Pairs of meanings that a screen shows together, and those that some eyes cannot tell by colour: each of these has another sign, which the next test looks for.
#[test]
fn colours_with_a_meaning_are_told_apart_by_every_kind_of_vision() {
    let [a, b, c] = [PlaneName::A, PlaneName::B, PlaneName::C].map(|name| of_scene(colour(name)));
    let curved = of_scene(CURVE_COLOUR);
    let [lateral, depth, elevation] = AXES.map(|(_, colour)| colour);
    let pairs = [
        ("plane A", a, "plane B", b, false),
        ("plane A", a, "plane C", c, false),
        ("plane B", b, "plane C", c, true),
        ("plane A", a, "a measurement", MEASURE, true),
        ("plane B", b, "a measurement", MEASURE, false),
        ("plane C", c, "a measurement", MEASURE, false),
        ("a curved plane", curved, "plane A", a, false),
        ("a curved plane", curved, "plane B", b, false),
        ("a curved plane", curved, "plane C", c, false),
        ("a curved plane", curved, "a measurement", MEASURE, false),
        ("a curved plane", curved, "the start of rendering", START, false),
        ("lateral", lateral, "depth", depth, true),
        ("lateral", lateral, "elevation", elevation, false),
        ("depth", depth, "elevation", elevation, true),
        ("a warning", WARNING, "a fault", FAULT, false),
        ("a note", ACCENT, "a fault", FAULT, false),
        ("within the budget", GOOD, "over it", WARNING, false),
    ];
    for (first, one, second, other, has_sign) in pairs {
        let [one, other] = [one, other].map(|colour| opaque(colour.to_array()));
        let least = VISIONS.iter().map(|(name, vision)| (distance(one, other, vision), name));
        let (least, vision) = least.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a vision");
        assert_eq!(least < TOLD_APART, has_sign, "{first} and {second}: {least:.1} with {vision}");
    }
}

/// Planes have letters, axes names, and measurements a number and crosses.
#[test]
fn what_colours_alone_do_not_tell_has_another_sign() {
    let texts = |shown: &Shown| -> Vec<String> {
        let texts = shown.drawn.iter().filter_map(|drawn| match &drawn.kind {
            Kind::Text { text, colours, .. } if colours[0] != OUTLINE.to_array() => Some(text.clone()),
            _ => None,
        });
        texts.collect()
    };
    let planes = Shown::new("mode='orthogonal'");
    let marks = planes.scene.marks();
    for (tile, name) in marks.iter().zip(["A", "B", "C"]) {
        assert_eq!(tile.plane.map(|(letter, _)| letter), Some(name));
        assert!(texts(&planes).iter().any(|text| text == name), "the letter of plane {name}");
    }
    // An axis along the view is a point, and has no name; the two others lie across.
    let mut turned = Shown::new("mode='surface'");
    turned.apply(Command::Rotate([30.0, 20.0]));
    for (name, _) in AXES {
        assert!(texts(&turned).iter().any(|text| text == name), "{name}");
    }
    let mut measured = Shown::new("mode='orthogonal'");
    measured.apply(Command::Tool(Tool::Measure(crate::scene::MeasureKind::Distance)));
    let tiling = measured.scene.tiling();
    let tile = tiling.tile_at(100, 100).expect("the first tile");
    for at in [[100.0, 100.0], [180.0, 140.0]] {
        measured.apply(Command::Point(measured.scene.point_of(tiling.point(tile, at)), false));
    }
    let found = overlay::drawn(&measured.scene, None, measured.controls.measures());
    assert!(!found.is_empty() && found.iter().all(|drawn| drawn.points.len() == 2), "{found:?}");
    for drawn in &found {
        assert!(drawn.label.starts_with("1: ") && texts(&measured).contains(&drawn.label), "{}", drawn.label);
    }
    let crosses = measured.drawn.iter().filter(|drawn| match drawn.kind {
        Kind::Line { ends: [from, to], colour, .. } => {
            colour == MEASURE.to_array() && (from[0] - to[0]).hypot(from[1] - to[1]) == 10.0
        }
        _ => false,
    });
    assert_eq!(crosses.count(), found.len() * 4, "two strokes at each end");
}
