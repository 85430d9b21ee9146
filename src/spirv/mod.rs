//! Reflection: what a SPIR-V module says of its bindings, parameters, constants and workgroup. The passes are bound by these
//! names, never by order. Reads only the instructions it needs; a module that breaks the format is an error, not a panic.

use std::collections::HashMap;

pub mod hoist_uniforms;
pub mod mutate;
pub mod strip_bindings;
pub mod tables;
pub mod texture_to_storage;

/// Every shader, embedded: name and variant, and its words as bytes.
pub const EMBEDDED: &[(&str, &[u8])] = include!("../../spirv/embedded.rs");

/// Name of the uniform block that holds a pass's numbers.
pub const PARAMS: &str = "Params";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Numbers of the pass.
    Params,
    /// Read by texel, no sampler.
    Sampled,
    /// Read through a linear sampler.
    Filtered,
    Storage,
    Buffer,
    /// A buffer read by texels of so many floats.
    Texels(u32),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    Read,
    Write,
    ReadWrite,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    Two,
    Layers,
    Three,
    None,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    pub name: String,
    pub binding: u32,
    pub kind: Kind,
    pub access: Access,
    pub dimension: Dimension,
}

/// A scalar or vector of 32-bit words in the parameter block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    pub name: String,
    pub offset: u32,
    pub components: u32,
    pub is_float: bool,
    pub is_signed: bool,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constant {
    pub name: String,
    pub id: u32,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Module {
    pub bindings: Vec<Binding>,
    pub params: Vec<Member>,
    /// Bytes of the parameter block.
    pub params_size: u32,
    pub constants: Vec<Constant>,
    pub local_size: [u32; 3],
}

#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("SPIR-V: {0}")]
pub struct SpirvError(String);

#[derive(Clone, Debug)]
enum Type {
    Int { signed: bool },
    Float,
    Vector(u32, u32),
    Image { dimension: u32, arrayed: bool, sampled: u32, format: u32 },
    SampledImage(u32),
    Struct(Vec<u32>),
    Pointer(u32),
    Other,
}

#[derive(Default)]
struct Tables {
    names: HashMap<u32, String>,
    member_names: HashMap<(u32, u32), String>,
    offsets: HashMap<(u32, u32), u32>,
    member_read_only: HashMap<u32, u32>,
    bindings: HashMap<u32, u32>,
    constant_ids: HashMap<u32, u32>,
    not_writable: Vec<u32>,
    not_readable: Vec<u32>,
    types: HashMap<u32, Type>,
    constants: HashMap<u32, u32>,
    variables: Vec<(u32, u32, u32)>,
    local_size: [u32; 3],
    local_size_ids: Option<[u32; 3]>,
}

/// The words of a module.
pub fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// The embedded shader of that name.
pub fn embedded(name: &str) -> Option<&'static [u8]> {
    EMBEDDED.iter().find(|(n, _)| *n == name).map(|(_, bytes)| *bytes)
}

pub fn reflect(words: &[u32]) -> Result<Module, SpirvError> {
    let tables = scan(words)?;
    let mut module = Module { local_size: tables.local_size, ..Module::default() };
    if let Some(ids) = tables.local_size_ids {
        module.local_size = ids.map(|id| tables.constants.get(&id).copied().unwrap_or(1));
    }
    for (&id, &constant) in &tables.constant_ids {
        let name = tables.names.get(&id).cloned().unwrap_or_default();
        module.constants.push(Constant { name, id: constant });
    }
    module.constants.sort_by_key(|c| c.id);
    for &(id, pointer, storage) in &tables.variables {
        if let Some(binding) = tables.bindings.get(&id) {
            tables.add_binding(&mut module, id, pointer, storage, *binding)?;
        }
    }
    module.bindings.sort_by_key(|b| b.binding);
    Ok(module)
}

fn error<T>(fault: impl Into<String>) -> Result<T, SpirvError> {
    Err(SpirvError(fault.into()))
}

fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|b| *b != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// One instruction: its number in the SPIR-V 1.5 specification and what follows.
struct Instruction<'a> {
    opcode: u32,
    operands: &'a [u32],
}

