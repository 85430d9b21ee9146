//! How something is to be looked at: the settings in layers, and the device.

use super::{Failure, failed, input, say};
use crate::gpu::{Choice, Context, ContextOptions, GpuError};
use crate::scene::load::Layers;
use std::path::PathBuf;
use std::sync::Arc;

/// The arguments that every command which renders has.
#[derive(clap::Args)]
pub struct Look {
    /// vr (volume), sr (surface), mixed, mip, minip, xray (mean), mpr (plane), orthogonal, tomography, cube
    #[arg(long)]
    mode: Option<String>,
    /// single, or 4up: three orthogonal planes beside the rendering
    #[arg(long, value_name = "LAYOUT")]
    layout: Option<String>,
    /// Transfer function: grey, sepia, skin, bone, cool, warm, or a .toml file of points
    #[arg(long, value_name = "NAME|FILE")]
    transfer: Option<String>,
    /// Settings in TOML
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Settings that suit a kind of picture: bmode, bone, fetal, phantom, thesis; may be given again, the later over the earlier
    #[arg(long, value_name = "NAME")]
    preset: Vec<String>,
    /// Width and height of the picture, pixels
    #[arg(long, value_name = "WxH")]
    size: Option<String>,
    /// azimuth, elevation, roll, fov (deg; 0 is parallel), zoom, target=lateral:depth:elevation (mm)
    #[arg(long, value_name = "KEY=VALUE,...", allow_hyphen_values = true)]
    camera: Option<String>,
    /// What is rendered, mm: lateral=LOW:HIGH,depth=LOW:HIGH,elevation=LOW:HIGH
    #[arg(long, value_name = "SIDE=LOW:HIGH,...", allow_hyphen_values = true)]
    roi: Option<String>,
    /// Any setting of a scene file, such as surface.threshold=0.1; light.shadow=none switches a filter or light off
    #[arg(long, value_name = "KEY.PATH=VALUE", allow_hyphen_values = true)]
    set: Vec<String>,
    /// Vulkan device, by number or part of its name (see `echolume devices`)
    #[arg(long, value_name = "N|NAME")]
    pub device: Option<Choice>,
}

impl Look {
    /// The settings before they are resolved; these assignments as a layer below the flags and `--set`.
    pub fn layers(&self, is_phantom: bool, chosen: &[String]) -> Result<Layers, Failure> {
        let mut layers = Layers::default();
        if is_phantom {
            layers.preset("phantom").map_err(input)?;
        }
        self.layers_over(layers, chosen)
    }

    /// The same over settings that are there already.
    pub fn layers_over(&self, mut layers: Layers, chosen: &[String]) -> Result<Layers, Failure> {
        for preset in &self.preset {
            layers.preset(preset).map_err(input)?;
        }
        if let Some(file) = &self.scene {
            layers.file(file).map_err(input)?;
        }
        for assignment in chosen {
            // What is already off cannot be switched off.
            if !assignment.ends_with("=none") || layers.has(assignment) {
                layers.set_by(&format!("--budget, {assignment}"), assignment).map_err(input)?;
            }
        }
        for (flag, assignment) in self.flags()? {
            layers.set_by(&flag, &assignment).map_err(input)?;
        }
        for assignment in &self.set {
            layers.set(assignment).map_err(input)?;
        }
        Ok(layers)
    }

    /// What settings are read from.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        self.scene.iter().cloned().chain(self.transfer.iter().map(PathBuf::from))
    }

    /// Whether the size of the picture was typed.
    #[cfg(feature = "view")]
    pub fn has_size(&self) -> bool {
        self.size.is_some()
    }

    /// The flags as typed, and the assignments that they stand for.
    fn flags(&self) -> Result<Vec<(String, String)>, Failure> {
        let mut set = Vec::new();
        set.extend(self.mode.as_ref().map(|mode| (format!("--mode {mode}"), format!("mode={mode}"))));
        for (name, key, value) in
            [("--layout", "layout", &self.layout), ("--transfer", "volume.transfer", &self.transfer)]
        {
            set.extend(value.as_ref().map(|value| (format!("{name} {value}"), format!("{key}={value}"))));
        }
        if let Some(size) = &self.size {
            let flag = format!("--size {size}");
            let edges = size.split_once('x').and_then(|(w, h)| Some((w.parse::<u32>().ok()?, h.parse::<u32>().ok()?)));
            let (w, h) = edges.ok_or_else(|| input(format!("{flag}: must read WIDTHxHEIGHT in pixels, as 512x512")))?;
            set.push((flag, format!("picture.size=[{w},{h}]")));
        }
        for (name, table, text) in [("--camera", "camera", &self.camera), ("--roi", "region", &self.roi)] {
            for part in text.iter().flat_map(|t| t.split(',')) {
                let flag = format!("{name} {part}");
                let pair = part.split_once('=');
                let (key, value) = pair.ok_or_else(|| input(format!("{flag}: must read key=value,key=value")))?;
                let key = if key == "fov" { "field_of_view" } else { key };
                let value = if value.contains(':') { format!("[{}]", value.replace(':', ",")) } else { value.into() };
                set.push((flag, format!("{table}.{key}={value}")));
            }
        }
        Ok(set)
    }

    /// The device, named on one line.
    pub fn device(&self, validation: bool) -> Result<Arc<Context>, Failure> {
        open_device(self.device.clone(), validation)
    }
}

/// The device that was chosen, or the best, named on one line.
pub fn open_device(choice: Option<Choice>, validation: bool) -> Result<Arc<Context>, Failure> {
    let device = choice.unwrap_or(Choice::Best);
    let context = Context::new(&ContextOptions { device, validation }).map_err(|e| match e {
        GpuError::NoSuchDevice { .. } => input(e),
        e => failed(e),
    })?;
    let note = if context.candidate.is_software() { " (software: no GPU is used)" } else { "" };
    say!("device: {}{note}, {}", context.candidate.name, context.candidate.driver.trim());
    Ok(context)
}
