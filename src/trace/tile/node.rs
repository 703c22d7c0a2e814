//! One node against a tile: its boxes against both edges of the tile's rectangle at once, then one box against
//! sixteen groups at a time.
//!
//! For a plane through the apex with normal n, a box with centre c and half size h has n.c + |n|.h as largest
//! value. The four families of planes (left, right, below, above) are evaluated at both edges of the tile; the
//! largest value is a convex function of where the plane lies between them, so a straight line between the two
//! values is a bound for every group. Source of the idea: Reshetov, Soupikov, Hurley, "Multi-level ray tracing
//! algorithm", 2005 (frusta over boxes); the interpolation is our own.

use super::frame::Frame;
use super::groups::Groups;
use super::parallel::Parallel;
use super::spans::{Spans, groups_of};
use super::starts::Room;
use super::{HALF_ULP, SET, V};
use crate::bvh::{Node, Nodes, Tree};
use crate::lanes::words::{signs, upper_halves, without_key};
use crate::lanes::{LaneMask, Lanes, Real, each, map3};

/// A vector of a node's children.
type Children = <f32 as Real>::Children;

/// Children per node.
pub const WIDTH: usize = Children::N;

/// Levels of a tree.
pub fn levels(tree: &Tree<f32>) -> usize {
    Nodes::<f32, WIDTH>::levels(tree) as usize
}

/// A child's place in its node.
#[inline(always)]
pub fn slot(at: u32) -> usize {
    at as usize & (WIDTH - 1)
}

/// Rounding errors of a box test, in half ulps of the scene's size ([`Frame::extent`]) times the plane's size; and how
/// far a hit that the triangle test may accept can lie outside.
pub const MARGIN: f32 = 48.0;

/// What node tests need of a tile.
#[derive(Clone, Copy, Debug)]
pub struct Planes {
    /// Per axis (s, t), of the left and the right edge: half the plane normals' components.
    normal: [[[f32; 3]; 2]; 2],
    /// Their absolute values.
    size: [[[f32; 3]; 2]; 2],
    /// Margin by axis and edge.
    margin: [[f32; 2]; 2],
    /// Half the depth axis, its absolute value, its margin.
    depth: [f32; 3],
    depth_size: [f32; 3],
    depth_margin: f32,
    /// Boxes that end before this depth are not met.
    front: f32,
    /// Where the edges' planes are, if not through the apex: by axis and edge.
    offset: [[f32; 2]; 2],
    /// Rays of one direction: the height of the apex ([`super::parallel`]).
    height: Option<f32>,
    apex: [f32; 3],
    /// Where segments are, if that is known in the space of the boxes.
    pub room: Option<Room>,
    /// See [`Spans`].
    pub spans: Spans,
}

/// An opened node: children that are left to visit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Level {
    /// Nearest depth of each child.
    near: [f32; WIDTH],
    /// Upper half of the nearest depth's bits, from 0 on; all ones for a child that is done or not wanted.
    pub keys: [u16; WIDTH],
    /// Groups that meet each child, as far as they looked when the node was opened.
    met: [u64; WIDTH],
    /// The node.
    pub node: u32,
}

impl Default for Level {
    fn default() -> Self {
        Self { near: [0.0; WIDTH], keys: [u16::MAX; WIDTH], met: [0; WIDTH], node: 0 }
    }
}

