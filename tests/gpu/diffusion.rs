//! Perona-Malik: against another implementation's numbers, against dense solves, at and beyond its limits.

use crate::common::gpu::*;
use crate::filters::{by_reference, largest_difference, noise, on_device, plane, texels};
use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::passes::{Slot, Texels, by_name};
use echolume::low_level::scene::{DeviceFacts, Scene};

fn csv(name: &str) -> Texels {
    let text = std::fs::read_to_string(data(&format!("perona-malik/{name}.csv"))).expect("numbers");
    let rows: Vec<Vec<f64>> =
        text.lines().map(|l| l.split(',').map(|v| v.parse().expect("a number")).collect()).collect();
    texels([rows[0].len(), rows.len()], |x, y| rows[y][x])
}

#[test]
fn explicit_steps_are_those_of_another_implementation() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let input = csv("input");
    let mut largest = [0.0f64; 2];
    for conductance in ["quotient", "exponential"] {
        for steps in [1, 20] {
            let filter = format!("perona_malik = {{ edge = 0.2, conductance = '{conductance}', repeat = {steps} }}");
            let scene = plane([24, 20], &filter);
            let expected = csv(&format!("{conductance}-{steps}"));
            assert!(largest_difference(&expected, &input) > 0.05, "the numbers say something");
            let f64s = largest_difference(&by_reference(&scene, "perona_malik_slice", &input), &expected);
            let f32s = largest_difference(&on_device(&mut single, &scene, "perona_malik_slice", &input), &expected);
            println!("{conductance}, {steps} steps: reference {f64s:.1e}, device {f32s:.1e} from the stored numbers");
            // Both sides round to f32 (6e-8 at 1) a few times a step, and diffusion does not make it more.
            assert!(f64s < 3e-7 && f32s < 5e-7, "{filter}: {f64s}, {f32s}");
            largest = [largest[0].max(f64s), largest[1].max(f32s)];
        }
    }
    device.figure("medpy-reference", &format!("{:.0e}", largest[0]));
    device.figure("medpy", &format!("{:.0e}", largest[1]));
}

/// u of M u = f by Gaussian elimination with partial pivoting.
fn dense(mut m: Vec<Vec<f64>>, mut f: Vec<f64>) -> Vec<f64> {
    let n = f.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|a, b| m[*a][k].abs().total_cmp(&m[*b][k].abs())).expect("rows");
        m.swap(k, pivot);
        f.swap(k, pivot);
        let (above, below) = m.split_at_mut(k + 1);
        for (i, row) in below.iter_mut().enumerate() {
            let share = row[k] / above[k][k];
            row[k..].iter_mut().zip(&above[k][k..]).for_each(|(v, p)| *v -= share * p);
            f[k + 1 + i] -= share * f[k];
        }
    }
    for k in (0..n).rev() {
        f[k] = (f[k] - (k + 1..n).map(|j| m[k][j] * f[j]).sum::<f64>()) / m[k][k];
    }
    f
}

/// u' = 1/2 ((I - 2 tau A_x)^-1 + (I - 2 tau A_y)^-1) u, each matrix over the whole picture.
fn aos_step(u: &Texels, tau: f64, conductance: impl Fn(f64) -> f64) -> Texels {
    let [width, height, _] = u.size;
    let mut mean = vec![0.0; width * height];
    for (dx, dy) in [(1, 0), (0, 1)] {
        let mut m = vec![vec![0.0; width * height]; width * height];
        for y in 0..height {
            for x in 0..width {
                let a = y * width + x;
                m[a][a] += 1.0;
                if x + dx < width && y + dy < height {
                    let b = a + dy * width + dx;
                    let w = 2.0 * tau * conductance((u.values[a] - u.values[b]).abs());
                    m[a][a] += w;
                    m[b][b] += w;
                    m[a][b] -= w;
                    m[b][a] -= w;
                }
            }
        }
        dense(m, u.values.clone()).into_iter().zip(&mut mean).for_each(|(v, mean)| *mean += 0.5 * v);
    }
    Texels { values: mean, ..u.clone() }
}

