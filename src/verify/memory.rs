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
use crate::report::{Fault, Figure, Level, PictureComparison, Unit, Worst};
use crate::scene::Scene;
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

/// Totals over all scenes.
#[derive(Default)]
struct Totals {
    scenes: usize,
    wrong: usize,
    slots: usize,
    left: usize,
}

fn check_scene(
    findings: &mut Findings,
    totals: &mut Totals,
    context: &Arc<Context>,
    (name, scene, frames): (&str, &Scene, &[Texels]),
) -> Result<(), GpuError> {
    let zeros = render_on(context, scene, frames, None)?;
    let poisoned = [
        render_on(context, scene, frames, Some(Poison::BOTH[0]))?,
        render_on(context, scene, frames, Some(Poison::BOTH[1]))?,
    ];
    totals.scenes += 1;
    for (n, held) in poisoned.iter().enumerate() {
        let what = format!("{name}, poison {}", n + 1);
        totals.wrong += usize::from(!expect_same_picture(findings, &what, &zeros.picture, &held.picture));
    }
    for (i, (slot, texels)) in zeros.slots.iter().enumerate() {
        let apart = slot_difference(*slot, texels, [&poisoned[0].slots[i].1, &poisoned[1].slots[i].1], scene);
        totals.slots += 1;
        totals.left += apart.left;
        if let Some(worst) = apart.worst {
            let what = format!("'{}' depends on what memory held before", slot.name());
            let (fault, slice) = (Some(findings.faults.len()), worst.at[2]);
            let pictures = texel_comparison(slot.name(), texels, &poisoned[0].slots[i].1, slice);
            findings.pictures.push(PictureComparison { fault, ..pictures });
            let worst = Some(Worst { beyond: apart.depend, ..worst });
            findings.faults.push(Fault { input: name.into(), worst, ..Fault::new(what) });
        }
        findings.expect(apart.left == 0, || {
            format!("{name}: {} of {} values of '{}' are never written", apart.left, texels.values.len(), slot.name())
        });
    }
    Ok(())
}

fn add_totals(findings: &mut Findings, totals: &Totals) {
    add_picture_counts(findings, 2 * totals.scenes, totals.wrong);
    findings.figures.push(count_figure("slots compared", totals.slots));
    findings.figures.push(Figure::error("values never written", totals.left as f64, 0.0, Unit::Count));
}

fn modes(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut totals, modes) = (Findings::default(), Totals::default(), dut.modes()?);
    let isolated = IsolatedContext::of_changes(dut)?;
    for of in modes.iter() {
        check_scene(&mut findings, &mut totals, &isolated.context, (&of.name, &of.scene, &of.frames))?;
    }
    isolated.report_validation(&mut findings);
    add_totals(&mut findings, &totals);
    Ok(findings)
}

/// A part of the built-in scenes; the group "passes" poisons the outputs of single passes in all of them.
fn variants(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut totals, scenes) = (Findings::default(), Totals::default(), dut.scenes());
    let isolated = IsolatedContext::of_changes(dut)?;
    let step = if dut.level == Level::Quick { 40 } else { 4 };
    // Without the wide scenes, which are the last, and without rays at edges alone, which leave most of a picture unwritten.
    let scenes = scenes.iter().take_while(|(name, _)| !name.starts_with("Cartesian of ["));
    for (name, scene) in scenes.filter(|(_, scene)| !scene.settings.ray.adaptive).step_by(step) {
        let frames = super::built_in::wall(scene, 0);
        check_scene(&mut findings, &mut totals, &isolated.context, (name, scene, &frames))?;
    }
    isolated.report_validation(&mut findings);
    add_totals(&mut findings, &totals);
    Ok(findings)
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
