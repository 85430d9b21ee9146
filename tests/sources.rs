//! Recorded files: the same frames and places whatever they are stored as, and one clear line for every fault.

use echolume::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use echolume::source::{Frame, InputError, Recording, SampleType, StoredType};
use flate2::{Compression, write::ZlibEncoder};
use proptest::prelude::*;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

fn stored(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// A folder of this test's own, without a probe file; gone when dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("echolume-sources-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn open(path: &Path) -> Recording {
    Recording::open(path, None).unwrap_or_else(|e| panic!("{e}"))
}

fn all_frames(recording: &mut Recording) -> Result<Vec<Frame>, InputError> {
    let mut frames = Vec::new();
    while let Some(frame) = recording.next_frame()? {
        frames.push(frame);
    }
    Ok(frames)
}

fn all_bytes(path: &Path) -> Result<Vec<u8>, InputError> {
    let mut recording = Recording::open(path, None)?;
    let _ = recording.facts();
    Ok(all_frames(&mut recording)?.into_iter().flat_map(|f| f.bytes).collect())
}

/// What any bytes must give: frames, or one line that fits on a screen.
fn total(path: &Path) -> Result<Vec<u8>, String> {
    all_bytes(path).map_err(|error| {
        let line = error.to_string();
        assert_eq!(line.lines().count(), 1, "{line}");
        assert!(line.len() < 2000 && !line.chars().any(char::is_control), "{line:?}");
        line
    })
}

