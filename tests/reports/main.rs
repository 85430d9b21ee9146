//! Measurements of `echolume profile` and `echolume report` on a device. A separate binary: cargo runs it when no other test runs.

mod choices;
mod commands;
#[path = "../common/mod.rs"]
mod common;
mod error_report;
mod filters;
mod profile;
mod scenes;
mod thesis_tables;
