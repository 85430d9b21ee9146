//! The exact reference of a ray: the integrals and maxima that the ray casters approximate by samples, computed in f64 without a step.
//!
//! The field along a ray is the volume between its texels as the scene interpolates it, stretched by the grey window. [`coordinates`] finds where the ray
//! enters another cell, [`field`] gives a polynomial for each part of it, [`volume`], [`projection`] and [`surface`] integrate it as
//! the modes ask. [`picture`] renders stage 2 of a scene with it. Nothing here uses the scene's step, its tables, or how a pass samples.
//!
//! The mathematics is in docs/numerics.md, "The exact reference of a ray".

pub mod coordinates;
pub mod fade;
pub mod field;
pub mod gauss_kronrod;
pub mod picture;
pub mod polynomial;
pub mod projection;
pub mod surface;
pub mod volume;

pub use coordinates::Line;
pub use field::{Segment, segments};
