//! Stage 4: the picture from the rendering, toned to 8 bits.

use crate::passes::pass::*;
use crate::passes::{chain, edge_coverage};
use crate::scene::planes::{Frame, Plane, Tile, Tiling};
use crate::scene::{ColourMap, Layout, Scene, transfer};
use glam::DVec3;

/// Opacity of a cross-line: the anatomy below it stays visible.
pub(in crate::passes) const LINE_STRENGTH: f64 = 0.7;

/// Applies contrast, brightness, gamma and colour map, draws cross-lines and borders over planes, and stores the picture in 8 bits.
pub const TONE: Pass = Pass {
    name: "tone",
    link: Link::Observer(Chain::Pictures),
    shader: |_, _| "postprocess/tone",
    needed: |s| match (s.tones_planes(), s.tones_assembled()) {
        (true, _) => Err("planes are cut straight to 8 bits"),
        (false, true) => Err("the picture is assembled straight to 8 bits"),
        (false, false) => Ok("every picture ends in 8 bits"),
    },
    reads: |s, t| [vec![whole("picture", t.source())], whole_if(s.draws_lines(), "tiles", Slot::Tiles)].concat(),
    writes: |s, _| vec![whole("screen", toned_slot(s))],
    params: |s, _| {
        let [x, y] = s.tile_area().corner;
        tone_and_lines_params(s, Params::default()).i32("tiles_x", x).i32("tiles_y", y)
    },
    constants: |s, _| tone_and_lines_constants(s),
    tolerance: Tolerance::absolute(1.01 / 255.0).because("a value half-way between two levels may be stored as either"),
    reference: |scene, _, reads, writes| tone_picture(scene, reads.get("picture"), writes.get_mut("screen")),
    ..Pass::OF_PICTURES
};

fn tone_picture(scene: &Scene, picture: &Texels, screen: &mut Texels) {
    let tiling = scene.draws_lines().then(|| scene.tiling());
    screen.fill(|x, y| {
        let rgba = picture.get([x, y, 0]);
        let colour = (rgba[3] > 0.0).then_some([rgba[0], rgba[1], rgba[2]]);
        reference_pixel(scene, tiling.as_ref(), colour, x, y)
    });
}

fn tone_and_lines_params(scene: &Scene, params: Params) -> Params {
    let [columns, rows] = scene.tile_grid();
    tone_params(scene, params).i32("columns", columns).i32("rows", rows).f32("line_strength", LINE_STRENGTH)
}

fn tone_and_lines_constants(scene: &Scene) -> Vec<(&'static str, i32)> {
    let lines = match scene.settings.layout {
        _ if !scene.draws_lines() => 0,
        Layout::Beside => 2,
        _ => 1,
    };
    [tone_constants(scene), vec![("LINES", lines)]].concat()
}

/// Adds the parameters of contrast, brightness, gamma and colour map to those of a pass.
pub(crate) fn tone_params(scene: &Scene, params: Params) -> Params {
    let post = &scene.settings.post;
    let [a, b, c, d, e] = transfer::colour_map(post.colour_map);
    params
        .f32("brightness", post.brightness)
        .f32("contrast", post.contrast)
        .f32("exponent", 1.0 / post.gamma)
        .vec3("map_0", a)
        .vec3("map_1", b)
        .vec3("map_2", c)
        .vec3("map_3", d)
        .vec3("map_4", e)
}

/// Specialization constants of a pass that applies contrast, brightness, gamma and colour map.
pub(crate) fn tone_constants(scene: &Scene) -> Vec<(&'static str, i32)> {
    let post = &scene.settings.post;
    vec![
        ("COLOUR_MAP", (post.colour_map != ColourMap::None) as i32),
        ("GAMMA", (post.gamma != 1.0) as i32),
        ("CROSSING", if (scene.shows_three() || scene.has_curve()) && scene.draws_lines() { 2 } else { 0 }),
    ]
}

/// The colour on the screen (0..1, opaque) of pixel (x, y), whose colour before toning is `colour`; black for None. With the lines of `tiling`, if
/// there is one.
pub(crate) fn reference_pixel(
    scene: &Scene,
    tiling: Option<&Tiling>,
    colour: Option<[f64; 3]>,
    x: usize,
    y: usize,
) -> [f64; 4] {
    let mut colour = colour.map_or([0.0; 3], |c| toned(scene, c));
    if let Some((tiling, tile)) = tiling.and_then(|s| s.tile_at(x, y).map(|tile| (s, tile))) {
        colour = with_lines(tiling, tile, colour, x, y);
    }
    [colour[0], colour[1], colour[2], 1.0]
}

