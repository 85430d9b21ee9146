//! `verify --reproduce`: what it writes is a complete dispatch, which gives the expected values again when it runs from the files alone,
//! and its script for Amber keeps to Amber's grammar.

use crate::common::gpu::*;
use echolume::low_level::gpu::ContextOptions;
use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::passes::slots::Format;
use echolume::low_level::passes::{self, Arrays, Texels};
use echolume::low_level::spirv::{Dimension, reflect, words as words_of};
use echolume::low_level::verify::DeviceUnderTest;
use echolume::low_level::verify::each_pass::{POISON, dispatch_args_of};
use echolume::low_level::verify::report::Level;
use echolume::low_level::verify::reproduce::{ReproduceError, reproduce};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

fn bench() -> DeviceUnderTest {
    let options = ContextOptions { device: chosen(), validation: true, ..ContextOptions::default() };
    DeviceUnderTest::new(&options, Level::Quick).expect("bench")
}

fn format(name: &str) -> Format {
    use Format::*;
    let all = [R8, R16, R16f, R32f, Rg16, Rg16f, Rg32f, Rgba16f, Rgba32f, Rgba8, R32u, Rg32u, Floats];
    *all.iter().find(|format| format!("{format:?}") == name).expect("a format")
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn doubles(folder: &Path, name: &str) -> Vec<f64> {
    bytes(folder, name).chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight"))).collect()
}

fn size_of(array: &Value) -> [usize; 3] {
    std::array::from_fn(|axis| array["size"][axis].as_u64().expect("a size") as usize)
}

/// Shares of the values of all outputs that are beyond their tolerance, and that are what the device wrote before, when the dispatch runs from the files
/// with `change` made to each input.
fn shares(bench: &DeviceUnderTest, folder: &Path, change: impl Fn(&mut Texels)) -> [f64; 2] {
    let about: Value = serde_json::from_slice(&bytes(folder, "dispatch.json")).expect("JSON");
    let pass = passes::by_name(about["pass"].as_str().expect("a pass")).expect("a pass");
    let scenes = bench.scenes();
    let (_, scene) = scenes.iter().find(|(name, _)| about["scene"] == name.as_str()).expect("its scene");
    let mut runner = PassRunner::new(&bench.context).expect("runner");
    let adapted = runner.adapted(scene);
    let args = dispatch_args_of(&adapted, pass, about["iteration"].as_u64().expect("a number") as u32);
    let arrays = about["arrays"].as_array().expect("arrays");
    let of = |name: &str| arrays.iter().find(|array| array["name"] == name);
    let mut inputs = Arrays::default();
    for bind in pass.reads(&adapted, &args) {
        let Some(array) = of(bind.name).filter(|array| array["is_output"] == false) else { continue };
        let held = bytes(folder, array["file"].as_str().expect("a file"));
        let mut texels = Texels::decode(size_of(array), format(array["format"].as_str().expect("a format")), &held);
        change(&mut texels);
        inputs.insert(bind.name, texels.with_outside(bind.slot, &adapted, 0.0));
    }
    let outputs = runner.run(scene, pass, &args, &inputs, POISON).expect("the dispatch");
    let (mut beyond, mut same, mut all) = (0, 0, 0);
    for bind in pass.writes(&adapted, &args) {
        let got = outputs.get(bind.name).stored_part(bind.slot, &adapted).values;
        let expected = doubles(folder, &format!("{}.expected.f64", bind.name));
        let tolerance = doubles(folder, &format!("{}.tolerance.f64", bind.name));
        assert!(got.len() == expected.len() && got.len() == tolerance.len(), "{}", bind.name);
        let before = doubles(folder, &format!("{}.got.f64", bind.name));
        same += got.iter().zip(&before).filter(|(a, b)| a.to_bits() == b.to_bits()).count();
        let written = got.iter().zip(&expected).zip(&tolerance).filter(|((_, e), _)| !e.is_nan());
        all += got.len();
        for ((got, expected), tolerance) in written {
            beyond += usize::from((got - expected).abs() > *tolerance);
        }
    }
    assert!(all > 20, "{all} values");
    [beyond, same].map(|count| count as f64 / all as f64)
}

#[test]
fn the_files_are_the_dispatch_and_give_the_expected_values_again() {
    let mut bench = bench();
    let folder = Folder::new("reproduce");
    for name in ["median_slice", "raycast_projection", "tone", "gaussian_lateral"] {
        let folder = folder.join(name);
        let made = reproduce(&mut bench, &format!("passes / {name}"), &folder).expect("written");
        assert!(!made.fails && made.title.contains(name), "{}", made.title);
        let about: Value = serde_json::from_slice(&bytes(&folder, "dispatch.json")).expect("JSON");
        for array in about["arrays"].as_array().expect("arrays") {
            let texels: usize = size_of(array).iter().product();
            let one =
                Texels::from_fn([1; 3], format(array["format"].as_str().expect("a format")).channels(), |_, _| 0.0);
            let texel = one.encode(format(array["format"].as_str().expect("a format"))).len();
            let held = bytes(&folder, array["file"].as_str().expect("a file")).len();
            assert_eq!((held, array["bytes"].as_u64()), (texels * texel, Some(held as u64)), "{name}: {array}");
        }
        assert!(bytes(&folder, "shader.spv").starts_with(&[3, 2, 0x23, 7]), "{name}");
        let allowed = about["outliers"].as_f64().expect("a share");
        let [share, same] = shares(&bench, &folder, |_| ());
        assert!(share <= allowed, "{name}: {share} of the values are beyond their tolerance, {allowed} may be");
        assert_eq!(same, 1.0, "{name}: the device wrote something else before");
        let [wrong, _] = shares(&bench, &folder, |texels| texels.values.iter_mut().for_each(|v| *v = 0.3 * *v + 0.1));
        assert!(wrong > 0.1, "{name}: other inputs give the same values: {wrong}");
        for file in &made.files {
            assert!(folder.join(file).exists(), "{file}");
        }
        assert_eq!(made.without_script, None, "{name}");
        let scripts: Vec<_> = made.files.iter().filter(|file| file.ends_with(".amber")).collect();
        let readme = String::from_utf8(bytes(&folder, "README.md")).expect("text");
        assert_eq!(scripts.len(), layers_of(&about).unwrap_or(1), "{name}: {scripts:?}");
        for script in scripts {
            assert!(readme.contains(script.as_str()), "{name}: README.md does not name {script}");
            amber_holds(&folder, script, &about);
        }
    }
    assert!(matches!(reproduce(&mut bench, "known answers", &folder.join("none")), Err(ReproduceError::NoPass(_))));
}

/// Of a dispatch that fails, the one that fails is written.
#[test]
fn a_failure_is_written_and_not_the_smallest_dispatch() {
    let planted =
        echolume::low_level::verify::self_test::faults().find(|fault| fault.name == "median of the wrong rank");
    let mut bench = bench().with_fault(planted.expect("the fault").change).expect("bench");
    let folder = Folder::new("reproduce-failure");
    let made = reproduce(&mut bench, "median_slice", &folder.join("it")).expect("written");
    assert!(made.fails, "{}", made.title);
    let shader = bytes(&folder.join("it"), "shader.spv");
    let sound = echolume::low_level::spirv::embedded("filter/median.slice").expect("embedded");
    assert!(!shader.is_empty() && shader != sound, "the shader is the one that the driver got");
}

/// Layers of the dispatch, where images have layers: what it has groups for along z.
fn layers_of(about: &Value) -> Option<usize> {
    let arrays = about["arrays"].as_array().expect("arrays");
    let is_layered = arrays.iter().any(|array| array["dimension"] == "Layers");
    is_layered.then(|| about["workgroups"][2].as_u64().expect("a number") as usize)
}

/// What a script declares: bytes a texel, channels and values of each array.
type Declared = BTreeMap<String, (usize, usize, usize)>;

/// Reads a script as Amber's parser does, with the commands that it uses.
fn amber_holds(folder: &Path, script: &str, about: &Value) {
    let text = String::from_utf8(bytes(folder, script)).expect("text");
    let mut lines = text.lines().map(|line| line.split('#').next().unwrap_or("").trim()).peekable();
    assert!(text.starts_with("#!amber\n"), "Amber's first line");
    let (mut declared, mut bound, mut ran, mut expectations) = (Declared::new(), Vec::new(), 0, 0);
    let (mut constants, mut of_params) = (0, String::new());
    // Images whose content comes from a file, and how many of the three copies that this takes were seen.
    let mut loaded: BTreeMap<String, usize> = BTreeMap::new();
    while let Some(line) = lines.next() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            [] => {}
            ["DEVICE_FEATURE", _] => {}
            ["SHADER", "compute", "pass", "SPIRV-BIN", "FILE", file] => {
                assert_eq!(file, if layers_of(about).is_some() { "shader.layer.spv" } else { "shader.spv" });
                let module = reflect(&words_of(&bytes(folder, file))).expect("a module");
                assert!(
                    module.bindings.iter().all(|b| b.dimension != Dimension::Layers),
                    "{file} has arrays of images"
                );
            }
            ["BUFFER", "params", "DATA_TYPE", "uint32", "SIZE", count, "FILE", "BINARY", file] => {
                assert_eq!(4 * number(count), bytes(folder, file).len());
                of_params = file.into();
            }
            ["BUFFER", name, "DATA_TYPE", kind, "SIZE", count, "FILE", "BINARY", file] => {
                let (bytes_each, channels) = texel(kind);
                assert_eq!(bytes_each * channels * number(count), bytes(folder, file).len(), "{line}");
                declared.insert(name.into(), (bytes_each, channels, channels * number(count)));
            }
            ["BUFFER", name, "FORMAT", kind, "FILE", "BINARY", file] => {
                let image = name.strip_prefix("file_of_").expect("of an image");
                let (bytes_each, channels, values) = declared[image];
                assert_eq!((bytes_each, channels), texel(kind), "{line}");
                assert_eq!(bytes_each * values, bytes(folder, file).len(), "{line}");
                assert_eq!(declared[image], declared[&format!("size_of_{image}")], "{line}");
                loaded.insert(image.into(), 0);
            }
            ["IMAGE", name, "FORMAT", kind, dimension, ref rest @ ..] => {
                let (bytes_each, channels) = texel(kind);
                let has_data = rest.last() == Some(&"DATA");
                let sides: Vec<usize> = match (dimension, &rest[..rest.len() - usize::from(has_data)]) {
                    ("DIM_2D", ["WIDTH", w, "HEIGHT", h]) => vec![number(w), number(h)],
                    ("DIM_3D", ["WIDTH", w, "HEIGHT", h, "DEPTH", d]) => vec![number(w), number(h), number(d)],
                    other => panic!("{other:?}"),
                };
                let count = channels * sides.iter().product::<usize>();
                if has_data {
                    let inside = lines.by_ref().take_while(|l| *l != "END").flat_map(str::split_whitespace);
                    let values: Vec<&str> = inside.collect();
                    assert_eq!(values.len(), count, "{name}");
                    let is_integer = kind.ends_with("UNORM") || kind.ends_with("UINT");
                    assert!(values.iter().all(|v| v.contains('.') != is_integer && !v.contains('e')), "{name}");
                }
                declared.insert(name.into(), (bytes_each, channels, count));
            }
            ["SAMPLER", "linear", ..] => assert_eq!(words.len() % 2, 0, "{line}"),
            ["PIPELINE", "compute", "pipeline"] => {
                for line in lines.by_ref().take_while(|l| *l != "END") {
                    let words: Vec<&str> = line.split_whitespace().collect();
                    match words[..] {
                        ["ATTACH", "pass", ref rest @ ..] => {
                            for constant in rest.chunks(5) {
                                assert!(matches!(constant, ["SPECIALIZE", _, "AS", "uint32", _]), "{line}");
                                constants += 1;
                            }
                        }
                        ["BIND", "BUFFER", name, "AS", .., "DESCRIPTOR_SET", "0", "BINDING", at] => {
                            assert!(name == "params" || declared.contains_key(name), "{name} is not declared");
                            bound.push(number(at));
                        }
                        _ => panic!("{line}"),
                    }
                }
            }
            // The content before the dispatch; sizes after all expectations.
            ["COPY", from, "TO", to] => {
                let image = to.strip_prefix("file_of_").unwrap_or(to);
                let copies = loaded.get_mut(image).expect("an image with a file");
                let wanted = match *copies {
                    0 => (format!("file_of_{image}"), image.into(), 0),
                    1 => (format!("size_of_{image}"), format!("file_of_{image}"), 1),
                    _ => (format!("size_of_{image}"), image.to_string(), 1),
                };
                assert_eq!((from.into(), to.into(), ran), wanted, "{line}");
                *copies += 1;
            }
            ["RUN", "pipeline", x, y, z] => {
                let mut groups = about["workgroups"].clone();
                if layers_of(about).is_some() {
                    groups[2] = 1.into();
                }
                assert_eq!(groups, Value::from([x, y, z].map(number).to_vec()));
                ran += 1;
            }
            ["EXPECT", name, "IDX", at, ref rest @ ..] => {
                let (bytes_each, channels, values) = declared[name];
                let compared = match rest {
                    ["TOLERANCE", _, "EQ", compared @ ..] | ["GE" | "LE", compared @ ..] => compared,
                    _ => panic!("{line}"),
                };
                assert!(ran == 1 && compared.len() == channels, "{line}");
                assert!(loaded.values().all(|copies| *copies == 1), "{line}: a size is given back too early");
                assert!(number(at).is_multiple_of(bytes_each * channels) && number(at) < bytes_each * values, "{line}");
                expectations += 1;
            }
            _ => panic!("{line} is no command of Amber that this script should have"),
        }
    }
    assert_eq!(constants, about["constants"].as_array().expect("constants").len());
    let arrays = about["arrays"].as_array().expect("arrays");
    let params = usize::from(!about["params_binding"].is_null());
    assert_eq!(of_params.len() > 1, params == 1);
    assert!(loaded.values().all(|copies| *copies == 3), "{loaded:?}");
    assert!(bound.len() == arrays.len() + params && expectations > 20 && ran == 1, "{bound:?}, {expectations}");
}

fn number(text: &str) -> usize {
    text.parse().unwrap_or_else(|_| panic!("{text} is no number"))
}

/// Bytes of a channel, and channels, of one of Amber's formats.
fn texel(kind: &str) -> (usize, usize) {
    match kind {
        "float" | "R32_SFLOAT" | "R32_UINT" => (4, 1),
        "R8_UNORM" => (1, 1),
        "R16_UNORM" | "R16_SFLOAT" => (2, 1),
        "R16G16_UNORM" | "R16G16_SFLOAT" => (2, 2),
        "R32G32_SFLOAT" | "R32G32_UINT" => (4, 2),
        "R8G8B8A8_UNORM" => (1, 4),
        "R16G16B16A16_SFLOAT" => (2, 4),
        "R32G32B32A32_SFLOAT" => (4, 4),
        _ => panic!("{kind} is no format of Amber"),
    }
}
