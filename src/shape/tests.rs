//! Shapes against closed forms and against a root finder that shares nothing with the kernels.

mod exact;
mod normals;
mod placement;
mod random;
mod sieve;
mod triangles;

use glam::{DAffine3, DVec3};

use super::{Cone, Cuboid, Cylinder, Placed, PlacedRecord, Solid, Span, Sphere};
use crate::lanes::{LaneMask, Lanes, Pair, Real, f32x4, f32x8, f32x16, f64x2, f64x4, f64x8};
use crate::math::Random;
use crate::ray::Packet;

/// Origin and direction.
type Ray = (DVec3, DVec3);

/// What a kernel says about one line, widened to f64.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    /// Entry and exit parameter with the faces' numbers; `None`: the line misses.
    span: Option<[(f64, u32); 2]>,
    /// Nearest boundary from `t = 0` on, with its face.
    nearest: Option<(f64, u32)>,
}

/// Rays as `f32` holds them, so that both precisions trace the same ones.
fn exact(ray: Ray) -> Ray {
    (ray.0.as_vec3().as_dvec3(), ray.1.as_vec3().as_dvec3())
}

/// One packet of rays, `rays.len() <= V::N`; the rest of the lanes repeat the first ray.
fn packet<V: Lanes>(rays: &[Ray]) -> Packet<V> {
    let gather = |pick: &dyn Fn(&Ray) -> f64| {
        let numbers: Vec<_> = (0..V::N).map(|i| V::Scalar::from_f64(pick(rays.get(i).unwrap_or(&rays[0])))).collect();
        V::load(&numbers)
    };
    let org = [0, 1, 2].map(|a| gather(&|r| r.0[a]));
    let dir = [0, 1, 2].map(|a| gather(&|r| r.1[a]));
    Packet::new(org, dir, V::constant(0.0))
}

fn pieces_at<V: Lanes>(
    rays: &[Ray],
    bounds: &crate::math::Aabb<V::Scalar>,
    span: impl Fn(&Packet<V>) -> Span<V>,
) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for chunk in rays.chunks(V::N) {
        let packet = packet::<V>(chunk);
        let span = span(&packet);
        let near = span.nearest(&packet, bounds);
        for lane in 0..chunk.len() {
            let number = |v: V| v.lane(lane).to_f64();
            let both =
                [(number(span.t_in), number(span.face_in) as u32), (number(span.t_out), number(span.face_out) as u32)];
            pieces.push(Piece {
                span: (span.hit.bits() >> lane & 1 != 0).then_some(both),
                nearest: (near.hit.bits() >> lane & 1 != 0).then(|| (number(near.t), number(near.u) as u32)),
            });
        }
    }
    pieces
}

/// A precision with all its widths.
trait Widths: Real {
    /// A solid against rays, at every width; the widths must agree to the bit.
    fn solid<K: Solid>(record: &PlacedRecord<Self>, rays: &[Ray]) -> Vec<Piece>;
    /// A world-space sphere likewise.
    fn sphere(numbers: &[Self; 4], rays: &[Ray]) -> Vec<Piece>;
}

macro_rules! widths {
    ($s:ty: $($v:ty),+) => {
        impl Widths for $s {
            fn solid<K: Solid>(record: &PlacedRecord<Self>, rays: &[Ray]) -> Vec<Piece> {
                let bounds = Placed::bounds(record);
                let want = pieces_at::<$s>(rays, &bounds, |p| Placed::span::<$s, K>(p, record));
                $(assert_eq!(pieces_at::<$v>(rays, &bounds, |p| Placed::span::<$v, K>(p, record)), want);)+
                want
            }

            fn sphere(numbers: &[Self; 4], rays: &[Ray]) -> Vec<Piece> {
                let bounds = super::WorldSphere::bounds(numbers);
                let want = pieces_at::<$s>(rays, &bounds, |p| super::WorldSphere::span(p.org, p.dir, numbers));
                $(assert_eq!(
                    pieces_at::<$v>(rays, &bounds, |p| super::WorldSphere::span(p.org, p.dir, numbers)), want);)+
                want
            }
        }
    };
}
widths!(f32: f32x4, f32x8, f32x16);
widths!(f64: f64x2, f64x4, f64x8, Pair<f64x8>);

/// A record in the identity place.
fn canonical<S: Real, K: Solid>(param: f64) -> PlacedRecord<S> {
    Placed::record::<S, K>(&DAffine3::IDENTITY, param).expect("the identity can be inverted")
}