/// Every instruction, each with the least operands that the code here takes for granted.
fn instructions(words: &[u32]) -> Result<Vec<Instruction<'_>>, SpirvError> {
    if words.len() < 5 || words[0] != 0x0723_0203 {
        return error("no SPIR-V module");
    }
    let mut all = Vec::new();
    let mut at = 5;
    while at < words.len() {
        let length = (words[at] >> 16) as usize;
        let Some(instruction) = words.get(at..at + length).filter(|i| !i.is_empty()) else {
            return error(format!("instruction at word {at} runs past the end"));
        };
        let (opcode, operands) = (words[at] & 0xffff, &instruction[1..]);
        let needed = match opcode {
            5 | 19 | 20 | 26 | 30 => 1,
            6 | 16 | 21 | 22 | 27 | 54 | 71 => 2,
            23 | 32 | 43 | 50 | 59 | 72 | 103 => 3,
            88 | 95 => 4,
            25 => 8,
            331 => 2,
            _ => 0,
        };
        if operands.len() < needed {
            return error(format!("instruction at word {at} is cut short"));
        }
        all.push(Instruction { opcode, operands });
        at += length;
    }
    Ok(all)
}

fn scan(words: &[u32]) -> Result<Tables, SpirvError> {
    let mut tables = Tables { local_size: [1; 3], ..Tables::default() };
    for i in instructions(words)? {
        tables.take(i.opcode, i.operands);
    }
    Ok(tables)
}

impl Tables {
    /// One instruction, by its opcode in the SPIR-V 1.5 specification.
    fn take(&mut self, opcode: u32, a: &[u32]) {
        match opcode {
            5 => drop(self.names.insert(a[0], text(&a[1..]))), // OpName
            6 => drop(self.member_names.insert((a[0], a[1]), text(&a[2..]))), // OpMemberName
            16 if a[1] == 17 && a.len() >= 5 => self.local_size = [a[2], a[3], a[4]], // OpExecutionMode LocalSize
            331 if a[1] == 38 && a.len() >= 5 => self.local_size_ids = Some([a[2], a[3], a[4]]), // LocalSizeId
            21 => drop(self.types.insert(a[0], Type::Int { signed: a.get(2) == Some(&1) })),
            22 => drop(self.types.insert(a[0], Type::Float)),
            23 => drop(self.types.insert(a[0], Type::Vector(a[1], a[2]))),
            25 => {
                let image = Type::Image { dimension: a[2], arrayed: a[4] == 1, sampled: a[6], format: a[7] };
                self.types.insert(a[0], image);
            }
            27 => drop(self.types.insert(a[0], Type::SampledImage(a[1]))),
            30 => drop(self.types.insert(a[0], Type::Struct(a[1..].to_vec()))),
            32 => drop(self.types.insert(a[0], Type::Pointer(a[2]))),
            19 | 20 | 26 | 28 | 29 if !a.is_empty() => drop(self.types.insert(a[0], Type::Other)),
            43 | 50 => drop(self.constants.insert(a[1], a[2])), // OpConstant, OpSpecConstant
            59 => self.variables.push((a[1], a[0], a[2])),      // OpVariable
            71 => match (a[1], a.get(2)) {
                (33, Some(&binding)) => drop(self.bindings.insert(a[0], binding)),
                (1, Some(&id)) => drop(self.constant_ids.insert(a[0], id)),
                (24, _) => self.not_writable.push(a[0]),
                (25, _) => self.not_readable.push(a[0]),
                _ => {}
            },
            72 => match (a[2], a.get(3)) {
                (35, Some(&offset)) => drop(self.offsets.insert((a[0], a[1]), offset)),
                (24, _) => *self.member_read_only.entry(a[0]).or_default() += 1,
                _ => {}
            },
            _ => {}
        }
    }

