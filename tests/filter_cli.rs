//! `echolume filter` as a user meets it: ordinary pictures in, filtered pictures and figures out, and what it says to wrong
//! files and flags.

use echolume::picture::grey::Grey;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

const PROGRAM: &str = env!("CARGO_BIN_EXE_echolume");

/// A folder of one test, gone at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("echolume-filter-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).expect("make a folder for the test");
        Folder(path)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().expect("a plain name").to_string()
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        fs::write(self.0.join(name), bytes).expect("write a file of the test");
        self.path(name)
    }

    fn files(&self) -> usize {
        fs::read_dir(&self.0).expect("list the folder").count()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Exit code, standard output and standard error of `echolume filter`.
fn run(arguments: &[&str], blind: bool) -> (Option<i32>, String, String) {
    let mut command = Command::new(PROGRAM);
    command.arg("filter").args(arguments).stdin(Stdio::null());
    if blind {
        command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
        command.env_remove("VK_ADD_DRIVER_FILES");
    }
    let output = command.output().expect("start the program");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// Runs with validation what has to work, and gives what it prints.
fn done(arguments: &[&str]) -> String {
    let (code, out, err) = run(&[arguments, &["--validate"]].concat(), false);
    assert_eq!(code, Some(0), "{arguments:?}: {err}");
    out
}

fn refused(arguments: &[&str], wanted: i32, named: &[&str]) {
    let (code, _, err) = run(arguments, false);
    let said = format!("{arguments:?} ended with {code:?} and said {err:?}, not {wanted} and {named:?}");
    assert!(code == Some(wanted) && named.iter().all(|n| err.contains(n)), "{said}");
    assert!(err.starts_with("echolume: ") && err.lines().count() == 1 && err.len() < 1000, "not one line: {said}");
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

/// Without a pattern in which two windows look the same.
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
    // A median has no use for one hot pixel, in either order of the flags.
    for filters in [["median", "gaussian:depth=1"], ["gaussian:depth=1", "median"]] {
        assert!(filtered(&file, &folder.path("out.png"), &filters).values.iter().all(|v| *v == 0));
    }
}

#[test]
fn colours_become_grey_by_rec_709_and_that_is_said() {
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
        // What it is decides, not what it is called.
        ("a.txt", image::ImageFormat::Png, 0),
    ] {
        let file = folder.path(name);
        picture.save_with_format(&file, format).expect("written");
        let out = filtered(&file, &folder.path("out.png"), &["sigma:sigma=0"]);
        let worst = out.values.iter().zip(picture.iter()).map(|(a, b)| a.abs_diff(u16::from(*b))).max();
        assert!((out.width, out.height) == (40, 30) && worst <= Some(off), "{name}: off by {worst:?}");
    }
}

#[test]
fn ratios_of_regions_are_those_of_the_files() {
    let folder = Folder::new("ratios");
    let picture = |x: u32, y: u32| noise(x, y) / if x < 32 { 4 } else { 2 } + if x < 32 { 40_000 } else { 1000 };
    let file = folder.write("in.pgm", pgm(64, 48, true, picture));
    let output = folder.path("out.png");
    let (region, background) = (["2", "3", "25", "40"], ["36", "4", "20", "33"]);
    let flags = ["--region", &region.join(","), "--background", &background.join(",")];
    let said = done(
        &[&[&file, "-o", &output, "--filter", "gaussian:lateral=1.2,depth=0.8", "--timings"], &flags[..]].concat(),
    );
    let level = |grey: &Grey, region: [&str; 4]| {
        let [x, y, w, h] = region.map(|n| n.parse::<usize>().expect("a number"));
        let shares = grey.shares();
        let inside: Vec<f64> = (y..y + h).flat_map(|y| shares[y * 64 + x..][..w].to_vec()).collect();
        let mean = inside.iter().sum::<f64>() / inside.len() as f64;
        (mean, (inside.iter().map(|v| v * v).sum::<f64>() / inside.len() as f64 - mean * mean).sqrt())
    };
    for (when, grey) in [("before", Grey::load(file.as_ref())), ("after", Grey::load(output.as_ref()))] {
        let grey = grey.expect("a picture");
        let ((m1, s1), (m2, s2)) = (level(&grey, region), level(&grey, background));
        let row = |name: &str| -> Vec<f64> {
            let line = said.lines().find_map(|l| l.strip_prefix(&format!("{name} {when}"))).expect("a line");
            line.split_whitespace().filter_map(|w| w.parse().ok()).collect()
        };
        let expected = [vec![m1, s1, m1 / s1, (m1 - m2).abs() / s1.hypot(s2)], vec![m2, s2, m2 / s2]];
        for (got, expected) in [row("region"), row("background")].iter().zip(expected) {
            assert_eq!(got.len(), expected.len(), "{said}");
            let off = got.iter().zip(&expected).map(|(g, e)| (g - e).abs() / e.max(0.1)).fold(0.0, f64::max);
            assert!(off < 2e-3, "{when}: {got:?} is not {expected:?}");
        }
    }
    // Smoothing takes noise away: otherwise the two lines are of the same picture.
    let snr = |when: &str| {
        let line = said.lines().find_map(|l| l.strip_prefix(&format!("region {when}"))).expect("a line");
        line.split_whitespace().nth(2).and_then(|w| w.parse::<f64>().ok()).expect("a ratio")
    };
    assert!(snr("after") > 1.5 * snr("before"), "{said}");
    assert!(said.contains("gaussian_lateral") && said.contains("gaussian_depth") && !said.contains("tone"), "{said}");
}

/// Every filter of the command line, against the f64 reference of the same slice.
#[test]
fn every_filter_by_its_name_is_the_one_of_the_settings() {
    let folder = Folder::new("names");
    let file =
        folder.write("in.pgm", pgm(45, 37, true, |x, y| 20_000 + noise(x, y) / 8 + if x > 20 { 20_000 } else { 0 }));
    let given = Grey::load(file.as_ref()).expect("input");
    for (filter, slices) in [
        ("median", "median = true"),
        ("estimator", "estimator = 'median'"),
        ("estimator:kind=gradient-inverse", "estimator = 'gradient-inverse'"),
        ("estimator:edge=0.05,kind=perona-malik", "estimator = 'perona-malik', estimator_edge = 0.05"),
        ("sigma:window=5", "sigma = { window = 5 }"),
        ("sigma:sigma=0.1,noise=multiplicative", "sigma = { sigma = 0.1, noise = 'multiplicative' }"),
        (
            "enhanced-sigma:sigma=0.0311,window=3,centre=nagao-matsuyama",
            "enhanced_sigma = { sigma = 0.0311, window = 3, centre = 'nagao-matsuyama' }",
        ),
        ("enhanced-sigma:edge=0.04", "enhanced_sigma = { centre = 'perona-malik', edge = 0.04 }"),
        ("perona-malik:repeat=3", "perona_malik = { repeat = 3 }"),
        ("perona-malik:scheme=aos,step=10", "perona_malik = { scheme = 'aos', step = 10.0 }"),
        ("blur", "blur = true"),
        ("gaussian:lateral=1.1,depth=0.7", "smooth = { lateral = 1.1, depth = 0.7 }"),
    ] {
        let got = filtered(&file, &folder.path("out.png"), &[filter]);
        let slots = reference(&given, slices);
        let expected = given.with(&slots[&echolume::passes::Slot::Volume].values);
        let off = |other: &Grey| got.values.iter().zip(&other.values).filter(|(g, e)| g.abs_diff(**e) > 40).count();
        // Within the tolerance of the passes; a pixel at exactly two sigma may fall on either side.
        assert!(off(&expected) <= 2, "{filter}: {} pixels differ", off(&expected));
        assert!(off(&given) > 200, "{filter} does nothing");
    }
}

/// Every slot of a picture's way through stage 1, in f64.
fn reference(
    grey: &Grey,
    slices: &str,
) -> std::collections::BTreeMap<echolume::passes::Slot, echolume::passes::Texels> {
    use echolume::probe::{Geometry, Grid};
    let size = [grey.width as usize, grey.height as usize, 1];
    let grid = Geometry::Cartesian(Grid { size, spacing: [1.0; 3], origin: [0.0; 3] });
    let stored = if grey.sixteen { echolume::source::StoredType::U16 } else { echolume::source::StoredType::U8 };
    let input = echolume::scene::Input { stored, range: [0.0, grey.white()] };
    let toml = format!("mode = 'plane'\npicture = {{ size = [1, 1] }}\nslices = {{ format = 'r32f', {slices} }}");
    let scene = echolume::scene::Scene::new(grid, input, toml::from_str(&toml).expect("settings")).expect("scene");
    let frame = echolume::passes::Texels { size, channels: 1, values: grey.shares() };
    echolume::report::whole::render(&scene, &[frame])
}

/// The rows of a growth table: sigma, window, largest, and shares.
fn rows(csv: &str) -> Vec<Vec<f64>> {
    let numbers = |l: &str| l.split(',').filter(|f| !f.is_empty()).map(|f| f.parse().expect("a number")).collect();
    csv.lines().skip(1).map(numbers).collect()
}

#[test]
fn the_growth_table_is_that_of_the_filter() {
    let folder = Folder::new("growth");
    let csv = folder.path("growth.csv");
    // Columns of one value each, 10 levels apart: within 5 levels lie only those of the same column, so a window of 3 (9 pixels)
    // grows until 9 rows of it lie in the picture.
    let stripes = folder.write("stripes.pgm", pgm(25, 100, false, |x, _| 10 * x as u16));
    done(&[
        &stripes,
        "--growth-table",
        "--filter",
        "enhanced-sigma:sigma=0.01,window=3,largest=17,centre=median",
        "--csv",
        &csv,
    ]);
    let table = rows(&fs::read_to_string(&csv).expect("the table"));
    assert_eq!((table.len(), &table[0][..3]), (1, &[0.01, 3.0, 17.0][..]));
    let shares = &table[0][3..];
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-5, "{shares:?}");
    // 92 rows of 100 grow by 3 rings; the second, third and fourth from an edge by 6, 5 and 4; the outermost, whose window starts
    // with 6 pixels, by 4. The outermost columns have another median.
    for (rings, share) in [(0, 0.0), (1, 0.0), (2, 0.0), (3, 0.92), (4, 0.04), (5, 0.02), (6, 0.02), (7, 0.0)] {
        assert!((share - shares[rings]).abs() < 0.0801, "+{}: {} for {share}", 2 * rings, shares[rings]);
    }
    assert!(shares[3] > 0.92 * 0.92 - 1e-6 && shares[4..7].iter().all(|s| *s > 0.018), "{shares:?}");

    // The whole table against the f64 reference, on noise.
    let noisy = folder.write("noisy.pgm", pgm(48, 40, false, |x, y| 100 + (noise(x, y) >> 10)));
    let said = done(&[&noisy, "--growth-table", "--csv", &csv]);
    let table = rows(&fs::read_to_string(&csv).expect("the table"));
    let windows: Vec<[f64; 2]> = table[..6].iter().map(|r| [r[1], r[2]]).collect();
    assert_eq!(windows, [[3., 17.], [5., 19.], [7., 19.], [9., 21.], [11., 21.], [13., 23.]], "Tables 7-9");
    let sigmas: Vec<f64> = table.iter().step_by(6).map(|r| r[0]).collect();
    assert_eq!((table.len(), sigmas), (18, vec![0.03, 0.1, 0.17]));
    assert_eq!(said.lines().filter(|l| l.contains(" %")).count(), 18);
    let given = Grey::load(noisy.as_ref()).expect("input");
    let mut grown = 0.0;
    for row in &table {
        let [sigma, window, largest] = [row[0], row[1], row[2]];
        let slices =
            format!("enhanced_sigma = {{ window = {window}, largest = {largest}, sigma = {sigma}, growth = true }}");
        let rings = &reference(&given, &slices)[&echolume::passes::Slot::Growth].values;
        for (n, share) in row[3..].iter().enumerate() {
            let expected = rings.iter().filter(|r| **r == n as f64).count() as f64 / rings.len() as f64;
            assert!((share - expected).abs() < 4.0 / rings.len() as f64, "{row:?}: +{} is {expected}", 2 * n);
        }
        grown += 1.0 - row[3];
    }
    assert!(grown > 0.5, "no window grows: {grown}");
}

