//! What is said of a device that is lost or has no memory left, and how work goes on with smaller bands.

use crate::common::gpu::*;
use ash::vk;
use echolume::low_level::gpu::faults::{InjectedFailure, InjectionPoint};
use echolume::low_level::gpu::lost_device::{Checkpoint, LossReport};
use echolume::low_level::gpu::{Bands, GpuError, Renderer, RendererOptions};
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::Scene;

fn small() -> Scene {
    scene(Geometry::Sweep(wobbler()), BYTES, "mode = 'mip'\npicture = { size = [24, 24] }\nslices = { pixels = 40 }")
}

fn drawn(device: &Device, scene: Scene, options: &RendererOptions) -> Renderer {
    let frames = body_frames(&scene, |p| if p.y > 40.0 { 0.9 } else { 0.1 });
    let mut renderer = Renderer::new(device, scene, options).expect("renderer");
    send(&mut renderer, &frames, 0);
    renderer
}

/// Prevents a lost device of which only the loss is said, although its driver knows more.
#[test]
fn the_error_of_a_lost_device_has_the_report_of_its_driver() {
    let device = Device::alone();
    let report = LossReport {
        description: "GPU hang".into(),
        addresses: vec![vk::DeviceFaultAddressInfoEXT {
            address_type: vk::DeviceFaultAddressTypeEXT::READ_INVALID,
            reported_address: 0xabc0_0000,
            address_precision: 4096,
        }],
        codes: Vec::new(),
        checkpoints: vec![Checkpoint { queue: 0, pass: "raycast_projection", is_done: false }],
    };
    for point in [InjectionPoint::Submit, InjectionPoint::Wait] {
        let lost = |reports: bool| {
            let mut renderer = drawn(&device, small(), &RendererOptions::default());
            renderer.take_times().expect("idle");
            device.faults.report_loss(if reports { report.clone() } else { LossReport::default() });
            device.faults.inject(point, 0, InjectedFailure::ERROR_DEVICE_LOST);
            renderer.picture().expect_err("lost")
        };
        let (plain, error) = (lost(false), lost(true));
        assert!(plain.is_device_lost() && error.is_device_lost(), "{plain}; {error}");
        assert!(plain.to_string().ends_with("the device was lost"), "{plain}");
        let line = error.to_string();
        let reported = "the device was lost; its driver reports: GPU hang; invalid read at 0xabc00000 within 4096 bytes; \
                        queue 0 had begun 'raycast_projection'";
        assert!(line.ends_with(reported), "{line}");
        device.faults.forget();
    }
}

/// Prevents allocations that push this program's or another's memory out of the device.
#[test]
fn an_allocation_over_the_memory_budget_is_refused_before_it_is_made() {
    let device = Device::alone();
    device.faults.limit_memory(4 << 20);
    let error = Renderer::new(&device, small(), &RendererOptions { volume_images: 3, ..Default::default() });
    assert!(error.is_ok(), "each of its allocations is below the budget");
    drop(error);
    let large = scene(
        Geometry::Sweep(wobbler()),
        BYTES,
        "mode = 'mip'\npicture = { size = [2048, 2048] }\nslices = { pixels = 40 }",
    );
    let before = device.allocated();
    let options = RendererOptions { readback: false, ..RendererOptions::default() };
    let error = Renderer::new(&device, large, &options).err().expect("over the budget");
    assert!(matches!(error, GpuError::Budget { needed, budget: 4_194_304, .. } if needed > 4 << 20), "{error}");
    let line = error.to_string();
    assert!(line.contains("(2048x2048") && line.contains("budget of this device's memory is 4 MiB"), "{line}");
    assert_eq!(device.allocated(), before, "what was made before is freed");
}

/// Prevents a device that is lost to a watchdog again and again by the same picture: on each loss the bands become smaller.
#[test]
fn every_loss_halves_the_bands() {
    let device = Device::alone();
    let toml = "mode = 'mip'\npicture = { size = [512, 512] }\nslices = { pixels = 40 }";
    let rays = |losses| {
        let bands = Bands::Measured { losses };
        let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml);
        let mut renderer = drawn(&device, scene, &RendererOptions { bands, ..Default::default() });
        let dispatched = renderer.dispatch_extents(|r| r.picture()).expect("picture");
        dispatched.iter().filter(|(name, _)| *name == "raycast_projection").count()
    };
    assert_eq!([1, 2, 4].map(rays), [2, 4, 16]);
    assert_eq!(rays(0), 1, "512 x 512 rays are the first band on every device");
}
