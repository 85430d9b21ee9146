//! The names of what the volumes of head and vessels hold, as a label volume numbers them.

use crate::tree::{All, Name};

/// The tissue at a point in the volume of the fetal head or of the vessels, as stored in label volumes. The number of a label never changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, All, Name)]
#[repr(u8)]
#[tree(rename_all = "lowercase")]
pub enum Label {
    /// Amniotic fluid.
    Fluid = 0,
    /// Skin and soft tissue of head and trunk.
    Skin = 1,
    /// Hand and forearm.
    Hand = 2,
    Cord = 3,
    Skull = 4,
    Brain = 5,
    #[tree(rename = "choroid plexus")]
    ChoroidPlexus = 6,
    /// Cerebrospinal fluid.
    Ventricle = 7,
    Falx = 8,
    /// The wall of the uterus and what is outside of it.
    Uterus = 9,
    /// Blood in the vessels.
    Blood = 10,
    #[tree(rename = "vessel wall")]
    VesselWall = 11,
    /// The liver tissue around the vessels.
    Liver = 12,
}

impl Label {
    /// The colour of this label in a segmentation: red, green, blue, 0..=1.
    pub fn colour(self) -> [f64; 3] {
        match self {
            Label::Fluid => [0.0; 3],
            Label::Skin => [0.88, 0.67, 0.55],
            Label::Hand => [0.78, 0.55, 0.42],
            Label::Cord => [0.75, 0.35, 0.45],
            Label::Skull => [0.95, 0.84, 0.57],
            Label::Brain => [0.98, 0.98, 0.88],
            Label::ChoroidPlexus => [0.85, 0.4, 0.31],
            Label::Ventricle => [0.35, 0.65, 0.9],
            Label::Falx => [0.6, 0.75, 0.45],
            Label::Uterus => [0.6, 0.45, 0.65],
            Label::Blood => [0.85, 0.34, 0.3],
            Label::VesselWall => [0.0, 0.59, 0.81],
            Label::Liver => [0.87, 0.51, 0.4],
        }
    }
}
