//! What is made of a verification's findings: JSON that comes back, comparisons of simulated runs, reports that other programs read.
//! Needs no GPU.

mod baseline;
mod html;
mod json;
mod junit;
#[allow(dead_code)]
#[path = "../profile/simulated.rs"]
mod profile;
mod simulated;
mod words;
