//! Skull and brain of the fetal head, in the axes of the head (see `face`).

use super::face::{VAULT, VAULT_RADII};
use super::shape::{carve, ellipsoid, join, one_side, rod};
use glam::{Vec3, vec3};

/// Skin and muscle on the vault; the bone with the meninges, mm.
const SCALP: f32 = 3.0;
const CALVARIA: f32 = 1.8;

/// Thickness of a bone's shell, mm. What is inside of it is brain, marrow or soft tissue.
const SHELL: f32 = 1.6;

/// True if a position in the head's coordinates lies in the shell of a bone. `mouth`: how far the jaw is lowered, mm.
pub(super) fn is_bone(p: Vec3, mouth: f32) -> bool {
    let inside = -bone(p, mouth);
    inside > 0.0 && inside < SHELL && !is_suture(p)
}

/// The frontal suture is open at this age, and widens to the fontanelle.
fn is_suture(p: Vec3) -> bool {
    p.y > 14.0 && p.z > -42.0 && p.x.abs() < 0.6 + 0.06 * (p.y - 14.0)
}

/// Distance of a position in the head's coordinates from the outer surface of the nearest bone, mm, negative inside: vault, brows, nose, cheek
/// bones, both jaws. The eye sockets are open.
pub(super) fn bone(p: Vec3, mouth: f32) -> f32 {
    let q = one_side(p);
    let vault = ellipsoid(p, VAULT, VAULT_RADII - SCALP);
    let brow = rod(q, vec3(7.0, 7.0, -8.0), vec3(22.0, 6.0, -15.0), [2.6, 2.6]);
    let nose = rod(p, vec3(0.0, 0.5, -6.0), vec3(0.0, -6.5, -2.4), [1.2, 1.0]);
    let cheek = rod(q, vec3(10.0, -11.0, -9.5), vec3(25.0, -8.0, -20.0), [2.8, 2.4]);
    let upper = ellipsoid(p, vec3(0.0, -20.0, -12.0), vec3(11.5, 5.0, 10.0));
    let chin = vec3(0.0, -35.5 - mouth, -8.0);
    let lower = rod(q, chin, chin + vec3(16.0, 8.0, -18.0), [4.0, 3.4]);
    let sockets = ellipsoid(q, vec3(15.5, -1.5, -6.0), vec3(9.0, 6.5, 14.0));
    let face = join(brow, cheek, 2.0).min(upper).min(lower);
    carve(vault.min(face), sockets, 1.0).min(nose)
}

/// The tissues inside the vault of the skull.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Intracranial {
    /// White matter and cortex.
    Brain,
    /// The grey nuclei next to the third ventricle, darker than the rest.
    Thalamus,
    /// The folds between gyri with their vessels, and the lateral fissure.
    Sulcus,
    /// The midline between the hemispheres.
    Falx,
    /// The bright plexus inside the lateral ventricles.
    ChoroidPlexus,
    /// Cerebrospinal fluid: ventricles, cavity of the septum pellucidum, the space around the brain.
    Fluid,
}

/// The tissue inside the vault at a position in the head's coordinates; None outside the vault.
pub(super) fn intracranial(p: Vec3) -> Option<Intracranial> {
    let inside = -ellipsoid(p, VAULT, VAULT_RADII - (SCALP + CALVARIA));
    if inside < 0.0 {
        return None;
    }
    let q = one_side(p);
    let part = if rod(q, vec3(6.5, 17.0, -40.0), vec3(13.5, 12.0, -57.0), [1.3, 3.0]) < 0.0 {
        Intracranial::ChoroidPlexus
    } else if is_ventricle(p, q) {
        Intracranial::Fluid
    } else if q.x < 0.8 && inside < 17.0 {
        Intracranial::Falx
    } else if inside < 1.3 {
        Intracranial::Fluid
    } else if ellipsoid(q, vec3(6.4, 6.0, -44.0), vec3(5.2, 5.5, 8.5)) < 0.0 {
        Intracranial::Thalamus
    } else if is_sulcus(p, q, inside) {
        Intracranial::Sulcus
    } else {
        Intracranial::Brain
    };
    Some(part)
}

/// Lateral ventricles from the frontal horn to the atrium, third ventricle, cavity of the septum pellucidum.
fn is_ventricle(p: Vec3, q: Vec3) -> bool {
    let horn = rod(q, vec3(5.0, 17.0, -25.0), vec3(6.5, 18.0, -40.0), [1.6, 2.4]);
    let atrium = rod(q, vec3(6.5, 18.0, -40.0), vec3(14.0, 12.0, -58.0), [2.4, 4.6]);
    let third = ellipsoid(p, vec3(0.0, 6.0, -43.0), vec3(0.8, 5.0, 8.0));
    let septum = ellipsoid(p, vec3(0.0, 15.0, -29.0), vec3(2.4, 3.5, 6.5));
    horn.min(atrium).min(third).min(septum) < 0.0
}

/// Two families of wavy folds, of different depth from place to place, and the lateral fissure. `inside`: depth below the vault, mm.
fn is_sulcus(p: Vec3, q: Vec3, inside: f32) -> bool {
    let depth = 5.0 + 2.5 * (0.21 * p.z + 0.13 * p.y).sin();
    let across = (0.40 * p.y + 1.3 * (0.17 * p.z).sin() + 0.8 * (0.2 * q.x).sin()).sin().abs() < 0.22;
    let along = (0.36 * p.z + 1.4 * (0.19 * p.y).sin() + 0.9 * (0.23 * q.x).sin()).sin().abs() < 0.20;
    let fissure = rod(q, vec3(22.0, 9.0, -30.0), vec3(25.0, 11.0, -48.0), [0.9, 0.9]) < 0.0;
    fissure || (across && inside < depth) || (along && inside < 0.7 * depth)
}
