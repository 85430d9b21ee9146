//! `echolume segment`: finds the bodies of a recording, labels them, and measures their volumes.

use super::recordings::{OUTPUT, check_written, read_volume};
use crate::args::{GeometryArgs, check_number, open_recording, recording_help};
use crate::files::replace;
use crate::mesh::files::{Colours, MeshFile};
use crate::probe::{Geometry, Grid, World};
use crate::scene::depth_offset;
use crate::segment::bodies::{Body, Found, OPENING, SMOOTHING, Search, find};
use crate::segment::{Field, Scale, cropped, files, usual_grid};
use crate::source::convert::target_grid;
use crate::source::segmentation;
use crate::terminal::{Failure, failed, input, remark, say, with_progress};
use glam::DVec3;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(
    after_help = "A body is what is brighter (--dark: darker) than the echoes around it. Its volume is that of what lies deeper than the shell around \
                  its surface, plus a share of the shell: how far the shell's mean echo is from that outside towards that inside. The interval of 95 % \
                  is of speckle, the thickness of the shell and the range of the log compression. Coordinates are mm: lateral, depth below the probe's face, elevation, as those of region.\n\n\
                  Examples:\n  \
                  echolume segment sweep.mha -o bodies.seg.nrrd\n  \
                  echolume segment ovary.mha -o follicles.seg.nrrd --dark --least 0.05 --csv follicles.csv\n  \
                  echolume segment sweep.mha -o mass.seg.nrrd --seed 4,62,-3 --box depth=30:90 --stl mass.stl"
)]
pub struct Segment {
    #[arg(help = recording_help())]
    input: PathBuf,
    /// Segmentation to write, a segment for each body: .seg.nrrd as 3D Slicer reads it, or .seg.dcm (DICOM Segmentation)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Level of the surface, 0..1 of the sample range as volume.threshold; auto: half of the step between the two classes next to it
    #[arg(long, value_name = "auto|SHARE", default_value = "auto", allow_hyphen_values = true)]
    threshold: String,
    /// Find bodies that are darker than what is around them, such as cysts and follicles
    #[arg(long)]
    dark: bool,
    /// Find only the body at this place: lateral, depth, elevation, mm
    #[arg(long, value_name = "L,D,E", value_parser = place, allow_hyphen_values = true)]
    seed: Option<DVec3>,
    /// Standard deviation of the Gaussian that smooths the echoes first, mm
    #[arg(long, value_name = "MM", default_value_t = SMOOTHING, allow_negative_numbers = true)]
    smooth: f64,
    /// Cut necks that a ball of this radius does not pass, mm [default: 0, with --seed 1]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    opening: Option<f64>,
    /// Search in this box, mm: lateral=LOW:HIGH,depth=LOW:HIGH,elevation=LOW:HIGH [default: everywhere]
    #[arg(long = "box", value_name = "SIDE=LOW:HIGH,...", id = "box", allow_hyphen_values = true)]
    within: Option<String>,
    /// Smallest body, cm3; a seed's may be smaller
    #[arg(long, value_name = "CM3", default_value_t = 0.1, allow_negative_numbers = true)]
    least: f64,
    /// Range of the log compression, dB over the sample range; none: samples are linear [default: by the speckle]
    #[arg(long, value_name = "DB|none")]
    decibels: Option<String>,
    /// Voxel spacing along every axis, mm [default: a Cartesian volume keeps its voxels; a sweep gets 0.5]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    spacing: Option<f64>,
    /// Also write the table of the bodies as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Also write the surface of the largest body (.stl, .ply or .glb)
    #[arg(long, value_name = "FILE")]
    stl: Option<PathBuf>,
    /// Volume of the recording to use, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    volume: usize,
    #[command(flatten)]
    geometry: GeometryArgs,
}

/// Colour of a mesh.
const GREY: [u8; 3] = [128; 3];

/// Three coordinates with commas between them.
fn place(text: &str) -> Result<DVec3, String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
    let three = numbers.and_then(|n| <[f64; 3]>::try_from(n).ok());
    three.map(DVec3::from).ok_or_else(|| "must read LATERAL,DEPTH,ELEVATION in mm, as 4,62,-3".into())
}

