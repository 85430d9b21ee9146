//! Determines which parts of the composed window must be drawn again: the picture, and the panels beside it that changed. Drawing all
//! panels takes a software device as long as a coarse picture.

use super::composition::Content;
use egui::epaint::{Primitive, Vertex};
use egui::{ClippedPrimitive, Pos2, Rect, TextureId};

/// What has to be drawn again in a composition over a new picture.
pub(super) struct Damage {
    /// Areas outside the picture that get the background first, pixels of the window: first corner, and the corner beyond the last pixel.
    pub cleared: Vec<[[u32; 2]; 2]>,
    /// The shapes to draw, clipped to the picture and to these areas.
    pub shapes: Vec<ClippedPrimitive>,
}

impl Content {
    /// Compares panels with what the composition shows, for a new picture in the same place. `scale`: pixels per point; `picture`: its upper left
    /// corner and its size, pixels; `size`: that of the window, pixels. None if everything has to be drawn.
    pub(super) fn damage(
        &self,
        shapes: &[ClippedPrimitive],
        scale: f32,
        picture: [[u32; 2]; 2],
        size: [u32; 2],
    ) -> Option<Damage> {
        if self.picture != picture || self.scale != scale {
            return None;
        }
        let [low, extent] = picture;
        let picture = [low, [low[0] + extent[0], low[1] + extent[1]]];
        let points = |at: [u32; 2]| Pos2::new(at[0] as f32 / scale, at[1] as f32 / scale);
        let beside = Rect { min: points(picture[0]), max: points(picture[1]) };
        let cleared = match change(&self.shapes, shapes, beside) {
            Change::None => Vec::new(),
            Change::Within(bounds) => around(pixels(bounds, scale, size), picture),
            Change::Unknown => return None,
        };
        let areas = std::iter::once(picture).chain(cleared.iter().copied());
        let clipped = areas.flat_map(|area| {
            shapes.iter().filter_map(move |shape| {
                let clip_rect = within(shape.clip_rect, scale, area)?;
                Some(ClippedPrimitive { clip_rect, primitive: shape.primitive.clone() })
            })
        });
        let shapes: Vec<_> = clipped.collect();
        // The renderer of the panels multiplies and truncates: of some scales it would miss a pixel.
        let is_exact = |at: Pos2| (at.x * scale).fract() == 0.0 && (at.y * scale).fract() == 0.0;
        let are_exact = shapes.iter().all(|s| is_exact(s.clip_rect.min) && is_exact(s.clip_rect.max));
        are_exact.then_some(Damage { cleared, shapes })
    }
}

/// What changed beside the picture.
enum Change {
    None,
    /// Points.
    Within(Rect),
    /// It is not known what is drawn.
    Unknown,
}

/// What changed between two lists of shapes outside an area, points.
fn change(before: &[ClippedPrimitive], now: &[ClippedPrimitive], area: Rect) -> Change {
    let (before, now) = without_equal_ends(before, now);
    if triangles_beside(before, area).eq(triangles_beside(now, area)) {
        return Change::None;
    }
    let [before, now] = [before, now].map(|shapes| triangles_beside(shapes, area).collect::<Vec<_>>());
    let first = before.iter().zip(&now).take_while(|(a, b)| a == b).count();
    let (before, now) = (&before[first..], &now[first..]);
    let last = before.iter().rev().zip(now.iter().rev()).take_while(|(a, b)| a == b).count();
    let changed = || before[..before.len() - last].iter().chain(&now[..now.len() - last]);
    if changed().any(|(texture, ..)| texture.is_none()) {
        return Change::Unknown;
    }
    let covered = changed().map(|(_, clip, corners)| {
        let mut bounds = Rect::NOTHING;
        corners.iter().flatten().for_each(|corner| bounds.extend_with(corner.pos));
        bounds.intersect(*clip)
    });
    let bounds = covered.filter(Rect::is_positive).fold(Rect::NOTHING, Rect::union);
    if bounds.is_positive() { Change::Within(bounds) } else { Change::None }
}

