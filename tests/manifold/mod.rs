//! Whether a mesh is closed and a manifold, apart from the library's own check.

use std::collections::{HashMap, HashSet};

use lanecast::scene::mesh::Mesh;

/// Checks that every edge is in two triangles, once each way, that the triangles around each vertex are one fan, and
/// that no two vertices are at one place. Gives the Euler characteristic.
pub fn manifold(mesh: &Mesh, what: &str) -> i64 {
    let mut after: HashMap<(u32, u32), u32> = HashMap::new();
    let mut used: HashSet<u32> = HashSet::new();
    for &[a, b, c] in &mesh.triangles {
        assert!(a != b && b != c && c != a, "{what}: a triangle has a corner twice");
        for (a, b, c) in [(a, b, c), (b, c, a), (c, a, b)] {
            assert_eq!(after.insert((a, b), c), None, "{what}: edge {a} {b} twice the same way");
            used.insert(a);
        }
    }
    for (a, b) in after.keys() {
        assert!(after.contains_key(&(*b, *a)), "{what}: edge {a} {b} has one side");
    }
    let places: HashSet<[u64; 3]> = mesh.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
    assert_eq!(places.len(), mesh.positions.len(), "{what}: two vertices at one place");
    assert_eq!(used.len(), mesh.positions.len(), "{what}: a vertex without triangles");
    one_fan_each(mesh, &after, what);
    mesh.positions.len() as i64 - after.len() as i64 / 2 + mesh.triangles.len() as i64
}

/// Goes round each vertex from one of its triangles; all of them must be met.
fn one_fan_each(mesh: &Mesh, after: &HashMap<(u32, u32), u32>, what: &str) {
    let mut around = vec![(0, 0); mesh.positions.len()];
    for &[a, b, c] in &mesh.triangles {
        for (v, next) in [(a, b), (b, c), (c, a)] {
            around[v as usize] = (around[v as usize].0 + 1, next);
        }
    }
    for (v, &(size, first)) in (0..).zip(&around) {
        let (mut at, mut steps) = (first, 0);
        while steps < size {
            at = after[&(v, at)];
            steps += 1;
            if at == first {
                break;
            }
        }
        assert_eq!((at, steps), (first, size), "{what}: vertex {v} joins two sheets");
    }
}
