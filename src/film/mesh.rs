//! Triangle meshes as files: binary STL, OBJ, binary PLY.
//!
//! Positions are written as the nearest `f32`; what the mesh was made with is in the comment, cut to the 80 bytes
//! that STL has.

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::atomic::{Writer, write_atomically};
use crate::error::{Error, Result};
use crate::scene::mesh::Mesh;

/// Kinds of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshKind {
    /// Binary STL: 3D Systems, "StereoLithography Interface Specification", 1988.
    Stl,
    /// Text: Alias|Wavefront, "Object Files (.obj)", 1995.
    Obj,
    /// Binary, little-endian: G. Turk, "The PLY Polygon File Format", 1994.
    Ply,
}

impl MeshKind {
    /// The kind that a file name asks for.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "stl" => Some(Self::Stl),
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }
}

/// Writes `mesh`, whose triangles wind counter-clockwise seen from outside. `comment` is one line.
///
/// # Errors
/// [`Error::Io`]; more than 2^32 - 1 triangles.
pub fn write_mesh(path: &Path, kind: MeshKind, mesh: &Mesh, comment: &str) -> Result<()> {
    let Ok(count) = u32::try_from(mesh.triangles.len()) else {
        return Err(Error::Usage(format!("{} triangles are too many for a file of meshes", mesh.triangles.len())));
    };
    let comment: String = comment.chars().map(|c| if c.is_ascii_graphic() { c } else { ' ' }).collect();
    write_atomically(path, |w| match kind {
        MeshKind::Stl => stl(w, mesh, count, &comment),
        MeshKind::Obj => obj(w, mesh, &comment),
        MeshKind::Ply => ply(w, mesh, &comment),
    })
}

fn single(p: DVec3) -> [f32; 3] {
    p.to_array().map(|x| x as f32)
}

fn stl(w: &mut Writer<'_>, mesh: &Mesh, count: u32, comment: &str) -> io::Result<()> {
    // `solid` at the start would make it look like text.
    let mut header = [b' '; 80];
    let text = format!("binary STL, {comment}");
    let length = text.len().min(80);
    header[..length].copy_from_slice(&text.as_bytes()[..length]);
    w.write_all(&header)?;
    w.write_all(&count.to_le_bytes())?;
    for i in 0..mesh.triangles.len() {
        let corners = mesh.corners(i);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for x in [normal, a, b, c].into_iter().flat_map(single) {
            w.write_all(&x.to_le_bytes())?;
        }
        w.write_all(&[0, 0])?;
    }
    Ok(())
}

fn obj(w: &mut Writer<'_>, mesh: &Mesh, comment: &str) -> io::Result<()> {
    writeln!(w, "# {comment}")?;
    for [x, y, z] in mesh.positions.iter().copied().map(single) {
        writeln!(w, "v {x} {y} {z}")?;
    }
    for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|i| u64::from(i) + 1)) {
        writeln!(w, "f {a} {b} {c}")?;
    }
    Ok(())
}

fn ply(w: &mut Writer<'_>, mesh: &Mesh, comment: &str) -> io::Result<()> {
    write!(
        w,
        "ply\nformat binary_little_endian 1.0\ncomment {comment}\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    for x in mesh.positions.iter().copied().flat_map(single) {
        w.write_all(&x.to_le_bytes())?;
    }
    for triangle in &mesh.triangles {
        w.write_all(&[3])?;
        for i in triangle {
            w.write_all(&i.to_le_bytes())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{obj, ply, stl};

    /// What the project's own readers make of it: the same corners of the same triangles.
    #[test]
    fn readers_read_it_back() {
        let positions = [[0.0, 0.0, 0.0], [1.5, 0.0, 1e-7], [0.0, -3e9, 0.0], [0.1, 0.2, 0.3]];
        let positions = positions.map(|p: [f32; 3]| DVec3::from_array(p.map(f64::from))).to_vec();
        let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let mesh = Mesh { positions, triangles, groups: Vec::new(), ..Mesh::default() };
        let dir = tempfile::tempdir().unwrap();
        for name in ["a.stl", "a.obj", "a.PLY"] {
            let path = dir.path().join(name);
            let kind = MeshKind::of(&path).unwrap();
            let comment =
                "solid with a line\nbreak and a comment that is much longer than the header of an STL file has room";
            write_mesh(&path, kind, &mesh, comment).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            let back = match kind {
                MeshKind::Stl => stl::parse(&path, &bytes),
                MeshKind::Obj => obj::parse(&path, &bytes).map(|file| file.mesh),
                MeshKind::Ply => ply::parse(&path, &bytes),
            };
            let back = back.unwrap();
            // Decimals of a text are those of an `f32`.
            let corners = |m: &Mesh| (0..m.triangles.len()).map(|i| m.corners(i).map(single)).collect::<Vec<_>>();
            assert_eq!(corners(&back), corners(&mesh), "{name}");
            assert_eq!(back.positions.len(), 4, "{name}");
        }
        assert_eq!(MeshKind::of(Path::new("a.gltf")), None);
    }
}
