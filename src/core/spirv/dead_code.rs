//! Removes code that a module never runs. A shader holds the code of all its variants, of which the constants of a pipeline choose one: of
//! the 14,000 instructions of the surface ray caster 2,000 are left. A validation layer and lavapipe process every instruction of each
//! pipeline.

use super::module::{HEADER_WORDS, Instruction, Op, SpirvError, decode, encode, error};
use std::collections::{HashMap, HashSet};

/// Removes branches that the module's constants never take, and values that nothing uses. The module computes the same.
///
/// # Errors
/// The module is invalid.
pub fn remove_dead_code(words: &[u32]) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    let Some(begin) = instructions.iter().position(|i| i.opcode == Op::Function) else {
        return Ok(words.to_vec());
    };
    let (head, code) = instructions.split_at(begin);
    let known: HashMap<u32, u32> = head.iter().filter_map(known).collect();
    let kept = without_unused(without_dead_blocks(code, &known)?);
    let before: HashSet<u32> = code.iter().filter_map(|i| result_of(i.opcode, i.operands)).collect();
    let removed = &before - &kept.iter().filter_map(|(opcode, words)| result_of(*opcode, words)).collect();
    let mut out = words[..HEADER_WORDS].to_vec();
    for i in head {
        let is_about = matches!(i.opcode, Op::Name | Op::Decorate);
        if !is_about || i.operands.first().is_none_or(|of| !removed.contains(of)) {
            out.extend(encode(i.opcode, i.operands));
        }
    }
    kept.iter().for_each(|(opcode, operands)| out.extend(encode(*opcode, operands)));
    Ok(out)
}

/// A constant and its value: 1 for true.
fn known(i: &Instruction) -> Option<(u32, u32)> {
    match (i.opcode, i.operands) {
        (Op::ConstantTrue, [_, id]) => Some((*id, 1)),
        (Op::ConstantFalse, [_, id]) => Some((*id, 0)),
        (Op::Constant, [_, id, value]) => Some((*id, *value)),
        _ => None,
    }
}

/// An instruction of the new module.
type Code = (Op, Vec<u32>);

/// Where control goes after a block.
struct Exit {
    /// As it is written: opcode and operands.
    code: Code,
    targets: Vec<u32>,
    /// Labels that must stay though nothing goes there: where the construct ends, and the branch that is never taken.
    stubs: Vec<u32>,
    /// The continue target of a loop.
    continues: Option<u32>,
}

/// A block without its exit.
struct Block<'a> {
    label: u32,
    code: &'a [Instruction<'a>],
    exit: Exit,
}

fn exit(code: &[Instruction], known: &HashMap<u32, u32>) -> Result<Exit, SpirvError> {
    let [.., last] = code else { return error("a block is empty") };
    let before = code.len().checked_sub(2).map(|n| &code[n]);
    let (merge, continues) = match before.map(|i| (i.opcode, i.operands)) {
        Some((Op::SelectionMerge, [merge, ..])) => (Some(*merge), None),
        Some((Op::LoopMerge, [merge, next, ..])) => (Some(*merge), Some(*next)),
        _ => (None, None),
    };
    let mut stubs = Vec::from_iter(merge);
    let mut written = (last.opcode, last.operands.to_vec());
    let targets = match (last.opcode, last.operands) {
        (Op::Branch, [to]) => vec![*to],
        (Op::BranchConditional, [condition, yes, no, ..]) => match known.get(condition) {
            Some(value) if continues.is_none() => {
                let (taken, dead) = if *value == 1 { (*yes, *no) } else { (*no, *yes) };
                if merge.is_some() {
                    // The selection stays, and so does the form of the code around it.
                    stubs.push(dead);
                } else {
                    written = (Op::Branch, vec![taken]);
                }
                vec![taken]
            }
            _ => vec![*yes, *no],
        },
        (Op::Switch, [selector, default, cases @ ..]) => match known.get(selector) {
            Some(value) => {
                let case = cases.chunks_exact(2).find(|case| case[0] == *value);
                let taken = case.map_or(*default, |case| case[1]);
                written = (Op::Switch, vec![*selector, taken]);
                vec![taken]
            }
            // Selectors of 32 bits, as in every shader of this project.
            None => cases.chunks_exact(2).map(|case| case[1]).chain([*default]).collect(),
        },
        (Op::Kill | Op::Return | Op::ReturnValue | Op::Unreachable, _) => Vec::new(),
        _ => return error(format!("a block ends with operation {:?}", last.opcode)),
    };
    Ok(Exit { code: written, targets, stubs, continues })
}

