//! What the PLUS toolkit says of the frames of a sequence, in MetaImage and in NRRD alike: their times, poses, status and spacing, and how
//! the axes of a picture lie on the transducer.

use super::describe::number;
use super::keys::{Aspect, Key, Use};
use super::layout::{Cartesian, LineOrder, Remarks, StoredGeometry, warned};
use super::transforms::{Poses, TransformName, matrix};
use crate::files::{InputError, quoted};
use crate::probe::{AxisOrder, World};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The keys of the frames of a PLUS sequence, in MetaImage and in NRRD, and how they are treated.
pub(super) static FRAME_KEYS: [Key; 8] = [
    Key::new("Seq_FrameN_Timestamp", Aspect::Time, Use::Used),
    Key::new("Seq_FrameN_ElementSpacing", Aspect::Geometry, Use::Used),
    Key::new("Seq_FrameN_*Transform", Aspect::Geometry, Use::Used),
    Key::new("Seq_FrameN_*TransformStatus", Aspect::Geometry, Use::Used),
    Key::new("Seq_FrameN_ImageStatus", Aspect::About, Use::Used),
    Key::new("Seq_FrameN_Status", Aspect::About, Use::Used),
    Key::new("Seq_FrameN_UnfilteredTimestamp", Aspect::About, Use::Listed),
    Key::new("Seq_FrameN_FrameNumber", Aspect::About, Use::Listed),
];

/// What the fields `Seq_FrameNNNN_...` of a PLUS sequence state about its frames, by their index NNNN.
#[derive(Default)]
pub(super) struct PlusFrames {
    /// Time stamps, s, by frame; no entry if it has none.
    pub times: BTreeMap<usize, f64>,
    poses: Poses,
    /// Transforms whose status is not OK: the status may stand before its transform.
    invalid: Vec<(TransformName, usize)>,
    /// Frames whose status is not OK.
    not_ok: BTreeSet<usize>,
    /// Sizes of pixels, mm.
    spacings: BTreeMap<usize, [f64; 3]>,
    /// True if the file has any field `Seq_Frame...`, so that its frames are a series in time.
    pub is_sequence: bool,
}

impl PlusFrames {
    /// Reads a field. `key`: its name after `Seq_Frame`, for example `0012_Timestamp`, `0012_ImageStatus`, `0012_ElementSpacing`,
    /// `0012_ProbeToTrackerTransform` and its `...Status`. Returns false for other fields, which are not used.
    ///
    /// # Errors
    /// A time stamp that is no number, or a spacing that is no length.
    pub(super) fn field(&mut self, path: &Path, key: &str, value: &str) -> Result<bool, InputError> {
        self.is_sequence = true;
        let Some((number, field)) = key.split_once('_') else { return Ok(false) };
        let Ok(number) = number.parse::<usize>() else { return Ok(false) };
        let fault = |fault: String| Err(InputError::new(path, format!("Seq_Frame{number:04}_{field}"), fault));
        match field {
            "Timestamp" => match value.parse::<f64>() {
                Ok(time) if time.is_finite() => drop(self.times.insert(number, time)),
                _ => return fault(format!("{} is not a finite number", quoted(value))),
            },
            "ImageStatus" | "Status" => drop((value != "OK").then(|| self.not_ok.insert(number))),
            "ElementSpacing" => match spacing(value) {
                Some(spacing) => drop(self.spacings.insert(number, spacing)),
                None => return fault(format!("{} is not 2 or 3 numbers above 0", quoted(value))),
            },
            _ => return Ok(self.transform(number, field, value)),
        }
        Ok(true)
    }

    /// False if the field is no transform.
    fn transform(&mut self, number: usize, field: &str, value: &str) -> bool {
        if let Some(name) = field.strip_suffix("TransformStatus").and_then(|name| name.parse().ok()) {
            if value != "OK" {
                self.invalid.push((name, number));
            }
        } else if let Some(name) = field.strip_suffix("Transform").and_then(|name| name.parse().ok()) {
            match matrix(value) {
                Ok(matrix) => self.poses.add(name, number, matrix),
                // As programs write what was not tracked: no inverse, not finite.
                Err(_) => self.invalid.push((name, number)),
            }
        } else {
            return false;
        }
        true
    }

    /// Takes the valid poses. `slices`: number of slices of a volume; with more than 1 no pose is used, because only pictures are placed by
    /// poses.
    pub(super) fn poses(&mut self, path: &Path, slices: usize, remarks: &mut Remarks) -> Poses {
        let mut poses = std::mem::take(&mut self.poses);
        self.invalid.iter().for_each(|(name, frame)| poses.remove(name, *frame));
        if !self.not_ok.is_empty() {
            let text = format!("{} by their ImageStatus; read all the same", self.not_ok.len());
            remarks.push(("frames not OK".into(), text));
        }
        if slices > 1 && !poses.by_name.is_empty() {
            let text = format!("{} of whole volumes: not used, only pictures are placed by poses", poses.names());
            remarks.push(warned(path, "tracking", text));
            return Poses::default();
        }
        remarks.extend(poses.remark());
        poses
    }

    /// The pixel size that frames state, mm, which takes precedence over `stated`, that of the header, because PLUS allows the depth of a
    /// transducer to change while it records. None if frames state none. Differences are added to `remarks`.
    pub(super) fn spacing(&self, path: &Path, stated: [f64; 3], remarks: &mut Remarks) -> Option<[f64; 3]> {
        let first = *self.spacings.values().next()?;
        // The third of pictures may be left out.
        let first = if first[2] > 0.0 { first } else { [first[0], first[1], stated[2]] };
        let is_near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|n| (a[n] - b[n]).abs() <= 1e-6 * b[n] || a[n] == 0.0);
        let text = |values: [f64; 3]| values.map(number).join(" x ");
        if self.spacings.values().any(|other| !is_near(*other, first)) {
            let text =
                format!("ElementSpacing differs from frame to frame: that of the first, {}, is taken", text(first));
            remarks.push(warned(path, "spacing", format!("{text} mm for all")));
        } else if !is_near(first, stated) {
            let [of_frames, of_header] = [first, stated].map(text);
            let text = format!(
                "ElementSpacing of the frames is {of_frames} mm and counts, not that of the header, {of_header} mm"
            );
            remarks.push(warned(path, "spacing", text));
        }
        Some(first)
    }
}

