//! MetaImage as other programs write it: four dimensions, spacings of frames, and where the samples are.

use super::recordings::*;
use echolume::Source;
use flate2::write::GzEncoder;

/// Header and samples. `file`: what `ElementDataFile` says.
fn header(dimensions: usize, size: &str, more: &str, file: &str) -> String {
    format!(
        "ObjectType = Image\nNDims = {dimensions}\nDimSize = {size}\nElementType = MET_UCHAR\n{more}ElementDataFile = {file}\n"
    )
}

fn local(dimensions: usize, size: &str, more: &str, bytes: u8) -> Vec<u8> {
    [header(dimensions, size, more, "LOCAL").into_bytes(), (0..bytes).collect()].concat()
}

fn said(path: impl AsRef<Path>) -> String {
    open(path).description().into_iter().map(|(title, text)| format!("{title}: {text}\n")).collect()
}

fn spacing(path: impl AsRef<Path>) -> [f64; 3] {
    let world = open(path).world().expect("a place in the world");
    [0, 1, 2].map(|n| (world.axis(n).length() * 1e9).round() / 1e9)
}

#[test]
fn the_fourth_dimension_is_volumes_in_time() {
    let folder = Folder::new("mha-4d");
    let turned = "ElementSpacing = 0.3 0.5 0.8 1\nOffset = 1 2 3 0\n\
                  TransformMatrix = 0 1 0 0 -1 0 0 0 0 0 1 0 0 0 0 1\n";
    let times = "Kinds = domain domain domain list\nUltrasoundImageOrientation = MFA\nUltrasoundImageType = BRIGHTNESS\n\
                 Seq_Frame0000_Timestamp = 0.5\nSeq_Frame0001_Timestamp = 0.75\nSeq_Frame0002_Timestamp = 1\n";
    let path = folder.write("a.mha", local(4, "3 2 2 3", &format!("{turned}{times}"), 36));
    let mut recording = open(&path);
    assert_eq!((recording.volumes(), recording.frames_per_volume()), (3, 2));
    let world = recording.world().unwrap();
    assert_eq!((world.axis(0).y, world.axis(1).x, world.origin().to_array()), (0.3, -0.5, [1.0, 2.0, 3.0]));
    let frames = all_frames(&mut recording).unwrap();
    assert_eq!(frames.iter().flat_map(|f| f.bytes.clone()).collect::<Vec<u8>>(), (0..36).collect::<Vec<u8>>());
    assert_eq!(frames.iter().filter_map(|f| f.time).collect::<Vec<f64>>(), [0.5, 0.5, 0.75, 0.75, 1.0, 1.0]);
    // ITK writes no kinds; what is not known is said.
    let plain = said(folder.write("a.mha", local(4, "3 2 2 3", "ElementSpacing = 1 1 1 0.04\n", 36)));
    assert!(plain.contains("fourth axis: of no stated kind") && plain.contains("0.04 from 0 on"), "{plain}");
    let odd = said(folder.write("a.mha", local(4, "3 2 2 3", "Kinds = domain domain list\n", 36)));
    assert!(odd.contains("Kinds has 3 entries, but NDims is 4: they are not used"), "{odd}");
    let posed = "Seq_Frame0000_ProbeToTrackerTransform = 1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1\n";
    let posed = said(folder.write("a.mha", local(4, "3 2 2 3", posed, 36)));
    assert!(posed.contains("tracking: ProbeToTracker of whole volumes: not used"), "{posed}");
    // Slices of a volume may be rows of the picture.
    let ascending = "UltrasoundImageOrientation = AMF\nSeq_Frame0000_Timestamp = 0\n";
    let mut recording = open(folder.write("a.mha", local(4, "3 2 2 3", ascending, 36)));
    recording.skip_to_volume(1).unwrap();
    assert_eq!(recording.next_frame().unwrap().unwrap().bytes, [12, 15, 18, 21]);
    for (more, size, named) in [
        ("", "3 2 2", "DimSize: has 3 entries, but NDims is 4"),
        ("ElementSpacing = 1 1 1\n", "3 2 2 3", "ElementSpacing: has 3 entries, must have 4"),
        ("TransformMatrix = 1 0 0 0 1 0 0 0 1\n", "3 2 2 3", "TransformMatrix: has 9 entries, must have 16"),
        (
            "TransformMatrix = 1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1\n",
            "3 2 2 3",
            "TransformMatrix: turns the fourth axis, time, into space",
        ),
        ("Kinds = list domain domain domain\n", "3 2 2 3", "Kinds: 1st entry 'list' is not read there"),
    ] {
        let error = total(folder.write("a.mha", local(4, size, more, 36))).unwrap_err();
        assert!(error.contains(named), "{more}: {error}");
    }
    assert!(total(folder.write("a.mha", local(5, "1 1 1 1 1", "", 1))).unwrap_err().contains("NDims: is 5"));
}

