//! Files of meshes: binary STL, binary little-endian PLY, and GLB (glTF 2.0). A file is complete or absent.

use super::Mesh;
use crate::files::{InputError, Unfinished};
use glam::DVec3;
use serde_json::json;
use std::io::{self, Write};
use std::path::Path;

/// Formats of meshes that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFile {
    /// Binary STL: triangles with their normals. It has neither colours nor a unit; mm are meant.
    Stl,
    /// Binary little-endian PLY with normals and colours of vertices, in mm.
    Ply,
    /// glTF 2.0 in one file, with normals and colours of vertices. The vertices are in mm, and a node scales them to metres.
    Glb,
}

/// Colours of vertices, sRGB.
#[derive(Clone, Copy, Debug)]
pub enum Colours<'a> {
    /// One colour for all vertices, which contains no light: the program that shows the mesh lights it.
    One([u8; 3]),
    /// A colour for each vertex, from a picture that already contains the light.
    OfPicture(&'a [[u8; 3]]),
}

impl Colours<'_> {
    fn of(&self, vertex: usize) -> [u8; 3] {
        match self {
            Colours::One(colour) => *colour,
            Colours::OfPicture(colours) => colours.get(vertex).copied().unwrap_or_default(),
        }
    }
}

/// The endings of file names, and their formats.
const ENDINGS: [(&str, MeshFile); 3] = [("stl", MeshFile::Stl), ("ply", MeshFile::Ply), ("glb", MeshFile::Glb)];

impl MeshFile {
    /// Chooses the format by the ending of a file name.
    ///
    /// # Errors
    /// The ending is not that of a format.
    pub fn of(path: &Path) -> Result<MeshFile, InputError> {
        let ending = path.extension().unwrap_or_default();
        match ENDINGS.iter().find(|(known, _)| ending.eq_ignore_ascii_case(known)) {
            Some((_, format)) => Ok(*format),
            None => Err(InputError::new(path, "file", "must end in .stl, .ply or .glb")),
        }
    }

    /// Writes a mesh to a file.
    ///
    /// # Errors
    /// The mesh is too large for the format, or the file cannot be written. Whatever was at `path` before is then unchanged.
    pub fn write(self, mesh: &Mesh, colours: Colours, path: &Path) -> Result<(), InputError> {
        let write = || {
            let mut file = Unfinished::create(path)?;
            self.put(mesh, colours, &mut file)?;
            file.complete()
        };
        write().map_err(|e: io::Error| InputError::unwritable(path, &e))
    }

    fn put(self, mesh: &Mesh, colours: Colours, out: &mut impl Write) -> io::Result<()> {
        match self {
            MeshFile::Stl => stl(mesh, out),
            MeshFile::Ply => ply(mesh, colours, out),
            MeshFile::Glb => glb(mesh, colours, out),
        }
    }
}

fn three(v: DVec3) -> [[u8; 4]; 3] {
    v.to_array().map(|value| (value as f32).to_le_bytes())
}

fn count(n: usize, what: &str) -> io::Result<u32> {
    u32::try_from(n).map_err(|_| io::Error::other(format!("{n} {what} are more than the format holds")))
}

fn stl(mesh: &Mesh, file: &mut impl Write) -> io::Result<()> {
    let mut head = [b' '; 80];
    // Not "solid", by which files of text begin.
    let title = b"binary STL of Echolume, mm";
    head[..title.len()].copy_from_slice(title);
    file.write_all(&head)?;
    file.write_all(&count(mesh.triangles.len(), "triangles")?.to_le_bytes())?;
    for triangle in &mesh.triangles {
        file.write_all(three(mesh.normal_area(triangle).normalize_or_zero()).as_flattened())?;
        mesh.corners(triangle).iter().try_for_each(|corner| file.write_all(three(*corner).as_flattened()))?;
        file.write_all(&[0; 2])?;
    }
    Ok(())
}

fn ply(mesh: &Mesh, colours: Colours, file: &mut impl Write) -> io::Result<()> {
    let (vertices, faces) = (mesh.vertices.len(), mesh.triangles.len());
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\ncomment mm\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )?;
    count(vertices, "vertices")?;
    for (n, (vertex, normal)) in mesh.vertices.iter().zip(mesh.normals()).enumerate() {
        file.write_all([three(*vertex), three(normal)].as_flattened().as_flattened())?;
        file.write_all(&colours.of(n))?;
    }
    for triangle in &mesh.triangles {
        file.write_all(&[3])?;
        triangle.iter().try_for_each(|n| file.write_all(&n.to_le_bytes()))?;
    }
    Ok(())
}