/// The blocks of functions, each from its label to before its exit.
fn blocks<'a>(code: &'a [Instruction<'a>], known: &HashMap<u32, u32>) -> Result<Vec<Block<'a>>, SpirvError> {
    let mut found = Vec::new();
    let starts = code.iter().enumerate().filter(|(_, i)| i.opcode == Op::Label);
    for (start, i) in starts {
        let [label] = i.operands else { return error("a label without a name") };
        let is_end = |i: &Instruction| (Op::Branch..=Op::Unreachable).contains(&i.opcode);
        let Some(length) = code[start..].iter().position(is_end) else { return error("a block without an end") };
        let exit = exit(&code[start + 1..=start + length], known)?;
        found.push(Block { label: *label, code: &code[start..start + length], exit });
    }
    Ok(found)
}

/// The code of functions without the blocks that nothing reaches.
fn without_dead_blocks(code: &[Instruction], known: &HashMap<u32, u32>) -> Result<Vec<Code>, SpirvError> {
    let blocks = blocks(code, known)?;
    let by_label: HashMap<u32, &Block> = blocks.iter().map(|block| (block.label, block)).collect();
    // The first label of each function.
    let functions = code.split(|i| i.opcode == Op::FunctionEnd);
    let entries = functions.filter_map(|function| function.iter().find(|i| i.opcode == Op::Label));
    let mut ahead: Vec<u32> = entries.map(|i| i.operands[0]).collect();
    let (mut reached, mut stubs) = (HashSet::<u32>::new(), HashSet::<u32>::new());
    while let Some(label) = ahead.pop() {
        if !reached.insert(label) {
            continue;
        }
        let Some(block) = by_label.get(&label) else { return error(format!("no block has the label {label}")) };
        // A loop that never goes round keeps its continue target, which nothing else could take the place of.
        ahead.extend(block.exit.targets.iter().chain(&block.exit.continues));
        stubs.extend(&block.exit.stubs);
    }
    // A label that is reached from elsewhere stays a target of a branch that does not go there.
    let targets = |block: &Block| -> Vec<u32> {
        let kept = block.exit.code.1.iter().filter(|to| block.exit.stubs.contains(to) && reached.contains(to));
        let kept = kept.filter(|_| block.exit.code.0 == Op::BranchConditional);
        block.exit.targets.iter().chain(kept).copied().collect()
    };
    let mut from: HashMap<u32, HashSet<u32>> = HashMap::new();
    for block in blocks.iter().filter(|block| reached.contains(&block.label)) {
        for to in targets(block) {
            from.entry(to).or_default().insert(block.label);
        }
    }
    let (mut out, nowhere) = (Vec::new(), HashSet::new());
    let mut is_inside = false;
    let mut at = blocks.iter();
    for i in code {
        match i.opcode {
            Op::Label => {
                is_inside = true;
                let Some(block) = at.next() else { return error("a label too many") };
                if reached.contains(&block.label) {
                    out.extend(block.code.iter().map(|i| live(i, from.get(&block.label).unwrap_or(&nowhere))));
                    out.push(block.exit.code.clone());
                } else if stubs.contains(&block.label) {
                    out.extend([(Op::Label, vec![block.label]), (Op::Unreachable, Vec::new())]);
                }
            }
            Op::FunctionEnd => {
                is_inside = false;
                out.push((i.opcode, Vec::new()));
            }
            _ if !is_inside => out.push((i.opcode, i.operands.to_vec())),
            _ => {}
        }
    }
    Ok(out)
}

/// An instruction of a block that is reached from these.
fn live(i: &Instruction, from: &HashSet<u32>) -> Code {
    let (Op::Phi, [of, id, pairs @ ..]) = (i.opcode, i.operands) else {
        return (i.opcode, i.operands.to_vec());
    };
    let kept = pairs.chunks_exact(2).filter(|pair| from.contains(&pair[1])).flatten();
    (Op::Phi, [*of, *id].iter().chain(kept).copied().collect())
}

/// The value of an instruction within a function.
fn result_of(opcode: Op, operands: &[u32]) -> Option<u32> {
    match opcode {
        Op::Label => operands.first().copied(),
        Op::Variable => operands.get(1).copied(),
        _ if is_pure(opcode) => operands.get(1).copied(),
        _ => None,
    }
}

/// True of operations that do nothing but make a value. Functions of GLSL that write through a pointer are none of this project's.
fn is_pure(opcode: Op) -> bool {
    // Access chains, vectors and composites, images, conversions, arithmetic, comparisons, bits.
    let runs = [
        Op::AccessChain..=Op::PtrAccessChain,
        Op::VectorExtractDynamic..=Op::Transpose,
        Op::ImageSampleExplicitLod..=Op::ImageRead,
        Op::Image..=Op::ImageQuerySamples,
        Op::ConvertFToU..=Op::Bitcast,
        Op::SNegate..=Op::SMulExtended,
        Op::Any..=Op::FUnordGreaterThanEqual,
        Op::ShiftRightLogical..=Op::BitCount,
    ];
    let others = [Op::Undef, Op::Load, Op::ExtInst, Op::ArrayLength, Op::CopyObject, Op::Phi, Op::SampledImage];
    others.contains(&opcode) || runs.iter().any(|run| run.contains(&opcode))
}

/// The code without values that nothing uses. A literal that looks like a value keeps one too many at worst.
fn without_unused(code: Vec<Code>) -> Vec<Code> {
    let by_result: HashMap<u32, usize> =
        code.iter().enumerate().filter_map(|(n, (opcode, words))| Some((result_of(*opcode, words)?, n))).collect();
    let mut is_used: Vec<bool> = code.iter().map(|(opcode, _)| !is_pure(*opcode)).collect();
    let mut ahead: Vec<usize> = (0..code.len()).filter(|n| is_used[*n]).collect();
    while let Some(n) = ahead.pop() {
        for used in code[n].1.iter().filter_map(|id| by_result.get(id)) {
            if !std::mem::replace(&mut is_used[*used], true) {
                ahead.push(*used);
            }
        }
    }
    code.into_iter().zip(is_used).filter(|(_, is_used)| *is_used).map(|(code, _)| code).collect()
}

#[cfg(test)]
mod tests {
    use super::super::module::{EMBEDDED, embedded, malformed, words};
    use super::super::specialize::specialize;
    use super::*;

    /// The predecessors of each block, by label.
    fn predecessors(code: &[Instruction]) -> HashMap<u32, HashSet<u32>> {
        let mut from: HashMap<u32, HashSet<u32>> = HashMap::new();
        for block in blocks(code, &HashMap::new()).unwrap() {
            from.entry(block.label).or_default();
            for to in block.exit.targets {
                from.entry(to).or_default().insert(block.label);
            }
        }
        from
    }

    fn code(words: &[u32]) -> Vec<Instruction<'_>> {
        decode(words).unwrap().into_iter().skip_while(|i| i.opcode != Op::Function).collect()
    }

    /// Every shader, with all constants as they are, 0, 1 and 2: what is left has the form of a module, and stays what it is the second time.
    #[test]
    fn each_phi_has_the_values_of_the_blocks_before_it_and_each_branch_a_label() {
        for (name, bytes) in EMBEDDED {
            for value in [None, Some(0), Some(1), Some(2)] {
                let values: Vec<_> = value.into_iter().flat_map(|value| (0..64).map(move |id| (id, value))).collect();
                let whole = specialize(&words(bytes), &values).unwrap();
                let pruned = remove_dead_code(&whole).unwrap();
                assert!(pruned.len() <= whole.len(), "{name}");
                assert_eq!(remove_dead_code(&pruned).unwrap(), pruned, "{name} {value:?}");
                let code = code(&pruned);
                let from = predecessors(&code);
                let labels: HashSet<u32> =
                    code.iter().filter(|i| i.opcode == Op::Label).map(|i| i.operands[0]).collect();
                assert_eq!(labels, from.keys().copied().collect(), "{name} {value:?}: targets without a label");
                let mut block = 0;
                for i in &code {
                    match (i.opcode, i.operands) {
                        (Op::Label, [label]) => block = *label,
                        (Op::Phi, [_, _, pairs @ ..]) => {
                            let of: HashSet<u32> = pairs.chunks_exact(2).map(|pair| pair[1]).collect();
                            assert_eq!(of, from[&block], "{name} {value:?}: a phi of block {block}");
                        }
                        _ => {}
                    }
                }
            }
        }
    }

    /// What the ray caster writes stays, and most of its code, which other variants run, does not.
    #[test]
    fn a_variant_of_the_ray_caster_is_a_quarter_of_its_code() {
        let whole = specialize(&words(embedded("raycast/surface").unwrap()), &[]).unwrap();
        let pruned = remove_dead_code(&whole).unwrap();
        let count = |words: &[u32], opcode: Option<Op>| {
            code(words).iter().filter(|i| opcode.is_none_or(|of| i.opcode == of)).count()
        };
        assert!(4 * count(&pruned, None) < count(&whole, None), "{}", count(&pruned, None));
        let writes = [&whole, &pruned].map(|words| count(words, Some(Op::ImageWrite)));
        assert!(writes[1] > 0 && writes[1] <= writes[0], "{writes:?}");
    }

    #[test]
    fn a_malformed_module_does_not_panic() {
        malformed(|words, _, _| remove_dead_code(words).is_ok());
    }
}
