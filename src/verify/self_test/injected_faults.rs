//! The faults for fault injection: in frames on their way in, in slices, in what is stored, in rays and empty-space skipping, in light,
//! and in the screen.

use crate::passes::fault_injection::{Change, Command, InjectedFault};
use crate::passes::slots::frames_per_batch;
use crate::passes::{DispatchArgs, Params, Slot, Value};
use crate::scene::Scene;
use crate::spirv::mutants::MUTATIONS;
use crate::spirv::mutate::{F_ADD, F_SUB, FMAX, FMIN, add_to_writes, replace_last, replace_last_opcode, round_to_half};
use half::f16;

const LSB: f32 = 1.0 / 255.0;

/// Changes a parameter by name, if the pass has it.
fn number(params: &mut Params, name: &str, by: impl FnOnce(&mut Value)) {
    if let Some((_, value)) = params.0.iter_mut().find(|(n, _)| *n == name) {
        by(value);
    }
}

fn times(params: &mut Params, name: &str, factor: f32) {
    number(params, name, |value| match value {
        Value::F32(v) => *v *= factor,
        Value::Vec4(v) => *v = v.map(|v| v * factor),
        _ => {}
    });
}

fn set(params: &mut Params, name: &str, to: f32) {
    number(params, name, |value| *value = Value::F32(to));
}

/// Swaps the values of two parameters.
fn swap(params: &mut Params, a: &str, b: &str) {
    let place = |name: &str| params.0.iter().position(|(n, _)| *n == name);
    if let (Some(a), Some(b)) = (place(a), place(b)) {
        (params.0[a].1, params.0[b].1) = (params.0[b].1.clone(), params.0[a].1.clone());
    }
}

/// The batch with one slice of a volume, not the one with which single passes are checked.
fn one_of_many(scene: &Scene, args: &DispatchArgs) -> bool {
    scene.slices() > 3 && (args.slice..args.slice + args.slices).contains(&(scene.slices() / 3))
}

/// Shifts rays by half a pixel to the right.
fn shifted(scene: &Scene, params: &mut Params) {
    let of = [("origin", scene.to_local(scene.rays.origin + 0.5 * scene.rays.origin_dx))];
    let directed = [("direction", scene.rays.direction + 0.5 * scene.rays.direction_dx)];
    for (name, to) in of.into_iter().chain(directed) {
        number(params, name, |value| *value = Value::Vec3(to.to_array().map(|v| v as f32)));
    }
}

/// Moves the far side of the box, along the view, a step nearer.
fn ends_early(scene: &Scene, params: &mut Params) {
    for axis in 0..3 {
        let (far, towards) = if scene.rays.forward[axis] > 0.0 { ("box_high", -1.0) } else { ("box_low", 1.0) };
        moved(params, far, axis, towards * scene.step * scene.rays.forward[axis].abs());
    }
}

fn moved(params: &mut Params, name: &str, axis: usize, by: f64) {
    number(params, name, |value| {
        if let Value::Vec3(v) = value {
            v[axis] += by as f32;
        }
    });
}

fn rounded_to_half(values: &mut [f32]) {
    values.iter_mut().for_each(|v| *v = f16::from_f32(*v).to_f32());
}