/// Two or three numbers above 0; without a third it is 0.
fn spacing(text: &str) -> Option<[f64; 3]> {
    let numbers = text.split_whitespace().map(|word| word.parse::<f64>().ok()).collect::<Option<Vec<f64>>>()?;
    let is_size = |value: &f64| value.is_finite() && *value > 0.0;
    match numbers[..] {
        _ if !numbers.iter().all(is_size) => None,
        [x, y] => Some([x, y, 0.0]),
        [x, y, z] => Some([x, y, z]),
        _ => None,
    }
}

/// Gives all slices of a volume the time of the volume: times by volume in, times by frame out. `frames`: number of frames of the file.
pub(super) fn spread(times: &BTreeMap<usize, f64>, slices: usize, frames: usize) -> BTreeMap<usize, f64> {
    let volumes = frames / slices.max(1);
    times.range(..volumes).flat_map(|(volume, time)| (0..slices).map(move |n| (volume * slices + n, *time))).collect()
}

/// What a file of PLUS states about its pictures, with the names of the fields for messages.
pub(super) struct PlusWords<'a> {
    pub path: &'a Path,
    /// Name of the field of the orientation, and its value, such as MF; None if it is absent.
    pub orientation: (&'static str, Option<&'a str>),
    /// Name of the field of the kind of frames, and its value, such as BRIGHTNESS; None if it is absent.
    pub kind: (&'static str, Option<&'a str>),
}

impl PlusWords<'_> {
    /// True if the rows of a frame are scan lines.
    pub(super) fn has_scan_lines(&self) -> bool {
        self.orientation.1.is_some_and(|word| word.starts_with('F'))
    }

    /// Whether rows are scan lines. PLUS names the axes of a frame, the fastest first, by their direction on the transducer. F is away from it,
    /// so FM means scan lines in order and FU scan lines from last to first. A first letter of M, U, A or D means rows of pictures.
    ///
    /// # Errors
    /// Another word.
    pub(super) fn line_order(&self) -> Result<LineOrder, InputError> {
        let (field, word) = self.orientation;
        match word {
            None | Some("FM" | "FMA") => Ok(LineOrder::InOrder),
            Some("FU" | "FUA") => Ok(LineOrder::Reversed),
            Some(word) if word.starts_with(['M', 'U', 'A', 'D']) => Ok(LineOrder::Pictures(quoted(word))),
            Some(other) => {
                let why = "is not read: scan lines must be FM or FU, pictures begin with M, U, A or D";
                Err(InputError::new(self.path, field, format!("{} {why}", quoted(other))))
            }
        }
    }

    /// The geometry of a file of pictures; [`StoredGeometry::Missing`] if its frames are scan lines, which need a probe. `size` and `volumes`:
    /// as stored.
    ///
    /// # Errors
    /// The frames hold undetected signals, or the axes are impossible.
    pub(super) fn pictures(
        &self,
        size: [usize; 3],
        volumes: usize,
        world: World,
        lines: &LineOrder,
        remarks: &mut Remarks,
    ) -> Result<StoredGeometry, InputError> {
        let (field, kind) = self.kind;
        match (kind, lines) {
            (None | Some("US_IMG_TYPE_XX"), _) | (Some("BRIGHTNESS"), LineOrder::Pictures(_)) => {}
            (Some(converted), _) if converted.starts_with("POSTSCAN") => {}
            (Some("BRIGHTNESS"), _) => {
                let fault = "BRIGHTNESS frames of scan lines need a probe geometry: give --probe FILE.toml, or put a \
                             probe.toml beside the recording";
                return Ok(StoredGeometry::Missing(InputError::new(self.path, field, fault)));
            }
            (Some(other), _) => {
                let fault = format!("{} is not read: only BRIGHTNESS is detected and compressed", quoted(other));
                return Err(InputError::new(self.path, field, fault));
            }
        }
        let order = self.order(size, volumes, remarks);
        // The matrix is that of the axes as PLUS draws them, the spacing that of the stored ones.
        let directions = world.directions();
        let axes = [0, 1, 2].map(|n| directions.col(n) * world.axis(order.stored[n]).length());
        let world =
            World::new(axes, world.origin()).map_err(|why| InputError::new(self.path, self.orientation.0, why))?;
        Ok(StoredGeometry::Cartesian(Cartesian { size, volumes, world, order }))
    }

    /// The order of axes that the orientation states.
    fn order(&self, size: [usize; 3], volumes: usize, remarks: &mut Remarks) -> AxisOrder {
        let Some(word) = self.orientation.1.filter(|_| !self.has_scan_lines()) else { return AxisOrder::STORED };
        let mut not_drawn = |why: &str| {
            remarks.push(warned(self.path, "not drawn so", format!("orientation {} {why}", quoted(word))));
            AxisOrder::STORED
        };
        match AxisOrder::of_plus(word) {
            // Pictures in time are not neighbours in space.
            Some(order) if volumes > 1 && size[2] == 1 && !order.keeps_frames() => {
                not_drawn("turns pictures out of their plane: they are drawn as stored")
            }
            Some(order) => order,
            None => not_drawn("is not known: the axes are drawn as stored"),
        }
    }
}