impl Segment {
    pub fn run(&self) -> Result<(), Failure> {
        if !segmentation::is_one(&self.output) && !segmentation::is_dicom(&self.output) {
            return Err(input(format!("{}: must end in .seg.nrrd or .seg.dcm", self.output.display())));
        }
        let mesh_file = self.stl.as_deref().map(|file| MeshFile::of(file).map(|format| (file, format)));
        let mesh_file = mesh_file.transpose().map_err(input)?;
        let (share, opening) = (self.share()?, self.opening.unwrap_or(if self.seed.is_some() { OPENING } else { 0.0 }));
        for (flag, value) in [("--opening", opening), ("--least", self.least), ("--smooth", self.smooth)] {
            check_number(flag, value, |value| value.is_finite() && value >= 0.0, "must be 0 or more")?;
        }
        let mut recording = open_recording(&self.input, self.geometry.options())?;
        let outputs = [(OUTPUT, Some(&*self.output)), ("--csv", self.csv.as_deref()), ("--stl", self.stl.as_deref())];
        check_written(&outputs, &*recording, &self.geometry)?;
        let (range, world) = (recording.range(), recording.world_of(self.volume));
        let (geometry, volume, _) = read_volume(&mut *recording, &self.input, self.volume, |_, _| ())?;
        let grid = self.grid(&geometry)?;
        let most = Search::most(&grid);
        for (flag, value) in [("--smooth", self.smooth), ("--opening", opening)] {
            check_number(flag, value, |mm| mm <= most, &format!("at most {most} mm, 32 voxels"))?;
        }
        let world = World::resampled(world, &geometry, &grid);
        let scale = self.scale()?.unwrap_or_else(|| Scale::by_speckle(&volume, range));
        let face = DVec3::Y * depth_offset(&geometry);
        let of_file = |why: String| input(format!("{}: {why}", self.input.display()));
        let slices = grid.size[2] as u64;
        let field =
            with_progress(slices, "slices", |step| Field::of(&volume, range, scale, grid, step)).map_err(of_file)?;
        drop(volume);
        let search = Search {
            is_dark: self.dark,
            level: share.map(|share| scale.searched(share)),
            smoothing: self.smooth,
            opening,
            seed: self.seed.map(|seed| seed + face),
            least: 1000.0 * self.least,
        };
        let found = find(&field, world, &search).map_err(of_file)?;
        files::write(&found.labels, &self.output, |label| format!("body {label}")).map_err(failed)?;
        if let Some((file, format)) = mesh_file {
            let mesh = files::surface(&found.labels, 1).map_err(failed)?;
            format.write(&mesh, Colours::One(GREY), file).map_err(failed)?;
        }
        if let Some(file) = &self.csv {
            replace(file, csv(&found.bodies, face).as_bytes()).map_err(failed)?;
        }
        self.say(&found, scale, face);
        Ok(())
    }

    /// The threshold that is stated; None for auto.
    fn share(&self) -> Result<Option<f64>, Failure> {
        if self.threshold.eq_ignore_ascii_case("auto") {
            return Ok(None);
        }
        let share = self.threshold.parse().ok().filter(|share| (0.0..=1.0).contains(share));
        let fault = || input(format!("--threshold {}: must be auto or lie in 0..=1", self.threshold));
        share.map(Some).ok_or_else(fault)
    }

    /// The scale that is stated.
    fn scale(&self) -> Result<Option<Scale>, Failure> {
        let Some(text) = &self.decibels else { return Ok(None) };
        if text.eq_ignore_ascii_case("none") {
            return Ok(Some(Scale::Linear));
        }
        let range = text.parse().ok().filter(|range| (1.0..=200.0).contains(range));
        let fault = || input(format!("--decibels {text}: must be none or lie in 1..=200"));
        range.map(|range| Some(Scale::Decibels(range))).ok_or_else(fault)
    }

