//! A chunk of rays of one octant as structures of arrays.

use super::bounds::Bounds;
use super::node::DENSE;
use super::region::Region;
use crate::lanes::rows::{ROW, Row, from_rows};
use crate::lanes::words::transpose_bits;
use crate::lanes::{LaneMask, Lanes, Lanes3, MAX_LANES, Real, each, map3};
use crate::ray::Packet;
use crate::shape::sieve::{Line, gauge};
use crate::shape::{BLOCK, Triangle, Turned, around};

/// Most rays in a chunk: one bit each in a [`Set`].
pub const RAYS: usize = 128;

/// A set of rays of a chunk.
pub type Set = u128;

/// How far a `shift` is moved, in half ulps: two roundings, doubled.
const SLACK: f64 = 4.0;

/// Up to this many rays go into an instance one by one.
const FEW: u32 = 4;

/// Rays in one space, prepared for the kernels as [`Packet`]s are. Entries from `len` on are unspecified.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Chunk<S> {
    /// Origins.
    pub org: [[S; RAYS]; 3],
    /// Origins with their component along the dominant axis first, then the two that follow it.
    pub around: [[S; RAYS]; 3],
    /// Directions.
    pub dir: [[S; RAYS]; 3],
    /// Finite reciprocals of the directions.
    pub rcp: [[S; RAYS]; 3],
    /// Origins times reciprocals, at least and at most: what near and far planes of boxes are moved by where every node counts (see
    /// [`super::node`]).
    pub shift: [[[S; RAYS]; 3]; 2],
    /// See [`Packet::shear`].
    pub shear: [[S; RAYS]; 3],
    /// Start of the segments.
    pub t_min: [S; RAYS],
    /// See [`Packet::t_floor`].
    pub t_floor: [S; RAYS],
    /// See [`Line::gauge`].
    gauge: [S; RAYS],
    /// See [`Line::t_low`].
    t_low: [S; RAYS],
    /// Octant of each ray (if `mixed`).
    pub octant: [u8; RAYS],
    /// Dominant axis of each ray.
    pub axis: [u8; RAYS],
    /// Rays with each dominant axis.
    pub dominant: [Set; 3],
    /// Rays along faces, of which the sieve is sure of nothing: see [`Chunk::find_common`].
    pub common: Set,
    /// Whether some ray may be [`Triangle::along_a_face`].
    pub flat: bool,
    /// Whether some `shift` is too large to compute with, or some ray starts behind its origin: for the exact test.
    pub steep: bool,
    /// Sum of the directions (closest-hit, of at least [`DENSE`] rays with `bounds`).
    pub mean: [S; 3],
    /// Number of rays.
    pub len: usize,
    /// Bounds over all of them, if they are of one octant.
    pub bounds: Option<Bounds<S>>,
    /// Whether there is what the common formula needs beside: `around`, `shear`, `axis` and `dominant`. Where `common` rays are, there
    /// always is.
    pub sheared: bool,
    /// Whether they go together whatever their octants.
    pub mixed: bool,
    /// Where they all lie, if that is known of `mixed` ones.
    pub region: Option<Region<S>>,
}

impl<S: Real> Default for Chunk<S> {
    fn default() -> Self {
        let zero = [S::ZERO; RAYS];
        Self {
            org: [zero; 3],
            around: [zero; 3],
            dir: [zero; 3],
            rcp: [zero; 3],
            shift: [[zero; 3]; 2],
            shear: [zero; 3],
            t_min: zero,
            t_floor: zero,
            gauge: zero,
            t_low: zero,
            octant: [0; RAYS],
            axis: [0; RAYS],
            dominant: [0; 3],
            flat: false,
            common: 0,
            steep: false,
            mean: [S::ZERO; 3],
            len: 0,
            bounds: None,
            sheared: true,
            mixed: false,
            region: None,
        }
    }
}

/// What a chunk takes of the rays of a packet, as columns.
#[inline(always)]
pub fn row<V: Lanes>(packet: &Packet<V>, t_max: V) -> [V; ROW] {
    let ([ox, oy, oz], [dx, dy, dz]) = (packet.org, packet.dir);
    [ox, oy, oz, packet.t_min, dx, dy, dz, t_max]
}