/// The scene with each of the solvers of AOS: an invocation a row, and a workgroup a row in the memory that every device has.
fn solvers(scene: &Scene) -> [Scene; 2] {
    [0, 16 << 10].map(|shared_memory| Scene { device: DeviceFacts { shared_memory, ..scene.device }, ..scene.clone() })
}

#[test]
fn aos_equals_dense_solves() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let quotient = |k: f64| move |g: f64| 1.0 / (1.0 + (g / k).powi(2));
    let mut largest = 0.0f64;
    for (size, seed) in [([13, 17], 1), ([1, 9], 2), ([8, 1], 3), ([1, 1], 4), ([129, 1], 5), ([1, 300], 6)] {
        let source = noise(size, seed);
        for tau in [0.1, 3.0, 1e3, 1e6] {
            let scene =
                plane(size, &format!("perona_malik = {{ scheme = 'aos', edge = 0.3, step = {tau:e}, repeat = 2 }}"));
            let once = aos_step(&source, tau, quotient(0.3));
            let expected = aos_step(&once, tau, quotient(0.3));
            for scene in solvers(&scene) {
                let f64s = largest_difference(&by_reference(&scene, "aos_slice", &source), &expected);
                let f32s = largest_difference(&on_device(&mut single, &scene, "aos_slice", &source), &expected);
                let memory = scene.device.shared_memory;
                println!("{size:?}, tau {tau}, {memory} B: reference {f64s:.1e}, device {f32s:.1e} from dense solves");
                // At 1e6 the solves themselves keep 9 digits of 16. On the device every term is positive: an ulp a pixel.
                let ulps = 2e-6f64.max(6e-8 * size[0].max(size[1]) as f64);
                assert!(f64s < 1e-7 && f32s < ulps, "tau {tau}, {memory} B: {f64s}, {f32s}");
                largest = largest.max(f32s);
            }
        }
    }
    device.figure("aos-solves", &format!("{largest:.0e}"));
}

/// The longest rows that workgroups solve in 16 KiB, in their memory and beyond it, and conductances from 0 to 1 in one row.
#[test]
fn both_solvers_of_aos_agree_on_long_and_stiff_rows() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    for size in [[1024, 3], [2, 1000], [640, 130]] {
        // Steps of 0, of noise, and of 1 next to each other.
        let mut random = Noise(size[0] as u64);
        let values: Vec<f64> = (0..size[0] * size[1])
            .map(|i| {
                if i % 37 < 12 {
                    0.5
                } else if i % 37 < 24 {
                    random.next()
                } else {
                    (i % 2) as f64
                }
            })
            .collect();
        let source = texels(size, |x, y| values[y * size[0] + x]);
        for (edge, tau) in [("0.02", "5.0"), ("0.3", "1e4"), ("1e-30", "1e9"), ("inf", "1e9"), ("0.001", "1e9")] {
            for conductance in ["quotient", "exponential"] {
                let filter = format!(
                    "perona_malik = {{ scheme = 'aos', conductance = '{conductance}', edge = {edge}, step = {tau}, repeat = 1 }}"
                );
                let [one, many] =
                    solvers(&plane(size, &filter)).map(|scene| on_device(&mut single, &scene, "aos_slice", &source));
                let off = largest_difference(&one, &many);
                println!("{size:?}, {filter}: {off:.1e}");
                assert!(many.values.iter().all(|v| *v > -1e-5 && *v < 1.0 + 1e-5), "{size:?}, {filter}: the range");
                // An ulp a pixel of either, as in the pass's tolerance.
                assert!(off < 3e-5, "{size:?}, {filter}: {off}");
            }
        }
    }
}

