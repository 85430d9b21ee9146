//! The keys of all settings, from docs/settings.md, which a test of tests/cli/docs holds equal to the declarations in src/core/scene/settings. A key that is
//! declared is here without a list of its own.

use std::collections::BTreeMap;

/// A setting that is one value: its key with the tables around it, and its type as the page states it.
#[derive(Clone, Debug)]
pub struct Key {
    pub path: String,
    pub of: String,
    /// The words of a type that is a choice among words.
    pub words: Vec<String>,
}

/// A table of the page: rows of cells, under the title of its section.
fn sections() -> BTreeMap<String, Vec<Vec<String>>> {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/settings.md")).expect("the page");
    let mut all: BTreeMap<String, Vec<Vec<String>>> = BTreeMap::new();
    let mut title = String::new();
    for line in page.lines() {
        if let Some(next) = line.strip_prefix("## ") {
            title = next.to_string();
        } else if line.starts_with("| `") {
            let cells = line.trim_matches('|').split(" | ").map(|cell| cell.trim().trim_matches('`').to_string());
            all.entry(title.clone()).or_default().push(cells.collect());
        }
    }
    all
}

/// All keys but those of lists, whose values are tables of their own.
pub fn all() -> Vec<Key> {
    let sections = sections();
    let mut found = Vec::new();
    collect("", "Top level", &sections, false, &mut found);
    assert!(found.len() > 150, "the page has changed its form: {} keys", found.len());
    found
}

/// All keys, those of the tables of lists without a place in the list.
pub fn with_lists() -> Vec<Key> {
    let mut found = Vec::new();
    collect("", "Top level", &sections(), true, &mut found);
    found
}

fn collect(
    prefix: &str,
    title: &str,
    sections: &BTreeMap<String, Vec<Vec<String>>>,
    has_lists: bool,
    found: &mut Vec<Key>,
) {
    for row in &sections[title] {
        let [name, of, ..] = &row[..] else { panic!("{title}: {row:?}") };
        let path = format!("{prefix}{name}");
        // "[Type](#type)", "[Type](#type) or none".
        let element = of.strip_prefix("list of ").filter(|_| has_lists).unwrap_or(of);
        let linked = element.strip_prefix('[').and_then(|rest| rest.split(']').next());
        match linked {
            Some(inner) if sections.get(inner).is_some_and(|rows| rows.iter().all(|row| row.len() >= 4)) => {
                if of.ends_with("or none") {
                    found.push(Key { path: path.clone(), of: "table or none".into(), words: Vec::new() });
                }
                collect(&format!("{path}."), inner, sections, has_lists, found);
            }
            Some(inner) => {
                let rows = sections.get(inner).map_or(&[][..], |rows| rows);
                let words = rows.iter().filter(|row| row.len() == 2).map(|row| row[0].clone()).collect();
                found.push(Key { path, of: of.clone(), words });
            }
            None => found.push(Key { path, of: of.clone(), words: Vec::new() }),
        }
    }
}

impl Key {
    /// Values of the key as `--set` takes them, other than `current` where that is one of its words or a number. A value may be refused.
    pub fn values(&self, current: Option<&toml::Value>) -> Vec<String> {
        let of = self.of.trim_end_matches(" or none");
        let number = current.and_then(|v| v.as_float().or(v.as_integer().map(|i| i as f64)));
        match of {
            "true or false" => vec![(!current.and_then(|v| v.as_bool()).unwrap_or(false)).to_string()],
            "whole number" => {
                let now = number.unwrap_or(4.0);
                [now + 1.0, now + 2.0, (now / 2.0).floor(), 2.0 * now, 3.0, 16.0, 64.0]
                    .into_iter()
                    .filter(|v| Some(*v) != number && *v >= 0.0)
                    .map(|v| format!("{v:.0}"))
                    .collect()
            }
            "number" => {
                let now = number.unwrap_or(1.0);
                [1.25 * now, 0.8 * now, now + 0.5, 0.3, 2.0, 10.0]
                    .into_iter()
                    .filter(|v| Some(*v) != number)
                    .map(|v| format!("{v:?}"))
                    .collect()
            }
            "2 x number" => vec!["[0.15,0.85]".into(), "[10.0,40.0]".into(), "[0.0,1.0]".into()],
            "2 x whole number" => vec!["[128,96]".into()],
            "3 x number" => vec!["[0.2,0.5,0.7]".into()],
            "table" => vec!["{}".into()],
            "text" => vec!["'a text'".into()],
            _ => self.words.iter().filter(|w| current.and_then(|v| v.as_str()) != Some(w)).cloned().collect(),
        }
    }
}
