//! What a command is asked to render: the recording, the settings in layers, the device.

use super::{Failure, failed, input, say};
use echolume::gpu::context::list;
use echolume::gpu::{Choice, Context, ContextOptions, Fetch, GpuError, select};
use echolume::scene::load::Layers;
use echolume::scene::{Input, Scene};
use echolume::source::phantom::{self, Phantom};
use echolume::source::played::Played;
use echolume::source::{self, Frame, Source};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The arguments that every command which renders has.
#[derive(clap::Args)]
pub struct Asked {
    /// MetaImage (.mha, .mhd), Kretz (.vol) or frames (.frames) file; without one a synthetic fetal head is drawn (preset phantom)
    input: Option<PathBuf>,
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
    /// Geometry of the probe (TOML); otherwise NAME.probe.toml or probe.toml beside the recording
    #[arg(long, value_name = "FILE")]
    probe: Option<PathBuf>,
    /// Which volume of the recording, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    volume: usize,
    /// Vulkan device, by number or part of its name (see `echolume devices`)
    #[arg(long, value_name = "N|NAME")]
    device: Option<Choice>,
}

impl Asked {
    /// The recording and the scene of its volume.
    pub fn open(&self) -> Result<(Box<dyn Source>, Scene), Failure> {
        self.open_over(&[])
    }

    /// The same with these assignments as a layer below the flags and `--set`.
    pub fn open_over(&self, chosen: &[String]) -> Result<(Box<dyn Source>, Scene), Failure> {
        let source = self.source()?;
        if self.volume >= source.volumes() {
            let (asked, there) = (self.volume, source.volumes());
            return Err(input(format!("{}: --volume {asked}: there are {there}, numbered from 0", self.shown())));
        }
        let geometry = source.geometry(self.volume);
        let samples = Input { stored: source.stored_type(), range: source.range() };
        let settings = self.layers_over(chosen)?.finish().map_err(input)?;
        let scene = Scene::new(geometry, samples, settings).map_err(input)?;
        Ok((source, scene))
    }

    pub fn shown(&self) -> String {
        self.input.as_ref().map_or("phantom".into(), |file| file.display().to_string())
    }

    /// Refuses to write over what is read.
    pub fn keep_inputs(&self, flag: &str, output: &Path) -> Result<(), Failure> {
        let Ok(output) = output.canonicalize() else { return Ok(()) };
        let inputs = [self.input.as_ref(), self.probe.as_ref(), self.scene.as_ref()];
        match inputs.into_iter().flatten().find(|i| i.canonicalize().is_ok_and(|i| i == output)) {
            Some(read) => Err(input(format!("{flag} {}: would replace an input", read.display()))),
            None => Ok(()),
        }
    }

    /// Every frame of the volume, in the order of the recording.
    pub fn frames(
        &self,
        source: &mut dyn Source,
        mut each: impl FnMut(Frame) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        source.skip_to_volume(self.volume).map_err(input)?;
        let frames = source.frames_per_volume();
        let bar = indicatif::ProgressBar::new(frames as u64).with_message("frames");
        let mut volume = None;
        for _ in 0..frames {
            let Some(frame) = source.next_frame().map_err(input)? else { break };
            // A volume that was not acquired to its end is followed by another.
            if *volume.get_or_insert(frame.volume) != frame.volume {
                break;
            }
            each(frame)?;
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(())
    }

    /// The scene as the device will sample it; as it is where there is no device.
    pub fn suited(&self, scene: Scene) -> Scene {
        let there = list().unwrap_or_default();
        match select::choose(&there, self.device.as_ref().unwrap_or(&Choice::Best)) {
            Ok(n) => scene.sampled(Fetch::of(&there[n]).sampling()),
            Err(_) => scene,
        }
    }

    /// The device, named on one line.
    pub fn device(&self, validation: bool) -> Result<Arc<Context>, Failure> {
        open_device(self.device.clone(), validation)
    }

    fn source(&self) -> Result<Box<dyn Source>, Failure> {
        match &self.input {
            Some(file) => source::open(file, self.probe.as_deref()).map_err(input),
            None => Ok(Box::new(Played::new(Phantom::new(phantom::Options::default()).map_err(input)?))),
        }
    }

    /// The settings before they are resolved.
    pub fn layers(&self) -> Result<Layers, Failure> {
        self.layers_over(&[])
    }

    fn layers_over(&self, chosen: &[String]) -> Result<Layers, Failure> {
        let mut layers = Layers::default();
        if self.input.is_none() {
            layers.preset("phantom").map_err(input)?;
        }
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