/// Numbers of some rays side by side.
#[inline(always)]
pub fn gathered<V: Lanes>(column: &[V::Scalar; RAYS], of: &[u8]) -> V {
    let mut numbers = [column[usize::from(of[0]) & (RAYS - 1)]; MAX_LANES];
    for (to, &ray) in numbers.iter_mut().zip(of) {
        *to = column[usize::from(ray) & (RAYS - 1)];
    }
    V::load(&numbers)
}

#[inline(always)]
fn load3<V: Lanes>(from: &[[V::Scalar; RAYS]; 3], at: usize) -> Lanes3<V> {
    [V::load(&from[0][at..]), V::load(&from[1][at..]), V::load(&from[2][at..])]
}

#[inline(always)]
fn store3<V: Lanes>(from: Lanes3<V>, to: &mut [[V::Scalar; RAYS]; 3], at: usize) {
    from.into_iter().zip(to).for_each(|(x, to)| x.store(&mut to[at..]));
}

impl<S: Real> Chunk<S> {
    /// Takes at most [`RAYS`] rays by their places among `rows` (see [`row`]), which are some; the ends of their segments go to `t`.
    /// `ANY`: for any-hit.
    #[inline(always)]
    pub fn gather<V: Lanes<Scalar = S>, const ANY: bool>(
        &mut self,
        rows: &[Row<S>],
        places: &[u32],
        t: &mut [S; RAYS],
        sheared: bool,
    ) {
        self.start(places.len(), sheared);
        let last = self.len - 1;
        for at in (0..self.len).step_by(V::N) {
            // Whole vectors: the last ray again.
            let row = |i: usize| rows[(places[(at + i).min(last)] as usize).min(rows.len() - 1)];
            let [ox, oy, oz, t_min, dx, dy, dz, t_max] = from_rows::<V>(row);
            t_max.store(&mut t[at..]);
            self.take(at, &Packet::prepared([ox, oy, oz], [dx, dy, dz], t_min, sheared), V::ALL);
        }
        self.bounds = Some(Bounds::of::<V>(self, t));
        if !ANY && self.len >= DENSE as usize {
            self.mean = self.sum_of_directions::<V>();
        }
        self.find_common::<V>(Set::MAX);
    }

    /// Starts anew, with `len` rays to come, with or without what the common formula needs of them beside.
    #[inline(always)]
    pub fn start(&mut self, len: usize, sheared: bool) {
        (self.len, self.bounds, self.region) = (len.min(RAYS), None, None);
        self.sheared = sheared;
        (self.mixed, self.flat, self.steep, self.common) = (false, false, false, 0);
    }

    /// Takes in a vector of rays, of which those of `live` matter.
    #[inline(always)]
    pub fn take<V: Lanes<Scalar = S>>(&mut self, at: usize, packet: &Packet<V>, live: u32) {
        store3(packet.org, &mut self.org, at);
        store3(packet.dir, &mut self.dir, at);
        packet.t_min.store(&mut self.t_min[at..]);
        self.put(at, packet, live);
    }

    /// Finds out, once all rays are there, which of `rays` have an infinite [`Line::gauge`], and prepares them for the common formula. Not
    /// vector by vector as they come: what is rarely needed of a vector would keep all of it from staying in registers.
    #[inline(always)]
    pub fn find_common<V: Lanes<Scalar = S>>(&mut self, rays: Set) {
        self.common = 0;
        // What is too large for bounds is rarer still, and may be decided triangle by triangle.
        if !self.flat {
            return;
        }
        let mut common = 0;
        for at in (0..self.len).step_by(V::N) {
            let infinite = V::splat(V::Scalar::MAX).cmp_lt(V::load(&self.gauge[at..])).bits();
            common |= Set::from(infinite) << at;
        }
        self.common = common & rays & Set::MAX.unbounded_shr((RAYS - self.len) as u32);
        if self.common != 0 && !self.sheared {
            self.shear_common::<V>();
        }
    }

    /// Works out what the common formula needs of `common` rays, and of those in vectors with them.
    #[cold]
    #[inline(never)]
    fn shear_common<V: Lanes<Scalar = S>>(&mut self) {
        for at in (0..self.len).step_by(V::N) {
            if (self.common >> at) as u32 & V::ALL != 0 {
                let (org, dir) = (load3::<V>(&self.org, at), load3(&self.dir, at));
                self.put_shear(at, &Packet::new(org, dir, V::load(&self.t_min[at..])));
            }
        }
    }

