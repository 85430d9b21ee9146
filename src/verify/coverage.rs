//! What the checks exercise: for each pass the shaders, pipelines, specialization constants, workgroups and classes of instructions, and
//! for each group of checks the Vulkan commands. It is derived from the declarations of passes and from built-in scenes, so that no device
//! is needed.

use super::each_pass::dispatch_args_of;
use crate::passes::device_limits::{self, MEASURES, POSITIONS};
use crate::passes::{DispatchArgs, PASSES, Pass};
use crate::scene::Scene;
use crate::spirv;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// What the check of one pass in the group "passes" covers.
#[derive(Default)]
pub struct PassCoverage {
    pub shaders: BTreeSet<&'static str>,
    /// For each specialization constant the values that it has in the check.
    pub constants: BTreeMap<&'static str, BTreeSet<i32>>,
    /// Pipelines of the check: each is a shader with the values of all its constants.
    pub pipelines: BTreeSet<(&'static str, Vec<(&'static str, i32)>)>,
    /// Largest number of workgroups of a dispatch along each of x, y and z.
    pub groups: [u32; 3],
    /// Classes of SPIR-V instructions that occur in the shaders.
    pub classes: BTreeSet<&'static str>,
}

impl PassCoverage {
    fn add(&mut self, scene: &Scene, pass: &Pass) {
        for iteration in 0..(pass.repeat)(scene) {
            let args = dispatch_args_of(scene, pass, iteration);
            let (shader, constants) = (pass.shader(scene, &args), pass.constants(scene, &args));
            let words = spirv::embedded(shader).map(spirv::words).unwrap_or_default();
            if self.shaders.insert(shader) {
                self.classes.extend(spirv::classes(&words));
            }
            for (name, value) in &constants {
                self.constants.entry(*name).or_default().insert(*value);
            }
            self.pipelines.insert((shader, constants));
            let local = spirv::reflect(&words).map_or([1; 3], |module| module.local_size);
            let extent = pass.invocations(scene, &args);
            for axis in 0..3 {
                self.groups[axis] = self.groups[axis].max(extent[axis].div_ceil(local[axis].max(1)));
            }
        }
    }
}

/// The coverage of each pass by its check in the group "passes", in the order of [`PASSES`].
pub fn passes(scenes: &[(String, Scene)]) -> Vec<(&'static str, PassCoverage)> {
    let of = |pass: &'static Pass| {
        let mut coverage = PassCoverage::default();
        scenes.iter().filter(|(_, scene)| pass.is_needed(scene)).for_each(|(_, scene)| coverage.add(scene, pass));
        (pass.name, coverage)
    };
    PASSES.iter().map(of).collect()
}

/// Embedded shaders that no check runs.
fn unused_shaders(scenes: &[(String, Scene)]) -> Vec<&'static str> {
    let mut used: BTreeSet<&str> = passes(scenes).into_iter().flat_map(|(_, of)| of.shaders).collect();
    if let Ok(scene) = device_limits::scene(8, 8) {
        // Run by the groups "sampling" and "formats".
        let measures = MEASURES.iter().chain([&POSITIONS]);
        used.extend(measures.map(|pass| pass.shader(&scene, &DispatchArgs::default())));
    }
    spirv::EMBEDDED.iter().map(|(name, _)| *name).filter(|name| !used.contains(name)).collect()
}

/// Vulkan commands that do work on a queue, and those that decide what it reads, with the groups of checks that would see a fault.
const COMMANDS: [(&str, &str); 21] = [
    ("vkCmdDispatch", "passes"),
    ("vkCmdDispatchBase", "passes, each in three bands"),
    ("vkCmdDispatchIndirect", "passes"),
    ("vkCmdCopyBufferToImage", "passes"),
    ("vkCmdCopyImageToBuffer", "passes"),
    ("vkCmdClearColorImage", "memory"),
    ("vkCmdPipelineBarrier2", "hazards; the self-test leaves out each"),
    ("vkCmdBindPipeline", "passes"),
    ("vkCmdBindDescriptorSets", "passes, where descriptors cannot be pushed; formats"),
    ("vkCmdPushDescriptorSetKHR", "passes, where descriptors can be pushed"),
    ("vkCmdWriteTimestamp2", "time stamps"),
    ("vkCmdBeginQuery", "none: statistics of `profile`"),
    ("vkCmdEndQuery", "none: statistics of `profile`"),
    ("vkCreateComputePipelines", "passes; specialization, where the driver applies constants"),
    ("vkCreateSampler", "sampling"),
    ("vkGetQueryPoolResults", "time stamps"),
    ("vkFlushMappedMemoryRanges", "memory, where memory is not coherent"),
    ("vkInvalidateMappedMemoryRanges", "passes, where memory is not coherent"),
    ("vkQueueSubmit2", "determinism, on 1 to 3 queues"),
    ("vkQueueWaitIdle", "every failed check once more, to tell faults of synchronization"),
    ("vkWaitSemaphores", "determinism, failures"),
];

