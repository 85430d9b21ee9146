//! The states of a stream: what its next step does ([`Phase`]), which settings wait ([`Pending`]) and what is on display ([`Display`]). It
//! has no side effects. The transition diagram is in docs/streaming.md.

use super::cine::CineVolume;
use std::time::Instant;

/// What the next step of a stream has to do.
#[derive(Debug, Default)]
pub(super) enum Phase {
    /// Begin a picture if anything changed, otherwise take an event of the source.
    #[default]
    Idle,
    /// A picture is being drawn. Until it is done, each step sends frames of the replay or takes an event.
    Drawing { picture: InFlight, replay: Option<Replay> },
    /// Take this number of queued events before the next picture begins. Used with rolling volumes and sources that do not wait: a picture after
    /// the first event would show a state that the others already replace.
    Draining { events: usize, replay: Option<Replay> },
    /// Begin a picture if anything changed, otherwise send frames of a volume of the cine loop to the device. Events wait until all are sent.
    Replaying(Replay),
}

/// A picture that is being drawn.
#[derive(Debug, Default)]
pub(super) struct InFlight {
    /// Number of the volume that the picture shows.
    pub volume: u32,
    /// Times of arrival of the frames that no earlier picture shows.
    pub arrived: Vec<Instant>,
}

/// A volume of the cine loop that is being sent to the device.
#[derive(Debug)]
pub(super) struct Replay {
    pub volume: CineVolume,
    /// Number of frames of the volume that were sent so far.
    pub sent: usize,
    /// Index of the volume image that the volume is sent to.
    pub image: u32,
}

impl Phase {
    /// The phase between pictures.
    fn between_pictures(replay: Option<Replay>) -> Phase {
        replay.map_or(Phase::Idle, Phase::Replaying)
    }

    /// Notes that a picture begins. A replay continues while it is drawn.
    pub fn begin(&mut self, picture: InFlight) {
        let replay = self.take_replay();
        *self = Phase::Drawing { picture, replay };
    }

    /// Notes that the picture is done, and returns it, or a default one if none was being drawn. `queued`: number of events to take from the feed
    /// before the next picture.
    pub fn finish(&mut self, queued: usize) -> InFlight {
        match std::mem::take(self) {
            Phase::Drawing { picture, replay } => {
                *self = match queued {
                    0 => Phase::between_pictures(replay),
                    events => Phase::Draining { events, replay },
                };
                picture
            }
            other => {
                *self = other;
                InFlight::default()
            }
        }
    }

    /// Notes that one of the queued events was taken. `is_empty`: the queue had none left.
    pub(crate) fn drained(&mut self, is_empty: bool) {
        if let Phase::Draining { events, replay } = self {
            *events = if is_empty { 0 } else { events.saturating_sub(1) };
            if *events == 0 {
                *self = Phase::between_pictures(replay.take());
            }
        }
    }

    /// Starts a replay, in place of one that has not finished.
    pub(crate) fn start_replay(&mut self, new: Replay) {
        match self {
            Phase::Idle | Phase::Replaying(_) => *self = Phase::Replaying(new),
            Phase::Drawing { replay, .. } | Phase::Draining { replay, .. } => *replay = Some(new),
        }
    }

    /// Removes the current replay, finished or not, and returns it; None if there is none.
    pub(crate) fn take_replay(&mut self) -> Option<Replay> {
        match self {
            Phase::Idle => None,
            Phase::Drawing { replay, .. } | Phase::Draining { replay, .. } => replay.take(),
            Phase::Replaying(_) => match std::mem::take(self) {
                Phase::Replaying(replay) => Some(replay),
                _ => None,
            },
        }
    }

    pub fn replay(&self) -> Option<&Replay> {
        match self {
            Phase::Idle => None,
            Phase::Drawing { replay, .. } | Phase::Draining { replay, .. } => replay.as_ref(),
            Phase::Replaying(replay) => Some(replay),
        }
    }

    pub(crate) fn replay_mut(&mut self) -> Option<&mut Replay> {
        match self {
            Phase::Idle => None,
            Phase::Drawing { replay, .. } | Phase::Draining { replay, .. } => replay.as_mut(),
            Phase::Replaying(replay) => Some(replay),
        }
    }

    pub fn is_drawing(&self) -> bool {
        matches!(self, Phase::Drawing { .. })
    }
}

/// Changed settings, made into `T`, that pictures do not use yet.
#[derive(Default)]
pub(super) enum Pending<T> {
    #[default]
    None,
    /// Their pipelines are being compiled in the background. Each step between pictures checks this; the end of a compilation wakes the caller.
    Compiling(T),
    /// The next step that may begin a picture applies them or starts to compile their pipelines.
    Ready(T),
}

