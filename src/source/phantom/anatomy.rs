//! The shape of a fetus of about 32 weeks, as signed distances: head and face, skull, hand, cord, shoulders.
//!
//! Axes of the head, mm: x to the right of the picture, y towards the crown, z out of the face; the origin is
//! between the eyes. Sizes follow usual biometry: outer orbital distance 50 mm, biparietal diameter 78 mm.

use glam::{Vec3, vec3};

/// Skin of the head. `mouth` is how far the jaw is lowered, mm.
pub(super) fn skin(p: Vec3, mouth: f32) -> f32 {
    // Paired parts are modelled once: q is p, or its mirror image.
    let q = vec3(p.x.abs(), p.y, p.z);
    let mut d = ellipsoid(p, vec3(0.0, 22.0, -42.0), vec3(38.0, 42.0, 45.5));
    d = join(d, ellipsoid(q, vec3(0.0, -11.0, -24.0), vec3(27.0, 27.0, 24.5)), 8.0);
    let jaw = vec3(0.0, -27.0 - 0.7 * mouth, -19.0);
    d = join(d, ellipsoid(p, jaw, vec3(23.0, 15.5, 19.5)), 8.0);
    d = join(d, ball(p, vec3(0.0, -39.5 - mouth, -6.0), 7.4), 6.0);
    d = join(d, ellipsoid(q, vec3(17.5, -17.0, -9.5), vec3(11.0, 11.5, 10.5)), 6.0);
    d = eyes(q, d);
    d = nose(p, q, d);
    d = lips(p, q, d, mouth);
    d = join(d, ear(q), 2.0);
    // Neck.
    join(d, rod(p, vec3(0.0, -18.0, -40.0), vec3(0.0, -62.0, -44.0), [20.0, 20.0]), 12.0)
}

/// Brows, sockets, closed and swollen lids with the slit between them.
fn eyes(q: Vec3, skin: f32) -> f32 {
    let mut d = join(skin, rod(q, vec3(6.0, 8.5, -5.0), vec3(23.0, 8.0, -12.5), [4.6, 4.4]), 5.0);
    d = carve(d, ellipsoid(q, vec3(15.5, -0.5, 3.0), vec3(10.5, 7.0, 10.5)), 3.5);
    d = join(d, ellipsoid(q, vec3(15.5, -0.2, -10.5), vec3(8.6, 6.2, 9.3)), 1.2);
    let slit = rod(q, vec3(7.5, -1.6, -4.0), vec3(15.5, -4.4, -1.6), [1.2, 1.8]).min(rod(
        q,
        vec3(15.5, -4.4, -1.6),
        vec3(23.5, -1.6, -5.0),
        [1.8, 1.2],
    ));
    carve(d, slit, 1.0)
}

/// Bridge, tip, wings, nostrils.
fn nose(p: Vec3, q: Vec3, skin: f32) -> f32 {
    let mut d = join(skin, rod(p, vec3(0.0, 3.0, -5.5), vec3(0.0, -12.0, 3.6), [3.2, 4.2]), 5.0);
    d = join(d, ellipsoid(p, vec3(0.0, -14.0, 5.0), vec3(5.4, 4.4, 4.6)), 2.5);
    d = join(d, ellipsoid(q, vec3(6.8, -15.3, 1.6), vec3(3.6, 3.7, 4.0)), 1.6);
    carve(d, rod(q, vec3(3.4, -20.5, 6.0), vec3(3.4, -16.5, 2.5), [2.0, 1.5]), 1.0)
}

