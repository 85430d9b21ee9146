//! Richardson's extrapolation of pictures against functions whose limit is known.

use echolume::low_level::error_report::richardson::{Extrapolated, extrapolated};
use echolume::low_level::passes::Texels;

fn rms(a: &Texels, b: &Texels) -> f64 {
    let squares: f64 = a.values.iter().zip(&b.values).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / a.values.len() as f64).sqrt()
}

/// Pictures limit + K c^p + M c^(p + 1), with coefficients that differ from value to value, in sign too.
fn picture(cell: f64, order: f64, next: f64) -> Texels {
    Texels::from_fn([13, 7, 1], 4, |[x, y, _], channel| {
        let turn = (x * 31 + y * 17 + channel * 7) as f64;
        limit(turn) + 0.3 * turn.sin() * cell.powf(order) + next * (1.7 * turn).cos() * cell.powf(order + 1.0)
    })
}

fn limit(turn: f64) -> f64 {
    0.5 + 0.4 * (0.3 * turn).sin()
}

fn three(cells: [f64; 3], order: f64, next: f64) -> [Texels; 3] {
    cells.map(|cell| picture(cell, order, next))
}

fn of(pictures: &[Texels; 3], cells: [f64; 3]) -> Result<Extrapolated, String> {
    extrapolated(pictures.each_ref(), cells)
}

/// Prevents an order of halved cells alone: lattices round the cells that were asked for.
#[test]
fn a_single_power_is_extrapolated_to_its_limit_at_any_ratio_of_cells() {
    let truth = picture(0.0, 1.0, 0.0);
    for order in [0.5, 1.0, 2.0, 3.0] {
        for cells in [[0.8, 0.4, 0.2], [0.9, 0.5, 0.31], [1.6, 0.4, 0.3]] {
            let found = of(&three(cells, order, 0.0), cells).expect("converges");
            assert!((found.order - order).abs() < 1e-9, "{order}: {}", found.order);
            assert!(rms(&found.picture, &truth) < 1e-12 && found.error < 1e-12, "{order}, {cells:?}: {}", found.error);
        }
    }
}

#[test]
fn the_stated_error_holds_where_another_power_follows() {
    let truth = picture(0.0, 1.0, 0.0);
    for order in [1.0, 2.0] {
        for next in [-0.4, -0.1, 0.1, 0.4] {
            let cells = [0.4, 0.2, 0.1];
            let pictures = three(cells, order, next);
            let found = of(&pictures, cells).expect("converges");
            let (error, finest) = (rms(&found.picture, &truth), rms(&pictures[2], &truth));
            assert!((found.order - order).abs() < 0.5, "{order}: {}", found.order);
            assert!(
                error <= found.error && error < 0.5 * finest,
                "{order}, {next}: {error:.1e} of {:.1e}, finest {finest:.1e}",
                found.error
            );
            assert!((found.finest / finest - 1.0).abs() < 0.5, "{} {finest}", found.finest);
        }
    }
}

#[test]
fn what_does_not_converge_is_refused_in_one_line() {
    let cells = [0.8, 0.4, 0.2];
    let [coarse, middle, fine] = three(cells, 1.0, 0.0);
    let fault = |pictures: [&Texels; 3], cells| {
        let fault = extrapolated(pictures, cells).expect_err("refused");
        assert!(fault.starts_with("extrapolation: ") && fault.lines().count() == 1, "{fault}");
        fault
    };
    assert!(fault([&fine, &middle, &coarse], cells).contains("no order"), "differences grow");
    assert!(fault([&coarse, &coarse, &fine], cells).contains("no order"), "the first difference is 0");
    assert!(fault([&coarse, &middle, &fine], [0.4, 0.8, 0.2]).contains("descend"));
    assert!(fault([&coarse, &middle, &fine], [0.4, 0.2, 0.0]).contains("descend"));
    let small = Texels::from_fn([2, 2, 1], 4, |_, _| 0.0);
    assert!(fault([&coarse, &small, &fine], cells).contains("size"));
    let mut broken = middle.clone();
    broken.values[5] = f64::NAN;
    assert!(fault([&coarse, &broken, &fine], cells).contains("finite"));
    let same = extrapolated([&coarse, &fine, &fine], cells).expect("converges");
    assert!(same.order.is_infinite() && same.error == 0.0 && same.picture.values == fine.values);
}
