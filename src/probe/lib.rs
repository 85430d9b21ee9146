//! The probe: the positions of its scan lines and frames ([`geometry`]), the TOML file that describes them ([`mod@file`]), and the motor
//! that sweeps it ([`motor`]).

#![forbid(unsafe_code)]

pub mod axis;
pub mod file;
mod file_text;
mod frame;
pub mod geometry;
pub mod grid;
pub mod motor;
mod rigid;
mod samples;
pub mod world;

use echolume_base::{files, sync, tree};

pub use axis::Axis;
pub use file::ProbeFile;
pub use frame::Frame;
pub use geometry::{Advance, Array, Firing, GeometryError, Indices, Motion, Probe, Volumes};
pub use grid::{Geometry, Grid};
pub use rigid::Rigid;
pub use samples::{SampleType, StoredType};
pub use world::{AxisOrder, DepthAxis, World, is_rigid, is_rotation};
