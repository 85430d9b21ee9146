//! Live sources: the trait that all of them implement, and recordings that are played back as if they were live.

use super::frame::{Frame, Header, Source};
use super::freehand::CompoundingOptions;
use crate::files::InputError;
use glam::DAffine3;
use std::time::{Duration, Instant};

/// The kind of a live source, for messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SourceKind {
    /// The built-in phantom.
    Demo,
    /// A recorded file.
    Recording,
    /// A stream on standard input.
    Pipe,
    /// A probe with a motor, or a server that passes on the images of a probe.
    #[default]
    Probe,
}

/// An event of a live source.
#[derive(Clone, Debug)]
pub enum Event {
    /// The properties of the frames that follow. It comes before the first frame and whenever they change; no frame of an earlier volume follows
    /// it.
    Begin(Box<Header>),
    /// A complete frame.
    Frame(Frame),
    /// Some scan lines of a frame, from line `first` on, in `frame.bytes`. The lines of a frame arrive in order; its last line completes it.
    Lines { frame: Frame, first: usize },
    /// Data were left out for the given reason. The source continues.
    Fault(String),
    /// Nothing arrived within the time that the caller wanted to wait.
    Idle,
    /// The source has ended; the reason if that was not expected.
    End(Option<String>),
}

/// A source whose frames arrive on its own clock. Implement it to stream from a device of your own.
///
/// Contract: [`Event::Begin`] comes before the first frame. Volume numbers never decrease. After [`Event::End`], `next` is not called again. Any
/// input gives frames or faults, never a panic, and a source takes no more memory than it documents.
pub trait Live: Send {
    /// The next event. It waits for about `patience` at most and then returns [`Event::Idle`].
    fn next(&mut self, patience: Duration) -> Event;

    /// True if the source waits for the caller, so that nothing is lost when `next` is not called for a while. A pipe does, and a file that is read
    /// as fast as possible. False if frames come at a rate of their own, whether or not volumes are then lost.
    fn can_wait(&self) -> bool;

    /// True if the source is a recording that is read as fast as the caller takes frames. Frames that are read while the picture is frozen then
    /// belong to the cine loop.
    fn is_recording(&self) -> bool {
        false
    }

    /// Options by which pictures with poses are compounded into a volume ([`Posed`](super::posed::Posed)); None: they are not compounded.
    fn compounding(&self) -> Option<CompoundingOptions> {
        None
    }

    /// Number of pictures of a freehand sweep so far that are not, or not wholly, in the volume.
    fn left_out(&self) -> u64 {
        0
    }

    /// The reason on one line why nothing can arrive at present, such as a refused connection. None while the source is connected.
    fn disconnected(&self) -> Option<String> {
        None
    }
}

/// When the frames of a file are delivered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Playback {
    /// As soon as they are requested.
    Fast,
    /// At this number of volumes a second; the frames of a volume are evenly spaced in time.
    Volumes(f64),
    /// At the recorded times of arrival, otherwise at the times of the time stamps. Frames with neither follow at once.
    Recorded,
}

/// Plays a recording or the phantom as a live source. It buffers at most one frame.
pub struct PlaybackSource {
    source: Box<dyn Source>,
    playback: Playback,
    /// How often the source is played.
    rounds: u32,
    round: u32,
    /// Number of the first volume of this round, and the highest number so far.
    base: u32,
    highest: u32,
    begun: Option<(Instant, f64)>,
    /// The volume that is played, when it was due, and its time stamp.
    playing: Option<(u32, Instant, f64)>,
    /// How long the volume before it lasted, s.
    lasted: f64,
    /// When the next round begins, at the earliest.
    resumes: Option<Instant>,
    /// The header was passed on.
    is_begun: bool,
    /// Of all frames without one of their own.
    pose: Option<DAffine3>,
    /// A frame that is not due yet, and when it is.
    waiting: Option<(Instant, Frame)>,
    frames: u64,
}

impl PlaybackSource {
    /// Plays `source` `rounds` times, at least once. Volume numbers continue from round to round.
    pub fn new(source: Box<dyn Source>, playback: Playback, rounds: u32) -> PlaybackSource {
        PlaybackSource {
            source,
            playback,
            rounds,
            round: 0,
            base: 0,
            highest: 0,
            begun: None,
            playing: None,
            lasted: 0.0,
            resumes: None,
            is_begun: false,
            pose: None,
            waiting: None,
            frames: 0,
        }
    }

    /// The next frame, and when it is due.
    fn read(&mut self) -> Result<Option<(Instant, Frame)>, InputError> {
        let mut next = self.source.next_frame()?;
        if next.is_none() {
            self.round += 1;
            if self.round >= self.rounds || self.frames == 0 {
                return Ok(None);
            }
            // The time stamps begin again. The last volume lasts as long as the one before it: nothing states its end.
            self.begun = None;
            let lasted = Duration::try_from_secs_f64(self.lasted).unwrap_or_default();
            self.resumes = self.playing.take().map(|(_, due, _)| due + lasted);
            self.base = self.highest.wrapping_add(1);
            self.source.skip_to_volume(0)?;
            next = self.source.next_frame()?;
        }
        let Some(mut frame) = next else { return Ok(None) };
        frame.volume = frame.volume.wrapping_add(self.base);
        frame.pose = frame.pose.or(self.pose);
        self.highest = frame.volume;
        let stamp = match self.playback {
            Playback::Fast => 0.0,
            Playback::Volumes(rate) => self.frames as f64 / (rate * self.source.frames_per_volume().max(1) as f64),
            Playback::Recorded => self.source.arrival().or(frame.time).unwrap_or(0.0),
        };
        self.frames += 1;
        let now = Instant::now();
        let starts = self.resumes.take().map_or(now, |resumes| resumes.max(now));
        let (began, first) = *self.begun.get_or_insert((starts, stamp));
        // A stamp that is not finite or before the first is due at once.
        let after = Duration::try_from_secs_f64((stamp - first).clamp(0.0, MAX_SPAN)).unwrap_or_default();
        let due = began + after;
        if self.playing.is_none_or(|(volume, ..)| volume != frame.volume) {
            let before = self.playing.replace((frame.volume, due, stamp));
            let lasted = before.map_or(0.0, |(_, _, before)| stamp - before);
            self.lasted = if (0.0..=LONGEST_VOLUME).contains(&lasted) { lasted } else { 0.0 };
        }
        Ok(Some((due, frame)))
    }
}

/// Longest interval between two volumes that is not a pause, s.
const LONGEST_VOLUME: f64 = 5.0;
/// Longest time from the first to the last frame of a recording, s: ten days.
const MAX_SPAN: f64 = 864_000.0;

impl Live for PlaybackSource {
    fn next(&mut self, patience: Duration) -> Event {
        if !std::mem::replace(&mut self.is_begun, true) {
            self.pose = self.source.pose();
            return Event::Begin(Box::new(self.source.header()));
        }
        if self.waiting.is_none() {
            match self.read() {
                Ok(Some(next)) => self.waiting = Some(next),
                Ok(None) => return Event::End(None),
                Err(fault) => return Event::End(Some(fault.to_string())),
            }
        }
        let Some((due, frame)) = self.waiting.take() else { return Event::Idle };
        let now = Instant::now();
        if due > now + patience {
            std::thread::sleep(patience);
            self.waiting = Some((due, frame));
            return Event::Idle;
        }
        std::thread::sleep(due.saturating_duration_since(now));
        Event::Frame(frame)
    }

    fn can_wait(&self) -> bool {
        self.playback == Playback::Fast
    }

    fn is_recording(&self) -> bool {
        self.can_wait()
    }
}
