//! The sources and licences of the crates, by the rules of deny.toml and without cargo-deny, and the Rust version that they need. Known
//! vulnerabilities are looked up by tools/deny, which needs a network.

use crate::common::files::repository;
use serde::Deserialize;
use spdx::{Expression, LicenseReq, ParseMode};
use std::collections::BTreeMap;
use std::process::Command;

const CRATES_IO: &str = "registry+https://github.com/rust-lang/crates.io-index";

#[derive(Deserialize)]
struct Lock {
    package: Vec<Locked>,
}

#[derive(Deserialize)]
struct Locked {
    name: String,
    source: Option<String>,
    checksum: Option<String>,
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    source: Option<String>,
    license: Option<String>,
    rust_version: Option<String>,
}

fn toml<T: for<'de> Deserialize<'de>>(name: &str) -> T {
    toml::from_str(&std::fs::read_to_string(repository(name)).expect(name)).expect(name)
}

fn words(value: &toml::Value) -> Vec<String> {
    value.as_array().expect("a list").iter().map(|word| word.as_str().expect("a word").to_string()).collect()
}

fn asked(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).current_dir(repository("")).output();
    let output = output.expect("it can be started");
    assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The crates that are built on this machine: the others are not downloaded.
fn packages() -> Vec<Package> {
    let version = asked("rustc", &["-vV"]);
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("a host");
    let about = ["metadata", "--format-version", "1", "--offline", "--locked", "--filter-platform", host];
    serde_json::from_str::<Metadata>(&asked(env!("CARGO"), &about)).expect("metadata").packages
}

#[test]
fn every_crate_is_from_one_registry_and_its_bytes_are_known() {
    for lock in ["Cargo.lock", "tools/fuzz/Cargo.lock", "tools/python/Cargo.lock", "tools/shaders/Cargo.lock"] {
        let locked: Lock = toml(lock);
        assert!(locked.package.len() > 10, "{lock}");
        for Locked { name, source, checksum } in locked.package {
            let is_ours = name.starts_with("echolume") && source.is_none();
            let is_known = checksum.is_some_and(|sum| sum.len() == 64 && sum.bytes().all(|b| b.is_ascii_hexdigit()));
            assert!(is_ours || source.as_deref() == Some(CRATES_IO), "{lock}: {name} comes from {source:?}");
            assert!(is_ours || is_known, "{lock}: {name} has no checksum");
        }
    }
    let deny: toml::Table = toml("deny.toml");
    let allowed = words(&deny["sources"]["allow-registry"]);
    assert_eq!(allowed, [CRATES_IO.trim_start_matches("registry+")], "deny.toml allows other registries");
}

#[test]
fn every_crate_has_a_licence_that_is_allowed() {
    let deny: toml::Table = toml("deny.toml");
    let allowed = words(&deny["licenses"]["allow"]);
    let exceptions = deny["licenses"]["exceptions"].as_array().expect("exceptions");
    let mut also: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for exception in exceptions {
        also.insert(exception["crate"].as_str().expect("a crate"), words(&exception["allow"]));
    }
    let packages = packages();
    assert!(packages.len() > 100, "{} crates", packages.len());
    for Package { name, license, .. } in packages.iter().filter(|package| package.source.is_some()) {
        let license = license.as_deref().unwrap_or_else(|| panic!("{name} has no licence"));
        let parsed = Expression::parse_mode(license, ParseMode::LAX);
        let parsed = parsed.unwrap_or_else(|e| panic!("{name}: {license}: {e}"));
        let more = also.remove(name.as_str()).unwrap_or_default();
        let is_allowed = |asked: &LicenseReq| {
            let asked = asked.to_string();
            allowed.contains(&asked) || more.contains(&asked)
        };
        assert!(parsed.evaluate(is_allowed), "{name}: {license} is none of deny.toml's licences");
    }
    assert!(also.is_empty(), "exceptions for crates that are not there: {also:?}");
}

/// Major, minor and patch of a version such as 1.95.
fn version(text: &str) -> [u32; 3] {
    let mut numbers = text.split('.').map(|number| number.parse().expect("a number"));
    std::array::from_fn(|_| numbers.next().unwrap_or(0))
}

#[test]
fn rust_version_is_what_the_crates_need() {
    let packages = packages();
    let ours = packages.iter().find(|package| package.name == "echolume").and_then(|p| p.rust_version.as_deref());
    let ours = ours.expect("Cargo.toml has a rust-version");
    let mut count = 0;
    for Package { name, rust_version, .. } in &packages {
        let Some(needed) = rust_version else { continue };
        assert!(version(ours) >= version(needed), "{name} needs Rust {needed}: Cargo.toml's rust-version is {ours}");
        count += 1;
    }
    assert!(count > 100, "only {count} crates say which Rust they need");
    assert!(version("1.88") < version("1.88.1") && version("1.100") > version("1.95") && version("1.95") == [1, 95, 0]);
}

