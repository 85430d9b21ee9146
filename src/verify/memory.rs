//! Group "memory": no pass reads memory that was not written. New memory is filled with poison values that no pass computes. Pictures and
//! slots must stay the same, and some pass must write every texel of every slot.

use super::compare::{add_picture_counts, count_figure, expect_same_picture, texel_comparison};
use super::{Check, DeviceUnderTest, Findings, IsolatedContext, render};
use crate::gpu::faults::Poison;
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::slots::{Initializer, Shape};
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::plan::Plan;
use crate::report::{Fault, Figure, Level, Unit, Worst};
use crate::scene::Scene;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

pub fn checks(_: Level) -> Vec<Check> {
    vec![
        Check::new("memory", "every mode on poisoned memory", modes),
        Check::new("memory", "every variant on poisoned memory", variants),
        Check::new("memory", "slots that start at zero", zeros),
    ]
}

/// A rendered picture with the contents of all slots of its plan.
struct RenderedSlots {
    picture: Picture,
    slots: Vec<(Slot, Texels)>,
}

fn render_on(
    context: &Arc<Context>,
    scene: &Scene,
    frames: &[Texels],
    poison: Option<Poison>,
) -> Result<RenderedSlots, GpuError> {
    context.faults.poison(poison);
    let drawn = draw(context, scene, frames);
    context.faults.poison(None);
    drawn
}

fn draw(context: &Arc<Context>, scene: &Scene, frames: &[Texels]) -> Result<RenderedSlots, GpuError> {
    let mut renderer = render::sent(context, scene, frames, &RendererOptions::default())?;
    let picture = renderer.picture()?;
    let mut slots = Vec::new();
    for slot in renderer.plan().slots.clone() {
        if let (Initializer::ByPasses, Some(texels)) = (slot.initializer(), renderer.read(slot)?) {
            slots.push((slot, texels));
        }
    }
    Ok(RenderedSlots { picture, slots })
}

/// Difference of a slot between zeroed memory and both poisons.
#[derive(Default)]
struct SlotDifference {
    /// Number of values that are still poison: no pass wrote them.
    left: usize,
    /// Number of values that depend on the previous contents of memory.
    depend: usize,
    /// The first of them.
    worst: Option<Worst>,
}

fn slot_difference(slot: Slot, zeros: &Texels, poisoned: [&Texels; 2], scene: &Scene) -> SlotDifference {
    let mut apart = SlotDifference::default();
    let format = slot.format(scene);
    let marks = Poison::BOTH.map(|poison| poison.texel_value(format));
    let is = |value: f64, mark: f64| value == mark || (value.is_nan() && mark.is_nan());
    // Layers that no batch had a frame for stay as they are; the first is that of every batch.
    let [width, height, _] = zeros.size;
    let layer = width * height * zeros.channels;
    let is_unused = |n: usize| {
        let of_layer = n * layer..(n + 1) * layer;
        let is_left = |i: usize| (0..2).all(|p| is(poisoned[p].values[i], marks[p]));
        matches!(slot.shape(scene), Shape::Layers(_)) && n > 0 && of_layer.into_iter().all(is_left)
    };
    let used: Vec<bool> = (0..zeros.values.len().div_ceil(layer.max(1))).map(|n| !is_unused(n)).collect();
    for (i, zero) in zeros.values.iter().enumerate().filter(|(i, _)| used[i / layer]) {
        let got = poisoned.map(|texels| texels.values[i]);
        if (0..2).all(|n| is(got[n], marks[n])) {
            apart.left += 1;
            continue;
        }
        let Some(other) = got.into_iter().find(|got| got.to_bits() != zero.to_bits()) else { continue };
        apart.depend += 1;
        apart.worst.get_or_insert(Worst::of(slot.name(), zeros, i, [*zero, other]));
    }
    apart
}

