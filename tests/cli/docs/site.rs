//! The pages as a site (`tools/docs --site`): which pages it has, and that it notices a broken link.

use super::pages;
use crate::common::files::repository;
use crate::common::program::*;
use std::collections::BTreeSet;
use std::process::Command;

fn site(arguments: &[&str]) -> Ran {
    finish(Command::new("python3").arg(repository("tools/docs.d/site.py")).args(arguments))
}

#[test]
fn every_page_is_a_chapter_of_the_site_and_the_gallery_is_the_first() {
    let (code, out, err) = site(&["summary"]);
    assert_eq!(code, Some(0), "{err}");
    let chapters: Vec<&str> = out.lines().filter_map(|line| line.split_once("](")?.1.strip_suffix(')')).collect();
    assert_eq!(chapters.first(), Some(&"docs/gallery.md"), "{out}");
    assert_eq!(chapters.iter().collect::<BTreeSet<_>>().len(), chapters.len(), "a page is there twice: {out}");
    for page in pages() {
        assert!(chapters.contains(&page.as_str()), "the site has no {page}: {out}");
    }
    // Below its own page, as mdBook folds chapters.
    assert!(out.contains("- [Experiments](docs/experiments/README.md)\n    - ["), "{out}");
}

#[test]
fn a_broken_link_of_the_site_is_noticed() {
    let folder = Folder::new("site");
    std::fs::create_dir(folder.join("docs")).expect("a folder");
    folder.write(
        "docs/a.html",
        "<h1 id=\"top\">A</h1><a href=\"../b.html\">B</a> <a href=\"#top\">A</a> <img src=\"p.png\">",
    );
    folder.write("docs/p.png", "a picture");
    folder.write("b.html", "<a href=\"docs/a.html#top\">A</a> <a href=\"https://example.org/none\">elsewhere</a>");
    let (code, _, err) = site(&["check", &folder.path("")]);
    assert_eq!(code, Some(0), "{err}");
    for (link, named) in
        [("docs/a.html#bottom", "b.html: docs/a.html#bottom"), ("docs/none.png", "b.html: docs/none.png")]
    {
        folder.write("b.html", format!("<a href=\"{link}\">A</a>"));
        let (code, _, err) = site(&["check", &folder.path("")]);
        assert!(code == Some(1) && err.contains(named), "{code:?}: {err}");
    }
}
