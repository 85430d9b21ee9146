//! Faults by class of instruction: for each class, one way in which a driver's compiler may translate an instruction wrongly. A mutant is a
//! module with one such change. It is valid and terminates.

use super::classes::class;
use super::module::{BOUND, HEADER_WORDS, Instruction, Op, SpirvError, decode, encode, error};
use std::collections::{BTreeMap, BTreeSet};

/// What replaces an instruction.
enum Change {
    /// Nothing.
    Dropped,
    /// This opcode, with the same operands.
    Opcode(Op),
    /// This instruction of GLSL.std.450, with the same operands.
    Extended(u32),
    /// The operands at these two places change places.
    Swapped(usize, usize),
    /// The float that it yields is negated.
    Negated,
    /// The components of the vector that it yields are reversed.
    Reversed,
    /// The float that it converts is rounded to the nearest integer first.
    Rounded,
}

/// A way in which a driver's compiler may translate the instructions of one class wrongly. `what` says how.
pub struct Mutation {
    pub class: &'static str,
    pub what: &'static str,
    /// Not where a module has loops, which might not end.
    spares_loops: bool,
    change: fn(opcode: Op, operands: &[u32]) -> Option<Change>,
}

/// The instruction of GLSL.std.450 becomes the other of a pair.
fn extended(operands: &[u32], pairs: &[(u32, u32)]) -> Option<Change> {
    let number = operands.get(3)?;
    pairs.iter().find(|(from, _)| from == number).map(|(_, to)| Change::Extended(*to))
}

/// The opcode becomes the other of a pair, in either direction.
fn paired(opcode: Op, pairs: &[(Op, Op)]) -> Option<Change> {
    let other = |(a, b): &(Op, Op)| if *a == opcode { Some(*b) } else { (*b == opcode).then_some(*a) };
    pairs.iter().find_map(other).map(Change::Opcode)
}

impl Mutation {
    const fn sparing_loops(self) -> Mutation {
        Mutation { spares_loops: true, ..self }
    }
}

const fn of(class: &'static str, what: &'static str, change: fn(Op, &[u32]) -> Option<Change>) -> Mutation {
    Mutation { class, what, spares_loops: false, change }
}

