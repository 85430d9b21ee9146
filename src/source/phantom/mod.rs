//! The phantom: simulated sweeps of an exactly known body with a wobbling abdominal probe.
//!
//! Each scan line is a straight line through the body, at the motor's angle and the time at which it is fired. The body defines
//! an echogenicity (`body`, and `head` with `face`, `limbs` and `skull`), `truth` tells what is where, and `speckle` adds the speckle of a real image. `source` hands out the frames. The same options give the same bytes on every machine
//! with the same mathematics library, with any number of threads.

/// The text form of an enum that derives `All` and `Name`: the names of its variants. `$field`: the option that is refused in the error.
macro_rules! named {
    ($kind:ident, $field:literal) => {
        impl std::fmt::Display for $kind {
            fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl std::str::FromStr for $kind {
            type Err = InputError;

            fn from_str(name: &str) -> Result<$kind, InputError> {
                let known = || $kind::ALL.map($kind::name).join(", ");
                let found = $kind::ALL.into_iter().find(|one| one.name() == name);
                found.ok_or_else(|| refusal($field, format!("'{name}' is not known, must be one of {}", known())))
            }
        }
    };
}

mod body;
mod face;
mod head;
mod labels;
mod limbs;
mod sampling;
mod shape;
mod skull;
mod source;
mod speckle;
#[cfg(test)]
mod tests;
mod truth;
mod vessels;

pub use body::{Body, HeartTruth, RampTruth, Truth, Wire};
pub use labels::Label;
pub use sampling::{PointSpread, Sampling};
pub use source::PhantomSource;
pub use speckle::DYNAMIC_RANGE;
pub use truth::distance_path;
pub use vessels::{Vessel, VesselTree};

use crate::Frame;
use crate::files::InputError;
use crate::probe::{Advance, Array, Axis, Motion, Probe, Rigid, SampleType, Volumes};
use crate::sequence::{self, MAX_FRAMES};
use crate::tree::{Defaults, Name};
use body::{Scatterers, refusal};
use glam::DVec3;
use rayon::prelude::*;
use speckle::{Beam, Echo, grey};
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

/// Geometry of an abdominal wobbler: Ra 40..42 mm, Rw 22..27 mm, 70..77 deg, are common.
const ARRAY_RADIUS: f64 = 40.0;
const WOBBLE_RADIUS: f64 = 25.0;
const SECTOR_ANGLE_DEG: f64 = 75.0;
/// Default angle between the first and the last frame of a volume, degrees.
pub const FAN_ANGLE_DEG: f64 = 61.0;
/// Default of [`PhantomOptions::gap`], mm, which is also its largest value.
pub const GAP: f64 = 29.9;
/// Depth of the last sample, mm.
const END_DEPTH: f64 = 120.0;
/// m/s.
const SOUND_SPEED: f64 = 1540.0;

/// Most samples of one volume. Its complex field takes eight bytes a sample.
const MAX_VOLUME_SAMPLES: usize = 1 << 25;

/// How speckle is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Name)]
#[tree(rename_all = "lowercase")]
pub enum Speckle {
    /// One realisation of the speckle, as a probe sees it.
    #[tree(rename = "true")]
    Random,
    /// The mean grey value over all realisations of the speckle, blurred by the probe: the ideal result of a speckle filter.
    Mean,
    /// No speckle: samples are the exact echogenicity, not blurred by the probe.
    #[tree(rename = "false")]
    None,
}

/// Options of a [`Phantom`].
#[derive(Clone, Debug, PartialEq, Defaults)]
pub struct PhantomOptions {
    /// Seed of the random speckle. The scanned object does not depend on it.
    #[value(1)]
    pub seed: u64,
    pub body: Body,
    /// Number of volumes, consecutive in time, 1..=10000.
    #[value(1)]
    pub volumes: usize,
    /// True if every second volume is swept backwards.
    pub both_ways: bool,
    #[value(Speckle::Random)]
    pub speckle: Speckle,
    /// Share of the distance between two frames that the motor travels while one frame is acquired, 0..=1.
    pub speed_ratio: f64,
    /// Number of frames of a volume, 2..=1024.
    #[value(37)]
    pub frames: usize,
    /// Number of scan lines of a frame, 2..=1024.
    #[value(128)]
    pub lines: usize,
    /// Number of samples of a line, 16..=8192, over a depth of 120 mm.
    #[value(512)]
    pub samples: usize,
    /// Angle between the first and the last frame of a volume, degrees, 10..=120.
    #[value(FAN_ANGLE_DEG)]
    pub fan_angle_deg: f64,
    #[value(PointSpread { axial_mm: 0.35, lateral_deg: 0.8, elevation_deg: 1.2 })]
    pub point_spread: PointSpread,
    /// True if the head does not move and the heart does not beat.
    pub still: bool,
    /// Amplitude of the change of the heart rate, as a share of its mean, 0..=0.3.
    pub heart_swing: f64,
    /// Least distance between the near uterine wall and the fetus of body head, filled by fluid, mm, 0..=29.9. A smaller gap makes the wall
    /// thicker.
    #[value(GAP)]
    pub gap: f64,
    /// Level of clutter in body head, a haze of reverberations and side lobes everywhere, dB re full scale, -60..=0. None: no clutter.
    pub clutter_db: Option<f64>,
    /// How the body head or vessels was moved before the sweep, in the coordinates of [`Probe`]. Other bodies cannot be moved.
    pub moved: Rigid,
}

impl PhantomOptions {
    /// The point between the eyes of the head where [`PhantomOptions::moved`] is no motion, mm in the coordinates of [`Probe`]: 55 mm below the
    /// array's face.
    pub const CENTRE: DVec3 = DVec3::new(0.0, ARRAY_RADIUS + 55.0, 0.0);
}

/// A simulated sweep: the checked options and the probe that they define. Frames are computed on request.
pub struct Phantom {
    options: PhantomOptions,
    /// Without its advance.
    probe: Probe,
    volumes: Volumes,
    scatterers: Scatterers,
}

impl Phantom {
    /// Checks the options and makes the phantom.
    ///
    /// # Errors
    /// An option is out of its range.
    pub fn new(options: PhantomOptions) -> Result<Phantom, InputError> {
        let whole = |field, value: usize, least: usize, most: usize| match (least..=most).contains(&value) {
            true => Ok(()),
            false => Err(refusal(field, format!("is {value}, must lie in {least}..={most}"))),
        };
        whole("volumes", options.volumes, 1, 10_000)?;
        whole("frames", options.frames, 2, 1024)?;
        whole("lines", options.lines, 2, 1024)?;
        whole("samples", options.samples, 16, 8192)?;
        // Cannot overflow: 2^10 frames of 2^10 lines of 2^13 samples.
        if options.frames * options.lines * options.samples > MAX_VOLUME_SAMPLES {
            return Err(refusal("samples", format!("more than {MAX_VOLUME_SAMPLES} in a volume")));
        }
        let spread = options.point_spread;
        for (field, value, least, most) in [
            ("speed_ratio", options.speed_ratio, 0.0, 1.0),
            ("fan_angle", options.fan_angle_deg, 10.0, 120.0),
            ("heart_swing", options.heart_swing, 0.0, 0.3),
            ("gap", options.gap, 0.0, GAP),
            ("clutter", options.clutter_db.unwrap_or(0.0), -60.0, 0.0),
            ("psf_axial", spread.axial_mm, 0.0, 5.0),
            ("psf_lateral", spread.lateral_deg, 0.0, 10.0),
            ("psf_elevation", spread.elevation_deg, 0.0, 10.0),
        ] {
            if !(least..=most).contains(&value) {
                return Err(refusal(field, format!("is {value}, must lie in {least}..={most}")));
            }
        }
        if options.moved != Rigid::default() && !matches!(options.body, Body::Head | Body::Vessels) {
            return Err(refusal("moved", "is for the bodies head and vessels"));
        }
        let volumes = Volumes {
            both_ways: options.both_ways,
            speed_ratio: options.speed_ratio,
            ..Volumes::forward(options.frames, options.volumes)
        };
        let spread = |angle_deg: f64, count: usize| Axis::centred(angle_deg.to_radians() / (count - 1) as f64, count);
        let probe = Probe {
            array: Array::Curved { radius: ARRAY_RADIUS },
            lines: spread(SECTOR_ANGLE_DEG, options.lines),
            start_depth: 0.0,
            sample_pitch: END_DEPTH / (options.samples - 1) as f64,
            samples: options.samples,
            motion: Motion::Fan { wobble_radius: WOBBLE_RADIUS },
            slices: spread(options.fan_angle_deg, options.frames),
            advance: Advance::None,
            sound_speed: SOUND_SPEED,
        };
        let scatterers = Scatterers::new(&options, &probe);
        let phantom = Phantom { options, probe, volumes, scatterers };
        for volume in 0..phantom.options.volumes.min(2) {
            phantom.probe(volume).check().map_err(|e| refusal(e.field, e.fault))?;
        }
        Ok(phantom)
    }

    pub fn options(&self) -> &PhantomOptions {
        &self.options
    }

    pub fn volumes(&self) -> usize {
        self.volumes.count
    }

    /// The probe during the volume of this index, including the motor's travel during each frame.
    pub fn probe(&self, volume: usize) -> Probe {
        self.volumes.swept(volume, &self.probe)
    }

    /// The ground truth of the scanned object where it was before [`PhantomOptions::moved`]: positions in the coordinates of [`Probe`], grey values
    /// without speckle.
    pub fn truth(&self) -> Truth {
        self.scatterers.truth()
    }

    /// Computes the frames of a volume, in order of acquisition. Samples are u8, log-compressed over [`DYNAMIC_RANGE`].
    pub fn volume(&self, volume: usize) -> Vec<Frame> {
        let probe = self.probe(volume);
        let backward = self.volumes.backward(volume);
        let frames = self.options.frames;

        let back = self.options.moved.map().inverse();
        let along = |frame: usize, slice: f64, echoes: &mut [Echo]| {
            for (line, out) in echoes.chunks_exact_mut(self.options.samples).enumerate() {
                let time = self.line_time(volume, frame, line);
                self.scatterers.along(&Beam::new(&probe, line, slice, time).moved(&back), out);
            }
        };
        let still = || -> Vec<Vec<Echo>> {
            let echoes = |frame: usize| {
                let mut echoes = vec![Echo::SILENT; self.options.lines * self.options.samples];
                along(frame, frame as f64, &mut echoes);
                echoes
            };
            (0..frames).into_par_iter().map(echoes).collect()
        };
        // Scatterers at rest give the same speckle in every volume. Those of a moving body do not.
        let noise_of_volume = if self.options.body == Body::Head { volume as u64 } else { 0 };
        let (psf, seed) = (&self.options.point_spread, self.options.seed);
        let slices: Vec<Vec<u8>> = match (self.options.speckle, self.options.body) {
            (Speckle::Random, Body::Heart) => speckle::moving_slices(&probe, psf, Some(seed), along),
            (Speckle::Mean, Body::Heart) => speckle::moving_slices(&probe, psf, None, along),
            (Speckle::Random, _) => speckle::slices(&still(), &probe, psf, seed, noise_of_volume),
            (Speckle::Mean, _) => speckle::mean_slices(&still(), &probe, psf),
            (Speckle::None, _) => {
                still().par_iter().map(|slice| slice.iter().map(|e| grey(e.bare())).collect()).collect()
            }
        };
        let mut made: Vec<Frame> = slices
            .into_iter()
            .enumerate()
            .map(|(slice, bytes)| Frame {
                number: self.number_of(volume, slice) as u32,
                backward,
                time: Some(self.line_time(volume, slice, 0)),
                ..Frame::of_slice(volume as u32, slice, bytes)
            })
            .collect();
        made.sort_by_key(|frame| frame.number);
        made
    }

    /// The number of a slice in order of acquisition.
    fn number_of(&self, volume: usize, slice: usize) -> usize {
        if self.volumes.backward(volume) { self.options.frames - 1 - slice } else { slice }
    }

    /// When a line is fired, s. A line takes 2 d / c (thesis 4.5), and the next one follows at once.
    fn line_time(&self, volume: usize, slice: usize, line: usize) -> f64 {
        let PhantomOptions { frames, lines, .. } = self.options;
        let each = self.probe.acquisition_time() / (frames * lines) as f64;
        ((volume * frames + self.number_of(volume, slice)) * lines + line) as f64 * each
    }

    /// Writes all volumes as a PLUS sequence (`.mha`), and the probe file `<stem>.probe.toml`. The sequence exists only if both files are
    /// complete.
    ///
    /// # Errors
    /// More than 20000 frames, a path that does not end in .mha, or a file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), InputError> {
        let frames = self.options.frames * self.volumes();
        if frames > MAX_FRAMES {
            let why = format!("make {frames} frames, a file holds at most {MAX_FRAMES}");
            return Err(InputError::new(path, "volumes", why));
        }
        sequence::write_both(path, &header(self), &probe_file(self), |file| {
            let mut frames = (0..self.volumes()).flat_map(|volume| self.volume(volume));
            frames.try_for_each(|frame| file.write_all(&frame.bytes)).map_err(|e| InputError::unwritable(path, &e))
        })
    }
}

