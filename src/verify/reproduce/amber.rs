//! A dispatch as a script for Amber (google/amber), which runs it on any driver without this program: the shader, its inputs and the
//! expected value of every texel.

use super::{Array, Case, LAYER_SHADER, PARAMS, SHADER};
use crate::passes::slots::Format;
use crate::spirv::{Access, Dimension, Kind};
use std::fmt::Write as _;

/// Name of the file in the folder of a reproduction.
const FILE: &str = "reproduce.amber";

/// Most values that a script may expect: it is to be read by people, too.
const MAX_VALUES: usize = 400_000;

/// The first place in an array that Amber reads wrongly, bytes: it takes places as floats of 32 bits.
const MAX_PLACE: usize = 1 << 24;

/// Halves that are smaller Amber takes as 0 when it reads what a shader has written.
const MIN_HALF: f64 = 1.0 / 16384.0;

/// A script for Amber, and the dispatch that it makes.
pub(super) struct Script<'a> {
    pub name: String,
    pub text: String,
    pub case: &'a Case,
    /// True if the script has only one layer of the image arrays of the reproduced dispatch.
    pub is_of_layer: bool,
    /// Name of the file that holds the uniform block.
    pub params: String,
}

/// The scripts of a dispatch: one, or one for each layer that it writes.
///
/// # Errors
/// One line: why Amber cannot express the dispatch.
pub(super) fn scripts(case: &Case) -> Result<Vec<Script<'_>>, String> {
    let script = |name: String, case, shader, params: String, is_of_layer| {
        Ok(Script { name, text: script(case, shader, &params)?, case, is_of_layer, params })
    };
    let layers = case.layers.as_ref().map_err(String::clone)?;
    if layers.is_empty() {
        return Ok(vec![script(FILE.into(), case, SHADER, PARAMS.into(), false)?]);
    }
    let of = |(n, layer)| {
        script(format!("reproduce.layer{n}.amber"), layer, LAYER_SHADER, format!("params.layer{n}.raw"), true)
    };
    layers.iter().enumerate().map(of).collect()
}

/// Text that tells a reader of the scripts how to run them, and their limits.
pub(super) fn about(case: &Case, scripts: &[Script]) -> String {
    let names: Vec<_> = scripts.iter().map(|script| script.name.as_str()).collect();
    let mut text = format!(
        "With Amber (google/amber), in this folder: `amber -t spv1.5 -v 1.3 {}`. The shader's uniform block has scalar layout, for which Amber \
         enables no feature.\n",
        names.join(" ")
    );
    if scripts.iter().any(|script| script.is_of_layer) {
        let _ = writeln!(
            text,
            "Amber has no arrays of images: each script has one layer of them as an image of its own, and `{LAYER_SHADER}`, which is `{SHADER}` with \
             single images. What depends on the arrays themselves is not in them."
        );
    }
    if case.arrays.iter().any(|array| is_checked(array) && is_half(array.format)) {
        text += "Amber reads halves below 2^-14 as 0, so the scripts allow 0 for them.\n";
    }
    if case.outliers > 0.0 {
        text += "Amber fails at the first value that is off: a script cannot allow for the share above.\n";
    }
    text
}

