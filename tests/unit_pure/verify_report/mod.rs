//! Reports of a verification: JSON that round-trips, comparisons of simulated runs, formats that other programs read.
//! Needs no GPU.

mod baseline;
mod html;
mod json;
mod junit;
mod simulated;
mod words;

use super::profile::simulated as profile;
