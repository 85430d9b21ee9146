//! The configuration file of the PLUS toolkit (XML): constant transforms, and how a volume is reconstructed.

use super::transforms::{Calibration, TransformName, matrix};
use crate::files::{self, InputError, quoted};
use roxmltree::{Document, Node, ParsingOptions};
use std::path::Path;

/// Largest file, bytes, and most elements and attributes in it.
const MAX_BYTES: u64 = 4 << 20;
const MAX_NODES: u32 = 200_000;

/// What is read of a configuration file of the PLUS toolkit.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct PlusConfig {
    /// The constant transforms in the file's element `CoordinateDefinitions`.
    pub fixed: Vec<Calibration>,
    /// Name of the pictures' coordinate frame in `VolumeReconstructor`; `reference` is that of the volume. None if not stated.
    pub image: Option<String>,
    pub reference: Option<String>,
    /// The part of each picture that the volume reconstructor uses: first column, first row, columns, rows. None: the whole picture, also if the
    /// stated rectangle is less than one pixel wide or high.
    pub clip: Option<[usize; 4]>,
    /// Voxel spacing of the volume reconstructor, mm: the smallest of its three axes. None if it is not stated or not above 0.
    pub spacing: Option<f64>,
}

impl PlusConfig {
    /// Reads a configuration file.
    ///
    /// # Errors
    /// The file cannot be read or is no XML, a transform has a wrong name or matrix, or a clip rectangle or spacing of `VolumeReconstructor` has a
    /// wrong number of entries or one that is not a finite number.
    pub fn read(path: &Path) -> Result<PlusConfig, InputError> {
        let text = files::read_text(path, MAX_BYTES, "configuration").map_err(|e| InputError::new(path, "file", e))?;
        PlusConfig::parse(path, &text)
    }

    fn parse(path: &Path, text: &str) -> Result<PlusConfig, InputError> {
        let options = ParsingOptions { allow_dtd: false, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
        let document = Document::parse_with_options(text, options)
            .map_err(|e| InputError::new(path, "file", format!("is no XML: {e}")))?;
        let fault = |field: &str, fault: String| InputError::new(path, field, fault);
        let mut config = PlusConfig::default();
        let named = |name: &'static str| document.descendants().filter(move |node| node.has_tag_name(name));
        for node in named("CoordinateDefinitions").flat_map(|node| node.children()) {
            if !node.has_tag_name("Transform") {
                continue;
            }
            let (from, to) = (node.attribute("From").unwrap_or(""), node.attribute("To").unwrap_or(""));
            let text = format!("{from}To{to}");
            let name: TransformName = text.parse().map_err(|e: String| fault("Transform", e))?;
            let numbers = node.attribute("Matrix").unwrap_or("");
            let matrix = matrix(numbers).map_err(|e| fault(&format!("Transform {name}"), e))?;
            config.fixed.push(Calibration { name, matrix });
        }
        // Configurations before version 2.2 have the other name.
        let node = named("VolumeReconstructor").chain(named("VolumeReconstruction")).next();
        let Some(node) = node else { return Ok(config) };
        config.image = node.attribute("ImageCoordinateFrame").map(str::to_string);
        config.reference = node.attribute("ReferenceCoordinateFrame").map(str::to_string);
        let corner = numbers::<2>(&node, "ClipRectangleOrigin").map_err(|e| fault("VolumeReconstructor", e))?;
        let size = numbers::<2>(&node, "ClipRectangleSize").map_err(|e| fault("VolumeReconstructor", e))?;
        if let (Some([x, y]), Some([width, height])) = (corner, size)
            && width >= 1.0
            && height >= 1.0
        {
            config.clip = Some([x, y, width, height].map(|v| v.max(0.0) as usize));
        }
        let spacing = numbers::<3>(&node, "OutputSpacing").map_err(|e| fault("VolumeReconstructor", e))?;
        config.spacing = spacing.map(|mm| mm.into_iter().fold(f64::INFINITY, f64::min)).filter(|mm| *mm > 0.0);
        Ok(config)
    }
}

/// The numbers of an attribute; None if it is absent.
fn numbers<const N: usize>(node: &Node, name: &str) -> Result<Option<[f64; N]>, String> {
    let Some(text) = node.attribute(name) else { return Ok(None) };
    let numbers: Option<Vec<f64>> =
        text.split_whitespace().map(|word| word.parse().ok().filter(|v: &f64| v.is_finite())).collect();
    match numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
        Some(numbers) => Ok(Some(numbers)),
        None => Err(format!("{name} {} is not {N} numbers", quoted(text))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<PlusConfig, String> {
        PlusConfig::parse(Path::new("config.xml"), text).map_err(|e| e.to_string())
    }

    #[test]
    fn transforms_and_the_reconstruction_are_read() {
        let config = read(
            "<PlusConfiguration version=\"2.7\"><DataCollection StartupDelaySec=\"1\"/>\
             <CoordinateDefinitions><Transform From=\"Image\" To=\"Probe\" Matrix=\"\n 0.1 0 0 1\n 0 0.2 0 2\n 0 0 0.1 3\n 0 0 0 1\" \
             Error=\"0.5\" Date=\"today\"/></CoordinateDefinitions>\
             <VolumeReconstructor ImageCoordinateFrame=\"Image\" ReferenceCoordinateFrame=\"Tracker\" OutputSpacing=\"1.0 0.5 2\" \
             ClipRectangleOrigin=\"3 4\" ClipRectangleSize=\"100 80\"/></PlusConfiguration>",
        )
        .unwrap();
        assert_eq!(config.fixed[0].name.to_string(), "ImageToProbe");
        assert_eq!(config.fixed[0].matrix.transform_point3(glam::DVec3::ONE), glam::DVec3::new(1.1, 2.2, 3.1));
        assert_eq!((config.image.as_deref(), config.reference.as_deref()), (Some("Image"), Some("Tracker")));
        assert_eq!((config.clip, config.spacing), (Some([3, 4, 100, 80]), Some(0.5)));
        let old = read("<a><VolumeReconstruction OutputSpacing='1 1 0.5'/></a>").unwrap();
        assert_eq!(old.spacing, Some(0.5));
        assert_eq!(read("<a/>").unwrap(), PlusConfig::default());
    }

    #[test]
    fn what_is_wrong_is_named() {
        let transform =
            |attributes: &str| format!("<CoordinateDefinitions><Transform {attributes}/></CoordinateDefinitions>");
        for (text, named) in [
            ("no xml".to_string(), "is no XML"),
            (transform("From='Image' To='Probe'"), "Transform ImageToProbe: has 0 numbers"),
            (transform("From='Image'"), "Transform: "),
            ("<VolumeReconstructor OutputSpacing='1 2'/>".into(), "OutputSpacing"),
            ("<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>".into(), "is no XML"),
        ] {
            let said = read(&text).expect_err(&text);
            assert!(said.contains(named) && said.lines().count() == 1, "{text}: {said}");
        }
    }
}
