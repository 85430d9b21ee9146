//! Reflection: the bindings, parameters, constants and workgroup size that a SPIR-V module declares. Passes bind their
//! slots by these names, never by order. Only the instructions that this needs are read. A module that breaks the format is
//! an error, not a panic.

use super::module::{Op, SpirvError, decode, decoration, error, storage_class, text};
use std::collections::HashMap;

/// Name of the uniform block that holds the numbers of a pass.
const PARAMS: &str = "Params";

/// What kind of resource a binding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The uniform block with the parameters of a pass.
    Params,
    /// A texture read texel by texel, without a sampler.
    Sampled,
    /// A texture read through a linear sampler.
    Filtered,
    /// An image that is read or written without a sampler.
    Storage,
    /// A storage buffer.
    Buffer,
    /// A storage texel buffer; each texel has this many floats (1, 2 or 4).
    Texels(u32),
}

/// How a shader accesses a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    Read,
    Write,
    ReadWrite,
}

/// Dimensionality of an image binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    Two,
    /// An array of 2D images.
    Layers,
    Three,
    /// Not an image.
    None,
}

/// One resource that a module binds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    pub name: String,
    pub binding: u32,
    pub kind: Kind,
    pub access: Access,
    pub dimension: Dimension,
}

/// A member of the parameter block: a scalar, vector or array of 32-bit words. `offset` is in bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    pub name: String,
    pub offset: u32,
    pub components: u32,
    pub is_float: bool,
    pub(crate) is_signed: bool,
}

/// A specialization constant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constant {
    pub name: String,
    /// The constant's `constant_id` (`SpecId`).
    pub id: u32,
}

/// The interface of a shader module, by reflection.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Module {
    /// Bindings in the order of their binding numbers.
    pub bindings: Vec<Binding>,
    /// Members of the parameter block, the uniform block `Params`; empty if the module has none.
    pub params: Vec<Member>,
    /// Size of the parameter block up to the end of its last member, bytes; 0 if the module has no parameter block.
    pub params_size: u32,
    /// Specialization constants in the order of their ids.
    pub constants: Vec<Constant>,
    /// Invocations of a workgroup along x, y, z.
    pub local_size: [u32; 3],
}

/// Execution modes.
const LOCAL_SIZE: u32 = 17;
const LOCAL_SIZE_ID: u32 = 38;

#[derive(Clone, Debug)]
enum Type {
    /// Whether it is signed.
    Int(bool),
    Float,
    Vector(u32, u32),
    /// Element type, the constant with its length.
    Array(u32, u32),
    Image {
        dimension: u32,
        arrayed: bool,
        sampled: u32,
        format: u32,
    },
    SampledImage(u32),
    Struct(Vec<u32>),
    Pointer(u32),
}

/// What the instructions of a module declare, by identifier.
#[derive(Default)]
struct Declarations {
    names: HashMap<u32, String>,
    member_names: HashMap<(u32, u32), String>,
    offsets: HashMap<(u32, u32), u32>,
    /// By struct: how many of its members are read-only.
    read_only_members: HashMap<u32, u32>,
    bindings: HashMap<u32, u32>,
    constant_ids: HashMap<u32, u32>,
    /// Bytes from one element of an array to the next.
    strides: HashMap<u32, u32>,
    not_writable: Vec<u32>,
    not_readable: Vec<u32>,
    types: HashMap<u32, Type>,
    constants: HashMap<u32, u32>,
    /// Identifier, pointer type, storage class.
    variables: Vec<[u32; 3]>,
    local_size: [u32; 3],
    local_size_ids: Option<[u32; 3]>,
}

