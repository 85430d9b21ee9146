//! What the program says of its own errors: proven bounds of a picture, and a map of the error of the step.

use crate::common::program::*;
use std::fs;

/// The values of an array of f64 in numpy's format.
fn values(path: &str) -> Vec<f64> {
    let bytes = fs::read(path).expect("read the array");
    assert!(bytes.starts_with(b"\x93NUMPY\x01\x00"), "{path} is no array");
    let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let body = &bytes[10 + header..];
    body.chunks_exact(8).map(|v| f64::from_le_bytes(v.try_into().expect("eight bytes"))).collect()
}

#[test]
fn bounds_enclose_each_other_the_wider_the_fewer_parts() {
    let folder = Folder::new("bounds");
    let bounds = |name: &str, more: &[&str]| {
        let at = folder.path(name);
        let all = ["report", "bounds", BONE, "--preset", "bone", "--mode", "vr", "--size", "16x12", "-o", &at];
        let said = done(&[&all, more].concat());
        for picture in ["low", "high", "width"] {
            assert_eq!(png_size(&format!("{at}/{picture}.png")), [16, 12]);
        }
        let about = fs::read_to_string(format!("{at}/bounds.json")).expect("bounds.json");
        assert!(about.contains("\"median_width\"") && about.contains("echolume bounds 1"), "{about}");
        (said, values(&format!("{at}/low.npy")), values(&format!("{at}/high.npy")))
    };
    let (said, low, high) = bounds("fine", &["--width", "0.01"]);
    let (_, coarse_low, coarse_high) = bounds("coarse", &["--width", "0.3"]);
    assert!(said.contains("median width") && said.contains("% of the rays"), "{said}");
    assert_eq!((low.len(), high.len()), (16 * 12 * 4, 16 * 12 * 4));
    assert!(low.iter().zip(&high).all(|(l, h)| 0.0 <= *l && l <= h && *h <= 1.0 + 1e-9 && h - l < 0.02));
    assert!(high.iter().any(|h| *h > 0.3), "the bone is seen");
    // Both contain the integral, so they have a common part.
    let pairs = low.iter().zip(&high).zip(coarse_low.iter().zip(&coarse_high));
    assert!(pairs.clone().all(|((l, h), (a, b))| l <= b && a <= h), "two bounds of one integral without a common part");
    assert!(pairs.filter(|((l, h), (a, b))| *b - *a > *h - *l).count() > 10, "coarse bounds are wider");
}

#[test]
fn what_has_no_bounds_and_no_error_map_is_refused_in_one_line() {
    let folder = Folder::new("no-bounds");
    let at = folder.path("bounds");
    let refused = |arguments: &[&str], named: &[&str]| refuses(arguments, &run(arguments), 2, named);
    refused(&["report", "bounds", BONE, "--mode", "mip", "-o", &at], &["report bounds", "--mode vr"]);
    refused(&["report", "bounds", BONE, "--mode", "vr", "--width", "0", "-o", &at], &["--width 0"]);
    let map = folder.path("map.png");
    folder.refuses(&[BONE, "--mode", "mpr", "--error-map", &map], &["--error-map", "no steps"]);
    folder.refuses(&[BONE, "--mode", "vr", "--error-map", &map, "--error-tolerance", "2"], &["--error-tolerance 2"]);
    let stated = [BONE, "--mode", "vr", "--set", "ray.tolerance=1", "--error-map", &map, "--error-tolerance", "0.1"];
    folder.refuses(&stated, &["--error-tolerance", "ray.tolerance"]);
}

#[test]
fn an_error_map_shows_less_error_for_a_finer_step() {
    let folder = Folder::new("error-map");
    let largest = |step: &str| {
        let map = folder.path("map.png");
        let set = format!("ray.step={step}");
        let said = render(BONE, &folder.path("picture.png"), &["--mode", "vr", "--set", &set, "--error-map", &map]);
        assert_eq!(png_size(&map), [64, 48]);
        let rms = said.split("RMS ").nth(1).and_then(|rest| rest.split(',').next()).expect("an RMS");
        rms.parse::<f64>().expect("a number")
    };
    let (coarse, fine) = (largest("2.0"), largest("0.25"));
    assert!(coarse > 2.0 * fine && fine > 0.0, "{coarse} and {fine}");
}

#[test]
fn bounds_prove_how_many_pixels_of_a_picture_keep_its_tolerance() {
    let folder = Folder::new("certified");
    let at = folder.path("bounds");
    let scene = ["report", "bounds", BONE, "--preset", "bone", "--mode", "vr", "--size", "32x24", "-o", &at];
    let said = |more: &[&str]| done(&[&scene[..], &["--set", "light.volume=none"], more].concat());
    let shares = |said: &str| -> Vec<f64> {
        let line = said.lines().find(|line| line.starts_with("the picture: at most")).expect("a certificate");
        let words = line.split_whitespace().collect::<Vec<_>>();
        words.windows(2).filter(|pair| pair[1] == "%").map(|pair| pair[0].parse().expect("a share")).collect()
    };
    let one = shares(&said(&["--set", "ray.tolerance=1"]));
    assert!(one.len() == 4 && (one.iter().sum::<f64>() - 100.0).abs() < 0.3, "{one:?}");
    assert!(one[0] > 95.0 && one[3] < 0.5, "most pixels keep a level by proof: {one:?}");
    // Ten parts a ray prove less, and no pixel is called broken for it.
    let few = shares(&said(&["--set", "ray.tolerance=1", "--parts", "16"]));
    assert!(few[0] < one[0] - 5.0 && few[1] > one[1] && few[3] <= one[3] + 1e-9, "{few:?} and {one:?}");
    assert!(!said(&[]).contains("the picture:"), "without a tolerance nothing is drawn");
    let arguments =
        [&scene[..], &["--set", "light.volume=none", "--set", "ray.tolerance=1", "--set", "post.colour_map=hot"]]
            .concat();
    refuses(&arguments, &run(&arguments), 2, &["post.colour_map"]);
}
