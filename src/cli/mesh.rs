//! `echolume mesh`: the surface of a recording as triangles.

use super::recordings::{OUTPUT, check_written, read_with_threshold, share_of};
use crate::args::{GeometryArgs, check_number, open_recording, recording_help};
use crate::mesh::Mesh;
use crate::mesh::base::Base;
use crate::mesh::files::{Colours, MeshFile};
use crate::mesh::nets::{Surface, surface_net};
use crate::mesh::smooth::Smoother;
use crate::mesh::{quadrics, simplify};
use crate::probe::{Geometry, Grid, World};
use crate::scene::default_look::smoothing;
use crate::scene::{Input, depth_offset};
use crate::source::convert::{Volume, target_grid};
use crate::terminal::{self, Failure, failed, input, say};
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(
    after_help = "The surface is where the volume, between 0 and 1 of its sample range, passes the threshold. It is closed at the border of the \
                        volume, half a voxel outside, so that it can be printed; with --open it ends there. Coordinates are mm, those of the \
                        world (LPS) where the recording states them. STL has neither colours nor a unit. With a base or closed it is \
                        watertight, unless --fast leaves edges open. What a picture shows, an open sheet from its distance map in its colours, is written by render --mesh.\n\nExamples:\n  \
                        echolume mesh sweep.mha face.stl\n  \
                        echolume mesh sweep.mha face.stl --simplify 0.1\n  \
                        echolume mesh sweep.mha relief.stl --base 3\n  \
                        echolume mesh bone.mha bone.glb --threshold 0.4 --spacing 0.5 --smooth 0.5 --open"
)]
pub struct MakeMesh {
    #[arg(help = recording_help())]
    input: PathBuf,
    /// File to write: .stl, .ply or .glb
    #[arg(value_name = "OUTPUT", required_unless_present = "named")]
    output: Option<PathBuf>,
    /// The file to write, as other commands take it
    #[arg(short = 'o', long = "output", value_name = "OUTPUT", id = "named", conflicts_with = "output")]
    named: Option<PathBuf>,
    /// Value of the surface, 0..1 of the sample range as volume.threshold [default: between the darker and the brighter class of echoes]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    threshold: Option<f64>,
    /// Voxel spacing along every axis, mm [default: a Cartesian volume keeps its voxels; a sweep gets the sample spacing of a scan line]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    spacing: Option<f64>,
    /// Standard deviation of the Gaussian that smooths the volume first, mm [default: a Cartesian volume is not smoothed; a sweep as by
    /// render without a preset]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    smooth: Option<f64>,
    /// Take away triangles as long as no point of the surface moves by more than this, mm; closed stays closed
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    simplify: Option<f64>,
    /// Simplify by quadrics, many times faster and to fewer triangles: without a bound, and edges may be left open
    #[arg(long, requires = "simplify")]
    fast: bool,
    /// Fill everything behind the surface, as the probe sees it, down to a flat base this far below the deepest place of the surface, mm:
    /// a relief to print
    #[arg(long, value_name = "MM", conflicts_with = "open", allow_negative_numbers = true)]
    base: Option<f64>,
    /// Leave out what lies above this depth, mm as region.depth [default: nothing; with --base a bright layer next to the probe, as by render
    /// without a preset]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    start: Option<f64>,
    /// Leave the surface open at the border of the volume
    #[arg(long)]
    open: bool,
    /// Colour of the vertices: grey or skin
    #[arg(long, value_name = "NAME", default_value = "grey")]
    colour: String,
    /// Volume of the recording to use, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    volume: usize,
    #[command(flatten)]
    geometry: GeometryArgs,
}

/// Colours by name, sRGB.
const COLOURS: [(&str, [u8; 3]); 2] = [("grey", [128, 128, 128]), ("skin", [224, 172, 140])];
/// Thickest base, mm.
const MAX_BASE: f64 = 1000.0;
/// Most rows of a slice with a base: as many as an edge of a volume that is written.
const MAX_ROWS: usize = 16_384;
/// Widest smoothing, voxels: its slices are kept in memory.
const MAX_DEVIATION: f64 = 32.0;

impl MakeMesh {
    /// The file to write: clap has seen to it that it is stated once.
    fn output(&self) -> &Path {
        self.named.as_deref().or(self.output.as_deref()).unwrap_or(Path::new(""))
    }

