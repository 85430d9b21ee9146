//! The phantom as a file: a PLUS sequence and its probe file.

use super::{ARRAY_RADIUS, FAN_ANGLE_DEG, Phantom, SECTOR_ANGLE_DEG, SOUND_SPEED, WOBBLE_RADIUS};
use crate::source::sequence::{self, MOST_FRAMES};
use crate::source::{InputError, SampleType};
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

pub(super) fn sweep(phantom: &Phantom, path: &Path) -> Result<(), InputError> {
    let frames = phantom.options().frames * phantom.volumes();
    if frames > MOST_FRAMES {
        return Err(InputError::new(
            path,
            "volumes",
            format!("make {frames} frames, a file holds at most {MOST_FRAMES}"),
        ));
    }
    sequence::write_both(path, &header(phantom), &probe_file(phantom), |file| {
        for volume in 0..phantom.volumes() {
            for frame in phantom.volume(volume) {
                file.write_all(&frame.bytes).map_err(|e| InputError::unwritable(path, &e))?;
            }
        }
        Ok(())
    })
}

/// The keys of a pre-scan sweep where those can say all, so that the file stands alone.
fn header(phantom: &Phantom) -> String {
    let options = phantom.options();
    let probe = phantom.probe(0);
    let frames = options.frames * phantom.volumes();
    let mut more = String::new();
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
