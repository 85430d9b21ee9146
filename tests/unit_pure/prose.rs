//! The prose of the pages: short sentences that stand alone, and nobody who speaks of themselves.

use crate::common::files::repository;

/// Most words of a sentence. What stands in `...` is one word.
const MOST_WORDS: usize = 40;
/// Words of the first person. "Us" is left out: it is a microsecond, too.
const FIRST_PERSON: [&str; 5] = ["I", "we", "We", "our", "Our"];
/// Words that a reader of another day cannot place.
const PHRASES: [&str; 5] = ["later that day", "of the night", "of before", "yardstick", "a moment ago"];
/// Pages that a tool writes.
const GENERATED: [&str; 6] = [
    "docs/cli.md",
    "docs/settings.md",
    "docs/thesis-tables.md",
    "docs/thesis-tables-gpu.md",
    "docs/filters.md",
    "docs/error-reports.md",
];

/// The paragraphs and the items of lists of a page, each with its first line, without code, tables, headings, pictures and comments.
fn paragraphs(page: &str) -> Vec<(usize, String)> {
    let mut found: Vec<(usize, String)> = Vec::new();
    let (mut is_code, mut is_open) = (false, false);
    for (i, line) in page.lines().enumerate() {
        let start = line.trim_start();
        let is_fence = start.starts_with("```");
        let is_other = start.is_empty() || ["|", "#", "<!--", "!["].iter().any(|mark| start.starts_with(mark));
        let is_prose = !is_code && !is_fence && !is_other;
        is_code ^= is_fence;
        let number = start.split_once(". ").map_or("", |(number, _)| number);
        let is_item = start.starts_with("- ") || number.parse::<u32>().is_ok();
        match found.last_mut().filter(|_| is_open && !is_item) {
            _ if !is_prose => {}
            Some((_, text)) => *text += &format!("\n{line}"),
            None => found.push((i + 1, line.to_string())),
        }
        is_open = is_prose;
    }
    found
}

/// What is wrong with a sentence: its words, each with its line.
fn faults_of(sentence: &[(usize, &str)]) -> Vec<String> {
    let Some((first, _)) = sentence.first() else { return Vec::new() };
    let text = sentence.iter().map(|(_, word)| *word).collect::<Vec<_>>().join(" ");
    let words = sentence.iter().filter(|(_, word)| word.contains(char::is_alphanumeric)).count();
    let long = (words > MOST_WORDS).then(|| format!("{first}: {words} words: {text}"));
    let bare = |word: &str| word.trim_matches(|c: char| !c.is_alphanumeric()).to_string();
    let plain = sentence.iter().map(|(_, word)| bare(word).to_lowercase()).collect::<Vec<_>>().join(" ");
    let plain = format!(" {plain} ");
    let persons = sentence.iter().filter(|(_, word)| FIRST_PERSON.contains(&bare(word).as_str()));
    let persons = persons.map(|(line, word)| format!("{line}: the first person: {word}"));
    let phrases = PHRASES.iter().filter(|phrase| plain.contains(&format!(" {phrase} ")));
    long.into_iter().chain(persons).chain(phrases.map(|phrase| format!("{first}: {phrase}: {text}"))).collect()
}

/// Every fault of the prose of a page: its line, what it is, and the words.
fn faults(page: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (first, text) in paragraphs(page) {
        let is_span = |i: usize| i % 2 == 1;
        let spans = text.split('`').enumerate().map(|(i, span)| match is_span(i) {
            true => format!("x{}", "\n".repeat(span.matches('\n').count())),
            false => span.to_string(),
        });
        let text: String = spans.collect();
        let mut sentence = Vec::new();
        for (line, word) in
            text.lines().enumerate().flat_map(|(i, l)| l.split_whitespace().map(move |w| (first + i, w)))
        {
            sentence.push((line, word));
            if word.trim_end_matches([')', '"', '\'', '*', '_', ']']).ends_with(['.', '?', '!']) {
                found.extend(faults_of(&std::mem::take(&mut sentence)));
            }
        }
        found.extend(faults_of(&sentence));
    }
    found
}

/// The list of exceptions states the number of faults exactly, so that a page never gets worse, and a better one stays so.
#[test]
fn pages_have_short_sentences_and_no_first_person() {
    let docs = ["docs", "docs/experiments"].into_iter().flat_map(|folder| {
        let names = std::fs::read_dir(repository(folder)).expect(folder).map(|entry| entry.expect("entry").file_name());
        names.map(move |name| format!("{folder}/{}", name.to_string_lossy())).filter(|name| name.ends_with(".md"))
    });
    let pages = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(str::to_string).into_iter().chain(docs);
    let mut wrong = Vec::new();
    for name in pages.filter(|name| !GENERATED.contains(&name.as_str())) {
        let found = faults(&std::fs::read_to_string(repository(&name)).expect("a page"));
        wrong.extend(found.iter().map(|fault| format!("{name}:{fault}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
