//! Every text of the window, in English; `keys` also has the commands of keys, each beside its text. Names of modes are in [`Mode`](crate::scene::Mode), names and
//! hints of sliders are at their settings; faults that the panels show are worded by the modules that find them. A name and its hint are a
//! pair, in this order, unless one of them is also used alone.

/// A text with values in it: `text!(name(value) = "text with {value}");`
macro_rules! text {
    ($name:ident($($value:ident),+) = $text:literal) => {
        pub(crate) fn $name($($value: impl std::fmt::Display),+) -> String {
            format!($text)
        }
    };
}

mod comparing;
mod exports;
mod first_steps;
pub mod hints;
pub mod keys;
mod labels;
mod measures;
mod messages;
mod panels;
mod sides;
mod sliders;

pub(crate) use comparing::*;
pub(crate) use exports::*;
pub(crate) use first_steps::*;
pub(crate) use labels::*;
pub(crate) use measures::*;
pub(crate) use messages::*;
pub(crate) use panels::*;
pub(crate) use sides::*;
pub(crate) use sliders::*;
