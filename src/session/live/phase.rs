//! The states of a stream: what its next step does ([`Phase`]) and what is on display ([`Display`]). It has no side effects. The transition diagram is in docs/streaming.md.

use super::cine::CineVolume;
use std::time::Instant;

/// What the next step of a stream has to do.
#[derive(Debug, Default)]
pub(super) enum Phase {
    /// Begin a picture if anything changed. Otherwise send frames of the replay, while events wait until all are sent; without a replay take an
    /// event of the source.
    #[default]
    Idle,
    /// A picture is being drawn. Until it is done, each step sends frames of the replay or takes an event.
    Drawing(InFlight),
    /// Take this number of queued events before the next picture begins. Used with rolling volumes and sources that do not wait: a picture after
    /// the first event would show a state that the others already replace.
    Draining(usize),
}

/// A picture that is being drawn.
#[derive(Debug, Default)]
pub(super) struct InFlight {
    /// Number of the volume that the picture shows.
    pub volume: u32,
    /// Times of arrival of the frames that no earlier picture shows.
    pub arrived: Vec<Instant>,
}

/// A volume of the cine loop that is being sent to the device, in any phase.
#[derive(Debug)]
pub(super) struct Replay {
    pub volume: CineVolume,
    /// Number of frames of the volume that were sent so far.
    pub sent: usize,
    /// Index of the volume image that the volume is sent to.
    pub image: u32,
}

impl Phase {
    /// Notes that the picture is done, and returns it, or a default one if none was being drawn. `queued`: number of events to take from the feed
    /// before the next picture.
    pub fn finish(&mut self, queued: usize) -> InFlight {
        let next = if queued == 0 { Phase::Idle } else { Phase::Draining(queued) };
        match std::mem::replace(self, next) {
            Phase::Drawing(picture) => picture,
            Phase::Idle | Phase::Draining(_) => InFlight::default(),
        }
    }

    /// Notes that one of the queued events was taken. `is_empty`: the queue had none left.
    pub(crate) fn drained(&mut self, is_empty: bool) {
        if let Phase::Draining(events) = self {
            *events = if is_empty { 0 } else { events.saturating_sub(1) };
            if *events == 0 {
                *self = Phase::Idle;
            }
        }
    }

    pub fn is_drawing(&self) -> bool {
        matches!(self, Phase::Drawing(_))
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
    use super::*;

    fn name(phase: &Phase) -> &'static str {
        match phase {
            Phase::Idle => "idle",
            Phase::Drawing(_) => "drawing",
            Phase::Draining(_) => "draining",
        }
    }

    #[test]
    fn a_picture_passes_through_drawing_and_draining() {
        let mut phase = Phase::Drawing(InFlight { volume: 3, arrived: Vec::new() });
        assert!(phase.is_drawing());
        assert_eq!(phase.finish(2).volume, 3);
        assert_eq!(name(&phase), "draining");
        phase.drained(false);
        assert_eq!(name(&phase), "draining");
        phase.drained(false);
        assert_eq!(name(&phase), "idle");
        phase = Phase::Drawing(InFlight::default());
        phase.finish(5);
        phase.drained(true);
        assert_eq!(name(&phase), "idle", "nothing was queued any more");
        phase = Phase::Drawing(InFlight::default());
        phase.finish(0);
        assert_eq!(name(&phase), "idle", "nothing was queued");
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
}