/// A colour after contrast, brightness, gamma and the colour map; red, green and blue, clamped to 0..1.
pub fn toned(scene: &Scene, colour: [f64; 3]) -> [f64; 3] {
    let post = &scene.settings.post;
    let toned = colour.map(|c| {
        let c = (c - 0.5) * post.contrast + 0.5 + post.brightness;
        c.clamp(0.0, 1.0).powf(1.0 / post.gamma)
    });
    if post.colour_map == ColourMap::None {
        return toned;
    }
    let map = transfer::colour_map(post.colour_map);
    let grey = (0.2126 * toned[0] + 0.7152 * toned[1] + 0.0722 * toned[2]) * 4.0;
    let n = (grey.floor() as usize).min(3);
    std::array::from_fn(|c| map[n][c] + (map[n + 1][c] - map[n][c]) * (grey - n as f64))
}

/// A colour, premultiplied, as the screen shows it: black where nothing is.
pub(crate) fn on_screen(scene: &Scene, rgba: &[f64]) -> [f64; 3] {
    if rgba[3] > 0.0 { toned(scene, [rgba[0], rgba[1], rgba[2]]) } else { [0.0; 3] }
}

/// A pixel's colour under the cross-lines and the frame of its tile.
fn with_lines(tiling: &Tiling, tile: &Tile, mut colour: [f64; 3], x: usize, y: usize) -> [f64; 3] {
    let place = tiling.place(tile, x, y);
    for (other, line) in &tile.crossed_by {
        let cover = LINE_STRENGTH * (1.0 - distance(&tile.plane, other, place) / tile.pixel).max(0.0);
        colour = std::array::from_fn(|c| colour[c] + (line[c] - colour[c]) * cover);
    }
    let before = |at: usize, axis: usize| at == tile.corner[axis] as usize;
    let after = |at: usize, axis: usize| at + 1 == (tile.corner[axis] + tile.size[axis]) as usize;
    match tile.frame {
        Frame::Around(c) if before(x, 0) || before(y, 1) || after(x, 0) || after(y, 1) => c,
        Frame::Between(c) if (before(x, 0) && x > 0) || (before(y, 1) && y > 0) => c,
        _ => colour,
    }
}

/// Distance in mm of a place in a plane from the line where another plane cuts that plane: to a point of the line, across
/// the line's direction.
fn distance(plane: &Plane, other: &Plane, place: DVec3) -> f64 {
    let along = plane.normal.cross(other.normal);
    // The point of the line that is nearest to the plane's own point: down the other plane's slope within this one.
    let slope = along.cross(plane.normal);
    let on_line = plane.at + slope * (other.normal.dot(other.at - plane.at) / other.normal.dot(slope));
    (place - on_line).cross(along.normalize()).length()
}

/// True if edges are looked for: between rays that are pixels apart, or through pixels with one ray.
fn has_edges(scene: &Scene) -> bool {
    scene.settings.ray.subsampling > 1 || scene.antialiases()
}

/// What tells edges: the distance of the surface on each ray. Compositing and projections blend what lies behind each other: their pictures are smooth between
/// rays, but for cut faces.
fn guide(scene: &Scene) -> Option<Slot> {
    (has_edges(scene) && scene.has_distance()).then(|| chain::distance_end(scene))
}

/// True if cut faces tell edges.
fn has_cut_edges(scene: &Scene) -> bool {
    scene.has_caps() && has_edges(scene)
}

/// The distance of each ray that tells edges of the rendering, or of the composited half of a pair. A cut face is nearer than all else: it has an edge where it
/// meets the surface that it cuts, too.
fn edge_distances(scene: &Scene, reads: &Arrays, is_rendering: bool) -> Option<Texels> {
    let distances = guide(scene).filter(|_| is_rendering).map(|_| reads.get("guide"));
    let faces = has_cut_edges(scene).then(|| reads.get("cap"));
    let size = distances.or(faces)?.size;
    Some(Texels::from_fn(size, 1, |at, _| match faces {
        Some(faces) if faces.get(at)[1] > 0.0 => 0.0,
        _ => distances.map_or(MISS, |d| d.get(at)[0]),
    }))
}

/// One invocation per pixel; where pixels are between rays, one for those of a column between the same two rows of rays, of which the first has half as many.
fn assemble_extent(scene: &Scene, _: &DispatchArgs) -> [u32; 3] {
    let [width, height] = scene.picture_size();
    match scene.settings.ray.subsampling {
        1 => [width, height, 1],
        apart => {
            let [_, upper] = scene.rendering_area().corner;
            let lead = (apart / 2 + apart - upper % apart) % apart;
            [width, (height + lead).div_ceil(apart), 1]
        }
    }
}

