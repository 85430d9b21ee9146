//! Small pictures of volumes, one for each preset or each volume of the loop, drawn beside the view by a renderer of their own from a coarse copy of
//! the volume. Each waits for the view to rest. Copy and renderer exist only while pictures are made.

use crate::gpu::{Context, Renderer, RendererOptions, Wake};
use crate::picture::Picture;
use crate::probe::Geometry;
use crate::scene::{
    Bilateral, Conditioning, Distance, Drawings, Input, Layout, LightVolume, Post, Ray, Scene, Settings, Slices,
};
use crate::source::coarse::coarse;
use crate::source::{Frame, StoredType};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Width and height of a thumbnail, pixels.
pub(super) const SIZE: [u32; 2] = [256, 160];
/// Longest edge of a slice, pixels.
const SLICE: u32 = 128;
/// Least distance of the samples of a ray, mm.
const STEP: f64 = 0.6;
/// Least edge of a cell of light, mm.
const CELL: f64 = 1.6;
/// Longest that a picture waits for the view to rest.
const PATIENCE: Duration = Duration::from_secs(1);
const POLL: Duration = Duration::from_millis(10);

/// A list of thumbnails to draw.
pub(super) struct Job {
    pub(super) context: Arc<Context>,
    pub(super) input: Input,
    /// For each thumbnail what it shows; None for one that is not drawn.
    pub(super) pictures: Vec<Option<Wanted>>,
    /// Called by the drawing thread after each thumbnail, drawn or failed.
    pub(super) wake: Wake,
}

/// The volume that a thumbnail shows, and its settings.
pub(super) struct Wanted {
    pub(super) geometry: Geometry,
    pub(super) frames: Vec<Arc<Frame>>,
    pub(super) settings: Settings,
}

/// A list of thumbnails, and the thread that draws them.
#[derive(Default)]
pub(super) struct Thumbnails {
    /// The thumbnails drawn so far; None for one that is not. Those of an earlier job stay until they are replaced.
    pub(super) pictures: Vec<Option<Arc<Picture>>>,
    work: Option<Work>,
    /// Threads that were told to stop.
    ending: Vec<JoinHandle<()>>,
}

struct Work {
    made: Receiver<(usize, Option<Picture>)>,
    orders: Arc<Orders>,
    thread: JoinHandle<()>,
}

/// What the thread is told while it works.
#[derive(Default)]
struct Orders {
    must_stop: AtomicBool,
    /// Whether the view rests.
    may_draw: AtomicBool,
}

impl Thumbnails {
    pub(super) fn is_working(&self) -> bool {
        self.work.is_some()
    }

    /// Starts to draw the thumbnails of a job, in place of those that are being drawn.
    pub(super) fn begin(&mut self, job: Job) {
        self.stop();
        self.pictures.resize(job.pictures.len(), None);
        let nothing = job.pictures.iter().zip(&mut self.pictures).filter(|(wanted, _)| wanted.is_none());
        nothing.for_each(|(_, picture)| *picture = None);
        let (sender, made) = channel();
        let orders = Arc::new(Orders::default());
        let heard = orders.clone();
        let work = move || job.draw(&heard, &sender);
        match std::thread::Builder::new().name("thumbnails".into()).spawn(work) {
            Ok(thread) => self.work = Some(Work { made, orders, thread }),
            Err(e) => tracing::debug!("no thumbnails are made: {e}"),
        }
    }

    /// Collects thumbnails that are finished. `may_draw`: the view is at rest, so that the thread may use the device. Returns true if there is a
    /// new one.
    pub(super) fn poll(&mut self, may_draw: bool) -> bool {
        self.ending.retain(|thread| !thread.is_finished());
        let Some(work) = &self.work else { return false };
        work.orders.may_draw.store(may_draw, Ordering::Relaxed);
        let mut is_new = false;
        loop {
            match work.made.try_recv() {
                Ok((n, picture)) => {
                    is_new = true;
                    if let Some(place) = self.pictures.get_mut(n) {
                        *place = picture.map(Arc::new);
                    }
                }
                Err(TryRecvError::Empty) => return is_new,
                Err(TryRecvError::Disconnected) => {
                    self.stop();
                    return true;
                }
            }
        }
    }

    /// Stops drawing, and discards all thumbnails after the first `count`.
    pub(super) fn keep_first(&mut self, count: usize) {
        self.stop();
        self.pictures.truncate(count);
    }

    /// Stops drawing, without waiting for the thread to end.
    pub(super) fn stop(&mut self) {
        if let Some(work) = self.work.take() {
            work.orders.must_stop.store(true, Ordering::Relaxed);
            self.ending.push(work.thread);
        }
    }
}

impl Drop for Thumbnails {
    fn drop(&mut self) {
        self.stop();
        // The device must not go while one of them uses it.
        self.ending.drain(..).for_each(|thread| drop(thread.join()));
    }
}

