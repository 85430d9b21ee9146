//! A SPIR-V module as words: the embedded shaders, and the decoding and encoding of instructions. Numbers are those of the
//! SPIR-V 1.5 specification.

/// Every embedded shader: its name and variant, and its words as bytes.
pub const EMBEDDED: &[(&str, &[u8])] = include!("../../../spirv/embedded.rs");

/// Opcodes.
pub(super) mod op {
    pub(crate) const UNDEF: u32 = 1;
    pub const NAME: u32 = 5;
    pub(crate) const MEMBER_NAME: u32 = 6;
    pub const LINE: u32 = 8;
    pub(crate) const EXT_INST: u32 = 12;
    pub(crate) const ENTRY_POINT: u32 = 15;
    pub(crate) const EXECUTION_MODE: u32 = 16;
    pub const CAPABILITY: u32 = 17;
    pub(crate) const TYPE_VOID: u32 = 19;
    pub(crate) const TYPE_BOOL: u32 = 20;
    pub(crate) const TYPE_INT: u32 = 21;
    pub(crate) const TYPE_FLOAT: u32 = 22;
    pub(crate) const TYPE_VECTOR: u32 = 23;
    pub(crate) const TYPE_IMAGE: u32 = 25;
    pub(crate) const TYPE_SAMPLER: u32 = 26;
    pub(crate) const TYPE_SAMPLED_IMAGE: u32 = 27;
    pub(crate) const TYPE_ARRAY: u32 = 28;
    pub(crate) const TYPE_RUNTIME_ARRAY: u32 = 29;
    pub(crate) const TYPE_STRUCT: u32 = 30;
    pub(crate) const TYPE_POINTER: u32 = 32;
    pub(crate) const CONSTANT_TRUE: u32 = 41;
    pub(crate) const CONSTANT_FALSE: u32 = 42;
    pub const CONSTANT: u32 = 43;
    pub(crate) const CONSTANT_COMPOSITE: u32 = 44;
    pub(crate) const SPEC_CONSTANT: u32 = 50;
    pub(crate) const SPEC_CONSTANT_COMPOSITE: u32 = 51;
    pub(crate) const SPEC_CONSTANT_OP: u32 = 52;
    pub(crate) const FUNCTION: u32 = 54;
    pub(crate) const FUNCTION_END: u32 = 56;
    pub(crate) const FUNCTION_CALL: u32 = 57;
    pub const VARIABLE: u32 = 59;
    pub const LOAD: u32 = 61;
    pub const STORE: u32 = 62;
    pub(crate) const COPY_MEMORY_SIZED: u32 = 64;
    pub(crate) const ACCESS_CHAIN: u32 = 65;
    pub(crate) const IN_BOUNDS_ACCESS_CHAIN: u32 = 66;
    pub(crate) const PTR_ACCESS_CHAIN: u32 = 67;
    pub(crate) const ARRAY_LENGTH: u32 = 68;
    pub(crate) const DECORATE: u32 = 71;
    pub(crate) const MEMBER_DECORATE: u32 = 72;
    pub(crate) const VECTOR_EXTRACT_DYNAMIC: u32 = 77;
    pub(crate) const VECTOR_SHUFFLE: u32 = 79;
    pub(crate) const COMPOSITE_CONSTRUCT: u32 = 80;
    pub(crate) const COMPOSITE_EXTRACT: u32 = 81;
    pub(crate) const COPY_OBJECT: u32 = 83;
    pub(crate) const TRANSPOSE: u32 = 84;
    pub const SAMPLED_IMAGE: u32 = 86;
    pub(crate) const IMAGE_SAMPLE_EXPLICIT_LOD: u32 = 88;
    pub(crate) const IMAGE_FETCH: u32 = 95;
    pub(crate) const IMAGE_READ: u32 = 98;
    pub(crate) const IMAGE_WRITE: u32 = 99;
    pub const IMAGE: u32 = 100;
    pub(crate) const IMAGE_QUERY_SIZE_LOD: u32 = 103;
    pub(crate) const IMAGE_QUERY_SIZE: u32 = 104;
    pub(crate) const IMAGE_QUERY_SAMPLES: u32 = 107;
    pub(crate) const CONVERT_F_TO_U: u32 = 109;
    pub(crate) const QUANTIZE_TO_F16: u32 = 116;
    pub(crate) const BITCAST: u32 = 124;
    pub(crate) const S_NEGATE: u32 = 126;
    pub(crate) const I_ADD: u32 = 128;
    pub const F_ADD: u32 = 129;
    pub(crate) const I_SUB: u32 = 130;
    pub const F_SUB: u32 = 131;
    pub(crate) const I_MUL: u32 = 132;
    pub(crate) const F_MUL: u32 = 133;
    pub(crate) const S_DIV: u32 = 135;
    pub(crate) const F_DIV: u32 = 136;
    pub(crate) const VECTOR_TIMES_SCALAR: u32 = 142;
    pub(crate) const S_MUL_EXTENDED: u32 = 152;
    pub const ANY: u32 = 154;
    pub(crate) const LOGICAL_OR: u32 = 166;
    pub(crate) const LOGICAL_AND: u32 = 167;
    pub(crate) const LOGICAL_NOT: u32 = 168;
    pub(crate) const SELECT: u32 = 169;
    pub(crate) const I_EQUAL: u32 = 170;
    pub(crate) const I_NOT_EQUAL: u32 = 171;
    pub(crate) const S_GREATER_THAN: u32 = 173;
    pub(crate) const S_GREATER_THAN_EQUAL: u32 = 175;
    pub(crate) const S_LESS_THAN: u32 = 177;
    pub(crate) const S_LESS_THAN_EQUAL: u32 = 179;
    pub(crate) const F_UNORD_GREATER_THAN_EQUAL: u32 = 191;
    pub(crate) const SHIFT_RIGHT_LOGICAL: u32 = 194;
    pub(crate) const BIT_COUNT: u32 = 205;
    pub(crate) const PHI: u32 = 245;
    pub(crate) const LOOP_MERGE: u32 = 246;
    pub(crate) const SELECTION_MERGE: u32 = 247;
    pub(crate) const LABEL: u32 = 248;
    pub(crate) const BRANCH: u32 = 249;
    pub(crate) const BRANCH_CONDITIONAL: u32 = 250;
    pub(crate) const SWITCH: u32 = 251;
    pub const KILL: u32 = 252;
    pub const RETURN: u32 = 253;
    pub(crate) const RETURN_VALUE: u32 = 254;
    pub(crate) const UNREACHABLE: u32 = 255;
    pub(crate) const NO_LINE: u32 = 317;
    pub(crate) const EXECUTION_MODE_ID: u32 = 331;
}

