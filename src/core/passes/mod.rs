//! The passes: each declared in one file with its parameters and its f64 reference, and all of them listed, in the order in
//! which they run, in [`PASSES`]. Everything else (bindings, barriers, time stamps, labels, tests) follows from these.

pub mod chain;
pub mod components;
pub mod cut;
pub mod device_limits;
mod edge_coverage;
pub mod fault_injection;
pub mod floating;
pub mod interface_check;
pub mod lookup_tables;
pub mod pass;
pub mod slots;
pub mod texels;
pub mod times;
pub mod unveil;

pub mod filter {
    pub mod aos;
    pub mod aos_richardson;
    pub mod bilateral;
    pub mod enhanced_sigma;
    pub mod estimator;
    pub mod gaussian;
    pub mod median;
    pub mod perona_malik;
    pub mod rkl1;
    pub mod sigma;
}
pub mod raycast {
    pub mod cap;
    pub mod composite;
    pub mod consistent;
    pub mod cube;
    mod detector;
    pub mod planes;
    pub mod projection;
    pub mod ray;
    pub(crate) mod refine;
    pub mod still;
    pub mod surface;
    pub(crate) mod surface_and_volume;
    pub mod survey;
    pub mod tolerance;
    pub mod volume;
}
pub mod empty_space;
pub mod labels;
pub mod light_volume;
pub mod postprocess;
pub mod preprocess;
pub mod shade;

pub use pass::*;
pub use times::PassTime;

/// All passes, in the order in which a frame and a picture run them.
pub const PASSES: &[Pass] = &[
    preprocess::CONDITION,
    preprocess::LOAD_SLICE,
    preprocess::SCAN_CONVERT,
    filter::median::SLICE,
    filter::estimator::SLICE,
    filter::sigma::SLICE,
    filter::enhanced_sigma::GROWTH,
    filter::enhanced_sigma::SLICE,
    filter::perona_malik::SLICE,
    filter::aos::SLICE,
    filter::aos_richardson::SLICE,
    filter::rkl1::SLICE,
    filter::gaussian::LATERAL,
    filter::gaussian::DEPTH,
    preprocess::SECTION_LOAD_SLICE,
    preprocess::SECTION_SCAN_CONVERT,
    filter::gaussian::SECTION_LATERAL,
    filter::gaussian::SECTION_DEPTH,
    filter::gaussian::ELEVATION,
    filter::gaussian::SECTION_ELEVATION,
    floating::DROP,
    cut::PASS,
    preprocess::PACKED_NEIGHBOURS,
    empty_space::TILE_RANGES,
    empty_space::BRICK_RANGES,
    empty_space::CLASSIFY_SURFACE,
    empty_space::DISTANCE_SURFACE,
    raycast::cap::PASS,
    raycast::surface::PASS,
    raycast::consistent::CANDIDATES,
    raycast::consistent::PATHS,
    raycast::consistent::CHOICE,
    empty_space::CLASSIFY_VOLUME,
    empty_space::DISTANCE_VOLUME,
    light_volume::MATTER,
    light_volume::REDUCE,
    light_volume::PROPAGATE,
    light_volume::PROPAGATE_BACK,
    light_volume::DIFFUSE,
    light_volume::AMBIENT,
    light_volume::SHADE,
    raycast::surface_and_volume::PASS,
    raycast::volume::PASS,
    raycast::refine::MARK_EDGES,
    raycast::volume::REFINED,
    raycast::tolerance::FIRST,
    raycast::tolerance::ENLARGE,
    raycast::tolerance::LIST,
    raycast::tolerance::REFINE,
    raycast::still::MAJORANTS,
    raycast::still::BEGIN,
    raycast::still::PATHS,
    raycast::still::RESOLVE,
    raycast::projection::PASS,
    raycast::planes::PASS,
    raycast::planes::TONED,
    raycast::cube::PASS,
    filter::median::DISTANCE,
    filter::bilateral::DISTANCE,
    filter::sigma::DISTANCE,
    filter::enhanced_sigma::DISTANCE,
    filter::perona_malik::DISTANCE,
    shade::SHADOW,
    shade::OCCLUSION,
    shade::LIGHT,
    postprocess::ASSEMBLE,
    postprocess::ASSEMBLE_TONED,
    filter::sigma::PICTURE,
    filter::enhanced_sigma::PICTURE,
    filter::perona_malik::PICTURE,
    filter::aos::PICTURE,
    postprocess::TONE,
    labels::PASS,
];

/// A measured interval on the device or the host. `begin` and `end` are ns since the timing of the renderer began.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    pub name: &'static str,
    pub on_device: bool,
    pub begin: f64,
    pub end: f64,
    /// Number of runs of the pass that the interval holds: one for each frame of a batch.
    pub runs: u32,
    /// Number of shader invocations that the device counted. None if it counts none.
    pub invocations: Option<u64>,
}

/// The pass of that name. None if there is none.
pub fn by_name(name: &str) -> Option<&'static Pass> {
    PASSES.iter().find(|p| p.name == name)
}
