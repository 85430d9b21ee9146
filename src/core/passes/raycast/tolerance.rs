//! Volume rendering with an error that every pixel states. Regions get as many rays, and rays as many steps, as keep the error below a
//! tolerance.
//!
//! Light is integrated between every two samples of a ray, as if the value went evenly from one to the other: by the integral of the transfer function over the
//! values ([`Slot::TransferIntegral`]), so that no thin shell of it is missed. From the same samples it is integrated between every second, beginning with
//! the first and with the next. The larger difference after toning is the error that is stated: in smooth matter three times the error of the shorter steps, and where samples hit detail by chance the two coarse sums tell by how much chance decides. The shade that a step casts on itself is not in its integral, and is added to
//! the error as far as colours differ at its ends. A ray halves its steps as often as its error needs.
//!
//! [`FIRST`] casts a ray through every other pixel of every other row, [`ENLARGE`] takes the means of these for the pixels between and states how far they may be
//! off by how much the picture bends from ray to ray, [`LIST`] lists the pixels whose error is too large, and `REFINE` casts their own rays; as many workgroups of
//! it run as the list fills, which the device itself reads. Rays that meet only empty bricks have no error at all, by the bricks' ranges.

use super::cap;
use super::ray::{self, Ray};
use super::volume::{self, RayMedium, Tables};
use crate::passes::empty_space;
use crate::passes::light_volume;
use crate::passes::lookup_tables::transfer_integral_within;
use crate::passes::pass::*;
use crate::passes::postprocess::{on_screen, tone_constants, tone_params};
use crate::scene::{Scene, transfer};
use glam::DVec3;

/// Number of steps between 0 and 1 in a picture of 8 bits: an error of one level is 1 / 255.
pub const LEVELS: f64 = 255.0;

/// How often a step is halved, at most.
const FINEST: u32 = 5;

/// Edge of the tiles whose pixels are marked together: a workgroup's.
const TILE: u32 = GROUP;

/// Values that differ by less are one: their mean is that of both, and the difference of the integrals is rounding.
const SAME_VALUE: f64 = 1e-3;

/// The error that is stated where matter was met and none was found. 0 is certain.
const LEAST: f64 = 1e-6;

fn need(scene: &Scene) -> Need {
    scene.tolerance().map(|_| "each pixel has the steps that keep its error").ok_or("no error is asked for")
}

/// The error that is allowed, 0..1 of the screen.
fn allowed(scene: &Scene) -> f64 {
    scene.tolerance().unwrap_or(1.0) / LEVELS
}

/// The step of all rays, mm: no longer than a slice pixel, so that no sample of a ray is missed by all of its neighbours'.
fn first_step(scene: &Scene) -> f64 {
    scene.step.min(scene.reference_length())
}

/// Light that is left where a ray ends early: what it can add is to be little beside the error.
fn early_end(scene: &Scene) -> f64 {
    scene.settings.ray.early_end.min(allowed(scene) / LEVELS)
}

/// Size of the lattice of first rays: one through every other pixel of every other row.
pub(crate) fn lattice_size(scene: &Scene) -> [u32; 2] {
    scene.ray_size().map(|n| n.div_ceil(2))
}

/// Number of tiles of 8 x 8 pixels of a picture, along both axes.
pub fn tiles(scene: &Scene) -> [u32; 2] {
    scene.ray_size().map(|n| n.div_ceil(TILE))
}

fn sized(scene: &Scene, params: Params) -> Params {
    let [columns, rows] = scene.ray_size();
    params.i32("columns", columns).i32("rows", rows)
}

/// Light of matter, at most: what is not yet seen of a ray that was left early.
fn brightest(scene: &Scene) -> f64 {
    let light = &scene.settings.light;
    if scene.lit_by_volume().is_some() { light.diffuse + light.ambient + light.specular } else { 1.0 }
}

