//! `echolume convert`, `echolume info` and `echolume phantom`: convert, describe and make recordings.

use crate::args::{GeometryArgs, Output, check_outputs, check_volume, open_recording, recording_help};
use crate::files::signals::Writing;
use crate::probe::{Geometry, Grid, Rigid, World};
use crate::scene::default_look::block_edge;
use crate::scene::{EchoHistogram, EchoLevels, Input, insonified_box};
use crate::segment::files;
use crate::source::convert::{Target, Volume};
use crate::source::phantom::{Body, Label, Phantom, PhantomOptions, PointSpread, Sampling, Speckle, distance_path};
use crate::source::recorder::{Header, Writer};
use crate::source::segmentation;
use crate::source::sequence::{self, Sequence};
use crate::source::volume_file::VolumeFile;
use crate::source::volume_sequence::{self, VolumeSequence};
use crate::source::{self, Description, Frame, Source};
use crate::terminal::{Failure, failed, input, progress_bar, remark, say, with_progress};
use std::path::{Path, PathBuf};

/// Name of the output file in messages.
pub(super) const OUTPUT: &str = "output";

/// Reads the volume with the index `number`. Returns its geometry, its samples and the number of frames that were there. `each` is called with every
/// frame. `file`: path of the recording, for messages. An error if there is no such volume or it cannot be read.
pub(super) fn read_volume(
    recording: &mut dyn Source,
    file: &Path,
    number: usize,
    mut each: impl FnMut(&Geometry, &Frame),
) -> Result<(Geometry, Volume, usize), Failure> {
    check_volume(recording, "--volume", number, file.display())?;
    let geometry = recording.geometry(number);
    let (volume, there) = Volume::read(recording, number, |frame| each(&geometry, frame)).map_err(input)?;
    Ok((geometry, volume, there))
}

/// Reads the volume with the index `number`. Returns its geometry, its samples, and the levels of the echoes, among them the threshold between the
/// darker and the brighter class; None if there are no two classes. `file`: path of the recording, for messages. `samples`: type and range of the
/// stored samples. An error if there is no such volume or it cannot be read.
pub(super) fn read_with_threshold(
    recording: &mut dyn Source,
    file: &Path,
    number: usize,
    samples: Input,
) -> Result<(Geometry, Volume, Option<EchoLevels>), Failure> {
    let mut levels = None;
    let (geometry, volume, _) = read_volume(recording, file, number, |geometry, frame| {
        let histogram = || EchoHistogram::new(geometry, samples, block_edge(geometry));
        levels.get_or_insert_with(histogram).take(&frame.bytes);
    })?;
    let found = levels.and_then(|histogram| histogram.levels());
    Ok((geometry, volume, found))
}

/// The threshold of the user (`asked`), otherwise the one that was found, as a share of the sample range.
///
/// # Errors
/// There is neither.
pub(super) fn share_of(asked: Option<f64>, found: Option<&EchoLevels>, file: &Path) -> Result<f64, Failure> {
    let none = || input(format!("{}: the echoes have no two classes; give --threshold", file.display()));
    asked.or(found.map(|levels| levels.threshold)).ok_or_else(none)
}

/// Checks outputs as [`check_outputs`] does. The inputs are the files of a recording and its probe file.
pub(super) fn check_written(
    outputs: &[Output],
    recording: &dyn Source,
    geometry: &GeometryArgs,
) -> Result<(), Failure> {
    let read = recording.files();
    check_outputs(outputs, read.iter().chain(&geometry.probe).map(PathBuf::as_path))
}

#[derive(clap::Args)]
#[command(after_help = "Example:\n  echolume convert sweep.mha volume.nrrd --spacing 0.5\n  \
                        echolume convert sweep.mha sweep.frames    (checksummed, appended frame by frame; a file that is there is not replaced)\n  \
                        echolume convert sweep.mha tissue.seg.nrrd    (for 3D Slicer)\n  \
                        echolume convert sweep.mha volumes.seq.nrrd    (every volume, as a sequence for 3D Slicer)\n  \
                        echolume convert sweep.frames sweep.mha --sequence    (frames of whole volumes, for other programs)\n  \
                        echolume render volume.mha --mode mip -o mip.png    (the result is a recording, too)")]
