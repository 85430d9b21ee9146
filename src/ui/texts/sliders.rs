//! Names of the groups of sliders, and names and hints of sliders that belong to no single setting; those of others are at their settings.

pub(crate) const IMAGE: &str = "Image";
pub(crate) const FILTERS: &str = "Filters";
pub const SURFACE: &str = "Surface";
pub const VOLUME: &str = "Volume";
pub(crate) const QUALITY: &str = "Quality";
/// The name of the switch `unveil.enabled`.
pub(crate) const AUTO_RENDER_START: &str = "Auto render start";
pub(crate) const THRESHOLD_OF_MODE: [&str; 2] =
    [super::THRESHOLD, "Echoes weaker than this are not shown: raise it until fluid and noise are gone."];
pub(crate) const WINDOW_LOW: [&str; 2] = ["Window low", "Echoes up to this value are black or transparent."];
pub(crate) const WINDOW_HIGH: [&str; 2] = ["Window high", "Echoes from this value on have full brightness."];
pub(crate) const START_DEPTH: [&str; 2] =
    ["Start depth", "Hides everything nearer to the probe, such as the wall in front of the face."];
pub(crate) const DEPTH_OF_CUT: [&str; 2] = [
    "Depth of cut",
    "How deep the last cut is, from where its contour meets the region. 0: it goes through everything.",
];
pub(crate) const PLANES_WINDOW_LOW: [&str; 2] =
    ["Planes window low", "In the planes, echoes up to this value are black."];
pub(crate) const PLANES_WINDOW_HIGH: [&str; 2] =
    ["Planes window high", "In the planes, echoes from this value on are white."];
pub(crate) const OPACITY: [&str; 2] = ["Opacity", "How much tissue hides what is behind it."];
pub(crate) const VOLUME_WINDOW_LOW: [&str; 2] =
    ["Volume window low", "In the volume layer, echoes up to this value are transparent."];
pub(crate) const VOLUME_WINDOW_HIGH: [&str; 2] =
    ["Volume window high", "In the volume layer, echoes from this value on have full brightness."];
pub(crate) const SMOOTHING: [&str; 2] =
    ["Smoothing", "Smooths the volume: less speckle, softer outlines. The volume is filtered again."];
