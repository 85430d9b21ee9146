//! What each control does, in one or two sentences: the tooltips of the view.

use crate::command::{Tool, Viewpoint};
use crate::scene::{Layout, MeasureKind, Mode};
use crate::texts;

/// By name of a slider: what it does.
const SLIDERS: [(&str, &str); 56] = [
    (texts::GAIN, "Makes the picture brighter or darker as a whole."),
    (texts::CONTRAST, "Spreads bright and dark apart."),
    (texts::GAMMA, "Brightens (above 1) or darkens the middle tones; black and white stay."),
    (texts::THRESHOLD, "Echoes weaker than this are not shown: raise it until fluid and noise are gone."),
    (texts::WINDOW_LOW, "Echoes up to this value are black or transparent."),
    (texts::WINDOW_HIGH, "Echoes from this value on have full brightness."),
    (texts::START_DEPTH, "Hides everything nearer to the probe, such as the wall in front of the face."),
    (
        texts::DEPTH_OF_CUT,
        "How deep the last cut is, from where its contour meets the region. 0: it goes through everything.",
    ),
    (
        texts::AUTO_RENDER_START,
        "Starts rendering at the fluid before the face: the wall in front of it goes. Where no fluid is found, nothing changes.",
    ),
    (
        texts::CLIP_ECHOES,
        "Tissue that a clip plane cuts shows its echoes there, as planes do. Off: what is behind it is drawn, lit. Fluid is open either way.",
    ),
    (
        texts::CLIP_THRESHOLD,
        "Weaker echoes stay open on the clip face: lower it to fill dark tissue, such as the brain. 0: what is rendered as solid is filled.",
    ),
    (texts::START_OFFSET, "How far behind the near face of the fluid rendering starts: more removes more."),
    (texts::START_SMOOTHING, "Smooths the surface at which rendering starts."),
    (texts::PLANES_ZOOM, "Enlarges the planes."),
    (texts::SLAB, "Thickness of the planes: a thick slab shows less speckle and more of what runs along it."),
    (texts::SPACING, "Distance between neighbouring slices. 0: they divide the region evenly."),
    (texts::PLANES_AZIMUTH, "Turns the planes about the depth axis."),
    (texts::PLANES_TILT, "Tilts the planes about the lateral axis."),
    (texts::PLANES_ROLL, "Turns the planes about the elevation axis."),
    (texts::PLANES_WINDOW_LOW, "In the planes, echoes up to this value are black."),
    (texts::PLANES_WINDOW_HIGH, "In the planes, echoes from this value on are white."),
    (texts::CUT_LEFT, "Cuts the block from its left face."),
    (texts::CUT_RIGHT, "Cuts the block from its right face."),
    (texts::CUT_NEAR, "Cuts the block from the face next to the probe."),
    (texts::CUT_FAR, "Cuts the block from its deepest face."),
    (texts::CUT_BOTTOM, "Cuts the block from the first slice on."),
    (texts::CUT_TOP, "Cuts the block from the last slice on."),
    (texts::FACE_SHADING, "Darkens faces of the block that are turned away."),
    (texts::OPACITY, "How much tissue hides what is behind it."),
    (texts::OPACITY_OF_A_HIT, "How much the first surface hides what is behind it."),
    (texts::VEIL, "How much of the volume is laid over the surface."),
    (texts::VOLUME_THRESHOLD, "The threshold of the volume layer alone."),
    (texts::VOLUME_WINDOW_LOW, "In the volume layer, echoes up to this value are transparent."),
    (texts::VOLUME_WINDOW_HIGH, "In the volume layer, echoes from this value on have full brightness."),
    (texts::VOLUME_START_DEPTH, "The start depth of the volume layer alone."),
    (texts::SURFACE_MEDIAN, "Removes single outliers from the surface."),
    (texts::SURFACE_SMOOTHING, "Smooths the surface and keeps its steps."),
    (texts::SURFACE_EDGE, "Steps of the surface beyond this height stay sharp."),
    (texts::AMBIENT, "Light from everywhere: brightens shaded places."),
    (texts::DIFFUSE, "Strength of the lamp on matt skin."),
    (texts::SPECULAR, "Strength of glossy highlights."),
    (texts::LIGHT_DEPTH, "How deep light enters tissue."),
    (texts::LIGHT_WARMTH, "How much tissue reddens the light in it."),
    (texts::EXPOSURE, "Brightness of the light inside tissue."),
    (texts::SHADOW, "How dark cast shadows are."),
    (texts::OCCLUSION, "How dark folds and corners are."),
    (texts::TRANSLUCENCY, "How much light shines through skin."),
    (texts::SMOOTHING, "Smooths the volume: less speckle, softer outlines. The volume is filtered again."),
    (texts::MEDIAN, "Removes speckle from each slice and keeps its edges. The volume is filtered again."),
    (texts::SPECKLE, "Averages speckle within tissue of one brightness. The volume is filtered again."),
    (texts::SPECKLE_ENHANCED, "The same with a window that follows the tissue. The volume is filtered again."),
    (texts::PICTURE_SPECKLE, "Averages speckle in the finished picture."),
    (texts::STEP, "Distance of samples along a ray: short is exact, long is fast. 0: one slice pixel."),
    (texts::FIELD_OF_VIEW, "0 draws without perspective; more draws near things larger."),
    (texts::LARGEST_ERROR, "Of a pixel by its steps, levels of 255. 0 takes the same steps everywhere."),
    (texts::RAYS_A_PIXEL, "More rays give smoother edges and take longer."),
];

/// What a slider does.
pub(crate) fn of_slider(name: &str) -> &'static str {
    SLIDERS.iter().find(|(known, _)| *known == name).map_or("", |(_, hint)| *hint)
}

/// What a mode shows.
pub fn of_mode(mode: Mode) -> &'static str {
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
pub(crate) fn of_layout(layout: Layout) -> &'static str {
    match layout {
        Layout::Single => "One picture.",
        Layout::Four => "Three planes and the rendering.",
        Layout::Pair => "Volume and surface side by side.",
    }
}

/// What a drag does.
pub(crate) fn of_tool(tool: Tool) -> &'static str {
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
        Tool::Curve => {
            "Curved plane: click the points of a line on A, B or C, then Enter or double click; or drag a straight one. (Shift+C)"
        }
        Tool::BodyMark => {
            "Body mark: a part of the body with the place of the probe. Drag it, or the probe on it; the wheel turns the probe. (Shift+B)"
        }
        Tool::Measure(kind) => of_measure(kind),
    }
}

/// Where a viewpoint is.
pub(crate) fn of_viewpoint(viewpoint: Viewpoint) -> &'static str {
    match viewpoint {
        Viewpoint::Front => "Seen from the probe, upright. (Ctrl+1)",
        Viewpoint::Left => "Seen from the left of the front view; the patient's sides are the letters. (Ctrl+2)",
        Viewpoint::Right => "Seen from the right of the front view; the patient's sides are the letters. (Ctrl+3)",
        Viewpoint::Top => "Seen from the top of the front view. (Ctrl+4)",
    }
}

/// How something is measured.
pub(crate) fn of_measure(kind: MeasureKind) -> &'static str {
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
        let known: Vec<&str> = crate::sliders::SLIDERS.iter().map(|slider| slider.name).collect();
        for name in &known {
            assert!(of_slider(name).ends_with('.'), "{name} has no hint");
        }
        for (name, _) in SLIDERS {
            assert!(known.contains(&name), "{name} is no slider");
        }
    }
}
