//! What a machine that runs for weeks in a clinic needs beside its picture: its whole configuration in one [`config`] file, logs that
//! stay within bounds ([`rotating`]), and a [`bundle`] of everything that whoever is to help needs, without anything of a patient
//! ([`redacted`]). None of it knows a device or a window.

pub mod bundle;
pub mod chord;
pub mod config;
pub mod redacted;
pub mod rotating;
pub mod system;
