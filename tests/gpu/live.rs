//! Frames that arrive while pictures are drawn: pictures show complete sent volumes, on one, two and three queues.

use crate::common::gpu::*;
use crate::common::scenes;
use crate::common::wait;
use echolume::low_level::gpu::{Renderer, RendererOptions, TimeStamps};
use echolume::low_level::live::{self, Feed, Statistics, Step, Stream, Update};
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::probe::{Advance, Geometry, Probe};
use echolume::low_level::scene::Settings;
use echolume::low_level::source::live::{Event, Live};
use echolume::low_level::source::recorder::Header;
use echolume::low_level::source::{Frame, StoredType};
use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A device whose single queue acts as several: the layers of 1.3.239 ignore timeline semaphores, so they report every pair of
/// submissions as a hazard then. Any other message fails the test.
struct Playing {
    device: Device,
    queues: usize,
}

impl Playing {
    fn new(queues: usize) -> Playing {
        let mut device = Device::alone();
        device.provoked = device.queue_count() < queues;
        Playing { device, queues }
    }
}

impl Drop for Playing {
    fn drop(&mut self) {
        let between = |m: &String| self.queues > 1 && m.contains("SYNC-HAZARD") && m.contains("vkQueueSubmit2");
        if !std::thread::panicking() {
            let other: Vec<_> = self.device.messages().into_iter().filter(|m| !between(m)).collect();
            assert!(other.is_empty(), "{} queues: {other:?}", self.queues);
        }
    }
}

/// A source that yields prepared events with pauses, and can wait or not.
pub struct Told(pub VecDeque<Event>, pub Duration, pub bool);

impl Live for Told {
    fn next(&mut self, _: Duration) -> Event {
        wait::pace(self.1);
        self.0.pop_front().unwrap_or(Event::End(None))
    }

    fn can_wait(&self) -> bool {
        self.2
    }
}

/// The wobbler with a motor that moves during a frame.
fn moving(share: f64) -> Probe {
    let probe = wobbler();
    Probe { advance: Advance::Same(share * probe.slices.pitch()), ..probe }
}

pub fn header(share: f64) -> Header {
    Header {
        forward: Geometry::Sweep(moving(share)),
        backward: Geometry::Sweep(moving(-share)),
        stored: StoredType::U8,
        range: [0.0, 255.0],
        posed: false,
        synthetic: false,
    }
}

pub fn settings(toml: &str) -> Settings {
    let small = "picture = { size = [24, 24] }\nslices = { pixels = 40, format = 'r8'";
    scenes::settings(&match toml.split_once("slices.") {
        Some((before, after)) => format!("{before}\n{small}, {after} }}"),
        None => format!("{toml}\n{small} }}"),
    })
}

/// A volume of a sweep with its frames in order of acquisition: every second one backwards, each sample from its position.
pub fn volume(number: u32, value: impl Fn(usize, usize) -> u8) -> Vec<Frame> {
    let (slices, bytes) = (9, 24 * 64);
    let frame = |n: u32| {
        let backward = number % 2 == 1;
        let slice = if backward { slices - 1 - n } else { n } as usize;
        let bytes = (0..bytes).map(|i| value(slice, i)).collect();
        Frame { volume: number, number: n, slice, backward, time: None, pose: None, bytes }
    };
    (0..slices).map(frame).collect()
}

/// The samples of each slice hold the number of its sweep.
pub fn stamped(number: u32) -> Vec<Frame> {
    volume(number, |_, _| 10 * number as u8 + 5)
}

pub fn speckled(number: u32) -> Vec<Frame> {
    let hash = |slice: usize, i: usize| (slice * 7919 + i * 104_729 + number as usize * 31) as u32;
    volume(number, |slice, i| (hash(slice, i).wrapping_mul(2_654_435_761) >> 24) as u8)
}