/// Decorations.
pub(super) mod decoration {
    pub(crate) const SPEC_ID: u32 = 1;
    pub(crate) const NON_WRITABLE: u32 = 24;
    pub(crate) const NON_READABLE: u32 = 25;
    pub const BINDING: u32 = 33;
    pub(crate) const OFFSET: u32 = 35;
    pub(crate) const ARRAY_STRIDE: u32 = 6;
}

/// Capabilities.
pub(super) mod capability {
    pub(crate) const IMAGE_BUFFER: u32 = 47;
    pub(crate) const STORAGE_IMAGE_EXTENDED_FORMATS: u32 = 49;
}

/// Storage classes.
pub(super) mod storage_class {
    pub(crate) const UNIFORM_CONSTANT: u32 = 0;
    pub(crate) const UNIFORM: u32 = 2;
    pub const STORAGE_BUFFER: u32 = 12;
}

/// The upper limit of identifiers that every consumer of SPIR-V accepts.
pub(super) const MAX_BOUND: u32 = 0x3f_ffff;
/// Words of a module's header; word 3 is the bound of its identifiers.
pub(super) const HEADER_WORDS: usize = 5;
pub(super) const BOUND: usize = 3;

/// The hash of each shader's expanded source, one line each.
pub const SOURCES: &str = include_str!("../../../spirv/SOURCES");

/// Word of a module's header that names the tool that made it; the lower half is the tool's version.
const GENERATOR: usize = 2;

/// Changes the tool version in the header of a module, which has no meaning for the code. Changing this word invalidates the driver's cache
/// entry. `number` differs between runs of the program.
pub fn set_tool_version(words: &mut [u32], number: u16) {
    if let Some(word) = words.get_mut(GENERATOR) {
        // Versions from 0x8000 on are later than any that a driver works around.
        *word = (*word & 0xffff_0000) | 0x8000 | u32::from(number);
    }
}

/// A module that breaks the format, or that a rewrite cannot handle.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("SPIR-V: {0}")]
pub struct SpirvError(String);

/// Decodes the words of a module.
pub fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// The embedded shader of this name, as bytes.
pub fn embedded(name: &str) -> Option<&'static [u8]> {
    EMBEDDED.iter().find(|(n, _)| *n == name).map(|(_, bytes)| *bytes)
}

/// Small modules and every so many words of a ray caster, because the time is that of the square of their length: cut before a word and with
/// that word changed, `read` ends without a panic. It is given a texture that the module has and a table, if it has one, and returns whether it is read.
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

/// A literal string: UTF-8, terminated by a zero byte.
pub(super) fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|b| *b != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// One instruction: its opcode and its operands.
pub(super) struct Instruction<'a> {
    pub opcode: u32,
    pub operands: &'a [u32],
}

/// Decodes every instruction. Each has at least the operands that the code of this module indexes without a check.
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
        let (opcode, operands) = (words[at] & 0xffff, &instruction[1..]);
        let required = match opcode {
            op::NAME | op::TYPE_VOID | op::TYPE_BOOL | op::TYPE_SAMPLER | op::TYPE_STRUCT => 1,
            op::MEMBER_NAME
            | op::EXECUTION_MODE
            | op::TYPE_INT
            | op::TYPE_FLOAT
            | op::TYPE_SAMPLED_IMAGE
            | op::FUNCTION
            | op::DECORATE
            | op::EXECUTION_MODE_ID => 2,
            op::TYPE_VECTOR
            | op::TYPE_ARRAY
            | op::TYPE_POINTER
            | op::CONSTANT
            | op::SPEC_CONSTANT
            | op::VARIABLE
            | op::MEMBER_DECORATE
            | op::IMAGE_QUERY_SIZE_LOD => 3,
            op::IMAGE_SAMPLE_EXPLICIT_LOD | op::IMAGE_FETCH => 4,
            op::TYPE_IMAGE => 8,
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

/// Encodes one instruction.
pub(super) fn encode(opcode: u32, operands: &[u32]) -> Vec<u32> {
    let mut words = vec![(operands.len() as u32 + 1) << 16 | opcode];
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