#[test]
fn the_spacing_of_frames_counts() {
    let folder = Folder::new("mha-spacing");
    let frame = |n: usize, spacing: &str| format!("Seq_Frame{n:04}_ElementSpacing = {spacing}\n");
    let read = |more: &str| folder.write("s.mha", local(3, "3 2 2", &format!("ElementSpacing = 1 1 1\n{more}"), 12));
    let path = read(&(frame(0, "0.025 0.05 1") + &frame(1, "0.025 0.05 1")));
    assert_eq!(spacing(&path), [0.025, 0.05, 1.0]);
    assert!(said(&path).contains("spacing: ElementSpacing of the frames is 0.025 x 0.05 x 1 mm and counts"));
    let path = read(&(frame(0, "0.025 0.05") + &frame(1, "0.5 0.5")));
    assert_eq!(spacing(&path), [0.025, 0.05, 1.0]);
    assert!(said(&path).contains("ElementSpacing differs from frame to frame"));
    assert!(!said(read(&frame(0, "1 1 1"))).contains("spacing: "), "the same as that of the header");
    assert!(total(read(&frame(1, "1 -1 1"))).unwrap_err().contains("Seq_Frame0001_ElementSpacing"));
}

#[test]
fn units_and_byte_orders_are_used_or_missed() {
    let folder = Folder::new("mha-units");
    let read = |unit: &str| folder.write("u.mha", local(3, "3 2 2", &format!("DistanceUnits = {unit}\n"), 12));
    assert_eq!(spacing(read("um")), [1e-3; 3]);
    assert_eq!(spacing(read("?")), [1.0; 3]);
    assert!(said(read("parsec")).contains("the unit 'parsec', is not known, taken as mm"));
    let words = String::from_utf8(local(3, "3 2 1", "", 12)).unwrap().replace("MET_UCHAR", "MET_SHORT");
    assert!(said(folder.write("w.mha", &words)).contains("the byte order is taken as little-endian"));
    let stated = words.replace("NDims", "BinaryDataByteOrderMSB = True\nNDims");
    assert!(!said(folder.write("w.mha", stated)).contains("byte order"));
}

#[test]
fn samples_are_where_the_header_says() {
    let folder = Folder::new("mha-files");
    fs::create_dir(folder.join("sub")).unwrap();
    let all: Vec<u8> = (0..12).collect();
    for name in ["d.raw", "sub/d.raw", "with space.raw", "77 %.raw", "p%d.raw 1 2 1"] {
        folder.write(name, &all);
    }
    for (n, slice) in all.chunks(6).enumerate() {
        folder.write(&format!("s{:03}.raw", 2 * n + 1), slice);
        folder.write(&format!("sub/t{}.raw", n + 1), slice);
    }
    let names = [
        "d.raw",
        "./d.raw",
        "sub/d.raw",
        "sub\\d.raw",
        "with space.raw",
        "77 %.raw",
        "p%d.raw 1 2 1",
        "LIST\ns001.raw\n./s003.raw",
        "LIST 2D\r\ns001.raw\r\ns003.raw",
        "LIST 3\nd.raw",
        "s%03d.raw 1 3 2",
        "s%03d.raw 1 3",
        "sub/t%d.raw",
        "sub/t%d.raw 1",
    ];
    for name in names {
        let path = folder.write("a.mhd", header(3, "3 2 2", "", name));
        assert_eq!(all_bytes(&path).unwrap_or_else(|e| panic!("{name}: {e}")), all, "{name}");
    }
    for name in ["LOCAL", "Local", "local"] {
        let path = folder.write("a.mha", [header(3, "3 2 2", "", name).as_bytes(), &all].concat());
        assert_eq!(all_bytes(path).unwrap(), all);
    }
    for (name, named) in [
        ("../d.raw", "same folder or below it"),
        ("sub/../../d.raw", "same folder or below it"),
        ("sub", "is not a regular file"),
        ("absent.raw", "cannot be read"),
        ("LIST\nd.raw", "lists 1 files, 2 make up the sizes"),
        ("LIST 9D\nd.raw", "states 9 axes of a file"),
        ("LIST of files\nd.raw", "is no list"),
        ("s%03d.raw 1 9 2", "names 5 files, 2 make up the sizes"),
        ("LIST\ns001.raw\n../s003.raw", "same folder or below it"),
    ] {
        let error = total(folder.write("a.mhd", header(3, "3 2 2", "", name))).unwrap_err();
        assert!(error.contains("ElementDataFile: ") && error.contains(named), "{name}: {error}");
    }
    folder.write("s003.raw", b"short");
    let error = total(folder.write("a.mhd", header(3, "3 2 2", "", "s%03d.raw 1 3 2"))).unwrap_err();
    assert!(error.contains("s003.raw: data: cut short"), "{error}");
}

#[test]
fn compressed_samples_are_zlib_or_gzip() {
    let folder = Folder::new("mha-gzip");
    let all: Vec<u8> = (0..12).collect();
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(&all).unwrap();
    let packed = encoder.finish().unwrap();
    let more = format!("CompressedData = True\nCompressedDataSize = {}\n", packed.len());
    let read =
        |data: &[u8]| total(folder.write("z.mha", [header(3, "3 2 2", &more, "LOCAL").as_bytes(), data].concat()));
    assert_eq!(read(&packed).unwrap(), all);
    assert!(read(&packed[..packed.len() - 1]).unwrap_err().contains("cut short"));
    let mut wrong = packed.clone();
    let last = wrong.len() - 6;
    wrong[last] ^= 1;
    assert!(read(&wrong).is_err(), "the checksum is verified");
    folder.write("z.zraw", &packed);
    let path = folder.write("z.mhd", header(3, "3 2 2", "CompressedData = True\n", "z.zraw"));
    assert_eq!(all_bytes(path).unwrap(), all);
}
