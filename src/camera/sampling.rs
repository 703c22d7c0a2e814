//! Random numbers as a function of place, so that no result depends on the order of work; directions and bases.

use glam::DVec3;

/// The pcg4d hash of four words: every output bit depends on every input bit.
/// Source: Mark Jarzynski, Marc Olano, *Hash Functions for GPU Rendering*, JCGT 9(3), 2020.
#[inline]
pub fn pcg4d(input: [u32; 4]) -> [u32; 4] {
    let mut v = input.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    mix(&mut v);
    v = v.map(|x| x ^ x >> 16);
    mix(&mut v);
    v
}

#[inline]
fn mix(v: &mut [u32; 4]) {
    v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[3]));
    v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
    v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
    v[3] = v[3].wrapping_add(v[1].wrapping_mul(v[2]));
}

/// The random numbers of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct PixelRandom {
    state: [u32; 4],
}

impl PixelRandom {
    /// Random numbers of pixel (x, y) under `seed`.
    #[inline]
    pub fn new(x: u32, y: u32, seed: u64) -> Self {
        Self { state: pcg4d([x, y, seed as u32, (seed >> 32) as u32]) }
    }

    /// Two independent numbers in [0, 1) for `sample` and `dimension` (a name for what they are used for).
    #[inline]
    pub fn pair(&self, sample: u32, dimension: u32) -> [f64; 2] {
        let [a, b, c, d] = self.state;
        let [x, y, _, _] = pcg4d([a ^ sample, b ^ dimension, c, d]);
        [x, y].map(|bits| f64::from(bits) / 4_294_967_296.0)
    }

    /// Point `index` of an evenly spread sequence over the unit square that starts at a random place of its own in
    /// each pixel and dimension: the R2 sequence, shifted modulo 1.
    ///
    /// Source: Martin Roberts, *The Unreasonable Effectiveness of Quasirandom Sequences*, 2018; the shift is
    /// R. Cranley and T. Patterson, *Randomization of Number Theoretic Methods for Multiple Integration*, 1976.
    #[inline]
    pub fn spread(&self, index: u32, dimension: u32) -> [f64; 2] {
        // 1 / g and 1 / g^2 with g the plastic number, g^3 = g + 1.
        const STEP: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
        let start = self.pair(0, dimension);
        [0, 1].map(|i| {
            let x = start[i] + f64::from(index) * STEP[i];
            x - x.floor()
        })
    }
}

/// Two unit vectors that form a right-handed orthonormal basis with the unit vector `n` (first x second = n).
/// Source: Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin, *Building an Orthonormal Basis, Revisited*,
/// JCGT 6(1), 2017.
pub fn orthonormal_basis(n: DVec3) -> [DVec3; 2] {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y)]
}

/// A unit direction around the unit vector `n`, density cos / pi, from two numbers in [0, 1).
/// Source: Malley's method (a uniform point of the disc, lifted to the hemisphere), in Pharr, Jakob, Humphreys,
/// *Physically Based Rendering*, 4th edition, section A.5.3; here with plain polar coordinates on the disc.
pub fn cosine_hemisphere(n: DVec3, random: [f64; 2]) -> DVec3 {
    let [tangent, bitangent] = orthonormal_basis(n);
    let radius = random[0].sqrt();
    let (sin, cos) = (random[1] * std::f64::consts::TAU).sin_cos();
    let height = (1.0 - random[0]).sqrt();
    tangent * (radius * cos) + bitangent * (radius * sin) + n * height
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_and_depend_on_every_argument() {
        let mut bins = [0u32; 16];
        let mut sum = 0.0;
        for y in 0..64 {
            for x in 0..64 {
                let [a, b] = PixelRandom::new(x, y, 1).pair(3, 2);
                assert!((0.0..1.0).contains(&a) && (0.0..1.0).contains(&b));
                bins[(a * 4.0) as usize * 4 + (b * 4.0) as usize] += 1;
                sum += a;
            }
        }
        // 4096 numbers in 16 bins: 256 each, standard deviation 15.5; five of those either side.
        assert!(bins.iter().all(|&n| (178..=334).contains(&n)), "{bins:?}");
        assert!((sum / 4096.0 - 0.5).abs() < 5.0 * 0.2887 / 64.0);
        let base = PixelRandom::new(5, 6, 7).pair(8, 9);
        assert_eq!(base, PixelRandom::new(5, 6, 7).pair(8, 9));
        let others = [
            PixelRandom::new(4, 6, 7).pair(8, 9),
            PixelRandom::new(5, 7, 7).pair(8, 9),
            PixelRandom::new(5, 6, 7 + (1 << 32)).pair(8, 9),
            PixelRandom::new(5, 6, 7).pair(9, 9),
            PixelRandom::new(5, 6, 7).pair(8, 8),
        ];
        assert!(others.iter().all(|o| o[0] != base[0] && o[1] != base[1]));
    }

    #[test]
    fn spread_points_fill_every_cell_of_a_small_grid() {
        // 64 points of a low-discrepancy sequence leave none of 4 x 4 cells empty, whatever the shift.
        for pixel in 0..32 {
            let random = PixelRandom::new(pixel, 0, 0);
            let mut cells = [0; 16];
            for k in 0..64 {
                let [x, y] = random.spread(k, 0);
                cells[(x * 4.0) as usize * 4 + (y * 4.0) as usize] += 1;
            }
            assert!(cells.iter().all(|&n| (2..=6).contains(&n)), "{cells:?}");
        }
    }

    #[test]
    fn bases_are_orthonormal_and_right_handed_also_at_the_poles() {
        let normals = [DVec3::Z, -DVec3::Z, DVec3::X, DVec3::new(-1e-9, 1e-9, -1.0), DVec3::new(3.0, -2.0, -5.0)];
        for n in normals.map(DVec3::normalize) {
            let [t, b] = orthonormal_basis(n);
            for (dot, want) in [(t.dot(t), 1.0), (b.dot(b), 1.0), (t.dot(b), 0.0), (t.dot(n), 0.0), (b.dot(n), 0.0)] {
                assert!((dot - want).abs() < 1e-12, "{n}");
            }
            assert!((t.cross(b) - n).length() < 1e-12);
        }
    }

    #[test]
    fn cosine_directions_have_the_moments_of_the_density() {
        let n = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let random = PixelRandom::new(1, 2, 3);
        let count = 4096;
        let (mut mean, mut square) = (DVec3::ZERO, 0.0);
        for k in 0..count {
            let d = cosine_hemisphere(n, random.spread(k, 1));
            assert!((d.length() - 1.0).abs() < 1e-12 && d.dot(n) >= -1e-12);
            mean += d / f64::from(count);
            square += d.dot(n).powi(2) / f64::from(count);
        }
        // E[cos] = 2/3 and E[cos^2] = 1/2 under density cos / pi.
        assert!((mean - n * (2.0 / 3.0)).length() < 0.005, "{mean}");
        assert!((square - 0.5).abs() < 0.005);
    }
}
