//! The worksheet as one page of HTML, which holds its pictures and needs no other file.

use super::{Entry, FOOTER, Row, Sheet, changed};
use crate::html_page::page;
use crate::picture::Picture;
use crate::scene::Settings;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use maud::{Markup, html};
use std::rc::Rc;

const STYLE: &str = include_str!("style.css");

/// The worksheet as a page of HTML. `settings`: those of the workspace. `pictures`: one for each of `sheet.measurements`, in their order.
///
/// # Errors
/// One line: a picture cannot be encoded.
pub fn write(sheet: &Sheet, settings: &Settings, pictures: &[Rc<Picture>]) -> Result<String, String> {
    let volumes = sheet.recording.volumes;
    let mut blocks = Vec::new();
    for (entry, picture) in sheet.measurements.iter().zip(pictures) {
        let png = format!("data:image/png;base64,{}", BASE64_STANDARD.encode(picture.png()?));
        blocks.push(block(entry, volumes, &png, picture));
    }
    let body = html! {
        header { h1 { "Measurements" } }
        (rows(&sheet.head()))
        table.summary {
            thead { tr { th { "No." } th { "Measurement" } th.value { "Result" } } }
            tbody {
                @for entry in &sheet.measurements {
                    tr { td { (entry.number) } td { (entry.title()) } td.value { (entry.result()) } }
                }
            }
        }
        main { @for block in &blocks { (block) } }
        section.settings {
            h2 { "Settings that are not their defaults" }
            @for line in changed(settings) { p { (line) } }
        }
        footer { (FOOTER) }
    };
    Ok(page(&format!("Measurements, {}", sheet.recording.name), STYLE, &body))
}

fn block(entry: &Entry, volumes: usize, png: &str, picture: &Picture) -> Markup {
    html! {
        section.measurement {
            h2 { span.number { (entry.number) } (entry.title()) span.result { (entry.result()) } }
            div {
                img src=(png) width=(picture.width) height=(picture.height) alt=(entry.picture.caption);
                (rows(&entry.rows(volumes)))
            }
        }
    }
}

fn rows(rows: &[Row]) -> Markup {
    html! { dl { @for (label, words) in rows { div { dt { (label) } dd { (words) } } } } }
}