/// The muzzle, the philtrum's groove, both lips and the slit between them; an open mouth is a hollow.
fn lips(p: Vec3, q: Vec3, skin: f32, mouth: f32) -> f32 {
    let mut d = join(skin, ellipsoid(p, vec3(0.0, -25.0 - 0.4 * mouth, -9.5), vec3(14.0, 9.5, 11.0)), 6.0);
    // The fold between lower lip and chin.
    let fold = vec3(0.0, -35.6 - mouth, 3.0);
    d = carve(d, rod(q, fold, fold + vec3(8.0, 1.0, -3.0), [1.8, 1.4]), 3.0);
    // The upper lip dips in the middle: the bow.
    let upper = rod(q, vec3(0.0, -23.6, 2.6), vec3(3.8, -22.9, 3.0), [2.5, 2.8]).min(rod(
        q,
        vec3(3.8, -22.9, 3.0),
        vec3(12.0, -26.3, -2.2),
        [2.8, 1.5],
    ));
    d = join(d, upper, 1.4);
    let lower = -31.0 - mouth;
    d = join(d, rod(q, vec3(0.0, lower, 2.4), vec3(4.8, lower + 0.2, 1.8), [3.2, 3.0]), 1.4);
    let corner = vec3(10.5, -27.8 - 0.4 * mouth, -2.4);
    d = join(d, rod(q, vec3(4.8, lower + 0.2, 1.8), corner, [3.0, 1.4]), 1.4);
    d = carve(d, rod(p, vec3(0.0, -19.6, 4.8), vec3(0.0, -22.2, 6.6), [1.6, 1.6]), 1.4);
    let middle = -27.4 - 0.5 * mouth;
    let slit = ellipsoid(q, vec3(0.0, middle, 3.2), vec3(12.5, 2.1 + 0.5 * mouth, 7.0));
    carve(d, slit, 1.0)
}

/// The rim of the outer ear and its lobe, nearly parallel to the beam.
fn ear(q: Vec3) -> f32 {
    let shell = ellipsoid(q, vec3(36.5, -3.0, -37.0), vec3(4.5, 14.5, 9.0));
    let bowl = ellipsoid(q, vec3(40.5, -1.5, -34.5), vec3(4.0, 9.0, 6.0));
    carve(shell, bowl, 1.5).min(ball(q, vec3(35.0, -15.0, -35.0), 3.5))
}

/// Outer surface of the bone: vault, brows, cheek bones, both jaws. Eye sockets, nose and fontanelle have none.
pub(super) fn bone(p: Vec3, mouth: f32) -> f32 {
    let q = vec3(p.x.abs(), p.y, p.z);
    let vault = ellipsoid(p, vec3(0.0, 22.0, -42.0), vec3(35.0, 39.0, 42.3));
    // The frontal suture is open at this age.
    let vault = carve(vault, rod(p, vec3(0.0, 16.0, 2.0), vec3(0.0, 60.0, -20.0), [1.0, 4.0]), 1.0);
    let brow = rod(q, vec3(7.0, 7.5, -7.5), vec3(23.0, 6.5, -15.0), [2.8, 2.8]);
    let cheek = rod(q, vec3(10.0, -12.0, -9.0), vec3(25.0, -9.0, -20.0), [3.0, 2.5]);
    let upper = ellipsoid(p, vec3(0.0, -19.0, -12.0), vec3(12.0, 5.0, 10.0));
    let chin = vec3(0.0, -36.5 - mouth, -9.5);
    let lower = rod(q, chin, chin + vec3(16.0, 8.0, -18.0), [4.2, 3.6]);
    let sockets = ellipsoid(q, vec3(15.5, -0.5, -6.0), vec3(9.0, 6.5, 14.0));
    let face = join(brow, cheek, 2.0).min(upper).min(lower);
    carve(vault.min(face), sockets, 1.0)
}

/// Inside of the vault.
pub(super) fn brain(p: Vec3) -> f32 {
    ellipsoid(p, vec3(0.0, 22.0, -42.0), vec3(33.0, 37.0, 40.3))
}

/// A hand next to the cheek, its back to the probe, fingers up; in the head's axes, but it does not rotate with the head.
/// `curl`: flexion of the fingers, 0..=1.
pub(super) fn hand(p: Vec3, curl: f32) -> f32 {
    // Next to the cheek, not touching it.
    let p = p - vec3(4.0, -3.0, -2.0);
    let bound = ball(p, vec3(40.0, -38.0, -10.0), 48.0);
    if bound > 6.0 {
        return bound;
    }
    let mut d = ellipsoid(p, vec3(38.0, -34.0, -9.0), vec3(9.5, 9.5, 4.6));
    d = join(d, rod(p, vec3(39.0, -41.0, -10.5), vec3(43.0, -66.0, -17.0), [6.2, 7.5]), 6.0);
    // Four fingers of two joints: root and length.
    const FINGERS: [(f32, f32, f32); 4] =
        [(31.4, -28.0, 9.5), (36.2, -26.4, 11.0), (41.0, -26.6, 10.4), (45.4, -28.6, 8.0)];
    for (x, y, length) in FINGERS {
        let spread = (x - 38.0) * 0.075;
        let root = vec3(x, y, -7.0);
        let knuckle = root + vec3(spread, 1.0, 0.35) * (length * 0.62);
        let tip = knuckle + vec3(spread, 0.85 - 0.9 * curl, -0.35 - 0.6 * curl) * (length * 0.75);
        d = join(d, rod(p, root, knuckle, [2.4, 2.1]).min(rod(p, knuckle, tip, [2.1, 1.8])), 1.3);
    }
    // The thumb points at the cheek.
    let thumb = vec3(28.2, -30.5, -3.5);
    d = join(d, rod(p, vec3(32.5, -38.0, -8.0), thumb, [3.0, 2.6]), 2.5);
    join(d, rod(p, thumb, vec3(27.8, -24.0, -1.5), [2.6, 2.1]), 1.5)
}