fn probe_of(recording: &Recording) -> Probe {
    match recording.geometry(0) {
        Geometry::Sweep(probe) => probe,
        Geometry::Cartesian(grid) => panic!("not polar: {grid:?}"),
    }
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A MetaImage of the given header lines.
fn image(size: &str, element: &str, more: &str, data: &[u8]) -> Vec<u8> {
    let header = format!(
        "ObjectType = Image\nNDims = 3\nDimSize = {size}\nElementType = {element}\n{more}ElementDataFile = LOCAL\n"
    );
    [header.as_bytes(), data].concat()
}

fn item(group: u16, element: u16, bytes: &[u8]) -> Vec<u8> {
    let length = bytes.len() as u32;
    [&group.to_le_bytes()[..], &element.to_le_bytes(), &length.to_le_bytes(), bytes].concat()
}

fn doubles(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A Kretz volume of 4 samples with the given angle tables (centred on 0), and more items before the voxels.
fn kretz(lines: &[f64], sweep: &[f64], more: &[u8]) -> Vec<u8> {
    let centred = |table: &[f64]| doubles(&table.iter().map(|a| a + std::f64::consts::FRAC_PI_2).collect::<Vec<_>>());
    let voxels: Vec<u8> = (0..4 * lines.len() * sweep.len()).map(|v| v as u8).collect();
    [
        b"KRETZFILE 1.0   ".to_vec(),
        item(0x0110, 2, b"SECRET^PATIENT\n\x1b[2J"),
        item(0x0120, 1, b"SECRET-NUMBER"),
        item(0xc000, 1, &4u16.to_le_bytes()),
        item(0xc000, 2, &(lines.len() as u16).to_le_bytes()),
        item(0xc000, 3, &(sweep.len() as u16).to_le_bytes()),
        item(0xc100, 1, &doubles(&[0.0005])),
        item(0xc200, 1, &doubles(&[80.0])),
        item(0xc200, 2, &doubles(&[-30.0])),
        item(0xc300, 1, &centred(sweep)),
        item(0xc300, 2, &centred(lines)),
        more.to_vec(),
        item(0xd000, 1, &voxels),
        item(0xffff, 0xffff, b""),
    ]
    .concat()
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-9, "{a} is not {b}");
}

#[test]
fn both_forms_of_the_wobbler_sweep_are_one_sweep() {
    let folder = Folder::new("both-forms");
    // Away from the probe file, each must know its own geometry.
    let copies = ["sweep.mha", "sweep.vol"].map(|n| folder.write(n, fs::read(stored("wobbler-4dc7").join(n)).unwrap()));
    let paths = [copies[0].clone(), copies[1].clone(), stored("wobbler-4dc7/sweep.mha")];
    let mut recordings = paths.map(|p| open(&p));
    assert_eq!(
        recordings.each_ref().map(|r| r.format()),
        ["MetaImage pre-scan sweep", "Kretz volume", "MetaImage pre-scan sweep"]
    );
    for recording in &recordings {
        assert_eq!((recording.volumes(), recording.frames_per_volume(), recording.frames_in_file()), (1, 31, 31));
        assert_eq!(recording.geometry(0).frame_size(), [400, 128]);
        let probe = probe_of(recording);
        let Motion::Fan { wobble_radius } = probe.motion else { panic!("{:?}", probe.motion) };
        close(wobble_radius, 27.25);
        close(probe.array_radius(), 39.8);
        close(probe.sample_pitch, 0.25);
        close(probe.start_depth, 0.0);
        close(probe.lines.pitch(), 0.010625);
        close(probe.lines.first() + probe.lines.last(), 0.0);
        close(probe.slices.pitch(), 0.0255342);
        close(probe.slices.first() + probe.slices.last(), 0.0);
        assert!(matches!((probe.lines, probe.slices), (Axis::Even { .. }, Axis::Even { .. })));
    }
    let frames = recordings.each_mut().map(|r| all_frames(r).unwrap());
    assert_eq!(frames[0].len(), 31);
    assert!(frames[0] == frames[1] && frames[0] == frames[2]);
    let raw = fs::read(&copies[0]).unwrap();
    let bytes: Vec<u8> = frames[0].iter().flat_map(|f| f.bytes.clone()).collect();
    assert!(raw.ends_with(&bytes) && bytes.len() == 400 * 128 * 31);
}

#[test]
fn the_ultrasonix_frames_are_polar_by_their_probe_file_and_pictures_are_not() {
    let mut polar = open(&stored("ultrasonix-curvilinear/brightness.mha"));
    assert_eq!(polar.format(), "PLUS sequence");
    assert_eq!((polar.volumes(), polar.frames_per_volume()), (5, 1));
    let probe = probe_of(&polar);
    assert_eq!(probe.array, Array::Curved { radius: 10.0 });
    close(probe.sample_pitch, 72.0 / 3640.0);
    close(probe.lines.first().to_degrees(), -75.0);
    let frames = all_frames(&mut polar).unwrap();
    assert_eq!(frames.iter().map(|f| f.bytes.len()).collect::<Vec<_>>(), [3640 * 96; 5]);
    assert_eq!(frames.iter().map(|f| f.time.unwrap()).collect::<Vec<_>>(), [98.0, 98.01, 98.02, 99.03, 99.04]);
    assert_eq!(frames.iter().map(|f| f.volume).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);

    let mut pictures = open(&stored("ultrasonix-curvilinear/scan-converted.mha"));
    let Geometry::Cartesian(grid) = pictures.geometry(4) else { panic!("820 x 616 pictures are not scan lines") };
    assert_eq!((grid.size, pictures.volumes()), ([820, 616, 1], 5));
    assert_eq!(all_frames(&mut pictures).unwrap().iter().map(|f| f.bytes.len()).sum::<usize>(), 820 * 616 * 5);
    let given = Recording::open(
        &stored("ultrasonix-curvilinear/scan-converted.mha"),
        Some(&stored("ultrasonix-curvilinear/probe.toml")),
    );
    assert!(given.err().unwrap().to_string().contains("pictures"));
}

#[test]
fn a_compressed_file_holds_the_same_frames_as_its_raw_bytes() {
    let folder = Folder::new("compressed");
    let probe = folder.write("probe.toml", fs::read(stored("ultrasonix-curvilinear/probe.toml")).unwrap());
    let mut compressed = Recording::open(&stored("ultrasonix-curvilinear/brightness.mha"), Some(&probe)).unwrap();
    let frames = all_frames(&mut compressed).unwrap();
    let data: Vec<u8> = frames.iter().flat_map(|f| f.bytes.clone()).collect();
    let raw = folder.write("raw.mha", image("3640 96                      5", "MET_UCHAR", "", &data));
    assert_eq!(all_bytes(&raw).unwrap(), data);
    let packed = zlib(&data);
    for more in
        ["CompressedData = True\n".into(), format!("CompressedData = True\nCompressedDataSize = {}\n", packed.len())]
    {
        let path = folder.write("zlib.mha", image("3640 96 5", "MET_UCHAR", &more, &packed));
        assert_eq!(all_bytes(&path).unwrap(), data);
    }
    // Going to a volume gives the frame that reading up to it gives, back and forth.
    for volume in [3, 1, 1, 4, 0] {
        compressed.skip_to_volume(volume).unwrap();
        assert_eq!(compressed.next_frame().unwrap().as_ref(), Some(&frames[volume]));
    }
    assert!(compressed.skip_to_volume(5).is_err());
    compressed.rewind();
    assert_eq!(all_frames(&mut compressed).unwrap(), frames);
}

#[test]
fn the_bone_is_cartesian() {
    let mut bone = open(&stored("bone-l14/bone.mha"));
    let Geometry::Cartesian(grid) = bone.geometry(0) else { panic!("no probe was given") };
    assert_eq!((grid.size, grid.spacing, grid.origin), ([160, 216, 33], [0.25, 0.25, 0.35], [0.0; 3]));
    assert_eq!((bone.format(), bone.volumes(), bone.range()), ("MetaImage", 1, [0.0, 255.0]));
    let frames = all_frames(&mut bone).unwrap();
    assert_eq!((frames.len(), frames[32].slice), (33, 32));
    assert!(frames.iter().any(|f| f.bytes.iter().any(|b| *b > 100)));
}

#[test]
fn samples_of_every_type_and_byte_order_keep_their_values() {
    let folder = Folder::new("types");
    let values: Vec<i32> = (0..24).map(|v| v * 997).collect();
    let u16s: Vec<u8> = values.iter().flat_map(|v| (*v as u16).to_le_bytes()).collect();
    let f32s: Vec<u8> = values.iter().flat_map(|v| (*v as f32 - 5000.0).to_le_bytes()).collect();
    for msb in [false, true] {
        let more = format!("{} = {msb}\n", if msb { "BinaryDataByteOrderMSB" } else { "ElementByteOrderMSB" });
        let order = |bytes: &[u8], n: usize| -> Vec<u8> {
            bytes.chunks(n).flat_map(|c| if msb { c.iter().rev().copied().collect() } else { c.to_vec() }).collect()
        };
        let unsigned = folder.write("u.mha", image("4 3 2", "MET_USHORT", &more, &order(&u16s, 2)));
        assert_eq!(all_bytes(&unsigned).unwrap(), u16s);
        assert_eq!(open(&unsigned).range(), [0.0, 23.0 * 997.0]);

        let i16s: Vec<u8> = values.iter().flat_map(|v| (*v as i16 - 10000).to_le_bytes()).collect();
        let signed = folder.write("i.mha", image("4 3 2", "MET_SHORT", &more, &order(&i16s, 2)));
        let shifted: Vec<u8> = values.iter().flat_map(|v| (*v as u16 + 22768).to_le_bytes()).collect();
        assert_eq!(all_bytes(&signed).unwrap(), shifted);
        let recording = open(&signed);
        assert_eq!((recording.sample_type(), recording.stored_type()), (SampleType::I16, StoredType::U16));
        assert_eq!(recording.range(), [22768.0, 22768.0 + 23.0 * 997.0]);

        let float = folder.write("f.mha", image("4 3 2", "MET_FLOAT", &more, &order(&f32s, 4)));
        assert_eq!(all_bytes(&float).unwrap(), f32s);
        assert_eq!(open(&float).range(), [-5000.0, 23.0 * 997.0 - 5000.0]);
    }
}

#[test]
fn samples_that_are_not_finite_are_counted_and_replaced() {
    let folder = Folder::new("not-finite");
    let values = [1.0f32, f32::NAN, 3.0, f32::INFINITY, f32::NEG_INFINITY, 1e-42, -7.0, 0.0];
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let path = folder.write("f.mha", image("2 2 2", "MET_FLOAT", "", &bytes));
    let mut recording = open(&path);
    assert_eq!((recording.replaced(), recording.flushed(), recording.range()), (3, 1, [-7.0, 3.0]));
    let read: Vec<u8> = all_frames(&mut recording).unwrap().into_iter().flat_map(|f| f.bytes).collect();
    let clean: Vec<u8> = [1.0f32, 0.0, 3.0, 0.0, 0.0, 0.0, -7.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(read, clean);
    assert_eq!(recording.replaced(), 3, "a second reading counts nothing twice");
    let nothing: Vec<u8> = [f32::NAN; 8].iter().flat_map(|v| v.to_le_bytes()).collect();
    let [low, high] = open(&folder.write("n.mha", image("2 2 2", "MET_FLOAT", "", &nothing))).range();
    assert!(low < high);
}

#[test]
fn uneven_kretz_tables_stay_uneven() {
    let folder = Folder::new("uneven");
    let path = folder.write("u.vol", kretz(&[-0.3, -0.1, 0.25], &[-0.2, 0.05, 0.1, 0.4], b""));
    let probe = probe_of(&open(&path));
    close(probe.array_radius(), 40.0);
    assert!(matches!(probe.motion, Motion::Fan { wobble_radius } if (wobble_radius - 25.0).abs() < 1e-9));
    for (axis, table) in [(&probe.lines, &[-0.3, -0.1, 0.25][..]), (&probe.slices, &[-0.2, 0.05, 0.1, 0.4])] {
        assert!(matches!(axis, Axis::Table(_)));
        for (i, value) in table.iter().enumerate() {
            close(axis.at(i as f64), *value);
        }
    }
    let falling = folder.write("f.vol", kretz(&[-0.3, -0.1, 0.25], &[0.4, 0.1, 0.0], b""));
    assert!(total(&falling).unwrap_err().contains("C300,0001"));
}

#[test]
fn what_a_kretz_file_cannot_give_is_said() {
    let folder = Folder::new("kretz");
    let wavelet = folder.write("w.vol", kretz(&[-0.1, 0.1], &[-0.1, 0.1], &item(2, 0x1100, b"xy")));
    assert!(total(&wavelet).unwrap_err().contains("wavelet"));
    let several = open(&folder.write("4d.vol", kretz(&[-0.1, 0.1], &[-0.1, 0.1], &item(0xd600, 1, b"xy"))));
    assert!(several.facts().iter().any(|(title, _)| title == "4D"));
    // Without tables the voxels are Cartesian, the radial step apart.
    let plain = kretz(&[-0.1, 0.1], &[-0.1, 0.1], b"");
    let at = |tag: &[u8]| plain.windows(4).position(|w| w == tag).unwrap();
    let (tables, voxels) = (at(&[0x00, 0xc3, 1, 0]), at(&[0x00, 0xd0, 1, 0]));
    let path = folder.write("c.vol", [&plain[..tables], &plain[voxels..]].concat());
    let Geometry::Cartesian(grid) = open(&path).geometry(0) else { panic!("there are no angles") };
    assert_eq!((grid.size, grid.spacing), ([4, 2, 2], [0.5; 3]));
}

#[test]
fn no_patient_field_is_ever_shown() {
    let folder = Folder::new("patient");
    let whole = kretz(&[-0.1, 0.1], &[-0.1, 0.1], b"");
    let mut shown = format!("{:?}", open(&folder.write("p.vol", &whole)).facts());
    for cut in 0..whole.len() {
        shown += &total(&folder.write("p.vol", &whole[..cut])).unwrap_err();
    }
    let more = "PatientName = SECRET^PATIENT\nSeq_Frame0000_PatientName = SECRET\nComment = SECRET\n";
    let whole = image("2 2 2", "MET_UCHAR", more, &[1; 8]);
    shown += &format!("{:?}", open(&folder.write("p.mha", &whole)).facts());
    for cut in 0..whole.len() {
        shown += &total(&folder.write("p.mha", &whole[..cut])).unwrap_err();
    }
    assert!(!shown.contains("SECRET"), "{shown}");
}

#[test]
fn a_file_cut_off_anywhere_is_one_line_and_no_panic() {
    let folder = Folder::new("cut");
    let data: Vec<u8> = (0..24).map(|v| v * 10).collect();
    let packed = zlib(&data);
    let sized = format!("CompressedData = True\nCompressedDataSize = {}\n", packed.len());
    let sweep = fs::read(stored("wobbler-4dc7/sweep.mha")).unwrap();
    let volume = fs::read(stored("wobbler-4dc7/sweep.vol")).unwrap();
    let small = [
        ("raw.mha", image("4 3 2", "MET_UCHAR", "", &data)),
        ("float.mha", image("3 1 2", "MET_FLOAT", "", &data)),
        ("sized.mha", image("4 3 2", "MET_UCHAR", &sized, &packed)),
        ("unsized.mha", image("4 3 2", "MET_UCHAR", "CompressedData = True\n", &packed)),
        ("small.vol", kretz(&[-0.1, 0.0, 0.1], &[-0.1, 0.1], b"")),
    ];
    for (name, whole) in &small {
        assert!(total(&folder.write(name, whole)).is_ok(), "{name}");
        for cut in 0..whole.len() {
            assert!(total(&folder.write(name, &whole[..cut])).is_err(), "{name} cut at {cut} of {}", whole.len());
        }
    }
    for (name, whole, header) in [("sweep.mha", sweep, 470), ("sweep.vol", volume, 1500)] {
        let data = (1..20).map(|i| i * (whole.len() - 1) / 19);
        for cut in (0..header).chain(data) {
            let error = total(&folder.write(name, &whole[..cut])).unwrap_err();
            assert!(error.contains(name), "{error}");
        }
    }
}

#[test]
fn a_damaged_compressed_stream_is_named() {
    let folder = Folder::new("damaged");
    let data: Vec<u8> = (0..4096u32).map(|v| (v * v / 512) as u8).collect();
    let packed = zlib(&data);
    for at in 0..packed.len() {
        let mut damaged = packed.clone();
        damaged[at] ^= 0x10;
        let path = folder.write("d.mha", image("64 8 8", "MET_UCHAR", "CompressedData = True\n", &damaged));
        match total(&path) {
            Err(error) => assert!(error.contains("data: "), "{error}"),
            // A few bits between the last code and the checksum mean nothing.
            Ok(read) => assert!(read == data && at + 5 >= packed.len(), "byte {at} of {} went unnoticed", packed.len()),
        }
    }
}

#[test]
fn header_numbers_that_cannot_be_true_are_refused_by_name() {
    let folder = Folder::new("numbers");
    let good =
        String::from_utf8(image("4 3 2", "MET_UCHAR", "ElementSpacing = 1 1 1\nOffset = 0 0 0\n", &[1; 24])).unwrap();
    let faults = [
        ("4 3 2", "4000000000 4000000000 31", "DimSize: 1st entry is 4000000000"),
        ("4 3 2", "4 3 0", "DimSize: 3rd entry is 0, must be at least 1"),
        ("4 3 2", "4 3 99999999999999999999", "DimSize"),
        ("4 3 2", "4 3 -2", "DimSize"),
        ("4 3 2", "4 3", "DimSize"),
        ("4 3 2", "65536 65536 65536", "DimSize: one frame has"),
        ("4 3 2", "4 3 200", "data: cut short, 24 of 2400 bytes are there"),
        ("4 3 2", "4 3 2\nCompressedData = True", "data"),
        ("4 3 2", "40 300 20\nCompressedData = True", "cannot hold"),
        ("1 1 1", "1 nan 1", "ElementSpacing: 2nd entry"),
        ("1 1 1", "1 1 inf", "ElementSpacing: 3rd entry"),
        ("1 1 1", "1 -1 1", "ElementSpacing: 2nd entry"),
        ("1 1 1", "0 1 1", "ElementSpacing: 1st entry"),
        ("0 0 0", "0 1e999 0", "Offset"),
        ("NDims = 3", "NDims = 4", "NDims"),
        ("MET_UCHAR", "MET_DOUBLE", "ElementType"),
        ("LOCAL", "LIST", "ElementDataFile"),
        ("LOCAL", "../secret.raw", "ElementDataFile"),
        ("LOCAL", "/etc/passwd", "ElementDataFile"),
        ("LOCAL", "..", "ElementDataFile"),
        ("LOCAL", "a%03d.raw 1 9 1", "ElementDataFile"),
        ("NDims = 3", "NDims = 3\nElementNumberOfChannels = 3", "ElementNumberOfChannels"),
        ("NDims = 3", "NDims = 3\nBinaryData = False", "BinaryData"),
        ("NDims = 3", "NDims = 3\nNDims = 3", "NDims: is given twice"),
        ("NDims = 3", "NDims = 3\nUltrasoundImageType = BRIGHTNESS", "--probe"),
        ("NDims = 3", "NDims = 3\nUltrasoundImageType = RF_REAL", "UltrasoundImageType"),
        ("NDims = 3", "NDims = 3\nUltrasoundImageOrientation = NU", "UltrasoundImageOrientation"),
        ("NDims = 3", "NDims = 3\nScanLinePitch = 0.01", "IsTransducerConvex: is missing"),
        ("NDims = 3", "NDims = 3\nHeaderSize = -2", "HeaderSize"),
        ("NDims = 3", "NDims = 3\nSeq_Frame0000_Timestamp = nan", "Seq_Frame0000_Timestamp"),
    ];
    for (from, to, named) in faults {
        assert!(good.contains(from));
        let error = total(&folder.write("n.mha", good.replacen(from, to, 1))).unwrap_err();
        assert!(error.contains(named), "{from} -> {to}: {error}");
    }
    let endless = "Comment = x\n".repeat(200_000);
    assert!(total(&folder.write("n.mha", endless)).unwrap_err().contains("ElementDataFile"));
    assert!(total(&folder.write("n.png", b"\x89PNG")).unwrap_err().contains("MetaImage"));
    assert!(total(&folder.0).unwrap_err().contains("regular file"));
    assert!(total(&folder.0.join("absent.mha")).unwrap_err().contains("absent.mha"));
}

#[test]
fn line_ends_of_another_system_do_not_shift_the_data() {
    let folder = Folder::new("line-ends");
    let header = String::from_utf8(image("4 3   2", "MET_UCHAR", "\n  \n", b"")).unwrap().replace('\n', "\r\n");
    let data: Vec<u8> = (0..24).collect();
    assert_eq!(total(&folder.write("l.mha", [header.as_bytes(), &data].concat())), Ok(data));
}

#[test]
fn a_recording_can_be_read_on_another_thread() {
    fn assert_send<T: Send>() {}
    assert_send::<Recording>();
}

#[test]
fn data_in_a_second_file_are_found_behind_its_header() {
    let folder = Folder::new("second-file");
    let data: Vec<u8> = (0..24).collect();
    folder.write("raw.bin", [&[9; 7][..], &data].concat());
    let header = |more: &str| {
        let text = String::from_utf8(image("4 3 2", "MET_UCHAR", more, b"")).unwrap();
        folder.write("h.mhd", text.replace("LOCAL", "raw.bin"))
    };
    assert_eq!(total(&header("HeaderSize = -1\n")), Ok(data.clone()));
    assert_eq!(total(&header("HeaderSize = 7\n")), Ok(data.clone()));
    assert!(total(&header("HeaderSize = 8\n")).unwrap_err().contains("23 of 24"));
    assert_eq!(total(&header("")).unwrap()[..7], [9; 7]);
    assert!(open(&header("")).facts().iter().any(|(title, _)| title == "more data"));
}

const TABLE: &str = "[array]\nkind = 'linear'\n[lines]\nwidth_mm = 20\n[depth]\nend_mm = 3\n[motion]\nkind = 'translated'\n\
                     frame_positions_mm = [0, 1, 3]\nframes_per_volume = 3\nboth_ways = true\nspeed_ratio = 0.5\n";

#[test]
fn sweeps_there_and_back_keep_their_slices_in_geometric_order() {
    let folder = Folder::new("there-and-back");
    let data: Vec<u8> = (0..7).flat_map(|frame| [frame; 8]).collect();
    folder.write("s.probe.toml", TABLE);
    let more = "UltrasoundImageType = BRIGHTNESS\nUltrasoundImageOrientation = FM\n";
    let mut recording = open(&folder.write("s.mha", image("4 2 7", "MET_UCHAR", more, &data)));
    assert_eq!((recording.volumes(), recording.frames_in_file()), (2, 7));
    let frames = all_frames(&mut recording).unwrap();
    let order: Vec<_> = frames.iter().map(|f| (f.volume, f.number, f.slice, f.backward, f.bytes[0])).collect();
    assert_eq!(order[..3], [(0, 0, 0, false, 0), (0, 1, 1, false, 1), (0, 2, 2, false, 2)]);
    assert_eq!(order[3..], [(1, 0, 2, true, 3), (1, 1, 1, true, 4), (1, 2, 0, true, 5)]);
    let advance = |volume| match recording.geometry(volume) {
        Geometry::Sweep(probe) => probe.advance,
        Geometry::Cartesian(_) => panic!("it is a sweep"),
    };
    assert_eq!(advance(0), Advance::Each(vec![0.5, 1.0, 1.0]));
    assert_eq!(advance(1), Advance::Each(vec![-0.5, -0.5, -1.0]));
}

#[test]
fn a_given_probe_file_wins_over_one_beside_and_that_over_the_header() {
    let folder = Folder::new("precedence");
    let sweep = folder.write("sweep.mha", fs::read(stored("wobbler-4dc7/sweep.mha")).unwrap());
    let text = fs::read_to_string(stored("wobbler-4dc7/probe.toml")).unwrap();
    let with_radius = |mm: &str| text.replace("radius_mm = 39.8 ", &format!("radius_mm = {mm} "));
    let radius = |given| probe_of(&Recording::open(&sweep, given).unwrap()).array_radius();
    assert_eq!(radius(None), 39.8);
    folder.write("probe.toml", with_radius("41"));
    assert_eq!(radius(None), 41.0);
    folder.write("sweep.probe.toml", with_radius("42"));
    assert_eq!(radius(None), 42.0);
    let given = folder.write("other.toml", with_radius("43"));
    assert_eq!(radius(Some(&given)), 43.0);
}

#[test]
fn lines_stored_from_last_to_first_are_turned_round() {
    let folder = Folder::new("turned");
    folder.write("probe.toml", TABLE.replace("frames_per_volume = 3", ""));
    let data: Vec<u8> = (0..24).collect();
    let path = folder.write("t.mha", image("4 2 3", "MET_UCHAR", "UltrasoundImageOrientation = FU\n", &data));
    assert_eq!(total(&path).unwrap()[..12], [4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15]);
}

#[test]
fn the_range_of_the_probe_file_is_in_the_units_of_the_recording() {
    let folder = Folder::new("range");
    folder
        .write("probe.toml", format!("{}[samples]\nrange = [-100, 400]\n", TABLE.replace("frames_per_volume = 3", "")));
    let path = folder.write("r.mha", image("4 2 3", "MET_SHORT", "", &[0; 48]));
    assert_eq!(open(&path).range(), [32668.0, 33168.0]);
}

/// Changes to a file: places and new bytes, and where to cut it.
fn damaged(mut whole: Vec<u8>, changes: &[(usize, u8)], cut: usize) -> Vec<u8> {
    for (at, byte) in changes {
        let at = at % whole.len();
        whole[at] = *byte;
    }
    whole.truncate(whole.len().saturating_sub(cut));
    whole
}

/// Reads the bytes under both endings and checks that what came out can have been in them.
fn read_hostile(folder: &Folder, bytes: &[u8]) {
    for name in ["x.mha", "x.vol"] {
        if let Ok(read) = total(&folder.write(name, bytes)) {
            assert!(read.len() <= bytes.len() * 1032 + (1 << 20), "{} bytes from {}", read.len(), bytes.len());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..600), kretz in any::<bool>()) {
        let folder = Folder::new("arbitrary");
        let start: &[u8] = if kretz { b"KRETZFILE 1.0   " } else { b"ObjectType = Image\n" };
        read_hostile(&folder, &bytes);
        read_hostile(&folder, &[start, &bytes].concat());
    }

    #[test]
    fn damaged_files_never_panic(
        changes in proptest::collection::vec((any::<usize>(), any::<u8>()), 0..6),
        signs in proptest::collection::vec((any::<usize>(), proptest::sample::select(b"0123456789 -.eLT\n=".to_vec())), 0..4),
        cut in 0usize..40,
        which in 0usize..4,
    ) {
        let folder = Folder::new("mutated");
        let sweep = fs::read(stored("wobbler-4dc7/sweep.mha")).unwrap();
        let header = String::from_utf8_lossy(&sweep[..464]).replace("400 128 31", "4 3 2");
        let data: Vec<u8> = (0..24).collect();
        let packed = zlib(&data);
        let whole = match which {
            0 => [header.as_bytes(), &data].concat(),
            1 => image("4 3 2", "MET_UCHAR", "CompressedData = True\nUltrasoundImageOrientation = FM\n", &packed),
            2 => image("4 3 1", "MET_SHORT", "HeaderSize = -1\nSeq_Frame0000_Timestamp = 1.5\n", &data),
            _ => kretz(&[-0.1, 0.0, 0.1], &[-0.1, 0.1], b""),
        };
        read_hostile(&folder, &damaged(damaged(whole, &changes, cut), &signs, 0));
    }
}
