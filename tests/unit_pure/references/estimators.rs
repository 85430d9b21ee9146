//! The local estimators by hand, as filters of slices and as centres of the enhanced sigma filter.

use super::*;

fn estimated(settings: &str, source: &Texels, at: [usize; 2]) -> f64 {
    let scene = slices([source.size[0], source.size[1]], settings);
    filtered(&scene, "estimator_slice", source).one(at[0], at[1], 0)
}

#[track_caller]
fn is(got: f64, expected: f64) {
    assert!((got - expected).abs() < 1e-12, "{got} in place of {expected}");
}

/// Four direct neighbours of 0.4 and four diagonal ones of 0.7 around 0.2.
fn star() -> Texels {
    rows([[0.7, 0.4, 0.7], [0.4, 0.2, 0.4], [0.7, 0.4, 0.7]])
}

#[test]
fn a_median_estimate_is_the_fifth_of_nine() {
    is(estimated("estimator = 'median'", &star(), [1, 1]), 0.4);
    let grid = rows([[0.1, 0.9, 0.3], [0.8, 0.6, 0.7], [0.2, 0.5, 0.4]]);
    is(estimated("estimator = 'median'", &grid, [1, 1]), 0.5);
    // The corner's own nine: 0.1 four times, 0.9 and 0.8 twice each, 0.6.
    is(estimated("estimator = 'median'", &grid, [0, 0]), 0.6);
}

/// At an edge constant of 0.1 a difference of 0.2 conducts a fifth, one of 0.3 a tenth.
#[test]
fn a_perona_malik_estimate_is_a_step_of_a_fifth_towards_four_neighbours() {
    let at = |edge: &str, source: &Texels| {
        estimated(&format!("estimator = 'perona-malik', estimator_edge = {edge}"), source, [1, 1])
    };
    is(at("0.1", &star()), 0.2 + 0.2 * 4.0 * 0.2 / 5.0);
    let uneven = rows([[9.0, 0.4, 9.0], [0.5, 0.2, 0.2], [9.0, 0.2, 9.0]]);
    is(at("0.1", &uneven), 0.2 + 0.2 * (0.2 / 5.0 + 0.3 / 10.0));
    is(at("0.2", &star()), 0.2 + 0.2 * 4.0 * 0.2 / 2.0);
    is(at("inf", &star()), 0.2 + 0.2 * 4.0 * 0.2);
    // An edge of 0 keeps everything, also between equal neighbours.
    is(at("0.0", &uneven), 0.2);
    // Each of the four alone.
    for (x, y) in [(1, 0), (0, 1), (2, 1), (1, 2)] {
        let one = plane([3, 3], |i, j| if (i, j) == (x, y) { 0.4 } else { 0.2 });
        is(at("0.2", &one), 0.2 + 0.2 * 0.2 / 2.0);
    }
}

/// Half the pixel, half its eight neighbours: (20 x 0.4 + 8 x 0.7) / 28; differences below half a level of 255 count as half a level.
#[test]
fn a_gradient_inverse_estimate_weighs_by_likeness() {
    let at = |source: &Texels| estimated("estimator = 'gradient-inverse'", source, [1, 1]);
    is(at(&star()), 0.1 + 0.5 * 13.6 / 28.0);
    let odd = rows([[0.5, 0.5, 0.5], [0.5, 0.5, 0.5], [0.5, 0.5, 0.75]]);
    // Seven alike weigh 510 each, one a quarter away 4.
    is(at(&odd), 0.25 + 0.5 * (7.0 * 510.0 * 0.5 + 4.0 * 0.75) / (7.0 * 510.0 + 4.0));
    is(at(&plane([3, 3], |_, _| 0.3)), 0.3);
}