/// Reads the interface of a module.
///
/// # Errors
/// The module is invalid, or declares a binding or a parameter that this program supports in no shader.
pub fn reflect(words: &[u32]) -> Result<Module, SpirvError> {
    let mut declared = Declarations { local_size: [1; 3], ..Declarations::default() };
    for i in decode(words)? {
        declared.add(i.opcode, i.operands);
    }
    let mut module = Module { local_size: declared.local_size, ..Module::default() };
    if let Some(ids) = declared.local_size_ids {
        module.local_size = ids.map(|id| declared.constants.get(&id).copied().unwrap_or(1));
    }
    for (&id, &constant) in &declared.constant_ids {
        let name = declared.names.get(&id).cloned().unwrap_or_default();
        module.constants.push(Constant { name, id: constant });
    }
    module.constants.sort_by_key(|c| c.id);
    for variable in &declared.variables {
        if let Some(binding) = declared.bindings.get(&variable[0]) {
            declared.add_binding(&mut module, *variable, *binding)?;
        }
    }
    module.bindings.sort_by_key(|b| b.binding);
    Ok(module)
}

impl Declarations {
    fn add(&mut self, opcode: Op, a: &[u32]) {
        match opcode {
            Op::Name => drop(self.names.insert(a[0], text(&a[1..]))),
            Op::MemberName => drop(self.member_names.insert((a[0], a[1]), text(&a[2..]))),
            Op::ExecutionMode if a[1] == LOCAL_SIZE && a.len() >= 5 => self.local_size = [a[2], a[3], a[4]],
            Op::ExecutionModeId if a[1] == LOCAL_SIZE_ID && a.len() >= 5 => {
                self.local_size_ids = Some([a[2], a[3], a[4]]);
            }
            Op::TypeInt => drop(self.types.insert(a[0], Type::Int(a.get(2) == Some(&1)))),
            Op::TypeFloat => drop(self.types.insert(a[0], Type::Float)),
            Op::TypeVector => drop(self.types.insert(a[0], Type::Vector(a[1], a[2]))),
            Op::TypeArray => drop(self.types.insert(a[0], Type::Array(a[1], a[2]))),
            Op::TypeImage => {
                let image = Type::Image { dimension: a[2], arrayed: a[4] == 1, sampled: a[6], format: a[7] };
                self.types.insert(a[0], image);
            }
            Op::TypeSampledImage => drop(self.types.insert(a[0], Type::SampledImage(a[1]))),
            Op::TypeStruct => drop(self.types.insert(a[0], Type::Struct(a[1..].to_vec()))),
            Op::TypePointer => drop(self.types.insert(a[0], Type::Pointer(a[2]))),
            Op::Constant | Op::SpecConstant => drop(self.constants.insert(a[1], a[2])),
            Op::Variable => self.variables.push([a[1], a[0], a[2]]),
            Op::Decorate => match (a[1], a.get(2)) {
                (decoration::BINDING, Some(&binding)) => drop(self.bindings.insert(a[0], binding)),
                (decoration::SPEC_ID, Some(&id)) => drop(self.constant_ids.insert(a[0], id)),
                (decoration::ARRAY_STRIDE, Some(&stride)) => drop(self.strides.insert(a[0], stride)),
                (decoration::NON_WRITABLE, _) => self.not_writable.push(a[0]),
                (decoration::NON_READABLE, _) => self.not_readable.push(a[0]),
                _ => {}
            },
            Op::MemberDecorate => match (a[2], a.get(3)) {
                (decoration::OFFSET, Some(&offset)) => drop(self.offsets.insert((a[0], a[1]), offset)),
                (decoration::NON_WRITABLE, _) => *self.read_only_members.entry(a[0]).or_default() += 1,
                _ => {}
            },
            _ => {}
        }
    }

