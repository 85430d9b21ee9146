//! Faults of frames on their way in, of slices, of what is stored, and of the screen.

use crate::passes::fault_injection::{Change, InjectedFault};
use crate::passes::{DispatchArgs, Params, Slot, Value};
use crate::scene::Scene;
use crate::spirv::mutate::{FMAX, FMIN, add_to_writes, replace_last, round_to_half};

const LSB: f32 = 1.0 / 255.0;

/// A number by its name, if the pass has it.
pub(super) fn number(params: &mut Params, name: &str, by: impl FnOnce(&mut Value)) {
    if let Some((_, value)) = params.0.iter_mut().find(|(n, _)| *n == name) {
        by(value);
    }
}

pub(super) fn times(params: &mut Params, name: &str, factor: f32) {
    number(params, name, |value| {
        if let Value::F32(v) = value {
            *v *= factor;
        }
    });
}

pub(super) fn set(params: &mut Params, name: &str, to: f32) {
    number(params, name, |value| *value = Value::F32(to));
}

/// The values of two numbers change places.
pub(super) fn swap(params: &mut Params, a: &str, b: &str) {
    let place = |name: &str| params.0.iter().position(|(n, _)| *n == name);
    if let (Some(a), Some(b)) = (place(a), place(b)) {
        (params.0[a].1, params.0[b].1) = (params.0[b].1, params.0[a].1);
    }
}

/// One slice of a volume, and not the one that a pass alone works on.
fn one_of_many(scene: &Scene, args: &DispatchArgs) -> bool {
    scene.slices() > 3 && args.slice == scene.slices() / 3
}

pub(super) const FAULTS: &[InjectedFault] = &[
    InjectedFault {
        name: "stale slice",
        what: "one frame of a volume is dropped on its way, and its slice shows the one before",
        change: Change::LeftOut { pass: "scan_convert", which: one_of_many },
    },
    InjectedFault {
        name: "layer of the ring reused too early",
        what: "one frame of a volume is overwritten by its successor before it is read",
        change: Change::DispatchArgs {
            pass: "scan_convert",
            by: |scene, args| args.layer = (args.layer + u32::from(one_of_many(scene, args))) % 4,
        },
    },
    InjectedFault {
        name: "reversed sweep",
        what: "the motor's way back is taken for its way there",
        change: Change::DispatchArgs {
            pass: "scan_convert",
            by: |scene, args| args.slice = scene.slices() - 1 - args.slice,
        },
    },
    InjectedFault {
        name: "wrong row pitch",
        what: "each line of an upload begins a sample late",
        change: Change::Frame(|[texel, width, height], bytes| {
            let before = bytes.to_vec();
            for (at, byte) in bytes.iter_mut().enumerate() {
                let line = at / (texel * width);
                *byte = before[(at + line * texel).min(texel * width * height - texel + at % texel)];
            }
        }),
    },
    InjectedFault {
        name: "mirrored lateral",
        what: "the probe's marker is on the other side",
        change: Change::Frame(|[texel, width, height], bytes| {
            let before = bytes.to_vec();
            for (line, to) in bytes.chunks_exact_mut(texel * width).enumerate() {
                let from = (height - 1 - line) * texel * width;
                to.copy_from_slice(&before[from..from + texel * width]);
            }
        }),
    },
    InjectedFault {
        name: "swapped axes",
        what: "samples and lines of the scan conversion table change places",
        change: Change::Table {
            slot: Slot::ScanLut,
            by: |_, values| values.chunks_exact_mut(2).filter(|pair| pair[0] >= 0.0).for_each(|pair| pair.swap(0, 1)),
        },
    },
    InjectedFault {
        name: "gain of the next sample",
        what: "the gain over depth is a sample early",
        change: Change::Table { slot: Slot::Tgc, by: |_, values| values.rotate_left(1) },
    },
    InjectedFault {
        name: "1 LSB bias",
        what: "what is stored in the volume is one of 255 steps too bright",
        change: Change::Shader { pass: "scan_convert", by: |words| add_to_writes(words, "target", [LSB; 4]) },
    },
    InjectedFault {
        name: "wrong rounding",
        what: "the screen's 8 bits are cut off instead of rounded",
        change: Change::Shader {
            pass: "tone",
            by: |words| add_to_writes(words, "screen", [-0.5 * LSB, -0.5 * LSB, -0.5 * LSB, 0.0]),
        },
    },
    InjectedFault {
        name: "median of the wrong rank",
        what: "the compiler takes a smaller for a larger value, once",
        change: Change::Shader { pass: "median_slice", by: |words| replace_last(words, FMAX, FMIN) },
    },
    InjectedFault {
        name: "half precision",
        what: "a filter computes with 11 bits instead of 24",
        change: Change::Shader { pass: "perona_malik_slice", by: round_to_half },
    },
    InjectedFault {
        name: "window of one texel less",
        what: "a sigma filter's window ends a texel early on each side",
        change: Change::Constant { pass: "sigma_slice", name: "RADIUS", by: |radius| radius - 1 },
    },
    InjectedFault {
        name: "lost last iteration",
        what: "a diffusion ends a step early",
        change: Change::LeftOut {
            pass: "perona_malik_slice",
            which: |scene, args| {
                args.iteration > 0
                    && args.iteration + 1 == scene.settings.slices.perona_malik.as_ref().map_or(0, |p| p.repeat)
            },
        },
    },
    InjectedFault {
        name: "NaN from a division",
        what: "a Gaussian of width 0 divides by it",
        change: Change::Numbers { pass: "gaussian_lateral", by: |_, params| set(params, "narrowness", f32::INFINITY) },
    },
    InjectedFault {
        name: "last workgroup lost",
        what: "extents are divided by the workgroup's, rounded down",
        change: Change::Extent { pass: "tone", by: |extent| extent[0] = (extent[0] / 8).max(1) * 8 },
    },
    InjectedFault {
        name: "gamma left out",
        what: "a switch that is not set",
        change: Change::Constant { pass: "tone", name: "GAMMA", by: |_| 0 },
    },
];
