//! What became of the frames that a motor was to place.

/// Of frames unless said otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrackingCounts {
    /// Were given a slice.
    pub placed: u64,
    /// Left out: before the sweep had begun.
    pub early: u64,
    /// Left out: near a turning point, where the direction is not known.
    pub turning: u64,
    /// Left out: more than half a pitch beyond the first or last slice.
    pub beyond: u64,
    /// Left out: another frame of the pass was nearer to the slice.
    pub farther: u64,
    /// Left out: without a time, or the motor's position was not known at theirs, or not soon enough.
    pub unknown: u64,
    /// Left out: of a pass or a slice before the newest.
    pub late: u64,
    /// Slices that no frame came nearest to, and that a neighbour's frame stands in for.
    pub filled: u64,
    /// Passes that became whole volumes.
    pub whole: u64,
    /// Passes that more was missing of.
    pub incomplete: u64,
}

impl TrackingCounts {
    /// What was counted since an earlier time.
    pub fn since(&self, before: &TrackingCounts) -> TrackingCounts {
        TrackingCounts {
            placed: self.placed - before.placed,
            early: self.early - before.early,
            turning: self.turning - before.turning,
            beyond: self.beyond - before.beyond,
            farther: self.farther - before.farther,
            unknown: self.unknown - before.unknown,
            late: self.late - before.late,
            filled: self.filled - before.filled,
            whole: self.whole - before.whole,
            incomplete: self.incomplete - before.incomplete,
        }
    }

    /// What is worth telling, on one line. Frames that were left out because there were more than needed are not.
    pub fn fault(&self) -> Option<String> {
        let parts = [
            (self.filled, "slices had no frame of their own and were given a neighbour's"),
            (self.incomplete, "passes missed more than two slices in a row and stayed incomplete"),
            (self.unknown, "frames were left out, the motor's position at their time not being known"),
            (self.late, "frames were left out, coming after those of a later pass or slice"),
        ];
        let parts: Vec<String> =
            parts.iter().filter(|(count, _)| *count > 0).map(|(n, what)| format!("{n} {what}")).collect();
        (!parts.is_empty()).then(|| format!("motor: {}", parts.join("; ")))
    }
}

impl std::fmt::Display for TrackingCounts {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let TrackingCounts { placed, early, turning, beyond, farther, unknown, late, filled, whole, incomplete } = self;
        write!(
            f,
            "{placed} frames in {whole} whole and {incomplete} incomplete passes, {filled} slices filled; left out: "
        )?;
        write!(
            f,
            "{early} before the sweep, {turning} at a turn, {beyond} beyond the slices, {farther} farther from "
        )?;
        write!(f, "their slice than others, {unknown} without a position, {late} too late")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_of_plenty_is_no_fault() {
        let plenty = TrackingCounts {
            placed: 9,
            early: 3,
            turning: 2,
            beyond: 1,
            farther: 7,
            whole: 1,
            ..TrackingCounts::default()
        };
        assert_eq!(plenty.fault(), None);
        let one = TrackingCounts { filled: 2, ..plenty };
        assert!(one.since(&plenty).fault().is_some_and(|f| f.starts_with("motor: 2 slices") && !f.contains(';')));
        assert!(one.to_string().contains("2 slices filled") && one.to_string().lines().count() == 1);
    }
}
