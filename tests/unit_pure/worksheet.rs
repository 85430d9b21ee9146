//! The view of a worksheet that shows a measurement: the scene's own, or a plane that holds the points, or the rendering that they were picked on.

use echolume::low_level::measure::overlay;
use echolume::low_level::picture::Picture;
use echolume::low_level::probe::{Geometry, Grid, StoredType};
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Input, Made, MeasureKind, Measurement, Scene};
use echolume::low_level::worksheet::Block;
use glam::DVec3;

/// A view, what differs from the scene's settings, and whether it shows the measurement whole.
struct View {
    set: Vec<String>,
    scene: Scene,
    is_drawn: bool,
}

fn viewed(settings: &[&str], measured: Measurement) -> View {
    let mut layers = Layers::default();
    layers.set("picture.size=[200,100]").expect("a size");
    settings.iter().for_each(|line| layers.set(line).expect(line));
    let grid = Grid { size: [41, 31, 21], spacing: [1.0; 3], origin: [-20.0, 0.0, -10.0] };
    let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
    let mut scene = Scene::new(Geometry::Cartesian(grid), input, layers.finish().expect("settings")).expect("a scene");
    scene.settings.drawn.measure = vec![measured];
    let block = Block::new(&scene, 0, 4, None).expect("a view");
    let picture = Picture { width: 1, height: 1, rgba: vec![0; 4] };
    let scene = block.scene().clone();
    let drawn = overlay::drawn(&scene, Some(4), &scene.settings.drawn.measure);
    let is_within = |drawn: &overlay::Drawn| {
        let [corner, size] = drawn.tile;
        drawn.points.iter().all(|(_, at)| (0..2).all(|a| at[a] >= corner[a] && at[a] <= corner[a] + size[a]))
    };
    View { set: block.entry(&picture, None).picture.set, is_drawn: drawn.iter().any(is_within), scene }
}

fn points(kind: MeasureKind, points: &[[f64; 3]]) -> Measurement {
    Measurement { kind, points: points.to_vec(), ..Measurement::default() }
}

/// Largest distance of places from the plane of the only tile of a view, mm.
fn off(view: &View, points: &[[f64; 3]]) -> f64 {
    let tiling = view.scene.tiling();
    assert_eq!(tiling.tiles.len(), 1);
    let off = |point: &[f64; 3]| tiling.project(&tiling.tiles[0], view.scene.place_of(*point)).1.abs();
    points.iter().map(off).fold(0.0, f64::max)
}

/// Prevents a picture without its caliper, whatever the view shows and wherever the points lie.
#[test]
fn a_plane_is_moved_and_turned_until_it_holds_the_points() {
    let here = [[-5.0, 15.0, 0.0], [5.0, 15.0, 0.0]];
    let view = viewed(&["mode='plane'"], points(MeasureKind::Distance, &here));
    assert!(view.is_drawn && view.set.is_empty(), "{:?}", view.set);
    for settings in
        [&["mode='plane'"][..], &["mode='surface'"], &["mode='plane'", "planes.azimuth=20", "planes.zoom=8"]]
    {
        for at in [
            &[[-5.0, 15.0, 3.0], [5.0, 12.0, 3.0]][..],
            &[[2.0, 15.0, -3.0], [2.0, 12.0, 3.0]],
            &[[-5.0, 12.0, 3.0], [5.0, 12.0, -3.0]],
            // In none of the three planes, and along the elevation.
            &[[-5.0, 10.0, -3.0], [5.0, 17.0, 4.0]],
            &[[1.0, 10.0, -3.0], [1.0, 10.0, 4.0]],
            &[[-5.0, 10.0, -3.0], [5.0, 17.0, 4.0], [3.0, 9.0, 1.0]],
        ] {
            let kind = if at.len() == 2 { MeasureKind::Distance } else { MeasureKind::Angle };
            let view = viewed(settings, points(kind, at));
            assert!(view.is_drawn && off(&view, at) < 0.01, "{at:?} in {settings:?}: {:?}", view.set);
        }
    }
    // No plane holds a screw.
    let screw = [[0.0, 10.0, 0.0], [5.0, 15.0, 0.0], [5.0, 15.0, 5.0], [-5.0, 12.0, -4.0]];
    let view = viewed(&["mode='plane'"], points(MeasureKind::Trace, &screw));
    assert!(!view.is_drawn && view.set.is_empty(), "{:?}", view.set);
}

/// Of the planes through two points the one on which they were set is shown.
#[test]
fn the_plane_of_two_points_is_the_one_that_they_were_made_on() {
    let at = [[-5.0, 15.0, 0.0], [5.0, 15.0, 0.0]];
    let slope = 0.5_f64.to_radians();
    let made = |normal: &str| Made { plane: format!("A at 0.0, 15.0, 0.0 mm, normal {normal}"), ..Made::default() };
    let on = |made: Made| Measurement { made: Some(Made { volume: 4, ..made }), ..points(MeasureKind::Distance, &at) };
    // Its own plane holds it, but is turned about the way between the points.
    let view = viewed(&["mode='surface'", "planes.tilt=30"], on(made("0.000, 0.500, 0.866")));
    let normal = view.scene.tiling().tiles[0].plane.normal;
    assert!(view.is_drawn && normal.angle_between(DVec3::new(0.0, 0.5, 0.75f64.sqrt())) < slope, "{normal}");
    let oblique = [[-5.0, 10.0, -3.0], [5.0, 17.0, 4.0]];
    let along = (DVec3::from(oblique[1]) - DVec3::from(oblique[0])).normalize();
    let [x, y, z] = along.any_orthonormal_vector().to_array().map(|share| format!("{share:.3}"));
    let measured = Measurement { points: oblique.to_vec(), ..on(made(&format!("{x}, {y}, {z}"))) };
    let view = viewed(&["mode='surface'"], measured);
    let normal = view.scene.tiling().tiles[0].plane.normal;
    assert!(view.is_drawn && normal.dot(along).abs() < 1e-6, "{normal}");
    assert!(normal.cross(along.any_orthonormal_vector()).length() < 0.002, "{normal}");
}

#[test]
fn a_rendering_is_turned_to_where_points_were_picked() {
    let made =
        Made { volume: 4, plane: "rendering, azimuth 30.0, elevation -10.0, roll 0.0 deg".into(), ..Made::default() };
    let measured = Measurement {
        on_surface: true,
        made: Some(made),
        ..points(MeasureKind::Distance, &[[0.0, 14.0, 0.0], [4.0, 15.0, 0.0]])
    };
    for mode in ["mode='plane'", "mode='volume'"] {
        let view = viewed(&[mode], measured.clone());
        let camera = &view.scene.settings.camera;
        assert!(view.is_drawn && !view.scene.is_flat(), "{mode}");
        assert_eq!((camera.azimuth, camera.elevation), (30.0, -10.0), "{mode}");
    }
    let view = viewed(&["mode='volume'", "camera.azimuth=30.04", "camera.elevation=-10"], measured);
    assert!(view.is_drawn && view.set.is_empty(), "{:?}", view.set);
}