    pub fn run(&self) -> Result<(), Failure> {
        let format = MeshFile::of(self.output()).map_err(input)?;
        let colour = COLOURS.iter().find(|(name, _)| self.colour.eq_ignore_ascii_case(name));
        let (_, colour) = colour.ok_or_else(|| input(format!("--colour {}: must be grey or skin", self.colour)))?;
        check_number("--threshold", self.threshold, |share| (0.0..=1.0).contains(&share), "must lie in 0..=1")?;
        let is_length = |mm: f64| mm.is_finite() && mm > 0.0;
        check_number("--simplify", self.simplify, is_length, "must be a length above 0 mm")?;
        let base = format!("must be a length above 0 and up to {MAX_BASE} mm");
        check_number("--base", self.base, |mm| mm > 0.0 && mm <= MAX_BASE, &base)?;
        check_number("--start", self.start, f64::is_finite, "must be a depth, mm")?;
        let mut recording = open_recording(&self.input, self.geometry.options())?;
        check_written(&[(OUTPUT, Some(self.output()))], &*recording, &self.geometry)?;
        let samples = Input { stored: recording.stored_type(), range: recording.range() };
        let (shift, world) = (recording.sample_type().shift(), recording.world_of(self.volume));
        let (geometry, volume, found) = read_with_threshold(&mut *recording, &self.input, self.volume, samples)?;
        let grid = target_grid(&geometry, self.spacing).map_err(input)?;
        let share = share_of(self.threshold, found.as_ref(), &self.input)?;
        let [low, high] = samples.range;
        let threshold = low + share * (high - low);
        let world = World::resampled(world, &geometry, &grid);
        let deviation = self.deviation(&geometry, &grid.spacing)?;
        let start = self.start.or(self.base.and(found.as_ref()).and_then(|levels| levels.start));
        // Depths are stated below the probe's face.
        let face = depth_offset(&geometry);
        // Rows of a slice that are left out.
        let rows = start.map_or(0.0, |depth| ((depth + face - grid.origin[1]) / grid.spacing[1]).ceil());
        let left_out = rows.clamp(0.0, grid.size[1] as f64) as usize;
        let asked = Asked { grid, world, deviation, left_out, threshold };
        let (mesh, rows) = self.net(&asked, &volume)?;
        let in_file = threshold - shift;
        if mesh.triangles.is_empty() {
            let fault =
                format!("no voxel differs from the others at --threshold {share:.3} ({in_file:.4} in the file)");
            return Err(input(format!("{}: nothing is written: {fault}", self.output().display())));
        }
        let mut how = format!("threshold {share:.3} ({in_file:.4} in the file), smoothed by {deviation:.2} mm");
        if let Some(depth) = start {
            how += &format!(", from a depth of {depth:.2} mm");
        }
        if self.base.is_some() {
            // Half a voxel below the last row.
            let depth = grid.origin[1] - face + (rows as f64 - 0.5) * grid.spacing[1];
            how += &format!(", filled down to a base at a depth of {depth:.2} mm");
        }
        let mesh = match self.simplify {
            None => mesh,
            Some(mm) if self.fast => {
                how += &format!(
                    ", simplified from {} triangles by quadrics for {mm} mm, without a bound",
                    mesh.triangles.len()
                );
                quadrics::simplified(&mesh, mm)
            }
            Some(mm) => {
                let (simple, bound) = simplify::simplified(&mesh, mm);
                how += &format!(
                    ", simplified from {} triangles, at most {} mm off",
                    mesh.triangles.len(),
                    rounded_up(bound)
                );
                simple
            }
        };
        format.write(&mesh, Colours::One(*colour), self.output()).map_err(failed)?;
        self.say(&mesh, &how);
        Ok(())
    }

    /// The mesh, and the rows of its lattice.
    fn net(&self, asked: &Asked, volume: &Volume) -> Result<(Mesh, usize), Failure> {
        let Asked { grid, world, deviation, left_out, threshold } = asked;
        let bar = self.bar(grid);
        let above = left_out * grid.size[0];
        let reader = || {
            let mut smoother = Smoother::new(grid.size, grid.spacing, *deviation);
            let bar = &bar;
            move |z: usize, out: &mut [f64]| {
                smoother.slice(z, out, |z, out| {
                    volume.slice(grid, z, out);
                    out.iter_mut().take(above).for_each(|value| *value = f64::NAN);
                });
                bar.inc(1);
            }
        };
        let mut size = grid.size;
        let mut base = None;
        let mut own = vec![0.0; size[0] * size[1]];
        if let Some(mm) = self.base {
            let (mut found, mut read) = (Base::new(size[0], *threshold), reader());
            for z in 0..size[2] {
                read(z, &mut own);
                found.survey(&own);
            }
            size[1] = self.rows(grid, mm, found.deepest())?;
            base = Some(found);
        }
        let mut read = reader();
        let slice = |z: usize, out: &mut [f64]| {
            match &base {
                None => read(z, out),
                Some(base) => {
                    read(z, &mut own);
                    base.fill(&own, out);
                }
            }
            Ok::<(), String>(())
        };
        let surface = Surface { threshold: *threshold, closed: !self.open };
        let mesh = surface_net(size, surface, slice, |at| world.at(at)).map_err(failed)?;
        bar.finish_and_clear();
        Ok((mesh, size[1]))
    }

