//! `echolume report error` on a device: its measurements are right, and its advice holds for other scenes.

use crate::scenes::*;
use echolume::low_level::error_report::dials::dial;
use echolume::low_level::error_report::errors_and_times::{ErrorMeasurement, MeasureError, ReferenceChoice};
use echolume::low_level::error_report::{Measure, Point, Reference, Report};
use echolume::low_level::scene::Scene;
use echolume::low_level::scene::default_look::Recorded;
use echolume::low_level::scene::load::Layers;

const BASE: [&str; 6] = [
    "mode=vr",
    "picture.size=[40,32]",
    "slices.pixels=48",
    "ray.sampling=exact",
    "volume.transfer=[{at=0.1,colour=[0.2,0.1,0.1],opacity=0.0},{at=0.9,colour=[1,0.9,0.8],opacity=0.2}]",
    "camera.zoom=1.2",
];

fn layers(more: &[&str]) -> Layers {
    let mut layers = Layers::default();
    BASE.iter().chain(more).for_each(|set| layers.set(set).expect("setting"));
    layers
}

fn resolved(layers: &Layers) -> Scene {
    scene_of(layers.clone().finish().expect("settings"))
}

/// The dials of these names, measured by so many runs.
fn measured(more: &[&str], names: &[&str], repeats: u32, reference: ReferenceChoice) -> Result<Report, MeasureError> {
    let (layers, frames) = (layers(more), frames());
    let scene = resolved(&layers);
    let dials: Vec<_> = names.iter().map(|n| dial(n, &scene).expect("dial")).collect();
    let context = device();
    let recorded = Recorded::as_set(scene.geometry.clone(), scene.input);
    let measurement = ErrorMeasurement {
        context: &context,
        recorded: &recorded,
        layers: &layers,
        scene: &scene,
        frames: &frames,
        input: "a bumpy wall",
        repeats,
        reference,
    };
    let finest = measurement.finest()?;
    measurement.report(&dials, &finest, None, |_, _| {})
}

fn report(more: &[&str], names: &[&str], reference: ReferenceChoice) -> Report {
    measured(more, names, 3, reference).expect("report")
}

/// Prevents an instrument that prints nothing useful: times that were never taken, or all of them booked as those of the volume, with every error right.
#[test]
fn every_point_has_times_of_its_volume_and_of_its_picture() {
    let _alone = alone();
    let report = report(&[], &["step", "format", "termination", "pipeline"], ReferenceChoice::F64);
    let points = || report.dials.iter().flat_map(|dial| dial.points.iter().map(move |point| (&dial.name, point)));
    for (dial, point) in points() {
        let times = point.times.unwrap_or_else(|| panic!("{dial} {}: no time", point.label));
        let all = [times.volume, times.picture, times.total];
        assert!(
            all.iter().all(|t| t.median > 0.0 && t.low <= t.median && t.median <= t.high),
            "{dial} {}: {times:?}",
            point.label
        );
        // Of three runs these are the shortest and the longest: whatever slowed a run down, they lie around the sums of both parts. The scene as it is has
        // more runs.
        let ([volume, picture, total], slack) = (all, 1e-9 * times.total.high);
        let is_around =
            total.low >= volume.low + picture.low - slack && total.high <= volume.high + picture.high + slack;
        assert!(point.is_default || is_around, "{dial} {}: {times:?}", point.label);
        assert!(point.ratios.is_some(), "{dial} {}: no ratio", point.label);
    }
    // Every point of a dial that a choice may take is among the choices, and all were timed.
    let numerical: usize = report.dials.iter().map(|dial| dial.points.len() - 1).sum();
    assert!(report.choices.len() > numerical, "{} choices of {numerical} settings", report.choices.len());
    assert!(report.choices.iter().all(|choice| choice.times.is_some()), "a choice has no time");
    assert!(report.choices[0].set.is_empty());
    assert!(!report.pareto_front(Measure::Rmse).is_empty());
    // The budget: a row for each approximation that the scene makes, none of them above all together by much.
    let rows: Vec<_> = report.budget.shares.iter().map(|share| (share.source.as_str(), share.errors.rmse)).collect();
    println!("{rows:?}, together {:.2e}", report.budget.total.rmse);
    for source in ["step", "format", "termination", "transfer", "device"] {
        assert!(rows.iter().any(|row| row.0 == source), "{source} is not in {rows:?}");
    }
    let (sum, total) = (report.budget.sum(), report.budget.total.rmse);
    assert!(total < 2.0 * sum && total > 0.0, "together {total}, root of the sum of the squares {sum}");
    let floor = rows[rows.len() - 1].1;
    assert!(rows.iter().all(|row| row.1 > 0.2 * floor), "{rows:?}");
}