/// Makes the picture from what was rendered. Several rays per pixel are averaged. At an edge of a surface the near and the far colour are mixed by
/// the share of the pixel that each covers. Where one ray makes several pixels, pixels are interpolated between rays, without mixing what is near
/// with what lies far behind it. Planes are placed next to the rendering; in a pair, the composited volume is placed next to the lit surface.
pub(crate) const ASSEMBLE: Pass = Pass {
    name: "assemble",
    stage: Stage::Postprocess,
    shader: |_, _| "postprocess/assemble.plain",
    needed: |s| match s.settings.layout {
        _ if !s.assembles() => Err("one ray makes a pixel of the whole picture"),
        _ if s.tones_assembled() => Err("the picture is assembled straight to 8 bits"),
        layout => Ok(why_assembled(s, layout)),
    },
    reads: |s, _| assemble_reads(s),
    writes: |_, _| vec![whole("picture", Slot::Picture)],
    extent: assemble_extent,
    params: |s, _| assemble_params(s),
    constants: |s, _| assemble_constants(s),
    tolerance: Tolerance::absolute(1e-3).outliers(2e-3).because(
        "a mean of at most 16 colours in f32; R16F stores 1 to 4.9e-4; a gap that is as wide as a cliff, two that are \
         as wide as each other, or a mean of sides that is nearly even in all directions may put a pixel on either \
         side of an edge",
    ),
    reference: |scene, _, reads, writes| assemble(scene, reads, writes.get_mut("picture")),
    ..Pass::OF_RAYS
};

/// Does the same as [`ASSEMBLE`], and also tones the picture and stores it in 8 bits.
pub(crate) const ASSEMBLE_TONED: Pass = Pass {
    name: "assemble_toned",
    shader: |_, _| "postprocess/assemble.toned",
    needed: |s| match (s.assembles(), s.tones_assembled()) {
        (true, true) => Ok(why_assembled(s, s.settings.layout)),
        (true, false) => Err("the picture is filtered, or wanted in floats"),
        (false, _) => Err("one ray makes a pixel of the whole picture"),
    },
    reads: |s, _| [assemble_reads(s), whole_if(s.draws_lines(), "tiles", Slot::Tiles)].concat(),
    writes: |s, _| vec![whole("screen", toned_slot(s))],
    params: |s, _| tone_and_lines_params(s, assemble_params(s)),
    constants: |s, _| [assemble_constants(s), tone_and_lines_constants(s)].concat(),
    tolerance: Tolerance::absolute(2.01 / 255.0).outliers(2e-3).because(
        "a value half-way between two levels may be stored as either, after an error that contrast and gamma multiply; \
         sides of an edge as without toning",
    ),
    reference: |scene, _, reads, writes| {
        let mut picture = Texels::untouched(writes.get_mut("screen").size, 4);
        assemble(scene, reads, &mut picture);
        tone_picture(scene, &picture, writes.get_mut("screen"));
    },
    ..ASSEMBLE
};

/// Why a pixel of the picture is not that of one ray.
fn why_assembled(scene: &Scene, layout: Layout) -> &'static str {
    match layout {
        Layout::Four | Layout::Beside => "the rendering stands beside three planes",
        Layout::Pair => "the volume stands beside the surface",
        Layout::Single if scene.settings.ray.subsampling > 1 => "one ray makes several pixels",
        Layout::Single if scene.antialiases() => "edges are antialiased",
        Layout::Single if scene.adapts_rays() => "several rays make a pixel at an edge",
        Layout::Single => "several rays make a pixel",
    }
}

fn assemble_reads(scene: &Scene) -> Vec<Bind> {
    let mut reads = vec![whole("rendered", Slot::Rendered)];
    reads.extend(scene.settings.layout.has_planes().then_some(whole("planes", Slot::Planes)));
    reads.extend(scene.is_pair().then_some(whole("composited", composited_beside_surface(scene))));
    if scene.adapts_rays() {
        reads.extend([whole("marks", Slot::EdgeMarks), whole("single", Slot::PixelRays)]);
    }
    reads.extend(guide(scene).map(|slot| whole("guide", slot)));
    reads.extend(whole_if(has_cut_edges(scene), "cap", Slot::Cap));
    reads
}

fn assemble_params(scene: &Scene) -> Params {
    Params::default().f32("cliff", scene.cliff())
}

