//! The names of devices and tools that came, for messages that say which of them can be selected.

use crate::files::quoted;
use std::collections::BTreeSet;

/// Most names that are kept, besides the selected one.
const MAX_NAMES: usize = 16;

/// Names of devices or tools from which messages arrived. Only some are kept, but always the one that the user selected.
pub(super) struct Names {
    selected: Option<String>,
    seen: BTreeSet<String>,
}

impl Names {
    pub fn new(selected: Option<String>) -> Names {
        Names { selected, seen: BTreeSet::new() }
    }

    /// Adds a name. Returns true if it is new and was kept.
    pub fn add(&mut self, name: &str) -> bool {
        let is_kept = self.seen.len() < MAX_NAMES || self.selected.as_deref() == Some(name);
        is_kept && !self.seen.contains(name) && self.seen.insert(name.to_string())
    }

    pub fn count(&self) -> usize {
        self.seen.len()
    }

    pub fn contains(&self, name: &str) -> bool {
        self.seen.contains(name)
    }

    /// The kept names in quotation marks, separated by commas.
    pub fn list(&self) -> String {
        self.seen.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_selected_name_is_kept_beyond_all_others() {
        let mut names = Names::new(Some("Stylus".into()));
        let kept = (0..100).filter(|n| names.add(&format!("Tool{n:02}"))).count();
        assert_eq!((kept, names.count(), names.contains("Stylus")), (MAX_NAMES, MAX_NAMES, false));
        assert!(names.add("Stylus") && !names.add("Stylus") && names.contains("Stylus"));
        assert!(names.list().starts_with("'Stylus', 'Tool00', ") && names.list().ends_with("'Tool15'"));
    }
}
