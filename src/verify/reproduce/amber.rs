//! A dispatch as a script for Amber (google/amber), which runs it on any driver without this program: the shader, its inputs and what is
//! expected of every texel.

use super::{Array, Case};
use crate::passes::slots::Format;
use crate::spirv::{Access, Dimension, Kind};
use std::fmt::Write as _;

/// Name of the file in the folder of a reproduction.
pub(super) const FILE: &str = "reproduce.amber";

/// Most values that a script may hold: it is to be read by people, too.
const MAX_VALUES: usize = 400_000;

/// The script.
///
/// # Errors
/// One line: why the dispatch cannot be expressed.
pub(super) fn script(case: &Case) -> Result<String, String> {
    let values: usize = case.arrays.iter().map(|array| array.bytes.len() / array.format.channel_bytes()).sum();
    if values > MAX_VALUES {
        return Err(format!("{values} values are too many for a script"));
    }
    let mut text = format!("#!amber\n# {}\n", case.title.replace('\n', " "));
    text += "DEVICE_FEATURE shaderStorageImageWriteWithoutFormat\nDEVICE_FEATURE shaderStorageImageExtendedFormats\n\n";
    // Not SPIRV-HEX: Amber of 2026 never comes to the end of hexadecimal bytes that are followed by a line break.
    let _ = writeln!(text, "SHADER compute pass SPIRV-BIN FILE {}\n", super::SHADER);
    if case.params_binding.is_some() {
        text += "BUFFER params DATA_TYPE uint32 DATA\n";
        let words: Vec<String> = case
            .params
            .chunks_exact(4)
            .map(|b| format!("0x{:08x}", u32::from_le_bytes([b[0], b[1], b[2], b[3]])))
            .collect();
        let _ = writeln!(text, "{}\nEND\n", words.join(" "));
    }
    for array in &case.arrays {
        declare(&mut text, array)?;
    }
    if case.arrays.iter().any(|array| array.kind == Kind::Filtered) {
        text += "SAMPLER linear MAG_FILTER linear MIN_FILTER linear ADDRESS_MODE_U clamp_to_edge ADDRESS_MODE_V clamp_to_edge \
                 ADDRESS_MODE_W clamp_to_edge MIN_LOD 0.0 MAX_LOD 0.0\n\n";
    }
    text += "PIPELINE compute pipeline\n  ATTACH pass";
    for (id, value) in &case.constants {
        // Amber takes the bits of a signed constant as an unsigned one.
        let _ = write!(text, " SPECIALIZE {id} AS uint32 {}", *value as u32);
    }
    text.push('\n');
    if let Some(binding) = case.params_binding {
        let _ = writeln!(text, "  BIND BUFFER params AS uniform DESCRIPTOR_SET 0 BINDING {binding}");
    }
    for array in &case.arrays {
        let _ = writeln!(
            text,
            "  BIND BUFFER {} AS {} DESCRIPTOR_SET 0 BINDING {}",
            array.name,
            bound_as(array.kind),
            array.binding
        );
    }
    let [x, y, z] = case.groups;
    let _ = writeln!(text, "END\n\nRUN pipeline {x} {y} {z}\n");
    for array in &case.arrays {
        expect(&mut text, array);
    }
    Ok(text)
}

fn bound_as(kind: Kind) -> &'static str {
    match kind {
        Kind::Params => "uniform",
        Kind::Sampled => "sampled_image",
        Kind::Filtered => "combined_image_sampler SAMPLER linear",
        Kind::Storage => "storage_image",
        Kind::Buffer => "storage",
        Kind::Texels(_) => "storage_texel_buffer",
    }
}