    /// Notes the octants of a vector of rays.
    #[inline(always)]
    pub fn take_octants<V: Lanes<Scalar = S>>(&mut self, at: usize, packet: &Packet<V>) {
        let down = map3(packet.rcp, |r| r.cmp_lt(V::constant(0.0)).bits());
        self.octant[at..at + V::N].copy_from_slice(&transpose_bits(down)[..V::N]);
    }

    /// About that: entries after the last ray count too, as far as the vectors go.
    fn sum_of_directions<V: Lanes<Scalar = S>>(&self) -> [S; 3] {
        each(|a| {
            let mut sums = [S::ZERO; MAX_LANES];
            let vectors = (0..self.len).step_by(V::N).map(|at| V::load(&self.dir[a][at..]));
            vectors.fold(V::constant(0.0), |sum, next| sum + next).store(&mut sums);
            sums.into_iter().fold(S::ZERO, |sum, next| sum + next)
        })
    }

    /// Puts in what kernels need beside origins and directions.
    #[inline(always)]
    fn put<V: Lanes<Scalar = S>>(&mut self, at: usize, packet: &Packet<V>, live: u32) {
        store3(packet.rcp, &mut self.rcp, at);
        let product = each(|a| packet.org[a] * packet.rcp[a]);
        let slack = map3(product, |x| x.abs() * V::constant(SLACK * V::Scalar::EPSILON.to_f64()));
        store3(each(|a| product[a] + slack[a]), &mut self.shift[0], at);
        store3(each(|a| product[a] - slack[a]), &mut self.shift[1], at);
        let most = V::constant(V::Scalar::MAX.to_f64() / 4.0);
        let [x, y, z] = map3(product, |x| x.abs().cmp_le(most));
        let ahead = V::constant(0.0).cmp_le(packet.t_min);
        self.steep |= !(x & y & z & ahead).bits() & live != 0;
        self.flat |= Triangle::along_a_face(packet.dir).bits() & live != 0;
        gauge(packet.org, packet.dir).store(&mut self.gauge[at..]);
        let from_start = packet.t_floor.cmp_lt(packet.t_min);
        V::select(from_start, packet.t_min, V::splat(V::Scalar::LOWEST)).store(&mut self.t_low[at..]);
        packet.t_floor.store(&mut self.t_floor[at..]);
        if self.sheared {
            self.put_shear(at, packet);
        }
    }

    /// Puts in what the common formula needs beside.
    #[inline(always)]
    fn put_shear<V: Lanes<Scalar = S>>(&mut self, at: usize, packet: &Packet<V>) {
        store3(packet.shear, &mut self.shear, at);
        let dominant = map3(packet.dominant, V::Mask::from_bits);
        let turned = each(|axis| around(packet.org, axis));
        let pick = |i: usize| V::select(dominant[0], turned[0][i], V::select(dominant[1], turned[1][i], turned[2][i]));
        store3(each(pick), &mut self.around, at);
        let [_, y, z] = packet.dominant;
        self.axis[at..at + V::N].copy_from_slice(&transpose_bits([y, z])[..V::N]);
        for (mask, bits) in self.dominant.iter_mut().zip(packet.dominant) {
            *mask = *mask & !(Set::from(V::ALL) << at) | Set::from(bits) << at;
        }
    }

    /// A ray around its dominant axis.
    #[inline(always)]
    pub fn turned(&self, ray: usize) -> Turned<S> {
        let axis = usize::from(self.axis[ray]);
        let pick = |v: &[[S; RAYS]; 3]| [v[0][ray], v[1][ray], v[2][ray]];
        Turned { axis, org: pick(&self.around), shear: pick(&self.shear), rcp: self.rcp[axis.min(2)][ray] }
    }

    /// One ray as the common formula takes it, `sheared` or not.
    #[inline(always)]
    pub fn whole(&self, ray: usize) -> (Turned<S>, Packet<S::Octo>) {
        if self.sheared {
            return (self.turned(ray), self.splat(ray));
        }
        let [org, dir] = [&self.org, &self.dir].map(|v| each(|a| S::Octo::splat(v[a][ray])));
        let [t_min, t_floor] = [&self.t_min, &self.t_floor].map(|x| S::Octo::splat(x[ray]));
        let packet = Packet { t_floor, ..Packet::new(org, dir, t_min) };
        let one = packet.single(0);
        let axis = usize::from(one.dominant[1] != 0) + 2 * usize::from(one.dominant[2] != 0);
        (Turned::of(&one, axis), packet)
    }