/// Prevents a wheel or a fuzz target that cannot be built, because a crate was added here: nothing in the gate builds them.
#[test]
fn the_crates_beside_the_program_have_locked_what_the_library_needs() {
    #[derive(Deserialize)]
    struct Entry {
        name: String,
        #[serde(default)]
        dependencies: Vec<String>,
    }
    #[derive(Deserialize)]
    struct Entries {
        package: Vec<Entry>,
    }
    let manifest: toml::Table = toml("Cargo.toml");
    let mut manifests = vec![manifest.clone()];
    manifests
        .extend(words(&manifest["workspace"]["members"]).iter().map(|member| toml(&format!("{member}/Cargo.toml"))));
    let is_optional = |about: &toml::Value| about.get("optional").and_then(toml::Value::as_bool).unwrap_or(false);
    for lock in ["tools/python/Cargo.lock", "tools/fuzz/Cargo.lock"] {
        let entries: Entries = toml(lock);
        for manifest in &manifests {
            let package = manifest["package"]["name"].as_str().expect("a name");
            let Some(entry) = entries.package.iter().find(|entry| entry.name == package) else { continue };
            let mut tables = vec![&manifest["dependencies"]];
            let targets = manifest.get("target").and_then(toml::Value::as_table);
            tables.extend(targets.into_iter().flat_map(|all| all.values().map(|target| &target["dependencies"])));
            let all: BTreeMap<&String, &toml::Value> =
                tables.into_iter().flat_map(|table| table.as_table().expect("dependencies")).collect();
            // A crate of which there are two versions has its version behind its name.
            let locked: Vec<&str> = entry.dependencies.iter().filter_map(|crate_| crate_.split(' ').next()).collect();
            for (needed, _) in all.iter().filter(|(_, about)| !is_optional(about)) {
                assert!(
                    locked.contains(&needed.as_str()),
                    "{lock}, {package}: no {needed}: run `cargo metadata` beside it"
                );
            }
            for there in locked {
                assert!(all.keys().any(|known| *known == there), "{lock}, {package}: {there} is needed no more");
            }
        }
        let has = |name: &str| entries.package.iter().any(|entry| entry.name == name);
        assert!(has("echolume-core"), "{lock} has no library");
        // What builds the wheel needs neither the command line nor the window.
        let others = ["echolume", "echolume-lab", "echolume-ui", "echolume-verify", "clap", "egui", "tar", "winit"];
        if lock.starts_with("tools/python") {
            assert_eq!(others.into_iter().find(|name| has(name)), None, "{lock}");
        }
    }
}

/// The Python module has the version of the program, and its types know the presets.
#[test]
fn the_python_module_is_of_this_version_and_knows_the_presets() {
    let version = |path: &str, keys: [&str; 2]| {
        let manifest: toml::Table = toml(path);
        let table = manifest[keys[0]].as_table().expect("a table");
        let table = if keys[1].is_empty() { table } else { table[keys[1]].as_table().expect("a table") };
        table["version"].as_str().expect("a version").to_string()
    };
    assert_eq!(version("tools/python/Cargo.toml", ["package", ""]), version("Cargo.toml", ["workspace", "package"]));
    let types = std::fs::read_to_string(repository("tools/python/python/echolume/_inputs.py")).expect("the module");
    let line = types.lines().find(|line| line.starts_with("Preset = ")).expect("the type of presets");
    let named: Vec<&str> = line.split('"').skip(1).step_by(2).collect();
    assert_eq!(named, echolume::low_level::scene::load::PRESETS.iter().map(|preset| preset.0).collect::<Vec<_>>());
}

/// Prevents pictures and recordings that a build does not need from going with every copy of the sources.
#[test]
fn the_package_is_under_10_mb_and_has_what_a_build_needs() {
    let files = asked(env!("CARGO"), &["package", "--list", "--allow-dirty", "--offline"]);
    // Cargo makes some of them.
    let size = |name: &str| std::fs::metadata(repository(name)).map_or(0, |about| about.len());
    let sizes: u64 = files.lines().map(size).sum();
    assert!((1_000_000..10_000_000).contains(&sizes), "{sizes} bytes");
    for needed in ["src/main.rs", "spirv/embedded.rs", "spirv/SOURCES", "docs/licences/lucide.txt", "CITATION.cff"] {
        assert!(files.lines().any(|name| name == needed), "{needed} is left out");
    }
    println!("{} files, {sizes} bytes", files.lines().count());
}

/// What a user cites is what was built.
#[test]
fn the_citation_has_the_version_of_the_program() {
    let citation = std::fs::read_to_string(repository("CITATION.cff")).expect("CITATION.cff");
    let of = |key: &str| {
        let mut values = citation.lines().filter_map(|line| line.strip_prefix(key)?.strip_prefix(": "));
        values.next().unwrap_or_else(|| panic!("CITATION.cff has no {key}")).to_string()
    };
    let manifest: toml::Table = toml("Cargo.toml");
    assert_eq!(manifest["workspace"]["package"]["version"].as_str(), Some(of("version").as_str()));
    assert_eq!((of("cff-version").as_str(), of("type").as_str()), ("1.2.0", "software"));
    // The keys that the format requires.
    for key in ["message", "title"] {
        assert!(of(key).len() > 10, "{key}");
    }
    assert!(citation.contains("\nauthors:\n  - name: "), "CITATION.cff has no authors");
}
