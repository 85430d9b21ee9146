//! Everything that determines and describes a rendered picture, without a GPU.
//!
//! - [`scene`] is everything that determines a picture: geometry, mode, filters, camera, light.
//! - [`passes`] declares every compute pass in one place: its slots (GPU resources), parameters, constants, tolerance and f64 reference.
//!   Its modules are the four stages preprocess, raycast, shade and postprocess, and the filters that several stages share.
//! - [`plan`] derives the passes and slots that a scene needs, and what must run again after a change. [`barriers`] derives the barriers
//!   between passes, [`queues`] the waits between queues. [`spirv`] reflects and rewrites shaders.
//! - [`reference`](mod@reference) renders on the CPU in f64, [`exact_ray`] integrates its rays without samples. [`mesh`] makes triangles of
//!   a volume's surface. [`dump`] writes slots to files. [`stated_error`] and [`error_map`] say what
//!   error a picture has.

#![forbid(unsafe_code)]

pub mod barriers;
pub mod dump;
pub mod error_map;
pub mod exact_ray;
pub mod mesh;
pub mod passes;
pub mod plan;
pub mod queues;
pub mod reference;
pub mod scene;
pub mod spirv;
pub mod stated_error;

use echolume_base::{files, picture, text, tree};
use echolume_probe as probe;