    /// A bar of the slices to go; with a base each is read twice.
    fn bar(&self, grid: &Grid) -> ProgressBar {
        let times = if self.base.is_some() { 2 } else { 1 };
        terminal::progress_bar((times * grid.size[2]) as u64).with_message("slices")
    }

    /// Rows of a lattice with a base `mm` thick. `deepest`: the last row at which a column is inside for the first time.
    fn rows(&self, grid: &Grid, mm: f64, deepest: Option<usize>) -> Result<usize, Failure> {
        let thickness = (mm / grid.spacing[1]).ceil() as usize;
        let rows = deepest.map_or(grid.size[1], |row| row.saturating_add(1 + thickness));
        if rows > MAX_ROWS {
            let fault = format!("--base {mm}: makes {rows} rows of {} mm, at most {MAX_ROWS}", grid.spacing[1]);
            return Err(input(format!("{fault}; give a thinner base or a larger --spacing")));
        }
        Ok(rows)
    }

    /// Standard deviation of the smoothing, mm.
    fn deviation(&self, geometry: &Geometry, spacing: &[f64; 3]) -> Result<f64, Failure> {
        let deviation = match (self.smooth, geometry) {
            (Some(mm), _) => mm,
            (None, Geometry::Sweep(_)) => smoothing(geometry),
            (None, Geometry::Cartesian(_)) => 0.0,
        };
        let most = MAX_DEVIATION * spacing.iter().copied().fold(f64::INFINITY, f64::min);
        match (0.0..=most).contains(&deviation) {
            true => Ok(deviation),
            // The default is for volumes that are finer than it.
            false if self.smooth.is_none() => Ok(most),
            false => Err(input(format!("--smooth {deviation}: must lie in 0..={most} mm, {MAX_DEVIATION} voxels"))),
        }
    }

    fn say(&self, mesh: &Mesh, how: &str) {
        let (triangles, vertices) = (mesh.triangles.len(), mesh.vertices.len());
        let area = mesh.area() / 100.0;
        let extent = match mesh.open_edges {
            0 => format!("closed, {:.3} ml, {area:.3} cm2", mesh.volume() / 1000.0),
            edges if self.fast => format!("open at {edges} edges, {area:.3} cm2"),
            _ => format!("open at the border, {area:.3} cm2"),
        };
        say!("mesh: {}, {triangles} triangles of {vertices} vertices, {extent}; {how}", self.output().display());
    }
}

/// What a mesh is made of.
struct Asked {
    grid: Grid,
    world: World,
    /// Standard deviation of the smoothing, mm.
    deviation: f64,
    /// Rows of a slice.
    left_out: usize,
    threshold: f64,
}

/// A bound with four decimals or, if it is small, two digits. It is rounded up: a bound that is printed smaller than it is would be none.
fn rounded_up(bound: f64) -> String {
    let digits = if bound > 0.0 { (1.0 - bound.log10().floor()).clamp(4.0, 15.0) as usize } else { 4 };
    let scale = 10f64.powi(digits as i32);
    let mut steps = (bound * scale).ceil();
    // The product may have been rounded down to a whole number.
    if steps / scale < bound {
        steps += 1.0;
    }
    format!("{:.digits$}", steps / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_never_printed_smaller_than_it_is() {
        for (bound, printed) in [
            (0.0, "0.0000"),
            (0.1, "0.1000"),
            (0.12344, "0.1235"),
            (0.123_400_01, "0.1235"),
            (12.000_04, "12.0001"),
            (2.04e-5, "0.000021"),
            (1e-9, "0.0000000010"),
        ] {
            assert_eq!(rounded_up(bound), printed, "{bound}");
        }
        // By a rule of its own: the printed number, read back, is no smaller and at most a step larger.
        let mut bound: f64 = 1e-12;
        while bound < 100.0 {
            let printed: f64 = rounded_up(bound).parse().expect("a number");
            assert!(
                printed >= bound && printed <= bound + 1.01e-4f64.min(0.11 * bound).max(1.01e-15),
                "{bound}: {printed}"
            );
            bound *= 1.037;
        }
    }
}
