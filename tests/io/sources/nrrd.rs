//! NRRD as other programs write it: axes of time and lists, units, detached headers, keys of PLUS.

use super::recordings::*;
use echolume::Source;
use flate2::write::GzEncoder;
use std::collections::BTreeMap;

/// Axes of the samples: x, y, z and time.
const SIZES: [usize; 4] = [3, 2, 2, 4];
const SPACE: &str = "space: left-posterior-superior\n";

/// The sample at a place.
fn sample([x, y, z, t]: [usize; 4]) -> u8 {
    (x + 3 * y + 6 * z + 12 * t) as u8
}

/// All samples with the axes in an order, fastest first.
fn samples(order: [usize; 4]) -> Vec<u8> {
    let sizes = order.map(|axis| SIZES[axis]);
    (0..sizes.iter().product())
        .map(|mut n| {
            let mut place = [0; 4];
            for (axis, size) in order.iter().zip(sizes) {
                (place[*axis], n) = (n % size, n / size);
            }
            sample(place)
        })
        .collect()
}

fn file(fields: &str, data: &[u8]) -> Vec<u8> {
    [format!("NRRD0005\ntype: uint8\nencoding: raw\n{fields}\n").as_bytes(), data].concat()
}

/// The bytes of each volume, slice by slice, and the time of its first slice.
fn volumes(path: impl AsRef<Path>) -> Vec<(Vec<u8>, Option<f64>)> {
    let mut all: BTreeMap<u32, BTreeMap<usize, Frame>> = BTreeMap::new();
    for frame in all_frames(&mut open(path)).unwrap() {
        all.entry(frame.volume).or_default().insert(frame.slice, frame);
    }
    let whole = |slices: BTreeMap<usize, Frame>| {
        let time = slices.values().next().and_then(|frame| frame.time);
        (slices.into_values().flat_map(|frame| frame.bytes).collect(), time)
    };
    all.into_values().map(whole).collect()
}

/// The volumes of [`samples`], with these times.
fn expected(times: [Option<f64>; 4]) -> Vec<(Vec<u8>, Option<f64>)> {
    samples([0, 1, 2, 3]).chunks(12).map(<[u8]>::to_vec).zip(times).collect()
}

fn said(path: impl AsRef<Path>) -> String {
    open(path).description().into_iter().map(|(title, text)| format!("{title}: {text}\n")).collect()
}

/// Size of the voxels and place of the first one, mm.
fn lattice(path: impl AsRef<Path>) -> ([f64; 3], [f64; 3]) {
    let world = open(path).world().expect("a place in the world");
    ([0, 1, 2].map(|n| world.axis(n).length()), world.origin().to_array())
}

fn near(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
}

#[test]
fn an_axis_of_time_may_stand_anywhere() {
    let folder = Folder::new("nrrd-time");
    let none = expected([None; 4]);
    let steps = expected([0.0, 0.04, 0.08, 0.12].map(Some));
    let cases = [
        // The orders of 3D Slicer, old and new; four numbers of a list are no colour.
        (
            "sizes: 4 3 2 2\nkinds: list domain domain domain\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n\
             labels: \"time\" \"\" \"\" \"\"\nunits: \"s\" \"\" \"\" \"\"\naxis 0 index values:=0 0.04 0.08 0.12\n",
            [3, 0, 1, 2],
            &steps,
        ),
        (
            "sizes: 3 2 2 4\nkinds: domain domain domain list\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n\
             units: \"\" \"\" \"\" \"ms\"\naxis 3 index type:=numeric\naxis 3 index values:=0 40 80 120\n",
            [0, 1, 2, 3],
            &steps,
        ),
        (
            "sizes: 3 2 4 2\nkinds: domain domain time domain\nspace directions: (1,0,0) (0,1,0) none (0,0,1)\n",
            [0, 1, 3, 2],
            &none,
        ),
        // Only the label says so.
        (
            "sizes: 4 3 2 2\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\nlabels: \"time\" \"\" \"\" \"\"\n",
            [3, 0, 1, 2],
            &none,
        ),
        // As ITK writes four dimensions, and with a unit of the fourth.
        (
            "sizes: 3 2 2 4\nkinds: domain domain domain domain\nspace dimension: 4\n\
             space directions: (1,0,0,0) (0,1,0,0) (0,0,1,0) (0,0,0,1)\nspace origin: (0,0,0,0)\n",
            [0, 1, 2, 3],
            &none,
        ),
        (
            "sizes: 4 3 2 2\nkinds: domain domain domain domain\nspace: scanner-xyz-time\nspace units: \"mm\" \"mm\" \"mm\" \"ms\"\n\
             space directions: (0,0,0,40) (1,0,0,0) (0,1,0,0) (0,0,1,0)\n",
            [3, 0, 1, 2],
            &steps,
        ),
        (
            "sizes: 3 2 2 4\nkinds: domain domain domain time\nspacings: 1 1 1 40\nunits: \"mm\" \"mm\" \"mm\" \"msec\"\n",
            [0, 1, 2, 3],
            &steps,
        ),
    ];
    for (fields, order, expected) in cases {
        let space = if fields.contains("space:") || fields.contains("space dimension") { "" } else { SPACE };
        let path = folder.write("t.nrrd", file(&format!("dimension: 4\n{space}{fields}"), &samples(order)));
        let found = volumes(&path);
        assert_eq!(found.len(), 4, "{fields}");
        for ((bytes, time), (whole, stamp)) in found.iter().zip(expected) {
            assert_eq!(bytes, whole, "{fields}");
            let is_near = time.zip(*stamp).map_or(time == stamp, |(a, b)| (a - b).abs() < 1e-9);
            assert!(is_near, "{fields}: {time:?}, not {stamp:?}");
        }
        // Back and forth.
        let mut recording = open(&path);
        for volume in [3, 1] {
            recording.skip_to_volume(volume).unwrap();
            assert_eq!(recording.next_frame().unwrap().unwrap().bytes, expected[volume].0[..6], "{fields}");
        }
    }
}

