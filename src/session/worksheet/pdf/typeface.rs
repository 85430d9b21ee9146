//! The typeface of a PDF: widths, lines that fit a column, and the part of the file that its text needs.

use ab_glyph::{Font, FontRef};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{CidFontType, FontFlags, SystemInfo, UnicodeCmap};
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, Str};
use std::collections::BTreeMap;
use std::io::Write;
use subsetter::GlyphRemapper;

/// Name of the part: six letters tell it from the whole.
const NAME: Name = Name(b"ECHOLU+DejaVuSansCondensed");
const SYSTEM: SystemInfo = SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };

pub(super) struct Typeface {
    font: FontRef<'static>,
    /// Units of its lengths in the size of the text.
    units: f32,
    /// The glyphs that are used, by their number in the part.
    part: GlyphRemapper,
    used: BTreeMap<u16, char>,
}

impl Typeface {
    /// # Errors
    /// One line: the typeface that is built in cannot be read.
    pub(super) fn new() -> Result<Typeface, String> {
        let font = FontRef::try_from_slice(dejavu::sans_condensed::regular()).map_err(|e| e.to_string())?;
        let units = font.units_per_em().ok_or("the typeface states no size")?;
        Ok(Typeface { font, units, part: GlyphRemapper::new(), used: BTreeMap::new() })
    }

    /// The numbers of the glyphs of a text, as a PDF shows them. A character that the typeface lacks is its sign for that.
    pub(super) fn encoded(&mut self, text: &str) -> Vec<u8> {
        let mut encoded = Vec::new();
        for c in text.chars() {
            let glyph = self.part.remap(self.font.glyph_id(c).0);
            self.used.entry(glyph).or_insert(c);
            encoded.extend(glyph.to_be_bytes());
        }
        encoded
    }

    /// Width of a text, points.
    pub(super) fn width(&self, text: &str, size: f32) -> f32 {
        let units: f32 = text.chars().map(|c| self.font.h_advance_unscaled(self.font.glyph_id(c))).sum();
        units / self.units * size
    }

    /// A text in lines of a width, at least one. A word that is wider than a line is cut.
    pub(super) fn wrapped(&self, text: &str, size: f32, width: f32) -> Vec<String> {
        let mut lines = vec![String::new()];
        for word in text.split(' ') {
            let mut line = lines.pop().unwrap_or_default();
            let with = if line.is_empty() { word.to_string() } else { format!("{line} {word}") };
            if self.width(&with, size) <= width {
                lines.push(with);
                continue;
            }
            if !line.is_empty() {
                lines.push(std::mem::take(&mut line));
            }
            for c in word.chars() {
                if self.width(&line, size) + self.width(c.encode_utf8(&mut [0; 4]), size) > width && !line.is_empty() {
                    lines.push(std::mem::take(&mut line));
                }
                line.push(c);
            }
            lines.push(line);
        }
        lines
    }

    /// Writes the part that was used. `id` gives new references.
    ///
    /// # Errors
    /// One line: the typeface that is built in cannot be divided.
    pub(super) fn write(&self, pdf: &mut Pdf, font: Ref, mut id: impl FnMut() -> Ref) -> Result<(), String> {
        let part = subsetter::subset(dejavu::sans_condensed::regular(), 0, &self.part).map_err(|e| e.to_string())?;
        let [cid, descriptor, file, unicode] = [id(), id(), id(), id()];
        pdf.type0_font(font)
            .base_font(NAME)
            .encoding_predefined(Name(b"Identity-H"))
            .descendant_font(cid)
            .to_unicode(unicode);
        let scaled = |units: f32| units / self.units * 1000.0;
        let mut object = pdf.cid_font(cid);
        object.subtype(CidFontType::Type2).base_font(NAME).system_info(SYSTEM).font_descriptor(descriptor);
        object.default_width(0.0).cid_to_gid_map_predefined(Name(b"Identity"));
        let advance = |old| scaled(self.font.h_advance_unscaled(ab_glyph::GlyphId(old)));
        object.widths().consecutive(0, self.part.remapped_gids().map(advance));
        object.finish();
        let (ascent, descent) = (scaled(self.font.ascent_unscaled()), scaled(self.font.descent_unscaled()));
        let mut object = pdf.font_descriptor(descriptor);
        object.name(NAME).flags(FontFlags::NON_SYMBOLIC).bbox(Rect::new(-1000.0, descent, 2000.0, ascent));
        object.italic_angle(0.0).ascent(ascent).descent(descent).cap_height(729.0).stem_v(80.0).font_file2(file);
        object.finish();
        let length = part.len() as i32;
        let part = compressed(&part)?;
        pdf.stream(file, &part).filter(Filter::FlateDecode).pair(Name(b"Length1"), length);
        let mut map = UnicodeCmap::new(Name(b"Custom"), SYSTEM);
        self.used.iter().for_each(|(glyph, c)| map.pair(*glyph, *c));
        pdf.stream(unicode, &compressed(&map.finish())?).filter(Filter::FlateDecode);
        Ok(())
    }
}

/// Bytes in the compression of zlib.
pub(super) fn compressed(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).map_err(|e| e.to_string())
}
