//! Values, messages and positions are those of serde's own derives.

use super::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use toml::Value;

#[derive(Debug, Default, PartialEq, Deserialize, Serialize, FromNode, ToNode)]
#[serde(deny_unknown_fields, default)]
#[tree(deny_unknown_fields, default)]
struct All {
    number: f64,
    count: u8,
    word: String,
    is_on: bool,
    maybe: Option<f64>,
    pair: [f64; 2],
    inner: Option<Inner>,
    list: Vec<Inner>,
    named: BTreeMap<String, u32>,
    choice: Choice,
    path: std::path::PathBuf,
}

#[derive(Debug, Default, PartialEq, Deserialize, Serialize, FromNode, ToNode)]
#[serde(deny_unknown_fields)]
#[tree(deny_unknown_fields)]
struct Inner {
    at: f64,
    #[serde(default)]
    #[tree(default)]
    of: Choice,
}

#[derive(Debug, Default, PartialEq, Deserialize, Serialize, FromNode, ToNode)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[tree(rename_all = "kebab-case", deny_unknown_fields)]
enum Choice {
    #[default]
    NoneOfAll,
    Of(Box<Inner>),
    Both {
        low: f64,
    },
    Two(f64, f64),
}

/// What serde says was expected, in the words of this program.
fn in_words(message: &str) -> String {
    // Of a variant's keys. `toml` has words of its own for them.
    if let Some(key) = message.strip_prefix("unexpected keys in table: ") {
        return format!("unknown field `{}`", key.replace(", available keys: ", "`, expected `"));
    }
    let Some((before, expected)) = message.rsplit_once("expected ") else { return message.into() };
    let words = match expected {
        "f32" | "f64" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" | "i32" | "i64" => "a whole number",
        "a boolean" => "true or false",
        "a string" | "path string" => "a text",
        "a map" => "a table",
        "a sequence" => "a list",
        "an array of length 2" => "a list of 2",
        name if name.starts_with("struct ") && name != "struct variant" => "a table",
        other => other,
    };
    let before = before.replace("type: map", "type: table").replace("type: sequence", "type: list");
    format!("{before}expected {words}")
}

const TEXTS: &[&str] = &[
    "",
    "number = 3",
    "number = 1e400",
    "number = -inf",
    "count = 255\nword = 'a'\nis_on = true\nmaybe = 0.1\npair = [1, 2.5]\npath = '/x'",
    "choice = 'none-of-all'",
    "choice = { of = { at = 1.0 } }",
    "[choice.both]\nlow = 2",
    "choice = { two = [1, 2] }",
    "[[list]]\nat = 1\n[[list]]\nat = 2\nof = { both = { low = 1 } }",
    "[named]\na = 1\n'b c' = 2",
    // Each of these is wrong.
    "number = 'x'",
    "\ncount = 256",
    "count = -1",
    "word = 1",
    "is_on = 'yes'",
    "pair = [1]",
    "pair = [1,\n 'x']",
    "unknown = 1",
    "[inner]\nof = 'none-of-all'",
    "[inner]\nat = 1\nmore = 2",
    "[[list]]\nat = 1\n[[list]]\nat = 'x'",
    "list = 3",
    "choice = 'other'",
    "choice = 3",
    "choice = {}",
    "choice = 'of'",
    "choice = 'both'",
    "choice = 'two'",
    "choice = { none-of-all = 3 }",
    "choice = { none-of-all = [1] }",
    "choice = { none-of-all = { a = 1 } }",
    "choice = { two = [1] }",
    "choice = { two = 3 }",
    "choice = { of = 1 }",
    "choice = { of = { at = 1 }, both = { low = 1 } }",
    "choice = { both = { low = 1, high = 2 } }",
    "[named]\na = -1",
    "number = ",
    "number = 1\nnumber = 2",
    "[inner]\nat = 1\n[inner]\nat = 2",
];