#[test]
fn no_wrong_file_is_met_with_a_panic_or_a_picture() {
    let folder = Folder::new("files");
    let good = folder.write("good.pgm", pgm(30, 20, false, |x, _| x as u16));
    let mut png = std::io::Cursor::new(Vec::new());
    image::GrayImage::from_fn(300, 200, |x, y| image::Luma([(noise(x, y) >> 8) as u8]))
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("encoded");
    let png = png.into_inner();
    let output = folder.path("out.png");
    let cut = folder.write("cut.png", &png[..png.len() / 2]);
    let text = folder.write("text.png", "no picture at all");
    let empty = folder.write("empty.png", "");
    let huge = folder.write("huge.pgm", "P5 100000 100000 255\n1234");
    let short = folder.write("short.pgm", "P5 100 100 255\n1234");
    let flat = folder.write("flat.pgm", "P5 0 100 255\n1234");
    let fifo = folder.path("fifo");
    assert!(Command::new("mkfifo").arg(&fifo).status().expect("mkfifo").success());
    let missing = folder.path("missing.png");
    let (before, directory) = (folder.files(), folder.path(""));
    for (file, named) in [
        (&cut, "cut.png"),
        (&text, "PNG, JPEG, PNM and BMP"),
        (&empty, "PNG, JPEG, PNM and BMP"),
        (&huge, "huge.pgm"),
        (&short, "short.pgm"),
        (&flat, "flat.pgm"),
        (&missing, "missing.png"),
        (&directory, "not a regular file"),
        (&fifo, "not a regular file"),
    ] {
        refused(&[file, "-o", &output, "--filter", "median"], 2, &["cannot be read", named]);
    }
    // Wider than any device's 3D image: the device's own limit is named.
    let wide = folder.write("wide.pgm", pgm(20_000, 2, false, |_, _| 0));
    refused(&[&wide, "-o", &output, "--filter", "median"], 1, &["20000", "the device allows"]);
    // No device.
    let (code, _, err) = run(&[&good, "-o", &output, "--filter", "median"], true);
    assert!(code == Some(1) && err.contains("no Vulkan device") && err.lines().count() == 1, "{err}");
    assert_eq!(folder.files(), before + 1, "something was written");
}

