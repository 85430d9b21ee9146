//! The classes of instructions of a module, which a driver's compiler has to translate correctly.

use super::module::{Op, decode, storage_class};
use std::collections::BTreeSet;

/// The storage class of memory that a workgroup shares.
const WORKGROUP: u32 = ::spirv::StorageClass::Workgroup as u32;
const VOTES: &str = "votes of a subgroup";

/// The classes of instructions that occur in a module, as names such as "arithmetic of floats". Empty if the words are no valid module.
pub fn classes(words: &[u32]) -> BTreeSet<&'static str> {
    decode(words).unwrap_or_default().iter().filter_map(|i| class(i.opcode, i.operands)).collect()
}

/// True if the module has operations among the invocations of a subgroup (votes and others). False if the words are no valid module.
pub fn has_votes(words: &[u32]) -> bool {
    classes(words).contains(VOTES)
}

/// The class of an instruction; `None` for declarations, and for what every module has: loads, stores, constants and jumps.
pub(super) fn class(opcode: Op, operands: &[u32]) -> Option<&'static str> {
    Some(match (opcode, operands) {
        (Op::ExtInst, [_, _, _, number, ..]) => match number {
            1..=3 | 8..=10 => "floats rounded to integers",
            4..=7 => "absolute values and signs",
            11..=25 => "angles and trigonometry",
            26..=32 => "powers, exponentials and roots",
            37..=45 => "minima, maxima and clamps",
            46..=50 => "mixtures and fused sums",
            54..=64 => "packed numbers",
            _ => "lengths and other functions of vectors",
        },
        (Op::SpecConstantTrue | Op::SpecConstantFalse | Op::SpecConstant | Op::SpecConstantOp, _) => {
            "specialization constants"
        }
        (Op::FunctionCall, _) => "calls of functions",
        (Op::Variable, [_, _, WORKGROUP, ..]) => "shared memory",
        (Op::Variable, [_, _, storage_class::STORAGE_BUFFER, ..]) => "storage buffers",
        (Op::ImageSampleExplicitLod, _) => "filtered samples",
        // One becomes the other where textures are read as storage images.
        (Op::ImageFetch | Op::ImageRead, _) => "reads of texels",
        (Op::ImageWrite, _) => "writes of texels",
        (Op::ImageQuerySizeLod | Op::ImageQuerySize, _) => "sizes of images",
        (Op::ConvertFToU | Op::ConvertFToS | Op::ConvertSToF | Op::ConvertUToF, _) => "conversions of numbers",
        (Op::Bitcast, _) => "bits of one type as another",
        (Op::SNegate | Op::IAdd | Op::ISub | Op::IMul, _) => "arithmetic of integers",
        (Op::FNegate | Op::FAdd | Op::FSub | Op::FMul, _) => "arithmetic of floats",
        (Op::UDiv | Op::SDiv | Op::UMod | Op::SRem | Op::SMod, _) => "quotients of integers",
        (Op::FDiv | Op::FRem | Op::FMod, _) => "quotients of floats",
        (of, _) if (Op::VectorTimesScalar..=Op::Dot).contains(&of) => "products of vectors and matrices",
        (Op::IAddCarry | Op::ISubBorrow | Op::UMulExtended | Op::SMulExtended, _) => {
            "wide sums and products of integers"
        }
        (Op::Any | Op::All, _) => "logic",
        (of, _) if (Op::LogicalEqual..=Op::LogicalNot).contains(&of) => "logic",
        (Op::IsNan | Op::IsInf, _) => "tests for NaN and infinity",
        (Op::Select, _) => "selections",
        (of, _) if (Op::IEqual..=Op::SLessThanEqual).contains(&of) => "comparisons of integers",
        (of, _) if (Op::FOrdEqual..=Op::FUnordGreaterThanEqual).contains(&of) => "comparisons of floats",
        (of, _) if (Op::ShiftRightLogical..=Op::BitCount).contains(&of) => "bits of integers",
        (Op::ControlBarrier | Op::MemoryBarrier, _) => "barriers in a workgroup",
        (of, _) if (Op::AtomicLoad..=Op::AtomicXor).contains(&of) => "atomic operations",
        (Op::Phi, _) => "values by branch",
        (Op::LoopMerge, _) => "loops",
        (Op::SelectionMerge | Op::Switch, _) => "branches",
        (of, _) if (Op::GroupNonUniformElect..=Op::GroupNonUniformQuadSwap).contains(&of) => VOTES,
        _ => return None,
    })
}
