//! The light volume: a lattice of cells over the region. In it light is absorbed by the opacity of the transfer function, widens, and is
//! scattered (half angle slicing, Kniss et al. 2003; extinction pyramids, Schlegel, Makhinya and Pajarola 2011). It does not depend on the
//! view unless the light follows the camera. Volume rendering takes the light of each sample from it.

mod beam;
mod lit;

pub(crate) use beam::{PROPAGATE, PROPAGATE_BACK};
pub use lit::bare_ground;
pub(super) use lit::{Lit, constants, developed, fade_density, on_film, params, reads};

use super::raycast::ray;
use crate::passes::lookup_tables::transfer_of;
use crate::passes::pass::*;
use crate::passes::shade::wrap;
use crate::scene::{LightVolume, Scene, windowed};
use glam::DVec3;

/// Density that fluid counts as where light is scattered: FLUID of diffuse.comp.
const FLUID: f64 = 0.0015;
/// Largest standard deviation of scattered light, cells.
const MAX_SCATTER: f64 = 48.0;
/// Places along a cone of ambient light, and the length that each stands for, for a reach of 20: REACH and LENGTH of ambient.comp.
const REACH: [f64; 4] = [2.5, 5.0, 10.0, 20.0];
const LENGTH: [f64; 4] = [2.5, 3.5, 7.0, 12.0];

fn need(scene: &Scene) -> Need {
    match (scene.lit_by_volume(), scene.composites()) {
        (Some(_), _) => Ok("light goes through the composited volume"),
        (None, true) => Err("no light volume is asked for"),
        (None, false) => Err("nothing is composited in this mode"),
    }
}

fn light_of(scene: &Scene) -> LightVolume {
    scene.settings.light.volume.unwrap_or_default()
}

/// Density of matter of an absorption of 1 over the reference length: the most opaque matter of the transfer function has a density of 1.
fn density(scene: &Scene) -> f64 {
    let largest = transfer_of(scene).iter().map(|entry| entry[3]).fold(0.0, f64::max);
    if largest > 0.0 { 1.0 / largest } else { 0.0 }
}

/// Cells of the light volume along each axis.
fn count(scene: &Scene) -> [u32; 3] {
    scene.light_lattice().count
}

/// [`count`] as the size of an array.
fn size(scene: &Scene) -> [usize; 3] {
    count(scene).map(|n| n as usize)
}

/// Samples the density and the echo of each cell. Cells outside the rendered box take the values at its faces. `region.fade` is not applied here, so
/// that what the region cuts off still lies in the shade of the matter beyond.
pub(crate) const MATTER: Pass = Pass {
    name: "light_matter",
    shader: |_, _| "light_volume/matter",
    needed: need,
    reads: |s, _| [ray::reads(s), vec![whole("transfer", Slot::Transfer)]].concat(),
    writes: |_, _| vec![whole("matter", Slot::LightMatter)],
    extent: |s, _| count(s),
    params: |s, _| {
        let lattice = s.light_lattice();
        ray::unmoved_params(s, s.volume_view())
            .vec3("light_low", s.to_local(lattice.low))
            .f32("cell", lattice.cell)
            .f32("density", density(s))
    },
    constants: |s, _| {
        let with = [("ENTRIES", s.transfer_entries() as i32), ("TAPS", light_of(s).taps as i32)];
        replaced(ray::constants(s), &["SPREAD", "MIRRORED"], with)
    },
    tolerance: Tolerance::absolute(4e-3).outliers(4e-3).because(
        "a place is off by 1e-5 mm in f32, so a sample by as much of a voxel's contrast, which the transfer function \
         multiplies; a cell at the very border of the sector or the box may fall on either side",
    ),
    reference: |scene, _, reads, writes| {
        let volume = reads.get("volume");
        let table = transfer_of(scene);
        let (lattice, taps, view) = (scene.light_lattice(), light_of(scene).taps, scene.volume_view());
        let (density, parts) = (density(scene), f64::from(taps.pow(3)));
        let target = writes.get_mut("matter");
        for at in cells(size(scene)) {
            let (mut dense, mut echo) = (0.0, 0.0);
            for n in 0..taps.pow(3) {
                let tap =
                    [n % taps, n / taps % taps, n / taps.pow(2)].map(|tap| (f64::from(tap) + 0.5) / f64::from(taps));
                let place = lattice.place(std::array::from_fn(|a| at[a] as f64 + tap[a])).clamp(view.low, scene.high);
                let is_kept = scene.clips().all(|(normal, limit)| normal.dot(place) <= limit);
                let Some(texel) = ray::texel_beyond_sweep(scene, place).filter(|_| is_kept) else { continue };
                let value = ray::interpolated(scene, volume, texel);
                let entry = windowed(view.window, value) * (table.len() - 1) as f64;
                let n = (entry as usize).min(table.len() - 2);
                dense += table[n][3] + (table[n + 1][3] - table[n][3]) * (entry - n as f64);
                echo += value;
            }
            target.set(at, &[(density * dense / parts).min(1.0), echo / parts]);
        }
    },
    ..Pass::OF_RAYS
};

