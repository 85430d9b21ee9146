//! What is stored of a unit: its record, whose existence marks it as done, and a line in the results of its shard.

use super::agreement::{Agreement, Drawer};
use super::shard::Shard;
use super::unit::Key;
use crate::digest::sha256_of_file;
use crate::terminal::remark;
use crate::tree::{self, FromNode, ToNode};
use crate::{files, machine};
use serde_json::{Map, Value};
use std::collections::{HashMap, HashSet};
use std::fs::{self, File, OpenOptions};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Name and version of the format of records.
pub const FORMAT: &str = "echolume-batch-1";
/// Most bytes of a line of results and of a record.
const MAX_LINE: u64 = 1 << 20;

/// How an attempt to do a unit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ToNode, FromNode)]
#[tree(rename_all = "lowercase")]
pub enum Status {
    Done,
    /// The recording or the command is wrong, so that another attempt would fail, too.
    Bad,
    /// The work failed for another reason.
    Failed,
    /// The device was lost during the work.
    Lost,
}

/// Wall-clock time that a unit took in each stage, s.
#[derive(Clone, Copy, Debug, Default, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Seconds {
    /// Time for reading the recording, on the thread that reads ahead, s.
    pub read: f64,
    /// Time for which the worker waited for the recording, s.
    pub wait: f64,
    /// Time for drawing, converting or comparing, s. For `convert` it includes writing the volume. 0 if the work was not finished.
    pub work: f64,
    /// Time for writing and renaming the output, s. About 0 for `convert` and for a comparison, and 0 if the work was not finished.
    pub write: f64,
}

/// An output file of a unit, with its length and digest.
#[derive(Clone, Debug, PartialEq, Eq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct OutputFile {
    /// Path of the file relative to the batch's folder.
    pub file: String,
    pub bytes: u64,
    pub sha256: String,
}

/// The result of one attempt to do a unit.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Record {
    /// Name and version of the format; [`FORMAT`] if this version of the program wrote it.
    pub format: String,
    /// Key of the outputs, with which their file names begin. Empty if the manifest states no digest and the recording could not be read.
    pub key: String,
    /// Number of the unit's line in the manifest, from 1.
    pub line: u64,
    pub input: String,
    /// The command or the scene of the unit, as text.
    pub work: String,
    pub status: Status,
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<OutputFile>,
    pub seconds: Seconds,
    /// The device that was open when the attempt ended; None if the work needs none, or none was open.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub drawer: Option<Drawer>,
    pub program: String,
    pub host: String,
    /// Date and time of the end of the attempt, RFC 3339.
    pub date: String,
    #[tree(default, skip_serializing_if = "Map::is_empty")]
    pub figures: Map<String, Value>,
    /// The comparison with the stored picture; None unless a finished unit was drawn again for it.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub agreement: Option<Agreement>,
}

/// Numbers of outputs whose digests were compared with those in their records.
#[derive(Default)]
pub(super) struct Verified {
    pub whole: AtomicU64,
    /// Number of outputs that have another digest or cannot be read. Each is reported in a line, and its unit is done again.
    pub damaged: AtomicU64,
}

impl Verified {
    /// Whether an output has the digest that its record states; counts and reports it.
    fn is_whole(&self, folder: &Path, output: &OutputFile) -> bool {
        let file = folder.join(&output.file);
        let fault = match sha256_of_file(&file) {
            Ok((sha256, _)) if sha256 == output.sha256 => None,
            Ok((sha256, _)) => Some(format!("has the digest {sha256}, its record says {}", output.sha256)),
            Err(e) => Some(format!("cannot be read: {e}")),
        };
        let count = if fault.is_none() { &self.whole } else { &self.damaged };
        count.fetch_add(1, Ordering::Relaxed);
        fault.is_none_or(|fault| {
            remark(&format!("{}: {fault}; it is made again", file.display()));
            false
        })
    }
}

