//! The outputs of a pass against those of its reference.

use crate::passes::slots::Format;
use crate::passes::{Arrays, Bind, DispatchArgs, Pass, Slot, Texels, is_hit};
use crate::scene::Scene;
use crate::verify::report::Worst;

/// How far the outputs of one dispatch are off.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Largest error of the texels within tolerance, in the units of the output.
    pub largest: f64,
    /// The same as a share of what is allowed there.
    pub used: f64,
    /// Largest share of an output's texels that are beyond tolerance, less what is allowed beside the pass' own.
    pub outliers: f64,
    /// Mean error of the texels within tolerance, with its sign, as a share of what is allowed there: errors that all go one way are
    /// no rounding. Of an output with enough texels that are written; the largest of all outputs.
    pub bias: f64,
    /// The worst texel of an output that has more such texels than its pass allows.
    pub worst: Option<Worst>,
}

/// Texels of which the mean error is looked at: of fewer, a few flipped roundings of whole steps are a bias.
const ENOUGH: usize = 100;
/// The same of floats, whose roundings are small.
const ENOUGH_FLOATS: usize = 20;

fn is_float(format: Format) -> bool {
    let floats = [Format::R16f, Format::Rg16f, Format::Rgba16f, Format::R32f, Format::Rg32f, Format::Rgba32f];
    floats.contains(&format)
}

/// What is allowed beyond a pass' own tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slack {
    /// Of values from 0 to 1.
    pub value: f64,
    /// Of distances, mm.
    pub distance: f64,
    /// Share of texels.
    pub outliers: f64,
}

impl Slack {
    /// Of a pass whose samples the device's own filter takes: its weights have so many bits and may be cut off, along three axes, of
    /// neighbours that differ by 1. A threshold is met a step earlier or later then, and here and there by another voxel.
    pub fn of(pass: &Pass, scene: &Scene, args: &DispatchArgs, bits: u32) -> Slack {
        match (pass.reads)(scene, args).iter().any(|bind| bind.filtered) {
            true => Slack { value: 3.0 * (-f64::from(bits)).exp2(), distance: scene.step, outliers: 0.02 },
            false => Slack::default(),
        }
    }

    fn at(&self, slot: Slot) -> f64 {
        match slot {
            Slot::Distance | Slot::DistanceA | Slot::DistanceB => self.distance,
            _ => self.value,
        }
    }
}

/// Compares every output. `poison` is what outputs held before: where the reference leaves NaN, that must still be there.
pub fn compare(
    pass: &Pass,
    scene: &Scene,
    slack: Slack,
    poison: f64,
    expected: &Arrays,
    got: &Arrays,
    writes: &[Bind],
) -> Comparison {
    let mut all = Comparison::default();
    for bind in writes {
        let (expected, got) = (expected.get(bind.name), got.get(bind.name));
        let format = bind.slot.format(scene);
        let (mut beyond, mut worst) = (0, None);
        // What the format makes of the expected values: what is left then is not its rounding.
        let stored = Texels::decode(expected.size, format, &expected.encode(format));
        let (mut signed, mut room, mut written) = (0.0, 0.0, 0);
        for (i, (e, g)) in expected.values.iter().zip(&got.values).enumerate() {
            let untouched = e.is_nan();
            let e = if untouched { poison } else { *e };
            let rounding = 1.01 * Texels::spacing(format, e);
            let tolerance =
                if untouched { 0.0 } else { pass.tolerance.absolute.max(pass.tolerance.relative * e.abs()) };
            let loose = if untouched { 0.0 } else { slack.at(bind.slot) };
            let (error, allowed) = ((e - g).abs(), tolerance + rounding + loose);
            if error <= allowed {
                if !untouched {
                    all.largest = all.largest.max(error);
                    all.used = all.used.max(error / allowed);
                    if is_hit(e.abs()) {
                        let aside = g - if is_float(format) { e } else { stored.values[i] };
                        // Of floats a driver may store the one below or the one above.
                        let rounded = if is_float(format) { aside.abs().min(Texels::spacing(format, e)) } else { 0.0 };
                        let aside = aside - rounded.copysign(aside);
                        (signed, room, written) = (signed + aside, room + allowed, written + 1);
                    }
                }
                continue;
            }
            beyond += 1;
            // NaN is further off than anything.
            if worst.is_none_or(|(_, _, _, w)| error > w || error.is_nan()) {
                worst = Some((i, e, *g, error));
            }
        }
        let enough = if is_float(format) { ENOUGH_FLOATS } else { ENOUGH };
        if written >= enough && room > 0.0 {
            all.bias = all.bias.max((signed / room).abs());
        }
        let share = beyond as f64 / expected.values.len() as f64;
        all.outliers = all.outliers.max(share - slack.outliers);
        let Some((i, e, g, _)) =
            worst.filter(|_| share > pass.tolerance.outliers + slack.outliers && all.worst.is_none())
        else {
            continue;
        };
        let (texel, [w, h, _]) = (i / expected.channels, expected.size);
        all.worst = Some(Worst {
            output: bind.name.into(),
            at: [texel % w, texel / w % h, texel / w / h],
            channel: i % expected.channels,
            expected: e,
            got: g,
            beyond,
            texels: expected.values.len(),
        });
    }
    all
}
