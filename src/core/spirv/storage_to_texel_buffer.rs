//! Turns lookup tables in storage buffers into storage texel buffers. On a software device each lane of a load from a storage
//! buffer is a branch of its own, while texels are gathered. As in [`super::texture_to_storage`], the words are rewritten when
//! the pipeline is made, so that a shader needs no second variant.

use super::module::{
    BOUND, Capability, HEADER_WORDS, ImageFormat, Instruction, Op, SpirvError, StorageImages, decode, decoration,
    encode, error, next_id, require, storage_class, text,
};
use std::collections::HashMap;

/// An entry of a table.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Entry {
    entry_type: u32,
    components: u32,
}

impl Entry {
    /// The image format of its texel.
    fn format(self) -> ImageFormat {
        match self.components {
            1 => ImageFormat::R32f,
            2 => ImageFormat::Rg32f,
            _ => ImageFormat::Rgba32f,
        }
    }
}

/// Makes storage texel buffers of the module's tables for whose names `is_selected` is true. A table is a read-only storage buffer that holds a
/// single array of floats or of vectors of two or four floats.
///
/// # Errors
/// The module is invalid, or uses such a table other than by reading entries and querying its length.
pub(crate) fn storage_to_texel_buffer(
    words: &[u32],
    is_selected: impl Fn(&str) -> bool,
) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    let mut tables = Tables::find(&instructions);
    tables.by_variable.retain(|_, (name, _)| is_selected(name));
    if tables.by_variable.is_empty() {
        return Ok(words.to_vec());
    }
    // Each instruction needs a few new identifiers at most: with this many of both, the bound stays in its limit.
    if words[BOUND] > 0x1f_ffff || instructions.len() > 0xf_ffff {
        return error("no identifiers are left for new types");
    }
    let mut rewrite = Rewrite { tables, ..Rewrite::default() };
    let mut out = words[..HEADER_WORDS].to_vec();
    require(Capability::ImageBuffer, &instructions, &mut out);
    if rewrite.tables.by_variable.values().any(|(_, entry)| entry.format() == ImageFormat::Rg32f) {
        require(Capability::StorageImageExtendedFormats, &instructions, &mut out);
    }
    for i in &instructions {
        rewrite.instruction(i.opcode, i.operands, &mut out)?;
    }
    Ok(out)
}

/// The tables of a module, and the types that their texels need.
#[derive(Default)]
struct Tables {
    /// The type of a 32-bit float.
    float: u32,
    /// The type of a vector of four floats; 0 if the module has none.
    vec4: u32,
    /// By variable: the name of the table and its entries.
    by_variable: HashMap<u32, (String, Entry)>,
}

impl Tables {
    fn find(instructions: &[Instruction]) -> Tables {
        let mut tables = Tables::default();
        let (mut names, mut read_only) = (HashMap::new(), Vec::new());
        let (mut vectors, mut arrays, mut structs, mut pointees) =
            (HashMap::new(), HashMap::new(), HashMap::new(), HashMap::new());
        for i in instructions {
            let a = i.operands;
            match i.opcode {
                Op::Name => drop(names.insert(a[0], text(&a[1..]))),
                Op::Decorate if a[1] == decoration::NON_WRITABLE => read_only.push(a[0]),
                Op::TypeFloat if a[1] == 32 => tables.float = a[0],
                Op::TypeVector if a[1] == tables.float => {
                    vectors.insert(a[0], a[2]);
                    if a[2] == 4 {
                        tables.vec4 = a[0];
                    }
                }
                Op::TypeRuntimeArray if a.len() >= 2 => drop(arrays.insert(a[0], a[1])),
                Op::TypeStruct if a.len() == 2 => drop(structs.insert(a[0], a[1])),
                Op::TypePointer => drop(pointees.insert(a[0], a[2])),
                Op::Variable if a[2] == storage_class::STORAGE_BUFFER && read_only.contains(&a[1]) => {
                    let member = pointees.get(&a[0]).and_then(|block| structs.get(block));
                    let Some(&entry_type) = member.and_then(|array| arrays.get(array)) else { continue };
                    let components = match vectors.get(&entry_type) {
                        Some(n) => *n,
                        None if entry_type == tables.float => 1,
                        None => continue,
                    };
                    let name = names.get(&a[1]).cloned().unwrap_or_default();
                    if matches!(components, 1 | 2 | 4) {
                        tables.by_variable.insert(a[1], (name, Entry { entry_type, components }));
                    }
                }
                _ => {}
            }
        }
        tables
    }
}

/// What a pointer of the module points at: an entry, or a component of it.
#[derive(Clone, Copy)]
struct Pointee {
    variable: u32,
    index: u32,
    component: Option<u32>,
}

#[derive(Default)]
struct Rewrite {
    tables: Tables,
    new_types: StorageImages,
    /// By pointer.
    pointees: HashMap<u32, Pointee>,
}

impl Rewrite {
    /// Appends the rewritten instruction, after whatever it needs declared.
    fn instruction(&mut self, opcode: Op, a: &[u32], out: &mut Vec<u32>) -> Result<(), SpirvError> {
        let table = |at: usize| a.get(at).and_then(|id| self.tables.by_variable.get(id)).map(|(_, entry)| *entry);
        match opcode {
            Op::Variable if let Some(entry) = table(1) => {
                let [_, pointer] = self.declare(entry.format(), out);
                out.extend(encode(opcode, &[pointer, a[1], 0]));
            }
            // Indices: the only member of the block, an entry, and possibly a component.
            Op::AccessChain if table(2).is_some() => {
                let (Some(&index), 5..=6) = (a.get(4), a.len()) else {
                    return error("a table is not read entry by entry");
                };
                self.pointees.insert(a[1], Pointee { variable: a[2], index, component: a.get(5).copied() });
            }
            Op::Load if a.len() >= 3 && self.pointees.contains_key(&a[2]) => self.load(a[0], a[1], a[2], out),
            Op::ArrayLength if table(2).is_some() => {
                let image = self.image(a[2], out);
                out.extend(encode(Op::ImageQuerySize, &[a[0], a[1], image]));
            }
            _ if self.points_at_table(opcode, a) => {
                return error(format!("operation {opcode:?} uses a table that is to become a texel buffer"));
            }
            _ => out.extend(encode(opcode, a)),
        }
        Ok(())
    }

