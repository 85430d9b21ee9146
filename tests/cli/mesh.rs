//! `echolume mesh`: a ball in a file becomes a closed surface in its place. `echolume convert` labels its voxels.

use crate::common::program::*;
use std::collections::HashSet;
use std::fs;

const RADIUS: f64 = 6.0;
const CENTRE: [f64; 3] = [3.0, -2.0, 11.0];

/// Distances from the surface of a ball, positive within, on 21 x 19 x 18 voxels. `matrix`: directions of the axes.
fn ball(folder: &Folder, name: &str, mirrored: bool) -> String {
    volume(folder, name, mirrored, |depth| depth)
}

/// A volume of a function of the depth below the surface of the ball.
fn volume(folder: &Folder, name: &str, mirrored: bool, value: impl Fn(f64) -> f64) -> String {
    let (size, spacing) = ([21, 19, 18], [0.8, 0.9, 1.0]);
    let hand = if mirrored { -1.0 } else { 1.0 };
    let origin = [CENTRE[0] - 8.0, CENTRE[1] - 8.0, CENTRE[2] - 8.4 * hand];
    let mut samples = Vec::new();
    for n in 0..size[0] * size[1] * size[2] {
        let cell = [n % size[0], n / size[0] % size[1], n / (size[0] * size[1])];
        let steps = [1.0, 1.0, hand];
        let offset = (0..3).map(|a| origin[a] + steps[a] * spacing[a] * cell[a] as f64 - CENTRE[a]);
        let distance = offset.map(|d| d * d).sum::<f64>().sqrt();
        samples.extend((value(RADIUS - distance) as f32).to_le_bytes());
    }
    let [x, y, z] = origin;
    let header = format!(
        "ObjectType = Image\nNDims = 3\nBinaryDataByteOrderMSB = False\nDimSize = 21 19 18\nElementType = MET_FLOAT\nElementSpacing = 0.8 0.9 1\nOffset = {x} {y} {z}\n\
         TransformMatrix = 1 0 0 0 1 0 0 0 {hand}\nElementDataFile = LOCAL\n"
    );
    folder.write(name, [header.into_bytes(), samples].concat())
}

/// Volume by the divergence theorem, and the centre of it, of a binary STL.
fn measured(file: &str) -> (f64, [f64; 3]) {
    let bytes = fs::read(file).expect("a mesh");
    let (mut volume, mut centre) = (0.0, [0.0; 3]);
    for triangle in bytes[84..].chunks_exact(50) {
        let number =
            |n: usize| f64::from(f32::from_le_bytes(triangle[12 + 4 * n..16 + 4 * n].try_into().expect("four")));
        let corner = |n: usize| [0, 1, 2].map(|axis| number(3 * n + axis) - CENTRE[axis]);
        let [a, b, c] = [corner(0), corner(1), corner(2)];
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        let part = (0..3).map(|n| a[n] * cross[n]).sum::<f64>() / 6.0;
        volume += part;
        (0..3).for_each(|n| centre[n] += part * (a[n] + b[n] + c[n]) / 4.0);
    }
    (volume, centre.map(|v| v / volume))
}

