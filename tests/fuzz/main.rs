//! Every parser against nearly valid bytes: none panics, uses more memory than it states, or runs for ever. Needs no GPU.
//!
//! The inputs are the same every time. `FUZZ_SECONDS=600` continues for so long, `FUZZ_TARGET=igtl` runs one parser alone. An input that fails is
//! saved and named; once the fault is fixed, it goes to `tests/fuzz/seeds/<target>`, which run first. `tools/fuzz` does the same under libFuzzer.

mod memory;
mod mutate;
mod targets;
#[path = "../common/wait.rs"]
#[allow(dead_code)] // What the other test binaries wait by.
mod wait;

use mutate::{Random, mutated};
use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use targets::{TARGETS, Target};

/// Maximum length of a seed, bytes: a header and some frames.
const LONGEST_SEED: usize = 8 << 10;
/// Inputs with a new outcome that are mutated further, in addition to the seeds.
const MOST_KEPT: usize = 512;
/// One input takes milliseconds; this is for a busy machine.
const LONGEST: Duration = Duration::from_secs(60);

fn top() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn seeds(target: &Target) -> Vec<Vec<u8>> {
    fn add(path: &Path, seeds: &mut Vec<Vec<u8>>) {
        if path.is_dir() {
            let entries = std::fs::read_dir(path).expect("a folder of seeds");
            let mut entries: Vec<_> = entries.map(|e| e.expect("a seed").path()).collect();
            entries.sort();
            entries.iter().for_each(|entry| add(entry, seeds));
        } else {
            let mut bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            bytes.truncate(LONGEST_SEED);
            seeds.push(bytes);
        }
    }
    let mut seeds = Vec::new();
    let own = top().join("tests/fuzz/seeds").join(target.name);
    if own.is_dir() {
        add(&own, &mut seeds);
    }
    target.also.iter().for_each(|path| add(&top().join(path), &mut seeds));
    // Parsers of numbers need no seeds but bytes.
    let mut random = Random(1);
    seeds.push((0..600).map(|_| random.next() as u8).collect());
    seeds.push(Vec::new());
    seeds
}

/// The input in progress and its start, for the watchdog.
type Running = Arc<Mutex<Option<(Instant, &'static str, Vec<u8>)>>>;

/// Ends the process with a line that names the input that does not terminate.
fn watch(running: &Running) {
    let running = running.clone();
    std::thread::spawn(move || {
        loop {
            wait::watch(Duration::from_millis(500));
            let now = running.lock().unwrap_or_else(|e| e.into_inner());
            if let Some((since, name, bytes)) = &*now
                && since.elapsed() > LONGEST
            {
                eprintln!("{name}: no end after {LONGEST:?}; the input is in {}", kept(name, bytes).display());
                std::process::exit(1);
            }
        }
    });
}

/// FNV-1a: long outcomes are compared by their hash.
fn sum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x100_0000_01b3))
}

/// Saves a failing input.
fn kept(name: &str, bytes: &[u8]) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{:016x}", sum(bytes)));
    std::fs::write(&path, bytes).expect("the input is kept");
    path
}

/// Runs one input. Returns its outcome without numbers.
fn run(target: &Target, bytes: &[u8], running: &Running) -> Result<String, String> {
    *running.lock().unwrap_or_else(|e| e.into_inner()) = Some((Instant::now(), target.name, bytes.to_vec()));
    let (result, most) = memory::most_during(|| catch_unwind(AssertUnwindSafe(|| (target.run)(bytes))));
    *running.lock().unwrap_or_else(|e| e.into_inner()) = None;
    let outcome = result.map_err(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        text.or(panic.downcast_ref::<&str>().map(|s| s.to_string())).unwrap_or_default()
    })?;
    match most <= target.memory + 8 * bytes.len() {
        true => Ok(outcome.chars().filter(|c| !c.is_ascii_digit()).take(200).collect()),
        false => Err(format!("took {most} bytes of memory for {} of input", bytes.len())),
    }
}

