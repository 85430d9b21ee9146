//! The names of what the head's volume holds, as a label volume numbers them.

/// What is at a point of the fetal head's volume. The number of a label never changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
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
    ChoroidPlexus = 6,
    /// Cerebrospinal fluid.
    Ventricle = 7,
    Falx = 8,
    /// The wall of the uterus and what is outside of it.
    Uterus = 9,
}

impl Label {
    pub const ALL: [Label; 10] = [
        Label::Fluid,
        Label::Skin,
        Label::Hand,
        Label::Cord,
        Label::Skull,
        Label::Brain,
        Label::ChoroidPlexus,
        Label::Ventricle,
        Label::Falx,
        Label::Uterus,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Label::Fluid => "fluid",
            Label::Skin => "skin",
            Label::Hand => "hand",
            Label::Cord => "cord",
            Label::Skull => "skull",
            Label::Brain => "brain",
            Label::ChoroidPlexus => "choroid plexus",
            Label::Ventricle => "ventricle",
            Label::Falx => "falx",
            Label::Uterus => "uterus",
        }
    }
}
