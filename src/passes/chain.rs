//! Filter chains: which slot the n-th filter of a stage reads and writes. Two spare slots take turns between the first and
//! the last, and a filter that is not needed leaves no copy behind.

use super::filter::aos;
use super::slots::Format;
use super::{DispatchArgs, PASSES, Pass, RUN, Slot};
use crate::scene::{Estimator, Layout, Scene};
use crate::source::StoredType;

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
    fn position(&self, scene: &Scene, name: &str, args: &DispatchArgs) -> (u32, u32) {
        let (mut before, mut all) = (0, 0);
        for pass in self.needed().filter(|p| p.is_needed(scene)) {
            if pass.name == name {
                before = all + args.iteration / dispatches(pass.name);
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

    fn link(&self, scene: &Scene, name: &str, args: &DispatchArgs) -> (Slot, Slot) {
        let (link, all) = self.position(scene, name, args);
        let from = if link == 0 { (self.first)(scene) } else { self.output(scene, link - 1, all) };
        (from, self.output(scene, link, all))
    }

    fn end(&self, scene: &Scene) -> Slot {
        let (_, all) = self.position(scene, "", &DispatchArgs::default());
        if all == 0 { (self.first)(scene) } else { self.output(scene, all - 1, all) }
    }
}

/// Where frames are copied as they arrive, if there is nothing to do to them: slices of a Cartesian volume whose stored values are what
/// the texture stores, and no filter looks at them. Floats may be beyond 0..1, so they go through a pass.
pub fn copied(scene: &Scene) -> Option<Slot> {
    let last = SLICES.last?(scene);
    let same = match scene.input.stored {
        StoredType::U8 => last.format(scene) == Format::R8 && scene.input.range == [0.0, 255.0],
        StoredType::U16 => last.format(scene) == Format::R16 && scene.input.range == [0.0, 65535.0],
        StoredType::F32 => false,
    };
    let is_filtered = SLICES.needed().any(|pass| pass.name != "load_slice" && pass.is_needed(scene));
    (same && scene.probe().is_none() && !is_filtered).then_some(last)
}

/// What stages 2 and 3 render into: the picture itself, unless several rays make a pixel or one makes four, or planes stand beside it.
pub fn rendered(scene: &Scene) -> Slot {
    let is_picture =
        scene.settings.ray.rays == 1 && !scene.settings.ray.half && scene.settings.layout == Layout::Single;
    if is_picture || scene.is_flat() { Slot::Picture } else { Slot::Rendered }
}

/// What a pass of stage 1 reads and writes.
pub fn slice_link(scene: &Scene, name: &str, args: &DispatchArgs) -> (Slot, Slot) {
    SLICES.link(scene, name, args)
}

/// Columns and rows of a slice that a pass makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    pub first: [u32; 2],
    pub size: [u32; 2],
}

/// Texels along an edge that a workgroup of the slices' filters makes, eight invocations of a run each: a rectangle begins and ends
/// with whole ones, or at the slice's border.
const WORKGROUP: u32 = 8 * RUN;

/// Passes over the slices of the volume, behind those that run on each frame: nothing looks further than what they make.
const BEHIND: [&str; 2] = ["gaussian_elevation", "quads"];

/// What a pass over slices has to make of each: what is seen, and as far around it as the filters behind it look. None for
/// passes that are not cut: lines of a frame, and the rows and columns of AOS, each of which depends on all of its own.
pub fn rectangle(scene: &Scene, pass: &str, args: &DispatchArgs) -> Option<Rectangle> {
    let whole = Rectangle { first: [0; 2], size: scene.grid.size };
    match pass {
        "growth_slice" => return Some(whole),
        "aos_slice" => return None,
        _ if BEHIND.contains(&pass) => {}
        _ if !SLICES.passes.contains(&pass) => return None,
        _ => {}
    }
    let (link, _) = SLICES.position(scene, pass, args);
    let mut around = [0, 0];
    let mut before = 0;
    for filter in SLICES.needed().filter(|p| p.is_needed(scene) && !BEHIND.contains(&pass)) {
        let links = (filter.repeat)(scene) / dispatches(filter.name);
        let behind = (before + links).saturating_sub((link + 1).max(before));
        before += links;
        match reach(scene, filter.name) {
            _ if behind == 0 => {}
            None => return Some(whole),
            Some(reach) => (0..2).for_each(|axis| around[axis] += behind * reach[axis]),
        }
    }
    let cut = |axis: usize| {
        let (low, high) = (scene.seen.low[axis], scene.seen.high[axis]);
        let first = low.saturating_sub(around[axis]) / WORKGROUP * WORKGROUP;
        let end = high.saturating_add(around[axis]).next_multiple_of(WORKGROUP).min(scene.grid.size[axis]);
        (first, end - first)
    };
    let (columns, rows) = (cut(0), cut(1));
    Some(Rectangle { first: [columns.0, rows.0], size: [columns.1, rows.1] })
}

/// How many columns and rows away a filter of slices looks at each step; none: from border to border.
fn reach(scene: &Scene, name: &str) -> Option<[u32; 2]> {
    let slices = &scene.settings.slices;
    let estimator = |kind| if kind == Estimator::NagaoMatsuyama { 2 } else { 1 };
    let [lateral, depth, _] = scene.smoothing_radius();
    Some(match name {
        "median_slice" | "perona_malik_slice" => [1; 2],
        "estimator_slice" => [slices.estimator.map_or(0, estimator); 2],
        "sigma_slice" => [slices.sigma.map_or(0, |s| s.window / 2); 2],
        "enhanced_sigma_slice" => {
            [slices.enhanced_sigma.map_or(0, |e| (e.largest / 2).max(estimator(scene.centre(e)))); 2]
        }
        "aos_slice" => return None,
        "gaussian_lateral" => [lateral, 0],
        "gaussian_depth" => [0, depth],
        _ => [0; 2],
    })
}

/// Whether a pass of stage 1 writes into the 3D texture itself.
pub fn writes_volume(scene: &Scene, name: &str, args: &DispatchArgs) -> bool {
    matches!(SLICES.link(scene, name, args).1, Slot::Volume | Slot::SharpVolume)
}

pub fn distance_link(scene: &Scene, name: &str, args: &DispatchArgs) -> (Slot, Slot) {
    DISTANCES.link(scene, name, args)
}

/// The distance map after its filters.
pub fn distance_end(scene: &Scene) -> Slot {
    DISTANCES.end(scene)
}

pub fn picture_link(scene: &Scene, name: &str, args: &DispatchArgs) -> (Slot, Slot) {
    PICTURES.link(scene, name, args)
}

/// The picture after its filters.
pub fn picture_end(scene: &Scene) -> Slot {
    PICTURES.end(scene)
}
