//! A program without its default features, as `tools/demo` builds it.

use crate::common::files::Folder;
use std::process::Command;

/// Requirement: what a build leaves out says in one line how to have it; all else works, and the help does not offer it.
#[test]
#[ignore = "builds the program once more: minutes"]
fn a_build_without_features_renders_and_names_what_it_left_out() {
    let folder = Folder::new("features");
    let target = concat!(env!("CARGO_TARGET_TMPDIR"), "/least");
    let mut build = Command::new(env!("CARGO"));
    build.args(["build", "--quiet", "--no-default-features", "--target-dir", target]);
    let build = build.current_dir(env!("CARGO_MANIFEST_DIR")).status().expect("cargo");
    assert!(build.success());
    let program = format!("{target}/debug/echolume");
    let run = |arguments: &[&str]| {
        let ran = Command::new(&program).args(arguments).output().expect("the program");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
        (ran.status.code(), text(ran.stdout), text(ran.stderr))
    };
    for (command, feature) in [
        ("filter", "lab"),
        ("profile", "lab"),
        ("report", "lab"),
        ("verify", "verify"),
        ("batch", "verify"),
        ("view", "view"),
    ] {
        for arguments in [&[command][..], &[command, "--any", "word"], &[command, "--help"]] {
            let (code, out, said) = run(arguments);
            assert_eq!((code, out.as_str(), said.lines().count()), (Some(2), "", 1), "{arguments:?}: {said}");
            assert!(said.contains(command) && said.contains(&format!("`{feature}`")), "{said}");
            assert!(said.contains("cargo build --release"), "{said}");
        }
        let (_, help, _) = run(&["--help"]);
        assert!(!help.lines().any(|line| line.trim_start().starts_with(command)), "{command}: {help}");
    }
    let picture = folder.path("picture.png");
    let (code, _, said) = run(&["render", "--budget", "9ms", "--report", "none.json", "-o", &picture]);
    assert!(code == Some(2) && said.contains("`lab`"), "{said}");
    let (code, out, said) = run(&["render", "--size", "64x64", "--timings", "-o", &picture]);
    assert_eq!(code, Some(0), "{said}");
    assert!(out.contains("scan_convert"), "{out}");
    let (width, height) = image::image_dimensions(&picture).expect("a picture");
    assert_eq!([width, height], [64, 64]);
    for (file, named) in [("a.uff", "uff"), ("a.mha", "No such file")] {
        let (code, _, said) = run(&["info", &folder.path(file)]);
        assert_eq!((code, said.lines().count()), (Some(2), 1), "{named}: {said}");
    }
}
