//! Reports of a verification: JSON that round-trips, comparisons of simulated runs, formats that other programs read.
//! Needs no GPU.

mod baseline;
mod gtest;
mod html;
mod json;
mod junit;
mod prometheus;
mod simulated;
mod words;

use super::profile::simulated as profile;
