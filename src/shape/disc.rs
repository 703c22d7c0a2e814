//! The canonical disc x^2 + y^2 <= 1, z = 0: a surface without inside.

use glam::DVec3;

use super::span::{Solid, Span};
use crate::lanes::{LaneMask, Lanes, Lanes3};

/// The canonical disc. Its span is empty (`t_in == t_out`): it bounds nothing.
#[derive(Clone, Copy, Debug)]
pub struct Disc;

impl Solid for Disc {
    const LO: DVec3 = DVec3::new(-1.0, -1.0, 0.0);
    const HI: DVec3 = DVec3::new(1.0, 1.0, 0.0);

    #[inline(always)]
    fn span<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, _: V::Scalar) -> Span<V> {
        let t = -(o[2] / d[2]);
        let (x, y) = (d[0].mul_add(t, o[0]), d[1].mul_add(t, o[1]));
        let parallel = d[2].cmp_eq(V::constant(0.0));
        let inside = x.mul_add(x, y * y).cmp_le(V::constant(1.0));
        Span::plain(inside & !parallel & V::Mask::from_bits(V::ALL), t, t)
    }

    fn normal(_: DVec3, _: u32, _: f64) -> DVec3 {
        DVec3::Z
    }
}
