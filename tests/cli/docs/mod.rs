//! The pages that a reader meets: docs/cli.md and docs/settings.md are what the program and the settings types say (`tools/docs` writes
//! them again), README.md stays short, and no link leads nowhere.

mod counts;
mod site;

use crate::common::files::repository;
use crate::common::program::PROGRAM;
use echolume::low_level::scene::{Number, Settings, numbers};
use echolume::low_level::source::formats::FORMATS;
use echolume::low_level::source::keys::{Row, Use};
use echolume::low_level::tree::ToNode;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use syn::punctuated::Punctuated;
use syn::{Attribute, Expr, ExprLit, Fields, Item, Lit, Meta, Token, Type};

fn read(name: &str) -> String {
    std::fs::read_to_string(repository(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Names of the files directly below a folder that end in `.ending`, sorted, with the folder in front.
fn files(folder: &str, ending: &str) -> Vec<String> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(repository(folder)).expect(folder) {
        let path = entry.expect("entry").path();
        if path.extension().is_some_and(|e| e == ending) {
            found.push(format!("{folder}/{}", path.file_name().expect("name").to_string_lossy()));
        }
    }
    found.sort();
    found
}

/// Compares a generated page with the file, or writes the file where UPDATE_DOCS is set.
fn hold(name: &str, page: &str) {
    if std::env::var_os("UPDATE_DOCS").is_some() {
        return std::fs::write(repository(name), page).expect(name);
    }
    let kept = std::fs::read_to_string(repository(name)).unwrap_or_default();
    let differs = kept.lines().zip(page.lines()).position(|(kept, page)| kept != page);
    let line = differs.unwrap_or_else(|| kept.lines().count().min(page.lines().count()));
    let at = |text: &str| text.lines().nth(line).unwrap_or("nothing").to_string();
    assert!(
        kept == page,
        "{name} is out of date: run tools/docs. Line {} is\n  {}\nand should be\n  {}",
        line + 1,
        at(&kept),
        at(page)
    );
}

/// The same for the part of a page between two marks.
fn hold_part(name: &str, part: &str) {
    let (begin, end) =
        ("<!-- Generated: `tools/docs` writes this part. Do not edit it. -->\n", "<!-- End of the generated part. -->");
    let page = read(name);
    let (before, rest) = page.split_once(begin).unwrap_or_else(|| panic!("{name} has no generated part"));
    let (_, after) = rest.split_once(end).unwrap_or_else(|| panic!("{name} has no end of the generated part"));
    hold(name, &format!("{before}{begin}\n{part}\n{end}{after}"));
}

// The formats.

/// Keys of a kind: those of each aspect, with the values that change nothing.
fn keys_of(rows: &[Row], is_one: impl Fn(Use) -> bool) -> String {
    let mut by_aspect: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for row in rows.iter().filter(|row| is_one(row.done)) {
        let unless = match row.done {
            Use::Warned(neutral) | Use::Refused(neutral) if !neutral.is_empty() => {
                format!(" unless {}", neutral.join(" or "))
            }
            _ => String::new(),
        };
        by_aspect.entry(row.aspect.name()).or_default().push(format!("`{}`{unless}", row.name));
    }
    by_aspect.iter().map(|(aspect, keys)| format!("{aspect}: {}", keys.join(", "))).collect::<Vec<_>>().join("; ")
}

#[test]
fn generated_tables_of_keys_are_those_of_the_readers() {
    let mut part = String::new();
    for format in FORMATS.iter().filter(|format| !format.keys().is_empty()) {
        let rows = format.keys();
        writeln!(part, "### {}\n\n| what is done | keys |\n|---|---|", format.name).expect("text");
        for (title, keys) in [
            ("used", keys_of(&rows, |done| matches!(done, Use::Used | Use::Optional))),
            ("not used, with a warning", keys_of(&rows, |done| matches!(done, Use::Warned(_)))),
            ("refused", keys_of(&rows, |done| matches!(done, Use::Refused(_)))),
            ("not used, listed by `info -v`", keys_of(&rows, |done| done == Use::Listed)),
        ] {
            if !keys.is_empty() {
                writeln!(part, "| {title} | {keys} |").expect("text");
            }
        }
        part.push('\n');
    }
    hold_part("docs/formats.md", part.trim_end());
}

// The command line.

/// What the program prints for `--help`, 100 columns wide, without spaces at line ends.
fn help(command: &[String]) -> String {
    let mut program = Command::new(PROGRAM);
    let output = program.args(command).arg("--help").env("COLUMNS", "100").env_remove("RUST_LOG").output();
    let output = output.expect("the program starts");
    assert!(output.status.success(), "{command:?} --help: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n").trim_end().to_string()
}

/// Names below `Commands:` in a help text; `help` itself has nothing to say.
fn subcommands(help: &str) -> Vec<String> {
    let list = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // Deeper lines continue a description.
    let names = list.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = names.map(|line| line.split_whitespace().next().expect("a name").to_string());
    names.filter(|name| name != "help").collect()
}

fn describe_command(command: &[String], index: &mut String, page: &mut String) {
    let text = help(command);
    let title = ["echolume".to_string()].iter().chain(command).cloned().collect::<Vec<_>>().join(" ");
    writeln!(index, "{}- [{title}](#{})", "  ".repeat(command.len()), slug(&title)).expect("text");
    writeln!(page, "\n## {title}\n\n```text\n{text}\n```").expect("text");
    for name in subcommands(&text) {
        let below: Vec<String> = command.iter().cloned().chain([name]).collect();
        describe_command(&below, index, page);
    }
}

#[test]
fn generated_command_line_page_is_what_the_program_prints() {
    // The page shows the default features.
    if cfg!(not(feature = "view")) || cfg!(feature = "hot-reload") {
        return;
    }
    let (mut index, mut page) = (String::new(), String::new());
    describe_command(&[], &mut index, &mut page);
    for name in ["render", "stream", "view", "verify", "profile", "report error", "probe simulate"] {
        assert!(page.contains(&format!("\n## echolume {name}\n")), "the command {name} is gone");
    }
    let head = "# Command line\n\n<!-- Generated: `tools/docs` writes this page from the program's own help. Do not edit it. -->\n\n\
                What `echolume --help` prints, for every command. The settings that `--set` and scene files take are in\n\
                [settings.md](settings.md).\n\n";
    hold("docs/cli.md", &format!("{head}{index}{page}"));
}

/// The usual flags fit on a screen, and are flags of the program.
#[test]
fn the_short_help_is_one_screen() {
    let mut commands = subcommands(&help(&[]));
    commands.retain(|name| name != "help");
    for name in commands {
        let output =
            Command::new(PROGRAM).args([&name, "-h"]).env("COLUMNS", "100").output().expect("the program starts");
        let text = String::from_utf8(output.stdout).expect("text");
        let whole = help(std::slice::from_ref(&name));
        assert!(output.status.success() && text.lines().count() <= 42, "{name}: {text}");
        assert!(text.contains(&format!("echolume {name} --help")), "{name}: {text}");
        for flag in text.split_whitespace().filter(|word| word.starts_with("--") && *word != "--help") {
            let flag = flag.trim_end_matches("...");
            assert!(whole.contains(flag), "{name} has no {flag}");
        }
    }
    // What has few flags has all of them, and no command loses the values that `--help` says are usual.
    let output = Command::new(PROGRAM).args(["render", "-h"]).output().expect("the program starts");
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(["--preset", "--mode", "--set", "--output"].iter().all(|flag| text.contains(flag)), "{text}");
    let order = ["Look:", "Device:", "Input:", "Output:", "Debugging:"].map(|group| text.find(group));
    assert!(order.iter().all(Option::is_some), "{text}");
}

/// Presets, modes, bodies and settings are words that a shell completes.
#[test]
fn completions_know_values() {
    let output = Command::new(PROGRAM).args(["completions", "bash"]).output().expect("the program starts");
    let script = String::from_utf8(output.stdout).expect("text");
    let keys = numbers().map(|number| format!("{}=", number.key));
    for word in ["face-classic", "minip", "wires", "rolling"].map(String::from).into_iter().chain(keys) {
        assert!(script.contains(&word), "{word}");
    }
}

// The settings.

/// A struct or an enum of the settings.
struct Described {
    name: String,
    doc: String,
    body: Body,
}

enum Body {
    Struct(Vec<Key>),
    Enum(Vec<Choice>),
}

struct Key {
    name: String,
    doc: String,
    of: Type,
    is_required: bool,
    /// The keys of its type stand in its place.
    is_flat: bool,
}

struct Choice {
    name: String,
    aliases: Vec<String>,
    doc: String,
    is_default: bool,
    /// Of a choice that is no word but a value.
    of: Option<Type>,
}

/// The lines of a doc comment as one paragraph, links to items as their names.
fn doc(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value().trim().to_string()),
            _ => None,
        },
        _ => None,
    });
    let text = lines.collect::<Vec<_>>().join(" ").trim().to_string();
    let mut plain = String::new();
    let mut rest = text.as_str();
    while let Some(start) = rest.find("[`") {
        let Some(end) = rest[start..].find("`]").map(|end| start + end) else { break };
        let name = rest[start + 2..end].rsplit("::").next().expect("a name");
        write!(plain, "{}`{name}`", &rest[..start]).expect("text");
        rest = &rest[end + 2..];
        if rest.starts_with('(') {
            rest = rest.split_once(')').expect("the end of a link").1;
        }
    }
    plain + rest
}