/// Bytes of a vertex in a GLB: position, normal, and colour with alpha.
const GLB_VERTEX: usize = 28;

fn glb(mesh: &Mesh, colours: Colours, file: &mut impl Write) -> io::Result<()> {
    let (vertices, indices) = (mesh.vertices.len(), 3 * mesh.triangles.len());
    let all = |first: DVec3, f: fn(DVec3, DVec3) -> DVec3| mesh.vertices.iter().copied().fold(first, f);
    // The bounds of what is stored: rounded as the vertices are.
    let bounds = [all(DVec3::INFINITY, DVec3::min), all(DVec3::NEG_INFINITY, DVec3::max)];
    let [low, high] = bounds.map(|v| v.to_array().map(|v| if v.is_finite() { v as f32 } else { 0.0 }));
    let split = vertices * GLB_VERTEX;
    let length = split + 4 * indices;
    let has_mesh = indices > 0;
    let accessors = json!([
        { "bufferView": 0, "byteOffset": 0, "componentType": 5126, "count": vertices, "type": "VEC3", "min": low, "max": high },
        { "bufferView": 0, "byteOffset": 12, "componentType": 5126, "count": vertices, "type": "VEC3" },
        { "bufferView": 0, "byteOffset": 24, "componentType": 5121, "normalized": true, "count": vertices, "type": "VEC4" },
        { "bufferView": 1, "byteOffset": 0, "componentType": 5125, "count": indices, "type": "SCALAR" }
    ]);
    let mut scene = json!({
        "asset": { "version": "2.0", "generator": "Echolume" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        // glTF is in metres.
        "nodes": [{ "name": "surface, mm", "mesh": 0, "scale": [0.001, 0.001, 0.001] }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "COLOR_0": 2 }, "indices": 3, "material": 0
        }] }],
        "materials": [{ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.8 } }],
        "buffers": [{ "byteLength": length }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": split, "byteStride": GLB_VERTEX, "target": 34962 },
            { "buffer": 0, "byteOffset": split, "byteLength": 4 * indices, "target": 34963 }
        ],
        "accessors": accessors
    });
    if matches!(colours, Colours::OfPicture(_)) {
        // They are lit already, and an open sheet is seen from behind as well.
        scene["extensionsUsed"] = json!(["KHR_materials_unlit"]);
        scene["materials"] = json!([{
            "extensions": { "KHR_materials_unlit": {} }, "doubleSided": true,
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.9 }
        }]);
    }
    // A buffer of no bytes is not allowed.
    let empty = json!({ "asset": scene["asset"], "scene": 0, "scenes": [{}] });
    let mut text = if has_mesh { scene } else { empty }.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    // All vertices and indices are multiples of 4 bytes.
    let binary = if has_mesh { 8 + length } else { 0 };
    let total = count(12 + 8 + text.len() + binary, "bytes")?;
    file.write_all(b"glTF\x02\0\0\0")?;
    file.write_all(&total.to_le_bytes())?;
    file.write_all(&count(text.len(), "bytes")?.to_le_bytes())?;
    file.write_all(b"JSON")?;
    file.write_all(&text)?;
    if !has_mesh {
        return Ok(());
    }
    file.write_all(&count(length, "bytes")?.to_le_bytes())?;
    file.write_all(b"BIN\0")?;
    for (n, (vertex, normal)) in mesh.vertices.iter().zip(mesh.normals()).enumerate() {
        let [r, g, b] = colours.of(n).map(linear);
        file.write_all([three(*vertex), three(normal)].as_flattened().as_flattened())?;
        file.write_all(&[r, g, b, 255])?;
    }
    mesh.triangles.iter().flatten().try_for_each(|n| file.write_all(&n.to_le_bytes()))
}

