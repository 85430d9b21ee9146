//! Cuts: what they remove of a volume, by formula.

use crate::common::probes::wobbler;
use crate::common::scenes::{BYTES, scene};
use echolume::low_level::passes::Slot;
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::{Scene, Settings};
use echolume::low_level::verify::built_in::geometries;
use glam::DVec3;
use std::f64::consts::PI;

const VIEW: &str = "view = { at = [0, 20, 0], direction = [0, 1, 0], up = [0, 0, 1] }";

/// A regular polygon about the origin, of the area of a circle of that radius.
fn circle(radius: f64) -> String {
    let corners = 96;
    let turn = 2.0 * PI / f64::from(corners);
    let out = radius * (turn / turn.sin()).sqrt();
    let corner = |n: i32| format!("[{}, {}]", out * (f64::from(n) * turn).cos(), out * (f64::from(n) * turn).sin());
    format!("[{}]", (0..corners).map(corner).collect::<Vec<_>>().join(", "))
}

fn cut(contour: &str, view: &str, more: &str) -> String {
    format!("mode = 'vr'\ncuts = [{{ contour = {contour}, {view}{more} }}]")
}

fn texels(scene: &Scene) -> impl Iterator<Item = [u32; 3]> + use<> {
    let [columns, rows, slices] = scene.volume_size();
    (0..slices).flat_map(move |z| (0..rows).flat_map(move |y| (0..columns).map(move |x| [x, y, z])))
}

/// What the cuts remove of all of the volume, mm^3.
fn removed(scene: &Scene) -> f64 {
    let (cuts, sizes) = (scene.cuts().collect::<Vec<_>>(), scene.texel_sizes());
    let rows = scene.volume_size()[1];
    let is_removed = |at: &[u32; 3]| cuts.iter().any(|cut| cut.removes(scene.texel_place(*at)));
    texels(scene).filter(is_removed).map(|[_, y, z]| sizes[(z * rows + y) as usize] as f64 * scene.part_unit()).sum()
}

/// A block of 40 x 40 x 40 mm about (0, 20, 0) of 0.4 mm voxels.
fn block(toml: &str) -> Scene {
    let grid = Grid { size: [100; 3], spacing: [0.4; 3], origin: [-19.8, 0.2, -19.8] };
    scene(Geometry::Cartesian(grid), BYTES, toml)
}

/// Area times length. The lattice has eight times the error of an octant: 0.6 % of a circle 20 voxels in radius. Half a voxel more of it would be 5 %.
#[test]
fn a_circle_removes_its_area_times_the_length() {
    let radius = 8.0;
    let area = PI * radius * radius;
    let close = |got: f64, expected: f64| assert!((got / expected - 1.0).abs() < 1e-2, "{got} {expected}");
    close(removed(&block(&cut(&circle(radius), VIEW, ""))), area * 40.0);
    // Aslant, a circle cuts an oblique cylinder of the same length along its axis.
    let aslant = "view = { at = [0, 20, 0], direction = [0.3, 1, 0.2], up = [0, 0, 1] }";
    let stretch = (1.0f64 + 0.09 + 0.04).sqrt();
    close(removed(&block(&cut(&circle(radius), aslant, ""))), area * 40.0 * stretch);
    // Between two rows.
    close(removed(&block(&cut(&circle(radius), VIEW, ", depth = 4.8"))), area * 24.8);
    close(removed(&block(&cut(&circle(radius), VIEW, ", keep = 'inside'"))), 64000.0 - area * 40.0);
    close(removed(&block(&cut(&circle(radius), VIEW, ", keep = 'inside', depth = 4.8"))), (1600.0 - area) * 24.8);
    // A frustum from 20 mm to 60 mm before an eye that is 40 mm from the circle.
    let cone = "view = { at = [0, 20, 0], direction = [0, 1, 0], up = [0, 0, 1], eye = 40 }";
    let frustum = PI * 40.0 / 3.0 * (4.0f64.powi(2) + 4.0 * 12.0 + 12.0 * 12.0);
    close(removed(&block(&cut(&circle(radius), cone, ""))), frustum);
}

/// A ball at each end and a cylinder between. The error is that of a circle above.
#[test]
fn a_brush_removes_a_capsule_and_balls() {
    let radius = 5.0;
    let of = |strokes: &str| {
        removed(&block(&format!("mode = 'vr'\ncuts = [{{ brush = {{ radius = {radius}, strokes = {strokes} }} }}]")))
    };
    let ball = 4.0 / 3.0 * PI * f64::powi(radius, 3);
    let close = |got: f64, expected: f64| assert!((got / expected - 1.0).abs() < 1e-2, "{got} {expected}");
    close(of("[[[1, 20, -2]]]"), ball);
    close(of("[[[-6, 12, -2], [6, 24, 4]]]"), ball + PI * radius * radius * 18.0);
    close(of("[[[-10, 12, -2]], [[9, 24, 4]]]"), 2.0 * ball);
}

/// The texels of a fan grow with the range, and lie on arcs: the cut is straight.
#[test]
fn a_cut_of_a_fan_is_straight() {
    let radius = 5.0;
    let of = |more: &str| {
        let toml = cut(&circle(radius), "view = { at = [0, 25, 0], direction = [0, 1, 0], up = [0, 0, 1] }", more);
        scene(Geometry::Sweep(wobbler()), BYTES, &format!("slices.pixels = 160\n{toml}"))
    };
    let between = removed(&of(", depth = 5")) - removed(&of(", depth = 0"));
    // The slices of this probe lie some 2 mm apart: their share of a circle is known to a few per cent.
    let expected = PI * radius * radius * 5.0;
    assert!((between / expected - 1.0).abs() < 0.06, "{between} {expected}");
}

