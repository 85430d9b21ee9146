//! DICOM as scanners and archives leave it: files that are built here, each with one thing that the standard allows but few write, or that
//! it forbids but many write. What a file states is used, refused in one line, or said to be otherwise in one line.

use crate::common::files::{Folder, data};
use crate::common::program;
use echolume::Source;
use echolume::low_level::probe::Geometry;
use echolume::low_level::source::{Description, OpenOptions, Recording, description};
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const LITTLE: &str = "1.2.840.10008.1.2.1";
const BIG: &str = "1.2.840.10008.1.2.2";
const JPEG: &str = "1.2.840.10008.1.2.4.50";
const JPEG_2000: &str = "1.2.840.10008.1.2.4.90";
const RLE: &str = "1.2.840.10008.1.2.5";

/// A file that is being built: elements by tag, with their type and value.
#[derive(Clone)]
struct File {
    syntax: &'static str,
    elements: BTreeMap<u32, ([u8; 2], Vec<u8>)>,
    /// The pixel data are items: the offsets of frames, then the fragments.
    fragments: Option<Vec<Vec<u8>>>,
}

impl File {
    /// Pictures of 8 bits and one number for each pixel, 0.2 mm.
    fn new(syntax: &'static str, columns: u16, rows: u16) -> File {
        let file = File { syntax, elements: BTreeMap::new(), fragments: None };
        let file = file.text(0x0008_0016, "1.2.840.10008.5.1.4.1.1.3.1").text(0x0008_0060, "US");
        let file = file.words(0x0028_0002, &[1]).text(0x0028_0004, "MONOCHROME2").text(0x0028_0030, "0.2\\0.2");
        file.words(0x0028_0010, &[rows]).words(0x0028_0011, &[columns]).bits(8, 8).words(0x0028_0103, &[0])
    }

    fn bytes(mut self, tag: u32, vr: &[u8; 2], bytes: &[u8]) -> File {
        let mut bytes = bytes.to_vec();
        if bytes.len() % 2 == 1 {
            bytes.push(if matches!(vr, b"OB" | b"OW") { 0 } else { b' ' });
        }
        self.elements.insert(tag, (*vr, bytes));
        self
    }

    fn text(self, tag: u32, text: &str) -> File {
        self.bytes(tag, b"CS", text.as_bytes())
    }

    fn packed_words(&self, words: &[u16]) -> Vec<u8> {
        let one = |word: &u16| if self.syntax == BIG { word.to_be_bytes() } else { word.to_le_bytes() };
        words.iter().flat_map(one).collect()
    }

    fn words(self, tag: u32, words: &[u16]) -> File {
        let bytes = self.packed_words(words);
        self.bytes(tag, b"US", &bytes)
    }

    fn table(self, tag: u32, words: &[u16]) -> File {
        let bytes = self.packed_words(words);
        self.bytes(tag, b"OW", &bytes)
    }

    fn bits(self, allocated: u16, stored: u16) -> File {
        self.words(0x0028_0100, &[allocated]).words(0x0028_0101, &[stored]).words(0x0028_0102, &[stored - 1])
    }

    fn frames(self, count: &str) -> File {
        self.text(0x0028_0008, count)
    }

    fn colours(self, photometric: &str, planar: u16) -> File {
        self.words(0x0028_0002, &[3]).text(0x0028_0004, photometric).words(0x0028_0006, &[planar])
    }

    fn pixels(self, bytes: &[u8]) -> File {
        self.bytes(0x7fe0_0010, b"OB", bytes)
    }

    /// A palette for all three colours: entries, first number, bits of an entry.
    fn palette(self, about: [u16; 3]) -> File {
        let file = self.text(0x0028_0004, "PALETTE COLOR");
        (0x0028_1101..=0x0028_1103).fold(file, |file, tag| file.words(tag, &about))
    }

    /// The entries of a palette: the same for each colour, so that an entry is its luminance.
    fn entries(self, first_tag: u32, words: &[u16]) -> File {
        (first_tag..first_tag + 3).fold(self, |file, tag| file.table(tag, words))
    }

    fn fragments(mut self, offsets: &[u32], fragments: &[Vec<u8>]) -> File {
        let table = offsets.iter().flat_map(|offset| offset.to_le_bytes()).collect();
        self.fragments = Some([vec![table], fragments.to_vec()].concat());
        self
    }

