//! MPR: planes and slabs through the volume. No ray is cast: each pixel shows a point of its tile's plane. Where stage 4 only tones
//! them, this pass tones: storing the picture in floats and loading it again took a third of the time.

use super::ray;
use crate::passes::pass::*;
use crate::passes::postprocess;
use crate::scene::planes::{Column, Tile, Tiling};
use crate::scene::{Scene, Slab, windowed};
use glam::DVec3;

pub(crate) const PASS: Pass = Pass {
    name: "raycast_planes",
    shader: |_, _| "raycast/planes.plain",
    needed: |s| match (s.is_flat(), s.cuts_planes()) {
        (true, _) if s.tones_planes() => Err("planes are cut straight to 8 bits"),
        (true, _) => Ok("planes are cut"),
        (false, true) => Ok("three planes stand beside the rendering"),
        (false, false) => Err("no plane is cut in this mode"),
    },
    reads: |s, _| reads(s),
    writes: |s, _| vec![whole("picture", if s.is_flat() { Slot::Picture } else { Slot::Planes })],
    extent,
    params: |s, _| params(s),
    constants: |s, _| constants(s),
    tolerance: Tolerance::absolute(1e-3).outliers(4e-3).because(
        "a place is off by 1e-5 mm in f32, so a sample by as much of a voxel's contrast, and the device's filter may \
         round its weights; a sample at the very border of the sector or the box may fall on either side",
    ),
    reference: |scene, _, reads, writes| {
        let volume = reads.get("volume");
        let (cut, [left, top]) = (Cut::of(scene), scene.tile_area().corner);
        writes.get_mut("picture").fill(|x, y| {
            let value = value_at(scene, volume, &cut, x + left as usize, y + top as usize);
            value.map_or([0.0; 4], |v| [v, v, v, 1.0])
        });
    },
    ..Pass::OF_RAYS
};

/// Does the same as [`PASS`], and also tones the picture and stores it in 8 bits.
pub(crate) const TONED: Pass = Pass {
    name: "raycast_planes_toned",
    shader: |_, _| "raycast/planes.toned",
    needed: |s| match (s.is_flat(), s.tones_planes()) {
        (true, true) => Ok("planes are cut and nothing is done to them but toning"),
        (true, false) => Err("the picture of planes is filtered, or wanted in floats"),
        (false, _) => Err("planes do not make up the picture"),
    },
    writes: |s, _| vec![whole("screen", toned_slot(s))],
    params: |s, _| postprocess::tone_params(s, params(s)).f32("line_strength", postprocess::LINE_STRENGTH),
    constants: |s, _| [constants(s), postprocess::tone_constants(s)].concat(),
    tolerance: Tolerance::absolute(2.01 / 255.0).outliers(4e-3).because(
        "a value half-way between two levels may be stored as either, after an error of 1e-3 that contrast multiplies; \
         samples at the very border as without toning",
    ),
    reference: |scene, _, reads, writes| {
        let volume = reads.get("volume");
        let cut = Cut::of(scene);
        writes.get_mut("screen").fill(|x, y| {
            let colour = value_at(scene, volume, &cut, x, y).map(|v| [v; 3]);
            postprocess::reference_pixel(scene, Some(&cut.tiling), colour, x, y)
        });
    },
    ..PASS
};

/// One invocation for a run of pixels of a column, of the part of the picture that has planes.
fn extent(scene: &Scene, _: &DispatchArgs) -> [u32; 3] {
    let [width, height] = scene.tile_area().size;
    in_runs_of(run(scene), [width, height, 1], 1)
}

fn reads(scene: &Scene) -> Vec<Bind> {
    let mut reads = ray::reads(scene);
    reads.iter_mut().filter(|b| b.slot == Slot::of_rays(scene)).for_each(|b| b.slot = Slot::of_planes(scene));
    reads.push(whole("tiles", Slot::Tiles));
    reads.extend(scene.has_curve().then_some(whole("curve_columns", Slot::CurveColumns)));
    reads
}

