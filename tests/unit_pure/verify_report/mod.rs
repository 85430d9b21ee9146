//! What is made of a verification's findings: JSON that comes back, comparisons of simulated runs, reports that other programs read.
//! Needs no GPU.

mod baseline;
mod html;
mod json;
mod junit;
mod simulated;
mod words;

use super::profile::simulated as profile;
