//! One node against a tile: eight boxes against both edges of the tile's rectangle at once, then one box against
//! sixteen groups at a time.
//!
//! For a plane through the apex with normal n, a box with centre c and half size h has n.c + |n|.h as largest
//! value. The four families of planes (left, right, below, above) are evaluated at both edges of the tile; the
//! largest value is a convex function of where the plane lies between them, so a straight line between the two
//! values is a bound for every group. Source of the idea: Reshetov, Soupikov, Hurley, "Multi-level ray tracing
//! algorithm", 2005 (frusta over boxes); the interpolation is our own.

use super::frame::Frame;
use super::groups::Groups;
use super::{SET, V};
use crate::bvh::{Node, WIDTH};
use crate::lanes::words::{halves, signs, twice, upper_halves, without_key};
use crate::lanes::{LaneMask, Lanes, each, f32x8, map3};

/// Half a vector: the eight children of a node.
type Half = f32x8;

/// Rounding errors of a box test, in half ulps of the scene's size ([`Frame::extent`]) times the plane's size; and how
/// far a hit that the triangle test may accept can lie outside.
pub const MARGIN: f32 = 48.0;

/// What node tests need of a tile.
#[derive(Clone, Copy, Debug)]
pub struct Planes {
    /// Per axis (s, t): half the plane normals' components, left edge in the low half, right edge in the high half.
    normal: [[V; 3]; 2],
    /// Their absolute values.
    size: [[V; 3]; 2],
    /// Margin by axis.
    margin: [V; 2],
    /// Half the depth axis, its absolute value, its margin.
    depth: [f32; 3],
    depth_size: [f32; 3],
    depth_margin: f32,
    /// Boxes that end before this depth are not met.
    front: f32,
    apex: [f32; 3],
}

/// An opened node: children that are left to visit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Level {
    /// Largest values of the left, right, lower and upper planes over each child's box, for planes at the tile's low edge.
    low: [[f32; WIDTH]; 4],
    /// What is to be added for planes at its high edge.
    step: [[f32; WIDTH]; 4],
    /// Nearest depth of each child.
    near: [f32; WIDTH],
    /// Upper half of the nearest depth's bits, from 0 on; all ones for a child that is done or not wanted.
    pub keys: [u16; WIDTH],
    /// The node.
    pub node: u32,
    /// Groups that met it.
    pub groups: u64,
}

impl Default for Level {
    fn default() -> Self {
        Self {
            low: [[0.0; WIDTH]; 4],
            step: [[0.0; WIDTH]; 4],
            near: [0.0; WIDTH],
            keys: [u16::MAX; WIDTH],
            node: 0,
            groups: 0,
        }
    }
}

/// The key of a depth: order of keys is order of depths, coarsely.
#[inline(always)]
pub fn key(depth: f32) -> u16 {
    ((if depth > 0.0 { depth } else { 0.0 }).to_bits() >> 16) as u16
}

impl Planes {
    /// The planes of a loaded tile whose frame is `frame` in the space of the boxes. `margin`: how far outside of a box
    /// its contents may be met, in that space.
    #[inline(always)]
    pub fn of(groups: &Groups, frame: &Frame, margin: f32) -> Self {
        let [u, v, a] = frame.axes;
        let both = |lo: f32, hi: f32| twice_each(lo, hi);
        let mut planes = Self {
            normal: [[V::splat(0.0); 3]; 2],
            size: [[V::splat(0.0); 3]; 2],
            margin: [V::splat(0.0); 2],
            depth: a.map(|x| 0.5 * x),
            depth_size: a.map(|x| (0.5 * x).abs()),
            depth_margin: 0.0,
            front: groups.front,
            apex: frame.apex,
        };
        let sum = |n: [f32; 3]| n[0].abs() + n[1].abs() + n[2].abs();
        for (axis, across) in [u, v].into_iter().enumerate() {
            let normal = groups.bounds[axis].map(|edge| each(|x| across[x] - edge * a[x]));
            planes.normal[axis] = each(|x| both(0.5 * normal[0][x], 0.5 * normal[1][x]));
            planes.size[axis] = map3(planes.normal[axis], V::abs);
            // The tile's edges are rounded differences too: |edge| * |a| belongs to the plane's size.
            let [lo, hi] = normal.map(|n| margin * (sum(n) + sum(across) + groups.wide * sum(a)));
            planes.margin[axis] = both(lo, hi) + V::splat(groups.slack * (1.0 + groups.wide) * 2.0);
        }
        planes.depth_margin = margin * sum(a) + groups.slack * 2.0;
        planes
    }

