//! Parameters u, v of surfaces, which patterns are functions of.

use glam::DVec3;

use crate::lanes::functions::{fraction, half_turn_of};
use crate::lanes::{Lanes, Lanes3, Real, dot, each, map3, space};
use crate::scene::assembly::PartKind;
use crate::scene::brlcad::ARB_FACES;
use crate::scene::description::Shape;
use crate::scene::solids::Solid;
use crate::scene::world::World;

/// Period of a half-space's parameters, mm.
const HALF_SPACE_PERIOD: f64 = 10_000.0;
/// Points of an arb nearer than this are one.
const SAME_POINT: f64 = 0.0005;
/// Least cosine between a normal and that of the arb's face that it belongs to.
const ALONG: f64 = 0.999;

/// Parameters of a direction on the sphere around everything.
#[inline]
pub(super) fn uv_of_direction<V: Lanes>(d: Lanes3<V>) -> [V; 2] {
    let zero = V::constant(0.0);
    let around = half_turn_of(d[1].abs(), d[0]);
    let level = d[1].mul_add(d[1], d[0] * d[0]).sqrt();
    let up = half_turn_of(d[2].abs(), level);
    let half = V::constant(0.5);
    let v = V::select(d[2].cmp_lt(zero), half - (up + up), half + (up + up));
    [V::select(d[1].cmp_lt(zero), V::constant(1.0) - around, around), v]
}

/// Parameters of the surface of leaf `prim` in region `region` at points `position` with outward normals `normal`; `None`
/// for solids without.
#[inline]
pub(super) fn uv<S: Real, V: Lanes<Scalar = S>>(
    world: &World<S>,
    region: u32,
    prim: u32,
    position: Lanes3<V>,
    normal: Lanes3<V>,
) -> Option<[V; 2]> {
    let (number, object) = world.first_placed()?;
    let part = &object.parts[region as usize];
    let PartKind::Solids(tree) = &part.kind else { return None };
    match tree.leaves[(prim - part.first_prim) as usize].solid {
        Solid::Shape(Shape::Sphere) => Some(uv_of_direction(world.place(number, prim)?.local_lanes(position))),
        Solid::Shape(Shape::HalfSpace) => Some(uv_of_plane(position, normal)),
        _ => None,
    }
}

/// Parameters of a plane: distances along two axes, there and back again every ten metres.
#[inline]
fn uv_of_plane<V: Lanes>(position: Lanes3<V>, n: Lanes3<V>) -> [V; 2] {
    let from_foot = space::sub(position, space::scale(n, dot(n, position)));
    let a = map3(n, V::abs);
    let unit = |k: usize| each(|axis| V::constant(f64::from(u8::from(axis == k))));
    let is_x = a[0].cmp_le(a[1]) & a[0].cmp_le(a[2]);
    let least = space::choose(is_x, unit(0), space::choose(a[1].cmp_le(a[2]), unit(1), unit(2)));
    let x = space::normalize(space::cross(least, n));
    let y = space::normalize(space::cross(x, n));
    [x, y].map(|axis| {
        let f = fraction(dot(from_foot, axis).abs() * V::constant(1.0 / HALF_SPACE_PERIOD));
        let back = V::constant(1.0) - f;
        V::constant(2.0) * f.fast_min(back)
    })
}

/// Parameters of those of an arb's `faces` that the normals `normal` belong to, at `position`: they run from 0 to 1 over
/// the smallest rectangle along the face's first edge; 0 where there is no such face.
#[inline]
pub(super) fn uv_of_arb<V: Lanes>(faces: &[Face], position: Lanes3<V>, normal: Lanes3<V>) -> [V; 2] {
    let splat = |v: DVec3| each(|axis| V::constant(v[axis]));
    let mut uv = [V::constant(0.0); 2];
    let mut nearest = V::splat(V::Scalar::INFINITY);
    for face in faces {
        let is_along = V::constant(ALONG).cmp_lt(dot(splat(face.normal), normal).abs());
        let from = space::sub(position, splat(face.origin));
        let distance = dot(from, splat(face.normal)).abs();
        let is_nearest = is_along & distance.cmp_lt(nearest);
        nearest = V::select(is_nearest, distance, nearest);
        for (uv, (axis, length)) in uv.iter_mut().zip([(face.u, face.u_length), (face.v, face.v_length)]) {
            *uv = V::select(is_nearest, dot(from, splat(axis)) / V::constant(length), *uv);
        }
    }
    uv
}

