//! A picture that is wholly one colour: one line on standard error names the cause, and the command succeeds.

use crate::common::program::*;

/// A Cartesian volume of `size` voxels of 0.5 x 0.5 x `slice` mm.
fn volume(size: [usize; 3], slice: f64, kind: &str, value: impl Fn(usize) -> Vec<u8>) -> Vec<u8> {
    let [x, y, z] = size;
    let header = format!(
        "ObjectType = Image\nNDims = 3\nBinaryDataByteOrderMSB = False\nDimSize = {x} {y} {z}\nElementSpacing = 0.5 0.5 {slice}\nElementType = {kind}\nElementDataFile = LOCAL\n"
    );
    header.bytes().chain((0..x * y * z).flat_map(value)).collect()
}

/// Renders and returns what was said on standard error.
fn said(folder: &Folder, input: &str, more: &[&str]) -> String {
    let output = folder.path("p.png");
    let (code, _, err) = run(&[&["render", input, "-o", &output, "--size", "64x48"], more].concat());
    assert_eq!(code, Some(0), "{more:?}: {err}");
    err
}

#[test]
fn each_cause_of_a_picture_of_one_colour_is_named() {
    let folder = Folder::new("one_colour");
    let even = folder.write("even.mha", volume([20, 20, 20], 0.5, "MET_UCHAR", |_| vec![51]));
    let even_floats =
        folder.write("floats.mha", volume([20, 20, 20], 0.5, "MET_FLOAT", |_| 5.0f32.to_le_bytes().into()));
    let one = folder.write("one.mha", volume([20, 20, 1], 1e-3, "MET_UCHAR", |i| vec![(i % 200) as u8]));
    let nothing = "volume.transfer=[{at=0,colour=[1,1,1],opacity=0},{at=1,colour=[1,1,1],opacity=0}]";
    let away = "clip=[{at=[0,-1000,0],normal=[0,1,0]}]";
    let cases: &[(&str, &[&str], &[&str])] = &[
        (&even, &["--mode", "mip", "--camera", "zoom=4"], &["every sample that it shows is 51", "constant volume"]),
        (&even, &["--mode", "sr"], &["every sample that it shows is 51", "constant volume"]),
        (
            &even_floats,
            &["--mode", "mip"],
            &["every sample that it shows is 5", "constant volume", "below", "projection.window=[0, 1]"],
        ),
        // Without a preset it is lit, before a ground.
        (BONE, &["--mode", "vr", "--set", away], &["the ground alone", "light.volume.ground", "clip planes"]),
        (BONE, &["--mode", "vr", "--set", away, "--set", "light.volume=none"], &["is wholly black", "clip planes"]),
        (BONE, &["--mode", "mpr", "--set", away], &["clip planes"]),
        (
            BONE,
            &["--mode", "mip", "--set", "projection.window=[2.0,3.0]"],
            &["below the grey window projection.window=[2, 3]", "510 .. 765"],
        ),
        (
            BONE,
            &["--mode", "mip", "--camera", "zoom=4", "--set", "projection.window=[-3.0,-2.0]"],
            &["white", "above the grey window", "-765 .. -510"],
        ),
        (
            BONE,
            &["--mode", "mpr", "--set", "planes.position=[500,0,0]", "--set", "planes.azimuth=90"],
            &["no plane passes", "planes.position"],
        ),
        (&one, &["--mode", "mip"], &["edge-on", "0.001 mm thin", "camera.elevation"]),
        (BONE, &["--mode", "mip", "--camera", "target=900:0:0"], &["camera looks past", "camera.target"]),
        (
            BONE,
            &["--mode", "sr", "--set", "surface.threshold=1.0"],
            &["no edge", "surface.threshold=1", "the largest over 1 mm is 0."],
        ),
        (BONE, &["--mode", "vr", "--set", nothing], &["volume.transfer", "transparent"]),
        (SWEEP, &["--mode", "mip", "--roi", "elevation=20:40,depth=0:0.5"], &["region of interest", "insonified"]),
        (BONE, &["--mode", "mip", "--set", "post.brightness=-1.0"], &["post.brightness=-1"]),
    ];
    for (input, more, named) in cases {
        let err = said(&folder, input, more);
        assert_eq!(err.lines().count(), 1, "{more:?}: {err}");
        assert!(err.contains("p.png: is ") && named.iter().all(|n| err.contains(n)), "{more:?}: {err}");
    }
    // The same scenes without the cause, and a picture of one pixel: nothing to say.
    for (input, more) in
        [(BONE, &["--mode", "mip"][..]), (BONE, &["--mode", "mpr"]), (SWEEP, &["--mode", "sr", "--size", "1x1"])]
    {
        assert_eq!(run(&[&["render", input, "-o", &folder.path("p.png")], more].concat()).2, "", "{more:?}");
    }
}