#[test]
fn a_ball_keeps_its_volume_and_place_whatever_the_hand_of_its_axes() {
    let folder = Folder::new("mesh");
    let exact = 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
    for mirrored in [false, true] {
        let (input, output) = (ball(&folder, "ball.mha", mirrored), folder.path("ball.stl"));
        let relief = folder.path("relief.stl");
        // The distance 0 as a share of the range of the samples.
        let info = done(&["info", &input]);
        let range = info.lines().find_map(|line| line.strip_prefix("value range")).expect("a range");
        let ends: Vec<f64> = range.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let share = (-ends[0] / (ends[1] - ends[0])).to_string();
        let said = done(&["mesh", &input, &output, "--threshold", &share]);
        assert!(said.contains("closed, 0.8"), "{said}");
        let (volume, centre) = measured(&output);
        let net = fs::metadata(&output).expect("a mesh").len();
        // Bound as in src/core/mesh/nets.rs: nothing lies deeper than 2 h^2 / R, for the widest voxel.
        let lost = 1.0 - volume / exact;
        assert!((0.0..6.0 / (RADIUS * RADIUS)).contains(&lost), "mirrored {mirrored}: {lost}");
        assert!(centre.iter().all(|v| v.abs() < 1e-2), "mirrored {mirrored}: {centre:?}");
        // Fewer triangles: at most 0.1 mm times the area is lost or won.
        let said = done(&["mesh", &input, &output, "--threshold", &share, "--simplify", "0.1"]);
        assert!(said.contains("closed, 0.") && said.contains(" triangles, at most 0."), "{said}");
        let (simple, _) = measured(&output);
        let most = 0.1 * 4.0 * std::f64::consts::PI * RADIUS * RADIUS;
        assert!((simple - volume).abs() < most, "mirrored {mirrored}: {simple} of {volume}");
        let left = fs::metadata(&output).expect("a mesh").len();
        // Without a bound, and it says so. A ball of quadrics loses hardly more.
        let said = done(&["mesh", &input, &output, "--threshold", &share, "--simplify", "0.1", "--fast"]);
        assert!(said.contains(" triangles by quadrics for 0.1 mm, without a bound"), "{said}");
        let (fast, _) = measured(&output);
        assert!((fast - volume).abs() < 2.0 * most, "mirrored {mirrored}: {fast} of {volume}");
        // Half of the ball on a cylinder that ends 2 mm below its deepest row, at most a voxel and a half more.
        let said = done(&["mesh", &input, &relief, "--threshold", &share, "--base", "2"]);
        assert!(said.contains("closed, 0.") && said.contains(", filled down to a base at a depth of "), "{said}");
        let (solid, centre) = measured(&relief);
        let with = |cylinder: f64| exact / 2.0 + std::f64::consts::PI * RADIUS * RADIUS * cylinder;
        assert!((with(0.95 * 2.0)..with(2.0 + 1.5 * 0.9)).contains(&solid), "{solid}");
        // The centre of half a ball is 3/8 of its radius above its middle.
        let (half, length) = (exact / 2.0, (solid - exact / 2.0) / (std::f64::consts::PI * RADIUS * RADIUS));
        let below = (length / 2.0 * (solid - half) - 0.375 * RADIUS * half) / solid;
        let off = [centre[0], centre[1] - below, centre[2]];
        // The net of so coarse a ball lacks up to a sixth of it.
        assert!(off.iter().all(|v| v.abs() < 0.15), "mirrored {mirrored}: {centre:?}, {below}");
        assert!(2 * left < net, "{left} of {net} bytes");
    }
}

#[test]
fn a_mesh_that_would_be_wrong_is_not_written() {
    let folder = Folder::new("mesh-wrong");
    let input = ball(&folder, "ball.mha", false);
    let (stl, obj) = (folder.path("x.stl"), folder.path("x.obj"));
    for (arguments, named) in [
        (&[&*input, &obj][..], ".stl, .ply or .glb"),
        (&[&input, &stl, "--threshold", "1.5"], "--threshold 1.5"),
        (&[&input, &stl, "--colour", "pink"], "grey or skin"),
        (&[&input, &stl, "--smooth", "-1", "--threshold", "0.5"], "--smooth -1"),
        (&[&input, &stl, "--spacing", "0"], "--spacing 0"),
        (&[&input, &stl, "--volume", "1"], "--volume 1"),
        (&[&input, &stl, "--simplify", "0"], "--simplify 0"),
        (&[&input, &stl, "--base", "0"], "--base 0"),
        (&[&input, &stl, "--start", "inf"], "--start inf"),
        (&[&input, &stl, "--base", "1000", "--spacing", "0.05", "--threshold", "0.6"], "--base 1000: makes 20"),
        (&[&input, &stl, "--threshold", "0"], "--threshold 0"),
        (&[&input, "-"], ".stl, .ply or .glb"),
    ] {
        let all = [&["mesh"], arguments].concat();
        // The whole volume is inside a threshold of 0: its closed surface is that of a block.
        if named == "--threshold 0" {
            assert!(done(&all).contains("closed"), "a block");
            fs::remove_file(&stl).expect("the block");
            continue;
        }
        refuses(&all, &run(&all), 2, &[named]);
    }
    assert_eq!(folder.names().len(), 1, "{:?}", folder.names());
}

