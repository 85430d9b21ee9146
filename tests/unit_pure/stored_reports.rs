//! The error reports that the documents show: each is complete, and its errors go where theory says.

use echolume::low_level::baselines::Stored;
use echolume::low_level::error_report::{Kind, Report};
use std::fs;
use std::path::Path;

fn stored() -> Vec<(String, Report)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reports");
    let files = fs::read_dir(&folder).expect("docs/reports").map(|entry| entry.expect("an entry").path());
    let mut all: Vec<_> = files
        .filter(|path| path.extension().is_some_and(|e| e == "json"))
        .map(|path| {
            let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
            let text = fs::read_to_string(&path).expect("a report");
            (name, Report::from_json(&text).unwrap_or_else(|fault| panic!("{}: {fault}", path.display())))
        })
        .collect();
    all.sort_by(|a, b| a.0.cmp(&b.0));
    assert!(!all.is_empty(), "no report is stored");
    all
}

/// Prevents a page and a plot of a report whose columns are empty, as they were when no time was measured.
#[test]
fn every_column_of_a_stored_report_is_filled() {
    for (name, report) in stored() {
        assert!(report.repeats >= 10, "{name}: intervals of {} runs", report.repeats);
        for dial in &report.dials {
            for point in &dial.points {
                let times = point.times.unwrap_or_else(|| panic!("{name}, {} {}: no time", dial.name, point.label));
                assert!(
                    times.volume.median > 0.0 && times.picture.median > 0.0,
                    "{name}, {} {}",
                    dial.name,
                    point.label
                );
                assert!(times.total.low < times.total.high, "{name}, {} {}: no interval", dial.name, point.label);
                assert!(point.ratios.is_some(), "{name}, {} {}: no ratio", dial.name, point.label);
            }
            // A pixel has one to three rays along an edge.
            let is_curve = dial.is_ordered && dial.kind != Kind::Pixels;
            let least = if is_curve { 4 } else { 2 };
            assert!(dial.points.len() >= least, "{name}, {}: {} points", dial.name, dial.points.len());
        }
        assert!(report.choices.len() > 20 && report.choices.iter().all(|c| c.times.is_some()), "{name}: choices");
        assert!(report.budget.shares.len() >= 4 && report.budget.total.rmse > 0.0, "{name}: budget");
    }
}

/// Prevents a reference that is another picture: then the error stays where it is however fine the step.
#[test]
fn errors_of_stored_reports_fall_as_theory_says() {
    for (name, report) in stored() {
        for dial in report.dials.iter().filter(|dial| ["step", "pipeline", "light-cell"].contains(&&*dial.name)) {
            let mut points: Vec<_> = dial.points.iter().map(|p| (p.value, p.errors.rmse)).collect();
            points.sort_by(|a, b| b.0.total_cmp(&a.0));
            let (first, last) = (points[0].1, points[points.len() - 1].1);
            // Cells differ by a factor of 4, and their error is about of order 1; its reference is off by as much as the last of them.
            let least = if dial.name == "light-cell" { 3.0 } else { 4.0 };
            assert!(first > least * last, "{name}, {}: {points:?}", dial.name);
            // Where the error is that of the device and its formats, it falls no more.
            let floor = dial.floor.unwrap_or(0.0).max(last);
            let falls = |pair: &[(f64, f64)]| pair[1].1 < 1.1 * pair[0].1 || pair[1].1 < 3.0 * floor;
            assert!(points.windows(2).all(falls), "{name}, {}: {points:?}", dial.name);
        }
        let budget = &report.budget;
        let largest = budget.shares.iter().map(|share| share.errors.rmse).fold(0.0, f64::max);
        // Errors may cancel or add up, but no approximation alone is much worse than all of them.
        assert!(budget.total.rmse > 0.5 * largest && budget.total.rmse < 2.0 * budget.sum(), "{name}: {budget:?}");
        assert!(report.dials.iter().any(|dial| dial.kind == Kind::Several), "{name}: the whole pipeline is a curve");
    }
}

/// Prevents a line through a point that is on no axis: names, and a tolerance that is none.
#[test]
fn only_points_of_an_axis_are_joined() {
    for (name, report) in stored() {
        for dial in &report.dials {
            let joined = dial.points.iter().filter(|point| dial.is_on_axis(point)).count();
            let wanted = match (dial.is_ordered, &*dial.name) {
                (false, _) => 0,
                (true, "tolerance") => 6,
                (true, _) => dial.points.len(),
            };
            assert_eq!(joined, wanted, "{name}, {}", dial.name);
        }
    }
}

/// Prevents a page that was not made from the reports beside it.
#[test]
fn the_page_states_the_stored_reports() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("docs/error-reports.md")).expect("the page");
    for (name, report) in stored() {
        let section = page.split("\n## ").find(|section| section.starts_with(&format!("{name}\n"))).expect("a section");
        for share in &report.budget.shares {
            let row = format!("| {}: {} | {:.1e} |", share.source, share.label, share.errors.rmse);
            let row = row.replace("e-", "e-0");
            assert!(section.contains(&row), "{name}: {row} is not on the page: run tools/reports --page");
        }
        assert!(section.contains(&report.device) && section.contains(&report.date[..10]), "{name}");
    }
    for picture in ["error-bone", "looks-bone", "readme-error"] {
        assert!(root.join(format!("docs/pictures/{picture}.png")).exists(), "{picture}");
    }
}