/// Prevents a reading that differs from that of the crate `toml`: in a value, in a message or in its place.
#[test]
fn a_text_is_read_as_toml_reads_it() {
    for text in TEXTS {
        let (ours, theirs) = (from_toml::<All>(text), toml::from_str::<All>(text));
        match (ours, theirs) {
            (Ok(ours), Ok(theirs)) => assert_eq!(ours, theirs, "{text}"),
            (Err(ours), Err(theirs)) => {
                let said = in_words(theirs.message());
                assert_eq!((ours.message(), ours.span()), (said.as_str(), theirs.span()), "{text}");
            }
            (ours, theirs) => panic!("{text}: {ours:?}, of toml {theirs:?}"),
        }
    }
}

/// Prevents a table in memory that is read otherwise than its text.
#[test]
fn a_table_is_read_as_its_text() {
    for text in TEXTS {
        let Ok(table) = toml::from_str::<toml::Table>(text) else { continue };
        let (ours, theirs) = (All::from_node(Node::from(Value::Table(table))), from_toml::<All>(text));
        assert_eq!(ours.as_ref().ok(), theirs.as_ref().ok(), "{text}");
        assert_eq!(ours.err().map(|e| e.message), theirs.err().map(|e| e.message), "{text}");
    }
}

#[test]
fn a_key_that_lacks_and_one_that_is_too_many_are_told_apart() {
    #[derive(Debug, FromNode)]
    #[tree(deny_unknown_fields)]
    struct Two {
        #[tree(rename = "needed")]
        _needed: u32,
    }
    for (text, fault, said) in [
        ("", Fault::MissingKey, "missing field `needed`"),
        ("needed = 1\nother = 2", Fault::UnknownKey, "unknown field `other`, expected `needed`"),
        ("needed = 'x'", Fault::Other, "invalid type: string \"x\", expected a whole number"),
    ] {
        let error = from_toml::<Two>(text).expect_err(text);
        assert_eq!((error.fault(), error.message()), (fault, said));
    }
}

#[test]
fn json_is_read_and_written_as_serde_json_does() {
    for text in TEXTS {
        let Ok(all) = from_toml::<All>(text) else { continue };
        let [ours, theirs] = [to_json(&all), serde_json::to_string(&all)].map(|text| text.expect("is written"));
        assert_eq!(ours, theirs);
        assert_eq!(to_json_lines(&all).ok(), serde_json::to_string_pretty(&all).ok());
        assert_eq!(to_toml(&all).ok(), toml::to_string(&all).ok());
        assert_eq!(all.to_node().into_toml().ok(), Value::try_from(&all).ok());
        // JSON has no infinite numbers.
        if all.number.is_finite() {
            assert_eq!(from_json::<All>(ours.as_bytes()).ok(), Some(all), "{ours}");
        }
    }
}

#[test]
fn a_fault_in_json_is_named_by_its_keys() {
    for (text, said) in [
        (r#"{"list": [{"at": 1}, {"at": "x"}]}"#, r#"list[1].at: invalid type: string "x", expected a number"#),
        (r#"{"number": null}"#, "number: invalid type: null, expected a number"),
        (r#"{"number": 1, "number": 2}"#, "duplicate field `number` at line 1 column 26"),
        (r#"{"named": {"a": 1, "a": 2}}"#, "duplicate field `a` at line 1 column 26"),
        (r#"{"number": "#, "EOF while parsing a value at line 1 column 11"),
    ] {
        assert_eq!(from_json::<All>(text.as_bytes()).expect_err(text).to_string(), said);
    }
}

#[test]
fn what_is_too_large_or_a_date_is_refused_in_words() {
    for (text, said) in [
        ("count = 99999999999999999999", "integer number overflowed"),
        ("number = 1979-05-27", "invalid type: date, expected a number"),
        // The crate `toml` ignores the third number.
        ("pair = [1, 2, 3]", "invalid length 3, expected a list of 2"),
    ] {
        assert_eq!(from_toml::<All>(text).expect_err("it is refused").message(), said);
    }
}
