//! The shown picture as the panels draw over it: from its pixels to points.

use super::{PanelState, ShownPicture, picture_rect, shown};
use egui::{LayerId, Painter, Pos2, Rect, Ui, vec2};

/// Draws over the shown picture: a painter, and where the picture's pixels are.
pub(super) struct Canvas {
    /// Draws where the picture is in sight.
    pub(super) painter: Painter,
    /// Upper left corner of the picture, points.
    pub(super) origin: Pos2,
    /// Pixels per point.
    pub(super) scale: f32,
}

impl Canvas {
    /// The shown picture and its canvas; None if no picture is shown.
    pub(super) fn of<'a>(ui: &Ui, state: &PanelState<'a>, scale: f32) -> Option<(&'a ShownPicture, Canvas)> {
        let (shown, picture) = shown(state, scale)?;
        let painter = ui.ctx().layer_painter(LayerId::background()).with_clip_rect(picture_rect(state, scale));
        Some((shown, Canvas { painter, origin: picture.min, scale }))
    }

    /// The place of a pixel of the picture, points.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> Pos2 {
        // Far outside of the picture a coordinate of any size would do.
        let near = |v: f64| (v / f64::from(self.scale)).clamp(-1e5, 1e5) as f32;
        self.origin + vec2(near(x), near(y))
    }

    /// The place under the pointer, points; None if it is not over the picture.
    pub(super) fn hovered(&self, ui: &Ui) -> Option<Pos2> {
        ui.ctx().pointer_hover_pos().filter(|at| self.painter.clip_rect().contains(*at))
    }

    /// The position in the picture at a place, pixels.
    pub(super) fn pixel(&self, at: Pos2) -> [f64; 2] {
        let at: [f32; 2] = ((at - self.origin) * self.scale).into();
        at.map(f64::from)
    }

    /// Draws where a tile is in sight: its upper left corner and its size, pixels.
    pub(super) fn within(&self, corner: [f64; 2], size: [f64; 2]) -> Painter {
        let end = [corner[0] + size[0], corner[1] + size[1]];
        let area = Rect::from_min_max(self.at(corner), self.at(end));
        self.painter.with_clip_rect(area.intersect(self.painter.clip_rect()))
    }
}
