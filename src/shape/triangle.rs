//! Triangles: watertight test in the ray's own sheared frame.
//!
//! Source: Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013. Departures:
//! * Edge functions are `mul, mul, sub` and never fused: exactly antisymmetric, so both neighbours of an edge see
//!   the same number with opposite sign, and their signs are never wrong, at worst zero. Of a triangle that may be hit,
//!   and one is zero, the products' roundings say the sign: seen edge-on all are zero or nearly, also far beside it.
//! * Zero counts as inside for both neighbours (the tie rule then decides), so no double-precision restart is
//!   needed on edges. It is kept for determinants that under- or overflow the precision.
//! * The winding is not looked at: both sides are hit.
//! * `t` comes from the triangle's plane, whose normal is computed in f64 without cancellation: the barycentric mean
//!   of the corners' depths is off by the triangle's aspect ratio, which is 10^4 for a needle. It is then moved into
//!   the interval of the triangle's own box (see [`crate::ray::slab`]), so that even seen edge-on a hit stays on the
//!   triangle. The point at `t` is within a few ulps of `|org| + |hit|` of the plane.
//!
//! Watertight: the sheared corners depend on the ray and the vertex only, and in the sheared plane the test is a
//! sign test without rounding errors in sign.

use glam::DVec3;

use super::block::{BLOCK, Block};
use super::edges::{Edges, around};
use super::facts::Facts;
use crate::lanes::{LaneMask, Lanes, Lanes3, Real, dot, each, map3};
use crate::math::Aabb;
use crate::ray::slab::Interval;
use crate::ray::{Candidate, Packet};

/// The triangle kind: nine numbers, three corners' x, y, z.
#[derive(Clone, Copy, Debug)]
pub struct Triangle;

/// Eight triangles.
pub type TriangleBlock<S> = Block<S, { Triangle::FIELDS }>;

/// Why a triangle can never be hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Degenerate {
    /// A corner is NaN or infinite (in the engines' precision).
    NonFinite,
    /// Its corners lie on a line.
    ZeroArea,
}

/// Two to the power of -1000: what coordinates are scaled by at most, and one over it.
const SMALLEST_POWER: f64 = f64::from_bits((1023 - 1000) << 52);

impl Triangle {
    /// Numbers per triangle.
    pub const FIELDS: usize = 9;

    /// Corners rounded to `S`, or why this triangle is dropped.
    ///
    /// # Errors
    /// [`Degenerate`] triangles.
    pub fn record<S: Real>(corners: [DVec3; 3]) -> Result<[S; 9], Degenerate> {
        let numbers = Self::rounded(corners);
        Self::check(&numbers)?;
        if Self::is_flat(corners) { Err(Degenerate::ZeroArea) } else { Ok(numbers) }
    }

    /// Whether these corners lie on a line. Rounded to `f32` they may not; but what has no area where it is described is hit in no
    /// precision.
    pub fn is_flat(corners: [DVec3; 3]) -> bool {
        Self::check(&Self::rounded::<f64>(corners)) == Err(Degenerate::ZeroArea)
    }

    /// Corners rounded to `S`.
    pub fn rounded<S: Real>(corners: [DVec3; 3]) -> [S; 9] {
        let mut numbers = [S::ZERO; 9];
        for (three, p) in numbers.chunks_exact_mut(3).zip(corners) {
            three.copy_from_slice(&p.to_array().map(S::from_f64));
        }
        numbers
    }

