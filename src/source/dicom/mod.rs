//! DICOM: ultrasound images of one or many frames, Enhanced US Volumes, Kretz files in GE's private elements, Philips' Cartesian volumes,
//! and folders of files as one series. Enhanced US Volumes and secondary captures are written.
//!
//! The elements are read here and not by the crate `dicom-object` (0.10.1): it takes whatever memory a length field claims, and sequences
//! that are nested some thousand times overflow its stack. docs/experiments/readers-of-crates.md compares them.

mod about;
mod classes;
mod elements;
mod file;
mod fragments;
mod frames;
mod image;
mod jpeg;
mod palette;
mod placed;
mod planes;
mod regions;
pub(super) mod segments;
mod series;
mod tags;
mod volume;
mod write;

pub(super) use classes::Coding;
pub(super) use elements::is_one;
pub(super) use file::read;
pub(super) use series::{is_dicom, is_series, read_series};
pub(super) use tags::rows;
pub(super) use write::{DicomWriter, MOST_BYTES};

/// Usual file name endings of DICOM files, in lower case without the dot. Many DICOM files have no ending, or a number in its place.
pub const ENDINGS: [&str; 3] = ["dcm", "dicom", "ima"];