/// Computes the levels of the Gaussian pyramid of the density, one after the other.
pub(crate) const REDUCE: Pass = Pass {
    name: "light_reduce",
    shader: |_, _| "light_volume/reduce",
    reads: |_, t| vec![whole("source", level(t.iteration))],
    writes: |_, t| vec![whole("target", level(t.iteration + 1))],
    extent: |s, t| count(s).map(|n| n.div_ceil(2 << t.iteration)),
    repeat: |s| s.ambient_cones().levels(),
    params: |_, _| Params::default(),
    constants: no_constants,
    tolerance: Tolerance::absolute(1e-6).relative(6e-4).because("64 terms in f32, none negative; then R16F"),
    reference: |_, _, reads, writes| {
        let source = reads.get("source");
        let target = writes.get_mut("target");
        let taps = [(-1, 1.0), (0, 3.0), (1, 3.0), (2, 1.0)];
        for at in cells(target.size) {
            let [x, y, z] = at.map(|n| 2 * n as i64);
            let mut sum = 0.0;
            for (k, down) in taps {
                for (j, along) in taps {
                    for (i, across) in taps {
                        sum += across * along * down * source.clamped(x + i, y + j, z + k);
                    }
                }
            }
            target.set(at, &[sum / 512.0]);
        }
    },
    ..MATTER
};

fn level(n: u32) -> Slot {
    match n {
        0 => Slot::LightMatter,
        1 => Slot::LightPyramid1,
        2 => Slot::LightPyramid2,
        3 => Slot::LightPyramid3,
        4 => Slot::LightPyramid4,
        5 => Slot::LightPyramid5,
        6 => Slot::LightPyramid6,
        7 => Slot::LightPyramid7,
        _ => Slot::LightPyramid8,
    }
}

/// Smallest edge of a cell of the light volume, mm, at which the light is as the settings request. Smaller cells would need wider kernels and cones,
/// in cells, than the passes have.
pub fn least_cell(scene: &Scene) -> f64 {
    let light = light_of(scene);
    let scattered = light.scatter_deviations().into_iter().fold(0.0, f64::max) / MAX_SCATTER;
    beam::least_cell(scene).max(scattered).max(scene.least_cell_of_cones())
}