pub struct Convert {
    #[arg(help = recording_help())]
    input: PathBuf,
    /// File to write: .mha, .nrrd, .nii, .nii.gz or .dcm (Enhanced US Volume) for a volume, .seq.nrrd for all volumes in time, .seg.nrrd for the voxels above --threshold as a
    /// segmentation, .seg.dcm (DICOM Segmentation) of a .seg.nrrd, .frames for every frame unchanged, .mha with --sequence
    #[arg(value_name = "OUTPUT", required_unless_present = "named")]
    output: Option<PathBuf>,
    /// The file to write, as other commands take it
    #[arg(short = 'o', long = "output", value_name = "OUTPUT", id = "named", conflicts_with = "output")]
    named: Option<PathBuf>,
    /// Voxel spacing along every axis, mm [default: a Cartesian volume keeps its voxels; a sweep gets the sample spacing of a scan line]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    spacing: Option<f64>,
    /// Volume of the recording to use, counted from 0 [default: 0; with .seq.nrrd all]
    #[arg(long, value_name = "N")]
    volume: Option<usize>,
    #[command(flatten)]
    geometry: GeometryArgs,
    /// Value of voxels outside the sector, in the file's own units [default: that of no echo, the low end of the sample range, such as -60 of decibels]
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    outside: Option<f64>,
    /// Also write a volume of 1 inside the sector and 0 outside; .seg.nrrd: as a segmentation
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
    /// With .seg.nrrd: least value of tissue, 0..1 of the sample range as volume.threshold [default: between the darker and the brighter
    /// class of echoes]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    threshold: Option<f64>,
    /// Write .dcm as a secondary capture: slices of 8 bits, from the range that is shown, without the place in the world
    #[arg(long, conflicts_with = "sequence")]
    secondary_capture: bool,
    /// Write the frames of all complete volumes as a PLUS sequence, and their geometry to NAME.probe.toml next to it
    #[arg(long, conflicts_with_all = ["spacing", "volume", "outside", "mask"])]
    sequence: bool,
}

impl Convert {
    /// The file to write: clap has seen to it that it is stated once.
    fn output(&self) -> &Path {
        self.named.as_deref().or(self.output.as_deref()).unwrap_or(Path::new(""))
    }

    pub fn run(&self) -> Result<(), Failure> {
        if self.output().as_os_str() == "-" {
            return Err(input(
                "-: a volume is written to a file, whole or not at all, and the file's ending says its format",
            ));
        }
        if segmentation::is_dicom(self.output()) {
            let others = [
                ("--spacing", self.spacing.is_some()),
                ("--volume", self.volume.is_some()),
                ("--outside", self.outside.is_some()),
                ("--mask", self.mask.is_some()),
                ("--threshold", self.threshold.is_some()),
                ("--secondary-capture", self.secondary_capture),
                ("--sequence", self.sequence),
            ];
            return match others.iter().find(|(_, is_given)| *is_given) {
                Some((flag, _)) => Err(input(format!("{flag}: a .seg.dcm has the labels of a .seg.nrrd as they are"))),
                None => self.labels(),
            };
        }
        let is_segmented = segmentation::is_one(self.output());
        if let Some(share) = self.threshold.filter(|share| !is_segmented || !(0.0..=1.0).contains(share)) {
            let fault = if is_segmented { "must lie in 0..=1" } else { "is for .seg.nrrd" };
            return Err(input(format!("--threshold {share}: {fault}")));
        }
        if self.output().extension().is_some_and(|e| e.eq_ignore_ascii_case("frames")) {
            return self.record();
        }
        if self.sequence {
            return self.sequence();
        }
        if is_segmented {
            return self.segment();
        }
        if volume_sequence::is_one(self.output()) {
            return self.volumes();
        }
        VolumeFile::of(self.output()).map_err(input)?;
        let mut recording = open_recording(&self.input, self.geometry.options())?;
        let number = self.volume.unwrap_or(0);
        check_volume(&*recording, "--volume", number, self.input.display())?;
        let target = self.target(&*recording, number)?;
        let grid = target.grid;
        if self.secondary_capture && target.world != World::of(&grid) {
            let kept = "a secondary capture does not keep the place in the world";
            remark(&format!("{}: {kept}", self.output().display()));
        }
        let is_enhanced =
            matches!(VolumeFile::of(self.output()), Ok(VolumeFile::Dicom { .. })) && !self.secondary_capture;
        if is_enhanced && target.world.directions().determinant() < 0.0 {
            let unread = "its axes are left-handed, of which programs of ITK read neither place nor spacing in DICOM; .nrrd and .mha keep them";
            remark(&format!("{}: {unread}", self.output().display()));
        }
        target.check(self.output()).map_err(input)?;
        if let Some(mask) = &self.mask {
            VolumeFile::of(mask).map_err(input)?;
        }
        self.check_outputs(&[(OUTPUT, Some(self.output())), ("--mask", self.mask.as_deref())], &*recording)?;
        let each = recording.frames_per_volume();
        let (geometry, volume, there) = read_volume(&mut *recording, &self.input, number, |_, _| ())?;
        let slices = grid.size[2] as u64;
        with_progress(slices, "slices", |step| volume.write(&target, self.output(), step)).map_err(failed)?;
        self.write_mask(&volume, &target)?;
        let missing = if there < each { format!(", {there} of {each} frames are there") } else { String::new() };
        say!("volume: {}, {}{missing}", self.output().display(), self.voxels(&target, &geometry));
        self.remark_others(&*recording);
        self.remark_size(&volume, &grid);
        Ok(())
    }