/// An sRGB component as a linear one: colours of glTF vertices are linear.
fn linear(component: u8) -> u8 {
    let value = f64::from(component) / 255.0;
    let linear = if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
    (255.0 * linear).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron of volume 1/6.
    fn tetrahedron() -> Mesh {
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        Mesh { vertices, triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], open_edges: 0 }
    }

    fn float(bytes: &[u8], at: usize) -> f32 {
        f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
    }

    fn word(bytes: &[u8], at: usize) -> usize {
        u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize
    }

    fn written(ending: &str, mesh: &Mesh) -> Vec<u8> {
        let format = MeshFile::of(Path::new(&format!("mesh.{ending}"))).expect("known");
        let mut bytes = Vec::new();
        format.put(mesh, Colours::One([255, 128, 0]), &mut bytes).expect("written");
        bytes
    }

    #[test]
    fn a_tetrahedron_has_its_measures() {
        let mesh = tetrahedron();
        assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-15);
        assert!((mesh.area() - (1.5 + 3f64.sqrt() / 2.0)).abs() < 1e-15);
        // Three triangles of area 1/2 along the axes meet at the origin.
        assert!(mesh.normals()[0].distance(DVec3::splat(-1.0 / 3f64.sqrt())) < 1e-15);
    }

    #[test]
    fn stl_has_each_triangle_with_its_normal() {
        let bytes = written("STL", &tetrahedron());
        assert_eq!((bytes.len(), word(&bytes, 80)), (84 + 4 * 50, 4));
        let last = 84 + 3 * 50;
        assert!([0, 4, 8].iter().all(|at| (float(&bytes, last + at) - 1.0 / 3f32.sqrt()).abs() < 1e-6));
        let corners: Vec<f32> = (0..9).map(|n| float(&bytes, last + 12 + 4 * n)).collect();
        assert_eq!(corners, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        assert!(!bytes.starts_with(b"solid"));
    }

    #[test]
    fn ply_shares_vertices() {
        let bytes = written("ply", &tetrahedron());
        let end = bytes.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
        assert_eq!(bytes.len(), end + 4 * 27 + 4 * 13);
        assert_eq!((float(&bytes, end + 27), &bytes[end + 24..end + 27]), (1.0, &[255, 128, 0][..]));
        let faces = end + 4 * 27;
        assert_eq!([1, 5, 9].map(|at| word(&bytes, faces + 3 * 13 + at)), [1, 2, 3]);
    }

    #[test]
    fn glb_says_what_it_holds() {
        let bytes = written("glb", &tetrahedron());
        assert_eq!((&bytes[..4], word(&bytes, 4), word(&bytes, 8)), (&b"glTF"[..], 2, bytes.len()));
        let length = word(&bytes, 12);
        let scene: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).expect("JSON");
        let (binary, size) = (20 + length + 8, word(&bytes, 20 + length));
        assert!(length.is_multiple_of(4) && &bytes[16..20] == b"JSON" && &bytes[20 + length + 4..binary] == b"BIN\0");
        assert_eq!((size, bytes.len()), (4 * 28 + 12 * 4, binary + size));
        assert_eq!(scene["accessors"][0]["max"], json!([1.0, 1.0, 1.0]));
        assert_eq!(scene["accessors"][0]["min"], json!([0.0, 0.0, 0.0]));
        let from = |view: usize| scene["bufferViews"][view]["byteOffset"].as_u64().expect("an offset") as usize;
        let indices: Vec<usize> = (0..3).map(|n| word(&bytes, binary + from(1) + 4 * (9 + n))).collect();
        assert_eq!(indices, [1, 2, 3]);
        // Of sRGB 128 the linear value is 0.216.
        assert_eq!(bytes[binary + 24..binary + 28], [255, 55, 0, 255]);
        let empty = written("glb", &Mesh::default());
        assert_eq!(word(&empty, 8), empty.len());
        assert!(serde_json::from_slice::<serde_json::Value>(&empty[20..]).is_ok());
    }

    #[test]
    fn colours_of_a_picture_are_those_of_their_vertices_and_not_lit_again() {
        let colours = [[255, 128, 0], [0, 0, 255], [1, 2, 3], [255; 3]];
        let mut ply = Vec::new();
        MeshFile::Ply.put(&tetrahedron(), Colours::OfPicture(&colours), &mut ply).expect("written");
        let end = ply.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
        let of = |n: usize| [0, 1, 2].map(|c| ply[end + 27 * n + 24 + c]);
        assert_eq!([0, 1, 2, 3].map(of), colours);
        let mut glb = Vec::new();
        MeshFile::Glb.put(&tetrahedron(), Colours::OfPicture(&colours), &mut glb).expect("written");
        let length = word(&glb, 12);
        let scene: serde_json::Value = serde_json::from_slice(&glb[20..20 + length]).expect("JSON");
        assert_eq!(scene["extensionsUsed"], json!(["KHR_materials_unlit"]));
        assert!(scene["materials"][0]["extensions"]["KHR_materials_unlit"].is_object());
        let first = 20 + length + 8 + 24;
        assert_eq!(
            (&glb[first..first + 4], &glb[first + 28..first + 32]),
            (&[255, 55, 0, 255][..], &[0, 0, 255, 255][..])
        );
    }

    #[test]
    fn other_endings_are_refused() {
        for name in ["face.obj", "face", "stl"] {
            assert!(MeshFile::of(Path::new(name)).is_err_and(|e| e.to_string().contains(".stl, .ply or .glb")));
        }
    }
}
