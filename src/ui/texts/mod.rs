//! Every text of the window, in English: a translation is another copy of this folder. Names of modes are in [`Mode`](crate::scene::Mode), those of sliders
//! and what they do at their settings; faults that the
//! panels pass on are of the modules that found them.

mod exports;
mod first_steps;
pub mod hints;
pub mod keys;
mod measures;
mod messages;
mod panels;
mod sides;
mod sliders;

pub(crate) use exports::*;
pub(crate) use first_steps::*;
pub(crate) use measures::*;
pub(crate) use messages::*;
pub(crate) use panels::*;
pub(crate) use sides::*;
pub(crate) use sliders::*;