/// The arguments of `#[tree(...)]` by name, in order; those without a value have an empty one.
fn tree_arguments(attributes: &[Attribute]) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for attribute in attributes.iter().filter(|attribute| attribute.path().is_ident("tree")) {
        let arguments = attribute.parse_args_with(Punctuated::<Meta, Token![,]>::parse_terminated).expect("tree");
        for argument in arguments {
            let name = argument.path().get_ident().expect("a name").to_string();
            let value = match &argument {
                Meta::NameValue(pair) => match &pair.value {
                    Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => text.value(),
                    _ => panic!("{name} of tree is no text"),
                },
                _ => String::new(),
            };
            found.push((name, value));
        }
    }
    found
}

fn argument<'a>(arguments: &'a [(String, String)], name: &str) -> Option<&'a str> {
    arguments.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
}

/// A variant's name as files have it.
fn renamed(name: &str, rule: Option<&str>) -> String {
    match rule {
        None => name.to_string(),
        Some("lowercase") => name.to_lowercase(),
        Some("kebab-case") => {
            let dash = |(i, c): (usize, char)| {
                let dash = if i > 0 && c.is_uppercase() { "-" } else { "" };
                format!("{dash}{}", c.to_lowercase())
            };
            name.chars().enumerate().map(dash).collect()
        }
        Some(other) => panic!("rename_all = {other} is not known here"),
    }
}

