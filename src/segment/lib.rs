//! Segmentation and registration without a device: label volumes, the volumes of what they label, and the motion between two volumes.
//!
//! - [`Labels`] is a label for each voxel of a lattice. A [`Brush`] edits it, [`contours`] finds the voxels between drawn sections,
//!   [`files`] reads and writes it.
//! - [`Field`] holds linear echoes on the same lattice. [`bodies`] finds the bodies that are brighter or darker than what is around
//!   them, by threshold or from a seed.
//! - [`sections`] finds how the planes of drawn contours lie to each other.
//! - [`registration`] finds the rigid motion between two volumes.
//! - [`volume`] measures the volume of a body from the echoes at its surface, with an interval.

#![forbid(unsafe_code)]

pub mod bodies;
pub mod contours;
mod distance;
mod field;
pub mod files;
mod labels;
mod lattice;
pub mod registration;
pub mod sections;
pub mod volume;

use echolume_base::{files as base_files, memory, statistics};
use echolume_core::{mesh, scene};
use {echolume_probe as probe, echolume_source as source};

pub use field::{Field, Scale};
pub use labels::{Brush, Labels, Patch, Shape};
pub use lattice::{cropped, usual_grid};
