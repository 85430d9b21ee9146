//! Stage 3 on distance maps with a known shading: shadows where geometry puts them, one colour on a plane whatever its holes,
//! filters that invent no edges; and the choice among several surfaces.

use crate::common::gpu::*;
use crate::common::probes::wobbler;
use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::passes::{Arrays, DispatchArgs, MISS, Slot, Texels, by_name, is_hit};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;

/// A block of 60 mm viewed along its depth axis, 0.25 mm a pixel, parallel.
pub fn plate(toml: &str) -> Scene {
    let block = Geometry::Cartesian(Grid { size: [61, 61, 61], spacing: [1.0; 3], origin: [0.0; 3] });
    scene(block, BYTES, &format!("picture = {{ size = [244, 244] }}\n{toml}"))
}

pub fn map(scene: &Scene, f: impl Fn(usize, usize) -> f64) -> Texels {
    let [width, height] = scene.picture_size().map(|n| n as usize);
    let texels = Texels::from_fn([width, height, 1], 1, |[x, y, _], _| f(x, y));
    let format = Slot::Distance.format(scene);
    Texels::decode(texels.size, format, &texels.encode(format))
}

/// One output of one pass on a distance map; its other inputs are neutral (found, bright, lit, open).
pub fn run(device: &Device, scene: &Scene, pass: &str, distances: &Texels) -> Texels {
    let pass = by_name(pass).expect("pass");
    let args = DispatchArgs::default();
    let mut inputs = Arrays::default();
    for bind in pass.reads(scene, &args) {
        let channels = bind.slot.format(scene).channels();
        let ones = Texels::from_fn(distances.size, channels, |_, _| 1.0);
        let is_map = matches!(bind.slot, Slot::Distance | Slot::DistanceA | Slot::DistanceB);
        inputs.insert(bind.name, if is_map { distances.clone() } else { ones });
    }
    let outputs = PassRunner::new(device).expect("single").run(scene, pass, &args, &inputs, 0.5).expect("dispatch");
    outputs.get(pass.writes(scene, &args)[0].name).clone()
}

/// A step of 10 mm on a plane, light from the left at 45 deg: its shadow is as long as its height, less the bias.
#[test]
fn a_shadow_ends_where_geometry_puts_it() {
    let device = Device::new();
    for (softness, toml) in [
        (0.0, "light = { direction = [-1.0, 0.0, 1.0], shadow = { softness = 0.0, bias = 0.5 } }"),
        (0.2, "light = { direction = [-1.0, 0.0, 1.0], shadow = { softness = 0.2, bias = 0.5 } }"),
    ] {
        let scene = plate(toml);
        let pixel = scene.rays.origin_dx.length();
        let distances = map(&scene, |x, _| if x < 80 { 40.0 } else { 50.0 });
        let shadow = run(&device, &scene, "shadow", &distances);
        let expected = 80.0 + (10.0 - 0.5) / pixel;
        let row = |x: usize| shadow.one(x, 120, 0);
        let edge = (80..244).find(|x| row(*x) > 0.5).expect("the shadow ends") as f64;
        // A step towards the light crosses a pixel, a quarter of a mm.
        assert!((edge - expected).abs() * pixel < 0.4, "ends at {edge}, not at {expected}");
        assert_eq!(row(82), 0.0, "right behind the step");
        assert_eq!((row(40), row(200)), (1.0, 1.0), "on the step, and beyond its shadow");
        let width = (80..244).filter(|x| row(*x) > 0.02 && row(*x) < 0.98).count() as f64 * pixel;
        if softness == 0.0 {
            assert!(width == 0.0, "a hard edge is {width} mm wide");
        } else {
            // The step that casts the shadow is 13 mm away along the ray.
            assert!(width > 1.0 && width < 5.0, "a soft edge is {width} mm wide");
        }
    }
    // From the right nothing blocks the light.
    let scene = plate("light = { direction = [1.0, 0.0, 1.0], shadow = { softness = 0.0 } }");
    let distances = map(&scene, |x, _| if x < 80 { 40.0 } else { 50.0 });
    assert!(run(&device, &scene, "shadow", &distances).values.iter().all(|v| *v == 1.0));
}

