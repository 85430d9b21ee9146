//! The outputs of a pass against those of its reference.

use crate::passes::{Arrays, Bind, Pass, Texels};
use crate::report::verify::Worst;
use crate::scene::Scene;

/// How far the outputs of one dispatch are off.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Largest error of the texels within tolerance, in the units of the output.
    pub largest: f64,
    /// The same as a share of what is allowed there.
    pub used: f64,
    /// Largest share of an output's texels that are beyond tolerance.
    pub outliers: f64,
    /// The worst texel of an output that has more such texels than its pass allows.
    pub worst: Option<Worst>,
}

/// Compares every output. `poison` is what outputs held before: where the reference leaves NaN, that must still be there.
pub fn compare(
    pass: &Pass,
    scene: &Scene,
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
        for (i, (e, g)) in expected.values.iter().zip(&got.values).enumerate() {
            let untouched = e.is_nan();
            let e = if untouched { poison } else { *e };
            let rounding = 1.01 * Texels::spacing(format, e);
            let tolerance =
                if untouched { 0.0 } else { pass.tolerance.absolute.max(pass.tolerance.relative * e.abs()) };
            let (error, allowed) = ((e - g).abs(), tolerance + rounding);
            if error <= allowed {
                if !untouched {
                    all.largest = all.largest.max(error);
                    all.used = all.used.max(error / allowed);
                }
                continue;
            }
            beyond += 1;
            // NaN is further off than anything.
            if worst.is_none_or(|(_, _, _, w)| error > w || error.is_nan()) {
                worst = Some((i, e, *g, error));
            }
        }
        let share = beyond as f64 / expected.values.len() as f64;
        all.outliers = all.outliers.max(share);
        let Some((i, e, g, _)) = worst.filter(|_| share > pass.tolerance.outliers && all.worst.is_none()) else {
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
