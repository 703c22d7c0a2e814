//! The oracle's own tree: median splits over boxes, built and walked without recursion.
//!
//! The median halves every range, so the depth is log2 of the number of items whatever their places are, also
//! when all centroids coincide or coordinates are near the ends of the number range.

use glam::DVec3;

use super::OracleRay;

/// Items in a leaf.
const LEAF: usize = 4;
/// Levels of the largest tree: 2^32 items halved, and the root.
const STACK: usize = 34;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub lo: DVec3,
    pub hi: DVec3,
}

impl Bounds {
    pub const EMPTY: Self = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY };
    pub const ALL: Self = Self { lo: DVec3::NEG_INFINITY, hi: DVec3::INFINITY };

    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { lo: b.lo.min(p), hi: b.hi.max(p) })
    }

    pub fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    pub fn is_finite(&self) -> bool {
        self.lo.is_finite() && self.hi.is_finite()
    }

    /// Largest absolute coordinate on each axis.
    pub fn magnitude(&self) -> DVec3 {
        self.lo.abs().max(self.hi.abs())
    }

    /// The eight corners.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { self.lo[axis] } else { self.hi[axis] };
            DVec3::new(pick(0), pick(1), pick(2))
        })
    }

    fn centre(&self) -> DVec3 {
        let c = self.lo * 0.5 + self.hi * 0.5;
        if c.is_finite() { c } else { DVec3::ZERO }
    }

    /// Where the segment enters the box grown by `pad` on all sides, if it does.
    pub fn entry(&self, ray: &OracleRay, t_max: f64, pad: f64) -> Option<f64> {
        let (mut near, mut far) = (ray.t_min, t_max);
        for axis in 0..3 {
            let (lo, hi) = (self.lo[axis] - pad, self.hi[axis] + pad);
            let (org, dir) = (ray.org[axis], ray.dir[axis]);
            if dir == 0.0 {
                if !(lo <= org && org <= hi) {
                    return None;
                }
                continue;
            }
            let (a, b) = ((lo - org) / dir, (hi - org) / dir);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near <= far).then_some(near)
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// Leaf: first entry of `order`. Inner node: first of two adjacent children.
    first: u32,
    /// Leaf: number of entries. Inner node: 0.
    count: u32,
}

/// A tree over numbered boxes.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl Tree {
    /// One leaf that holds `items`: walking it is brute force.
    pub fn flat(items: Vec<u32>) -> Self {
        let root = Node { bounds: Bounds::ALL, first: 0, count: items.len() as u32 };
        Self { nodes: if items.is_empty() { Vec::new() } else { vec![root] }, order: items }
    }

    /// Median splits over the box of each item.
    pub fn build(items: Vec<u32>, bounds_of: impl Fn(u32) -> Bounds) -> Self {
        let mut tree = Self::flat(items);
        if tree.nodes.is_empty() {
            return tree;
        }
        let mut open = vec![(0usize, 0usize..tree.order.len())];
        while let Some((node, range)) = open.pop() {
            let items = &mut tree.order[range.clone()];
            let bounds = items.iter().fold(Bounds::EMPTY, |b, &i| b.union(bounds_of(i)));
            if items.len() <= LEAF {
                tree.nodes[node] = Node { bounds, first: range.start as u32, count: items.len() as u32 };
                continue;
            }
            let centres = Bounds::of(items.iter().map(|&i| bounds_of(i).centre()));
            let axis = (centres.hi - centres.lo).max_position();
            let half = items.len() / 2;
            items.select_nth_unstable_by(half, |&i, &j| {
                bounds_of(i).centre()[axis].total_cmp(&bounds_of(j).centre()[axis])
            });
            let child = tree.nodes.len();
            tree.nodes[node] = Node { bounds, first: child as u32, count: 0 };
            tree.nodes.extend([Node { bounds, first: 0, count: 0 }; 2]);
            open.push((child, range.start..range.start + half));
            open.push((child + 1, range.start + half..range.end));
        }
        tree
    }

    /// Calls `item` for every item whose box, grown by `pad` of the node's box, meets the segment from `ray.t_min`
    /// to `t_max`. `item` returns the new end of the segment.
    pub fn visit(
        &self,
        ray: &OracleRay,
        mut t_max: f64,
        pad: impl Fn(&Bounds) -> f64,
        mut item: impl FnMut(u32, f64) -> f64,
    ) -> f64 {
        let enters = |i: u32, end: f64| {
            let node = &self.nodes[i as usize];
            node.bounds.entry(ray, end, pad(&node.bounds))
        };
        let mut stack = [(0u32, 0.0); STACK];
        let mut len = 0;
        if let Some(near) = (!self.nodes.is_empty()).then(|| enters(0, t_max)).flatten() {
            stack[0] = (0, near);
            len = 1;
        }
        while len > 0 {
            len -= 1;
            let (index, near) = stack[len];
            if near > t_max {
                continue;
            }
            let node = self.nodes[index as usize];
            for &i in &self.order[node.first as usize..][..node.count as usize] {
                t_max = item(i, t_max);
            }
            if node.count > 0 {
                continue;
            }
            let mut children = [node.first, node.first + 1].map(|c| enters(c, t_max).map(|near| (c, near)));
            if let [Some(a), Some(b)] = children
                && a.1 < b.1
            {
                children.swap(0, 1);
            }
            for child in children.into_iter().flatten() {
                stack[len] = child;
                len += 1;
            }
        }
        t_max
    }
}
