//! `echolume segment`: a body in a file is measured, labelled in its place, and written; what is wrong is refused in a line.

use crate::common::program::*;
use echolume::low_level::segment::files::read;
use echolume::low_level::source::OpenOptions;
use std::fs;

const CENTRE: [f64; 3] = [3.0, -2.0, 11.0];
/// Of a ball of 9 mm, cm3.
const VOLUME: f64 = 4.0 / 3.0 * std::f64::consts::PI * 0.729;

/// A ball of 0.8 in 0.1, or the other way round, as linear floats with an edge of a voxel. The axes of the file may be left-handed.
pub fn ball(folder: &Folder, name: &str, is_dark: bool, hand: f64) -> String {
    let (size, spacing) = ([44, 40, 42], [0.7, 0.8, 0.75]);
    let origin = [CENTRE[0] - 15.0, CENTRE[1] - 15.6, CENTRE[2] - 15.4 * hand];
    let mut samples = Vec::new();
    for n in 0..size[0] * size[1] * size[2] {
        let cell = [n % size[0], n / size[0] % size[1], n / (size[0] * size[1])];
        let steps = [1.0, 1.0, hand];
        let offset = (0..3).map(|a| origin[a] + steps[a] * spacing[a] * cell[a] as f64 - CENTRE[a]);
        let share = (9.0 - offset.map(|d| d * d).sum::<f64>().sqrt() + 0.5).clamp(0.0, 1.0);
        let share = if is_dark { 1.0 - share } else { share };
        samples.extend((0.1 + 0.7 * share as f32).to_le_bytes());
    }
    let [x, y, z] = origin;
    let header = format!(
        "ObjectType = Image\nNDims = 3\nBinaryDataByteOrderMSB = False\nDimSize = 44 40 42\nElementType = MET_FLOAT\n\
         ElementSpacing = 0.7 0.8 0.75\nOffset = {x} {y} {z}\nTransformMatrix = 1 0 0 0 1 0 0 0 {hand}\nElementDataFile = LOCAL\n"
    );
    folder.write(name, [header.into_bytes(), samples].concat())
}

#[test]
fn a_body_in_a_file_is_measured_labelled_in_its_place_and_written() {
    let folder = Folder::new("segment");
    for (name, is_dark, hand) in [("bright.mha", false, 1.0), ("dark.mha", true, 1.0), ("mirrored.mha", false, -1.0)] {
        let (input, output) = (ball(&folder, name, is_dark, hand), folder.path("bodies.seg.nrrd"));
        let (csv, stl) = (folder.path("bodies.csv"), folder.path("body.stl"));
        let mut arguments = vec!["segment", &*input, "-o", &*output, "--csv", &*csv, "--stl", &*stl, "--smooth", "0.8"];
        arguments.extend(is_dark.then_some("--dark"));
        let said = done(&arguments);
        assert!(said.contains("bodies: 1") && said.contains("(linear)"), "{said}");
        let table = fs::read_to_string(&csv).expect("a table");
        let row: Vec<&str> = table.lines().nth(1).expect("a body").split(',').collect();
        let number = |n: usize| row[n].parse::<f64>().expect("a number");
        assert!((number(1) / VOLUME - 1.0).abs() < 0.01 && number(2) <= number(1) && number(1) <= number(3), "{table}");
        assert!((number(8) - 18.0).abs() < 0.1 && row[9] == "false", "{table}");
        // The labels lie where the ball does in the world, whatever the axes of the file.
        let (labels, segments) = read(output.as_ref(), OpenOptions::default()).expect("labels");
        assert_eq!((segments.len(), &*segments[0].name), (1, "body 1"));
        let [width, height, _] = labels.grid().size;
        let inside: Vec<usize> = (0..labels.voxels().len()).filter(|n| labels.voxels()[*n] == 1).collect();
        let index = |n: &usize| [n % width, n / width % height, n / (width * height)].map(|i| i as f64);
        let place =
            inside.iter().map(|n| labels.world().at(index(n).into())).sum::<glam::DVec3>() / inside.len() as f64;
        assert!(place.distance(CENTRE.into()) < 0.1, "{name}: {place}");
        assert!((inside.len() as f64 * 0.42e-3 / VOLUME - 1.0).abs() < 0.01);
        assert!(fs::metadata(&stl).expect("a mesh").len() > 50_000);
    }
}

