//! Figures of docs/validation.md: a test states what it measures, and the page shows it behind a comment with the figure's name,
//! `<!--wires-->0.074`.

use super::files::repository;
use std::ops::Range;
use std::sync::Mutex;

const PAGE: &str = "docs/validation.md";
/// Tests of a binary run at the same time.
static WRITING: Mutex<()> = Mutex::new(());

/// Where the number of a figure is on a page; `None` if the page does not have exactly one figure of this name.
pub fn place(page: &str, name: &str) -> Option<Range<usize>> {
    let mark = format!("<!--{name}-->");
    let (before, rest) = page.split_once(&mark)?;
    let length = rest.find(|c: char| !(c.is_ascii_digit() || ".e-".contains(c))).unwrap_or(rest.len());
    // A full stop or a hyphen behind the number is not part of it.
    let length = rest[..length].trim_end_matches(['.', '-', 'e']).len();
    let start = before.len() + mark.len();
    (length > 0 && !rest.contains(&mark)).then_some(start..start + length)
}

/// The value of the last digit of a decimal number: 0.01 of 2.50, 1e-7 of 7.7e-6.
fn last_digit(number: &str) -> f64 {
    let (digits, exponent) = number.split_once('e').unwrap_or((number, "0"));
    let decimals = digits.split_once('.').map_or(0, |(_, decimals)| decimals.len() as i32);
    10f64.powi(exponent.parse::<i32>().expect("an exponent") - decimals)
}

/// Whether two decimal numbers are equal to one of the last digit of `measured`.
pub fn agree(written: &str, measured: &str) -> bool {
    let value = |number: &str| number.parse::<f64>().unwrap_or_else(|e| panic!("{number}: {e}"));
    (value(written) - value(measured)).abs() < 1.01 * last_digit(measured)
}

/// Compares a measured number, rounded to the digits that the page shows, with the figure of this name: they may differ by one of the
/// last digit. With UPDATE_DOCS the number is written into the page instead. A figure of a device is stated by `Device::figure`.
pub fn figure(name: &str, measured: &str) {
    let _writing = WRITING.lock().unwrap_or_else(|e| e.into_inner());
    let path = repository(PAGE);
    let page = std::fs::read_to_string(&path).expect(PAGE);
    let place = place(&page, name).unwrap_or_else(|| panic!("{PAGE} must have exactly one figure {name}"));
    let written = &page[place.clone()];
    let agrees = agree(written, measured);
    if std::env::var_os("UPDATE_DOCS").is_some() {
        if written != measured {
            let changed = [&page[..place.start], measured, &page[place.end..]].concat();
            std::fs::write(path, changed).expect(PAGE);
        }
        return;
    }
    assert!(agrees, "{PAGE}: {name} is {written} there and {measured} here: run this test with UPDATE_DOCS=1");
}

/// The names of the figures of a page, in its order.
pub fn names(page: &str) -> Vec<&str> {
    let comments = page.split("<!--").skip(1).filter_map(|rest| rest.split_once("-->"));
    let is_figure =
        |(name, rest): &(&str, &str)| !name.contains(' ') && rest.starts_with(|c: char| c.is_ascii_digit() || c == '-');
    comments.filter(is_figure).map(|(name, _)| name).collect()
}
