//! What came of a run, in words and pictures.

pub mod curves;
pub mod dump;
pub mod growth;
pub mod profile;
pub mod regions;
pub mod tables;
pub mod times;
pub mod verify;
pub mod whole;

/// What a file says of itself, on one line: it may hold anything.
fn one_line(text: &str) -> String {
    crate::scene::load::plain(text).chars().take(400).collect()
}
