//! What a machine that runs for weeks in a clinic needs besides the picture: one file of configuration ([`config`]), logs of bounded size
//! ([`log_rotation`]), and a support [`bundle`] without any data of patients ([`redaction`]). None of it depends on a device or a window.

pub mod bundle;
pub mod chord;
pub mod config;
pub mod log_rotation;
pub mod redaction;
