//! Which of the triangles that were set up together the groups of a tile meet: by rectangle and depth, no ray looked at.
//!
//! Sixteen groups at a time against one triangle, or sixteen triangles at a time against one group. Both come to the same pairs,
//! bit by bit: a linear function is largest at one corner of a rectangle, and its roundings are monotone. Groups of about one size
//! ([`super::even`]) may be listed with a few more.

use super::batch::{BATCH, Planes};
use super::groups::Groups;
use super::held::Plane;
use super::{GROUPS, SET, SETS, V};
use crate::lanes::chosen::lanes_of;
use crate::lanes::marks::words_with;
use crate::lanes::{LaneMask, Lanes, Lanes3, each};

/// The pairs of a triangle and a group that meet.
#[derive(Clone, Debug)]
pub struct Listing {
    /// Listed group by group, else triangle by triangle.
    pub by_groups: bool,
    /// By group: triangles, as bits. Only of those that are listed.
    triangles: [u16; GROUPS],
    /// The groups.
    groups: [u8; GROUPS],
    len: usize,
    /// By triangle: groups, as bits.
    met: [u64; BATCH],
    /// The triangles that some group meets, as bits.
    seen: u32,
    /// Pairs.
    pub pairs: usize,
}

impl Default for Listing {
    fn default() -> Self {
        Self {
            by_groups: true,
            triangles: [0; GROUPS],
            groups: [0; GROUPS],
            len: 0,
            met: [0; BATCH],
            seen: 0,
            pairs: 0,
        }
    }
}

/// The set bits of `bits`, each a triangle of a batch.
#[inline(always)]
pub fn triangles(bits: u32) -> impl Iterator<Item = usize> {
    lanes_of(bits).map(|i| i & (BATCH - 1))
}

/// The set bits of `bits`, each a group of a tile.
#[inline(always)]
pub fn groups(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let g = bits.trailing_zeros() as usize & (GROUPS - 1);
        (bits != 0).then(|| {
            bits &= bits - 1;
            g
        })
    })
}

/// Numbers of all groups.
#[inline(always)]
fn of_all(sets: &[V; SETS]) -> &[f32; GROUPS] {
    bytemuck::cast_ref(sets)
}

