//! The frame of every HTML page that the program writes: self-contained, without network, script or other file.

use crate::text::escaped;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The style of all pages.
const STYLE: &str = include_str!("style.css");

/// A complete HTML page as text. `title`: any text; it is escaped. `style`: CSS in addition to the common one. Pictures may only be `data:` URIs: a
/// browser that opens the page loads nothing.
pub fn page(title: &str, style: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'";
                meta name="color-scheme" content="light dark";
                link rel="icon" href="data:,";
                title { (escaped(title)) }
                style { (PreEscaped(STYLE)) (PreEscaped(style)) }
            }
            body { (body) }
        }
    };
    page.into_string()
}
