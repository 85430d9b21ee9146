//! A SPIR-V module as words: the embedded shaders, and the decoding and encoding of instructions. Operations are those of the
//! SPIR-V specification, whose registry the crate `spirv` is made from.

pub(super) use ::spirv::{Capability, ImageFormat, Op};
use std::collections::HashMap;

/// Every embedded shader: its path below glsl/ with its variant, and its words as bytes.
pub const EMBEDDED: &[(&str, &[u8])] = include!("../../../spirv/embedded.rs");

/// Numbers of SPIR-V decorations.
pub(super) mod decoration {
    use ::spirv::Decoration;

    pub(crate) const SPEC_ID: u32 = Decoration::SpecId as u32;
    pub(crate) const NON_WRITABLE: u32 = Decoration::NonWritable as u32;
    pub(crate) const NON_READABLE: u32 = Decoration::NonReadable as u32;
    pub const BINDING: u32 = Decoration::Binding as u32;
    pub(crate) const OFFSET: u32 = Decoration::Offset as u32;
    pub(crate) const ARRAY_STRIDE: u32 = Decoration::ArrayStride as u32;
}

/// Numbers of SPIR-V storage classes.
pub(super) mod storage_class {
    use ::spirv::StorageClass;

    pub(crate) const UNIFORM_CONSTANT: u32 = StorageClass::UniformConstant as u32;
    pub(crate) const UNIFORM: u32 = StorageClass::Uniform as u32;
    pub const STORAGE_BUFFER: u32 = StorageClass::StorageBuffer as u32;
}

/// The largest bound of identifiers that every consumer of SPIR-V accepts.
pub(super) const MAX_BOUND: u32 = 0x3f_ffff;
/// Number of words in a module's header; word 3 is the bound of its identifiers.
pub(super) const HEADER_WORDS: usize = 5;
pub(super) const BOUND: usize = 3;

/// A new identifier of the module that is being written. Its header has the bound.
pub(super) fn next_id(out: &mut [u32]) -> u32 {
    out[BOUND] += 1;
    out[BOUND] - 1
}

/// One line for each shader: the SHA-256, in hexadecimal, of compiler options, macros and expanded source, then the shader's name in [`EMBEDDED`].
pub const SOURCES: &str = include_str!("../../../spirv/SOURCES");

/// Word of a module's header that names the tool that made it; the lower half is the tool's version.
const GENERATOR: usize = 2;

/// Changes the tool version in the header of a module, which does not affect the code, but invalidates the driver's cache entry. `number`, of which
/// 15 bits count, must differ between runs of the program.
pub fn set_tool_version(words: &mut [u32], number: u16) {
    if let Some(word) = words.get_mut(GENERATOR) {
        // Versions from 0x8000 on are later than any that a driver works around.
        *word = (*word & 0xffff_0000) | 0x8000 | u32::from(number);
    }
}

/// Why a module is invalid, or cannot be rewritten: one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("SPIR-V: {0}")]
pub struct SpirvError(String);

/// Decodes the words of a module from little-endian bytes. Bytes after the last whole word are left out.
pub fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// The bytes of the embedded shader with this name in [`EMBEDDED`]. None if there is no such shader.
pub fn embedded(name: &str) -> Option<&'static [u8]> {
    EMBEDDED.iter().find(|(n, _)| *n == name).map(|(_, bytes)| *bytes)
}

/// Test helper: `read` must not panic on malformed modules. They are small modules, and a ray caster at some of its words (the time grows with the
/// square of the length), cut before a word and with that word changed. `read` gets the words, a texture and a table of the module, and returns
/// whether it read them.
#[cfg(test)]
pub(super) fn malformed(read: impl Fn(&[u32], &str, &str) -> bool) {
    let modules = [
        ("measure/positions", "volume", "nothing", 1),
        ("preprocess/condition", "frames", "tgc", 1),
        ("raycast/planes.plain", "volume", "sweep_lut", 24),
    ];
    for (name, texture, other, every) in modules {
        let intact = words(embedded(name).expect("a shader"));
        assert!(read(&intact, texture, other), "{name}");
        for at in (1..intact.len()).step_by(every) {
            read(&intact[..at], texture, other);
            let mut corrupted = intact.clone();
            corrupted[at] ^= 0x0003_0001;
            read(&corrupted, texture, other);
        }
    }
}

pub(super) fn error<T>(fault: impl Into<String>) -> Result<T, SpirvError> {
    Err(SpirvError(fault.into()))
}