#[test]
fn a_renderer_uses_the_solver_of_its_device() {
    let device = Device::new();
    let filters = "slices = { format = 'r32f', perona_malik = { scheme = 'aos-richardson', edge = 0.2, step = 5.0, repeat = 2 } }\n\
                   post = { perona_malik = { scheme = 'aos', step = 5.0, repeat = 2 } }\nmode = 'mip'\npicture.size = [40, 30]";
    let scene = scene(cartesian([150, 33, 3]), FLOATS, filters);
    let frames = body_frames(&scene, |p| 0.5 + 0.5 * (p.x * 1.7).sin() * (p.y * 2.3 + p.z).cos());
    let [one, many] = solvers(&scene).map(|scene| {
        let mut renderer = rendered(&device, scene, &frames);
        let picture = renderer.picture().expect("picture");
        let steps = renderer.plan().steps.iter().filter(|s| s.pass.name.starts_with("aos")).count();
        (steps, renderer.read(Slot::Volume).expect("read").expect("the volume"), picture)
    });
    // 24 and 8 dispatches, or half of them. A GPU always has the memory.
    let software = device.candidate.is_software();
    assert_eq!((one.0, many.0), (if software { 32 } else { 16 }, 16));
    let off = largest_difference(&one.1, &many.1);
    assert!(off < 2e-5, "{off}");
    assert!(difference(&one.2, &many.2).1 <= 1.0);
}

/// A disc of 0.7 and a smaller one of 0.45 on 0.3, with noise of 0.06: 64 x 64.
fn discs() -> Texels {
    let mut random = Noise(31);
    let rough: Vec<f64> = (0..64 * 64).map(|_| (0..12).map(|_| random.next()).sum::<f64>() - 6.0).collect();
    texels([64, 64], |x, y| {
        let disc = |cx: f64, cy: f64, r: f64| (x as f64 - cx).hypot(y as f64 - cy) < r;
        let body = if disc(24.0, 28.0, 15.0) {
            0.7
        } else if disc(48.0, 46.0, 9.0) {
            0.45
        } else {
            0.3
        };
        body + 0.06 * rough[y * 64 + x]
    })
}

/// After `steps` explicit steps of `lambda`, in f64, without the pass: quotient, four neighbours.
fn explicit(source: &Texels, k: f64, lambda: f64, steps: u32) -> Texels {
    let [width, height, _] = source.size;
    let mut u = source.values.clone();
    for _ in 0..steps {
        let mut next = u.clone();
        for a in 0..width * height {
            let neighbours = [(a % width + 1 < width, 1), (a / width + 1 < height, width)];
            for (_, away) in neighbours.into_iter().filter(|n| n.0) {
                let g = u[a + away] - u[a];
                let flow = lambda * g / (1.0 + (g / k).powi(2));
                next[a] += flow;
                next[a + away] -= flow;
            }
        }
        u = next;
    }
    Texels { values: u, ..source.clone() }
}

fn rmse(a: &Texels, b: &Texels) -> f64 {
    let squares: f64 = a.values.iter().zip(&b.values).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / a.values.len() as f64).sqrt()
}

#[test]
fn aos_converges_to_the_equation_with_first_order() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let source = discs();
    // T = 2; explicit steps of 1/2000 are sixty times finer than the finest compared, and first order themselves.
    let truth = explicit(&source, 0.1, 0.0005, 4000);
    let errors: Vec<f64> = [0.25, 0.125, 0.0625, 0.03125]
        .map(|tau: f64| {
            let filter = format!("perona_malik = {{ scheme = 'aos', step = {tau}, repeat = {} }}", 2.0 / tau);
            rmse(&on_device(&mut single, &plane([64, 64], &filter), "aos_slice", &source), &truth)
        })
        .to_vec();
    let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    println!("AOS at T = 2, steps 1/4, 1/8, 1/16, 1/32: {errors:.5?}, orders {orders:.2?}");
    assert!((orders[2] - 1.0).abs() < 0.2, "{errors:?}: {orders:?}");
    assert!(errors.windows(2).all(|e| e[1] < e[0]));
}

/// Stable at any step, though not accurate: the step is a dial.
#[test]
fn errors_of_large_aos_steps_over_a_time_of_100() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let source = discs();
    let truth = explicit(&source, 0.1, 0.02, 5000);
    let error = |single: &mut PassRunner, filter: &str, pass| {
        rmse(&on_device(single, &plane([64, 64], filter), pass, &source), &truth)
    };
    let fifth = error(&mut single, "perona_malik = { repeat = 500 }", "perona_malik_slice");
    let mut aos = |step: u32| {
        let filter = format!("perona_malik = {{ scheme = 'aos', step = {step}, repeat = {} }}", 100 / step);
        error(&mut single, &filter, "aos_slice")
    };
    let [one, ten, hundred] = [1, 10, 100].map(&mut aos);
    println!("RMSE at T = 100: explicit 0.2 {fifth:.1e}, AOS 1 {one:.4}, 10 {ten:.4}, 100 {hundred:.4}");
    assert!(fifth < 1e-3 && one < 0.01 && one < ten && ten < hundred, "{fifth}, {one}, {ten}, {hundred}");
    assert!(ten < 0.03 && hundred < 0.1, "{ten}, {hundred}");
    device.figure("aos-step-10", &format!("{ten:.4}"));
    device.figure("aos-step-100", &format!("{hundred:.4}"));
}

