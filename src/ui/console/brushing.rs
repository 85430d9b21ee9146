//! The brush: projects a drag over a rendering onto the surface.

use super::Console;
use super::surface::SurfaceMap;
use crate::controls::Change;
use crate::scene::Scene;
use crate::texts;
use std::time::Instant;

/// Least distance of two points of a stroke, as a share of the radius: what they leave between them is a hundredth of it.
const SPACING: f64 = 0.25;

/// Lines over the surface: lateral, depth, elevation, mm.
type Strokes = Vec<Vec<[f64; 3]>>;

impl Console {
    /// Removes tissue near the surface along the stroke of the brush that the user has finished.
    pub(super) fn end_stroke(&mut self, now: Instant) {
        let pixels = self.controls.take_stroke();
        if pixels.is_empty() {
            return;
        }
        let change = match self.stroke_over(&pixels) {
            Ok((strokes, scene)) => self.controls.brush(strokes, &scene),
            Err(why) => return self.notify(&why, true),
        };
        match change {
            Change::Settings => {
                self.activity.changes_settings(now);
                self.quality.pace.forget();
            }
            Change::Refused(why) => self.notify(why, true),
            _ => {}
        }
    }

    /// The strokes over the surface under these pixels: it begins anew behind a gap or a step of the surface.
    fn stroke_over(&mut self, pixels: &[[f64; 2]]) -> Result<(Strokes, Scene), String> {
        let radius = self.controls.brush_radius();
        let (scene, distances) = self.drawn_surface(texts::BRUSH_NEEDS_SURFACE)?;
        let map = SurfaceMap::of(&scene, &distances);
        let mut strokes = Vec::new();
        let mut stroke: Vec<glam::DVec3> = Vec::new();
        for place in pixels.iter().map(|pixel| map.at(*pixel)) {
            let away = stroke.last().zip(place).map(|(last, place)| last.distance(place));
            match (place, away) {
                (Some(_), Some(away)) if away < SPACING * radius => {}
                (Some(place), Some(away)) if away <= 2.0 * radius => stroke.push(place),
                (place, _) => {
                    strokes.extend(Some(std::mem::take(&mut stroke)).filter(|stroke| !stroke.is_empty()));
                    stroke.extend(place);
                }
            }
        }
        strokes.extend(Some(stroke).filter(|stroke| !stroke.is_empty()));
        if strokes.is_empty() {
            return Err(texts::NO_SURFACE_HERE.into());
        }
        let points = |stroke: Vec<glam::DVec3>| stroke.into_iter().map(|place| scene.point_of(place)).collect();
        Ok((strokes.into_iter().map(points).collect(), scene.clone()))
    }
}
