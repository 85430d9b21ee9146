//! What an earlier run of the program wrote.

use super::told;
use echolume::report::verify::baseline::{Options, compare};
use echolume::report::verify::json::{from_json, to_json};
use echolume::report::verify::{html, junit, words};

/// What is taken is written out and read back, does not differ from itself, and makes reports.
pub fn verification(bytes: &[u8]) -> String {
    let run = match from_json(&String::from_utf8_lossy(bytes)) {
        Ok(run) => run,
        Err(error) => return told(error),
    };
    let written = to_json(&run).expect("JSON");
    let again = from_json(&written).expect("what was written out is right");
    assert_eq!(to_json(&again).expect("JSON"), written);
    let compared = compare(&run, &again, &Options::default());
    assert!(compared.lines().is_empty(), "{:?}", compared.lines());
    junit::junit(&run, Some(&compared)).expect("XML");
    html::html(&run, Some(&compared)).expect("a page");
    told(words::summary(&run))
}
