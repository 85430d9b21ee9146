//! Turns arrays of two-dimensional images that a module declares into single images, which hold one layer: for programs that run a shader and
//! have no arrays of images.

use super::module::{BOUND, HEADER_WORDS, Instruction, Op, SpirvError, decode, encode, error, is_of_images, next_id};
use std::collections::{HashMap, HashSet};

/// Operand of an image type: whether it is an array.
const ARRAYED: usize = 4;
const DIMENSION_2D: u32 = 1;

/// Replaces each array of 2D images in the module by a single 2D image; the layer that the code names is ignored. The module computes the same as
/// before on an array of one layer.
///
/// # Errors
/// The module is invalid, has too many identifiers or instructions, or uses an array of images other than by texels read and written, and by queries
/// of its size.
pub fn one_layer(words: &[u32]) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    // Two new identifiers for an instruction at most: with this many of both, the bound stays in its limit.
    if words[BOUND] > 0xf_ffff || instructions.len() > 0xf_ffff {
        return error("no identifiers are left for new values");
    }
    let mut out = words[..HEADER_WORDS].to_vec();
    let mut rewrite = Rewrite::default();
    rewrite.find(&instructions, &mut out);
    if rewrite.layered.is_empty() {
        return Ok(words.to_vec());
    }
    for i in &instructions {
        rewrite.instruction(i.opcode, i.operands, &mut out)?;
    }
    Ok(out)
}

#[derive(Default)]
struct Rewrite {
    /// Types of arrays, and of arrays with a sampler.
    layered: HashSet<u32>,
    /// Types that become equal to one before them, which takes their place.
    same: HashMap<u32, u32>,
    /// The type of a signed integer, and of vectors of two and three; 0 if there is none.
    int: u32,
    pair: u32,
    triple: u32,
    /// The module declares no pair; it is declared before the first function.
    declares_pair: bool,
    /// The constant 1, once it is declared.
    one: u32,
    /// Vectors of three integers.
    triples: HashSet<u32>,
    /// Arrays that were loaded.
    loaded: HashSet<u32>,
}

impl Rewrite {
    fn find(&mut self, instructions: &[Instruction], out: &mut [u32]) {
        let mut first = HashMap::new();
        for i in instructions {
            let a = i.operands;
            match i.opcode {
                Op::TypeInt if a.get(1..3) == Some(&[32, 1]) => self.int = a[0],
                Op::TypeVector if self.int != 0 && a[1..3] == [self.int, 2] => self.pair = a[0],
                Op::TypeVector if self.int != 0 && a[1..3] == [self.int, 3] => self.triple = a[0],
                Op::TypeImage | Op::TypeSampledImage => {
                    if is_array(i.opcode, a) || i.opcode == Op::TypeSampledImage && self.layered.contains(&a[1]) {
                        self.layered.insert(a[0]);
                    }
                    let becomes = self.type_of_image(i.opcode, a)[1..].to_vec();
                    let kept = *first.entry((i.opcode, becomes)).or_insert(a[0]);
                    if kept != a[0] {
                        self.same.insert(a[0], kept);
                    }
                }
                _ => {}
            }
        }
        if self.pair == 0 {
            self.pair = next_id(out);
            self.declares_pair = true;
        }
    }

    /// The operands of the type of an image, or of one with a sampler.
    fn type_of_image(&self, opcode: Op, a: &[u32]) -> Vec<u32> {
        let mut operands = a.to_vec();
        match opcode {
            Op::TypeSampledImage => operands[1] = self.kept(a[1]),
            _ if is_array(opcode, a) => operands[ARRAYED] = 0,
            _ => {}
        }
        operands
    }

    fn kept(&self, of: u32) -> u32 {
        self.same.get(&of).copied().unwrap_or(of)
    }

