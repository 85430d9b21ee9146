//! `echolume convert`.

use super::{Failure, failed, input, say};
use echolume::picture::check_target;
use echolume::probe::Geometry;
use echolume::source::convert::{Volume, VolumeFile, lattice};
use echolume::source::recorder::{Header, Writer};
use echolume::source::{self, Recording};
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "Example:\n  echolume convert sweep.mha volume.nrrd --spacing 0.5\n  \
                        echolume convert sweep.mha sweep.frames    (checksummed, appended frame by frame; a file that is there is not replaced)\n  \
                        echolume render volume.mha --mode mip -o mip.png    (what was written is read like any recording)")]
pub struct Convert {
    /// MetaImage (.mha, .mhd) or Kretz (.vol) file
    input: PathBuf,
    /// The volume to write (.mha, .nrrd), or .frames for every frame as it is
    output: PathBuf,
    /// Distance between voxels along every axis, mm [default: between samples of a line]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    spacing: Option<f64>,
    /// Which volume of the recording, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    volume: usize,
    /// Geometry of the probe (TOML); otherwise NAME.probe.toml or probe.toml beside the recording
    #[arg(long, value_name = "FILE")]
    probe: Option<PathBuf>,
}

impl Convert {
    pub fn run(&self) -> Result<(), Failure> {
        if self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("frames")) {
            return self.record();
        }
        VolumeFile::of(&self.output).map_err(input)?;
        let mut recording = Recording::open(&self.input, self.probe.as_deref()).map_err(input)?;
        let shown = self.input.display();
        if self.volume >= recording.volumes() {
            let there = recording.volumes();
            return Err(input(format!("{shown}: --volume {}: there are {there}, numbered from 0", self.volume)));
        }
        let read = [Some(&self.input), self.probe.as_ref()];
        let same = |file: &PathBuf| self.output.canonicalize().is_ok_and(|o| file.canonicalize().is_ok_and(|f| f == o));
        if let Some(file) = read.into_iter().flatten().find(|file| same(file)) {
            return Err(input(format!("output {}: would replace an input", file.display())));
        }
        let geometry = recording.geometry(self.volume);
        let usual = match &geometry {
            Geometry::Sweep(probe) => probe.sample_pitch,
            Geometry::Cartesian(grid) => grid.spacing.into_iter().fold(f64::INFINITY, f64::min),
        };
        let grid = lattice(&geometry, self.spacing.unwrap_or(usual)).map_err(|e| input(format!("--spacing {e}")))?;
        check_target(&self.output).map_err(failed)?;
        let mut volume = Volume::new(geometry, recording.stored_type());
        recording.skip_to_volume(self.volume).map_err(input)?;
        for _ in 0..recording.frames_per_volume() {
            let Some(frame) = recording.next_frame().map_err(input)? else { break };
            volume.take(frame);
        }
        let bar = indicatif::ProgressBar::new(grid.size[2] as u64).with_message("slices");
        volume.write(&grid, recording.sample_type(), &self.output, || bar.inc(1)).map_err(failed)?;
        bar.finish_and_clear();
        let ([x, y, z], [spacing, ..]) = (grid.size, grid.spacing);
        say!("volume: {}, {x} x {y} x {z} voxels of {spacing} mm", self.output.display());
        Ok(())
    }

    /// Every frame of every volume, as they are.
    fn record(&self) -> Result<(), Failure> {
        if self.spacing.is_some() || self.volume != 0 {
            return Err(input("--spacing and --volume are of a volume; .frames takes every frame as it is"));
        }
        let mut recording = source::open(&self.input, self.probe.as_deref()).map_err(input)?;
        let first = recording.geometry(0);
        let second = if recording.volumes() > 1 { recording.geometry(1) } else { first.clone() };
        let mut frame = recording.next_frame().map_err(input)?;
        let is_backward = frame.as_ref().is_some_and(|frame| frame.backward);
        let (forward, backward) = if is_backward { (second, first) } else { (first, second) };
        let header = Header { forward, backward, stored: recording.stored_type(), range: recording.range() };
        let mut writer = Writer::create(&self.output, header).map_err(failed)?;
        let bar = indicatif::ProgressBar::new((recording.volumes() * recording.frames_per_volume()) as u64);
        while let Some(there) = frame {
            writer.frame(&there, there.time.unwrap_or(0.0)).map_err(failed)?;
            bar.inc(1);
            frame = recording.next_frame().map_err(input)?;
        }
        bar.finish_and_clear();
        let frames = writer.frames();
        writer.finish().map_err(failed)?;
        say!("frames: {}, {frames} of {} volumes", self.output.display(), recording.volumes());
        Ok(())
    }
}