#[test]
fn colours_and_time_are_told_apart() {
    let folder = Folder::new("nrrd-colours");
    let grey: Vec<u8> = samples([3, 0, 1, 2]).into_iter().flat_map(|v| [v; 3]).collect();
    // Three numbers of a colour behind a list of four.
    let mut data = vec![0; grey.len()];
    for (n, value) in samples([3, 0, 1, 2]).into_iter().enumerate() {
        (0..3).for_each(|c| data[n / 4 * 12 + 4 * c + n % 4] = value);
    }
    let directions = "space directions: none none (1,0,0) (0,1,0) (0,0,1)\n";
    let kinds = "kinds: list RGB-color domain domain domain\n";
    let path =
        folder.write("c.nrrd", file(&format!("dimension: 5\n{SPACE}sizes: 4 3 3 2 2\n{kinds}{directions}"), &data));
    assert_eq!(volumes(&path), expected([None; 4]));
    let last = "space directions: none (1,0,0) (0,1,0) (0,0,1) none\nkinds: vector domain domain domain list\n";
    let data: Vec<u8> = samples([0, 1, 2, 3]).into_iter().flat_map(|v| [v; 3]).collect();
    let path = folder.write("c.nrrd", file(&format!("dimension: 5\n{SPACE}sizes: 3 3 2 2 4\n{last}"), &data));
    assert_eq!(volumes(&path), expected([None; 4]));
    assert!(said(&path).contains("3 numbers of kind vector are taken as colours"));
    // Nothing says what an axis is: a line says what it is taken for, or it is refused.
    let first = "space directions: none (1,0,0) (0,1,0) (0,0,1)\n";
    let path = folder.write("c.nrrd", file(&format!("dimension: 4\n{SPACE}sizes: 4 3 2 2\n{first}"), &[7; 48]));
    assert!(said(&path).contains("axis 0, of 4 numbers, has no kind: taken as colours"));
    let path = folder.write("c.nrrd", file("dimension: 4\nsizes: 3 2 2 4\n", &samples([0, 1, 2, 3])));
    assert_eq!(volumes(&path), expected([None; 4]));
    assert!(said(&path).contains("axis 3 is the fourth without a kind of its own: taken as volumes one after another"));
    let path = folder.write("c.nrrd", file("dimension: 3\nsizes: 3 2 2\nkinds: domain domain list\n", &[7; 12]));
    assert!(
        open(&path).volumes() == 1
            && said(&path).contains("axis 2 is a list beside two axes in space: taken as slices")
    );
    for (fields, named) in [
        ("sizes: 5 3 2 2\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n", "kinds: axis 0, of 5 numbers"),
        ("sizes: 4 3 2 2\nkinds: quaternion domain domain domain\n", "kinds: 'quaternion' is not read"),
        ("sizes: 3 3 2 2\nkinds: point domain domain domain\n", "kinds: 'point' is not read"),
        ("sizes: 4 3 2 2\nkinds: list time domain domain\n", "more than one axis of time or lists"),
        ("sizes: 4 3 2 2\nkinds: domain domain domain\n", "kinds: has 3 entries, must have 4"),
        ("sizes: 3 2 2 4\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n", "space directions: is not one vector"),
        ("sizes: 3 2 2 4\nspace directions: (1,0,0,1) (0,1,0,0) (0,0,1,0) (0,0,0,1)\n", "mixes space and time"),
        ("sizes: 3 2 2 4\nspace directions: (1,0,0) (0,1,0) (0,0,1) (0,0,0,1)\n", "vectors of different lengths"),
    ] {
        let error = total(folder.write("c.nrrd", file(&format!("dimension: 4\n{fields}"), &[7; 200]))).unwrap_err();
        assert!(error.contains(named), "{fields}: {error}");
    }
}

