//! The planes beside a rendering, cut from a volume of their own.

use crate::common::gpu::*;
use crate::visible_bounds::speckle;
use echolume::low_level::passes::Slot;
use echolume::low_level::picture::Picture;
use echolume::low_level::plan::{Plan, Rerun};
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::Scene;

/// The rendering's own filters, region and clip plane.
const RENDERING: &str = "mode = 'vr'
    layout = 'four'
    slices = { pixels = 64, median = true, smooth = { lateral = 2.0, depth = 2.0, elevation = 1.0 } }
    region = { lateral = [-6, 9], depth = [8, 21], elevation = [-2, 3] }
    clip = [{ at = [2, 12, 0], normal = [1, 0.4, 0] }]";
/// Of the planes, whatever is beside them.
const PLANES: &str = "picture.size = [44, 38]
    ray.sampling = 'exact'
    planes.position = [1, 13, 0.5]
    planes.azimuth = 12
    planes.tilt = -8
    planes.thickness = 1.5";
const LIGHT: &str = "{ lateral = 0.6, depth = 0.5, elevation = 0.7 }";

fn of(geometry: &Geometry, toml: &str) -> Scene {
    scene(geometry.clone(), BYTES, &format!("{toml}\n{PLANES}"))
}

fn beside(geometry: &Geometry) -> Scene {
    of(geometry, &format!("{RENDERING}\nplanes.smooth = {LIGHT}"))
}

/// Pixels of the tiles of the planes, or of the rendering, whose levels differ by more than `most`.
fn differing(a: &Picture, b: &Picture, is_rendering: bool, most: u8) -> usize {
    let [width, height] = [a.width, a.height].map(|n| n as usize);
    let pixels = (0..width * height).filter(|n| (n % width >= width / 2 && n / width >= height / 2) == is_rendering);
    let off = |n: &usize| (4 * n..4 * n + 4).any(|at| a.rgba[at].abs_diff(b.rgba[at]) > most);
    pixels.filter(off).count()
}

/// Prevents planes with the filters, the region or the clip planes of the rendering, and a rendering with those of the planes. In a Cartesian
/// volume places are relative to the middle of the region, which another region rounds in another way.
#[test]
fn planes_show_the_whole_sector_hardly_filtered_and_the_rendering_keeps_its_own() {
    let device = Device::new();
    for (name, geometry) in geometries() {
        let both = beside(&geometry);
        let frames = speckle(&both);
        let sections = of(
            &geometry,
            &format!("mode = 'orthogonal'\nslices = {{ pixels = 64, smooth = {LIGHT} }}\npost.floats = true"),
        );
        let cropped = of(&geometry, RENDERING);
        let [both, sections, cropped] =
            [both, sections, cropped].map(|scene| rendered(&device, scene, &frames).picture().expect("picture"));
        let most = u8::from(name == "Cartesian");
        let at_border = if most > 0 { 6 } else { 0 };
        assert!(differing(&both, &sections, false, most) <= at_border, "{name}: planes");
        assert_eq!(differing(&both, &cropped, true, 0), 0, "{name}: the rendering");
        let changed = differing(&both, &cropped, false, 8);
        assert!(
            changed > 100,
            "{name}: {changed} pixels of the planes lie beyond the region, or are filtered otherwise"
        );
    }
}

/// What neither a ray nor a plane meets is not filtered.
#[test]
fn the_picture_is_that_of_volumes_that_are_filtered_completely() {
    let device = Device::new();
    for (name, geometry) in geometries() {
        let part = beside(&geometry);
        let everything = format!("{RENDERING}\nplanes.smooth = {LIGHT}").replace("pixels", "everything = true, pixels");
        let frames = speckle(&part);
        let pictures = [part, of(&geometry, &everything)].map(|scene| {
            let mut renderer = rendered(&device, scene, &frames);
            (renderer.picture().expect("picture"), renderer.scene().visible_share())
        });
        let [(part, share), (whole, all)] = pictures;
        assert!(part == whole && share <= all && all == 1.0, "{name}: {share}");
    }
}

#[test]
fn only_planes_beside_a_rendering_have_a_volume_of_their_own() {
    let plan = |toml: &str| {
        let scene = scene(Geometry::Sweep(wobbler()), BYTES, &format!("{toml}\nplanes.smooth = {LIGHT}"));
        let plan = Plan::new(&scene);
        let passes: Vec<_> = plan.steps.iter().map(|s| s.pass.name).filter(|n| n.starts_with("section")).collect();
        let is_section = |slot: &&Slot| [Slot::SectionVolume, Slot::SharpSectionVolume].contains(slot);
        (passes.join(" "), plan.slots.iter().filter(is_section).count())
    };
    for toml in ["mode = 'vr'", "mode = 'orthogonal'", "layout = 'pair'\nmode = 'sr'"] {
        assert_eq!(plan(toml), (String::new(), 0), "{toml}");
    }
    let passes = "section_scan_convert section_lateral section_depth section_elevation";
    assert_eq!(plan("mode = 'vr'\nlayout = 'four'"), (passes.to_string(), 2));
    // Slices of a Cartesian volume that the volume stores without loss are copied there, unless planes read the frames too.
    let voxels = |more: &str| {
        let toml = format!("mode = 'vr'\nlayout = 'four'\nslices.format = 'r8'\n{more}");
        let scene = scene(cartesian([16, 12, 9]), BYTES, &toml);
        let passes: Vec<_> = Plan::new(&scene).steps.iter().map(|s| s.pass.name).collect();
        passes.join(" ")
    };
    assert!(!voxels("").contains("load_slice"));
    let own = voxels("planes.smooth = {}");
    assert!(own.starts_with("load_slice section_load_slice ") && !own.contains("section_elevation"), "{own}");
    assert!(
        voxels("planes.smooth.lateral = 2").starts_with("load_slice section_lateral "),
        "frames are read as they are"
    );
}

/// What a hand moves most: the camera leaves the planes, a plane leaves the rendering, and neither sends a frame again.
#[test]
fn a_camera_leaves_the_planes_and_a_plane_the_rendering() {
    let geometry = Geometry::Sweep(wobbler());
    let rendering = RENDERING.replace("pixels", "everything = true, pixels");
    let with = |smooth: &str, more: &str| of(&geometry, &format!("{rendering}\nplanes.smooth = {smooth}\n{more}"));
    let passes = |smooth: &str, more: &str| {
        let (old, new) = (with(LIGHT, ""), with(smooth, more));
        let plan = Plan::new(&new);
        match plan.rerun(&old, &new) {
            Rerun::Steps { steps, .. } => steps.iter().map(|i| plan.steps[*i].pass.name).collect::<Vec<_>>().join(" "),
            other => format!("{other:?}"),
        }
    };
    let drawn = passes(LIGHT, "camera.azimuth = 30");
    assert!(drawn.contains("raycast_volume") && !drawn.contains("planes"), "{drawn}");
    assert_eq!(passes(LIGHT, "planes.roll = 20"), "raycast_planes assemble_toned");
    assert_eq!(passes("{ lateral = 1.5, depth = 0.5, elevation = 0.7 }", ""), "Frames");
}
