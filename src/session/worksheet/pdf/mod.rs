//! The worksheet as PDF: pages of A4 with text that can be searched, and pictures without loss.

mod typeface;

use super::{Entry, FOOTER, Row, Sheet, changed};
use crate::picture::Picture;
use crate::scene::Settings;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str, TextStr};
use std::rc::Rc;
use typeface::{Typeface, compressed};

/// A4 in points, and its margins.
const PAGE: [f32; 2] = [595.28, 841.89];
const SIDE: f32 = 48.0;
const TOP: f32 = 52.0;
const BOTTOM: f32 = 62.0;
const WIDTH: f32 = PAGE[0] - 2.0 * SIDE;
/// Largest picture of a block, and the gap to the table beside it.
const PICTURE: [f32; 2] = [246.0, 250.0];
const GAP: f32 = 18.0;
/// Width of labels.
const LABEL: f32 = 62.0;
/// Sizes of text.
const TITLE: f32 = 22.0;
const HEADING: f32 = 12.0;
const BODY: f32 = 8.5;
const SMALL: f32 = 7.0;
/// Distance of lines as a share of the text's size.
const LEADING: f32 = 1.36;

type Colour = [f32; 3];
const INK: Colour = [0.10, 0.12, 0.14];
const DIM: Colour = [0.36, 0.41, 0.43];
const RULE: Colour = [0.84, 0.86, 0.87];

/// The worksheet as the bytes of a PDF file. `settings`: those of the workspace. `pictures`: one for each of `sheet.measurements`, in their order.
///
/// # Errors
/// One line: the typeface that is built in cannot be read, or compression failed.
pub fn write(sheet: &Sheet, settings: &Settings, pictures: &[Rc<Picture>]) -> Result<Vec<u8>, String> {
    let mut report = Report { typeface: Typeface::new()?, pages: vec![Content::new()], down: TOP, images: Vec::new() };
    report.head(sheet);
    for (entry, picture) in sheet.measurements.iter().zip(pictures) {
        report.block(entry, sheet.recording.volumes, picture);
    }
    report.settings(settings);
    report.finish(sheet)
}

/// The pages so far. Lengths are points, down from the top of a page.
struct Report {
    typeface: Typeface,
    pages: Vec<Content>,
    /// Where the next thing begins.
    down: f32,
    /// The pictures; the same one once.
    images: Vec<Rc<Picture>>,
}

impl Report {
    /// Begins a page if less than this is left of the last one.
    fn need(&mut self, height: f32) {
        if self.down + height > PAGE[1] - BOTTOM && self.down > TOP {
            self.pages.push(Content::new());
            self.down = TOP;
        }
    }

    /// The last page: there always is one.
    fn page(&mut self) -> &mut Content {
        let last = self.pages.len() - 1;
        &mut self.pages[last]
    }

    /// Writes a line of text, whose base line is `down` points from the top.
    fn text(&mut self, [x, down]: [f32; 2], size: f32, [r, g, b]: Colour, text: &str) {
        let glyphs = self.typeface.encoded(text);
        let page = self.page();
        page.begin_text().set_fill_rgb(r, g, b).set_font(Name(b"F"), size);
        page.next_line(x, PAGE[1] - down).show(Str(&glyphs)).end_text();
    }

    /// The same, to the left of the right margin.
    fn text_right(&mut self, down: f32, size: f32, colour: Colour, text: &str) {
        let x = PAGE[0] - SIDE - self.typeface.width(text, size);
        self.text([x, down], size, colour, text);
    }

    /// A line across the page.
    fn rule(&mut self, down: f32, width: f32, [r, g, b]: Colour) {
        let y = PAGE[1] - down;
        let page = self.page();
        page.set_stroke_rgb(r, g, b).set_line_width(width).move_to(SIDE, y).line_to(PAGE[0] - SIDE, y).stroke();
    }

    /// Labels with what stands beside them, in lines of a column.
    fn lines(&self, rows: &[Row], width: f32) -> Vec<Row> {
        let mut lines = Vec::new();
        for (label, words) in rows {
            let labels = self.typeface.wrapped(label, BODY, LABEL - 4.0);
            let words = self.typeface.wrapped(words, BODY, width - LABEL);
            let line = |all: &[String], n: usize| all.get(n).cloned().unwrap_or_default();
            lines.extend((0..labels.len().max(words.len())).map(|n| (line(&labels, n), line(&words, n))));
        }
        lines
    }

    /// Writes such lines, the first one below `down`, and returns where they end.
    fn column(&mut self, x: f32, mut down: f32, lines: &[Row]) -> f32 {
        for (label, words) in lines {
            self.text([x, down + BODY], BODY, DIM, label);
            self.text([x + LABEL, down + BODY], BODY, INK, words);
            down += BODY * LEADING;
        }
        down
    }

    /// Title, what is stated of the whole, and all results.
    fn head(&mut self, sheet: &Sheet) {
        self.text([SIDE, TOP + TITLE * 0.8], TITLE, INK, "Measurements");
        let lines = self.lines(&sheet.head(), WIDTH);
        self.down = self.column(SIDE, TOP + TITLE * 1.7, &lines) + 14.0;
        self.text([SIDE, self.down + BODY], BODY, DIM, "No.");
        self.text([SIDE + 30.0, self.down + BODY], BODY, DIM, "Measurement");
        self.text_right(self.down + BODY, BODY, DIM, "Result");
        self.down += BODY * 2.0;
        for entry in &sheet.measurements {
            let size = BODY + 1.0;
            let room = WIDTH - 45.0 - self.typeface.width(&entry.result(), size);
            let lines = self.typeface.wrapped(&entry.title(), size, room);
            let height = 5.0 + lines.len() as f32 * size * LEADING;
            self.need(height);
            self.rule(self.down, 0.5, RULE);
            self.titled(entry, &lines, 30.0, self.down + 12.5, size);
            self.down += height;
        }
        self.rule(self.down, 0.5, RULE);
        self.down += 26.0;
    }