/// Where a texel is and where rays find it are two formulas.
#[test]
fn texels_are_where_rays_find_them() {
    for (name, geometry) in geometries() {
        let scene = scene(geometry, BYTES, "slices.pixels = 40");
        let mut checked = 0;
        for [x, y, z] in texels(&scene).step_by(7) {
            let place = scene.texel_place([x, y, z]);
            let (found, slice) = match scene.probe() {
                None => (place.truncate().to_array(), f64::from(z)),
                Some(probe) => {
                    let (px, py, position) = probe.inverse_sweep_map(place);
                    let (sample, line) = probe.plane_indices(px, py);
                    let is_in = |at: f64, count: usize| at >= 0.0 && at <= (count - 1) as f64;
                    if !is_in(sample, probe.samples) || !is_in(line, probe.lines.len()) {
                        continue;
                    }
                    ([px, py], probe.slice_index(position, line))
                }
            };
            let (px, py) = scene.grid.place(f64::from(x), f64::from(y));
            assert!((found[0] - px).abs() < 1e-9 && (found[1] - py).abs() < 1e-9, "{name}: {found:?}, {px}, {py}");
            assert!((slice - f64::from(z)).abs() < 1e-9, "{name}: slice {z} is found at {slice}");
            checked += 1;
        }
        assert!(checked > 50, "{name}: {checked}");
    }
}

/// Prevents a second volume where nothing is cut, and a cut that planes would lose.
#[test]
fn only_renderings_with_cuts_have_a_volume_for_them() {
    let has = |toml: &str| Plan::new(&block(toml)).slots.contains(&Slot::CutVolume);
    let cuts = cut("[[0, 0], [3, 0], [0, 3]]", VIEW, "");
    assert!(!has("mode = 'vr'"));
    for (mode, expected) in [
        ("vr", true),
        ("sr", true),
        ("mixed", true),
        ("mip", true),
        ("minip", true),
        ("mean", true),
        ("plane", false),
        ("orthogonal", false),
        ("tomography", false),
        ("cube", false),
    ] {
        assert_eq!(has(&cuts.replace("'vr'", &format!("'{mode}'"))), expected, "{mode}");
    }
    let four = block(&format!("layout = 'four'\n{cuts}"));
    assert_eq!((Slot::of_planes(&four), Slot::of_rays(&four)), (Slot::Volume, Slot::CutVolume));
}

#[test]
fn what_is_removed_has_a_value_of_which_nothing_is_drawn() {
    let value = |more: &str| block(&format!("{}\n{more}", cut("[[0, 0], [3, 0], [0, 3]]", VIEW, ""))).removed_value();
    let dark =
        "volume.transfer = [{ at = 0, colour = [1, 1, 1], opacity = 1 }, { at = 1, colour = [1, 1, 1], opacity = 0 }]";
    let all =
        "volume.transfer = [{ at = 0, colour = [1, 1, 1], opacity = 1 }, { at = 1, colour = [1, 1, 1], opacity = 1 }]";
    assert_eq!(value(""), Some(0.0));
    assert_eq!(value(dark), Some(1.0));
    let of = |toml: &str| block(toml).removed_value();
    assert_eq!([of("mode = 'sr'"), of("mode = 'sr'\nsurface.sign = 'dark'")], [Some(0.0), Some(1.0)]);
    assert_eq!([of("mode = 'mip'"), of("mode = 'minip'"), of("mode = 'mean'")], [Some(0.0), Some(1.0), Some(0.0)]);
    assert_eq!(of(&format!("mode = 'vr'\n{all}")), None);
    let grid = Grid { size: [8; 3], spacing: [1.0; 3], origin: [0.0; 3] };
    let toml = format!("{}\n{all}", cut("[[0, 0], [3, 0], [0, 3]]", VIEW, ""));
    let settings: Settings = Settings::from_toml(&toml).expect("settings");
    let error = Scene::new(Geometry::Cartesian(grid), BYTES, settings).expect_err("refused").to_string();
    assert!(error.starts_with("scene: cuts: ") && error.ends_with("remove the cuts"), "{error}");
}

/// Two views of the same place: what a cut removes does not depend on the camera, the region or the size of the picture.
#[test]
fn a_cut_stays_in_its_place() {
    let cuts =
        cut(&circle(6.0), "view = { at = [3, 15, 2], direction = [0.4, 1, -0.3], up = [0, 0, 1], eye = 80 }", "");
    let kept = |more: &str| {
        let scene = block(&format!("{cuts}\n{more}"));
        let places = [[0.0, 3.0, 1.0], [4.0, 18.0, 2.0], [-9.0, 15.0, 2.0], [10.0, 39.0, -9.0]].map(DVec3::from);
        places.map(|place| scene.cuts().any(|cut| cut.removes(place)))
    };
    let first = kept("");
    assert!(first.contains(&true) && first.contains(&false));
    for more in ["camera = { azimuth = 70, zoom = 3 }", "region.depth = [10, 30]", "picture.size = [100, 900]"] {
        assert_eq!(kept(more), first, "{more}");
    }
}