#[test]
fn index_values_without_a_unit_of_time_are_no_time_stamps() {
    let folder = Folder::new("nrrd-index");
    let kinds = "dimension: 4\nsizes: 3 2 2 4\nkinds: domain domain domain list\n";
    for (more, named) in [
        ("axis 3 index values:=0 1 2 3\n", "times: times of axis 3 have no unit: not used"),
        ("units: mm mm mm deg\naxis 3 index values:=0 1 2 3\n", "the unit 'deg', which is none of time"),
        ("units: mm mm mm s\naxis 3 index values:=0 1 2\n", "axis 3 index values are 3, but the axis has 4"),
        ("units: mm mm mm s\naxis 3 index values:=a b c d\n", "axis 3 index values are not all finite numbers"),
        ("units: mm mm mm s\naxis 3 index type:=text\naxis 3 index values:=0 1 2 3\n", "are text"),
        ("axis 2 index values:=0 1\n", "axis 2 index values are not used"),
        ("spacings: 1 1 1 0.5\n", "time steps: of axis 3 have no unit: not used"),
    ] {
        let path = folder.write("i.nrrd", file(&format!("{kinds}{more}"), &samples([0, 1, 2, 3])));
        assert_eq!(volumes(&path), expected([None; 4]), "{more}");
        assert!(said(&path).contains(named), "{more}: {}", said(&path));
    }
}

#[test]
fn lengths_have_the_unit_that_is_stated() {
    let folder = Folder::new("nrrd-units");
    let directions = "dimension: 3\nsizes: 3 2 2\nspace dimension: 3\nspace directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (4,0,0)\n";
    let spacings = "dimension: 3\nsizes: 3 2 2\nspacings: 2 2 2\n";
    for (unit, mm) in
        [("microns", 1e-3), ("\u{3bc}m", 1e-3), ("Meters", 1e3), ("inch", 25.4), ("cm", 10.0), ("mm", 1.0)]
    {
        let quoted = format!("\"{unit}\" \"{unit}\" \"{unit}\"\n");
        for fields in [
            format!("{directions}space units: {quoted}"),
            format!("{directions}units: {quoted}"),
            format!("{spacings}units: {unit} {unit} {unit}\n"),
        ] {
            let (spacing, origin) = lattice(folder.write("u.nrrd", file(&fields, &[0; 12])));
            assert!(near(spacing, [2.0 * mm; 3]), "{fields}: {spacing:?}");
            assert!(
                near(origin, [if fields.contains("origin") { 4.0 * mm } else { 0.0 }, 0.0, 0.0]),
                "{fields}: {origin:?}"
            );
        }
    }
    // Each coordinate has its own, and a byte of Latin-1 is a sign for micro.
    let mut fields = file(&format!("{directions}space units: mm ?m cm\n"), &[0; 12]);
    let at = fields.iter().position(|byte| *byte == b'?').unwrap();
    fields[at] = 0xb5;
    assert!(near(lattice(folder.write("u.nrrd", fields)).0, [2.0, 2e-3, 20.0]));
    for (more, named) in [
        ("space units: \"pixel\" \"pixel\" \"pixel\"\n", "units: the unit 'pixel' is not known, taken as mm"),
        ("space units: \"um\" \"\" \"um\"\n", "units: the unit of a coordinate is not stated, taken as mm"),
        ("", "units: not stated, taken as mm"),
    ] {
        assert!(said(folder.write("u.nrrd", file(&format!("{directions}{more}"), &[0; 12]))).contains(named), "{more}");
    }
    for (more, named) in [
        ("space units: mm mm\n", "space units: has 2 entries, must have 3"),
        ("units: um mm mm\n", "units: differ from axis to axis"),
    ] {
        let error = total(folder.write("u.nrrd", file(&format!("{directions}{more}"), &[0; 12]))).unwrap_err();
        assert!(error.contains(named), "{more}: {error}");
    }
}