fn checkerboard(size: [usize; 2]) -> Texels {
    texels(size, |x, y| ((x + y) % 2) as f64)
}

/// The worst case of the explicit scheme, which noise would hide.
#[test]
fn a_checkerboard_flips_at_a_quarter_and_would_grow_above() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let board = checkerboard([24, 20]);
    // Without edges only the border pixels, with two or three neighbours, damp; their effect moves inwards by a pixel a step.
    for steps in [1usize, 2, 5] {
        let scene = plane([24, 20], &format!("perona_malik = {{ edge = inf, step = 0.25, repeat = {steps} }}"));
        let got = on_device(&mut single, &scene, "perona_malik_slice", &board);
        assert!(got.values.iter().all(|v| (0.0..=1.0).contains(v)), "the range is kept");
        for y in steps..20 - steps {
            for x in steps..24 - steps {
                let flipped = ((x + y + steps) % 2) as f64;
                assert!((got.one(x, y, 0) - flipped).abs() < 1e-6, "{steps} steps at {x}, {y}");
            }
        }
    }
    // The reason of the refusal: beyond the limit the formula overshoots at once, and more at every further step.
    let mut scene = plane([24, 20], "perona_malik = { edge = inf, step = 0.25, repeat = 10 }");
    scene.slice_filters.perona_malik.as_mut().expect("settings").step = 0.26;
    let grown = by_reference(&scene, "perona_malik_slice", &board);
    // Inside, each step multiplies the contrast by 1 - 8 x 0.26.
    let contrast = (grown.one(12, 10, 0) - grown.one(11, 10, 0)).abs();
    assert!((contrast - 1.08f64.powi(10)).abs() < 0.02, "{contrast}");
}

/// Noise, a checkerboard and one bright pixel: what an unstable scheme lets grow first.
fn rough(size: [usize; 2]) -> [(&'static str, Texels); 3] {
    let hot = texels(size, |x, y| f64::from((x, y) == (30, 20)));
    [("noise", noise(size, 6)), ("checkerboard", checkerboard(size)), ("hot", hot)]
}

#[test]
fn aos_keeps_the_range_at_any_step() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let size = [61, 47];
    let sources = rough(size);
    for (name, source) in &sources {
        let low = source.values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = source.values.iter().copied().fold(0.0, f64::max);
        let sum: f64 = source.values.iter().sum();
        for step in ["0.25", "10.0", "1e3", "1e6", "1e9"] {
            for edge in ["1e-30", "0.1", "inf"] {
                let filter = format!("perona_malik = {{ scheme = 'aos', edge = {edge}, step = {step}, repeat = 3 }}");
                for scene in solvers(&plane(size, &filter)) {
                    let got = on_device(&mut single, &scene, "aos_slice", source);
                    // An ulp a pixel of the row, as in the pass's tolerance.
                    let inside = got.values.iter().all(|v| *v >= low - 1e-5 && *v <= high + 1e-5);
                    assert!(inside, "{name}, {filter} leaves {low}..{high}");
                    // Nothing flows across the border: the mean stays.
                    let drift = (got.values.iter().sum::<f64>() - sum).abs() / sum;
                    assert!(drift < 1e-4, "{name}, {filter} drifts by {drift}");
                }
            }
        }
        // Without edges, one huge step is the mean of each row and of each column.
        let filter = "perona_malik = { scheme = 'aos', edge = inf, step = 1e9, repeat = 1 }";
        let got = on_device(&mut single, &plane(size, filter), "aos_slice", source);
        let row = |y: usize| (0..size[0]).map(|x| source.one(x, y, 0)).sum::<f64>() / size[0] as f64;
        let column = |x: usize| (0..size[1]).map(|y| source.one(x, y, 0)).sum::<f64>() / size[1] as f64;
        let means = texels(size, |x, y| 0.5 * (row(y) + column(x)));
        assert!(largest_difference(&got, &means) < 1e-5, "{name}");
    }
}