    /// Number, title in lines that begin `inset` points behind the number's, and result of a measurement.
    fn titled(&mut self, entry: &Entry, lines: &[String], inset: f32, mut down: f32, size: f32) {
        self.text([SIDE, down], size, DIM, &entry.number.to_string());
        self.text_right(down, size, INK, &entry.result());
        for line in lines {
            self.text([SIDE + inset, down], size, INK, line);
            down += size * LEADING;
        }
    }

    /// A measurement: its picture, and beside it the table.
    fn block(&mut self, entry: &Entry, volumes: usize, picture: &Rc<Picture>) {
        let [width, height] = [picture.width, picture.height].map(|n| n.max(1) as f32);
        let scale = (PICTURE[0] / width).min(PICTURE[1] / height);
        let shown = [width * scale, height * scale];
        let rows = self.lines(&entry.rows(volumes), WIDTH - shown[0] - GAP);
        let inset = self.typeface.width(&entry.number.to_string(), HEADING) + 8.0;
        let room = WIDTH - inset - 14.0 - self.typeface.width(&entry.result(), HEADING);
        let title = self.typeface.wrapped(&entry.title(), HEADING, room);
        let heading = 10.0 + title.len() as f32 * HEADING * LEADING;
        let body = shown[1].max(rows.len() as f32 * BODY * LEADING);
        self.need(heading + body);
        self.rule(self.down, 1.0, INK);
        self.titled(entry, &title, inset, self.down + 16.0, HEADING);
        let below = self.down + heading;
        self.image(picture, [SIDE, below], shown);
        self.column(SIDE + shown[0] + GAP, below - 1.0, &rows);
        self.down = below + body + 22.0;
    }

    fn image(&mut self, picture: &Rc<Picture>, [x, down]: [f32; 2], [width, height]: [f32; 2]) {
        let same = self.images.iter().position(|image| Rc::ptr_eq(image, picture));
        let number = same.unwrap_or(self.images.len());
        if same.is_none() {
            self.images.push(picture.clone());
        }
        let page = self.page();
        page.save_state().transform([width, 0.0, 0.0, height, x, PAGE[1] - down - height]);
        page.x_object(Name(image_name(number).as_bytes())).restore_state();
    }

    fn settings(&mut self, settings: &Settings) {
        self.need(60.0);
        self.rule(self.down, 1.0, INK);
        self.text([SIDE, self.down + 16.0], HEADING, INK, "Settings that are not their defaults");
        self.down += 26.0;
        for setting in changed(settings) {
            for line in self.typeface.wrapped(&setting, SMALL, WIDTH) {
                self.need(SMALL * LEADING);
                self.text([SIDE, self.down + SMALL], SMALL, DIM, &line);
                self.down += SMALL * LEADING;
            }
        }
    }

    /// Writes what stands at the foot of every page, and the file.
    fn finish(mut self, sheet: &Sheet) -> Result<Vec<u8>, String> {
        let (count, mut pages) = (self.pages.len(), Vec::new());
        for (n, page) in std::mem::take(&mut self.pages).into_iter().enumerate() {
            self.pages.push(page);
            let down = PAGE[1] - 36.0;
            self.rule(down - 14.0, 0.5, RULE);
            self.text([SIDE, down], BODY, INK, FOOTER);
            self.text_right(down, BODY, DIM, &format!("Page {} of {count}", n + 1));
            pages.extend(self.pages.pop());
        }
        let mut next = 0;
        let mut id = || {
            next += 1;
            Ref::new(next)
        };
        let [catalog, tree, info, font] = [id(), id(), id(), id()];
        let (mut pdf, images) = (Pdf::new(), self.images.iter().map(|_| id()).collect::<Vec<Ref>>());
        let ids: Vec<[Ref; 2]> = pages.iter().map(|_| [id(), id()]).collect();
        let mut about = pdf.catalog(catalog);
        about.pages(tree).lang(TextStr("en"));
        about.viewer_preferences().display_doc_title(true);
        about.finish();
        let (title, program) =
            (format!("Measurements, {}", sheet.recording.name), format!("Echolume {}", sheet.program));
        pdf.document_info(info).title(TextStr(&title)).creator(TextStr(&program)).subject(TextStr(FOOTER));
        pdf.pages(tree).kids(ids.iter().map(|[page, _]| *page)).count(count as i32);
        for ([page, content], drawn) in ids.iter().zip(pages) {
            let mut object = pdf.page(*page);
            object.media_box(Rect::new(0.0, 0.0, PAGE[0], PAGE[1])).parent(tree).contents(*content);
            let mut resources = object.resources();
            resources.fonts().pair(Name(b"F"), font);
            let mut named = resources.x_objects();
            for (n, image) in images.iter().enumerate() {
                named.pair(Name(image_name(n).as_bytes()), *image);
            }
            named.finish();
            resources.finish();
            object.finish();
            pdf.stream(*content, &compressed(&drawn.finish())?).filter(Filter::FlateDecode);
        }
        for (image, picture) in images.iter().zip(&self.images) {
            let rgb: Vec<u8> = picture.rgba.chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect();
            let rgb = compressed(&rgb)?;
            let mut object = pdf.image_xobject(*image, &rgb);
            object.filter(Filter::FlateDecode);
            object.width(picture.width as i32).height(picture.height as i32);
            object.bits_per_component(8).interpolate(false).color_space().device_rgb();
        }
        self.typeface.write(&mut pdf, font, id)?;
        Ok(pdf.finish())
    }
}

fn image_name(number: usize) -> String {
    format!("I{number}")
}