/// Obstacles of all sizes, near and far, thinner than the assumed thickness allows to look through: a longer reach finds what a shorter one finds.
#[test]
fn a_longer_reach_never_removes_a_shadow() {
    let device = Device::new();
    let hills = |x: usize, y: usize| {
        let wave = |period: f64, height: f64| height * ((x as f64 + 0.4 * y as f64) / period).sin();
        45.0 + wave(1.5, 0.6) + wave(9.0, 2.0) + wave(40.0, 5.0)
    };
    for look in ["camera = { field_of_view = 0 }", "camera = { field_of_view = 40 }"] {
        for light in ["direction = [-1.0, 0.3, 0.4]", "position = [-30.0, 10.0, 0.0]"] {
            let mut before: Option<(f64, Texels)> = None;
            for reach in [3.0, 10.0, 31.0, 40.0, 90.0, 1e6] {
                let shadow = format!("shadow = {{ softness = 0.1, bias = 0.1, thickness = 8.0, reach = {reach:?} }}");
                let scene = plate(&format!("{look}\nlight = {{ {light}, {shadow} }}"));
                let found = run(&device, &scene, "shadow", &map(&scene, hills));
                if let Some((shorter, before)) = before {
                    let lost = found.values.iter().zip(&before.values).filter(|(far, near)| far > near).count();
                    assert_eq!(lost, 0, "{look}, {light}: {shorter} mm has shadows that {reach} mm lacks");
                    let shaded = found.values.iter().filter(|light| **light < 0.5).count();
                    assert!(shaded > 3000, "{look}, {light}, {reach} mm: only {shaded} pixels in shadow");
                }
                before = Some((reach, found));
            }
        }
    }
}

#[test]
fn a_plane_has_one_colour_whatever_its_holes_and_borders() {
    let device = Device::new();
    let scene = plate("light = { direction = [-0.4, 0.5, 0.7], shadow = {}, occlusion = {}, skin = {} }");
    let tilted = |x: usize, y: usize| 40.0 + 0.05 * x as f64 - 0.03 * y as f64;
    let holed =
        |x: usize, y: usize| (x / 7 + y / 5).is_multiple_of(4) || (100..140).contains(&x) && (90..120).contains(&y);
    let distances = map(&scene, |x, y| if holed(x, y) { MISS } else { tilted(x, y) });
    let picture = run(&device, &scene, "light", &distances);
    let open = run(&device, &scene, "occlusion", &distances);
    let lit = run(&device, &scene, "shadow", &distances);
    let first = picture.get([1, 9, 0]).to_vec();
    assert_eq!(first[3], 1.0);
    for y in 0..244 {
        for x in 0..244 {
            let colour = picture.get([x, y, 0]);
            if holed(x, y) {
                assert_eq!(colour, [0.0; 4], "a hole stays black");
                continue;
            }
            let alone = [(1i64, 0i64), (-1, 0), (0, 1), (0, -1)].iter().all(|(dx, dy)| {
                let (i, j) = (x as i64 + dx, y as i64 + dy);
                !(0..244).contains(&i) || !(0..244).contains(&j) || holed(i as usize, j as usize)
            });
            let off = colour.iter().zip(&first).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(alone || off < 2e-3, "a false edge at {x}, {y}: {colour:?} is not {first:?}");
            assert!(open.one(x, y, 0) > 0.999, "a plane lies open at {x}, {y}");
            assert!(lit.one(x, y, 0) > 0.999, "a plane casts no shadow on itself at {x}, {y}");
        }
    }
}

/// Thesis Fig. 42: smoothing must not put surface where there is none between two surfaces.
#[test]
fn no_filter_of_the_distance_map_invents_an_edge() {
    let device = Device::new();
    let scene = plate(
        "distance = { median = 9, bilateral = { pixels = 4.0, distance = 1.0 }, sigma = { window = 9, sigma = 0.5 } }",
    );
    let mut noise = Noise(2);
    let rough: Vec<f64> = (0..244 * 244).map(|_| noise.range(-0.3, 0.3)).collect();
    let distances = map(&scene, |x, y| match (x * 3 + y < 300, y > 180) {
        (_, true) => MISS,
        (true, _) => 30.0 + rough[y * 244 + x],
        (false, _) => 45.0 + rough[y * 244 + x],
    });
    for pass in ["median_distance", "bilateral_distance", "sigma_distance"] {
        let filtered = run(&device, &scene, pass, &distances);
        let between =
            filtered.values.iter().filter(|v| is_hit(**v) && !(29.5..30.5).contains(*v) && !(44.5..45.5).contains(*v));
        assert_eq!(between.count(), 0, "{pass} puts surface between the surfaces");
        let spread = |texels: &Texels| {
            let inside: Vec<f64> = (20..60).flat_map(|y| (5..60).map(move |x| texels.one(x, y, 0) - 30.0)).collect();
            (inside.iter().map(|v| v * v).sum::<f64>() / inside.len() as f64).sqrt()
        };
        assert!(spread(&filtered) < 0.6 * spread(&distances), "{pass} smooths: {}", spread(&filtered));
        assert!(!is_hit(filtered.one(120, 200, 0)), "{pass} fills what nothing surrounds");
    }
}

