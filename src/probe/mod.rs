//! The probe: the positions of its scan lines and frames ([`geometry`]), the TOML file that describes them ([`mod@file`]), and the motor
//! that sweeps it ([`motor`]).

pub mod axis;
pub mod file;
pub mod geometry;
pub mod grid;
pub mod motor;
pub mod world;

pub use axis::Axis;
pub use file::ProbeFile;
pub use geometry::{Advance, Array, GeometryError, Indices, Motion, Probe, Volumes};
pub use grid::{Geometry, Grid};
pub use world::{AxisOrder, DepthAxis, World, is_rigid};