    /// Whether rounded corners are those of a triangle that can be hit.
    ///
    /// # Errors
    /// [`Degenerate`] triangles.
    pub fn check<S: Real>(numbers: &[S; 9]) -> Result<(), Degenerate> {
        if !numbers.iter().all(|x| x.is_finite()) {
            return Err(Degenerate::NonFinite);
        }
        // Scaled by a power of two so that products of tiny or huge coordinates neither vanish nor overflow.
        let largest = numbers.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        let power = f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits());
        let scale = 1.0 / power.clamp(SMALLEST_POWER, 1.0 / SMALLEST_POWER);
        let [a, b, c] = Self::corners(numbers).map(|p| p * scale);
        match (b - a).cross(c - a) == DVec3::ZERO {
            true => Err(Degenerate::ZeroArea),
            false => Ok(()),
        }
    }

    /// The stored corners in f64.
    pub fn corners<S: Real>(numbers: &[S; 9]) -> [DVec3; 3] {
        [0, 3, 6].map(|i| DVec3::new(numbers[i].to_f64(), numbers[i + 1].to_f64(), numbers[i + 2].to_f64()))
    }

    /// Box of the stored corners, exact.
    #[inline(always)]
    pub fn bounds<S: Real>(n: &[S; 9]) -> Aabb<S> {
        let low = |a: usize| n[a].fast_min(n[a + 3]).fast_min(n[a + 6]);
        let high = |a: usize| n[a].fast_max(n[a + 3]).fast_max(n[a + 6]);
        Aabb { lo: [low(0), low(1), low(2)], hi: [high(0), high(1), high(2)] }
    }

    /// Nearest hits of `N` rays on some triangles of a block, the set bits of `slots`. `found` gets, triangle by triangle, the
    /// candidate (lanes where the line meets the triangle at `t_min <= t`; `u` and `v` are the weights of the second
    /// and third corner), the lanes it was tested for, and the primitive number. What is farther than `t_max` may be left
    /// out.
    #[inline(always)]
    pub fn intersect<V: Lanes>(
        packet: &Packet<V>,
        t_max: V,
        block: &TriangleBlock<V::Scalar>,
        slots: u32,
        active: u32,
        mut found: impl FnMut(&Candidate<V>, u32, u32),
    ) {
        // One pass per dominant axis present; coherent packets have one.
        for axis in 0..3 {
            let lanes = packet.dominant[axis] & active;
            if lanes != 0 {
                match axis {
                    0 => Self::along::<V, 0>(packet, t_max, block, slots, lanes, &mut found),
                    1 => Self::along::<V, 1>(packet, t_max, block, slots, lanes, &mut found),
                    _ => Self::along::<V, 2>(packet, t_max, block, slots, lanes, &mut found),
                }
            }
        }
    }

    /// The test for lanes whose dominant axis is `K`.
    #[inline(always)]
    fn along<V: Lanes, const K: usize>(
        packet: &Packet<V>,
        t_max: V,
        block: &TriangleBlock<V::Scalar>,
        slots: u32,
        lanes: u32,
        found: &mut impl FnMut(&Candidate<V>, u32, u32),
    ) {
        let org = around(packet.org, K);
        let edges = |i: usize| Edges::new(org, packet.shear, K, |f| V::splat(block.fields[f][i]));
        // First which are to be looked at closer, without a branch on any of them: it would be a surprise, and each would
        // wait for the one before.
        let (mut maybe, mut wanted) = ([0; BLOCK], 0);
        if V::N == 1 {
            // A single ray tests the whole block at once.
            let ray = packet.single(0);
            wanted = slots & Self::candidates(&Turned::of(&ray, K), ray.t_min, t_max.lane(0), block).0;
            maybe = [lanes; BLOCK];
        } else {
            let mut rest = slots;
            while rest != 0 {
                let i = rest.trailing_zeros() as usize & (BLOCK - 1);
                rest &= rest - 1;
                let edges = edges(i);
                let aside = edges.aside(packet.rcp[K], packet.t_min, t_max);
                maybe[i] = (!(edges.outside() | aside)).bits() & lanes;
                wanted |= u32::from(maybe[i] != 0) << i;
            }
        }
        while wanted != 0 {
            let i = wanted.trailing_zeros() as usize & (BLOCK - 1);
            wanted &= wanted - 1;
            let mut maybe = V::Mask::from_bits(maybe[i]);
            let n = block.get(i);
            let edges = edges(i);
            if (edges.vague() & maybe).any() {
                maybe = maybe & !Edges::told(&[org, packet.shear], K, &n.map(V::splat)).outside();
            }
            let candidate = Self::accept(packet, &Facts::of(&n), maybe, edges.functions, true, |_| n);
            found(&candidate, lanes, block.prim[i]);
        }
    }

    /// Triangles of a block to [`Triangle::look_closer`] at, as bits: those that the ray is not outside of and whose
    /// corners are neither all beyond `t_max` nor all before `t_min`; and the edge functions of all.
    #[inline(always)]
    pub fn candidates<S: Real>(ray: &Turned<S>, t_min: S, t_max: S, block: &TriangleBlock<S>) -> (u32, [S::Octo; 3]) {
        let rcp = S::Octo::splat(ray.rcp);
        let corners = |f: usize| S::Octo::load(&block.fields[f]);
        let (org, shear) = (map3(ray.org, S::Octo::splat), map3(ray.shear, S::Octo::splat));
        let edges = Edges::new(org, shear, ray.axis, corners);
        let aside = edges.aside(rcp, S::Octo::splat(t_min), S::Octo::splat(t_max));
        let mut maybe = (!(edges.outside() | aside)).bits();
        if maybe != 0 && edges.vague().bits() & maybe != 0 {
            maybe &= !Edges::told(&[org, shear], ray.axis, &std::array::from_fn(corners)).outside().bits();
        }
        (maybe, edges.functions)
    }

    /// One ray, the same in all lanes, against those of its [`Triangle::candidates`] whose bits are set in `slots`; `edges`: their
    /// edge functions, `facts`: those of the block. `flat`: whether the ray may be [`Triangle::along_a_face`].
    #[inline(always)]
    pub fn look_closer<S: Real>(
        ray: &Packet<S::Octo>,
        block: &TriangleBlock<S>,
        facts: &Facts<S::Octo>,
        slots: u32,
        edges: [S::Octo; 3],
        flat: bool,
    ) -> Candidate<S::Octo> {
        let maybe = <S::Octo as Lanes>::Mask::from_bits(slots);
        Self::accept(ray, facts, maybe, edges, flat, |slot| block.get(slot))
    }

    /// Depth, weights and segment of lanes that are not outside the triangle. `numbers(i)`: the triangle of lane `i`.
    #[inline(always)]
    fn accept<V: Lanes>(
        packet: &Packet<V>,
        facts: &Facts<V>,
        maybe: V::Mask,
        [u, v, w]: [V; 3],
        flat: bool,
        numbers: impl Fn(usize) -> [V::Scalar; 9],
    ) -> Candidate<V> {
        let det = u + v + w;
        let inv = V::constant(1.0) / det;
        let corner = each(|a| facts.corner[a] - packet.org[a]);
        let t = dot(facts.normal, corner) / dot(facts.normal, packet.dir);
        let mut found = Candidate { hit: maybe, t, u: v * inv, v: w * inv };
        let interval = Interval::of_boxes(packet.org, packet.rcp, facts.lo, facts.hi);
        found.hit = maybe & interval.near.cmp_le(interval.far);
        let size = det.abs();
        let sound = V::constant(Self::least_det::<V::Scalar>()).cmp_le(size) & size.cmp_le(V::splat(V::Scalar::MAX));
        let doubtful = (found.hit & !sound).bits();
        if doubtful != 0 {
            // Copies: a packet that is only made for this test stays in registers.
            found = Self::restart(&[packet.org, packet.dir], &numbers, found, doubtful);
        }
        let mut end = interval.far;
        if flat {
            let (zero, flat) = (V::constant(0.0), Self::along_a_face(packet.dir));
            end = V::select(interval.far.cmp_eq(zero) & flat, found.t, end);
            let behind = found.t.cmp_lt(zero);
            found.hit = found.hit & !(flat & interval.near.cmp_eq(zero) & behind);
        }
        found.t = packet.t_floor.fast_max(interval.near.fast_max(found.t.fast_min(end)));
        // A parameter that overflowed is no hit: it would tie with the end of an infinite segment.
        let finite = found.t.abs().cmp_le(V::splat(V::Scalar::MAX));
        let in_front = packet.t_min.cmp_le(interval.far);
        found.hit = found.hit & in_front & packet.t_min.cmp_le(found.t) & finite;
        found
    }

    /// Lanes with a direction component of zero. A line in the upper face of a box has its interval end at 0 there
    /// (`0 * rcp`), one in the lower face has it begin at 0, and neither says anything about where the triangle is.
    #[inline(always)]
    pub fn along_a_face<V: Lanes>(dir: Lanes3<V>) -> V::Mask {
        let [x, y, z] = map3(dir, |d| d.abs().cmp_lt(V::splat(V::Scalar::MIN_POSITIVE)));
        x | y | z
    }

    /// Determinants below this may have lost bits to underflow.
    #[inline(always)]
    pub(super) fn least_det<S: Real>() -> f64 {
        S::MIN_POSITIVE.to_f64() / (S::EPSILON.to_f64() * S::EPSILON.to_f64())
    }

    /// Lanes whose edge functions under- or overflowed, one by one in f64 and scaled to unit size. Rare: tiny or
    /// huge coordinates, and triangles seen exactly edge-on (which are misses). `lines`: origins and directions.
    #[cold]
    #[inline(never)]
    fn restart<V: Lanes>(
        lines: &[Lanes3<V>; 2],
        numbers: &impl Fn(usize) -> [V::Scalar; 9],
        mut found: Candidate<V>,
        lanes: u32,
    ) -> Candidate<V> {
        let mut hit = found.hit.bits() & !lanes;
        for lane in 0..V::N {
            if lanes >> lane & 1 == 0 {
                continue;
            }
            let read = |v: [V; 3]| DVec3::from_array(v.map(|x| x.lane(lane).to_f64()));
            let [org, dir] = lines.map(read);
            if let Some((t, u, v)) = edge_test_f64(org, dir, Self::corners(&numbers(lane))) {
                let only = V::Mask::from_bits(1 << lane);
                let put = |x: f64, old: V| V::select(only, V::constant(x), old);
                (found.t, found.u, found.v) = (put(t, found.t), put(u, found.u), put(v, found.v));
                hit |= 1 << lane;
            }
        }
        found.hit = V::Mask::from_bits(hit);
        found
    }

    /// Unnormalised geometric normal (right-handed over the corners' order), f64.
    pub fn normal<S: Real>(numbers: &[S; 9]) -> DVec3 {
        let [a, b, c] = Self::corners(numbers);
        (b - a).cross(c - a)
    }
}

