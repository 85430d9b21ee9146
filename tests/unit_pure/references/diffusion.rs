//! Perona and Malik's diffusion: explicit steps by hand, and semi-implicit ones put back into the equation that they solve.

use super::*;
use echolume::low_level::passes::Slot;
use echolume::low_level::reference;
use echolume::low_level::scene::PeronaMalik;

const SCHEMES: [&str; 2] = ["quotient", "exponential"];

fn explicit(conductance: &str, more: &str) -> String {
    format!("perona_malik = {{ conductance = '{conductance}', {more} }}")
}

fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-12
}

/// Differences of 0.1 and 0.3 at an edge of 0.1: 1/2 and 1/10, or exp(-1) and exp(-9).
#[test]
fn an_explicit_step_by_hand() {
    let source = rows([[0.0, 0.1, 0.4]]);
    for (name, near, far) in [("quotient", 0.5, 0.1), ("exponential", (-1.0f64).exp(), (-9.0f64).exp())] {
        let (near, far) = (0.2 * near * 0.1, 0.2 * far * 0.3);
        let expected = rows([[near, 0.1 - near + far, 0.4 - far]]);
        let scene = slices([3, 1], &explicit(name, "edge = 0.1, step = 0.2"));
        same(&filtered(&scene, "perona_malik_slice", &source), &expected, name);
        let column = Texels { size: [1, 3, 1], ..source.clone() };
        let scene = slices([1, 3], &explicit(name, "edge = 0.1, step = 0.2"));
        same(&filtered(&scene, "perona_malik_slice", &column), &Texels { size: [1, 3, 1], ..expected }, name);
    }
}

/// What is left of a checkerboard after some explicit steps, where the border is too far away to be felt: of the difference of two neighbours, as a factor of
/// the first one.
fn left_of_a_checkerboard(lambda: f64, edge: f64, steps: usize) -> f64 {
    let mut now = plane([40, 40], |x, y| if (x + y) % 2 == 0 { 0.75 } else { 0.25 });
    let scene = slices([40, 40], &explicit("quotient", &format!("edge = {edge:?}, step = {lambda:?}")));
    for _ in 0..steps {
        now = filtered(&scene, "perona_malik_slice", &now);
    }
    (now.one(20, 20, 0) - now.one(21, 20, 0)) / 0.5
}

/// The explicit scheme multiplies a checkerboard, its highest frequency, by 1 - 8 lambda c for a conductance c. A step of 1/4 is the limit of its
/// stability and damps nothing of it; the default of 1/5 leaves 3/5 a step; above 1/4 it would grow, and is refused.
#[test]
fn a_checkerboard_turns_over_at_the_limit_and_fades_below_it() {
    for steps in [1, 2, 5, 16] {
        let left = |lambda: f64| left_of_a_checkerboard(lambda, f64::INFINITY, steps);
        let power = |factor: f64| factor.powi(steps as i32);
        for (lambda, factor) in [(0.25, -1.0), (0.2, -0.6), (0.125, 0.0), (0.1, 0.2)] {
            assert!(is_near(left(lambda), power(factor)), "{steps} steps of {lambda}: {}", left(lambda));
        }
    }
    assert_eq!(PeronaMalik::default().step, 0.2, "the default damps it");
    // An edge of the checkerboard's own height conducts half: the largest step then takes it away at once.
    assert!(is_near(left_of_a_checkerboard(0.25, 0.5, 1), 0.0));
    // A number beside the limit grows: (1 - 8 lambda)^16 is 1.6 at a hundredth more.
    for (filters, step) in [("slices", 0.2501), ("distance", 0.3), ("post", 1.0)] {
        let settings = scenes::settings(&format!("{filters}.perona_malik = {{ step = {step} }}"));
        let refused = settings.check().expect_err("unstable").to_string();
        assert!(refused.contains(filters) && refused.contains("0.25") && refused.contains("aos"), "{refused}");
    }
    assert!(scenes::settings("slices.perona_malik = { step = 0.25 }").check().is_ok());
}

/// Diffusion over the time 4 in some steps.
fn diffused(source: &Texels, scheme: &str, steps: u32) -> Texels {
    let [width, height, _] = source.size;
    let filter = format!("scheme = '{scheme}', edge = 0.1, step = {:?}, repeat = {steps}", 4.0 / f64::from(steps));
    let scene = scene([width, height, 1], &format!("mode = 'mip'\nslices = {{ {} }}", explicit("quotient", &filter)));
    reference::render(&scene, std::slice::from_ref(source)).remove(&Slot::Volume).expect("a volume")
}