/// Every public type of src/core/scene/settings with attributes of `tree`, by name.
fn described_types() -> BTreeMap<String, Described> {
    let mut types = BTreeMap::new();
    for file in files("src/core/scene/settings", "rs") {
        let parsed = syn::parse_file(&read(&file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        for item in parsed.items {
            let (name, attributes, body) = match item {
                Item::Struct(item) => {
                    let all_default = argument(&tree_arguments(&item.attrs), "default").is_some();
                    let Fields::Named(fields) = item.fields else {
                        panic!("{file}: {} has no named fields", item.ident)
                    };
                    // What is skipped is in no file.
                    let is_key = |field: &syn::Field| argument(&tree_arguments(&field.attrs), "skip").is_none();
                    let keys = fields.named.into_iter().filter(is_key).map(|field| {
                        let arguments = tree_arguments(&field.attrs);
                        for (name, _) in &arguments {
                            let is_known = ["default", "skip_serializing_if", "flatten"].contains(&name.as_str());
                            assert!(is_known, "{file}: {name}: an argument that is not known here");
                        }
                        Key {
                            name: field.ident.expect("a name").to_string(),
                            doc: doc(&field.attrs),
                            of: field.ty,
                            is_required: !all_default && argument(&arguments, "default").is_none(),
                            is_flat: argument(&arguments, "flatten").is_some(),
                        }
                    });
                    (item.ident, item.attrs, Body::Struct(keys.collect()))
                }
                Item::Enum(item) => {
                    let rule = tree_arguments(&item.attrs);
                    let choices = item.variants.into_iter().map(|variant| {
                        let arguments = tree_arguments(&variant.attrs);
                        let by_rule = || renamed(&variant.ident.to_string(), argument(&rule, "rename_all"));
                        let name = argument(&arguments, "rename").map_or_else(by_rule, str::to_string);
                        let aliases = arguments.into_iter().filter(|(key, alias)| key == "alias" && *alias != name);
                        Choice {
                            aliases: aliases.map(|(_, alias)| alias).collect(),
                            name,
                            doc: doc(&variant.attrs),
                            is_default: variant.attrs.iter().any(|attribute| attribute.path().is_ident("default")),
                            of: variant.fields.into_iter().next().map(|field| field.ty),
                        }
                    });
                    (item.ident, item.attrs, Body::Enum(choices.collect()))
                }
                _ => continue,
            };
            let name = name.to_string();
            types.insert(name.clone(), Described { name, doc: doc(&attributes), body });
        }
    }
    while let Some((whole, at, part)) = flat_key(&types) {
        let Some(Described { body: Body::Struct(keys), .. }) = types.remove(&part) else {
            panic!("{part} is no struct")
        };
        let Some(Described { body: Body::Struct(all), .. }) = types.get_mut(&whole) else { continue };
        all.splice(at..=at, keys.into_iter().map(|key| Key { is_required: false, ..key }));
    }
    types
}

/// The first key that stands for those of its type: the type that has it, its index there, and its own type.
fn flat_key(types: &BTreeMap<String, Described>) -> Option<(String, usize, String)> {
    types.iter().find_map(|(name, described)| {
        let Body::Struct(keys) = &described.body else { return None };
        let at = keys.iter().position(|key| key.is_flat)?;
        Some((name.clone(), at, parts(&keys[at].of).0))
    })
}

/// The last name of a type's path and what it is of: `Option` and `f64` of `Option<f64>`.
fn parts(of: &Type) -> (String, Option<&Type>) {
    let Type::Path(path) = of else { panic!("neither a path nor an array") };
    let last = path.path.segments.last().expect("a name");
    let inner = match &last.arguments {
        syn::PathArguments::AngleBracketed(arguments) => arguments.args.first().map(|argument| match argument {
            syn::GenericArgument::Type(inner) => inner,
            _ => panic!("{} is not of a type", last.ident),
        }),
        _ => None,
    };
    (last.ident.to_string(), inner)
}

fn length(array: &syn::TypeArray) -> usize {
    match &array.len {
        Expr::Lit(ExprLit { lit: Lit::Int(length), .. }) => length.base10_parse().expect("a length"),
        _ => panic!("an array whose length is no number"),
    }
}

/// A type as a user writes its values.
fn type_words(of: &Type, types: &BTreeMap<String, Described>) -> String {
    if let Type::Array(array) = of {
        return format!("{} x {}", length(array), type_words(&array.elem, types));
    }
    match (parts(of).0.as_str(), parts(of).1) {
        ("Option", Some(inner)) => format!("{} or none", type_words(inner, types)),
        ("Vec", Some(inner)) => format!("list of {}", type_words(inner, types)),
        ("bool", None) => "true or false".to_string(),
        ("u32", None) => "whole number".to_string(),
        ("f64", None) => "number".to_string(),
        ("DVec3", None) => "3 x number".to_string(),
        ("String", None) => "text".to_string(),
        (name, None) if types.contains_key(name) => format!("[{name}](#{})", slug(name)),
        (name, _) => panic!("a setting of type {name} cannot be described: add it to tests/cli/docs/mod.rs"),
    }
}

/// The first sentence about a type of the settings; nothing of others.
fn type_summary(of: &Type, types: &BTreeMap<String, Described>) -> String {
    if matches!(of, Type::Array(_)) {
        return String::new();
    }
    match parts(of) {
        (_, Some(inner)) => type_summary(inner, types),
        (name, None) => {
            match types.get(&name).map(|t| t.doc.split_once(". ").map_or(t.doc.as_str(), |(first, _)| first)) {
                Some(first) if !first.is_empty() => format!("{}.", first.trim_end_matches('.')),
                _ => String::new(),
            }
        }
    }
}

/// A value that a required key takes, so that the defaults beside it can be asked for.
fn any_value(of: &Type) -> Value {
    match of {
        Type::Array(array) => Value::Array(vec![any_value(&array.elem); length(array)]),
        _ => json!(1),
    }
}

/// Adds `value` at a path of keys.
fn with(settings: &mut Value, path: &[String], value: Value) {
    let mut place = settings;
    for key in path {
        place = place.as_object_mut().expect("a table").entry(key).or_insert(json!({}));
    }
    *place = value;
}

/// What is read of `value` at a path of otherwise default settings.
fn defaults(path: &[String], value: Value) -> Value {
    let mut asked = json!({});
    with(&mut asked, path, value);
    let settings = Settings::read(asked.to_node()).unwrap_or_else(|e| panic!("{path:?}: {e}"));
    let all = serde_json::to_value(settings.to_node()).expect("settings");
    path.iter().fold(all, |value, key| value[key.as_str()].clone())
}

fn value_words(value: &Value) -> String {
    match value {
        Value::Null => "none".to_string(),
        other => format!("`{}`", other.to_string().replace(',', ", ")),
    }
}

/// Without what would end a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

struct SettingsPage<'a> {
    types: &'a BTreeMap<String, Described>,
    text: String,
    /// Types without a heading yet, in the order in which they are met, each with a path to one and whether it is an element of a list.
    ahead: Vec<(String, Vec<String>, bool)>,
    met: BTreeSet<String>,
}

impl SettingsPage<'_> {
    /// Puts the types that `of` names on the list of those to be described.
    fn meet(&mut self, of: &Type, path: &[String], is_element: bool) {
        match of {
            Type::Array(array) => self.meet(&array.elem, path, is_element),
            _ => match parts(of) {
                (name, Some(inner)) => self.meet(inner, path, is_element || name == "Vec"),
                (name, None) if self.types.contains_key(&name) && self.met.insert(name.clone()) => {
                    self.ahead.push((name, path.to_vec(), is_element));
                }
                _ => {}
            },
        }
    }

    /// A type below its heading. Its defaults are those at `path`; an element of a list has none.
    fn describe(&mut self, name: &str, path: &[String], is_element: bool) {
        let types = self.types;
        let Described { doc, body, .. } = &types[name];
        if !doc.is_empty() {
            write!(self.text, "{doc}\n\n").expect("text");
        }
        match body {
            Body::Struct(keys) => {
                let required = keys.iter().filter(|key| key.is_required);
                let required: Map<String, Value> = required.map(|key| (key.name.clone(), any_value(&key.of))).collect();
                let defaults = if is_element { Value::Null } else { defaults(path, Value::Object(required)) };
                self.text += "| key | type | default | |\n|---|---|---|---|\n";
                for key in keys {
                    let below: Vec<String> = path.iter().cloned().chain([key.name.clone()]).collect();
                    self.meet(&key.of, &below, is_element);
                    let value = &defaults[key.name.as_str()];
                    let value = match (key.is_required, value) {
                        (true, _) => "required".to_string(),
                        (false, _) if is_element => "optional".to_string(),
                        // It has a table of its own.
                        (false, Value::Object(_)) => String::new(),
                        (false, value) => value_words(value),
                    };
                    let of = type_words(&key.of, types);
                    let mut about = if key.doc.is_empty() { type_summary(&key.of, types) } else { key.doc.clone() };
                    let row = numbers().find(|number| number.key == below.join("."));
                    // Not twice.
                    let is_stated = |allowed: &str| {
                        let range = allowed.split(' ').next().unwrap_or_default();
                        about.split([' ', ',', ';']).any(|word| word.trim_end_matches('.') == range)
                    };
                    if let Some(allowed) = row.map(Number::allowed).filter(|allowed| !is_stated(allowed)) {
                        about += &format!(" Allowed: {allowed}.");
                    }
                    writeln!(self.text, "| `{}` | {of} | {} | {} |", key.name, cell(&value), cell(&about))
                        .expect("text");
                }
            }
            Body::Enum(choices) => {
                self.text += "| value | |\n|---|---|\n";
                for choice in choices {
                    let mut about = choice.doc.clone();
                    if choice.is_default {
                        about = format!("{about} The default.").trim().to_string();
                    }
                    if !choice.aliases.is_empty() {
                        let aliases = choice.aliases.iter().map(|alias| format!("`{alias}`")).collect::<Vec<_>>();
                        about = format!("{about} Also {}.", aliases.join(", ")).trim().to_string();
                    }
                    let value = match &choice.of {
                        Some(of) => {
                            self.meet(of, path, true);
                            type_words(of, types)
                        }
                        None => format!("`{}`", choice.name),
                    };
                    writeln!(self.text, "| {value} | {} |", cell(&about)).expect("text");
                }
            }
        }
        self.text += "\n";
    }
}

