//! Everything that is read was written before: with new memory full of what nobody computes, pictures and slots are the same, and every
//! texel of every slot is some pass's.

use super::isolated_context::IsolatedContext;
use super::repeats::{counted, same};
use super::{Bench, Check, Found, drawn, shown};
use crate::gpu::faults::Poison;
use crate::gpu::{Context, GpuError, RendererOptions};
use crate::passes::slots::Initializer;
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::scene::Scene;
use crate::verify::report::{Fault, Figure, Level, Shown, Unit, Worst};
use std::sync::Arc;

pub fn checks(_: Level) -> Vec<Check> {
    vec![
        Check::new("memory", "every mode on poisoned memory", modes),
        Check::new("memory", "every variant on poisoned memory", variants),
    ]
}

/// A picture, and what every slot of its plan holds then.
struct Held {
    picture: Picture,
    slots: Vec<(Slot, Texels)>,
}

fn held(context: &Arc<Context>, scene: &Scene, frames: &[Texels], poison: Option<Poison>) -> Result<Held, GpuError> {
    context.faults.poison(poison);
    let drawn = draw(context, scene, frames);
    context.faults.poison(None);
    drawn
}

fn draw(context: &Arc<Context>, scene: &Scene, frames: &[Texels]) -> Result<Held, GpuError> {
    let mut renderer = drawn::sent(context, scene, frames, &RendererOptions::default())?;
    let picture = renderer.picture()?;
    let mut slots = Vec::new();
    for slot in renderer.plan().slots.clone() {
        if let (Initializer::ByPasses, Some(texels)) = (slot.filled(), renderer.read(slot)?) {
            slots.push((slot, texels));
        }
    }
    Ok(Held { picture, slots })
}

/// What differs between a slot on zeros and the same on both poisons.
#[derive(Default)]
struct Apart {
    /// Texels that hold whichever poison there was: no pass wrote them.
    left: usize,
    /// Values that depend on what memory held, and the first of them.
    depend: usize,
    worst: Option<Worst>,
}

fn apart(slot: Slot, zeros: &Texels, poisoned: [&Texels; 2], scene: &Scene) -> Apart {
    let mut apart = Apart::default();
    let format = slot.format(scene);
    let marks = Poison::BOTH.map(|poison| poison.texel_value(format));
    let is = |value: f64, mark: f64| value == mark || (value.is_nan() && mark.is_nan());
    for (i, zero) in zeros.values.iter().enumerate() {
        let got = poisoned.map(|texels| texels.values[i]);
        if (0..2).all(|n| is(got[n], marks[n])) {
            apart.left += 1;
            continue;
        }
        let Some(other) = got.into_iter().find(|got| got.to_bits() != zero.to_bits()) else { continue };
        apart.depend += 1;
        let (texel, [w, h, _]) = (i / zeros.channels, zeros.size);
        apart.worst.get_or_insert(Worst {
            output: slot.name().into(),
            at: [texel % w, texel / w % h, texel / w / h],
            channel: i % zeros.channels,
            expected: *zero,
            got: other,
            beyond: 0,
            texels: zeros.values.len() / zeros.channels,
        });
    }
    apart
}

/// What came of one scene, added up over all.
#[derive(Default)]
struct Sums {
    scenes: usize,
    wrong: usize,
    slots: usize,
    left: usize,
}

fn look(
    found: &mut Found,
    sums: &mut Sums,
    context: &Arc<Context>,
    (name, scene, frames): (&str, &Scene, &[Texels]),
) -> Result<(), GpuError> {
    let zeros = held(context, scene, frames, None)?;
    let poisoned =
        [held(context, scene, frames, Some(Poison::BOTH[0]))?, held(context, scene, frames, Some(Poison::BOTH[1]))?];
    sums.scenes += 1;
    for (n, held) in poisoned.iter().enumerate() {
        let what = format!("{name}, poison {}", n + 1);
        sums.wrong += usize::from(!same(found, &what, &zeros.picture, &held.picture));
    }
    for (i, (slot, texels)) in zeros.slots.iter().enumerate() {
        let apart = apart(*slot, texels, [&poisoned[0].slots[i].1, &poisoned[1].slots[i].1], scene);
        sums.slots += 1;
        sums.left += apart.left;
        if let Some(worst) = apart.worst {
            let what = format!("'{}' depends on what memory held before", slot.name());
            let (fault, slice) = (Some(found.faults.len()), worst.at[2]);
            let pictures = shown::shown(slot.name(), texels, &poisoned[0].slots[i].1, slice);
            found.pictures.push(Shown { fault, ..pictures });
            let worst = Some(Worst { beyond: apart.depend, ..worst });
            found.faults.push(Fault { input: name.into(), worst, ..Fault::new(what) });
        }
        found.expect(apart.left == 0, || {
            format!("{name}: {} of {} values of '{}' are never written", apart.left, texels.values.len(), slot.name())
        });
    }
    Ok(())
}

fn tell(found: &mut Found, sums: &Sums) {
    counted(found, 2 * sums.scenes, sums.wrong);
    let figure = Figure::error("slots compared", sums.slots as f64, 0.0, Unit::Count);
    found.figures.push(Figure { allowed: None, ..figure });
    found.figures.push(Figure::error("values never written", sums.left as f64, 0.0, Unit::Count));
}

fn modes(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, mut sums, modes) = (Found::default(), Sums::default(), bench.modes()?);
    let aside = IsolatedContext::of_changes(bench)?;
    for of in modes.iter() {
        look(&mut found, &mut sums, &aside.context, (&of.name, &of.scene, &of.frames))?;
    }
    aside.tell(&mut found);
    tell(&mut found, &sums);
    Ok(found)
}

/// Of the scenes that need every pass a few: passes alone are poisoned in all of them.
fn variants(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, mut sums, scenes) = (Found::default(), Sums::default(), bench.scenes());
    let aside = IsolatedContext::of_changes(bench)?;
    let step = if bench.level == Level::Quick { 40 } else { 4 };
    for (name, scene) in scenes.iter().step_by(step) {
        let frames = super::built_in::wall(scene, 0);
        look(&mut found, &mut sums, &aside.context, (name, scene, &frames))?;
    }
    aside.tell(&mut found);
    tell(&mut found, &sums);
    Ok(found)
}
