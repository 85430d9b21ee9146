//! What comes in and goes out: files of recordings, pipes, the network, the motor, signals. Needs no GPU.

#[path = "../common/mod.rs"]
mod common;
mod convert;
mod dicom;
mod dicom_forms;
mod formats;
mod igtl;
mod interrupted;
#[cfg(target_os = "linux")]
mod motor;
mod outside;
mod piped;
mod posed;
mod progress;
mod recorder;
mod signals;
mod sources;
mod stacks;
mod tracked;
mod uff;
mod unused;
