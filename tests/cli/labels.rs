//! `--labels`: a segmentation is drawn where its recording shows the body, from a flag and from a workspace; what is none is refused in a line.

use crate::common::program::*;
use crate::segment::ball;
use std::fs;

/// Red, green and blue of every pixel.
fn pixels(file: &str) -> Vec<[i32; 3]> {
    image::open(file).expect("a picture").to_rgb8().pixels().map(|p| p.0.map(i32::from)).collect()
}

fn is_coloured(pixel: &[i32; 3]) -> bool {
    pixel[0].max(pixel[1]).max(pixel[2]) - pixel[0].min(pixel[1]).min(pixel[2]) > 20
}

/// The middle of the pixels that are chosen, of a picture 200 wide, and their number.
fn middle(chosen: impl Iterator<Item = bool>) -> ([f64; 2], usize) {
    let (mut sum, mut count) = ([0.0; 2], 0);
    for (n, _) in chosen.enumerate().filter(|(_, is_chosen)| *is_chosen) {
        (sum, count) = ([sum[0] + (n % 200) as f64, sum[1] + (n / 200) as f64], count + 1);
    }
    (sum.map(|sum| sum / count as f64), count)
}

#[test]
fn labels_are_drawn_over_the_body_that_they_are_of() {
    let folder = Folder::new("labels");
    // The axes of the second file are left-handed: the recording and its labels are drawn with one of them reversed.
    for (name, hand) in [("ball.mha", 1.0), ("mirrored.mha", -1.0)] {
        let (input, labels) = (ball(&folder, name, false, hand), folder.path("bodies.seg.nrrd"));
        done(&["segment", &input, "-o", &labels, "--smooth", "0"]);
        let (plain, labelled, shown) =
            (folder.path("plain.png"), folder.path("labelled.png"), folder.path("shown.png"));
        for plane in ["a", "b", "c"] {
            let set = format!("planes.plane={plane}");
            let look = ["--mode", "plane", "--size", "200x160", "--set", &set, "--set", "planes.position=[3,-2,11]"];
            let look = [&look[..], &["--set", "planes.window=[0,1]"]].concat();
            done(&[&["render", &*input, "-o", &*plain], &look[..]].concat());
            done(&[&["render", &*input, "-o", &*labelled, "--labels", &*labels], &look[..]].concat());
            let (plain, labelled) = (pixels(&plain), pixels(&labelled));
            let (body, area) = middle(plain.iter().map(|p| p[0] > 110));
            let (tinted, count) = middle(labelled.iter().map(is_coloured));
            assert!(plain.iter().filter(|p| is_coloured(p)).count() == 0 && area > 1000, "{name}, {plane}: {area}");
            let off = (0..2).map(|a| (body[a] - tinted[a]).abs()).fold(0.0, f64::max);
            let share = count as f64 / area as f64;
            assert!(
                off < 0.5 && (0.97..1.08).contains(&share),
                "{name}, {plane}: off by {off} pixels, {share} of the area"
            );
        }
        let workspace =
            "[workspace]\nversion = 1\nrecording = 'NAME'\nlabels = 'bodies.seg.nrrd'\n".replace("NAME", name);
        let workspace = folder.write("work.toml", format!("mode = 'mip'\n{workspace}"));
        done(&["render", &workspace, "-o", &shown, "--size", "200x160"]);
        let both = ["--mode", "mip", "--size", "200x160", "--labels", &*labels];
        done(&[&["render", &*input, "-o", &*labelled], &both[..]].concat());
        let of = |file: &str| middle(pixels(file).iter().map(is_coloured)).1;
        assert!(of(&shown) > 500 && of(&labelled) > 500, "{} {}", of(&shown), of(&labelled));
        let explained = explain(&input, &both[4..]);
        assert!(explained.contains("+ labels") && explained.contains("label_cover"), "{explained}");
    }
}

#[test]
fn what_is_no_segmentation_of_the_recording_is_refused_in_one_line() {
    let folder = Folder::new("labels-refused");
    let (input, labels) = (ball(&folder, "ball.mha", false, 1.0), folder.path("bodies.seg.nrrd"));
    done(&["segment", &input, "-o", &labels, "--smooth", "0"]);
    let moved = fs::read(&labels).expect("labels");
    let end = moved.windows(2).position(|w| w == b"\n\n").expect("a header");
    let header = String::from_utf8(moved[..end].to_vec()).expect("text");
    let line = header.lines().find(|line| line.starts_with("space origin")).expect("an origin");
    let with = |name: &str, header: String| folder.write(name, [header.as_bytes(), &moved[end..]].concat());
    let moved_away = with("away.seg.nrrd", header.replace(line, "space origin: (900,0,0)"));
    let large = with("large.seg.nrrd", header.replace("sizes: 44 40 42", "sizes: 40000 40000 40000"));
    for (file, named) in [
        (&input, &["ball.mha", "labels", "no segmentation"][..]),
        (&moved_away, &["away.seg.nrrd", "beside the volume"]),
        (&large, &["large.seg.nrrd"]),
        (&folder.path("none.seg.nrrd"), &["none.seg.nrrd"]),
    ] {
        let all = ["render", &*input, "--labels", file, "-o", &*folder.path("a.png")];
        refuses(&all, &run(&all), 2, named);
    }
    let dicom = folder.path("bodies.seg.dcm");
    let all = ["convert", &*labels, &*dicom, "--spacing", "2"];
    refuses(&all, &run(&all), 2, &["--spacing", ".seg.dcm"]);
    let all = ["convert", &*input, &*dicom];
    refuses(&all, &run(&all), 2, &["ball.mha", "no segmentation"]);
    assert!(!folder.names().contains("a.png") && !folder.names().contains("bodies.seg.dcm"));
    assert!(done(&["convert", &labels, &dicom]).contains("1 segments"));
}
