//! `echolume worksheet`: values are those of formulas, pictures those of `render`, a report is made again bit for bit, and what is wrong is
//! refused in a line.

use crate::common::program::*;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use echolume::low_level::picture::Picture;
use scraper::{Html, Selector};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;

/// Squares of 1 cm2 at two elevations 2 mm apart: 0.4 cm3. A caliper in the plane, one in none of the three, one on the surface, a text, a box.
const MEASURE: &str = "
mode = 'plane'
[workspace]
version = 1
recording = 'bone.mha'
[picture]
size = [160, 120]
[[measure]]
kind = 'distance'
points = [[12.4, 0.5, 5.6], [12.4, 23.6, 5.6]]
text = 'to the bone'
[[measure]]
kind = 'distance'
points = [[10, 10, 3], [20, 20, 8]]
[[measure]]
kind = 'text'
points = [[10, 10, 5.6]]
text = 'skin'
[[measure]]
kind = 'volume'
contours = [[[5, 5, 3], [15, 5, 3], [15, 15, 3], [5, 15, 3]], [[5, 5, 5], [15, 5, 5], [15, 15, 5], [5, 15, 5]]]
[[measure]]
kind = 'surface'
points = [[10, 25, 5], [14, 25, 5]]
on_surface = true
made = { volume = 0, time = 1.25, plane = 'rendering, azimuth 30.0, elevation 10.0, roll 0.0 deg', settings = 'Surface 0123456789abcdef' }
[[measure]]
kind = 'threshold'
points = [[25, 5, 6], [35, 15, 10]]
threshold = 0.5
counted = 250
";

/// A folder with a recording, and a workspace of it with these lines before its first table.
fn exam(name: &str, first: &str) -> (Folder, String) {
    let folder = Folder::new(name);
    fs::copy(BONE, folder.join("bone.mha")).expect("copied");
    let workspace = folder.write("exam.toml", format!("{first}{MEASURE}"));
    (folder, workspace)
}