#[test]
fn generated_settings_page_is_what_the_types_say() {
    let types = described_types();
    let Body::Struct(keys) = &types["Settings"].body else { panic!("Settings is no struct") };
    let mut page = SettingsPage { types: &types, text: String::new(), ahead: Vec::new(), met: BTreeSet::new() };
    page.describe("Settings", &[], false);
    let mut next = 0;
    while next < page.ahead.len() {
        let (name, path, is_element) = page.ahead[next].clone();
        write!(page.text, "## {name}\n\n").expect("text");
        page.describe(&name, &path, is_element);
        next += 1;
    }
    let left: Vec<&str> = types.values().map(|t| t.name.as_str()).filter(|name| *name != "Settings").collect();
    let left: Vec<&&str> = left.iter().filter(|name| !page.met.contains(**name)).collect();
    assert!(left.is_empty(), "no setting has the type {left:?}");
    let known = serde_json::to_value(Settings::default().to_node()).expect("settings");
    let known: BTreeSet<&String> = known.as_object().expect("a table").keys().collect();
    assert_eq!(keys.iter().map(|key| &key.name).collect::<BTreeSet<_>>(), known, "keys that files name otherwise");

    let mut presets = String::new();
    for file in files("src/core/scene/presets", "toml") {
        let name = Path::new(&file).file_stem().expect("a name").to_string_lossy().into_owned();
        write!(presets, "\n### {name}\n\n```toml\n{}\n```\n", read(&file).trim_end()).expect("text");
    }
    let head = "# Settings\n\n<!-- Generated: `tools/docs` writes this page from src/core/scene/settings. Do not edit it. -->\n\n\
                Everything that a scene file (`--scene settings.toml`) or `--set` can change. A key of a table is written with dots: the \
                key `window`\nof `surface` is `--set surface.window=[0.1,0.9]`, and in a scene file\n\n\
                ```toml\n[surface]\nwindow = [0.1, 0.9]\n```\n\n\
                Lengths are in mm, angles in degrees, samples and opacities in 0..1 unless a key says otherwise. Settings come in layers: \
                the\ndefaults below, presets, the scene file, flags, `--set`; each overrides the one before. `none` switches off what an \
                earlier layer set\n(`--set light.shadow=none`). An unknown key is refused. A scene file may state its version,\n`version = 1`; a later one is \
                refused. The presets are at the [end](#presets).\n\nWithout a preset, the recording \
                determines the mode, grey windows, transfer function, light and filters that nothing sets, in place of the defaults below: \
                `--explain` says which.\n\nThe thesis, whose sections, equations, figures and tables are named by their numbers, is that of the \
                [glossary](architecture.md#glossary).\n\n\
                ## Top level\n\n";
    let text = page.text.trim_end();
    hold("docs/settings.md", &format!("{head}{text}\n\n## Presets\n\nWhat `--preset NAME` sets.\n{presets}"));
}

