//! The light volume: a lattice of cells over the region. In it light is absorbed by the opacity of the transfer function, widens, and is
//! scattered (half angle slicing, Kniss et al. 2003; extinction pyramids, Schlegel, Makhinya and Pajarola 2011). It does not depend on the
//! view unless the light follows the camera. Volume rendering takes the light of each sample from it.

use super::raycast::ray;
use crate::passes::lookup_tables::transfer_of;
use crate::passes::pass::*;
use crate::passes::shade::wrap;
use crate::passes::slots::Shape;
use crate::scene::{Ground, LightLattice, LightVolume, Mode, Propagation, Scene};
use glam::DVec3;

/// Density that fluid counts as where light is scattered: FLUID of diffuse.comp.
const FLUID: f64 = 0.0015;
/// Most cells between two of that kernel.
const MAX_STRIDE: u32 = 16;
/// Largest standard deviation of scattered light, cells.
const MAX_SCATTER: f64 = 48.0;
/// Smallest and largest variance of the kernel of propagate.comp, cells^2, for which no weight is negative; the largest by the square of its stride.
const VARIANCES: [f64; 2] = [0.25, 0.75];
/// Layers of a dispatch of propagate_layers.comp, and the shared memory that it takes, bytes: a float for each of three colours, in
/// 32 x 32 cells of two layers.
const LAYERS: u32 = 8;
const LAYERS_MEMORY: u32 = 2 * 3 * 4 * 32 * 32;
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

