//! Labels over the finished picture: on planes the boundary of each label and a translucent fill, in a rendering a translucent shell.
//!
//! The surface of labels is where the share of the surroundings that has one, a binomial mean, is a half between voxels. So it is smooth, and each
//! voxel is on its own side. Between two labels the boundary is where both have as large a share of the corners of a cell.

use super::chain;
use super::pass::*;
use crate::scene::planes::{Column, Tile, Tiling};
use crate::scene::{LabelVolume, Scene};
use glam::DVec3;

/// Half the width of an outline, pixels.
const HALF_LINE: f64 = 0.75;
/// Opacity of the dark line on both sides of an outline, a pixel wide.
const CASING: f64 = 0.5;
/// Light on the shell where the ray grazes it; 1 where it hits it straight.
const AMBIENT: f64 = 0.35;
/// Halvings by which the reference finds the surface between two samples.
const BISECTIONS: u32 = 40;

pub(crate) const PASS: Pass = Pass {
    name: "labels",
    stage: Stage::Postprocess,
    shader: |_, _| "postprocess/labels",
    needed: |s| match (s.labels(), &s.settings.labels.volume) {
        (Some(_), _) => Ok("the labels of a segmentation are shown"),
        (None, Some(_)) => Err("the settings show nothing of the labels"),
        (None, None) => Err("there are no labels"),
    },
    reads: |s, _| {
        let mut reads = vec![
            whole("unlabelled", Slot::Unlabelled),
            whole("labels", Slot::Labels),
            whole("label_cover", Slot::LabelCover),
            whole("label_colours", Slot::LabelColours),
        ];
        reads.extend(s.cuts_planes().then_some(whole("tiles", Slot::Tiles)));
        reads.extend(s.has_curve().then_some(whole("curve_columns", Slot::CurveColumns)));
        reads.extend(guide(s).map(|slot| whole("guide", slot)));
        reads
    },
    writes: |_, _| vec![whole("screen", Slot::Screen)],
    extent: picture_extent,
    params: |s, _| params(s),
    constants: |s, _| {
        vec![
            ("PLANES", s.cuts_planes() as i32),
            ("RENDERING", !s.is_flat() as i32),
            ("CURVED", s.has_curve() as i32),
            ("GUIDED", guide(s).is_some() as i32),
        ]
    },
    tolerance: Tolerance::absolute(2.01 / 255.0).outliers(4e-3).because(
        "a value half-way between two levels may be stored as either, after an error of 1e-5 mm of a place in f32; the \
         surface is found to 1/64 of a voxel, over which the light on it changes by as much; at the shell's \
         silhouette, and between labels, a pixel may have either side",
    ),
    reference: |scene, _, reads, writes| reference(scene, reads, writes.get_mut("screen")),
    ..Pass::OF_RAYS
};

/// The distance of the surface that dims labels behind it.
fn guide(scene: &Scene) -> Option<Slot> {
    (!scene.is_flat() && scene.has_distance()).then(|| chain::distance_end(scene))
}

/// Rays along the edge of a pixel.
fn rays_per_pixel(scene: &Scene) -> f64 {
    f64::from(scene.settings.ray.rays) / f64::from(scene.settings.ray.subsampling)
}

fn params(scene: &Scene) -> Params {
    let style = &scene.settings.labels;
    let [x, y, z] = scene.labels().map_or([[0.0; 4]; 3], |labels| {
        let matrix = labels.to_index.matrix3;
        let offset = labels.to_index.transform_point3(scene.local_origin());
        std::array::from_fn(|n| matrix.row(n).extend(offset[n]).to_array())
    });
    let area = |corner: [u32; 2], size: [u32; 2]| [corner[0], corner[1], size[0], size[1]].map(f64::from);
    let (planes, rendering) = (scene.tile_area(), scene.rendering_area());
    let [columns, rows] = scene.tile_grid();
    ray_params(scene)
        .vec4("index_x", x)
        .vec4("index_y", y)
        .vec4("index_z", z)
        .vec4("planes_area", area(planes.corner, planes.size))
        .vec4("rendering_area", area(rendering.corner, rendering.size))
        .i32("columns", columns)
        .i32("rows", rows)
        .f32("rays_per_pixel", rays_per_pixel(scene))
        .f32("outline", f64::from(u8::from(style.outline)))
        .f32("fill", style.fill)
        .f32("shell", style.shell)
        .f32("behind", style.behind)
        .f32("voxel", scene.labels().map_or(1.0, LabelVolume::voxel))
}

