//! Consecutive frames go through stage 1 together: the same bits as one by one, in fewer submissions and dispatches. A frame that arrives
//! alone does not wait.

use crate::common::gpu::*;
use crate::common::wait;
use crate::live::{Told, events, header, settings, volume};
use echolume::low_level::barriers::Resource;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::live::{self, Feed, Step, Stream};
use echolume::low_level::passes::slots::frames_per_batch;
use echolume::low_level::passes::{Frequency, Slot, Texels};
use echolume::low_level::probe::{Axis, Geometry, Probe};
use echolume::low_level::queues::oracle::Event as Logged;
use echolume::low_level::scene::Scene;
use echolume::low_level::source::Frame;
use echolume::low_level::source::live::{Event, Live};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

const SLICES: usize = 37;

/// Every pass of stage 1, alone and after others.
const FILTERS: [&str; 12] = [
    "smooth = { elevation = 0.7 }",
    "median = true",
    "estimator = 'nagao-matsuyama'",
    "sigma = {}",
    "enhanced_sigma = { growth = true }",
    "perona_malik = { repeat = 2 }",
    "perona_malik = { scheme = 'aos' }",
    "perona_malik = { scheme = 'aos-richardson' }",
    "perona_malik = { scheme = 'rkl1' }",
    "smooth = { lateral = 1.0 }",
    "smooth = { depth = 1.5 }",
    "median = true, sigma = {}, perona_malik = { scheme = 'aos', repeat = 2 }, smooth = { lateral = 1.0, depth = 1.0 }",
];

const CONDITIONED: &str = "conditioning = { samples = 32 }";

fn swept(toml: &str) -> Scene {
    let probe = Probe { slices: Axis::centred(0.02, SLICES), ..wobbler() };
    scene(Geometry::Sweep(probe), BYTES, &format!("mode = 'mip'\npicture = {{ size = [16, 16] }}\n{toml}"))
}

fn noise(scene: &Scene) -> Vec<Vec<u8>> {
    let (mut noise, [width, height]) = (Noise(3), scene.frame_size().map(|n| n as usize));
    let format = frame_format(scene);
    let mut frame = || {
        let mut texels = Texels::from_fn([width, height, 1], 1, |_, _| 0.0);
        texels.values.iter_mut().for_each(|value| *value = noise.next());
        texels.encode(format)
    };
    (0..scene.slices()).map(|_| frame()).collect()
}

/// As many frames at once as fit, also in software.
fn together() -> RendererOptions {
    RendererOptions { frames_at_once: Some(u32::MAX), ..RendererOptions::default() }
}

/// Sends the frames in this order, and so many at once.
fn send_in(renderer: &mut Renderer, frames: &[Vec<u8>], order: &[usize], at_once: usize) {
    for (n, &k) in order.iter().enumerate() {
        renderer.frame(k as u32, &frames[k], 0).expect("frame");
        if (n + 1) % at_once == 0 {
            renderer.submit_frames().expect("submitted");
        }
    }
}

/// Prevents texels that are lost or exchanged where a workgroup of the Gaussian or the sigma filter reads its texels into shared memory, and an invocation of
/// the median makes one column, as on a GPU: slices that end within a workgroup, and parts of them. On a GPU both are as there.
#[test]
fn texels_of_shared_memory_are_those_that_single_invocations_read() {
    let device = Device::new();
    for pixels in [77, 200] {
        let filters = "median = true, sigma = { window = 9, sigma = 0.2 }, smooth = { lateral = 1.0, depth = 2.0 }";
        for region in ["", "[region]\nlateral = [-3, 4]\ndepth = [20, 31]"] {
            let single = swept(&format!("slices = {{ pixels = {pixels}, {filters} }}\n{region}"));
            let mut shared = single.clone();
            shared.device.shared_memory = 16 << 10;
            let volume = |scene: &Scene| {
                let mut renderer = Renderer::new(&device, scene.clone(), &together()).expect("renderer");
                let order: Vec<usize> = (0..SLICES).collect();
                send_in(&mut renderer, &noise(scene), &order, SLICES);
                renderer.picture().expect("picture");
                renderer.read(Slot::Volume).expect("read").expect("there")
            };
            let (one, other) = (volume(&single), volume(&shared));
            assert!(one.values.iter().any(|v| *v > 0.1), "{pixels}: an empty volume");
            assert!(one == other, "{pixels} pixels, {region}");
        }
    }
}

