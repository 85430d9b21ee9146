//! Any bytes give frames or one line that names the fault.

use super::recordings::*;
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
        ("raw.nrrd", fs::read(stored("formats/raw-ras.nrrd")).unwrap()),
        ("gzip.nrrd", fs::read(stored("formats/gzip-lps.nrrd")).unwrap()),
        ("bzip2.nrrd", fs::read(stored("formats/bzip2-las.nrrd")).unwrap()),
        ("one.nii", fs::read(stored("formats/oblique.nii")).unwrap()),
        ("two.nii", fs::read(stored("formats/big-endian-4d.nii")).unwrap()),
        ("one.nii.gz", fs::read(stored("formats/mirrored.nii.gz")).unwrap()),
        ("frames.dcm", fs::read(stored("dicom/palette.dcm")).unwrap()),
        ("planes.dcm", fs::read(stored("dicom/enhanced-flow.dcm")).unwrap()),
        ("rle.dcm", fs::read(stored("dicom/colours-rle.dcm")).unwrap()),
        ("jpeg.dcm", fs::read(stored("dicom/colours-jpeg.dcm")).unwrap()),
        ("kretz.dcm", fs::read(stored("dicom/kretz.dcm")).unwrap()),
        ("packed.mha.gz", fs::read(stored("formats/packed.mha.gz")).unwrap()),
    ];
    for (name, whole) in &small {
        assert!(total(folder.write(name, whole)).is_ok(), "{name}");
        // A Kretz file may lack its last item, the end mark of 8 bytes.
        let last_item = if name.ends_with(".vol") { whole.len() - 8 } else { whole.len() };
        for cut in (0..whole.len()).filter(|cut| *cut != last_item) {
            assert!(total(folder.write(name, &whole[..cut])).is_err(), "{name} cut at {cut} of {}", whole.len());
        }
    }
    for (name, whole, header) in [("sweep.mha", sweep, 470), ("sweep.vol", volume, 1500)] {
        let data = (1..20).map(|i| i * (whole.len() - 1) / 19);
        for cut in (0..header).chain(data) {
            let error = total(folder.write(name, &whole[..cut])).unwrap_err();
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
            // A few bits between the last code and the checksum have no meaning.
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
        ("NDims = 3", "NDims = 4", "DimSize: has 3 entries, but NDims is 4"),
        ("MET_UCHAR", "MET_ASCII_CHAR", "ElementType"),
        ("LOCAL", "LIST", "ElementDataFile"),
        ("LOCAL", "../secret.raw", "ElementDataFile"),
        ("LOCAL", "/etc/passwd", "ElementDataFile"),
        ("LOCAL", "..", "ElementDataFile"),
        ("LOCAL", "a%03d.raw 1 9 1", "ElementDataFile"),
        ("NDims = 3", "NDims = 3\nElementNumberOfChannels = 2", "ElementNumberOfChannels"),
        ("NDims = 3", "NDims = 3\nElementNumberOfChannels = 3", "data: cut short, 24 of 72 bytes are there"),
        ("NDims = 3", "NDims = 3\nTransformMatrix = 1 0 0 1 0 0 0 0 1", "TransformMatrix: has axes 0.00 degrees apart"),
        ("NDims = 3", "NDims = 3\nTransformMatrix = 1 0 0 0 0 0 0 0 1", "TransformMatrix: has an axis of no length"),
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
        let error = total(folder.write("n.mha", good.replacen(from, to, 1))).unwrap_err();
        assert!(error.contains(named), "{from} -> {to}: {error}");
    }
    let endless = "Comment = x\n".repeat(200_000);
    assert!(total(folder.write("n.mha", endless)).unwrap_err().contains("ElementDataFile"));
    assert!(total(folder.write("n.png", b"\x89PNG")).unwrap_err().contains("MetaImage"));
    let of_folder = total(&folder.0).unwrap_err();
    assert!(of_folder.contains("n.png: file: is no picture of a known format"), "{of_folder}");
    assert!(total(folder.join("absent.mha")).unwrap_err().contains("absent.mha"));
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

/// Reads the bytes under both file endings and checks that no more frames come out than the bytes can hold.
fn read_hostile(folder: &Folder, bytes: &[u8]) {
    for name in ["x.mha", "x.vol", "x.nrrd", "x.nii.gz"] {
        if let Ok(read) = total(folder.write(name, bytes)) {
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
        which in 0usize..8,
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
            3 => kretz(&[-0.1, 0.0, 0.1], &[-0.1, 0.1], b""),
            4 => fs::read(stored("formats/raw-ras.nrrd")).unwrap(),
            5 => fs::read(stored("formats/gzip-lps.nrrd")).unwrap(),
            6 => fs::read(stored("formats/oblique.nii")).unwrap(),
            _ => fs::read(stored("formats/big-endian-4d.nii")).unwrap(),
        };
        read_hostile(&folder, &damaged(damaged(whole, &changes, cut), &signs, 0));
    }
}