/// A colour times its opacity, and that.
type Over = [f64; 4];

/// A colour of this opacity over another one.
fn laid_over(below: Over, [r, g, b]: [f64; 3], opacity: f64) -> Over {
    let above = [r, g, b, 1.0];
    std::array::from_fn(|c| below[c] * (1.0 - opacity) + above[c] * opacity)
}

fn reference(scene: &Scene, reads: &Arrays, screen: &mut Texels) {
    let Some(labels) = scene.labels() else { return };
    let field = Field { labels, ids: reads.get("labels"), cover: reads.get("label_cover") };
    let (below, rendering) = (reads.get("unlabelled"), scene.rendering_area());
    let tiling = scene.cuts_planes().then(|| scene.tiling());
    let columns = tiling.iter().flat_map(|tiling| tiling.tiles.last()).flat_map(Tile::columns).collect::<Vec<_>>();
    screen.fill(|x, y| {
        let over = match &tiling {
            Some(tiling) if scene.is_flat() || !rendering.holds([x, y]) => {
                on_plane(scene, &field, tiling, &columns, [x, y])
            }
            _ => {
                // In a pair the left half has the rays of the right one.
                let within = |at: usize, axis: usize| (at as f64 + 0.5) - f64::from(rendering.corner[axis]);
                let across = if within(x, 0) < 0.0 { x as f64 + 0.5 } else { within(x, 0) };
                on_ray(scene, &field, reads, [across, within(y, 1)].map(|at| at * rays_per_pixel(scene)))
            }
        };
        let over = over.unwrap_or_default();
        let below = below.get([x, y, 0]);
        let [r, g, b] = [0, 1, 2].map(|c| below[c] * (1.0 - over[3]) + over[c]);
        [r, g, b, 1.0]
    });
}

/// Labels, and the shares of the surroundings that have one, as functions of place.
struct Field<'a> {
    labels: &'a LabelVolume,
    ids: &'a Texels,
    cover: &'a Texels,
}

impl Field<'_> {
    /// The corners of the cell around an index: label, cover, weight and slope of the weight.
    fn corners(&self, q: DVec3) -> impl Iterator<Item = (u8, f64, f64, DVec3)> {
        let (low, share) = (q.floor(), q - q.floor());
        (0..8).map(move |n| {
            let upper = [n & 1, n >> 1 & 1, n >> 2];
            let weight: [f64; 3] = std::array::from_fn(|a| if upper[a] == 1 { share[a] } else { 1.0 - share[a] });
            let slope = |a: usize| if upper[a] == 1 { 1.0 } else { -1.0 } * weight[(a + 1) % 3] * weight[(a + 2) % 3];
            let at: [f64; 3] = std::array::from_fn(|a| low[a] + f64::from(upper[a]));
            let is_in = (0..3).all(|a| at[a] >= 0.0 && at[a] < self.ids.size[a] as f64);
            let of = |texels: &Texels| if is_in { texels.get(at.map(|n| n as usize))[0] } else { 0.0 };
            let id = (of(self.ids) * 255.0).round() as u8;
            (id, of(self.cover), weight.iter().product(), DVec3::new(slope(0), slope(1), slope(2)))
        })
    }

    fn cover_at(&self, q: DVec3) -> f64 {
        self.corners(q).map(|(_, cover, weight, _)| cover * weight).sum()
    }

    /// The shares of the labels of the corners and their slopes, the largest first.
    fn shares(&self, q: DVec3) -> Vec<(u8, f64, DVec3)> {
        let mut shares: Vec<(u8, f64, DVec3)> = Vec::new();
        for (id, _, weight, slope) in self.corners(q).filter(|(id, ..)| *id > 0) {
            match shares.iter_mut().find(|(known, ..)| *known == id) {
                Some((_, sum, slopes)) => (*sum, *slopes) = (*sum + weight, *slopes + slope),
                None => shares.push((id, weight, slope)),
            }
        }
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        shares
    }

    fn colour(&self, label: u8) -> [f64; 3] {
        self.labels.colours[usize::from(label)]
    }
}

