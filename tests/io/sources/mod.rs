//! Recorded files: the same frames and positions in every format, and one clear line for every fault.

mod broken;
mod geometry;
mod metaimage;
mod nrrd;
mod recordings;
mod values;
