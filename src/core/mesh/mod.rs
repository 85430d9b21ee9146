//! Triangle meshes of a threshold's surface, on the CPU in f64: surface nets of a lattice ([`nets`]) that may be smoothed
//! ([`smooth`]) or filled to a solid with a flat base ([`base`]), meshes of fewer triangles ([`simplify`], [`quadrics`]), the open sheet of a distance map ([`sheet`]), and files of them ([`files`]).
//!
//! A mesh is welded: triangles share vertices by their index. One without open edges is a closed manifold: every edge belongs to exactly two
//! triangles, which run along it in opposite directions.

pub mod base;
mod cell;
pub mod files;
pub mod nets;
pub mod polygons;
pub mod quadrics;
pub mod sheet;
pub mod simplify;
pub mod smooth;

use glam::DVec3;

/// A surface as triangles, without colours; vertices in mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    pub vertices: Vec<DVec3>,
    /// Indices of vertices. A triangle is anticlockwise as seen from outside, which is where the values are below the threshold.
    pub triangles: Vec<[u32; 3]>,
    /// How far the mesh is from closed; 0 for a closed surface. For [`nets`] it is the number of lattice edges at which the surface continues without
    /// a triangle, at the border of the known values; for [`quadrics`] and [`sheet`] the number of triangle edges that do not belong to two
    /// triangles. [`simplify`] keeps the number of the mesh that it simplifies.
    pub open_edges: u64,
}

impl Mesh {
    /// Area of the surface, mm^2.
    pub fn area(&self) -> f64 {
        self.triangles.iter().map(|t| self.normal_area(t).length()).sum()
    }

    /// Volume enclosed by the surface, mm^3, by the divergence theorem. It is meaningful only for a closed surface, and negative if the triangles
    /// face inwards.
    pub fn volume(&self) -> f64 {
        // Around a point of the mesh, so that a place far from the origin costs no digits.
        let about = self.vertices.first().copied().unwrap_or_default();
        let of = |[a, b, c]: [DVec3; 3]| (a - about).dot((b - about).cross(c - about)) / 6.0;
        self.triangles.iter().map(|t| of(self.corners(t))).sum()
    }

    /// Unit normal of every vertex: the mean of the normals of its triangles, weighted by their areas. The zero vector for a vertex without area.
    pub fn normals(&self) -> Vec<DVec3> {
        let mut sums = vec![DVec3::ZERO; self.vertices.len()];
        for triangle in &self.triangles {
            let normal = self.normal_area(triangle);
            triangle.iter().for_each(|n| sums[*n as usize] += normal);
        }
        sums.into_iter().map(DVec3::normalize_or_zero).collect()
    }

    /// Normal of a triangle, as long as its area.
    fn normal_area(&self, triangle: &[u32; 3]) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a) / 2.0
    }

    fn corners(&self, triangle: &[u32; 3]) -> [DVec3; 3] {
        triangle.map(|n| self.vertices[n as usize])
    }
}