impl Listing {
    /// Listed group by group: the groups that meet triangles.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len.min(GROUPS)
    }

    /// One of them, and the triangles it meets, as bits.
    #[inline(always)]
    pub fn get(&self, k: usize) -> (usize, u32) {
        let g = usize::from(self.groups[k]) & (GROUPS - 1);
        (g, self.triangles[g].into())
    }

    /// Listed triangle by triangle: those that groups meet, as bits.
    #[inline(always)]
    pub fn seen(&self) -> u32 {
        self.seen
    }

    /// The groups that meet triangle `i`, as bits.
    #[inline(always)]
    pub fn groups(&self, i: usize) -> u64 {
        self.met[i & (BATCH - 1)]
    }

    /// All groups with some of the `wanted` triangles.
    #[inline(always)]
    pub fn each(&self, wanted: u32, mut pair: impl FnMut(usize, usize)) {
        if self.by_groups {
            for (g, met) in (0..self.len()).map(|k| self.get(k)) {
                triangles(met & wanted).for_each(|i| pair(g, i));
            }
        } else {
            for i in triangles(self.seen & wanted) {
                groups(self.groups(i)).for_each(|g| pair(g, i));
            }
        }
    }

    /// Lists which of the `seen` triangles the groups of `N` sets meet, of those that met their leaves.
    #[inline(always)]
    pub fn fill<const N: usize, const EXACT: bool>(
        &mut self,
        seen: u32,
        met_leaves: &[u64],
        groups: &Groups,
        planes: &mut Planes,
    ) {
        (self.len, self.pairs, self.by_groups) = (0, 0, true);
        let Some(wanted) = met_leaves.first_chunk() else { return };
        // A loop: closures over arrays of this length become calls, which cost more than what they do.
        let mut any = 0;
        for (i, groups) in wanted.iter().enumerate() {
            any |= if seen >> i & 1 != 0 { *groups } else { 0 };
        }
        let mut some = [0; SETS];
        for (q, some) in some.iter_mut().enumerate().take(N) {
            *some = words_with(wanted, 0xffff << (q * SET)) & seen;
        }
        // A group costs with all triangles what a set costs with one; half or twice as much makes no difference.
        self.by_groups = any.count_ones() <= some.iter().map(|some| some.count_ones()).sum::<u32>();
        if self.by_groups {
            self.group_by_group::<EXACT>(wanted, (seen, any), groups, planes);
        } else {
            (self.met, self.seen) = ([0; BATCH], 0);
            planes.find_corners();
            for (q, some) in some.into_iter().enumerate().take(N) {
                self.set::<EXACT>(q, wanted, some, groups, planes);
            }
        }
    }

    /// All triangles against one group after the other.
    #[inline(always)]
    fn group_by_group<const EXACT: bool>(
        &mut self,
        wanted: &[u64; BATCH],
        among: (u32, u64),
        groups: &Groups,
        planes: &Planes,
    ) {
        let linear = |k: usize| each(|x| V::load(&planes.linear[k][x]));
        let linear = [linear(0), linear(1), linear(2), linear(3)];
        if let Some(even) = groups.even.as_ref().filter(|_| !EXACT) {
            let raised = linear.map(|f: Lanes3<V>| even.raised(f));
            let [mid_s, mid_t] = even.middle.each_ref().map(of_all);
            self.largest_met::<EXACT>(wanted, among, groups, planes, |k, g| {
                let [x, y, z] = raised[k];
                x.mul_add(V::splat(mid_s[g]), y.mul_add(V::splat(mid_t[g]), z))
            });
        } else {
            // Of each product with an end of the rectangle one is zero: sums are those with the one that is greater.
            let zero = V::constant(0.0);
            let split = linear.map(|[x, y, z]: [V; 3]| {
                ([x.fast_max(zero), x.fast_min(zero)], [y.fast_max(zero), y.fast_min(zero)], z)
            });
            let [[low_s, high_s], [low_t, high_t]] = groups.rect.each_ref().map(|ends| ends.each_ref().map(of_all));
            self.largest_met::<EXACT>(wanted, among, groups, planes, |k, g| {
                let ([x1, x0], [y1, y0], z) = split[k];
                let (s0, s1, t0, t1) = (low_s[g], high_s[g], low_t[g], high_t[g]);
                let along_t = y1.mul_add(V::splat(t1), y0.mul_add(V::splat(t0), z));
                x1.mul_add(V::splat(s1), x0.mul_add(V::splat(s0), along_t))
            });
        }
    }

    /// The same; `largest`: the greatest value of linear function `k` over group `g`.
    #[inline(always)]
    fn largest_met<const EXACT: bool>(
        &mut self,
        wanted: &[u64; BATCH],
        (seen, any): (u32, u64),
        groups: &Groups,
        planes: &Planes,
        largest: impl Fn(usize, usize) -> V,
    ) {
        let (outside, most) = (V::load(&planes.outside), V::load(&planes.most));
        let (nearest, farthest) = (V::load(&planes.nearest), V::load(&planes.farthest));
        let wild = if EXACT { 0 } else { planes.wild };
        let least = of_all(&groups.least);
        let mut rest = any;
        while rest != 0 {
            let g = rest.trailing_zeros() as usize & (GROUPS - 1);
            rest &= rest - 1;
            let edge = largest(0, g).fast_min(largest(1, g)).fast_min(largest(2, g));
            let inverse = largest(3, g);
            let inverse = if EXACT { inverse * most } else { nearest.fast_min(farthest.fast_max(inverse)) };
            let met = outside.cmp_le(edge) & V::splat(least[g]).cmp_le(inverse);
            let met = (met.bits() | wild) & seen & words_with(wanted, 1 << g);
            // Always written, counted where there are any: that is a surprise every time.
            self.triangles[g] = met as u16;
            self.groups[self.len & (GROUPS - 1)] = g as u8;
            self.len += usize::from(met != 0);
            self.pairs += met.count_ones() as usize;
        }
    }

    /// All groups of set `q` against one after the other of some triangles.
    #[inline(always)]
    fn set<const EXACT: bool>(&mut self, q: usize, wanted: &[u64; BATCH], some: u32, groups: &Groups, planes: &Planes) {
        let mut rest = some;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize & (BATCH - 1);
            rest &= rest - 1;
            // The largest value over each group's rectangle, one group per lane.
            let largest = |k: usize| {
                let [x, y, z] = each(|x| V::splat(planes.linear[k][x][i]));
                let [s, t] = [0, 1].map(|axis| {
                    groups.rect[axis].as_flattened()[(planes.corner[k][axis][i] as usize + q) & (2 * SETS - 1)]
                });
                x.mul_add(s, y.mul_add(t, z))
            };
            let edge = largest(0).fast_min(largest(1)).fast_min(largest(2));
            let inverse = largest(3);
            let inverse = if EXACT { inverse * V::splat(planes.most[i]) } else { Plane::of(planes, i).within(inverse) };
            let met = V::splat(planes.outside[i]).cmp_le(edge) & groups.least[q].cmp_le(inverse);
            let wild = if EXACT { 0 } else { 0u32.wrapping_sub(planes.wild >> i & 1) };
            let met = (met.bits() | wild) & (wanted[i] >> (q * SET)) as u32 & 0xffff;
            self.pairs += met.count_ones() as usize;
            self.met[i] |= u64::from(met) << (q * SET);
            self.seen |= u32::from(met != 0) << i;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of a group and a triangle, in order.
    fn pairs(listing: &Listing) -> Vec<(usize, usize)> {
        let mut pairs = Vec::new();
        listing.each(0xffff, |g, i| pairs.push((g, i)));
        pairs.sort_unstable();
        assert_eq!(listing.pairs, pairs.len());
        pairs
    }

    #[test]
    fn groups_and_sets_list_the_same_pairs() {
        let mut state = 5u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / 16_777_216.0 - 0.5
        };
        let (mut groups, mut planes) = (Box::<Groups>::default(), Box::<Planes>::default());
        let (mut by_groups, mut by_sets, mut listed) = (Listing::default(), Listing::default(), 0);
        for round in 0..200 {
            let mut numbers = |size: f32| V::new(std::array::from_fn(|_| size * next()));
            for q in 0..SETS {
                for axis in 0..2 {
                    let low = numbers(1.0);
                    groups.rect[axis][0][q] = low;
                    groups.rect[axis][1][q] = low + numbers(0.2).abs();
                }
                groups.least[q] = numbers(1.0);
            }
            for k in 0..4 {
                for axis in 0..3 {
                    numbers(1.0).store(&mut planes.linear[k][axis]);
                }
                for axis in 0..2 {
                    let is_low = planes.linear[k][axis].map(|x| x < 0.0);
                    planes.corner[k][axis] = is_low.map(|is_low| if is_low { 0 } else { SETS as u32 });
                }
            }
            let columns = [&mut planes.outside, &mut planes.nearest, &mut planes.farthest, &mut planes.most];
            columns.into_iter().for_each(|column| numbers(0.5).store(column));
            planes.wild = u32::from(round % 3 == 0) << (round % 16);
            let wanted: [u64; BATCH] = std::array::from_fn(|i| ((next() * 1e6) as i64 as u64) << (4 * i) ^ i as u64);
            let any = wanted.iter().fold(0, |any, wanted| any | wanted);
            // Those that are not seen are not listed, whatever their leaves met.
            let seen = if round % 2 == 0 { 0xffff } else { 0x5b6d };
            let (groups, planes) = (&*groups, &*planes);
            let mut both = |exact: bool| {
                (by_groups, by_sets) = (Listing::default(), Listing { by_groups: false, ..Listing::default() });
                match exact {
                    true => by_groups.group_by_group::<true>(&wanted, (seen, any), groups, planes),
                    false => by_groups.group_by_group::<false>(&wanted, (seen, any), groups, planes),
                }
                for q in 0..SETS {
                    match exact {
                        true => by_sets.set::<true>(q, &wanted, seen, groups, planes),
                        false => by_sets.set::<false>(q, &wanted, seen, groups, planes),
                    }
                }
                let pairs = [pairs(&by_groups), pairs(&by_sets)];
                assert_eq!(pairs[0], pairs[1]);
                let listed = pairs[0].iter().fold(0, |listed, &(_, i)| listed | 1 << i);
                assert_eq!(by_sets.seen(), listed);
                assert!(pairs[0].iter().all(|&(g, i)| wanted[i] >> g & u64::from(seen >> i) & 1 != 0));
                let wild = if exact { 0 } else { planes.wild & seen };
                for (i, wanted) in wanted.iter().enumerate().filter(|(i, _)| wild >> i & 1 != 0) {
                    assert!((0..GROUPS).filter(|g| wanted >> g & 1 != 0).all(|g| pairs[0].contains(&(g, i))));
                }
                by_groups.pairs
            };
            listed += both(false) + both(true);
        }
        assert!((5_000..200_000).contains(&listed), "{listed}");
    }
}
