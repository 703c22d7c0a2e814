//! The canonical box [-1, 1]^3 as three slabs (Kay, Kajiya, "Ray Tracing Complex Scenes", 1986).

use glam::DVec3;

use super::span::{Solid, Span};
use crate::lanes::{Lanes, Lanes3};

/// The canonical box. Faces: 0..=5 for -x, +x, -y, +y, -z, +z.
#[derive(Clone, Copy, Debug)]
pub struct Cuboid;

impl Solid for Cuboid {
    const LO: DVec3 = DVec3::NEG_ONE;
    const HI: DVec3 = DVec3::ONE;

    #[inline(always)]
    fn span<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, _: V::Scalar) -> Span<V> {
        let sides = [V::constant(-1.0), V::constant(1.0)];
        let slab = |axis: usize| Span::slab(o[axis], d[axis], sides, [2.0 * axis as f64, 2.0 * axis as f64 + 1.0]);
        slab(0).intersect(&slab(1)).intersect(&slab(2))
    }

    fn normal(_: DVec3, face: u32, _: f64) -> DVec3 {
        let mut n = DVec3::ZERO;
        n[(face as usize / 2).min(2)] = if face.is_multiple_of(2) { -1.0 } else { 1.0 };
        n
    }
}