fn json(path: &str) -> Value {
    serde_json::from_slice(&fs::read(path).expect("a file")).expect("JSON")
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// What `render` draws of each entry, by the assignments that it states.
fn rendered(folder: &Folder, workspace: &str, report: &Value) -> Vec<Picture> {
    let entries = report["measurements"].as_array().expect("a list");
    let draw = |entry: &Value| {
        let file = folder.path("rendered.png");
        let mut arguments = vec!["render", workspace, "-o", &file];
        for set in entry["picture"]["set"].as_array().expect("a list") {
            arguments.extend(["--set", set.as_str().expect("text")]);
        }
        done(&arguments);
        Picture::load(Path::new(&file)).expect("a picture")
    };
    entries.iter().map(draw).collect()
}

#[test]
fn values_are_those_of_formulas_and_pictures_those_of_render() {
    let (folder, workspace) = exam("worksheet", "");
    let [html, json_file] = ["report.html", "report.json"].map(|name| folder.path(name));
    let said = done(&["worksheet", &workspace, "-o", &html]);
    assert!(said.ends_with(&format!("report: {html}, measurements: 5; --from {json_file} makes it again\n")), "{said}");
    let report = json(&json_file);
    let entries = report["measurements"].as_array().expect("a list");
    let value = |n: usize| entries[n]["quantities"][0]["value"].as_f64().expect("a number");
    for (n, expected) in [(0, 23.1), (1, 15.0), (2, 0.4), (3, 4.0), (4, 0.25)] {
        assert!((value(n) - expected).abs() < 1e-9, "{n}: {}", value(n));
    }
    assert_eq!(entries.iter().map(|entry| entry["number"].as_u64()).collect::<Vec<_>>(), [1, 2, 4, 5, 6].map(Some));
    assert_eq!(report["recording"]["sha256"], sha256(&fs::read(BONE).expect("the recording")).as_str());
    assert_eq!(entries[2]["interval"], "no interval stated");
    assert!(entries[2]["method"].as_str().is_some_and(|method| method.contains("parallel")));
    assert_eq!((&entries[0]["interval"], &entries[3]["time"]), (&Value::Null, &Value::from(1.25)));
    assert!(entries[0]["plane"].as_str().is_some_and(|plane| plane.starts_with("A at ")), "{}", entries[0]);
    // Each picture is that of the view that the JSON states, in the page and by its digest.
    let page = Html::parse_document(&fs::read_to_string(&html).expect("a page"));
    assert!(page.errors.is_empty(), "{:?}", page.errors);
    let select = |what: &str| Selector::parse(what).expect("a selector");
    let images: Vec<String> = page
        .select(&select("section.measurement img"))
        .map(|image| image.attr("src").expect("a picture").trim_start_matches("data:image/png;base64,").into())
        .collect();
    let pictures = rendered(&folder, &workspace, &report);
    assert_eq!((images.len(), pictures.len()), (5, 5));
    for ((image, picture), entry) in images.iter().zip(&pictures).zip(entries) {
        let shown = folder.write("shown.png", BASE64_STANDARD.decode(image).expect("base64"));
        assert!(Picture::load(Path::new(&shown)).expect("a picture") == *picture, "{}", entry["picture"]);
        assert_eq!(entry["picture"]["sha256"], sha256(&picture.rgba).as_str());
        // Every picture has the yellow of a caliper, or of the section of a box.
        let yellow = picture.rgba.chunks_exact(4).filter(|p| p[0] > 200 && p[1] > 150 && p[2] < 120).count();
        assert!(yellow > 10, "{yellow} pixels, {}", entry["picture"]);
    }
    assert!(entries[0]["picture"]["set"].as_array().is_some_and(Vec::is_empty), "the workspace shows it");
    let words = page.root_element().text().collect::<String>();
    for shown in ["23.1 mm", "15.0 mm", "0.40 cm³", "to the bone", "Not a medical device", "1 of 1", "1.250 s"] {
        assert!(words.contains(shown), "{shown}: {words}");
    }
    let csv = folder.path("report.csv");
    done(&["worksheet", &workspace, "-o", &csv]);
    let table = fs::read_to_string(&csv).expect("a table");
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines[0].ends_with(",plane,settings,recording_sha256,picture_sha256,program,device"), "{}", lines[0]);
    assert!(lines[1].starts_with("1,Caliper,\"to the bone\",distance,23.1000,mm,\"bone.mha\",0,"), "{}", lines[1]);
    assert!(lines[1].contains(&sha256(&pictures[0].rgba)), "{}", lines[1]);
}

/// An object of a PDF: its dictionary as text, and its stream, decompressed.
type Object = (String, Vec<u8>);

fn find(bytes: &[u8], what: &[u8]) -> Option<usize> {
    bytes.windows(what.len()).position(|window| window == what)
}

/// The objects of a PDF by their numbers, by its table of cross references.
fn objects(pdf: &[u8]) -> BTreeMap<usize, Object> {
    assert!(pdf.starts_with(b"%PDF-1.") && pdf.trim_ascii_end().ends_with(b"%%EOF"));
    let last = pdf.windows(9).rposition(|window| window == b"startxref").expect("its end");
    let number =
        |text: &[u8]| String::from_utf8_lossy(text).split_whitespace().next().and_then(|n| n.parse::<usize>().ok());
    let table = &pdf[number(&pdf[last + 9..]).expect("a place")..];
    assert!(table.starts_with(b"xref"));
    let text = String::from_utf8_lossy(&table[..find(table, b"trailer").expect("a trailer")]).into_owned();
    let used = text.lines().skip(2).enumerate().filter(|(_, line)| line.trim_end().ends_with('n'));
    used.map(|(n, line)| {
        let object = &pdf[number(line.as_bytes()).expect("a place")..];
        assert_eq!(number(object), Some(n), "the place of object {n}");
        let end = find(object, b"endobj").expect("its end");
        let Some(start) = find(&object[..end], b"stream\n") else {
            return (n, (String::from_utf8_lossy(&object[..end]).into_owned(), Vec::new()));
        };
        let about = String::from_utf8_lossy(&object[..start]).into_owned();
        let length = number(&about.as_bytes()[about.find("/Length ").expect("a length") + 8..]).expect("a length");
        let stream = &object[start + 7..start + 7 + length];
        assert!(object[start + 7 + length..].trim_ascii_start().starts_with(b"endstream"), "object {n}");
        let mut plain = Vec::new();
        flate2::read::ZlibDecoder::new(stream).read_to_end(&mut plain).expect("zlib");
        (n, (about, plain))
    })
    .collect()
}

