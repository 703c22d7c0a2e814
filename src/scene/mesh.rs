//! Indexed triangle meshes as they come from a file: the description side, in f64.

use std::collections::HashMap;

use glam::DVec3;

/// What users are told of a file that has them: meshes keep none.
pub(super) const COLOURS: &str = "the colours of vertices are not read";

/// An indexed triangle mesh. Positions keep the file's values (f32 files widen exactly), indices the file's order
/// and winding; nothing is dropped here, so triangle `i` of the mesh is triangle `i` of the file (polygons are
/// made of triangles in place).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, object space, scene units. May hold non-finite values: they are dropped and counted when
    /// the world is compiled.
    pub positions: Vec<DVec3>,
    /// Vertex indices of each triangle; always in range of `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Runs of triangles with a common material or group, in order, covering all triangles; empty means one
    /// unnamed run.
    pub groups: Vec<MeshGroup>,
    /// Shading normals, object space, need not be unit; zero or not finite where the file has none.
    pub normals: Attribute<[f32; 3]>,
    /// Sets of texture coordinates: u to the right, v down, the picture's upper left corner at (0, 0). Importers turn
    /// the v of formats where it points up.
    pub uvs: [Attribute<[f32; 2]>; 2],
    /// Tangents x, y, z with the bitangent's sign in w, as glTF 2.0 defines them (section 3.7.2.1).
    pub tangents: Attribute<[f32; 4]>,
}

/// Values at the corners of triangles; absent if there are no values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attribute<T> {
    /// The values.
    pub values: Vec<T>,
    /// Indices of the values at each triangle's corners, in range; empty means those of the vertices.
    pub indices: Vec<[u32; 3]>,
}

impl<T: Copy> Attribute<T> {
    /// The values at the corners of triangle `i`, whose vertices are `vertices`; `None` if there are no values.
    pub fn corners(&self, i: usize, vertices: [u32; 3]) -> Option<[T; 3]> {
        if self.values.is_empty() {
            return None;
        }
        let indices = self.indices.get(i).copied().unwrap_or(vertices);
        Some(indices.map(|k| self.values[k as usize]))
    }

    fn check(&self, what: &str, triangles: &[[u32; 3]]) -> Result<(), String> {
        let by_vertex = triangles.get(self.indices.len()..).filter(|_| !self.values.is_empty());
        in_range(what, self.values.len(), by_vertex.unwrap_or_default())?;
        in_range(what, self.values.len(), if self.values.is_empty() { &[] } else { &self.indices })
    }

    /// Bytes of values and indices.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&self.values[..]) + size_of_val(&self.indices[..])) as u64
    }
}

/// Whether all of `indices` are below `count`.
fn in_range(what: &str, count: usize, indices: &[[u32; 3]]) -> Result<(), String> {
    match indices.as_flattened().iter().max() {
        Some(&most) if most as usize >= count => {
            Err(format!("triangles name {what} up to {most}, but there are {count}"))
        }
        _ => Ok(()),
    }
}

/// A run of triangles of a [`Mesh`] that share a name (OBJ `g`/`usemtl`).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshGroup {
    /// Group or object name, may be empty.
    pub name: String,
    /// Material name, may be empty.
    pub material: String,
    /// First triangle of the run.
    pub first: u32,
    /// Number of triangles.
    pub count: u32,
}

impl Mesh {
    /// Whether all indices name something that is there.
    ///
    /// # Errors
    /// What does not.
    pub fn check(&self) -> Result<(), String> {
        let Self { positions, triangles, normals, uvs: [first, second], tangents, .. } = self;
        in_range("positions", positions.len(), triangles)?;
        normals.check("normals", triangles)?;
        first.check("texture coordinates", triangles)?;
        second.check("texture coordinates", triangles)?;
        tangents.check("tangents", triangles)
    }

    /// The three corners of triangle `i`.
    pub fn corners(&self, i: usize) -> [DVec3; 3] {
        self.triangles[i].map(|v| self.positions[v as usize])
    }

    /// Lower and upper corner of the finite referenced vertices, or `None` if there are none.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let mut range: Option<(DVec3, DVec3)> = None;
        for &v in self.triangles.iter().flatten() {
            let p = self.positions[v as usize];
            if p.is_finite() {
                range = Some(range.map_or((p, p), |(lo, hi)| (lo.min(p), hi.max(p))));
            }
        }
        range
    }

    /// For each vertex the first one at its place: files often give one corner several numbers. Zeros of both signs are one
    /// place.
    pub fn first_at_place(positions: &[DVec3]) -> Vec<u32> {
        let mut first_at = HashMap::with_capacity(positions.len());
        let place = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
        positions.iter().zip(0..).map(|(p, i)| *first_at.entry(place(*p)).or_insert(i)).collect()
    }

    /// Volume inside, if the mesh is closed and winds counter-clockwise seen from outside (the divergence theorem).
    pub fn volume(&self) -> f64 {
        // From a point nearby: far from the origin, products would cancel.
        let near = self.positions.first().copied().unwrap_or(DVec3::ZERO);
        let tetrahedron = |i| {
            let [a, b, c] = self.corners(i).map(|p| p - near);
            a.dot(b.cross(c)) / 6.0
        };
        (0..self.triangles.len()).map(tetrahedron).sum()
    }

    /// Sum of the triangles' areas.
    pub fn area(&self) -> f64 {
        let triangle = |i| {
            let [a, b, c] = self.corners(i);
            0.5 * (b - a).cross(c - a).length()
        };
        (0..self.triangles.len()).map(triangle).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_must_name_what_is_there() {
        let mut mesh =
            Mesh { positions: vec![DVec3::ZERO; 3], triangles: vec![[0, 1, 2], [2, 1, 0]], ..Mesh::default() };
        assert_eq!((Mesh::default().check(), mesh.check()), (Ok(()), Ok(())));
        mesh.normals = Attribute { values: vec![[0.0; 3]; 2], indices: vec![[0, 1, 1]; 2] };
        assert_eq!(mesh.check(), Ok(()));
        mesh.normals.indices.pop();
        assert_eq!(mesh.check(), Err("triangles name normals up to 2, but there are 2".into()));
        mesh.normals.indices = vec![[0, 7, 0]; 2];
        assert_eq!(mesh.check(), Err("triangles name normals up to 7, but there are 2".into()));
        mesh.normals.values.clear();
        assert_eq!(mesh.check(), Ok(()), "there are none");
        mesh.triangles[0][1] = 3;
        assert_eq!(mesh.check(), Err("triangles name positions up to 3, but there are 3".into()));
    }
}