fn need_back(scene: &Scene) -> Need {
    match scene.lit_by_volume() {
        Some(light) if light.back > 0.0 => Ok("a light shines from behind"),
        Some(_) => Err("the back light has no strength"),
        None => need(scene),
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

fn cells(scene: &Scene) -> [u32; 3] {
    scene.light_lattice().count
}

/// The density and the echo of each cell; beyond the box, those at its faces. Matter does not fade towards the faces of the region here: what it cuts lies in the shade of what is beyond.
pub(crate) const MATTER: Pass = Pass {
    name: "light_matter",
    stage: Stage::Raycast,
    frequency: Frequency::Picture,
    link: Link::None,
    shader: |_, _| "light_volume/matter",
    needed: need,
    reads: |s, _| {
        let mut reads = ray::reads(s);
        reads.push(whole("transfer", Slot::Transfer));
        reads
    },
    writes: |_, _| vec![whole("matter", Slot::LightMatter)],
    extent: |s, _| cells(s),
    repeat: once,
    params: |s, _| {
        let lattice = s.light_lattice();
        ray::unmoved_params(s, s.volume_view())
            .vec3("light_low", s.to_local(lattice.low))
            .f32("cell", lattice.cell)
            .f32("density", density(s))
    },
    constants: |s, _| {
        let mut constants = ray::constants(s);
        constants.retain(|(name, _)| !["SPREAD", "MIRRORED"].contains(name));
        constants.push(("ENTRIES", s.transfer_entries() as i32));
        constants.push(("TAPS", light_of(s).taps as i32));
        constants
    },
    tolerance: Tolerance {
        absolute: 4e-3,
        relative: 0.0,
        outliers: 4e-3,
        why: "a place is off by 1e-5 mm in f32, so a sample by as much of a voxel's contrast, which the transfer function multiplies; a \
              cell at the very border of the sector or the box may fall on either side",
    },
    reference: |scene, _, reads, writes| {
        let volume = reads.get("volume");
        let table = transfer_of(scene);
        let (lattice, taps, view) = (scene.light_lattice(), light_of(scene).taps, scene.volume_view());
        let (density, parts) = (density(scene), f64::from(taps.pow(3)));
        let target = writes.get_mut("matter");
        for_cells(lattice.count, |at| {
            let (mut dense, mut echo) = (0.0, 0.0);
            for n in 0..taps.pow(3) {
                let tap =
                    [n % taps, n / taps % taps, n / taps.pow(2)].map(|tap| (f64::from(tap) + 0.5) / f64::from(taps));
                let place = lattice.place(std::array::from_fn(|a| at[a] as f64 + tap[a])).clamp(view.low, scene.high);
                let is_kept = scene.clips().all(|(normal, limit)| normal.dot(place) <= limit);
                let Some(texel) = ray::texel_beyond_sweep(scene, place).filter(|_| is_kept) else { continue };
                let value = ray::interpolated(scene, volume, texel);
                let [low, high] = view.window;
                let entry = ((value - low) / (high - low)).clamp(0.0, 1.0) * (table.len() - 1) as f64;
                let n = (entry as usize).min(table.len() - 2);
                let absorption = table[n][3] + (table[n + 1][3] - table[n][3]) * (entry - n as f64);
                dense += absorption;
                echo += value;
            }
            target.set(at, &[(density * dense / parts).min(1.0), echo / parts]);
        });
    },
};

/// The levels of the pyramid, one after the other.
pub(crate) const REDUCE: Pass = Pass {
    name: "light_reduce",
    shader: |_, _| "light_volume/reduce",
    reads: |_, t| vec![whole("source", level(t.iteration))],
    writes: |_, t| vec![whole("target", level(t.iteration + 1))],
    extent: |s, t| cells(s).map(|n| n.div_ceil(2 << t.iteration)),
    repeat: |s| s.ambient_cones().levels(),
    params: |_, _| Params::default(),
    constants: no_constants,
    tolerance: Tolerance {
        absolute: 1e-6,
        relative: 6e-4,
        outliers: 0.0,
        why: "64 terms in f32, none negative; then R16F",
    },
    reference: |_, _, reads, writes| {
        let source = reads.get("source");
        let target = writes.get_mut("target");
        let taps = [(-1, 1.0), (0, 3.0), (1, 3.0), (2, 1.0)];
        for_cells(target.size.map(|n| n as u32), |at| {
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
        });
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

/// Smallest edge of a cell, mm, at which the light is the requested one. In smaller cells kernels and cones would have to be wider than
/// they can be.
pub fn least_cell(scene: &Scene) -> f64 {
    let light = light_of(scene);
    let scattered = light.scatter_deviations().into_iter().fold(0.0, f64::max) / MAX_SCATTER;
    let beam = |beam: &Beam| {
        let most = VARIANCES[1] * f64::from(MAX_STRIDE.pow(2));
        light.widening.powi(2) * beam.propagation(scene).path / most
    };
    beam(&KEY).max(scattered).max(scene.least_cell_of_cones())
}

/// One of the lights that are propagated.
struct Beam {
    matter: Slot,
    fronts: [Slot; 2],
    arriving: Slot,
    is_back: bool,
}

const KEY: Beam = Beam {
    matter: Slot::LightMatter,
    fronts: [Slot::LightFrontA, Slot::LightFrontB],
    arriving: Slot::LightArriving,
    is_back: false,
};
const BACK: Beam = Beam {
    matter: Slot::LightPyramid1,
    fronts: [Slot::BackFrontA, Slot::BackFrontB],
    arriving: Slot::BackLight,
    is_back: true,
};

impl Beam {
    fn propagation(&self, scene: &Scene) -> Propagation {
        let direction = if self.is_back { light_of(scene).back_direction } else { scene.settings.light.direction };
        Propagation::new(scene.light_direction(direction))
    }

    fn cells(&self, scene: &Scene) -> [u32; 3] {
        cells(scene).map(|n| if self.is_back { n / 2 } else { n })
    }

    fn cell(&self, scene: &Scene) -> f64 {
        scene.light_lattice().cell * if self.is_back { 2.0 } else { 1.0 }
    }

    fn layers(&self, scene: &Scene) -> u32 {
        self.cells(scene)[self.propagation(scene).axis]
    }

    /// Several layers a dispatch where workgroups have memory of their own: on a GPU. A stride would need a wider border of each.
    fn layers_at_once(&self, scene: &Scene) -> u32 {
        if LAYERS_MEMORY <= scene.shared_memory && self.stride(scene) == 1 { LAYERS } else { 1 }
    }

    fn shader(&self, scene: &Scene) -> &'static str {
        if self.layers_at_once(scene) > 1 { "light_volume/propagate_layers" } else { "light_volume/propagate" }
    }

    fn dispatches(&self, scene: &Scene) -> u32 {
        self.layers(scene).div_ceil(self.layers_at_once(scene))
    }

    /// The layers that a dispatch lights, in order: the light's end of the axis comes first.
    fn lit_layers(&self, scene: &Scene, args: &DispatchArgs) -> Vec<u32> {
        let (all, each) = (self.layers(scene), self.layers_at_once(scene));
        let first = args.iteration * each;
        let from_high = self.propagation(scene).from_high;
        (first..(first + each).min(all)).map(|n| if from_high { all - 1 - n } else { n }).collect()
    }

    fn reads(&self, args: &DispatchArgs) -> Vec<Bind> {
        let mut reads = vec![whole("matter", self.matter)];
        reads.extend((args.iteration > 0).then(|| whole("front", self.fronts[(args.iteration as usize + 1) % 2])));
        reads
    }

    fn writes(&self, args: &DispatchArgs) -> Vec<Bind> {
        vec![whole("next_front", self.fronts[args.iteration as usize % 2]), whole("arriving", self.arriving)]
    }

    fn extent(&self, scene: &Scene) -> [u32; 3] {
        let Shape::Two([width, height]) = self.fronts[0].shape(scene) else { return [1; 3] };
        [width, height, 1]
    }

    /// Of the kernel, cells^2.
    fn variance(&self, scene: &Scene) -> f64 {
        let [low, high] = VARIANCES;
        self.widening(scene).clamp(low, high * f64::from(self.stride(scene).pow(2)))
    }

    /// Variance that a layer adds, cells^2.
    fn widening(&self, scene: &Scene) -> f64 {
        light_of(scene).widening.powi(2) * self.propagation(scene).path / self.cell(scene)
    }

    /// Cells between two of the kernel: the fewest that its variance needs. Small cells need more than one.
    fn stride(&self, scene: &Scene) -> u32 {
        // The slack is that of rounding.
        ((self.widening(scene) / VARIANCES[1]).sqrt() - 1e-9).ceil().clamp(1.0, f64::from(MAX_STRIDE)) as u32
    }

    /// The share of the outermost layers that is within the box: what is beyond it absorbs nothing on the way in.
    fn outer_share(&self, scene: &Scene) -> f64 {
        let axis = self.propagation(scene).axis;
        scene.light_lattice().outer_share(axis, self.layers(scene), self.cell(scene))
    }

    /// The share of a layer that absorbs.
    fn share(&self, scene: &Scene, layer: u32) -> f64 {
        let is_outer = layer == 0 || layer + 1 == self.layers(scene);
        if is_outer { self.outer_share(scene) } else { 1.0 }
    }

    /// Absorption of red, green and blue over the path through one layer of density 1.
    fn absorption(&self, scene: &Scene) -> [f64; 3] {
        let light = light_of(scene);
        let extinction = if self.is_back { light.back_extinction() } else { light.extinction() };
        extinction.map(|e| e * self.propagation(scene).path * self.cell(scene))
    }

    fn constants(&self, scene: &Scene, args: &DispatchArgs) -> Vec<(&'static str, i32)> {
        vec![
            ("AXIS", self.propagation(scene).axis as i32),
            ("FIRST", i32::from(args.iteration == 0)),
            ("STRIDE", self.stride(scene) as i32),
        ]
    }

    fn params(&self, scene: &Scene, args: &DispatchArgs) -> Params {
        let (found, layers) = (self.propagation(scene), self.lit_layers(scene, args));
        let first = layers.first().copied().unwrap_or(0);
        let mut params = Params::default().i32("layer", first);
        let share = match self.layers_at_once(scene) > 1 {
            true => {
                params = params
                    .i32("from_high", found.from_high.into())
                    .i32("count", layers.len() as u32)
                    .i32("last_layer", self.layers(scene) - 1)
                    .f32("outer_share", self.outer_share(scene));
                1.0
            }
            false => self.share(scene, first),
        };
        params
            .vec2("shift", found.shift)
            .f32("variance", self.variance(scene))
            .vec3("absorption", self.absorption(scene).map(|a| a * share))
    }

    fn reference(&self, scene: &Scene, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
        let found = self.propagation(scene);
        let [width, height, _] = self.extent(scene).map(|n| n as usize);
        let (absorption, variance, stride) = (self.absorption(scene), self.variance(scene), self.stride(scene));
        // The share of each of three cells, with the mean and the variance asked for.
        let shares = |shift: f64| {
            let (spread, off) = ((variance + shift * shift) / f64::from(stride.pow(2)), shift / f64::from(stride));
            [(spread - off) / 2.0, 1.0 - spread, (spread + off) / 2.0]
        };
        let whole = found.shift.map(|shift| (shift + 0.5).floor());
        let [across, down] = [0, 1].map(|a| shares(found.shift[a] - whole[a]));
        let mut front = (args.iteration > 0).then(|| reads.get("front").clone());
        for layer in self.lit_layers(scene, args) {
            let mut next = Texels::untouched([width, height, 1], 4);
            let share = self.share(scene, layer);
            for (u, v) in (0..height).flat_map(|v| (0..width).map(move |u| (u, v))) {
                let layer = layer as usize;
                let cell = match found.axis {
                    0 => [layer, u, v],
                    1 => [u, layer, v],
                    _ => [u, v, layer],
                };
                let mut light = [1.0; 3];
                if let Some(front) = &front {
                    light = [0.0; 3];
                    for (i, j) in (0..3).flat_map(|j| (0..3).map(move |i| (i, j))) {
                        let tap = |at: usize, whole: f64, n: usize, size: usize| {
                            (at as i64 + whole as i64 + i64::from(stride) * (n as i64 - 1)).clamp(0, size as i64 - 1)
                                as usize
                        };
                        let from = front.get([tap(u, whole[0], i, width), tap(v, whole[1], j, height), 0]);
                        light.iter_mut().zip(from).for_each(|(light, from)| *light += across[i] * down[j] * from);
                    }
                }
                let dense = reads.get("matter").get(cell)[0];
                let half: [f64; 3] = absorption.map(|a| (-0.5 * a * share * dense).exp());
                let there: [f64; 3] = std::array::from_fn(|c| light[c] * half[c]);
                let on: [f64; 3] = std::array::from_fn(|c| there[c] * half[c]);
                writes.get_mut("arriving").set(cell, &[there[0], there[1], there[2], dense]);
                next.set([u, v, 0], &[on[0], on[1], on[2], 1.0]);
            }
            front = Some(next);
        }
        if let Some(front) = front {
            let target = writes.get_mut("next_front");
            for (u, v) in (0..height).flat_map(|v| (0..width).map(move |u| (u, v))) {
                target.set([u, v, 0], front.get([u, v, 0]));
            }
        }
    }
}

/// The light that `light.direction` names, layer by layer, or several layers at once.
pub(crate) const PROPAGATE: Pass = Pass {
    name: "light_propagate",
    shader: |s, _| KEY.shader(s),
    reads: |_, t| KEY.reads(t),
    writes: |_, t| KEY.writes(t),
    extent: |s, _| KEY.extent(s),
    repeat: |s| KEY.dispatches(s),
    params: |s, t| KEY.params(s, t),
    constants: |s, t| KEY.constants(s, t),
    tolerance: Tolerance {
        absolute: 1e-6,
        relative: 6e-4,
        outliers: 0.0,
        why: "nine terms in f32 a layer, none negative; then RGBA16F",
    },
    reference: |s, t, reads, writes| KEY.reference(s, t, reads, writes),
    ..MATTER
};

/// The back light, in larger cells.
pub(crate) const PROPAGATE_BACK: Pass = Pass {
    name: "light_propagate_back",
    needed: need_back,
    reads: |_, t| BACK.reads(t),
    writes: |_, t| BACK.writes(t),
    extent: |s, _| BACK.extent(s),
    shader: |s, _| BACK.shader(s),
    repeat: |s| BACK.dispatches(s),
    params: |s, t| BACK.params(s, t),
    constants: |s, t| BACK.constants(s, t),
    reference: |s, t, reads, writes| BACK.reference(s, t, reads, writes),
    ..PROPAGATE
};

/// Light that tissue scatters, along one axis a dispatch.
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
    extent: |s, _| cells(s),
    repeat: |_| 3,
    params: |s, _| Params::default().vec3("narrowness", scatter(s).map(|deviation| 0.5 / (deviation * deviation))),
    constants: |s, t| {
        let widest = scatter(s).into_iter().fold(0.0, f64::max);
        vec![("AXIS", t.iteration as i32), ("RADIUS", (2.0 * widest).ceil() as i32)]
    },
    tolerance: Tolerance {
        absolute: 1e-5,
        relative: 1e-3,
        outliers: 0.0,
        why: "a mean with weights that are off by 1e-6 each; then RGBA16F",
    },
    reference: |scene, t, reads, writes| {
        let (pyramid, source) = (reads.get("pyramid_1"), reads.get("source"));
        let target = writes.get_mut("target");
        let deviations = scatter(scene);
        let radius = (2.0 * deviations.into_iter().fold(0.0, f64::max)).ceil() as i64;
        let axis = t.iteration as usize;
        for_cells(cells(scene), |at| {
            let light = source.get(at);
            let mut mean = [light[0], light[1], light[2], light[3]];
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
        });
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

/// Light from everywhere above, and from behind.
pub(crate) const AMBIENT: Pass = Pass {
    name: "light_ambient",
    shader: |_, _| "light_volume/ambient",
    reads: |s, _| {
        let cones = s.ambient_cones();
        let mut reads: Vec<Bind> = (0..).zip(PYRAMID).map(|(n, name)| whole(name, level(1 + cones.level(n)))).collect();
        reads.push(whole("around", Slot::LightPyramid2));
        reads.extend(need_back(s).is_ok().then_some(whole("back_light", Slot::BackLight)));
        reads
    },
    writes: |_, _| vec![whole("ambient_light", Slot::LightAmbient)],
    extent: |s, _| cells(s).map(|n| n / 2),
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
            ("BACK", need_back(s).is_ok() as i32),
            ("NARROWEST", cones.narrowest),
            ("BETWEEN", (cones.wider > 0.0) as i32),
        ]
    },
    tolerance: Tolerance {
        absolute: 2e-5,
        relative: 1e-3,
        outliers: 0.0,
        why: "a place is off by 1e-6 cells, a power by 1e-5 of what it is; then RGBA16F",
    },
    reference: |scene, _, reads, writes| {
        let light = light_of(scene);
        let unit = reach_unit(light);
        let density = 0.5 / scene.light_lattice().cell * unit;
        let target = writes.get_mut("ambient_light");
        let (pyramid, around, levels) =
            (PYRAMID.map(|name| reads.get(name)), reads.get("around"), scene.ambient_cones());
        let ambient = scene.settings.light.ambient;
        for_cells(target.size.map(|n| n as u32), |at| {
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
                if need_back(scene).is_ok() {
                    rgba[c] += light.back * light.back_colour[c] * reads.get("back_light").get(at)[c];
                }
            }
            target.set(at, &rgba);
        });
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

/// Computes the light that leaves each cell, and the cell's orientation: the unit vector towards weaker echoes, times its certainty (0..1).
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
    extent: |s, _| cells(s),
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
    tolerance: Tolerance {
        absolute: 2e-4,
        relative: 2e-3,
        outliers: 2e-3,
        why: "differences of echoes in f32, an orientation where they nearly cancel; then RGBA16F",
    },
    reference: |scene, _, reads, writes| {
        let (light, volume, cell) = (&scene.settings.light, light_of(scene), scene.light_lattice().cell);
        let towards = scene.light_direction(light.direction);
        let wrap = wrap(volume.wrap);
        let (matter, pyramid) = (reads.get("matter"), reads.get("pyramid_1"));
        let ambient_light = reads.get("ambient_light");
        for_cells(cells(scene), |at| {
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
        });
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

fn for_cells(count: [u32; 3], mut of: impl FnMut([usize; 3])) {
    let [width, height, depth] = count.map(|n| n as usize);
    for z in 0..depth {
        for y in 0..height {
            (0..width).for_each(|x| of([x, y, z]));
        }
    }
}

/// Reciprocal of the length over which matter fades towards the faces of the region; 0 if it does not.
pub(super) fn fade_density(scene: &Scene) -> f64 {
    scene.region_fade().map_or(0.0, |fade| 1.0 / fade)
}

/// What a pass that composites reads of the light volume.
pub(super) fn reads(scene: &Scene) -> Vec<Bind> {
    let filtered = scene.filters_in_hardware();
    match scene.lit_by_volume() {
        Some(_) => [("light_shade", Slot::LightShade), ("light_normals", Slot::LightNormals)]
            .map(|(name, slot)| Bind { filtered, ..whole(name, slot) })
            .to_vec(),
        None => Vec::new(),
    }
}

/// Adds the numbers of the light volume to those of a pass that composites.
pub(super) fn params(scene: &Scene, params: Params) -> Params {
    let light = &scene.settings.light;
    let volume = light_of(scene);
    let ground = volume.ground.unwrap_or_default();
    let (low, density) = match scene.lit_by_volume() {
        Some(_) => (scene.light_lattice().low, 1.0 / scene.light_lattice().cell),
        None => (scene.local_origin(), 0.0),
    };
    params
        .f32("fade_density", fade_density(scene))
        .vec3("light_low", scene.to_local(low))
        .f32("light_density", density)
        .vec3("light_towards", scene.light_direction(light.direction))
        .vec3("light_colour", light.colour)
        .f32("specular", light.specular)
        .f32("shininess", light.shininess)
        .f32("exposure", volume.exposure)
        .vec3("ground_middle", ground.middle)
        .vec3("ground_edge", ground.edge)
}

/// Constants of a pass that composites; `is_alone`: what it makes fills the picture.
pub(super) fn constants(scene: &Scene, is_alone: bool) -> [(&'static str, i32); 4] {
    [
        ("FADE", scene.region_fade().is_some() as i32),
        ("LIT", scene.lit_by_volume().is_some() as i32),
        ("LIT_STEPS", scene.lit_steps() as i32),
        ("GROUND", ground_of(scene, is_alone).is_some() as i32),
    ]
}

fn ground_of(scene: &Scene, is_alone: bool) -> Option<Ground> {
    scene.lit_by_volume().filter(|_| is_alone)?.ground
}

/// The light of a ray through a place of the picture, rays from its corner, as it is shown: through the response curve, premultiplied.
pub(super) fn developed(scene: &Scene, is_alone: bool, rgba: [f64; 4], at: [f64; 2]) -> [f64; 4] {
    match scene.lit_by_volume() {
        Some(volume) => on_film(scene, volume.exposure, ground_of(scene, is_alone), rgba, at),
        None => rgba,
    }
}

/// Colour of a ray that meets no matter, through a position of the picture in rays from its corner. None without a ground.
pub fn bare_ground(scene: &Scene, at: [f64; 2]) -> Option<[f64; 3]> {
    let is_alone = scene.settings.mode == Mode::Volume && !scene.lights_volume() && scene.still().is_none();
    ground_of(scene, is_alone)?;
    let [r, g, b, _] = developed(scene, true, [0.0; 4], at);
    Some([r, g, b])
}

/// Linear light of a ray through a place of the picture, rays from its corner, premultiplied: through the response curve and over the ground.
pub(super) fn on_film(scene: &Scene, exposure: f64, ground: Option<Ground>, rgba: [f64; 4], at: [f64; 2]) -> [f64; 4] {
    let film = |light: f64| {
        let c = light * exposure;
        (c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14)).clamp(0.0, 1.0).powf(1.0 / 2.2)
    };
    let opacity = rgba[3];
    let Some(ground) = ground else {
        let shown = |c: usize| if opacity > 0.0 { opacity * film(rgba[c] / opacity) } else { 0.0 };
        return [shown(0), shown(1), shown(2), opacity];
    };
    let size = scene.ray_size().map(f64::from);
    let edge = size[0].min(size[1]);
    let [right, down] = [0, 1].map(|a| (at[a] - size[a] / 2.0) / edge + if a == 1 { 0.05 } else { 0.0 });
    let share = (1.0 - 2.6 * (right * right + down * down)).clamp(0.0, 1.0);
    let shown =
        |c: usize| film(rgba[c] + (1.0 - opacity) * (ground.edge[c] + (ground.middle[c] - ground.edge[c]) * share));
    [shown(0), shown(1), shown(2), 1.0]
}

/// The light volume as the reference of a pass that composites sees it.
pub(super) struct Lit<'a> {
    shade: &'a Texels,
    normals: &'a Texels,
    lattice: LightLattice,
    towards: DVec3,
}

/// Share of the ambient light that a grazing view adds: SHEEN of lit.glsl.
const SHEEN: f64 = 0.3;

impl<'a> Lit<'a> {
    pub fn new(scene: &Scene, reads: &'a Arrays) -> Option<Lit<'a>> {
        scene.lit_by_volume()?;
        Some(Lit {
            shade: reads.get("light_shade"),
            normals: reads.get("light_normals"),
            lattice: scene.light_lattice(),
            towards: scene.light_direction(scene.settings.light.direction),
        })
    }

    /// Light that white matter at a position scatters along a unit direction, without a highlight.
    pub fn scattered(&self, place: DVec3, along: DVec3) -> [f64; 3] {
        let cells = (place - self.lattice.low) / self.lattice.cell - 0.5;
        let at = clamped(cells.to_array(), self.shade);
        let (shade, oriented) = (self.shade.interpolated(at), self.normals.interpolated(at));
        let direction = DVec3::new(oriented[0], oriented[1], oriented[2]);
        let grazing = match direction.length() {
            certain if certain < 1e-4 => 0.0,
            certain => 1.0 - (-direction.dot(along) / certain).max(0.0),
        };
        std::array::from_fn(|c| shade[c] + shade[3] * SHEEN * grazing.powi(3))
    }

    /// Light of matter of this colour at a position in space, seen along a unit direction.
    pub fn light(&self, scene: &Scene, albedo: [f64; 3], place: DVec3, along: DVec3) -> [f64; 3] {
        let cells = (place - self.lattice.low) / self.lattice.cell - 0.5;
        let at = clamped(cells.to_array(), self.shade);
        let (shade, oriented) = (self.shade.interpolated(at), self.normals.interpolated(at));
        let direction = DVec3::new(oriented[0], oriented[1], oriented[2]);
        let certain = direction.length();
        if certain < 1e-4 {
            return std::array::from_fn(|c| albedo[c] * shade[c]);
        }
        let normal = direction / certain;
        let halfway = (self.towards - along).try_normalize().unwrap_or(DVec3::ZERO);
        let gloss = if normal.dot(self.towards) > 0.0 { normal.dot(halfway).max(0.0) } else { 0.0 };
        let light = &scene.settings.light;
        let grazing = 1.0 - (-normal.dot(along)).max(0.0);
        let highlight = light.specular * gloss.powf(light.shininess) * certain * oriented[3];
        std::array::from_fn(|c| {
            albedo[c] * (shade[c] + shade[3] * SHEEN * grazing.powi(3)) + highlight * light.colour[c]
        })
    }
}