    /// Appends the rewritten instruction, after whatever it needs.
    fn instruction(&mut self, opcode: Op, a: &[u32], out: &mut Vec<u32>) -> Result<(), SpirvError> {
        let is_loaded = |id: &u32| self.loaded.contains(id);
        let rewritten = match (opcode, a) {
            (Op::Name | Op::TypeImage | Op::TypeSampledImage, [id, ..]) if self.same.contains_key(id) => {
                return Ok(());
            }
            (Op::TypeImage | Op::TypeSampledImage, _) => encode(opcode, &self.type_of_image(opcode, a)),
            (Op::TypePointer, [id, class, to]) => encode(opcode, &[*id, *class, self.kept(*to)]),
            (Op::Function, _) => {
                self.declare(out)?;
                encode(opcode, a)
            }
            (Op::Load | Op::Image, [of, id, rest @ ..]) => {
                if self.layered.contains(of) {
                    self.loaded.insert(*id);
                }
                encode(opcode, &[&[self.kept(*of), *id], rest].concat())
            }
            (Op::ImageFetch | Op::ImageRead, [of, id, image, at, rest @ ..]) if is_loaded(image) => {
                let place = self.place(*at, out)?;
                encode(opcode, &[&[*of, *id, *image, place], rest].concat())
            }
            (Op::ImageWrite, [image, at, rest @ ..]) if is_loaded(image) => {
                let place = self.place(*at, out)?;
                encode(opcode, &[&[*image, place], rest].concat())
            }
            (Op::ImageQuerySize | Op::ImageQuerySizeLod, [of, id, rest @ ..])
                if rest.first().is_some_and(is_loaded) =>
            {
                if *of != self.triple {
                    return error("the size of an array of images is no vector of three integers");
                }
                let size = next_id(out);
                out.extend(encode(opcode, &[&[self.pair, size], rest].concat()));
                encode(Op::CompositeConstruct, &[*of, *id, size, self.one])
            }
            // Any other use: calls, copies, selections, samples.
            (of, [_, _, used @ ..])
                if (is_of_images(of) || matches!(of, Op::FunctionCall | Op::CopyObject | Op::Select | Op::Phi))
                    && used.iter().any(is_loaded) =>
            {
                return error(format!("operation {opcode:?} uses an array of images"));
            }
            _ => encode(opcode, a),
        };
        // Of these no other operand than a type can have the number of one.
        let is_value = opcode >= Op::ConstantTrue && !matches!(opcode, Op::Decorate | Op::MemberDecorate);
        if let ([of, id, ..], true) = (a, is_value || opcode == Op::Undef)
            && *of == self.triple
        {
            self.triples.insert(*id);
        }
        out.extend(rewritten);
        Ok(())
    }

    /// Declares what is missing, before the first function.
    fn declare(&mut self, out: &mut Vec<u32>) -> Result<(), SpirvError> {
        if self.one != 0 {
            return Ok(());
        }
        if self.int == 0 || self.triple == 0 {
            return error("a module with arrays of images has no vectors of three integers");
        }
        if self.declares_pair {
            out.extend(encode(Op::TypeVector, &[self.pair, self.int, 2]));
        }
        self.one = next_id(out);
        out.extend(encode(Op::Constant, &[self.int, self.one, 1]));
        Ok(())
    }

    /// The first two of three coordinates.
    fn place(&mut self, at: u32, out: &mut Vec<u32>) -> Result<u32, SpirvError> {
        if !self.triples.contains(&at) {
            return error("a texel of an array of images has other than three integers as its place");
        }
        let place = next_id(out);
        out.extend(encode(Op::VectorShuffle, &[self.pair, place, at, at, 0, 1]));
        Ok(place)
    }
}

/// `a`: operands of the type of an image.
fn is_array(opcode: Op, a: &[u32]) -> bool {
    opcode == Op::TypeImage && (a[2], a[ARRAYED]) == (DIMENSION_2D, 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::module::{EMBEDDED, malformed, words};
    use crate::spirv::reflect::{Dimension, reflect};
    use crate::spirv::volumes_to_layers::volumes_to_layers;

    fn has_layers(words: &[u32]) -> bool {
        reflect(words).unwrap().bindings.iter().any(|b| b.dimension == Dimension::Layers)
    }

    /// Of the modules with arrays, also with those that a scene makes of volumes.
    #[test]
    fn arrays_become_images_and_nothing_else_changes() {
        let mut changed = 0;
        for (name, bytes) in EMBEDDED {
            let declared = words(bytes);
            let arrayed = volumes_to_layers(&declared, &["target"]).unwrap_or_else(|_| declared.clone());
            for before in [declared, arrayed] {
                let after = one_layer(&before).unwrap_or_else(|e| panic!("{name}: {e}"));
                if !has_layers(&before) {
                    assert_eq!(after, before, "{name}");
                    continue;
                }
                changed += 1;
                let (mut old, new) = (reflect(&before).unwrap(), reflect(&after).unwrap());
                for binding in old.bindings.iter_mut().filter(|b| b.dimension == Dimension::Layers) {
                    binding.dimension = Dimension::Two;
                }
                assert_eq!(new, old, "{name}");
                let count =
                    |words: &[u32], opcode| decode(words).unwrap().iter().filter(|i| i.opcode == opcode).count();
                for opcode in [Op::ImageFetch, Op::ImageWrite, Op::ImageQuerySize, Op::ImageQuerySizeLod] {
                    assert_eq!(count(&after, opcode), count(&before, opcode), "{name}");
                }
                let types = decode(&after).unwrap();
                let images: Vec<_> =
                    types.iter().filter(|i| i.opcode == Op::TypeImage).map(|i| &i.operands[1..]).collect();
                assert_eq!(
                    images.iter().collect::<HashSet<_>>().len(),
                    images.len(),
                    "{name}: a type is declared twice"
                );
            }
        }
        assert!(changed > 20, "{changed} modules have arrays of images");
    }

    #[test]
    fn a_malformed_module_is_an_error_and_not_a_panic() {
        malformed(|words, _, _| one_layer(words).is_ok());
    }
}
