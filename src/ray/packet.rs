//! `N` rays in registers, their hits, and the one place where hits are committed.

use super::batch::{Hits, INVALID_ID, PAD, Rays};
use crate::lanes::chosen::merge;
use crate::lanes::words::positions;
use crate::lanes::{LaneMask, Lanes, Lanes3, MAX_LANES, Real, f32x16, finite_rcp, map3};
use crate::math::Affine;

/// `N` rays with what every kernel needs of them. Shape: lanes; space: the space being traversed.
#[derive(Clone, Copy, Debug)]
pub struct Packet<V: Lanes> {
    /// Origins.
    pub org: Lanes3<V>,
    /// Directions, not necessarily unit.
    pub dir: Lanes3<V>,
    /// Finite reciprocals of the directions.
    pub rcp: Lanes3<V>,
    /// Start of the closed segment.
    pub t_min: V,
    /// No hit may be nearer than this: entry into the instance's box (see [`super::slab`]).
    pub t_floor: V,
    /// Lanes whose direction is largest along x, y, z (each lane is in exactly one).
    pub dominant: [u32; 3],
    /// With `k` the lane's dominant axis: `-dir[k+1] / dir[k]`, `-dir[k+2] / dir[k]`, `1 / dir[k]`
    /// (the shear of Woop, Benthin and Wald, 2013).
    pub shear: Lanes3<V>,
}

impl<V: Lanes> Packet<V> {
    /// Prepares rays for traversal.
    #[inline(always)]
    pub fn new(org: Lanes3<V>, dir: Lanes3<V>, t_min: V) -> Self {
        let [x, y, z] = Self::dominant_axes(dir);
        let pick = |a: V, b: V, c: V| V::select(x, a, V::select(y, b, c));
        let scale = V::constant(1.0) / pick(dir[0], dir[1], dir[2]);
        Self {
            dominant: [x.bits(), y.bits(), z.bits()],
            shear: [-(pick(dir[1], dir[2], dir[0]) * scale), -(pick(dir[2], dir[0], dir[1]) * scale), scale],
            ..Self::unsheared(org, dir, t_min)
        }
    }

    /// With or without what only triangles ask for: see [`Packet::new`] and [`Packet::unsheared`].
    #[inline(always)]
    pub fn prepared(org: Lanes3<V>, dir: Lanes3<V>, t_min: V, sheared: bool) -> Self {
        match sheared {
            true => Self::new(org, dir, t_min),
            false => Self::unsheared(org, dir, t_min),
        }
    }

    /// The same without what only triangles ask for: no dominant axes, no shear.
    #[inline(always)]
    pub fn unsheared(org: Lanes3<V>, dir: Lanes3<V>, t_min: V) -> Self {
        Self {
            org,
            dir,
            rcp: map3(dir, finite_rcp),
            t_min,
            t_floor: V::splat(V::Scalar::LOWEST),
            dominant: [0; 3],
            shear: [V::constant(0.0); 3],
        }
    }

    /// Gives its rays the directions `dir`, and what follows from them; with or without the shear.
    #[inline(always)]
    pub fn turn(&mut self, dir: Lanes3<V>, sheared: bool) {
        if sheared {
            let Self { rcp, dominant, shear, .. } = Self::new(self.org, dir, self.t_min);
            (self.rcp, self.dominant, self.shear) = (rcp, dominant, shear);
        } else {
            self.rcp = map3(dir, finite_rcp);
        }
        self.dir = dir;
    }

    /// Whether some of the rays `first..first + N` of a batch has a segment: without reading where they are.
    #[inline(always)]
    pub fn has_segment(rays: &Rays<V::Scalar>, first: usize) -> bool {
        V::load(&rays.t_min[first..]).cmp_le(V::load(&rays.t_max[first..])).any()
    }

    /// Rays `first..first + N` of a batch, their `t_max`, and the lanes that are live.
    #[inline(always)]
    pub fn load(rays: &Rays<V::Scalar>, first: usize) -> (Self, V, u32) {
        let ([org, dir], [t_min, t_max], live) = Self::read(rays, first);
        (Self::new(org, dir, t_min), t_max, live)
    }