#[test]
fn a_segmentation_labels_the_voxels_from_the_threshold_on() {
    let folder = Folder::new("segmentation");
    let input = ball(&folder, "ball.mha", false);
    let [labels, mask] = ["ball.seg.nrrd", "all.SEG.nrrd"].map(|name| folder.path(name));
    let info = done(&["info", &input]);
    let range = info.lines().find_map(|line| line.strip_prefix("value range")).expect("a range");
    let ends: Vec<f64> = range.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    // A distance between those of two voxels: in the file, 0.0371.
    let share = ((0.0371 - ends[0]) / (ends[1] - ends[0])).to_string();
    let said = done(&["convert", &input, &labels, "--threshold", &share, "--mask", &mask]);
    assert!(said.contains("21 x 19 x 18 voxels, 1 tissue") && said.contains("(0.0371 in the file)"), "{said}");
    // Each as a plain volume again, by the reader.
    let plain = |path: &str| {
        let out = folder.path("plain.mha");
        done(&["convert", path, &out]);
        let bytes = fs::read(&out).expect("a volume");
        bytes[bytes.len() - 21 * 19 * 18..].to_vec()
    };
    let samples = fs::read(&input).expect("the ball");
    let samples = samples[samples.len() - 4 * 21 * 19 * 18..].chunks_exact(4);
    let values = samples.map(|four| f32::from_le_bytes(four.try_into().expect("four")));
    let expected: Vec<u8> = values.map(|value| u8::from(value >= 0.0371)).collect();
    assert!(expected.contains(&1) && plain(&labels) == expected);
    assert!(plain(&mask).iter().all(|label| *label == 1));
    let header = fs::read(&labels).expect("a segmentation");
    let header = String::from_utf8_lossy(&header[..800]).into_owned();
    assert!(header.contains("Segment0_Name:=tissue\n") && header.contains("space origin: (-5,-10,2.5"), "{header}");
    let other = folder.path("x.nrrd");
    for (arguments, named) in [
        (&[&*other, "--threshold", "0.5"][..], "is for .seg.nrrd"),
        (&[&labels, "--threshold", "2"], "--threshold 2: must lie in 0..=1"),
        (&[&labels, "--outside", "1"], "are for volumes of samples"),
    ] {
        let all = [&["convert", &input], arguments].concat();
        refuses(&all, &run(&all), 2, &[named]);
    }
}

/// Vertices with their normals and colours, and the triangles, of a PLY file.
type Ply = (Vec<([f64; 3], [f64; 3], [u8; 3])>, Vec<[usize; 3]>);

fn ply(file: &str) -> Ply {
    let bytes = fs::read(file).expect("a mesh");
    let end = bytes.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let count = |what: &str| -> usize {
        let line = head.lines().find_map(|line| line.strip_prefix(&format!("element {what} ")));
        line.expect("a count").parse().expect("a number")
    };
    let split = end + 27 * count("vertex");
    let float = |part: &[u8], n: usize| f64::from(f32::from_le_bytes(part[4 * n..4 * n + 4].try_into().expect("four")));
    let vertex = |part: &[u8]| {
        let three = |from: usize| [0, 1, 2].map(|n| float(part, from + n));
        (three(0), three(3), [part[24], part[25], part[26]])
    };
    let corner =
        |part: &[u8], n: usize| u32::from_le_bytes(part[1 + 4 * n..5 + 4 * n].try_into().expect("four")) as usize;
    let triangle = |part: &[u8]| [0, 1, 2].map(|n| corner(part, n));
    assert_eq!(bytes.len(), split + 13 * count("face"));
    (bytes[end..split].chunks_exact(27).map(vertex).collect(), bytes[split..].chunks_exact(13).map(triangle).collect())
}

