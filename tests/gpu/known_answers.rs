//! Normals by formula. Pictures with analytic answers are checked by `verify`.

use crate::common::gpu::*;
use echolume::low_level::passes::shade::normal;
use echolume::low_level::passes::{MISS, Texels};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;
use glam::DVec3;

fn block(spacing: f64, size: [usize; 3]) -> Geometry {
    Geometry::Cartesian(Grid { size, spacing: [spacing; 3], origin: [0.0; 3] })
}

#[test]
fn normals_of_a_sphere_point_outwards_within_a_degree_away_from_the_limb() {
    let toml =
        "picture = { size = [200, 160] }\ncamera = { field_of_view = 35, azimuth = 15 }\nlight = { cliff = 3.0 }";
    let scene = scene(block(1.0, [40, 40, 40]), BYTES, toml);
    let (centre, radius) = (DVec3::splat(20.0), 15.0);
    let distances = sphere_distances(&scene, centre, radius);
    let mut checked = 0;
    for y in 0..160 {
        for x in 0..200 {
            let distance = distances.one(x, y, 0);
            let Some(normal) = normal(&scene, &distances, x as i64, y as i64) else { continue };
            let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            let outwards = (origin + direction * distance - centre).normalize();
            if outwards.dot(-direction) > 0.5 {
                assert!(normal.angle_between(outwards).to_degrees() < 1.0, "at {x}, {y}");
                checked += 1;
            }
        }
    }
    assert!(checked > 3000, "{checked}");
}

fn sphere_distances(scene: &Scene, centre: DVec3, radius: f64) -> Texels {
    let [width, height] = scene.picture_size().map(|n| n as usize);
    Texels::from_fn([width, height, 1], 1, |[x, y, _], _| {
        let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        let along = (centre - origin).dot(direction);
        let offset = (origin + direction * along).distance(centre);
        if offset < radius { along - (radius * radius - offset * offset).sqrt() } else { MISS }
    })
}
