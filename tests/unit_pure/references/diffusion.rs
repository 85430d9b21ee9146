//! Perona and Malik's diffusion: explicit steps by hand, and semi-implicit ones put back into the equation that they solve.

use super::*;

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
