//! The pre-scan sweep's own keys, as the UsTK library writes them: metres and radians.

use super::header::Header;
use crate::probe::file::SLAB;
use crate::probe::{Advance, Array, Axis, Motion, Probe};
use crate::source::InputError;
use crate::source::error::quoted;

/// Any of these makes a file a pre-scan sweep; then all must be there.
const KEYS: [&str; 7] = [
    "IsTransducerConvex",
    "TransducerRadius",
    "ScanLinePitch",
    "MotorType",
    "MotorRadius",
    "FramePitch",
    "AxialResolution",
];
/// UsTK leaves it out; soft tissue's usual value, m/s.
const SOUND_SPEED: f64 = 1540.0;
const MM: f64 = 1e3;

/// The probe, or `None` for a file that has none of the keys.
pub(super) fn probe(header: &Header, [samples, lines]: [usize; 2], frames: usize) -> Result<Option<Probe>, InputError> {
    let kind = header.get("UltrasoundImageType").unwrap_or("");
    // UsTK leaves the keys in the files that it has scan-converted.
    if kind.starts_with("POSTSCAN") || (!kind.starts_with("PRESCAN") && header.first_of(&KEYS).is_none()) {
        return Ok(None);
    }
    if !matches!(kind, "" | "BRIGHTNESS") && !kind.starts_with("PRESCAN") {
        let fault = format!("{} is not read: only detected and compressed frames are", quoted(kind));
        return header.fault("UltrasoundImageType", fault);
    }
    let line_pitch = header.size("ScanLinePitch", false)?;
    let (array, lines) = match header.flag("IsTransducerConvex")? {
        Some(true) => {
            let radius = header.size("TransducerRadius", true)? * MM;
            (Array::Curved { radius }, Axis::centred(line_pitch, lines))
        }
        Some(false) => (Array::Linear, Axis::centred(line_pitch * MM, lines)),
        None => return header.fault("IsTransducerConvex", "is missing"),
    };
    let sample_pitch = header.size("AxialResolution", false)? * MM;
    let (motion, slices) = if frames == 1 {
        (Motion::Still { thickness: SLAB }, Axis::centred(1.0, 1))
    } else {
        let frame_pitch = header.size("FramePitch", false)?;
        match header.need("MotorType")? {
            "TiltingMotor" => {
                let wobble_radius = header.size("MotorRadius", true)? * MM;
                (Motion::Fan { wobble_radius }, Axis::centred(frame_pitch, frames))
            }
            "LinearMotor" => (Motion::Translated, Axis::centred(frame_pitch * MM, frames)),
            other => {
                return header.fault(
                    "MotorType",
                    format!("{} is not read, only TiltingMotor and LinearMotor are", quoted(other)),
                );
            }
        }
    };
    Ok(Some(Probe {
        array,
        lines,
        start_depth: 0.0,
        sample_pitch,
        samples,
        motion,
        slices,
        advance: Advance::None,
        sound_speed: SOUND_SPEED,
    }))
}
