//! The composed window: picture and panels in an image of their own, which is copied to the window. While only the picture changes, as in a drag, the
//! panels beside it stay as they are: to draw them takes a software device as long as a coarse picture.

use super::flat_image::FlatImage;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use ash::vk;
use egui::epaint::{Primitive, Vertex};
use egui::{ClippedPrimitive, Pos2, Rect, TextureId};
use std::sync::Arc;

/// The image, and what was drawn into it last.
pub(super) struct Composition {
    pub image: FlatImage,
    /// It was drawn into, and has a layout.
    pub is_laid_out: bool,
    /// What it holds; None if that is not known.
    pub content: Option<Content>,
}

/// What a composition holds.
pub(super) struct Content {
    /// The panels, with the pixels per point that they were drawn with.
    pub shapes: Vec<ClippedPrimitive>,
    pub scale: f32,
    /// Where the picture is, pixels: its corner and size.
    pub picture: [[u32; 2]; 2],
}

impl Composition {
    /// # Errors
    /// The device has no memory for it.
    pub(super) fn new(context: &Arc<Context>, format: vk::Format, size: [u32; 2]) -> Result<Composition, GpuError> {
        let usage = vk::ImageUsageFlags::TRANSFER_DST
            | vk::ImageUsageFlags::TRANSFER_SRC
            | vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let image = FlatImage::new(context, "composed window", format, size, usage)?;
        Ok(Composition { image, is_laid_out: false, content: None })
    }

    /// True if it fits images of the window of this format and size, pixels.
    pub(super) fn fits(&self, format: vk::Format, size: [u32; 2]) -> bool {
        (self.image.format, self.image.size) == (format, size)
    }
}

impl Content {
    /// The shapes that have to be drawn over a new picture in the same place, if nothing beside it changes with these panels.
    pub(super) fn over_picture(
        &self,
        shapes: &[ClippedPrimitive],
        scale: f32,
        picture: [[u32; 2]; 2],
    ) -> Option<Vec<ClippedPrimitive>> {
        let [low, size] = picture;
        let high = [low[0] + size[0], low[1] + size[1]];
        let points = |at: [u32; 2]| Pos2::new(at[0] as f32 / scale, at[1] as f32 / scale);
        let area = Rect { min: points(low), max: points(high) };
        let is_same = self.picture == picture && self.scale == scale;
        let (before, now) = without_equal_ends(&self.shapes, shapes);
        if !is_same || !triangles_beside(before, area).eq(triangles_beside(now, area)) {
            return None;
        }
        let clipped = shapes.iter().filter_map(|shape| {
            let clip_rect = within(shape.clip_rect, scale, [low, high])?;
            Some(ClippedPrimitive { clip_rect, primitive: shape.primitive.clone() })
        });
        let clipped: Vec<_> = clipped.collect();
        // The renderer of the panels multiplies and truncates: of some scales it would miss a pixel.
        let is_exact = |at: Pos2| (at.x * scale).fract() == 0.0 && (at.y * scale).fract() == 0.0;
        clipped.iter().all(|s| is_exact(s.clip_rect.min) && is_exact(s.clip_rect.max)).then_some(clipped)
    }
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
        let over = before.over_picture(&drawn(GREY, moved), 1.0, PICTURE).expect("the panels stay");
        assert_eq!(over.len(), 1, "the panel itself is not drawn");
        assert_eq!(over[0].clip_rect, rect(100.0, 50.0, 200.0, 100.0));
        let more = [drawn(GREY, moved), vec![shape(mark, &[(mark, Rgba::BLUE)])]].concat();
        assert_eq!(before.over_picture(&more, 1.0, PICTURE).map(|over| over.len()), Some(2));
        let outwards = mark.translate(egui::vec2(-25.0, 0.0));
        for (other, why) in [
            (drawn(Rgba::BLACK, mark), "a panel of another colour"),
            (drawn(GREY, outwards), "a mark that leaves the picture"),
            (drawn(GREY, mark)[..1].to_vec(), "a shape beside it that is gone"),
        ] {
            assert!(before.over_picture(&other, 1.0, PICTURE).is_none(), "{why}");
        }
        let same = drawn(GREY, mark);
        assert!(before.over_picture(&same, 2.0, PICTURE).is_none(), "another scale");
        assert!(before.over_picture(&same, 1.0, [[100, 50], [200, 90]]).is_none(), "another size of the picture");
        let mut whole = 0;
        for scale in [1.1, 1.25, 1.3, 1.5, 1.7, 2.0, 3.0] {
            let over = content(&same, scale).over_picture(&same, scale, PICTURE);
            let clips: Vec<Rect> = over.iter().flatten().map(|shape| shape.clip_rect).collect();
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
        let unknown = [shape(area, &[(Rect::NAN, GREY)])];
        assert_eq!(without_equal_ends(&unknown, &unknown).0.len(), 1, "it equals nothing");
    }

    /// Prevents a column of pixels at the picture's edge that is drawn twice or not at all.
    #[test]
    fn clipping_selects_the_pixels_of_the_whole_rectangle() {
        // As the renderer of the panels computes it.
        let pixels = |clip: Rect, scale: f32| {
            let axis = |from: f32, to: f32| {
                let first = ((from * scale) as i32).max(0);
                (first, first + (to * scale - from * scale) as i32)
            };
            let ((left, right), (top, bottom)) = (axis(clip.min.x, clip.max.x), axis(clip.min.y, clip.max.y));
            move |x: i32, y: i32| (left..right).contains(&x) && (top..bottom).contains(&y)
        };
        for scale in [1.0, 2.0] {
            for n in 0..400 {
                let part = |step: f32| (n as f32 * step) % 7.3;
                let clip = rect(90.0 + part(1.37), 48.5 + part(0.61), 3.0 + 30.0 * part(0.77), 2.25 + 14.0 * part(1.9));
                let clip =
                    Rect { min: (clip.min.to_vec2() / scale).to_pos2(), max: (clip.max.to_vec2() / scale).to_pos2() };
                let [low, size] = PICTURE;
                let high = [low[0] + size[0], low[1] + size[1]];
                let whole = pixels(clip, scale);
                let part = within(clip, scale, [low, high]).map(|part| pixels(part, scale));
                for (x, y) in (low[0]..high[0]).flat_map(|x| (low[1]..high[1]).map(move |y| (x as i32, y as i32))) {
                    let is_in = part.as_ref().is_some_and(|part| part(x, y));
                    assert_eq!(is_in, whole(x, y), "{clip:?} at {scale}: {x} {y}");
                }
            }
        }
    }
}
