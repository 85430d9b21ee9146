//! What arrives by itself: the one trait behind every live source, and files played as if they were live.

use super::frame::{Frame, Header, Source};
use std::time::{Duration, Instant};

/// What a live source says next.
#[derive(Clone, Debug)]
pub enum Event {
    /// What the frames that follow have in common: before the first, and again whenever it changes. Volumes of before are over.
    Begin(Box<Header>),
    /// A whole frame.
    Frame(Frame),
    /// Lines of a frame, from line `first` on, in `frame.bytes`; those of a frame follow one another, and the last completes it.
    Lines { frame: Frame, first: usize },
    /// Something was left out, and why; the source goes on.
    Fault(String),
    /// Nothing has come.
    Idle,
    /// Nothing will come any more, and why if that was not to be expected.
    End(Option<String>),
}

/// Where frames come from on their own clock. Volumes are numbered upwards; a frame belongs to the volume whose number it has.
///
/// Every source is total: whatever comes in is a frame or a fault, and no more memory is taken than the source states.
pub trait Live: Send {
    /// What comes next, waiting for it at most about so long.
    fn next(&mut self, patience: Duration) -> Event;

    /// Whether it can be kept waiting without losing anything, as a file or a pipe can. What cannot loses whole volumes instead.
    fn can_wait(&self) -> bool;
}

/// When the frames of a file arrive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Playback {
    /// As soon as they are asked for.
    Fast,
    /// So many volumes a second, their frames evenly spread.
    Volumes(f64),
    /// As they were stamped: by the time of arrival where that was recorded, else by the time of the frame. Those without a stamp
    /// follow at once.
    Recorded,
}

/// A recording or the phantom as a live source. Between two frames it holds none.
pub struct PlaybackSource {
    source: Box<dyn Source>,
    pace: Playback,
    /// Times that the whole is played.
    rounds: u32,
    round: u32,
    /// What the numbers of this round's volumes begin with, and the highest that was given.
    base: u32,
    highest: u32,
    begun: Option<(Instant, f64)>,
    header: Option<Header>,
    /// A frame that is due later.
    waiting: Option<(Instant, Frame)>,
    frames: u64,
}

impl PlaybackSource {
    /// `rounds`: how often to play it; volumes go on being numbered.
    pub fn new(source: Box<dyn Source>, pace: Playback, rounds: u32) -> PlaybackSource {
        PlaybackSource {
            source,
            pace,
            rounds,
            round: 0,
            base: 0,
            highest: 0,
            begun: None,
            header: None,
            waiting: None,
            frames: 0,
        }
    }

    /// The next frame and when it is due, on from the first.
    fn read(&mut self) -> Result<Option<(Instant, Frame)>, String> {
        let mut frame = match self.source.next_frame().map_err(|e| e.to_string())? {
            Some(frame) => frame,
            None => {
                self.round += 1;
                if self.round >= self.rounds || self.frames == 0 {
                    return Ok(None);
                }
                // Stamps begin again.
                self.begun = None;
                self.base = self.highest.wrapping_add(1);
                self.source.skip_to_volume(0).map_err(|e| e.to_string())?;
                match self.source.next_frame().map_err(|e| e.to_string())? {
                    Some(frame) => frame,
                    None => return Ok(None),
                }
            }
        };
        frame.volume = frame.volume.wrapping_add(self.base);
        self.highest = frame.volume;
        let stamp = match self.pace {
            Playback::Fast => 0.0,
            Playback::Volumes(rate) => self.frames as f64 / (rate * self.source.frames_per_volume().max(1) as f64),
            Playback::Recorded => self.source.arrival().or(frame.time).unwrap_or(0.0),
        };
        self.frames += 1;
        let (began, first) = *self.begun.get_or_insert_with(|| (Instant::now(), stamp));
        // A stamp that is no time, or lies before the first, is due at once; so is one that lies in another age.
        let after = Duration::try_from_secs_f64((stamp - first).clamp(0.0, MAX_SPAN)).unwrap_or_default();
        Ok(Some((began + after, frame)))
    }
}

/// Between the first and the last frame of a recording, s: ten days.
const MAX_SPAN: f64 = 864_000.0;

impl Live for PlaybackSource {
    fn next(&mut self, patience: Duration) -> Event {
        if self.header.is_none() {
            let header = self.source.header();
            self.header = Some(header.clone());
            return Event::Begin(Box::new(header));
        }
        if self.waiting.is_none() {
            match self.read() {
                Ok(Some(next)) => self.waiting = Some(next),
                Ok(None) => return Event::End(None),
                Err(fault) => return Event::End(Some(fault)),
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
        self.pace == Playback::Fast
    }
}