    /// Writes the labels of a segmentation as DICOM.
    fn labels(&self) -> Result<(), Failure> {
        let output = self.output();
        check_outputs(&[(OUTPUT, Some(output))], [&*self.input])?;
        let (labels, segments) = files::read(&self.input, self.geometry.options()).map_err(input)?;
        let [width, height, _] = labels.grid().size;
        let label = |[x, y, z]: [usize; 3]| labels.voxels()[(z * height + y) * width + x];
        segmentation::write(output, labels.grid(), labels.world(), &segments, label, || ()).map_err(failed)?;
        say!("segmentation: {}, {} segments", output.display(), segments.len());
        Ok(())
    }

    /// Writes all volumes, or the one that was chosen, as a sequence of volumes in time.
    fn volumes(&self) -> Result<(), Failure> {
        if let Some(mask) = &self.mask {
            VolumeFile::of(mask).map_err(input)?;
        }
        let mut recording = open_recording(&self.input, self.geometry.options())?;
        let numbers = self.volume.map_or(0..recording.volumes(), |number| number..number.saturating_add(1));
        check_volume(&*recording, "--volume", numbers.start, self.input.display())?;
        VolumeSequence::check(&self.target(&*recording, numbers.start)?, self.output()).map_err(input)?;
        self.check_outputs(&[(OUTPUT, Some(self.output())), ("--mask", self.mask.as_deref())], &*recording)?;
        let sequence = VolumeSequence::of(&mut *recording, numbers, &self.input).map_err(input)?;
        // Of the first volume that is whole.
        let (geometry, target) = (recording.geometry(sequence.first()), self.target(&*recording, sequence.first())?);
        let (count, written) = (sequence.volumes(), self.output());
        let write = |step: &dyn Fn()| sequence.write(&mut *recording, &target, written, step);
        with_progress(count as u64, "volumes", write).map_err(failed)?;
        let empty = Volume::new(geometry.clone(), recording.stored_type());
        self.write_mask(&empty, &target)?;
        let left_out = match sequence.left_out() {
            0 => String::new(),
            n => format!("; {n} volumes are left out, with frames missing"),
        };
        let shown = written.display();
        say!("sequence: {shown}, {count} volumes of {}{left_out}", self.voxels(&target, &geometry));
        if let Err(why) = sequence.times() {
            remark(&format!("{shown}: {why}"));
        }
        self.remark_size(&empty, &target.grid);
        Ok(())
    }