/// Casts a ray through every other pixel of every other row. It begins with the scene's step, at most a slice pixel, and repeats a ray with shorter
/// steps if its estimated error is too large.
pub const FIRST: Pass = Pass {
    name: "tolerance_first",
    shader: |_, _| "tolerance/cast.first",
    needed: need,
    reads: |s, _| {
        let mut reads = ray::marching_reads(s, empty_space::volume_skipping(s));
        reads.extend([whole("transfer", Slot::Transfer), whole("transfer_integral", Slot::TransferIntegral)]);
        reads.extend(light_volume::reads(s));
        reads.extend(cap::reads(s));
        reads
    },
    writes: |_, _| vec![whole("lattice", Slot::Lattice), whole("lattice_errors", Slot::LatticeErrors)],
    extent: |s, _| {
        let [width, height] = lattice_size(s);
        [width, height, 1]
    },
    params: |s, _| {
        let params = ray::params(s, s.volume_view(), first_step(s));
        let mut params = tone_params(s, volume::compositing_params(s, params, first_step(s)));
        params.0.retain(|(name, _)| *name != "opaque_enough");
        params = params.f32("opaque_enough", 1.0 - early_end(s));
        sized(s, params.f32("allowed", allowed(s)).f32("brightest", brightest(s)).i32("finest", FINEST))
    },
    constants: |s, _| {
        let marching = ray::marching_constants(s, empty_space::volume_skipping(s));
        let all = [marching, volume::compositing_constants(s, true), vec![cap::constant(s)], tone_constants(s)];
        // Each step has its own light, opacities follow from integrals, nothing is filtered along the ray, and where the sector ends is asked of both its sides.
        let others = ["LIT_STEPS", "SLIDING", "CROSSING", "COMPOSITING", "MIRRORED"];
        replaced(all.concat(), &others, [("COMPOSITING", 1)])
    },
    tolerance: Tolerance::absolute(4e-3).outliers(2e-2).because(
        "as raycast_volume; a ray whose error is close to what is allowed may take other steps, which change it by as \
         much; behind bricks that are skipped long steps begin anew, which changes the estimate of an error, and light \
         in the middle of a long step is the mean of two",
    ),
    reference: |scene, _, reads, writes| {
        let medium = Cast::new(scene, reads);
        for (x, y) in writes.get("lattice").pixels() {
            let (rgba, error) = medium.settled([2 * x, 2 * y], 0);
            let [r, g, b] = on_screen(scene, &rgba);
            writes.get_mut("lattice").set([x, y, 0], &rgba);
            writes.get_mut("lattice_errors").set([x, y, 0], &[r, g, b, error]);
        }
    },
    ..volume::PASS
};

/// Computes all pixels and their errors from the rays of [`FIRST`], and marks the pixels whose error is too large.
pub const ENLARGE: Pass = Pass {
    name: "tolerance_enlarge",
    shader: |_, _| "tolerance/enlarge",
    reads: |_, _| vec![whole("lattice", Slot::Lattice), whole("lattice_errors", Slot::LatticeErrors)],
    writes: |s, _| {
        vec![whole("picture", rendered(s)), whole("errors", Slot::PixelErrors), whole("error_marks", Slot::ErrorMarks)]
    },
    extent: ray_extent,
    params: |s, _| sized(s, Params::default().f32("allowed", allowed(s))),
    constants: no_constants,
    tolerance: Tolerance::absolute(1e-3).outliers(1e-3).because(
        "means of four colours, stored in halves; sums of errors are off by 1e-7 in f32: one at what is allowed may be \
         on either side",
    ),
    reference: |scene, _, reads, writes| {
        // As the shader has it.
        let allowed = f64::from(allowed(scene) as f32);
        let (lattice, shown) = (reads.get("lattice"), reads.get("lattice_errors"));
        let bend = |x: i64, y: i64| {
            let inside = |n: i64, size: usize| n.clamp(0, size as i64 - 1) as usize;
            let at = |x, y, c: usize| shown.get([inside(x, shown.size[0]), inside(y, shown.size[1]), 0])[c];
            let along = |dx: i64, dy: i64| {
                let of = |c| (at(x - dx, y - dy, c) + at(x + dx, y + dy, c) - 2.0 * at(x, y, c)).abs();
                (0..3).map(of).fold(0.0, f64::max)
            };
            along(1, 0).max(along(0, 1)) / 4.0
        };
        writes.get_mut("error_marks").values.fill(0.0);
        let ([width, height, _], [columns, rows, _]) = (writes.get("picture").size, lattice.size);
        for (x, y) in pixels([width, height]) {
            let corners: [[usize; 2]; 4] =
                std::array::from_fn(|k| [((x + k % 2) / 2).min(columns - 1), ((y + k / 2) / 2).min(rows - 1)]);
            let mean = |of: &Texels, c| corners.iter().map(|[x, y]| of.get([*x, *y, 0])[c]).sum::<f64>() / 4.0;
            let is_between = x % 2 == 1 || y % 2 == 1;
            let is_beyond = x.div_ceil(2) >= columns || y.div_ceil(2) >= rows;
            let most = corners.iter().map(|[x, y]| bend(*x as i64, *y as i64)).fold(0.0, f64::max);
            let of_rays = mean(shown, 3);
            let error = if is_between { (of_rays + most).max(LEAST) } else { of_rays };
            writes.get_mut("picture").set([x, y, 0], &std::array::from_fn::<_, 4, _>(|c| mean(lattice, c)));
            writes.get_mut("errors").set([x, y, 0], &[error]);
            let is_beside = !is_between && error > 0.0 && most > allowed;
            if is_beside || is_between && (is_beyond || error > allowed) {
                let marks = writes.get_mut("error_marks");
                let tile = TILE as usize;
                let (word, bit) = place_in_tile([x % tile, y % tile]);
                let at = 2 * (x / tile + (y / tile) * marks.size[0]) + word;
                marks.values[at] += f64::from(1_u32 << bit);
            }
        }
    },
    ..FIRST
};

