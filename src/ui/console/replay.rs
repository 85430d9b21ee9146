//! Playback of the cine loop, and freezing again the volume that was frozen when a recording was left.

use crate::cine_player::{CinePlayer, CineState, Loop};
use std::time::Instant;

/// The playback of the cine loop, and the volume that is to be frozen again when a recording is shown again.
#[derive(Debug, Default)]
pub(super) struct Replay {
    player: CinePlayer,
    /// The number of the volume that was frozen when the recording was left, until it is loaded again.
    frozen: Option<u32>,
}

impl Replay {
    /// `frozen`: number of the volume that was frozen when the recording was last left; None if none was.
    pub(super) fn new(frozen: Option<u32>) -> Replay {
        Replay { frozen, ..Replay::default() }
    }

    /// Freezes no volume again, because the user shows another one or freezes.
    pub(super) fn forget_frozen(&mut self) {
        self.frozen = None;
    }

    pub(super) fn frozen(&self) -> Option<u32> {
        self.frozen
    }

    pub(super) fn stop(&mut self) {
        self.player.stop();
    }

    /// Starts to play the cine loop at `now`, or stops.
    pub(super) fn toggle(&mut self, of: Loop, now: Instant) {
        self.player.toggle(of, now);
    }

    /// Index of the volume to show now; None if none is due. `shown`: index of the one that is shown.
    pub(super) fn advance(&mut self, of: Loop, shown: Option<usize>, now: Instant) -> Option<usize> {
        self.player.advance(of, shown, now)
    }

    /// Time at which the next volume is to be shown; None while the loop is not played.
    pub(super) fn due(&self) -> Option<Instant> {
        self.player.due()
    }

    pub(super) fn state(&self, of: Loop, shown: Option<usize>) -> CineState {
        self.player.state(of, shown)
    }

    /// Index of the volume that is to be frozen again now: once the recording is loaded, or before the loop would drop it. `volumes`: numbers of
    /// the loop's volumes; `most`: how many it holds at most.
    pub(super) fn refreeze(
        &mut self,
        volumes: impl ExactSizeIterator<Item = u32>,
        most: usize,
        is_over: bool,
    ) -> Option<usize> {
        let wanted = self.frozen?;
        let is_full = volumes.len() >= most;
        let at = volumes.enumerate().find(|(_, volume)| *volume == wanted).map(|(at, _)| at);
        let is_due = is_over || (is_full && at.is_some_and(|at| at < 2));
        if is_due {
            self.frozen = None;
        }
        at.filter(|_| is_due)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a recording that comes back without the volume that was frozen, or one that freezes in the middle of being read.
    #[test]
    fn the_frozen_volume_is_frozen_again_at_the_end_or_before_it_is_dropped() {
        let mut replay = Replay::new(Some(5));
        assert_eq!(replay.refreeze(4..8, 10, false), None, "the recording is still read");
        assert_eq!(replay.refreeze(2..8, 6, false), None, "full, but it stays for a while");
        assert_eq!(replay.frozen(), Some(5));
        assert_eq!(replay.refreeze(4..10, 6, false), Some(1), "the loop would drop it");
        assert_eq!(replay.frozen(), None);
        assert_eq!(Replay::new(Some(5)).refreeze(0..8, 10, true), Some(5), "the end of the recording");
        let mut gone = Replay::new(Some(5));
        assert_eq!((gone.refreeze(6..8, 10, true), gone.frozen()), (None, None), "it never came");
        let mut other = Replay::new(Some(5));
        other.forget_frozen();
        assert_eq!(other.refreeze(0..8, 10, true), None, "the user froze another one since");
    }
}