#[test]
fn a_corner_is_darker_than_a_plane_and_an_edge_is_not() {
    let device = Device::new();
    let scene = plate("light = { occlusion = { radius = 8.0, strength = 1.0 }, cliff = 1000.0 }");
    // A valley whose sides rise at 45 deg towards the viewer, and the same as a ridge.
    let pixel = scene.rays.origin_dx.length();
    let away = |x: usize| (x as f64 - 122.0).abs() * pixel;
    let valley = run(&device, &scene, "occlusion", &map(&scene, |x, _| 50.0 - away(x)));
    let ridge = run(&device, &scene, "occlusion", &map(&scene, |x, _| 40.0 + away(x)));
    assert!(valley.one(122, 120, 0) < 0.85, "{}", valley.one(122, 120, 0));
    assert!(valley.one(20, 120, 0) > 0.99);
    assert!(ridge.one(122, 120, 0) > 0.99);
}

/// No setting of a light gives a non-finite number.
#[test]
fn no_light_and_no_map_gives_anything_but_finite_colours() {
    let device = Device::new();
    let lights = [
        "direction = [0.0, 0.0, -1.0]",
        "position = [0.0, 0.0, 0.0]",
        "position = [0.0, 0.0, -50.0], skin = { translucency = 1.0, wrap = 1.0 }",
        "shininess = 0.0",
        "shininess = 1000000.0, direction = [0.0, 0.0, 1.0]",
        "cliff = 0.0",
    ];
    for light in lights {
        let scene = plate(&format!("light = {{ {light}, shadow = {{}}, occlusion = {{}} }}"));
        let middle = |x: usize, y: usize| x == 122 && y == 122;
        let maps = [
            map(&scene, |_, _| MISS),
            map(&scene, |x, y| if middle(x, y) { 31.5 } else { MISS }),
            map(&scene, |x, _| if x < 122 { 1e-3 } else { 1e6 }),
            map(&scene, |_, _| 31.5),
        ];
        for distances in &maps {
            for pass in ["shadow", "occlusion", "light"] {
                let result = run(&device, &scene, pass, distances);
                let wrong = result.values.iter().find(|v| !v.is_finite() || **v < 0.0 || **v > 20.0);
                assert!(wrong.is_none(), "{pass} under {light}: {wrong:?}");
            }
            let picture = run(&device, &scene, "light", distances);
            let lit = picture.values.chunks_exact(4).filter(|c| c[3] > 0.0).count();
            assert_eq!(lit, distances.values.iter().filter(|d| is_hit(**d)).count(), "{light}: what is hit is lit");
        }
    }
}

#[test]
fn the_requested_surface_of_several_is_taken() {
    let device = Device::new();
    let block = Geometry::Cartesian(Grid { size: [12, 160, 12], spacing: [0.25; 3], origin: [0.0; 3] });
    let walls = [8.0, 17.0, 29.0];
    for rough in [1, 2] {
        for number in 1..=4 {
            let toml = format!(
                "picture = {{ size = [8, 8] }}\nray = {{ step = 0.25, sampling = 'exact' }}\nslices = {{ format = 'r32f' }}\n\
                 surface = {{ threshold = 0.1, number = {number}, rough = {rough} }}"
            );
            let scene = scene(block.clone(), FLOATS, &toml);
            // Three bright sheets of 3 mm.
            let frames = body_frames(&scene, |p| {
                let sheet = |w: f64| ((1.5 - (p.y - w - 1.5).abs()) / 0.5 + 0.5).clamp(0.0, 1.0);
                walls.iter().map(|w| sheet(*w)).fold(0.0, f64::max)
            });
            let mut renderer = rendered(&device, scene.clone(), &frames);
            renderer.picture().expect("picture");
            let distance = renderer.read(Slot::Distance).expect("read").expect("there").one(4, 4, 0);
            let (origin, direction) = scene.rays.at(4.5, 4.5);
            match walls.get(number - 1) {
                Some(wall) => {
                    let found = (origin + direction * distance).y;
                    assert!((found - wall).abs() < 0.1, "surface {number}, rough {rough}: {found} is not {wall}");
                }
                None => assert!(!is_hit(distance), "there are but three"),
            }
        }
    }
}

