//! What `echolume profile` and `echolume report` measure, on a device. A binary of its own: cargo runs it when nothing else runs.

mod commands;
#[path = "../common/mod.rs"]
mod common;
mod error_report;
mod profile;
mod scenes;
mod thesis_tables;