/// Nagao and Matsuyama's nine masks: where only one of them is flat, the pixel takes its value.
const MASKS: [[&str; 5]; 9] = [
    [".....", ".xxx.", ".xxx.", ".xxx.", "....."],
    [".xxx.", ".xxx.", "..x..", ".....", "....."],
    [".....", ".....", "..x..", ".xxx.", ".xxx."],
    [".....", "xx...", "xxx..", "xx...", "....."],
    [".....", "...xx", "..xxx", "...xx", "....."],
    ["xx...", "xxx..", ".xx..", ".....", "....."],
    ["...xx", "..xxx", "..xx.", ".....", "....."],
    [".....", ".....", ".xx..", "xxx..", "xx..."],
    [".....", ".....", "..xx.", "..xxx", "...xx"],
];

#[test]
fn a_nagao_matsuyama_estimate_is_the_mean_of_the_flattest_of_nine_masks() {
    for (n, mask) in MASKS.iter().enumerate() {
        let marked = |x: usize, y: usize| mask[y].as_bytes()[x] == b'x';
        let rough = noise([5, 5], 70 + n);
        // Nearly flat, so that no other mask is flatter, with a mean that no pixel has.
        let source =
            plane(
                [5, 5],
                |x, y| if marked(x, y) { 0.5 + 0.001 * rough.one(x, y, 0) } else { 20.0 * rough.one(x, y, 0) },
            );
        let within: Vec<f64> =
            window(source.size, 2, 2, 2).filter(|(x, y)| marked(*x, *y)).map(|(x, y)| source.one(x, y, 0)).collect();
        assert_eq!(within.len(), if n == 0 { 9 } else { 7 });
        is(estimated("estimator = 'nagao-matsuyama'", &source, [2, 2]), mean(&within));
    }
}

/// Variances are compared by pixel: a square of nine whose squares sum to more may still vary less than a mask of seven.
#[test]
fn the_flattest_mask_is_the_one_of_least_mean_square() {
    // Nine at 1, 0 and -1: 6 by 9. The mask to the right of them: 5.1 by 7, about another mean.
    let source = plane([5, 5], |x, y| match (x, y) {
        (1..=3, 1..=3) => y as f64 - 2.0,
        (4, 1..=3) => y as f64 - 1.2,
        _ => 50.0 * (1.0 + hash(y * 5 + x)),
    });
    is(estimated("estimator = 'nagao-matsuyama'", &source, [2, 2]), 0.0);
    // A slope along x: 24/49 in the masks to its sides, against 4/7 above and 6/9 in the square. That towards +x is the first.
    let slope = plane([7, 7], |x, _| x as f64);
    is(estimated("estimator = 'nagao-matsuyama'", &slope, [3, 3]), 3.0 + 9.0 / 7.0);
    // Along y it is that towards -y.
    let slope = plane([7, 7], |_, y| y as f64);
    is(estimated("estimator = 'nagao-matsuyama'", &slope, [3, 3]), 3.0 - 9.0 / 7.0);
    // A bright column two pixels away: whichever flat mask is taken, its mean is 0.25.
    let wall = plane([7, 7], |x, _| if x == 5 { 9.0 } else { 0.25 });
    is(estimated("estimator = 'nagao-matsuyama'", &wall, [3, 3]), 0.25);
}

#[test]
fn a_difference_that_f32_cannot_divide_by_is_none() {
    use echolume::low_level::passes::Value;
    let edge = |edge: &str| {
        let scene = slices([4, 4], &format!("estimator = 'perona-malik', estimator_edge = {edge}"));
        let params = (pass("estimator_slice").params)(&scene, &DispatchArgs { slice: 3, ..DispatchArgs::default() });
        let [("edge", Value::F32(edge)), ("least", Value::F32(least)), ("slice", Value::I32(3))] = params.0[..] else {
            panic!("{params:?}")
        };
        assert_eq!(least, (1.0 / 510.0) as f32);
        edge
    };
    assert_eq!([edge("0.0"), edge("0.125"), edge("inf")], [1e-30, 0.125, 1e30]);
}
