//! The rules of the source tree: layers, embedded shaders that match their sources, and passes that match their shaders.
//! Needs no GPU.

use crate::common::files::repository;
use crate::common::probes::{voxels, wobbler};
use crate::common::scenes::{BYTES, FLOATS, scene};
use echolume::low_level::gpu::WRITERS_OF_RUNS;
use echolume::low_level::passes::{DispatchArgs, Frequency, PASSES, Part, Pass, device_limits, interface_check};
use echolume::low_level::probe::{Advance, Axis, Geometry, Motion, Probe};
use echolume::low_level::scene::{DeviceFacts, Scene};
use echolume::low_level::shader_source;
use echolume::low_level::spirv;
use echolume::low_level::verify::built_in::labelled;
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Split, because this file is searched too.
const UNSAFE: &str = concat!("unsafe", " {");

/// Every Rust file below a folder, with its path from the top.
fn sources(folder: &str) -> Vec<(String, String)> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("folder").map(|e| e.expect("entry").path()) {
            match entry.is_dir() {
                true => walk(&entry, found),
                false if entry.extension().is_some_and(|e| e == "rs") => found.push(entry),
                false => {}
            }
        }
    }
    let mut found = Vec::new();
    walk(&repository(folder), &mut found);
    found.sort();
    let name = |p: &PathBuf| p.strip_prefix(repository("")).expect("below the top").to_string_lossy().into_owned();
    found.iter().map(|p| (name(p), std::fs::read_to_string(p).expect("source"))).collect()
}