/// The Vulkan format without its prefix.
fn format_name(array: &Array) -> &'static str {
    match (array.kind, array.format) {
        (Kind::Texels(2), Format::Floats) => "R32G32_SFLOAT",
        (Kind::Texels(4), Format::Floats) => "R32G32B32A32_SFLOAT",
        (_, Format::R32f | Format::Floats) => "R32_SFLOAT",
        (_, Format::R8) => "R8_UNORM",
        (_, Format::R16) => "R16_UNORM",
        (_, Format::R16f) => "R16_SFLOAT",
        (_, Format::Rg16) => "R16G16_UNORM",
        (_, Format::Rg16f) => "R16G16_SFLOAT",
        (_, Format::Rg32f) => "R32G32_SFLOAT",
        (_, Format::Rgba16f) => "R16G16B16A16_SFLOAT",
        (_, Format::Rgba32f) => "R32G32B32A32_SFLOAT",
        (_, Format::Rgba8) => "R8G8B8A8_UNORM",
        (_, Format::Bgra8) => "B8G8R8A8_UNORM",
        (_, Format::R32u) => "R32_UINT",
        (_, Format::Rg32u) => "R32G32_UINT",
    }
}

/// Levels of a normalized format; None for other formats.
fn levels(format: Format) -> Option<f64> {
    match format {
        Format::R8 | Format::Rgba8 | Format::Bgra8 => Some(255.0),
        Format::R16 | Format::Rg16 => Some(65535.0),
        _ => None,
    }
}

fn is_integer(format: Format) -> bool {
    matches!(format, Format::R32u | Format::Rg32u)
}

fn declare(text: &mut String, array: &Array) -> Result<(), String> {
    let ([width, height, depth], name, format) = (array.size, &array.name, format_name(array));
    let _ = match array.dimension {
        Dimension::Two => write!(text, "IMAGE {name} FORMAT {format} DIM_2D WIDTH {width} HEIGHT {height} DATA"),
        Dimension::Three => {
            write!(text, "IMAGE {name} FORMAT {format} DIM_3D WIDTH {width} HEIGHT {height} DEPTH {depth} DATA")
        }
        Dimension::Layers => return Err(format!("'{name}' is an array of images, which Amber does not have")),
        Dimension::None if array.kind == Kind::Buffer => write!(text, "BUFFER {name} DATA_TYPE float DATA"),
        Dimension::None => write!(text, "BUFFER {name} DATA_TYPE {format} DATA"),
    };
    let values = array.stored().values;
    for (n, value) in values.iter().enumerate() {
        text.push(if n % 16 == 0 { '\n' } else { ' ' });
        let _ = match (levels(array.format), is_integer(array.format)) {
            (Some(levels), _) => write!(text, "{}", (value * levels).round() as u32),
            (None, true) => write!(text, "{}", *value as u32),
            (None, false) => write!(text, "{}", number(*value)),
        };
    }
    text.push_str("\nEND\n\n");
    Ok(())
}

/// One line for each texel that is written.
fn expect(text: &mut String, array: &Array) {
    let Some(expected) = &array.expected else { return };
    if array.access == Access::Read {
        return;
    }
    let channels = array.format.channels();
    let texels = expected.values.chunks_exact(channels).zip(expected.tolerances.chunks_exact(channels));
    for (n, (values, tolerances)) in texels.enumerate() {
        // The pass does not write it.
        if values.iter().any(|value| value.is_nan()) {
            continue;
        }
        let at = n * channels * array.format.channel_bytes();
        let (mut wanted, mut within) = (String::new(), String::new());
        for (value, tolerance) in values.iter().zip(tolerances) {
            match (levels(array.format), is_integer(array.format)) {
                (Some(levels), _) => {
                    let level = (value.clamp(0.0, 1.0) * levels).round();
                    // The whole levels that lie within the tolerance.
                    let off = ((value - level / levels).abs() + tolerance) * levels;
                    let _ = write!(wanted, " {level}");
                    let _ = write!(within, " {}", number(off));
                }
                (None, true) => {
                    let _ = write!(wanted, " {}", *value as u32);
                    let _ = write!(within, " {}", number(*tolerance));
                }
                (None, false) => {
                    let _ = write!(wanted, " {}", number(*value));
                    let _ = write!(within, " {}", number(*tolerance));
                }
            }
        }
        let _ = writeln!(text, "EXPECT {} IDX {at} TOLERANCE{within} EQ{wanted}", array.name);
    }
}

/// A number that Amber reads as a float: with a point, and without an exponent.
fn number(value: f64) -> String {
    let text = format!("{value}");
    if text.contains(['.', 'N', 'i']) { text } else { text + ".0" }
}
