//! Numbers of a pass, loaded once where a module reads them again and again. A GPU keeps them in registers that all lanes share. llvmpipe
//! gathers them lane by lane, some 25 instructions for each scalar, wherever a shader names them: eight of them made up half
//! the time of a sample along a ray. As in [`super::stored`] the words are rewritten when the pipeline is made.

use super::texture_to_storage::instruction;
use super::{Instruction, SpirvError, error, instructions};
use std::collections::{HashMap, HashSet};

/// Storage class of uniform blocks.
const UNIFORM: u32 = 2;

/// A member of a uniform block, or a component of one, that is loaded.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Member {
    /// The numbers of its type and of the pointer's.
    is: u32,
    pointer: u32,
    /// The block's variable, and the constants that lead to the member.
    path: Vec<u32>,
}

/// The module with every number of its uniform blocks loaded at its beginning, and nowhere else. What it computes is the same.
/// A module of several functions stays as it is.
///
/// # Errors
/// A module that breaks the format.
pub fn hoisted(words: &[u32]) -> Result<Vec<u32>, SpirvError> {
    let whole = instructions(words)?;
    let found = Found::of(&whole);
    if found.functions != 1 || found.members.is_empty() {
        return Ok(words.to_vec());
    }
    let mut bound = words[3];
    if bound > 0x3f_ffff - 2 * found.members.len() as u32 {
        return error("no numbers are left for values");
    }
    let values: HashMap<&Member, u32> = found.members.iter().zip((bound + 1..).step_by(2)).collect();
    let mut out = words[..5].to_vec();
    let mut is_loaded = false;
    let mut in_function = false;
    for i in &whole {
        let a = i.operands;
        // Behind the function's first label and its variables.
        let is_head = !in_function || matches!(i.opcode, 8 | 59 | 248 | 317);
        if in_function && !is_head && !is_loaded {
            is_loaded = true;
            for member in &found.members {
                let chain = [&[member.pointer, bound][..], &member.path].concat();
                out.extend(instruction(65, &chain));
                out.extend(instruction(61, &[member.is, bound + 1, bound]));
                bound += 2;
            }
        }
        in_function |= i.opcode == 248;
        match found.load(i).and_then(|member| values.get(&member)) {
            // OpCopyObject
            Some(value) => out.extend(instruction(83, &[a[0], a[1], *value])),
            None => out.extend(instruction(i.opcode, a)),
        }
    }
    out[3] = bound;
    Ok(out)
}

#[derive(Default)]
struct Found {
    functions: usize,
    /// By pointer: its type, and where it points.
    chains: HashMap<u32, (u32, Vec<u32>)>,
    /// In the order in which they are first loaded.
    members: Vec<Member>,
}

impl Found {
    fn of(whole: &[Instruction]) -> Found {
        let mut found = Found::default();
        let (mut constants, mut blocks, mut known) = (HashSet::new(), HashSet::new(), HashSet::new());
        for i in whole {
            match (i.opcode, i.operands) {
                (43, [_, id, ..]) => drop(constants.insert(*id)),
                (59, [_, id, UNIFORM, ..]) => drop(blocks.insert(*id)),
                (54, _) => found.functions += 1,
                (65 | 66, [pointer, id, path @ ..])
                    if path.split_first().is_some_and(|(base, indices)| {
                        blocks.contains(base) && indices.iter().all(|index| constants.contains(index))
                    }) =>
                {
                    found.chains.insert(*id, (*pointer, path.to_vec()));
                }
                (61, _) => {
                    if let Some(member) = found.load(i)
                        && known.insert(member.clone())
                    {
                        found.members.push(member);
                    }
                }
                _ => {}
            }
        }
        found
    }

    /// The member that an instruction loads. Loads that say how memory is accessed are left alone.
    fn load(&self, i: &Instruction) -> Option<Member> {
        match (i.opcode, i.operands) {
            (61, [is, _, from]) => {
                self.chains.get(from).map(|(pointer, path)| Member { is: *is, pointer: *pointer, path: path.clone() })
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::{EMBEDDED, embedded, reflect, words};

    /// Loads of uniform blocks: before the first branch, and behind it.
    fn loads(words: &[u32]) -> (usize, usize) {
        let whole = instructions(words).unwrap();
        let found = Found::of(&whole);
        let first = whole.iter().position(|i| matches!(i.opcode, 249..=254)).unwrap();
        let count = |part: &[Instruction]| part.iter().filter(|i| found.load(i).is_some()).count();
        (count(&whole[..first]), count(&whole[first..]))
    }

    #[test]
    fn every_number_of_every_shader_is_loaded_once_and_nothing_else_changes() {
        for (name, bytes) in EMBEDDED {
            let before = words(bytes);
            let after = hoisted(&before).unwrap();
            assert_eq!(reflect(&before).unwrap(), reflect(&after).unwrap(), "{name}");
            let members = Found::of(&instructions(&before).unwrap()).members.len();
            assert_eq!(loads(&after), (members, 0), "{name}");
            let (old, new) = (instructions(&before).unwrap(), instructions(&after).unwrap());
            assert_eq!(new.len(), old.len() + 2 * members, "{name}");
            let kept = |i: &&Instruction| !matches!(i.opcode, 61 | 65 | 83);
            let same = old.iter().filter(kept).zip(new.iter().filter(kept));
            assert!(same.clone().count() > 0 && same.into_iter().all(|(o, n)| o.operands == n.operands), "{name}");
        }
        let (early, late) = loads(&words(embedded("raycast/projection.even").unwrap()));
        assert!(early + late > 40, "rays have that many numbers");
    }

    #[test]
    fn a_broken_module_is_an_error() {
        let whole = words(embedded("raycast/volume.uneven").unwrap());
        for cut in 1..whole.len() {
            let _ = hoisted(&whole[..cut]);
        }
        for at in 3..whole.len() {
            let mut bent = whole.clone();
            bent[at] ^= 0x0003_0001;
            let _ = hoisted(&bent);
        }
    }
}
