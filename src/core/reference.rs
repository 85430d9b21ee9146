//! The CPU reference renderer: all four stages in f64, every step of a plan by the reference of its pass, slots as plain arrays.
//! Goldens are made with it, and errors are measured against it.

use crate::passes::slots::{Initializer, Shape};
use crate::passes::{Arrays, DispatchArgs, Frequency, Slot, Texels, chain};
use crate::plan::{Plan, Step};
use crate::probe::Frame;
use crate::scene::Scene;
use std::collections::BTreeMap;

/// Renders a volume by the references of all passes. `frames`: one array per slice in geometric order, with the values that the shader reads from the
/// frame ([`decoded`]). Returns the contents of all slots of the plan.
pub fn render(scene: &Scene, frames: &[Texels]) -> BTreeMap<Slot, Texels> {
    render_with(scene, frames, &mut |_, _, _| false)
}

/// Converts the frames of a volume, in any order, to the values that shaders read from them, one array per slice in geometric order. The values are
/// 0..1 for integer samples, and the samples themselves for floats.
pub fn decoded(scene: &Scene, frames: &[Frame]) -> Vec<Texels> {
    let format = Slot::Frames.format(scene);
    let [width, height] = scene.frame_size().map(|n| n as usize);
    let mut frames: Vec<&Frame> = frames.iter().collect();
    frames.sort_by_key(|f| f.slice);
    frames.iter().map(|f| Texels::decode([width, height, 1], format, &f.bytes)).collect()
}

/// A function that may compute the outputs of a pass in place of its own reference: it gets the pass's name, its inputs and its outputs, and returns
/// true if it filled the outputs.
pub type Replacement<'a> = dyn FnMut(&str, &Arrays, &mut Arrays) -> bool + 'a;

/// Renders a volume from `frames` to the contents of all slots, like [`render`]. It calls `replace` for each dispatch, which may compute the outputs
/// in place of the reference of the pass.
pub fn render_with(scene: &Scene, frames: &[Texels], replace: &mut Replacement) -> BTreeMap<Slot, Texels> {
    let plan = Plan::new(scene);
    let mut slots: BTreeMap<Slot, Texels> = plan.slots.iter().map(|s| (*s, empty(*s, scene))).collect();
    for (slice, frame) in frames.iter().enumerate() {
        if let Some(volume) = chain::copied(scene).and_then(|slot| slots.get_mut(&slot)) {
            for (x, y) in (0..frame.size[1]).flat_map(|y| (0..frame.size[0]).map(move |x| (x, y))) {
                volume.set([x, y, slice], frame.get([x, y, 0]));
            }
        }
        slots.insert(Slot::Frames, frame.clone());
        for (_, step) in plan.steps_of(Frequency::Frame) {
            run(scene, step, &DispatchArgs { slice: slice as u32, ..step.args() }, &mut slots, replace);
        }
    }
    for (_, step) in plan.steps_of(Frequency::Volume).chain(plan.steps_of(Frequency::Picture)) {
        run(scene, step, &DispatchArgs { slices: step.pass.slices(scene), ..step.args() }, &mut slots, replace);
    }
    slots
}

/// Initial contents of a slot on the device: zeros, or values computed from the scene.
fn empty(slot: Slot, scene: &Scene) -> Texels {
    let format = slot.format(scene);
    let mut size = slot.array_size(scene);
    if let Shape::Layers(_) = slot.shape(scene) {
        size[2] = 1;
    }
    let mut texels = Texels::from_fn(size, format.channels(), |_, _| 0.0);
    if let Initializer::ByScene(make) = slot.initializer() {
        texels.values = make(scene).into_iter().map(f64::from).collect();
    }
    texels
}

fn run(scene: &Scene, step: &Step, args: &DispatchArgs, slots: &mut BTreeMap<Slot, Texels>, replace: &mut Replacement) {
    let (reads, writes) = (step.pass.reads(scene, args), step.pass.writes(scene, args));
    let (mut inputs, mut outputs) = (Arrays::default(), Arrays::default());
    // A plan lists every slot of its steps, and no step reads a slot that it writes.
    let missing = || Texels::untouched([0; 3], 1);
    for bind in &reads {
        if let Some(search) = bind.slot.search() {
            let found = slots.get(&search.within).map(|volume| (search.reference)(scene, volume));
            slots.extend(found.map(|found| (bind.slot, found)));
        }
        inputs.insert(bind.name, slots.get(&bind.slot).cloned().unwrap_or_else(missing));
    }
    for bind in &writes {
        outputs.insert(bind.name, slots.remove(&bind.slot).unwrap_or_else(missing));
    }
    if !replace(step.pass.name, &inputs, &mut outputs) {
        step.pass.reference(scene, args, &inputs, &mut outputs);
    }
    for bind in writes {
        slots.insert(bind.slot, outputs.get(bind.name).clone());
    }
}
