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
