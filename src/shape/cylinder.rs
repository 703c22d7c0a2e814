//! The canonical capped cylinder x^2 + y^2 <= 1, 0 <= z <= 1: an infinite cylinder cut by a slab
//! (Cychosz, Waggenspack, "Intersecting a ray with a cylinder", Graphics Gems IV, 1994).

use glam::DVec3;

use super::span::{Solid, Span, infinite, nearest_to_origin};
use crate::lanes::{Lanes, Lanes3};

/// The canonical cylinder. Faces: 0 side, 1 cap at z = 0, 2 cap at z = 1.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder;

impl Solid for Cylinder {
    const LO: DVec3 = DVec3::new(-1.0, -1.0, 0.0);
    const HI: DVec3 = DVec3::ONE;

    #[inline(always)]
    fn span<V: Lanes>(o: Lanes3<V>, d: Lanes3<V>, _: V::Scalar) -> Span<V> {
        let (o, shift) = nearest_to_origin(o, d);
        let a = d[0].mul_add(d[0], d[1] * d[1]);
        // Along the axis `a` is 0: the line is inside or outside for ever.
        let along = a.cmp_le(V::constant(0.0));
        let to_axis = V::select(along, V::constant(0.0), -(o[0].mul_add(d[0], o[1] * d[1]) / a));
        let (x, y) = (d[0].mul_add(to_axis, o[0]), d[1].mul_add(to_axis, o[1]));
        let room = V::constant(1.0) - x.mul_add(x, y * y);
        let half = V::select(along, infinite(), (room / a).sqrt());
        let side = Span::plain(V::constant(0.0).cmp_le(room), to_axis - half, to_axis + half);
        side.intersect(&Span::unit_slab(o[2], d[2])).shifted(shift)
    }

    fn normal(point: DVec3, face: u32, _: f64) -> DVec3 {
        match face {
            1 => DVec3::NEG_Z,
            2 => DVec3::Z,
            _ => DVec3::new(point.x, point.y, 0.0),
        }
    }
}
