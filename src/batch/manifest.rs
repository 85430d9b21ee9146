//! The manifest: one unit of work a line, as JSON (NDJSON). Only the units of one shard are kept in memory.

use crate::tree::{self, FromNode, ToNode};
use serde_json::{Map, Value};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::sync::Arc;

/// Most bytes of a line.
const MAX_LINE: u64 = 1 << 20;
/// Largest number of units.
const MAX_UNITS: usize = 1 << 27;
/// Largest number of outputs of a unit.
const MAX_OUTPUTS: usize = 4;

/// A unit of work, which is one line of the manifest: a recording and what is done with it.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Unit {
    /// Path of the recording, absolute or relative to the manifest's folder.
    pub input: String,
    /// SHA-256 of the recording, 64 lower-case hexadecimal digits. None: the recording has to be read to compute the key of its outputs.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// Length of the recording's files, bytes; None if not given.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
    /// Expected cost, relative to the other lines; 1 if not given.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub cost: Option<f64>,
    /// Settings as in a scene file, with which the recording is rendered. Not allowed together with `command`.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<Map<String, Value>>,
    /// What is done: `render`, `convert`, `measure` or `verify` with its flags. None: `render`, with `scene` if that is given.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<Vec<String>>,
    /// File names of the outputs, without a folder. Every command makes one output, so that more names are an error when the command is parsed.
    /// Empty: a name by the kind of work, such as `picture.png`.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<String>,
}

/// A unit and the number of its line in the manifest, from 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbered {
    pub line: u64,
    pub unit: Arc<Unit>,
}

/// The part of a line that the division into shards needs.
#[derive(FromNode)]
struct Cost {
    cost: Option<f64>,
}

impl Unit {
    /// Checks what can be checked without the recording.
    fn check(&self) -> Result<(), String> {
        if self.input.is_empty() {
            return Err("input: is empty".into());
        }
        if let Some(digest) = &self.digest
            && !(digest.len() == 64 && digest.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b)))
        {
            return Err("digest: must be 64 lower-case hexadecimal digits, as sha256sum prints".into());
        }
        if self.scene.is_some() && self.command.is_some() {
            return Err("scene and command: only one of them may be given".into());
        }
        if self.outputs.len() > MAX_OUTPUTS {
            return Err(format!("outputs: at most {MAX_OUTPUTS}"));
        }
        self.outputs.iter().try_for_each(|name| check_name(name))
    }
}

/// Checks that an output's name is a plain file name on every system, so that it cannot leave the unit's folder.
fn check_name(name: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-+".contains(c);
    match !name.is_empty() && name.len() <= 100 && !name.starts_with('.') && name.chars().all(plain) {
        true => Ok(()),
        false => Err("outputs: a name has at most 100 letters, digits, '.', '_', '-' and '+', and no folder".into()),
    }
}

fn check_cost(cost: Option<f64>) -> Result<f64, String> {
    match cost.unwrap_or(1.0) {
        cost if cost.is_finite() && cost >= 0.0 => Ok(cost),
        cost => Err(format!("cost: {cost} must be finite and not below 0")),
    }
}

/// Calls `each` with the number and the text of every line that is not empty.
fn for_each_line(file: &Path, mut each: impl FnMut(u64, &str) -> Result<(), String>) -> Result<(), String> {
    let fault = |e: &dyn std::fmt::Display| format!("{}: cannot be read: {e}", file.display());
    let mut reader = BufReader::new(File::open(file).map_err(|e| fault(&e))?);
    let (mut line, mut number) = (Vec::new(), 0);
    loop {
        line.clear();
        number += 1;
        let read = reader.by_ref().take(MAX_LINE + 1).read_until(b'\n', &mut line).map_err(|e| fault(&e))?;
        if read == 0 {
            return Ok(());
        }
        let at = |e: String| format!("{}:{number}: {e}", file.display());
        if read as u64 > MAX_LINE {
            return Err(at(format!("the line is longer than {MAX_LINE} bytes")));
        }
        let text = std::str::from_utf8(&line).map_err(|_| at("is not UTF-8 text".into()))?.trim();
        if !text.is_empty() {
            each(number, text).map_err(at)?;
        }
    }
}

/// The expected cost of every unit, in the order of the manifest: at least 0, relative to the others, 1 where the line states none.
///
/// # Errors
/// One line that names the file and the fault, and the line if one is wrong: the file cannot be read, has no unit or more than 2^27, a line is no
/// JSON object, or a cost is no number, negative or not finite. Other fields are not checked.
pub fn costs(file: &Path) -> Result<Vec<f64>, String> {
    let mut costs = Vec::new();
    for_each_line(file, |_, text| {
        if costs.len() >= MAX_UNITS {
            return Err(format!("a manifest has at most {MAX_UNITS} units; divide it"));
        }
        let line: Cost = tree::from_json(text.as_bytes()).map_err(|e| format!("is no unit: {e}"))?;
        costs.push(check_cost(line.cost)?);
        Ok(())
    })?;
    match costs.is_empty() {
        true => Err(format!("{}: has no unit", file.display())),
        false => Ok(costs),
    }
}

/// The units that `is_chosen` selects by their index in the manifest, from 0, in the order of the manifest.
///
/// # Errors
/// One line that names the file and the fault, and the line if one is wrong.
pub fn units(file: &Path, is_chosen: impl Fn(usize) -> bool) -> Result<Vec<Numbered>, String> {
    let (mut units, mut place) = (Vec::new(), 0);
    for_each_line(file, |line, text| {
        place += 1;
        if is_chosen(place - 1) {
            let unit: Unit = tree::from_json(text.as_bytes()).map_err(|e| format!("is no unit: {e}"))?;
            check_cost(unit.cost)?;
            unit.check()?;
            units.push(Numbered { line, unit: Arc::new(unit) });
        }
        Ok(())
    })?;
    Ok(units)
}

/// Calls `each` with every unit of a manifest, in its order. Only one is in memory at a time. Lines are parsed, but values are not checked as by
/// [`units`].
///
/// # Errors
/// One line that names the file and the fault, and the line if one is wrong.
pub fn for_each_unit(file: &Path, mut each: impl FnMut(&Unit)) -> Result<(), String> {
    for_each_line(file, |_, text| {
        each(&tree::from_json(text.as_bytes()).map_err(|e| format!("is no unit: {e}"))?);
        Ok(())
    })
}
