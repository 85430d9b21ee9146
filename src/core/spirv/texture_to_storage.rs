//! Turns textures that a module fetches texel by texel into storage images. On a software device a fetch runs the complete
//! sampler, while an image load is an address and a bounds check. A storage image that is read needs its format in the module
//! (not every device reads without one), so a shader would have to be compiled once for every format. Instead its words are
//! rewritten when the pipeline is made: types, loads and fetches, one instruction for one.

use super::module::{
    BOUND, Capability, HEADER_WORDS, Instruction, MAX_BOUND, Op, SpirvError, StorageImages, decode, decoration, encode,
    error, is_of_images, require, text,
};
pub use ::spirv::ImageFormat;
use std::collections::HashMap;

/// True if a format needs the capability StorageImageExtendedFormats. Of integers slots have unsigned ones of one or two channels only.
fn is_extended(format: ImageFormat) -> bool {
    format > ImageFormat::Rgba8Snorm && format != ImageFormat::R32ui
}

/// Image operand Lod.
const LOD: u32 = 2;
/// Image operands SignExtend and ZeroExtend.
const EXTEND: u32 = 0x3000;

/// Makes read-only storage images of the textures of these names. Filtered samples of them, in code that a specialization constant switches off,
/// become undefined values. Everything else computes the same values.
///
/// # Errors
/// The module is invalid, a name is not that of a texture, or a texture is used other than by fetches without offset and size queries.
pub(crate) fn texture_to_storage(words: &[u32], textures: &[(&str, ImageFormat)]) -> Result<Vec<u32>, SpirvError> {
    if textures.is_empty() {
        return Ok(words.to_vec());
    }
    let instructions = decode(words)?;
    if words[BOUND] > MAX_BOUND - 2 * textures.len() as u32 {
        return error("no identifiers are left for new types");
    }
    let mut rewrite = Rewrite::default();
    rewrite.find(&instructions, textures)?;
    let mut out = words[..HEADER_WORDS].to_vec();
    if textures.iter().any(|(_, format)| is_extended(*format)) {
        require(Capability::StorageImageExtendedFormats, &instructions, &mut out);
    }
    for i in &instructions {
        rewrite.instruction(i.opcode, i.operands, &mut out)?;
    }
    Ok(out)
}

#[derive(Default)]
struct Rewrite {
    /// The variables that become storage images: the operands of the image type after its identifier, without usage and format, and the new format.
    textures: HashMap<u32, (Vec<u32>, ImageFormat)>,
    new_types: StorageImages,
    /// By variable: the new type of its image.
    types: HashMap<u32, u32>,
    /// By loaded image: its new type.
    loaded: HashMap<u32, u32>,
}

impl Rewrite {
    fn find(&mut self, instructions: &[Instruction], textures: &[(&str, ImageFormat)]) -> Result<(), SpirvError> {
        let (mut names, mut pointees, mut sampled, mut images) =
            (HashMap::new(), HashMap::new(), HashMap::new(), HashMap::new());
        for i in instructions {
            match i.opcode {
                Op::Name => drop(names.insert(i.operands[0], text(&i.operands[1..]))),
                Op::TypeImage => drop(images.insert(i.operands[0], &i.operands[1..])),
                Op::TypeSampledImage => drop(sampled.insert(i.operands[0], i.operands[1])),
                Op::TypePointer => drop(pointees.insert(i.operands[0], i.operands[2])),
                Op::Variable => {
                    let pointee = pointees.get(&i.operands[0]).copied().unwrap_or(0);
                    let image = sampled.get(&pointee).copied().unwrap_or(pointee);
                    let Some(shape) = images.get(&image) else { continue };
                    let Some(called) = names.get(&i.operands[1]) else { continue };
                    let Some((name, format)) = textures.iter().find(|(name, _)| name == called) else { continue };
                    // Sampled type, dimension, depth, arrayed, multisampled, usage, format.
                    if shape[5] != 1 {
                        return error(format!("'{name}' is not a texture"));
                    }
                    self.textures.insert(i.operands[1], (shape[..5].to_vec(), *format));
                }
                _ => {}
            }
        }
        let found = |name: &str| self.textures.keys().any(|id| names.get(id).is_some_and(|called| called == name));
        match textures.iter().find(|(name, _)| !found(name)) {
            Some((name, _)) => error(format!("'{name}' is not a texture")),
            None => Ok(()),
        }
    }

