//! Everything that needs a device. No device is a failure, never a skip; validation and synchronization validation are on in
//! every test, and any message fails the test that caused it.

mod adaptive;
mod antialias;
mod any_scene;
mod bands;
mod batches;
mod beside;
mod caps;
#[path = "../common/mod.rs"]
mod common;
mod conditioning;
#[cfg(feature = "view")]
mod console;
mod cube;
mod curved_plane;
mod cuts;
mod deep_pictures;
mod detector;
mod detector_agreement;
mod detector_convergence;
mod detector_false_positives;
mod diffusion;
mod elevation;
mod empty_space;
mod extreme_geometry;
mod extremes;
mod far_and_tiny;
mod filters;
mod floating;
mod goldens;
mod growth;
mod half_resolution;
mod known_answers;
mod labels;
#[cfg(feature = "view")]
mod ladder;
mod light_volume;
mod live;
mod live_control;
mod live_failures;
mod lost_device;
mod modes;
mod motion;
mod pair;
mod passes;
mod pictures;
mod pipelines;
mod planes;
mod rays;
mod recordings;
mod reproduce;
mod reruns;
mod sampling;
mod scaled;
mod sections;
mod sector;
mod self_test;
mod shading;
mod sizes_in_mm;
mod sliding;
mod start_curve;
mod still;
mod stored_volume;
mod tiles;
mod timing;
mod tolerance;
mod truth;
mod unveil;
#[cfg(feature = "view")]
mod upscale;
mod verify_groups;
mod visible_bounds;
mod volume_storage;
