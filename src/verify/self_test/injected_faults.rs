//! The faults for fault injection: in frames on their way in, in slices, in what is stored, in rays and empty-space skipping, in light,
//! and in the screen.

use crate::passes::fault_injection::{Change, Command, InjectedFault};
use crate::passes::slots::frames_per_batch;
use crate::passes::{DispatchArgs, Params, Slot, Value};
use crate::scene::Scene;
use crate::spirv::SpirvError;
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
    fault("stale slice", "frames of a volume are dropped on their way, and their slices show the ones before")
        .left_out("scan_convert", one_of_many),
    fault(
        "layer of the ring reused too early",
        "frames of a volume are overwritten by their successors before they are read",
    )
    .arguments("scan_convert", |scene, args| {
        let (next, layers) = (frames_per_batch(scene), Slot::Frames.shape(scene).parts());
        args.layer = (args.layer + u32::from(one_of_many(scene, args)) * next) % layers;
    }),
    fault("reversed sweep", "the motor's way back is taken for its way there")
        .arguments("scan_convert", |scene, args| args.slice = scene.slices().saturating_sub(args.slice + args.slices)),
    fault("wrong row pitch", "each line of an upload begins a sample late").with(Change::Frame(
        |[texel, width, height], bytes| {
            let before = bytes.to_vec();
            for (at, byte) in bytes.iter_mut().enumerate() {
                let line = at / (texel * width);
                *byte = before[(at + line * texel).min(texel * width * height - texel + at % texel)];
            }
        },
    )),
    fault("mirrored lateral", "the probe's marker is on the other side").with(Change::Frame(
        |[texel, width, height], bytes| {
            let before = bytes.to_vec();
            for (line, to) in bytes.chunks_exact_mut(texel * width).enumerate() {
                let from = (height - 1 - line) * texel * width;
                to.copy_from_slice(&before[from..from + texel * width]);
            }
        },
    )),
    fault("swapped axes", "samples and lines of the scan conversion table change places")
        .table(Slot::ScanLut, |_, values| {
            values.chunks_exact_mut(2).filter(|pair| pair[0] >= 0.0).for_each(|pair| pair.swap(0, 1))
        }),
    fault("gain of the next sample", "the gain over depth is a sample early")
        .table(Slot::Tgc, |_, values| values.rotate_left(1)),
    fault("1 LSB bias", "what is stored in the volume is one of 255 steps too bright")
        .shader("scan_convert", |words| add_to_writes(words, "target", [LSB; 4])),
    fault("wrong rounding", "the screen's 8 bits are cut off instead of rounded")
        .shader("tone", |words| add_to_writes(words, "screen", [-0.5 * LSB, -0.5 * LSB, -0.5 * LSB, 0.0])),
    fault("median of the wrong rank", "the compiler takes a smaller for a larger value, once")
        .shader("median_slice", |words| replace_last(words, FMAX, FMIN)),
    fault("half precision", "a filter computes with 11 bits instead of 24").shader("perona_malik_slice", round_to_half),
    fault("window of one texel less", "a sigma filter's window ends a texel early on each side").constant(
        "sigma_slice",
        "RADIUS",
        |radius| radius - 1,
    ),
    fault("lost last iteration", "a diffusion ends a step early").left_out("perona_malik_slice", |scene, args| {
        args.iteration > 0 && args.iteration + 1 == scene.slice_filters.perona_malik.as_ref().map_or(0, |p| p.repeat)
    }),
    fault("NaN from a division", "the weights of a Gaussian of width 0 are divided by it").numbers(
        "gaussian_lateral",
        |_, params| {
            number(params, "weights", |value| {
                if let Value::Floats(weights) = value {
                    weights.fill(f32::NAN);
                }
            });
        },
    ),
    fault("last workgroup lost", "extents are divided by the workgroup's, rounded down")
        .with(Change::Extent { pass: "tone", by: |extent| extent[0] = (extent[0] / 8).max(1) * 8 }),
    fault("gamma left out", "a switch that is not set").constant("tone", "GAMMA", |_| 0),
    fault("shifted half pixel", "rays start at the corners of pixels").numbers("raycast_", shifted),
    fault("picture transposed", "columns and rows of rays change places").numbers("raycast_projection", |_, params| {
        swap(params, "origin_dx", "origin_dy");
        swap(params, "direction_dx", "direction_dy");
    }),
    fault("off-by-one LUT", "every entry of the sweep's table is the one after it").table(
        Slot::SweepLut,
        |_, values| {
            let last = values.len().saturating_sub(1);
            values.copy_within(1.min(last).., 0);
        },
    ),
    fault("table in half precision", "the sweep's table is stored with 11 bits")
        .table(Slot::SweepLut, |_, values| rounded_to_half(values)),
    fault("coefficient of a polynomial", "the slice index is 0.1 % off")
        .numbers("raycast_", |_, params| times(params, "sweep_terms_0", 1.001)),
    fault("absorption in half precision", "small absorption is lost with its digits")
        .table(Slot::Transfer, |_, values| rounded_to_half(values)),
    fault("wrong opacity correction", "opacities hold for a length 1 % off")
        .numbers("raycast_volume", |_, params| times(params, "absorption_scale", 1.01)),
    fault("lost last step", "rays end a step before the volume does").numbers("raycast_volume", ends_early),
    fault("region off", "the rendered box is shifted by half a pixel of a slice").numbers(
        "raycast_projection",
        |scene, params| {
            moved(params, "box_low", 0, 0.5 * scene.grid.pitch[0]);
            moved(params, "box_high", 0, 0.5 * scene.grid.pitch[0]);
        },
    ),
    fault("early detector", "every surface is found 2 um early")
        .shader("raycast_surface", |words| add_to_writes(words, "distance_map", [-2e-3, 0.0, 0.0, 0.0])),
    fault("higher threshold", "the detector wants 2 % more contrast than was asked for")
        .numbers("raycast_surface", |_, params| times(params, "threshold", 1.02)),
    fault("the motor's motion ignored", "all lines of a frame lie where its first does")
        .numbers("raycast_", |_, params| set(params, "advance", 0.0)),
    fault("nearest neighbour", "the sampler does not filter").with(Change::Nearest),
    fault("colour channels swapped", "red and blue of the transfer function change places")
        .table(Slot::Transfer, |_, values| values.chunks_exact_mut(4).for_each(|entry| entry.swap(0, 2))),
    fault("off-by-one row", "the pre-integrated table is entered a row of 256 too far").table(
        Slot::PreIntegrated,
        |_, values| {
            let row = 4 * (values.len() / 4).isqrt();
            values.copy_within(row.., 0);
        },
    ),
    fault("skip one brick too far", "the distance to the next brick of another kind is counted from the one behind")
        .shader("brick_distance_", |words| add_to_writes(words, "target", [1.0 / 255.0, 0.0, 0.0, 0.0])),
    fault("brick taken for empty", "bricks a hundredth above the threshold are skipped").numbers(
        "classify_bricks_surface",
        |_, params| {
            number(params, "quiet_level", |value| {
                if let Value::F32(v) = value {
                    *v += 0.01;
                }
            });
        },
    ),
    fault("clip plane's sign", "a clip plane keeps what it should cut")
        .numbers("raycast_", |_, params| times(params, "clip_0", -1.0)),
    fault("wrong volume image", "of the volumes that take turns the first is shown, whichever was asked for")
        .arguments("raycast_", |_, args| args.image = 0),
    fault("ambient and diffuse swapped", "two numbers in the wrong order")
        .numbers("light", |_, params| swap(params, "ambient", "diffuse")),
    fault("parameters of the dispatch before", "a dispatch reads the uniform block that lies before its own").numbers(
        "scan_convert",
        |_, params| {
            number(params, "slice", |value| {
                if let Value::I32(slice) = value {
                    *slice = (*slice - 1).max(0);
                }
            });
        },
    ),
    fault("lost register", "the compiler mixes up an operand where many values are alive")
        .shader("light", |words| replace_last_opcode(words, F_ADD, F_SUB)),
    fault("shadow softness", "edges of shadows are a tenth too wide")
        .numbers("shadow", |_, params| times(params, "softness", 1.1)),
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
    fault(name, what).with(Change::Command(command))
}

