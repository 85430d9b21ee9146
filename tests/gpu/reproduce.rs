//! `verify --reproduce`: what it writes is a complete dispatch, which gives the expected values again when it runs from the files alone,
//! and its script for Amber keeps to Amber's grammar.

use crate::common::gpu::*;
use echolume::low_level::gpu::ContextOptions;
use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::passes::slots::Format;
use echolume::low_level::passes::{self, Arrays, Texels};
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

/// Share of the values of all outputs that are beyond their tolerance when the dispatch runs from the files, with `change` made to each
/// input.
fn share_beyond(bench: &DeviceUnderTest, folder: &Path, change: impl Fn(&mut Texels)) -> f64 {
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
    let (mut beyond, mut all) = (0, 0);
    for bind in pass.writes(&adapted, &args) {
        let got = outputs.get(bind.name).stored_part(bind.slot, &adapted).values;
        let expected = doubles(folder, &format!("{}.expected.f64", bind.name));
        let tolerance = doubles(folder, &format!("{}.tolerance.f64", bind.name));
        assert!(got.len() == expected.len() && got.len() == tolerance.len(), "{}", bind.name);
        let written = got.iter().zip(&expected).zip(&tolerance).filter(|((_, e), _)| !e.is_nan());
        for ((got, expected), tolerance) in written {
            all += 1;
            beyond += usize::from((got - expected).abs() > *tolerance);
        }
    }
    assert!(all > 20, "{all} values");
    f64::from(beyond as u32) / f64::from(all as u32)
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
        let share = share_beyond(&bench, &folder, |_| ());
        assert!(share <= allowed, "{name}: {share} of the values are beyond their tolerance, {allowed} may be");
        let wrong = share_beyond(&bench, &folder, |texels| texels.values.iter_mut().for_each(|v| *v = 0.3 * *v + 0.1));
        assert!(wrong > 0.1, "{name}: other inputs give the same values: {wrong}");
        for file in &made.files {
            assert!(folder.join(file).exists(), "{file}");
        }
        if made.without_script.is_none() {
            amber_holds(&folder, &about);
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

/// What a script declares: bytes a texel and channels of each array.
type Declared = BTreeMap<String, (usize, usize, usize)>;

/// Reads a script as Amber's parser does, with the commands that it uses.
fn amber_holds(folder: &Path, about: &Value) {
    let text = String::from_utf8(bytes(folder, "reproduce.amber")).expect("text");
    let mut lines = text.lines().map(|line| line.split('#').next().unwrap_or("").trim()).peekable();
    assert!(text.starts_with("#!amber\n"), "Amber's first line");
    let (mut declared, mut bound, mut ran, mut expectations) = (Declared::new(), Vec::new(), 0, 0);
    let mut constants = 0;
    while let Some(line) = lines.next() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let mut until_end = |what: &str| -> Vec<String> {
            let inside: Vec<String> = lines
                .by_ref()
                .take_while(|l| *l != "END")
                .flat_map(|l| l.split_whitespace().map(String::from))
                .collect();
            assert!(!inside.is_empty(), "{what} is empty");
            inside
        };
        match words[..] {
            [] => {}
            ["DEVICE_FEATURE", _] => {}
            // Its words are looked at above.
            ["SHADER", "compute", "pass", "SPIRV-BIN", "FILE", file] => assert_eq!(file, "shader.spv"),
            ["BUFFER", "params", "DATA_TYPE", "uint32", "DATA"] => {
                let words = until_end("params");
                let block: Vec<u8> = (words.iter())
                    .flat_map(|w| {
                        u32::from_str_radix(w.strip_prefix("0x").expect("hex"), 16).expect("a word").to_le_bytes()
                    })
                    .collect();
                assert_eq!(block, bytes(folder, "params.raw"));
            }
            ["BUFFER", name, "DATA_TYPE", kind, "DATA"] => {
                let (bytes_each, channels) = texel(kind);
                let count = until_end(name).len();
                declared.insert(name.into(), (bytes_each, channels, count));
            }
            ["IMAGE", name, "FORMAT", kind, dimension, ref rest @ ..] => {
                let (bytes_each, channels) = texel(kind);
                let sides: Vec<usize> = match (dimension, rest) {
                    ("DIM_2D", ["WIDTH", w, "HEIGHT", h, "DATA"]) => vec![number(w), number(h)],
                    ("DIM_3D", ["WIDTH", w, "HEIGHT", h, "DEPTH", d, "DATA"]) => vec![number(w), number(h), number(d)],
                    other => panic!("{other:?}"),
                };
                let values = until_end(name);
                assert_eq!(values.len(), channels * sides.iter().product::<usize>(), "{name}");
                let is_integer = kind.ends_with("UNORM") || kind.ends_with("UINT");
                assert!(values.iter().all(|v| v.contains('.') != is_integer && !v.contains('e')), "{name}");
                declared.insert(name.into(), (bytes_each, channels, values.len()));
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
            ["RUN", "pipeline", x, y, z] => {
                let groups = [x, y, z].map(|n| Value::from(number(n)));
                assert_eq!(about["workgroups"], Value::from(groups.to_vec()));
                ran += 1;
            }
            ["EXPECT", name, "IDX", at, "TOLERANCE", ref rest @ ..] => {
                let (bytes_each, channels, values) = declared[name];
                assert!(ran == 1 && rest.len() == 2 * channels + 1 && rest[channels] == "EQ", "{line}");
                assert!(number(at).is_multiple_of(bytes_each * channels) && number(at) < bytes_each * values, "{line}");
                expectations += 1;
            }
            _ => panic!("{line} is no command of Amber that this script should have"),
        }
    }
    assert_eq!(constants, about["constants"].as_array().expect("constants").len());
    let arrays = about["arrays"].as_array().expect("arrays");
    let params = usize::from(!about["params_binding"].is_null());
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