    /// The lattice of a volume, and what is written on it.
    fn target(&self, recording: &dyn Source, number: usize) -> Result<Target, Failure> {
        let mut target = Target::of(recording, number, self.spacing).map_err(input)?;
        if self.secondary_capture {
            target = target.captured(recording.range());
        }
        target.outside = self.outside.unwrap_or(target.outside);
        Ok(target)
    }

    fn write_mask(&self, volume: &Volume, target: &Target) -> Result<(), Failure> {
        let Some(mask) = &self.mask else { return Ok(()) };
        volume.write_mask(target, mask).map_err(failed)?;
        say!("mask: {}, 1 inside and 0 outside", mask.display());
        Ok(())
    }

    /// The voxels of a volume in words.
    fn voxels(&self, target: &Target, geometry: &Geometry) -> String {
        let ([x, y, z], [dx, dy, dz]) = (target.grid.size, target.grid.spacing);
        let spacing = if dx == dy && dy == dz { format!("{dx}") } else { format!("{dx} x {dy} x {dz}") };
        let outside = match geometry {
            Geometry::Sweep(_) if !self.secondary_capture => format!(", {} outside of the sector", target.outside),
            _ => String::new(),
        };
        format!("{x} x {y} x {z} voxels of {spacing} mm{outside}")
    }

    /// Says that a recording has more volumes than the file, unless one was chosen.
    fn remark_others(&self, recording: &dyn Source) {
        let (count, shown) = (recording.volumes(), self.output().display());
        if self.volume.is_none() && count > 1 {
            remark(&format!("{shown}: volume 1 of {count}; NAME.seq.nrrd takes all, --volume another"));
        }
    }

    /// Says if a lattice leaves little or nothing of a volume.
    fn remark_size(&self, volume: &Volume, grid: &Grid) {
        let (shown, geometry) = (self.output().display(), volume.geometry());
        if !volume.meets(grid) {
            remark(&format!("{shown}: is empty: {}", thinner_than(grid, geometry)));
        } else if let Some(left) = self.spacing.and_then(|mm| what_is_left(mm, grid, geometry)) {
            remark(&format!("{shown}: {left}"));
        }
    }

    /// Writes the voxels above a threshold as a segmentation.
    fn segment(&self) -> Result<(), Failure> {
        if self.secondary_capture || self.outside.is_some() {
            let shown = self.output().display();
            return Err(input(format!("{shown}: --secondary-capture and --outside are for volumes of samples")));
        }
        let mut recording = open_recording(&self.input, self.geometry.options())?;
        self.check_outputs(&[(OUTPUT, Some(self.output())), ("--mask", self.mask.as_deref())], &*recording)?;
        let samples = Input { stored: recording.stored_type(), range: recording.range() };
        let (sample, number) = (recording.sample_type(), self.volume.unwrap_or(0));
        let (_, volume, found) = read_with_threshold(&mut *recording, &self.input, number, samples)?;
        let target = self.target(&*recording, number)?;
        let share = share_of(self.threshold, found.as_ref(), &self.input)?;
        let threshold = samples.range[0] + share * (samples.range[1] - samples.range[0]);
        let [x, y, z] = target.grid.size;
        let write = |step: &dyn Fn()| volume.write_tissue(&target, threshold, self.output(), step);
        with_progress(z as u64, "slices", write).map_err(failed)?;
        self.write_mask(&volume, &target)?;
        let in_file = threshold - sample.shift();
        let shown = self.output().display();
        say!(
            "segmentation: {shown}, {x} x {y} x {z} voxels, 1 tissue; threshold {share:.3} ({in_file:.4} in the file)"
        );
        self.remark_others(&*recording);
        Ok(())
    }

    fn check_outputs(&self, targets: &[Output], recording: &dyn Source) -> Result<(), Failure> {
        check_written(targets, recording, &self.geometry)
    }