#[test]
fn batches_of_any_length_and_order_leave_the_same_bits() {
    let device = Device::new();
    let up: Vec<usize> = (0..SLICES).collect();
    let down: Vec<usize> = up.iter().rev().copied().collect();
    // Up, down, a slice twice, and a gap.
    let mixed: Vec<usize> =
        [(0..9).collect(), (9..20).rev().collect(), vec![9, 9, 10], (20..37).rev().collect::<Vec<_>>()].concat();
    let polar = FILTERS.iter().map(|filter| swept(&format!("slices = {{ pixels = 48, everything = true, {filter} }}")));
    let conditioned = swept(&format!("slices = {{ pixels = 48, everything = true, median = true }}\n{CONDITIONED}"));
    let block =
        scene(cartesian([24, 33, SLICES]), BYTES, "mode = 'mip'\npicture.size = [16, 16]\nslices.median = true");
    let copied =
        scene(cartesian([24, 33, SLICES]), BYTES, "mode = 'mip'\npicture.size = [16, 16]\nslices.format = 'r8'");
    for scene in polar.chain([conditioned, block, copied]) {
        let frames = noise(&scene);
        let volume = |order: &[usize], at_once: usize| {
            let mut renderer = Renderer::new(&device, scene.clone(), &together()).expect("renderer");
            send_in(&mut renderer, &frames, order, at_once);
            renderer.show(0).expect("show");
            renderer.picture().expect("picture");
            renderer.read(Slot::Volume).expect("read").expect("there")
        };
        let single = volume(&up, 1);
        assert!(single.values.iter().filter(|v| **v > 0.0).count() > SLICES * 300, "slices hold something");
        for (order, at_once) in [(&up, 4), (&up, usize::MAX), (&down, 4), (&down, usize::MAX), (&mixed, usize::MAX)] {
            let together = volume(order, at_once);
            let differ = single.values.iter().zip(&together.values).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
            assert_eq!(differ, 0, "{at_once} at once: {:?}", scene.settings.slices);
        }
    }
}

#[test]
fn a_batch_takes_one_submission_and_one_dispatch_of_each_pass() {
    let device = Device::new();
    let scene =
        swept("slices = { pixels = 48, everything = true, median = true, sigma = {}, smooth = { lateral = 1.0 } }");
    assert_eq!(frames_per_batch(&scene), 16);
    let frames = noise(&scene);
    let options = RendererOptions { queues: Some(1), log: true, ..together() };
    let up: Vec<usize> = (0..SLICES).collect();
    let down: Vec<usize> = up.iter().rev().copied().collect();
    for (order, at_once, batches) in [
        (&up, usize::MAX, vec![16, 16, 5]),
        (&down, usize::MAX, vec![16, 16, 5]),
        (&up, 1, vec![1; SLICES]),
        (&up, 10, vec![10, 10, 10, 7]),
    ] {
        let mut renderer = Renderer::new(&device, scene.clone(), &options).expect("renderer");
        let before = renderer.log().expect("log").submissions.len();
        let dispatched = renderer
            .dispatch_extents(|r| {
                send_in(r, &frames, order, at_once);
                Ok(())
            })
            .expect("recorded");
        let log = renderer.log().expect("log");
        assert_eq!(log.find_hazard(&scene), None);
        let submissions = &log.submissions[before..];
        assert_eq!(submissions.len(), batches.len());
        let steps = renderer.plan().steps_of(Frequency::Frame).count();
        assert_eq!((steps, dispatched.len()), (4, 4 * batches.len()));
        let deep: Vec<u32> = dispatched.iter().step_by(steps).map(|(_, [.., z])| *z).collect();
        assert_eq!(deep, batches);
        // Of the volume each writes its own slices.
        let mut written = vec![0; SLICES];
        let operations = submissions.iter().flat_map(|submission| &submission.events).filter_map(|event| match event {
            Logged::Operation(accesses) => Some(accesses),
            _ => None,
        });
        for access in operations.flatten().filter(|a| a.write && a.resource == Resource::Slot(Slot::Volume, 0)) {
            access.parts.clone().for_each(|slice| written[slice as usize] += 1);
        }
        assert_eq!(written, [1; SLICES]);
    }
}

