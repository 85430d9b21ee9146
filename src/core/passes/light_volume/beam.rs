//! Light that is propagated through the light volume, layer by layer: that of the key light, and of one behind.

use super::{MATTER, count, light_of, need};
use crate::passes::pass::*;
use crate::passes::slots::Shape;
use crate::scene::{Propagation, Scene};

/// Most cells between two of the kernel.
const MAX_STRIDE: u32 = 16;
/// Smallest and largest variance of the kernel of propagate.comp, cells^2, for which no weight is negative; the largest by the square of its stride.
const VARIANCES: [f64; 2] = [0.25, 0.75];
/// Layers of a dispatch of propagate_layers.comp, and cells of a workgroup's region, each with an invocation. A workgroup lights a tile of a quarter
/// of them; the others lie around it.
const LAYERS: u32 = 8;
const REGION_CELLS: u32 = 32 * 32;
/// Shared memory of a workgroup, bytes: a float for each of three colours, in two layers.
const LAYERS_MEMORY: u32 = 2 * 3 * 4 * REGION_CELLS;

pub(super) fn need_back(scene: &Scene) -> Need {
    match scene.lit_by_volume() {
        Some(light) if light.back > 0.0 => Ok("a light shines from behind"),
        Some(_) => Err("the back light has no strength"),
        None => need(scene),
    }
}

/// Smallest edge of a cell, mm, at which the widest kernel still spreads the key light as far as requested.
pub(super) fn least_cell(scene: &Scene) -> f64 {
    let most = VARIANCES[1] * f64::from(MAX_STRIDE.pow(2));
    light_of(scene).widening.powi(2) * KEY.propagation(scene).path / most
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
        count(scene).map(|n| if self.is_back { n / 2 } else { n })
    }

    fn cell(&self, scene: &Scene) -> f64 {
        scene.light_lattice().cell * if self.is_back { 2.0 } else { 1.0 }
    }

    fn layers(&self, scene: &Scene) -> u32 {
        self.cells(scene)[self.propagation(scene).axis]
    }

    /// Several layers a dispatch where workgroups have memory of their own: on a GPU. A stride would need a wider border of each.
    fn layers_at_once(&self, scene: &Scene) -> u32 {
        let fits = LAYERS_MEMORY <= scene.device.shared_memory && REGION_CELLS <= scene.device.invocations;
        if fits && self.stride(scene) == 1 { LAYERS } else { 1 }
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

    /// Cells of a layer along both of its axes.
    fn front_size(&self, scene: &Scene) -> [u32; 2] {
        match self.fronts[0].shape(scene) {
            Shape::Two(size) => size,
            _ => [1; 2],
        }
    }

    fn extent(&self, scene: &Scene) -> [u32; 3] {
        let [width, height] = self.front_size(scene);
        // Regions of several layers overlap: an edge is twice that of the tile within it.
        let along = if self.layers_at_once(scene) > 1 { 2 } else { 1 };
        [along * width, along * height, 1]
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
        let [width, height] = self.front_size(scene).map(|n| n as usize);
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
            for (u, v) in pixels([width, height]) {
                let layer = layer as usize;
                let cell = match found.axis {
                    0 => [layer, u, v],
                    1 => [u, layer, v],
                    _ => [u, v, layer],
                };
                let mut light = [if front.is_some() { 0.0 } else { 1.0 }; 3];
                if let Some(front) = &front {
                    for (i, j) in pixels([3, 3]) {
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
            writes.get_mut("next_front").set_layer(0, &front);
        }
    }
}

/// Propagates the light from `light.direction` through the lattice: one layer, or several, a dispatch.
pub(crate) const PROPAGATE: Pass = propagate::<0>("light_propagate", need);

/// Propagates the back light, in cells of twice the edge.
pub(crate) const PROPAGATE_BACK: Pass = propagate::<1>("light_propagate_back", need_back);

/// The lights that the passes propagate. A pass refers to its light by number, because its functions can capture nothing but constants.
const BEAMS: [Beam; 2] = [KEY, BACK];

const fn propagate<const BEAM: usize>(name: &'static str, needed: fn(&Scene) -> Need) -> Pass {
    Pass {
        name,
        needed,
        shader: |s, _| BEAMS[BEAM].shader(s),
        reads: |_, t| BEAMS[BEAM].reads(t),
        writes: |_, t| BEAMS[BEAM].writes(t),
        extent: |s, _| BEAMS[BEAM].extent(s),
        repeat: |s| BEAMS[BEAM].dispatches(s),
        params: |s, t| BEAMS[BEAM].params(s, t),
        constants: |s, t| BEAMS[BEAM].constants(s, t),
        tolerance: Tolerance::absolute(1e-6)
            .relative(6e-4)
            .because("nine terms in f32 a layer, none negative; then RGBA16F"),
        reference: |s, t, reads, writes| BEAMS[BEAM].reference(s, t, reads, writes),
        ..MATTER
    }
}