/// The record of a finished unit. None unless it is valid and all outputs exist with the recorded length and, with `verified`, the recorded
/// digest.
pub(super) fn read_record(folder: &Path, key: &Key, verified: Option<&Verified>) -> Option<Record> {
    let bytes = files::read(&folder.join(key.record()), MAX_LINE, "record").ok()?;
    let record: Record = tree::from_json(&bytes).ok()?;
    let is_there = |output: &OutputFile| {
        fs::metadata(folder.join(&output.file)).is_ok_and(|there| there.is_file() && there.len() == output.bytes)
    };
    let is_done = record.format == FORMAT && record.status == Status::Done && record.key == key.text();
    let is_whole = |output: &OutputFile| verified.is_none_or(|verified| verified.is_whole(folder, output));
    (is_done && record.outputs.iter().all(is_there) && record.outputs.iter().all(is_whole)).then_some(record)
}

/// Hash of a unit's recording and work: eight bytes instead of two texts, as there may be millions.
fn hash_of(input: &str, work: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    (input, work).hash(&mut hasher);
    hasher.finish()
}

/// The set of units in a manifest, as hashes: a million take about 18 MiB.
#[derive(Default)]
pub struct Asked(HashSet<u64>);

impl Asked {
    pub fn add(&mut self, input: &str, work: &str) {
        self.0.insert(hash_of(input, work));
    }
}

/// Results that earlier runs wrote into a folder.
#[derive(Debug, Default)]
pub struct Earlier {
    /// True if the folder of the batch has the folder `results`, even an empty one.
    pub is_begun: bool,
    /// True if the files that were read have at least one record.
    pub has_lines: bool,
    /// True if at least one of these records is about a unit of the present manifest, which is `asked` of [`Earlier::read`]. False without `asked`.
    pub is_of_these: bool,
    /// Keys and recordings of this shard's units with a line that says done.
    done: HashSet<(String, String)>,
    /// Number of lost devices of this shard's units, by recording and work.
    lost: HashMap<(String, String), usize>,
    /// Units of all shards that were asked for and that this version of the program has done.
    done_anywhere: HashSet<u64>,
}

impl Earlier {
    /// Reads the earlier results of a shard; a folder without results has none. If `asked`, the units of the manifest, is given, results of all other
    /// shards are read, too, also of divisions into another number of shards. Each file is read once, and nothing is written.
    ///
    /// # Errors
    /// One line that names the file that cannot be read.
    pub fn read(folder: &Path, shard: Shard, asked: Option<&Asked>) -> Result<Earlier, String> {
        let mut found = Earlier::default();
        let own = file_of(folder, shard);
        let files = match files_of(folder) {
            Err((_, e)) if e.kind() == io::ErrorKind::NotFound => return Ok(found),
            files => files.map_err(|(place, e)| format!("{}: cannot be read: {e}", place.display()))?,
        };
        found.is_begun = true;
        let program = machine::program();
        for file in files.iter().filter(|file| asked.is_some() || **file == own) {
            for_each_record(file, |record| {
                found.has_lines = true;
                let hash = hash_of(&record.input, &record.work);
                if asked.is_some_and(|asked| asked.0.contains(&hash)) {
                    found.is_of_these = true;
                    if record.status == Status::Done && record.program == program {
                        found.done_anywhere.insert(hash);
                    }
                }
                if *file != own {
                    return;
                }
                match record.status {
                    Status::Done => drop(found.done.insert((record.key, record.input))),
                    Status::Lost => *found.lost.entry((record.input, record.work)).or_insert(0) += 1,
                    Status::Bad | Status::Failed => {}
                }
            })?;
        }
        Ok(found)
    }

    /// True if any shard has done this unit with this version of the program. False for a unit that was not in `asked` of [`Earlier::read`].
    pub fn says_done(&self, input: &str, work: &str) -> bool {
        self.done_anywhere.contains(&hash_of(input, work))
    }
}

fn file_of(folder: &Path, shard: Shard) -> PathBuf {
    folder.join("results").join(format!("shard-{:04}-of-{:04}.ndjson", shard.index, shard.count))
}

/// The file with the results of a shard, open for appending.
pub struct Results {
    file: File,
    path: PathBuf,
    earlier: Earlier,
}