/// The planes of a tile's edges over a node's boxes.
#[repr(C, align(64))]
struct Sides {
    /// Largest values of the left, right, lower and upper planes over each child's box, for planes at the tile's low edge.
    low: [[f32; WIDTH]; 4],
    /// What is to be added for planes at its high edge.
    step: [[f32; WIDTH]; 4],
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
    pub fn of<const N: usize>(groups: &Groups, frame: &Frame, margin: f32) -> Self {
        let [u, v, a] = frame.axes;
        let mut planes = Self {
            normal: [[[0.0; 3]; 2]; 2],
            size: [[[0.0; 3]; 2]; 2],
            margin: [[0.0; 2]; 2],
            depth: a.map(|x| 0.5 * x),
            depth_size: a.map(|x| (0.5 * x).abs()),
            depth_margin: 0.0,
            front: groups.front,
            offset: [[0.0; 2]; 2],
            height: None,
            apex: frame.apex,
            room: None,
            spans: Spans::of::<N>(groups, frame, margin),
        };
        if let Some(parallel) = &frame.parallel {
            planes.set_parallel(parallel, groups, frame, margin);
            return planes;
        }
        let sum = |n: [f32; 3]| n[0].abs() + n[1].abs() + n[2].abs();
        for (axis, across) in [u, v].into_iter().enumerate() {
            let normal = groups.bounds[axis].map(|edge| each(|x| across[x] - edge * a[x]));
            planes.normal[axis] = normal.map(|n| n.map(|x| 0.5 * x));
            planes.size[axis] = normal.map(|n| n.map(|x| (0.5 * x).abs()));
            // The tile's edges are rounded differences too: |edge| * |a| belongs to the plane's size.
            let [lo, hi] = normal.map(|n| margin * (sum(n) + sum(across) + groups.wide * sum(a)));
            planes.margin[axis] = [lo, hi].map(|m| m + groups.slack * (1.0 + groups.wide) * 2.0);
        }
        planes.depth_margin = margin * sum(a) + groups.slack * 2.0;
        planes
    }

    /// The same for rays of one direction.
    #[inline(never)]
    fn set_parallel(&mut self, parallel: &Parallel, groups: &Groups, frame: &Frame, margin: f32) {
        let [u, v, a] = frame.axes;
        let sum = |n: [f32; 3]| n[0].abs() + n[1].abs() + n[2].abs();
        for (axis, across) in [u, v].into_iter().enumerate() {
            self.normal[axis] = [across.map(|x| 0.5 * x); 2];
            self.size[axis] = [across.map(|x| (0.5 * x).abs()); 2];
            self.offset[axis] = groups.bounds[axis];
            self.margin[axis] = [margin * 2.0 * sum(across) + groups.slack * 2.0; 2];
        }
        self.depth_margin = margin * 2.0 * sum(a) + groups.slack * 2.0;
        self.height = Some(parallel.height);
    }

    /// Tests the children of `node` against those of a tile's `N` sets of groups that met it; returns the children that some group
    /// meets, and fills in `level` if there are any.
    ///
    /// All children at once, whatever will be found in the nearest: few are left out for that later, while a test by itself is
    /// mostly waited for.
    #[inline(always)]
    pub fn open<const N: usize>(&self, node: &Node<f32, WIDTH>, tile: (&Groups, u64), level: &mut Level) -> u32 {
        // Two pieces of code: what only rays of one direction need costs the others 2 %.
        match self.height {
            None => self.open_from::<N, false>(node, tile, level),
            Some(_) => self.open_along::<N>(node, tile, level),
        }
    }

    /// The same for rays of one direction.
    #[inline(never)]
    fn open_along<const N: usize>(&self, node: &Node<f32, WIDTH>, tile: (&Groups, u64), level: &mut Level) -> u32 {
        self.open_from::<N, true>(node, tile, level)
    }

