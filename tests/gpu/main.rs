//! Everything that needs a device. No device is a failure, never a skip; validation and synchronization validation are on in
//! every test, and any message fails the test that caused it.

mod common;
mod conditioning;
mod console;
mod cube;
mod detector;
mod diffusion;
mod extreme_geometry;
mod extremes;
mod filters;
mod goldens;
mod growth;
mod half;
mod known_answers;
mod leaping;
mod led_astray;
mod live;
mod live_amiss;
mod live_kept;
mod modes;
mod motion;
mod passes;
mod pictures;
mod planes;
mod rays;
mod recordings;
mod reruns;
mod sector;
mod seen;
mod shading;
mod sliding;
mod stored;
mod tiles;
mod timing;
mod truth;
mod verified;