/// A fault without its change yet, which the methods add: each is named after a [`Change`].
struct Named(&'static str, &'static str);

const fn fault(name: &'static str, what: &'static str) -> Named {
    Named(name, what)
}

impl Named {
    const fn with(self, change: Change) -> InjectedFault {
        InjectedFault { name: self.0, what: self.1, change }
    }

    const fn numbers(self, pass: &'static str, by: fn(&Scene, &mut Params)) -> InjectedFault {
        self.with(Change::Numbers { pass, by })
    }

    const fn shader(self, pass: &'static str, by: fn(&[u32]) -> Result<Vec<u32>, SpirvError>) -> InjectedFault {
        self.with(Change::Shader { pass, by })
    }

    const fn arguments(self, pass: &'static str, by: fn(&Scene, &mut DispatchArgs)) -> InjectedFault {
        self.with(Change::DispatchArgs { pass, by })
    }

    const fn table(self, slot: Slot, by: fn(&Scene, &mut [f32])) -> InjectedFault {
        self.with(Change::Table { slot, by })
    }

    const fn constant(self, pass: &'static str, name: &'static str, by: fn(i32) -> i32) -> InjectedFault {
        self.with(Change::Constant { pass, name, by })
    }

    const fn left_out(self, pass: &'static str, which: fn(&Scene, &DispatchArgs) -> bool) -> InjectedFault {
        self.with(Change::LeftOut { pass, which })
    }
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