// Links.

/// The anchor of a heading, as code hosts make it.
fn slug(heading: &str) -> String {
    let kept = heading.to_lowercase();
    kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_')).collect::<String>().replace(' ', "-")
}

/// A page without its blocks of code and without what stands in `...`.
fn prose(text: &str) -> String {
    let mut is_code = false;
    let mut kept = String::new();
    for line in text.lines() {
        if line.starts_with("```") {
            is_code = !is_code;
        } else if !is_code && !line.starts_with("    ") {
            kept.extend(line.split('`').step_by(2));
        }
        kept.push('\n');
    }
    kept
}

fn anchors(text: &str) -> BTreeSet<String> {
    let mut is_code = false;
    let mut found = BTreeSet::new();
    for line in text.lines() {
        is_code ^= line.starts_with("```");
        if let Some(heading) = line.strip_prefix('#').filter(|_| !is_code) {
            found.insert(slug(heading.trim_start_matches('#').trim()));
        }
    }
    found
}

/// Targets of the links and pictures of a page.
fn links(text: &str) -> Vec<String> {
    let prose = prose(text);
    let inline = prose.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target);
    let tags = ["src=\"", "href=\""].map(|tag| prose.split(tag).skip(1).filter_map(|rest| rest.split_once('"')));
    let tags = tags.into_iter().flatten().map(|(target, _)| target);
    inline.chain(tags).map(str::to_string).collect()
}