/// The pixels (from, to) of a window that a rectangle of points touches.
fn pixels(bounds: Rect, scale: f32, size: [u32; 2]) -> [[u32; 2]; 2] {
    let low = [bounds.min.x, bounds.min.y].map(|at| (at * scale).floor().max(0.0) as u32);
    let high = [bounds.max.x, bounds.max.y].map(|at| (at * scale).ceil().max(0.0) as u32);
    [low, [high[0].min(size[0]), high[1].min(size[1])]]
}

/// The parts of a rectangle of pixels (from, to) beside another: all of it, or those above, below, left and right of the other.
fn around([low, high]: [[u32; 2]; 2], [inner_low, inner_high]: [[u32; 2]; 2]) -> Vec<[[u32; 2]; 2]> {
    let clamped = |at: u32, axis: usize| at.clamp(low[axis], high[axis].max(low[axis]));
    let (left, right) = (clamped(inner_low[0], 0), clamped(inner_high[0], 0));
    let (top, bottom) = (clamped(inner_low[1], 1), clamped(inner_high[1], 1));
    let parts = match left >= right || top >= bottom {
        true => vec![[low, high]],
        false => vec![
            [low, [high[0], top]],
            [[low[0], bottom], high],
            [[low[0], top], [left, bottom]],
            [[right, top], [high[0], bottom]],
        ],
    };
    parts.into_iter().filter(|[from, to]| from[0] < to[0] && from[1] < to[1]).collect()
}

/// The part of a clip rectangle that lies in an area of pixels (from, to), points; None if it is empty. It selects the same pixels there as the rectangle
/// itself, whose corner and size the renderer of the panels truncates.
fn within(clip: Rect, scale: f32, [low, high]: [[u32; 2]; 2]) -> Option<Rect> {
    let along = |from: f32, to: f32, axis: usize| {
        let (from, extent) = (from * scale, to * scale - from * scale);
        let first = from.max(0.0).trunc();
        let last = (first + extent.max(0.0).trunc()).min(high[axis] as f32);
        let first = first.max(low[axis] as f32);
        (last > first).then_some((first / scale, last / scale))
    };
    let (left, right) = along(clip.min.x, clip.max.x, 0)?;
    let (top, bottom) = along(clip.min.y, clip.max.y, 1)?;
    Some(Rect { min: Pos2::new(left, top), max: Pos2::new(right, bottom) })
}

/// Two lists of shapes without the equal ones that they begin and end with. Most panels do not change, and to compare them whole takes a tenth of the time
/// that their triangles take.
fn without_equal_ends<'a>(
    mut a: &'a [ClippedPrimitive],
    mut b: &'a [ClippedPrimitive],
) -> (&'a [ClippedPrimitive], &'a [ClippedPrimitive]) {
    while let ([one, rest @ ..], [other, others @ ..]) = (a, b)
        && is_equal(one, other)
    {
        (a, b) = (rest, others);
    }
    while let ([rest @ .., one], [others @ .., other]) = (a, b)
        && is_equal(one, other)
    {
        (a, b) = (rest, others);
    }
    (a, b)
}

fn is_equal(one: &ClippedPrimitive, other: &ClippedPrimitive) -> bool {
    match (&one.primitive, &other.primitive) {
        (Primitive::Mesh(a), Primitive::Mesh(b)) => one.clip_rect == other.clip_rect && a == b,
        // Nobody knows what they draw.
        _ => false,
    }
}