/// No ray is cast: a camera that moves leaves the planes as they are.
fn params(scene: &Scene) -> Params {
    let [columns, rows] = scene.tile_grid();
    let still = unmoved(scene);
    let params = ray::params(&still, scene.planes_view(), still.step);
    params.i32("columns", columns).i32("rows", rows)
}

fn constants(scene: &Scene) -> Vec<(&'static str, i32)> {
    let with = [
        ("CLIPS", scene.planes_clips().count() as i32),
        ("SAMPLES", scene.slab_samples() as i32),
        ("SLAB", scene.settings.planes.slab.number()),
        ("ONE_TILE", (scene.tile_count() == 1) as i32),
        ("CURVED", scene.has_curve() as i32),
        ("RUN", run(scene) as i32),
    ];
    replaced(ray::constants(scene), &["SPREAD", "CLIPS"], with)
}

/// Pixels of a column that an invocation makes. A CPU loads some sixty parameters for every eight invocations, which takes a fifth of the time of a pixel
/// each.
fn run(scene: &Scene) -> u32 {
    if scene.is_for_cpu() { 8 } else { 1 }
}

/// The tiling, and the columns of its curved plane.
struct Cut {
    tiling: Tiling,
    columns: Vec<Option<Column>>,
}

impl Cut {
    fn of(scene: &Scene) -> Cut {
        let tiling = scene.tiling();
        let columns = tiling.tiles.last().map_or(Vec::new(), Tile::columns);
        Cut { tiling, columns }
    }
}

/// The value of a pixel; none outside all tiles, beyond the ends of a curved plane, and outside the insonified region.
fn value_at(scene: &Scene, volume: &Texels, Cut { tiling, columns }: &Cut, x: usize, y: usize) -> Option<f64> {
    let tile = tiling.tile_at(x, y)?;
    if tile.section.is_none() {
        return slab(scene, volume, tiling.place(tile, x, y), tile.plane.normal);
    }
    let (place, across) = columns[x - tile.corner[0] as usize]?;
    let down = (y as f64 + 0.5 - f64::from(tile.corner[1]) - f64::from(tile.size[1]) / 2.0) * tile.pixel;
    slab(scene, volume, place + tile.plane.down * down, across)
}

/// The scene without its camera and its rays' step, which no plane depends on. Where one plane fills the picture, the rays begin at its
/// pixels, and their direction is that through the slab.
fn unmoved(scene: &Scene) -> Scene {
    let zero = DVec3::ZERO;
    let tiling = scene.tiling();
    let vectors = match &tiling.tiles[..] {
        [tile] => tiling.vectors(tile, scene.settings.planes.thickness),
        _ => [zero, zero, zero, DVec3::Y],
    };
    let mut still = ray::unmoved(scene, vectors);
    if scene.has_sections() {
        still.settings.clip.clear();
    }
    still
}

/// The value of a slab around a point; none where all of it is cut away or not insonified.
fn slab(scene: &Scene, volume: &Texels, place: DVec3, normal: DVec3) -> Option<f64> {
    let settings = &scene.settings.planes;
    let count = scene.slab_samples() as usize;
    let values = (0..count).filter_map(|i| {
        let through = if count > 1 { i as f64 / (count - 1) as f64 - 0.5 } else { 0.0 };
        value(scene, volume, place + normal * (through * settings.thickness))
    });
    let values: Vec<f64> = values.collect();
    match settings.slab {
        _ if values.is_empty() => None,
        Slab::Mean => Some(values.iter().sum::<f64>() / values.len() as f64),
        Slab::Max => values.into_iter().reduce(f64::max),
        Slab::Min => values.into_iter().reduce(f64::min),
    }
}

/// The windowed sample at a place; none outside the region, beyond a clip plane, and outside the insonified region.
fn value(scene: &Scene, volume: &Texels, place: DVec3) -> Option<f64> {
    let view = scene.planes_view();
    let within = place.cmpge(view.low).all() && place.cmple(view.high).all();
    if !within || scene.planes_clips().any(|(normal, limit)| normal.dot(place) > limit) {
        return None;
    }
    let at = ray::texel(scene, place)?;
    Some(windowed(scene.settings.planes.window, ray::interpolated(scene, volume, at)))
}