/// Paths of this repository that a page names in `...`, without those that stand for several.
fn paths(text: &str) -> Vec<String> {
    let mut is_code = false;
    let mut found = Vec::new();
    for line in text.lines() {
        is_code ^= line.starts_with("```");
        let spans = line.split('`').skip(1).step_by(2).filter(|_| !is_code);
        let spans = spans.filter(|span| !span.contains([' ', '*', '{', '<']));
        let folders = ["src/", "glsl/", "spirv/", "tests/", "benches/", "tools/", "docs/"];
        found.extend(spans.filter(|span| folders.iter().any(|f| span.starts_with(f))).map(str::to_string));
    }
    found
}

fn pages() -> Vec<String> {
    let mut pages = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md"].map(str::to_string).to_vec();
    pages.extend(files("docs", "md"));
    pages.extend(files("docs/experiments", "md"));
    pages
}

/// The path that a link of a page means, from the top of the repository, and its anchor.
fn meant(page: &str, link: &str) -> (String, Option<String>) {
    let (path, anchor) = link.split_once('#').map_or((link, None), |(path, anchor)| (path, Some(anchor.to_string())));
    if path.is_empty() {
        return (page.to_string(), anchor);
    }
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in path.split('/') {
        match part {
            "." => {}
            ".." => drop(parts.pop().unwrap_or_else(|| panic!("{page}: {link} leaves the repository"))),
            part => parts.push(part),
        }
    }
    (parts.join("/"), anchor)
}

