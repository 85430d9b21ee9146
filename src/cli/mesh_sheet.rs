//! `render --mesh`: writes the surface that a picture shows to a file.

use crate::gpu::Renderer;
use crate::mesh::files::{Colours, MeshFile};
use crate::mesh::sheet::sheet;
use crate::passes::chain::distance_end;
use crate::passes::is_hit;
use crate::picture::Picture;
use crate::probe::{Geometry, World};
use crate::scene::picker::Picker;
use crate::terminal::{Failure, failed, input, say};
use glam::DVec3;
use std::path::Path;

/// Writes the surface in the distance map that a renderer drew last as an open mesh (sheet), in the colours of its picture. `world`: map from the
/// voxels of a Cartesian volume to the world; None for a sweep.
///
/// # Errors
/// The plan has no distance map, no rays next to each other hit a surface, or the file cannot be written.
pub(super) fn write(
    renderer: &mut Renderer,
    picture: &Picture,
    world: Option<World>,
    format: MeshFile,
    path: &Path,
) -> Result<(), Failure> {
    let map = renderer.read(distance_end(renderer.scene())).map_err(failed)?;
    let map = map.ok_or_else(|| failed("--mesh: the plan has no distance map"))?;
    let scene = renderer.scene();
    let size = [map.size[0], map.size[1]];
    let distances: Vec<Option<f64>> = map.values.iter().map(|mm| Some(*mm).filter(|mm| is_hit(*mm))).collect();
    let ray = |x: usize, y: usize| scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    let (mut mesh, rays) = sheet(size, ray, &distances);
    if mesh.triangles.is_empty() {
        return Err(input(format!("{}: nothing is written: no rays next to each other hit a surface", path.display())));
    }
    let colours: Vec<[u8; 3]> = {
        let picker = Picker::of(scene);
        let colour = |ray: &usize| {
            let [x, y] = picker.pixel_of_ray([ray % size[0], ray / size[0]]);
            let pixel = x.min(picture.width as usize - 1) + picture.width as usize * y.min(picture.height as usize - 1);
            [0, 1, 2].map(|channel| picture.rgba.get(4 * pixel + channel).copied().unwrap_or(0))
        };
        rays.iter().map(colour).collect()
    };
    if let (Geometry::Cartesian(own), Some(world)) = (&scene.geometry, world) {
        let (origin, spacing) = (DVec3::from(own.origin), DVec3::from(own.spacing));
        mesh.vertices.iter_mut().for_each(|vertex| *vertex = world.at((*vertex - origin) / spacing));
        if world.is_left_handed() {
            mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
    }
    format.write(&mesh, Colours::OfPicture(&colours), path).map_err(failed)?;
    let (triangles, vertices) = (mesh.triangles.len(), mesh.vertices.len());
    say!(
        "mesh: {}, {triangles} triangles of {vertices} vertices, an open sheet of {:.3} cm2",
        path.display(),
        mesh.area() / 100.0
    );
    Ok(())
}