    /// The same as they are: origins and directions, start and end of the segments, lanes that are live.
    #[inline(always)]
    pub fn read(rays: &Rays<V::Scalar>, first: usize) -> ([Lanes3<V>; 2], [V; 2], u32) {
        let load = |a: &[V::Scalar]| V::load(&a[first..]);
        let org = [load(&rays.org[0]), load(&rays.org[1]), load(&rays.org[2])];
        let dir = [load(&rays.dir[0]), load(&rays.dir[1]), load(&rays.dir[2])];
        let (t_min, t_max) = (load(&rays.t_min), load(&rays.t_max));
        ([org, dir], [t_min, t_max], Self::live(org, dir, t_min.cmp_le(t_max)))
    }

    /// Lanes whose direction is largest along x, y, z.
    #[inline(always)]
    fn dominant_axes(dir: Lanes3<V>) -> [V::Mask; 3] {
        let size = map3(dir, V::abs);
        let x = size[0].cmp_ge(size[1]) & size[0].cmp_ge(size[2]);
        let y = !x & size[1].cmp_ge(size[2]);
        [x, y, !x & !y]
    }

    /// Of the lanes with a segment, those that can hit something.
    #[inline(always)]
    fn live(org: Lanes3<V>, dir: Lanes3<V>, segment: V::Mask) -> u32 {
        let zero = V::constant(0.0);
        let points = zero.cmp_lt(dir[0].abs()) | zero.cmp_lt(dir[1].abs()) | zero.cmp_lt(dir[2].abs());
        (finite(org, dir) & points & segment).bits()
    }

    /// Lanes whose origin and direction are finite. Of others nothing is known, and what is asked of all lanes together would not be
    /// either.
    #[inline(always)]
    pub fn finite_lanes(&self) -> u32 {
        finite(self.org, self.dir).bits()
    }

    /// The same rays in an instance's space; `floor` is where they enter the instance's box.
    #[inline(always)]
    pub fn into_local(&self, to_local: &Affine<V::Scalar>, floor: V) -> Self {
        self.brought_in(to_local, floor, true)
    }

    /// [`Packet::into_local`] with or without what only triangles ask for.
    #[inline(always)]
    pub fn brought_in(&self, to_local: &Affine<V::Scalar>, floor: V, sheared: bool) -> Self {
        let (org, dir) = (to_local.points(self.org), to_local.vectors(self.dir));
        let mut local = Self::prepared(org, dir, self.t_min, sheared);
        local.t_floor = floor;
        local
    }

    /// One lane as a packet of width 1.
    #[inline(always)]
    pub fn single(&self, lane: usize) -> Packet<V::Scalar> {
        let pick = |v: Lanes3<V>| map3(v, |x| x.lane(lane));
        Packet {
            org: pick(self.org),
            dir: pick(self.dir),
            rcp: pick(self.rcp),
            t_min: self.t_min.lane(lane),
            t_floor: self.t_floor.lane(lane),
            dominant: map3(self.dominant, |bits| bits >> lane & 1),
            shear: pick(self.shear),
        }
    }
}

/// Where all numbers are finite: zero times each is zero then, and so is their sum.
#[inline(always)]
fn finite<V: Lanes>([x, y, z]: Lanes3<V>, [dx, dy, dz]: Lanes3<V>) -> V::Mask {
    let zero = V::constant(0.0);
    let sum = [y, z, dx, dy, dz].into_iter().fold(x * zero, |sum, v| v.mul_add(zero, sum));
    sum.cmp_eq(zero)
}

/// What a kernel found: lanes where one primitive is hit, and where.
#[derive(Clone, Copy, Debug)]
pub struct Candidate<V: Lanes> {
    /// Lanes that hit.
    pub hit: V::Mask,
    /// Ray parameters (undefined in other lanes).
    pub t: V,
    /// First surface parameter.
    pub u: V,
    /// Second surface parameter.
    pub v: V,
}

