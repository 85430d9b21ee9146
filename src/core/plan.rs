//! Plans a scene: which passes and slots it needs, and after a change of scene, what has to run again. Needs no GPU.

use crate::passes::slots::frames_per_batch;
use crate::passes::{DispatchArgs, Frequency, PASSES, Part, Pass, Slot, Stage, chain};
use crate::scene::Scene;
use std::collections::BTreeMap;
use std::ops::Range;

/// One dispatch of a plan. A pass that repeats has one step for each repetition.
#[derive(Clone, Copy)]
pub struct Step {
    pub pass: &'static Pass,
    pub iteration: u32,
}

/// The dispatches that a scene needs, in order, and the slots that they use.
pub struct Plan {
    pub steps: Vec<Step>,
    pub slots: Vec<Slot>,
}

/// What has to run again after a change of scene or shaders.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Rerun {
    /// The geometry (apart from the motor's travel during a frame), the type or range of the samples, or the slots that frames fill, with their sizes
    /// and formats, differ. All slots are made again, and all frames have to be sent again.
    Everything,
    /// All frames have to be sent again, through stage 1 (preprocess).
    Frames,
    /// These steps over the volume and the picture have to run again, given by their indices in [`Plan::steps`], and the CPU has to compute these
    /// slots again.
    Steps { steps: Vec<usize>, slots: Vec<Slot> },
}

/// The most expensive part of a rendering that has to run again. The variants are in ascending order of cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Work {
    /// Only planes beside a rendering and stage 4 (postprocess), both of which take little time.
    Tone,
    /// Stage 3 (shade), with the distance map as it is.
    Shading,
    /// Stage 2 (raycast): rays are cast again. Stage 1 (preprocess), with all frames, may have to run again before.
    Rays,
}

impl Work {
    /// The work that a change of scene from `before` to `after` requires.
    pub fn between(before: &Scene, after: &Scene) -> Work {
        let plan = Plan::new(after);
        match plan.rerun(before, after) {
            Rerun::Steps { steps, .. } => plan.work(after, steps),
            Rerun::Frames | Rerun::Everything => Work::Rays,
        }
    }
}

impl Plan {
    /// The most expensive work among these steps, which are given by their indices in [`Plan::steps`]. [`Work::Tone`] if there are none.
    pub fn work(&self, scene: &Scene, steps: impl IntoIterator<Item = usize>) -> Work {
        let of_planes = |slot: &Slot| matches!(slot, Slot::SharpSectionVolume | Slot::SectionVolume);
        let work_of = |step: &Step| match step.pass.stage {
            Stage::Preprocess if step.writes(scene).iter().all(of_planes) => Work::Tone,
            Stage::Raycast if step.writes(scene).iter().all(|slot| *slot == Slot::Planes) => Work::Tone,
            Stage::Preprocess | Stage::Raycast => Work::Rays,
            Stage::Shade => Work::Shading,
            Stage::Postprocess => Work::Tone,
        };
        steps.into_iter().filter_map(|i| self.steps.get(i)).map(work_of).max().unwrap_or(Work::Tone)
    }

    /// The plan of a scene.
    pub fn new(scene: &Scene) -> Plan {
        let mut steps = Vec::new();
        for pass in PASSES.iter().filter(|p| p.is_needed(scene)) {
            steps.extend((0..(pass.repeat)(scene)).map(|iteration| Step { pass, iteration }));
        }
        let mut slots: Vec<Slot> = steps.iter().flat_map(|s| s.slots(scene)).collect();
        slots.sort();
        slots.dedup();
        Plan { steps, slots }
    }

    /// The steps that run at this frequency, with their indices.
    pub fn steps_of(&self, frequency: Frequency) -> impl Iterator<Item = (usize, &Step)> {
        self.steps.iter().enumerate().filter(move |(_, s)| s.pass.frequency == frequency)
    }

    /// Device memory of all slots, bytes; a multibuffered slot is counted once.
    pub fn bytes(&self, scene: &Scene) -> u64 {
        self.slots.iter().map(|s| s.bytes(scene)).sum()
    }

