//! The canonical capped cone: radius 1 at z = 0, radius `top` at z = 1 (Cychosz, Waggenspack, "Intersecting a ray
//! with a quadric surface", Graphics Gems III, 1992, with the stable quadratic of Press et al., Numerical Recipes).

use glam::DVec3;

use super::span::{Solid, Span, infinite, nearest_to_vertex};
use crate::lanes::{Lanes, Lanes3, Real};

/// The canonical cone. `param` is the radius at z = 1, `0 <= top < 1`. Faces: 0 side, 1 cap at z = 0, 2 cap at
/// z = 1.
#[derive(Clone, Copy, Debug)]
pub struct Cone;

impl Solid for Cone {
    const LO: DVec3 = DVec3::new(-1.0, -1.0, 0.0);
    const HI: DVec3 = DVec3::ONE;

    #[inline(always)]
    fn span<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, top: V::Scalar) -> Span<V> {
        let zero = V::constant(0.0);
        // Inside the double cone: f(t) = a t^2 + 2 b t + c <= 0, with radius r(z) = 1 - slope z.
        let slope = V::splat(V::Scalar::ONE - top);
        let fall = slope * d[2];
        let at = |o: Lanes3<V>| {
            let radius = V::constant(1.0) - slope * o[2];
            let b = o[0].mul_add(d[0], o[1] * d[1]) + fall * radius;
            [b, o[0].mul_add(o[0], o[1] * o[1]) - radius * radius]
        };
        let a = d[0].mul_add(d[0], d[1] * d[1]) - fall * fall;
        let (o, shift) = nearest_to_vertex(o, d, a, at);
        let [b, c] = at(o);
        let disc = b.mul_add(b, -(a * c));
        let steep = a.cmp_lt(zero);
        // A line steeper than the cone always crosses it; only rounding can say otherwise.
        let root = disc.fast_max(zero).sqrt();
        let q = V::select(b.cmp_lt(zero), root - b, -(b + root));
        // Through the tip both roots are one, and all of b, c and q may be 0.
        let r0 = q / a;
        let r1 = V::select(q.cmp_eq(zero), r0, c / q);
        let (first, second) = (r0.fast_min(r1), r0.fast_max(r1));
        // A steep line is inside before its first root or after its second, each in one nappe; the nappe that the
        // slab leaves is the one on the side of decreasing z.
        let rising = zero.cmp_lt(d[2]);
        let t_in = V::select(steep, V::select(rising, -infinite::<V>(), second), first);
        let t_out = V::select(steep, V::select(rising, first, infinite()), second);
        let side = Span::plain(zero.cmp_le(disc) | steep, t_in, t_out);
        side.intersect(&Span::unit_slab(o[2], d[2])).shifted(shift)
    }

    fn normal(point: DVec3, face: u32, top: f64) -> DVec3 {
        match face {
            1 => DVec3::NEG_Z,
            2 => DVec3::Z,
            _ => {
                let slope = 1.0 - top;
                DVec3::new(point.x, point.y, slope * (1.0 - slope * point.z))
            }
        }
    }
}
