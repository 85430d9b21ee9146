//! Every command and control by name, for the search of the window.

use crate::command::Command;
use crate::controls::EXAMS;
use crate::sliders::{GROUPS, SLIDERS};
use crate::texts::keys::{KEY_BINDINGS, WITHOUT_KEY, key_label};
use crate::texts::{self, hints};
use crate::volume_export::FORMATS;

/// An entry in the search of all commands and controls.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    pub name: String,
    /// What the command does, or where the control is; empty if the name says all.
    pub about: String,
    /// Name of the key that has the same effect; empty if there is none.
    pub key: String,
    pub command: Command,
}

/// All entries of the search: commands, presets, export formats, controls.
pub(crate) fn entries() -> impl Iterator<Item = Entry> {
    // A key beside another for the same is not told.
    let is_first = |n: &usize| !KEY_BINDINGS[..*n].iter().any(|other| other.command == KEY_BINDINGS[*n].command);
    let by_key = (0..KEY_BINDINGS.len()).filter(is_first).map(|n| {
        let binding = &KEY_BINDINGS[n];
        let (name, key) = (capitalised(binding.description), key_label(binding));
        Entry { name, about: about(binding.command).into(), key, command: binding.command }
    });
    let entry = |name: &str, about: &str, command| Entry {
        name: name.into(),
        about: about.into(),
        key: String::new(),
        command,
    };
    let others = WITHOUT_KEY.into_iter().map(move |([name, about], command)| entry(name, about, command));
    let looks = EXAMS.iter().enumerate();
    let looks = looks.map(move |(n, exam)| entry(&texts::look(exam.title), exam.hint, Command::Preset(n)));
    let formats = FORMATS.iter().enumerate();
    let formats =
        formats.map(move |(n, format)| entry(&texts::export_as(format.name), format.hint, Command::Export(n)));
    let controls = SLIDERS.iter().enumerate().map(move |(n, slider)| {
        let group = GROUPS.iter().find(|(group, _)| *group == slider.group).map_or("", |(_, name)| name);
        entry(slider.name, &texts::control_in(group, slider.hint), Command::ShowControl(n))
    });
    by_key.chain(others).chain(looks).chain(formats).chain(controls)
}

/// What a command does, as its button says it; nothing for those whose name says all.
fn about(command: Command) -> &'static str {
    match command {
        Command::Mode(mode) => hints::of_mode(mode),
        Command::Layout(layout) => hints::of_layout(layout),
        Command::Tool(tool) => hints::of_tool(tool),
        Command::LookFrom(viewpoint) => hints::of_viewpoint(viewpoint),
        _ => "",
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// The entries that contain all words of a text, in this order: those whose name begins with the text, those that have all words in their name,
/// the others.
pub(crate) fn found(text: &str) -> Vec<Entry> {
    let text = text.trim().to_lowercase();
    let words: Vec<&str> = text.split_whitespace().collect();
    let has = |in_text: &str| words.iter().all(|word| in_text.contains(word));
    let rank = |entry: &Entry| {
        let name = entry.name.to_lowercase();
        let all = format!("{name} {} {}", entry.about, entry.key).to_lowercase();
        match () {
            () if name.starts_with(&text) => Some(0),
            () if has(&name) => Some(1),
            () => has(&all).then_some(2),
        }
    };
    let mut found: Vec<_> = entries().filter_map(|entry| Some((rank(&entry)?, entry))).collect();
    found.sort_by_key(|(rank, _)| *rank);
    found.into_iter().map(|(_, entry)| entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Tool;
    use crate::scene::MeasureKind;

    /// Prevents a command or a control that no search finds by its own name.
    #[test]
    fn every_command_and_control_is_found_by_its_name() {
        for entry in entries() {
            let found = found(&entry.name);
            assert!(found.contains(&entry), "{entry:?}");
            let says = entry.about.len() + entry.key.len();
            assert!(!entry.name.is_empty() && says > 0, "{entry:?}");
        }
        for binding in KEY_BINDINGS {
            assert!(entries().any(|entry| entry.command == binding.command), "{binding:?}");
        }
        for n in 0..SLIDERS.len() {
            assert!(entries().any(|entry| entry.command == Command::ShowControl(n)), "{}", SLIDERS[n].key);
        }
    }

    #[test]
    fn the_nearest_name_comes_first_and_all_words_count() {
        let first = |text: &str| found(text).first().map(|entry| entry.command);
        assert_eq!(first("measure: cal"), Some(Command::Tool(Tool::Measure(MeasureKind::Distance))));
        assert!(found("measure").iter().any(|entry| entry.command == Command::Tool(Tool::Measure(MeasureKind::Angle))));
        assert_eq!(first("look: face"), Some(Command::Preset(0)));
        assert_eq!(first("picture save"), Some(Command::SavePicture));
        assert_eq!(first("ctrl+i"), Some(Command::SavePicture));
        assert!(found("speckle").iter().any(|entry| entry.name == "Smoothing"), "a control is found by what it does");
        assert!(found("no such thing").is_empty());
    }
}
