//! Measurements of the renderer: [`profile`] measures GPU times, [`error_report`] error against run time, [`filter_report`] what filters do to
//! speckle and edges, [`thesis_tables`] the tables of the thesis. [`bounds`] encloses rays.

#![forbid(unsafe_code)]

pub mod bounds;
pub mod error_report;
pub mod filter_report;
pub mod profile;
pub mod thesis_tables;

use echolume_base::{baselines, canvas, picture, statistics, text};
use echolume_core::{error_map, exact_ray, passes, plan, reference, scene};
use echolume_gpu::{self as gpu, machine};
use {echolume_probe as probe, echolume_source as source};
