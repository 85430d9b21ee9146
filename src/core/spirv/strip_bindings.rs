//! Removes bindings of textures and tables that a module declares but a scene does not have. Specialization constants keep them from
//! being read or written. Without this rewrite either a dummy would be bound or each combination would need a shader variant of its own.

use super::module::{
    HEADER_WORDS, Instruction, Op, SpirvError, decode, encode, error, is_of_images, storage_class, text,
};
use std::collections::HashSet;

/// Removes the textures and storage buffers of these names from a module. Texels fetched, samples taken, numbers loaded and lengths become undefined
/// values, so no code that runs may use one; texels stored are left out. Names that the module does not have are ignored.
///
/// # Errors
/// The module is invalid, uses such a texture other than by fetches, samples of a given level, stores of texels and size queries, or uses such a
/// buffer other than by loads and queries of its length.
pub(crate) fn strip_bindings(words: &[u32], names: &[&str]) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    let stripped = Stripped::find(&instructions, names);
    if stripped.variables.is_empty() {
        return Ok(words.to_vec());
    }
    let mut out = words[..HEADER_WORDS].to_vec();
    for i in &instructions {
        stripped.rewrite(i, &mut out)?;
    }
    Ok(out)
}

/// What is removed, by identifier.
#[derive(Default)]
struct Stripped {
    variables: HashSet<u32>,
    /// Images loaded from these variables, and pointers into them.
    parts: HashSet<u32>,
}

impl Stripped {
    fn find(instructions: &[Instruction], names: &[&str]) -> Stripped {
        let mut stripped = Stripped::default();
        let mut named = HashSet::new();
        for i in instructions {
            match (i.opcode, i.operands) {
                (Op::Name, [id, name @ ..]) if names.contains(&text(name).as_str()) => drop(named.insert(*id)),
                (Op::Variable, [_, id, storage_class::UNIFORM_CONSTANT | storage_class::STORAGE_BUFFER, ..])
                    if named.contains(id) =>
                {
                    stripped.variables.insert(*id);
                }
                (Op::Load | Op::AccessChain | Op::InBoundsAccessChain, [_, id, from, ..])
                    if stripped.variables.contains(from) =>
                {
                    stripped.parts.insert(*id);
                }
                // The image of a texture that is also sampled.
                (Op::Image, [_, id, from]) if stripped.parts.contains(from) => {
                    stripped.parts.insert(*id);
                }
                _ => {}
            }
        }
        stripped
    }

    fn rewrite(&self, i: &Instruction, out: &mut Vec<u32>) -> Result<(), SpirvError> {
        let a = i.operands;
        let is_stripped = |id: &u32| self.variables.contains(id) || self.parts.contains(id);
        match (i.opcode, a) {
            (Op::Name | Op::Decorate, [id, ..])
            | (Op::Variable | Op::Load | Op::Image | Op::AccessChain | Op::InBoundsAccessChain, [_, id, ..])
                if is_stripped(id) => {}

            // Operands: execution model, function, name, and the variables of its interface.
            (Op::EntryPoint, [_, _, named @ ..]) => {
                let ends = |word: &u32| word.to_le_bytes().contains(&0);
                let interface = 3 + named.iter().position(ends).unwrap_or(named.len());
                let (head, used) = a.split_at(interface.min(a.len()));
                let used = used.iter().copied().filter(|id| !is_stripped(id));
                out.extend(encode(Op::EntryPoint, &head.iter().copied().chain(used).collect::<Vec<_>>()));
            }
            (
                Op::Load | Op::ArrayLength | Op::ImageFetch | Op::ImageQuerySizeLod | Op::ImageSampleExplicitLod,
                [of, result, from, ..],
            ) if is_stripped(from) => out.extend(encode(Op::Undef, &[*of, *result])),
            (Op::ImageWrite, [image, ..]) if is_stripped(image) => {}
            _ => {
                // Any other use: calls, stores, copies, samples, selections.
                let used = match i.opcode {
                    Op::Store | Op::CopyMemory | Op::CopyMemorySized => a,
                    Op::FunctionCall
                    | Op::AccessChain
                    | Op::InBoundsAccessChain
                    | Op::PtrAccessChain
                    | Op::CopyObject
                    | Op::Select
                    | Op::Phi => a.get(2..).unwrap_or_default(),
                    // Only the image can be one. Behind the coordinates are flags, which may equal an identifier.
                    of if is_of_images(of) => a.get(2..3).unwrap_or_default(),
                    _ => &[],
                };
                if used.iter().any(is_stripped) {
                    return error(format!("operation {:?} uses a texture or a table that is to be removed", i.opcode));
                }
                out.extend(encode(i.opcode, a));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::module::{embedded, malformed, words};
    use crate::spirv::reflect::reflect;

    #[test]
    fn only_the_named_bindings_are_removed() {
        let removed = ["bricks", "packed_neighbours", "line_lut", "slice_table"];
        let before = words(embedded("raycast/surface").unwrap());
        let after = strip_bindings(&before, &[&removed[..], &["nothing"]].concat()).unwrap();
        let (old, new) = (reflect(&before).unwrap(), reflect(&after).unwrap());
        let kept: Vec<_> = old.bindings.iter().filter(|b| !removed.contains(&b.name.as_str())).collect();
        assert_eq!(old.bindings.len(), kept.len() + removed.len());
        assert_eq!(new.bindings.iter().collect::<Vec<_>>(), kept);
        assert_eq!((old.params, old.constants, old.local_size), (new.params, new.constants, new.local_size));
        assert_eq!(strip_bindings(&before, &["nothing"]).unwrap(), before);
    }

    /// Prevents a module that is refused, or not, as the numbers of its identifiers happen to be: 8194 also says that a fetch names its level and
    /// extends zeros.
    #[test]
    fn the_flags_of_a_fetch_are_no_identifiers() {
        let (gone, kept) = (8194, 20);
        let variable = |id| encode(Op::Variable, &[9, id, storage_class::UNIFORM_CONSTANT]);
        let load = |id, from| encode(Op::Load, &[8, id, from]);
        let fetch = encode(Op::ImageFetch, &[6, 22, 21, 5, 8194, 4]);
        let name = encode(Op::Name, &[30, u32::from_le_bytes(*b"gon\0")]);
        let stays = [variable(kept), load(21, kept), fetch].concat();
        let header = [0x0723_0203, 0x0001_0300, 0, 9000, 0];
        let module = [&header[..], &name, &variable(30), &load(gone, 30), &stays].concat();
        assert_eq!(strip_bindings(&module, &["gon"]).unwrap(), [&header[..], &stays].concat());
    }

    #[test]
    fn a_sampled_texture_is_removed_and_a_malformed_module_is_an_error() {
        let intact = words(embedded("raycast/surface").unwrap());
        let without = reflect(&strip_bindings(&intact, &["volume"]).unwrap()).unwrap();
        assert!(without.bindings.iter().all(|b| b.name != "volume"), "it is read with a filter and without");
        malformed(|words, texture, table| strip_bindings(words, &[texture, table]).is_ok());
    }
}