fn diffusions(edge: &str) -> Vec<(Scene, &'static str, String)> {
    let mut all = Vec::new();
    for (scheme, pass) in [("explicit", "perona_malik_slice"), ("aos", "aos_slice")] {
        for conductance in ["quotient", "exponential"] {
            let of =
                format!("scheme = '{scheme}', conductance = '{conductance}', edge = {edge}, step = 0.25, repeat = 3");
            let filter = format!("perona_malik = {{ {of} }}");
            all.push((plane([19, 23], &filter), pass, filter));
        }
    }
    all
}

#[test]
fn edges_of_0_and_infinity_and_flat_and_hot_pictures() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let size = [19, 23];
    let source = noise(size, 9);
    for (scene, pass, filter) in diffusions("0.0") {
        assert!(!by_name(pass).expect("pass").is_needed(&scene), "{filter} changes nothing");
    }
    for (scene, pass, filter) in diffusions("1e-30") {
        let got = on_device(&mut single, &scene, pass, &source);
        assert!(largest_difference(&got, &source) < 1e-6, "{filter} keeps every difference");
    }
    for (scene, pass, filter) in diffusions("inf") {
        let got = on_device(&mut single, &scene, pass, &source);
        let expected = match pass {
            "aos_slice" => (0..3).fold(source.clone(), |u, _| aos_step(&u, 0.25, |_| 1.0)),
            // The heat equation: k beyond all differences.
            _ => explicit(&source, 1e12, 0.25, 3),
        };
        assert!(largest_difference(&got, &expected) < 1e-6, "{filter} is the heat equation");
    }
    for edge in ["1e-30", "0.1", "inf"] {
        for (scene, pass, filter) in diffusions(edge) {
            for value in [0.0, 0.37, 1.0] {
                let flat = texels(size, |_, _| value);
                let off = largest_difference(&on_device(&mut single, &scene, pass, &flat), &flat);
                assert!(off < 1e-6, "{filter} on a constant {value}: {off}");
            }
            let hot = texels(size, |x, y| f64::from((x, y) == (9, 11)));
            let got = on_device(&mut single, &scene, pass, &hot);
            assert!(got.values.iter().all(|v| (-1e-7..=1.0 + 1e-6).contains(v)), "{filter} on a hot pixel");
            assert!((got.values.iter().sum::<f64>() - 1.0).abs() < 1e-5, "{filter} keeps what there is");
        }
    }
}

/// The equation at T = 2 on the discs, by explicit steps of 1/2000 and 1/1000 extrapolated: their own first-order error would hide a second order.
fn solved(source: &Texels) -> Texels {
    let (fine, coarse) = (explicit(source, 0.1, 0.0005, 4000), explicit(source, 0.1, 0.001, 2000));
    let values = fine.values.iter().zip(&coarse.values).map(|(fine, coarse)| 2.0 * fine - coarse).collect();
    Texels { values, ..source.clone() }
}

#[test]
fn extrapolated_aos_converges_with_second_order_and_rkl1_with_first() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let source = discs();
    let truth = solved(&source);
    for (scheme, pass, steps, order) in [
        ("aos-richardson", "aos_richardson_slice", [0.125, 0.0625, 0.03125], 2.0),
        ("rkl1", "rkl1_slice", [0.5, 0.25, 0.125], 1.0),
    ] {
        let errors: Vec<f64> = steps
            .map(|step: f64| {
                let filter =
                    format!("perona_malik = {{ scheme = '{scheme}', step = {step}, repeat = {} }}", 2.0 / step);
                rmse(&on_device(&mut single, &plane([64, 64], &filter), pass, &source), &truth)
            })
            .to_vec();
        let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
        println!("{scheme} at T = 2, steps {steps:?}: {errors:.6?}, orders {orders:.2?}");
        assert!((orders[1] - order).abs() < 0.3, "{scheme}: {errors:?}: {orders:?}");
    }
}