/// The orders of both semi-implicit schemes on smooth data, as docs/numerics.md states them. They are 1 and 2 in the limit. At steps that are worth
/// taking the error of a step is no single power of it: Richardson's extrapolation of AOS gains 1.1 to 1.7.
#[test]
fn the_orders_of_aos_on_smooth_data_are_those_that_are_stated() {
    let wave = |n: usize, pixels: f64| (std::f64::consts::TAU * n as f64 / pixels).sin();
    let source = plane([32, 28], |x, y| 0.5 + 0.25 * wave(x, 21.0) * wave(y + 5, 26.0) + 0.15 * wave(x + 2 * y, 33.0));
    let rmse = |a: &Texels, b: &Texels| {
        let squares = a.values.iter().zip(&b.values).map(|(a, b)| (a - b).powi(2));
        (squares.sum::<f64>() / a.values.len() as f64).sqrt()
    };
    let fine = diffused(&source, "aos-richardson", 128);
    assert!(rmse(&source, &fine) > 0.02, "the filter does something");
    // Another scheme comes to the same, up to its own error of the first order.
    assert!(rmse(&diffused(&source, "explicit", 200), &fine) < 4e-4);
    // Steps of 4, 2, 1, 1/2 and 1/4.
    for (scheme, stated) in [("aos", [0.64, 0.78, 0.88, 0.94]), ("aos-richardson", [1.14, 1.34, 1.51, 1.67])] {
        let errors = [1, 2, 4, 8, 16].map(|n| rmse(&diffused(&source, scheme, n), &fine));
        let orders: Vec<f64> = errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
        println!("{scheme}: {errors:?}, orders {orders:.2?}");
        let is_as_stated = |(order, stated): (&f64, f64)| (order - stated).abs() < 0.05;
        assert!(orders.iter().zip(stated).all(is_as_stated), "{scheme}: {orders:.2?}, stated {stated:?}");
    }
}

/// Computes every pixel separately from its neighbours; the reference goes by pairs.
fn step(source: &Texels, lambda: f64, conducts: impl Fn(f64) -> f64) -> Texels {
    plane([source.size[0], source.size[1]], |x, y| {
        let here = source.one(x, y, 0);
        let beside = window(source.size, x, y, 1).filter(|(i, j)| i.abs_diff(x) + j.abs_diff(y) == 1);
        let flows = beside.map(|(i, j)| source.one(i, j, 0) - here).filter(|g| g.abs() < 1e30);
        if here == MISS { here } else { here + lambda * flows.map(|g| g * conducts(g)).sum::<f64>() }
    })
}

#[test]
fn an_explicit_step_moves_each_pixel_towards_its_four_neighbours() {
    let source = noise([8, 7], 3);
    let scene = slices([8, 7], &explicit("quotient", "edge = 0.3, step = 0.25"));
    let got = filtered(&scene, "perona_malik_slice", &source);
    same(&got, &step(&source, 0.25, |g| 0.09 / (0.09 + g * g)), "quotient");
    assert!(is_near(got.values.iter().sum(), source.values.iter().sum()), "nothing flows across the border");
    let scene = slices([8, 7], &explicit("exponential", "edge = 0.3, step = 0.1"));
    same(
        &filtered(&scene, "perona_malik_slice", &source),
        &step(&source, 0.1, |g| (-g * g / 0.09).exp()),
        "exponential",
    );
    let scene = slices([8, 7], &explicit("quotient", "edge = inf, step = 0.25"));
    same(&filtered(&scene, "perona_malik_slice", &source), &step(&source, 0.25, |_| 1.0), "heat");
    // Distances: nothing flows to or from a miss.
    let source = holed([8, 7], 3);
    let scene = distances([8, 7], &explicit("quotient", "edge = 0.5, step = 0.2"));
    same(
        &filtered(&scene, "perona_malik_distance", &source),
        &step(&source, 0.2, |g| 0.25 / (0.25 + g * g)),
        "distances",
    );
    // Diffusion would carry a miss, which is far away, to every adjacent hit.
    let scene = distances([8, 7], &explicit("quotient", "edge = inf, step = 0.2"));
    same(&filtered(&scene, "perona_malik_distance", &source), &step(&source, 0.2, |_| 1.0), "heat of distances");
}

/// Differences of 0.1, 0.2 and 0.2 make a root mean square of sqrt(0.03): at that edge a half flows. Alpha flows with them and does
/// not count.
#[test]
fn the_channels_of_a_picture_flow_together() {
    let source = Texels { size: [2, 1, 1], channels: 4, values: vec![0.1, 0.5, 0.3, 1.0, 0.2, 0.3, 0.5, 0.0] };
    let scene = picture([2, 1], &explicit("quotient", &format!("edge = {}, step = 0.25", 0.03f64.sqrt())));
    let got = filtered(&scene, "perona_malik_picture", &source);
    let expected = vec![0.1125, 0.475, 0.325, 0.875, 0.1875, 0.325, 0.475, 0.125];
    same(&got, &Texels { values: expected, ..source }, "a picture");
}

/// Settings refuse none of these: the passes are not needed then, and the formula still holds.
#[test]
fn an_edge_of_0_keeps_everything_and_equal_neighbours_too() {
    let source = rows([[0.25, 0.25, 0.5], [0.25, 0.75, 0.5]]);
    for conductance in SCHEMES {
        let scene = slices([3, 2], &explicit(conductance, "edge = 0.0"));
        assert!(!pass("perona_malik_slice").is_needed(&scene));
        same(&filtered(&scene, "perona_malik_slice", &source), &source, conductance);
    }
}