fn script(case: &Case, shader: &str, params: &str) -> Result<String, String> {
    let outputs = || case.arrays.iter().filter(|array| is_checked(array));
    let expected = outputs().filter_map(|array| array.expected.as_ref()).flat_map(|expected| &expected.values);
    let values = expected.filter(|value| !value.is_nan()).count();
    if values > MAX_VALUES {
        return Err(format!("{values} values are too many for a script"));
    }
    if let Some(array) = outputs().find(|array| array.bytes.len() > MAX_PLACE) {
        return Err(format!("Amber cannot tell the places of all {} bytes of '{}'", array.bytes.len(), array.name));
    }
    let mut text = format!("#!amber\n# {}\n", case.title.replace('\n', " "));
    text += "DEVICE_FEATURE shaderStorageImageWriteWithoutFormat\nDEVICE_FEATURE shaderStorageImageExtendedFormats\n\n";
    // Not SPIRV-HEX: Amber of 2026 never comes to the end of hexadecimal bytes that are followed by a line break.
    let _ = writeln!(text, "SHADER compute pass SPIRV-BIN FILE {shader}\n");
    if case.params_binding.is_some() {
        let _ = writeln!(text, "BUFFER params DATA_TYPE uint32 SIZE {} FILE BINARY {params}\n", case.params.len() / 4);
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
    text += "END\n\n";
    let loaded: Vec<_> = case.arrays.iter().filter(|array| is_loaded_image(array)).map(|array| &array.name).collect();
    for name in &loaded {
        let _ = writeln!(text, "COPY file_of_{name} TO {name}");
    }
    let [x, y, z] = case.groups;
    let _ = writeln!(text, "RUN pipeline {x} {y} {z}\n");
    for array in outputs() {
        expect(&mut text, array)?;
    }
    if !loaded.is_empty() {
        text += "\n# Images have no FILE, and COPY gives its target the size of its source as soon as it is read. These give the sizes back;\n\
                 # they run when all is done.\n";
    }
    for name in loaded {
        let _ = writeln!(text, "COPY size_of_{name} TO file_of_{name}\nCOPY size_of_{name} TO {name}");
    }
    Ok(text)
}

/// True for what the dispatch writes.
fn is_checked(array: &Array) -> bool {
    array.expected.is_some() && array.access != Access::Read
}

/// True for an image whose content comes from a file: bytes, because Amber converts no small halves from text.
fn is_loaded_image(array: &Array) -> bool {
    array.dimension != Dimension::None && array.expected.is_none()
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

fn is_half(format: Format) -> bool {
    matches!(format, Format::R16f | Format::Rg16f | Format::Rgba16f)
}

fn declare(text: &mut String, array: &Array) -> Result<(), String> {
    let ([width, height, depth], name, file, format) = (array.size, &array.name, &array.file, format_name(array));
    let shape = match array.dimension {
        Dimension::Two => format!("FORMAT {format} DIM_2D WIDTH {width} HEIGHT {height}"),
        Dimension::Three => format!("FORMAT {format} DIM_3D WIDTH {width} HEIGHT {height} DEPTH {depth}"),
        Dimension::Layers => return Err(format!("'{name}' is an array of images, which Amber does not have")),
        Dimension::None => {
            let (kind, floats) = match array.kind {
                Kind::Texels(floats) => (format, floats as usize),
                _ => ("float", 1),
            };
            let entries = array.bytes.len() / (4 * floats);
            let _ = writeln!(text, "BUFFER {name} DATA_TYPE {kind} SIZE {entries} FILE BINARY {file}\n");
            return Ok(());
        }
    };
    if is_loaded_image(array) {
        let _ = writeln!(text, "IMAGE {name} {shape}\nIMAGE size_of_{name} {shape}");
        let _ = writeln!(text, "BUFFER file_of_{name} FORMAT {format} FILE BINARY {file}\n");
        return Ok(());
    }
    let _ = write!(text, "IMAGE {name} {shape} DATA");
    for (n, value) in array.stored().values.iter().enumerate() {
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

/// What a value may be, as Amber sees it: whole levels of normalized and integer formats, otherwise floats.
#[derive(Debug, PartialEq)]
struct Range {
    low: f64,
    high: f64,
}

impl Range {
    fn new(format: Format, value: f64, tolerance: f64) -> Range {
        let levels = levels(format).or(is_integer(format).then_some(1.0));
        if let Some(levels) = levels {
            let most = if is_integer(format) { f64::from(u32::MAX) } else { levels };
            let nearest = (value * levels).round().clamp(0.0, most);
            // Rounding errors of these products are no reason to leave a level out.
            let (low, high) = ((value - tolerance) * levels - 1e-6, (value + tolerance) * levels + 1e-6);
            return Range { low: low.ceil().clamp(0.0, nearest), high: high.floor().clamp(nearest, most) };
        }
        let (low, high) = (value - tolerance, value + tolerance);
        match is_half(format) && low < MIN_HALF && high > -MIN_HALF {
            true => Range { low: low.min(0.0), high: high.max(0.0) },
            false => Range { low, high },
        }
    }

    /// A value in the middle: a level, or a float of 32 bits.
    fn middle(&self, format: Format) -> f64 {
        let middle = 0.5 * (self.low + self.high);
        if is_float(format) { f64::from(middle as f32) } else { middle.round() }
    }

    /// How far off the middle a value may be.
    fn off(&self, format: Format) -> f64 {
        let middle = self.middle(format);
        (self.high - middle).max(middle - self.low)
    }
}

fn is_float(format: Format) -> bool {
    levels(format).is_none() && !is_integer(format)
}

/// One line for each texel that is written where its channels have one tolerance. Amber reads one TOLERANCE alone, but compares each channel with
/// limits of its own: then these follow, and of floats the largest tolerance goes before them, because no limit refuses NaN.
fn expect(text: &mut String, array: &Array) -> Result<(), String> {
    let (Some(expected), name, format) = (&array.expected, &array.name, array.format) else { return Ok(()) };
    let channels = format.channels();
    let texels = expected.values.chunks_exact(channels).zip(expected.tolerances.chunks_exact(channels));
    for (n, (values, tolerances)) in texels.enumerate() {
        // The pass does not write it.
        if values.iter().any(|value| value.is_nan()) {
            continue;
        }
        let at = n * channels * format.channel_bytes();
        let ranges: Vec<_> = values.iter().zip(tolerances).map(|(v, t)| Range::new(format, *v, *t)).collect();
        if ranges.iter().any(|range| !(range.low.is_finite() && range.high.is_finite())) {
            return Err(format!("'{name}' holds values that are not finite, which Amber does not read"));
        }
        let of = |value: &dyn Fn(&Range) -> f64| -> String {
            let shown = |range| if is_float(format) { number(value(range)) } else { format!("{}", value(range)) };
            ranges.iter().map(shown).collect::<Vec<_>>().join(" ")
        };
        let offs = || ranges.iter().map(|range| range.off(format));
        let most = offs().fold(0.0, f64::max);
        // A float of 32 bits is seldom the very middle: a line alone is wider by 0.01 % at most.
        let is_one = ranges.iter().all(|range| {
            let middle = range.middle(format);
            (range.high - middle).min(middle - range.low) >= 0.9999 * most
        });
        if is_one || is_float(format) {
            let middles = of(&|range| range.middle(format));
            let _ = writeln!(text, "EXPECT {name} IDX {at} TOLERANCE {} EQ {middles}", number(most));
        }
        if !is_one {
            let _ = writeln!(text, "EXPECT {name} IDX {at} GE {}", of(&|range| outward(format, range.low, false)));
            let _ = writeln!(text, "EXPECT {name} IDX {at} LE {}", of(&|range| outward(format, range.high, true)));
        }
    }
    Ok(())
}

/// A limit as the value of the format that is as far out at least: Amber reads limits as floats of 32 bits.
fn outward(format: Format, limit: f64, up: bool) -> f64 {
    let nearest = limit as f32;
    let is_inward = if up { f64::from(nearest) < limit } else { f64::from(nearest) > limit };
    match (is_float(format), is_inward, up) {
        (false, ..) => limit,
        (true, false, _) => f64::from(nearest),
        (true, true, true) => f64::from(nearest.next_up()),
        (true, true, false) => f64::from(nearest.next_down()),
    }
}

/// A number that Amber reads as a float: with a point, and without an exponent.
fn number(value: f64) -> String {
    let text = format!("{value}");
    if text.contains('.') { text } else { text + ".0" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproduce::Expected;

    /// An output of one texel.
    fn output(format: Format, values: &[f64], tolerances: &[f64]) -> Array {
        Array {
            name: "target".into(),
            binding: 1,
            kind: Kind::Storage,
            access: Access::Write,
            dimension: Dimension::Two,
            format,
            size: [1; 3],
            bytes: vec![0; format.channels() * format.channel_bytes()],
            file: "target.raw".into(),
            expected: Some(Expected { values: values.into(), tolerances: tolerances.into(), got: values.into() }),
        }
    }

    fn lines(format: Format, values: &[f64], tolerances: &[f64]) -> Vec<String> {
        let mut text = String::new();
        expect(&mut text, &output(format, values, tolerances)).unwrap();
        text.lines().map(String::from).collect()
    }

    /// What Amber says to these values, which it reads from the texel: of a normalized format levels. Limits are floats of 32 bits, and of several
    /// tolerances it takes the first.
    fn accepts(lines: &[String], got: &[f64]) -> bool {
        lines.iter().all(|line| {
            let words: Vec<_> = line.split(' ').collect();
            let at = words.iter().position(|w| ["EQ", "GE", "LE"].contains(w)).unwrap();
            let wanted: Vec<_> = words[at + 1..].iter().map(|w| f64::from(w.parse::<f32>().unwrap())).collect();
            assert_eq!((wanted.len(), &words[..4]), (got.len(), &["EXPECT", "target", "IDX", "0"][..]), "{line}");
            let within = (words[at] == "EQ").then(|| words[5].parse::<f64>().unwrap());
            got.iter().zip(wanted).all(|(got, wanted)| match words[at] {
                "EQ" => (got - wanted).abs() <= within.unwrap(),
                // Of these NaN is none too small, and none too large.
                "GE" => got.is_nan() || *got >= wanted,
                _ => got.is_nan() || *got <= wanted,
            })
        })
    }

    /// Prevents the first tolerance of a texel from standing for all of its channels.
    #[test]
    fn each_channel_has_its_own_tolerance() {
        let (values, tolerances) = ([0.5, -2.0, 0.1, 30.0], [0.001, 0.1, 0.01, 1.0]);
        let told = lines(Format::Rgba32f, &values, &tolerances);
        assert_eq!(told.len(), 3, "{told:?}");
        assert!(accepts(&told, &values));
        for c in 0..4 {
            for side in [-1.0, 1.0] {
                let with = |off: f64| {
                    let mut got = values;
                    got[c] += side * off * tolerances[c];
                    got
                };
                assert!(accepts(&told, &with(0.99)) && !accepts(&told, &with(1.01)), "channel {c}: {told:?}");
            }
            let mut got = values;
            got[c] = f64::NAN;
            assert!(!accepts(&told, &got), "NaN in channel {c}");
        }
        let told = lines(Format::Rgba32f, &values, &[0.1; 4]);
        assert_eq!(told.len(), 1, "channels with one tolerance need one line: {told:?}");
        assert!(accepts(&told, &[0.59, -2.09, 0.19, 29.91]) && !accepts(&told, &[0.5, -2.0, 0.1, 30.11]));
    }

    #[test]
    fn of_levels_those_within_the_tolerance_are_allowed() {
        let level = 1.0 / 255.0;
        let told = lines(Format::Rgba8, &[0.0, 10.4 * level, 20.0 * level, 1.0], &[2.0 * level; 4]);
        for (channel, low, high) in [(0, 0, 2), (1, 9, 12), (2, 18, 22), (3, 253, 255)] {
            for tried in 0..=255 {
                let mut got = [0.0, 10.0, 20.0, 255.0];
                got[channel] = f64::from(tried);
                assert_eq!(
                    accepts(&told, &got),
                    (low..=high).contains(&tried),
                    "channel {channel}, level {tried}: {told:?}"
                );
            }
        }
        // The nearest level is allowed though it is off by more than the tolerance.
        let told = lines(Format::R16, &[0.5], &[1e-9]);
        assert!(accepts(&told, &[32768.0]) && !accepts(&told, &[32766.0]), "{told:?}");
        let told = lines(Format::R32u, &[4e9], &[0.0]);
        assert_eq!(told, ["EXPECT target IDX 0 TOLERANCE 0.0 EQ 4000000000"]);
    }

    #[test]
    fn zero_is_allowed_for_a_half_that_amber_takes_for_it() {
        let told = lines(Format::R16f, &[3e-5], &[1e-6]);
        assert!(accepts(&told, &[0.0]) && accepts(&told, &[3.05e-5]) && !accepts(&told, &[4e-5]), "{told:?}");
        assert!(!accepts(&told, &[-1e-5]), "{told:?}");
        let told = lines(Format::R16f, &[-6.2e-5], &[2e-6]);
        assert!(accepts(&told, &[0.0]) && !accepts(&told, &[1e-5]), "{told:?}");
        for told in [lines(Format::R16f, &[7e-5], &[1e-6]), lines(Format::R32f, &[3e-5], &[1e-6])] {
            assert!(told.len() == 1 && !accepts(&told, &[0.0]), "{told:?}");
        }
    }

    #[test]
    fn what_is_not_written_is_not_expected_and_infinity_is_refused() {
        assert!(lines(Format::Rg32f, &[f64::NAN, 1.0], &[0.1; 2]).is_empty());
        let endless = output(Format::R32f, &[f64::INFINITY], &[0.1]);
        assert!(expect(&mut String::new(), &endless).is_err());
    }
}