    /// Writes the frames of all complete volumes as a PLUS sequence.
    fn sequence(&self) -> Result<(), Failure> {
        if VolumeFile::of(self.output()).map_err(input)? != VolumeFile::MetaImage {
            return Err(input(format!("{}: a sequence must end in .mha", self.output().display())));
        }
        let mut recording = open_recording(&self.input, self.geometry.options())?;
        let beside = sequence::probe_file_path(self.output());
        self.check_outputs(&[(OUTPUT, Some(self.output())), (OUTPUT, Some(&beside))], &*recording)?;
        let sequence = Sequence::of(&mut *recording, &self.input).map_err(input)?;
        let (frames, volumes) = (sequence.frames(), sequence.volumes());
        let write = |step: &dyn Fn()| sequence.write(&mut *recording, self.output(), step);
        with_progress(volumes as u64, "volumes", write).map_err(failed)?;
        let left_out = match sequence.left_out() {
            0 => String::new(),
            n => format!("; {n} volumes are left out, with frames missing or swept the same way twice"),
        };
        say!("sequence: {}, {frames} frames of {volumes} volumes{left_out}", self.output().display());
        Ok(())
    }

    /// Writes every frame of every volume unchanged, as .frames.
    fn record(&self) -> Result<(), Failure> {
        let is_of_volumes =
            self.spacing.is_some() || self.volume.is_some() || self.outside.is_some() || self.mask.is_some();
        if is_of_volumes || self.sequence || self.secondary_capture {
            return Err(input(
                "--spacing, --volume, --outside, --mask, --secondary-capture and --sequence apply to volumes; .frames holds every frame unchanged",
            ));
        }
        let mut recording = open_recording(&self.input, self.geometry.options())?;
        let first = recording.geometry(0);
        let (pose, posed) = (recording.pose(), recording.header().posed);
        let second = if recording.volumes() > 1 { recording.geometry(1) } else { first.clone() };
        let mut frame = recording.next_frame().map_err(input)?;
        let is_backward = frame.as_ref().is_some_and(|frame| frame.backward);
        let (forward, backward) = if is_backward { (second, first) } else { (first, second) };
        let (stored, range, synthetic) = (recording.stored_type(), recording.range(), recording.is_synthetic());
        let header = Header { forward, backward, stored, range, posed, synthetic };
        // A signal ends the process only after the incomplete file is deleted.
        let signals = Writing::begin();
        let mut writer = Writer::create(self.output(), header).map_err(failed)?;
        let bar = progress_bar((recording.volumes() * recording.frames_per_volume()) as u64);
        let mut copy = || {
            while let Some(mut there) = frame.take() {
                there.pose = there.pose.or(pose);
                if let Some(signal) = signals.signal() {
                    return Err(failed(format!("{}: stopped by {signal}", self.output().display())));
                }
                let arrived = recording.arrival().or(there.time).unwrap_or(0.0);
                writer.frame(&there, arrived).map_err(failed)?;
                bar.inc(1);
                frame = recording.next_frame().map_err(input)?;
            }
            Ok(())
        };
        if let Err(failure) = copy() {
            writer.discard();
            return Err(failure);
        }
        bar.finish_and_clear();
        let frames = writer.frames();
        writer.finish().map_err(failed)?;
        say!("recording: {}, {frames} frames of {} volumes", self.output().display(), recording.volumes());
        Ok(())
    }
}

#[derive(clap::Args)]
pub struct Info {
    #[arg(help = recording_help())]
    file: PathBuf,
    #[command(flatten)]
    geometry: GeometryArgs,
}

impl Info {
    /// Prints the description of the recording, one fact a line. `all`: also each key that the file states and that was not used.
    pub fn run(&self, all: bool) -> Result<(), Failure> {
        let Description { rows: mut facts, unused } =
            source::description(&self.file, self.geometry.options()).map_err(input)?;
        let unused = unused.lines();
        match unused.len() {
            0 => {}
            _ if all => facts.extend(unused.into_iter().map(|key| ("key not used".to_string(), key))),
            count => facts.push(("keys not used".into(), format!("{count}, which info -v lists"))),
        }
        let width = facts.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
        for (name, value) in facts {
            say!("{name:width$}  {value}");
        }
        Ok(())
    }
}

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  echolume phantom -o sweep.mha --volumes 4 --both-ways\n  \
                        echolume phantom -o still.mha --sampling gallery    (111 frames of 192 lines of a fetus at rest)\n  \
                        echolume phantom -o sweep.mha --truth truth.mha --truth-spacing 0.5    (compare with: echolume convert sweep.mha \
                        volume.mha --spacing 0.5)")]