    /// A description of the plan in several lines: passes with the reason why each is needed or not, the visible region, and slots with their bytes.
    pub fn explain(&self, scene: &Scene) -> String {
        let (mut lines, mut stage) = (Vec::new(), None);
        let names = |slots: Vec<Slot>| slots.into_iter().map(Slot::name).collect::<Vec<_>>().join(", ");
        for pass in PASSES {
            if stage != Some(pass.stage) {
                stage = Some(pass.stage);
                lines.push(format!("stage {}: {}", pass.stage as u32 + 1, pass.stage.name()));
            }
            let why = match pass.needed(scene) {
                Ok(why) => why,
                Err(why) => {
                    lines.push(format!("  - {:<19} {why}", pass.name));
                    continue;
                }
            };
            let all = DispatchArgs { slices: pass.slices(scene), ..DispatchArgs::default() };
            let [x, y, z] = pass.invocations(scene, &all);
            let each = match pass.frequency {
                Frequency::Frame => "each frame",
                Frequency::Volume => "each volume",
                Frequency::Picture => "each picture",
            };
            let times = match (pass.repeat)(scene) {
                1 => String::new(),
                n => format!(", {n} times"),
            };
            lines.push(format!("  + {:<19} {x} x {y} x {z}, {each}{times}: {why}", pass.name));
            // A pass that repeats may use several pipelines; each is listed once.
            let mut listed = Vec::new();
            for step in (0..(pass.repeat)(scene)).map(|iteration| Step { pass, iteration }) {
                let shader = pass.shader(scene, &step.args());
                let pipeline = (shader, pass.constants(scene, &step.args()));
                if !listed.contains(&pipeline) {
                    listed.push(pipeline);
                    let (reads, writes) = (names(step.reads(scene)), names(step.writes(scene)));
                    lines.push(format!("    {:<19} {shader}: {reads} -> {writes}", ""));
                }
            }
        }
        if self.slots.contains(&Slot::Volume) {
            lines.push(format!("slices: {}", self.slice_path(scene)));
            lines.push(scene.format_choice());
            lines.push(format!("samples of the volume: {}", scene.sampling.words()));
            lines.extend(scene.brick_choice());
        }
        lines.extend(scene.light_choice());
        lines.extend(scene.found.iter().map(|found| format!("chosen: {found}")));
        lines.extend(scene.resolved_sizes.iter().map(ToString::to_string));
        let (bounds, [columns, rows, slices]) = (&scene.visible_bounds, scene.volume_size());
        let [x, y, z] = [0, 1, 2].map(|axis| format!("{}..{}", bounds.low[axis], bounds.high[axis]));
        lines.push(format!(
            "visible: columns {x} of {columns}, rows {y} of {rows}, slices {z} of {slices}: {:.1} % of the volume; frames {:?}",
            100.0 * scene.visible_share(),
            scene.visible_frames()
        ));
        lines.push("slots".into());
        let row = |name: &str, bytes: u64| format!("    {name:<15} {bytes:>12} bytes");
        for slot in &self.slots {
            let shape = format!("{:?} {:?}", slot.shape(scene), slot.format(scene));
            lines.push(format!("{}  {shape}", row(slot.name(), slot.bytes(scene))));
        }
        lines.push(row("total", self.bytes(scene)));
        lines.join("\n") + "\n"
    }

    /// How slices get into the 3D image.
    fn slice_path(&self, scene: &Scene) -> String {
        if let Some(slot) = chain::copied(scene) {
            let (from, to) = (Slot::Frames.format(scene), slot.format(scene));
            let widened =
                if from == to { String::new() } else { format!(", widened from {from:?} to {to:?} by the CPU") };
            return format!("copied into the 3D image as they arrive, by no pass{widened}");
        }
        let last = self.steps_of(Frequency::Frame).last().map_or("no pass", |(_, step)| step.pass.name);
        let at_once = frames_per_batch(scene);
        format!("{last}, the last pass of a frame, writes them into the 3D image; of up to {at_once} frames at once")
    }

    /// What has to run again after a change from `old` to `new`; `self` is the plan of `new`. Steps are compared by their shaders, constants,
    /// parameters and slots, without knowledge of what settings mean. A step that reads a slot that changes runs again too.
    pub fn rerun(&self, old: &Scene, new: &Scene) -> Rerun {
        let before = Plan::new(old);
        // The slots that frames fill. Everything else can be computed again from them.
        let stored = |plan: &Plan, scene: &Scene| -> Vec<_> {
            let slots = plan.steps.iter().filter(|s| s.pass.frequency == Frequency::Frame).flat_map(|s| s.slots(scene));
            let slots = slots.chain(chain::copied(scene));
            slots.map(|s| (s, s.array_size(scene), s.format(scene))).collect()
        };
        let moved = !old.geometry.equals_except_advance(&new.geometry);
        if stored(&before, old) != stored(self, new) || moved || old.input != new.input {
            return Rerun::Everything;
        }
        // A smaller visible region needs nothing new; a larger one needs frames, and so does smoothing that reaches further across slices.
        let new = &new.clone().keeping(old);
        let (frames, wanted) = (old.visible_frames(), new.visible_frames());
        let has_frames = wanted.is_empty() || (frames.start <= wanted.start && wanted.end <= frames.end);
        if !old.visible_bounds.holds(&new.visible_bounds) || !has_frames || old.stored_bounds() != new.stored_bounds() {
            return Rerun::Frames;
        }
        let old = &Scene { visible_bounds: new.visible_bounds, kept_bounds: new.kept_bounds, ..old.clone() };
        let slots: Vec<Slot> = self.slots.iter().copied().filter(|s| s.differs(old, new)).collect();
        self.steps_again(new, slots, |step| {
            !before.steps.iter().any(|s| s.id() == step.id() && s.same_work(step, old, new))
        })
    }

    /// What has to run again in an unchanged scene after shaders were edited: the steps of these shaders and all that read their results.
    /// `is_changed` gets a shader's path below glsl/ with its variant.
    pub fn rerun_shaders(&self, scene: &Scene, is_changed: impl Fn(&str) -> bool) -> Rerun {
        self.steps_again(scene, Vec::new(), |step| is_changed(step.pass.shader(scene, &step.args())))
    }

