//! Evaluation of measured times: statistics against known values, comparisons against simulated runs, formats against their
//! rules. Needs no GPU.

mod compare;
mod formats;
pub mod simulated;
mod statistics;
mod trace;