/// Decodes a literal string: UTF-8, terminated by a zero byte.
pub(super) fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|b| *b != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// One instruction: its opcode and its operands.
pub(super) struct Instruction<'a> {
    pub opcode: Op,
    pub operands: &'a [u32],
}

/// Decodes every instruction of a module. Each has at least the operands that this crate indexes without a check.
///
/// # Errors
/// The module is invalid.
pub(super) fn decode(words: &[u32]) -> Result<Vec<Instruction<'_>>, SpirvError> {
    if words.len() < HEADER_WORDS || words[0] != 0x0723_0203 {
        return error("not a SPIR-V module");
    }
    let mut instructions = Vec::new();
    let mut at = HEADER_WORDS;
    while at < words.len() {
        let length = (words[at] >> 16) as usize;
        let Some(instruction) = words.get(at..at + length).filter(|i| !i.is_empty()) else {
            return error(format!("the instruction at word {at} runs past the end"));
        };
        let operands = &instruction[1..];
        let Some(opcode) = Op::from_u32(words[at] & 0xffff) else {
            return error(format!("the instruction at word {at} is none of the specification"));
        };
        let required = match opcode {
            Op::Name | Op::TypeVoid | Op::TypeBool | Op::TypeSampler | Op::TypeStruct => 1,
            Op::MemberName
            | Op::ExecutionMode
            | Op::TypeInt
            | Op::TypeFloat
            | Op::TypeSampledImage
            | Op::Function
            | Op::Decorate
            | Op::ExecutionModeId => 2,
            Op::TypeVector
            | Op::TypeArray
            | Op::TypePointer
            | Op::Constant
            | Op::SpecConstant
            | Op::Variable
            | Op::MemberDecorate
            | Op::ImageQuerySizeLod => 3,
            Op::ImageSampleExplicitLod | Op::ImageFetch => 4,
            Op::TypeImage => 8,
            _ => 0,
        };
        if operands.len() < required {
            return error(format!("the instruction at word {at} is too short"));
        }
        instructions.push(Instruction { opcode, operands });
        at += length;
    }
    Ok(instructions)
}

/// True for instructions on images: samples, fetches, reads, writes and queries.
pub(super) fn is_of_images(opcode: Op) -> bool {
    (Op::SampledImage..=Op::ImageQuerySamples).contains(&opcode)
}

/// Declares a capability at the beginning of the module that is being written, unless `instructions` declare it.
pub(super) fn require(capability: Capability, instructions: &[Instruction], out: &mut Vec<u32>) {
    let operands = [capability as u32];
    if !instructions.iter().any(|i| i.opcode == Op::Capability && i.operands == operands) {
        out.extend(encode(Op::Capability, &operands));
    }
}

/// The types of storage images that were declared, each with the type of its pointers.
#[derive(Default)]
pub(super) struct StorageImages(HashMap<Vec<u32>, [u32; 2]>);

impl StorageImages {
    /// The type of a storage image and that of pointers to it, which are declared once. `shape`: the operands of the image type after its identifier,
    /// without usage and format.
    pub(super) fn declare(&mut self, shape: &[u32], format: ImageFormat, out: &mut Vec<u32>) -> [u32; 2] {
        // Used as storage (2).
        let key = [shape, &[2, format as u32]].concat();
        *self.0.entry(key).or_insert_with_key(|operands| {
            let (image, pointer) = (next_id(out), next_id(out));
            out.extend(encode(Op::TypeImage, &[&[image], operands.as_slice()].concat()));
            out.extend(encode(Op::TypePointer, &[pointer, 0, image]));
            [image, pointer]
        })
    }
}

/// Encodes one instruction.
pub(super) fn encode(opcode: Op, operands: &[u32]) -> Vec<u32> {
    let mut words = vec![(operands.len() as u32 + 1) << 16 | opcode as u32];
    words.extend_from_slice(operands);
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A driver looks compiled shaders up by their words: another number is another shader to it, and means the same.
    #[test]
    fn another_tool_version_changes_one_word_and_no_meaning() {
        for (name, bytes) in EMBEDDED {
            let before = words(bytes);
            let [one, two] = [1, 2].map(|number| {
                let mut words = before.clone();
                set_tool_version(&mut words, number);
                words
            });
            assert_ne!(one, two, "{name}");
            for marked in [one, two] {
                assert_eq!((&marked[..2], &marked[3..]), (&before[..2], &before[3..]), "{name}");
                // The tool itself stays: drivers know faults of some.
                assert_eq!(marked[2] >> 16, before[2] >> 16, "{name}");
                assert!(super::super::reflect(&marked).is_ok(), "{name}");
            }
        }
    }
}
