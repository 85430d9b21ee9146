//! Which recording a command is asked to render, and how.

use super::look::Look;
use super::targets::{self, Target};
use super::{Failure, input};
use crate::gpu::context::list;
use crate::gpu::{Choice, Context, Fetch, select};
use crate::scene::load::Layers;
use crate::scene::{Input, Scene};
use crate::source::phantom::{self, Phantom};
use crate::source::phantom_source::Played;
use crate::source::{self, Frame, Source};
use std::path::PathBuf;
use std::sync::Arc;

/// The arguments that every command which renders has.
#[derive(clap::Args)]
pub struct Asked {
    /// MetaImage (.mha, .mhd), Kretz (.vol) or frames (.frames) file; without one a synthetic fetal head is drawn (preset phantom)
    input: Option<PathBuf>,
    #[command(flatten)]
    look: Look,
    /// Geometry of the probe (TOML); otherwise NAME.probe.toml or probe.toml beside the recording
    #[arg(long, value_name = "FILE")]
    probe: Option<PathBuf>,
    /// Which volume of the recording, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    volume: usize,
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

    /// Looks at what is to be written, beside what is read: the source's files and what settings come from.
    pub fn check_targets(&self, targets: &[Target], source: &dyn Source) -> Result<(), Failure> {
        let mut read = source.files();
        read.extend(self.probe.clone());
        read.extend(self.look.files());
        targets::check(targets, read.iter().map(PathBuf::as_path))
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
        match select::choose(&there, self.look.device.as_ref().unwrap_or(&Choice::Best)) {
            Ok(n) => scene.sampled(Fetch::of(&there[n]).sampling()),
            Err(_) => scene,
        }
    }

    /// The device, named on one line.
    pub fn device(&self, validation: bool) -> Result<Arc<Context>, Failure> {
        self.look.device(validation)
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
        self.look.layers(self.input.is_none(), chosen)
    }
}
