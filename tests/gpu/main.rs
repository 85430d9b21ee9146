//! Everything that needs a device. No device is a failure, never a skip; validation and synchronization validation are on in
//! every test, and any message fails the test that caused it.

mod common;
mod conditioning;
mod detector;
mod extreme_geometry;
mod extremes;
mod faults;
mod goldens;
mod known_answers;
mod motion;
mod passes;
mod pictures;
mod recordings;
mod reruns;
mod shading;
mod truth;
