//! Bags of triangles that enclose a solid: `bot` of mode solid, and polysolids.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;

use crate::scene::mesh::Mesh;
use crate::scene::solids;
use crate::scene::solids::flat::closed;

/// The mode of a bot that encloses something.
const SOLID: u8 = 2;

/// The solid inside the triangles `faces` between `vertices`. Their order of corners may be anything: neighbours are
/// turned the same way, and every connected piece outwards: what is in any piece is inside, so one inside another is no void.
///
/// # Errors
/// In words: it is a surface or a plate; it is not closed; its triangles cannot be turned the same way.
pub(super) fn solid(mode: u8, vertices: &[DVec3], faces: &[[u32; 3]]) -> Result<solids::Solid, String> {
    if mode != SOLID {
        return Err("a `bot` that is a surface or a plate is not supported, those of mode solid are".into());
    }
    let mut triangles = welded(vertices, faces);
    turn(vertices, &mut triangles)?;
    let mesh = Mesh { positions: vertices.to_vec(), triangles, ..Mesh::default() };
    closed(&mesh)?;
    Ok(solids::Solid::Mesh(Arc::new(mesh)))
}

/// Corners at one place as one corner, without triangles that lose their area by that.
fn welded(vertices: &[DVec3], faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let first = Mesh::first_at_place(vertices);
    let corners = faces.iter().map(|face| face.map(|i| first[i as usize]));
    corners.filter(|[a, b, c]| a != b && b != c && c != a).collect()
}

/// Turns the triangles of each connected piece the same way, outwards.
fn turn(positions: &[DVec3], triangles: &mut [[u32; 3]]) -> Result<(), String> {
    let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let mut beside: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
    for (i, triangle) in triangles.iter().enumerate() {
        for (a, b) in edges(*triangle) {
            beside.entry((a.min(b), a.max(b))).or_default().push(i as u32);
        }
    }
    let mut is_known = vec![false; triangles.len()];
    for first in 0..triangles.len() {
        if is_known[first] {
            continue;
        }
        is_known[first] = true;
        let mut piece = vec![first];
        let mut next = 0;
        while next < piece.len() {
            let i = piece[next];
            next += 1;
            for (a, b) in edges(triangles[i]) {
                // Where more than two triangles meet, the way round cannot be told from one edge.
                let &[p, q] = &beside[&(a.min(b), a.max(b))][..] else { continue };
                let j = if p as usize == i { q } else { p } as usize;
                let same_way = edges(triangles[j]).contains(&(a, b));
                if is_known[j] && same_way && j != i {
                    return Err("the triangles of the `bot` cannot be turned the same way".into());
                }
                if !is_known[j] {
                    if same_way {
                        triangles[j].swap(1, 2);
                    }
                    is_known[j] = true;
                    piece.push(j);
                }
            }
        }
        let origin = positions[triangles[first][0] as usize];
        let volume = |&i: &usize| {
            let [a, b, c] = triangles[i].map(|k| positions[k as usize] - origin);
            a.dot(b.cross(c))
        };
        if piece.iter().map(volume).sum::<f64>() < 0.0 {
            piece.iter().for_each(|&i| triangles[i].swap(1, 2));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: [[u32; 3]; 12] = [
        [0, 2, 1],
        [0, 3, 2],
        [4, 5, 6],
        [4, 6, 7],
        [0, 1, 5],
        [0, 5, 4],
        [1, 2, 6],
        [1, 6, 5],
        [2, 3, 7],
        [2, 7, 6],
        [3, 0, 4],
        [3, 4, 7],
    ];

    fn corners(at: f64) -> Vec<DVec3> {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        [0.0, 1.0].iter().flat_map(|&z| square.map(|(x, y)| DVec3::new(x + at, y, z))).collect()
    }

    #[test]
    fn any_order_of_corners_gives_two_cubes_turned_outwards() {
        for flips in 0..1u32 << 12 {
            // Every triangle with corners of its own, as in a polysolid.
            let (mut vertices, mut faces) = (Vec::new(), Vec::new());
            for (offset, turned) in [(0.0, flips), (5.0, flips.rotate_left(7) ^ 0x5a5)] {
                for (i, face) in CUBE.iter().enumerate() {
                    let at = vertices.len() as u32;
                    vertices.extend(face.map(|k| corners(offset)[k as usize]));
                    faces.push(if turned >> i & 1 == 0 { [at, at + 1, at + 2] } else { [at, at + 2, at + 1] });
                }
            }
            let mut triangles = welded(&vertices, &faces);
            turn(&vertices, &mut triangles).unwrap();
            for cube in triangles.chunks(12) {
                let mesh = Mesh { positions: vertices.clone(), triangles: cube.to_vec(), ..Mesh::default() };
                assert!((mesh.volume() - 1.0).abs() < 1e-12, "{flips:b}");
            }
        }
    }

    #[test]
    fn surfaces_holes_and_one_sided_bands_are_refused() {
        assert!(solid(1, &corners(0.0), &CUBE).unwrap_err().contains("surface"));
        assert!(solid(2, &corners(0.0), &CUBE[1..]).unwrap_err().contains("not closed"));
        // A band of five triangles with half a turn.
        let band = [[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 0], [4, 0, 1]];
        let places: Vec<DVec3> = (0..5).map(|i| DVec3::new(f64::from(i), f64::from(i * i), f64::from(i % 2))).collect();
        assert!(solid(2, &places, &band).unwrap_err().contains("the same way"));
    }
}
