//! Makes specialization constants of a module constants. A validation layer specializes and validates a module again for each of its
//! pipelines; without specialization constants it validates the module once, and remembers it.

use super::module::{HEADER_WORDS, Op, SpirvError, decode, decoration, encode, error};
use std::collections::HashMap;

/// A constant that is known.
#[derive(Clone, Copy)]
enum Value {
    Bool(bool),
    /// A number of 32 bits.
    Word(u32),
}

/// Writes values of specialization constants, as pairs of `SpecId` and value, into a module, and evaluates expressions of constants. Constants
/// without a value keep their defaults.
///
/// # Errors
/// The module is invalid, or has an expression without a value: one with an operation that no shader of this project has, or a division by 0.
pub fn specialize(words: &[u32], values: &[(u32, i32)]) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    let (mut given, mut known) = (HashMap::new(), HashMap::new());
    let mut out = words[..HEADER_WORDS].to_vec();
    for i in &instructions {
        match (i.opcode, i.operands) {
            (Op::Decorate, [id, decoration::SPEC_ID, constant]) => {
                if let Some((_, value)) = values.iter().find(|(of, _)| of == constant) {
                    given.insert(*id, *value as u32);
                }
                continue;
            }
            (Op::ConstantTrue | Op::ConstantFalse, [_, id]) => {
                known.insert(*id, Value::Bool(i.opcode == Op::ConstantTrue));
            }
            (Op::Constant, [_, id, value]) => drop(known.insert(*id, Value::Word(*value))),
            (Op::SpecConstant, [of, id, default]) => {
                let value = given.get(id).copied().unwrap_or(*default);
                known.insert(*id, Value::Word(value));
                out.extend(encode(Op::Constant, &[*of, *id, value]));
                continue;
            }
            (Op::SpecConstantOp, [of, id, operation, operands @ ..]) => {
                let operands: Option<Vec<Value>> = operands.iter().map(|o| known.get(o).copied()).collect();
                let Some(value) = operands.and_then(|operands| evaluate(Op::from_u32(*operation)?, &operands)) else {
                    return error(format!("no value of an expression with operation {operation}"));
                };
                known.insert(*id, value);
                out.extend(match value {
                    Value::Bool(true) => encode(Op::ConstantTrue, &[*of, *id]),
                    Value::Bool(false) => encode(Op::ConstantFalse, &[*of, *id]),
                    Value::Word(word) => encode(Op::Constant, &[*of, *id, word]),
                });
                continue;
            }
            (Op::SpecConstantComposite, parts) => {
                out.extend(encode(Op::ConstantComposite, parts));
                continue;
            }
            _ => {}
        }
        out.extend(encode(i.opcode, i.operands));
    }
    Ok(out)
}

