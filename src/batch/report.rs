//! The results of a batch as one HTML page: failures, comparisons between devices, devices and times, and a contact sheet. The page needs no
//! script, no network and no other file.

use super::agreement::{Class, Drawer};
use super::comparisons::{Pair, pairs};
use super::results::{Record, Status};
use crate::html_page::page;
use crate::picture::Picture;
use crate::statistics::quantile_of;
use crate::text::escaped;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use maud::{Markup, html};
use std::collections::BTreeMap;
use std::path::Path;

/// Longest edge of a thumbnail, pixels.
const THUMBNAIL: u32 = 128;
/// Largest number of thumbnails, and of their bytes.
const MAX_THUMBNAILS: usize = 1000;
const MAX_BYTES: usize = 24 << 20;
/// Largest number of failures that are listed.
const MAX_FAILURES: usize = 2000;

const STYLE: &str = ".sheet { display: flex; flex-wrap: wrap; gap: .75rem; } .sheet figure { margin: 0; width: 8rem; font-size: .75rem; } \
                     .sheet img { display: block; max-width: 8rem; max-height: 8rem; background: #000; }";

/// Orders the results of a unit: the greatest one counts.
fn rank(record: &Record) -> (bool, bool, &str) {
    (record.status == Status::Done, record.agreement.is_none(), &record.date)
}

/// The results of all shards of a batch, reduced to one for each unit: a recording and what is done with it.
#[derive(Default)]
pub struct Merged<'a> {
    /// The result of each unit, by its input and work: the last success by date, otherwise the last failure. Among either, an attempt that drew a
    /// finished unit again for a comparison counts only if there is no other.
    pub units: BTreeMap<(&'a str, &'a str), &'a Record>,
}

impl<'a> Merged<'a> {
    pub fn of(records: &'a [Record]) -> Merged<'a> {
        let mut units: BTreeMap<(&str, &str), &Record> = BTreeMap::new();
        for record in records {
            let kept = units.entry((&record.input, &record.work)).or_insert(record);
            if rank(record) > rank(kept) {
                *kept = record;
            }
        }
        Merged { units }
    }

    /// The results of units that are not done.
    pub fn failures(&self) -> impl Iterator<Item = &'a Record> {
        self.units.values().copied().filter(|record| record.status != Status::Done)
    }

    /// The results of units that are done, one for each.
    pub fn done(&self) -> impl Iterator<Item = &'a Record> {
        self.units.values().copied().filter(|record| record.status == Status::Done)
    }
}

/// The HTML report of a batch. `folder`: that of the batch, from which thumbnails are read. `torn`: number of lines of the results that are no
/// records, such as those that killed processes left incomplete.
pub fn html(records: &[Record], torn: usize, folder: &Path) -> String {
    let merged = Merged::of(records);
    let (units, failures) = (merged.units.len(), merged.failures().count());
    let pairs = pairs(records);
    let disagree: usize = pairs.values().map(|pair| pair.faults.len()).sum();
    let verdict = match (failures, disagree) {
        (0, 0) => format!("All {units} units are done"),
        (0, n) => format!("{n} comparisons of devices do not agree"),
        (n, _) => format!("{n} of {units} units failed"),
    };
    let class = if failures + disagree > 0 { "failed" } else { "passed" };
    let body = html! {
        header class=(class) {
            p class="program" { "echolume batch" }
            h1 { (verdict) }
            ul class="counts" {
                li { strong { (units - failures) } " done" }
                li { strong { (failures) } " failed" }
                li { strong { (records.len()) } " tries" }
                @if let Some((first, last)) = dates(records) {
                    li { "on " strong { (first) } @if last != first { " to " strong { (last) } } }
                }
                @if torn > 0 { li { strong { (torn) } " lines cut short by killed processes" } }
            }
        }
        main {
            @if failures > 0 { (failed(&merged)) }
            @if !pairs.is_empty() { (agreements(&pairs)) }
            (times_table(&merged, ["Devices", "devices", "Device and driver"], |record| drawer(record.drawer.as_ref())))
            (times_table(&merged, ["Work", "work", "Work and host"], work_and_host))
            (contact_sheet(&merged, folder))
        }
        footer { p { "Written by " (escaped(&crate::machine::program())) "." } }
    };
    page(&format!("echolume batch: {verdict}"), STYLE, &body)
}

/// The dates of the first and of the last try, UTC.
fn dates(records: &[Record]) -> Option<(String, String)> {
    let days = || records.iter().filter_map(|record| record.date.split('T').next()).filter(|day| !day.is_empty());
    days().min().zip(days().max()).map(|(first, last)| (escaped(first), escaped(last)))
}

fn failed(merged: &Merged) -> Markup {
    let mut failures: Vec<&Record> = merged.failures().collect();
    failures.sort_by_key(|record| (record.error.clone(), record.line));
    let left_out = failures.len().saturating_sub(MAX_FAILURES);
    html! {
        section id="failures" {
            h2 { "Failures" }
            table {
                thead { tr { th { "Line" } th { "Recording" } th { "Work" } th { "Kind" } th { "What failed" } } }
                tbody {
                    @for record in failures.iter().take(MAX_FAILURES) {
                        tr {
                            td { (record.line) }
                            td class="name" { (escaped(&record.input)) }
                            td { (escaped(&record.work)) }
                            td { span class="badge failed" { (kind_of(record.status)) } }
                            td { (escaped(record.error.as_deref().unwrap_or("no reason is known"))) }
                        }
                    }
                }
            }
            @if left_out > 0 { p class="dim" { (left_out) " more are in the results." } }
        }
    }
}

fn kind_of(status: Status) -> &'static str {
    match status {
        Status::Done => "done",
        Status::Bad => "bad input",
        Status::Failed => "failed",
        Status::Lost => "device lost",
    }
}

