//! What a file states is used, refused, or named: every key of the readers' tables, and keys that no table has.

use crate::common::files::{Folder, data};
use crate::common::program::PROGRAM;
use echolume::low_level::source::formats::FORMATS;
use echolume::low_level::source::keys::{Row, Use};
use echolume::low_level::source::{Description, OpenOptions, description};
use flate2::Crc;
use std::path::Path;
use std::process::Command;

fn keys(format: &str) -> Vec<Row> {
    FORMATS.iter().find(|there| there.name == format).expect(format).keys()
}

fn described(path: impl AsRef<Path>) -> Result<Description, String> {
    description(path.as_ref(), OpenOptions::default()).map_err(|e| e.to_string())
}

/// The lines of a description that are warnings of keys.
fn warnings(found: &Description) -> Vec<String> {
    found.rows.iter().filter(|(title, _)| title == "not used").map(|(_, text)| text.clone()).collect()
}

/// A header of text whose samples follow it: fields in order, and what stands between a field and its value.
struct Header {
    first: &'static str,
    fields: &'static [(&'static str, &'static str)],
    between: &'static str,
    last: &'static str,
}

const METAIMAGE: Header = Header {
    first: "",
    fields: &[
        ("ObjectType", "Image"),
        ("NDims", "3"),
        ("DimSize", "2 2 2"),
        ("ElementType", "MET_UCHAR"),
        ("ElementSpacing", "1 1 1"),
        ("BinaryData", "True"),
    ],
    between: " = ",
    last: "ElementDataFile = LOCAL\n",
};
const NRRD: Header = Header {
    first: "NRRD0005\n",
    fields: &[
        ("type", "uint8"),
        ("dimension", "3"),
        ("space", "LPS"),
        ("sizes", "2 2 2"),
        ("space directions", "(1,0,0) (0,1,0) (0,0,1)"),
        ("encoding", "raw"),
    ],
    between: ": ",
    last: "\n",
};

impl Header {
    /// The file with another value of a field, or with one more field.
    fn with(&self, name: &str, value: &str) -> Vec<u8> {
        let mut text = self.first.to_string();
        let is_there = self.fields.iter().any(|(there, _)| *there == name);
        let more = (!is_there).then_some((name, value));
        for (there, usual) in self.fields.iter().copied().chain(more) {
            text += &format!("{there}{}{}\n", self.between, if there == name { value } else { usual });
        }
        let last = if name == "ElementDataFile" { format!("{name} = {value}\n") } else { self.last.into() };
        [text.as_bytes(), last.as_bytes(), &[1, 2, 3, 4, 5, 6, 7, 8]].concat()
    }
}

/// Every key with a value that cannot be: used ones are refused or a warning, others are listed, and a warning where they matter.
fn every_key_has_a_consequence(format: &str, header: &Header) {
    let folder = Folder::new(&format!("unused-{format}"));
    let mut tried = 0;
    for key in keys(format).iter().filter(|key| !key.name.contains(['*', 'N']) || key.name == "NDims") {
        let found = |value: &str| described(folder.write("file", header.with(&key.name, value)));
        let (name, nonsense) = (&key.name, found("nonsense 7"));
        let is_listed = |found: &Description| found.unused.lines().iter().any(|line| line == name);
        tried += 1;
        match (key.done, nonsense) {
            // Nothing in these files depends on them, or they are text.
            (Use::Used | Use::Optional, Ok(found)) => {
                let said = found.rows.iter().any(|(_, text)| text.contains(name.as_str()) || text.contains("nonsense"));
                assert!(
                    said || is_listed(&found) || name == "Comment",
                    "{format}: {name} is ignored: {:?}",
                    found.rows
                );
            }
            (Use::Used | Use::Optional, Err(fault)) => {
                assert_eq!(fault.lines().count(), 1, "{name}: {fault}");
            }
            (Use::Warned(neutral), Ok(nonsense)) => {
                assert!(is_listed(&nonsense) && warnings(&nonsense).len() == 1, "{name}: {:?}", nonsense.rows);
                for value in neutral {
                    let usual = found(value).expect(name);
                    assert!(is_listed(&usual) && warnings(&usual).is_empty(), "{name} {value}: {:?}", usual.rows);
                }
            }
            (Use::Refused(neutral), Err(fault)) => {
                assert!(fault.contains(name.as_str()), "{name}: {fault}");
                neutral.iter().for_each(|value| assert!(found(value).is_ok(), "{name} {value}"));
            }
            (Use::Listed, Ok(found)) => assert!(is_listed(&found) && warnings(&found).is_empty(), "{name}"),
            (done, found) => panic!("{format}: {name} is {done:?}, but {found:?}"),
        }
    }
    assert!(tried > 20, "{tried} keys of {format}");
    let other = described(folder.write("file", header.with("PatientName", "Doe"))).expect("read");
    // Names of NRRD's fields are the same in any case.
    assert_eq!(other.unused.lines().join(", ").to_lowercase(), "patientname");
    assert!(other.rows.iter().all(|(_, text)| !text.contains("Doe")));
}