/// Thesis 4-5 to 4-7: the rendered pixel is the colour of the ambient light alone, and a shadow dims the pixel or the light.
#[test]
fn a_surface_is_lit_by_the_rendered_pixel() {
    let device = Device::new();
    let lit_with = |[ambient, diffuse]: [f64; 2], toml: &str, light: &str| {
        let scene = plate(&format!(
            "surface = {{ {toml} }}\nlight = {{ direction = [0, 0, 1], ambient = {ambient}, diffuse = {diffuse}, specular = 0, \
             surface_colour = [1, 0.5, 0.25]{light} }}"
        ));
        let distances = map(&scene, |_, _| 40.0);
        let pass = by_name("light").expect("pass");
        let mut inputs = Arrays::default();
        for bind in pass.reads(&scene, &DispatchArgs::default()) {
            let value = |c: usize| match bind.slot {
                Slot::VolumeLayer => [0.8, 0.6, 0.2, 0.9][c],
                Slot::Shadow => 0.25,
                _ => 1.0,
            };
            let channels = bind.slot.format(&scene).channels();
            let texels = Texels::from_fn(distances.size, channels, |_, c| value(c));
            inputs.insert(bind.name, if bind.slot == Slot::Distance { distances.clone() } else { texels });
        }
        let mut runner = PassRunner::new(&device).expect("single");
        let outputs = runner.run(&scene, pass, &DispatchArgs::default(), &inputs, 0.5).expect("dispatch");
        outputs.get("picture").get([120, 120, 0])[..3].to_vec()
    };
    let lit = |toml: &str, light: &str| lit_with([0.3, 0.4], toml, light);
    let near = |a: &[f64], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3);
    let layer = [0.8, 0.6, 0.2];
    let constant = lit("", "");
    assert!(near(&constant, [1.0, 0.5, 0.25].map(|c| 0.7 * c)), "{constant:?}");
    let rendered = lit("colour = 'rendered'", "");
    assert!(near(&rendered, layer.map(|c| 0.3 * c + 0.4)), "{rendered:?}");
    let behind = lit("colour = 'behind'", "");
    assert!(near(&behind, layer.map(|c| 0.7 * c)), "{behind:?}");
    // Of the light that a shadow of full strength removes, a quarter arrives.
    let light = lit("colour = 'rendered'", ", shadow = { strength = 1 }");
    assert!(near(&light, layer.map(|c| 0.3 * c + 0.1)), "{light:?}");
    let pixel = lit("colour = 'rendered'", ", shadow = { strength = 1, dims = 'pixel' }");
    assert!(near(&pixel, layer.map(|c| 0.25 * (0.3 * c + 0.4))), "{pixel:?}");
    // The light of a light volume is brighter than a surface takes without a film curve.
    for ([ambient, diffuse], volume, brightness) in
        [([0.2, 1.8], "", 2.0), ([0.2, 1.8], ", volume = {}", 1.0), ([0.3, 0.4], ", volume = {}", 0.7)]
    {
        let bright = lit_with([ambient, diffuse], "", volume);
        assert!(near(&bright, [1.0, 0.5, 0.25].map(|c| brightness * c)), "{bright:?}");
    }
}

/// Prevents a surface whose picture does not depend on the transfer function.
#[test]
fn the_transfer_function_colours_a_surface_that_takes_its_colour() {
    let device = Device::new();
    let picture = |colour: &str, transfer: &str| {
        let toml = format!(
            "picture = {{ size = [48, 40] }}\nslices = {{ pixels = 40 }}\nmode = 'sr'\nsurface = {{ colour = '{colour}' }}\n\
             volume = {{ transfer = '{transfer}' }}"
        );
        let scene = scene(Geometry::Sweep(wobbler()), BYTES, &toml);
        // A wall in the middle of each line, brighter further behind.
        let [samples, lines] = scene.frame_size().map(|n| n as usize);
        let echo = |sample: usize| if sample < samples / 2 { 0.1 } else { 0.4 + 0.6 * sample as f64 / samples as f64 };
        let frame = Texels::from_fn([samples, lines, 1], 1, |[sample, _, _], _| echo(sample));
        let frames = vec![frame; scene.slices() as usize];
        rendered(&device, scene, &frames).picture().expect("picture").rgba
    };
    for colour in ["rendered", "behind"] {
        assert_ne!(picture(colour, "grey"), picture(colour, "bone"), "{colour}");
    }
    assert_eq!(picture("constant", "grey"), picture("constant", "bone"));
}