pub struct MakePhantom {
    /// The sweep to write (.mha). Its geometry goes to NAME.probe.toml next to it
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Seed of the speckle; the same seed gives the same bytes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// head, or a body whose picture has a closed formula: sphere, step, wires, constant, ramp; or heart,
    /// a beating chamber, of which one slow sweep has many cycles; or vessels, a branching portal vein in a piece of liver
    #[arg(long, value_name = "NAME", default_value = "head")]
    body: String,
    /// Number of volumes in time; the head moves
    #[arg(long, value_name = "N", default_value_t = 1)]
    volumes: usize,
    /// Sweep every second volume backwards; the motor moves while frames are acquired
    #[arg(long)]
    both_ways: bool,
    /// Share of the frame pitch that the motor travels during one frame, 0..1 [default: 0, with --both-ways 0.5]
    #[arg(long, value_name = "SHARE")]
    speed_ratio: Option<f64>,
    /// Named set of the options below: live (37 frames of 128 lines), or gallery (111 frames of 192 lines, a narrower beam, --still)
    #[arg(long, value_name = "NAME", default_value = "live")]
    sampling: String,
    /// Frames a volume [default: of the sampling]
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// Scan lines a frame [default: of the sampling]
    #[arg(long, value_name = "N")]
    lines: Option<usize>,
    /// Angle from the first frame to the last, degrees [default: 61]
    #[arg(long, value_name = "DEG")]
    fan: Option<f64>,
    /// Standard deviation of the point-spread function along a scan line, mm [default: 0.35]
    #[arg(long, value_name = "MM")]
    psf_axial: Option<f64>,
    /// The same from line to line, degrees [default: 0.8; gallery: 0.6]
    #[arg(long, value_name = "DEG")]
    psf_lateral: Option<f64>,
    /// The same from frame to frame, degrees [default: 1.2; gallery: 0.6]
    #[arg(long, value_name = "DEG")]
    psf_elevation: Option<f64>,
    /// The head does not move, the heart does not beat
    #[arg(long)]
    still: bool,
    /// Share by which the rate of the heart rises and falls within 8 s, 0..0.3
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    heart_swing: f64,
    /// Body head: fluid between the near uterine wall and the fetus where they are nearest, mm, 0 to 29.9. The wall is
    /// thicker by what this is below 29.9 [default: 29.9]
    #[arg(long, value_name = "MM")]
    gap: Option<f64>,
    /// Body head: level of clutter (reverberations and side lobes) everywhere, dB re full scale, -60 to 0 [default: none]
    #[arg(long, value_name = "DB", allow_negative_numbers = true)]
    clutter: Option<f64>,
    /// Bodies head and vessels: move the body before the sweep, by a shift in mm along lateral, depth and elevation and a rotation vector in degrees about a point 55 mm
    /// below the probe's face, such as 3,0,-2,0,5,0 [default: not moved]
    #[arg(long, value_name = "L,D,E,X,Y,Z", allow_hyphen_values = true)]
    moved: Option<Rigid>,
    /// Also write what is where in the first volume of bodies head and vessels: labels to this file (.mha, or .seg.nrrd with their names for 3D Slicer), and the signed
    /// distance from the skin (vessels: from the blood), mm, to NAME.distance.mha. 0 fluid, 1 skin, 2 hand, 3 cord, 4 skull, 5 brain, 6 choroid plexus, 7 ventricle, 8 falx,
    /// 9 uterus, 10 blood, 11 vessel wall, 12 liver
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Voxel spacing of these files, mm
    #[arg(long, value_name = "MM", default_value_t = 1.0, requires = "truth")]
    truth_spacing: f64,
    /// Write the echogenicity, without speckle and without the blur of the probe
    #[arg(long)]
    no_speckle: bool,
    /// Write the mean over all speckle, which a filter of speckle should find
    #[arg(long, conflicts_with = "no_speckle")]
    mean_speckle: bool,
}