/// The first failing input, and why; or the number of inputs and of distinct outcomes.
fn fuzz(target: &Target, seconds: Option<f64>, running: &Running) -> Result<(u32, usize), (Vec<u8>, String)> {
    let (mut corpus, mut random) = (seeds(target), Random(0x5eed));
    let (mut outcomes, own, begun, mut rounds) = (HashSet::new(), corpus.len(), Instant::now(), 0);
    for seed in &corpus {
        outcomes.insert(sum(run(target, seed, running).map_err(|why| (seed.clone(), why))?.as_bytes()));
    }
    let goes_on = |rounds| seconds.map_or(rounds < target.rounds, |s| begun.elapsed().as_secs_f64() < s);
    while goes_on(rounds) {
        rounds += 1;
        let bytes = mutated(&corpus, target.text, &mut random);
        match run(target, &bytes, running) {
            Ok(outcome) => {
                if outcomes.insert(sum(outcome.as_bytes())) && corpus.len() < own + MOST_KEPT {
                    corpus.push(bytes);
                }
            }
            Err(why) => return Err((bytes, format!("round {rounds}: {why}"))),
        }
    }
    Ok((rounds, outcomes.len()))
}

/// Memory is counted for the complete process: one target at a time.
static ALONE: Mutex<()> = Mutex::new(());

#[test]
fn no_bytes_break_any_parser() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let seconds = std::env::var("FUZZ_SECONDS").ok().map(|s| s.parse::<f64>().expect("FUZZ_SECONDS is a number"));
    let only = std::env::var("FUZZ_TARGET").ok();
    let chosen: Vec<&Target> = TARGETS.iter().filter(|t| only.as_ref().is_none_or(|o| o == t.name)).collect();
    let names: Vec<&str> = TARGETS.iter().map(|t| t.name).collect();
    assert!(!chosen.is_empty(), "FUZZ_TARGET is none of {}", names.join(", "));
    let running = Running::default();
    watch(&running);
    let mut failed = Vec::new();
    for target in &chosen {
        let begun = Instant::now();
        match fuzz(target, seconds.map(|s| s / chosen.len() as f64), &running) {
            Ok((rounds, outcomes)) => {
                println!(
                    "{}: {rounds} inputs, {outcomes} outcomes, {:.1} s",
                    target.name,
                    begun.elapsed().as_secs_f64()
                );
            }
            Err((bytes, why)) => {
                failed.push(format!("{}: {why}; the input is in {}", target.name, kept(target.name, &bytes).display()));
            }
        }
    }
    let _ = std::fs::remove_dir_all(targets::folder());
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// Injected faults are found: an unchecked number, an unchecked length, a word that differs by two bits.
#[test]
fn injected_faults_are_found() {
    fn number(bytes: &[u8]) -> String {
        let text = String::from_utf8_lossy(bytes);
        let value = text.split_once("gear = ").and_then(|(_, v)| v.split_whitespace().next()?.parse::<f64>().ok());
        assert!(!value.is_some_and(|v| v > 1e300), "a gear beyond all bounds");
        String::new()
    }
    fn length(bytes: &[u8]) -> String {
        let claimed = bytes.first_chunk().map_or(0, |b| u32::from_le_bytes(*b));
        let taken: Vec<u8> = Vec::with_capacity((claimed as usize).min(1 << 30));
        format!("{}", taken.capacity().min(1))
    }
    fn word(bytes: &[u8]) -> String {
        assert!(bytes.get(2..8) != Some(b"STRINF"), "the wrong word");
        String::new()
    }
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let also = &["tests/data/motor/probe.toml", "tests/data/openigtlink"];
    let planted = |name, run, text, memory| Target { name, run, text, memory, rounds: 60_000, also };
    let running = Running::default();
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let found = [
        (planted("planted-number", number as fn(&[u8]) -> String, true, 1 << 20), "beyond all bounds"),
        (planted("planted-length", length, false, 1 << 20), "bytes of memory"),
        (planted("planted-word", word, false, 1 << 20), "the wrong word"),
    ]
    .map(|(target, why)| (target.name, why, fuzz(&target, None, &running)));
    std::panic::set_hook(hook);
    for (name, why, found) in found {
        let Err((_, said)) = found else { panic!("{name} was not found") };
        assert!(said.contains(why), "{name}: {said}");
    }
}
