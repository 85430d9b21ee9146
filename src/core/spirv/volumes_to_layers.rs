//! Turns three-dimensional images that a module declares into arrays of layers. Texels of both have three coordinates, so that only the
//! type of the image differs. Without this rewrite a shader that works on slices would have to be compiled once for those of a volume
//! and once for those of a batch.

use super::module::{HEADER_WORDS, Instruction, Op, SpirvError, decode, encode, error, text};
use std::collections::{HashMap, HashSet};

/// Operands of an image type behind its identifier and the type of its samples: dimension, depth, arrayed.
const DIMENSION: usize = 2;
const ARRAYED: usize = 4;
const DIMENSION_2D: u32 = 1;
const DIMENSION_3D: u32 = 2;

/// Makes arrays of 2D images of the 3D textures and storage images of these names. Names of other variables, and names that the module does not have,
/// are ignored.
///
/// # Errors
/// The module is invalid, such an image shares its type with one that stays 3D or is sampled with a filter, or two types would become the same.
pub(crate) fn volumes_to_layers(words: &[u32], names: &[&str]) -> Result<Vec<u32>, SpirvError> {
    let instructions = decode(words)?;
    let layered = layered_types(&instructions, names)?;
    if layered.is_empty() {
        return Ok(words.to_vec());
    }
    let mut declared = HashSet::new();
    let mut out = words[..HEADER_WORDS].to_vec();
    for i in &instructions {
        let mut operands = i.operands.to_vec();
        if i.opcode == Op::TypeImage {
            if layered.contains(&operands[0]) {
                operands[DIMENSION] = DIMENSION_2D;
                operands[ARRAYED] = 1;
            }
            if !declared.insert(operands[1..].to_vec()) {
                return error("an image that is to become an array of layers would have the type of another");
            }
        }
        out.extend(encode(i.opcode, &operands));
    }
    Ok(out)
}

/// The three-dimensional image types of the variables of these names.
fn layered_types(instructions: &[Instruction], names: &[&str]) -> Result<HashSet<u32>, SpirvError> {
    let mut named = HashSet::new();
    let (mut volumes, mut pointees, mut sampled) = (HashSet::new(), HashMap::new(), HashMap::new());
    let (mut layered, mut kept) = (HashSet::new(), HashSet::new());
    for i in instructions {
        match (i.opcode, i.operands) {
            (Op::Name, [id, name @ ..]) if names.contains(&text(name).as_str()) => drop(named.insert(*id)),
            (Op::TypeImage, [id, _, DIMENSION_3D, _, 0, ..]) => drop(volumes.insert(*id)),
            (Op::TypeSampledImage, [id, image]) => drop(sampled.insert(*id, *image)),
            (Op::TypePointer, [id, _, to]) => drop(pointees.insert(*id, *to)),
            (Op::Variable, [of, id, ..]) => {
                let Some(pointee) = pointees.get(of) else { continue };
                let (image, is_sampled) = match sampled.get(pointee) {
                    Some(image) => (image, true),
                    None => (pointee, false),
                };
                match (volumes.contains(image), named.contains(id)) {
                    (true, true) if is_sampled => {
                        return error("layers have no filtered samples between them");
                    }
                    (true, true) => drop(layered.insert(*image)),
                    (true, false) => drop(kept.insert(*image)),
                    (false, _) => {}
                }
            }
            _ => {}
        }
    }
    match layered.is_disjoint(&kept) {
        true => Ok(layered),
        false => error("an image that is to become an array of layers shares its type with a volume"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::module::{embedded, words};
    use crate::spirv::reflect::{Dimension, reflect};

    fn dimensions(words: &[u32]) -> Vec<(String, Dimension)> {
        reflect(words).unwrap().bindings.into_iter().map(|b| (b.name, b.dimension)).collect()
    }

    #[test]
    fn named_volumes_become_layers_and_nothing_else_changes() {
        let before = words(embedded("filter/gaussian").unwrap());
        let after = volumes_to_layers(&before, &["source", "target", "nothing"]).unwrap();
        let (old, new) = (reflect(&before).unwrap(), reflect(&after).unwrap());
        for (old, new) in old.bindings.iter().zip(&new.bindings) {
            let becomes = ["source", "target"].contains(&old.name.as_str());
            assert_eq!(old.dimension, if becomes { Dimension::Three } else { Dimension::None }, "{}", old.name);
            assert_eq!(new.dimension, if becomes { Dimension::Layers } else { Dimension::None }, "{}", old.name);
            assert_eq!((old.kind, old.access, old.binding), (new.kind, new.access, new.binding), "{}", old.name);
        }
        assert_eq!((old.params, old.constants, old.local_size), (new.params, new.constants, new.local_size));
        assert_eq!(before.iter().zip(&after).filter(|(a, b)| a != b).count(), 4, "two words of two types");
        // One of the two, and images that have layers already.
        let one = volumes_to_layers(&before, &["target"]).unwrap();
        assert_eq!(dimensions(&one).iter().filter(|(_, d)| *d == Dimension::Layers).count(), 1);
        assert_eq!(volumes_to_layers(&after, &["source", "target"]).unwrap(), after);
    }

    #[test]
    fn what_layers_cannot_be_is_refused() {
        let surface = words(embedded("raycast/surface").unwrap());
        assert!(volumes_to_layers(&surface, &["volume"]).is_err(), "filtered samples");
        let ambient = words(embedded("light_volume/ambient").unwrap());
        assert!(volumes_to_layers(&ambient, &["pyramid_1"]).is_err(), "another volume has the same type");
        // The source of layers has the type that the second texture would get.
        let mut twice = words(embedded("filter/gaussian").unwrap());
        let at = decode(&twice).unwrap().iter().find(|i| i.opcode == Op::TypeImage).unwrap().operands.to_vec();
        let place = twice.windows(at.len()).position(|w| w == at).unwrap() + at.len();
        let other = [&[twice[super::super::module::BOUND], at[1], DIMENSION_2D, at[3], 1][..], &at[5..]].concat();
        twice.splice(place..place, encode(Op::TypeImage, &other));
        assert!(volumes_to_layers(&twice, &["source", "target"]).is_err(), "two equal types");
    }

    #[test]
    fn a_malformed_module_is_an_error() {
        let intact = words(embedded("filter/gaussian").unwrap());
        for cut in (1..intact.len()).step_by(7) {
            let _ = volumes_to_layers(&intact[..cut], &["source", "target"]);
        }
        for at in 3..intact.len() {
            let mut corrupted = intact.clone();
            corrupted[at] ^= 0x0003_0001;
            let _ = volumes_to_layers(&corrupted, &["source", "target"]);
        }
    }
}
