//! Segmentation: volumes and surfaces against closed formulas.

mod accuracy;
mod made;
mod speckle;