/// Computes the light that tissue scatters: a Gaussian along one axis in each dispatch.
pub(crate) const DIFFUSE: Pass = Pass {
    name: "light_diffuse",
    shader: |_, _| "light_volume/diffuse",
    needed: |s| match s.lit_by_volume() {
        Some(light) if light.scatter > 0.0 => Ok("tissue scatters light"),
        Some(_) => Err("tissue scatters no light"),
        None => need(s),
    },
    reads: |_, t| vec![whole("pyramid_1", Slot::LightPyramid1), whole("source", scattered(t.iteration))],
    writes: |_, t| vec![whole("target", scattered(t.iteration + 1))],
    extent: |s, _| count(s),
    repeat: |_| 3,
    params: |s, _| Params::default().vec3("narrowness", scatter(s).map(|deviation| 0.5 / (deviation * deviation))),
    constants: |s, t| {
        let widest = scatter(s).into_iter().fold(0.0, f64::max);
        vec![("AXIS", t.iteration as i32), ("RADIUS", (2.0 * widest).ceil() as i32)]
    },
    tolerance: Tolerance::absolute(1e-5)
        .relative(1e-3)
        .because("a mean with weights that are off by 1e-6 each; then RGBA16F"),
    reference: |scene, t, reads, writes| {
        let (pyramid, source) = (reads.get("pyramid_1"), reads.get("source"));
        let target = writes.get_mut("target");
        let deviations = scatter(scene);
        let radius = (2.0 * deviations.into_iter().fold(0.0, f64::max)).ceil() as i64;
        let axis = t.iteration as usize;
        for at in cells(size(scene)) {
            let mut mean: [f64; 4] = std::array::from_fn(|c| source.get(at)[c]);
            let [x, y, z] = at.map(|n| n / 2);
            if pyramid.one(x, y, z) > 0.0 {
                for (c, deviation) in deviations.iter().enumerate() {
                    let (mut sum, mut weights) = (0.0, 0.0);
                    for i in -radius..=radius {
                        let along = at[axis] as i64 + i;
                        if along < 0 || along >= source.size[axis] as i64 {
                            continue;
                        }
                        let mut tap = at;
                        tap[axis] = along as usize;
                        let share = (-0.5 * (i as f64 / deviation).powi(2)).exp() * (source.get(tap)[3] + FLUID);
                        sum += share * source.get(tap)[c];
                        weights += share;
                    }
                    mean[c] = sum / weights;
                }
            }
            target.set(at, &mean);
        }
    },
    ..MATTER
};

/// The light after so many of the three axes.
fn scattered(axes: u32) -> Slot {
    match axes {
        0 => Slot::LightArriving,
        2 => Slot::LightScatteredB,
        _ => Slot::LightScattered,
    }
}

/// Standard deviations over which red, green and blue light are scattered, cells; more than 0.
fn scatter(scene: &Scene) -> [f64; 3] {
    light_of(scene)
        .scatter_deviations()
        .map(|deviation| (deviation / scene.light_lattice().cell).clamp(0.05, MAX_SCATTER))
}