    /// Adds a variable, whose identifier, pointer type and storage class are given, to the bindings of the module.
    fn add_binding(&self, module: &mut Module, variable: [u32; 3], binding: u32) -> Result<(), SpirvError> {
        let [id, pointer, storage] = variable;
        let Some(&Type::Pointer(pointee)) = self.types.get(&pointer) else {
            return error(format!("variable {id} is not a pointer"));
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
            // Dimension Buffer (5), in a format that lookup tables have: R32f, Rg32f, Rgba32f.
            Some(Type::Image { dimension: 5, sampled: 2, format, .. }) => {
                let components = match format {
                    3 => 1,
                    6 => 2,
                    1 => 4,
                    _ => return error(format!("the format of texel buffer '{name}' is not one of a lookup table")),
                };
                (Kind::Texels(components), declared, Dimension::None)
            }
            Some(Type::Image { sampled: 1, .. }) => (Kind::Sampled, Access::Read, shape(&pointee)),
            Some(Type::Image { .. }) => (Kind::Storage, declared, shape(&pointee)),
            Some(Type::Struct(members)) if storage == storage_class::UNIFORM => {
                name = self.names.get(&pointee).cloned().unwrap_or_default();
                if name != PARAMS {
                    return error(format!("uniform block '{name}': the numbers of a pass must be in '{PARAMS}'"));
                }
                self.add_params(module, pointee, members)?;
                (Kind::Params, Access::Read, Dimension::None)
            }
            Some(Type::Struct(members)) => {
                let all_read_only = self.read_only_members.get(&pointee).copied() == Some(members.len() as u32);
                (Kind::Buffer, if all_read_only { Access::Read } else { declared }, Dimension::None)
            }
            _ => return error(format!("binding '{name}' has an unsupported type")),
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
                // Without gaps, as the scalar layout has them.
                Some(Type::Array(scalar, length)) if self.strides.get(member) == Some(&4) => {
                    (self.types.get(scalar), self.constants.get(length).copied().unwrap_or(0))
                }
                scalar => (scalar, 1),
            };
            let (is_float, is_signed) = match scalar {
                Some(Type::Float) => (true, true),
                Some(Type::Int(signed)) => (false, *signed),
                _ => {
                    return error(format!(
                        "parameter '{name}' is neither a scalar nor a vector, nor an array of scalars without gaps"
                    ));
                }
            };
            let Some(&offset) = self.offsets.get(&key) else {
                return error(format!("parameter '{name}' has no offset"));
            };
            // Every device allows at least this size for a uniform block.
            let Some(end) = components.checked_mul(4).and_then(|size| size.checked_add(offset)).filter(|e| *e <= 16384)
            else {
                return error(format!("parameter '{name}' ends after 16384 bytes"));
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
    use crate::spirv::module::{embedded, malformed, words};

    #[test]
    fn reflection_reads_names_types_offsets_and_workgroup() {
        let module = reflect(&words(embedded("filter/sigma.slice").unwrap())).unwrap();
        assert_eq!(module.local_size, [8, 8, 1]);
        let constants = [("RADIUS", 0), ("MULTIPLICATIVE", 1), ("TILED", 2), ("LAYERED", 40)]
            .map(|(name, id)| Constant { name: name.into(), id });
        assert_eq!(module.constants, constants);
        let names: Vec<_> = module.params.iter().map(|p| (p.name.as_str(), p.offset, p.is_float)).collect();
        assert_eq!(
            names,
            [
                ("range", 0, true),
                ("tie", 4, true),
                ("few", 8, true),
                ("slice", 12, false),
                ("first_column", 16, false),
                ("first_row", 20, false),
                ("end_column", 24, false),
                ("end_row", 28, false),
                ("first_stored_column", 32, false),
                ("first_stored_row", 36, false),
                ("first_stored_slice", 40, false)
            ]
        );
        let gaussian = reflect(&words(embedded("filter/gaussian").unwrap())).unwrap();
        let weights = gaussian.params.iter().find(|p| p.name == "weights").unwrap();
        assert!(weights.components == 97 && weights.is_float, "{weights:?}");
        let target = module.bindings.iter().find(|b| b.name == "target").unwrap();
        assert_eq!((target.kind, target.access, target.dimension), (Kind::Storage, Access::Write, Dimension::Three));
        let source = module.bindings.iter().find(|b| b.name == "source").unwrap();
        assert_eq!((source.kind, source.dimension), (Kind::Sampled, Dimension::Layers));
    }

    #[test]
    fn a_malformed_module_is_an_error_and_not_a_panic() {
        assert!(reflect(&[]).is_err());
        malformed(|words, _, _| reflect(words).is_ok());
    }
}