    /// Two rays, each in half of the lanes; in vectors of eight or less the first. `t`: ends of the segments.
    #[inline(always)]
    pub fn beside<P: Lanes<Scalar = S>>(&self, t: &[S; RAYS], first: usize, second: usize) -> Line<P> {
        let pick = |of: &[S; RAYS]| match P::N <= BLOCK {
            true => P::splat(of[first]),
            false => P::select(P::Mask::from_bits(0xff), P::splat(of[first]), P::splat(of[second])),
        };
        Line {
            org: each(|a| pick(&self.org[a])),
            dir: each(|a| pick(&self.dir[a])),
            gauge: pick(&self.gauge),
            t_min: pick(&self.t_min),
            t_low: pick(&self.t_low),
            t_max: pick(t),
        }
    }

    /// One ray, the same in all lanes.
    #[inline(always)]
    pub fn splat(&self, ray: usize) -> Packet<S::Octo> {
        let splat3 = |v: &[[S; RAYS]; 3]| each(|a| S::Octo::splat(v[a][ray]));
        Packet {
            org: splat3(&self.org),
            dir: splat3(&self.dir),
            rcp: splat3(&self.rcp),
            t_min: S::Octo::splat(self.t_min[ray]),
            t_floor: S::Octo::splat(self.t_floor[ray]),
            dominant: map3(self.dominant, |mask| if mask >> ray & 1 != 0 { S::Octo::ALL } else { 0 }),
            shear: splat3(&self.shear),
        }
    }

    /// Rays `at..at + N` as a packet.
    #[inline(always)]
    pub fn packet<V: Lanes<Scalar = S>>(&self, at: usize) -> Packet<V> {
        Packet {
            org: load3(&self.org, at),
            dir: load3(&self.dir, at),
            rcp: load3(&self.rcp, at),
            t_min: V::load(&self.t_min[at..]),
            t_floor: V::load(&self.t_floor[at..]),
            dominant: map3(self.dominant, |mask| (mask >> at) as u32 & V::ALL),
            shear: load3(&self.shear, at),
        }
    }

    /// Some rays, at least one, side by side as a packet; other lanes have one of them.
    #[inline(always)]
    pub fn gathered<V: Lanes<Scalar = S>>(&self, of: &[u8]) -> Packet<V> {
        let three = |from: &[[S; RAYS]; 3]| each(|a| gathered::<V>(&from[a], of));
        let mut packet = Packet {
            org: three(&self.org),
            dir: three(&self.dir),
            rcp: three(&self.rcp),
            t_min: gathered(&self.t_min, of),
            t_floor: gathered(&self.t_floor, of),
            dominant: [0; 3],
            shear: [V::constant(0.0); 3],
        };
        if self.sheared {
            packet.shear = three(&self.shear);
            packet.dominant = map3(self.dominant, |set| {
                of.iter().enumerate().fold(0, |all, (lane, &ray)| all | ((set >> ray & 1) as u32) << lane)
            });
        }
        packet
    }

    /// The octant of the first of some rays, and those of the same.
    #[inline(always)]
    pub fn first_octant<V: Lanes<Scalar = S>>(&self, rays: Set) -> (usize, Set) {
        let octant = |i: usize| (0..3).fold(0, |o, axis| o | usize::from(self.rcp[axis][i] < S::ZERO) << axis);
        let first = octant(rays.trailing_zeros() as usize & (RAYS - 1));
        if rays.count_ones() > FEW {
            let zero = V::constant(0.0);
            let alike = |at: usize| {
                let [x, y, z] = each(|a| {
                    let down = V::load(&self.rcp[a][at..]).cmp_lt(zero).bits();
                    down ^ 0u32.wrapping_sub(first as u32 >> a & 1)
                });
                Set::from(!(x | y | z) & V::ALL) << at
            };
            return (first, rays & (0..self.len).step_by(V::N).fold(0, |all, at| all | alike(at)));
        }
        let (mut rest, mut alike) = (rays, 0);
        while rest != 0 {
            let i = rest.trailing_zeros() as usize & (RAYS - 1);
            rest &= rest - 1;
            alike |= Set::from(octant(i) == first) << i;
        }
        (first, alike)
    }
}
