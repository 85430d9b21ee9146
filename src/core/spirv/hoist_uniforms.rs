//! Hoists the loads of uniform numbers to the start of a shader. A GPU keeps uniforms in registers that all lanes share.
//! llvmpipe gathers them lane by lane, about 25 instructions for each scalar, wherever a shader names them: eight of them
//! took half the time of a sample along a ray. As in [`super::texture_to_storage`], the words are rewritten when the pipeline
//! is made.

use super::module::{
    BOUND, HEADER_WORDS, Instruction, MAX_BOUND, Op, SpirvError, decode, encode, error, storage_class,
};
use std::collections::{HashMap, HashSet};

/// A member of a uniform block, or a component of one, that is loaded.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Member {
    value_type: u32,
    pointer_type: u32,
    /// The variable of the block, and the constants that index the member.
    path: Vec<u32>,
}

/// Loads every member of the module's uniform blocks once, at the start. It computes the same values. A module with several functions is returned
/// unchanged.
///
/// # Errors
/// The module is invalid.
pub(crate) fn hoist_uniforms(words: &[u32]) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    let loads = UniformLoads::find(&instructions);
    if loads.functions != 1 || loads.members.is_empty() {
        return Ok(words.to_vec());
    }
    let mut bound = words[BOUND];
    if bound > MAX_BOUND - 2 * loads.members.len() as u32 {
        return error("no identifiers are left for new values");
    }
    let values: HashMap<&Member, u32> = loads.members.iter().zip((bound + 1..).step_by(2)).collect();
    let mut out = words[..HEADER_WORDS].to_vec();
    let mut is_loaded = false;
    let mut in_function = false;
    for i in &instructions {
        let a = i.operands;
        // The loads go after the function's first label and its variables.
        let is_head = !in_function || matches!(i.opcode, Op::Line | Op::Variable | Op::Label | Op::NoLine);
        if in_function && !is_head && !is_loaded {
            is_loaded = true;
            for member in &loads.members {
                let chain = [&[member.pointer_type, bound][..], &member.path].concat();
                out.extend(encode(Op::AccessChain, &chain));
                out.extend(encode(Op::Load, &[member.value_type, bound + 1, bound]));
                bound += 2;
            }
        }
        in_function |= i.opcode == Op::Label;
        match loads.member(i).and_then(|member| values.get(&member)) {
            Some(value) => out.extend(encode(Op::CopyObject, &[a[0], a[1], *value])),
            None => out.extend(encode(i.opcode, a)),
        }
    }
    out[BOUND] = bound;
    Ok(out)
}

#[derive(Default)]
struct UniformLoads {
    functions: usize,
    /// By pointer: its type, and where it points.
    chains: HashMap<u32, (u32, Vec<u32>)>,
    /// In the order of their first load.
    members: Vec<Member>,
}

impl UniformLoads {
    fn find(instructions: &[Instruction]) -> UniformLoads {
        let mut loads = UniformLoads::default();
        let (mut constants, mut blocks, mut found) = (HashSet::new(), HashSet::new(), HashSet::new());
        for i in instructions {
            match (i.opcode, i.operands) {
                (Op::Constant, [_, id, ..]) => drop(constants.insert(*id)),
                (Op::Variable, [_, id, storage_class::UNIFORM, ..]) => drop(blocks.insert(*id)),
                (Op::Function, _) => loads.functions += 1,
                (Op::AccessChain | Op::InBoundsAccessChain, [pointer, id, path @ ..])
                    if path.split_first().is_some_and(|(base, indices)| {
                        blocks.contains(base) && indices.iter().all(|index| constants.contains(index))
                    }) =>
                {
                    loads.chains.insert(*id, (*pointer, path.to_vec()));
                }
                (Op::Load, _) => {
                    if let Some(member) = loads.member(i)
                        && found.insert(member.clone())
                    {
                        loads.members.push(member);
                    }
                }
                _ => {}
            }
        }
        loads
    }

    /// The member that an instruction loads. Loads with memory access operands are left alone.
    fn member(&self, i: &Instruction) -> Option<Member> {
        match (i.opcode, i.operands) {
            (Op::Load, [value_type, _, from]) => self.chains.get(from).map(|(pointer_type, path)| Member {
                value_type: *value_type,
                pointer_type: *pointer_type,
                path: path.clone(),
            }),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::module::{EMBEDDED, embedded, malformed, words};
    use crate::spirv::reflect::reflect;

    /// Loads of uniform blocks before the first branch and after it.
    fn count_loads(words: &[u32]) -> (usize, usize) {
        let instructions = decode(words).unwrap();
        let loads = UniformLoads::find(&instructions);
        let first = instructions.iter().position(|i| (Op::Branch..=Op::ReturnValue).contains(&i.opcode)).unwrap();
        let count = |part: &[Instruction]| part.iter().filter(|i| loads.member(i).is_some()).count();
        (count(&instructions[..first]), count(&instructions[first..]))
    }

    #[test]
    fn every_uniform_of_every_shader_is_loaded_once_and_nothing_else_changes() {
        for (name, bytes) in EMBEDDED {
            let before = words(bytes);
            let after = hoist_uniforms(&before).unwrap();
            assert_eq!(reflect(&before).unwrap(), reflect(&after).unwrap(), "{name}");
            let members = UniformLoads::find(&decode(&before).unwrap()).members.len();
            assert_eq!(count_loads(&after), (members, 0), "{name}");
            let (old, new) = (decode(&before).unwrap(), decode(&after).unwrap());
            assert_eq!(new.len(), old.len() + 2 * members, "{name}");
            let kept = |i: &&Instruction| !matches!(i.opcode, Op::Load | Op::AccessChain | Op::CopyObject);
            let same = old.iter().filter(kept).zip(new.iter().filter(kept));
            assert!(same.clone().count() > 0 && same.into_iter().all(|(o, n)| o.operands == n.operands), "{name}");
        }
        let (early, late) = count_loads(&words(embedded("raycast/projection").unwrap()));
        assert!(early + late > 40, "ray casting has that many uniform numbers");
    }

    #[test]
    fn a_malformed_module_is_an_error() {
        malformed(|words, _, _| hoist_uniforms(words).is_ok());
    }
}
