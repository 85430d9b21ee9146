//! Results of `echolume filter`: every filter against its f64 reference, figures of regions, growth of windows.

use super::*;
use crate::common::probes::voxels;
use crate::common::scenes::scene;

#[test]
fn figures_of_regions_equal_those_of_the_files() {
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
    // Smoothing removes noise: otherwise the two lines are of the same picture.
    let snr = |when: &str| {
        let line = said.lines().find_map(|l| l.strip_prefix(&format!("region {when}"))).expect("a line");
        line.split_whitespace().nth(2).and_then(|w| w.parse::<f64>().ok()).expect("a ratio")
    };
    assert!(snr("after") > 1.5 * snr("before"), "{said}");
    assert!(said.contains("gaussian_lateral") && said.contains("gaussian_depth") && !said.contains("tone"), "{said}");
}

/// Every filter of the command line, against the f64 reference of the same slice.
#[test]
fn every_filter_name_gives_the_filter_of_the_settings() {
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
        let expected = given.with(&slots[&echolume::low_level::passes::Slot::Volume].values);
        let off = |other: &Grey| got.values.iter().zip(&other.values).filter(|(g, e)| g.abs_diff(**e) > 40).count();
        // Within the tolerance of the passes; a pixel at exactly two sigma may fall on either side.
        assert!(off(&expected) <= 2, "{filter}: {} pixels differ", off(&expected));
        assert!(off(&given) > 200, "{filter} does nothing");
    }
}

/// Every slot of stage 1 for a picture, in f64.
fn reference(
    grey: &Grey,
    slices: &str,
) -> std::collections::BTreeMap<echolume::low_level::passes::Slot, echolume::low_level::passes::Texels> {
    let size = [grey.width as usize, grey.height as usize, 1];
    let stored = if grey.sixteen {
        echolume::low_level::source::StoredType::U16
    } else {
        echolume::low_level::source::StoredType::U8
    };
    let input = echolume::low_level::scene::Input { stored, range: [0.0, grey.white()] };
    let toml = format!("mode = 'plane'\npicture = {{ size = [1, 1] }}\nslices = {{ format = 'r32f', {slices} }}");
    let scene = scene(voxels(size), input, &toml);
    let frame = echolume::low_level::passes::Texels { size, channels: 1, values: grey.shares() };
    echolume::low_level::reference::render(&scene, &[frame])
}

/// The rows of a growth table: sigma, window, largest, and shares.
/// The numbers of each line; a word is NaN.
fn rows(csv: &str) -> Vec<Vec<f64>> {
    let numbers = |l: &str| l.split(',').filter(|f| !f.is_empty()).map(|f| f.parse().unwrap_or(f64::NAN)).collect();
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
    assert_eq!((table.len(), &table[0][1..4]), (1, &[0.01, 3.0, 17.0][..]));
    let shares = &table[0][4..];
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
    let windows: Vec<[f64; 2]> = table[..7].iter().map(|r| [r[2], r[3]]).collect();
    assert_eq!(windows, [[3., 17.], [5., 19.], [7., 19.], [7., 21.], [9., 21.], [11., 21.], [13., 23.]], "Tables 7-9");
    let sigmas: Vec<f64> = table.iter().step_by(7).map(|r| r[1]).collect();
    assert_eq!((table.len(), sigmas), (42, vec![0.03, 0.1, 0.17, 0.03, 0.1, 0.17]));
    let centres: Vec<String> = fs::read_to_string(&csv)
        .expect("the table")
        .lines()
        .skip(1)
        .map(|l| l.split(',').next().unwrap_or("").into())
        .collect();
    assert!(
        centres[..21].iter().all(|c| c == "median") && centres[21..].iter().all(|c| c == "perona-malik"),
        "{centres:?}"
    );
    assert_eq!(said.lines().filter(|l| l.contains(" %")).count(), 42);
    let given = Grey::load(noisy.as_ref()).expect("input");
    let mut grown = 0.0;
    for (row, centre) in table.iter().zip(&centres) {
        let [sigma, window, largest] = [row[1], row[2], row[3]];
        let keys =
            format!("window = {window}, largest = {largest}, sigma = {sigma}, centre = '{centre}', growth = true");
        let slices = format!("enhanced_sigma = {{ {keys} }}");
        let rings = &reference(&given, &slices)[&echolume::low_level::passes::Slot::Growth].values;
        for (n, share) in row[4..].iter().enumerate() {
            let expected = rings.iter().filter(|r| **r == n as f64).count() as f64 / rings.len() as f64;
            assert!((share - expected).abs() < 4.0 / rings.len() as f64, "{row:?}: +{} is {expected}", 2 * n);
        }
        grown += 1.0 - row[4];
    }
    assert!(grown > 0.5, "no window grows: {grown}");
}