#[test]
fn nothing_is_written_over_the_input_or_where_it_cannot_be() {
    let folder = Folder::new("targets");
    let input = folder.write("in.pgm", pgm(9, 9, false, |x, y| (x * y) as u16));
    let bytes = fs::read(&input).expect("input");
    std::os::unix::fs::symlink(&input, folder.path("link.png")).expect("link");
    for output in ["in.pgm", "./in.pgm", "link.png"] {
        refused(&[&input, "-o", &folder.path(output), "--filter", "median"], 2, &["would replace the input"]);
    }
    refused(&[&input, "-o", &folder.path("none/out.png"), "--filter", "median"], 1, &["there is no folder"]);
    refused(&[&input, "-o", &folder.path(""), "--filter", "median"], 1, &["folder"]);
    assert_eq!(fs::read(&input).expect("input"), bytes);
}

#[test]
fn no_wrong_flag_is_taken_for_a_default() {
    let folder = Folder::new("flags");
    let (input, output) = (folder.write("in.pgm", pgm(30, 20, false, |x, _| x as u16)), folder.path("out.png"));
    for (filters, named) in [
        (
            &["nonsense"][..],
            &["nonsense", "median, estimator, sigma, enhanced-sigma, perona-malik, blur, gaussian"][..],
        ),
        (&["sigma:window=8"], &["slices.sigma", "odd"]),
        (&["sigma:width=9"], &["--filter sigma:width=9", "width"]),
        (&["sigma:window"], &["--filter sigma:window", "KEY=VALUE"]),
        (&["sigma:window=wide"], &["--filter sigma:window=wide"]),
        (&["sigma:sigma=-1"], &["slices.sigma", "at least 0"]),
        (&["median:size=5"], &["median has no settings"]),
        (&["estimator:edges=1"], &["estimator has no \"edges\"", "kind, edge"]),
        (&["estimator:kind=mode"], &["--filter estimator:kind=mode", "nagao-matsuyama"]),
        (&["perona-malik:step=0.3"], &["slices.perona_malik", "0.25"]),
        (&["enhanced-sigma:largest=3"], &["slices.enhanced_sigma", "less than window"]),
        (&["median", "median"], &["median is given twice"]),
        (&["gaussian"], &["give lateral, depth or both"]),
        (&["gaussian:elevation=1"], &["reach across slices"]),
        (&["gaussian:kernel=3"], &["reach across slices"]),
        (&["gaussian:depth=1", "blur"], &["a gaussian blurs already"]),
        (&["gaussian:lateral=900"], &["slices.smooth.lateral", "at most 32"]),
    ] {
        let flags: Vec<&str> = filters.iter().flat_map(|f| ["--filter", f]).collect();
        refused(&[&[&input, "-o", &output], &flags[..]].concat(), 2, named);
    }
    let still = &["--growth-table", "--filter", "enhanced-sigma:sigma=0"];
    refused(&[&[&*input], &still[..]].concat(), 2, &["a sigma of 0"]);
    for (flags, named) in [
        (["--region", "0,0,31,20"], "the picture is 30 x 20"),
        (["--region", "0,0,5"], "X,Y,WIDTH,HEIGHT"),
        (["--region", "3,3,1,1"], "fewer than two"),
        (["--device", "no such device"], "there are"),
    ] {
        refused(&[&[&input, "-o", &output, "--filter", "median"], &flags[..]].concat(), 2, &[named]);
    }
    assert_eq!(folder.files(), 1, "something was written");
    // What clap refuses shows the usage.
    for arguments in [
        vec![],
        vec![&*input, "--filter", "median"],
        vec![&*input, "-o", &output],
        vec![&*input, "-o", &output, "--filter", "median", "--background", "0,0,2,2"],
        vec![&*input, "-o", &output, "--filter", "median", "--csv", "t.csv"],
    ] {
        let (code, out, err) = run(&arguments, false);
        assert!(code == Some(2) && out.is_empty() && err.contains("--help"), "{arguments:?}: {err}");
    }
    assert!(run(&["--help"], false).1.contains("--growth-table"));
}