#[test]
fn every_link_leads_somewhere() {
    let mut count = 0;
    for page in pages() {
        for link in links(&read(&page)) {
            if link.starts_with("https://") {
                continue;
            }
            let (path, anchor) = meant(&page, &link);
            assert!(repository(&path).exists(), "{page}: {link} leads to {path}, which is not there");
            if let Some(anchor) = anchor {
                assert!(anchors(&read(&path)).contains(&anchor), "{page}: {path} has no heading #{anchor}");
            }
            count += 1;
        }
        // CHANGELOG.md may name what was there once.
        for path in paths(&read(&page)).into_iter().filter(|_| page != "CHANGELOG.md") {
            assert!(repository(&path).exists(), "{page} names {path}, which is not there");
        }
    }
    assert!(count > 100, "only {count} links: are they read at all?");
}

#[test]
fn every_page_and_every_picture_is_shown() {
    let mut linked = BTreeSet::new();
    for page in pages() {
        for link in links(&read(&page)) {
            let (path, _) = if link.starts_with("https://") { continue } else { meant(&page, &link) };
            if page.ends_with("README.md") || path.ends_with(".png") {
                linked.insert(path);
            }
        }
    }
    for page in pages().into_iter().filter(|page| page.starts_with("docs/")) {
        assert!(linked.contains(&page), "no README.md has a link to {page}");
    }
    for picture in files("docs/pictures", "png") {
        assert!(linked.contains(&picture), "no page shows {picture}");
    }
}

#[test]
fn readme_is_short_and_says_what_must_be_said() {
    let readme = read("README.md");
    let lines = readme.lines().count();
    assert!(lines <= 200, "README.md has {lines} lines; 200 are enough, the rest belongs to docs/");
    let manifest: toml::Table = toml::from_str(&read("Cargo.toml")).expect("Cargo.toml");
    let version = manifest["workspace"]["package"]["rust-version"].as_str().expect("a version");
    assert!(readme.contains(&format!("Rust {version}")), "README.md does not say Rust {version}");
    for said in ["not a medical device", "No licence has been chosen yet", "tools/demo", "tools/test"] {
        assert!(readme.contains(said), "README.md does not say: {said}");
    }
}