impl Job {
    fn draw(self, orders: &Orders, made: &Sender<(usize, Option<Picture>)>) {
        let must_stop = || orders.must_stop.load(Ordering::Relaxed);
        let (mut renderer, mut copy) = (None, None);
        for (n, wanted) in self.pictures.iter().enumerate() {
            let since = Instant::now();
            while !must_stop() && !orders.may_draw.load(Ordering::Relaxed) && since.elapsed() < PATIENCE {
                std::thread::sleep(POLL);
            }
            if must_stop() {
                return;
            }
            let Some(wanted) = wanted else { continue };
            let picture = wanted.coarse(self.input.stored, &mut copy).and_then(|(geometry, frames)| {
                let scene = Scene::new(geometry.clone(), self.input, thumbnail(&wanted.settings)).ok()?;
                drawn(&self.context, &mut renderer, scene, frames, orders)
            });
            // A picture of an earlier volume is not to stay.
            if made.send((n, picture)).is_err() {
                return;
            }
            (self.wake)();
        }
    }
}

/// A coarse copy, and the first of the frames that it was made of.
type Copy = (Arc<Frame>, Geometry, Vec<Frame>);

impl Wanted {
    /// A coarse copy of the volume: the one before if it is of the same frames.
    fn coarse<'a>(&self, stored: StoredType, copy: &'a mut Option<Copy>) -> Option<(&'a Geometry, &'a [Frame])> {
        let first = self.frames.first()?;
        if copy.as_ref().is_none_or(|(of, ..)| !Arc::ptr_eq(of, first)) {
            *copy = coarse(&self.geometry, stored, &self.frames)
                .map(|(geometry, frames)| (first.clone(), geometry, frames));
        }
        copy.as_ref().map(|(_, geometry, frames)| (geometry, frames.as_slice()))
    }
}

/// A picture of the frames; none if the device does not make one, or the list is closed meanwhile.
fn drawn(
    context: &Arc<Context>,
    renderer: &mut Option<Renderer>,
    scene: Scene,
    frames: &[Frame],
    orders: &Orders,
) -> Option<Picture> {
    let draw = || {
        let mut there = match renderer.take() {
            Some(mut there) => {
                there.change(scene)?;
                there
            }
            None => Renderer::new(context, scene, &RendererOptions::default())?,
        };
        for frame in frames {
            if orders.must_stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            there.frame(frame.slice as u32, &frame.bytes, 0)?;
        }
        there.show(0)?;
        let picture = there.picture()?;
        *renderer = Some(there);
        Ok::<_, crate::gpu::GpuError>(Some(picture))
    };
    draw().map_err(|fault| tracing::debug!("no thumbnail: {fault}")).ok().flatten()
}

/// Settings of a small picture that looks like the large one: filters in pixels are smaller, and what a coarse volume has no use for is left out.
fn thumbnail(settings: &Settings) -> Settings {
    let of = settings.clone();
    let volume = of
        .light
        .volume
        .map(|volume| LightVolume { cell: Some(volume.cell.map_or(CELL, |cell| cell.max(CELL))), ..volume });
    let has_distance = of.distance.median > 0 || of.distance.median_mm.is_some() || of.distance.bilateral.is_some();
    let bilateral = Bilateral { pixels: 1.5, mm: None, distance: 3.0, repeat: 1 };
    Settings {
        layout: if of.layout == Layout::Pair { Layout::Pair } else { Layout::Single },
        floating: 0.0,
        picture: crate::scene::settings::Picture { size: SIZE },
        conditioning: Conditioning { low_pass: None, low_pass_mm: None, samples: None, ..of.conditioning },
        slices: Slices { pixels: SLICE.min(of.slices.pixels), smooth: of.slices.smooth, ..Slices::default() },
        ray: Ray {
            step: Some(of.ray.step.unwrap_or(STEP).max(STEP)),
            samples_per_voxel: None,
            subsampling: 1,
            rays: 1,
            sliding: 0,
            ..of.ray
        },
        distance: match has_distance {
            true => Distance { median: 3, bilateral: Some(bilateral), ..Distance::default() },
            false => Distance::default(),
        },
        light: crate::scene::Light { volume, ..of.light },
        planes: crate::scene::Planes { lines: false, reference: false, smooth: None, ..of.planes },
        post: Post { sigma: None, enhanced_sigma: None, perona_malik: None, ..of.post },
        drawn: Drawings::default(),
        ..of
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::Geometry;
    use crate::scene::load::{Layers, PRESETS};
    use crate::source::phantom::{Phantom, PhantomOptions};

    /// Prevents a preset whose thumbnail is refused, or as large as the picture itself.
    #[test]
    fn a_thumbnail_of_every_preset_is_a_small_scene() {
        let phantom = Phantom::new(PhantomOptions::default()).expect("a phantom");
        let geometry = Geometry::Sweep(phantom.probe(0).clone());
        let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
        for (name, _) in PRESETS {
            let mut layers = Layers::default();
            layers.preset(name).expect("preset");
            let settings = thumbnail(&layers.finish().expect("settings"));
            let scene = Scene::new(geometry.clone(), input, settings).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(scene.picture_size(), SIZE, "{name}");
        }
    }
}