/// The header of the sequence. If the keys of a pre-scan sweep can describe all of it, they are added, so that the file needs no probe
/// file.
fn header(phantom: &Phantom) -> String {
    let options = phantom.options();
    let probe = phantom.probe(0);
    let frames = options.frames * phantom.volumes();
    let mut more = sequence::comment(true);
    if phantom.volumes() == 1 && options.speed_ratio == 0.0 {
        // Metres and radians. Writing to a String cannot fail.
        let _ = write!(
            more,
            "IsTransducerConvex = True\nTransducerRadius = {}\nScanLinePitch = {}\nAxialResolution = {}\n\
             MotorType = TiltingMotor\nMotorRadius = {}\nFramePitch = {}\n",
            ARRAY_RADIUS / 1e3,
            probe.lines.pitch(),
            probe.sample_pitch / 1e3,
            WOBBLE_RADIUS / 1e3,
            probe.slices.pitch()
        );
    }
    let frame_time = probe.acquisition_time() / options.frames as f64;
    let times = (0..frames).map(|n| (n, format!("{:.6}", n as f64 * frame_time)));
    sequence::header([options.samples, options.lines, frames], SampleType::U8, &more, times)
}

fn probe_file(phantom: &Phantom) -> String {
    let options = phantom.options();
    let mut text = format!(
        "# Probe of a phantom sweep: body {}, seed {}, speckle {}. Lengths in mm, angles in degrees.\n",
        options.body,
        options.seed,
        options.speckle.name()
    );
    let probe = phantom.probe(0);
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "[array]\nkind = \"curved\"\nradius_mm = {ARRAY_RADIUS:?}\n\n\
         [lines]\nsector_angle_deg = {SECTOR_ANGLE_DEG:?}\n\n\
         [depth]\nstart_mm = {:?}\nsample_pitch_mm = {:?}\n\n\
         [motion]\nkind = \"fan\"\nwobble_radius_mm = {WOBBLE_RADIUS:?}\nfan_angle_deg = {:?}\n\
         frames_per_volume = {}\nboth_ways = {}\nspeed_ratio = {:?}\n\n\
         [sound]\nspeed_m_per_s = {SOUND_SPEED:?}\n",
        probe.start_depth,
        probe.sample_pitch,
        options.fan_angle_deg,
        options.frames,
        options.both_ways,
        options.speed_ratio
    );
    text
}