/// The coverage as text: a line for each pass and for each class of instructions, one line with all unused shaders, and a line for each Vulkan
/// command.
pub fn text(scenes: &[(String, Scene)]) -> String {
    let (of_passes, mut text) = (passes(scenes), String::new());
    let mut by_class: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (name, of) in &of_passes {
        let shaders: Vec<&str> = of.shaders.iter().copied().collect();
        let values = |values: &BTreeSet<i32>| match values.len() {
            0..=6 => values.iter().map(i32::to_string).collect::<Vec<_>>().join("|"),
            count => format!("{count} values"),
        };
        let constants: Vec<String> = of.constants.iter().map(|(name, set)| format!("{name}={}", values(set))).collect();
        let [x, y, z] = of.groups;
        let _ = writeln!(
            text,
            "passes / {name}: {}; pipelines: {}; workgroups to {x} x {y} x {z}; constants: {}",
            shaders.join(", "),
            of.pipelines.len(),
            if constants.is_empty() { "none".into() } else { constants.join(", ") },
        );
        of.classes.iter().for_each(|class| by_class.entry(class).or_default().push(name));
    }
    for (class, passes) in by_class {
        let _ = writeln!(text, "instructions, {class}: {}", passes.join(", "));
    }
    match &unused_shaders(scenes)[..] {
        [] => text += "shaders that no check runs: none\n",
        unused => text += &format!("shaders that no check runs: {}\n", unused.join(", ")),
    }
    for (command, by) in COMMANDS {
        let _ = writeln!(text, "command {command}: {by}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in;

    /// A fault of a command or an instruction that nothing here runs is never found.
    #[test]
    fn every_shader_is_run_and_every_dispatch_goes_beyond_eight_workgroups() {
        let scenes = built_in::scenes(built_in::gpu()).unwrap();
        assert_eq!(unused_shaders(&scenes), Vec::<&str>::new());
        // A workgroup that lists all pixels, and the coarse cells of light from behind.
        let exceptions = ["tolerance_list", "light_propagate_back"];
        let is_small = |of: &PassCoverage| of.groups.iter().all(|count| *count <= 8);
        let small = passes(&scenes).into_iter().filter(|(_, of)| is_small(of)).map(|(name, of)| (name, of.groups));
        let small: Vec<_> = small.filter(|(name, _)| !exceptions.contains(name)).collect();
        assert!(small.is_empty(), "{small:?}");
    }

    /// Commands that the members of the workspace record or wait by, without the window's.
    #[test]
    fn every_command_of_the_renderer_is_listed() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../gpu");
        let mut used = BTreeSet::new();
        let mut folders = vec![std::path::PathBuf::from(folder)];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
                match entry.extension() {
                    _ if entry.is_dir() && !entry.ends_with("window") => folders.push(entry),
                    Some(ending) if ending == "rs" => {
                        let text = std::fs::read_to_string(&entry).unwrap();
                        let calls = text.split(".cmd_").skip(1).filter_map(|rest| rest.split('(').next());
                        used.extend(calls.map(|call| format!("cmd{}", call.replace('_', ""))));
                    }
                    _ => {}
                }
            }
        }
        // Labels for debuggers, marks for lost devices, copies of the window's pictures.
        let others = ["cmdbegindebugutilslabel", "cmdenddebugutilslabel", "cmdsetcheckpoint", "cmdcopyimage"];
        let listed: BTreeSet<String> =
            COMMANDS.iter().filter_map(|(name, _)| name.strip_prefix("vk")).map(|name| name.to_lowercase()).collect();
        used.retain(|call| !others.contains(&call.as_str()));
        let missing: Vec<_> =
            used.iter().filter(|call| !listed.iter().any(|name| name.trim_end_matches("khr") == *call)).collect();
        assert!(missing.is_empty(), "{missing:?} of {used:?}");
    }
}
