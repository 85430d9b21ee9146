//! Labels in the console: where the brush is, and bodies that grow in the background.

use super::Console;
use super::surface::SurfaceMap;
use crate::labelling::{Effect, Labelling};
use crate::panels::Note;
use crate::passes::Texels;
use crate::probe::{Geometry, World};
use crate::scene::Scene;
use crate::scene::planes::Tile;
use crate::segment::bodies::{Body, Search, find};
use crate::segment::{Field, Labels, Scale, contours, files, usual_grid};
use crate::source::OpenOptions;
use crate::source::convert::Volume;
use crate::texts;
use glam::{DAffine3, DVec3};
use std::path::Path;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Instant;

/// Most voxels of labels to edit: all of them may have to be shown at once.
const MOST_VOXELS: usize = 1 << 26;

/// A place in space, mm, and the normal of the plane on which it is, if it is on one.
type Place = (DVec3, Option<DVec3>);

/// What becomes of the work of a thread: it is done by the console.
type Finish = Box<dyn FnOnce(&mut Console) + Send>;

/// The work in progress on labels, and on bodies that are measured.
#[derive(Default)]
pub(super) struct LabelWork {
    /// Receives the result of the thread that is at work, and what the window says meanwhile.
    at_work: Option<(Receiver<Finish>, &'static str)>,
    /// The surface under the stroke in progress; the last place of the stroke in space, mm; and why the brush has no place.
    surface: Option<(Scene, Texels)>,
    last: Option<DVec3>,
    fault: Option<String>,
}

impl LabelWork {
    /// What the window says while a thread is at work.
    pub(super) fn note(&self) -> Option<Note> {
        self.at_work.as_ref().map(|(_, text)| Note { text: (*text).into(), is_fault: false })
    }
}

impl Console {
    /// Works on a volume or on labels on a thread, if none is at work. `says`: what the window says meanwhile.
    pub(super) fn work(&mut self, says: &'static str, work: impl FnOnce() -> Finish + Send + 'static) {
        if self.label_work.at_work.is_some() {
            return self.notify(texts::STILL_AT_WORK, true);
        }
        let (sender, done) = channel();
        let wake = self.fixed.wake.clone();
        let work = move || {
            // The console may have ended.
            let _ = sender.send(work());
            wake();
        };
        match std::thread::Builder::new().name("bodies".into()).spawn(work) {
            Ok(_) => self.label_work.at_work = Some((done, says)),
            Err(why) => self.notify(&texts::why_no_thread(why), true),
        }
    }

    /// Begins to edit labels: those of the file that is shown, or empty ones on the lattice of the volume.
    pub(super) fn begin_labels(&mut self) {
        let geometry = self.stream.scene().map(|scene| scene.geometry.clone());
        let Some(geometry) = geometry.filter(|_| self.controls.labelling().is_none()) else { return };
        let has_labels = self.controls.settings().labels.volume.is_some();
        let file = self.fixed.origin.as_ref().and_then(|origin| origin.labels.clone()).filter(|_| has_labels);
        let world = self.fixed.world.clone();
        self.work(texts::NO_LABELS_YET, move || {
            let begun = begun(file.as_deref(), &geometry, world.and_then(|world| world()));
            Box::new(|console| match begun {
                Ok(labels) => console.controls.begin_labels(labels),
                Err(why) => console.notify(&texts::no_labels(why), true),
            })
        });
    }

    /// Moves the brush to a pixel of the picture.
    pub(super) fn brush_labels(&mut self, pixel: [f64; 2], tile: Option<usize>, erases: bool) {
        let place = match self.place_of_brush(pixel, tile) {
            Ok(place) => place,
            Err(why) => return self.label_work.fault = Some(why),
        };
        let last = std::mem::replace(&mut self.label_work.last, place.map(|(place, _)| place));
        let radius = self.controls.brush_radius();
        self.controls.edit_labels(|labels| {
            if let (Some((to, plane)), Effect::Paint | Effect::Erase) = (place, labels.effect) {
                // The surface may jump to what is behind.
                let from = last.filter(|last| tile.is_some() || last.distance(to) <= 2.0 * radius).unwrap_or(to);
                labels.paint([from, to], radius, plane, erases || labels.effect == Effect::Erase);
            }
        });
    }

    /// The place in space under a pixel of the picture, mm, and the normal of the plane on which it is; None beside the tile and where no
    /// surface is.
    fn place_of_brush(&mut self, pixel: [f64; 2], tile: Option<usize>) -> Result<Option<Place>, String> {
        if let Some(n) = tile {
            let Some(tiling) = self.presentation.shown().map(|shown| shown.scene.tiling()) else { return Ok(None) };
            let place = |tile: &Tile| (tiling.point(tile, pixel), tile.section.is_none().then_some(tile.plane.normal));
            return Ok(tiling.tiles.get(n).filter(|tile| tile.has(pixel)).map(place));
        }
        if self.label_work.surface.is_none() {
            self.label_work.surface = Some(self.drawn_surface(texts::LABELS_NEED_SURFACE)?);
        }
        let surface = self.label_work.surface.as_ref();
        Ok(surface.and_then(|(scene, distances)| Some((SurfaceMap::of(scene, distances).at(pixel)?, None))))
    }

