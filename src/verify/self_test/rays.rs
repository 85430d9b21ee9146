//! Faults of rays, of what they leap over, and of light.

use super::list::{number, set, swap, times};
use crate::passes::fault_injection::{Change, InjectedFault};
use crate::passes::{Params, Slot, Value};
use crate::scene::Scene;
use crate::spirv::mutate::add_to_writes;
use half::f16;

/// Rays of pixels half a pixel to the right.
fn shifted(scene: &Scene, params: &mut Params) {
    let of = [("origin", scene.rays.origin + 0.5 * scene.rays.origin_dx)];
    let directed = [("direction", scene.rays.direction + 0.5 * scene.rays.direction_dx)];
    for (name, to) in of.into_iter().chain(directed) {
        number(params, name, |value| *value = Value::Vec3(to.to_array().map(|v| v as f32)));
    }
}

/// The far side of the box, seen along the view, a step nearer.
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
        what: "the box that is rendered lies half a pixel of a slice aside",
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
        name: "leap one brick too far",
        what: "the distance to the next brick of another kind is counted from the one behind",
        change: Change::Shader {
            pass: "leap_",
            by: |words| add_to_writes(words, "target", [1.0 / 255.0, 0.0, 0.0, 0.0]),
        },
    },
    InjectedFault {
        name: "brick taken for empty",
        what: "bricks a hundredth above the threshold are leapt over",
        change: Change::Numbers {
            pass: "classify_surface",
            by: |_, params| {
                number(params, "quiet", |value| {
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
        change: Change::Numbers {
            pass: "raycast_",
            by: |_, params| {
                number(params, "clip_0", |value| {
                    if let Value::Vec4(v) = value {
                        *v = v.map(|v| -v);
                    }
                });
            },
        },
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
        name: "shadow softness",
        what: "edges of shadows are a tenth too wide",
        change: Change::Numbers { pass: "shadow", by: |_, params| times(params, "softness", 1.1) },
    },
];