/// The best hits so far of `N` rays. `t` starts as the segment's end.
#[derive(Clone, Copy, Debug)]
pub struct HitPacket<V: Lanes> {
    /// Best `t`, or the segment's end.
    pub t: V,
    /// First surface parameter.
    pub u: V,
    /// Second surface parameter.
    pub v: V,
    /// Primitive numbers.
    pub prim: [u32; MAX_LANES],
    /// Instance numbers.
    pub inst: [u32; MAX_LANES],
}

impl<V: Lanes> HitPacket<V> {
    /// Nothing hit yet.
    #[inline(always)]
    pub fn new(t_max: V) -> Self {
        let zero = V::constant(0.0);
        Self { t: t_max, u: zero, v: zero, prim: [INVALID_ID; MAX_LANES], inst: [INVALID_ID; MAX_LANES] }
    }

    /// The tie rule, in one place: a candidate in `active` wins if it is nearer, or as near with a smaller
    /// instance number, or the same instance and a smaller primitive number.
    #[inline(always)]
    pub fn commit(&mut self, active: u32, c: &Candidate<V>, prim: u32, inst: u32) {
        let wanted = c.hit & V::Mask::from_bits(active);
        let mut wins = (wanted & c.t.cmp_lt(self.t)).bits();
        let mut ties = (wanted & c.t.cmp_eq(self.t)).bits();
        while ties != 0 {
            let lane = ties.trailing_zeros() as usize;
            if (inst, prim) < (self.inst[lane], self.prim[lane]) {
                wins |= 1 << lane;
            }
            ties &= ties - 1;
        }
        if wins == 0 {
            return;
        }
        let mask = V::Mask::from_bits(wins);
        self.t = V::select(mask, c.t, self.t);
        self.u = V::select(mask, c.u, self.u);
        self.v = V::select(mask, c.v, self.v);
        if V::N == 1 {
            (self.prim[0], self.inst[0]) = (prim, inst);
            return;
        }
        let wins = <f32x16 as Lanes>::Mask::from_bits(wins);
        self.prim = merge(wins, prim, self.prim);
        self.inst = merge(wins, inst, self.inst);
    }

    /// One lane as hits of width 1.
    #[inline(always)]
    pub fn single(&self, lane: usize) -> HitPacket<V::Scalar> {
        let mut one = HitPacket::new(self.t.lane(lane));
        (one.u, one.v) = (self.u.lane(lane), self.v.lane(lane));
        (one.prim[0], one.inst[0]) = (self.prim[lane], self.inst[lane]);
        one
    }

    /// Puts back what [`HitPacket::single`] took out.
    #[inline(always)]
    pub fn replace(&mut self, lane: usize, one: &HitPacket<V::Scalar>) {
        let mask = V::Mask::from_bits(1 << lane);
        self.t = V::select(mask, V::splat(one.t), self.t);
        self.u = V::select(mask, V::splat(one.u), self.u);
        self.v = V::select(mask, V::splat(one.v), self.v);
        (self.prim[lane], self.inst[lane]) = (one.prim[0], one.inst[0]);
    }

    /// Writes the hits of rays `first..first + N` of a batch; lanes that hit nothing become misses.
    #[inline(always)]
    pub fn store(&self, hits: &mut Hits<V::Scalar>, first: usize) {
        const { assert!(PAD.is_multiple_of(MAX_LANES)) };
        let found =
            if V::N == 1 { u32::from(self.prim[0] != INVALID_ID) } else { !positions(&self.prim, INVALID_ID) & V::ALL };
        V::select(V::Mask::from_bits(found), self.t, V::splat(V::Scalar::INFINITY)).store(&mut hits.t[first..]);
        self.u.store(&mut hits.u[first..]);
        self.v.store(&mut hits.v[first..]);
        hits.prim[first..first + V::N].copy_from_slice(&self.prim[..V::N]);
        hits.inst[first..first + V::N].copy_from_slice(&self.inst[..V::N]);
    }
}
