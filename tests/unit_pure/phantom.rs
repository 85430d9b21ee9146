//! The phantom: its bodies are where their formulas say, its speckle has the right statistics, and the same options give
//! the same bytes.

use crate::common::files::Folder;
use echolume::Source;
use echolume::low_level::probe::{Advance, Geometry, Indices, Probe};
use echolume::low_level::source::phantom::{
    Body, DYNAMIC_RANGE, Label, Phantom, PhantomOptions, PointSpread, Sampling, Speckle, Truth, distance_path,
};
use echolume::low_level::source::{Frame, Recording};
use glam::DVec3;
use std::fs;

/// A small sweep: the tests need no more.
fn small(body: Body) -> PhantomOptions {
    PhantomOptions { body, frames: 9, lines: 48, samples: 256, ..PhantomOptions::default() }
}

fn phantom(options: PhantomOptions) -> Phantom {
    Phantom::new(options).unwrap_or_else(|e| panic!("{e}"))
}

fn bytes(options: PhantomOptions) -> Vec<u8> {
    phantom(options).volume(0).into_iter().flat_map(|frame| frame.bytes).collect()
}

/// Every sample of a volume with its place: (probe, indices, grey).
fn each_sample(phantom: &Phantom, volume: usize, mut see: impl FnMut(&Probe, Indices, f64)) {
    let probe = phantom.probe(volume);
    for frame in phantom.volume(volume) {
        for (i, grey) in frame.bytes.iter().enumerate() {
            let (line, sample) = ((i / probe.samples) as f64, (i % probe.samples) as f64);
            see(&probe, Indices { sample, line, slice: frame.slice as f64 }, f64::from(*grey));
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    for body in Body::ALL {
        let first = bytes(small(body));
        assert!(first == bytes(small(body)), "{body}");
        assert!(first != bytes(PhantomOptions { seed: 2, ..small(body) }), "{body}");
        let bare = |seed| bytes(PhantomOptions { seed, speckle: Speckle::None, ..small(body) });
        assert!(bare(1) == bare(2), "{body}: the seed is the speckle's alone");
    }
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bytes(small(Body::Head)))
    };
    let one = with(1);
    assert!(one == with(2) && one == with(5));
}

/// Rayleigh in amplitude, Fisher-Tippett in dB; the mean is 15 dB below full scale, so that neither end clips.
#[test]
fn speckle_is_fully_developed() {
    let full = phantom(PhantomOptions { body: Body::Constant, ..PhantomOptions::default() });
    let frames = full.volume(0);
    for slice in [0, 18, 36] {
        // One frame has 512 x 128 samples: over 3000 cells of 2 pi x 1.5 x 2 samples.
        let level: Vec<f64> =
            frames[slice].bytes.iter().map(|v| (f64::from(*v) / 255.0 - 1.0) * DYNAMIC_RANGE).collect();
        let (mean_db, sd_db) = mean_and_sd(level.iter().copied());
        let (mean, sd) = mean_and_sd(level.iter().map(|db| 10f64.powf(db / 20.0)));
        assert!((mean / sd / 1.913 - 1.0).abs() < 0.05, "slice {slice}: mean / sd is {}", mean / sd);
        assert!((sd_db / 5.57 - 1.0).abs() < 0.05, "slice {slice}: sd is {sd_db} dB");
        // The logarithm's mean lies 2.51 dB below that of the power (Euler's constant), which speckle leaves as it was.
        assert!((mean_db + 2.51 + 15.0).abs() < 0.5, "slice {slice}: mean is {mean_db} dB");
    }
}

