//! Echolume renders the polar frames of a mechanically wobbling ultrasound probe as volumes, on bare Vulkan.
//!
//! The tour, in the order in which a frame travels:
//!
//! - [`source`] reads recordings into frames; [`probe`] says where their samples lie in space, in f64, and drives its motor.
//! - [`scene`] is everything that determines a picture: geometry, mode, filters, camera, light.
//! - [`passes`] declares every compute pass in one place: its slots, parameters, constants, tolerance and f64 reference.
//!   The four stages are its folders: preprocess, raycast, shade, postprocess; filters that several stages use lie beside them.
//! - [`plan`] turns a scene into the passes and slots it needs, and a change into what runs again; [`barriers`] derives the
//!   order between them (and has a second opinion on it) and [`queues`] that between queues; [`spirv`] reflects the shaders and rewrites how they read texels. All of these are pure and tested
//!   without a GPU.
//! - [`files`] reads up to a limit and writes whole or not at all; [`picture`] is what is drawn, as a file.
//! - [`ui`] is the live volume on a screen, and the hands that turn it.
//! - [`kiosk`] is what a cart needs around that: its configuration, its logs, and what it tells whoever is to help.
//! - [`live`] is the loop between a source that does not wait and the device.
//! - [`gpu`] is the only folder that knows Vulkan; [`report`] says in words and pictures what came of it; [`measuring`] runs the
//!   one to fill the other, and [`verify`] to say whether a device and its driver still do what they should.

// Elsewhere than in `gpu` nobody can allow it again.
#![deny(unsafe_code)]

#[forbid(unsafe_code)]
mod args;
#[forbid(unsafe_code)]
pub mod barriers;
#[forbid(unsafe_code)]
pub mod cli;
#[forbid(unsafe_code)]
pub mod dump;
#[forbid(unsafe_code)]
pub mod error_report;
#[forbid(unsafe_code)]
pub mod files;
#[allow(unsafe_code)]
pub mod gpu;
#[forbid(unsafe_code)]
pub mod kiosk;
#[forbid(unsafe_code)]
pub mod live;
#[forbid(unsafe_code)]
pub mod machine;
#[forbid(unsafe_code)]
pub mod passes;
#[forbid(unsafe_code)]
pub mod picture;
#[forbid(unsafe_code)]
pub mod plan;
#[forbid(unsafe_code)]
pub mod probe;
#[forbid(unsafe_code)]
pub mod profile;
#[forbid(unsafe_code)]
pub mod queues;
#[forbid(unsafe_code)]
pub mod reference;
#[forbid(unsafe_code)]
pub mod scene;
#[cfg(feature = "hot-reload")]
#[forbid(unsafe_code)]
mod shader_compile;
#[forbid(unsafe_code)]
pub mod shader_source;
#[forbid(unsafe_code)]
pub mod shader_tools;
#[forbid(unsafe_code)]
pub mod source;
#[forbid(unsafe_code)]
pub mod spirv;
#[forbid(unsafe_code)]
mod terminal;
#[forbid(unsafe_code)]
pub mod text;
#[forbid(unsafe_code)]
pub mod thesis_tables;
#[cfg(feature = "view")]
#[forbid(unsafe_code)]
pub mod ui;
#[forbid(unsafe_code)]
pub mod verify;
