//! The skin of a fetal head of about 30 weeks, asleep, as a signed distance.
//!
//! Axes of the head, mm: x to the right of the picture, y towards the crown, z out of the face; the origin is
//! between the eyes. Sizes follow usual biometry: outer orbital distance 48 mm, biparietal diameter 74 mm, crown to chin 97 mm.

use super::shape::{ball, bell, carve, ellipsoid, join, one_side, rod, smooth_step};
use glam::{Vec3, vec3};

/// Fine relief acts on distances below this, mm. Farther away it changes no sign.
const RELIEF: f32 = 5.0;
/// Every part that a ball encloses is at least so far inside of it, mm, with the reach of its joins.
const MARGIN: f32 = 3.0;

/// Centre of the vault of the skull in the head's coordinates, mm. [`VAULT_RADII`] are the half axes of the skin on it, mm.
pub(super) const VAULT: Vec3 = vec3(0.0, 17.0, -41.5);
pub(super) const VAULT_RADII: Vec3 = vec3(37.0, 37.5, 44.5);

/// Distance of a position in the head's coordinates from the skin of the head, mm, negative inside. `mouth`: how far the jaw is lowered, mm.
pub(super) fn skin(p: Vec3, mouth: f32) -> f32 {
    let q = one_side(p);
    let mut d = head(p, q, mouth);
    // Eyes, nose, lips and ears cost most. Each of them is evaluated only in a ball around it.
    let mut within = |ball: f32, part: &dyn Fn(f32) -> f32| {
        d = if ball < 0.0 { part(d) } else { d.min(ball + MARGIN) };
    };
    within(ball(q, vec3(15.3, 0.5, -6.5), 22.5), &|d| eyes(q, d));
    within(ball(p, vec3(0.0, -9.5, 0.5), 20.5), &|d| nose(p, q, d));
    within(ball(p, vec3(0.0, -25.0 - 0.5 * mouth, -2.5), 22.0 + 0.5 * mouth), &|d| folds(q, lips(p, q, d, mouth)));
    within(ball(q, vec3(35.0, -7.0, -43.0), 20.0), &|d| join(d, ear(q), 2.5));
    d
}

/// Vault, face, cheeks, jaw and neck.
fn head(p: Vec3, q: Vec3, mouth: f32) -> f32 {
    let mut d = ellipsoid(p, VAULT, VAULT_RADII);
    d = join(d, ellipsoid(p, vec3(0.0, -10.0, -27.0), vec3(30.5, 27.0, 25.5)), 10.0);
    d = join(d, ellipsoid(p, vec3(0.0, -24.0 - 0.6 * mouth, -20.0), vec3(23.0, 16.0, 20.0)), 9.0);
    d = join(d, ellipsoid(q, vec3(17.5, -19.0 - 0.3 * mouth, -12.5), vec3(12.5, 12.0, 12.0)), 8.0);
    // The chin, and the pad of fat below it.
    d = join(d, ellipsoid(p, vec3(0.0, -37.0 - mouth, -4.6), vec3(7.0, 5.4, 6.6)), 6.0);
    d = join(d, ellipsoid(p, vec3(0.0, -37.0 - 0.8 * mouth, -20.0), vec3(17.0, 8.5, 15.0)), 8.0);
    join(d, rod(p, vec3(0.0, -20.0, -44.0), vec3(0.0, -62.0, -48.0), [19.0, 19.0]), 10.0)
}

/// Brows, shallow sockets, closed lids with the crease of the upper one and the slit between them.
fn eyes(q: Vec3, skin: f32) -> f32 {
    let mut d = join(skin, rod(q, vec3(7.0, 8.0, -5.5), vec3(22.0, 8.0, -11.5), [3.4, 3.2]), 7.0);
    d = carve(d, ellipsoid(q, vec3(15.2, -0.5, 4.6), vec3(10.4, 6.9, 10.2)), 5.0);
    d = join(d, ellipsoid(q, vec3(15.6, -2.2, -11.3), vec3(8.6, 6.2, 9.2)), 1.6);
    if d.abs() > RELIEF {
        return d;
    }
    // From -1 at the inner corner to 1 at the outer one.
    let s = (q.x - 15.8) / 8.0;
    let ends = smooth_step(1.18 - s.abs(), 0.0, 0.45);
    // The edge of the upper lid overhangs the slit, which bends down in the middle.
    let t = q.y + 5.0 - 1.9 * s * s - 0.35 * s;
    d += ends * (1.5 * bell(t + 0.3, 0.9) - 0.7 * bell(t - 1.4, 1.2) - 0.35 * bell(t + 2.2, 1.2));
    d + ends * 0.6 * bell(q.y - 1.6 + 2.6 * s * s + 0.3 * s, 0.9)
}

/// Bridge, tip, alae, columella, nostrils.
fn nose(p: Vec3, q: Vec3, skin: f32) -> f32 {
    let mut d = join(skin, rod(p, vec3(0.0, 1.5, -4.6), vec3(0.0, -10.5, 2.4), [2.8, 3.4]), 7.0);
    d = join(d, ellipsoid(p, vec3(0.0, -12.8, 3.9), vec3(4.7, 4.1, 4.4)), 3.5);
    d = join(d, ellipsoid(q, vec3(4.9, -14.2, 1.4), vec3(2.8, 3.0, 3.9)), 1.7);
    d = join(d, rod(p, vec3(0.0, -15.8, 4.6), vec3(0.0, -17.4, 1.2), [1.5, 1.6]), 1.6);
    carve(d, rod(q, vec3(2.7, -17.8, 4.6), vec3(3.5, -14.6, 2.2), [1.35, 1.0]), 0.9)
}