    fn built(&self) -> Vec<u8> {
        let class = b"1.2.840.10008.5.1.4.1.1.3.1\0";
        let syntax = format!("{}{}", self.syntax, if self.syntax.len() % 2 == 1 { "\0" } else { "" });
        let text = |element: u8, text: &[u8]| [&[2, 0, element, 0, b'U', b'I', text.len() as u8, 0], text].concat();
        let meta = [text(2, class), text(16, syntax.as_bytes())].concat();
        let length = [&[2, 0, 0, 0, b'U', b'L', 4, 0][..], &(meta.len() as u32).to_le_bytes()].concat();
        let mut out = [&[0; 128][..], b"DICM", &length, &meta].concat();
        out.extend(elements(&self.elements, self.syntax == BIG));
        if let Some(items) = &self.fragments {
            out.extend([0xe0, 0x7f, 0x10, 0, b'O', b'B', 0, 0, 0xff, 0xff, 0xff, 0xff]);
            for item in items {
                out.extend([&[0xfe, 0xff, 0, 0xe0][..], &(item.len() as u32).to_le_bytes(), item].concat());
            }
            out.extend([0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
        }
        out
    }

    fn written(&self, folder: &Folder) -> PathBuf {
        folder.write("file.dcm", self.built()).into()
    }
}

fn elements(elements: &BTreeMap<u32, ([u8; 2], Vec<u8>)>, big: bool) -> Vec<u8> {
    let short = |n: u32| if big { (n as u16).to_be_bytes() } else { (n as u16).to_le_bytes() };
    let mut out = Vec::new();
    for (tag, (vr, value)) in elements {
        out.extend([short(tag >> 16), short(tag & 0xffff), *vr].concat());
        let length = value.len() as u32;
        match vr {
            b"OB" | b"OW" | b"OV" | b"SQ" => {
                let length = if big { length.to_be_bytes() } else { length.to_le_bytes() };
                out.extend([&[0, 0][..], &length].concat());
            }
            _ => out.extend(short(length)),
        }
        out.extend(value);
    }
    out
}

/// What is read: the frames, their times, and the lines that warn.
struct Got {
    frames: Vec<Vec<u8>>,
    times: Vec<f64>,
    warnings: Vec<String>,
    /// mm.
    spacing: [f64; 3],
}

fn opened(path: &Path) -> Result<Got, String> {
    let mut recording = Recording::open(path, None).map_err(|e| e.to_string())?;
    let is_warning = |row: &(String, String)| row.0 == "warning";
    let warnings = recording.description().into_iter().filter(is_warning).map(|(_, text)| text).collect();
    let Geometry::Cartesian(grid) = recording.geometry(0) else { panic!("a picture") };
    let mut got = Got { frames: Vec::new(), times: Vec::new(), warnings, spacing: grid.spacing };
    while let Some(frame) = recording.next_frame().map_err(|e| e.to_string())? {
        got.times.extend(frame.time);
        got.frames.push(frame.bytes);
    }
    Ok(got)
}

fn read(file: &File) -> Got {
    let folder = Folder::new("dicom-forms");
    opened(&file.written(&folder)).unwrap_or_else(|e| panic!("{e}"))
}

/// The frames of a file that says nothing wrong.
fn plain(file: &File) -> Vec<Vec<u8>> {
    let got = read(file);
    assert!(got.warnings.is_empty(), "{:?}", got.warnings);
    got.frames
}

/// The one warning of a file.
fn warned(file: &File, parts: &[&str]) -> Got {
    let got = read(file);
    assert!(got.warnings.len() == 1 && parts.iter().all(|part| got.warnings[0].contains(part)), "{:?}", got.warnings);
    got
}

fn refused(file: &File, parts: &[&str]) {
    let folder = Folder::new("dicom-forms");
    let error = opened(&file.written(&folder)).err().expect("refused");
    assert!(error.lines().count() == 1 && parts.iter().all(|part| error.contains(part)), "{error}");
}

/// So many different bytes.
fn numbers(count: usize) -> Vec<u8> {
    (0..count).map(|n| (n * 7 + n / 31) as u8).collect()
}

/// JPEG frames of 16 x 8 pixels, each of another grey.
fn jpegs(count: usize) -> Vec<Vec<u8>> {
    let one = |n: usize| {
        let mut out = Vec::new();
        let pixels: Vec<u8> = (0..128).map(|at| (40 * n + at % 16) as u8).collect();
        JpegEncoder::new(&mut out).encode(&pixels, 16, 8, ExtendedColorType::L8).expect("encoded");
        if out.len() % 2 == 1 {
            out.push(0);
        }
        out
    };
    (0..count).map(one).collect()
}

fn pieces(frames: &[Vec<u8>], length: usize) -> Vec<Vec<u8>> {
    frames.iter().flat_map(|frame| frame.chunks(length).map(<[u8]>::to_vec)).collect()
}

/// The offset of each frame as a table states it, if its frames are cut into pieces of `length`.
fn offsets(frames: &[Vec<u8>], length: usize) -> Vec<u32> {
    let bytes = |frame: &Vec<u8>| (frame.len() + 8 * frame.len().div_ceil(length)) as u32;
    (0..frames.len()).map(|n| frames[..n].iter().map(bytes).sum()).collect()
}

/// An RLE frame of bytes, in runs of one byte.
fn rle(bytes: &[u8]) -> Vec<u8> {
    let mut out = [1u32, 64].map(u32::to_le_bytes).concat();
    out.resize(64, 0);
    out.extend(bytes.chunks(128).flat_map(|run| [&[run.len() as u8 - 1][..], run].concat()));
    if out.len() % 2 == 1 {
        out.push(0);
    }
    out
}

#[test]
fn padding_behind_the_end_mark_is_skipped() {
    let bare = jpegs(1);
    let file = File::new(JPEG, 16, 8);
    let expected = plain(&file.clone().fragments(&[], &bare));
    for padding in [&[0, 0][..], &[0xff, 0xff], &[0xff, 0xff, 0xff, 0xff, 0, 0]] {
        let padded = [[&bare[0], padding].concat()];
        assert!(plain(&file.clone().fragments(&[], &padded)) == expected, "{padding:?}");
        assert!(plain(&file.clone().fragments(&[], &pieces(&padded, 60))) == expected, "{padding:?} in fragments");
        let alone = [bare[0].clone(), padding.to_vec()];
        assert!(plain(&file.clone().fragments(&[], &alone)) == expected, "{padding:?} as a fragment");
    }
    let cut = [bare[0][..bare[0].len() / 2 * 2 - 20].to_vec()];
    refused(&file.fragments(&[], &cut), &["frame 0", "end mark is missing"]);
}

#[cfg(feature = "jpeg2000")]
#[test]
fn padding_behind_a_code_stream_of_jpeg_2000_is_skipped() {
    let stored = std::fs::read(data("dicom/image-j2k.dcm")).expect("stored");
    let begin = stored.windows(4).position(|w| w == [0xff, 0x4f, 0xff, 0x51]).expect("a start");
    let end = stored.windows(2).rposition(|w| w == [0xff, 0xd9]).expect("an end") + 2;
    let bare = stored[begin..end].to_vec();
    let file = File::new(JPEG_2000, 7, 6).bits(16, 16);
    let all = |padding: &[u8]| file.clone().fragments(&[], &pieces(&[[&bare[..], padding].concat()], 100));
    let even = if bare.len() % 2 == 1 { &[0][..] } else { &[] };
    let expected = plain(&all(even));
    assert!(plain(&all(&[&[0xff, 0xff], even].concat())) == expected);
    let twice = [bare.clone(), vec![0xff, 0xff], bare.clone()];
    assert_eq!(plain(&file.clone().frames("2").fragments(&[], &twice)), [&expected[..], &expected].concat());
}

#[test]
fn fragments_without_a_table_are_divided_where_code_streams_begin() {
    let frames = jpegs(5);
    let file = File::new(JPEG, 16, 8).frames("5");
    let expected = plain(&file.clone().fragments(&[], &frames));
    assert_eq!(expected.len(), 5);
    assert!(expected.windows(2).all(|pair| pair[0] != pair[1]));
    let cut = pieces(&frames, 100);
    assert!(cut.len() > 5);
    assert!(plain(&file.clone().fragments(&[], &cut)) == expected);
    assert!(plain(&file.clone().fragments(&offsets(&frames, 100), &cut)) == expected);
    // The extended table of offsets.
    let wide: Vec<u8> = offsets(&frames, 100).iter().flat_map(|at| u64::from(*at).to_le_bytes()).collect();
    assert!(plain(&file.clone().bytes(0x7fe0_0001, b"OV", &wide).fragments(&[], &cut)) == expected);
    // A table of another number is not used, and that is said.
    let got = warned(&file.fragments(&[0], &cut), &["table of offsets has 1 entries for 5 frames"]);
    assert!(got.frames == expected);
}

#[test]
fn a_number_of_frames_that_is_not_so_is_said_or_refused() {
    let frames = jpegs(5);
    let file = File::new(JPEG, 16, 8).fragments(&[], &pieces(&frames, 100));
    assert_eq!(warned(&file, &["frames (0028,0008) is missing", "5 frames in the pixel data"]).frames.len(), 5);
    for less in ["1", "3"] {
        let got = warned(&file.clone().frames(less), &["frames (0028,0008) states", "5 frames in the pixel data"]);
        assert_eq!(got.frames.len(), 5);
    }
    refused(&file.clone().frames("7"), &["5 of 7 frames (0028,0008)"]);
    refused(&file.frames("0"), &["frames (0028,0008)"]);
    // RLE: the table says six.
    let frames: Vec<Vec<u8>> = (0..6).map(|n| rle(&numbers(96 + n)[n..])).collect();
    let file = File::new(RLE, 12, 8).fragments(&offsets(&frames, 1000), &frames);
    let got = warned(&file, &["(0028,0008) is missing", "6 frames"]);
    assert!(got.frames.len() == 6 && got.frames[5] == numbers(101)[5..]);
    let file = File::new(RLE, 12, 8).frames("6").fragments(&[], &pieces(&frames, 50));
    assert_eq!(warned(&file, &["RLE are in several fragments"]).frames, got.frames);
}

#[test]
fn pixel_data_of_another_length_are_said_or_refused() {
    let bytes = numbers(3 * 77);
    let file = File::new(LITTLE, 11, 7).pixels(&bytes);
    let got = warned(&file, &["frames (0028,0008) is missing", "3 frames"]);
    assert_eq!(got.frames.concat(), bytes);
    let got = warned(&file.clone().frames("2"), &["longer than stated", "154 bytes", "232 are there"]);
    assert_eq!(got.frames.concat(), bytes[..154]);
    assert_eq!(plain(&file.clone().frames("3")).concat(), bytes, "one byte makes the length even");
    refused(&file.frames("4"), &["cut short"]);
    // The program says it on standard error too.
    let folder = Folder::new("dicom-forms");
    let from = File::new(LITTLE, 11, 7).frames("2").pixels(&bytes).written(&folder);
    let from = from.to_str().expect("a plain name");
    let (code, _, said) = program::run(&["convert", from, &folder.path("out.mha"), "--volume", "0"]);
    assert!(code == Some(0) && said.lines().count() == 1 && said.contains("longer than stated"), "{said}");
}

#[test]
fn bytes_in_words_of_a_big_endian_file_are_exchanged() {
    for (columns, rows) in [(12, 8), (11, 7)] {
        let bytes = numbers(3 * usize::from(columns * rows));
        let mut words = [&bytes[..], &[0]].concat();
        words.truncate(bytes.len().next_multiple_of(2));
        words.chunks_exact_mut(2).for_each(|word| word.swap(0, 1));
        let file = File::new(BIG, columns, rows).frames("3");
        assert_eq!(plain(&file.clone().bytes(0x7fe0_0010, b"OW", &words)).concat(), bytes, "{columns} x {rows}");
        assert_eq!(plain(&file.pixels(&bytes)).concat(), bytes);
        let little = File::new(LITTLE, columns, rows).frames("3").bytes(0x7fe0_0010, b"OW", &bytes);
        assert_eq!(plain(&little).concat(), bytes);
    }
    let rgb = File::new(BIG, 2, 1).colours("RGB", 1).bytes(0x7fe0_0010, b"OW", &[200, 0, 200, 0, 200, 0]);
    assert_eq!(plain(&rgb).concat(), [0, 200]);
}

#[test]
fn palettes_of_all_forms_give_luminances() {
    let file = |bytes: &[u8]| File::new(LITTLE, bytes.len() as u16, 1).pixels(bytes);
    // Entries for 50 .. 52; those around them mean the ends.
    let words = [10 * 257, 20 * 257, 30 * 257];
    let short = file(&[0, 50, 51, 52, 53, 255]).palette([3, 50, 16]);
    assert_eq!(plain(&short.clone().entries(0x0028_1201, &words)).concat(), [10, 10, 20, 30, 30, 30]);
    refused(&short.clone().entries(0x0028_1201, &words[..1]), &["palette (0028,1101)", "1 of 3 entries"]);
    refused(
        &short.clone().entries(0x0028_1201, &words).words(0x0028_1103, &[3, 0, 16]),
        &["differs from that of green"],
    );
    let more = short.clone().entries(0x0028_1201, &[words[0], words[1], words[2], 0]);
    assert_eq!(warned(&more, &["palette has 4 entries, more than the 3"]).frames.concat(), [10, 10, 20, 30, 30, 30]);
    refused(&short, &["palette (0028,1101)"]);
    // Bytes, two in a word; and one in a word.
    let bytes = file(&[0, 1, 2, 3]).palette([4, 0, 8]);
    assert_eq!(plain(&bytes.clone().entries(0x0028_1201, &[0x1405, 0x3c28])).concat(), [5, 20, 40, 60]);
    assert_eq!(plain(&bytes.entries(0x0028_1201, &[5, 20, 40, 60])).concat(), [5, 20, 40, 60]);
    // An odd number of bytes, and one that makes the length even.
    let odd = file(&[0, 1, 2, 3]).palette([3, 0, 8]).entries(0x0028_1201, &[0x1405, 0x0028]);
    assert_eq!(plain(&odd).concat(), [5, 20, 40, 40]);
    // Segments: two entries, a line to 254, and the two again.
    let segments = [0, 2, 0, 2 * 257, 1, 252, 254 * 257, 2, 1, 0, 0];
    let segmented = file(&[0, 1, 2, 100, 253, 254, 255]).palette([256, 0, 16]).entries(0x0028_1221, &segments);
    assert_eq!(plain(&segmented).concat(), [0, 2, 3, 101, 254, 0, 2]);
    refused(&segmented.entries(0x0028_1221, &segments[..5]), &["palette (0028,1101)", "cut short"]);
}

#[test]
fn palettes_of_wide_numbers_give_luminances() {
    // 65536 entries, in both orders of bytes.
    let words: Vec<u16> = (0..=65535).collect();
    for syntax in [LITTLE, BIG] {
        let file = File::new(syntax, 4, 1).bits(16, 16).palette([0, 0, 16]).entries(0x0028_1201, &words);
        assert_eq!(plain(&file.table(0x7fe0_0010, &[0, 0x1234, 0x8000, 0xffff])).concat(), [0, 0x12, 0x80, 0xff]);
    }
    // 12 bits with a sign, the highest four bits of no meaning; the first entry is for -2.
    let signed = File::new(LITTLE, 5, 1).bits(16, 12).words(0x0028_0103, &[1]).palette([4, 0xfffe, 8]);
    let signed = signed.entries(0x0028_1201, &[10, 20, 30, 40]);
    let numbers = [0x0800, 0x0ffe, 0xffff, 0xf000, 0x0002];
    assert_eq!(plain(&signed.table(0x7fe0_0010, &numbers)).concat(), [10, 10, 20, 30, 40]);
    let small = File::new(LITTLE, 4, 1).words(0x0028_0103, &[1]).palette([2, 0xffff, 8]);
    assert_eq!(plain(&small.entries(0x0028_1201, &[10, 20]).pixels(&[0x80, 0xff, 0, 5])).concat(), [10, 10, 20, 20]);
}

#[test]
fn colours_are_read_in_the_order_that_is_stated() {
    // Two frames of 4 x 2 pixels: luminance, or three channels of one value.
    let luma = numbers(16);
    let pairs = |frame: &[u8]| -> Vec<u8> { frame.chunks(2).flat_map(|two| [two[0], two[1], 90, 160]).collect() };
    let pixels = |frame: &[u8]| -> Vec<u8> { frame.iter().flat_map(|y| [*y, 90, 160]).collect() };
    let planes = |frame: &[u8]| [frame, &[90; 8], &[160; 8]].concat();
    let cine = |each: &dyn Fn(&[u8]) -> Vec<u8>| luma.chunks(8).flat_map(each).collect::<Vec<u8>>();
    let file = |photometric, planar, bytes: &[u8]| {
        File::new(LITTLE, 4, 2).frames("2").colours(photometric, planar).pixels(bytes)
    };
    assert_eq!(plain(&file("YBR_FULL", 0, &cine(&pixels))).concat(), luma);
    assert_eq!(plain(&file("YBR_FULL", 1, &cine(&planes))).concat(), luma);
    assert_eq!(plain(&file("YBR_FULL_422", 0, &cine(&pairs))).concat(), luma);
    let grey = cine(&|frame| frame.repeat(3));
    assert_eq!(plain(&file("RGB", 1, &grey)).concat(), luma);
    // What is said of the colours is not so.
    for (planar, bytes) in [(0, cine(&pixels)), (1, cine(&planes))] {
        let got = warned(&file("YBR_FULL_422", planar, &bytes), &["(0028,0004)", "three bytes a pixel are stored"]);
        assert_eq!(got.frames.concat(), luma);
    }
    refused(&file("YBR_FULL_422", 1, &cine(&pairs)), &["planar configuration (0028,0006)"]);
    refused(&file("RGB", 2, &grey), &["planar configuration (0028,0006)", "is 2"]);
    let mut unsaid = file("YBR_FULL", 0, &cine(&pixels));
    unsaid.elements.remove(&0x0028_0006);
    assert_eq!(warned(&unsaid, &["(0028,0006) is missing", "pixel by pixel"]).frames.concat(), luma);
}

#[test]
fn the_frame_increment_pointer_says_which_times_count() {
    let bare = File::new(LITTLE, 4, 2).frames("4").pixels(&numbers(32));
    let single = |file: File| file.text(0x0018_1063, "33.3");
    let vector = |file: File| file.text(0x0018_1065, "0\\40\\80\\80");
    let pointer = |file: File, element: u16| {
        let tag = file.packed_words(&[0x0018, element]);
        file.bytes(0x0028_0009, b"AT", &tag)
    };
    let is = |got: &Got, ms: [f64; 4]| {
        let is_near = |(a, b): (&f64, &f64)| (a - b / 1e3).abs() < 1e-9;
        assert!(got.times.len() == 4 && got.times.iter().zip(&ms).all(is_near), "{:?}", got.times);
    };
    let (even, uneven) = ([0.0, 33.3, 66.6, 99.9], [0.0, 40.0, 120.0, 200.0]);
    let both = vector(single(bare.clone()));
    for (file, times) in [
        (single(bare.clone()), even),
        (pointer(single(bare.clone()), 0x1063), even),
        (pointer(both.clone(), 0x1063), even),
        (pointer(both.clone(), 0x1065), uneven),
        (pointer(vector(bare.clone()), 0x1065), uneven),
    ] {
        let got = read(&file);
        assert!(got.warnings.is_empty(), "{:?}", got.warnings);
        is(&got, times);
    }
    is(&warned(&both, &["frame increment pointer (0028,0009)", "vector (0018,1065) counts"]), uneven);
    let other = pointer(single(bare.clone()), 0x2005);
    is(&warned(&other, &["frame increment pointer (0028,0009)", "frame time (0018,1063) counts"]), even);
    let absent = pointer(vector(bare.clone()), 0x1063);
    is(&warned(&absent, &["frame time (0018,1063) is missing", "vector (0018,1065) counts"]), uneven);
    let few = pointer(bare.clone().text(0x0018_1065, "0\\40"), 0x1065);
    assert!(warned(&few, &["gives no times for 4 frames", "the frames have no times"]).times.is_empty());
    assert!(read(&bare).times.is_empty());
}

#[test]
fn a_region_without_a_scale_leaves_it_to_the_pixel_spacing() {
    let region = |dx: f64, dy: f64, units: u16| {
        let word = |n: u16| (*b"US", n.to_le_bytes().to_vec());
        let long = |n: u32| (*b"UL", n.to_le_bytes().to_vec());
        let real = |v: f64| (*b"FD", v.to_le_bytes().to_vec());
        let all = BTreeMap::from([
            (0x0018_6012, word(1)),
            (0x0018_6014, word(1)),
            (0x0018_6018, long(1)),
            (0x0018_601a, long(1)),
            (0x0018_601c, long(4)),
            (0x0018_601e, long(3)),
            (0x0018_6024, word(units)),
            (0x0018_6026, word(units)),
            (0x0018_602c, real(dx)),
            (0x0018_602e, real(dy)),
        ]);
        let item = elements(&all, false);
        let item = [&[0xfe, 0xff, 0, 0xe0][..], &(item.len() as u32).to_le_bytes(), &item].concat();
        File::new(LITTLE, 6, 5).text(0x0028_0030, "0.5\\0.25").pixels(&numbers(30)).bytes(0x0018_6011, b"SQ", &item)
    };
    let is = |got: &Got, size: usize, spacing: [f64; 2]| {
        assert!(got.frames.concat().len() == size && got.spacing[..2] == spacing, "{:?}", got.spacing);
    };
    let good = read(&region(0.03, 0.02, 3));
    assert!(good.warnings.is_empty(), "{:?}", good.warnings);
    is(&good, 12, [0.3, 0.2]);
    for (dx, dy) in [(0.0, 0.0), (0.03, 0.0), (f64::NAN, 0.02)] {
        let got = warned(&region(dx, dy, 3), &["physical delta (0018,602C)", "pixel spacing (0028,0030) counts"]);
        is(&got, 12, [0.25, 0.5]);
    }
    is(&warned(&region(-0.03, 0.02, 3), &["below 0"]), 12, [0.3, 0.2]);
    is(&warned(&region(0.03, 0.02, 0), &["none of 1 regions (0018,6011)", "(0028,0030) counts"]), 30, [0.25, 0.5]);
    let mut without = region(0.0, 0.0, 3);
    without.elements.remove(&0x0028_0030);
    refused(&without, &["--voxel-spacing"]);
    refused(&region(0.0, 0.0, 3).text(0x0028_0030, "0\\0"), &["--voxel-spacing"]);
}

#[test]
fn elements_that_are_not_used_are_listed_by_their_tags_and_those_that_matter_are_warnings() {
    let folder = Folder::new("dicom-unused");
    let found = |more: &[(u32, &str)]| {
        let file = File::new(LITTLE, 4, 3).pixels(&[9; 12]);
        let file = more.iter().fold(file, |file, (tag, text)| file.text(*tag, text));
        description(&file.written(&folder), OpenOptions::default()).expect("read")
    };
    let warned = |found: &Description| found.rows.iter().filter(|(title, _)| title == "not used").count();
    let base = found(&[]).unused.lines();
    let added =
        |found: &Description| found.unused.lines().into_iter().filter(|line| !base.contains(line)).collect::<Vec<_>>();
    let named = found(&[(0x0010_0010, "Doe^Jane"), (0x0028_1050, "40")]);
    assert_eq!(added(&named), ["(0010,0010)", "WindowCenter (0028,1050)"]);
    assert!(warned(&named) == 0 && named.rows.iter().all(|(_, text)| !text.contains("Doe")), "{:?}", named.rows);
    for (tag, name, neutral, other) in [
        (0x0028_0034, "PixelAspectRatio (0028,0034)", "1\\1", "4\\3"),
        (0x2050_0020, "PresentationLUTShape (2050,0020)", "IDENTITY", "INVERSE"),
        (0x0018_7034, "FieldOfViewHorizontalFlip (0018,7034)", "NO", "YES"),
    ] {
        let (usual, other) = (found(&[(tag, neutral)]), found(&[(tag, other)]));
        assert_eq!((added(&usual), warned(&usual)), (vec![name.to_string()], 0), "{:?}", usual.rows);
        assert_eq!((added(&other), warned(&other)), (vec![name.to_string()], 1), "{:?}", other.rows);
    }
    assert_eq!(warned(&found(&[(0x0018_1164, "0.1\\0.1")])), 1);
}

#[test]
fn numbers_of_32_bits_in_words_of_a_big_endian_file_are_refused() {
    let value = 0x0102_0304u32;
    let file = |syntax| File::new(syntax, 1, 1).bits(32, 32);
    refused(
        &file(BIG).bytes(0x7fe0_0010, b"OW", &value.to_be_bytes()),
        &["(0028,0100)", "big-endian words of 16 bits"],
    );
    let little = file(LITTLE).bytes(0x7fe0_0010, b"OW", &value.to_le_bytes());
    assert_eq!(plain(&little).concat(), (value as f32).to_le_bytes());
}