#[test]
fn what_a_picture_shows_is_an_open_sheet_in_its_place_and_colours() {
    let folder = Folder::new("sheet");
    for (name, mirrored) in [("ball.mha", false), ("mirrored.mha", true)] {
        let input = volume(&folder, name, mirrored, |depth| (0.5 + depth).clamp(0.0, 1.0));
        let [sheet, picture] = ["sheet.ply", "p.png"].map(|file| folder.path(file));
        let arguments = ["render", &input, "--mode", "sr", "--size", "90x90", "-o", &picture, "--mesh", &sheet];
        let (code, out, err) = run(&arguments);
        assert_eq!(code, Some(0), "{out}{err}");
        let said = out.lines().find(|line| line.starts_with("mesh:")).unwrap_or_default();
        assert!(said.contains("an open sheet of"), "{out}");
        let (vertices, triangles) = ply(&sheet);
        assert!(vertices.len() > 1000 && triangles.len() > 2000, "{said}");
        let from_centre = |v: &[f64; 3]| [0, 1, 2].map(|axis| v[axis] - CENTRE[axis]);
        let length = |v: [f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|n| a[n] * b[n]).sum::<f64>();
        // The edge is 1 mm wide: the detector's peak lies where it ends, 0.5 mm inside, and further out on the rays that graze the ball.
        let off: Vec<f64> = vertices.iter().map(|(v, ..)| length(from_centre(v)) - RADIUS).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        assert!((-0.6..-0.4).contains(&mean), "{name}: {mean} mm off");
        assert!(off.iter().all(|off| (-0.75..0.1).contains(off)), "{name}: {off:?}");
        // It faces outwards, so that no triangle of the mirrored volume is turned round.
        let outwards = vertices.iter().filter(|(v, normal, _)| dot(from_centre(v), *normal) > 0.0).count();
        assert!(outwards * 100 > vertices.len() * 99, "{name}: {outwards} of {} face outwards", vertices.len());
        // Half of the ball, from the probe's side: rows of the volume go along the second axis.
        assert!(vertices.iter().all(|(v, ..)| from_centre(v)[1] < 1.5), "{name}: what is behind is in it");
        let drawn = image::open(&picture).expect("a picture").to_rgb8();
        let colours: HashSet<[u8; 3]> = drawn.pixels().map(|pixel| pixel.0).collect();
        assert!(vertices.iter().all(|(.., colour)| colours.contains(colour)), "a colour that the picture has not");
        let shades: HashSet<[u8; 3]> = vertices.iter().map(|(.., colour)| *colour).collect();
        assert!(shades.len() > 20, "{} colours", shades.len());

        let (code, _, err) = run(&["render", &input, "--mode", "mip", "-o", &picture, "--mesh", &sheet]);
        assert!(code == Some(2) && err.contains("--mesh: this mode has no distance map"), "{err}");
    }
    let input = folder.path("ball.mha");
    let (code, _, err) = run(&["render", &input, "--mesh", &folder.path("sheet.obj")]);
    assert!(code == Some(2) && err.contains("must end in .stl, .ply or .glb"), "{err}");
    let (code, _, err) = run(&["render", &input, "--turntable", "3", "-o", &folder.path("turn"), "--mesh", "x.ply"]);
    assert!(code == Some(2) && err.contains("--mesh: is for one picture"), "{err}");
}
