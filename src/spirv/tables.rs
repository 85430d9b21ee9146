//! Tables that a module reads from storage buffers, read as storage texel buffers instead. Where the device is a CPU each lane of a
//! load from a storage buffer is a branch of its own, while texels are gathered. As in [`super::stored`] the words are rewritten
//! when the pipeline is made, so that no shader says anything twice.

use super::texture_to_storage::instruction;
use super::{Instruction, SpirvError, error, instructions, text};
use std::collections::HashMap;

const IMAGE_BUFFER: u32 = 47;
const RG32F: u32 = 6;

/// What one entry of a table is.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Entry {
    /// The number of its type.
    is: u32,
    components: u32,
}

impl Entry {
    /// The image format that holds one.
    fn format(self) -> u32 {
        match self.components {
            1 => 3,     // R32f
            2 => RG32F, // needs the capability of extended formats
            _ => 1,     // Rgba32f
        }
    }
}

/// Names of the storage buffers that are tables: only read, and nothing but one array of floats or of vectors of two or four.
pub fn tables(words: &[u32]) -> Result<Vec<String>, SpirvError> {
    let whole = instructions(words)?;
    Ok(Found::of(&whole).tables.into_values().map(|(name, _)| name).collect())
}

/// The module with those storage buffers among its tables that `wanted` names as storage texel buffers.
///
/// # Errors
/// A table that is used in any way besides reading entries and asking how many there are.
pub fn as_texels(words: &[u32], wanted: impl Fn(&str) -> bool) -> Result<Vec<u32>, SpirvError> {
    let whole = instructions(words)?;
    let mut found = Found::of(&whole);
    found.tables.retain(|_, (name, _)| wanted(name));
    if found.tables.is_empty() {
        return Ok(words.to_vec());
    }
    if words[3] > 0x1f_ffff || whole.len() > 0xf_ffff {
        return error("no numbers are left for new types");
    }
    let mut rewriting = Rewriting { bound: words[3], found, ..Rewriting::default() };
    let mut out = words[..5].to_vec();
    let mut need = vec![IMAGE_BUFFER];
    need.extend(
        rewriting
            .found
            .tables
            .values()
            .any(|(_, e)| e.format() == RG32F)
            .then_some(super::texture_to_storage::EXTENDED_FORMATS),
    );
    for capability in need {
        if !whole.iter().any(|i| i.opcode == 17 && i.operands == [capability]) {
            out.extend(instruction(17, &[capability]));
        }
    }
    for i in &whole {
        rewriting.rewrite(i.opcode, i.operands, &mut out)?;
    }
    out[3] = rewriting.bound;
    Ok(out)
}

#[derive(Default)]
struct Found {
    float: u32,
    /// Vector of four floats; 0 where there is none.
    four: u32,
    /// By variable: the table's name and what its entries are.
    tables: HashMap<u32, (String, Entry)>,
}

impl Found {
    fn of(whole: &[Instruction]) -> Found {
        let mut found = Found::default();
        let (mut names, mut read_only) = (HashMap::new(), Vec::new());
        let (mut vectors, mut arrays, mut structs, mut pointees) =
            (HashMap::new(), HashMap::new(), HashMap::new(), HashMap::new());
        for i in whole {
            let a = i.operands;
            match i.opcode {
                5 => drop(names.insert(a[0], text(&a[1..]))),
                71 if a[1] == super::texture_to_storage::NON_WRITABLE => read_only.push(a[0]),
                22 if a[1] == 32 => found.float = a[0],
                23 if a[1] == found.float => {
                    vectors.insert(a[0], a[2]);
                    if a[2] == 4 {
                        found.four = a[0];
                    }
                }
                29 if a.len() >= 2 => drop(arrays.insert(a[0], a[1])),
                30 if a.len() == 2 => drop(structs.insert(a[0], a[1])),
                32 => drop(pointees.insert(a[0], a[2])),
                // OpVariable in storage class StorageBuffer
                59 if a[2] == 12 && read_only.contains(&a[1]) => {
                    let member = pointees.get(&a[0]).and_then(|block| structs.get(block));
                    let Some(&is) = member.and_then(|array| arrays.get(array)) else { continue };
                    let components = match vectors.get(&is) {
                        Some(n) => *n,
                        None if is == found.float => 1,
                        None => continue,
                    };
                    let name = names.get(&a[1]).cloned().unwrap_or_default();
                    // Blocks that go by the name of their instance.
                    if matches!(components, 1 | 2 | 4) {
                        found.tables.insert(a[1], (name, Entry { is, components }));
                    }
                }
                _ => {}
            }
        }
        found
    }
}

/// An entry, or a component of it, that a module points at.
#[derive(Clone, Copy)]
struct Place {
    variable: u32,
    index: u32,
    component: Option<u32>,
}

#[derive(Default)]
struct Rewriting {
    bound: u32,
    found: Found,
    /// New types of an image and of a pointer to it, by the format.
    made: HashMap<u32, (u32, u32)>,
    places: HashMap<u32, Place>,
}

impl Rewriting {
    fn next_id(&mut self) -> u32 {
        self.bound += 1;
        self.bound - 1
    }