impl<T> Pending<T> {
    pub fn take(&mut self) -> Option<T> {
        match std::mem::take(self) {
            Pending::None => None,
            Pending::Compiling(next) | Pending::Ready(next) => Some(next),
        }
    }

    /// Makes the next step that may begin a picture check whether the pipelines are compiled.
    pub(crate) fn ask_again(&mut self) {
        *self = match std::mem::take(self) {
            Pending::Compiling(next) => Pending::Ready(next),
            other => other,
        };
    }

    pub fn is_none(&self) -> bool {
        matches!(self, Pending::None)
    }

    pub fn is_ready(&self) -> bool {
        matches!(self, Pending::Ready(_))
    }
}

/// The number of the volume on display, and whether the last picture shows its present state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Display {
    #[default]
    Empty,
    /// The last picture shows the volume of this number unchanged.
    Current(u32),
    /// The volume of this number, or the way in which it is drawn, has changed since the last picture began.
    Stale(u32),
}

impl Display {
    pub fn volume(self) -> Option<u32> {
        match self {
            Display::Empty => None,
            Display::Current(volume) | Display::Stale(volume) => Some(volume),
        }
    }

    /// Notes that the last picture no longer shows the present state.
    pub fn invalidate(&mut self) {
        if let Display::Current(volume) = *self {
            *self = Display::Stale(volume);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cine::{Cine, CineLimits};
    use super::*;
    use crate::source::Frame;
    use proptest::prelude::*;

    fn replay(volume: u32) -> Replay {
        let mut cine = Cine::new(CineLimits { volumes: 1, bytes: 100 }, 1);
        cine.frame(Frame { volume, number: 0, slice: 0, backward: false, time: None, pose: None, bytes: vec![0] });
        Replay { volume: cine.volumes()[0].clone(), sent: 0, image: 1 }
    }

    fn name(phase: &Phase) -> &'static str {
        match phase {
            Phase::Idle => "idle",
            Phase::Drawing { .. } => "drawing",
            Phase::Draining { .. } => "draining",
            Phase::Replaying(_) => "replaying",
        }
    }

    #[test]
    fn a_picture_passes_through_drawing_and_draining() {
        let mut phase = Phase::default();
        phase.begin(InFlight { volume: 3, arrived: Vec::new() });
        assert_eq!(name(&phase), "drawing");
        assert_eq!(phase.finish(2).volume, 3);
        assert_eq!(name(&phase), "draining");
        phase.drained(false);
        assert_eq!(name(&phase), "draining");
        phase.drained(false);
        assert_eq!(name(&phase), "idle");
        phase.begin(InFlight::default());
        phase.finish(5);
        phase.drained(true);
        assert_eq!(name(&phase), "idle", "nothing was queued any more");
    }

    #[test]
    fn settings_that_compile_are_not_ready() {
        let mut pending = Pending::Compiling(1);
        assert!(!pending.is_none() && !pending.is_ready());
        assert_eq!((pending.take(), pending.take()), (Some(1), None));
        assert!(Pending::Ready(2).is_ready() && pending.is_none());
    }

    #[test]
    fn only_what_is_shown_becomes_stale() {
        for (mut display, stale) in [
            (Display::Empty, Display::Empty),
            (Display::Current(2), Display::Stale(2)),
            (Display::Stale(2), Display::Stale(2)),
        ] {
            display.invalidate();
            assert_eq!(display, stale);
        }
    }

    proptest! {
        /// A replay ends only when it is taken or another one takes its place, and `Replaying` never lacks one.
        #[test]
        fn no_transition_loses_a_replay(steps in prop::collection::vec((0u8..5, 0u32..4), 1..60)) {
            let (mut phase, mut expected) = (Phase::default(), None);
            for (step, n) in steps {
                match step {
                    0 => phase.begin(InFlight::default()),
                    1 => drop(phase.finish(n as usize)),
                    2 => phase.drained(n == 0),
                    3 => {
                        phase.start_replay(replay(n));
                        expected = Some(n);
                    }
                    _ => prop_assert_eq!(phase.take_replay().map(|r| r.volume.volume), expected.take()),
                }
                prop_assert_eq!(phase.replay().map(|r| r.volume.volume), expected);
                let is_done = matches!(phase, Phase::Draining { events: 0, .. });
                prop_assert!(!is_done);
                let is_replaying = matches!(phase, Phase::Replaying(_));
                prop_assert!(expected.is_some() || !is_replaying);
            }
        }
    }
}