fn on_plane(
    scene: &Scene,
    field: &Field,
    tiling: &Tiling,
    columns: &[Option<Column>],
    [x, y]: [usize; 2],
) -> Option<Over> {
    let tile = tiling.tile_at(x, y)?;
    let (mut place, mut right) = (tiling.place(tile, x, y), tile.plane.right * tile.pixel);
    if tile.section.is_some() {
        let n = x - tile.corner[0] as usize;
        let column = |n: usize| columns.get(n).copied().flatten().map(|(place, _)| place);
        let here = column(n)?;
        let down = (y as f64 + 0.5 - f64::from(tile.corner[1]) - f64::from(tile.size[1]) / 2.0) * tile.pixel;
        place = here + tile.plane.down * down;
        let before = || n.checked_sub(1).and_then(column);
        // A single column has no direction.
        right = column(n + 1).map(|after| after - here).or_else(|| Some(here - before()?)).unwrap_or(DVec3::ZERO);
    }
    let axes = [right, tile.plane.down * tile.pixel].map(|v| field.labels.to_index.transform_vector3(v));
    let pixels = |value: f64, slope: DVec3| value / slope.dot(axes[0]).hypot(slope.dot(axes[1])).max(1e-6);
    let q = field.labels.to_index.transform_point3(place);
    let shares = field.shares(q);
    let (label, most, slope) = *shares.first()?;
    let rise = field.corners(q).map(|(_, cover, _, slope)| slope * cover).sum();
    let inside = pixels(field.cover_at(q) - 0.5, rise);
    let edge = match shares.get(1) {
        Some((_, next, other)) if inside > 0.0 => inside.abs().min(pixels(most - next, slope - *other)),
        _ => inside.abs(),
    };
    let style = &scene.settings.labels;
    let colour = field.colour(label);
    let filled = laid_over(Over::default(), colour, style.fill * (0.5 + inside).clamp(0.0, 1.0));
    if !style.outline {
        return Some(filled);
    }
    let [line, cased] = [HALF_LINE, HALF_LINE + 1.0].map(|half| (half + 0.5 - edge).clamp(0.0, 1.0));
    Some(laid_over(laid_over(filled, [0.0; 3], CASING * cased), colour, line))
}

fn on_ray(scene: &Scene, field: &Field, reads: &Arrays, ray: [f64; 2]) -> Option<Over> {
    let (origin, along) = scene.rays.at(ray[0], ray[1]);
    let to_index = &field.labels.to_index;
    let (q, pace) = (to_index.transform_point3(origin), to_index.transform_vector3(along));
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let pace = if pace[axis].abs() < 1e-9 { 1e-9 } else { pace[axis] };
        let ends = [-1.0, field.ids.size[axis] as f64].map(|end| (end - q[axis]) / pace);
        enter = enter.max(ends[0].min(ends[1]));
        leave = leave.min(ends[0].max(ends[1]));
    }
    let each = 1.0 / pace.abs().max_element();
    let is_in = |distance: f64| field.cover_at(q + pace * distance) >= 0.5;
    let count = ((leave - enter) / each).ceil().max(0.0) as u32;
    let mut hit = (0..count).map(|n| enter + (f64::from(n) + 0.5) * each).find(|distance| is_in(*distance))?;
    let mut before = (hit - each).max(enter);
    for _ in 0..BISECTIONS {
        let middle = (before + hit) / 2.0;
        if is_in(middle) { hit = middle } else { before = middle }
    }
    let at = q + pace * hit;
    let rise = DVec3::AXES.map(|axis| field.cover_at(at + axis) - field.cover_at(at - axis));
    let normal = to_index.matrix3.transpose() * DVec3::from(rise);
    let light = AMBIENT + (1.0 - AMBIENT) * normal.normalize_or_zero().dot(along).abs();
    let style = &scene.settings.labels;
    // From half a voxel behind the surface on, until one and a half.
    let hidden = guide(scene).map_or(0.0, |_| {
        let guide = reads.get("guide");
        let pixel = |a: usize| (ray[a] as usize).min(guide.size[a] - 1);
        ((hit - guide.one(pixel(0), pixel(1), 0)) / field.labels.voxel() - 0.5).clamp(0.0, 1.0)
    });
    let (label, ..) = *field.shares(at).first()?;
    let opacity = style.shell * (1.0 + (style.behind - 1.0) * hidden);
    Some(laid_over(Over::default(), field.colour(label).map(|c| c * light), opacity))
}
