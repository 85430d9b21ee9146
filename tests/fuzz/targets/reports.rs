//! Reports of earlier runs, and ordinary pictures.

use super::{told, written};
use echolume::low_level::baselines::{Stored, Threshold};
use echolume::low_level::error_report::choose::Bound;
use echolume::low_level::error_report::{Measure, Report, choose, export as error_export};
use echolume::low_level::picture::Grey;
use echolume::low_level::profile::{Profile, compare, export};
use echolume::low_level::scene::Settings;
#[cfg(feature = "view")]
use echolume::low_level::ui::frame_budget::measured_ladder;
use echolume::low_level::verify::report::{self, baseline, html as page, junit};
use echolume::low_level::worksheet::{Sheet, html, pdf};
use echolume::low_level::workspace::Workspace;
use std::path::Path;

pub fn error_report(bytes: &[u8]) -> String {
    let report = match Report::from_json(&String::from_utf8_lossy(bytes)) {
        Ok(report) => report,
        Err(error) => return told(error),
    };
    let written = report.to_json().expect("it was checked");
    assert_eq!(Report::from_json(&written).expect("what was written is right"), report);
    let mut outcome = String::new();
    for measure in [Measure::Rmse, Measure::Mm, Measure::Degrees] {
        error_export::summary_table(&report, measure);
        for bound in [Bound::Error(0.01), Bound::Time(1e7)] {
            let choice = choose::choose(&report, measure, bound, &[]);
            outcome += &choice.map_or_else(|e| e, |c| report.choices[c].describe(measure));
            outcome += &format!("{:?}", choose::proposals(&report.dials, Some(bound), 8));
        }
    }
    #[cfg(not(feature = "view"))]
    let rungs = 0;
    #[cfg(feature = "view")]
    let rungs = measured_ladder(&report).map_or(0, |rungs| rungs.len());
    format!("{} {rungs} {}", outcome.len(), error_export::csv(&report).len())
}

pub fn profile(bytes: &[u8]) -> String {
    let profile = match Profile::from_json(&String::from_utf8_lossy(bytes)) {
        Ok(profile) => profile,
        Err(error) => return told(error),
    };
    let written = profile.to_json().expect("it was checked");
    assert_eq!(Profile::from_json(&written).expect("what was written is right"), profile);
    let _ = (export::csv(&profile), export::csv_samples(&profile), export::profile_table(&profile));
    match compare::compare(&profile, &profile, &compare::CompareOptions::default()) {
        Ok(compared) => {
            assert_eq!(compared.regressions().count(), 0, "it is no slower than itself");
            export::comparison_table(&compared)
        }
        Err(error) => error.to_string(),
    }
}

/// What was read is what is written, and every form of it can be made.
pub fn worksheet(bytes: &[u8]) -> String {
    let sheet = match Sheet::read(&String::from_utf8_lossy(bytes)) {
        Ok(sheet) => sheet,
        Err(error) => return told(error),
    };
    let written = sheet.json().expect("JSON");
    assert_eq!(Sheet::read(&written).expect("what was written is right"), sheet);
    let workspace = Workspace::of_text(Path::new("report.json"), &sheet.source);
    let settings = workspace.and_then(|workspace| workspace.layers.finish().map_err(|e| e.to_string()));
    let (settings, outcome) = match settings {
        Ok(settings) => (settings, String::new()),
        Err(error) => (Settings::default(), error),
    };
    sheet.csv(&settings);
    html::write(&sheet, &settings, &[]).expect("a page");
    pdf::write(&sheet, &settings, &[]).expect("a PDF");
    told(outcome)
}

pub fn picture(bytes: &[u8]) -> String {
    match Grey::load(&written("picture", bytes)) {
        Ok(grey) => {
            assert_eq!(grey.values.len(), grey.width as usize * grey.height as usize);
            format!("{} {}", grey.sixteen, grey.from_colour)
        }
        Err(error) => told(error),
    }
}

/// An accepted run round-trips, does not differ from itself, and makes reports.
pub fn verification(bytes: &[u8]) -> String {
    let run = match report::Run::from_json(&String::from_utf8_lossy(bytes)) {
        Ok(run) => run,
        Err(error) => return told(error),
    };
    let written = run.to_json().expect("JSON");
    let again = report::Run::from_json(&written).expect("what was written out is right");
    assert_eq!(again.to_json().expect("JSON"), written);
    let compared = baseline::compare(&run, &again, Threshold::default());
    assert!(compared.lines().is_empty(), "{:?}", compared.lines());
    junit::junit(&run, Some(&compared)).expect("XML");
    page::html(&run, Some(&compared)).expect("a page");
    told(report::summary(&run))
}