#[test]
fn every_key_of_metaimage_has_a_consequence() {
    every_key_has_a_consequence("MetaImage", &METAIMAGE);
}

#[test]
fn every_key_of_nrrd_has_a_consequence() {
    every_key_has_a_consequence("NRRD", &NRRD);
}

#[test]
fn two_keys_that_say_different_things_are_a_warning_and_the_same_thing_is_none() {
    let folder = Folder::new("unused-twice");
    let number = |bytes: Vec<u8>| warnings(&described(folder.write("file", bytes)).expect("read")).len();
    let twice = |position: &str| {
        let text = String::from_utf8(METAIMAGE.with("Offset", "1 2 3")).expect("text");
        text.replace("Offset", &format!("Position = {position}\nOffset")).into_bytes()
    };
    assert_eq!((number(twice("1 2 3")), number(twice("1 2 4"))), (0, 1));
    assert_eq!((number(NRRD.with("spacings", "1 1 1")), number(NRRD.with("spacings", "1 2 1"))), (0, 1));
    let units = |units: &str| {
        let text = String::from_utf8(NRRD.with("space units", "\"cm\" \"cm\" \"cm\"")).expect("text");
        text.replace("encoding", &format!("units: {units}\nencoding")).into_bytes()
    };
    assert_eq!((number(units("cm cm cm")), number(units("mm mm mm"))), (0, 1));
}

#[test]
fn fields_of_frames_that_are_not_used_are_listed_once() {
    let folder = Folder::new("unused-frames");
    let mut fields = String::new();
    for n in 0..2 {
        fields += &format!("Seq_Frame{n:04}_Timestamp = {n}\nSeq_Frame{n:04}_UnfilteredTimestamp = {n}\n");
        fields += &format!("Seq_Frame{n:04}_Elbow = {n}\nSeq_Frame{n:04}_ImageStatus = OK\n");
    }
    let text = String::from_utf8(METAIMAGE.with("Name", "x")).expect("text");
    let found = described(folder.write("file.mha", text.replace("Name", &format!("{fields}Name")))).expect("read");
    let listed = ["Name", "Seq_FrameN_Elbow (2 times)", "Seq_FrameN_UnfilteredTimestamp (2 times)"];
    assert_eq!(found.unused.lines(), listed);
}

/// A volume of 2 x 2 x 2 bytes, twice, as NIfTI-1, with some bytes of its header replaced.
fn nifti(replaced: &[(usize, &[u8])]) -> Vec<u8> {
    let mut header = vec![0; 352];
    let short = |n: i16| n.to_le_bytes();
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &348i32.to_le_bytes());
    put(40, &[4i16, 2, 2, 2, 2].map(short).concat());
    put(70, &[2i16, 8].map(short).concat());
    put(76, &[1f32, 1.0, 1.0, 1.0, 0.5].map(f32::to_le_bytes).concat());
    put(108, &352f32.to_le_bytes());
    put(123, &[10]);
    put(344, b"n+1\0");
    replaced.iter().for_each(|(at, bytes)| put(*at, bytes));
    header.extend([7; 16]);
    header
}

#[test]
fn fields_of_nifti_are_listed_and_no_unit_is_guessed_in_silence() {
    let folder = Folder::new("unused-nifti");
    let found = |replaced: &[(usize, &[u8])]| described(folder.write("file.nii", nifti(replaced))).expect("read");
    let says = |found: &Description, text: &str| found.rows.iter().any(|(_, row)| row.contains(text));
    let usual = found(&[]);
    assert!(usual.unused.lines().is_empty() && says(&usual, "0 .. 0.5 s"), "{:?}", usual.rows);
    let named = found(&[(148, b"Doe"), (68, &[1])]);
    assert_eq!(named.unused.lines(), ["descrip", "intent_code"]);
    assert!(warnings(&named).is_empty() && !says(&named, "Doe"));
    let timed = found(&[(132, &0.1f32.to_le_bytes())]);
    assert!(timed.unused.lines() == ["slice_duration"] && warnings(&timed).len() == 1, "{:?}", timed.rows);
    assert!(warnings(&found(&[(72, &[16])]))[0].contains("bitpix is 16, but datatype has 8 bits"));
    // An sform of 2 mm beside a qform of 1 mm, and one that says the same: both in RAS.
    let sform = |mm: f32| {
        let rows = [[mm, 0.0, 0.0, 0.0], [0.0, mm, 0.0, 0.0], [0.0, 0.0, mm, 0.0]];
        rows.concat().into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>()
    };
    let both = |mm: f32| found(&[(252, &[1, 0, 1, 0]), (280, &sform(mm))]);
    assert!(says(&both(2.0), "the qform states another place") && !says(&both(1.0), "the qform"));
    // Codes of units: none, lengths that are not known, Hz.
    assert!(says(&found(&[(123, &[0])]), "taken as mm") && says(&found(&[(123, &[0])]), "taken as s"));
    assert!(says(&found(&[(123, &[8 + 5])]), "code 5"));
    let no_times = found(&[(123, &[2 + 32])]);
    assert!(says(&no_times, "no unit of time") && !says(&no_times, "0 .. 0.5 s"), "{:?}", no_times.rows);
}