/// Word and bit of a pixel of a tile.
fn place_in_tile([x, y]: [usize; 2]) -> (usize, usize) {
    let n = x + y * TILE as usize;
    (n / 32, n % 32)
}

/// Marked pixels of a tile.
fn marked(marks: &Texels, tile: usize) -> u32 {
    marks.values[2 * tile..2 * tile + 2].iter().map(|word| (*word as u32).count_ones()).sum()
}

/// Counts the marked pixels in the tiles before each tile, and the workgroups that `REFINE` needs for all marked pixels. It runs as a single
/// workgroup.
pub const LIST: Pass = Pass {
    name: "tolerance_list",
    shader: |_, _| "tolerance/list",
    reads: |_, _| vec![whole("error_marks", Slot::ErrorMarks)],
    writes: |_, _| vec![whole("marked_before", Slot::MarkedBefore), whole("refine_groups", Slot::RefineGroups)],
    extent: |_, _| [GROUP, GROUP, 1],
    params: |s, _| {
        let [columns, rows] = tiles(s);
        Params::default().i32("tile_columns", columns).i32("tile_rows", rows)
    },
    tolerance: Tolerance::exact("sums of integers"),
    reference: |_, _, reads, writes| {
        let marks = reads.get("error_marks");
        let mut before = 0;
        for tile in 0..marks.values.len() / 2 {
            writes.get_mut("marked_before").values[tile] = f64::from(before);
            before += marked(marks, tile);
        }
        let groups = before.div_ceil(GROUP * GROUP);
        let wide = groups.clamp(1, 32768);
        let groups = [wide, groups.div_ceil(wide), 1, before];
        writes.get_mut("refine_groups").values.copy_from_slice(&groups.map(f64::from));
    },
    ..ENLARGE
};

/// Casts a ray for each listed pixel.
pub(crate) const REFINE: Pass = Pass {
    name: "tolerance_refine",
    shader: |_, _| "tolerance/cast.refine",
    reads: |s, dispatch| {
        let mut reads = (FIRST.reads)(s, dispatch);
        reads.extend([
            whole("error_marks", Slot::ErrorMarks),
            whole("marked_before", Slot::MarkedBefore),
            Bind { part: Part::Groups, ..whole("refine_groups", Slot::RefineGroups) },
        ]);
        reads
    },
    writes: |s, _| vec![whole("picture", rendered(s)), whole("errors", Slot::PixelErrors)],
    extent: ray_extent,
    tolerance: Tolerance {
        absolute: 5e-4,
        outliers: 1e-2,
        why: "sums in f32 along rays of short steps, stored in halves; a ray whose error is close to what is allowed may take other steps",
        ..FIRST.tolerance
    },
    reference: |scene, _, reads, writes| {
        let (medium, marks) = (Cast::new(scene, reads), reads.get("error_marks"));
        for (x, y) in writes.get("picture").pixels() {
            let tile = TILE as usize;
            let (word, bit) = place_in_tile([x % tile, y % tile]);
            let marks = marks.values[2 * (x / tile + (y / tile) * marks.size[0]) + word];
            if (marks as u32) >> bit & 1 == 0 {
                continue;
            }
            let (rgba, error) = medium.settled([x, y], 1);
            writes.get_mut("picture").set([x, y, 0], &rgba);
            writes.get_mut("errors").set([x, y, 0], &[error]);
        }
    },
    ..FIRST
};

