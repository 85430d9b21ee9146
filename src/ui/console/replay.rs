//! Playback of the cine loop, and freezing again the volume that was frozen when a recording was left.

use super::reel::Reel;
use crate::cine_player::CinePlayer;

/// The playback of the cine loop, and the volume that is to be frozen again when a recording is shown again.
#[derive(Default)]
pub(super) struct Replay {
    pub(super) player: CinePlayer,
    /// The number of the volume that was frozen when the recording was left, until it is loaded again, or the user shows another one or freezes.
    pub(super) frozen: Option<u32>,
    /// The thumbnails of the loop's volumes.
    pub(super) reel: Reel,
}

impl Replay {
    /// `frozen`: number of the volume that was frozen when the recording was last left; None if none was.
    pub(super) fn new(frozen: Option<u32>) -> Replay {
        Replay { frozen, ..Replay::default() }
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
        assert_eq!(replay.frozen, Some(5));
        assert_eq!(replay.refreeze(4..10, 6, false), Some(1), "the loop would drop it");
        assert_eq!(replay.frozen, None);
        assert_eq!(Replay::new(Some(5)).refreeze(0..8, 10, true), Some(5), "the end of the recording");
        let mut gone = Replay::new(Some(5));
        assert_eq!((gone.refreeze(6..8, 10, true), gone.frozen), (None, None), "it never came");
        let mut other = Replay::new(Some(5));
        other.frozen = None;
        assert_eq!(other.refreeze(0..8, 10, true), None, "the user froze another one since");
    }
}
