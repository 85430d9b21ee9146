//! The list of the settings that are lengths (`tests/common/lengths.rs`) is complete: every setting whose documentation names mm is in it.

use crate::common::files::repository;
use crate::common::lengths::LENGTHS;
use std::collections::{BTreeMap, BTreeSet};

/// Settings whose documentation names mm and that are not scaled: drawn over a picture, a ratio of lengths, or of a size in mm by nature.
const OTHERS: &[(&str, &str)] = &[
    ("measure", "drawn over the picture"),
    ("unveil", "the fluid that it looks for has a size in mm"),
    ("light.shadow.softness", "mm of edge per mm of distance"),
    ("slices.sigma.sigma", "in mm on distances only"),
    ("slices.enhanced_sigma.sigma", "in mm on distances only"),
    ("slices.perona_malik.edge", "in mm on distances only"),
    ("post.sigma", "pixels of a finished picture"),
    ("post.enhanced_sigma", "pixels of a finished picture"),
    ("post.perona_malik", "pixels of a finished picture"),
];

/// A row of a table of docs/settings.md.
struct Key {
    name: String,
    kind: String,
    about: String,
}

/// The tables by their headings, and what stands in front of each.
fn tables() -> BTreeMap<String, (String, Vec<Key>)> {
    let page = std::fs::read_to_string(repository("docs/settings.md")).expect("docs/settings.md");
    let mut tables: BTreeMap<String, (String, Vec<Key>)> = BTreeMap::new();
    for section in page.split("\n## ").skip(1) {
        let (heading, text) = section.split_once('\n').expect("a heading and a text");
        let rows = text.lines().filter_map(|line| {
            let cells: Vec<&str> = line.split(" | ").map(|cell| cell.trim_matches(['|', ' '])).collect();
            let is_key = cells.len() == 4 && cells[0].starts_with('`');
            let [name, kind, about] = [0, 1, 3].map(|n| cells.get(n).copied().unwrap_or_default().to_string());
            is_key.then(|| Key { name: name.trim_matches('`').to_string(), kind, about })
        });
        let intro: Vec<&str> = text.lines().take_while(|line| !line.starts_with('|')).collect();
        tables.insert(heading.to_string(), (intro.join(" "), rows.collect()));
    }
    tables
}

fn names_mm(text: &str) -> bool {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').any(|word| word == "mm" || word.ends_with("_mm"))
}

/// The paths of all settings, and of those whose documentation names mm.
fn paths() -> (BTreeSet<String>, BTreeSet<String>) {
    let tables = tables();
    let (mut all, mut in_mm) = (BTreeSet::new(), BTreeSet::new());
    let mut open = vec![(String::new(), "Top level".to_string(), false)];
    while let Some((before, heading, is_mm)) = open.pop() {
        let (_, keys) = &tables[&heading];
        for key in keys {
            let path = format!("{before}{}", key.name);
            let below = key.kind.split_once('[').and_then(|(_, rest)| rest.split_once(']')).map(|(name, _)| name);
            let is_table = below.filter(|name| tables.get(*name).is_some_and(|(_, keys)| !keys.is_empty()));
            all.insert(path.clone());
            match is_table {
                // "Distance that each face is moved inwards, mm" is said of all of its keys.
                Some(name) => {
                    let is_mm = names_mm(&tables[name].0)
                        && !names_mm(&tables[name].1.iter().map(|k| k.about.as_str()).collect::<Vec<_>>().join(" "));
                    open.push((format!("{path}."), name.to_string(), is_mm));
                }
                None if is_mm || names_mm(&key.about) || names_mm(&key.name) => drop(in_mm.insert(path)),
                None => {}
            }
        }
    }
    (all, in_mm)
}

/// Prevents a new setting in mm that the test of scaled volumes does not scale, so that nothing shows whether a picture depends on its unit.
#[test]
fn every_setting_in_mm_is_in_the_list_of_lengths() {
    let (all, in_mm) = paths();
    assert!(
        all.len() > 200 && in_mm.len() > 60,
        "{} settings, {} in mm: the page is read wrongly",
        all.len(),
        in_mm.len()
    );
    let listed: BTreeSet<&str> = LENGTHS.iter().map(|length| length.path).collect();
    assert_eq!(listed.len(), LENGTHS.len(), "a length is listed twice");
    let is_other = |path: &str| {
        OTHERS
            .iter()
            .any(|(other, _)| path.strip_prefix(other).is_some_and(|rest| rest.is_empty() || rest.starts_with('.')))
    };
    let missing: Vec<&String> =
        in_mm.iter().filter(|path| !listed.contains(path.as_str()) && !is_other(path)).collect();
    assert!(missing.is_empty(), "not in LENGTHS of tests/common/lengths.rs: {missing:?}");
    let unknown: Vec<&&str> = listed.iter().filter(|path| !all.contains(**path)).collect();
    assert!(unknown.is_empty(), "no settings: {unknown:?}");
    let unused: Vec<&str> =
        OTHERS.iter().map(|(path, _)| *path).filter(|path| !all.iter().any(|one| one.starts_with(path))).collect();
    assert!(unused.is_empty(), "no settings: {unused:?}");
}