    /// True if a pointer operand points at a table. That is any other use: loads of all of it, stores, calls, copies,
    /// selections.
    fn points_at_table(&self, opcode: Op, a: &[u32]) -> bool {
        let pointers = match opcode {
            Op::Load | Op::AccessChain | Op::InBoundsAccessChain | Op::PtrAccessChain | Op::ArrayLength => a.get(2..3),
            Op::Store | Op::CopyMemory | Op::CopyMemorySized => a.get(..2),
            Op::FunctionCall | Op::CopyObject | Op::Select | Op::Phi => a.get(2..),
            _ => None,
        };
        let is_table = |id: &u32| self.tables.by_variable.contains_key(id) || self.pointees.contains_key(id);
        pointers.is_some_and(|p| p.iter().any(is_table))
    }

    /// The type of a texel buffer and that of pointers to it. Declares them once, and the vector of four floats that every texel is read as.
    fn declare(&mut self, format: ImageFormat, out: &mut Vec<u32>) -> [u32; 2] {
        let Tables { float, vec4, .. } = &mut self.tables;
        if *vec4 == 0 {
            *vec4 = next_id(out);
            out.extend(encode(Op::TypeVector, &[*vec4, *float, 4]));
        }
        // Dimension Buffer (5), no depth, not arrayed, not multisampled.
        self.new_types.declare(&[*float, 5, 0, 0, 0], format, out)
    }

    /// Loads the texel buffer of a variable.
    fn image(&mut self, variable: u32, out: &mut Vec<u32>) -> u32 {
        let [image_type, _] = self.declare(self.tables.by_variable[&variable].1.format(), out);
        let image = next_id(out);
        out.extend(encode(Op::Load, &[image_type, image, variable]));
        image
    }

    fn load(&mut self, value_type: u32, result: u32, pointer: u32, out: &mut Vec<u32>) {
        let Pointee { variable, index, component } = self.pointees[&pointer];
        let entry = self.tables.by_variable[&variable].1;
        let image = self.image(variable, out);
        // A read returns four components; those that the format lacks are 0 and 1.
        let texel = if entry.components == 4 && component.is_none() { result } else { next_id(out) };
        out.extend(encode(Op::ImageRead, &[self.tables.vec4, texel, image, index]));
        match (component, entry.components) {
            (Some(component), _) => {
                out.extend(encode(Op::VectorExtractDynamic, &[value_type, result, texel, component]));
            }
            (None, 1) => out.extend(encode(Op::CompositeExtract, &[value_type, result, texel, 0])),
            (None, 2) => out.extend(encode(Op::VectorShuffle, &[value_type, result, texel, texel, 0, 1])),
            (None, _) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::module::{embedded, malformed, words};
    use crate::spirv::reflect::{Access, Dimension, Kind, reflect};

    fn table_names(words: &[u32]) -> Vec<String> {
        Tables::find(&decode(words).unwrap()).by_variable.into_values().map(|(name, _)| name).collect()
    }

    #[test]
    fn tables_become_texel_buffers_and_nothing_else_changes() {
        let before = words(embedded("raycast/volume").unwrap());
        let mut names = table_names(&before);
        names.sort();
        assert_eq!(names, ["line_lut", "slice_table", "sweep_lut", "transfer"]);
        let after = storage_to_texel_buffer(&before, |_| true).unwrap();
        let (old, new) = (reflect(&before).unwrap(), reflect(&after).unwrap());
        for (old, new) in old.bindings.iter().zip(&new.bindings) {
            assert_eq!((&old.name, old.binding, old.dimension), (&new.name, new.binding, new.dimension));
            let components = match old.name.as_str() {
                "sweep_lut" | "line_lut" => Some(1),
                "slice_table" => Some(2),
                "transfer" => Some(4),
                _ => None,
            };
            assert_eq!(new.kind, components.map_or(old.kind, Kind::Texels), "{}", old.name);
            assert_eq!(new.access, old.access);
        }
        assert_eq!((old.params, old.constants, old.local_size), (new.params, new.constants, new.local_size));
        let one = reflect(&storage_to_texel_buffer(&before, |name| name == "transfer").unwrap()).unwrap();
        let of = |name: &str| one.bindings.iter().find(|b| b.name == name).unwrap();
        assert_eq!((of("transfer").kind, of("transfer").access), (Kind::Texels(4), Access::Read));
        assert_eq!((of("sweep_lut").kind, of("sweep_lut").dimension), (Kind::Buffer, Dimension::None));
    }

    #[test]
    fn buffers_of_structures_and_writable_buffers_are_not_tables() {
        assert!(table_names(&words(embedded("filter/sigma.slice").unwrap())).is_empty());
        assert!(table_names(&words(embedded("shade/light").unwrap())).is_empty());
    }

    #[test]
    fn a_malformed_module_is_an_error() {
        malformed(|words, _, _| storage_to_texel_buffer(words, |_| true).is_ok());
    }
}