/// The mutations: at most one for each class of instructions.
pub const MUTATIONS: &[Mutation] = &[
    of("comparisons of floats", "equal numbers compare the other way", |opcode, _| {
        paired(
            opcode,
            &[
                (Op::FOrdLessThan, Op::FOrdLessThanEqual),
                (Op::FUnordLessThan, Op::FUnordLessThanEqual),
                (Op::FOrdGreaterThan, Op::FOrdGreaterThanEqual),
                (Op::FUnordGreaterThan, Op::FUnordGreaterThanEqual),
                (Op::FOrdEqual, Op::FOrdNotEqual),
                (Op::FUnordEqual, Op::FUnordNotEqual),
            ],
        )
    }),
    of("comparisons of integers", "equal numbers compare the other way", |opcode, _| {
        paired(
            opcode,
            &[
                (Op::UGreaterThan, Op::UGreaterThanEqual),
                (Op::SGreaterThan, Op::SGreaterThanEqual),
                (Op::ULessThan, Op::ULessThanEqual),
                (Op::SLessThan, Op::SLessThanEqual),
                (Op::IEqual, Op::INotEqual),
            ],
        )
    }),
    of("barriers in a workgroup", "a barrier is left out", |_, _| Some(Change::Dropped)),
    of("votes of a subgroup", "any and all are mixed up", |opcode, _| {
        paired(opcode, &[(Op::GroupNonUniformAll, Op::GroupNonUniformAny)])
    }),
    of("logic", "any and all, or and and, are mixed up", |opcode, _| {
        paired(opcode, &[(Op::Any, Op::All), (Op::LogicalOr, Op::LogicalAnd), (Op::LogicalEqual, Op::LogicalNotEqual)])
    }),
    of("selections", "the other value is selected", |_, _| Some(Change::Swapped(3, 4))),
    of("conversions of numbers", "a float is rounded to the nearest integer instead of towards zero", |opcode, _| {
        matches!(opcode, Op::ConvertFToU | Op::ConvertFToS).then_some(Change::Rounded)
    }),
    of("floats rounded to integers", "rounding goes in another direction", |_, operands| {
        extended(operands, &[(1, 8), (2, 8), (3, 9), (8, 9), (9, 8)])
    }),
    of("minima, maxima and clamps", "minimum and maximum are mixed up", |_, operands| {
        extended(operands, &[(37, 40), (40, 37), (38, 41), (41, 38), (39, 42), (42, 39)])
    }),
    of("absolute values and signs", "the absolute value is negative", |_, operands| {
        (operands.get(3) == Some(&4)).then_some(Change::Negated)
    }),
    of("powers, exponentials and roots", "another base, or the reciprocal", |_, operands| {
        extended(operands, &[(27, 29), (28, 30), (29, 27), (30, 28), (31, 32), (32, 31)])
            .or_else(|| (operands.get(3) == Some(&26)).then_some(Change::Swapped(4, 5)))
    }),
    of("angles and trigonometry", "sine and cosine, or the two legs, are mixed up", |_, operands| {
        extended(operands, &[(13, 14), (14, 13), (16, 17), (17, 16)])
            .or_else(|| (operands.get(3) == Some(&25)).then_some(Change::Swapped(4, 5)))
    }),
    of("mixtures and fused sums", "the ends of a mixture change places", |_, operands| {
        (operands.get(3) == Some(&46)).then_some(Change::Swapped(4, 5))
    }),
    of("packed numbers", "halves are read as shares of 65535", |_, operands| extended(operands, &[(58, 57), (62, 61)])),
    of("lengths and other functions of vectors", "what a function of vectors yields is negated", |_, operands| {
        matches!(operands.get(3), Some(66..=71)).then_some(Change::Negated)
    }),
    of("products of vectors and matrices", "the product is negated", |_, _| Some(Change::Negated)),
    of("arithmetic of floats", "a sum is a difference", |opcode, _| paired(opcode, &[(Op::FAdd, Op::FSub)]))
        .sparing_loops(),
    of("arithmetic of integers", "a sum is a difference", |opcode, _| paired(opcode, &[(Op::IAdd, Op::ISub)]))
        .sparing_loops(),
    of("quotients of floats", "a quotient is a product", |opcode, _| paired(opcode, &[(Op::FDiv, Op::FMul)])),
    of("quotients of integers", "quotient and remainder are mixed up", |opcode, _| {
        paired(opcode, &[(Op::UDiv, Op::UMod), (Op::SDiv, Op::SRem)])
    }),
    of("bits of integers", "shifts go the other way, or and and are mixed up", |opcode, _| {
        paired(opcode, &[(Op::ShiftRightLogical, Op::ShiftLeftLogical), (Op::BitwiseOr, Op::BitwiseAnd)])
    }),
    of("sizes of images", "the wrong component of an image's size", |_, _| Some(Change::Reversed)),
    of("reads of texels", "the components of a texel are reversed", |_, _| Some(Change::Reversed)),
    of("filtered samples", "the components of a sample are reversed", |_, _| Some(Change::Reversed)),
    of("writes of texels", "a write is lost", |_, _| Some(Change::Dropped)),
];

/// The instructions of a module that a mutation can change, by place.
fn sites(instructions: &[Instruction], mutation: &Mutation) -> Vec<usize> {
    let has_loops = || instructions.iter().any(|i| i.opcode == Op::LoopMerge);
    if mutation.spares_loops && has_loops() {
        return Vec::new();
    }
    let types = Types::of(instructions);
    let suits = |i: &Instruction| {
        class(i.opcode, i.operands) == Some(mutation.class)
            && match (mutation.change)(i.opcode, i.operands) {
                Some(Change::Reversed) => types.vectors.contains_key(&i.operands[0]),
                Some(Change::Negated) => types.floats.contains(&i.operands[0]),
                Some(Change::Rounded) => i.operands.get(2).is_some_and(|of| types.of_float(*of).is_some()),
                Some(_) => true,
                None => false,
            }
    };
    (0..instructions.len()).filter(|n| suits(&instructions[*n])).collect()
}

/// Types of a module by their identifiers.
#[derive(Default)]
struct Types {
    /// Vectors, with the number of their components.
    vectors: BTreeMap<u32, u32>,
    /// Floats and vectors of them.
    floats: BTreeSet<u32>,
    /// The type of each result.
    of_result: BTreeMap<u32, u32>,
    /// The extended instruction set.
    extended: u32,
}

impl Types {
    fn of(instructions: &[Instruction]) -> Types {
        let mut types = Types::default();
        for i in instructions {
            match (i.opcode, i.operands) {
                (Op::TypeFloat, [id, ..]) => drop(types.floats.insert(*id)),
                (Op::TypeVector, [id, of, count, ..]) => {
                    types.vectors.insert(*id, *count);
                    if types.floats.contains(of) {
                        types.floats.insert(*id);
                    }
                }
                (Op::ExtInstImport, [id, ..]) => types.extended = *id,
                (operation, [of, id, ..]) if yields(operation) => {
                    types.of_result.insert(*id, *of);
                }
                _ => {}
            }
        }
        types
    }