    /// The same; `ALONG`: whether rays have a direction in common and not a point.
    #[inline(always)]
    fn open_from<const N: usize, const ALONG: bool>(
        &self,
        node: &Node<f32, WIDTH>,
        (tile, groups): (&Groups, u64),
        level: &mut Level,
    ) -> u32 {
        let splat = <Children as Lanes>::splat;
        let zero = splat(0.0);
        let side = |side: usize| each(|a| Children::load(&node.bounds[a][side]) - splat(self.apex[a]));
        let (lo, hi): ([Children; 3], [Children; 3]) = (side(0), side(1));
        let (sum, size): ([Children; 3], [Children; 3]) = (each(|a| hi[a] + lo[a]), each(|a| hi[a] - lo[a]));
        let middle = |n: [f32; 3]| {
            let n = map3(n, splat);
            n[0].mul_add(sum[0], n[1].mul_add(sum[1], n[2] * sum[2]))
        };
        let radius = |n: [f32; 3], e: f32| {
            let n = map3(n, splat);
            n[0].mul_add(size[0], n[1].mul_add(size[1], n[2].mul_add(size[2], splat(e))))
        };
        // Of the planes of either family along an axis, as they are at one of the tile's edges.
        let planes = |axis: usize, edge: usize| {
            let through = middle(self.normal[axis][edge]);
            let m = if ALONG { through - splat(self.offset[axis][edge]) } else { through };
            let r = radius(self.size[axis][edge], self.margin[axis][edge]);
            (r + m, r - m)
        };
        let ((left_low, right_low), (left_high, right_high)) = (planes(0, 0), planes(0, 1));
        let ((below_low, above_low), (below_high, above_high)) = (planes(1, 0), planes(1, 1));
        let (mz, rz) = (middle(self.depth), radius(self.depth_size, self.depth_margin));
        // Left of the tile's left edge or right of its right edge, all of the box.
        let least = left_low.fast_min(below_low).fast_min(right_high.fast_min(above_high));
        // Heights grow towards where the tile is seen from, and their reciprocals are depths.
        let (near, far) = match self.height {
            Some(height) if ALONG => (splat(1.0) / (mz + rz + splat(height)), splat(f32::INFINITY)),
            _ => (mz - rz, mz + rz),
        };
        let outside = least.cmp_lt(zero) | far.cmp_lt(splat(self.front)) | splat(tile.farthest).cmp_lt(near);
        let mut met = !outside.bits() & ((1u32 << node.used.min(WIDTH as u32)) - 1);
        if let Some(room) = &self.room {
            // As far as the same differences tell: rounding keeps their order.
            let [x, y, z] = each(|a| hi[a].cmp_lt(splat(room.lo[a])) | splat(room.hi[a]).cmp_lt(lo[a]));
            met &= !(x | y | z).bits();
        }
        if met == 0 {
            return 0;
        }
        let families =
            [(left_low, left_high), (right_low, right_high), (below_low, below_high), (above_low, above_high)];
        let mut sides = Sides { low: [[0.0; WIDTH]; 4], step: [[0.0; WIDTH]; 4] };
        for (family, (low, high)) in families.into_iter().enumerate() {
            low.store(&mut sides.low[family]);
            (high - low).store(&mut sides.step[family]);
        }
        near.fast_max(zero).store(&mut level.near);
        let of_sets = self.spans.met::<N, ALONG>(&lo, &hi);
        let (mut rest, mut kept) = (met, 0);
        while rest != 0 {
            let child = slot(rest.trailing_zeros());
            rest &= rest - 1;
            let some = groups & groups_of(of_sets, child) & sides.groups_at::<N>(child, tile);
            level.met[child] = some;
            kept |= u32::from(some != 0) << child;
        }
        level.keys = upper_halves(near.fast_max(zero), kept);
        kept
    }
}

impl Sides {
    /// Groups of the first `N` sets whose rectangles meet the box of `child`.
    #[inline(always)]
    fn groups_at<const N: usize>(&self, child: usize, tile: &Groups) -> u64 {
        let low = |family: usize| V::splat(self.low[family][child]);
        let step = |family: usize| V::splat(self.step[family][child]);
        let (low, step) = ([low(0), low(1), low(2), low(3)], [step(0), step(1), step(2), step(3)]);
        let mut met = 0;
        for q in 0..N {
            let between = |family: usize, part: V| part.mul_add(step[family], low[family]);
            // The left planes lie at the groups' least s, the right planes at their greatest; so for t.
            let [[s0, s1], [t0, t1]] = &tile.part;
            let least =
                between(0, s0[q]).fast_min(between(1, s1[q])).fast_min(between(2, t0[q]).fast_min(between(3, t1[q])));
            met |= u64::from(!signs(least) & 0xffff) << (q * SET);
        }
        met
    }
}

impl Level {
    /// Groups of the first `N` sets that look as far as the box of `child`.
    #[inline(always)]
    fn within_reach<const N: usize>(&self, child: usize, tile: &Groups) -> u64 {
        // A little nearer, whatever rounds; those that want nothing any more have infinity, and zero times that is no number.
        let near = V::splat(self.near[child] * (1.0 - 4.0 * HALF_ULP));
        let one = V::constant(1.0);
        (0..N).fold(0, |met, q| met | u64::from((near * tile.least[q]).cmp_le(one).bits()) << (q * SET))
    }

    /// Groups of the first `N` sets that meet the box of `child`.
    #[inline(always)]
    pub fn groups_at<const N: usize>(&self, child: usize, tile: &Groups) -> u64 {
        self.met[child] & self.within_reach::<N>(child, tile)
    }

    /// Takes a child off the list.
    #[inline(always)]
    pub fn remove(&mut self, child: usize) {
        self.keys = without_key(&self.keys, child);
    }
}