/// The result of the four dispatches of a step: rows, and the target.
fn aos(scene: &Scene, name: &str, source: &Texels) -> (Texels, Texels) {
    let mut held = Arrays::default();
    held.insert("source", source.clone());
    for iteration in 0..4 {
        let args = DispatchArgs { iteration, ..DispatchArgs::default() };
        let mut writes = Arrays::default();
        for bind in pass(name).writes(scene, &args) {
            let channels = if bind.name == "shares" { 1 } else { source.channels };
            writes.insert(bind.name, Texels::untouched(source.size, channels));
        }
        pass(name).reference(scene, &args, &held, &mut writes);
        for (written, texels) in writes.iter() {
            assert!(texels.values.iter().all(|v| v.is_finite()), "{written} has holes");
            held.insert(if iteration == 1 && written == "target" { "rows" } else { written }, texels.clone());
        }
        if iteration % 2 == 0 {
            assert!(held.get("shares").values.iter().all(|s| (0.0..1.0).contains(s)), "shares of a whole");
        }
    }
    (held.get("rows").clone(), held.get("target").clone())
}

/// (I - 2 tau A) u along one axis, A by the differences of `source`.
fn applied(u: &Texels, source: &Texels, axis: usize, tau: f64, conducts: impl Fn(&[f64], &[f64]) -> f64) -> Texels {
    Texels::from_fn(u.size, u.channels, |at, c| {
        let mut sum = u.get(at)[c];
        for step in [-1i64, 1] {
            let mut beside = at;
            beside[axis] = (at[axis] as i64 + step).clamp(0, u.size[axis] as i64 - 1) as usize;
            sum -= 2.0 * tau * conducts(source.get(at), source.get(beside)) * (u.get(beside)[c] - u.get(at)[c]);
        }
        sum
    })
}

#[test]
fn a_semi_implicit_step_fulfils_its_equation_along_both_axes() {
    for size in [[7, 5], [4, 6], [1, 6], [6, 1], [2, 3], [1, 1]] {
        let source = noise(size, size[0] * 10 + size[1]);
        for tau in [0.25, 8.0] {
            for (name, conducts) in [
                ("quotient", (|g| 1.0 / (1.0 + g * g / 0.09)) as fn(f64) -> f64),
                ("exponential", |g| (-g * g / 0.09).exp()),
            ] {
                let scene = slices(size, &explicit(name, &format!("scheme = 'aos', edge = 0.3, step = {tau}")));
                let (rows, target) = aos(&scene, "aos_slice", &source);
                // The target is the mean of both axes' solutions.
                let columns =
                    Texels::from_fn(source.size, 1, |[x, y, _], _| 2.0 * target.one(x, y, 0) - rows.one(x, y, 0));
                for (axis, solution) in [&rows, &columns].into_iter().enumerate() {
                    let back = applied(solution, &source, axis, tau, |a, b| conducts(a[0] - b[0]));
                    same(&back, &source, &format!("{name}, tau {tau}, {size:?}, axis {axis}"));
                }
            }
        }
    }
}

#[test]
fn a_semi_implicit_step_of_a_picture_goes_by_all_its_colours() {
    let source = colours([5, 4], 8);
    let scene = picture([5, 4], "perona_malik = { scheme = 'aos', edge = 0.4, step = 3.0 }");
    let (rows, target) = aos(&scene, "aos_picture", &source);
    let columns = Texels::from_fn(source.size, 4, |at, c| 2.0 * target.get(at)[c] - rows.get(at)[c]);
    for (axis, solution) in [&rows, &columns].into_iter().enumerate() {
        let conducts = |a: &[f64], b: &[f64]| {
            let mean = (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>() / 3.0;
            1.0 / (1.0 + mean / 0.16)
        };
        same(&applied(solution, &source, axis, 3.0, conducts), &source, "a picture");
    }
}

#[test]
fn the_last_sweep_of_a_slice_goes_where_it_belongs() {
    let scene = slices([3, 2], "perona_malik = { scheme = 'aos', repeat = 1 }");
    let mut reads = Arrays::default();
    reads.insert("shares", plane([3, 2], |_, _| 0.0));
    reads.insert("forward", plane([3, 2], |x, _| x as f64));
    reads.insert("rows", plane([3, 2], |_, y| y as f64));
    for (depth, z) in [(3, 2), (1, 0)] {
        let mut writes = Arrays::default();
        writes.insert("target", Texels::untouched([3, 2, depth], 1));
        pass("aos_slice").reference(
            &scene,
            &DispatchArgs { iteration: 3, slice: 2, ..DispatchArgs::default() },
            &reads,
            &mut writes,
        );
        let target = writes.get("target");
        for (x, y) in window([3, 2, 1], 0, 0, 3) {
            assert_eq!(target.one(x, y, z), (x + y) as f64 / 2.0);
            assert!((0..z).all(|other| target.one(x, y, other).is_nan()));
        }
    }
}