/// The value of an expression. None: an operation or kinds of operands that are not known here, or a division by zero.
fn evaluate(operation: Op, operands: &[Value]) -> Option<Value> {
    use Value::{Bool, Word};
    let word = |value: i32| Word(value as u32);
    Some(match (operation, operands) {
        (Op::SNegate, [Word(a)]) => Word(a.wrapping_neg()),
        (Op::LogicalNot, [Bool(a)]) => Bool(!a),
        (Op::LogicalOr, [Bool(a), Bool(b)]) => Bool(*a || *b),
        (Op::LogicalAnd, [Bool(a), Bool(b)]) => Bool(*a && *b),
        (Op::Select, [Bool(which), yes, no]) => *(if *which { yes } else { no }),
        (_, [Word(a), Word(b)]) => {
            let (a, b) = (*a as i32, *b as i32);
            match operation {
                Op::IAdd => word(a.wrapping_add(b)),
                Op::ISub => word(a.wrapping_sub(b)),
                Op::IMul => word(a.wrapping_mul(b)),
                Op::SDiv => word(a.checked_div(b)?),
                Op::IEqual => Bool(a == b),
                Op::INotEqual => Bool(a != b),
                Op::SGreaterThan => Bool(a > b),
                Op::SGreaterThanEqual => Bool(a >= b),
                Op::SLessThan => Bool(a < b),
                Op::SLessThanEqual => Bool(a <= b),
                _ => return None,
            }
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::module::{EMBEDDED, words};
    use crate::spirv::reflect::reflect;

    /// Every embedded shader, with the value 7 for every constant of an even number.
    #[test]
    fn no_shader_keeps_a_specialization_constant_and_all_values_arrive() {
        for (name, bytes) in EMBEDDED {
            let before = words(bytes);
            let module = reflect(&before).unwrap();
            let values: Vec<_> = (0..64).step_by(2).map(|id| (id, 7)).collect();
            let after = specialize(&before, &values).unwrap();
            assert_eq!(reflect(&after).unwrap().constants, [], "{name}");
            let instructions = decode(&after).unwrap();
            let is_special = |opcode| (Op::SpecConstant..=Op::SpecConstantOp).contains(&opcode);
            assert!(instructions.iter().all(|i| !is_special(i.opcode)), "{name}");
            let of = |opcode: Op, words: &[u32]| -> HashMap<u32, u32> {
                let all = decode(words).unwrap();
                all.iter().filter(|i| i.opcode == opcode).map(|i| (i.operands[1], i.operands[2])).collect()
            };
            let (defaults, made) = (of(Op::SpecConstant, &before), of(Op::Constant, &after));
            let special = decode(&before).unwrap();
            let special = special.iter().filter(|i| i.opcode == Op::Decorate && i.operands[1] == decoration::SPEC_ID);
            let special: Vec<_> = special.map(|i| (i.operands[0], i.operands[2])).collect();
            assert_eq!(special.len(), module.constants.len(), "{name}");
            for (id, constant) in special {
                let expected = if constant % 2 == 0 { 7 } else { defaults[&id] };
                assert_eq!(made[&id], expected, "{name}: {constant}");
            }
        }
    }

    /// Of numbers and their order, of truth values, and of a choice.
    #[test]
    fn expressions_have_the_values_of_their_operations() {
        use Value::{Bool, Word};
        let number = |operation, a: i32, b: i32| match evaluate(operation, &[Word(a as u32), Word(b as u32)]) {
            Some(Word(value)) => Some(value as i32),
            Some(Bool(value)) => Some(i32::from(value)),
            None => None,
        };
        let binary = [Op::IAdd, Op::ISub, Op::IMul, Op::SDiv];
        assert_eq!(binary.map(|of| number(of, -7, 2)), [Some(-5), Some(-9), Some(-14), Some(-3)]);
        let order = [Op::SLessThan, Op::SLessThanEqual, Op::SGreaterThan, Op::SGreaterThanEqual];
        assert_eq!(order.map(|of| number(of, -1, 1)), [Some(1), Some(1), Some(0), Some(0)]);
        assert_eq!(order.map(|of| number(of, 3, 3)), [Some(0), Some(1), Some(0), Some(1)]);
        assert_eq!([Op::IEqual, Op::INotEqual].map(|of| number(of, 4, 4)), [Some(1), Some(0)]);
        assert_eq!((number(Op::SDiv, 1, 0), number(Op::Select, 1, 2)), (None, None));
        assert!(matches!(evaluate(Op::SNegate, &[Word(5)]), Some(Word(0xffff_fffb))));
        assert!(matches!(evaluate(Op::LogicalOr, &[Bool(false), Bool(true)]), Some(Bool(true))));
        assert!(matches!(evaluate(Op::LogicalAnd, &[Bool(false), Bool(true)]), Some(Bool(false))));
        assert!(matches!(evaluate(Op::LogicalNot, &[Bool(false)]), Some(Bool(true))));
        assert!(matches!(evaluate(Op::Select, &[Bool(false), Word(1), Word(2)]), Some(Word(2))));
    }

    #[test]
    fn a_malformed_module_is_an_error() {
        assert!(specialize(&[1, 2, 3], &[]).is_err());
        let intact = words(EMBEDDED[0].1);
        assert!(specialize(&intact[..HEADER_WORDS + 1], &[]).is_err(), "half of an instruction");
    }
}
