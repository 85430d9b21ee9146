//! Leaving the program: whether that loses volumes that exist nowhere else, the question about them, and leaving once they are saved. Volumes are
//! named by their numbers.

use crate::source::live::SourceKind;

/// What was saved of the cine loop, and what is asked before the program ends.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Leaving {
    /// The volumes of the source can be had once only.
    comes_once: bool,
    /// Everything that arrives is recorded to a file.
    is_recorded: bool,
    /// The question is shown.
    asks: bool,
    /// The program ends when the loop up to this volume is saved.
    awaited: Option<u32>,
    /// The newest volume of the loops that were saved whole.
    saved: Option<u32>,
}

impl Leaving {
    /// `is_recorded`: everything that arrives is recorded to a file.
    pub(super) fn new(source: SourceKind, is_recorded: bool) -> Leaving {
        let comes_once = matches!(source, SourceKind::Probe | SourceKind::Pipe);
        Leaving { comes_once, is_recorded, ..Leaving::default() }
    }

    /// True if volumes of the loop exist nowhere else: neither in a file that they were read from or recorded to, nor in one that was saved.
    /// `newest`: of the loop; `unrecorded`: number of volumes or frames that the recording lacks.
    pub(super) fn loses(&self, newest: Option<u32>, unrecorded: u64) -> bool {
        let is_only_here = self.comes_once && !(self.is_recorded && unrecorded == 0);
        is_only_here && newest.is_some() && newest != self.saved
    }

    pub(super) fn asks(&self) -> bool {
        self.asks
    }

    pub(super) fn ask(&mut self) {
        self.asks = true;
    }

    /// Asks no longer. False if nothing was asked.
    pub(super) fn dismiss(&mut self) -> bool {
        std::mem::take(&mut self.asks)
    }

    /// The program ends as soon as the loop is saved up to this volume; never, if there is none.
    pub(super) fn after(&mut self, newest: Option<u32>) {
        self.awaited = newest;
    }

    /// A file was saved; of a complete loop with its newest volume. True if the program ends now.
    pub(super) fn saved(&mut self, complete_to: Option<u32>) -> bool {
        self.saved = self.saved.max(complete_to);
        self.awaits(complete_to)
    }

    /// A file was not saved: the program goes on if it is the one that it waits for.
    pub(super) fn not_saved(&mut self, complete_to: Option<u32>) {
        if self.awaits(complete_to) {
            self.awaited = None;
        }
    }

    fn awaits(&self, complete_to: Option<u32>) -> bool {
        complete_to.is_some() && complete_to == self.awaited
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Requirement: what a probe sent is not lost without a question, and nobody is asked about what is in a file.
    #[test]
    fn only_volumes_that_exist_nowhere_else_are_asked_about() {
        for (source, comes_once) in [
            (SourceKind::Probe, true),
            (SourceKind::Pipe, true),
            (SourceKind::Recording, false),
            (SourceKind::Demo, false),
        ] {
            let mut leaving = Leaving::new(source, false);
            assert!(!leaving.loses(None, 0), "{source:?}: an empty loop");
            assert_eq!(leaving.loses(Some(3), 0), comes_once, "{source:?}");
            assert!(!leaving.saved(Some(3)) && !leaving.loses(Some(3), 0), "{source:?}: saved");
            assert!(!leaving.saved(None), "{source:?}: a picture");
            assert_eq!(leaving.loses(Some(4), 0), comes_once, "{source:?}: one came since");
            let recorded = Leaving::new(source, true);
            assert!(!recorded.loses(Some(3), 0), "{source:?}");
            assert_eq!(recorded.loses(Some(3), 1), comes_once, "{source:?}: the disk was full");
        }
    }

    #[test]
    fn the_program_ends_with_the_loop_that_it_waits_for_and_not_with_a_fault() {
        let mut leaving = Leaving::new(SourceKind::Probe, false);
        leaving.ask();
        assert!(leaving.asks() && leaving.dismiss() && !leaving.dismiss());
        leaving.after(Some(7));
        assert!(!leaving.saved(None) && !leaving.saved(Some(5)) && leaving.saved(Some(7)));
        leaving.after(Some(9));
        leaving.not_saved(None);
        leaving.not_saved(Some(9));
        assert!(!leaving.saved(Some(9)), "the user saves it later, and stays");
    }
}
