//! What passes alone are given: noise and extremes, in every slot that they read, and what follows from the one in the other.

use super::built_in::Noise;
use crate::gpu::resources::shape_size;
use crate::passes::preprocess::packed_neighbours;
use crate::passes::slots::Initializer;
use crate::passes::{Arrays, Bind, DispatchArgs, MISS, Part, Pass, Slot, Texels};
use crate::plan::Plan;
use crate::scene::Scene;

/// Inputs by kind: noise, all zero, all one, one hot texel; for distances smooth hits with cliffs and misses, all misses, one
/// hit; for volumes blurred noise, so that rays see something like tissue.
pub const KINDS: [&str; 4] = ["noise", "zero", "one", "hot"];

fn input(scene: &Scene, bind: &Bind, kind: &str, noise: &mut Noise) -> Texels {
    let format = bind.slot.format(scene);
    let mut size = shape_size(bind.slot.shape(scene));
    if bind.part == Part::Layer {
        size[2] = 1;
    }
    let mut texels = Texels::from_fn(size, format.channels(), |_, _| 0.0);
    if let Initializer::ByScene(make) = bind.slot.filled() {
        texels.values = make(scene).into_iter().map(f64::from).collect();
        return texels;
    }
    let count = texels.values.len();
    let is_distance = matches!(bind.slot, Slot::Distance | Slot::DistanceA | Slot::DistanceB);
    let tilt = noise.range(-0.4, 0.4);
    for i in 0..count {
        let (x, y) = ((i / format.channels() % size[0]) as f64, (i / format.channels() / size[0]) as f64);
        texels.values[i] = match (kind, is_distance) {
            ("noise", true) => match noise.next() {
                share if share < 0.1 => MISS,
                share if share < 0.2 => noise.range(10.0, 90.0),
                _ => 60.0 + tilt * x - 0.2 * y + if x > 9.0 { 8.0 } else { 0.0 } + noise.range(-0.3, 0.3),
            },
            ("zero", true) => MISS,
            ("one", true) => 42.0,
            ("hot", true) if i == count / 2 => 33.0,
            ("hot", true) => MISS,
            ("noise", false) => noise.next(),
            ("one", false) => 1.0,
            ("hot", false) if i == count / 2 => 1.0,
            _ => 0.0,
        };
    }
    if bind.slot == Slot::Picture || bind.slot == Slot::SmoothPicture {
        // Alpha is 0 or 1, as the passes leave it.
        texels.values.chunks_exact_mut(4).for_each(|p| p[3] = p[3].round());
    }
    if bind.slot == Slot::Surface {
        texels.values.chunks_exact_mut(2).for_each(|p| p[1] = p[1].round());
    }
    if bind.slot == Slot::Volume && kind == "noise" {
        texels = blurred(&texels);
    }
    // Both sides see what the slot's format can hold.
    Texels::decode(size, format, &texels.encode(format))
}

fn blurred(noise: &Texels) -> Texels {
    Texels::from_fn(noise.size, 1, |[x, y, z], _| {
        let mut sum = 0.0;
        for (dx, dy, dz) in (0..125).map(|i| (i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2)) {
            sum += noise.clamped(x as i64 + dx, y as i64 + dy, z as i64 + dz);
        }
        (0.5 + 4.0 * (sum / 125.0 - 0.5)).clamp(0.0, 1.0)
    })
}

/// What the passes between a volume and its rays make of it, by their references.
fn leaps_of(scene: &Scene, slot: Slot, volume: &Texels) -> Texels {
    let mut slots = std::collections::BTreeMap::from([(Slot::Volume, volume.clone())]);
    let made = |name: &str| ["tile_ranges", "brick_ranges", "classify", "leap"].iter().any(|p| name.starts_with(p));
    for step in Plan::new(scene).steps.iter().filter(|s| made(s.pass.name)) {
        let args = DispatchArgs { slices: scene.slices(), ..step.args() };
        let (mut inputs, mut outputs) = (Arrays::default(), Arrays::default());
        for bind in (step.pass.reads)(scene, &args) {
            let there = slots.get(&bind.slot).cloned();
            inputs.insert(bind.name, there.unwrap_or_else(|| input(scene, &bind, "zero", &mut Noise(1))));
        }
        for bind in (step.pass.writes)(scene, &args) {
            let channels = bind.slot.format(scene).channels();
            outputs.insert(bind.name, Texels::untouched(shape_size(bind.slot.shape(scene)), channels));
        }
        (step.pass.reference)(scene, &args, &inputs, &mut outputs);
        for bind in (step.pass.writes)(scene, &args) {
            slots.insert(bind.slot, outputs.get(bind.name).clone());
        }
        if slots.contains_key(&slot) {
            break;
        }
    }
    // A plan whose pass reads leaps has what makes them.
    slots.remove(&slot).unwrap_or_else(|| Texels::untouched([0; 3], 1))
}

/// A turn that is not the first of anything.
pub fn turn_of(scene: &Scene, iteration: u32) -> DispatchArgs {
    DispatchArgs { layer: 2, slice: scene.slices() / 2, slices: scene.slices().div_ceil(3), iteration, image: 0 }
}

/// What a pass reads, of one of [`KINDS`]: every array that some pass must have made before it follows from the others.
pub fn inputs_of(scene: &Scene, pass: &Pass, args: &DispatchArgs, kind: &str, seed: u64) -> Arrays {
    let mut noise = Noise(seed);
    let mut inputs = Arrays::default();
    let reads = (pass.reads)(scene, args);
    for (n, bind) in reads.iter().enumerate() {
        // One image bound under two names has one content.
        let made = reads[..n].iter().find(|b| b.slot == bind.slot).map(|b| inputs.get(b.name).clone());
        inputs.insert(bind.name, made.unwrap_or_else(|| input(scene, bind, kind, &mut noise)));
    }
    if let Some(bricks) = reads.iter().find(|b| b.name == "bricks") {
        // What rays leap by says what the volume says.
        let leaps = leaps_of(scene, bricks.slot, inputs.get("volume"));
        inputs.insert("bricks", leaps);
    }
    if reads.iter().any(|b| b.slot == Slot::Quads) {
        let mut quads = Arrays::default();
        let channels = Slot::Quads.format(scene).channels();
        quads.insert("quads", Texels::untouched(shape_size(Slot::Quads.shape(scene)), channels));
        let all = DispatchArgs { slices: scene.slices(), ..DispatchArgs::default() };
        (packed_neighbours::PASS.reference)(scene, &all, &inputs, &mut quads);
        inputs.insert("quads", quads.get("quads").clone());
    }
    inputs
}
