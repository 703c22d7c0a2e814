//! A heightfield mesh from value noise; the same bits on every machine (only + - * / on integers and f64).
//!
//! Source: K. Perlin, "An Image Synthesizer", SIGGRAPH 1985 (noise on an integer lattice, sums of octaves); the
//! quintic fade is his "Improving Noise", SIGGRAPH 2002; damping by height: F. K.
//! Musgrave in "Texturing and Modeling", 1994.

use glam::DVec3;

use super::hash::{mix3, unit};
use crate::scene::mesh::Mesh;

/// Largest field: ten million triangles.
pub const MAX_SIZE: u32 = 2300;
/// Octaves summed.
const OCTAVES: u32 = 6;
/// Lattice cells of the lowest octave across the field.
const CELLS: f64 = 3.0;

/// A square field of `size` x `size` quads, two triangles each, over -0.5..0.5 in x and z, heights 0..1 in y;
/// counter-clockwise seen from above.
pub fn terrain(size: u32, seed: u32) -> Mesh {
    let side = size + 1;
    let step = 1.0 / f64::from(size);
    let mut positions = Vec::with_capacity(side as usize * side as usize);
    for j in 0..side {
        for i in 0..side {
            let (x, z) = (f64::from(i) * step, f64::from(j) * step);
            positions.push(DVec3::new(x - 0.5, height(x, z, seed), z - 0.5));
        }
    }
    let mut triangles = Vec::with_capacity(2 * size as usize * size as usize);
    for j in 0..size {
        for i in 0..size {
            let a = j * side + i;
            let (b, c, d) = (a + 1, a + side, a + side + 1);
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    Mesh { positions, triangles, groups: Vec::new(), ..Mesh::default() }
}

/// Height in 0..1 at `x`, `z` in 0..1: octaves of noise, each damped where the sum below it is low, so that valleys
/// are smooth and peaks rough; squared, which widens the valleys.
fn height(x: f64, z: f64, seed: u32) -> f64 {
    let (mut sum, mut total, mut amplitude) = (0.0, 0.0, 1.0);
    let mut cells = CELLS;
    for octave in 0..OCTAVES {
        let damping = if octave == 0 { 1.0 } else { sum / total };
        sum += damping * amplitude * noise(x * cells, z * cells, seed.wrapping_add(octave));
        total += amplitude;
        amplitude *= 0.5;
        cells *= 2.0;
    }
    let mean = sum / total;
    mean * mean
}

/// Value noise in 0..1 at a point of the lattice plane, `x` and `z` not negative.
fn noise(x: f64, z: f64, seed: u32) -> f64 {
    let (i, j) = (x.floor(), z.floor());
    let (u, v) = (fade(x - i), fade(z - j));
    let (i, j) = (i as u32, j as u32);
    let corner = |di: u32, dj: u32| unit(mix3(i.wrapping_add(di), j.wrapping_add(dj), seed));
    let near = corner(0, 0) * (1.0 - u) + corner(1, 0) * u;
    let far = corner(0, 1) * (1.0 - u) + corner(1, 1) * u;
    near * (1.0 - v) + far * v
}

/// 6 t^5 - 15 t^4 + 10 t^3: 0 at 0, 1 at 1, first and second derivatives zero at both.
fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_takes_the_hashed_values_at_lattice_points_and_their_mean_between() {
        let lattice = |i, j| unit(mix3(i, j, 9));
        assert_eq!(noise(4.0, 2.0, 9), lattice(4, 2));
        let middle = (lattice(4, 2) + lattice(5, 2) + lattice(4, 3) + lattice(5, 3)) / 4.0;
        assert!((noise(4.5, 2.5, 9) - middle).abs() < 1e-15);
    }

    #[test]
    fn a_field_has_all_its_triangles_facing_up() {
        let mesh = terrain(24, 1);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (25 * 25, 2 * 24 * 24));
        let mut area = 0.0;
        for i in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(i);
            let n = (b - a).cross(c - a);
            assert!(n.y > 0.0);
            area += n.y / 2.0;
        }
        // Projected from above the triangles tile the unit square.
        assert!((area - 1.0).abs() < 1e-12);
        let (low, high) = mesh.bounds().unwrap();
        assert!(low.y >= 0.0 && high.y <= 1.0 && high.y - low.y > 0.3, "{low} {high}");
        assert_ne!(terrain(8, 1).positions, terrain(8, 2).positions);
    }
}
