//! The phantom as a file: a PLUS sequence and its probe file.

use super::{ARRAY_RADIUS, FAN_ANGLE_DEG, Phantom, SECTOR_ANGLE_DEG, SOUND_SPEED, WOBBLE_RADIUS};
use crate::source::InputError;
use crate::source::unfinished::{Unfinished, unwritable};
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

/// Most frames of one file: their time stamps are in its header, of which at most 1 MiB is read.
const MOST_FRAMES: usize = 20_000;

pub(super) fn sweep(phantom: &Phantom, path: &Path) -> Result<(), InputError> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    if !ending.eq_ignore_ascii_case("mha") {
        return Err(InputError::new(path, "file", "must end in .mha"));
    }
    if path.is_dir() {
        return Err(InputError::new(path, "file", "is a folder"));
    }
    let mut beside = path.file_stem().unwrap_or_default().to_os_string();
    beside.push(".probe.toml");
    let beside = path.with_file_name(beside);

    let frames = phantom.options().frames * phantom.volumes();
    if frames > MOST_FRAMES {
        return Err(InputError::new(
            path,
            "volumes",
            format!("make {frames} frames, a file holds at most {MOST_FRAMES}"),
        ));
    }
    let (mut samples, mut file) = Unfinished::create(path)?;
    file.write_all(header(phantom).as_bytes()).map_err(|e| unwritable(path, &e))?;
    for volume in 0..phantom.volumes() {
        for frame in phantom.volume(volume) {
            file.write_all(&frame.bytes).map_err(|e| unwritable(path, &e))?;
        }
    }
    samples.finish(file)?;
    let (mut probe, mut file) = Unfinished::create(&beside)?;
    file.write_all(probe_file(phantom).as_bytes()).map_err(|e| unwritable(&beside, &e))?;
    probe.finish(file)?;
    // The geometry first: frames never stand there without it.
    probe.rename()?;
    samples.rename()
}

/// MetaImage with the fields of PLUS; and the keys of a pre-scan sweep where those can say all, so that the file stands alone.
fn header(phantom: &Phantom) -> String {
    let options = phantom.options();
    let probe = phantom.probe(0);
    let frames = options.frames * phantom.volumes();
    let mut text = format!(
        "ObjectType = Image\nNDims = 3\nDimSize = {} {} {frames}\nElementType = MET_UCHAR\nElementSpacing = 1 1 1\n\
         BinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n\
         UltrasoundImageOrientation = FM\nUltrasoundImageType = BRIGHTNESS\n",
        options.samples, options.lines
    );
    let mut say = |line: String| {
        text.push_str(&line);
        text.push('\n');
    };
    if phantom.volumes() == 1 && options.speed_ratio == 0.0 {
        // Metres and radians.
        say(format!("IsTransducerConvex = True\nTransducerRadius = {}", ARRAY_RADIUS / 1e3));
        say(format!("ScanLinePitch = {}\nAxialResolution = {}", probe.lines.pitch(), probe.sample_pitch / 1e3));
        say(format!("MotorType = TiltingMotor\nMotorRadius = {}", WOBBLE_RADIUS / 1e3));
        say(format!("FramePitch = {}", probe.slices.pitch()));
    }
    let frame_time = probe.acquisition_time() / options.frames as f64;
    for frame in 0..frames {
        say(format!("Seq_Frame{frame:04}_Timestamp = {:.6}", frame as f64 * frame_time));
    }
    text.push_str("ElementDataFile = LOCAL\n");
    text
}

fn probe_file(phantom: &Phantom) -> String {
    let options = phantom.options();
    let mut text = format!(
        "# Probe of a phantom sweep: body {}, seed {}, speckle {}. Lengths in mm, angles in degrees.\n",
        options.body, options.seed, options.speckle
    );
    let probe = phantom.probe(0);
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "[array]\nkind = \"curved\"\nradius_mm = {ARRAY_RADIUS:?}\n\n\
         [lines]\nsector_angle_deg = {SECTOR_ANGLE_DEG:?}\n\n\
         [depth]\nstart_mm = {:?}\nsample_pitch_mm = {:?}\n\n\
         [motion]\nkind = \"fan\"\nwobble_radius_mm = {WOBBLE_RADIUS:?}\nfan_angle_deg = {FAN_ANGLE_DEG:?}\n\
         frames_per_volume = {}\nboth_ways = {}\nspeed_ratio = {:?}\n\n\
         [sound]\nspeed_m_per_s = {SOUND_SPEED:?}\n",
        probe.start_depth, probe.sample_pitch, options.frames, options.both_ways, options.speed_ratio
    );
    text
}
