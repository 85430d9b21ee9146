//! What each control does, in one or two sentences: the tooltips of the view.

use super::command::{Tool, Viewpoint};
use crate::scene::{Layout, MeasureKind, Mode};

/// By name of a slider: what it does.
const SLIDERS: [(&str, &str); 53] = [
    ("Gain", "Makes the picture brighter or darker as a whole."),
    ("Contrast", "Spreads bright and dark apart."),
    ("Gamma", "Brightens (above 1) or darkens the middle tones; black and white stay."),
    ("Threshold", "Echoes weaker than this are not shown: raise it until fluid and noise are gone."),
    ("Window low", "Echoes up to this value are black or transparent."),
    ("Window high", "Echoes from this value on have full brightness."),
    ("Start depth", "Hides everything nearer to the probe, such as the wall in front of the face."),
    (
        "Depth of cut",
        "How deep the last cut is, from where its contour meets the region. 0: it goes through everything.",
    ),
    (
        "Auto render start",
        "Starts rendering at the fluid before the face: the wall in front of it goes. Where no fluid is found, nothing changes.",
    ),
    ("Start offset", "How far behind the near face of the fluid rendering starts: more removes more."),
    ("Start smoothing", "Smooths the surface at which rendering starts."),
    ("Planes zoom", "Enlarges the planes."),
    ("Slab", "Thickness of the planes: a thick slab shows less speckle and more of what runs along it."),
    ("Spacing", "Distance between neighbouring slices. 0: they divide the region evenly."),
    ("Planes azimuth", "Turns the planes about the depth axis."),
    ("Planes tilt", "Tilts the planes about the lateral axis."),
    ("Planes roll", "Turns the planes about the elevation axis."),
    ("Planes window low", "In the planes, echoes up to this value are black."),
    ("Planes window high", "In the planes, echoes from this value on are white."),
    ("Cut left", "Cuts the block from its left face."),
    ("Cut right", "Cuts the block from its right face."),
    ("Cut near", "Cuts the block from the face next to the probe."),
    ("Cut far", "Cuts the block from its deepest face."),
    ("Cut bottom", "Cuts the block from the first slice on."),
    ("Cut top", "Cuts the block from the last slice on."),
    ("Face shading", "Darkens faces of the block that are turned away."),
    ("Opacity", "How much tissue hides what is behind it."),
    ("Opacity of a hit", "How much the first surface hides what is behind it."),
    ("Veil", "How much of the volume is laid over the surface."),
    ("Volume threshold", "The threshold of the volume layer alone."),
    ("Volume window low", "In the volume layer, echoes up to this value are transparent."),
    ("Volume window high", "In the volume layer, echoes from this value on have full brightness."),
    ("Volume start depth", "The start depth of the volume layer alone."),
    ("Surface median", "Removes single outliers from the surface."),
    ("Surface smoothing", "Smooths the surface and keeps its steps."),
    ("Surface edge", "Steps of the surface beyond this height stay sharp."),
    ("Ambient", "Light from everywhere: brightens shaded places."),
    ("Diffuse", "Strength of the lamp on matt skin."),
    ("Specular", "Strength of glossy highlights."),
    ("Light depth", "How deep light enters tissue."),
    ("Light warmth", "How much tissue reddens the light in it."),
    ("Exposure", "Brightness of the light inside tissue."),
    ("Shadow", "How dark cast shadows are."),
    ("Occlusion", "How dark folds and corners are."),
    ("Translucency", "How much light shines through skin."),
    ("Smoothing", "Smooths the volume: less speckle, softer outlines. The volume is filtered again."),
    ("Median", "Removes speckle from each slice and keeps its edges. The volume is filtered again."),
    ("Speckle", "Averages speckle within tissue of one brightness. The volume is filtered again."),
    ("Speckle, enhanced", "The same with a window that follows the tissue. The volume is filtered again."),
    ("Picture speckle", "Averages speckle in the finished picture."),
    ("Step", "Distance of samples along a ray: short is exact, long is fast. 0: one slice pixel."),
    ("Field of view", "0 draws without perspective; more draws near things larger."),
    ("Rays a pixel", "More rays give smoother edges and take longer."),
];

