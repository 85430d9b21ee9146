//! Two fingers on the picture: what lies under them stays under them.

use super::command::Command;
use super::picture::{Picture, Spot};
use super::sliders::PLANES_ZOOM;
use super::view;

/// Fingers that are nearer to one another only move the picture, pixels: what they say of scale and angle is noise.
const NEAR: f64 = 24.0;

/// What two fingers ask for that went from two places of the window to two others. `spot` is where they came down.
pub(super) fn pair(old: [[f64; 2]; 2], new: [[f64; 2]; 2], spot: Spot, on: &Picture) -> Vec<Command> {
    let Some(scene) = on.scene else { return Vec::new() };
    let between = |[a, b]: [[f64; 2]; 2]| [b[0] - a[0], b[1] - a[1]];
    let (was, is) = (between(old), between(new));
    let (length, longer) = (was[0].hypot(was[1]), is[0].hypot(is[1]));
    let settings = &scene.settings;
    let zoom = if spot == Spot::Rendering { settings.camera.zoom } else { settings.planes.zoom };
    let (mut times, mut angle) = (1.0, 0.0);
    if length.min(longer) >= NEAR {
        // Beyond the last zoom the picture only moves and turns.
        times = view::zoomed(zoom, longer / length) / zoom;
        angle = (was[0] * is[1] - was[1] * is[0]).atan2(was[0] * is[0] + was[1] * is[1]);
    }
    let mut commands = Vec::new();
    match spot {
        Spot::Plane(_) if !scene.is_flat() => commands.push(Command::Slide(PLANES_ZOOM, zoom * times)),
        Spot::Plane(_) => commands.extend([Command::Zoom(times), Command::Roll(angle.to_degrees())]),
        Spot::Rendering => {
            // Zoom and roll are about the middle of the rendering; the rest of what leads from one pair to the other is a pan.
            let middle = on.middle();
            let from_middle = |[a, b]: [[f64; 2]; 2]| [0, 1].map(|i| (a[i] + b[i]) / 2.0 - middle[i]);
            let ([x, y], [to_x, to_y]) = (from_middle(old), from_middle(new));
            let (sin, cos) = angle.sin_cos();
            let pan = [to_x - times * (x * cos - y * sin), to_y - times * (x * sin + y * cos)];
            commands.extend([
                Command::Zoom(times),
                Command::Roll(angle.to_degrees()),
                Command::Pan(pan.map(|n| n / on.size[1])),
            ]);
        }
    }
    let does_nothing = [Command::Zoom(1.0), Command::Roll(0.0), Command::Pan([0.0; 2])];
    commands.retain(|command| !does_nothing.contains(command));
    commands
}
