//! Textures that a module fetches texel by texel, read as storage images instead. Where the device is a CPU a fetch goes through
//! the whole of its sampler, and a load is an address and a bounds check. A storage image that is read has its format in the module
//! (reading without one is not everywhere), so a shader would have to be compiled once more for every format; instead its words are
//! rewritten when the pipeline is made: types, loads and fetches, one instruction for one.

use super::{SpirvError, error, text};
use std::collections::HashMap;

/// Formats of storage images, by their numbers in the SPIR-V specification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageFormat {
    Rgba32f = 1,
    Rgba16f = 2,
    R32f = 3,
    Rgba8 = 4,
    Rg32f = 6,
    Rg16f = 7,
    R16f = 9,
    Rg16 = 12,
    R16 = 14,
    R8 = 15,
    R32ui = 33,
    Rg32ui = 35,
}

impl ImageFormat {
    /// Whether it needs the capability of extended formats.
    fn is_extended(self) -> bool {
        self as u32 > 5 && self != ImageFormat::R32ui
    }
}

pub(super) const EXTENDED_FORMATS: u32 = 49;
pub(super) const NON_WRITABLE: u32 = 24;
const LOD: u32 = 2;
/// SignExtend and ZeroExtend.
const EXTENDED: u32 = 0x3000;

pub(super) fn instruction(opcode: u32, operands: &[u32]) -> Vec<u32> {
    let mut words = vec![(operands.len() as u32 + 1) << 16 | opcode];
    words.extend_from_slice(operands);
    words
}

/// The module with the textures of these names as storage images that are only read. Filtered samples of them, which a
/// specialization constant keeps from being taken, become undefined values; everything else computes what it did.
///
/// # Errors
/// A name that is no texture, or a texture that is used in any way besides fetches without offset and questions after its size.
pub fn as_storage(words: &[u32], textures: &[(&str, ImageFormat)]) -> Result<Vec<u32>, SpirvError> {
    if textures.is_empty() {
        return Ok(words.to_vec());
    }
    let whole = super::instructions(words)?;
    // The largest bound that every consumer of SPIR-V has to take.
    if words[3] > 0x3f_ffff - 2 * textures.len() as u32 {
        return error("no numbers are left for new types");
    }
    let mut rewriting = Rewriting { bound: words[3], ..Rewriting::default() };
    rewriting.look(&whole, textures)?;
    let mut out = words[..5].to_vec();
    if textures.iter().any(|(_, format)| format.is_extended())
        && !whole.iter().any(|i| i.opcode == 17 && i.operands == [EXTENDED_FORMATS])
    {
        out.extend(instruction(17, &[EXTENDED_FORMATS]));
    }
    for i in &whole {
        rewriting.rewrite(i.opcode, i.operands, &mut out)?;
    }
    out[3] = rewriting.bound;
    Ok(out)
}

#[derive(Default)]
struct Rewriting {
    bound: u32,
    /// The variables that become storage images.
    formats: HashMap<u32, ImageFormat>,
    /// By the variable: the operands of its image's type behind the type's own number.
    shapes: HashMap<u32, Vec<u32>>,
    /// New types of an image and of a pointer to it, by shape and format.
    made: HashMap<(Vec<u32>, ImageFormat), (u32, u32)>,
    /// The new type of a variable's image.
    types: HashMap<u32, u32>,
    /// Images in hand: their new type.
    held: HashMap<u32, u32>,
}

impl Rewriting {
    fn look(&mut self, whole: &[super::Instruction], textures: &[(&str, ImageFormat)]) -> Result<(), SpirvError> {
        let (mut names, mut pointees, mut sampled, mut images) =
            (HashMap::new(), HashMap::new(), HashMap::new(), HashMap::new());
        for i in whole {
            match i.opcode {
                5 => drop(names.insert(i.operands[0], text(&i.operands[1..]))),
                25 => drop(images.insert(i.operands[0], &i.operands[1..])),
                27 => drop(sampled.insert(i.operands[0], i.operands[1])),
                32 => drop(pointees.insert(i.operands[0], i.operands[2])),
                59 => {
                    let pointee = pointees.get(&i.operands[0]).copied().unwrap_or(0);
                    let image = sampled.get(&pointee).copied().unwrap_or(pointee);
                    let Some(shape) = images.get(&image) else { continue };
                    let Some(called) = names.get(&i.operands[1]) else { continue };
                    let Some((name, format)) = textures.iter().find(|(name, _)| name == called) else { continue };
                    // Type, dimension, depth, arrayed, multisampled, sampled, format.
                    if shape[5] != 1 {
                        return error(format!("'{name}' is no texture"));
                    }
                    self.formats.insert(i.operands[1], *format);
                    self.shapes.insert(i.operands[1], shape[..5].to_vec());
                }
                _ => {}
            }
        }
        let found = |name: &str| self.formats.keys().any(|id| names.get(id).is_some_and(|called| called == name));
        match textures.iter().find(|(name, _)| !found(name)) {
            Some((name, _)) => error(format!("'{name}' is no texture")),
            None => Ok(()),
        }
    }

    fn next_id(&mut self) -> u32 {
        self.bound += 1;
        self.bound - 1
    }

