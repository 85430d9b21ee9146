//! Fixtures of all test binaries: files, processes, probes, scenes, devices, the simulated motor.

// Each binary uses a part.
#![allow(dead_code, unused_imports)]

pub mod figures;
pub mod files;
pub mod gpu;
pub mod growth;
pub mod layer;
pub mod lengths;
#[cfg(target_os = "linux")]
pub mod motor;
pub mod own_process;
pub mod probes;
pub mod program;
pub mod scenes;
pub mod setting_keys;
pub mod wait;