/// A face of an arb with its axes.
#[derive(Clone, Debug)]
pub(super) struct Face {
    origin: DVec3,
    normal: DVec3,
    u: DVec3,
    v: DVec3,
    u_length: f64,
    v_length: f64,
}

impl Face {
    /// The faces of the arb with corners `points`.
    pub fn of_arb(points: &[DVec3; 8]) -> Vec<Self> {
        ARB_FACES.iter().filter_map(|face| Self::of(&face.map(|i| points[i]))).collect()
    }

    fn of(corners: &[DVec3; 4]) -> Option<Self> {
        let mut distinct: Vec<DVec3> = Vec::new();
        for &p in corners {
            if distinct.iter().all(|q| q.distance(p) > SAME_POINT) {
                distinct.push(p);
            }
        }
        let &[a, b, c, ..] = distinct.as_slice() else { return None };
        let normal = (c - a).cross(b - a).try_normalize()?;
        let u = (b - a).normalize();
        let v = normal.cross(u).normalize();
        let range = |axis: DVec3| {
            let along = distinct.iter().map(|&p| (p - a).dot(axis));
            along.fold((0.0f64, 0.0f64), |(low, high), x| (low.min(x), high.max(x)))
        };
        let ((u_low, u_high), (v_low, v_high)) = (range(u), range(v));
        let origin = a + u * u_low + v * v_low;
        Some(Self { origin, normal, u, v, u_length: u_high - u_low, v_length: v_high - v_low })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_of_a_box_have_parameters_from_corner_to_corner() {
        let points = [
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [2.0, 3.0, 0.0],
            [0.0, 3.0, 0.0],
            [0.0, 0.0, 4.0],
            [2.0, 0.0, 4.0],
            [2.0, 3.0, 4.0],
            [0.0, 3.0, 4.0],
        ];
        let faces = Face::of_arb(&points.map(DVec3::from));
        let up = [0.0, 0.0, 1.0];
        let middle = uv_of_arb(&faces, [1.0, 1.5, 4.0], up);
        assert!((middle[0] - 0.5).abs() < 1e-12 && (middle[1] - 0.5).abs() < 1e-12);
        let mut corners: Vec<[i64; 2]> =
            points[4..].iter().map(|&p| uv_of_arb(&faces, p, up).map(|x| x.round() as i64)).collect();
        corners.sort_unstable();
        assert_eq!(corners, [[0, 0], [0, 1], [1, 0], [1, 1]]);
        assert_eq!(uv_of_arb(&faces, [1.0, 1.5, 4.0], [0.6, 0.0, 0.8]), [0.0, 0.0]);
    }

    #[test]
    fn planes_repeat_there_and_back() {
        let at = |x: f64| uv_of_plane([x, 0.0, 7.0], [0.0, 0.0, 1.0]);
        let along = at(2500.0);
        assert!(along.contains(&0.5) && along.contains(&0.0), "{along:?}");
        assert_eq!(at(7500.0), along);
        assert_eq!(at(12_500.0), along);
    }

    #[test]
    fn directions_go_once_around() {
        for (direction, [u, v]) in [
            ([1.0, 0.0, 0.0], [0.0, 0.5]),
            ([0.0, 2.0, 0.0], [0.25, 0.5]),
            ([0.0, -1.0, 0.0], [0.75, 0.5]),
            ([0.0, 0.0, -3.0], [0.0, 0.0]),
        ] {
            let found = uv_of_direction(direction);
            assert!((found[0] - u).abs() < 1e-15 && (found[1] - v).abs() < 1e-15, "{direction:?}: {found:?}");
        }
    }
}
