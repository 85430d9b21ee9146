//! The pointer, where no windowing system draws one.

use super::Facts;
use egui::{Color32, Id, LayerId, Mesh, Order, Shape, Stroke, Ui, Vec2, pos2, vec2};

/// Its corners from the tip on, points: a head, and a tail between its two halves.
const CORNERS: [Vec2; 7] = [
    vec2(0.0, 0.0),
    vec2(0.0, 24.0),
    vec2(5.5, 18.8),
    vec2(9.4, 27.2),
    vec2(13.2, 25.4),
    vec2(9.4, 17.4),
    vec2(17.0, 17.4),
];
/// The triangles that fill it: it is not convex.
const TRIANGLES: [[u32; 3]; 5] = [[0, 1, 2], [0, 2, 5], [0, 5, 6], [2, 3, 4], [2, 4, 5]];

pub fn paint(ui: &Ui, facts: &Facts, scale: f32) {
    let Some([x, y]) = facts.pointer else { return };
    let tip = pos2(x as f32 / scale, y as f32 / scale);
    // Over everything, and no layer that could be pressed.
    let painter = ui.ctx().layer_painter(LayerId::new(Order::Debug, Id::new("pointer")));
    let corners = CORNERS.map(|corner| tip + corner);
    let mut mesh = Mesh::default();
    corners.iter().for_each(|corner| mesh.colored_vertex(*corner, Color32::WHITE));
    TRIANGLES.iter().for_each(|[a, b, c]| mesh.add_triangle(*a, *b, *c));
    painter.add(mesh);
    // Dark round bright: to be seen on any echo.
    painter.add(Shape::closed_line(corners.to_vec(), Stroke::new(1.5, Color32::BLACK)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangles_fill_what_the_corners_surround() {
        let twice = |corners: &[Vec2]| -> f32 {
            let next = corners.iter().cycle().skip(1);
            corners.iter().zip(next).map(|(a, b)| a.x * b.y - a.y * b.x).sum()
        };
        let filled = TRIANGLES.map(|corners| twice(&corners.map(|n| CORNERS[n as usize])));
        // All of them turn the same way round: none covers another.
        assert!(filled.iter().all(|area| *area < 0.0), "{filled:?}");
        assert!((filled.iter().sum::<f32>() - twice(&CORNERS)).abs() < 1e-3);
    }
}