fn assemble_constants(scene: &Scene) -> Vec<(&'static str, i32)> {
    let layout = match scene.settings.layout {
        Layout::Single => 0,
        Layout::Four => 1,
        Layout::Pair => 2,
        Layout::Beside => 3,
    };
    let ray = &scene.settings.ray;
    vec![
        ("RAYS", ray.rays as i32),
        ("APART", ray.subsampling as i32),
        ("LAYOUT", layout),
        ("GUIDED", guide(scene).is_some() as i32),
        ("REFINED", scene.adapts_rays() as i32),
        ("CAPPED", has_cut_edges(scene) as i32),
    ]
}

fn assemble(scene: &Scene, reads: &Arrays, picture: &mut Texels) {
    let rays = scene.settings.ray.rays as usize;
    let [beside, of_rendering] = [false, true].map(|is_rendering| edge_distances(scene, reads, is_rendering));
    let rendering = scene.rendering_area();
    let [corner, tiles] = [rendering, scene.tile_area()].map(|area| area.corner.map(|n| n as usize));
    picture.fill(|x, y| {
        let is_rendering = rendering.holds([x, y]);
        if !is_rendering && scene.cuts_planes() {
            return colour_at(reads.get("planes"), [x - tiles[0], y - tiles[1]]);
        }
        let (shown, distances, corner) = match is_rendering {
            true => (reads.get("rendered"), &of_rendering, corner),
            false => (reads.get("composited"), &beside, [0, 0]),
        };
        let at = [x - corner[0], y - corner[1]];
        if scene.settings.ray.subsampling > 1 {
            let guide = distances.as_ref().map(|distances| (distances, scene.cliff()));
            return between(shown, guide, f64::from(scene.settings.ray.subsampling), at);
        }
        if let Some(distances) = distances {
            return antialiased(shown, distances, scene.cliff(), at);
        }
        if scene.adapts_rays() && reads.get("marks").one(at[0], at[1], 0) == 0.0 {
            return colour_at(reads.get("single"), at);
        }
        let mut mean = [0.0; 4];
        for (i, j) in pixels([rays, rays]) {
            let ray = shown.get([at[0] * rays + i, at[1] * rays + j, 0]);
            mean.iter_mut().zip(ray).for_each(|(m, v)| *m += v / (rays * rays) as f64);
        }
        mean
    });
}

fn colour_at(picture: &Texels, [x, y]: [usize; 2]) -> [f64; 4] {
    std::array::from_fn(|c| picture.get([x, y, 0])[c])
}

/// The colour of a pixel with one ray: at an edge, its own and the mean of those around it beyond the edge, by the share of the pixel that lies beyond. A step
/// of half a cliff is no edge, one of a cliff is.
fn antialiased(rendered: &Texels, distances: &Texels, cliff: f64, [x, y]: [usize; 2]) -> [f64; 4] {
    let ray = |dx: i64, dy: i64| -> [usize; 3] {
        let inside = |at: usize, by: i64, size: usize| (at as i64 + by).clamp(0, size as i64 - 1) as usize;
        [inside(x, dx, rendered.size[0]), inside(y, dy, rendered.size[1]), 0]
    };
    let distance = |dx: i64, dy: i64| distances.get(ray(dx, dy))[0];
    let own = colour_at(rendered, [x, y]);
    let here = distance(0, 0);
    let mut jump = 0.0;
    let mut limit = here;
    for there in [(-1, 0), (1, 0), (0, -1), (0, 1)].map(|(dx, dy)| distance(dx, dy)) {
        if (there - here).abs() > jump {
            (jump, limit) = ((there - here).abs(), 0.5 * here + 0.5 * there);
        }
    }
    if jump <= 0.5 * cliff {
        return own;
    }
    let is_near = |dx: i64, dy: i64| distance(dx, dy) < limit;
    let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
    let beyond = around.filter(|(dx, dy)| is_near(*dx, *dy) != is_near(0, 0));
    let weighed: Vec<_> = beyond.map(|(dx, dy)| (if dx * dy == 0 { 2.0 } else { 1.0 }, ray(dx, dy))).collect();
    let all: f64 = weighed.iter().map(|(weight, _)| weight).sum();
    let there = 2.0 * limit - here;
    let near = edge_coverage::near_share(&distance, limit, is_outline(here.min(there), here.max(there)));
    let beyond_share = if is_near(0, 0) { 1.0 - near } else { near } * (2.0 * jump / cliff - 1.0).clamp(0.0, 1.0);
    std::array::from_fn(|c| {
        let there = weighed.iter().map(|(weight, at)| weight * rendered.get(*at)[c]).sum::<f64>() / all;
        own[c] + (there - own[c]) * beyond_share
    })
}