    /// The lattice: that of the volume, or of the spacing, within the box.
    fn grid(&self, geometry: &Geometry) -> Result<Grid, Failure> {
        let grid = if self.spacing.is_none() { usual_grid(geometry) } else { target_grid(geometry, self.spacing) };
        let mut grid = grid.map_err(input)?;
        let Some(text) = &self.within else { return Ok(grid) };
        let fault = |why: &str| input(format!("--box {text}: {why}"));
        let face = [0.0, depth_offset(geometry), 0.0];
        for side in text.split(',') {
            const FORM: &str = "must read SIDE=LOW:HIGH,... in mm, with the sides lateral, depth and elevation";
            let (name, ends) = side.split_once('=').ok_or_else(|| fault(FORM))?;
            let (low, high) = ends.split_once(':').ok_or_else(|| fault(FORM))?;
            let axis = ["lateral", "depth", "elevation"].iter().position(|known| *known == name.trim());
            let [Ok(low), Ok(high)] = [low, high].map(|end| end.trim().parse::<f64>()) else { return Err(fault(FORM)) };
            let axis = axis.filter(|_| low < high).ok_or_else(|| fault(FORM))?;
            let mut corners = [DVec3::NEG_INFINITY, DVec3::INFINITY];
            [corners[0][axis], corners[1][axis]] = [low, high].map(|end| end + face[axis]);
            let empty = || fault(&format!("nothing of the volume lies within its {}", name.trim()));
            grid = cropped(&grid, corners).ok_or_else(empty)?;
        }
        Ok(grid)
    }

    fn say(&self, found: &Found, scale: Scale, face: DVec3) {
        say!(
            "{:>5}  {:>10}  {:>21}  {:>30}  {:>8}",
            "label",
            "volume cm3",
            "95 % interval",
            "lateral, depth, elevation mm",
            "diameter"
        );
        for body in &found.bodies {
            let (volume, interval) = match &body.measured {
                Ok(m) => (m.volume, format!("{:.3} to {:.3}", m.low / 1000.0, m.high / 1000.0)),
                Err(why) => (body.labelled, (*why).to_string()),
            };
            let [l, d, e] = (body.centroid - face).to_array();
            let place = format!("{l:.1}, {d:.1}, {e:.1}");
            let cut = if body.is_cut { "  at the border" } else { "" };
            say!(
                "{:5}  {:10.3}  {interval:>21}  {place:>30}  {:8.1}{cut}",
                body.label,
                volume / 1000.0,
                diameter(volume)
            );
        }
        let range = match scale {
            Scale::Linear => " (linear)".into(),
            Scale::Decibels(range) => format!(" ({range:.0} dB)"),
        };
        let share = scale.share(found.level);
        let [x, y, z] = found.labels.grid().size;
        let (count, shown) = (found.bodies.len(), self.output.display());
        say!(
            "segmentation: {shown}, {x} x {y} x {z} voxels; bodies: {count}; threshold {share:.4} of the sample range{range}, smoothed by {} mm",
            self.smooth
        );
        if found.left_out > 0 {
            remark(&format!("{shown}: {} smaller bodies are left out; --least sets the smallest", found.left_out));
        }
    }
}

/// The diameter of a ball of this volume, mm.
fn diameter(volume: f64) -> f64 {
    (6.0 * volume / std::f64::consts::PI).cbrt()
}

/// The table as CSV: volumes in cm3, lengths in mm; without an interval where nothing could be measured.
fn csv(bodies: &[Body], face: DVec3) -> String {
    let mut text = String::from(
        "label,volume_cm3,low_cm3,high_cm3,labelled_cm3,lateral_mm,depth_mm,elevation_mm,diameter_mm,at_border\n",
    );
    for body in bodies {
        let [l, d, e] = (body.centroid - face).to_array();
        let (volume, ends) = match &body.measured {
            Ok(m) => (m.volume, format!("{:.4},{:.4}", m.low / 1000.0, m.high / 1000.0)),
            Err(_) => (body.labelled, ",".into()),
        };
        text += &format!(
            "{},{:.4},{ends},{:.4},{l:.2},{d:.2},{e:.2},{:.2},{}\n",
            body.label,
            volume / 1000.0,
            body.labelled / 1000.0,
            diameter(volume),
            body.is_cut
        );
    }
    text
}