/// Prevents a second copy of a frame by the host on its way to the device.
#[test]
fn the_host_copies_each_byte_of_a_volume_once() {
    let device = Device::new();
    // Slices that stage 1 converts, and slices that are copied as they are.
    let copied =
        scene(cartesian([24, 33, SLICES]), BYTES, "mode = 'mip'\npicture.size = [16, 16]\nslices.format = 'r8'");
    for scene in [swept("slices = { pixels = 48, everything = true }"), copied] {
        let frames = noise(&scene);
        let mut renderer = Renderer::new(&device, scene, &together()).expect("renderer");
        let staged = || device.counts.staged.load(Ordering::Relaxed);
        let before = staged();
        send_in(&mut renderer, &frames, &(0..SLICES).collect::<Vec<_>>(), SLICES);
        renderer.picture().expect("picture");
        assert_eq!(staged() - before, frames.iter().map(|bytes| bytes.len() as u64).sum::<u64>());
    }
}

/// Frames of a volume, and then nothing more until the stream is dropped.
struct Pausing(Told);

impl Live for Pausing {
    fn next(&mut self, patience: Duration) -> Event {
        match self.0.0.is_empty() {
            true => {
                wait::pace(patience.min(Duration::from_millis(5)));
                Event::Idle
            }
            false => self.0.next(patience),
        }
    }

    fn can_wait(&self) -> bool {
        true
    }
}

#[test]
fn a_frame_that_arrives_alone_is_submitted_at_once_and_those_that_wait_together() {
    let device = Device::new();
    let settings = || settings("mode = 'mip'\nslices.median = true");
    let mut frames = volume(0, |slice, i| (slice * 31 + i) as u8);
    let dispatches_of = |told: Vec<Event>, frames: u64| {
        // The header, and frames that are whole.
        let count = 1 + frames as usize;
        let feed = Feed::new(Box::new(Pausing(Told(told.into(), Duration::ZERO, true))), None).expect("thread");
        let begun = Instant::now();
        while feed.waiting() < count {
            assert!(begun.elapsed() < Duration::from_secs(60), "the events do not arrive");
            wait::poll();
        }
        let mut stream = Stream::new(&device, feed, settings(), live::StreamOptions::default());
        let before = stream.dispatches();
        while stream.frames() < frames || stream.has_waiting() {
            assert!(matches!(stream.step(Duration::from_millis(20)).expect("step"), Step::Progress));
        }
        stream.dispatches() - before
    };
    // Of an incomplete volume no picture is drawn: every dispatch is of stage 1.
    assert_eq!(dispatches_of(events(header(0.3), frames.drain(..1)), 1), 2);
    assert_eq!(
        dispatches_of(events(header(0.3), frames.drain(..7)), 7),
        if device.candidate.is_software() { 4 } else { 2 },
        "seven waited"
    );
    let last = frames.remove(0);
    let half = last.bytes.len() / 2;
    let lines = |bytes: &[u8], first| Event::Lines { frame: Frame { bytes: bytes.to_vec(), ..last.clone() }, first };
    let begin = Event::Begin(Box::new(header(0.3)));
    assert_eq!(
        dispatches_of(vec![begin, lines(&last.bytes[..half], 0), lines(&last.bytes[half..], 12)], 1),
        2,
        "in lines"
    );
}
