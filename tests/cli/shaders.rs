//! `--glsl`: shaders from a folder, compiled by what the system has.

use crate::common::program::*;
use std::fs;
use std::process::Command;

#[test]
fn shaders_from_a_folder_are_drawn_with_and_what_is_wrong_with_them_is_one_line() {
    let folder = Folder::new("glsl");
    let glsl = repository("glsl");
    let render = |from: &str, to: &str| run(&["render", BONE, "-o", to, "--size", "64x48", "--glsl", from]);
    let (built_in, compiled) = (folder.path("built-in.png"), folder.path("compiled.png"));
    done(&["render", BONE, "-o", &built_in, "--size", "64x48"]);
    let (code, _, err) = render(glsl.to_str().expect("a plain name"), &compiled);
    assert_eq!(code, Some(0), "{err}");
    let pixels = |file: &str| image::open(file).expect("a picture").to_rgba8().into_raw();
    let apart = pixels(&built_in).into_iter().zip(pixels(&compiled)).map(|(a, b)| a.abs_diff(b)).max();
    assert!(apart <= Some(1), "compiled with other options: {apart:?}");

    // One stage is enough to be refused by.
    let broken = Folder::new("broken");
    for (from, to) in [("include", "include"), ("postprocess", "postprocess")] {
        fs::create_dir(broken.join(to)).expect("create");
        for file in fs::read_dir(glsl.join(from)).expect("list").map(|e| e.expect("entry").path()) {
            fs::copy(&file, broken.join(to).join(file.file_name().expect("a name"))).expect("copy");
        }
    }
    let path = broken.path("");
    let nowhere = folder.path("nowhere");
    refuses(&["--glsl"], &render(&path, &nowhere), 2, &["is not in"]);
    let measured = ["profile", BONE, "--size", "64x48", "--repeat", "1", "--warm-up", "1", "--no-ceilings", "--glsl"];
    refuses(&["profile"], &run(&[&measured[..], &[&*path]].concat()), 2, &["is not in"]);
    fs::write(broken.join("postprocess/tone.comp"), "#version 460\n#include \"missing.glsl\"\n").expect("write");
    refuses(&["--glsl"], &render(&path, &nowhere), 2, &["include/missing.glsl"]);
    refuses(&["--glsl"], &render(&folder.path("absent"), &nowhere), 2, &["absent"]);
    fs::create_dir(folder.join("empty")).expect("create");
    refuses(&["--glsl"], &render(&folder.path("empty"), &nowhere), 2, &["there are no shaders"]);
    assert!(!fs::exists(&nowhere).expect("exists"), "a picture of refused shaders");
}

/// What is measured are the folder's shaders: one that does not compile is named, with the compiler's words.
#[test]
fn a_profile_is_of_the_shaders_of_the_folder() {
    let (folder, glsl) = (Folder::new("profiled"), repository("glsl"));
    let mut pending = vec![glsl.clone()];
    while let Some(from) = pending.pop() {
        let to = folder.join(from.strip_prefix(&glsl).expect("below it").to_str().expect("a plain name"));
        fs::create_dir_all(&to).expect("create");
        for file in fs::read_dir(&from).expect("list").map(|e| e.expect("entry").path()) {
            match file.is_dir() {
                true => pending.push(file),
                false => drop(fs::copy(&file, to.join(file.file_name().expect("a name"))).expect("copy")),
            }
        }
    }
    let path = folder.path("");
    // A surface.
    let repeats = ["--preset", "bone", "--size", "64x48", "--repeat", "1", "--warm-up", "1", "--no-ceilings"];
    let (code, out, err) = run(&[&["profile", BONE, "--glsl", &*path], &repeats[..]].concat());
    assert!(code == Some(0) && out.contains("raycast_surface"), "{out}{err}");
    let (code, out, err) = run(&["profile", BONE, "--preset", "bone", "--pipelines", "--glsl", &path]);
    assert!(code == Some(0) && out.contains("raycast/surface"), "{out}{err}");
    // A shader that only the picture needs.
    fs::write(folder.join("raycast/surface.comp"), "#version 460\nvoid main() { nothing; }\n").expect("write");
    for how in [&repeats[..], &["--preset", "bone", "--pipelines"]] {
        let ran = run(&[&["profile", BONE, "--glsl", &*path], how].concat());
        assert!(ran.0 == Some(2) && ran.2.contains("raycast/surface") && ran.2.contains("nothing"), "{}", ran.2);
    }
}

/// A build with shaderc needs none.
#[cfg(not(feature = "hot-reload"))]
#[test]
fn without_a_compiler_in_path_it_is_said_which_to_install() {
    let glsl = repository("glsl");
    let glsl = glsl.to_str().expect("a plain name");
    for command in ["render", "profile", "view"] {
        if command == "view" && !cfg!(feature = "view") {
            continue;
        }
        let ran = finish(Command::new(PROGRAM).args([command, "--glsl", glsl]).env("PATH", "/nonexistent"));
        refuses(&[command], &ran, 2, &["there is no shader compiler", "apt-get install glslc"]);
    }
}
