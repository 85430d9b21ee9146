//! `tools/soak`: the rules by which it passes, and that it understands what the program logs. The soak itself takes hours.

use crate::common::files::repository;
use echolume::low_level::live::Statistics;
use std::process::Command;

#[test]
fn the_soak_finds_growth_faults_and_lost_frames_and_reads_the_counts_of_the_log() {
    let mut statistics = Statistics::default();
    statistics.latency.saturating_record(30_000);
    let line = format!("{}; {}", statistics.line(None), statistics.totals());
    let test = |line: &str| {
        let done = Command::new("python3").arg(repository("tools/soak")).args(["--self-test", line]).output();
        let done = done.expect("python3 is installed");
        (done.status.success(), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    assert_eq!(test(&line), (true, String::new()));
    let (passes, why) = test("frames 1.0/s");
    assert!(!passes && why.contains("no counts or no latency"), "{why}");
}