#[test]
fn other_commands_that_write_pictures_and_volumes_name_the_cause_too() {
    let folder = Folder::new("one_colour_others");
    let (code, _, err) = run(&["convert", SWEEP, &folder.path("v.mha"), "--spacing", "1000"]);
    assert!(code == Some(0) && err.lines().count() == 1, "{err}");
    assert!(err.contains("v.mha: is empty: the sector is") && err.contains("--spacing 1000 mm"), "{err}");
    assert_eq!(run(&["convert", SWEEP, &folder.path("w.mha"), "--spacing", "2"]).2, "");
    // A stream says it once, however many pictures follow.
    let pictures = folder.path("pictures");
    let stream =
        ["stream", "--source", SWEEP, "--out", &pictures, "--volumes", "2", "--rounds", "2", "--size", "32x24"];
    let (code, out, err) = run(&[&stream[..], &["--mode", "mip", "--set", "projection.window=[2.0,3.0]"]].concat());
    assert!(code == Some(0) && out.contains("2 pictures"), "{out}{err}");
    assert_eq!(err.matches("is wholly black").count(), 1, "{err}");
    assert!(err.contains("below the grey window projection.window"), "{err}");
    // A filter of a level picture.
    let flat = folder.write("flat.pgm", [b"P5 8 8 255\n".as_slice(), &[77; 64]].concat());
    let (code, _, err) = run(&["filter", &flat, "-o", &folder.path("f.png"), "--filter", "median"]);
    assert!(code == Some(0) && err.contains("f.png: is wholly of one level, 77: so is the input"), "{err}");
}

#[test]
fn outliers_of_a_float_volume_do_not_hide_the_rest_and_are_told_once() {
    let folder = Folder::new("outliers");
    let echo = |i: usize| 0.1 + 0.8 * (i as f32 * 0.618_034).fract();
    let float = |bad: f32| {
        volume([24, 20, 20], 0.5, "MET_FLOAT", move |i| if i % 50 == 3 { bad } else { echo(i) }.to_le_bytes().into())
    };
    let (dirty, clean) = (folder.write("dirty.mha", float(1e30)), folder.write("clean.mha", float(0.5)));
    // The range alone decides: a window from the echoes would brighten what it crushes.
    let mean = ["--mode", "xray", "--set", "projection.window=[0.0,1.0]"];
    let err = said(&folder, &dirty, &mean);
    assert_eq!(err.lines().count(), 1, "{err}");
    for named in ["2 % of the samples are outliers", "1.0000e30", "clamped to 0.1", "samples.range"] {
        assert!(err.contains(named), "{named}: {err}");
    }
    let tones = |name: &str| {
        let picture =
            echolume::low_level::picture::Picture::load(std::path::Path::new(&folder.path(name))).expect("a picture");
        let lit: Vec<f64> = picture.rgba.chunks(4).map(|p| f64::from(p[0])).filter(|v| *v > 0.0).collect();
        lit.iter().sum::<f64>() / lit.len().max(1) as f64
    };
    let robust = tones("p.png");
    assert_eq!(said(&folder, &clean, &mean), "", "clean data are not remarked on");
    // 2 % of white among a mean grey of 0.5.
    let expected = tones("p.png");
    assert!((robust - expected).abs() < 6.0 && expected > 100.0, "{robust} for {expected}");
    // The range that is asked for decides: that of the file crushes the echoes, and the remark names the cause.
    let err = said(&folder, &dirty, &[&mean[..], &["--set", "samples.range=[0.0,1e30]"]].concat());
    assert!(err.contains("outliers"), "{err}");
    assert!(tones("p.png") < 10.0);
    let said = done(&["info", &dirty]);
    assert!(said.contains("value range") && said.contains("(measured)") && !said.contains("e30 (measured)"), "{said}");
    let refused = run(&["render", &clean, "-o", &folder.path("q.png"), "--set", "samples.range=[1.0,0.0]"]);
    refuses(&["samples.range"], &refused, 2, &["samples.range", "rise"]);
}
