//! The canonical half-space z <= 0; its surface is the plane z = 0.

use glam::DVec3;

use super::span::{Solid, Span, infinite};
use crate::lanes::{LaneMask, Lanes, Lanes3};

/// The canonical half-space. It has no bounds: it is kept out of trees.
#[derive(Clone, Copy, Debug)]
pub struct HalfSpace;

impl Solid for HalfSpace {
    const LO: DVec3 = DVec3::NEG_INFINITY;
    // Not z <= 0: hits are clamped to the box, and a level line's end at infinity must stay there.
    const HI: DVec3 = DVec3::INFINITY;

    #[inline(always)]
    fn span<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, _: V::Scalar) -> Span<V> {
        let zero = V::constant(0.0);
        let t = -(o[2] / d[2]);
        let rising = zero.cmp_lt(d[2]);
        let level = d[2].cmp_eq(zero);
        // A level line is inside for ever or never.
        let t_in = V::select(rising | level, -infinite::<V>(), t);
        let t_out = V::select(rising & !level, t, infinite());
        let hit = (!level | o[2].cmp_le(zero)) & V::Mask::from_bits(V::ALL);
        Span::plain(hit, t_in, t_out)
    }

    fn normal(_: DVec3, _: u32, _: f64) -> DVec3 {
        DVec3::Z
    }
}