    /// One instruction as it is now, and what has to stand before it.
    fn rewrite(&mut self, opcode: u32, a: &[u32], out: &mut Vec<u32>) -> Result<(), SpirvError> {
        let held = |at: usize| a.get(at).and_then(|id| self.held.get(id)).copied();
        let now = match opcode {
            // OpDecorate Binding: the variable's one decoration that is there for certain.
            71 if a.get(1) == Some(&33) && self.formats.contains_key(&a[0]) => {
                out.extend(instruction(71, &[a[0], NON_WRITABLE]));
                instruction(opcode, a)
            }
            // OpVariable
            59 if self.formats.contains_key(&a[1]) => {
                let pointer = self.declare(a[1], out);
                instruction(opcode, &[pointer, a[1], a[2]])
            }
            // OpLoad
            61 if a.len() >= 3 && self.types.contains_key(&a[2]) => {
                let of = self.types[&a[2]];
                self.held.insert(a[1], of);
                instruction(opcode, &[of, a[1], a[2]])
            }
            // OpImage, the texture of a sampled one, is the image itself: OpCopyObject
            100 => match held(2) {
                Some(of) => {
                    self.held.insert(a[1], of);
                    instruction(83, &[of, a[1], a[2]])
                }
                None => instruction(opcode, a),
            },
            // OpImageFetch: OpImageRead. There is one level only. What says how integers are extended stays.
            95 if held(2).is_some() => {
                match a.get(4).map(|operands| (operands & !(LOD | EXTENDED), operands & EXTENDED)) {
                    None | Some((0, 0)) => instruction(98, &a[..4]),
                    Some((0, extended)) => instruction(98, &[&a[..4], &[extended]].concat()),
                    Some(_) => return error("a fetch with an offset cannot become a load"),
                }
            }
            // OpImageQuerySizeLod: OpImageQuerySize
            103 if held(2).is_some() => instruction(104, &a[..3]),
            // OpImageSampleExplicitLod: OpUndef
            88 if held(2).is_some() => instruction(1, &a[..2]),
            // Whatever else takes an image: calls, copies, choices, other samples.
            57 | 83 | 86..=107 | 169 | 245 if (2..a.len()).any(|at| held(at).is_some()) => {
                return error(format!("operation {opcode} on a texture that is to be a storage image"));
            }
            _ => instruction(opcode, a),
        };
        out.extend(now);
        Ok(())
    }

    /// Types of a variable's storage image, declared once, and the pointer's.
    fn declare(&mut self, variable: u32, out: &mut Vec<u32>) -> u32 {
        let (shape, format) = (self.shapes[&variable].clone(), self.formats[&variable]);
        let key = (shape, format);
        let (image, pointer) = match self.made.get(&key) {
            Some(made) => *made,
            None => {
                let (image, pointer) = (self.next_id(), self.next_id());
                let mut operands = vec![image];
                operands.extend(&key.0);
                operands.extend([2, format as u32]);
                out.extend(instruction(25, &operands));
                out.extend(instruction(32, &[pointer, 0, image]));
                self.made.insert(key, (image, pointer));
                (image, pointer)
            }
        };
        self.types.insert(variable, image);
        pointer
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::{Access, Dimension, Kind, embedded, reflect, words};

    #[test]
    fn a_texture_becomes_a_storage_image_of_its_own_format_and_nothing_else_changes() {
        let before = words(embedded("shade/light.shadowed").unwrap());
        let after = as_storage(&before, &[("distance_map", ImageFormat::R32f), ("shadow", ImageFormat::R16f)]).unwrap();
        let (old, new) = (reflect(&before).unwrap(), reflect(&after).unwrap());
        for (old, new) in old.bindings.iter().zip(&new.bindings) {
            let becomes = ["distance_map", "shadow"].contains(&old.name.as_str());
            assert_eq!((&old.name, old.binding, old.dimension), (&new.name, new.binding, new.dimension));
            assert_eq!(new.kind, if becomes { Kind::Storage } else { old.kind }, "{}", old.name);
            assert_eq!(new.access, old.access, "{}", old.name);
        }
        assert_eq!((old.params, old.constants, old.local_size), (new.params, new.constants, new.local_size));
        let fetches = |words: &[u32], opcode| {
            super::super::instructions(words).unwrap().iter().filter(|i| i.opcode == opcode).count()
        };
        assert_eq!(fetches(&before, 95), fetches(&after, 95) + fetches(&after, 98));
        assert_eq!(fetches(&after, 95), 1, "the surface stays a texture");
    }

    #[test]
    fn a_sampled_volume_becomes_a_storage_image() {
        let before = words(embedded("raycast/surface.moved").unwrap());
        let after = as_storage(&before, &[("volume", ImageFormat::R8)]).unwrap();
        let volume = reflect(&after).unwrap().bindings.into_iter().find(|b| b.name == "volume").unwrap();
        assert_eq!((volume.kind, volume.access, volume.dimension), (Kind::Storage, Access::Read, Dimension::Three));
    }

    #[test]
    fn what_is_no_texture_is_refused_and_a_broken_module_is_an_error() {
        let whole = words(embedded("raycast/surface.moved").unwrap());
        for name in ["distance_map", "sweep_lut", "Params", "nothing"] {
            assert!(as_storage(&whole, &[(name, ImageFormat::R8)]).is_err(), "{name}");
        }
        for cut in 1..whole.len() {
            let _ = as_storage(&whole[..cut], &[("volume", ImageFormat::R8)]);
        }
        for at in 3..whole.len() {
            let mut bent = whole.clone();
            bent[at] ^= 0x0003_0001;
            let _ = as_storage(&bent, &[("volume", ImageFormat::R8)]);
        }
    }
}
