//! Filter chains: which slot the n-th filter of a stage reads and writes. Two spare slots take turns between the first and
//! the last, and a filter that is not needed leaves no copy behind.

use super::filter::aos;
use super::{PASSES, Pass, Slot, Turn};
use crate::scene::{Layout, Scene};

/// The slices of stage 1, the distance maps of stage 3, and the pictures of stage 4.
struct Chain {
    /// The links in order.
    passes: &'static [&'static str],
    first: fn(&Scene) -> Slot,
    spare: [Slot; 2],
    /// What the last link writes; none: whatever spare it is.
    last: Option<fn(&Scene) -> Slot>,
}

/// Every pass of stage 1 that runs on each frame. The first reads the frame itself.
const SLICES: Chain = Chain {
    passes: &[
        "load_slice",
        "scan_convert",
        "median_slice",
        "estimator_slice",
        "sigma_slice",
        "enhanced_sigma_slice",
        "perona_malik_slice",
        "aos_slice",
        "gaussian_lateral",
        "gaussian_depth",
    ],
    first: |_| Slot::Frames,
    spare: [Slot::SliceA, Slot::SliceB],
    last: Some(|scene| if scene.smoothing()[2] > 0.0 { Slot::SharpVolume } else { Slot::Volume }),
};

const DISTANCES: Chain = Chain {
    passes: &[
        "median_distance",
        "bilateral_distance",
        "sigma_distance",
        "enhanced_sigma_distance",
        "perona_malik_distance",
    ],
    first: |_| Slot::Distance,
    spare: [Slot::DistanceA, Slot::DistanceB],
    last: None,
};

const PICTURES: Chain = Chain {
    passes: &["sigma_picture", "enhanced_sigma_picture", "perona_malik_picture", "aos_picture"],
    first: |_| Slot::Picture,
    spare: [Slot::SmoothPicture, Slot::SmoothPictureB],
    last: None,
};

/// Dispatches that make one link: what lies between them stays within the pass.
fn dispatches(name: &str) -> u32 {
    match name {
        "aos_slice" | "aos_picture" => aos::DISPATCHES,
        _ => 1,
    }
}

impl Chain {
    fn needed(&self) -> impl Iterator<Item = &'static Pass> {
        PASSES.iter().filter(|p| self.passes.contains(&p.name))
    }

    /// Links before the one that this pass's iteration works on, and links in all.
    fn position(&self, scene: &Scene, name: &str, turn: &Turn) -> (u32, u32) {
        let (mut before, mut all) = (0, 0);
        for pass in self.needed().filter(|p| p.is_needed(scene)) {
            if pass.name == name {
                before = all + turn.iteration / dispatches(pass.name);
            }
            all += (pass.repeat)(scene) / dispatches(pass.name);
        }
        (before, all)
    }

    fn output(&self, scene: &Scene, link: u32, all: u32) -> Slot {
        match self.last {
            Some(last) if link + 1 == all => last(scene),
            _ => self.spare[link as usize % 2],
        }
    }

    fn link(&self, scene: &Scene, name: &str, turn: &Turn) -> (Slot, Slot) {
        let (link, all) = self.position(scene, name, turn);
        let from = if link == 0 { (self.first)(scene) } else { self.output(scene, link - 1, all) };
        (from, self.output(scene, link, all))
    }

    fn end(&self, scene: &Scene) -> Slot {
        let (_, all) = self.position(scene, "", &Turn::default());
        if all == 0 { (self.first)(scene) } else { self.output(scene, all - 1, all) }
    }
}

/// What stages 2 and 3 render into: the picture itself, unless several rays make a pixel or planes stand beside it.
pub fn rendered(scene: &Scene) -> Slot {
    let is_picture = scene.settings.ray.rays == 1 && scene.settings.layout == Layout::Single;
    if is_picture || scene.is_flat() { Slot::Picture } else { Slot::Rendered }
}

/// What a pass of stage 1 reads and writes.
pub fn slice_link(scene: &Scene, name: &str, turn: &Turn) -> (Slot, Slot) {
    SLICES.link(scene, name, turn)
}

/// Whether a pass of stage 1 writes into the 3D texture itself.
pub fn writes_volume(scene: &Scene, name: &str, turn: &Turn) -> bool {
    matches!(SLICES.link(scene, name, turn).1, Slot::Volume | Slot::SharpVolume)
}

pub fn distance_link(scene: &Scene, name: &str, turn: &Turn) -> (Slot, Slot) {
    DISTANCES.link(scene, name, turn)
}

/// The distance map after its filters.
pub fn distance_end(scene: &Scene) -> Slot {
    DISTANCES.end(scene)
}

pub fn picture_link(scene: &Scene, name: &str, turn: &Turn) -> (Slot, Slot) {
    PICTURES.link(scene, name, turn)
}

/// The picture after its filters.
pub fn picture_end(scene: &Scene) -> Slot {
    PICTURES.end(scene)
}
