//! `echolume report filters` as a user sees it.

use crate::common::program::*;
use std::fs;

const HEAD: &str = "tests/data/wobbler-4dc7/sweep.mha";
const AREAS: [&str; 6] = [
    "--crop",
    "lateral=-30:30,depth=40:80",
    "--region",
    "lateral=-28:-20,depth=44:52",
    "--background",
    "lateral=-4:9,depth=71:79",
];

/// A figure of a filter's only setting, or of its first.
fn figure(csv: &str, recording: &str, filter: &str, column: &str) -> Option<f64> {
    let mut lines = csv.lines();
    // Settings have commas within quotes: figures are counted from the end.
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let from_end = header.len() - header.iter().position(|name| *name == column).expect(column);
    let start = format!("\"{recording}\"");
    let line = lines.find(|l| l.starts_with(&start) && l.contains(&format!("\"{filter}\""))).expect("a row");
    line.rsplit(',').nth(from_end - 1).expect("a field").parse().ok()
}

#[test]
fn filters_are_compared_on_the_phantom_and_on_a_recording() {
    let folder = Folder::new("filters");
    let (md, csv, pictures) = (folder.path("f.md"), folder.path("f.csv"), folder.path("sheets"));
    let ask = ["report", "filters", HEAD, "--filter", "median", "--pixels", "256", "--repeat", "1"];
    let files = ["--markdown", &md, "--csv", &csv, "--pictures", &pictures];
    done(&[&ask[..], &AREAS[..], &files[..]].concat());
    let csv = fs::read_to_string(&csv).expect("csv");
    let of = |recording, filter, column| figure(&csv, recording, filter, column);
    // Fully developed speckle of 5.57 dB over 50 dB at a mean grey of the phantom's skin, a little less after scan conversion.
    let snr = of("phantom", "none", "snr").expect("a ratio");
    assert!((5.0..9.0).contains(&snr), "{snr}");
    for recording in ["phantom", "sweep"] {
        for column in ["snr", "cnr"] {
            let [none, median] = ["none", "median"].map(|f| of(recording, f, column).expect("a figure"));
            assert!(median > none, "{recording}: {column} {median}, {none} without the filter");
        }
    }
    for (column, sign) in [("ssim", 1.0), ("rmse", -1.0)] {
        let [none, median] = ["none", "median"].map(|f| of("phantom", f, column).expect("a figure"));
        assert!(sign * (median - none) > 0.0, "{column} {median}, {none} without the filter");
        assert_eq!(of("sweep", "median", column), None, "no truth of a recording is known");
    }
    let text = fs::read_to_string(&md).expect("markdown");
    for word in ["## phantom, frame 18", "## sweep, frame 15", "| median", "Pratt"] {
        assert!(text.contains(word), "{word} is missing from\n{text}");
    }
    for name in ["phantom.png", "sweep.png"] {
        let sheet =
            echolume::low_level::picture::Picture::load(&std::path::Path::new(&pictures).join(name)).expect(name);
        let levels: std::collections::BTreeSet<u8> = sheet.rgba.chunks_exact(4).map(|p| p[0]).collect();
        assert!(sheet.width > 500 && levels.len() > 100, "{name}: {} levels", levels.len());
    }
}

#[test]
fn wrong_areas_and_filters_are_refused_in_one_line() {
    let base = ["report", "filters", HEAD, "--filter", "median", "--repeat", "1", "--pixels", "256"];
    let refused = |more: &[&str], named: &[&str]| {
        let (code, _, err) = run(&[&base[..], more].concat());
        assert_eq!((code, err.lines().count()), (Some(2), 1), "{more:?}: {err}");
        named.iter().for_each(|word| assert!(err.contains(word), "{more:?} does not name {word}: {err}"));
    };
    refused(&[], &["--crop", "0 times for 1"]);
    let with = |at: usize, text: &'static str| {
        let mut areas = AREAS;
        areas[at] = text;
        areas
    };
    refused(&with(1, "lateral=-30:30"), &["--crop lateral=-30:30", "depth=LOW:HIGH"]);
    refused(&with(1, "lateral=-70:70,depth=0:99"), &["sweep.mha", "crop", "beyond the sector"]);
    refused(&with(3, "lateral=-28:-20,depth=10:20"), &["region", "beyond the crop"]);
    let (code, _, err) = run(&["report", "filters", "--filter", "medium"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("medium") && err.contains("Nagao-Matsuyama") && err.lines().count() == 1, "{err}");
}