    /// The type of a result, if it is a float or a vector of them.
    fn of_float(&self, result: u32) -> Option<u32> {
        self.of_result.get(&result).copied().filter(|of| self.floats.contains(of))
    }
}

/// True of instructions with a type and a result.
fn yields(operation: Op) -> bool {
    let runs = [
        Op::ExtInst..=Op::ExtInst,
        Op::ConstantTrue..=Op::Load,
        Op::AccessChain..=Op::InBoundsPtrAccessChain,
        Op::VectorExtractDynamic..=Op::ImageRead,
        Op::Image..=Op::FwidthCoarse,
        Op::AtomicLoad..=Op::Phi,
        Op::GroupNonUniformElect..=Op::GroupNonUniformQuadSwap,
    ];
    runs.iter().any(|run| run.contains(&operation))
}

/// Number of mutants that this mutation makes of a module: one for each instruction that it can change. 0 if the words are no module.
pub fn count(words: &[u32], mutation: &Mutation) -> usize {
    decode(words).map_or(0, |instructions| sites(&instructions, mutation).len())
}

/// The mutant of a module with this number, from 0 to below [`count`].
///
/// # Errors
/// The module is invalid, or has no such mutant.
pub fn mutant(words: &[u32], mutation: &Mutation, number: usize) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    let Some(site) = sites(&instructions, mutation).get(number).copied() else {
        return error(format!("no instruction of class '{}' to change", mutation.class));
    };
    let types = Types::of(&instructions);
    let mut out = words[..HEADER_WORDS].to_vec();
    let new = words[BOUND];
    for (n, i) in instructions.iter().enumerate() {
        let change = if n == site { (mutation.change)(i.opcode, i.operands) } else { None };
        let with = |at: usize, to: u32| {
            let mut operands = i.operands.to_vec();
            operands[at] = to;
            operands
        };
        match change {
            None => out.extend(encode(i.opcode, i.operands)),
            Some(Change::Dropped) => {}
            Some(Change::Opcode(to)) => out.extend(encode(to, i.operands)),
            Some(Change::Extended(to)) => out.extend(encode(i.opcode, &with(3, to))),
            Some(Change::Swapped(a, b)) => {
                let mut operands = i.operands.to_vec();
                if a.max(b) < operands.len() {
                    operands.swap(a, b);
                }
                out.extend(encode(i.opcode, &operands));
            }
            Some(Change::Negated) => {
                out.extend(encode(i.opcode, &with(1, new)));
                out.extend(encode(Op::FNegate, &[i.operands[0], i.operands[1], new]));
            }
            Some(Change::Reversed) => {
                let components = types.vectors.get(&i.operands[0]).copied().unwrap_or(0);
                out.extend(encode(i.opcode, &with(1, new)));
                let order: Vec<u32> = (0..components).rev().collect();
                let shuffle = [&[i.operands[0], i.operands[1], new, new][..], &order].concat();
                out.extend(encode(Op::VectorShuffle, &shuffle));
            }
            Some(Change::Rounded) => {
                let of = types.of_float(i.operands[2]).unwrap_or(0);
                out.extend(encode(Op::ExtInst, &[of, new, types.extended, ROUND, i.operands[2]]));
                out.extend(encode(i.opcode, &with(2, new)));
            }
        }
    }
    out[BOUND] = new + 1;
    Ok(out)
}

/// Of GLSL.std.450.
const ROUND: u32 = 1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::module::{EMBEDDED, words};
    use crate::spirv::reflect::reflect;

    #[test]
    fn a_mutant_differs_in_one_place_and_declares_the_same_interface() {
        let mut seen = BTreeSet::new();
        for (name, bytes) in EMBEDDED {
            let before = words(bytes);
            let interface = reflect(&before).unwrap();
            for mutation in MUTATIONS {
                let all = count(&before, mutation);
                for number in [0, all.saturating_sub(1)].into_iter().take(all) {
                    let after = mutant(&before, mutation, number).unwrap();
                    assert_ne!(before, after, "{name}, {}", mutation.class);
                    assert_eq!(interface, reflect(&after).unwrap(), "{name}, {}", mutation.class);
                    seen.insert(mutation.class);
                }
                assert!(mutant(&before, mutation, all).is_err());
            }
        }
        let unused: Vec<_> = MUTATIONS.iter().map(|m| m.class).filter(|class| !seen.contains(class)).collect();
        assert!(unused.is_empty(), "no shader has anything to change for {unused:?}");
    }
}