fn agreements(pairs: &BTreeMap<(Class, Option<Drawer>, Option<Drawer>), Pair>) -> Markup {
    html! {
        section id="agreement" {
            h2 { "The same unit on several devices" }
            table {
                thead { tr { th { "Kept" } th { "Compared" } th { "Allowed" } th { "Units" } th { "Same bytes" } th { "Do not agree" } } }
                tbody {
                    @for ((class, a, b), pair) in pairs {
                        tr {
                            td { (drawer(a.as_ref())) }
                            td { (drawer(b.as_ref())) }
                            td { (class.sentence()) }
                            td class="value" { (pair.compared) }
                            td class="value" { (pair.same_bytes) }
                            td class="value" { (pair.faults.len()) }
                        }
                    }
                }
            }
            @for (input, work, fault) in pairs.values().flat_map(|pair| &pair.faults).take(MAX_FAILURES) {
                p { (escaped(input)) ", " (escaped(work)) ": " span class="fault" { (escaped(fault)) } }
            }
        }
    }
}

fn drawer(drawer: Option<&Drawer>) -> String {
    match drawer {
        None => "no device".into(),
        Some(there) => escaped(&format!("{}, {}", there.device, there.driver)),
    }
}

/// Seconds by stage of a set of units.
#[derive(Default)]
struct Times {
    /// Of each unit; the others are sums.
    work: Vec<f64>,
    read: f64,
    wait: f64,
    write: f64,
}

impl Times {
    fn add(&mut self, record: &Record) {
        self.work.push(record.seconds.work);
        self.read += record.seconds.read;
        self.wait += record.seconds.wait;
        self.write += record.seconds.write;
    }

    /// Median time of the work of a unit, s.
    fn median(&self) -> f64 {
        quantile_of(self.work.iter().copied(), 0.5).unwrap_or(0.0)
    }

    fn mean(&self, total: f64) -> f64 {
        total / self.work.len().max(1) as f64
    }
}

/// The times of the units that are done, in groups of the same name. `first`: heading of the names.
fn times_table(merged: &Merged, [title, id, first]: [&str; 3], name: impl Fn(&Record) -> String) -> Markup {
    let mut times: BTreeMap<String, Times> = BTreeMap::new();
    merged.done().for_each(|record| times.entry(name(record)).or_default().add(record));
    html! {
        section id=(id) {
            h2 { (title) }
            p class="dim" { "Seconds a unit. Reading overlaps with the work on the unit before; what is left of it is the wait." }
            table {
                thead { tr { th { (first) } th { "Units" } th { "Work, median" } th { "Work, mean" } th { "Read" } th { "Wait" } th { "Write" } } }
                tbody {
                    @for (name, times) in &times {
                        tr {
                            td class="name" { (name) }
                            td class="value" { (times.work.len()) }
                            @for seconds in [times.median(), times.mean(times.work.iter().sum()), times.mean(times.read), times.mean(times.wait), times.mean(times.write)] {
                                td class="value" { (format!("{seconds:.4}")) }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn work_and_host(record: &Record) -> String {
    let host = if record.host.is_empty() { "unknown host" } else { &record.host };
    format!("{}, {}", escaped(&record.work), escaped(host))
}

fn contact_sheet(merged: &Merged, folder: &Path) -> Markup {
    let (mut shown, mut bytes, mut left_out) = (Vec::new(), 0, 0);
    for record in merged.done() {
        for output in record.outputs.iter().filter(|output| output.file.ends_with(".png")) {
            if shown.len() >= MAX_THUMBNAILS || bytes > MAX_BYTES {
                left_out += 1;
                continue;
            }
            let small = Picture::load(&folder.join(&output.file)).and_then(|picture| thumbnail(&picture).png());
            let picture = small.map(|png| format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png)));
            bytes += picture.as_ref().map_or(0, String::len);
            shown.push((record, output, picture));
        }
    }
    html! {
        @if !shown.is_empty() {
            section id="pictures" {
                h2 { "Pictures" }
                div class="sheet" {
                    @for (record, output, picture) in &shown {
                        figure {
                            @match picture {
                                Ok(uri) => { img alt=(escaped(&record.input)) src=(uri); }
                                Err(fault) => { p class="fault" { (escaped(fault)) } }
                            }
                            figcaption title=(escaped(&output.file)) { (record.line) ": " (escaped(&name_of(&record.input))) }
                        }
                    }
                }
                @if left_out > 0 { p class="dim" { (left_out) " pictures are left out, the page is full." } }
            }
        }
    }
}

fn name_of(input: &str) -> String {
    Path::new(input).file_name().map_or(input.into(), |name| name.to_string_lossy().into_owned())
}

/// A picture reduced to at most [`THUMBNAIL`] pixels an edge, by box filtering.
fn thumbnail(picture: &Picture) -> Picture {
    let step = picture.width.max(picture.height).div_ceil(THUMBNAIL).max(1);
    if step == 1 {
        return picture.clone();
    }
    let (width, height) = (picture.width.div_ceil(step), picture.height.div_ceil(step));
    let mut rgba = Vec::with_capacity(4 * (width * height) as usize);
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let (mut sums, mut count) = ([0u32; 4], 0);
        for v in y * step..((y + 1) * step).min(picture.height) {
            for u in x * step..((x + 1) * step).min(picture.width) {
                let at = 4 * (v as usize * picture.width as usize + u as usize);
                for (sum, value) in sums.iter_mut().zip(&picture.rgba[at..at + 4]) {
                    *sum += u32::from(*value);
                }
                count += 1;
            }
        }
        rgba.extend(sums.map(|sum| (sum / count.max(1)) as u8));
    }
    Picture { width, height, rgba }
}
