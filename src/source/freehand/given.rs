//! Options of a freehand volume that a user gives.

use super::CompoundingOptions;
use crate::files::InputError;
use std::path::Path;

/// Options of a freehand volume that a user gives. None: the value that the file states, otherwise the default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FreehandArguments {
    /// The part of each picture that is used: first column, first row, columns, rows.
    pub clip: Option<[usize; 4]>,
    /// Distance between voxels along each axis, mm.
    pub spacing: Option<f64>,
    /// Widest gap between pictures that is filled, mm; 0 fills none.
    pub max_hole: Option<f64>,
    /// Least length of the volume along the normal of the pictures, mm ([`CompoundingOptions::extent`]).
    pub extent: Option<f64>,
    /// Largest number of voxels of the volume.
    pub max_voxels: Option<usize>,
}

impl FreehandArguments {
    /// `options` with those values replaced that the user gave.
    pub fn over(&self, options: CompoundingOptions) -> CompoundingOptions {
        CompoundingOptions {
            clip: self.clip.or(options.clip),
            spacing: self.spacing.or(options.spacing),
            max_hole: self.max_hole.unwrap_or(options.max_hole),
            extent: self.extent.or(options.extent),
            max_voxels: self.max_voxels.unwrap_or(options.max_voxels),
            ..options
        }
    }

    /// Checks that no option is set, for a file that is not a freehand volume.
    ///
    /// # Errors
    /// An option is set.
    pub fn refused(&self, path: &Path) -> Result<(), InputError> {
        let fault = "is for pictures with poses that differ, which become a freehand volume";
        self.flag().map_or(Ok(()), |flag| Err(InputError::new(path, flag, fault)))
    }

    /// The command-line flag of the first option that is set; None if none is.
    pub fn flag(&self) -> Option<&'static str> {
        let FreehandArguments { clip, spacing, max_hole, extent, max_voxels } = self;
        let said = [
            ("--clip", clip.is_some()),
            ("--spacing", spacing.is_some()),
            ("--hole", max_hole.is_some()),
            ("--extent", extent.is_some()),
            ("--freehand-size", max_voxels.is_some()),
        ];
        said.iter().find(|(_, is_said)| *is_said).map(|(flag, _)| *flag)
    }
}