#[test]
fn items_of_kretz_are_listed_by_their_numbers() {
    let folder = Folder::new("unused-kretz");
    let (magic, polar) = (b"KRETZFILE 1.0   ", |tag: [u16; 2], bytes: &[u8]| {
        let head = [tag[0].to_le_bytes(), tag[1].to_le_bytes()].concat();
        [&head[..], &(bytes.len() as u32).to_le_bytes(), bytes].concat()
    });
    let sizes = [1, 2, 3].map(|n| polar([0xc000, n], &2u16.to_le_bytes())).concat();
    let step = polar([0xc100, 1], &0.0005f64.to_le_bytes());
    let others = [polar([0x110, 1], b"Doe"), polar([0x10, 9], b"x")].concat();
    let voxels = [polar([0xd000, 1], &[5; 8]), polar([0xffff, 0xffff], &[])].concat();
    let file = [&magic[..], &sizes, &step, &others, &voxels].concat();
    assert_eq!(described(folder.write("file.vol", file)).expect("read").unused.lines(), ["0010,0009", "0110,0001"]);
}

#[test]
fn what_stands_beside_pixels_and_beside_beamformed_data_is_listed() {
    let folder = Folder::new("unused-pictures");
    let picture = image::GrayImage::from_fn(4, 4, |x, y| image::Luma([(x + 4 * y) as u8]));
    let path = folder.path("1.png");
    picture.save(&path).expect("written");
    let mut bytes = std::fs::read(&path).expect("a picture");
    // 11811 pixels a metre, behind the first chunk.
    let chunk = [&b"pHYs"[..], &11811u32.to_be_bytes(), &11811u32.to_be_bytes(), &[1]].concat();
    let mut crc = Crc::new();
    crc.update(&chunk);
    bytes.splice(33..33, [&9u32.to_be_bytes()[..], &chunk, &crc.sum().to_be_bytes()].concat());
    std::fs::write(&path, bytes).expect("written");
    let options = OpenOptions { voxel_spacing: Some([1.0; 3]), ..OpenOptions::default() };
    assert_eq!(description(&folder.0, options).expect("read").unused.lines(), ["PNG pHYs"]);

    // EXIF with the orientation 6: the picture is to be turned by a quarter.
    let turned = Folder::new("unused-turned");
    let path = turned.path("1.jpg");
    picture.save(&path).expect("written");
    let mut bytes = std::fs::read(&path).expect("a picture");
    let exif = b"\xff\xe1\x00\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
    bytes.splice(2..2, *exif);
    std::fs::write(&path, bytes).expect("written");
    let found = description(&turned.0, options).expect("read");
    assert!(found.rows.iter().any(|(_, text)| text.contains("EXIF")), "{:?}", found.rows);
    assert!(found.unused.lines().iter().any(|name| name == "JPEG APP1 Exif"), "{:?}", found.unused.lines());

    for (name, listed, warned) in [
        ("sector.uff", ["frame_rate", "scan/origin"], 0),
        ("linear.uff", ["frame_rate", "scan/transform"], 0),
        // The same scan about an origin that is 10 mm away.
        ("moved.uff", ["frame_rate", "scan/origin"], 1),
    ] {
        let found = described(data("uff").join(name)).expect("read");
        assert_eq!(
            (found.unused.lines(), warnings(&found).len()),
            (listed.map(String::from).to_vec(), warned),
            "{name}"
        );
    }
}

#[test]
fn info_counts_the_keys_that_were_not_used_and_lists_them_when_asked() {
    let folder = Folder::new("unused-info");
    let path = folder.write("file.mha", METAIMAGE.with("ElementToIntensityFunctionSlope", "2"));
    let said = |arguments: &[&str]| {
        let output = Command::new(PROGRAM).args(arguments).arg(&path).output().expect("the program starts");
        (String::from_utf8_lossy(&output.stdout).into_owned(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (rows, warned) = said(&["info"]);
    assert!(rows.contains("keys not used") && rows.contains("1, which info -v lists"), "{rows}");
    assert!(warned.lines().filter(|line| line.contains("ElementToIntensityFunctionSlope")).count() == 1, "{warned}");
    let (rows, _) = said(&["info", "-v"]);
    assert!(rows.lines().any(|line| line.starts_with("key not used") && line.ends_with("FunctionSlope")), "{rows}");
}