/// The colour of a pixel between the rays around it. Ray i goes through the middle of the `apart` pixels from `apart` i on; beyond the outermost ray its
/// value repeats. It is linear interpolation, except where the guide has a cliff between the four rays.
fn between(rendered: &Texels, guide: Option<(&Texels, f64)>, apart: f64, pixel: [usize; 2]) -> [f64; 4] {
    let place: [f64; 2] =
        std::array::from_fn(|a| ((pixel[a] as f64 + 0.5) / apart - 0.5).clamp(0.0, (rendered.size[a] - 1) as f64));
    let low = place.map(f64::floor);
    let ray = |offset: [i32; 2]| -> [usize; 3] {
        let [x, y] =
            [0, 1].map(|a| (low[a] as i64 + i64::from(offset[a])).clamp(0, rendered.size[a] as i64 - 1) as usize);
        [x, y, 0]
    };
    let rays = [[0, 0], [1, 0], [0, 1], [1, 1]];
    let weight =
        |offset: [i32; 2]| -> f64 { (0..2).map(|a| 1.0 - (place[a] - low[a] - f64::from(offset[a])).abs()).product() };
    let mean = |weight: &dyn Fn([i32; 2]) -> f64| -> [f64; 4] {
        let all: f64 = rays.iter().map(|offset| weight(*offset)).sum();
        std::array::from_fn(|c| rays.iter().map(|o| weight(*o) * rendered.get(ray(*o))[c]).sum::<f64>() / all)
    };
    let Some((limit, reach, distances)) = guide.and_then(|(distances, cliff)| {
        let around = rays.map(|offset| distances.get(ray(offset))[0]);
        cliff_between(around, cliff).map(|(limit, reach)| (limit, reach, distances))
    }) else {
        return mean(&weight);
    };

    let is_near = |offset: [i32; 2]| distances.get(ray(offset))[0] < limit;
    // Near less far, in a mean over more rays, and how it rises per ray.
    let (mut sum, mut slope) = (0.0, [0.0; 2]);
    for (i, j) in (1 - reach..=reach).flat_map(|j| (1 - reach..=reach).map(move |i| (i, j))) {
        let x: [f64; 2] = std::array::from_fn(|a| (f64::from([i, j][a]) - (place[a] - low[a])) / f64::from(reach));
        let [u, v] = x.map(|x| (1.0 - x * x).max(0.0));
        let side = if is_near([i, j]) { 0.5 } else { -0.5 };
        sum += side * (u * v).powi(2);
        slope[0] += side * 4.0 / f64::from(reach) * x[0] * u * v * v;
        slope[1] += side * 4.0 / f64::from(reach) * x[1] * u * u * v;
    }
    // Where that straight edge has one of the four rays on the wrong side by more than half a ray, the four decide.
    let steep = slope[0].hypot(slope[1]);
    let straight = sum / steep.max(1e-6);
    let inside_of = |offset: [i32; 2]| {
        let by = |a: usize| slope[a] / steep.max(1e-6) * (f64::from(offset[a]) - (place[a] - low[a]));
        straight + by(0) + by(1)
    };
    let is_wrong = |offset: &[i32; 2]| (if is_near(*offset) { -1.0 } else { 1.0 }) * inside_of(*offset) > 0.5;
    let inside = match rays.iter().any(is_wrong) {
        true => rays.iter().filter(|o| is_near(**o)).map(|o| weight(*o)).sum::<f64>() - 0.5,
        false => straight,
    };
    let coverage = (0.5 + inside * apart).clamp(0.0, 1.0);
    let near = mean(&|offset| if is_near(offset) { weight(offset) + 1e-3 } else { 0.0 });
    let far = mean(&|offset| if is_near(offset) { 0.0 } else { weight(offset) + 1e-3 });
    std::array::from_fn(|c| far[c] + (near[c] - far[c]) * coverage)
}

/// The distance that parts what is near from what is far, in the widest gap between four distances, if that is a cliff; and how many rays away others
/// tell where the edge is. Around an outline or a cut face, what is near is all that is hit or cut; between two surfaces only the nearest rays tell.
fn cliff_between(mut distances: [f64; 4], cliff: f64) -> Option<(f64, i32)> {
    distances.sort_by(f64::total_cmp);
    let gaps: Vec<f64> = distances.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let widest = (0..3).rev().max_by(|a, b| gaps[*a].total_cmp(&gaps[*b]))?;
    let limit = 0.5 * distances[widest] + 0.5 * distances[widest + 1];
    (gaps[widest] > cliff).then_some((limit, if is_outline(distances[0], distances[3]) { 4 } else { 2 }))
}

/// True if an edge is that of a cut face, or of something in front of nothing.
fn is_outline(nearest: f64, furthest: f64) -> bool {
    nearest <= 0.0 || !is_hit(furthest)
}
