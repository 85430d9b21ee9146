//! Comparison of two pictures of one unit: bit for bit on the same device and driver, otherwise within the tolerance of `verify`.

use crate::picture::Picture;
use crate::tree::{FromNode, ToNode};
use crate::verify::report::Figure;
use crate::verify::{Findings, compare_picture};

/// The device that drew a picture, and its driver.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Drawer {
    pub device: String,
    pub driver: String,
    pub vulkan: String,
    pub is_software: bool,
}

/// How far two pictures of one unit of a batch may differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ToNode, FromNode)]
#[tree(rename_all = "kebab-case")]
pub enum Class {
    /// They were drawn by the same device and driver, or by none: their bytes must be equal.
    SameDriver,
    /// They were drawn by different devices or drivers: they must agree within the tolerance of `verify`.
    OtherDriver,
}

impl Class {
    /// The class of two pictures, given the devices that drew them; None: no device was used.
    pub fn of(a: Option<&Drawer>, b: Option<&Drawer>) -> Class {
        if a == b { Class::SameDriver } else { Class::OtherDriver }
    }

    /// The class in words, for reports.
    pub fn sentence(self) -> &'static str {
        match self {
            Class::SameDriver => "same device and driver: bit for bit",
            Class::OtherDriver => "another device or driver: within the tolerance of verify",
        }
    }
}

/// The comparison of a second picture of a unit with the stored one.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Agreement {
    pub class: Class,
    /// The device that drew the stored picture; None if none did.
    pub with: Option<Drawer>,
    pub same_bytes: bool,
    /// True if the difference is within what the class allows.
    pub agrees: bool,
    /// Errors between the two pictures, with their limits in `verify`; empty if the bytes are equal or the sizes differ.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
    /// One line that describes the difference; None if the pictures agree.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
}

impl Agreement {
    /// Compares the picture `drawn` with the stored one, `kept`. The transparency of `drawn` is ignored, because a file has none. Equal pixels mean
    /// equal bytes, as both are encoded alike.
    pub fn of(kept: &Picture, kept_by: Option<&Drawer>, drawn: &Picture, drawn_by: Option<&Drawer>) -> Agreement {
        let class = Class::of(kept_by, drawn_by);
        // A file has no transparency.
        let mut drawn = drawn.clone();
        drawn.rgba.chunks_exact_mut(4).for_each(|pixel| pixel[3] = u8::MAX);
        let mut found = Agreement {
            class,
            with: kept_by.cloned(),
            same_bytes: *kept == drawn,
            agrees: true,
            figures: Vec::new(),
            fault: None,
        };
        if found.same_bytes {
            return found;
        }
        let mut findings = Findings::default();
        compare_picture(&mut findings, "picture", kept, &drawn);
        let fault = findings.faults.first().map(|fault| fault.what.clone());
        found.fault = match class {
            Class::SameDriver => Some("the same device and driver drew another picture".into()),
            Class::OtherDriver => fault,
        };
        found.agrees = found.fault.is_none();
        found.figures = findings.figures;
        found
    }
}
