//! Checks a pass's declaration against its shader: names, types, access and dimensions. Needs no GPU.

use super::pass::{Bind, DispatchArgs, Params, Pass, Slot, Value};
use super::slots::Shape;
use crate::scene::Scene;
use crate::spirv::hoist_uniforms::hoist_uniforms;
use crate::spirv::storage_to_texel_buffer::storage_to_texel_buffer;
use crate::spirv::strip_bindings::strip_bindings;
use crate::spirv::texture_to_storage::{ImageFormat, texture_to_storage};
use crate::spirv::volumes_to_layers::volumes_to_layers;
use crate::spirv::{self, Access, Dimension, Kind, Member, Module};

/// Textures and tables that a shader declares and a pass may not bind. Specialization constants say whether they are read or written.
const OPTIONAL: [&str; 35] = [
    "back_light",
    "before",
    "bricks",
    "cap",
    "composited",
    "curve_columns",
    "cuts",
    "distance_map",
    "front",
    "guide",
    "hit_distance",
    "light_normals",
    "light_shade",
    "line_lut",
    "line_shares",
    "majorants",
    "marks",
    "occlusion",
    "opaque_before",
    "packed_neighbours",
    "planes",
    "rows",
    "shadow",
    "single",
    "slice_places",
    "slice_table",
    "start_curve",
    "start_surface",
    "step_result",
    "surface",
    "sweep_lut",
    "tgc",
    "tiles",
    "volume_bricks",
    "volume_layer",
];

/// Rewrites a pass's shader for a scene. Optional textures and tables that the pass does not bind in this scene are removed. Textures whose slot is
/// an array of layers in this scene become array images.
///
/// # Errors
/// The SPIR-V module is invalid.
pub fn for_scene(pass: &Pass, scene: &Scene, args: &DispatchArgs, words: &[u32]) -> Result<Vec<u32>, String> {
    let bound = [pass.reads(scene, args), pass.writes(scene, args)].concat();
    let absent: Vec<_> = OPTIONAL.into_iter().filter(|name| bound.iter().all(|b| b.name != *name)).collect();
    let words = strip_bindings(words, &absent).map_err(|e| e.to_string())?;
    let layered: Vec<_> = bound.iter().filter(|bind| bind.slot.is_layered(scene)).map(|bind| bind.name).collect();
    volumes_to_layers(&words, &layered).map_err(|e| e.to_string())
}

/// Rewrites a pass's shader for fast execution on a CPU: parameters are loaded once. Of the slots for which `stores` is true, textures that are only
/// fetched become storage images and tables become storage texel buffers. `stores`: whether the device can bind a slot in that way.
///
/// # Errors
/// The SPIR-V module is invalid.
pub fn for_cpu(
    pass: &Pass,
    scene: &Scene,
    args: &DispatchArgs,
    words: &[u32],
    stores: impl Fn(Slot) -> bool,
) -> Result<Vec<u32>, String> {
    let module = spirv::reflect(words).map_err(|e| e.to_string())?;
    let is_texture = |bind: &Bind| {
        let binding = module.bindings.iter().find(|b| b.name == bind.name);
        binding.is_some_and(|b| matches!(b.kind, Kind::Sampled | Kind::Filtered))
    };
    let reads = pass.reads(scene, args);
    let textures: Vec<_> = reads
        .iter()
        .filter(|bind| !bind.filtered && stores(bind.slot) && is_texture(bind))
        .filter_map(|bind| Some((bind.name, ImageFormat::from_u32(bind.slot.format(scene) as u32)?)))
        .collect();
    let words =
        hoist_uniforms(words).and_then(|words| texture_to_storage(&words, &textures)).map_err(|e| e.to_string())?;
    storage_to_texel_buffer(&words, |name| reads.iter().any(|b| b.name == name && stores(b.slot)))
        .map_err(|e| e.to_string())
}

