//! The start: what the screen says before there is a picture, and the first pictures.

use crate::desktop::*;

/// Steps of the start in their order, as the log names them when they were presented or drawn.
const STEPS: [&str; 6] = ["Source", "Compiling", "Frames", "Picture", "with few rays", "in full"];

/// The indices of the steps in the order in which each came first.
fn order(log: &str) -> Vec<usize> {
    let mut found = Vec::new();
    for line in log.lines().filter_map(|line| line.split_once(" start: ")) {
        let step = STEPS.iter().position(|step| line.1.contains(step)).expect("a step");
        if !found.contains(&step) {
            found.push(step);
        }
    }
    found
}

/// Prevents a black window without a word, and a first picture that waits for all its rays.
#[test]
fn the_screen_says_each_step_and_the_first_picture_has_few_rays() {
    let (desk, folder) = (Desk::new(false), Folder::new("start"));
    for (budget, pictures) in [("33ms", &[4, 5][..]), ("none", &[5])] {
        let log = folder.path(&format!("{budget}.txt"));
        let more = ["--log-file", &log, "-vv", "--budget", budget];
        let arguments = [&["--size", "1000x700", "--source", SWEEP], &more[..]].concat();
        let mut command = std::process::Command::new(PROGRAM);
        command.env("ECHOLUME_PIPELINE_CACHE", "none");
        let view = desk.view_by(&mut command, &arguments);
        let (corner, size) = echolume::low_level::ui::panels::picture_area([1000, 700], 1.0, true);
        let (from, half) = (size.map(|n| n / 4), size.map(|n| n / 2));
        let at = [corner[0] + from[0], corner[1] + from[1]];
        view.shows_at(&headless(size, &[]), at, from, half, "the picture in full");
        view.leave();
        let log = std::fs::read_to_string(&log).expect("a log");
        let order = order(&log);
        assert!(order.is_sorted(), "{budget}: {order:?} of {STEPS:?}");
        assert!(order.contains(&1) && order.contains(&3), "{budget}: {order:?} of {STEPS:?}");
        let drawn: Vec<usize> = order.iter().copied().filter(|step| *step >= 4).collect();
        assert_eq!(drawn, pictures, "{budget}");
    }
}