    /// Appends the rewritten instruction, after whatever it needs declared.
    fn instruction(&mut self, opcode: Op, a: &[u32], out: &mut Vec<u32>) -> Result<(), SpirvError> {
        let loaded = |at: usize| a.get(at).and_then(|id| self.loaded.get(id)).copied();
        let rewritten = match opcode {
            // Every variable has exactly one Binding decoration.
            Op::Decorate if a.get(1) == Some(&decoration::BINDING) && self.textures.contains_key(&a[0]) => {
                out.extend(encode(Op::Decorate, &[a[0], decoration::NON_WRITABLE]));
                encode(opcode, a)
            }
            Op::Variable if let Some((shape, format)) = self.textures.get(&a[1]) => {
                let [image, pointer] = self.new_types.declare(shape, *format, out);
                self.types.insert(a[1], image);
                encode(opcode, &[pointer, a[1], a[2]])
            }
            Op::Load if a.len() >= 3 && self.types.contains_key(&a[2]) => {
                let of = self.types[&a[2]];
                self.loaded.insert(a[1], of);
                encode(opcode, &[of, a[1], a[2]])
            }
            // Extracts the texture of a combined one: now a copy of the storage image.
            Op::Image => match loaded(2) {
                Some(of) => {
                    self.loaded.insert(a[1], of);
                    encode(Op::CopyObject, &[of, a[1], a[2]])
                }
                None => encode(opcode, a),
            },
            // There is only one mip level. The operands that say how integers are extended are kept.
            Op::ImageFetch if loaded(2).is_some() => {
                match a.get(4).map(|operands| (operands & !(LOD | EXTEND), operands & EXTEND)) {
                    None | Some((0, 0)) => encode(Op::ImageRead, &a[..4]),
                    Some((0, extend)) => encode(Op::ImageRead, &[&a[..4], &[extend]].concat()),
                    Some(_) => return error("a fetch with an offset cannot become an image load"),
                }
            }
            Op::ImageQuerySizeLod if loaded(2).is_some() => encode(Op::ImageQuerySize, &a[..3]),
            Op::ImageSampleExplicitLod if loaded(2).is_some() => encode(Op::Undef, &a[..2]),
            // Any other use of an image: calls, copies, selections, other samples.
            _ if (is_of_images(opcode)
                || matches!(opcode, Op::FunctionCall | Op::CopyObject | Op::Select | Op::Phi))
                && (2..a.len()).any(|at| loaded(at).is_some()) =>
            {
                return error(format!("operation {opcode:?} uses a texture that is to become a storage image"));
            }
            _ => encode(opcode, a),
        };
        out.extend(rewritten);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::module::{embedded, malformed, words};
    use crate::spirv::reflect::{Access, Dimension, Kind, reflect};

    #[test]
    fn named_textures_become_storage_images_of_their_format_and_nothing_else_changes() {
        let before = words(embedded("shade/light").unwrap());
        let after =
            texture_to_storage(&before, &[("distance_map", ImageFormat::R32f), ("shadow", ImageFormat::R16f)]).unwrap();
        let (old, new) = (reflect(&before).unwrap(), reflect(&after).unwrap());
        for (old, new) in old.bindings.iter().zip(&new.bindings) {
            let becomes = ["distance_map", "shadow"].contains(&old.name.as_str());
            assert_eq!((&old.name, old.binding, old.dimension), (&new.name, new.binding, new.dimension));
            assert_eq!(new.kind, if becomes { Kind::Storage } else { old.kind }, "{}", old.name);
            assert_eq!(new.access, old.access, "{}", old.name);
        }
        assert_eq!((old.params, old.constants, old.local_size), (new.params, new.constants, new.local_size));
        let count = |words: &[u32], opcode| decode(words).unwrap().iter().filter(|i| i.opcode == opcode).count();
        assert_eq!(count(&before, Op::ImageFetch), count(&after, Op::ImageFetch) + count(&after, Op::ImageRead));
        assert_eq!(
            count(&after, Op::ImageFetch),
            6,
            "cut faces, surface, composited volume (three times) and occlusion stay textures"
        );
    }

    #[test]
    fn a_sampled_volume_becomes_a_storage_image() {
        let before = words(embedded("raycast/surface").unwrap());
        let after = texture_to_storage(&before, &[("volume", ImageFormat::R8)]).unwrap();
        let volume = reflect(&after).unwrap().bindings.into_iter().find(|b| b.name == "volume").unwrap();
        assert_eq!((volume.kind, volume.access, volume.dimension), (Kind::Storage, Access::Read, Dimension::Three));
    }

    #[test]
    fn other_bindings_are_refused_and_a_malformed_module_is_an_error() {
        let intact = words(embedded("raycast/surface").unwrap());
        for name in ["distance_map", "sweep_lut", "Params", "nothing"] {
            assert!(texture_to_storage(&intact, &[(name, ImageFormat::R8)]).is_err(), "{name}");
        }
        malformed(|words, texture, _| texture_to_storage(words, &[(texture, ImageFormat::R8)]).is_ok());
    }
}