/// The hexadecimal or literal strings that a content stream shows, as glyphs of two bytes.
fn shown(content: &[u8]) -> Vec<Vec<u16>> {
    let (mut found, mut at) = (Vec::new(), 0);
    while at < content.len() {
        let mut string = Vec::new();
        match content[at] {
            b'<' => {
                let end = at + find(&content[at..], b">").expect("its end");
                let digits: Vec<u8> = content[at + 1..end].to_vec();
                string.extend(
                    digits
                        .chunks(2)
                        .map(|two| u8::from_str_radix(std::str::from_utf8(two).expect("digits"), 16).expect("a byte")),
                );
                at = end;
            }
            b'(' => {
                let mut depth = 1;
                at += 1;
                while depth > 0 {
                    match content[at] {
                        b'\\' => {
                            at += 1;
                            let octal = content[at].is_ascii_digit();
                            let byte = match content[at] {
                                b'n' => b'\n',
                                b'r' => b'\r',
                                b't' => b'\t',
                                b'b' => 8,
                                b'f' => 12,
                                _ if octal => {
                                    let digits = std::str::from_utf8(&content[at..at + 3]).expect("digits");
                                    at += 2;
                                    u8::from_str_radix(digits, 8).expect("a byte")
                                }
                                other => other,
                            };
                            string.push(byte);
                        }
                        b'(' => {
                            depth += 1;
                            string.push(b'(');
                        }
                        b')' => {
                            depth -= 1;
                            string.extend((depth > 0).then_some(b')'));
                        }
                        byte => string.push(byte),
                    }
                    at += 1;
                }
            }
            _ => {}
        }
        if !string.is_empty() {
            found.push(string.chunks_exact(2).map(|two| u16::from_be_bytes([two[0], two[1]])).collect());
        }
        at += 1;
    }
    found
}

/// The page of a reader: text by the map of its typeface, and pictures.
#[test]
fn a_pdf_opens_with_its_text_and_the_same_pictures() {
    let (folder, workspace) = exam("worksheet-pdf", "");
    let pdf = folder.path("report.pdf");
    done(&["worksheet", &workspace, "-o", &pdf]);
    let objects = objects(&fs::read(&pdf).expect("a file"));
    let with = |key: &str| objects.values().filter(|(about, _)| about.contains(key)).collect::<Vec<_>>();
    // Of the map: `<0001> <004D>`.
    let map =
        objects.values().map(|(_, stream)| String::from_utf8_lossy(stream)).find(|map| map.contains("beginbfchar"));
    let map = map.expect("a map of characters");
    let pairs = map.lines().filter_map(|line| {
        let two = line.strip_prefix('<')?.strip_suffix('>')?.split_once("> <")?;
        let [glyph, c] = [two.0, two.1].map(|hex| u32::from_str_radix(hex, 16).expect("digits"));
        Some((u16::try_from(glyph).expect("a glyph"), char::from_u32(c).expect("a character")))
    });
    let map: BTreeMap<u16, char> = pairs.collect();
    let pages = with("/Type /Page\n").len();
    let contents: Vec<String> = objects
        .values()
        .filter(|(about, stream)| !about.contains("/Type") && stream.windows(3).any(|window| window == b" Tf"))
        .map(|(_, content)| {
            let words =
                shown(content).into_iter().map(|glyphs| glyphs.iter().map(|glyph| map[glyph]).collect::<String>());
            words.collect::<Vec<_>>().join("\n")
        })
        .collect();
    assert!(pages > 1 && contents.len() == pages, "{pages} pages, {}", contents.len());
    for (n, page) in contents.iter().enumerate() {
        for words in ["Not a medical device".to_string(), format!("Page {} of {pages}", n + 1)] {
            assert!(page.lines().any(|line| line == words), "{words}: {page}");
        }
    }
    let all = contents.join("\n");
    for words in
        ["Measurements", "bone.mha", "Caliper: to the bone", "23.1 mm", "15.0 mm", "0.40 cm³", "no interval stated"]
    {
        assert!(all.contains(words), "{words}: {all}");
    }
    let images = with("/Subtype /Image");
    let drawn = rendered(&folder, &workspace, &json(&folder.path("report.json")));
    assert_eq!(images.len(), drawn.len());
    for (picture, (about, rgb)) in drawn.iter().zip(images) {
        assert!(about.contains(&format!("/Width {}", picture.width)), "{about}");
        assert!(picture.rgba.chunks_exact(4).flat_map(|p| &p[..3]).eq(rgb), "other pixels: {about}");
    }
}

