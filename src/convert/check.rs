//! Whether a mesh is closed and a manifold: asked before it is written.

use glam::DVec3;

use crate::scene::mesh::Mesh;

/// What a closed, manifold mesh is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Topology {
    /// Vertices - edges + triangles: 2 for each surface like a sphere's, less 2 for each handle.
    pub euler: i64,
    /// Number of connected surfaces.
    pub shells: usize,
}

/// Checks that every edge is in two triangles, once each way, that the triangles around each vertex are one fan, and
/// that no triangle has an area of zero and no two vertices one place.
///
/// # Errors
/// What is wrong, in words.
pub fn check(mesh: &Mesh) -> Result<Topology, String> {
    let count = mesh.positions.len();
    // Directed edges with the third vertex of their triangle.
    let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * mesh.triangles.len());
    let mut fans = vec![0u32; count];
    for (i, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        if area(mesh.corners(i)) <= 0.0 {
            return Err(format!("triangle {i} has no area"));
        }
        edges.extend([(a, b, c), (b, c, a), (c, a, b)]);
        [a, b, c].iter().for_each(|&v| fans[v as usize] += 1);
    }
    edges.sort_unstable();
    if let Some(w) = edges.windows(2).find(|w| (w[0].0, w[0].1) == (w[1].0, w[1].1)) {
        return Err(format!("the edge from vertex {} to {} is in two triangles the same way", w[0].0, w[0].1));
    }
    let after = |a: u32, b: u32| edges.binary_search_by_key(&(a, b), |e| (e.0, e.1)).ok().map(|i| edges[i].2);
    if let Some((a, b, _)) = edges.iter().find(|(a, b, _)| after(*b, *a).is_none()) {
        return Err(format!("the edge from vertex {a} to {b} has one side"));
    }
    let mut i = 0;
    for (v, &size) in (0..).zip(&fans) {
        let Some(&(_, first, _)) = edges.get(i).filter(|_| size > 0) else {
            return Err(format!("vertex {v} is in no triangle"));
        };
        let (mut at, mut steps) = (first, 0);
        while steps == 0 || at != first {
            at = after(v, at).ok_or("an edge has one side")?;
            steps += 1;
        }
        if steps != size {
            return Err(format!("vertex {v} joins two sheets"));
        }
        i += size as usize;
    }
    let mut places: Vec<[u64; 3]> = mesh.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
    places.sort_unstable();
    if places.windows(2).any(|w| w[0] == w[1]) {
        return Err("two vertices are at one place".into());
    }
    let euler = count as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64;
    let shells = (0..).zip(roots(&mesh.triangles, count)).filter(|(v, root)| v == root).count();
    Ok(Topology { euler, shells })
}

/// Twice the area of a triangle.
pub fn area([a, b, c]: [DVec3; 3]) -> f64 {
    (b - a).cross(c - a).length()
}

/// The first vertex of each vertex's connected surface, by union and find. `count` is the number of vertices.
pub fn roots(triangles: &[[u32; 3]], count: usize) -> Vec<u32> {
    let mut root: Vec<u32> = (0..count as u32).collect();
    let find = |root: &mut [u32], mut v: u32| {
        while root[v as usize] != v {
            root[v as usize] = root[root[v as usize] as usize];
            v = root[v as usize];
        }
        v
    };
    for &[a, b, c] in triangles {
        for other in [b, c] {
            let (p, q) = (find(&mut root, a), find(&mut root, other));
            root[p.max(q) as usize] = p.min(q);
        }
    }
    (0..count as u32).map(|v| find(&mut root, v)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].to_vec();
        Mesh { positions, triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], ..Mesh::default() }
    }

    #[test]
    fn a_tetrahedron_passes_and_every_fault_is_found() {
        assert_eq!(check(&tetrahedron()), Ok(Topology { euler: 2, shells: 1 }));
        let broken = |change: &dyn Fn(&mut Mesh), what: &str| {
            let mut mesh = tetrahedron();
            change(&mut mesh);
            let fault = check(&mesh).unwrap_err();
            assert!(fault.contains(what), "{fault}");
        };
        broken(&|m| m.triangles.truncate(3), "one side");
        broken(&|m| m.triangles[0].reverse(), "same way");
        broken(&|m| m.positions[3] = DVec3::new(1.0, 1.0, 0.0) * 0.5, "no area");
        broken(&|m| m.positions.push(DVec3::ONE), "in no triangle");
        // A second one with a vertex of the first.
        let second = |m: &mut Mesh, joined: bool| {
            m.positions.extend([-DVec3::X, -DVec3::Y, -DVec3::Z]);
            let more: Vec<_> = m.triangles.iter().map(|t| t.map(|v| if v == 0 { 0 } else { v + 3 })).collect();
            m.triangles.extend(more.iter().map(|[a, b, c]| [*a, *c, *b]));
            if !joined {
                m.positions.push(DVec3::ZERO);
                m.triangles[4..].iter_mut().flatten().filter(|v| **v == 0).for_each(|v| *v = 7);
            }
        };
        broken(&|m| second(m, true), "joins two sheets");
        broken(&|m| second(m, false), "one place");
        let mut two = tetrahedron();
        second(&mut two, false);
        two.positions[7] = DVec3::splat(-0.1);
        assert_eq!(check(&two), Ok(Topology { euler: 4, shells: 2 }));
    }
}
