//! Support for a machine that runs for weeks in a clinic: one configuration file ([`config`]), logs of bounded size ([`log_rotation`]), and
//! a support [`bundle`] without patient data ([`redaction`]). It depends on neither a device nor a window.

pub mod bundle;
pub mod chord;
pub mod config;
pub mod log_rotation;
pub mod redaction;