    /// What has to run again where the CPU computes `slots` again: the changed steps, and those that read what changes.
    fn steps_again(&self, scene: &Scene, slots: Vec<Slot>, is_changed: impl Fn(&Step) -> bool) -> Rerun {
        let (mut changed, mut steps) = (slots.clone(), Vec::new());
        for (i, step) in self.steps.iter().enumerate() {
            if !is_changed(step) && !step.reads(scene).iter().any(|slot| changed.contains(slot)) {
                continue;
            }
            if step.pass.frequency == Frequency::Frame {
                return Rerun::Frames;
            }
            changed.extend(step.writes(scene));
            steps.push(i);
        }
        Rerun::Steps { steps, slots }
    }
}

/// For each slot the step (name of the pass, iteration) that wrote it last.
pub type Contents = BTreeMap<Slot, (&'static str, u32)>;

impl Plan {
    /// Marks further steps in `stale` (for each step, true if it has to run): those whose result a stale step reads from a slot that holds the result
    /// of another step by now. `contents`: which step's result each slot holds.
    pub fn complete(&self, scene: &Scene, stale: &mut [bool], contents: &Contents) {
        'again: loop {
            let mut now = contents.clone();
            for (i, step) in self.steps.iter().enumerate().filter(|(_, s)| s.pass.frequency != Frequency::Frame) {
                if !stale[i] {
                    continue;
                }
                for bind in step.pass.reads(scene, &step.args()) {
                    let writer = self.steps[..i].iter().rposition(|s| s.writes(scene).contains(&bind.slot));
                    let Some(j) = writer.filter(|j| self.steps[*j].pass.frequency != Frequency::Frame) else {
                        continue;
                    };
                    if now.get(&bind.slot) != Some(&self.steps[j].id()) {
                        stale[j] = true;
                        continue 'again;
                    }
                }
                now.extend(step.writes(scene).into_iter().map(|slot| (slot, step.id())));
            }
            return;
        }
    }
}

/// Ranges of slices that have to be recomputed if the slices that are true in `changed` have changed and each result depends on `reach` neighbours on
/// either side. They are in rising order and do not overlap.
pub fn affected(changed: &[bool], reach: u32) -> Vec<Range<u32>> {
    let mut runs: Vec<Range<u32>> = Vec::new();
    for slice in (0..changed.len() as u32).filter(|s| changed[*s as usize]) {
        let near = slice.saturating_sub(reach)..(slice + reach + 1).min(changed.len() as u32);
        match runs.last_mut() {
            Some(last) if last.end >= near.start => last.end = near.end,
            _ => runs.push(near),
        }
    }
    runs
}

impl Step {
    /// Number of further slices on either side of a dispatch's slices that this step reads; 0 if it reads no such neighbours.
    pub fn reach(&self, scene: &Scene) -> u32 {
        let reads = self.pass.reads(scene, &self.args());
        reads.iter().map(|b| if let Part::Around(more) = b.part { more } else { 0 }).max().unwrap_or(0)
    }

    /// Name of the step's pass, and its iteration.
    pub fn id(&self) -> (&'static str, u32) {
        (self.pass.name, self.iteration)
    }

    /// The slots that the step reads.
    pub fn reads(&self, scene: &Scene) -> Vec<Slot> {
        self.pass.reads(scene, &self.args()).iter().map(|b| b.slot).collect()
    }

    /// The slots that the step writes.
    pub fn writes(&self, scene: &Scene) -> Vec<Slot> {
        self.pass.writes(scene, &self.args()).iter().map(|b| b.slot).collect()
    }

    /// Dispatch arguments of the step for a single slice; layer, slice and image are 0.
    pub fn args(&self) -> DispatchArgs {
        DispatchArgs { iteration: self.iteration, ..DispatchArgs::default() }
    }

    fn slots(&self, scene: &Scene) -> Vec<Slot> {
        [self.reads(scene), self.writes(scene)].concat()
    }

    fn same_work(&self, other: &Step, old: &Scene, new: &Scene) -> bool {
        let (a, b) = (self.pass, other.pass);
        let args = self.args();
        a.shader(old, &args) == b.shader(new, &args)
            && a.constants(old, &args) == b.constants(new, &args)
            && a.numbers(old, &args) == b.numbers(new, &args)
            && a.invocations(old, &args) == b.invocations(new, &args)
            && a.reads(old, &args) == b.reads(new, &args)
            && a.writes(old, &args) == b.writes(new, &args)
    }
}

#[cfg(test)]
mod tests {
    use super::affected;

    #[test]
    fn a_changed_slice_affects_its_neighbours_and_adjacent_ranges_merge() {
        let changed = |which: &[usize]| (0..10).map(|i| which.contains(&i)).collect::<Vec<_>>();
        assert_eq!(affected(&changed(&[]), 2), []);
        assert_eq!(affected(&changed(&[5]), 0), vec![5..6; 1]);
        assert_eq!(affected(&changed(&[0, 9]), 2), [0..3, 7..10]);
        assert_eq!(affected(&changed(&[2, 5, 9]), 1), [1..7, 8..10]);
    }
}