/// Both lips with their line and corners, the philtrum, the fold above the chin; an open mouth is a hollow.
fn lips(p: Vec3, q: Vec3, skin: f32, mouth: f32) -> f32 {
    let m = mouth;
    let mut d = join(skin, ellipsoid(p, vec3(0.0, -24.9 - 0.4 * m, -8.8), vec3(12.5, 8.8, 9.8)), 6.0);
    d = carve(d, rod(q, vec3(0.0, -33.2 - m, 4.4), vec3(6.0, -32.4 - m, 2.2), [1.1, 0.9]), 3.0);
    // The upper lip has two peaks, the cupid's bow, and a tubercle between them.
    let peak = vec3(3.0, -23.6, 2.3);
    let corner = vec3(9.2, -26.4, -2.0);
    let upper = join(rod(q, vec3(0.0, -24.6, 2.4), peak, [2.1, 2.1]), rod(q, peak, corner, [2.1, 0.9]), 0.8);
    d = join(d, upper, 1.2);
    d = join(d, ellipsoid(p, vec3(0.0, -25.4, 3.0), vec3(2.0, 1.6, 2.0)), 1.6);
    let full = vec3(3.2, -28.7 - m, 1.6);
    let corner = vec3(8.8, -26.9 - 0.5 * m, -2.3);
    let lower = join(rod(q, vec3(0.0, -28.9 - m, 1.7), full, [2.3, 2.3]), rod(q, full, corner, [2.3, 0.9]), 0.8);
    d = join(d, lower, 0.9);
    if d.abs() < RELIEF {
        // The philtrum between its ridges.
        let along = smooth_step(q.y, -23.8, -21.9) * smooth_step(-q.y, 17.3, 18.9);
        d += along * (0.55 * bell(q.x, 1.2) - 0.2 * bell(q.x - 2.5, 1.1));
        // The line between the lips.
        let line = -26.8 - 0.45 * m + 0.5 * bell(q.x - 3.6, 2.4) - 0.2 * bell(q.x, 1.4);
        d += 1.4 * smooth_step(1.08 - q.x / 9.4, 0.0, 0.5) * bell(q.y - line, 0.85);
        // The border of the upper lip's red.
        let border = -21.8 - 0.3 * (q.x - 3.0).max(0.0) - 0.5 * bell(q.x, 1.6);
        d += 0.15 * smooth_step(1.0 - q.x / 8.0, 0.0, 0.5) * bell(q.y - border, 0.8);
        d += 0.8 * bell((q.x - 9.6).hypot(q.y + 26.9 + 0.4 * m), 1.6);
    }
    if m > 0.3 {
        let hollow = vec3(5.2 + 0.5 * m, 0.4 + 0.6 * m, 7.5);
        d = carve(d, ellipsoid(p, vec3(0.0, -26.7 - 0.5 * m, 1.6), hollow), 1.0);
    }
    d
}

/// The fold from the wing of the nose to the corner of the mouth.
fn folds(q: Vec3, skin: f32) -> f32 {
    if skin.abs() > RELIEF {
        return skin;
    }
    let along = smooth_step(q.y, -27.0, -24.0) * smooth_step(-q.y, 13.0, 16.0);
    skin + 0.4 * along * bell(q.x - 8.0 - 0.3 * (-15.0 - q.y), 1.5)
}

/// The outer ear: a plate that leaves the head at its front edge, with helix, antihelix, concha, tragus and lobe.
fn ear(q: Vec3) -> f32 {
    let from = q - vec3(33.4, -6.5, -41.5);
    // Tilted back by 12 degrees, and out of the head by 37.
    let (y, z) = (0.978 * from.y - 0.208 * from.z, 0.978 * from.z + 0.208 * from.y);
    // Along the plate to its rear edge, up, and out of it.
    let p = vec3(0.6 * from.x - 0.8 * z, y, 0.8 * from.x + 0.6 * z);
    let mut d = ellipsoid(p, vec3(0.2, 1.0, -1.0), vec3(7.6, 11.8, 2.0));
    let fade = smooth_step(p.y, -11.0, -4.0);
    d = join(d, oval(p.x, p.y - 1.0, 7.4, 11.8).hypot(p.z - 1.1) - 0.9 - fade, 1.4);
    d = carve(d, ellipsoid(p, vec3(-1.6, -2.5, 2.6), vec3(4.0, 5.6, 3.4)), 1.6);
    let fade = smooth_step(p.x, -2.5, 1.0);
    d = join(d, oval(p.x + 0.5, p.y, 4.6, 8.0).hypot(p.z - 0.7) - 0.2 - 1.1 * fade, 1.2);
    d = join(d, ellipsoid(p, vec3(-2.0, -11.5, 0.2), vec3(4.0, 4.2, 2.3)), 2.0);
    join(d, ball(p, vec3(-6.2, -3.0, 1.2), 2.2), 1.5)
}

/// Distance from an ellipse around the origin, to first order, mm.
fn oval(x: f32, y: f32, a: f32, b: f32) -> f32 {
    let k = (x / a).hypot(y / b);
    k * (k - 1.0) / ((x / (a * a)).hypot(y / (b * b)) + 1e-6)
}
