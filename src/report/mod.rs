//! What came of a run, in words and pictures.

pub mod dump;
pub mod profile;
pub mod times;
pub mod whole;
