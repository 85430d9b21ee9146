//! `echolume stic`: from a slow sweep over a beating heart to a loop of one cycle, and what it refuses.

use crate::common::program::*;
use std::fs;

/// The first number after `start` of a text.
fn number_after(text: &str, start: &str) -> f64 {
    let rest = &text[text.find(start).unwrap_or_else(|| panic!("{start}: {text}")) + start.len()..];
    let word = rest.split_whitespace().next().unwrap_or_default();
    word.parse().unwrap_or_else(|_| panic!("{start} {word}"))
}

#[test]
fn a_slow_sweep_becomes_a_loop_of_one_cycle() {
    let folder = Folder::new("stic");
    let [sweep, cycle, volume] = ["sweep.mha", "cycle.frames", "volume.nrrd"].map(|name| folder.path(name));
    let beating = ["--body", "heart", "--frames", "600", "--lines", "64", "--fan", "30", "--no-speckle"];
    done(&[&["phantom", "-o", &sweep], &beating[..]].concat());
    let said = done(&["stic", &sweep, &cycle]);
    assert!((number_after(&said, "heart rate:") - 144.0).abs() < 3.0, "{said}");
    let info = done(&["info", &cycle]);
    assert!(info.contains("20 of 13 frames, 20 whole") && info.contains("as it was written"), "{info}");
    // 20 volumes in a cycle of 0.417 s.
    assert!((number_after(&info, "volume rate") - 48.0).abs() < 1.0, "{info}");
    done(&["convert", &cycle, &volume, "--spacing", "3", "--volume", "7"]);
    // It is not replaced.
    let before = fs::read(&cycle).expect("the cycle");
    let again = ["stic", &sweep, &cycle, "--phases", "4"];
    refuses(&again, &run(&again), 1, &["cycle.frames", "exists"]);
    assert!(fs::read(&cycle).expect("the cycle") == before);
    // A heart at rest, and a sweep that is in parts only.
    let rest = folder.path("rest.mha");
    done(&[&["phantom", "-o", &rest, "--still"], &beating[..]].concat());
    let (out, names) = (folder.path("out.frames"), folder.names());
    let still = ["stic", &rest, &out];
    refuses(&still, &run(&still), 2, &["rest.mha: nothing in the frames repeats"]);
    assert_eq!(folder.names(), names);
}

#[test]
fn what_makes_no_cycle_is_refused_in_one_line_and_nothing_is_left() {
    let folder = Folder::new("stic-bad");
    let empty = folder.write("empty.mha", "");
    let text = folder.write("text.frames", "no frames at all");
    let words = folder.write("words.txt", "0.1\n0.6 # the second\nlater\n");
    let not = folder.write("not.txt", "0.1\nNaN\n1.0\n");
    let falls = folder.write("falls.txt", "0.5\n0.1\n");
    let apart = folder.write("apart.txt", "100\n100.5\n101\n");
    let few = folder.write("few.txt", "0.1\n1.6\n2.9\n");
    let part = folder.write("part.txt", "0.1\n0.9\n");
    let none = folder.write("none.txt", "# nothing\n\n");
    let (out, picture) = (folder.path("out.frames"), folder.path("out.mha"));
    let at_ten = ["--frame-rate", "10"];
    let waves = |file: &'static str| [&at_ten[..], &["--r-waves", file]].concat();
    let leak = |text: &String| -> &'static str { Box::leak(text.clone().into_boxed_str()) };
    let names = folder.names();
    let rows: Vec<(&str, &str, Vec<&str>, &str)> = vec![
        (BONE, &out, vec![], "is a Cartesian volume"),
        (&empty, &out, vec![], "empty.mha"),
        (&text, &out, vec![], "text.frames"),
        ("missing.mha", &out, vec![], "missing.mha"),
        (SWEEP, &picture, vec![], "written to a .frames file"),
        (SWEEP, &out, vec![], "give --frame-rate"),
        (SWEEP, &out, vec!["--frame-rate", "100"], "31 frames are too few"),
        (SWEEP, &out, vec!["--frame-rate", "0"], "must be above 0"),
        (SWEEP, &out, vec!["--frame-rate", "nan"], "must be above 0"),
        (SWEEP, &out, vec!["--volume", "1", "--frame-rate", "100"], "--volume 1: there are 1"),
        (SWEEP, &out, vec!["--heart-rate", "0:0"], "must be LOW:HIGH"),
        (SWEEP, &out, vec!["--heart-rate", "180:90"], "must be LOW:HIGH"),
        (SWEEP, &out, vec!["--heart-rate", "nan:nan"], "must be LOW:HIGH"),
        (SWEEP, &out, vec!["--heart-rate", "90:220:300"], "must be LOW:HIGH"),
        (SWEEP, &out, waves(leak(&words)), "words.txt: line 3: 'later' is not a time"),
        (SWEEP, &out, waves(leak(&not)), "not.txt: line 2: 'NaN' is not a time"),
        (SWEEP, &out, waves(leak(&falls)), "falls.txt: R wave 2, at 0.1 s, does not come after"),
        (SWEEP, &out, waves(leak(&apart)), "apart.txt: 0 of 3 R waves lie between 0.000 and 3.000 s"),
        (SWEEP, &out, waves(leak(&few)), "cycles: at least 4 are needed"),
        (
            SWEEP,
            &out,
            waves(leak(&part)),
            "part.txt: 2.6 cycles of the sweep lie before the first or after the last R wave",
        ),
        (SWEEP, &out, waves(leak(&none)), "none.txt: 0 of 0 R waves"),
        (SWEEP, &out, waves("missing.txt"), "missing.txt"),
    ];
    for (recording, output, more, wanted) in rows {
        let all = [&["stic", recording, output], &more[..]].concat();
        refuses(&all, &run(&all), 2, &[wanted]);
        assert_eq!(folder.names(), names, "{all:?}");
    }
}
