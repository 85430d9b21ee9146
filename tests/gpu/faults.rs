//! What happens when the device refuses or is lost: an error that says what was being done, and nothing left behind.

use crate::common::*;
use ash::vk;
use echolume::gpu::faults::Seam;
use echolume::gpu::{GpuError, Options, Renderer};
use echolume::probe::Geometry;
use echolume::scene::Scene;

fn small() -> Scene {
    let toml = "mode = 'sr'\npicture = { size = [16, 16] }\nslices = { pixels = 20 }\ndistance = { median = 3 }";
    scene(Geometry::Sweep(wobbler()), BYTES, toml)
}

#[test]
fn out_of_memory_at_every_allocation_names_what_was_made_and_leaves_a_working_device() {
    let device = Device::new();
    let mut refused = 0;
    for after in 0.. {
        device.faults.inject(Seam::Allocate, after, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        match Renderer::new(&device, small(), &Options::default()) {
            Ok(_) => break,
            Err(error) => {
                let text = error.to_string();
                assert!(text.starts_with("create ") && text.ends_with("out of device memory"), "{text}");
                refused += 1;
            }
        }
    }
    assert!(refused > 10, "{refused}");
    // The planned failure of the last round was never reached.
    device.faults.inject(Seam::Wait, u32::MAX, vk::Result::SUCCESS);
    let frames = body_frames(&small(), |p| if p.y > 40.0 { 0.9 } else { 0.0 });
    rendered(&device, small(), &frames).picture().expect("the device still works");
}

/// Wherever memory runs out while a scene changes, the renderer says so, draws nothing wrong, and the next change heals it.
#[test]
fn a_change_that_runs_out_of_memory_is_healed_by_the_next_one() {
    let device = Device::new();
    let frames = body_frames(&small(), |p| if p.y > 40.0 { 0.9 } else { 0.0 });
    let toml = "mode = 'sr'\npicture = { size = [24, 20] }\nslices = { pixels = 26, median = true }
                distance = { median = 3, bilateral = { pixels = 1.0, distance = 1.0 } }";
    let larger = scene(Geometry::Sweep(wobbler()), BYTES, toml);
    let expected = rendered(&device, larger.clone(), &frames).picture().expect("picture");
    let mut refused = 0;
    for after in 0.. {
        let mut renderer = rendered(&device, small(), &frames);
        renderer.picture().expect("picture");
        device.faults.inject(Seam::Allocate, after, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        let changed = renderer.change(larger.clone());
        device.faults.inject(Seam::Wait, u32::MAX, vk::Result::SUCCESS);
        match changed {
            Ok(_) => {
                send(&mut renderer, &frames, 0);
                assert_eq!(renderer.picture().expect("picture"), expected);
                break;
            }
            Err(_) => {
                refused += 1;
                assert!(matches!(renderer.picture(), Err(GpuError::Broken(_))));
                let frame = vec![0; renderer.frame_bytes()];
                assert!(matches!(renderer.frame(0, &frame, 0), Err(GpuError::Broken(_))));
                renderer.change(larger.clone()).expect("healed");
                send(&mut renderer, &frames, 0);
                assert_eq!(renderer.picture().expect("picture"), expected);
            }
        }
    }
    assert!(refused > 10, "{refused}");
}

/// A frame whose submission failed leaves its successors ordered: the next operation waits for everything.
#[test]
fn after_a_failed_submission_the_same_work_can_be_sent_again() {
    let device = Device::new();
    let frames = body_frames(&small(), |p| if p.y > 40.0 { 0.9 } else { 0.0 });
    let expected = rendered(&device, small(), &frames).picture().expect("picture");
    for after in 0..12 {
        let mut renderer = Renderer::new(&device, small(), &Options::default()).expect("renderer");
        device.faults.inject(Seam::Submit, after, vk::Result::ERROR_OUT_OF_HOST_MEMORY);
        for (k, frame) in frames.iter().enumerate() {
            let bytes = frame.encode(frame_format(&small()));
            if renderer.frame(k as u32, &bytes, 0).is_err() {
                renderer.frame(k as u32, &bytes, 0).expect("again");
            }
        }
        renderer.show(0).expect("show");
        let picture = renderer.picture().or_else(|_| renderer.picture()).expect("again");
        assert_eq!(picture, expected);
        device.faults.inject(Seam::Wait, u32::MAX, vk::Result::SUCCESS);
    }
}

#[test]
fn a_volume_image_that_is_not_there_is_refused() {
    let device = Device::new();
    let mut renderer = Renderer::new(&device, small(), &Options::default()).expect("renderer");
    let frame = vec![0; renderer.frame_bytes()];
    assert!(matches!(renderer.frame(0, &frame, 1), Err(GpuError::VolumeImage { image: 1, images: 1 })));
    assert!(renderer.show(3).is_err());
}

#[test]
fn a_lost_device_and_a_time_out_say_what_ran() {
    let device = Device::new();
    let frames = body_frames(&small(), |_| 0.5);
    let mut renderer = rendered(&device, small(), &frames);
    device.faults.inject(Seam::Submit, 0, vk::Result::ERROR_DEVICE_LOST);
    let error = renderer.picture().expect_err("lost");
    assert!(error.is_device_lost() && error.to_string().contains("picture"), "{error}");

    let mut renderer = rendered(&device, small(), &frames);
    renderer.picture().expect("picture");
    renderer.show(0).expect("show");
    device.faults.inject(Seam::Wait, 1, vk::Result::TIMEOUT);
    let error = renderer.picture().expect_err("timed out");
    assert!(matches!(error, GpuError::TimedOut { .. }), "{error}");
    assert!(error.to_string().contains("picture"), "{error}");
}

#[test]
fn a_frame_of_the_wrong_size_or_place_and_a_picture_beyond_the_device_are_refused() {
    let device = Device::new();
    let mut renderer = Renderer::new(&device, small(), &Options::default()).expect("renderer");
    assert!(matches!(renderer.frame(0, &[0; 7], 0), Err(GpuError::FrameSize { got: 7, .. })));
    let frame = vec![0; renderer.frame_bytes()];
    assert!(matches!(renderer.frame(99, &frame, 0), Err(GpuError::FrameSlice { slice: 99, slices: 9 })));
    renderer.frame(8, &frame, 0).expect("the last slice");

    let limit = device.limits.max_image_dimension3_d as usize;
    let wide = scene(cartesian([limit + 1, 2, 2]), BYTES, "mode = 'vr'\npicture = { size = [4, 4] }");
    let error = Renderer::new(&device, wide, &Options::default()).err().expect("too wide").to_string();
    assert!(error.contains("volume") && error.contains(&limit.to_string()), "{error}");
}
