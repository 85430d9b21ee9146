//! How the volume is stored where no setting says it.

use crate::common::probes::voxels;
use crate::common::scenes::{BYTES, scene};
use echolume::low_level::passes::Slot;
use echolume::low_level::passes::slots::Format;
use echolume::low_level::plan::Plan;
use echolume::low_level::scene::{DeviceFacts, Scene};

fn stored(toml: &str, truncates_halves: bool) -> Scene {
    let scene = scene(voxels([12, 10, 8]), BYTES, toml);
    Scene { device: DeviceFacts { truncates_halves, ..scene.device }, ..scene }
}

/// A device that rounds keeps half floats, and so its pictures; one that truncates gets what is more accurate, where all values fit into it.
#[test]
fn auto_is_r16_on_a_device_that_truncates_halves_where_no_filter_leaves_0_to_1() {
    let of = |toml: &str, truncates| Slot::Volume.format(&stored(toml, truncates));
    assert_eq!((of("", false), of("", true)), (Format::R16f, Format::R16));
    assert_eq!((of("slices.format = 'auto'", false), of("slices.format = 'auto'", true)), (Format::R16f, Format::R16));
    for (set, format) in [("r8", Format::R8), ("r16", Format::R16), ("r16f", Format::R16f), ("r32f", Format::R32f)] {
        for truncates in [false, true] {
            assert_eq!(of(&format!("slices.format = '{set}'"), truncates), format, "{set}");
        }
    }
    for (scheme, format) in
        [("explicit", Format::R16), ("aos", Format::R16), ("rkl1", Format::R16), ("aos-richardson", Format::R16f)]
    {
        assert_eq!(of(&format!("slices.perona_malik = {{ scheme = '{scheme}' }}"), true), format, "{scheme}");
    }
}

#[test]
fn explain_says_how_the_volume_is_stored_and_why() {
    let said = |toml: &str, truncates| {
        let scene = stored(toml, truncates);
        let text = Plan::new(&scene).explain(&scene);
        text.lines().find(|line| line.starts_with("format of the volume: ")).expect("a line").to_string()
    };
    assert_eq!(said("", true), "format of the volume: r16, the device truncates what it stores as r16f");
    assert_eq!(said("", false), "format of the volume: r16f, no device that truncates what it stores so");
    assert_eq!(said("slices.format = 'r16f'", true), "format of the volume: r16f, as set");
    let overshooting = said("slices.perona_malik = { scheme = 'aos-richardson' }", true);
    assert!(
        overshooting.starts_with("format of the volume: r16f, ") && overshooting.contains("aos-richardson"),
        "{overshooting}"
    );
}