impl MakePhantom {
    pub fn run(&self) -> Result<(), Failure> {
        let usual = self.sampling.parse::<Sampling>().map_err(input)?.options();
        let psf = usual.point_spread;
        let options = PhantomOptions {
            seed: self.seed,
            body: self.body.parse::<Body>().map_err(input)?,
            volumes: self.volumes,
            both_ways: self.both_ways,
            speckle: match (self.no_speckle, self.mean_speckle) {
                (true, _) => Speckle::None,
                (_, true) => Speckle::Mean,
                _ => Speckle::Random,
            },
            speed_ratio: self.speed_ratio.unwrap_or(if self.both_ways { 0.5 } else { 0.0 }),
            frames: self.frames.unwrap_or(usual.frames),
            lines: self.lines.unwrap_or(usual.lines),
            fan_angle_deg: self.fan.unwrap_or(usual.fan_angle_deg),
            point_spread: PointSpread {
                axial_mm: self.psf_axial.unwrap_or(psf.axial_mm),
                lateral_deg: self.psf_lateral.unwrap_or(psf.lateral_deg),
                elevation_deg: self.psf_elevation.unwrap_or(psf.elevation_deg),
            },
            still: self.still || usual.still,
            heart_swing: self.heart_swing,
            gap: self.gap.unwrap_or(usual.gap),
            clutter_db: self.clutter,
            moved: self.moved.map_or(usual.moved, |moved| Rigid { about: PhantomOptions::CENTRE, ..moved }),
            ..usual
        };
        let phantom = Phantom::new(options).map_err(input)?;
        self.check_outputs()?;
        if let Some(truth) = &self.truth {
            // First: what it refuses is refused before the sweep is computed.
            let grid = phantom.truth_grid(self.truth_spacing).map_err(input)?;
            phantom.write_truth(truth, &grid).map_err(failed)?;
            let named = |label: &Label| format!("{} {}", *label as u8, label.name());
            let labels: Vec<String> = phantom.options().body.labels().iter().map(named).collect();
            say!("labels: {}, {}", truth.display(), labels.join(", "));
            say!("distance: {}, mm, negative inside", distance_path(truth).display());
        }
        phantom.write(&self.output).map_err(failed)?;
        say!("sweep: {}", self.output.display());
        Ok(())
    }

    /// Refuses files that cannot be written, and two outputs in one file.
    fn check_outputs(&self) -> Result<(), Failure> {
        let distance = self.truth.as_deref().map(distance_path);
        let beside = sequence::probe_file_path(&self.output);
        let targets: [Output; 4] = [
            (OUTPUT, Some(&self.output)),
            (OUTPUT, Some(&beside)),
            ("--truth", self.truth.as_deref()),
            ("--truth", distance.as_deref()),
        ];
        check_outputs(&targets, [])
    }
}

/// Why no voxel of a grid lies in the insonified region.
fn thinner_than(grid: &Grid, geometry: &Geometry) -> String {
    let (low, high) = insonified_box(geometry);
    let [x, y, z] = (high - low).to_array();
    let [spacing, ..] = grid.spacing;
    format!(
        "the sector is {x:.2} x {y:.2} x {z:.2} mm, and none of the voxels, --spacing {spacing} mm apart, lies in it"
    )
}

/// What a spacing leaves of a region, if that is one or two voxels along an axis that had more.
fn what_is_left(spacing: f64, grid: &Grid, geometry: &Geometry) -> Option<String> {
    let (low, high) = insonified_box(geometry);
    let extent = (high - low).to_array();
    let [columns, rows] = geometry.frame_size();
    let before = [columns, rows, geometry.slices()];
    let is_little = (0..3).any(|n| grid.size[n] <= 2 && before[n] > 4 && extent[n] > 0.0);
    let ([x, y, z], [a, b, c]) = (extent, grid.size);
    is_little.then(|| format!("--spacing {spacing} mm leaves {a} x {b} x {c} voxels of {x:.2} x {y:.2} x {z:.2} mm"))
}