/// Prevents a report that nobody can check: the same pictures from its JSON, wherever the folder is, and none of another recording.
#[test]
fn a_report_is_made_again_bit_for_bit_of_the_same_recording_only() {
    let (folder, workspace) = exam("worksheet-again", "marks = { bar = true }\n");
    let [html, first, again] = ["report.html", "report.json", "again.html"].map(|name| folder.path(name));
    done(&["worksheet", &workspace, "-o", &html]);
    fs::remove_file(&workspace).expect("the JSON has all of it");
    let said = done(&["worksheet", "--from", &first, "-o", &again]);
    let same = |file: &str| format!("pictures: all 5 are those of {file}, bit for bit\n");
    assert!(said.ends_with(&same(&first)), "{said}");
    assert!(fs::read(&html).expect("a page") == fs::read(&again).expect("a page"));
    assert_eq!(json(&first), json(&folder.path("again.json")));
    // The recording in another folder, beside the JSON, and named.
    let elsewhere = Folder::new("worksheet-moved");
    let [moved, third] = ["report.json", "third.json"].map(|name| elsewhere.path(name));
    fs::copy(&first, &moved).expect("copied");
    let named = ["worksheet", "--from", &moved, &folder.path("bone.mha"), "-o", &third];
    assert!(done(&named).ends_with(&same(&moved)));
    fs::copy(BONE, elsewhere.join("bone.mha")).expect("copied");
    assert!(done(&["worksheet", "--from", &moved, "-o", &third]).ends_with(&same(&moved)));
    // What differs is named, with the device that drew it.
    let mut other = json(&first);
    other["measurements"][1]["picture"]["sha256"] = "0".into();
    other["device"] = "Another GPU, driver 1".into();
    let other = folder.write("other.json", other.to_string());
    let said = done(&["worksheet", "--from", &other, "-o", &again]);
    assert!(said.contains(&format!("those of 1 of 5 measurements differ from {other} (2), which Echolume ")), "{said}");
    assert!(said.contains(" drew on Another GPU, driver 1"), "{said}");
    let mut bytes = fs::read(BONE).expect("the recording");
    *bytes.last_mut().expect("bytes") ^= 1;
    let digest = sha256(&bytes);
    folder.write("bone.mha", bytes);
    let changed = ["worksheet", "--from", &first, "-o", &again];
    let before = fs::read(&again).expect("a page");
    refuses(&changed, &run(&changed), 2, &["bone.mha: is not the recording of ", "report.json", &digest]);
    assert!(fs::read(&again).expect("a page") == before, "a refused report keeps the old one");
}

