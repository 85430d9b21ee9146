//! What the CPU does, in hot paths and at the start: look-up tables, parsing, planning, the phantom, and the f64 references.
//!
//! `cargo bench --bench cpu` measures all, `cargo bench --bench cpu -- 'tables|plan'` those whose name matches; what comes after
//! `--` is criterion's: `--save-baseline before` and later `--baseline before` say what a change cost.
//! `cargo bench --bench cpu -- --test`, or `cargo test --bench cpu`, runs each once. Needs no GPU.
//!
//! What is read: `time: [low mean high]`, wall time, low and high enclosing the mean (or the slope over the number of runs)
//! with 95 % confidence; `--verbose` adds the median. Nothing is asserted about it. Only the phantom uses all threads.

#[path = "../common/mod.rs"]
mod common;
mod parsing;
mod phantom;
mod planning;
mod references;
mod tables;

use common::Run;
use criterion::Criterion;
use std::process::ExitCode;

fn main() -> ExitCode {
    match all() {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("cpu bench: {fault}");
            ExitCode::FAILURE
        }
    }
}

fn all() -> Result<(), String> {
    if Run::from_arguments() != Run::List {
        println!("threads: {}", rayon::current_num_threads());
    }
    let mut criterion: Criterion = common::criterion();
    tables::bench(&mut criterion)?;
    parsing::bench(&mut criterion)?;
    planning::bench(&mut criterion)?;
    phantom::bench(&mut criterion)?;
    references::bench(&mut criterion)?;
    criterion.final_summary();
    Ok(())
}