/// Steps a stream to its end; `each` runs after each picture.
pub fn run(stream: &mut Stream, mut each: impl FnMut(&mut Stream, live::FinishedPicture)) -> Vec<String> {
    let (mut faults, begun) = (Vec::new(), Instant::now());
    loop {
        assert!(begun.elapsed() < Duration::from_secs(300), "the stream does not end");
        match stream.step(Duration::from_millis(20)).expect("step") {
            Step::Picture(shown) => each(stream, shown),
            Step::Fault(fault) => faults.push(fault),
            Step::Progress => {}
            Step::End(None) => return faults,
            Step::End(Some(why)) => panic!("{why}"),
        }
    }
}

pub fn stream(device: &Device, events: Vec<Event>, settings: Settings, options: live::StreamOptions) -> Stream {
    // With rolling updates there is time for a picture between some frames.
    let pause = Duration::from_millis(if options.update == Update::Rolling { 20 } else { 0 });
    stream_of(device, Told(events.into(), pause, true), settings, options)
}

pub fn stream_of(device: &Device, source: Told, settings: Settings, options: live::StreamOptions) -> Stream {
    let feed = Feed::new(Box::new(source), None).expect("thread");
    Stream::new(device, feed, settings, options)
}

pub fn events(header: Header, frames: impl IntoIterator<Item = Frame>) -> Vec<Event> {
    std::iter::once(Event::Begin(Box::new(header))).chain(frames.into_iter().map(Event::Frame)).collect()
}

pub fn volume_of(renderer: &mut Renderer) -> Texels {
    renderer.read(Slot::Volume).expect("read").expect("there")
}

/// Prevents a picture of two sweeps: each slice holds the number of its sweep, and the device draws slower than frames arrive.
#[test]
fn a_complete_volume_never_mixes_frames_of_two() {
    for (images, queues, waits) in [(2, 1, false), (3, 1, true), (2, 3, true), (3, 2, false), (3, 3, true)] {
        let playing = Playing::new(queues);
        let device = &playing.device;
        let options = live::StreamOptions {
            update: Update::Whole,
            images,
            queues: Some(queues),
            ..live::StreamOptions::default()
        };
        let source = Told(events(header(0.3), (0..12).flat_map(stamped)).into(), Duration::ZERO, waits);
        let settings = settings("mode = 'mip'\nslices.everything = true");
        let mut stream = stream_of(device, source, settings, options);
        let mut shown = Vec::new();
        let faults = run(&mut stream, |stream, picture| {
            let volume = volume_of(stream.renderer().expect("begun"));
            let expected = f64::from(10 * picture.volume as u8 + 5) / 255.0;
            // Pixels outside the sector are 0.
            let mixed = volume.values.iter().find(|v| **v != 0.0 && (**v - expected).abs() > 1e-6);
            assert_eq!(mixed, None, "volume {} of {images} images, {queues} queues", picture.volume);
            assert!(volume.values.iter().filter(|v| **v != 0.0).count() > 9 * 300);
            shown.push(picture.volume);
        });
        assert!(faults.is_empty() && shown.windows(2).all(|w| w[0] < w[1]), "{shown:?} {faults:?}");
        let Statistics { volumes, frames, pictures, latency, .. } = stream.statistics().expect("statistics");
        assert_eq!((frames, volumes.shown + volumes.dropped + volumes.incomplete), (108, 12), "{volumes:?}");
        assert!(!waits || volumes.shown == 12, "a source that can wait loses nothing: {volumes:?}");
        assert_eq!(
            (pictures, latency.len()),
            (volumes.shown, 9 * volumes.shown),
            "a latency for each frame that was shown"
        );
    }
}

/// Prevents times that leave out the frames which arrive while a picture is drawn, without a word.
#[test]
fn every_pass_of_every_frame_is_timed_or_counted() {
    let device = Device::alone();
    for (update, images) in [(Update::Whole, 3), (Update::Rolling, 2)] {
        let time_stamps = TimeStamps::EachPass;
        let options = live::StreamOptions { update, images, time_stamps, ..live::StreamOptions::default() };
        let settings = settings("mode = 'mip'\nslices.median = true");
        let frames = (0..12).flat_map(speckled);
        let mut stream = stream(&device, events(header(0.3), frames), settings, options);
        run(&mut stream, |_, _| {});
        let statistics = stream.take_final_statistics().expect("statistics");
        let runs = |name: &str| statistics.passes.iter().find(|p| p.name == name).map_or(0, |p| p.runs);
        assert_eq!((statistics.frames, statistics.untimed), (108, 0));
        for name in ["upload", "scan_convert", "median_slice"] {
            assert_eq!(runs(name), 108, "{update:?}: {name}");
        }
        assert_eq!(u64::from(runs("raycast_projection")), statistics.pictures, "{update:?}");
    }
}