/// Every Rust source of the modules of this name: of the program, a member, or a module of a member.
fn module_sources(name: &str) -> String {
    let top = repository("src");
    let members = std::fs::read_dir(&top).expect("src").map(|entry| entry.expect("entry").path());
    let places = std::iter::once(top.clone()).chain(members.filter(|path| path.join("Cargo.toml").is_file()));
    let found = places.map(|place| place.join(name)).filter(|p| p.is_dir() || p.with_extension("rs").is_file());
    let text: String = found.map(|place| sources(&place)).collect();
    assert!(!text.is_empty(), "no member has a module {name}");
    text
}

/// Every Rust source below a place, a folder or a file without its ending.
fn sources(place: &Path) -> String {
    if place.with_extension("rs").is_file() {
        return std::fs::read_to_string(place.with_extension("rs")).expect("source");
    }
    let entries = std::fs::read_dir(place).unwrap_or_else(|e| panic!("{}: {e}", place.display()));
    let mut text = String::new();
    for path in entries.map(|entry| entry.expect("entry").path()) {
        if path.is_dir() {
            text += &sources(&path);
        } else if path.extension().is_some_and(|e| e == "rs") {
            text += &std::fs::read_to_string(&path).expect("source");
        }
    }
    text
}

#[test]
fn walks_through_the_code_name_functions_that_exist() {
    let page = read("docs/architecture.md");
    let walks = page.split("\n## ").filter(|part| part.starts_with("A frame,") || part.starts_with("A scene,"));
    let mut count = 0;
    for row in walks.flat_map(|walk| walk.lines()).filter(|line| line.starts_with("| `")) {
        let cell = row.split('|').nth(1).expect("a cell");
        // The first name of a cell begins with its module; those behind it are of the same module.
        let mut module = String::new();
        for name in cell.split('`').skip(1).step_by(2) {
            let parts: Vec<&str> = name.split("::").collect();
            if let Some(first) = parts.first().filter(|_| parts.len() > 1) {
                module = (*first).to_string();
            }
            let function = parts.last().expect("a name");
            let text = module_sources(&module);
            let is_there = ["(", "<"].iter().any(|end| text.contains(&format!("fn {function}{end}")));
            assert!(is_there, "docs/architecture.md: src/{module} has no function {function} ({name})");
            let of = parts.iter().rev().nth(1).filter(|of| of.starts_with(char::is_uppercase));
            let types = ["struct", "trait", "enum"];
            let is_known = of.is_none_or(|of| types.iter().any(|kind| text.contains(&format!("{kind} {of}"))));
            assert!(is_known, "docs/architecture.md: src/{module} has no type {of:?} ({name})");
            count += 1;
        }
    }
    assert!(count > 20, "only {count} functions: are the walks read at all?");
}

#[test]
fn links_are_found_and_checked_as_code_hosts_do() {
    let page = "# A `b` of c-d: e!\n[x](docs/a.md#b) `[no](no)` ![p](p.png)\n```sh\n# [no](no)\n```\n<img src=\"q.png\" width=\"9\">\n    [no](no)\n";
    assert_eq!(links(page), ["docs/a.md#b", "p.png", "q.png"]);
    assert_eq!(paths("`src/lib.rs` `src/*.rs` src/no\n```\n`src/no`\n```\n`tools/`"), ["src/lib.rs", "tools/"]);
    assert_eq!(anchors(page).into_iter().collect::<Vec<_>>(), ["a-b-of-c-d-e"]);
    assert_eq!(meant("docs/x.md", "../README.md#y"), ("README.md".to_string(), Some("y".to_string())));
    assert_eq!(meant("docs/x.md", "#y"), ("docs/x.md".to_string(), Some("y".to_string())));
    assert_eq!(meant("docs/x.md", "pictures/./p.png"), ("docs/pictures/p.png".to_string(), None));
}
