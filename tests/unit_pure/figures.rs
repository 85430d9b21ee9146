//! Figures of docs/validation.md: each is stated by a test.

use crate::common::figures::{agree, names, place};
use crate::common::files::repository;
use std::fs;
use std::path::Path;

/// The text of every Rust file below a folder.
fn sources(folder: &Path, texts: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, texts);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            texts.push(fs::read_to_string(&path).expect("text"));
        }
    }
}

/// A figure that no test states would stay as it is, whatever the program does. One that is not on the page fails in its own test.
#[test]
fn every_figure_of_the_page_is_stated_by_a_test() {
    let page = fs::read_to_string(repository("docs/validation.md")).expect("the page");
    let mut texts = Vec::new();
    sources(&repository("tests"), &mut texts);
    texts.retain(|text| text.contains("figure("));
    let names = names(&page);
    assert!(names.len() > 80, "{} figures", names.len());
    for name in names {
        assert!(place(&page, name).is_some(), "docs/validation.md has the figure {name} twice");
        let stated = format!("\"{name}\"");
        assert!(texts.iter().any(|text| text.contains(&stated)), "no test states the figure {name}");
    }
}

#[test]
fn a_figure_is_found_and_compared_to_its_last_digit() {
    let page =
        "a <!--one-->0.074 mm, <!--two-->7.7e-6.\n<!--three-->-1.05; <!--twice-->1 <!--twice-->1 <!-- nightly -->\n1";
    let at = |name: &str| place(page, name).map(|place| &page[place]);
    assert_eq!([at("one"), at("two"), at("three")], [Some("0.074"), Some("7.7e-6"), Some("-1.05")]);
    assert_eq!([at("twice"), at("four")], [None, None]);
    assert_eq!(names(page), ["one", "two", "three", "twice", "twice"]);
    assert!(agree("0.074", "0.075") && agree("7.7e-6", "7.8e-6") && agree("-1.05", "-1.05") && agree("99", "100"));
    assert!(!agree("0.074", "0.076") && !agree("7.7e-6", "7.9e-6") && !agree("7.7e-6", "7.7e-7") && !agree("1", "-1"));
}