/// The triangles that may cover pixels outside an area, points, in the order in which they are drawn, with their texture and where they are clipped.
fn triangles_beside(
    shapes: &[ClippedPrimitive],
    area: Rect,
) -> impl Iterator<Item = (Option<TextureId>, Rect, [Option<Vertex>; 3])> {
    let beside = shapes.iter().filter(move |shape| !area.contains_rect(shape.clip_rect));
    beside.flat_map(move |shape| {
        let clip = shape.clip_rect;
        let (mesh, other) = match &shape.primitive {
            Primitive::Mesh(mesh) => (Some(mesh), None),
            // Nobody knows what it draws, so that it equals none.
            Primitive::Callback(_) => (None, Some((None, Rect::NAN, [None; 3]))),
        };
        let triangles = mesh.into_iter().flat_map(move |mesh| {
            let corner = |i: u32| mesh.vertices.get(i as usize).copied();
            let all = mesh.indices.chunks_exact(3).map(move |i| [corner(i[0]), corner(i[1]), corner(i[2])]);
            let is_beside = move |t: &[Option<Vertex>; 3]| t.iter().flatten().any(|v| !area.contains(v.pos));
            all.filter(is_beside).map(move |t| (Some(mesh.texture_id), clip, t))
        });
        triangles.chain(other)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Mesh, Rgba, pos2};

    const PICTURE: [[u32; 2]; 2] = [[100, 50], [200, 100]];
    const SIZE: [u32; 2] = [400, 200];
    const GREY: Rgba = Rgba::from_rgb(0.5, 0.5, 0.5);

    fn rect(x: f32, y: f32, w: f32, h: f32) -> Rect {
        Rect { min: pos2(x, y), max: pos2(x + w, y + h) }
    }

    fn shape(clip: Rect, filled: &[(Rect, Rgba)]) -> ClippedPrimitive {
        let mut mesh = Mesh::default();
        filled.iter().for_each(|(rect, colour)| mesh.add_colored_rect(*rect, (*colour).into()));
        ClippedPrimitive { clip_rect: clip, primitive: Primitive::Mesh(mesh) }
    }

    fn content(shapes: &[ClippedPrimitive], scale: f32) -> Content {
        Content { shapes: shapes.to_vec(), scale, picture: PICTURE }
    }

    /// Prevents panels that are not drawn again though they changed.
    #[test]
    fn only_what_changes_within_the_picture_leaves_the_panels_as_they_are() {
        let window = rect(0.0, 0.0, 400.0, 200.0);
        let (panel, mark) = (rect(310.0, 0.0, 90.0, 200.0), rect(120.0, 60.0, 10.0, 10.0));
        let drawn = |panel_colour, mark_at: Rect| {
            vec![
                shape(panel, &[(panel, panel_colour)]),
                shape(window, &[(mark_at, Rgba::WHITE), (rect(0.0, 0.0, 20.0, 20.0), Rgba::RED)]),
            ]
        };
        let before = content(&drawn(GREY, mark), 1.0);
        let moved = mark.translate(egui::vec2(30.0, 5.0));
        let damage = |shapes: &[ClippedPrimitive]| before.damage(shapes, 1.0, PICTURE, SIZE).expect("not everything");
        let over = damage(&drawn(GREY, moved));
        assert_eq!((over.shapes.len(), over.cleared.len()), (1, 0), "the panel itself is not drawn");
        assert_eq!(over.shapes[0].clip_rect, rect(100.0, 50.0, 200.0, 100.0));
        let more = [drawn(GREY, moved), vec![shape(mark, &[(mark, Rgba::BLUE)])]].concat();
        assert_eq!(damage(&more).shapes.len(), 2);
        let outwards = mark.translate(egui::vec2(-25.0, 0.0));
        for (other, wanted, why) in [
            (drawn(Rgba::BLACK, mark), [[310, 0], [400, 200]], "a panel of another colour"),
            (drawn(GREY, outwards), [[95, 60], [100, 70]], "a mark that leaves the picture"),
            (drawn(GREY, mark)[..1].to_vec(), [[0, 0], [20, 20]], "a shape beside it that is gone"),
        ] {
            assert_eq!(damage(&other).cleared, [wanted], "{why}");
        }
        // Beyond the window, where a renderer may clip it or not.
        let beyond = rect(500.0, 20.0, 9.0, 9.0);
        let everywhere = shape(Rect::EVERYTHING, &[(beyond, Rgba::RED)]);
        let with_it = [drawn(GREY, mark), vec![everywhere]].concat();
        assert_eq!(damage(&with_it).cleared, [[[0; 2]; 2]; 0], "a shape beyond the window");
        let same = drawn(GREY, mark);
        assert!(before.damage(&same, 2.0, PICTURE, SIZE).is_none(), "another scale");
        assert!(before.damage(&same, 1.0, [[100, 50], [200, 90]], SIZE).is_none(), "another size of the picture");
        let mut whole = 0;
        for scale in [1.1, 1.25, 1.3, 1.5, 1.7, 2.0, 3.0] {
            let over = content(&same, scale).damage(&same, scale, PICTURE, SIZE);
            let clips: Vec<Rect> = over.iter().flat_map(|over| &over.shapes).map(|shape| shape.clip_rect).collect();
            let ends = clips.iter().flat_map(|clip| [clip.min.x, clip.min.y, clip.max.x, clip.max.y]);
            ends.for_each(|end| assert_eq!((end * scale).fract(), 0.0, "{scale}: the renderer would truncate it"));
            whole += u32::from(!clips.is_empty());
        }
        assert!(whole > 1, "{whole} scales");
    }

    /// Prevents a change that is lost where only a part of two lists is compared.
    #[test]
    fn shapes_that_are_left_out_of_a_comparison_do_not_change_its_answer() {
        let area = rect(100.0, 50.0, 200.0, 100.0);
        let of = |n: usize| {
            let at = rect([10.0, 120.0, 320.0][n % 3], 60.0 + n as f32, 30.0, 10.0);
            shape(rect(0.0, 0.0, 400.0, 200.0), &[(at, [GREY, Rgba::RED][n / 3 % 2])])
        };
        let (mut same, mut other) = (0, 0);
        for n in 0..4096_usize {
            // Two lists of up to three shapes each of six.
            let list = |from: usize| -> Vec<_> { (0..n / from % 4).map(|i| of(n / (from * (i + 4)) % 6)).collect() };
            let (a, b) = (list(1), list(7));
            let (short, shorter) = without_equal_ends(&a, &b);
            let is_equal = triangles_beside(&a, area).eq(triangles_beside(&b, area));
            assert_eq!(is_equal, triangles_beside(short, area).eq(triangles_beside(shorter, area)), "{n}");
            assert_eq!(a.len() - short.len(), b.len() - shorter.len());
            (same, other) = (same + u32::from(is_equal), other + u32::from(!is_equal));
        }
        assert!(same > 100 && other > 100, "{same} {other}");
        let panels: Vec<_> = (0..6).map(of).collect();
        let left = without_equal_ends(&panels, &panels);
        assert!(left.0.is_empty() && left.1.is_empty());
    }

    /// A window of pixels, and what a renderer does to it: one colour a rectangle, blended by half where it is translucent.
    #[derive(Clone, PartialEq)]
    struct Pixels(Vec<u32>);

    impl Pixels {
        fn fill(&mut self, [from, to]: [[u32; 2]; 2], value: u32) {
            for y in from[1]..to[1] {
                (from[0]..to[0]).for_each(|x| self.0[(y * SIZE[0] + x) as usize] = value);
            }
        }

        /// Each rectangle mixes the number of its colour into what is below, so that order and repetition show.
        fn draw(&mut self, shapes: &[ClippedPrimitive], scale: f32) {
            for shape in shapes {
                let Primitive::Mesh(mesh) = &shape.primitive else { continue };
                let clip = pixels_of(shape.clip_rect, scale);
                for corners in mesh.vertices.chunks(4) {
                    let (low, high) = (corners[0].pos * scale, corners[3].pos * scale);
                    for (x, y) in (0..SIZE[0]).flat_map(|x| (0..SIZE[1]).map(move |y| (x, y))) {
                        let centre = pos2(x as f32 + 0.5, y as f32 + 0.5);
                        let is_in = centre.x > low.x && centre.x < high.x && centre.y > low.y && centre.y < high.y;
                        if is_in && clip(x as i32, y as i32) {
                            let below = &mut self.0[(y * SIZE[0] + x) as usize];
                            *below = below.wrapping_mul(31).wrapping_add(u32::from(corners[0].color.r()));
                        }
                    }
                }
            }
        }
    }

    /// Prevents pixels of a panel that moved, changed or went, and ones that are blended twice.
    #[test]
    fn what_is_drawn_again_makes_the_window_that_is_drawn_whole() {
        let mut state = 3_u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % below
        };
        let (mut kept, mut pixels) = (0, 0);
        for scale in [1.0, 2.0] {
            let mut one = || {
                let mut quarter = |below: u32| random(4 * below) as f32 / 4.0 / scale;
                let clip = rect(quarter(250), quarter(120), 40.0 + quarter(150), 20.0 + quarter(80));
                let inside = |at: f32, from: f32, to: f32| from + (at * 7.3) % (to - from);
                let at = pos2(
                    inside(quarter(400), clip.min.x - 9.0, clip.max.x),
                    inside(quarter(400), clip.min.y - 9.0, clip.max.y),
                );
                let size = egui::vec2(2.0 + quarter(60), 2.0 + quarter(30));
                let other = rect(at.x + 11.25, at.y - 3.5, 6.25, 9.0);
                let colour = Rgba::from_rgb(0.1 + quarter(3) * scale / 4.0, 0.0, 0.0);
                shape(clip, &[(Rect::from_min_size(at, size), colour), (other, colour)])
            };
            let mut shapes: Vec<_> = (0..9).map(|_| one()).collect();
            let mut spare: Vec<_> = (0..40).map(|_| one()).collect();
            let mut window: Option<Pixels> = None;
            let mut before: Option<Content> = None;
            for round in 0..40_u32 {
                // One shape comes, goes or changes its place; now and then none.
                let at = random(shapes.len() as u32) as usize;
                match random(4) {
                    0 if shapes.len() > 4 => _ = shapes.remove(at),
                    1 => shapes.extend(spare.pop()),
                    2 => shapes.swap(0, at),
                    _ => {}
                }
                let mut whole = Pixels(vec![1; (SIZE[0] * SIZE[1]) as usize]);
                let [low, extent] = PICTURE;
                let picture = [low, [low[0] + extent[0], low[1] + extent[1]]];
                whole.fill(picture, 1000 + round);
                whole.draw(&shapes, scale);
                let damage = before.as_ref().and_then(|before| before.damage(&shapes, scale, PICTURE, SIZE));
                if let (Some(window), Some(damage)) = (&mut window, damage) {
                    window.fill(picture, 1000 + round);
                    damage.cleared.iter().for_each(|area| window.fill(*area, 1));
                    window.draw(&damage.shapes, scale);
                    assert!(*window == whole, "round {round} at {scale}");
                    kept += 1;
                    let area = |[from, to]: &[[u32; 2]; 2]| (to[0] - from[0]) * (to[1] - from[1]);
                    pixels += damage.cleared.iter().map(area).sum::<u32>();
                }
                window = Some(whole);
                before = Some(Content { shapes: shapes.clone(), scale, picture: PICTURE });
            }
        }
        let beside = SIZE[0] * SIZE[1] - PICTURE[1][0] * PICTURE[1][1];
        assert!(kept > 70 && pixels < kept * beside / 3, "{kept} rounds, {pixels} pixels of panels");
    }

    /// The pixels that a clip rectangle selects, as the renderer of the panels computes them.
    fn pixels_of(clip: Rect, scale: f32) -> impl Fn(i32, i32) -> bool {
        let axis = |from: f32, to: f32| {
            let first = ((from * scale) as i32).max(0);
            (first, first + (to * scale - from * scale) as i32)
        };
        let ((left, right), (top, bottom)) = (axis(clip.min.x, clip.max.x), axis(clip.min.y, clip.max.y));
        move |x: i32, y: i32| (left..right).contains(&x) && (top..bottom).contains(&y)
    }

    /// Prevents a column of pixels at the picture's edge that is drawn twice or not at all.
    #[test]
    fn clipping_selects_the_pixels_of_the_whole_rectangle() {
        for scale in [1.0, 2.0] {
            for n in 0..400 {
                let part = |step: f32| (n as f32 * step) % 7.3;
                let clip = rect(90.0 + part(1.37), 48.5 + part(0.61), 3.0 + 30.0 * part(0.77), 2.25 + 14.0 * part(1.9));
                let clip =
                    Rect { min: (clip.min.to_vec2() / scale).to_pos2(), max: (clip.max.to_vec2() / scale).to_pos2() };
                let [low, size] = PICTURE;
                let high = [low[0] + size[0], low[1] + size[1]];
                let whole = pixels_of(clip, scale);
                let part = within(clip, scale, [low, high]).map(|part| pixels_of(part, scale));
                for (x, y) in (low[0]..high[0]).flat_map(|x| (low[1]..high[1]).map(move |y| (x as i32, y as i32))) {
                    let is_in = part.as_ref().is_some_and(|part| part(x, y));
                    assert_eq!(is_in, whole(x, y), "{clip:?} at {scale}: {x} {y}");
                }
            }
        }
    }
}
