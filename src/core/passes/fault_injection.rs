//! Fault injection: deliberate faults that test whether the checks detect them. A fault changes what the device gets; the input of the
//! f64 reference stays the same. Pure: the renderer applies the changes where it passes data to the device.

use super::pass::{DispatchArgs, Params, Part, Pass, Slot};
use super::slots::Initializer;
use crate::scene::Scene;
use crate::spirv::mutants::{self, Mutation};
use crate::spirv::{self, SpirvError};

/// A deliberate fault that checks are to detect, with its name.
#[derive(Clone, Copy)]
pub struct InjectedFault {
    pub name: &'static str,
    /// The real fault that it stands for, in a driver or in this program.
    pub what: &'static str,
    pub change: Change,
}

/// What a fault changes on the way to the device. `pass` is the beginning of a name: the fault applies to all passes whose names begin with it.
#[derive(Clone, Copy)]
pub enum Change {
    /// Changes the parameters of a dispatch.
    Numbers { pass: &'static str, by: fn(&Scene, &mut Params) },
    /// Changes the value of the specialization constant `name`.
    Constant { pass: &'static str, name: &'static str, by: fn(i32) -> i32 },
    /// Changes the SPIR-V words of a shader.
    Shader { pass: &'static str, by: fn(&[u32]) -> Result<Vec<u32>, SpirvError> },
    /// Changes the dispatch arguments (slice, layer, iteration, volume image).
    DispatchArgs { pass: &'static str, by: fn(&Scene, &mut DispatchArgs) },
    /// Leaves out the dispatches for which `which` is true: their outputs keep their old content.
    LeftOut { pass: &'static str, which: fn(&Scene, &DispatchArgs) -> bool },
    /// Changes the number of invocations of a dispatch.
    Extent { pass: &'static str, by: fn(&mut [u32; 3]) },
    /// Changes the values of a table that the CPU makes from the scene.
    Table { slot: Slot, by: fn(&Scene, &mut [f32]) },
    /// Changes the bytes of an uploaded frame. The function gets three numbers (bytes per texel, texels per line, number of lines) and the bytes.
    Frame(fn([usize; 3], &mut [u8])),
    /// Makes the sampler take the nearest texel instead of interpolating.
    Nearest,
    /// Changes one instruction of a class in every shader of the pass, as if a compiler had translated it wrongly. `share` (0 to 1) chooses which one
    /// of them.
    Mutant { pass: &'static str, mutation: &'static Mutation, share: f32 },
    /// Makes the driver execute a Vulkan command wrongly.
    Command(Command),
}

/// A Vulkan command, and what a faulty driver does instead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `vkCmdDispatchBase` ignores the base: it begins with workgroup 0.
    DispatchBase,
    /// `vkCmdDispatchIndirect` dispatches nothing.
    DispatchIndirect,
    /// `vkCmdCopyBufferToImage` copies only the first layer or slice.
    CopyToImage,
    /// `vkCmdCopyImageToBuffer` copies nothing.
    CopyToBuffer,
    /// `vkCmdClearColorImage` clears to 1 instead of 0.
    Clear,
    /// `vkCreateComputePipelines` ignores specialization constants: they keep their defaults.
    Specialize,
    /// `vkInvalidateMappedMemoryRanges` does nothing.
    Invalidate,
}

impl Change {
    /// Applies the fault to the parameters of a dispatch. Returns true if that changed them. `constants`, `args`, `extent`, `table` and `frame` do
    /// the same with their last argument.
    pub fn numbers(&self, pass: &Pass, scene: &Scene, params: &mut Params) -> bool {
        match self {
            Change::Numbers { pass: name, by } if pass.name.starts_with(name) => changed(params, |p| by(scene, p)),
            _ => false,
        }
    }

    pub fn constants(&self, pass: &str, constants: &mut [(&'static str, i32)]) -> bool {
        let Change::Constant { pass: of, name, by } = self else { return false };
        let found = constants.iter_mut().find(|(n, _)| n == name && pass.starts_with(of));
        found.is_some_and(|(_, value)| changed(value, |v| *v = by(*v)))
    }

    /// Applies the fault to the SPIR-V words of a shader. Returns true if that changed them.
    ///
    /// # Errors
    /// The module is invalid, or lacks the instruction or name to change.
    pub fn words(&self, pass: &str, words: &mut Vec<u32>) -> Result<bool, SpirvError> {
        match self {
            Change::Shader { pass: name, by } if pass.starts_with(name) => {
                let other = by(words)?;
                Ok(std::mem::replace(words, other) != *words)
            }
            Change::Mutant { pass: name, mutation, share } if pass.starts_with(name) => {
                match mutants::count(words, mutation) {
                    0 => Ok(false),
                    count => {
                        let site = (share * count as f32) as usize;
                        *words = mutants::mutant(words, mutation, site.min(count - 1))?;
                        Ok(true)
                    }
                }
            }
            _ => Ok(false),
        }
    }

    pub fn args(&self, pass: &str, scene: &Scene, args: &mut DispatchArgs) -> bool {
        match self {
            Change::DispatchArgs { pass: name, by } if pass.starts_with(name) => changed(args, |t| by(scene, t)),
            _ => false,
        }
    }

    pub fn leaves_out(&self, pass: &str, scene: &Scene, args: &DispatchArgs) -> bool {
        matches!(self, Change::LeftOut { pass: name, which } if pass.starts_with(name) && which(scene, args))
    }

    pub fn extent(&self, pass: &str, extent: &mut [u32; 3]) -> bool {
        match self {
            Change::Extent { pass: name, by } if pass.starts_with(name) => changed(extent, by),
            _ => false,
        }
    }

    pub fn table(&self, slot: Slot, scene: &Scene, values: &mut [f32]) -> bool {
        let Change::Table { slot: of, by } = self else { return false };
        let before = values.to_vec();
        if slot == *of {
            by(scene, values);
        }
        before != values
    }

    pub fn frame(&self, scene: &Scene, bytes: &mut [u8]) -> bool {
        let Change::Frame(by) = self else { return false };
        let ([width, height], before) = (scene.frame_size().map(|n| n as usize), bytes.to_vec());
        by([bytes.len() / (width * height), width, height], bytes);
        before != bytes
    }

    /// True if the fault can change the output of this pass in a scene, so that a comparison of the pass with its reference may notice it. False for
    /// `Clear`, `Specialize` and `Invalidate` of [`Command`], which other checks have to notice.
    pub fn concerns(&self, pass: &Pass, scene: &Scene) -> bool {
        let args = |iteration| DispatchArgs { layer: 2, slice: scene.slices() / 2, slices: 1, iteration, image: 0 };
        let turns: Vec<DispatchArgs> = (0..(pass.repeat)(scene)).map(args).collect();
        let reads = |slot: Slot| turns.iter().any(|t| pass.reads(scene, t).iter().any(|b| b.slot == slot));
        pass.is_needed(scene)
            && match self {
                Change::Numbers { .. } => turns.iter().any(|t| self.numbers(pass, scene, &mut pass.numbers(scene, t))),
                Change::Constant { .. } => {
                    turns.iter().any(|t| self.constants(pass.name, &mut pass.constants(scene, t)))
                }
                Change::Shader { pass: name, .. } | Change::Extent { pass: name, .. } => pass.name.starts_with(name),
                Change::DispatchArgs { .. } => turns.iter().any(|t| self.args(pass.name, scene, &mut t.clone())),
                Change::LeftOut { .. } => turns.iter().any(|t| self.leaves_out(pass.name, scene, t)),
                Change::Table { slot, .. } => {
                    let made = |make: fn(&Scene) -> Vec<f32>| self.table(*slot, scene, &mut make(scene));
                    reads(*slot) && matches!(slot.initializer(), Initializer::ByScene(make) if made(make))
                }
                Change::Frame(_) => reads(Slot::Frames),
                Change::Mutant { pass: name, mutation, .. } => {
                    let shader = spirv::embedded(pass.shader(scene, &turns[0])).map(spirv::words);
                    pass.name.starts_with(name) && shader.is_some_and(|words| mutants::count(&words, mutation) > 0)
                }
                Change::Command(Command::DispatchIndirect) => {
                    pass.reads(scene, &turns[0]).iter().any(|bind| bind.part == Part::Groups)
                }
                Change::Command(command) => {
                    matches!(command, Command::DispatchBase | Command::CopyToImage | Command::CopyToBuffer)
                }
                Change::Nearest => pass.reads(scene, &turns[0]).iter().any(|b| b.filtered),
            }
    }
}

fn changed<T: Clone + PartialEq>(value: &mut T, by: impl FnOnce(&mut T)) -> bool {
    let before = value.clone();
    by(value);
    before != *value
}