/// The session of docs/tutorial.md: the chamber of the phantom's heart at rest is a ball of blood with a radius of 13 mm in a wall of 4 mm.
#[test]
fn the_interval_of_a_dark_chamber_holds_its_volume() {
    let folder = Folder::new("cyst");
    let [sweep, labels, csv] = ["cyst.mha", "cyst.seg.nrrd", "cyst.csv"].map(|name| folder.path(name));
    done(&["phantom", "--body", "heart", "--still", "-o", &sweep]);
    let segment =
        ["segment", &*sweep, "--dark", "--seed", "2,58,-1", "--smooth", "0.6", "-o", &*labels, "--csv", &*csv];
    let segmented = |more: &[&str]| {
        let said = done(&[&segment, more].concat());
        let table = fs::read_to_string(&csv).expect("a table");
        let row: Vec<f64> = table.lines().nth(1).expect("a body").split(',').take(8).flat_map(str::parse).collect();
        (said, table, row)
    };
    let (said, table, row) = segmented(&[]);
    let truth = 4.0 / 3.0 * std::f64::consts::PI * 1.3f64.powi(3);
    assert!((row[2]..=row[3]).contains(&truth), "{truth}: {table}");
    let off = glam::DVec3::new(row[5] - 2.0, row[6] - 58.0, row[7] + 1.0).length();
    assert!((row[1] / truth - 1.0).abs() < 0.03 && off < 0.5, "{truth}: {table}");
    // The printed threshold has the unit of --threshold.
    let printed = said.split("threshold ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a threshold");
    let (again, _, same) = segmented(&["--threshold", printed]);
    assert!(again.contains(&format!("threshold {printed} of")) && same[1..4] == row[1..4], "{said} {again}");
}

#[test]
fn a_seed_a_box_and_a_threshold_choose_what_is_labelled() {
    let folder = Folder::new("segment-choices");
    let (input, output, csv) = (ball(&folder, "ball.mha", false, 1.0), folder.path("a.seg.nrrd"), folder.path("a.csv"));
    let labelled = |more: &[&str]| {
        done(&[&["segment", &*input, "-o", &*output, "--csv", &*csv, "--smooth", "0"], more].concat());
        let table = fs::read_to_string(&csv).expect("a table");
        let row: Vec<String> = table.lines().nth(1).expect("a body").split(',').map(str::to_string).collect();
        (row[4].parse::<f64>().expect("a number") / VOLUME, row[9] == "true")
    };
    let (seeded, is_cut) = labelled(&["--seed", "3,-2,15"]);
    assert!((seeded - 1.0).abs() < 0.01 && !is_cut, "{seeded}");
    // Half of the ball, at the border of the box.
    let (half, is_cut) = labelled(&["--box", "lateral=3:40,elevation=-40:40"]);
    assert!((half - 0.5).abs() < 0.03 && is_cut, "{half}");
    // At 0.1 of the range the surface is 0.4 mm further out, at 0.9 as much further in.
    let [low, high] = ["0.1", "0.9"].map(|share| labelled(&["--threshold", share]).0);
    assert!(
        (low - (9.4f64 / 9.0).powi(3)).abs() < 0.02 && (high - (8.6f64 / 9.0).powi(3)).abs() < 0.02,
        "{low} {high}"
    );
}

#[test]
fn what_cannot_be_segmented_is_refused_in_one_line() {
    let folder = Folder::new("segment-refused");
    let (input, output) = (ball(&folder, "ball.mha", false, 1.0), folder.path("a.seg.nrrd"));
    let before = folder.names();
    let cases: [(&[&str], &[&str]); 11] = [
        (&["--threshold", "2"], &["--threshold 2", "auto"]),
        (&["--smooth", "-1"], &["--smooth", "0 or more"]),
        (&["--smooth", "500"], &["--smooth", "at most"]),
        (&["--decibels", "0"], &["--decibels", "1..=200"]),
        (&["--box", "depth=4"], &["--box", "LOW:HIGH"]),
        (&["--box", "depth=900:901"], &["--box", "depth"]),
        (&["--seed", "300,0,0"], &["ball.mha", "outside"]),
        (&["--seed", "-11,-16,-3", "--threshold", "0.5"], &["ball.mha", "no body"]),
        (&["--least", "500"], &["ball.mha", "no body"]),
        (&["--volume", "3"], &["--volume 3"]),
        (&["--stl", "a.obj"], &["a.obj", ".stl"]),
    ];
    for (more, named) in cases {
        let all = [&["segment", &*input, "-o", &*output], more].concat();
        refuses(&all, &run(&all), 2, named);
    }
    let other = ["segment", &*input, "-o", &*folder.path("a.nrrd")];
    refuses(&other, &run(&other), 2, &[".seg.nrrd"]);
    assert_eq!(folder.names(), before);
}
