//! Tooltips of the view: what each control does, in one or two sentences.

use crate::command::{Tool, Viewpoint};
use crate::scene::{Layout, MeasureKind, Mode};

/// What a mode shows.
pub const fn of_mode(mode: Mode) -> &'static str {
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
pub(crate) const fn of_layout(layout: Layout) -> &'static str {
    match layout {
        Layout::Single => "One picture.",
        Layout::Four => "Three planes and the rendering, of one size.",
        Layout::Beside => "The rendering, and three planes beside it.",
        Layout::Pair => "Volume and surface side by side.",
    }
}

/// What a drag does.
pub(crate) fn of_tool(tool: Tool) -> &'static str {
    match tool {
        Tool::Rotate => "Drag turns the view.",
        Tool::Light => "Drag moves the lamp.",
        Tool::Region => {
            "Drag moves the nearest face of the region; on planes beside it a side of its box, or all of it; on plane A also the green start line. (G)"
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
        Tool::Labels => {
            "Labels: paint the parts of an organ on planes or on the surface, or click a body to label all of it. Ctrl erases, Shift+wheel sets the brush. (Shift+L)"
        }
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
fn of_measure(kind: MeasureKind) -> &'static str {
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
        MeasureKind::Threshold => {
            "Volume of the largest bright body in the region, in cm³, with its interval of 95 %. (K)"
        }
        MeasureKind::Text => "Text: click its place and type, or type it at the pointer; Enter ends it. (I)",
        MeasureKind::Arrow => "Arrow: click what it points to, then its other end, then type. (Y)",
    }
}

/// What to do next to measure: `set` points are set, and a volume has contours or none.
pub(crate) fn of_step(kind: MeasureKind, set: usize, has_contours: bool) -> &'static str {
    match (kind, set) {
        (MeasureKind::Distance | MeasureKind::Surface, 0) => "Click the first end.",
        (MeasureKind::Distance | MeasureKind::Surface, _) => "Click the other end.",
        (MeasureKind::Angle, 0) => "Click the end of a leg.",
        (MeasureKind::Angle, 1) => "Click the vertex.",
        (MeasureKind::Angle, _) => "Click the end of the other leg.",
        (MeasureKind::Ellipse, 0) => "Click one end of the long axis.",
        (MeasureKind::Volume, 0) if has_contours => "Step or turn the plane and trace again, or press Enter.",
        (MeasureKind::Trace | MeasureKind::Volume, 0) => "Drag round the outline on a plane.",
        (MeasureKind::Trace | MeasureKind::Volume, _) => "Enter closes the outline.",
        (MeasureKind::Text, _) => "Click the place of the text, or type it at the pointer. Esc leaves.",
        (MeasureKind::Arrow, 0) => "Click what the arrow points to.",
        (MeasureKind::Ellipse, 1) | (MeasureKind::Arrow, _) => "Click its other end.",
        (MeasureKind::Ellipse, _) => "Click the end of the short axis.",
        (MeasureKind::Threshold, _) => "",
    }
}
