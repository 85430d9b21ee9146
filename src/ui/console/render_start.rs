//! When the user is told that rendering cannot start at the fluid because the fluid was lost.

use crate::passes::unveil::Outcome;
use std::time::{Duration, Instant};

/// That fluid is lost is said at most so often: it may come and go with each live volume.
const LOST_INTERVAL: Duration = Duration::from_secs(20);

/// Whether the user was told that rendering cannot start at the fluid, because the fluid was not found any more.
#[derive(Debug, Default)]
pub(super) struct RenderStart {
    /// Whether the fluid is lost and this was reported.
    is_told: bool,
    told_at: Option<Instant>,
}

impl RenderStart {
    /// Makes the next loss of the fluid count as a new one, because the source changed or the search was switched off.
    pub(super) fn forget(&mut self) {
        (self.is_told, self.told_at) = (false, None);
    }

    /// Evaluates the outcome of a picture's search for fluid; `None`: it did not search. Returns the outcome if the fluid was not found and the
    /// user has to be told now: once for each loss, and not more often than every [`LOST_INTERVAL`].
    pub(super) fn take(&mut self, outcome: Option<Outcome>, now: Instant) -> Option<Outcome> {
        if outcome.is_none() {
            self.forget();
        }
        let lost = outcome.filter(|outcome| !outcome.is_found());
        self.is_told &= lost.is_some();
        let is_rare = self.told_at.is_none_or(|at| now.saturating_duration_since(at) >= LOST_INTERVAL);
        let said = lost.filter(|_| !self.is_told && is_rare);
        if said.is_some() {
            (self.is_told, self.told_at) = (true, Some(now));
        }
        said
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::unveil::Evidence;

    /// Prevents a message at every other live volume, and that a loss during the pause is never said.
    #[test]
    fn lost_fluid_is_said_once_and_not_too_often() {
        let begin = Instant::now();
        let mut start = RenderStart::default();
        let found = Outcome::Found(Evidence { tissue: 9, pocket: 1, share: 90 });
        let mut take = |seconds: u64, outcome| start.take(outcome, begin + Duration::from_secs(seconds));
        let mut said = |seconds: u64, is_lost: bool| {
            take(seconds, Some(if is_lost { Outcome::NoPocket } else { found })) == Some(Outcome::NoPocket)
        };
        assert!(!said(0, false) && said(1, true) && !said(2, true) && !said(60, true), "once");
        assert!(!said(61, false) && said(62, true), "each time");
        assert!((63..81).all(|second| !said(second, second % 2 == 0)), "not at every change");
        assert!(!said(81, true) && said(82, true) && !said(83, true), "later, if it is still lost then");
        assert_eq!(take(84, None), None, "switched off");
        assert_eq!(take(85, Some(Outcome::NoPocket)), Some(Outcome::NoPocket), "and on again: another search");
    }
}