/// Bounded solids as convex functions: the solid is where all of a face's functions are `<= 0`.
trait Convex: Solid {
    /// One value per face, in face order; convex along every line.
    fn faces(p: DVec3, param: f64) -> Vec<f64>;

    /// The largest of them: negative inside, positive outside.
    fn depth(p: DVec3, param: f64) -> f64 {
        Self::faces(p, param).into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
}

impl Convex for Sphere {
    fn faces(p: DVec3, _: f64) -> Vec<f64> {
        vec![p.length() - 1.0]
    }
}

impl Convex for Cuboid {
    fn faces(p: DVec3, _: f64) -> Vec<f64> {
        vec![-1.0 - p.x, p.x - 1.0, -1.0 - p.y, p.y - 1.0, -1.0 - p.z, p.z - 1.0]
    }
}

impl Convex for Cylinder {
    fn faces(p: DVec3, _: f64) -> Vec<f64> {
        vec![p.x.hypot(p.y) - 1.0, -p.z, p.z - 1.0]
    }
}

impl Convex for Cone {
    fn faces(p: DVec3, top: f64) -> Vec<f64> {
        vec![p.x.hypot(p.y) - (1.0 - (1.0 - top) * p.z), -p.z, p.z - 1.0]
    }
}

/// The deepest point of a line inside a solid: parameter and depth (ternary search of a convex function).
fn deepest<K: Convex>(local: Ray, param: f64) -> (f64, f64) {
    let depth = |t: f64| K::depth(local.0 + local.1 * t, param);
    let middle = -local.0.dot(local.1) / local.1.length_squared();
    let reach = 3.0 / local.1.length();
    let (mut a, mut b) = (middle - reach, middle + reach);
    for _ in 0..120 {
        let (p, q) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
        (a, b) = if depth(p) < depth(q) { (a, q) } else { (p, b) };
    }
    (0.5 * (a + b), depth(0.5 * (a + b)))
}

/// Judges what a kernel said of one line. `local`: the line in the solid's space in f64; `tol`: how far, in that
/// space, rounding may move a surface. Returns whether the line passed well inside.
fn judge<K: Convex>(local: Ray, param: f64, piece: &Piece, tol: f64) -> bool {
    let at = |t: f64| local.0 + local.1 * t;
    let (bottom, depth) = deepest::<K>(local, param);
    let Some([(t_in, face_in), (t_out, face_out)]) = piece.span else {
        assert!(depth > -tol, "missed, though {depth:e} deep: {local:?}");
        assert_eq!(piece.nearest, None);
        return false;
    };
    assert!(depth < tol, "hit, though {depth:e} outside: {local:?} {piece:?}");
    assert!(t_in <= t_out, "{local:?} {piece:?}");
    for (t, face) in [(t_in, face_in), (t_out, face_out)] {
        let on_face = K::faces(at(t), param)[face as usize];
        assert!(on_face.abs() < tol && K::depth(at(t), param) < tol, "{on_face:e} off at {t}: {local:?} {piece:?}");
    }
    // The depth is convex and zero at both ends: a deep line has its bottom between them, so they are the two roots.
    let deep = depth < -4.0 * tol;
    if deep {
        assert!(t_in < bottom && bottom < t_out, "{local:?} {piece:?} bottom {bottom}");
        // Parity: inside in the middle, outside a little beyond either end.
        let step = 0.02 * (t_out - t_in) + 2.0 * tol / local.1.length();
        assert!(K::depth(at(0.5 * (t_in + t_out)), param) < 0.0);
        assert!(K::depth(at(t_in - step), param) > 0.0 && K::depth(at(t_out + step), param) > 0.0, "{local:?}");
    }
    judge_nearest(piece, tol / local.1.length());
    deep
}

/// The nearest boundary is the first end of the span in the segment; `slack` is how far the clamp to the solid's box
/// may move it.
fn judge_nearest(piece: &Piece, slack: f64) {
    let Some([entry, exit]) = piece.span else { return };
    match piece.nearest {
        Some((t, face)) => {
            let from = if (t - entry.0).abs() <= slack && face == entry.1 { entry } else { exit };
            assert!(t >= 0.0 && (t - from.0).abs() <= slack && face == from.1, "{piece:?}");
            assert!(from == entry || entry.0 < slack, "passed over the entry: {piece:?}");
        }
        None => assert!(exit.0 < slack, "nothing found in {piece:?}"),
    }
}
