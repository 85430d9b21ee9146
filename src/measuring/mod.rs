//! Runs the renderer again and again, and writes down what [`crate::report`] makes tables, comparisons and curves of.

pub mod ceilings;
pub mod dials;
pub mod error;
pub mod growth;
pub mod machine;
pub mod profile;
pub mod tables;