/// Prevents work that grows with time: once all sweep directions have occurred, frames and pictures need no device memory, no
/// pipeline and no wait for the device to be idle.
#[test]
fn a_running_stream_allocates_and_compiles_nothing_and_never_stalls() {
    let device = Device::alone();
    for (update, toml) in [
        (Update::Whole, "mode = 'sr'\nslices.smooth = { elevation = 1.0 }"),
        (Update::Rolling, "mode = 'vr'\nslices.smooth = { elevation = 1.0 }"),
        (Update::Rolling, "mode = 'vr'\nray = { elevation = 'bspline-sharp', brick = 8 }"),
        (Update::Whole, "mode = 'orthogonal'"),
    ] {
        let options = live::StreamOptions { update, ..live::StreamOptions::default() };
        let count = || {
            let counts = &device.counts;
            [&counts.allocations, &counts.pipelines, &counts.waits_idle].map(|c| c.load(Ordering::Relaxed))
        };
        // The more is left out because the machine is busy, the longer it takes to see four pictures.
        let enough = [10, 40, 160].into_iter().any(|volumes| {
            let source = events(header(0.3), (0..volumes).flat_map(speckled));
            let mut stream = stream(&device, source, settings(toml), options.clone());
            let (mut before, mut pictures) = (None, 0);
            run(&mut stream, |_, shown| {
                pictures += 1;
                // Forward, backward, and mixed while rolling.
                if shown.volume >= 2 {
                    assert_eq!(*before.get_or_insert_with(count), count(), "{update:?}: {toml}");
                }
            });
            pictures > 3 && before.is_some()
        });
        assert!(enough, "{update:?}: {toml}");
    }
}

/// Prevents rolling volumes that end differently from complete ones, and slices that are filtered again without a need.
#[test]
fn a_rolling_volume_shows_each_frame_and_ends_as_the_complete_one() {
    for queues in 1..=3 {
        let playing = Playing::new(queues);
        let device = &playing.device;
        let toml = "mode = 'vr'\nray.brick = 8\nslices.smooth = { elevation = 1.0 }";
        let options =
            live::StreamOptions { update: Update::Rolling, queues: Some(queues), ..live::StreamOptions::default() };
        let mut last = None;
        let mut stream = stream(device, events(header(0.3), (0..4).flat_map(speckled)), settings(toml), options);
        run(&mut stream, |_, shown| last = Some((shown.volume, shown.picture)));
        let scene = stream.scene().expect("begun").clone();
        let Geometry::Sweep(probe) = &scene.geometry else { panic!("a sweep") };
        let back = vec![-0.3 * probe.slices.pitch(); 9];
        assert_eq!(probe.advance, Advance::Each(back), "all slices are of volume 3, which was swept backwards");
        let mut plain = Renderer::new(device, scene, &RendererOptions::default()).expect("renderer");
        speckled(3).iter().for_each(|f| plain.frame(f.slice as u32, &f.bytes, 0).expect("frame"));
        plain.show(0).expect("show");
        assert!(last == Some((3, plain.picture().ok())), "{queues} queues");
        let counts = stream.statistics().expect("statistics").volumes;
        assert_eq!((counts.shown, counts.dropped, counts.incomplete), (4, 0, 0));

        // One more frame: smoothing across slices reaches three to either side, and nothing else is smoothed again.
        let renderer = stream.renderer().expect("begun");
        let work = |r: &mut Renderer| {
            r.frame(4, &speckled(4)[4].bytes, 0)?;
            r.show(0)?;
            r.picture()
        };
        let done = renderer.dispatch_extents(work).expect("picture");
        let made: Vec<_> = done.iter().filter(|(name, _)| *name == "tile_ranges").map(|(_, n)| n[2]).collect();
        assert_eq!(made, [7], "{done:?}");
    }
}