/// What a slider does.
pub(super) fn of_slider(name: &str) -> &'static str {
    SLIDERS.iter().find(|(known, _)| *known == name).map_or("", |(_, hint)| *hint)
}

/// What a mode shows.
pub(super) fn of_mode(mode: Mode) -> &'static str {
    match mode {
        Mode::Surface => "The first surface, lit: faces, limbs.",
        Mode::Volume => "Tissue as a lit, partly transparent volume.",
        Mode::Mixed => "The surface behind a transparent layer of the volume.",
        Mode::Mip => "The strongest echo along each ray: bone.",
        Mode::MinIp => "The weakest echo along each ray: vessels, fluid.",
        Mode::Mean => "The mean echo along each ray, as in an X-ray picture.",
        Mode::Plane => "One plane through the volume.",
        Mode::Orthogonal => "Planes A, B and C, perpendicular to each other.",
        Mode::Tomography => "Parallel slices at equal distances.",
        Mode::Cube => "The volume as a solid block with echoes on its faces.",
    }
}

/// What a layout shows.
pub(super) fn of_layout(layout: Layout) -> &'static str {
    match layout {
        Layout::Single => "One picture.",
        Layout::Four => "Three planes and the rendering.",
        Layout::Pair => "Volume and surface side by side.",
    }
}

/// What a drag does.
pub(super) fn of_tool(tool: Tool) -> &'static str {
    match tool {
        Tool::Rotate => "Drag turns the view.",
        Tool::Light => "Drag moves the lamp.",
        Tool::Region => {
            "Drag moves the nearest face of the region; on the planes of 4-up a side of its box, or all of it; on plane A also the green start line. (G)"
        }
        Tool::Clip => "Drag up cuts away what is nearer to you.",
        Tool::Cut => "Drag round what is in the way: it is cut away along the view. (F)",
        Tool::Brush => {
            "Drag over what is in the way: what is near the surface there is removed. Modes Surface and Mixed. (Z)"
        }
        Tool::Plane => "Drag or click moves the planes.",
        Tool::Measure(kind) => of_measure(kind),
    }
}

/// Where a viewpoint is.
pub(super) fn of_viewpoint(viewpoint: Viewpoint) -> &'static str {
    match viewpoint {
        Viewpoint::Front => "Seen from the probe, upright. (Ctrl+1)",
        Viewpoint::Left => "Seen from the left of the front view; the patient's sides are the letters. (Ctrl+2)",
        Viewpoint::Right => "Seen from the right of the front view; the patient's sides are the letters. (Ctrl+3)",
        Viewpoint::Top => "Seen from the top of the front view. (Ctrl+4)",
    }
}

/// How something is measured.
pub(super) fn of_measure(kind: MeasureKind) -> &'static str {
    match kind {
        MeasureKind::Distance => {
            "Distance in mm: click both ends, or drag. On a rendering: from surface to surface. (M)"
        }
        MeasureKind::Angle => "Angle: click the end of a leg, the vertex, the end of the other leg. (N)",
        MeasureKind::Ellipse => "Ellipse: click both ends of one axis, then the end of the other. (E)",
        MeasureKind::Trace => "Area in cm²: drag round the outline, or click its points and press Enter. (O)",
        MeasureKind::Surface => "Length along the surface of a rendering: click both ends. (U)",
        MeasureKind::Volume => {
            "Volume in cm³: trace the outline, step or turn the plane, trace again; Enter ends it. (W)"
        }
        MeasureKind::Threshold => "Volume of all echoes in the region from the threshold on, in cm³. (K)",
        MeasureKind::Text => "Text: click its place, then type; Enter ends it. (I)",
        MeasureKind::Arrow => "Arrow: click what it points to, then its other end, then type. (Y)",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_slider_has_a_hint_and_every_hint_a_slider() {
        let known: Vec<&str> = crate::ui::sliders::SLIDERS.iter().map(|slider| slider.name).collect();
        for name in &known {
            assert!(of_slider(name).ends_with('.'), "{name} has no hint");
        }
        for (name, _) in SLIDERS {
            assert!(known.contains(&name), "{name} is no slider");
        }
    }
}