/// Umbilical cord: two arteries around a vein, a twisted rope of 11 mm next to the other cheek. In the head's axes.
pub(super) fn cord(p: Vec3) -> f32 {
    const KNOTS: [Vec3; 7] = [
        Vec3::new(-62.0, 14.0, -22.0),
        Vec3::new(-50.0, 5.0, -13.0),
        Vec3::new(-43.0, -8.0, -8.0),
        Vec3::new(-40.0, -22.0, -7.0),
        Vec3::new(-36.0, -35.0, -9.0),
        Vec3::new(-26.0, -48.0, -12.0),
        Vec3::new(-10.0, -58.0, -12.0),
    ];
    let p = p + vec3(5.0, 2.0, 2.0);
    let bound = ellipsoid(p, vec3(-36.0, -22.0, -13.0), vec3(48.0, 58.0, 24.0));
    if bound > 8.0 {
        return bound.min(30.0);
    }
    let (mut nearest, mut away, mut run, mut at) = (f32::MAX, Vec3::ZERO, 0.0, 0.0);
    for pair in KNOTS.windows(2) {
        let along = pair[1] - pair[0];
        let length = along.length();
        let share = ((p - pair[0]).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        let off = p - pair[0] - along * share;
        if off.length_squared() < nearest {
            (nearest, away, at) = (off.length_squared(), off, run + share * length);
        }
        run += length;
    }
    // Three strands, one revolution in 26 mm: the rope is thicker where a strand is on the outside.
    let around = away.z.atan2(away.x);
    nearest.sqrt() - 5.0 - 1.1 * (3.0 * around + at * std::f32::consts::TAU * 3.0 / 26.0).cos()
}

/// Shoulders and chest below the chin, in the head's axes.
pub(super) fn shoulders(p: Vec3) -> f32 {
    let q = vec3(p.x.abs(), p.y, p.z);
    let shoulder = rod(q, vec3(8.0, -62.0, -44.0), vec3(40.0, -68.0, -46.0), [15.0, 13.0]);
    join(shoulder, ellipsoid(p, vec3(0.0, -82.0, -42.0), vec3(36.0, 26.0, 24.0)), 10.0)
}

pub(super) fn ball(p: Vec3, centre: Vec3, radius: f32) -> f32 {
    (p - centre).length() - radius
}

pub(super) fn ellipsoid(p: Vec3, centre: Vec3, radii: Vec3) -> f32 {
    let scaled = (p - centre) / radii;
    let slope = (scaled / radii).length();
    let k = scaled.length();
    // At the centre the slope vanishes; there the smallest radius is the distance.
    if slope < 1e-6 { -radii.min_element() } else { k * (k - 1.0) / slope }
}

/// A rod with round ends, its radius interpolated between two values.
fn rod(p: Vec3, from: Vec3, to: Vec3, radii: [f32; 2]) -> f32 {
    let along = to - from;
    let share = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    (p - from - along * share).length() - radii[0] - (radii[1] - radii[0]) * share
}

/// Union that fills the crease between two shapes over `width` mm.
pub(super) fn join(a: f32, b: f32, width: f32) -> f32 {
    let overlap = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - overlap * overlap * width / 4.0
}

/// `a` without `b`, its edge rounded over `width` mm.
fn carve(a: f32, b: f32, width: f32) -> f32 {
    -join(-a, b, width)
}

/// Unit normal of a distance field, by four samples on the corners of a tetrahedron.
pub(super) fn normal(p: Vec3, field: impl Fn(Vec3) -> f32) -> Vec3 {
    const REACH: f32 = 0.3;
    const CORNERS: [Vec3; 4] =
        [Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, -1.0, 1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::ONE];
    CORNERS.iter().map(|corner| *corner * field(p + *corner * REACH)).sum::<Vec3>().normalize_or_zero()
}
