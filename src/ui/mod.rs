//! The live volume on a screen, and the hands that turn it. What comes from a window, a touch screen or an input device is
//! [`input::Input`]; [`command::Command`]s are made of it, of gestures by [`hand`] and of keys by [`keys`], and settings of those by
//! [`controls`]. [`console`] joins them to the stream, [`pace`] holds the time of a picture on the rungs of [`ladder`], [`supply`] has the
//! source, [`keep`] saves, [`panels`] lays out what is drawn over the picture. None of these knows a window, so that all of them are tested
//! without one; [`window`] does. Without a windowing system `direct` shows on a monitor that nothing else uses, and `devices` are read
//! from the kernel.

pub mod command;
pub mod console;
pub mod controls;
#[cfg(target_os = "linux")]
pub mod devices;
#[cfg(target_os = "linux")]
pub mod direct;
pub mod export;
pub mod frame_budget;
pub mod gestures;
pub mod input;
pub mod keys;
pub mod panels;
mod picking;
pub mod quality_ladder;
mod recovery;
pub mod sliders;
pub mod source_supervisor;
pub mod times;
mod view;
pub mod window;

#[cfg(test)]
mod tests;
