//! Frames hold the values of the file, whatever its type, byte order and compression.

use super::recordings::*;
use echolume::Source;
#[test]
fn both_forms_of_the_wobbler_sweep_are_one_sweep() {
    let folder = Folder::new("both-forms");
    // Away from the probe file, each must know its own geometry.
    let copies = ["sweep.mha", "sweep.vol"].map(|n| folder.write(n, fs::read(stored("wobbler-4dc7").join(n)).unwrap()));
    let paths = [copies[0].as_ref(), copies[1].as_ref(), Path::new(SWEEP)];
    let mut recordings = paths.map(open);
    assert_eq!(
        recordings.each_ref().map(|r| r.format()),
        ["MetaImage pre-scan sweep", "Kretz volume", "MetaImage pre-scan sweep"]
    );
    for recording in &recordings {
        assert_eq!((recording.volumes(), recording.frames_per_volume()), (1, 31));
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
    let mut polar = open(stored("ultrasonix-curvilinear/brightness.mha"));
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

    let mut pictures = open(stored("ultrasonix-curvilinear/scan-converted.mha"));
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
    let mut compressed =
        Recording::open(&stored("ultrasonix-curvilinear/brightness.mha"), Some(probe.as_ref())).unwrap();
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
    // Seeking to a volume gives the same frames as reading up to it, forwards and backwards.
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
    let mut bone = open(stored("bone-l14/bone.mha"));
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
    let [low, high] = open(folder.write("n.mha", image("2 2 2", "MET_FLOAT", "", &nothing))).range();
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
    let falling = folder.write("f.vol", kretz(&[-0.3, -0.1, 0.25], &[0.4, 0.0, 0.1], b""));
    assert!(total(&falling).unwrap_err().contains("C300,0001"));
}

#[test]
fn missing_parts_of_a_kretz_file_are_named() {
    let folder = Folder::new("kretz");
    let wavelet = folder.write("w.vol", kretz(&[-0.1, 0.1], &[-0.1, 0.1], &item(2, 0x1100, b"xy")));
    assert!(total(&wavelet).unwrap_err().contains("wavelet"));
    let several = open(folder.write("4d.vol", kretz(&[-0.1, 0.1], &[-0.1, 0.1], &item(0xd600, 1, b"xy"))));
    assert!(several.description().iter().any(|(title, _)| title == "4D"));
    // Without tables the voxels are Cartesian, the radial step apart.
    let plain = kretz(&[-0.1, 0.1], &[-0.1, 0.1], b"");
    let at = |tag: &[u8]| plain.windows(4).position(|w| w == tag).unwrap();
    let (tables, voxels) = (at(&[0x00, 0xc3, 1, 0]), at(&[0x00, 0xd0, 1, 0]));
    let path = folder.write("c.vol", [&plain[..tables], &plain[voxels..]].concat());
    let Geometry::Cartesian(grid) = open(&path).geometry(0) else { panic!("there are no angles") };
    assert_eq!((grid.size, grid.spacing), ([4, 2, 2], [0.5; 3]));
}

#[test]
fn volumes_in_time_of_a_kretz_file_are_all_read() {
    let folder = Folder::new("kretz-4d");
    let (lines, sweep) = (&[-0.1, 0.1], &[-0.2, 0.0, 0.3]);
    let each = 4 * 2 * 3;
    let voxels: Vec<u8> = (0..3 * each).map(|v| 100 + v as u8).collect();
    let both = kretz(lines, sweep, &[item(0xd600, 1, &voxels), item(0xd000, 0x101, &[0; 9])].concat());
    let still_at = both.windows(4).position(|w| w == [0x00, 0xd0, 1, 0]).unwrap();
    let alone = [&both[..still_at], &item(0xffff, 0xffff, b"")].concat();
    for (name, bytes, beside) in [("both.vol", &both, true), ("alone.vol", &alone, false)] {
        let path = folder.write(name, bytes);
        let mut recording = open(&path);
        assert_eq!((recording.volumes(), recording.frames_per_volume()), (3, 3));
        assert_eq!(all_bytes(&path).unwrap(), voxels);
        recording.skip_to_volume(2).unwrap();
        let frame = recording.next_frame().unwrap().unwrap();
        assert_eq!((frame.volume, frame.slice, &frame.bytes[..]), (2, 0, &voxels[2 * each..][..8]));
        let said = format!("{:?}", recording.description());
        assert!(said.contains("3 volumes in time") && said.contains("still one") == beside, "{said}");
        assert!(said.contains("colour flow; not read"), "{said}");
    }
    // From the last slice to the first: each volume.
    let path = folder.write("falling.vol", kretz(lines, &[0.3, 0.0, -0.2], &item(0xd600, 1, &voxels)));
    let slices: Vec<usize> = all_frames(&mut open(&path)).unwrap().iter().map(|frame| frame.slice).collect();
    assert_eq!(slices, [2, 1, 0, 2, 1, 0, 2, 1, 0]);
    // Bytes that are no whole volumes are another form.
    let odd = [&both[..still_at], &item(0xffff, 0xffff, b"")].concat();
    let cut = odd.windows(4).position(|w| w == [0x00, 0xd6, 1, 0]).unwrap();
    let odd = [&odd[..cut], &item(0xd600, 1, &voxels[1..]), &item(0xffff, 0xffff, b"")].concat();
    let fault = total(folder.write("odd.vol", odd)).unwrap_err();
    assert!(fault.contains("D600,0001") && fault.contains("71 bytes are no whole number of volumes of 24"), "{fault}");
}

#[test]
fn no_patient_field_is_ever_shown() {
    let folder = Folder::new("patient");
    let whole = kretz(&[-0.1, 0.1], &[-0.1, 0.1], b"");
    let mut shown = format!("{:?}", open(folder.write("p.vol", &whole)).description());
    // Without the end mark of 8 bytes it is read.
    for cut in (0..whole.len()).filter(|cut| *cut != whole.len() - 8) {
        shown += &total(folder.write("p.vol", &whole[..cut])).unwrap_err();
    }
    let more = "PatientName = SECRET^PATIENT\nSeq_Frame0000_PatientName = SECRET\nComment = SECRET\n";
    let whole = image("2 2 2", "MET_UCHAR", more, &[1; 8]);
    shown += &format!("{:?}", open(folder.write("p.mha", &whole)).description());
    for cut in 0..whole.len() {
        shown += &total(folder.write("p.mha", &whole[..cut])).unwrap_err();
    }
    assert!(!shown.contains("SECRET"), "{shown}");
}

#[test]
fn line_ends_of_another_system_do_not_shift_the_data() {
    let folder = Folder::new("line-ends");
    let header = String::from_utf8(image("4 3   2", "MET_UCHAR", "\n  \n", b"")).unwrap().replace('\n', "\r\n");
    let data: Vec<u8> = (0..24).collect();
    assert_eq!(total(folder.write("l.mha", [header.as_bytes(), &data].concat())), Ok(data));
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
    assert_eq!(total(header("HeaderSize = -1\n")), Ok(data.clone()));
    assert_eq!(total(header("HeaderSize = 7\n")), Ok(data.clone()));
    assert!(total(header("HeaderSize = 8\n")).unwrap_err().contains("23 of 24"));
    assert_eq!(total(header("")).unwrap()[..7], [9; 7]);
    assert!(open(header("")).description().iter().any(|(title, _)| title == "more data"));
}

/// Angles from the last line or frame to the first describe the same volume as the frames in their order.
#[test]
fn falling_kretz_tables_and_a_missing_end_mark_are_read() {
    let folder = Folder::new("falling");
    let lines = [-0.1, 0.0, 0.1];
    let rising = kretz(&lines, &[-0.1, 0.1], b"");
    let falling = kretz(&[0.1, 0.0, -0.1], &[0.1, -0.1], b"");
    let places = |bytes: &[u8]| {
        let mut recording = open(folder.write("f.vol", bytes));
        let mut slices: Vec<_> = all_frames(&mut recording).unwrap().into_iter().map(|f| (f.slice, f.bytes)).collect();
        slices.sort();
        (recording.geometry(0), slices)
    };
    let ((forth, ahead), (back, behind)) = (places(&rising), places(&falling));
    assert_eq!(forth, back);
    // The voxels count up in the order of the file: the last line of the last frame is stored last.
    assert_eq!(ahead[0].1[..4], [0, 1, 2, 3]);
    assert_eq!(behind[1].1[8..], [0, 1, 2, 3], "the first stored line has the largest angles");
    let mixed = kretz(&[0.1, -0.1, 0.0], &[-0.1, 0.1], b"");
    assert!(total(folder.write("m.vol", mixed)).unwrap_err().contains("rise or fall"));
    let open_ended = &rising[..rising.len() - 8];
    assert_eq!(places(open_ended), places(&rising));
    let packed = |bytes: &[u8]| {
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packed.write_all(bytes).and_then(|()| packed.finish()).expect("packed")
    };
    for bytes in [open_ended.to_vec(), packed(open_ended)] {
        assert!(open(folder.write("e.vol", bytes)).description().iter().any(|(title, _)| title == "end mark"));
    }
    // Within an item it is cut short, packed or not.
    let cut = &open_ended[..open_ended.len() - 3];
    for bytes in
        [cut.to_vec(), packed(cut), [open_ended, &[1, 2, 3]].concat(), packed(&[open_ended, &[1, 2, 3]].concat())]
    {
        let error = total(folder.write("c.vol", bytes)).unwrap_err();
        assert!(error.contains("cut short") && error.lines().count() == 1, "{error}");
    }
}
