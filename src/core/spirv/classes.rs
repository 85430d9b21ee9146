//! The classes of instructions of a module, which a driver's compiler has to translate correctly.

use super::module::{decode, op, storage_class};
use std::collections::BTreeSet;

/// The storage class of memory that a workgroup shares.
const WORKGROUP: u32 = 4;
const VOTES: &str = "votes of a subgroup";

/// The classes of instructions in a module. Empty if the words are not a module.
pub fn classes(words: &[u32]) -> BTreeSet<&'static str> {
    decode(words).unwrap_or_default().iter().filter_map(|i| class(i.opcode, i.operands)).collect()
}

/// True if invocations of a subgroup vote in the module.
pub fn has_votes(words: &[u32]) -> bool {
    classes(words).contains(VOTES)
}

/// The class of an instruction; `None` for declarations, and for what every module has: loads, stores, constants and jumps.
pub(super) fn class(opcode: u32, operands: &[u32]) -> Option<&'static str> {
    Some(match (opcode, operands) {
        (op::EXT_INST, [_, _, _, number, ..]) => match number {
            1..=3 | 8..=10 => "floats rounded to integers",
            4..=7 => "absolute values and signs",
            11..=25 => "angles and trigonometry",
            26..=32 => "powers, exponentials and roots",
            37..=45 => "minima, maxima and clamps",
            46..=50 => "mixtures and fused sums",
            54..=64 => "packed numbers",
            _ => "lengths and other functions of vectors",
        },
        (48..=50 | op::SPEC_CONSTANT_OP, _) => "specialization constants",
        (op::FUNCTION_CALL, _) => "calls of functions",
        (op::VARIABLE, [_, _, WORKGROUP, ..]) => "shared memory",
        (op::VARIABLE, [_, _, storage_class::STORAGE_BUFFER, ..]) => "storage buffers",
        (op::IMAGE_SAMPLE_EXPLICIT_LOD, _) => "filtered samples",
        // One becomes the other where textures are read as storage images.
        (op::IMAGE_FETCH | op::IMAGE_READ, _) => "reads of texels",
        (op::IMAGE_WRITE, _) => "writes of texels",
        (op::IMAGE_QUERY_SIZE_LOD | op::IMAGE_QUERY_SIZE, _) => "sizes of images",
        (op::CONVERT_F_TO_U..=112, _) => "conversions of numbers",
        (op::BITCAST, _) => "bits of one type as another",
        (op::S_NEGATE | op::I_ADD | op::I_SUB | op::I_MUL, _) => "arithmetic of integers",
        (127 | op::F_ADD | op::F_SUB | op::F_MUL, _) => "arithmetic of floats",
        (134 | op::S_DIV | 137..=139, _) => "quotients of integers",
        (op::F_DIV | 140 | 141, _) => "quotients of floats",
        (op::VECTOR_TIMES_SCALAR..=148, _) => "products of vectors and matrices",
        (149..=op::S_MUL_EXTENDED, _) => "wide sums and products of integers",
        (op::ANY | 155 | 164..=op::LOGICAL_NOT, _) => "logic",
        (156 | 157, _) => "tests for NaN and infinity",
        (op::SELECT, _) => "selections",
        (op::I_EQUAL..=op::S_LESS_THAN_EQUAL, _) => "comparisons of integers",
        (180..=op::F_UNORD_GREATER_THAN_EQUAL, _) => "comparisons of floats",
        (op::SHIFT_RIGHT_LOGICAL..=op::BIT_COUNT, _) => "bits of integers",
        (224 | 225, _) => "barriers in a workgroup",
        (227..=242, _) => "atomic operations",
        (op::PHI, _) => "values by branch",
        (op::LOOP_MERGE, _) => "loops",
        (op::SELECTION_MERGE | op::SWITCH, _) => "branches",
        (333..=366, _) => VOTES,
        _ => return None,
    })
}
