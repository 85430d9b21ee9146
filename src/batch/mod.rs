//! Many recordings, each a unit of work: rendered, converted, measured or verified. A process does one shard of the manifest; Slurm, Kubernetes or
//! GNU parallel starts the processes.
//!
//! - [`manifest`] is the list of units, [`make`] writes it from files and folders. [`shard`] divides it.
//! - [`unit`] is the command of a unit, and the key of its outputs: a hash of what determines them.
//! - [`reading`] reads a unit's recording, on a thread of its own. [`painter`] draws, with one device and one renderer. [`work`] runs a shard.
//! - [`results`] is what is stored of a unit. [`agreement`] compares pictures of two devices, [`comparisons`] counts them. [`report`] is the page.
//!
//! A unit is done when its record exists, which is written after its outputs. If a process is killed, a later one does what is left. Two processes
//! that do the same unit write the same bytes.

pub mod agreement;
pub mod comparisons;
pub mod make;
pub mod manifest;
pub(crate) mod painter;
mod progress;
pub(crate) mod reading;
pub mod report;
pub mod results;
pub mod shard;
pub mod unit;
pub mod work;
