//! Modules that compute something slightly else, as a driver's compiler that errs would make them: for faults that are planted on
//! purpose.

use super::texture_to_storage::instruction;
use super::{Instruction, SpirvError, error, instructions};
use std::collections::{HashMap, HashSet};

/// Instructions of GLSL.std.450.
pub const FMIN: u32 = 37;
pub const FMAX: u32 = 40;

/// The module with the last instruction `from` of the extended set replaced by `to`, which takes the same operands.
///
/// # Errors
/// A module that breaks the format or has no such instruction.
pub fn replaced(words: &[u32], from: u32, to: u32) -> Result<Vec<u32>, SpirvError> {
    let whole = instructions(words)?;
    let is_it = |i: &Instruction| i.opcode == 12 && i.operands.get(3) == Some(&from);
    let Some(last) = whole.iter().rposition(is_it) else { return error("no such instruction") };
    let mut out = words[..5].to_vec();
    for (n, i) in whole.iter().enumerate() {
        let mut operands = i.operands.to_vec();
        if n == last {
            operands[3] = to;
        }
        out.extend(instruction(i.opcode, &operands));
    }
    Ok(out)
}

/// The module with `amount` added to every texel that is written to the image of that name.
///
/// # Errors
/// A module that breaks the format or writes no such image.
pub fn added(words: &[u32], image: &str, amount: [f32; 4]) -> Result<Vec<u32>, SpirvError> {
    let whole = instructions(words)?;
    let mut images = HashSet::new();
    let (mut float, mut vector) = (None, None);
    let mut vectors = HashSet::new();
    for i in &whole {
        match (i.opcode, i.operands) {
            (5, [id, name @ ..]) if super::text(name) == image => drop(images.insert(*id)),
            (22, [id, 32, ..]) => float = Some(*id),
            (23, [id, of, 4]) if Some(*of) == float => vector = Some(*id),
            // OpLoad
            (61, [_, id, from, ..]) if images.contains(from) => drop(images.insert(*id)),
            (_, [of, id, ..]) if Some(*of) == vector => drop(vectors.insert(*id)),
            _ => {}
        }
    }
    let (Some(float), Some(vector)) = (float, vector) else { return error("no vectors of four floats") };
    let mut bound = words[3];
    let mut next = || {
        bound += 1;
        bound - 1
    };
    let (parts, whole_amount) = ([next(), next(), next(), next()], next());
    let mut out = words[..5].to_vec();
    let (mut is_declared, mut writes) = (false, 0);
    for i in &whole {
        if i.opcode == 54 && !is_declared {
            is_declared = true;
            for (id, part) in parts.iter().zip(amount) {
                out.extend(instruction(43, &[float, *id, part.to_bits()]));
            }
            out.extend(instruction(44, &[&[vector, whole_amount][..], &parts].concat()));
        }
        match (i.opcode, i.operands) {
            // OpImageWrite
            (99, [to, at, texel, rest @ ..]) if images.contains(to) && vectors.contains(texel) => {
                let sum = next();
                out.extend(instruction(129, &[vector, sum, *texel, whole_amount]));
                out.extend(instruction(99, &[&[*to, *at, sum][..], rest].concat()));
                writes += 1;
            }
            _ => out.extend(instruction(i.opcode, i.operands)),
        }
    }
    out[3] = bound;
    if writes == 0 { error(format!("nothing is written to '{image}'")) } else { Ok(out) }
}

/// The module with every sum, difference, product and quotient of floats rounded to half precision.
///
/// # Errors
/// A module that breaks the format.
pub fn in_halves(words: &[u32]) -> Result<Vec<u32>, SpirvError> {
    let whole = instructions(words)?;
    let mut bound = words[3];
    let mut out = words[..5].to_vec();
    let mut seen = HashMap::new();
    for i in &whole {
        match (i.opcode, i.operands) {
            // OpFAdd, OpFSub, OpFMul, OpFDiv, OpVectorTimesScalar
            (129 | 131 | 133 | 136 | 142, [of, id, a, b]) => {
                out.extend(instruction(i.opcode, &[*of, bound, *a, *b]));
                // OpQuantizeToF16
                out.extend(instruction(116, &[*of, *id, bound]));
                seen.insert(*id, bound);
                bound += 1;
            }
            _ => out.extend(instruction(i.opcode, i.operands)),
        }
    }
    out[3] = bound;
    if seen.is_empty() { error("nothing is computed with floats") } else { Ok(out) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::{EMBEDDED, embedded, reflect, words};

    #[test]
    fn a_bent_module_declares_what_it_declared() {
        for (name, bytes) in EMBEDDED {
            let before = words(bytes);
            if let Ok(after) = in_halves(&before) {
                assert_eq!(reflect(&before).unwrap(), reflect(&after).unwrap(), "{name}");
            }
        }
        let tone = words(embedded("postprocess/tone.plain").unwrap());
        let after = added(&tone, "screen", [0.1, 0.1, 0.1, 0.0]).unwrap();
        assert_eq!(reflect(&tone).unwrap(), reflect(&after).unwrap());
        assert_eq!(instructions(&after).unwrap().len(), instructions(&tone).unwrap().len() + 6);
        assert!(added(&tone, "nowhere", [0.0; 4]).is_err());
        let median = words(embedded("filter/median.slice").unwrap());
        let after = replaced(&median, FMAX, FMIN).unwrap();
        assert_eq!(after.iter().zip(&median).filter(|(a, b)| a != b).count(), 1);
    }

    #[test]
    fn a_broken_module_is_an_error() {
        let whole = words(embedded("postprocess/tone.plain").unwrap());
        for cut in 0..whole.len() {
            let _ = added(&whole[..cut], "screen", [0.0; 4]);
            let _ = in_halves(&whole[..cut]);
            let _ = replaced(&whole[..cut], FMAX, FMIN);
        }
    }
}