/// Code without comments: a doc comment may name what the code may not use.
fn code(text: &str) -> String {
    text.lines().map(|l| l.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

/// The string literals of code, each with the code since the last end of a statement or block. Raw strings and characters are left out.
fn literals(text: &str) -> Vec<(&str, &str)> {
    let (bytes, mut found, mut at, mut since) = (text.as_bytes(), Vec::new(), 0, 0);
    while at < bytes.len() {
        match bytes[at] {
            b'/' if bytes.get(at + 1) == Some(&b'/') => at = text[at..].find('\n').map_or(bytes.len(), |end| at + end),
            b'\'' if bytes.get(at + 1) == Some(&b'\\') => at += 4,
            b'\'' if bytes.get(at + 2) == Some(&b'\'') => at += 3,
            b'"' => {
                let start = at + 1;
                at = start;
                while at < bytes.len() && bytes[at] != b'"' {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                found.push((&text[since..start - 1], &text[start..at.min(bytes.len())]));
                at += 1;
            }
            end => {
                at += 1;
                // Braces within a line belong to an expression.
                if end == b';' || (matches!(end, b'{' | b'}') && bytes.get(at) == Some(&b'\n')) {
                    since = at;
                }
            }
        }
    }
    found
}

/// True for words that a reader is meant to see: several, or one with a capital letter.
fn is_prose(literal: &str) -> bool {
    let mut outside = true;
    let keep = |c: &char| {
        match c {
            '{' => outside = false,
            '}' => outside = true,
            _ => return outside,
        }
        false
    };
    let text: String = literal.chars().filter(keep).collect();
    let is_word = |word: &&str| word.len() > 1 && word.chars().filter(|c| c.is_ascii_lowercase()).count() > 1;
    let mut words = text.split_whitespace();
    let first = words.next().unwrap_or("");
    let begins_with_capital = first.starts_with(|c: char| c.is_ascii_uppercase()) && is_word(&first);
    begins_with_capital || (text.contains(' ') && text.split_whitespace().any(|word| is_word(&word)))
}

#[test]
fn every_text_of_the_window_is_in_its_table() {
    // What goes to the log or ends the program without a window.
    let is_elsewhere = |before: &str| ["tracing::", "GpuError::"].iter().any(|word| before.contains(word));
    let allowed = [
        // The name of the window is that of the program.
        "Echolume",
        // The last line on the terminal, and why a report of errors is refused there.
        "{:.1} s: {} volumes",
        "ms: picture {}, input to picture",
        ", last frame to presentation",
        ", presentation to monitor",
        "error report: ",
        "{fault}; is there a desktop?",
        // With these a line of the program that exports begins.
        "echolume: ",
        "error: ",
    ];
    let mut count = 0;
    for (name, text) in sources("src/ui") {
        if name.contains("/tests") {
            continue;
        }
        let end = text.find("#[cfg(test)]\nmod ").unwrap_or(text.len());
        for (before, literal) in literals(&text[..end]).into_iter().filter(|(_, literal)| is_prose(literal)) {
            if name.contains("/texts/") {
                count += 1;
                continue;
            }
            let is_fine = is_elsewhere(before) || allowed.iter().any(|start| literal.starts_with(start));
            assert!(is_fine, "{name}: {literal:?} belongs in src/ui/texts");
        }
    }
    assert!(count > 0, "no text is found in its table");
}

#[test]
fn texts_are_told_from_other_literals() {
    let code =
        "ui.label(\"Two words\"); // \"not this\"\nlet c = '\"'; tracing::warn!(\"lost {x}\"); f(\"a \\\" quote\")";
    let found: Vec<&str> = literals(code).into_iter().map(|(_, literal)| literal).collect();
    assert_eq!(found, ["Two words", "lost {x}", "a \\\" quote"]);
    assert!(literals(code)[1].0.contains("tracing::"));
    assert!(is_prose("Undo") && is_prose("the end") && is_prose("{n} files"));
    assert!(!is_prose("png") && !is_prose("{a} {b}") && !is_prose("MIP") && !is_prose("{x:.1}"));
}

/// What Cargo cannot enforce: the order of the modules of one member, and the crates that one module of a member uses alone.
#[test]
fn no_module_uses_a_module_above_it_in_its_member() {
    // A folder, and the modules that it must not name.
    let rules: &[(&str, &[&str])] = &[
        ("src/core/scene", &["passes", "plan", "barriers", "exact_ray", "reference"]),
        ("src/core/mesh", &["passes", "plan", "scene"]),
        ("src/core/spirv", &["passes", "plan", "scene"]),
        ("src/core/passes", &["plan", "barriers", "exact_ray"]),
        ("src/core/exact_ray", &["plan", "reference"]),
        ("src/session/measure", &["live", "gpu", "passes"]),
        ("src/session/kiosk", &["gpu"]),
        ("src/lab/profile", &["verify", "error_report"]),
        ("src/lab/bounds", &["gpu", "error_report"]),
        ("src/lab/error_report", &["verify"]),
        ("src/verify/report", &["gpu"]),
        ("src/batch", &["live", "kiosk", "profile", "cli"]),
    ];
    // A crate, and the only places of its member that may use it.
    let crates: &[(&str, &[&str])] = &[
        ("signal_hook::", &["src/base/files/signals.rs"]),
        ("tempfile::", &["src/base/files/"]),
        ("rav1e::", &["src/base/picture/film.rs"]),
        // To wait for several files at once, and to keep a process on one core, which the standard library cannot do.
        ("rustix::", &["src/probe/motor/", "src/ui/devices/", "src/cli/against.rs"]),
        ("evdev::", &["src/ui/devices/"]),
        ("arboard::", &["src/ui/clipboard.rs"]),
        ("winit::", &["src/ui/window.rs", "src/ui/screen_reader.rs"]),
        ("egui::", &["src/ui/panels/", "src/gpu/window/"]),
        // The colours that the contrast of everything is tested with are in one place.
        ("Color32::", &["src/ui/panels/colours.rs", "src/ui/panels/drawn.rs"]),
    ];
    let all: Vec<(String, String)> = sources("src").into_iter().map(|(name, text)| (name, code(&text))).collect();
    for (place, above) in rules {
        let within: Vec<_> = all.iter().filter(|(name, _)| name.starts_with(place)).collect();
        assert!(!within.is_empty(), "{place} is gone");
        for (name, code) in within {
            for module in *above {
                assert!(!code.contains(&format!("crate::{module}::")), "{name} names {module}, which stands on it");
            }
        }
    }
    for (name, text) in &all {
        for (word, homes) in crates {
            let at_home = homes.iter().any(|home| name.starts_with(home));
            assert!(at_home || !text.contains(word), "{name} names {word}, which only {homes:?} knows");
        }
        assert!(
            !text.contains(".unwrap()") || name.contains("test") || text.contains("#[cfg(test)]"),
            "{name} unwraps"
        );
    }
}

/// The compiler enforces these attributes. This test fails if one is removed: a member without its `forbid`, an allowed lint.
#[test]
fn unsafe_code_is_forbidden_in_every_member_but_one_and_has_its_reasons_there() {
    let read = |name: &str| std::fs::read_to_string(repository(name)).expect(name);
    let manifest: toml::Table = toml::from_str(&read("Cargo.toml")).expect("Cargo.toml");
    let members = manifest["workspace"]["members"].as_array().expect("members");
    let roots = members.iter().map(|member| format!("{}/lib.rs", member.as_str().expect("a path")));
    for root in roots.chain(["src/lib.rs".into(), "src/main.rs".into()]) {
        let forbids = read(&root).contains("#![forbid(unsafe_code)]");
        assert!(forbids != (root == "src/gpu/lib.rs"), "{root}: forbids unsafe code: {forbids}");
        let lints: toml::Table = toml::from_str(&read(
            &root.replace("lib.rs", "Cargo.toml").replace("src/Cargo", "Cargo").replace("src/main.rs", "Cargo.toml"),
        ))
        .expect("a manifest");
        assert_eq!(lints["lints"]["workspace"].as_bool(), Some(true), "{root} takes no lints of the workspace");
    }
    let lint = &manifest["workspace"]["lints"]["clippy"]["undocumented_unsafe_blocks"];
    assert_eq!(lint.as_str(), Some("deny"), "clippy is not asked for the reasons");
    for (name, text) in sources("src/gpu").into_iter().chain(sources("tests")).chain(sources("benches")) {
        assert!(!text.contains(concat!("undocumented_", "unsafe_blocks)")), "{name} allows unsafe without a reason");
        let lines: Vec<&str> = text.lines().collect();
        let blocks = lines.iter().enumerate().filter(|(_, l)| code(l).contains(UNSAFE));
        for (i, line) in blocks {
            let reasoned = (i.saturating_sub(6)..=i).any(|j| lines[j].contains("// SAFETY:"));
            assert!(reasoned, "{name}:{}: {}", i + 1, line.trim());
        }
    }
}

/// What `tools/test` leaves out is in a table of docs/validation.md. A name that is gone would leave nothing out, and hide that its test was renamed.
#[test]
fn every_test_of_the_nightly_part_exists() {
    let page = std::fs::read_to_string(repository("docs/validation.md")).expect("the page");
    let table = page.split("<!-- nightly -->").nth(1).and_then(|rest| rest.split("<!-- end of nightly -->").next());
    let rows = table.expect("a table").lines().filter(|line| line.starts_with("| `"));
    let named: Vec<(&str, &str)> =
        rows.map(|row| row.split('`').collect::<Vec<_>>()).map(|parts| (parts[1], parts[3])).collect();
    assert!(!named.is_empty(), "the table is empty");
    for (binary, name) in named {
        let (modules, test) = name.rsplit_once("::").expect("a module");
        // The tests of a member of the workspace are in its code.
        let mut folders = ["src", "tests"].map(|top| format!("{top}/{binary}")).into_iter();
        let folder = folders.rfind(|folder: &String| repository(folder).is_dir()).expect("a folder");
        let place = format!("{folder}/{}", modules.trim_end_matches("::tests").replace("::", "/"));
        let text = sources(&folder)
            .into_iter()
            .filter(|(path, _)| *path == format!("{place}.rs") || *path == format!("{place}/mod.rs"))
            .map(|(_, text)| text)
            .collect::<String>();
        assert!(text.contains(&format!("fn {test}()")), "docs/validation.md: {place} has no test {test}");
    }
}

/// The gate is compiled without debug assertions: what is worth an assertion is checked in every build.
#[test]
fn no_assertion_is_for_debug_builds_alone() {
    for (path, text) in sources("src") {
        let code = code(&text);
        assert!(
            !["debug_assert!", "debug_assert_eq!", "debug_assert_ne!"].iter().any(|name| code.contains(name)),
            "{path}"
        );
    }
}

/// A test that sleeps for a time fails under load, or is slow without: it waits for a condition.
#[test]
fn tests_sleep_only_in_their_one_module_of_waits() {
    let own = ["tests/common/wait.rs", "tests/unit_pure/rules.rs"];
    for (path, text) in sources("tests").into_iter().filter(|(path, _)| !own.contains(&path.as_str())) {
        let code = code(&text);
        let sleeps = ["sleep(", "park_timeout("].iter().any(|call| code.contains(call));
        assert!(!sleeps, "{path} sleeps: use tests/common/wait.rs");
    }
}

/// A wait for a queue waits for the picture in flight too, which may take seconds. egui-ash-renderer's own uploads of textures do that. `verify` asks for
/// it, to tell faults of synchronization from others.
#[test]
fn nothing_waits_for_a_whole_queue() {
    for (path, text) in sources("src") {
        let code = code(&text).replace("device.queue_wait_idle(*queue)", "");
        for call in ["queue_wait_idle", ".set_texture(", ".set_textures("] {
            assert!(!code.contains(call), "{path} uses {call}");
        }
    }
}

/// The crate that `tools/mutants` makes is complete: no file in it names a module that is not copied.
#[test]
fn the_crate_of_tools_mutants_is_complete() {
    let tool = std::fs::read_to_string(repository("tools/mutants")).expect("tools/mutants");
    let list = tool.split("\npure=\"").nth(1).and_then(|rest| rest.split('"').next()).expect("its list");
    let copied: Vec<String> = list.split_whitespace().map(|path| format!("src/{path}")).collect();
    let stands = |name: &str| copied.iter().any(|path| name == path || name.starts_with(&format!("{path}/")));
    let all = sources("src");
    for (name, text) in all.iter().filter(|(name, _)| stands(name)) {
        for module in code(text)
            .split("crate::")
            .skip(1)
            .filter_map(|rest| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next())
            .filter(|name| name.starts_with(char::is_lowercase))
        {
            let there = |path: &String| path.trim_end_matches(".rs").split('/').skip(1).any(|part| part == module);
            assert!(copied.iter().any(there), "{name} names crate::{module}, which tools/mutants does not copy");
        }
        let folder = format!("{}/", name.trim_end_matches(".rs"));
        let mut below = all.iter().filter(|(other, _)| other.starts_with(&folder));
        assert!(below.all(|(other, _)| stands(other)), "{name} is copied by tools/mutants without {folder}");
    }
}

#[test]
fn the_embedded_shaders_are_what_their_sources_say() {
    let text = std::fs::read_to_string(repository("spirv/SOURCES")).expect("spirv/SOURCES");
    let known: BTreeMap<&str, &str> = text.lines().filter_map(|l| l.split_once("  ")).map(|(h, n)| (n, h)).collect();
    let sources = shader_source::sources(&repository("glsl")).expect("glsl");
    for source in &sources {
        let hash: String = Sha256::digest(source.fingerprint()).iter().map(|b| format!("{b:02x}")).collect();
        assert_eq!(known.get(source.name.as_str()), Some(&hash.as_str()), "{}: run tools/shaders", source.name);
        assert!(spirv::embedded(&source.name).is_some(), "{} is not embedded", source.name);
    }
    assert_eq!(known.len(), sources.len(), "spirv/ has shaders that glsl/ has not");
    assert_eq!(spirv::EMBEDDED.len(), sources.len());
}

fn scenes() -> Vec<Scene> {
    let fan = Probe { lines: Axis::centred(0.05, 16), slices: Axis::centred(0.05, 8), ..wobbler() };
    let uneven = Axis::from_table((0..8).map(|k| 0.05 * k as f64 + 0.01 * (k as f64).sin()).collect());
    let advance = Advance::Same(0.02);
    let geometries = [
        Geometry::Sweep(fan.clone()),
        Geometry::Sweep(Probe { advance: advance.clone(), ..fan.clone() }),
        Geometry::Sweep(Probe { slices: uneven.clone(), ..fan.clone() }),
        Geometry::Sweep(Probe { slices: uneven, advance, ..fan.clone() }),
        Geometry::Sweep(Probe { motion: Motion::Still { thickness: 1.0 }, slices: Axis::centred(1.0, 1), ..fan }),
        voxels([8, 8, 8]),
    ];
    let filters = [
        "",
        "slices = { median = true, sigma = {}, smooth = { lateral = 1.0, depth = 1.0, elevation = 1.0 } }\n\
         distance = { median = 3, sigma = {}, bilateral = { pixels = 2.0, distance = 1.0 } }\npost = { sigma = {}, enhanced_sigma = {} }\n\
         light = { shadow = {}, occlusion = {}, skin = {} }",
        "light = { shadow = {} }",
        "light = { occlusion = {} }",
        "light = { volume = { cell = 8 } }",
        "light = { volume = { cell = 8, back = 0, scatter = 0, ground = {} } }\nregion = { fade = 3 }",
        "conditioning = { samples = 16, dynamic_range = 60 }",
        "conditioning = { tgc = [{ depth = 5, gain = -3 }] }",
        "slices = { median = true }",
        "slices = { sigma = {} }",
        "slices = { estimator = 'median' }",
        "slices = { estimator = 'median', enhanced_sigma = { growth = true }, perona_malik = {}, smooth = { lateral = 1.0 } }\n\
         distance = { enhanced_sigma = {}, perona_malik = {} }\npost = { perona_malik = {} }",
        "slices = { enhanced_sigma = {} }",
        "slices = { perona_malik = {} }",
        "slices = { perona_malik = { scheme = 'aos', repeat = 2 } }\npost = { perona_malik = { scheme = 'aos' } }",
        "slices = { perona_malik = { scheme = 'aos-richardson', repeat = 2 } }",
        "slices = { perona_malik = { scheme = 'rkl1', step = 2.0, repeat = 2 } }",
        "slices = { smooth = { lateral = 1.0 } }",
        "ray = { rays = 2 }",
        "ray = { sampling = 'quads' }",
        "ray = { elevation = 'bspline' }",
        "ray = { sampling = 'exact', elevation = 'bspline-sharp' }",
    ];
    let mut scenes = Vec::new();
    for geometry in &geometries {
        for filters in filters {
            if filters.contains("conditioning") && matches!(geometry, Geometry::Cartesian(_)) {
                continue; // has no lines
            }
            for mode in [
                "'vr'",
                "'sr'",
                "'mip'",
                "'sr'\nsurface = { colour = 'rendered' }",
                "'sr'\nsurface = { colour = 'behind' }",
                "'mixed'",
                "'vr'\nvolume = { shading = 'first-hit' }",
                "'vr'\nlayout = 'four'",
                "'vr'\nstill = { samples = 2, batch = 1 }",
                "'vr'\nfloating = 20",
                "'vr'\ncuts = [{ contour = [[0, 0], [1, 0], [0, 1]], view = { at = [0, 0, 0], direction = [0, 1, 0], up = [0, 0, 1] } }]",
                "'vr'\nlayout = 'four'\nplanes = { smooth = { lateral = 1.0, depth = 1.0, elevation = 1.0 } }",
                "'sr'\nlayout = 'pair'",
                "'sr'\nsurface = { detector = 'consistent' }",
            ] {
                scenes.push(scene(geometry.clone(), BYTES, &format!("mode = {mode}\n{filters}")));
            }
        }
        for sections in [
            "mode = 'vr'\nray = { rays = 2, adaptive = true }",
            "mode = 'vr'\nray = { tolerance = 1 }",
            "mode = 'plane'",
            "mode = 'orthogonal'",
            "mode = 'plane'\npost = { floats = true }",
            "mode = 'tomography'\nplanes = { lines = false, thickness = 3, slab = 'max' }",
            "mode = 'cube'\nclip = [{ at = [0, 0, 0], normal = [1, 0, 0] }]",
            "mode = 'vr'\nlight = { volume = { cell = 8 } }\nregion = { fade = 3 }\nclip = [{ at = [0, 0, 0], normal = [1, 0, 0] }]",
            "mode = 'sr'\nlight = { shadow = {} }\nclip = [{ at = [0, 0, 0], normal = [1, 0, 0] }]",
            "mode = 'mixed'\nclip = [{ at = [0, 0, 0], normal = [1, 0, 0] }]",
        ] {
            scenes.push(scene(geometry.clone(), BYTES, sections));
        }
        for labels in ["mode = 'sr'\nlayout = 'four'", "mode = 'mip'", "mode = 'orthogonal'"] {
            scenes.push(labelled(scene(geometry.clone(), BYTES, labels)).expect("labels"));
        }
    }
    // Values that a filter cannot read from the frames.
    scenes.push(scene(voxels([8, 8, 8]), FLOATS, "slices = { median = true }"));
    // With the shared memory of a GPU.
    let use_it = scenes.iter().filter(|s| s.settings.slices.perona_malik.is_some() || s.lit_by_volume().is_some());
    let device = DeviceFacts { shared_memory: 32 << 10, ..DeviceFacts::default() };
    let in_workgroups: Vec<_> = use_it.map(|s| Scene { device, ..s.clone() }).collect();
    scenes.extend(in_workgroups);
    scenes
}

/// Prevents a pass over runs of slices whose writes a validation layer since 2024 takes for hazards, and one that is excused for nothing.
#[test]
fn the_writers_of_runs_of_slices_are_listed_for_validation() {
    let over_volumes = PASSES.iter().filter(|p| p.frequency == Frequency::Volume);
    let scenes = scenes();
    let mut writers = BTreeSet::new();
    for (pass, scene) in over_volumes.flat_map(|p| scenes.iter().filter(|s| p.is_needed(s)).map(move |s| (p, s))) {
        let args = DispatchArgs::default();
        if pass.writes(scene, &args).iter().any(|bind| matches!(bind.part, Part::Around(_))) {
            writers.insert((pass.name, pass.shader(scene, &args)));
        }
    }
    assert_eq!(writers, BTreeSet::from(WRITERS_OF_RUNS));
}

#[test]
fn every_pass_agrees_with_every_shader_it_may_use() {
    let mut used = Vec::new();
    // All that a check depends on: many scenes declare the same.
    let mut checked = BTreeSet::new();
    for scene in scenes() {
        for pass in PASSES.iter().filter(|p| p.is_needed(&scene)) {
            for iteration in 0..(pass.repeat)(&scene) {
                let args = DispatchArgs { iteration, ..DispatchArgs::default() };
                let shader = pass.shader(&scene, &args);
                let binds = [pass.reads(&scene, &args), pass.writes(&scene, &args)].concat();
                let slots: Vec<_> = binds.iter().map(|b| (b.slot.format(&scene), b.slot.shape(&scene))).collect();
                let numbers: Vec<_> =
                    pass.numbers(&scene, &args).0.iter().map(|(name, v)| (*name, std::mem::discriminant(v))).collect();
                let constants = pass.constants(&scene, &args);
                if !checked.insert(format!("{} {shader} {binds:?} {slots:?} {numbers:?} {constants:?}", pass.name)) {
                    continue;
                }
                let bytes =
                    spirv::embedded(shader).unwrap_or_else(|| panic!("{}: {shader} is not embedded", pass.name));
                // As compiled, and with its textures as storage images.
                let words = interface_check::for_scene(pass, &scene, &args, &spirv::words(bytes)).expect("the scene's");
                let stored = interface_check::for_cpu(pass, &scene, &args, &words, |_| true);
                let stored = stored.unwrap_or_else(|e| panic!("{} with {shader}: {e}", pass.name));
                for words in [&words, &stored] {
                    let module = spirv::reflect(words).expect("reflection");
                    let agreed = interface_check::check(pass, &scene, &args, &module);
                    agreed.unwrap_or_else(|e| panic!("{} with {shader}: {e}", pass.name));
                }
                let left = spirv::reflect(&stored).expect("reflection").bindings;
                let textures = left.iter().filter(|b| b.kind == spirv::Kind::Sampled).count();
                assert_eq!(textures, 0, "{shader} still fetches from a texture");
                used.push(shader);
            }
        }
    }
    let scene = device_limits::scene(8, 8).expect("scene");
    for pass in device_limits::MEASURES.iter().chain([&device_limits::POSITIONS]) {
        let shader = pass.shader(&scene, &DispatchArgs::default());
        let module = spirv::reflect(&spirv::words(spirv::embedded(shader).expect("embedded"))).expect("reflection");
        interface_check::check(pass, &scene, &DispatchArgs::default(), &module).expect("agreement");
        used.push(shader);
    }
    for (name, _) in spirv::EMBEDDED {
        assert!(used.contains(name), "no scene uses {name}");
    }
}

#[test]
fn an_interface_mismatch_names_both_sides() {
    let scene = scenes().swap_remove(1);
    let tone = echolume::low_level::passes::by_name("tone").unwrap();
    let words = spirv::words(spirv::embedded("postprocess/tone").unwrap());
    let module =
        spirv::reflect(&interface_check::for_scene(tone, &scene, &DispatchArgs::default(), &words).unwrap()).unwrap();
    let changed = |change: fn(&mut Pass)| {
        let mut pass = Pass { ..*tone };
        change(&mut pass);
        interface_check::check(&pass, &scene, &DispatchArgs::default(), &module).unwrap_err()
    };
    let error = changed(|p| {
        p.reads = |_, _| vec![echolume::low_level::passes::whole("pictur", echolume::low_level::passes::Slot::Picture)]
    });
    assert!(error.contains("pictur") && error.contains("reads"), "{error}");
    let error = changed(|p| p.params = |_, _| echolume::low_level::passes::Params::default().i32("brightness", 1));
    assert!(error.contains("brightness") && error.contains("float"), "{error}");
    let error = changed(|p| p.constants = |_, _| vec![("COLOUR", 1)]);
    assert!(error.contains("COLOUR"), "{error}");
    let error = changed(|p| {
        p.writes = |_, _| vec![echolume::low_level::passes::whole("screen", echolume::low_level::passes::Slot::Volume)]
    });
    assert!(error.contains("Three") && error.contains("Two"), "{error}");
}

#[test]
fn pass_names_are_unique_and_stages_in_order() {
    let mut names: Vec<_> = PASSES.iter().map(|p| p.name).collect();
    assert!(PASSES.windows(2).all(|w| w[0].stage <= w[1].stage), "a pass runs before its stage");
    names.sort();
    names.dedup();
    assert_eq!(names.len(), PASSES.len());
}

/// A type that knows more than that is a wall in the wrong place.
#[test]
fn no_type_of_the_program_has_more_than_25_fields() {
    struct Fields(Vec<(String, usize)>);
    impl<'ast> syn::visit::Visit<'ast> for Fields {
        fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
            self.0.push((item.ident.to_string(), item.fields.len()));
        }
    }
    let mut all = Fields(Vec::new());
    for (path, text) in sources("src").into_iter().filter(|(path, _)| !path.contains("/tests/")) {
        let file = syn::parse_file(&text).unwrap_or_else(|e| panic!("{path}: {e}"));
        syn::visit::Visit::visit_file(&mut all, &file);
    }
    assert!(all.0.len() > 500, "{} structs", all.0.len());
    assert_eq!(all.0.iter().filter(|(_, fields)| *fields > 25).collect::<Vec<_>>(), Vec::<&(String, usize)>::new());
}

/// Identifiers in a text.
fn identifiers(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

/// Names of the functions and constants that a file declares more visible than its own module, tests left out.
fn exported(text: &str) -> Vec<&str> {
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or(text);
    let declared = |line: &'_ str| line.trim_start().starts_with("pub");
    code.lines()
        .filter(|line| declared(line))
        .filter_map(|line| {
            let mut words = identifiers(line).skip_while(|word| !["fn", "const", "static"].contains(word)).skip(1);
            words.find(|word| !["fn", "unsafe", "async", "mut"].contains(word))
        })
        .collect()
}

#[test]
fn nothing_is_public_that_no_other_file_uses() {
    let folders = ["src", "tests", "benches", "tools/mutants/src", "tools/shaders/src", "tools/fuzz"];
    let all: Vec<_> = folders.iter().filter(|f| repository(f).exists()).flat_map(|f| sources(f)).collect();
    // Files that contain each identifier.
    let mut users: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (name, text) in &all {
        identifiers(text).for_each(|word| _ = users.entry(word).or_default().insert(name));
    }
    let unused: Vec<_> = all
        .iter()
        .filter(|(name, _)| name.starts_with("src/"))
        .flat_map(|(name, text)| exported(text).into_iter().map(move |word| (name, word)))
        .filter(|(name, word)| users[word].iter().all(|user| user == name))
        .collect();
    assert!(unused.is_empty(), "public, and used by no other file: {unused:?}");
    assert_eq!(exported("pub const fn a() {}\n    pub(super) fn b()\nfn c()\npub static D: u8 = 0;"), ["a", "b", "D"]);
}

/// A member shows others what they use, and no more: a function that nobody else names is `pub(crate)`. Types are shown by the functions that return them.
#[test]
fn no_member_shows_a_function_that_nobody_else_names() {
    let folders = ["src", "tests", "benches", "tools/python/src", "tools/shaders/src", "tools/fuzz"];
    let all: Vec<_> = folders.iter().filter(|f| repository(f).exists()).flat_map(|f| sources(f)).collect();
    let member = |path: &str| {
        let folder = path.strip_prefix("src/").and_then(|rest| rest.split('/').next()).unwrap_or("");
        repository(&format!("src/{folder}/Cargo.toml")).exists().then(|| folder.to_string())
    };
    let mut users: BTreeMap<&str, BTreeSet<Option<String>>> = BTreeMap::new();
    for (name, text) in &all {
        identifiers(text).for_each(|word| _ = users.entry(word).or_default().insert(member(name)));
    }
    let mut shown = Vec::new();
    for (name, text) in all.iter().filter(|(name, _)| member(name).is_some()) {
        let open: String =
            text.lines().filter(|line| line.trim_start().starts_with("pub ")).map(|l| format!("{l}\n")).collect();
        for word in exported(&open) {
            if users[word].iter().all(|user| *user == member(name)) {
                shown.push(format!("{name}: {word}"));
            }
        }
    }
    assert!(shown.is_empty(), "public, and named in no other member: {shown:#?}");
}
