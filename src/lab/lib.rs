//! Measurements of the renderer: [`profile`] measures GPU times, [`error_report`] errors against run time, and [`filter_report`] the effect
//! of filters on speckle and edges. [`thesis_tables`] measures the tables of the thesis, and [`bounds`] computes proven bounds of rays.

#![forbid(unsafe_code)]

pub mod bounds;
pub mod error_report;
pub mod filter_report;
pub mod profile;
pub mod thesis_tables;

use echolume_base::{baselines, canvas, picture, statistics, text, tree};
use echolume_core::{error_map, exact_ray, passes, plan, reference, scene};
use echolume_gpu::{self as gpu, machine};
use {echolume_probe as probe, echolume_source as source};
