//! Answers of `echolume filter` to wrong files and flags; it leaves no file behind.

use super::*;

#[test]
fn wrong_files_cause_neither_a_panic_nor_a_picture() {
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
    let (before, directory) = (folder.names(), folder.path(""));
    for (file, named) in [
        (&cut, "cut.png"),
        (&text, "PNG, JPEG, PNM and BMP"),
        (&empty, "PNG, JPEG, PNM and BMP"),
        (&huge, "huge.pgm"),
        (&short, "short.pgm"),
        (&flat, "flat.pgm"),
        (&missing, "missing.png"),
    ] {
        refused(&[file, "-o", &output, "--filter", "median"], 2, &["cannot be read", named]);
    }
    for file in [&directory, &fifo] {
        refused(&[file, "-o", &output, "--filter", "median"], 2, &[file, "not a regular file"]);
    }
    // Wider than any device's 3D image: the device's own limit is named.
    let wide = folder.write("wide.pgm", pgm(20_000, 2, false, |_, _| 0));
    refused(&[&wide, "-o", &output, "--filter", "median"], 1, &["20000", "the device allows"]);
    // No device.
    let arguments = ["filter", &good, "-o", &output, "--filter", "median"];
    let ran = finish(without_device(Command::new(PROGRAM).args(arguments)));
    refuses(&arguments, &ran, 3, &["no Vulkan device"]);
    assert_eq!(folder.names().len(), before.len() + 1, "something was written");
}

#[test]
fn inputs_are_not_overwritten_and_bad_targets_are_refused() {
    let folder = Folder::new("targets");
    let input = folder.write("in.pgm", pgm(9, 9, false, |x, y| (x * y) as u16));
    let bytes = fs::read(&input).expect("input");
    std::os::unix::fs::symlink(&input, folder.path("link.png")).expect("link");
    for output in ["in.pgm", "./in.pgm", "link.png"] {
        refused(&[&input, "-o", &folder.path(output), "--filter", "median"], 2, &["would replace an input"]);
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
        (&["estimator:edges=1"], &["estimator has no key \"edges\"", "kind, edge"]),
        (&["estimator:kind=mode"], &["--filter estimator:kind=mode", "nagao-matsuyama"]),
        (&["perona-malik:step=0.3"], &["slices.perona_malik", "0.25"]),
        (&["enhanced-sigma:largest=3"], &["slices.enhanced_sigma", "less than window"]),
        (&["enhanced-sigma:largest=99"], &["slices.enhanced_sigma.largest", "is 99", "3..=63"]),
        (&["median", "median"], &["median is given twice"]),
        (&["gaussian"], &["give lateral, depth or both"]),
        (&["gaussian:elevation=1"], &["need several slices"]),
        (&["gaussian:kernel=3"], &["need several slices"]),
        (&["gaussian:depth=1", "blur"], &["cannot be combined with gaussian"]),
        (&["gaussian:lateral=900"], &["slices.smooth.lateral", "at most 32"]),
    ] {
        let flags: Vec<&str> = filters.iter().flat_map(|f| ["--filter", f]).collect();
        refused(&[&[&input, "-o", &output], &flags[..]].concat(), 2, named);
    }
    let still = &["--growth-table", "--filter", "enhanced-sigma:sigma=0"];
    refused(&[&[&*input], &still[..]].concat(), 2, &["sigma must be above 0"]);
    for (flags, named) in [
        (["--region", "0,0,31,20"], "the picture is 30 x 20"),
        (["--region", "0,0,5"], "X,Y,WIDTH,HEIGHT"),
        (["--region", "3,3,1,1"], "fewer than two"),
    ] {
        refused(&[&[&input, "-o", &output, "--filter", "median"], &flags[..]].concat(), 2, &[named]);
    }
    let elsewhere = [&*input, "-o", &output, "--filter", "median", "--device", "no such device"];
    refused(&elsewhere, 3, &["available"]);
    assert_eq!(folder.names().len(), 1, "something was written");
    // Refusals of clap show the usage.
    for arguments in [
        vec![],
        vec![&*input, "--filter", "median"],
        vec![&*input, "-o", &output],
        vec![&*input, "-o", &output, "--filter", "median", "--background", "0,0,2,2"],
        vec![&*input, "-o", &output, "--filter", "median", "--csv", "t.csv"],
    ] {
        let (code, out, err) = run(&arguments);
        assert!(code == Some(2) && out.is_empty() && err.contains("--help"), "{arguments:?}: {err}");
    }
    assert!(run(&["--help"]).1.contains("--growth-table"));
}
