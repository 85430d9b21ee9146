//! Pictures of the phantom say so: of the phantom itself, of recordings of it, of workspaces, and of what the viewer exports.

use crate::common::program::*;
use echolume::low_level::picture::Picture;
use std::fs;
use std::path::Path;

/// Bright pixels of a picture below a row.
fn bright(picture: &Picture, rows: std::ops::Range<u32>) -> usize {
    let row = 4 * picture.width as usize;
    let part = &picture.rgba[row * rows.start as usize..row * rows.end.min(picture.height) as usize];
    part.chunks_exact(4).filter(|pixel| pixel[..3].iter().all(|c| *c > 120)).count()
}

/// Prevents a picture of the phantom that passes for a patient's, and rendered pixels that are no longer those of the device.
#[test]
fn recordings_workspaces_and_exports_of_the_phantom_say_so_and_rendered_pixels_stay() {
    let folder = Folder::new("demo-data");
    let [sweep, frames, again, other] =
        ["sweep.mha", "sweep.frames", "again.mha", "other.mha"].map(|name| folder.path(name));
    done(&["phantom", "-o", &sweep, "--frames", "9", "--lines", "24"]);
    done(&["convert", &sweep, &frames]);
    done(&["convert", &frames, &again, "--sequence"]);
    // The same of unknown origin.
    let bytes = fs::read(&sweep).expect("the sweep");
    let comment = b"Comment = Demo data (phantom)\n";
    let at = bytes.windows(comment.len()).position(|part| part == comment).expect("the comment");
    fs::write(&other, [&bytes[..at], &bytes[at + comment.len()..]].concat()).expect("written");
    fs::copy(folder.path("sweep.probe.toml"), folder.path("other.probe.toml")).expect("copied");
    let drawn = |more: &[&str]| {
        let picture = folder.path("p.png");
        // Dark planes: what is bright is drawn over them.
        let look = ["--mode", "mpr", "--size", "320x200", "--set", "planes.window=[0.99,1]"];
        done(&[&["render", "-o", &picture], more, &look].concat());
        Picture::load(Path::new(&picture)).expect("a picture")
    };
    let alone = drawn(&[&other]);
    for recording in [&sweep, &frames, &again] {
        assert!(drawn(&[recording]) == alone, "{recording}: rendered pixels alone stay as they are");
        let [named, unnamed] = [recording, &other].map(|file| drawn(&[file, "--set", "marks.bar=true"]));
        let [named, unnamed] = [named, unnamed].map(|picture| bright(&picture, 200..picture.height));
        assert!(named > unnamed + 60, "{recording}: {named} bright pixels of the bar, {unnamed} of another's");
    }
    // With a measurement and no bar, in the corner.
    let caliper = "measure=[{kind='distance',points=[[-5,30,0],[5,30,0]]}]";
    let [named, unnamed] = [&sweep, &other].map(|file| bright(&drawn(&[file, "--set", caliper]), 184..200));
    assert!(named > unnamed + 60, "{named} {unnamed}");
    // A workspace, and what the viewer exports of one.
    let text = |recording: &str| {
        format!(
            "mode = 'surface'\n[workspace]\nversion = 1\nrecording = '{recording}'\n[picture]\nsize = [320, 200]\n[surface]\nthreshold = 0.999\n"
        )
    };
    for (recording, is_named) in [("phantom", true), ("sweep.mha", true), ("sweep.frames", true), ("other.mha", false)]
    {
        let (workspace, out) = (folder.write("exam.toml", text(recording)), folder.path("out/"));
        done(&["render", &workspace, "--turntable", "2", "-o", &out]);
        let picture = Picture::load(&Path::new(&out).join("picture-000001.png")).expect("a picture");
        let found = bright(&picture, 184..200);
        assert_eq!(found > 60, is_named, "{recording}: {found}");
        fs::remove_dir_all(&out).expect("removed");
    }
}
