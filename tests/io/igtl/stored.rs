//! The stored messages decode to the values in their bytes; the numbers here were read from hex dumps.

use super::messages::*;

/// 0x6553f100 seconds and 0x40000000 / 2^32.
const TIME: f64 = 1_700_000_000.25;

#[test]
fn a_volume_comes_with_both_header_versions() {
    for (file, device) in [("Image_Motor_v1.bin", "Image_Motor"), ("Image_v2_v2.bin", "Image_v2")] {
        let Message::Image(image) = whole(&stored(file)) else { panic!("{file} is no image") };
        assert_eq!((image.device.as_str(), image.time), (device, TIME));
        assert_eq!(image.size, [4, 3, 2]);
        assert_eq!(image.region, Region { offset: [0; 3], size: [4, 3, 2] });
        assert_eq!((image.scalar, image.components, image.coordinates), (Scalar::U8, 1, Coordinates::Lps));
        assert_eq!(image.axes, [[0.5, 0.0, 0.0], [0.0, 0.6, 0.0], [0.0, 0.0, 0.7]]);
        assert_eq!(image.centre, [10.75, 20.6, 30.35]);
        assert_eq!(image.bytes, (0..24).collect::<Vec<u8>>());
        // The first voxel of this volume is at (10, 20, 30): its middle less 1.5, 1 and 0.5 voxels.
        let first = image.index_to_mm(Coordinates::Lps).w_axis;
        for (a, b) in first.to_array().into_iter().zip([10.0, 20.0, 30.0, 1.0]) {
            assert!((a - b).abs() < 1e-6, "{first}");
        }
        let spacing = image.spacing();
        assert!((spacing[1] - 0.6).abs() < 1e-7 && (spacing[2] - 0.7).abs() < 1e-7, "{spacing:?}");
    }
}

#[test]
fn a_pose_comes_row_by_row() {
    let matrix = [[0.0, -1.0, 0.0, 1.5], [1.0, 0.0, 0.0, -2.25], [0.0, 0.0, 1.0, 30.0]];
    let expected = Transform { device: "ProbeToMotor".into(), time: TIME, matrix };
    assert_eq!(whole(&stored("ProbeToMotor_v1.bin")), Message::Transform(expected));
}

#[test]
fn a_text_comes() {
    let expected = Text { device: "Str".into(), time: TIME, text: "hello".into() };
    assert_eq!(whole(&stored("Str_v1.bin")), Message::Text(expected));
}

#[test]
fn three_tools_come() {
    let sine = f32::from_bits(0x3e12_4924);
    let cosine = f32::from_bits(0x3f7d_5fd1);
    let matrix = [[-1.0, 0.0, 0.0, 50.0], [0.0, sine, cosine, 0.0], [0.0, cosine, -f32::from_bits(0x3e12_4920), 50.0]];
    let tool = |name: &str, kind| Tool { name: name.into(), kind, matrix };
    let tools = vec![
        tool("Channel 0", ToolKind::Tracker),
        tool("Channel 1", ToolKind::SixD),
        tool("Channel 2", ToolKind::FiveD),
    ];
    let expected = TrackingData { device: "Tracker".into(), time: 0.0, tools };
    assert_eq!(whole(&stored("TDATA_ref_cpp_v1.bin")), Message::TrackingData(expected));
}

#[test]
fn what_version_1_files_hold_is_written_back_byte_for_byte() {
    for file in FILES {
        let bytes = stored(file);
        let written = encode(&whole(&bytes), Version::V1).unwrap();
        if file.starts_with("Image_v2") {
            assert_eq!(whole(&written), whole(&bytes));
        } else {
            assert_eq!(written, bytes, "{file}");
        }
    }
}