    fn rewrite(&mut self, opcode: u32, a: &[u32], out: &mut Vec<u32>) -> Result<(), SpirvError> {
        let table = |at: usize| a.get(at).and_then(|id| self.found.tables.get(id)).map(|(_, entry)| *entry);
        match opcode {
            // OpVariable
            59 if table(1).is_some() => {
                let pointer = self.declare(table(1).map_or(0, Entry::format), out);
                out.extend(instruction(opcode, &[pointer, a[1], 0]));
            }
            // OpAccessChain, of the one member an entry and perhaps a component
            65 if table(2).is_some() => {
                let (Some(&index), 5..=6) = (a.get(4), a.len()) else { return error("a table is read as a whole") };
                self.places.insert(a[1], Place { variable: a[2], index, component: a.get(5).copied() });
            }
            // OpLoad
            61 if a.len() >= 3 && self.places.contains_key(&a[2]) => self.load(a[0], a[1], a[2], out),
            // OpArrayLength: OpImageQuerySize
            68 if table(2).is_some() => {
                let image = self.image(a[2], out);
                out.extend(instruction(104, &[a[0], a[1], image]));
            }
            _ if self.points_at_table(opcode, a) => {
                return error(format!("operation {opcode} on a table that is to be texels"));
            }
            _ => out.extend(instruction(opcode, a)),
        }
        Ok(())
    }

    /// Whether an operand that is a pointer points at a table: loads of all of it, stores, calls, copies, choices.
    fn points_at_table(&self, opcode: u32, a: &[u32]) -> bool {
        let pointers = match opcode {
            61 | 65..=68 => a.get(2..3),
            62..=64 => a.get(..2),
            57 | 83 | 169 | 245 => a.get(2..),
            _ => None,
        };
        let is_table = |id: &u32| self.found.tables.contains_key(id) || self.places.contains_key(id);
        pointers.is_some_and(|p| p.iter().any(is_table))
    }

    /// Types of a texel buffer, declared once, and the pointer's. Vectors of four, which every texel is read as, too.
    fn declare(&mut self, format: u32, out: &mut Vec<u32>) -> u32 {
        if self.found.four == 0 {
            self.found.four = self.next_id();
            out.extend(instruction(23, &[self.found.four, self.found.float, 4]));
        }
        if let Some((_, pointer)) = self.made.get(&format) {
            return *pointer;
        }
        let (image, pointer) = (self.next_id(), self.next_id());
        // Dimension Buffer, no depth, not arrayed, not multisampled, storage.
        out.extend(instruction(25, &[image, self.found.float, 5, 0, 0, 0, 2, format]));
        out.extend(instruction(32, &[pointer, 0, image]));
        self.made.insert(format, (image, pointer));
        pointer
    }

    fn image(&mut self, variable: u32, out: &mut Vec<u32>) -> u32 {
        let format = self.found.tables[&variable].1.format();
        let of = self.made.get(&format).map_or(0, |made| made.0);
        let image = self.next_id();
        out.extend(instruction(61, &[of, image, variable]));
        image
    }

    fn load(&mut self, of: u32, result: u32, pointer: u32, out: &mut Vec<u32>) {
        let Place { variable, index, component } = self.places[&pointer];
        let entry = self.found.tables[&variable].1;
        let image = self.image(variable, out);
        // OpImageRead gives four components, those that the format has not 0 and 1.
        let texel = if entry.components == 4 && component.is_none() { result } else { self.next_id() };
        out.extend(instruction(98, &[self.found.four, texel, image, index]));
        match (component, entry.components) {
            // OpVectorExtractDynamic
            (Some(component), _) => out.extend(instruction(77, &[of, result, texel, component])),
            // OpCompositeExtract
            (None, 1) => out.extend(instruction(81, &[of, result, texel, 0])),
            // OpVectorShuffle
            (None, 2) => out.extend(instruction(79, &[of, result, texel, texel, 0, 1])),
            (None, _) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::{Access, Dimension, Kind, embedded, reflect, words};

    #[test]
    fn tables_become_texels_and_nothing_else_changes() {
        let before = words(embedded("raycast/volume.uneven_moved").unwrap());
        let mut names = tables(&before).unwrap();
        names.sort();
        assert_eq!(names, ["line_lut", "slice_table", "sweep_lut", "transfer"]);
        let after = as_texels(&before, |_| true).unwrap();
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
        let one = reflect(&as_texels(&before, |name| name == "transfer").unwrap()).unwrap();
        let of = |name: &str| one.bindings.iter().find(|b| b.name == name).unwrap();
        assert_eq!((of("transfer").kind, of("transfer").access), (Kind::Texels(4), Access::Read));
        assert_eq!((of("sweep_lut").kind, of("sweep_lut").dimension), (Kind::Buffer, Dimension::None));
    }

    #[test]
    fn structures_and_what_is_written_are_no_tables() {
        assert!(tables(&words(embedded("filter/sigma.slice").unwrap())).unwrap().is_empty());
        assert!(tables(&words(embedded("shade/light.plain").unwrap())).unwrap().is_empty());
    }

    #[test]
    fn a_broken_module_is_an_error() {
        let whole = words(embedded("raycast/volume.uneven").unwrap());
        for cut in 1..whole.len() {
            let _ = as_texels(&whole[..cut], |_| true);
        }
        for at in 3..whole.len() {
            let mut bent = whole.clone();
            bent[at] ^= 0x0003_0001;
            let _ = as_texels(&bent, |_| true);
        }
    }
}