/// What the passes cast, in f64.
struct Cast<'a> {
    scene: &'a Scene,
    reads: &'a Arrays,
    tables: Tables<'a>,
}

/// What the matter between two samples adds to a ray.
struct Between {
    rgb: [f64; 3],
    opacity: f64,
    place: DVec3,
    /// What the shade that it casts on itself may change of its colour.
    unsure: [f64; 3],
}

/// How much of the colours' difference at both ends the shade of a step on itself may take from its mean: of even matter y / 12 of a thin step, a half of an
/// opaque one; more where absorption rises.
fn self_shade(depth: f64) -> f64 {
    depth / (depth + 12.0)
}

/// Colour, premultiplied, and opacity of a ray so far.
#[derive(Clone, Copy, Default)]
struct Sum([f64; 4]);

impl Sum {
    /// Adds a step of this colour and opacity.
    fn add(&mut self, colour: [f64; 3], opacity: f64) {
        let through = 1.0 - self.0[3];
        for (sum, colour) in self.0.iter_mut().zip([colour[0], colour[1], colour[2], 1.0]) {
            *sum += through * opacity * colour;
        }
    }
}

impl<'a> Cast<'a> {
    fn new(scene: &'a Scene, reads: &'a Arrays) -> Cast<'a> {
        Cast { scene, reads, tables: Tables::of_transfer(scene, reads) }
    }

    /// The colour of a pixel with steps halved at least so many times, and as short as its error needs; the error that is left, 0..1 of the screen.
    fn settled(&self, at: [usize; 2], mut halvings: u32) -> ([f64; 4], f64) {
        let allowed = allowed(self.scene);
        loop {
            let (rgba, error) = self.cast(at, halvings);
            if error <= allowed || halvings >= FINEST {
                return (rgba, error);
            }
            let wanted = (0.5 * (error / allowed).log2()).ceil().max(1.0);
            halvings = (f64::from(halvings) + wanted).min(f64::from(FINEST)) as u32;
        }
    }

    /// The colour of a pixel with steps halved so many times, and its error, 0..1 of the screen.
    fn cast(&self, [x, y]: [usize; 2], halvings: u32) -> ([f64; 4], f64) {
        let scene = self.scene;
        let step = first_step(scene) / f64::from(1 << halvings);
        let at = ray::middle_of(x, y);
        let ray = Ray::through(scene, self.reads.get("volume"), scene.volume_view(), step, at);
        let cut = cap::cut_at(scene, self.reads, x, y);
        let shows = |sum: [f64; 4]| {
            let rgba = light_volume::developed(scene, true, sum, at);
            cut.map_or(rgba, |cut| cut.over(rgba))
        };
        let on_screen = |rgba: [f64; 4]| on_screen(scene, &rgba);
        let is_cut = cut.is_some_and(|cut| cut.ends_ray());
        let (sums, doubt) = if is_cut { Default::default() } else { self.march(&ray) };
        let [fine, even, odd] = sums.map(|sum| shows(sum.0));
        if ray.path() <= 0.0 || is_cut {
            return (fine, 0.0);
        }
        let [colour, even, odd] = [fine, even, odd].map(on_screen);
        let mut off: [f64; 3] = std::array::from_fn(|c| (even[c] - colour[c]).abs().max((odd[c] - colour[c]).abs()));
        let [r, g, b, opacity] = sums[0].0;
        let doubtful = on_screen(shows([r + doubt[0], g + doubt[1], b + doubt[2], opacity]));
        (0..3).for_each(|c| off[c] += (doubtful[c] - colour[c]).abs());
        if self.ends(&sums) {
            let left = (1.0 - opacity) * brightest(scene);
            let most = on_screen(shows([r + left, g + left, b + left, 1.0]));
            (0..3).for_each(|c| off[c] += (most[c] - colour[c]).abs());
        }
        (fine, off.into_iter().fold(LEAST, f64::max))
    }

    /// True if nothing more of the ray is looked at.
    fn ends(&self, sums: &[Sum; 3]) -> bool {
        let early = early_end(self.scene);
        early > 0.0 && sums.iter().all(|sum| sum.0[3] >= 1.0 - early)
    }

    /// A ray by its steps, and by the two ways of longer ones; what the shade of steps on themselves may change.
    fn march(&self, ray: &Ray) -> ([Sum; 3], [f64; 3]) {
        let [mut fine, mut here, mut behind] = [Sum::default(); 3];
        let mut doubt = [0.0; 3];
        // Where the step before was lit.
        let mut lit_before = None;
        let (medium, path) = (RayMedium::new(self.scene, ray, &self.tables), ray.path());
        let (mut i, mut before, mut last) = (0.0, 0.0, 0.0);
        while last < path && !self.ends(&[fine, here, behind]) {
            let next = ray.offset(i + 1.0).min(path);
            let middle = ray.place((last + next) / 2.0);
            let [short, long] = [last, before].map(|from| self.between(&medium, ray, [from, next]));
            let is_lit = [&short, &long].into_iter().flatten().any(|found| found.opacity > 0.0);
            if let Some(found) = short {
                let light = self.tables.lit.as_ref().map_or([1.0; 3], |lit| lit.scattered(middle, ray.direction));
                let seen = (1.0 - fine.0[3]) * found.opacity;
                (0..3).for_each(|c| doubt[c] += seen * found.unsure[c] * light[c]);
                fine.add(medium.tinted_at(found.rgb, found.place, middle), found.opacity);
            }
            if let Some(found) = long {
                // The light in the middle of a long step is the mean of those in its halves.
                let [one, other] =
                    [lit_before.unwrap_or(middle), middle].map(|at| medium.tinted_at(found.rgb, found.place, at));
                behind.add(std::array::from_fn(|c| (one[c] + other[c]) / 2.0), found.opacity);
            }
            lit_before = is_lit.then_some(middle);
            (here, behind) = (behind, here);
            (i, before, last) = (i + 1.0, last, next);
        }
        if !self.ends(&[fine, here, behind]) {
            // What is left of the long step (`catch_up` of cast.comp), under the light of its middle.
            if let Some(found) = self.between(&medium, ray, [before, last]) {
                behind.add(medium.tinted_at(found.rgb, found.place, found.place), found.opacity);
            }
        }
        ([fine, here, behind], doubt)
    }

    /// What is between two samples, offsets behind the ray's entry; nothing where both are outside.
    fn between(&self, medium: &RayMedium, ray: &Ray, step: [f64; 2]) -> Option<Between> {
        let [a, b] = super::composite::Medium::part_inside(medium, step)?;
        let ends = step.map(|offset| ray.sample(offset, 0.0));
        let (front, back) = (ends[0].or(ends[1])?, ends[1].or(ends[0])?);
        let looked_up = |value| volume::looked_up(self.tables.of_steps, self.scene.transfer_entries(), value);
        let [low, high] = [front, back].map(looked_up);
        let apart: [f64; 3] = std::array::from_fn(|c| (high[c] - low[c]).abs());
        let [r, g, bl, kappa] = match (back - front).abs() < SAME_VALUE {
            true => std::array::from_fn(|c| (low[c] + high[c]) / 2.0),
            false => {
                let [low, high] = [front, back].map(|value| self.integral(value));
                let [r, g, bl, kappa]: [f64; 4] = std::array::from_fn(|c| (high[c] - low[c]) / (back - front));
                let over = kappa.max(1e-20);
                [r / over, g / over, bl / over, kappa]
            }
        };
        let place = ray.place((step[0] + step[1]) / 2.0);
        let depth = kappa * self.scene.faded(place) * (b - a) / self.scene.reference_length();
        let unsure = apart.map(|apart| self_shade(depth) * apart);
        Some(Between { rgb: [r, g, bl], opacity: transfer::opacity(depth), place, unsure })
    }

    /// Integral of the transfer function over the values up to one.
    fn integral(&self, value: f64) -> [f64; 4] {
        let entries = self.scene.transfer_entries();
        let (n, share) = volume::placed(value, entries);
        let [low, high] = [n, n + 1].map(|n| volume::entry(self.tables.of_steps, n));
        let (sum, part) =
            (volume::entry(self.reads.get("transfer_integral"), n), transfer_integral_within(low, high, share));
        std::array::from_fn(|c| sum[c] + part[c] / (entries - 1) as f64)
    }
}