    fn add_binding(
        &self,
        module: &mut Module,
        id: u32,
        pointer: u32,
        storage: u32,
        binding: u32,
    ) -> Result<(), SpirvError> {
        let Some(&Type::Pointer(pointee)) = self.types.get(&pointer) else {
            return error(format!("variable {id} is no pointer"));
        };
        let mut name = self.names.get(&id).cloned().unwrap_or_default();
        let declared = if self.not_writable.contains(&id) {
            Access::Read
        } else if self.not_readable.contains(&id) {
            Access::Write
        } else {
            Access::ReadWrite
        };
        let shape = |id: &u32| match self.types.get(id) {
            Some(Type::Image { dimension: 1, arrayed: false, .. }) => Dimension::Two,
            Some(Type::Image { dimension: 1, arrayed: true, .. }) => Dimension::Layers,
            Some(Type::Image { dimension: 2, .. }) => Dimension::Three,
            _ => Dimension::None,
        };
        let (kind, access, dimension) = match self.types.get(&pointee) {
            Some(Type::SampledImage(image)) => (Kind::Filtered, Access::Read, shape(image)),
            // Dimension Buffer, in one of the formats that tables have: R32f, Rg32f, Rgba32f.
            Some(Type::Image { dimension: 5, sampled: 2, format, .. }) => {
                let components = match format {
                    3 => 1,
                    6 => 2,
                    1 => 4,
                    _ => return error(format!("'{name}' is a texel buffer of a format that no table has")),
                };
                (Kind::Texels(components), declared, Dimension::None)
            }
            Some(Type::Image { sampled: 1, .. }) => (Kind::Sampled, Access::Read, shape(&pointee)),
            Some(Type::Image { .. }) => (Kind::Storage, declared, shape(&pointee)),
            Some(Type::Struct(members)) if storage == 2 => {
                name = self.names.get(&pointee).cloned().unwrap_or_default();
                if name != PARAMS {
                    return error(format!("uniform block '{name}': numbers of a pass live in '{PARAMS}'"));
                }
                self.add_params(module, pointee, members)?;
                (Kind::Params, Access::Read, Dimension::None)
            }
            Some(Type::Struct(members)) => {
                let all_read_only = self.member_read_only.get(&pointee).copied() == Some(members.len() as u32);
                (Kind::Buffer, if all_read_only { Access::Read } else { declared }, Dimension::None)
            }
            _ => return error(format!("binding '{name}' has a type that no pass uses")),
        };
        module.bindings.push(Binding { name, binding, kind, access, dimension });
        Ok(())
    }

    fn add_params(&self, module: &mut Module, block: u32, members: &[u32]) -> Result<(), SpirvError> {
        for (i, member) in members.iter().enumerate() {
            let key = (block, i as u32);
            let name = self.member_names.get(&key).cloned().unwrap_or_default();
            let (scalar, components) = match self.types.get(member) {
                Some(Type::Vector(scalar, n)) => (self.types.get(scalar), *n),
                scalar => (scalar, 1),
            };
            let (is_float, is_signed) = match scalar {
                Some(Type::Float) => (true, true),
                Some(Type::Int { signed }) => (false, *signed),
                _ => return error(format!("parameter '{name}' is neither a scalar nor a vector")),
            };
            let Some(&offset) = self.offsets.get(&key) else {
                return error(format!("parameter '{name}' has no offset"));
            };
            // The least that every device allows for a uniform block.
            let Some(end) = components.checked_mul(4).and_then(|size| size.checked_add(offset)).filter(|e| *e <= 16384)
            else {
                return error(format!("parameter '{name}' lies beyond 16384 bytes"));
            };
            module.params_size = module.params_size.max(end);
            module.params.push(Member { name, offset, components, is_float, is_signed });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_module_tells_its_names_types_offsets_and_workgroup() {
        let module = reflect(&words(embedded("filter/sigma.slice").unwrap())).unwrap();
        assert_eq!(module.local_size, [8, 8, 1]);
        let constants = [("RADIUS", 0), ("MULTIPLICATIVE", 1)].map(|(name, id)| Constant { name: name.into(), id });
        assert_eq!(module.constants, constants);
        let names: Vec<_> = module.params.iter().map(|p| (p.name.as_str(), p.offset, p.is_float)).collect();
        assert_eq!(
            names,
            [
                ("range", 0, true),
                ("few", 4, true),
                ("slice", 8, false),
                ("first_column", 12, false),
                ("first_row", 16, false)
            ]
        );
        let target = module.bindings.iter().find(|b| b.name == "target").unwrap();
        assert_eq!((target.kind, target.access, target.dimension), (Kind::Storage, Access::Write, Dimension::Three));
        let source = module.bindings.iter().find(|b| b.name == "source").unwrap();
        assert_eq!((source.kind, source.dimension), (Kind::Sampled, Dimension::Two));
    }

    #[test]
    fn a_broken_module_is_an_error_wherever_it_breaks() {
        let whole = words(embedded("raycast/surface.moved").unwrap());
        assert!(reflect(&[]).is_err());
        for cut in 1..whole.len() {
            let _ = reflect(&whole[..cut]);
        }
        for at in 5..whole.len() {
            let mut bent = whole.clone();
            bent[at] ^= 0x0003_0001;
            let _ = reflect(&bent);
        }
    }
}
