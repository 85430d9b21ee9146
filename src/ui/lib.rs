//! The live volume on a screen, and the gestures that control it.
//!
//! - [`input`] is what a window, a touch screen or an input device reports. `gestures` and `keys` turn inputs
//!   into commands, and `controls` applies these to the settings.
//! - [`console`] connects inputs, stream and screen. [`frame_budget`] keeps the time of a picture on the rungs of the
//!   quality ladder, [`source_supervisor`] keeps the source open, [`recordings`] lists what else is open, [`export`] saves files (`volume_export` in the formats of other programs), and [`panels`] lays out what is
//!   drawn over the picture. None of these depends on a window, so all of them are tested without one.
//! - [`window`] shows the console in a window, and `screen_reader` tells the desktop's screen readers what its panels are. Without a windowing system, `direct` shows it on a monitor and `devices` reads
//!   input devices from the kernel.

#![forbid(unsafe_code)]

mod anatomy;
mod cine_player;
mod clipboard;
pub mod command;
mod comparison;
pub mod console;
mod controls;
#[cfg(target_os = "linux")]
mod devices;
#[cfg(target_os = "linux")]
pub mod direct;
pub mod export;
pub mod frame_budget;
mod gestures;
pub mod input;
mod keyboard_pointer;
mod keys;
mod labelling;
mod open_list;
mod palette;
pub mod panels;
mod picking;
pub mod recordings;
mod recovery;
mod region_box;
mod screen_reader;
mod shown_picture;
mod silence;
pub mod sliders;
pub mod source_supervisor;
mod texts;
mod thumbnails;
mod times;
mod view;
mod volume_export;
pub mod window;

use echolume_base::{files, picture, progress_lines, statistics, sync, text, tree};
use echolume_core::{mesh, passes, plan, scene};
use echolume_lab::error_report;
use echolume_segment as segment;
use echolume_session::{compare, kiosk, live, marked, measure, user_presets, workspace};
use {echolume_gpu as gpu, echolume_probe as probe, echolume_source as source};

#[cfg(test)]
mod tests;