fn mean_and_sd(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    (mean, (values.map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt())
}

/// Half a grey level for rounding, plus the rounding of levels in f32.
const ROUNDING: f64 = 0.501;

#[test]
fn greys_without_speckle_are_the_formula_on_every_sample_both_ways() {
    for body in [Body::Sphere, Body::Step, Body::Wires, Body::Constant, Body::Ramp, Body::Vessels] {
        let options =
            PhantomOptions { speckle: Speckle::None, volumes: 2, both_ways: true, speed_ratio: 0.5, ..small(body) };
        let phantom = phantom(options);
        let truth = phantom.truth();
        let mut shown = [255.0f64, 0.0];
        for volume in 0..2 {
            each_sample(&phantom, volume, |probe, at, grey| {
                let place = probe.to_space(at);
                // How far behind an edge, in samples; -0.5..0.5 is the edge itself.
                let edge = |beyond: f64, near: f64, far: f64| {
                    near + (far - near) * (beyond / probe.sample_pitch + 0.5).clamp(0.0, 1.0)
                };
                let expected = match &truth {
                    Truth::Sphere { centre, radius, inside, outside } => {
                        edge(radius - place.distance(*centre), *outside, *inside)
                    }
                    Truth::Step { y, above, below } => edge(place.y - y, *above, *below),
                    Truth::Wires { wires, peak, per_mm2, outside } => {
                        let nearest = wires.iter().map(|w| w.distance(place)).fold(f64::MAX, f64::min);
                        outside.max(peak - per_mm2 * nearest * nearest)
                    }
                    Truth::Vessels(tree) => {
                        let away = tree.distance(place);
                        edge(away, tree.blood, edge(away - tree.wall, tree.muscle, tree.tissue))
                    }
                    Truth::Constant { grey } => *grey,
                    Truth::Ramp(ramp) => ramp.grey(
                        probe.first_range() + probe.sample_pitch * at.sample,
                        probe.lines.at(at.line),
                        probe.slice_position(at.line, at.slice),
                    ),
                    Truth::Head | Truth::Heart(_) => panic!("has no formula, or one that depends on time"),
                };
                assert!((grey - expected).abs() < ROUNDING, "{body}, volume {volume}, {at:?}: {grey} for {expected}");
                shown = [shown[0].min(grey), shown[1].max(grey)];
            });
        }
        let spread = if body == Body::Constant { 0.0 } else { 100.0 };
        assert!(shown[1] - shown[0] >= spread && shown[0] > 0.0 && shown[1] < 255.0, "{body}: {shown:?}");
    }
}

/// With speckle the means of bright and dark regions are kept.
#[test]
fn speckle_leaves_the_body_where_it_is() {
    let phantom = phantom(PhantomOptions { body: Body::Sphere, ..PhantomOptions::default() });
    let Truth::Sphere { centre, radius, inside, outside } = phantom.truth() else { panic!("is a sphere") };
    let mut sums = [(0.0, 0.0); 2];
    each_sample(&phantom, 0, |probe, at, grey| {
        let from_edge = probe.to_space(at).distance(centre) - radius;
        if from_edge.abs() > 8.0 {
            let (sum, count) = &mut sums[usize::from(from_edge > 0.0)];
            *sum += grey;
            *count += 1.0;
        }
    });
    // The mean of the logarithm lies 2.51 dB below the power; in the fluid, 45 dB down, clipping lifts it again.
    let lower = 2.51 / DYNAMIC_RANGE * 255.0;
    assert!((sums[0].0 / sums[0].1 - (inside - lower)).abs() < 3.0, "{sums:?}");
    assert!((sums[1].0 / sums[1].1 - outside).abs() < lower, "{sums:?}");
}

/// The head moves: volumes differ by more than their speckle seeds, and differ without speckle too.
#[test]
fn the_head_is_bright_in_dark_fluid_and_moves() {
    let phantom = phantom(PhantomOptions { speckle: Speckle::None, volumes: 6, ..small(Body::Head) });
    let grey_at = |volume: usize, place: [f64; 3]| {
        let probe = phantom.probe(volume);
        let at = probe.to_indices(place.into());
        let frame = &phantom.volume(volume)[at.slice.round() as usize];
        frame.bytes[at.line.round() as usize * probe.samples + at.sample.round() as usize]
    };
    assert!(grey_at(0, [0.0, 72.0, 0.0]) < 40, "fluid between wall and face");
    assert!(grey_at(0, [0.0, 50.0, 0.0]) > 100, "the wall");
    let between = |a: usize, b: usize| {
        let (a, b) = (phantom.volume(a), phantom.volume(b));
        a.iter().zip(&b).map(|(a, b)| a.bytes.iter().zip(&b.bytes).filter(|(a, b)| a != b).count()).sum::<usize>()
    };
    assert!(between(0, 5) > 2000, "{} samples differ", between(0, 5));
}

fn read_back(recording: &mut Recording) -> Vec<Frame> {
    std::iter::from_fn(|| recording.next_frame().unwrap_or_else(|e| panic!("{e}"))).collect()
}

#[test]
fn a_written_sweep_reads_back_as_it_was_made() {
    let folder = Folder::new("both-ways");
    let path = folder.join("sweep.mha");
    let made = phantom(PhantomOptions { volumes: 3, both_ways: true, speed_ratio: 0.5, ..small(Body::Head) });
    made.write(&path).unwrap();
    assert!(folder.names().iter().eq(["sweep.mha", "sweep.probe.toml"]));

    let mut recording = Recording::open(&path, None).unwrap();
    assert_eq!((recording.format(), recording.volumes()), ("PLUS sequence", 3));
    let read = read_back(&mut recording);
    let frames: Vec<Frame> = (0..3).flat_map(|v| made.volume(v)).collect();
    assert_eq!(read.len(), frames.len());
    for (read, made) in read.iter().zip(&frames) {
        assert!((read.time.unwrap() - made.time.unwrap()).abs() < 1e-6);
        assert!(*read == Frame { time: read.time, ..made.clone() }, "volume {} frame {}", made.volume, made.number);
    }
    for volume in 0..3 {
        assert_eq!(recording.geometry(volume), Geometry::Sweep(made.probe(volume)));
    }
}

/// One volume of a stepped motor needs no probe file: the keys of a pre-scan sweep are enough.
#[test]
fn a_single_volume_stands_alone() {
    let folder = Folder::new("alone");
    let path = folder.join("sweep.mha");
    let made = phantom(small(Body::Sphere));
    made.write(&path).unwrap();
    // Overwritten, as by a second run.
    made.write(&path).unwrap();
    fs::remove_file(folder.join("sweep.probe.toml")).unwrap();
    let mut recording = Recording::open(&path, None).unwrap();
    assert!(read_back(&mut recording).iter().zip(&made.volume(0)).all(|(a, b)| a.bytes == b.bytes));
    let (Geometry::Sweep(read), made) = (recording.geometry(0), made.probe(0)) else { panic!("is a sweep") };
    let corner = Indices { sample: 255.0, line: 47.0, slice: 8.0 };
    assert!(read.to_space(corner).distance(made.to_space(corner)) < 1e-9);
}

#[test]
fn every_second_volume_goes_backwards() {
    let options = PhantomOptions { volumes: 2, both_ways: true, speed_ratio: 0.5, ..small(Body::Constant) };
    let phantom = phantom(options);
    let pitch = phantom.probe(0).slices.pitch();
    for (volume, sign) in [(0, 1.0), (1, -1.0)] {
        assert_eq!(phantom.probe(volume).advance, Advance::Same(sign * 0.5 * pitch));
        phantom.probe(volume).check().unwrap();
        for (number, frame) in phantom.volume(volume).iter().enumerate() {
            assert_eq!((frame.volume as usize, frame.number as usize), (volume, number));
            assert_eq!(frame.backward, volume == 1);
            assert_eq!(frame.slice, if frame.backward { 8 - number } else { number });
        }
    }
    // A line takes 2 d / c.
    let time = phantom.volume(1)[0].time.unwrap();
    assert!((time - phantom.probe(0).acquisition_time()).abs() < 1e-12);
    assert!((time - 9.0 * 48.0 * 2.0 * 0.12 / 1540.0).abs() < 1e-9);
}

#[test]
fn impossible_sweeps_and_files_are_refused_in_one_line() {
    let ok = small(Body::Sphere);
    let wrong = [
        (PhantomOptions { volumes: 0, ..ok.clone() }, "volumes"),
        (PhantomOptions { frames: 1, ..ok.clone() }, "frames"),
        (PhantomOptions { lines: 1, ..ok.clone() }, "lines"),
        (PhantomOptions { samples: 2, ..ok.clone() }, "samples"),
        (PhantomOptions { frames: 1024, lines: 1024, samples: 8192, ..ok.clone() }, "samples"),
        (PhantomOptions { samples: usize::MAX, ..ok.clone() }, "samples"),
        (PhantomOptions { speed_ratio: 1.5, ..ok.clone() }, "speed_ratio"),
        (PhantomOptions { fan_angle_deg: 5.0, ..ok.clone() }, "fan_angle"),
        (PhantomOptions { fan_angle_deg: f64::NAN, ..ok.clone() }, "fan_angle"),
        (PhantomOptions { point_spread: PointSpread { axial_mm: -1.0, ..ok.point_spread }, ..ok.clone() }, "psf_axial"),
        (
            PhantomOptions { point_spread: PointSpread { lateral_deg: 11.0, ..ok.point_spread }, ..ok.clone() },
            "psf_lateral",
        ),
        (
            PhantomOptions { point_spread: PointSpread { elevation_deg: f64::NAN, ..ok.point_spread }, ..ok.clone() },
            "psf_elevation",
        ),
        (PhantomOptions { speed_ratio: f64::NAN, ..ok.clone() }, "speed_ratio"),
    ];
    for (options, field) in wrong {
        let Err(error) = Phantom::new(options) else { panic!("{field}") };
        assert_eq!(error.to_string().lines().count(), 1);
        assert!(error.to_string().starts_with(&format!("phantom: {field}: ")), "{error}");
    }
    let error = "foot\n".parse::<Body>().unwrap_err().to_string();
    assert!(error.lines().count() == 1 && error.contains("sphere"), "{error}");
    for body in Body::ALL {
        assert_eq!(body.name().parse::<Body>().unwrap(), body);
    }
    for sampling in Sampling::ALL {
        assert_eq!(sampling.name().parse::<Sampling>().unwrap(), sampling);
    }
    assert!("fast".parse::<Sampling>().unwrap_err().to_string().contains("live, gallery"));

    let folder = Folder::new("refused");
    fs::create_dir(folder.join("folder.mha")).unwrap();
    let made = phantom(ok.clone());
    for name in ["sweep.vol", "sweep", "folder.mha", "nowhere/sweep.mha"] {
        let error = made.write(&folder.join(name)).unwrap_err().to_string();
        assert!(error.lines().count() == 1 && error.contains(name), "{error}");
    }
    let long = phantom(PhantomOptions { volumes: 10_000, ..ok });
    assert!(long.write(&folder.join("long.mha")).unwrap_err().to_string().contains("volumes"));
    assert!(folder.names().iter().eq(["folder.mha"]), "something half done is left: {:?}", folder.names());
}

#[test]
fn the_mean_over_all_speckle_is_the_mean_of_many_realisations() {
    const SEEDS: u64 = 150;
    for body in [Body::Head, Body::Wires] {
        let sweep =
            |seed, speckle| bytes(PhantomOptions { seed, speckle, frames: 3, lines: 32, samples: 128, ..small(body) });
        let mean = sweep(1, Speckle::Mean);
        let mut sums = vec![[0.0; 2]; mean.len()];
        for seed in 0..SEEDS {
            for (sum, grey) in sums.iter_mut().zip(sweep(seed, Speckle::Random)) {
                sum[0] += f64::from(grey);
                sum[1] += f64::from(grey).powi(2);
            }
        }
        let count = SEEDS as f64;
        // Differences in standard errors, with half a grey value for the rounding of the mean and for what is cut off above.
        let mut excess: Vec<f64> = Vec::new();
        let mut total = 0.0;
        for (mean, [sum, squares]) in mean.iter().zip(&sums) {
            let found = sum / count;
            let error = ((squares / count - found * found).max(0.0) / count).sqrt();
            excess.push((f64::from(*mean) - found).abs() / (error + 0.5));
            total += f64::from(*mean) - found;
        }
        excess.sort_by(f64::total_cmp);
        let p99 = excess[excess.len() * 99 / 100];
        println!(
            "{body}: 99 % within {p99:.2} standard errors, mean difference {:.3} grey values",
            total / mean.len() as f64
        );
        // Of a normal distribution 99 % lie within 2.6.
        assert!(p99 < 3.0, "{body}: {p99}");
        assert!((total / mean.len() as f64).abs() < 0.3, "{body}");
        // It is not simply the echogenicity.
        assert!(mean != sweep(1, Speckle::None), "{body}");
    }
}

/// The power of speckle of a Gaussian point-spread function of sd s is correlated by exp(-d^2 / 2 s^2) over a distance d.
#[test]
fn the_point_spread_is_as_wide_as_it_says() {
    let point_spread = PointSpread { axial_mm: 0.5, lateral_deg: 0.9, elevation_deg: 1.1 };
    let options = PhantomOptions { body: Body::Constant, frames: 61, point_spread, ..PhantomOptions::default() };
    let phantom = phantom(options.clone());
    let probe = phantom.probe(0);
    let power: Vec<Vec<f64>> = phantom
        .volume(0)
        .iter()
        .map(|frame| {
            frame.bytes.iter().map(|v| 10f64.powf((f64::from(*v) / 255.0 - 1.0) * DYNAMIC_RANGE / 10.0)).collect()
        })
        .collect();
    // Near the focus, where the beam is narrowest.
    let middle = (55.0 / probe.sample_pitch) as usize;
    let samples = middle - 20..middle + 20;
    let correlation = |frames: usize, lines: usize, along: usize| {
        let pairs = (5..options.frames - 5).flat_map(|f| {
            let samples = samples.clone();
            (5..options.lines - 5).flat_map(move |l| samples.clone().map(move |s| (f, l, s)))
        });
        let at = |f: usize, l: usize, s: usize| power[f][l * probe.samples + s];
        let pairs: Vec<[f64; 2]> = pairs.map(|(f, l, s)| [at(f, l, s), at(f + frames, l + lines, s + along)]).collect();
        let [(ma, sa), (mb, sb)] = [0, 1].map(|i| mean_and_sd(pairs.iter().map(move |p| p[i])));
        pairs.iter().map(|[a, b]| (a - ma) * (b - mb)).sum::<f64>() / pairs.len() as f64 / (sa * sb)
    };
    let expected = |distance: f64, sd: f64| (-(distance / sd).powi(2) / 2.0).exp();
    let [line, frame] = [probe.lines.pitch(), probe.slices.pitch()].map(f64::to_degrees);
    for (found, expected) in [
        (correlation(0, 0, 2), expected(2.0 * probe.sample_pitch, 0.5)),
        (correlation(0, 1, 0), expected(line, 0.9)),
        (correlation(0, 2, 0), expected(2.0 * line, 0.9)),
        (correlation(1, 0, 0), expected(frame, 1.1)),
        (correlation(2, 0, 0), expected(2.0 * frame, 1.1)),
    ] {
        assert!((found - expected).abs() < 0.04, "{found:.3} for {expected:.3}");
    }
}

#[test]
fn samplings_differ_in_density_and_a_gallery_is_still() {
    assert!(Sampling::Live.options() == PhantomOptions::default());
    let gallery = Sampling::Gallery.options();
    assert_eq!((gallery.frames, gallery.lines, gallery.point_spread.elevation_deg), (111, 192, 0.6));
    let made =
        phantom(PhantomOptions { volumes: 2, frames: 5, lines: 24, samples: 64, speckle: Speckle::None, ..gallery });
    let [first, second] = [0, 1].map(|v| made.volume(v).into_iter().map(|f| f.bytes).collect::<Vec<_>>());
    assert!(first == second, "nothing moves");
}

/// No sample of the outermost frame above the crown meets the head: the vault is inside the fan.
#[test]
fn the_vault_lies_inside_the_fan() {
    let phantom = phantom(PhantomOptions { samples: 128, ..PhantomOptions::default() });
    let probe = phantom.probe(0);
    let clear = (0..probe.samples).flat_map(|sample| (0..128).map(move |line| (sample as f64, f64::from(line))));
    let nearest = clear
        .map(|(sample, line)| probe.to_space(Indices { sample, line, slice: 36.0 }))
        .map(|place| phantom.distance(0, place).unwrap())
        .fold(f64::MAX, f64::min);
    assert!(nearest > 2.0, "{nearest} mm");
}

/// What a sweep without speckle shows is what the truth says, at the time at which each line is fired.
#[test]
fn the_truth_is_what_the_sweep_shows() {
    let made = phantom(PhantomOptions {
        speckle: Speckle::None,
        volumes: 2,
        both_ways: true,
        frames: 13,
        lines: 64,
        ..PhantomOptions::default()
    });
    for volume in 0..2 {
        let mut seen = [0; 2];
        let mut shallow = 0;
        each_sample(&made, volume, |probe, at, grey| {
            let place = probe.to_space(at);
            let label = made.label(volume, place).unwrap();
            let inside = -made.distance(volume, place).unwrap();
            if label == Label::Fluid {
                seen[0] += 1;
                assert!(grey < 45.0, "{grey} in fluid at {place}");
            }
            let skin = [Label::Skin, Label::Hand, Label::Cord].contains(&label);
            if skin && (0.0..1.5).contains(&inside) {
                shallow += 1;
                seen[1] += usize::from(grey > 120.0);
            }
            assert!(inside <= 0.05 || label != Label::Fluid, "{place}: {inside} mm inside");
        });
        // Some skin lies in the shadow of other parts.
        assert!(seen[0] > 10_000 && shallow > 1000, "{seen:?}, {shallow}");
        assert!(seen[1] as f64 > 0.7 * f64::from(shallow), "{} of {shallow} bright", seen[1]);
    }
}

/// The distance is a length: on either side of the skin it changes by as much as the point moves along the normal.
#[test]
fn distances_near_the_skin_are_lengths() {
    let made = phantom(PhantomOptions { still: true, ..small(Body::Head) });
    let probe = made.probe(0);
    let mut slopes = Vec::new();
    for (line, slice) in (0..48).flat_map(|line| (2..7).map(move |slice| (line, slice))) {
        // Down a line to the skin, by bisection.
        let at = |sample: f64| probe.to_space(Indices { sample, line: f64::from(line), slice: f64::from(slice) });
        let distance = |sample: f64| made.distance(0, at(sample)).unwrap();
        let Some(inside) = (0..256).find(|s| distance(f64::from(*s)) < 0.0) else { continue };
        let (mut low, mut high) = (f64::from(inside) - 1.0, f64::from(inside));
        for _ in 0..40 {
            let middle = (low + high) / 2.0;
            if distance(middle) < 0.0 { high = middle } else { low = middle }
        }
        let place = at(high);
        let gradient = [glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z].map(|axis| {
            let reach = 0.2;
            (made.distance(0, place + axis * reach).unwrap() - made.distance(0, place - axis * reach).unwrap())
                / (2.0 * reach)
        });
        slopes.push(glam::DVec3::from(gradient).length());
    }
    slopes.sort_by(f64::total_cmp);
    let [low, high] = [slopes.len() / 10, slopes.len() * 9 / 10].map(|i| slopes[i]);
    // In a fold the nearest skin changes, and with it the slope.
    assert!(slopes.len() > 80 && low > 0.85 && high < 1.2, "{low} to {high} of {}", slopes.len());
}

#[test]
fn the_written_truth_reads_back_and_has_every_label() {
    let folder = Folder::new("truth");
    let path = folder.join("truth.mha");
    let made = phantom(PhantomOptions::default());
    let grid = made.truth_grid(2.0).unwrap();
    made.write_truth(&path, &grid).unwrap();
    assert_eq!(distance_path(&path), folder.join("truth.distance.mha"));
    let read = |path: &std::path::Path| {
        let mut recording = Recording::open(path, None).unwrap();
        let Geometry::Cartesian(read) = recording.geometry(0) else { panic!("is a volume") };
        assert_eq!(read.size, grid.size);
        read_back(&mut recording)
    };
    let (labels, distances) = (read(&path), read(&distance_path(&path)));
    let mut counts = [0; 10];
    for (z, (labels, distances)) in labels.iter().zip(&distances).enumerate() {
        for (i, (label, distance)) in labels.bytes.iter().zip(distances.bytes.chunks_exact(4)).enumerate() {
            counts[usize::from(*label)] += 1;
            let distance = f32::from_le_bytes(distance.try_into().unwrap());
            let is_fetus = !["fluid", "uterus"].contains(&Label::ALL[usize::from(*label)].name());
            assert_eq!(is_fetus, distance <= 0.0, "slice {z}, voxel {i}: label {label}, {distance} mm");
        }
    }
    assert!(counts.iter().all(|n| *n > 20), "{counts:?}");
    assert_eq!(Body::Head.labels().len(), counts.len());
    for (n, label) in Label::ALL.into_iter().enumerate() {
        assert_eq!(label as usize, n);
    }

    let ball = phantom(small(Body::Sphere));
    let error = ball.truth_grid(2.0).unwrap_err().to_string();
    assert!(error.lines().count() == 1 && error.contains("only the head"), "{error}");
    for spacing in [0.0, -1.0, f64::NAN, 1e-4] {
        assert!(made.truth_grid(spacing).unwrap_err().to_string().contains("truth_spacing"), "{spacing}");
    }
    assert!(made.write_truth(&folder.join("truth.nrrd"), &grid).is_err());

    // The same as a segmentation.
    let path = folder.join("named.seg.nrrd");
    made.write_truth(&path, &grid).unwrap();
    assert_eq!(distance_path(&path), folder.join("named.distance.mha"));
    let named = read(&path);
    assert!(named.iter().zip(&labels).all(|(a, b)| a.bytes == b.bytes) && named.len() == labels.len());
}

/// Fluid between the near wall and the fetus, where they are nearest.
#[test]
fn the_gap_is_the_fluid_between_the_wall_and_the_fetus() {
    for gap in [13.0, 5.0, 2.0] {
        let head = phantom(PhantomOptions { gap, still: true, ..small(Body::Head) });
        let face = head.probe(0).array_radius();
        // The wall's inner face, and the first of the fetus below it, by lines along the depth.
        let (mut walls, mut skins) = (Vec::new(), Vec::new());
        for (x, z) in (-32..=32).flat_map(|x| (-32..=32).map(move |z| (1.25 * f64::from(x), 1.25 * f64::from(z)))) {
            let at = |depth: f64| DVec3::new(x, face + depth, z);
            let mut labels =
                (6..240).map(|n| 0.25 * f64::from(n)).map(|depth| (at(depth), head.label(0, at(depth)).unwrap()));
            walls.extend(labels.find(|(_, label)| *label != Label::Uterus).map(|(place, _)| place));
            skins.extend(labels.find(|(_, label)| *label != Label::Fluid).map(|(place, _)| place));
        }
        let of = |skin: &DVec3| walls.iter().map(|wall| wall.distance(*skin)).fold(f64::INFINITY, f64::min);
        let least = skins.iter().map(of).fold(f64::INFINITY, f64::min);
        println!("{gap} {least}");
    }
}

/// Speckle of clutter adds to what is dark, and hardly to what is bright.
#[test]
fn clutter_lifts_fluid_to_its_level() {
    let of = |clutter_db| {
        let mean = PhantomOptions { clutter_db, speckle: Speckle::None, still: true, ..small(Body::Head) };
        let head = phantom(mean);
        let [mut fluid, mut tissue] = [(0.0, 0.0); 2];
        each_sample(&head, 0, |probe, at, grey| {
            let of = match head.label(0, probe.to_space(at)).unwrap() {
                Label::Fluid => &mut fluid,
                Label::Uterus => &mut tissue,
                _ => return,
            };
            *of = (of.0 + grey, of.1 + 1.0);
        });
        [fluid, tissue].map(|(sum, count)| (sum / count / 255.0 - 1.0) * DYNAMIC_RANGE)
    };
    let (none, some) = (of(None), of(Some(-35.0)));
    assert!(none[0] < -43.0 && (some[0] + 35.0).abs() < 1.0, "{none:?} {some:?}");
    assert!((some[1] - none[1]).abs() < 1.5, "{none:?} {some:?}");
}