/// Draws scenes, each with its name and frames, on both kinds of poisoned memory and on zeroed memory.
fn check_scenes<'a>(
    dut: &mut DeviceUnderTest,
    scenes: impl Iterator<Item = (&'a str, &'a Scene, Cow<'a, [Texels]>)>,
) -> Result<Findings, GpuError> {
    let (mut findings, mut slots, mut left) = (Findings::default(), 0, 0);
    let isolated = IsolatedContext::of_changes(dut)?;
    for (name, scene, frames) in scenes {
        let draw = |poison| render_on(&isolated.context, scene, &frames, poison);
        let (zeros, poisoned) = (draw(None)?, [draw(Some(Poison::BOTH[0]))?, draw(Some(Poison::BOTH[1]))?]);
        for (n, held) in poisoned.iter().enumerate() {
            expect_same_picture(&mut findings, &format!("{name}, poison {}", n + 1), &zeros.picture, &held.picture);
        }
        slots += zeros.slots.len();
        for (i, (slot, texels)) in zeros.slots.iter().enumerate() {
            let apart = slot_difference(*slot, texels, [&poisoned[0].slots[i].1, &poisoned[1].slots[i].1], scene);
            left += apart.left;
            if let Some(worst) = apart.worst {
                let what = format!("'{}' depends on what memory held before", slot.name());
                let pictures = texel_comparison(slot.name(), texels, &poisoned[0].slots[i].1, worst.at[2]);
                let worst = Some(Worst { beyond: apart.depend, ..worst });
                findings.add_shown(Fault { input: name.into(), worst, ..Fault::new(what) }, pictures);
            }
            findings.expect(apart.left == 0, || {
                let (left, all, slot) = (apart.left, texels.values.len(), slot.name());
                format!("{name}: {left} of {all} values of '{slot}' are never written")
            });
        }
    }
    isolated.report_validation(&mut findings);
    add_picture_counts(&mut findings);
    findings.figures.push(count_figure("slots compared", slots));
    findings.figures.push(Figure::error("values never written", left as f64, 0.0, Unit::Count));
    Ok(findings)
}

fn modes(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let modes = dut.modes()?;
    check_scenes(dut, modes.iter().map(|of| (&*of.name, &of.scene, Cow::from(&of.frames[..]))))
}

/// A part of the built-in scenes; the group "passes" poisons the outputs of single passes in all of them.
fn variants(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (scenes, step) = (dut.scenes(), if dut.level == Level::Quick { 40 } else { 4 });
    // Without the wide scenes, which are the last, and without rays at edges alone, which leave most of a picture unwritten.
    let scenes = scenes.iter().take_while(|(name, _)| !name.starts_with("Cartesian of ["));
    let scenes = scenes.filter(|(_, scene)| !scene.settings.ray.adaptive).step_by(step);
    check_scenes(dut, scenes.map(|(name, scene)| (&**name, scene, Cow::from(super::built_in::wall(scene, 0)))))
}

/// Slots that are read before a pass has written all of them hold zeros in a new renderer.
fn zeros(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, scenes) = (Findings::default(), dut.scenes());
    let isolated = IsolatedContext::of_changes(dut)?;
    let mut seen = BTreeSet::new();
    for (name, scene) in scenes.iter() {
        let slots = Plan::new(scene).slots;
        let new: Vec<Slot> = slots.into_iter().filter(|slot| slot.starts_clear() && seen.insert(*slot)).collect();
        if new.is_empty() {
            continue;
        }
        let mut renderer = Renderer::new(&isolated.context, scene.clone(), &RendererOptions::default())?;
        for slot in new {
            let texels = renderer.read(slot)?;
            let values = texels.iter().flat_map(|texels| &texels.values);
            let wrong = values.filter(|value| **value != 0.0).count();
            findings.expect(wrong == 0, || format!("'{name}': {wrong} values of '{}' are not 0 at first", slot.name()));
        }
    }
    isolated.report_validation(&mut findings);
    findings.figures.push(count_figure("slots that start at zero", seen.len()));
    Ok(findings)
}