/// What the test of one ray needs, the components along its dominant axis first, then along the two that follow it.
#[derive(Clone, Copy, Debug)]
pub struct Turned<S> {
    /// The dominant axis.
    pub axis: usize,
    /// Origin, turned.
    pub org: [S; 3],
    /// See [`Packet::shear`].
    pub shear: [S; 3],
    /// Reciprocal of the direction along the dominant axis.
    pub rcp: S,
}

impl<S: Real> Turned<S> {
    /// `ray` around its dominant axis.
    #[inline(always)]
    pub fn of(ray: &Packet<S>, axis: usize) -> Self {
        Self { axis, org: around(ray.org, axis), shear: ray.shear, rcp: ray.rcp[axis] }
    }
}

/// The same test in f64 with the geometry scaled to unit size: `(t, u, v)` or a miss.
fn edge_test_f64(org: DVec3, dir: DVec3, corners: [DVec3; 3]) -> Option<(f64, f64, f64)> {
    let relative = corners.map(|p| p - org);
    let largest = relative.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let power = |x: f64| if x > 0.0 { x.log2().floor().clamp(-1000.0, 1000.0).exp2() } else { 1.0 };
    let (length, speed) = (power(largest), power(dir.abs().max_element()));
    let dir = dir / speed;
    let size = dir.abs();
    let k = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let (kx, ky) = ((k + 1) % 3, (k + 2) % 3);
    let [a, b, c] = relative.map(|p| {
        let p = p / length;
        (p[kx] - dir[kx] / dir[k] * p[k], p[ky] - dir[ky] / dir[k] * p[k], p[k])
    });
    let u = c.0 * b.1 - c.1 * b.0;
    let v = a.0 * c.1 - a.1 * c.0;
    let w = b.0 * a.1 - b.1 * a.0;
    let det = u + v + w;
    if (u.min(v).min(w) < 0.0 && u.max(v).max(w) > 0.0) || det == 0.0 {
        return None;
    }
    let depth = (u * a.2 + v * b.2 + w * c.2) / det;
    Some((depth / dir[k] * (length / speed), v / det, w / det))
}
