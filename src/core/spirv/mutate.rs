//! Fault injection into shaders: modules that compute slightly different values, as the output of a faulty driver compiler
//! would.

use super::module::{BOUND, HEADER_WORDS, Instruction, Op, SpirvError, decode, encode, error, next_id, text};
use std::collections::HashSet;

/// Number of the instruction FMin in the extended set GLSL.std.450: the smaller of two floats.
pub const FMIN: u32 = 37;
/// Number of the instruction FMax in the extended set GLSL.std.450: the larger of two floats.
pub const FMAX: u32 = 40;

/// The opcode for the addition of floats.
pub const F_ADD: Op = Op::FAdd;
/// The opcode for the subtraction of floats.
pub const F_SUB: Op = Op::FSub;

/// Replaces the last instruction of number `from` of the extended set GLSL.std.450 by number `to`, which takes the same operands.
///
/// # Errors
/// The module is invalid or has no such instruction.
pub fn replace_last(words: &[u32], from: u32, to: u32) -> Result<Vec<u32>, SpirvError> {
    let is_it = |i: &Instruction| i.opcode == Op::ExtInst && i.operands.get(3) == Some(&from);
    with_last(words, is_it, |i| encode(i.opcode, &[&i.operands[..3], &[to], &i.operands[4..]].concat()))
}

/// Replaces the last instruction of opcode `from` by `to`, which takes the same operands.
///
/// # Errors
/// The module is invalid or has no such instruction.
pub fn replace_last_opcode(words: &[u32], from: Op, to: Op) -> Result<Vec<u32>, SpirvError> {
    with_last(words, |i| i.opcode == from, |i| encode(to, i.operands))
}

/// The module with another instruction in place of the last of those for which `is_it` is true.
fn with_last(
    words: &[u32],
    is_it: impl Fn(&Instruction) -> bool,
    other: impl Fn(&Instruction) -> Vec<u32>,
) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    let Some(last) = instructions.iter().rposition(is_it) else { return error("no such instruction") };
    let mut out = words[..HEADER_WORDS].to_vec();
    for (n, i) in instructions.iter().enumerate() {
        out.extend(if n == last { other(i) } else { encode(i.opcode, i.operands) });
    }
    Ok(out)
}

/// Adds `amount` to every texel that the module writes to the image of that name.
///
/// # Errors
/// The module is invalid or does not write to such an image.
pub fn add_to_writes(words: &[u32], image: &str, amount: [f32; 4]) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    let mut images = HashSet::new();
    let (mut float, mut vector) = (None, None);
    let mut vectors = HashSet::new();
    for i in &instructions {
        match (i.opcode, i.operands) {
            (Op::Name, [id, name @ ..]) if text(name) == image => drop(images.insert(*id)),
            (Op::TypeFloat, [id, 32, ..]) => float = Some(*id),
            (Op::TypeVector, [id, of, 4]) if Some(*of) == float => vector = Some(*id),
            (Op::Load, [_, id, from, ..]) if images.contains(from) => drop(images.insert(*id)),
            (_, [of, id, ..]) if Some(*of) == vector => drop(vectors.insert(*id)),
            _ => {}
        }
    }
    let (Some(float), Some(vector)) = (float, vector) else { return error("no vectors of four floats") };
    let mut out = words[..HEADER_WORDS].to_vec();
    let (components, offset) = ([(); 4].map(|()| next_id(&mut out)), next_id(&mut out));
    let (mut is_declared, mut writes) = (false, 0);
    for i in &instructions {
        if i.opcode == Op::Function && !is_declared {
            is_declared = true;
            for (id, component) in components.iter().zip(amount) {
                out.extend(encode(Op::Constant, &[float, *id, component.to_bits()]));
            }
            out.extend(encode(Op::ConstantComposite, &[&[vector, offset][..], &components].concat()));
        }
        match (i.opcode, i.operands) {
            (Op::ImageWrite, [to, at, texel, rest @ ..]) if images.contains(to) && vectors.contains(texel) => {
                let sum = next_id(&mut out);
                out.extend(encode(Op::FAdd, &[vector, sum, *texel, offset]));
                out.extend(encode(Op::ImageWrite, &[&[*to, *at, sum][..], rest].concat()));
                writes += 1;
            }
            _ => out.extend(encode(i.opcode, i.operands)),
        }
    }
    if writes == 0 { error(format!("the module does not write to '{image}'")) } else { Ok(out) }
}

/// Rounds the result of every addition, subtraction, multiplication and division of floats, also of a vector by a scalar, to half precision. Dot and
/// matrix products are not rounded.
///
/// # Errors
/// The module is invalid or has no such instruction.
pub fn round_to_half(words: &[u32]) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    let mut out = words[..HEADER_WORDS].to_vec();
    for i in &instructions {
        match (i.opcode, i.operands) {
            (Op::FAdd | Op::FSub | Op::FMul | Op::FDiv | Op::VectorTimesScalar, [of, id, a, b]) => {
                let exact = next_id(&mut out);
                out.extend(encode(i.opcode, &[*of, exact, *a, *b]));
                out.extend(encode(Op::QuantizeToF16, &[*of, *id, exact]));
            }
            _ => out.extend(encode(i.opcode, i.operands)),
        }
    }
    if out[BOUND] == words[BOUND] { error("the module computes nothing with floats") } else { Ok(out) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::module::{EMBEDDED, embedded, words};
    use crate::spirv::reflect::reflect;

    #[test]
    fn a_mutated_module_declares_the_same_interface() {
        for (name, bytes) in EMBEDDED {
            let before = words(bytes);
            if let Ok(after) = round_to_half(&before) {
                assert_eq!(reflect(&before).unwrap(), reflect(&after).unwrap(), "{name}");
            }
        }
        let tone = words(embedded("postprocess/tone").unwrap());
        let after = add_to_writes(&tone, "screen", [0.1, 0.1, 0.1, 0.0]).unwrap();
        assert_eq!(reflect(&tone).unwrap(), reflect(&after).unwrap());
        assert_eq!(decode(&after).unwrap().len(), decode(&tone).unwrap().len() + 6);
        assert!(add_to_writes(&tone, "nowhere", [0.0; 4]).is_err());
        let median = words(embedded("filter/median.slice").unwrap());
        let after = replace_last(&median, FMAX, FMIN).unwrap();
        assert_eq!(after.iter().zip(&median).filter(|(a, b)| a != b).count(), 1);
        let light = words(embedded("shade/light").unwrap());
        let after = replace_last_opcode(&light, F_ADD, F_SUB).unwrap();
        assert_eq!(after.iter().zip(&light).filter(|(a, b)| a != b).count(), 1);
        assert!(replace_last_opcode(&light, Op::Kill, F_SUB).is_err());
    }

    #[test]
    fn a_malformed_module_is_an_error() {
        let intact = words(embedded("postprocess/tone").unwrap());
        for cut in 0..intact.len() {
            let _ = add_to_writes(&intact[..cut], "screen", [0.0; 4]);
            let _ = round_to_half(&intact[..cut]);
            let _ = replace_last(&intact[..cut], FMAX, FMIN);
        }
    }
}
