//! What every ray's closer look at a triangle needs: its plane and its box.

use super::block::BLOCK;
use super::triangle::{Triangle, TriangleBlock};
use crate::lanes::{Lanes, Lanes3, MAX_LANES, Real, each, map3};

/// Planes and boxes of triangles, one per lane.
#[derive(Clone, Copy, Debug)]
pub struct Facts<V> {
    /// Normals with a largest component of about 1.
    pub normal: Lanes3<V>,
    /// First corners.
    pub corner: Lanes3<V>,
    /// Lower corners of the boxes.
    pub lo: Lanes3<V>,
    /// Upper corners of the boxes.
    pub hi: Lanes3<V>,
}

impl<V: Lanes> Facts<V> {
    /// One triangle, the same in all lanes.
    #[inline(always)]
    pub fn of(n: &[V::Scalar; 9]) -> Self {
        let normal = normals::<V::Scalar, f64>(|f| n[f].to_f64());
        let own = Triangle::bounds(n);
        Self {
            normal: map3(normal, |x| V::splat(V::Scalar::from_f64(x))),
            corner: each(|a| V::splat(n[a])),
            lo: map3(own.lo, V::splat),
            hi: map3(own.hi, V::splat),
        }
    }

    /// The eight triangles of a block: the same numbers as one by one.
    #[inline(always)]
    pub fn of_block<S: Real<Octo = V>>(block: &TriangleBlock<S>) -> Self
    where
        V: Lanes<Scalar = S>,
    {
        type Wide = <f64 as Real>::Octo;
        let normal = normals::<S, Wide>(|f| {
            let mut wide = [0.0; BLOCK];
            for (wide, x) in wide.iter_mut().zip(&block.fields[f]) {
                *wide = x.to_f64();
            }
            Wide::load(&wide)
        });
        let round = |x: Wide| {
            let mut rounded = [S::ZERO; BLOCK];
            for (rounded, x) in rounded.iter_mut().zip(x.to_array()) {
                *rounded = S::from_f64(x);
            }
            V::load(&rounded)
        };
        let corners =
            each(|a| [V::load(&block.fields[a]), V::load(&block.fields[a + 3]), V::load(&block.fields[a + 6])]);
        Self {
            normal: map3(normal, round),
            corner: map3(corners, |[first, ..]| first),
            lo: map3(corners, |[a, b, c]| a.fast_min(b).fast_min(c)),
            hi: map3(corners, |[a, b, c]| a.fast_max(b).fast_max(c)),
        }
    }
}

/// Normals of triangles whose number `f` is `n(f)`, scaled by a power of two to a largest component of about 1, accurate to a few
/// ulps for any sliver: products of f32 differences are exact in f64, those of f64 differences are paired with their rounding
/// errors (Kahan's difference of products; Jeannerod, Louvet, Muller, "Further analysis of Kahan's algorithm", Math.
/// Comp. 82, 2013). `S`: the precision of the corners.
#[inline(always)]
fn normals<S: Real, W: Lanes<Scalar = f64>>(n: impl Fn(usize) -> W) -> Lanes3<W> {
    let first = each(&n);
    let (p, q) = (each(|a| n(3 + a) - first[a]), each(|a| n(6 + a) - first[a]));
    let minor = |a: usize, b: usize| {
        if S::EPSILON.to_f64() > f64::EPSILON {
            p[a] * q[b] - p[b] * q[a]
        } else {
            let product = p[b] * q[a];
            let error = (-p[b]).mul_add(q[a], product);
            p[a].mul_add(q[b], -product) + error
        }
    };
    let normal = [minor(1, 2), minor(2, 0), minor(0, 1)];
    let mut scale = [0.0; MAX_LANES];
    normal[0].abs().fast_max(normal[1].abs()).fast_max(normal[2].abs()).store(&mut scale);
    for scale in &mut scale[..W::N] {
        let exponent = scale.to_bits() >> 52;
        *scale = f64::from_bits((2046 - exponent.min(2045)) << 52);
    }
    let scale = W::load(&scale);
    map3(normal, |x| x * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normals and boxes of slivers, needles and ordinary triangles, of tiny and of huge ones.
    fn check<S: Real>() {
        let mut state = 7u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24) - 0.5
        };
        for round in 0..400 {
            let size = [1e-15, 1e-3, 1.0, 1e12][round % 4];
            let mut block = TriangleBlock::<S>::empty();
            for slot in 0..BLOCK {
                let thin = if slot % 2 == 0 { 1e-4 } else { 1.0 };
                let numbers = std::array::from_fn(|f| S::from_f64(size * next() * if f > 5 { thin } else { 1.0 }));
                block.set(slot, numbers, slot as u32);
            }
            let all = Facts::<S::Octo>::of_block(&block);
            for slot in 0..BLOCK {
                let one = Facts::<S>::of(&block.get(slot));
                for axis in 0..3 {
                    let of_all = [all.normal[axis], all.corner[axis], all.lo[axis], all.hi[axis]].map(|v| v.lane(slot));
                    assert_eq!(of_all, [one.normal[axis], one.corner[axis], one.lo[axis], one.hi[axis]]);
                }
                let normal = glam::DVec3::from_array(map3(one.normal, S::to_f64));
                let want = Triangle::normal(&block.get(slot));
                let (largest, sine) = (normal.abs().max_element(), normal.normalize().cross(want.normalize()).length());
                assert!((0.99..2.01).contains(&largest) && sine < 1e-6, "{normal} {want}");
            }
        }
    }

    #[test]
    fn a_block_at_once_gives_the_numbers_of_its_triangles() {
        check::<f32>();
        check::<f64>();
    }
}
