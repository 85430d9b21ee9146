//! Compiles every variant of every shader below glsl/ to spirv/, and writes the table that the program embeds.
//! Needs cmake, ninja and python3 for the build of shaderc; the program itself needs none of them.
//!
//!     cargo run --release --manifest-path tools/shaders/Cargo.toml

#[path = "../../../src/gpu/shader_source.rs"]
mod shader_source;
#[path = "../../../src/gpu/shader_compile.rs"]
mod shader_compile;

use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

fn main() -> Result<(), String> {
    // Another checkout may be named.
    let top = std::env::args().nth(1).map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."), Into::into);
    let (glsl, spirv) = (top.join("glsl"), top.join("spirv"));
    let known = read_hashes(&spirv.join("SOURCES"));

    let compiler = shaderc::Compiler::new().map_err(|e| e.to_string())?;
    let mut hashes = String::new();
    let mut table = String::from("// Written by tools/shaders.\n&[\n");
    let mut compiled = 0;
    let sources = shader_source::sources(&glsl)?;
    for source in &sources {
        let hash: String = Sha256::digest(source.fingerprint()).iter().map(|b| format!("{b:02x}")).collect();
        let file = spirv.join(format!("{}.spv", source.name));
        if known.get(&source.name) != Some(&hash) || !file.exists() {
            let words = shader_compile::compile(&compiler, source)?;
            write(&file, &strip_source(&words))?;
            compiled += 1;
        }
        let _ = writeln!(hashes, "{hash}  {}", source.name);
        let _ = writeln!(table, "    (\"{0}\", include_bytes!(\"{0}.spv\")),", source.name);
    }
    for stale in known.keys().filter(|name| !sources.iter().any(|s| s.name == **name)) {
        let _ = std::fs::remove_file(spirv.join(format!("{stale}.spv")));
    }
    table.push_str("]\n");
    write(&spirv.join("SOURCES"), hashes.as_bytes())?;
    write(&spirv.join("embedded.rs"), table.as_bytes())?;
    println!("{} shaders, {compiled} compiled", sources.len());
    Ok(())
}

fn write(file: &Path, bytes: &[u8]) -> Result<(), String> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    std::fs::write(file, bytes).map_err(|e| format!("{}: {e}", file.display()))
}

fn read_hashes(file: &Path) -> BTreeMap<String, String> {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    text.lines().filter_map(|l| l.split_once("  ")).map(|(hash, name)| (name.to_string(), hash.to_string())).collect()
}

/// Drops the embedded source text and line marks (OpSource, OpSourceContinued, OpString, OpLine, OpNoLine): names stay,
/// and a comment does not change the binary.
fn strip_source(words: &[u32]) -> Vec<u8> {
    let mut kept: Vec<u32> = words[..5].to_vec();
    let mut at = 5;
    while at < words.len() {
        let (length, op) = ((words[at] >> 16) as usize, words[at] & 0xffff);
        if !matches!(op, 2 | 3 | 7 | 8 | 317) {
            kept.extend_from_slice(&words[at..at + length]);
        }
        at += length.max(1);
    }
    kept.iter().flat_map(|w| w.to_le_bytes()).collect()
}