#[test]
fn an_axis_begins_at_its_least_place() {
    let folder = Folder::new("nrrd-mins");
    let fields = "dimension: 3\nsizes: 3 2 2\nspacings: 2 nan 2\naxis mins: 1 1 1\naxis maxs: nan 5 nan\n";
    let path = folder.write("m.nrrd", file(&format!("{fields}centerings: cell cell node\n"), &[0; 12]));
    assert_eq!(lattice(&path), ([2.0, 2.0, 2.0], [2.0, 2.0, 1.0]));
    let path = folder.write("m.nrrd", file("dimension: 3\nsizes: 3 2 2\nspacings: 2 nan 2\n", &[0; 12]));
    assert!(said(&path).contains("spacing: not stated of axis 1, taken as 1 mm"));
    let path = folder.write("m.nrrd", file("dimension: 3\nsizes: 3 2 2\nspacings: 2 2 nan\n", &[0; 12]));
    assert!(said(&path).contains("axis 2, of 2 numbers, has no kind: taken as volumes one after another"));
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn a_detached_header_names_one_file_or_several() {
    let folder = Folder::new("nrrd-files");
    fs::create_dir(folder.join("sub")).unwrap();
    let all = samples([0, 1, 2, 3]);
    for (n, volume) in all.chunks(12).enumerate() {
        folder.write(&format!("sub/v 0{n}.raw"), [b"two\nlines\n", volume, b"tail"].concat());
        folder.write(&format!("v{}.gz", 7 - n), gzip(volume));
    }
    folder.write("50%d.raw", &all);
    let list = (0..4).map(|n| format!("./sub/v 0{n}.raw\n")).collect::<String>();
    let packed = (0..4).map(|n| format!("v{}.gz\n", 7 - n)).collect::<String>();
    let skips = "encoding: raw\nline skip: 1\nbyte skip: 6\n";
    for fields in [
        format!("{skips}data file: LIST\n{list}"),
        format!("{skips}data file: LIST 4\n{list}"),
        format!("{skips}data file: sub/v %02d.raw 0 3 1\n"),
        "encoding: gzip\ndata file: v%d.gz 7 4 -1 3\n".into(),
        format!("encoding: gzip\r\ndata file: LIST 3\r\n{}", packed.replace('\n', "\r\n")),
        "encoding: raw\ndata file: 50%d.raw\n".into(),
        "encoding: raw\ndata file: ./50%d.raw\n".into(),
    ] {
        let kinds = "dimension: 4\nsizes: 3 2 2 4\nkinds: domain domain domain time\n";
        let path = folder.write("a.nhdr", format!("NRRD0004\ntype: uint8\n{kinds}{fields}"));
        assert_eq!(volumes(&path), expected([None; 4]), "{fields}");
        let mut recording = open(&path);
        recording.skip_to_volume(2).unwrap();
        assert_eq!(recording.next_frame().unwrap().unwrap().bytes, all[24..30], "{fields}");
        let files = recording.files();
        assert!(
            fields.contains("50%") || files.iter().filter(|file| file.to_string_lossy().contains('v')).count() >= 4
        );
    }
    for (fields, named) in [
        ("encoding: raw\ndata file: LIST\n", "data file: names 0 files"),
        ("encoding: raw\ndata file: LIST\nsub/v 00.raw\n", "data file: names 1 files of 3 axes"),
        ("encoding: raw\ndata file: LIST 9\nsub/v 00.raw\n", "data file: states 9 axes"),
        ("encoding: raw\ndata file: v%d.gz 0 3 0\n", "by steps of 0"),
        ("encoding: raw\ndata file: v%s.gz 0 3 1\n", "is no pattern of file names"),
        ("encoding: raw\ndata file: v%d.gz\n", "must have a first and a last number and a step"),
        ("encoding: raw\ndata file: absent%d.raw 0 3 1\n", "'absent0.raw' cannot be read"),
        ("encoding: raw\ndata file: ../sub/v%d.raw 0 3 1\n", "same folder or below it"),
        ("encoding: raw\ndata file: LIST\n/etc/passwd\na\nb\nc\n", "same folder or below it"),
        ("encoding: raw\nline skip: 9\ndata file: sub/v 00.raw\n", "line skip: is 9, but 3 lines are there"),
        ("encoding: raw\nline skip: x\ndata file: sub/v 00.raw\n", "line skip: 'x' is not a number of lines"),
        ("encoding: raw\nbyte skip: -2\ndata file: sub/v 00.raw\n", "byte skip: '-2' is not possible here"),
    ] {
        let kinds = "dimension: 4\nsizes: 3 2 2 4\nkinds: domain domain domain time\n";
        let error = total(folder.write("a.nhdr", format!("NRRD0004\ntype: uint8\n{kinds}{fields}"))).unwrap_err();
        assert!(error.contains(named), "{fields}: {error}");
    }
    folder.write("v4.gz", b"");
    let kinds = "dimension: 4\nsizes: 3 2 2 4\nkinds: domain domain domain time\nencoding: gzip\n";
    let header = format!("NRRD0004\ntype: uint8\n{kinds}data file: v%d.gz 7 4 -1\n");
    assert!(total(folder.write("a.nhdr", header)).unwrap_err().contains("cut short"));
}

#[test]
fn numbers_of_two_bytes_need_a_byte_order() {
    let folder = Folder::new("nrrd-endian");
    let good = "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 2\nencoding: raw\nendian: big\n\n";
    assert!(total(folder.write("e.nrrd", [good.as_bytes(), &[0; 24]].concat())).is_ok());
    let bad = good.replace("endian: big\n", "");
    let error = total(folder.write("e.nrrd", [bad.as_bytes(), &[0; 24]].concat())).unwrap_err();
    assert!(error.contains("endian: is missing: numbers of 2 bytes need a byte order"), "{error}");
}

/// Two pictures of 3 x 2 pixels as PLUS writes them.
fn pictures(keys: &str) -> Vec<u8> {
    let fields = "dimension: 3\nsizes: 3 2 2\nkinds: domain domain list\nspace dimension: 2\nspace directions: (0.5,0) (0,0.5) none\n";
    file(&format!("{fields}{keys}"), &(0..12).collect::<Vec<u8>>())
}

#[test]
fn keys_of_plus_are_those_of_its_metaimages() {
    let folder = Folder::new("nrrd-plus");
    let second = |word: &str| {
        let keys = format!(
            "ultrasound image orientation:={word}\nSeq_Frame0000_Timestamp:=1.5\nSeq_Frame0001_Timestamp:=1.75\n"
        );
        let found = volumes(folder.write("p.nrrd", pictures(&keys)));
        assert_eq!((found.len(), found[1].1), (2, Some(1.75)));
        found[1].0.clone()
    };
    for (words, drawn) in [
        ("MF MFA", [6, 7, 8, 9, 10, 11]),
        ("UF UFA UFD", [8, 7, 6, 11, 10, 9]),
        ("MN MNA", [9, 10, 11, 6, 7, 8]),
        ("UN UNA", [11, 10, 9, 8, 7, 6]),
    ] {
        words.split(' ').for_each(|word| assert_eq!(second(word), drawn, "{word}"));
    }
    let with = |keys: &str| folder.write("p.nrrd", pictures(keys));
    let tracked = said(with(
        "Seq_Frame0000_ProbeToTrackerTransform:=1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1\n\
         Seq_Frame0000_ProbeToTrackerTransformStatus:=OK\nSeq_Frame0001_ImageStatus:=INVALID\n",
    ));
    assert!(tracked.contains("tracking: ProbeToTracker") && tracked.contains("frames not OK: 1 by"), "{tracked}");
    let sized = with("Seq_Frame0000_ElementSpacing:=0.1 0.2 1\nSeq_Frame0001_ElementSpacing:=0.1 0.2 1\n");
    assert!(
        near(lattice(&sized).0, [0.1, 0.2, 1.0])
            && said(&sized).contains("ElementSpacing of the frames is 0.1 x 0.2 x 1 mm")
    );
    let odd = said(with("ultrasound image orientation:=MX\nSeq_Frame0000_Timestamp:=1\n"));
    assert!(odd.contains("orientation 'MX' is not known: the axes are drawn as stored"), "{odd}");
    for (keys, named) in [
        ("ultrasound image orientation:=NU\n", "ultrasound image orientation: 'NU' is not read"),
        ("ultrasound image type:=RF_REAL\n", "ultrasound image type: 'RF_REAL' is not read"),
        ("ultrasound image orientation:=FM\nultrasound image type:=BRIGHTNESS\n", "--probe"),
        ("Seq_Frame0001_Timestamp:=soon\n", "Seq_Frame0001_Timestamp: 'soon' is not a finite number"),
        (
            "Seq_Frame0001_ElementSpacing:=0 1 1\n",
            "Seq_Frame0001_ElementSpacing: '0 1 1' is not 2 or 3 numbers above 0",
        ),
    ] {
        let error = total(with(keys)).unwrap_err();
        assert!(error.contains(named), "{keys}: {error}");
    }
}

fn refused(path: impl AsRef<Path>) -> String {
    let error = Recording::open(path.as_ref(), None).err().expect("refused").to_string();
    assert_eq!(error.lines().count(), 1, "{error}");
    error
}

#[test]
fn colours_that_are_no_rgb_and_numbers_as_text_are_refused() {
    let folder = Folder::new("nrrd-refused");
    for kind in ["HSV-color", "XYZ-color"] {
        let fields = format!("dimension: 4\nsizes: 3 2 2 4\nkinds: {kind} domain domain domain\n");
        let error = refused(folder.write("colours.nrrd", file(&fields, &samples([0, 1, 2, 3]))));
        assert!(error.contains(&format!("kinds: '{}' is not read", kind.to_lowercase())), "{error}");
    }
    for encoding in ["hex", "text", "txt", "ascii", "ASCII"] {
        let header = format!("NRRD0005\ntype: uint8\ndimension: 2\nsizes: 2 2\nencoding: {encoding}\n\n");
        let error = refused(folder.write("text.nrrd", header + "1 2\n3 4\n"));
        let said = format!("encoding: '{}' is not read: raw, gzip and bzip2 are", encoding.to_lowercase());
        assert!(error.contains(&said), "{error}");
    }
}

/// Of segments that overlap 3D Slicer writes layers, as an axis before those of space.
#[test]
fn layers_of_a_segmentation_are_not_taken_for_volumes_in_time() {
    let folder = Folder::new("nrrd-layers");
    let keys = "Segment0_ID:=Segment_1\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n";
    let space = format!("{SPACE}space directions: none (1,0,0) (0,1,0) (0,0,1)\nkinds: list domain domain domain\n");
    let fields = format!("dimension: 4\nsizes: 4 3 2 2\n{space}");
    let layers = file(&format!("{fields}{keys}"), &samples([3, 0, 1, 2]));
    let error = refused(folder.write("layers.seg.nrrd", layers));
    assert!(error.contains("kinds: make axis 0 layers of segments that overlap"), "{error}");
    // The same axis without segments is time, and one layer is a volume.
    assert_eq!(open(folder.write("list.nrrd", file(&fields, &samples([3, 0, 1, 2])))).volumes(), 4);
    let one = file(&format!("dimension: 4\nsizes: 1 3 2 2\n{space}{keys}"), &samples([0, 1, 2, 3])[..12]);
    assert_eq!(volumes(folder.write("one.seg.nrrd", one)), [(samples([0, 1, 2, 3])[..12].to_vec(), None)]);
}

#[test]
fn times_of_colours_may_be_counted_without_the_axis_of_colours() {
    let folder = Folder::new("nrrd-colour-times");
    // 3D Slicer writes the list of a sequence of colours as axis 4, and its values as those of axis 3.
    let fields = |values: &str| {
        format!(
            "{SPACE}dimension: 5\nsizes: 3 2 2 1 2\nkinds: RGB-color domain domain domain list\n\
             space directions: none (1,0,0) (0,1,0) (0,0,1) none\nunits: \"\" \"\" \"\" \"\" \"s\"\naxis 3 index values:={values}\n"
        )
    };
    let times = |values: &str| {
        let path = folder.write("file.seq.nrrd", file(&fields(values), &[9; 24]));
        let said = said(&path);
        (volumes(&path).into_iter().map(|(_, time)| time).collect::<Vec<_>>(), said)
    };
    let (found, said) = times("0 0.5");
    assert_eq!(found, [Some(0.0), Some(0.5)], "{said}");
    assert!(said.contains("taken as those of axis 4"), "{said}");
    let (found, said) = times("0 0.5 1");
    assert_eq!(found, [None, None], "{said}");
    assert!(said.contains("axis 3 index values are not used"), "{said}");
}
