//! Every text of the window, in English: a translation is another copy of this folder. Names of modes are in [`Mode`](crate::scene::Mode), faults that the
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

pub use exports::*;
pub use first_steps::*;
pub use measures::*;
pub use messages::*;
pub use panels::*;
pub use sides::*;
pub use sliders::*;