pub(super) const FAULTS: &[InjectedFault] = &[
    InjectedFault {
        name: "stale slice",
        what: "frames of a volume are dropped on their way, and their slices show the ones before",
        change: Change::LeftOut { pass: "scan_convert", which: one_of_many },
    },
    InjectedFault {
        name: "layer of the ring reused too early",
        what: "frames of a volume are overwritten by their successors before they are read",
        change: Change::DispatchArgs {
            pass: "scan_convert",
            by: |scene, args| {
                let (next, layers) = (frames_per_batch(scene), Slot::Frames.shape(scene).parts());
                args.layer = (args.layer + u32::from(one_of_many(scene, args)) * next) % layers;
            },
        },
    },
    InjectedFault {
        name: "reversed sweep",
        what: "the motor's way back is taken for its way there",
        change: Change::DispatchArgs {
            pass: "scan_convert",
            by: |scene, args| args.slice = scene.slices().saturating_sub(args.slice + args.slices),
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
                    && args.iteration + 1 == scene.slice_filters.perona_malik.as_ref().map_or(0, |p| p.repeat)
            },
        },
    },
    InjectedFault {
        name: "NaN from a division",
        what: "the weights of a Gaussian of width 0 are divided by it",
        change: Change::Numbers {
            pass: "gaussian_lateral",
            by: |_, params| {
                number(params, "weights", |value| {
                    if let Value::Floats(weights) = value {
                        weights.fill(f32::NAN);
                    }
                });
            },
        },
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
    InjectedFault {
        name: "shifted half pixel",
        what: "rays start at the corners of pixels",
        change: Change::Numbers { pass: "raycast_", by: shifted },
    },
    InjectedFault {
        name: "picture transposed",
        what: "columns and rows of rays change places",
        change: Change::Numbers {
            pass: "raycast_projection",
            by: |_, params| {
                swap(params, "origin_dx", "origin_dy");
                swap(params, "direction_dx", "direction_dy");
            },
        },
    },
    InjectedFault {
        name: "off-by-one LUT",
        what: "every entry of the sweep's table is the one after it",
        change: Change::Table {
            slot: Slot::SweepLut,
            by: |_, values| {
                let last = values.len().saturating_sub(1);
                values.copy_within(1.min(last).., 0);
            },
        },
    },
    InjectedFault {
        name: "table in half precision",
        what: "the sweep's table is stored with 11 bits",
        change: Change::Table { slot: Slot::SweepLut, by: |_, values| rounded_to_half(values) },
    },
    InjectedFault {
        name: "coefficient of a polynomial",
        what: "the slice index is 0.1 % off",
        change: Change::Numbers { pass: "raycast_", by: |_, params| times(params, "sweep_terms_0", 1.001) },
    },
    InjectedFault {
        name: "absorption in half precision",
        what: "small absorption is lost with its digits",
        change: Change::Table { slot: Slot::Transfer, by: |_, values| rounded_to_half(values) },
    },
    InjectedFault {
        name: "wrong opacity correction",
        what: "opacities hold for a length 1 % off",
        change: Change::Numbers { pass: "raycast_volume", by: |_, params| times(params, "absorption_scale", 1.01) },
    },
    InjectedFault {
        name: "lost last step",
        what: "rays end a step before the volume does",
        change: Change::Numbers { pass: "raycast_volume", by: ends_early },
    },
    InjectedFault {
        name: "region off",
        what: "the rendered box is shifted by half a pixel of a slice",
        change: Change::Numbers {
            pass: "raycast_projection",
            by: |scene, params| {
                moved(params, "box_low", 0, 0.5 * scene.grid.pitch[0]);
                moved(params, "box_high", 0, 0.5 * scene.grid.pitch[0]);
            },
        },
    },
    InjectedFault {
        name: "early detector",
        what: "every surface is found 2 um early",
        change: Change::Shader {
            pass: "raycast_surface",
            by: |words| add_to_writes(words, "distance_map", [-2e-3, 0.0, 0.0, 0.0]),
        },
    },
    InjectedFault {
        name: "higher threshold",
        what: "the detector wants 2 % more contrast than was asked for",
        change: Change::Numbers { pass: "raycast_surface", by: |_, params| times(params, "threshold", 1.02) },
    },
    InjectedFault {
        name: "the motor's motion ignored",
        what: "all lines of a frame lie where its first does",
        change: Change::Numbers { pass: "raycast_", by: |_, params| set(params, "advance", 0.0) },
    },
    InjectedFault { name: "nearest neighbour", what: "the sampler does not filter", change: Change::Nearest },
    InjectedFault {
        name: "colour channels swapped",
        what: "red and blue of the transfer function change places",
        change: Change::Table {
            slot: Slot::Transfer,
            by: |_, values| values.chunks_exact_mut(4).for_each(|entry| entry.swap(0, 2)),
        },
    },
    InjectedFault {
        name: "off-by-one row",
        what: "the pre-integrated table is entered a row of 256 too far",
        change: Change::Table {
            slot: Slot::PreIntegrated,
            by: |_, values| {
                let row = 4 * (values.len() / 4).isqrt();
                values.copy_within(row.., 0);
            },
        },
    },
    InjectedFault {
        name: "skip one brick too far",
        what: "the distance to the next brick of another kind is counted from the one behind",
        change: Change::Shader {
            pass: "brick_distance_",
            by: |words| add_to_writes(words, "target", [1.0 / 255.0, 0.0, 0.0, 0.0]),
        },
    },
    InjectedFault {
        name: "brick taken for empty",
        what: "bricks a hundredth above the threshold are skipped",
        change: Change::Numbers {
            pass: "classify_bricks_surface",
            by: |_, params| {
                number(params, "quiet_level", |value| {
                    if let Value::F32(v) = value {
                        *v += 0.01;
                    }
                });
            },
        },
    },
    InjectedFault {
        name: "clip plane's sign",
        what: "a clip plane keeps what it should cut",
        change: Change::Numbers { pass: "raycast_", by: |_, params| times(params, "clip_0", -1.0) },
    },
    InjectedFault {
        name: "wrong volume image",
        what: "of the volumes that take turns the first is shown, whichever was asked for",
        change: Change::DispatchArgs { pass: "raycast_", by: |_, args| args.image = 0 },
    },
    InjectedFault {
        name: "ambient and diffuse swapped",
        what: "two numbers in the wrong order",
        change: Change::Numbers { pass: "light", by: |_, params| swap(params, "ambient", "diffuse") },
    },
    InjectedFault {
        name: "parameters of the dispatch before",
        what: "a dispatch reads the uniform block that lies before its own",
        change: Change::Numbers {
            pass: "scan_convert",
            by: |_, params| {
                number(params, "slice", |value| {
                    if let Value::I32(slice) = value {
                        *slice = (*slice - 1).max(0);
                    }
                });
            },
        },
    },
    InjectedFault {
        name: "lost register",
        what: "the compiler mixes up an operand where many values are alive",
        change: Change::Shader { pass: "light", by: |words| replace_last_opcode(words, F_ADD, F_SUB) },
    },
    InjectedFault {
        name: "shadow softness",
        what: "edges of shadows are a tenth too wide",
        change: Change::Numbers { pass: "shadow", by: |_, params| times(params, "softness", 1.1) },
    },
    of_command("vkCmdDispatchBase", "a dispatch with a base begins with the first workgroup", Command::DispatchBase),
    of_command(
        "vkCmdDispatchIndirect",
        "a dispatch whose workgroups the device counts runs none",
        Command::DispatchIndirect,
    ),
    of_command("vkCmdCopyBufferToImage", "an upload ends after its first layer or slice", Command::CopyToImage),
    of_command("vkCmdCopyImageToBuffer", "nothing is read back", Command::CopyToBuffer),
    of_command("vkCmdClearColorImage", "images are cleared to one instead of zero", Command::Clear),
    of_command("vkCreateComputePipelines", "specialization constants keep their defaults", Command::Specialize),
    of_command("vkInvalidateMappedMemoryRanges", "what the device wrote does not reach the host", Command::Invalidate),
];

const fn of_command(name: &'static str, what: &'static str, command: Command) -> InjectedFault {
    InjectedFault { name, what, change: Change::Command(command) }
}

/// Faults of the compiler: one for each class of instructions.
pub(super) fn of_instructions() -> impl Iterator<Item = InjectedFault> {
    MUTATIONS.iter().map(|mutation| InjectedFault {
        name: mutation.class,
        what: mutation.what,
        // The first and the last are often checks of bounds, which no invocation inside the picture notices.
        change: Change::Mutant { pass: "", mutation, share: 0.5 },
    })
}
