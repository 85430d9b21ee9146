//! Textures that a module has and a scene has not: where specialization constants keep them from being read, the binding goes too,
//! instead of something being bound that nobody looks at. Shaders would else have another variant for each.

use super::texture_to_storage::instruction;
use super::{Instruction, SpirvError, error, instructions, text};
use std::collections::HashSet;

/// The module without the textures of these names. Texels of them become undefined values: nothing that runs may use one.
/// Names that it does not have are passed over.
///
/// # Errors
/// A module that breaks the format, or a texture that is used in any way besides fetches and questions after its size.
pub fn without(words: &[u32], names: &[&str]) -> Result<Vec<u32>, SpirvError> {
    let whole = instructions(words)?;
    let gone = Gone::of(&whole, names);
    if gone.variables.is_empty() {
        return Ok(words.to_vec());
    }
    let mut out = words[..5].to_vec();
    for i in &whole {
        gone.rewrite(i, &mut out)?;
    }
    Ok(out)
}

#[derive(Default)]
struct Gone {
    variables: HashSet<u32>,
    /// What was loaded of them.
    images: HashSet<u32>,
}

impl Gone {
    fn of(whole: &[Instruction], names: &[&str]) -> Gone {
        let mut gone = Gone::default();
        let mut named = HashSet::new();
        for i in whole {
            match (i.opcode, i.operands) {
                (5, [id, name @ ..]) if names.contains(&text(name).as_str()) => drop(named.insert(*id)),
                // OpVariable in storage class UniformConstant
                (59, [_, id, 0, ..]) if named.contains(id) => drop(gone.variables.insert(*id)),
                (61, [_, id, from, ..]) if gone.variables.contains(from) => drop(gone.images.insert(*id)),
                _ => {}
            }
        }
        gone
    }

    fn rewrite(&self, i: &Instruction, out: &mut Vec<u32>) -> Result<(), SpirvError> {
        let a = i.operands;
        let is_gone = |id: &u32| self.variables.contains(id) || self.images.contains(id);
        match (i.opcode, a) {
            // OpName, OpDecorate, OpVariable, OpLoad
            (5 | 71, [id, ..]) | (59 | 61, [_, id, ..]) if is_gone(id) => {}
            // OpEntryPoint: model, function, name, and what it uses
            (15, [_, _, named @ ..]) => {
                let ends = |word: &u32| word.to_le_bytes().contains(&0);
                let interface = 3 + named.iter().position(ends).unwrap_or(named.len());
                let (head, used) = a.split_at(interface.min(a.len()));
                let used = used.iter().copied().filter(|id| !is_gone(id));
                out.extend(instruction(15, &head.iter().copied().chain(used).collect::<Vec<_>>()));
            }
            // OpImageFetch, OpImageQuerySizeLod: OpUndef
            (95 | 103, [of, result, image, ..]) if is_gone(image) => out.extend(instruction(1, &[*of, *result])),
            (57 | 62..=67 | 83 | 86..=107 | 169 | 245, _) if a.iter().skip(2).any(is_gone) => {
                return error(format!("operation {} on a texture that is not there", i.opcode));
            }
            _ => out.extend(instruction(i.opcode, a)),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::{embedded, reflect, words};

    #[test]
    fn the_binding_goes_and_nothing_else_changes() {
        let before = words(embedded("raycast/surface.moved").unwrap());
        let after = without(&before, &["bricks", "quads", "nothing"]).unwrap();
        let (old, new) = (reflect(&before).unwrap(), reflect(&after).unwrap());
        let kept: Vec<_> = old.bindings.iter().filter(|b| !["bricks", "quads"].contains(&b.name.as_str())).collect();
        assert_eq!(old.bindings.len(), kept.len() + 2);
        assert_eq!(new.bindings.iter().collect::<Vec<_>>(), kept);
        assert_eq!((old.params, old.constants, old.local_size), (new.params, new.constants, new.local_size));
        assert_eq!(without(&before, &["nothing"]).unwrap(), before);
    }

    #[test]
    fn what_is_sampled_cannot_go_and_a_broken_module_is_an_error() {
        let whole = words(embedded("raycast/surface.moved").unwrap());
        assert!(without(&whole, &["volume"]).is_err(), "its filtered samples are taken");
        for cut in 1..whole.len() {
            let _ = without(&whole[..cut], &["bricks", "quads"]);
        }
        for at in 3..whole.len() {
            let mut bent = whole.clone();
            bent[at] ^= 0x0003_0001;
            let _ = without(&bent, &["bricks", "quads"]);
        }
    }
}