/// Row: T = 100, where explicit steps are 400. Passes are dispatches over the slice: one for each explicit step and stage of RKL1, four for a step
/// of AOS, twelve for an extrapolated one.
#[test]
fn rkl1_is_nearer_than_aos_over_a_time_of_100_in_as_many_passes() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let source = discs();
    let truth = explicit(&source, 0.1, 0.02, 5000);
    let mut error = |scheme: &str, pass: &str, steps: u32| {
        let filter = format!(
            "perona_malik = {{ scheme = '{scheme}', step = {:?}, repeat = {steps} }}",
            100.0 / f64::from(steps)
        );
        let scene = plane([64, 64], &filter);
        let passes = (by_name(pass).expect("pass").repeat)(&scene);
        let error = rmse(&on_device(&mut single, &scene, pass, &source), &truth);
        println!("T = 100, {scheme} in {steps} steps, {passes} passes: RMSE {error:.5}");
        (passes, error)
    };
    let (_, explicit) = error("explicit", "perona_malik_slice", 400);
    for (steps, most) in [(3, 0.009), (6, 0.0045), (12, 0.002)] {
        let (_, extrapolated) = error("aos-richardson", "aos_richardson_slice", steps);
        assert!(extrapolated < most, "{steps} extrapolated steps: {extrapolated}");
    }
    for steps in [2, 4, 8, 16] {
        let (passes, rkl1) = error("rkl1", "rkl1_slice", steps);
        let (_, aos) = error("aos", "aos_slice", passes.div_ceil(4));
        assert!(passes < 400 && rkl1 < aos, "{steps} steps: {rkl1}, AOS in as many passes {aos}");
        if steps == 4 {
            device.figure("passes-100", &passes.to_string());
            device.figure("aos-100", &format!("{aos:.4}"));
            device.figure("rkl1-100", &format!("{rkl1:.4}"));
        }
    }
    assert!(explicit < 1e-3, "{explicit}");
}

#[test]
fn extrapolated_aos_and_rkl1_are_stable_at_extreme_steps_and_edges() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let size = [61, 47];
    let sources = rough(size);
    for (scheme, pass, steps) in [
        ("aos-richardson", "aos_richardson_slice", ["0.25", "10.0", "1e3", "1e9"]),
        ("rkl1", "rkl1_slice", ["0.25", "5.0", "50.0", "200.0"]),
    ] {
        for edge in ["1e-30", "0.1", "inf"] {
            for step in steps {
                let filter =
                    format!("perona_malik = {{ scheme = '{scheme}', edge = {edge}, step = {step}, repeat = 2 }}");
                let scene = plane(size, &filter);
                for (name, source) in &sources {
                    let got = on_device(&mut single, &scene, pass, source);
                    let mean = |t: &Texels| t.values.iter().sum::<f64>() / t.values.len() as f64;
                    let spread = |t: &Texels| t.values.iter().map(|v| (v - mean(t)).powi(2)).sum::<f64>().sqrt();
                    assert!(got.values.iter().all(|v| v.is_finite()), "{name}, {filter}");
                    assert!((mean(&got) - mean(source)).abs() < 1e-4, "{name}, {filter} drifts");
                    assert!(spread(&got) < spread(source) * (1.0 + 1e-4) + 1e-3, "{name}, {filter} grows");
                }
                let flat = texels(size, |_, _| 0.37);
                let off = largest_difference(&on_device(&mut single, &scene, pass, &flat), &flat);
                assert!(off < 2e-5, "{filter} on a constant: {off}");
            }
        }
        // The formula: the reference solves the same.
        let filter =
            format!("perona_malik = {{ scheme = '{scheme}', conductance = 'exponential', step = 7.0, repeat = 2 }}");
        let (scene, source) = (plane(size, &filter), noise(size, 9));
        let off =
            largest_difference(&on_device(&mut single, &scene, pass, &source), &by_reference(&scene, pass, &source));
        assert!(off < 1e-4, "{filter}: {off}");
    }
}
