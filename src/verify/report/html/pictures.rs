//! Pictures within the page, as many as it can carry.

use crate::picture::Picture;
use crate::text::escaped;
use crate::verify::report::Shown;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use maud::{Markup, html};

/// Sets of three pictures in one page.
pub const MOST_SETS: usize = 300;
/// Bytes of all pictures in one page, encoded.
pub const MOST_BYTES: usize = 24 << 20;

/// Pictures narrower than this are shown larger than they are, every pixel as a square. Pixels.
const SMALL: u32 = 320;

/// What was put into the page so far.
#[derive(Default)]
pub struct Album {
    sets: usize,
    bytes: usize,
    left_out: usize,
}

impl Album {
    /// Actual, expected and difference side by side, or a line that says why not.
    pub fn set(&mut self, shown: &Shown) -> Markup {
        let pictures = [
            ("actual".to_string(), &shown.actual),
            ("expected".to_string(), &shown.expected),
            (format!("difference, {} times", shown.gain), &shown.difference),
        ];
        let what = escaped(&shown.what);
        if self.sets >= MOST_SETS {
            return self.leave_out(&what);
        }
        let encoded: Result<Vec<String>, String> = pictures.iter().map(|(_, picture)| data_uri(picture)).collect();
        let encoded = match encoded {
            Ok(encoded) => encoded,
            Err(fault) => return html! { p class="dim" { (what) ": the pictures cannot be shown: " (fault) } },
        };
        let bytes = self.bytes + encoded.iter().map(String::len).sum::<usize>();
        if bytes > MOST_BYTES {
            return self.leave_out(&what);
        }
        (self.sets, self.bytes) = (self.sets + 1, bytes);
        html! {
            figure class="set" {
                figcaption { (what) " " span class="dim" { (shown.actual.width) " x " (shown.actual.height) } }
                div class="three" {
                    @for ((name, picture), uri) in pictures.iter().zip(&encoded) {
                        div {
                            img class=[(picture.width < SMALL).then_some("small")] width=(picture.width) height=(picture.height)
                                alt={ (what) ", " (name) } src=(uri);
                            span { (name) }
                        }
                    }
                }
            }
        }
    }

    fn leave_out(&mut self, what: &str) -> Markup {
        self.left_out += 1;
        html! { p class="dim" { (what) ": pictures left out, the page is full" } }
    }

    /// A sentence where pictures were left out.
    pub fn note(&self) -> Option<String> {
        (self.left_out > 0).then(|| {
            format!(
                "{} of {} sets of pictures are left out: a page holds {MOST_SETS} sets and {} MiB.",
                self.left_out,
                self.left_out + self.sets,
                MOST_BYTES >> 20
            )
        })
    }
}

fn data_uri(picture: &Picture) -> Result<String, String> {
    Ok(format!("data:image/png;base64,{}", BASE64_STANDARD.encode(picture.png()?)))
}
