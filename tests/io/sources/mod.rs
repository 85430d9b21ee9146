//! Recorded files: the same frames and places whatever they are stored as, and one clear line for every fault.

mod broken;
mod geometry;
mod recordings;
mod values;