/// Computes, in cells of twice the edge, the ambient light that comes from the side of the probe, and adds the back light to it.
pub(crate) const AMBIENT: Pass = Pass {
    name: "light_ambient",
    shader: |_, _| "light_volume/ambient",
    reads: |s, _| {
        let cones = s.ambient_cones();
        let mut reads: Vec<Bind> = (0..).zip(PYRAMID).map(|(n, name)| whole(name, level(1 + cones.level(n)))).collect();
        reads.push(whole("around", Slot::LightPyramid2));
        reads.extend(beam::need_back(s).is_ok().then_some(whole("back_light", Slot::BackLight)));
        reads
    },
    writes: |_, _| vec![whole("ambient_light", Slot::LightAmbient)],
    extent: |s, _| count(s).map(|n| n / 2),
    repeat: once,
    params: |s, _| {
        let light = light_of(s);
        let unit = reach_unit(light);
        Params::default()
            .f32("absorption", light.ambient_extinction() * unit)
            .f32("density", 0.5 / s.light_lattice().cell * unit)
            .vec3("powers", light.ambient_powers())
            .f32("ambient", s.settings.light.ambient)
            .vec3("back_colour", light.back_colour.map(|c| c * light.back))
            .f32("wider", s.ambient_cones().wider)
    },
    constants: |s, _| {
        let cones = s.ambient_cones();
        vec![
            ("BACK", beam::need_back(s).is_ok() as i32),
            ("NARROWEST", cones.narrowest),
            ("BETWEEN", (cones.wider > 0.0) as i32),
        ]
    },
    tolerance: Tolerance::absolute(2e-5)
        .relative(1e-3)
        .because("a place is off by 1e-6 cells, a power by 1e-5 of what it is; then RGBA16F"),
    reference: |scene, _, reads, writes| {
        let light = light_of(scene);
        let unit = reach_unit(light);
        let density = 0.5 / scene.light_lattice().cell * unit;
        let target = writes.get_mut("ambient_light");
        let (pyramid, around, levels) =
            (PYRAMID.map(|name| reads.get(name)), reads.get("around"), scene.ambient_cones());
        let ambient = scene.settings.light.ambient;
        for at in cells(target.size) {
            let coarse: [usize; 3] = std::array::from_fn(|a| (at[a] / 2).min(around.size[a] - 1));
            let mut open = 1.0;
            if around.get(coarse)[0] > 0.0 {
                let share = |cone: DVec3| {
                    let matter: f64 = (0..4)
                        .map(|n| {
                            // The nth place in the cells of the mth level.
                            let sample = |n: usize, m: usize| {
                                let place: [f64; 3] = std::array::from_fn(|a| {
                                    let cells = at[a] as f64 + 0.5 + cone[a] * REACH[n] * density;
                                    cells / f64::from(1u32 << levels.level(m as i32)) - 0.5
                                });
                                pyramid[m].trilinear(clamped(place, pyramid[m]))
                            };
                            let mut found = sample(n, n);
                            if levels.wider > 0.0 && levels.narrowest + n as i32 >= 0 {
                                found += levels.wider * (sample(n, n + 1) - found);
                            }
                            found * LENGTH[n]
                        })
                        .sum();
                    (-light.ambient_extinction() * unit * matter).exp()
                };
                open = cones().into_iter().map(share).sum::<f64>() / 7.0;
            }
            let powers = light.ambient_powers();
            let mut rgba = [0.0, 0.0, 0.0, ambient * open];
            for c in 0..3 {
                rgba[c] = ambient * open.max(1e-6).powf(powers[c]);
                if beam::need_back(scene).is_ok() {
                    rgba[c] += light.back * light.back_colour[c] * reads.get("back_light").get(at)[c];
                }
            }
            target.set(at, &rgba);
        }
    },
    ..MATTER
};

/// What the shader calls the levels that the cones run through.
const PYRAMID: [&str; 5] = ["pyramid_1", "pyramid_2", "pyramid_3", "pyramid_4", "pyramid_5"];

/// The length that [`REACH`] and [`LENGTH`] count in, mm.
fn reach_unit(light: LightVolume) -> f64 {
    light.reach / REACH[3]
}

/// Directions towards the probe: one along depth, six around it.
fn cones() -> [DVec3; 7] {
    std::array::from_fn(|n| match n {
        0 => DVec3::NEG_Y,
        _ => {
            let (sin, cos) = ((n - 1) as f64 * std::f64::consts::FRAC_PI_3).sin_cos();
            DVec3::new(0.8 * cos, -0.6, 0.8 * sin)
        }
    })
}