    /// Ends a stroke of the brush, or lets a body grow from its last place.
    pub(super) fn end_stroke_of_labels(&mut self, now: Instant) {
        self.label_work.surface = None;
        if let Some(why) = self.label_work.fault.take() {
            self.notify(&why, true);
        }
        match (self.controls.labelling().map(|labels| labels.effect), self.label_work.last.take()) {
            (None, _) => self.begin_labels(),
            (Some(Effect::GrowBright), Some(seed)) => self.grow(seed, false),
            (Some(Effect::GrowDark), Some(seed)) => self.grow(seed, true),
            _ if self.controls.end_edit_of_labels() => self.activity.changes_settings(now),
            _ => {}
        }
    }

    fn grow(&mut self, seed: DVec3, is_dark: bool) {
        let (Some((header, volume)), Some(labels)) = (self.shown_volume(), self.controls.labelling()) else {
            return self.notify(texts::NO_VOLUME_IN_LOOP, true);
        };
        let (lattice, label) = (labels.lattice(), labels.chosen);
        self.work(texts::GROWING, move || {
            let grown = grown(&volume, header.range, is_dark, seed, lattice);
            Box::new(move |console| match grown {
                Ok((voxels, body)) => console.label_voxels(&voxels, label, &texts::grown(&body)),
                Err(why) => console.notify(&texts::not_grown(why), true),
            })
        });
    }

    /// Labels the body of a volume by contours, by its index in the list of measurements.
    pub(super) fn fill_labels(&mut self, n: usize) {
        let (Some(labels), Some(scene)) = (self.controls.labelling(), self.stream.scene()) else { return };
        let Some(measured) = self.controls.measures().get(n) else { return };
        let (label, (grid, to_grid)) = (labels.chosen, labels.grid());
        let place = |point: &[f64; 3]| to_grid.transform_point3(scene.place_of(*point));
        let contours: Vec<Vec<DVec3>> =
            measured.contours.iter().map(|contour| contour.iter().map(place).collect()).collect();
        self.work(texts::FILLING, move || {
            let filled = contours::voxels(&grid, &contours);
            Box::new(move |console| match filled {
                Ok(voxels) if voxels.is_empty() => console.notify(&texts::not_grown(texts::WHY_NOTHING_TO_FILL), true),
                Ok(voxels) => {
                    let volume = voxels.len() as f64 * grid.spacing.iter().product::<f64>() / 1000.0;
                    console.label_voxels(&voxels, label, &texts::filled(n + 1, volume));
                }
                Err(why) => console.notify(&texts::not_grown(why), true),
            })
        });
    }

    /// Gives voxels a label, as a step of undo, and says so.
    fn label_voxels(&mut self, voxels: &[u32], label: u8, says: &str) {
        // A stroke in progress is a step of its own.
        self.controls.end_edit_of_labels();
        self.controls.edit_labels(|labels| labels.set(voxels, label));
        self.controls.end_edit_of_labels();
        self.activity.changes_settings(Instant::now());
        self.notify(says, false);
    }

    /// Takes what a thread has made of labels, and lets the picture show edits once it can be drawn anew.
    pub(super) fn poll_labels(&mut self, now: Instant) {
        let done = self.label_work.at_work.as_ref().map(|(done, _)| done.try_recv());
        if let Some(done) = done.filter(|done| !matches!(done, Err(TryRecvError::Empty))) {
            self.label_work.at_work = None;
            self.presentation.redraw();
            match done {
                Ok(finish) => finish(self),
                Err(_) => self.notify(&texts::not_grown(texts::WHY_THREAD_ENDED), true),
            }
        }
        if !self.stream.is_drawing() && self.controls.show_labels() {
            self.activity.changes_settings(now);
        }
    }
}

/// Labels to edit: those of a file, or empty ones for a volume of this geometry. `world`: where it is, if it says so.
fn begun(file: Option<&Path>, geometry: &Geometry, world: Option<World>) -> Result<Labelling, String> {
    let (labels, segments) = match file {
        Some(file) => files::read(file, OpenOptions::default()).map_err(|e| e.to_string())?,
        None => {
            let grid = usual_grid(geometry)?;
            let own = world.filter(|_| matches!(geometry, Geometry::Cartesian(_)));
            (Labels::new(grid, own.unwrap_or(World::of(&grid)))?, Vec::new())
        }
    };
    if labels.voxels().len() > MOST_VOXELS {
        return Err(texts::too_many_voxels(MOST_VOXELS));
    }
    let to_space = files::to_space(&labels, geometry, world);
    Ok(Labelling::new(labels, segments, to_space))
}

/// The body that the usual search with a seed (in space, mm) finds: the numbers of its voxels on a lattice, and what was measured of it. `range`: the
/// stored values at both ends of the sample range; `lattice`: number of its voxels, and the map from their index to space, mm.
fn grown(
    volume: &Volume,
    range: [f64; 2],
    is_dark: bool,
    seed: DVec3,
    lattice: ([usize; 3], DAffine3),
) -> Result<(Vec<u32>, Body), String> {
    let grid = usual_grid(volume.geometry())?;
    let field = Field::of(volume, range, Scale::by_speckle(volume, range), grid, || ())?;
    let found = find(&field, World::of(&grid), &Search::usual(&grid, is_dark, Some(seed)))?;
    let body = found.bodies.into_iter().next().ok_or(texts::WHY_NO_LABELS)?;
    Ok((found.labels.sampled(lattice.0, lattice.1), body))
}