/// Checks a pass's declaration against its shader's reflection: bindings, parameters and constants, and that the width of a workgroup is a multiple
/// of 8.
///
/// # Errors
/// The first disagreement, with what the declaration and the shader say.
pub fn check(pass: &Pass, scene: &Scene, args: &DispatchArgs, module: &Module) -> Result<(), String> {
    let (reads, writes) = (pass.reads(scene, args), pass.writes(scene, args));
    reads.iter().try_for_each(|bind| check_bind(scene, module, bind, Access::Read))?;
    writes.iter().try_for_each(|bind| check_bind(scene, module, bind, Access::Write))?;
    for binding in module.bindings.iter().filter(|b| b.kind != Kind::Params) {
        if !reads.iter().chain(&writes).any(|b| b.name == binding.name) {
            return Err(format!("glsl declares '{}', the pass neither reads nor writes it", binding.name));
        }
    }
    check_params(module, &pass.numbers(scene, args))?;
    let constants = pass.constants(scene, args);
    for (name, _) in &constants {
        if !module.constants.iter().any(|c| c.name == *name) {
            return Err(format!("the pass sets constant '{name}', glsl has none of that name"));
        }
    }
    for constant in &module.constants {
        if !constants.iter().any(|(name, _)| *name == constant.name) {
            return Err(format!("glsl has constant '{}', the pass does not set it", constant.name));
        }
    }
    match module.local_size[0] % 8 {
        0 => Ok(()),
        _ => Err(format!("workgroup width {} is no multiple of 8", module.local_size[0])),
    }
}

fn check_bind(scene: &Scene, module: &Module, bind: &Bind, access: Access) -> Result<(), String> {
    let verb = if access == Access::Read { "reads" } else { "writes" };
    let Some(binding) = module.bindings.iter().find(|b| b.name == bind.name) else {
        return Err(format!("the pass {verb} '{}', glsl declares nothing of that name", bind.name));
    };
    if binding.access != access {
        return Err(format!("glsl declares '{}' {:?}, the pass {verb} it", bind.name, binding.access));
    }
    if bind.filtered && binding.kind != Kind::Filtered {
        return Err(format!("glsl declares '{}' {:?}, the pass takes filtered samples of it", bind.name, binding.kind));
    }
    let declared = binding.dimension;
    let there = match bind.slot.shape(scene) {
        Shape::Two(_) => Dimension::Two,
        Shape::Layers(_) => Dimension::Layers,
        Shape::Three(_) => Dimension::Three,
        Shape::Buffer(_) => Dimension::None,
    };
    match declared == there {
        true => Ok(()),
        false => Err(format!("glsl declares '{}' {declared:?}, slot '{}' is {there:?}", bind.name, bind.slot.name())),
    }
}

fn check_params(module: &Module, params: &Params) -> Result<(), String> {
    for (i, (name, _)) in params.0.iter().enumerate() {
        if params.0[..i].iter().any(|(n, _)| n == name) {
            return Err(format!("the pass sets parameter '{name}' twice"));
        }
        // A block that a variant does not use at all is optimised away.
        if !module.params.is_empty() && !module.params.iter().any(|m| m.name == *name) {
            return Err(format!("the pass sets parameter '{name}', glsl has none of that name"));
        }
    }
    for member in &module.params {
        let Some((_, value)) = params.0.iter().find(|(name, _)| *name == member.name) else {
            return Err(format!("glsl has parameter '{}', the pass does not set it", member.name));
        };
        if !fits(member, value) {
            return Err(format!("glsl declares '{}' as {}, the pass sets {value:?}", member.name, type_name(member)));
        }
    }
    Ok(())
}

fn fits(member: &Member, value: &Value) -> bool {
    let is_type = match value {
        Value::I32(_) => !member.is_float && member.is_signed,
        _ => member.is_float,
    };
    // Every component has 4 bytes.
    is_type && 4 * member.components as usize == bytes_of(value).len()
}

fn type_name(member: &Member) -> String {
    let scalar = match (member.is_float, member.is_signed) {
        (true, _) => "float",
        (false, true) => "int",
        (false, false) => "uint",
    };
    if member.components == 1 { scalar.into() } else { format!("{scalar} x {}", member.components) }
}

fn bytes_of(value: &Value) -> &[u8] {
    match value {
        Value::F32(v) => bytemuck::bytes_of(v),
        Value::I32(v) => bytemuck::bytes_of(v),
        Value::Vec2(v) => bytemuck::bytes_of(v),
        Value::Vec3(v) => bytemuck::bytes_of(v),
        Value::Vec4(v) => bytemuck::bytes_of(v),
        Value::Floats(v) => bytemuck::cast_slice(&v[..]),
    }
}

/// Packs the parameters into the bytes of the parameter block that the shader declares. A member without a parameter of its name is 0.
pub fn pack(module: &Module, params: &Params) -> Vec<u8> {
    let mut block = vec![0; module.params_size as usize];
    for member in &module.params {
        let Some((_, value)) = params.0.iter().find(|(name, _)| *name == member.name) else { continue };
        let (at, bytes) = (member.offset as usize, bytes_of(value));
        block[at..at + bytes.len()].copy_from_slice(bytes);
    }
    block
}