/// Computes for each cell of the light volume the light that it scatters towards the viewer, and its orientation: the unit vector towards weaker
/// echoes, times its certainty (0..1).
pub const SHADE: Pass = Pass {
    name: "light_shade",
    shader: |_, _| "light_volume/shade",
    reads: |s, _| {
        let arriving = if (DIFFUSE.needed)(s).is_ok() { Slot::LightScattered } else { Slot::LightArriving };
        vec![
            whole("matter", Slot::LightMatter),
            whole("pyramid_1", Slot::LightPyramid1),
            whole("arriving", arriving),
            whole("ambient_light", Slot::LightAmbient),
        ]
    },
    writes: |_, _| vec![whole("light_shade", Slot::LightShade), whole("light_normals", Slot::LightNormals)],
    extent: |s, _| count(s),
    repeat: once,
    params: |s, _| {
        let (light, volume) = (&s.settings.light, light_of(s));
        Params::default()
            .vec3("towards", s.light_direction(light.direction))
            .f32("diffuse", light.diffuse)
            .vec3("light_colour", light.colour)
            .vec3("wrap", wrap(volume.wrap))
            .f32("relief", volume.relief)
            .f32("cell", s.light_lattice().cell)
            .f32("slope", volume.slope)
    },
    constants: no_constants,
    tolerance: Tolerance::absolute(2e-4)
        .relative(2e-3)
        .outliers(2e-3)
        .because("differences of echoes in f32, an orientation where they nearly cancel; then RGBA16F"),
    reference: |scene, _, reads, writes| {
        let (light, volume, cell) = (&scene.settings.light, light_of(scene), scene.light_lattice().cell);
        let towards = scene.light_direction(light.direction);
        let wrap = wrap(volume.wrap);
        let (matter, pyramid) = (reads.get("matter"), reads.get("pyramid_1"));
        let ambient_light = reads.get("ambient_light");
        for at in cells(size(scene)) {
            let (mut shade, mut oriented) = ([0.0; 4], [0.0; 4]);
            let [x, y, z] = at.map(|n| n / 2);
            if pyramid.one(x, y, z) > 0.0 {
                let gradient = slope_at(matter, at) / cell;
                let steep = gradient.length();
                let normal = if steep > 1e-9 * volume.slope { -gradient / steep } else { DVec3::ZERO };
                let certain = (steep / volume.slope).min(1.0);
                let wrapped = ((DVec3::splat(normal.dot(towards)) + wrap) / (1.0 + wrap)).max(DVec3::ZERO);
                let arriving = reads.get("arriving").get(at);
                let place: [f64; 3] = std::array::from_fn(|a| (at[a] as f64 + 0.5) / 2.0 - 0.5);
                let ambient = ambient_light.interpolated(clamped(place, ambient_light));
                for c in 0..3 {
                    let facing = 1.0 + certain * volume.relief * (1.6 * wrapped[c] - 1.0);
                    shade[c] = light.colour[c] * (light.diffuse * arriving[c] * facing + ambient[c]);
                    oriented[c] = certain * normal[c];
                }
                shade[3] = ambient[3];
                oriented[3] = arriving[1] * light.colour[1];
            }
            writes.get_mut("light_shade").set(at, &shade);
            writes.get_mut("light_normals").set(at, &oriented);
        }
    },
    ..MATTER
};

/// Difference of the echo over one cell along each axis, weighted by (1, 2, 1) along the other two.
fn slope_at(matter: &Texels, at: [usize; 3]) -> DVec3 {
    let echo = |away: [i64; 3]| {
        let tap = std::array::from_fn(|a| (at[a] as i64 + away[a]).clamp(0, matter.size[a] as i64 - 1) as usize);
        matter.get(tap)[1]
    };
    let along = |axis: usize| {
        let mut sum = 0.0;
        for (i, j) in (-1..=1).flat_map(|j| (-1..=1).map(move |i| (i, j))) {
            let weight = f64::from((2 - i32::abs(i)) * (2 - i32::abs(j)));
            let tap = |step: i64| {
                let mut away = [0; 3];
                (away[axis], away[(axis + 1) % 3], away[(axis + 2) % 3]) = (step, i64::from(i), i64::from(j));
                echo(away)
            };
            sum += weight * (tap(1) - tap(-1));
        }
        sum / 32.0
    };
    DVec3::new(along(0), along(1), along(2))
}

/// A place in texels, moved to the nearest texel's centre where it is beyond them.
fn clamped(place: [f64; 3], texels: &Texels) -> [f64; 3] {
    std::array::from_fn(|a| place[a].clamp(0.0, (texels.size[a] - 1) as f64))
}