#[test]
fn errors_fall_with_the_step_down_to_the_devices_floor() {
    let _alone = alone();
    let report = report(&[], &["step"], ReferenceChoice::F64);
    let dial = &report.dials[0];
    let mut points: Vec<_> = dial.points.iter().map(|p| (p.value, p.errors.rmse)).collect();
    points.sort_by(|a, b| b.0.total_cmp(&a.0));
    let floor = dial.floor.expect("a floor");
    println!("{points:?}, floor {floor:.2e}, order {:?}", dial.order.as_ref().map(|o| o.order));
    assert!(floor < 1.5e-3, "{floor}");
    // At the border of the sector, which a sample hits or misses, the order is 1: eight times the step, eight times the error.
    assert!(points[0].1 > 8.0 * points[points.len() - 1].1, "{points:?}");
    assert!(points.windows(2).all(|p| p[1].1 < 1.05 * p[0].1), "{points:?}");
    assert_eq!(dial.points.iter().filter(|p| p.is_default).count(), 1);
}

/// Prevents a detector that finds another surface, or none, at a finer step: then the finest step would have the largest error.
#[test]
fn errors_of_a_surface_fall_with_the_step_too() {
    let _alone = alone();
    let report = report(&["mode=sr", "surface.threshold=0.1"], &["step"], ReferenceChoice::F64);
    let dial = &report.dials[0];
    let mut points: Vec<_> = dial.points.iter().map(|p| (p.value, p.errors.rmse)).collect();
    points.sort_by(|a, b| b.0.total_cmp(&a.0));
    println!("{points:?}");
    // The default is the coarsest: a longer step is no other for the detector.
    assert!(points.len() >= 6 && dial.points.iter().position(|p| p.is_default) == Some(0), "{points:?}");
    assert!(dial.points.iter().all(|p| p.value <= dial.points[0].value), "{points:?}");
    // The wall has bumps as narrow as the edge: single rays jump between two surfaces, and one of them alone is an RMSE of 0.02.
    assert!(points[0].1 < 0.1 && points[0].1 > 3.0 * points[points.len() - 1].1, "{points:?}");
    // The place of the others has an error that falls with the step: 0.07 to under 0.001 mm.
    let place = |p: &Point| p.errors.mm.as_ref().and_then(|mm| mm.error.as_ref()).expect("surfaces").median;
    let finest = dial.points.iter().min_by(|a, b| a.value.total_cmp(&b.value)).expect("points");
    let (first, last) = (place(&dial.points[0]), place(finest));
    println!("median of the place: {first} to {last} mm");
    assert!(first > 30.0 * last, "{first} to {last} mm");
}

/// Prevents a filter that nobody asked for as the reference of the others: then the scene's own filter has the largest "error".
#[test]
fn filters_differ_from_the_scene_as_it_is() {
    let _alone = alone();
    let report =
        report(&["slices.sigma={window=5,sigma=0.1}"], &["sigma", "filter3d", "perona-malik"], ReferenceChoice::Auto);
    for dial in &report.dials {
        assert_eq!(dial.reference, Reference::AsItIs, "{}", dial.name);
        let (own, others): (Vec<_>, Vec<_>) = dial.points.iter().partition(|p| p.is_default);
        assert!(own.len() == 1 && own[0].errors.rmse == 0.0, "{own:?}");
        // One of them may be the scene's own filter.
        assert!(others.iter().filter(|p| p.errors.rmse > 1e-4).count() + 1 >= others.len(), "{others:?}");
    }
    assert!(report.pareto_front(Measure::Rmse).is_empty());
}

/// Every sampling method against the f64 reference of the same scene.
#[test]
fn the_device_samples_as_f64_does_by_its_filter_by_eight_texels_and_by_quads() {
    let _alone = alone();
    let report = report(&["slices.format=r16"], &["sampling"], ReferenceChoice::F64);
    let places: Vec<_> = report.dials[0].points.iter().map(|p| (p.label.as_str(), p.errors.rmse)).collect();
    println!("{places:?}");
    assert_eq!(places.iter().map(|p| p.0).collect::<Vec<_>>(), ["exact", "hardware", "quads"]);
    // An 8-bit weight is off by 1/512 of the difference of two texels.
    assert!(places[0].1 < 1e-3 && places[1].1 < 2e-3 && places[2].1 < 1e-3, "{places:?}");
}

/// A converged picture of the device as reference states its own remaining error.
#[test]
fn a_converged_reference_states_its_own_error() {
    let _alone = alone();
    let report = report(&[], &["rays", "lut", "adaptive"], ReferenceChoice::Converged);
    for dial in &report.dials {
        let Reference::Converged { set, rmse } = &dial.reference else {
            panic!("{} is reference against f64", dial.name)
        };
        let worst = dial.points.iter().map(|p| p.errors.rmse).fold(0.0, f64::max);
        println!("{}: worst {worst:.1e}, {} itself {rmse:.1e}", dial.name, set.join(" "));
        assert!(*rmse < worst, "{}: {rmse} against {worst}", dial.name);
    }
    let lut = &report.dials[1];
    let of = |entries: f64| lut.points.iter().find(|p| p.value == entries).expect("place").errors.rmse;
    assert!(of(3.0) > 3.0 * of(1025.0), "three entries must show: {} and {}", of(3.0), of(1025.0));
}