impl Results {
    /// Opens or creates the shard's file in the folder `results`, for example `shard-0002-of-0008.ndjson` for the index 2 of 8. If a killed process
    /// left the last line unfinished, a newline ends that line. `earlier`: the results that were read before.
    ///
    /// # Errors
    /// One line that names the file that cannot be opened or written.
    pub fn open(folder: &Path, shard: Shard, earlier: Earlier) -> Result<Results, String> {
        let place = folder.join("results");
        fs::create_dir_all(&place).map_err(|e| format!("{}: cannot be made: {e}", place.display()))?;
        let path = file_of(folder, shard);
        let fault = |e: io::Error| format!("{}: cannot be written: {e}", path.display());
        let mut file =
            files::private(OpenOptions::new().create(true).read(true).append(true)).open(&path).map_err(fault)?;
        let mut last = [b'\n'];
        if file.metadata().map_err(fault)?.len() > 0 {
            file.seek(SeekFrom::End(-1)).and_then(|_| file.read_exact(&mut last)).map_err(fault)?;
        }
        if last != [b'\n'] {
            file.write_all(b"\n").map_err(fault)?;
        }
        Ok(Results { file, path, earlier })
    }

    pub fn earlier(&self) -> &Earlier {
        &self.earlier
    }

    /// Appends a record as a line, in one write, so that lines of two processes do not mix.
    ///
    /// # Errors
    /// One line that names the file that cannot be written.
    pub fn add(&mut self, record: &Record) -> Result<(), String> {
        let fault = |e: &dyn std::fmt::Display| format!("{}: cannot be written: {e}", self.path.display());
        let line = tree::to_json(record).map_err(|e| fault(&e))? + "\n";
        self.file.write_all(line.as_bytes()).map_err(|e| fault(&e))?;
        if record.status == Status::Done {
            self.earlier.done.insert((record.key.clone(), record.input.clone()));
        }
        Ok(())
    }

    /// True if a line of the results says that the record's unit is done. The line may be missing although the record's file exists: a process may
    /// be killed between writing the two.
    pub fn has(&self, record: &Record) -> bool {
        self.earlier.done.contains(&(record.key.clone(), record.input.clone()))
    }

    /// Number of earlier runs of this shard that lost the device while they did this unit.
    pub fn losses(&self, input: &str, work: &str) -> usize {
        // Nearly always empty, and a key has to be copied.
        let is_known = !self.earlier.lost.is_empty();
        let found = is_known.then(|| self.earlier.lost.get(&(input.to_string(), work.to_string())));
        found.flatten().copied().unwrap_or(0)
    }
}

/// Calls `each` with every record of a file of results. Returns the number of lines that are no records.
fn for_each_record(path: &Path, mut each: impl FnMut(Record)) -> Result<usize, String> {
    let fault = |e: io::Error| format!("{}: cannot be read: {e}", path.display());
    let mut reader = BufReader::new(File::open(path).map_err(fault)?);
    let (mut torn, mut line) = (0, Vec::new());
    loop {
        line.clear();
        if reader.by_ref().take(MAX_LINE).read_until(b'\n', &mut line).map_err(fault)? == 0 {
            return Ok(torn);
        }
        if line.trim_ascii().is_empty() {
            continue;
        }
        match tree::from_json::<Record>(&line) {
            Ok(record) if record.format == FORMAT => each(record),
            _ => torn += 1,
        }
    }
}

/// The files of results of a folder, sorted. The error names what cannot be read.
fn files_of(folder: &Path) -> Result<Vec<PathBuf>, (PathBuf, io::Error)> {
    let place = folder.join("results");
    let fault = |e: io::Error| (place.clone(), e);
    let mut files = Vec::new();
    for entry in fs::read_dir(&place).map_err(fault)? {
        let path = entry.map_err(fault)?.path();
        if path.extension().is_some_and(|e| e == "ndjson") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// All results in a folder, without their figures, and the number of lines that are no records of this format, such as those that killed processes
/// left incomplete.
///
/// # Errors
/// One line: the folder has no folder `results`, or a file in it cannot be read.
pub fn read_all(folder: &Path) -> Result<(Vec<Record>, usize), String> {
    let files = files_of(folder)
        .map_err(|(place, e)| format!("{}: cannot be read: {e}; is this the folder of a batch?", place.display()))?;
    let (mut records, mut torn) = (Vec::new(), 0);
    for file in &files {
        torn += for_each_record(file, |record| {
            // Figures are the larger part of a record.
            records.push(Record { figures: Map::new(), ..record });
        })?;
    }
    Ok((records, torn))
}
