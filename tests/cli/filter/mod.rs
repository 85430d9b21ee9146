//! `echolume filter` as a user sees it: ordinary pictures in, filtered pictures and figures out, and its answers to wrong
//! files and flags.

mod figures;
mod refusals;

use crate::common::program::{self, *};
use echolume::low_level::picture::Grey;
use std::fs;
use std::process::Command;

/// `echolume filter` with these arguments.
fn run(arguments: &[&str]) -> Ran {
    program::run(&[&["filter"], arguments].concat())
}

/// Runs with validation; it must succeed. Returns its standard output.
fn done(arguments: &[&str]) -> String {
    program::done(&[&["filter"], arguments, &["--validate"]].concat())
}

fn refused(arguments: &[&str], code: i32, named: &[&str]) {
    refuses(arguments, &run(arguments), code, named);
}

/// PGM of 8 or 16 bits.
fn pgm(width: u32, height: u32, sixteen: bool, f: impl Fn(u32, u32) -> u16) -> Vec<u8> {
    let mut bytes = format!("P5 {width} {height} {}\n", if sixteen { 65535 } else { 255 }).into_bytes();
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let value = f(x, y).to_be_bytes();
        bytes.extend(if sixteen { &value[..] } else { &value[1..] });
    }
    bytes
}

fn filtered(input: &str, output: &str, filters: &[&str]) -> Grey {
    let flags: Vec<&str> = filters.iter().flat_map(|f| ["--filter", f]).collect();
    done(&[&[input, "-o", output], &flags[..]].concat());
    Grey::load(output.as_ref()).expect("the written picture")
}

/// Noise without a pattern, so that no two windows are equal.
fn noise(x: u32, y: u32) -> u16 {
    let mixed = (x ^ (y << 12)).wrapping_add(1).wrapping_mul(0x9e37_79b9);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b);
    ((mixed ^ (mixed >> 13)) >> 16) as u16
}

#[test]
fn a_filter_that_changes_nothing_gives_back_every_value_of_either_depth() {
    let folder = Folder::new("same");
    for sixteen in [false, true] {
        // Not a multiple of a workgroup, and every value of 8 bits.
        let file = folder.write("in.pgm", pgm(61, 45, sixteen, |x, y| noise(x, y) >> if sixteen { 0 } else { 8 }));
        let given = Grey::load(file.as_ref()).expect("input");
        assert_eq!(filtered(&file, &folder.path("out.png"), &["sigma:sigma=0"]), given);
    }
}

#[test]
fn a_gaussian_spreads_a_point_by_its_kernel() {
    let folder = Folder::new("gaussian");
    let file = folder.write("in.pgm", pgm(41, 39, true, |x, y| if (x, y) == (20, 19) { 65535 } else { 0 }));
    let out = filtered(&file, &folder.path("out.png"), &["gaussian:lateral=1.5,depth=2.5"]);
    let kernel = |deviation: f64, at: i64| {
        let weight = |i: i64| (-0.5 * (i as f64 / deviation).powi(2)).exp();
        let radius = (3.0 * deviation).ceil() as i64;
        if at.abs() > radius { 0.0 } else { weight(at) / (-radius..=radius).map(weight).sum::<f64>() }
    };
    for (i, value) in out.values.iter().enumerate() {
        let (x, y) = ((i % 41) as i64 - 20, (i / 41) as i64 - 19);
        let expected = 65535.0 * kernel(1.5, x) * kernel(2.5, y);
        assert!((f64::from(*value) - expected).abs() < 0.6, "{x}, {y}: {value} is not {expected}");
    }
    // A median removes one hot pixel, in either order of the flags.
    for filters in [["median", "gaussian:depth=1"], ["gaussian:depth=1", "median"]] {
        assert!(filtered(&file, &folder.path("out.png"), &filters).values.iter().all(|v| *v == 0));
    }
}

#[test]
fn colours_become_grey_by_rec_709_with_a_note() {
    let folder = Folder::new("colour");
    let ppm = [b"P6 4 1 255\n".as_slice(), &[255, 0, 0, 0, 255, 0, 0, 0, 255, 77, 77, 77]].concat();
    let file = folder.write("in.ppm", ppm);
    let out = filtered(&file, &folder.path("out.png"), &["sigma:sigma=0"]);
    assert_eq!((out.values, out.sixteen), (vec![54, 182, 18, 77], false));
    let said = |file: &str| done(&[file, "-o", &folder.path("out.png"), "--filter", "median"]);
    assert!(said(&file).contains("Rec. 709"));
    assert!(!said(&folder.write("grey.pgm", pgm(5, 5, false, |_, _| 9))).contains("Rec. 709"));
}

#[test]
fn png_jpeg_pnm_and_bmp_are_read() {
    let folder = Folder::new("formats");
    let smooth = |x: u32, y: u32| 40 + 3 * x as u8 + 2 * y as u8;
    let picture = image::GrayImage::from_fn(40, 30, |x, y| image::Luma([smooth(x, y)]));
    for (name, format, off) in [
        ("a.png", image::ImageFormat::Png, 0),
        ("a.jpg", image::ImageFormat::Jpeg, 4),
        ("a.pgm", image::ImageFormat::Pnm, 0),
        ("a.bmp", image::ImageFormat::Bmp, 0),
        // The content decides, not the name.
        ("a.txt", image::ImageFormat::Png, 0),
    ] {
        let file = folder.path(name);
        picture.save_with_format(&file, format).expect("written");
        let out = filtered(&file, &folder.path("out.png"), &["sigma:sigma=0"]);
        let worst = out.values.iter().zip(picture.iter()).map(|(a, b)| a.abs_diff(u16::from(*b))).max();
        assert!((out.width, out.height) == (40, 30) && worst <= Some(off), "{name}: off by {worst:?}");
    }
}