/// Prevents the spike between two entries of the table that drew black and was reported as an error of 0: the reference had the
/// same table.
#[test]
fn a_narrow_spike_of_the_transfer_function_is_drawn_and_its_error_is_seen() {
    let _alone = alone();
    let spike = "volume.transfer=[{at=0.499,colour=[1,1,1],opacity=0.0},{at=0.5,colour=[1,1,1],opacity=0.5},\
                 {at=0.501,colour=[1,1,1],opacity=0.0}]";
    assert_eq!(resolved(&layers(&[spike])).transfer_entries(), 1001);
    let report = report(&[spike], &["step", "transfer"], ReferenceChoice::Auto);
    for dial in &report.dials {
        let Reference::Exact { estimate, pieces } = dial.reference else { panic!("{:?}", dial.reference) };
        println!("{}: estimate {estimate:.1e}, {pieces} pieces, order {:?}", dial.name, dial.order.map(|o| o.order));
        dial.points.iter().for_each(|p| println!("  {} {:.2e}", p.label, p.errors.rmse));
        assert!(estimate < 1e-9 && pieces > 500, "{estimate:.1e}, {pieces}");
        let own = dial.points.iter().find(|p| p.is_default).expect("a default");
        assert!(own.errors.rmse > 1e-3, "long steps miss a layer this thin: {}", own.errors.rmse);
    }
    let steps = &report.dials[0].points;
    let of = |n: usize| steps.iter().map(|p| (p.value, p.errors.rmse)).nth(n).expect("a point").1;
    assert!(of(steps.len() - 1) < 0.7 * of(1), "finer steps meet more of it: {} and {}", of(1), of(steps.len() - 1));
}

/// Prevents orders and errors against a picture in which there is nothing.
#[test]
fn a_reference_without_hits_is_refused_by_name() {
    let _alone = alone();
    let refused = |more: &[&str], name: &str, reference: ReferenceChoice| {
        measured(more, &[name], 1, reference).expect_err("nothing to compare with").to_string()
    };
    let said = refused(&["volume.transfer=[{at=0,colour=[1,1,1],opacity=0.0}]"], "brick", ReferenceChoice::Auto);
    assert!(
        said.contains("dial brick") && said.contains("black everywhere") && said.contains("volume.transfer"),
        "{said}"
    );
    let said = refused(&["mode=sr", "surface.threshold=0.95", "surface.rough=1"], "brick", ReferenceChoice::Exact);
    assert!(said.contains("surface.threshold=0.95") && !said.contains('\n'), "{said}");
    let said = refused(&["mode=sr", "surface.rough=2"], "step", ReferenceChoice::Exact);
    assert!(said.contains("no exact reference") && said.contains("surface.rough=1"), "{said}");
}

/// Prevents a reference of a lit scene that is as coarse as what it judges: its cells are smaller than those of every point, it is extrapolated to cells of no
/// size, and it states its own error.
#[test]
fn a_lit_scene_is_compared_with_what_ever_smaller_cells_converge_to() {
    let _alone = alone();
    let report = report(&["light.volume={cell=3.0}"], &["light-cell"], ReferenceChoice::Auto);
    for (name, reference) in [("light-cell", &report.dials[0].reference), ("budget", &report.budget.reference)] {
        let Reference::Extrapolated { cells, order, rmse, .. } = reference else {
            panic!("{name}: {reference:?}");
        };
        println!("{name}: cells of {cells:.3?} mm, order {order:.2}, off by {rmse:.1e}");
        assert!(cells[0] > cells[1] && cells[1] > cells[2] && (0.5..4.0).contains(order), "{name}: {cells:?}, {order}");
        assert!(report.dials[0].points.iter().all(|point| point.value > 1.9 * cells[2]), "{name}: {cells:?}");
    }
    let mut points: Vec<&Point> = report.dials[0].points.iter().collect();
    points.sort_by(|a, b| a.value.total_cmp(&b.value));
    let errors: Vec<_> = points.iter().map(|point| (point.value, point.errors.rmse)).collect();
    println!("{errors:.4?}");
    assert!(errors.len() > 4 && errors.windows(2).all(|two| two[1].1 > 0.9 * two[0].1), "{errors:?}");
    assert!(errors[errors.len() - 1].1 > 3.0 * errors[0].1, "{errors:?}");
    let Reference::Extrapolated { rmse, .. } = report.dials[0].reference else { return };
    // Its limit is what the two coarser lattices alone would be off by, of which the finer is a point.
    assert!(rmse < 1.5 * errors[0].1, "the reference is off by {rmse}, the best point by {}", errors[0].1);
    let of =
        |source: &str| report.budget.shares.iter().find(|share| share.source == source).expect("a share").errors.rmse;
    assert!(of("light-cell") > 0.0 && report.budget.total.rmse < 2.0 * report.budget.sum(), "{:?}", report.budget);
}