#[test]
fn a_measurement_is_drawn_on_its_own_volume() {
    let folder = Folder::new("worksheet-volumes");
    let sweep = folder.path("sweep.mha");
    done(&["phantom", "-o", &sweep, "--volumes", "2", "--frames", "9", "--lines", "24"]);
    let caliper = |volume: u32| {
        format!("[[measure]]\nkind = 'distance'\npoints = [[0, 40, 0], [5, 52, 0]]\nmade = {{ volume = {volume} }}\n")
    };
    let text = |last: u32| {
        let head = "mode = 'plane'\n[workspace]\nversion = 1\nrecording = 'sweep.mha'\n[picture]\nsize = [48, 40]\n";
        [head.to_string(), caliper(0), caliper(last)].concat()
    };
    let (workspace, out) = (folder.write("exam.toml", text(1)), folder.path("report.json"));
    done(&["worksheet", &workspace, "-o", &out]);
    let report = json(&out);
    for (n, volume) in ["0", "1"].into_iter().enumerate() {
        let picture = folder.path("p.png");
        done(&["render", &workspace, "--volume", volume, "-o", &picture]);
        let picture = Picture::load(Path::new(&picture)).expect("a picture");
        assert_eq!(report["measurements"][n]["picture"]["sha256"], sha256(&picture.rgba).as_str(), "{volume}");
        assert_eq!(report["measurements"][n]["quantities"][0]["value"], 13.0);
    }
    let shared = [0, 1].map(|n| report["measurements"][n]["picture"]["sha256"].clone());
    assert_ne!(shared[0], shared[1], "the volumes differ");
    let wrong = folder.write("wrong.toml", text(2));
    let all = ["worksheet", &wrong, "-o", &out];
    refuses(&all, &run(&all), 2, &["measurement 2 is of volume 2: there are 2, numbered from 0"]);
}

#[test]
fn what_cannot_be_a_report_is_refused_in_one_line() {
    let (folder, workspace) = exam("worksheet-refused", "");
    let (out, no_report) = (folder.path("out.pdf"), folder.write("no.json", "{}"));
    let old = folder.write("old.json", "{\"echolume_worksheet\": 9}");
    let odd = folder.write("odd.json", "{\"echolume_worksheet\": 1, \"date\": 3}");
    let broken = folder.write("broken.json", "[1,\n");
    let none = folder.path("none.json");
    let before = folder.names();
    let rows: [(&[&str], &str); 12] = [
        (&[&workspace, "-o", &folder.path("report.doc")], "report.doc: must end in .pdf, .html, .csv or .json"),
        (&[&workspace, "-o", "-"], "-o -: must end in"),
        (&[&workspace, "-o", &folder.path("none/report.pdf")], "there is no folder"),
        (&[&folder.path("bone.mha"), "-o", &out], "bone.mha: has no measurements"),
        (&["-o", &out], "phantom: has no measurements"),
        (&["-", "-o", &out], "standard input"),
        (&[&folder.path("none.toml"), "-o", &out], "none.toml: cannot be read"),
        (&["--from", &none, "-o", &out], "none.json: cannot be read"),
        (&["--from", &no_report, "-o", &out], "no.json: is no worksheet"),
        (&["--from", &old, "-o", &out], "old.json: is of version 9, this program reads version 1"),
        (&["--from", &odd, "-o", &out], "odd.json: is no worksheet: "),
        (&["--from", &broken, "-o", &out], "broken.json: is no worksheet: "),
    ];
    for (more, named) in rows {
        let all = [&["worksheet"][..], more].concat();
        let wanted = if named == "there is no folder" { 1 } else { 2 };
        refuses(&all, &run(&all), wanted, &[named]);
    }
    let replaced = ["worksheet", "--from", &no_report, "-o", &folder.path("no.html")];
    refuses(&replaced, &run(&replaced), 2, &["no.json: would replace an input"]);
    let (code, _, err) = run(&["worksheet", "--from", &no_report, "--set", "mode=mip", "-o", &out]);
    assert!(code == Some(2) && err.contains("cannot be used with"), "{err}");
    assert_eq!(folder.names(), before);
}
