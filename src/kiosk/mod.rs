//! What a machine that runs for weeks in a clinic needs beside its picture: its whole configuration in one [`config`] file, logs that
//! stay within bounds ([`log_rotation`]), and a [`bundle`] of everything that whoever is to help needs, without anything of a patient
//! ([`redaction`]). None of it knows a device or a window.

pub mod bundle;
pub mod chord;
pub mod config;
pub mod log_rotation;
pub mod redaction;
