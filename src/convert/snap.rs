//! Positions as files hold them.

use std::collections::HashSet;

use glam::DVec3;

use super::vertices::Vertex;

/// Steps inward before giving up.
const TRIES: u32 = 64;

/// Rounds positions to `f32`, no two vertices to the same place: readers join vertices by their places. One that
/// would share a place is moved inward by a few units in the last place.
///
/// # Errors
/// Vertices that cannot be told apart: cells as small as the rounding.
pub fn snap(vertices: &[Vertex]) -> Result<Vec<DVec3>, String> {
    let mut taken: HashSet<[u32; 3]> = HashSet::with_capacity(vertices.len());
    let mut snapped = Vec::with_capacity(vertices.len());
    for vertex in vertices {
        let free = (0..TRIES).map(|tries| moved(vertex, tries)).find(|p| taken.insert(p.map(f32::to_bits)));
        let free = free.ok_or("cells are too small for the digits of f32, in which vertices are written")?;
        snapped.push(DVec3::from_array(free.map(f64::from)));
    }
    Ok(snapped)
}

/// The vertex moved by `tries` roundings of its largest coordinate.
fn moved(vertex: &Vertex, tries: u32) -> [f32; 3] {
    let ulp = vertex.position.abs().max_element() * f64::from(f32::EPSILON);
    // Minus zero is another word for the same place.
    (vertex.position - vertex.normal * (2.0 * ulp * f64::from(tries))).to_array().map(|x| x as f32 + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_at_one_place_are_parted_by_a_few_roundings() {
        let vertex = |normal| Vertex { position: DVec3::new(1.0, 2.0, -3.0), normal };
        let got = snap(&[vertex(DVec3::X), vertex(DVec3::X), vertex(DVec3::NEG_Z)]).unwrap();
        assert_eq!(got[0], DVec3::new(1.0, 2.0, -3.0));
        assert!(got[1] != got[0] && got[2] != got[0] && got[2] != got[1]);
        assert!(got.iter().all(|p| (*p - got[0]).length() < 4e-6), "{got:?}");
        let same = Vertex { position: DVec3::ZERO, normal: DVec3::Z };
        assert!(snap(&[same, same]).is_err());
    }
}