    /// Tests the children of `node`; returns those that are met, and fills in `level` if any is.
    #[inline(always)]
    pub fn open(&self, node: &Node<f32>, level: &mut Level) -> u32 {
        let zero = Half::splat(0.0);
        let (mut sum, mut size) = ([zero; 3], [zero; 3]);
        for a in 0..3 {
            let origin = Half::splat(self.apex[a]);
            let lo = Half::new(node.bounds[a][0]) - origin;
            let hi = Half::new(node.bounds[a][1]) - origin;
            (sum[a], size[a]) = (hi + lo, hi - lo);
        }
        let (sums, sizes) = (map3(sum, twice), map3(size, twice));
        let middle = |n: &[V; 3]| n[0].mul_add(sums[0], n[1].mul_add(sums[1], n[2] * sums[2]));
        let radius = |n: &[V; 3], e: V| n[0].mul_add(sizes[0], n[1].mul_add(sizes[1], n[2].mul_add(sizes[2], e)));
        let (ms, rs) = (middle(&self.normal[0]), radius(&self.size[0], self.margin[0]));
        let (mt, rt) = (middle(&self.normal[1]), radius(&self.size[1], self.margin[1]));
        let (left, right, below, above) = (rs + ms, rs - ms, rt + mt, rt - mt);
        let d = map3(self.depth, Half::splat);
        let e = map3(self.depth_size, Half::splat);
        let mz = d[0].mul_add(sum[0], d[1].mul_add(sum[1], d[2] * sum[2]));
        let margin = Half::splat(self.depth_margin);
        let rz = e[0].mul_add(size[0], e[1].mul_add(size[1], e[2].mul_add(size[2], margin)));
        // Left of the tile's left edge or right of its right edge, all of the box.
        let outside = signs(left.fast_min(below)) & 0xff | signs(right.fast_min(above)) >> 8;
        let in_front = Half::splat(self.front).cmp_le(mz + rz).bits();
        let met = !outside & in_front & ((1u32 << node.used.min(8)) - 1);
        if met == 0 {
            return 0;
        }
        for (family, value) in [left, right, below, above].into_iter().enumerate() {
            let [low, high] = halves(value);
            low.store(&mut level.low[family]);
            (high - low).store(&mut level.step[family]);
        }
        let near = mz - rz;
        level.near = near.to_array();
        level.keys = upper_halves(near.fast_max(zero), met);
        met
    }
}

impl Level {
    /// Groups that meet the box of `child`, of those that met the node; the tile has `N` sets.
    #[inline(always)]
    pub fn groups_at<const N: usize>(&self, child: usize, groups: &Groups) -> u64 {
        let low = |family: usize| V::splat(self.low[family][child]);
        let step = |family: usize| V::splat(self.step[family][child]);
        let (low, step) = ([low(0), low(1), low(2), low(3)], [step(0), step(1), step(2), step(3)]);
        let near = V::splat(self.near[child]);
        let mut met = 0;
        for q in 0..N {
            let between = |family: usize, part: V| part.mul_add(step[family], low[family]);
            // The left planes lie at the groups' least s, the right planes at their greatest; so for t.
            let [[s0, s1], [t0, t1]] = &groups.part;
            let least =
                between(0, s0[q]).fast_min(between(1, s1[q])).fast_min(between(2, t0[q]).fast_min(between(3, t1[q])));
            met |= u64::from(!signs(least) & near.cmp_le(groups.far[q]).bits()) << (q * SET);
        }
        met & self.groups
    }

    /// Takes a child off the list.
    #[inline(always)]
    pub fn remove(&mut self, child: usize) {
        self.keys = without_key(&self.keys, child);
    }
}

fn twice_each(lo: f32, hi: f32) -> V {
    V::new(std::array::from_fn(|i| if i < 8 { lo } else { hi }))
}
