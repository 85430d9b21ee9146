//! Sessions, which last longer than one picture: streams of frames that are rendered while they arrive ([`live`]), measurements
//! ([`measure`]), marks on saved pictures ([`marked`]) and pictures beside each other ([`compare`]), presets and workspaces of a user ([`user_presets`], [`workspace`]), reports of them ([`worksheet`]), and the
//! configuration, the logs and the support bundle of a kiosk display ([`kiosk`]).

#![forbid(unsafe_code)]

pub mod compare;
#[cfg(feature = "kiosk")]
pub mod kiosk;
pub mod live;
pub mod marked;
pub mod measure;
#[cfg(test)]
#[path = "../core/scene/test_block.rs"]
mod test_block;
pub mod user_presets;
pub mod worksheet;
pub mod workspace;

use echolume_base::{canvas, digest, files, html_page, metrics, picture, sync, text, tree};
use echolume_core::{passes, plan, scene};
use echolume_gpu::{self as gpu, machine};
use echolume_segment as segment;
use {echolume_probe as probe, echolume_source as source};
