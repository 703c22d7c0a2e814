//! Rays of one direction: what parallel cameras see, and shadow rays to a sun.
//!
//! They have no point in common, but what a tile's arithmetic needs is only that a ray is two numbers and a triangle four linear
//! functions of these. Here the numbers are where a ray's line passes across the direction, (s, t) = (p.u, p.v), a corner is seen at
//! its own, whatever its depth, and edge functions over the area are the weights themselves. Where tiles of a common point have 1/z
//! there is the *height*: the distance along the direction from a plane behind all of the scene, so it is positive, greater for
//! what is nearer, and zero infinitely far away, as 1/z is. So listing, pairs and ends are the same.
//!
//! Rays that are asked for their nearest hit are seen from where they come from, and where they hit is told by the plane and the
//! start, as behind a mirror ([`Shared::Along`]). Those that are asked for any hit are seen from where they go, as those to a light
//! ([`Shared::Against`]): what is nearest there is what hides the sun.

use glam::DVec3;

use super::batch::{Batch, LEAST_PART, LEAST_VOLUME, Planes, steady};
use super::bundle::{Bundle, Shared, TAME, groups, largest, load3};
use super::columns::Segments;
use super::edges::{cross_accurate, minus, own_edges, sum};
use super::frame::{Frame, normalised, reach, sides};
use super::groups::{Group, Groups};
use super::lines::Lines;
use super::{GROUPS, HALF_ULP, Job, Mask, SET, SETS, V, select};
use crate::lanes::words::{greatest, least};
use crate::lanes::{LaneMask, Lanes, dot, each, map3};
use crate::math::Aabb;
use crate::ray::Rays;

/// Rays may start up to this many times the scene's size away from where they pass its middle: what their places across the direction
/// round to grows with that, the bound that answers keep does not.
pub const FAR: f32 = 16.0;

/// Rays must start at a coordinate of at least this part of the scene's size: heights, and places across the direction, are as fine
/// as what is as large as the scene, whereas the common formula is finer for rays that start near zero.
pub const NEAR: f32 = 1.0 / 16.0;

/// Heights start this far below the scene, in parts of its size.
const BELOW: f32 = 0.25;

/// What heights round to, in half ulps of the largest.
const ROUNDING: f32 = 32.0 * HALF_ULP;

/// A common direction, as a frame has it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Parallel {
    /// The direction of the rays as they are.
    pub dir: [f32; 3],
    /// The direction the tile looks in: theirs, or the opposite.
    pub view: [f32; 3],
    /// Height of the frame's origin.
    pub height: f32,
    /// What is added to a ray's height per unit of its parameter.
    slope: f32,
}

impl Parallel {
    /// Height of rays at parameter `t`, where it is `from` at zero.
    #[inline(always)]
    pub fn height_at(&self, from: V, t: V) -> V {
        t.mul_add(V::splat(self.slope), from).fast_max(V::constant(0.0))
    }

    /// Parameters `t` of hits at the heights `at`, of rays whose height is `from` at zero: a plane that is seen nearly edge-on says
    /// them badly, and where heights are moved into the triangle's own by much.
    #[inline(always)]
    pub fn between(&self, t: V, from: V, at: V) -> V {
        let per_height = V::splat(1.0 / self.slope);
        let by_height = (at - from) * per_height;
        let off = (from.abs() + V::splat(self.height)) * V::splat(ROUNDING) * per_height.abs();
        t.fast_max(by_height - off).fast_min(by_height + off)
    }

    /// The height that rays asked for any hit look down to: they start at `height`, and are `above` the frame's origin at zero.
    #[inline(always)]
    pub fn far(&self, above: V, height: V) -> V {
        let size = above.abs() + V::splat(self.height);
        V::constant(0.0).fast_max(size.mul_add(V::splat(-ROUNDING), height))
    }

    /// Of the `wanted` groups those with a ray that meets the box between two corners, as seen from the apex.
    #[inline(always)]
    pub fn met(&self, groups: &Groups, apex: [f32; 3], [lo, hi]: [[f32; 3]; 2], wanted: u64) -> u64 {
        let (zero, infinite) = (V::constant(0.0), V::splat(f32::INFINITY));
        // What does not move along an axis is between its planes always or never.
        let per_axis = self.dir.map(|x| if x == 0.0 { f32::MAX } else { (1.0 / x).clamp(-f32::MAX, f32::MAX) });
        let [near, far] =
            [[lo, hi], [hi, lo]].map(|[up, down]| each(|a| V::splat(if self.dir[a] < 0.0 { down[a] } else { up[a] })));
        let scale = V::splat(1.0 / groups.frame.scale);
        let (mut met, mut rest) = (0, wanted);
        while rest != 0 {
            let g = rest.trailing_zeros() as usize & (GROUPS - 1);
            rest &= rest - 1;
            let Group { start, inv_lo, .. } = &groups.of[g];
            // From the apex, too: far from the origin the boxes' margin would be rounded away.
            let start = each(|a| start[a] * scale - V::splat(apex[a]));
            let enter = each(|a| (near[a] - start[a]) * V::splat(per_axis[a]));
            let leave = each(|a| (far[a] - start[a]) * V::splat(per_axis[a]));
            let enter = enter[0].fast_max(enter[1]).fast_max(enter[2].fast_max(zero));
            let leave = leave[0].fast_min(leave[1]).fast_min(leave[2]);
            let mut lanes = enter.cmp_le(leave * V::splat(1.0 + 16.0 * HALF_ULP)) & inv_lo.cmp_lt(infinite);
            if groups.is_behind && groups.endless {
                let there = enter.mul_add(V::splat(self.slope), groups.behind[g]);
                let off = groups.behind[g].abs() + V::splat(self.height);
                lanes = lanes & inv_lo.cmp_le(off.mul_add(V::splat(ROUNDING), there));
            }
            met |= u64::from(lanes.any()) << g;
        }
        met
    }

    /// A group's rays in the frame; see [`Lines::of`].
    #[inline(always)]
    pub fn lines(&self, frame: &Frame, bundle: &Bundle, segments: &Segments, tame: u32) -> Lines {
        let zero = V::constant(0.0);
        let Segments { org, dir, t_min, .. } = *segments;
        let way = each(|a| org[a] - V::splat(bundle.apex[a]));
        let [s, t, above] = frame.coordinates(way);
        let from = above + V::splat(self.height);
        let t_min = t_min + zero;
        let start = each(|a| t_min.mul_add(dir[a], org[a]));
        let far = match bundle.shared {
            Shared::Against => self.far(above, self.height_at(from, t_min)),
            _ => zero,
        };
        let whole = zero.cmp_eq(t_min).bits() & tame == tame;
        let near = V::splat(f32::INFINITY);
        Lines {
            s,
            t,
            slowness: V::constant(1.0),
            far,
            near,
            fit: V::ALL,
            reach: largest(way),
            behind: from,
            start,
            whole,
        }
    }
}

impl Frame {
    /// The frame of rays of one direction. `picture`: see [`sides`].
    pub fn parallel(
        bundle: &Bundle,
        rays: &Rays<f32>,
        bounds: &Aabb<f32>,
        (scale, extent): (f32, f32),
        [across, along]: [[f64; 3]; 2],
    ) -> Option<Self> {
        let apex = bundle.apex;
        let leader = (0..bundle.len).find(|&g| bundle.tame[g] != 0)?;
        let dir = rays.dir(bundle.first + leader * V::N + bundle.tame[leader].trailing_zeros() as usize);
        let sign = if bundle.shared == Shared::Along { 1.0f32 } else { -1.0 };
        let view = dir.map(|x| x * sign);
        let a = normalised(view.map(f64::from))?;
        let [u, v] = sides(a, across, along)?;
        let axes = [u, v, a.map(|x| -x)].map(|axis| axis.map(|x| x as f32 * scale));
        let size: [f32; 3] = each(|i| (bounds.lo[i] - apex[i]).abs().max((bounds.hi[i] - apex[i]).abs()));
        let height = (1.0 + BELOW) * (0..3).map(|i| axes[2][i].abs() * size[i]).sum::<f32>();
        let slope = dot(axes[2].map(f64::from), dir.map(f64::from)) as f32;
        let is_usable = height > 0.0 && slope.is_normal();
        is_usable.then_some(Self { apex, axes, scale, extent, parallel: Some(Parallel { dir, view, height, slope }) })
    }
}

impl<'a> Bundle<'a> {
    /// Whether the tame rays of the only group have one direction.
    pub fn is_of_one_direction(&self, rays: &Rays<f32>) -> bool {
        let lanes = self.tame[0];
        if lanes & lanes.wrapping_sub(1) == 0 {
            return false;
        }
        let dir = rays.dir(self.first + lanes.trailing_zeros() as usize);
        lanes & !same(rays, self.first, dir) == 0
    }

    /// The `N` sets of rays that start with ray `first`, if they are full and a few of them have one direction: that all have it is
    /// presumed. `any`: they are asked for any hit.
    pub fn presumed_parallel<const N: usize>(
        rays: &'a Rays<f32>,
        first: usize,
        bounds: &Aabb<f32>,
        any: bool,
    ) -> Option<Self> {
        let mut bundle = Self::unsorted(rays, first, groups::<N>(rays, first));
        if bundle.len < N * SET || rays.t_min[first] != 0.0 || rays.t_max[first] != f32::INFINITY {
            return None;
        }
        let dir = rays.dir(first);
        let sample = || (0..N * SET).step_by(N).map(|g| first + g * V::N);
        if !sample().all(|ray| rays.is_live(ray) && rays.dir(ray) == dir) || !dir.iter().all(|x| x.abs() <= TAME.1) {
            return None;
        }
        bundle.set_middle(sample().map(|ray| rays.org(ray)), dir, bounds)?;
        bundle.shared = if any { Shared::Against } else { Shared::Along };
        (bundle.presumed, bundle.tame) = (true, [0; GROUPS]);
        bundle.tame[..N * SET].fill(V::ALL);
        Some(bundle)
    }

    /// Sets the apex: where rays in the direction `dir` from `starts` pass the middle of the scene.
    fn set_middle(&mut self, starts: impl Iterator<Item = [f32; 3]>, dir: [f32; 3], bounds: &Aabb<f32>) -> Option<()> {
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for start in starts {
            (sum, count) = (sum + DVec3::from(start.map(f64::from)), count + 1.0);
        }
        let (start, dir) = (sum / count, DVec3::from(dir.map(f64::from)));
        let middle = DVec3::from(each(|a| 0.5 * (f64::from(bounds.lo[a]) + f64::from(bounds.hi[a]))));
        let apex = start + dir * ((middle - start).dot(dir) / dir.length_squared());
        self.apex = apex.to_array().map(|x| x as f32);
        apex.is_finite().then_some(())
    }

    /// The `N` sets of rays that start with ray `first`, if all that are live have one direction and leave the scene within `bounds`
    /// before they end. `any`: they are asked for any hit.
    pub fn parallel<const N: usize>(rays: &'a Rays<f32>, first: usize, bounds: &Aabb<f32>, any: bool) -> Option<Self> {
        let mut bundle = Self::unsorted(rays, first, groups::<N>(rays, first));
        bundle.sort_lanes(rays);
        let mut live = (0..bundle.len).filter(|&g| bundle.tame[g] != 0);
        let leader = live.next()?;
        let ray = |g: usize| first + g * V::N + bundle.tame[g].trailing_zeros() as usize;
        let dir = rays.dir(ray(leader));
        let wide = dir.map(f64::from);
        let square = dot(wide, wide);
        let corner =
            |towards: bool| each(|a| f64::from(if (dir[a] > 0.0) == towards { bounds.hi[a] } else { bounds.lo[a] }));
        // Past this no ray meets anything.
        let exit = dot(corner(true), wide);
        let size: f64 = (0..3).map(|a| wide[a].abs() * f64::from(bounds.lo[a].abs().max(bounds.hi[a].abs()))).sum();
        let exit = V::splat((exit + 1e-5 * size) as f32);
        let starts: Vec<_> = std::iter::once(leader).chain(live.step_by(4)).map(|g| rays.org(ray(g))).collect();
        bundle.set_middle(starts.into_iter(), dir, bounds)?;
        bundle.shared = if any { Shared::Against } else { Shared::Along };
        let (mut fits, mut farthest, mut nearest) = (true, V::constant(0.0), V::splat(f32::INFINITY));
        for g in (0..bundle.len).filter(|&g| bundle.tame[g] | bundle.odd[g] != 0) {
            let at = first + g * V::N;
            let (org, t_max) = (load3(&rays.org, at), V::load(&rays.t_max[at..]));
            let lanes = bundle.tame[g];
            let end = t_max.mul_add(V::splat(square as f32), dot(org, dir.map(V::splat)));
            fits &= bundle.odd[g] == 0 && lanes & !(same(rays, at, dir) & exit.cmp_le(end).bits()) == 0;
            let way = largest(each(|a| org[a] - V::splat(bundle.apex[a])));
            let tame = Mask::from_bits(lanes);
            farthest = select(tame, way.fast_max(farthest), farthest);
            nearest = select(tame, largest(org).fast_min(nearest), nearest);
        }
        let (farthest, extent) = (greatest(farthest), reach(bounds, bundle.apex));
        bundle.slack = 8.0 * HALF_ULP * farthest;
        (fits && farthest <= FAR * extent && NEAR * extent <= least(nearest)).then_some(bundle)
    }
}

/// Lanes of a group whose direction is `dir`.
#[inline(always)]
fn same(rays: &Rays<f32>, at: usize, dir: [f32; 3]) -> u32 {
    let lanes = load3(&rays.dir, at);
    let [x, y, z] = each(|a| lanes[a].cmp_eq(V::splat(dir[a])));
    (x & y & z).bits()
}

impl Job<'_> {
    /// Traces a block of rays of one direction; false if it is none, or not for tiles.
    #[inline(never)]
    pub fn parallel<const ANY: bool, const COUNT: bool>(&mut self, first: usize) -> bool {
        if self.most != GROUPS || !self.world.is_single_object() {
            return false;
        }
        let bounds = self.world.tree_bounds();
        if let Some(mut bundle) = Bundle::presumed_parallel::<SETS>(self.rays, first, bounds, ANY)
            && self.tile::<SETS, ANY, false, COUNT>(&mut bundle, u64::MAX)
        {
            return true;
        }
        let Some(mut bundle) = Bundle::parallel::<SETS>(self.rays, first, bounds, ANY) else {
            return false;
        };
        let all = u64::MAX >> (GROUPS - bundle.len);
        if all >> SET == 0 {
            return self.tile::<1, ANY, false, COUNT>(&mut bundle, all);
        }
        self.tile::<SETS, ANY, false, COUNT>(&mut bundle, all)
    }
}

impl Batch {
    /// Set-up for rays of one direction.
    #[inline(never)]
    pub fn set_up_parallel<const ANY: bool>(&self, parallel: &Parallel, groups: &Groups, planes: &mut Planes) -> u32 {
        let one = V::constant(1.0);
        let p = self.seen(groups, false);
        let normal = cross_accurate(minus(p[1], p[0]), minus(p[2], p[0]));
        let reached = self.set_up_side(groups, planes, Some(parallel));
        let seen = map3(p, |q| [q[0], q[1], one]);
        let [a, b, c] = map3(p, |q| q[2] + V::splat(parallel.height));
        let area = normal[2];
        let rcp = one / area;
        let (edges, eps) = own_edges(groups, &seen, &[one; 3]);
        let edges = map3(edges, |e| map3(e, |x| x * rcp));
        let size = area.abs();
        let eps = map3(eps, |e| e * rcp.abs());
        let (nearest, farthest) = (a.fast_max(b).fast_max(c), a.fast_min(b).fast_min(c));
        nearest.store(&mut planes.nearest);
        farthest.store(&mut planes.farthest);

        let all = self.lanes();
        let tells = V::splat(LEAST_VOLUME).cmp_le(size) & (sum(normal) * V::splat(LEAST_PART)).cmp_lt(size);
        planes.wild = all & !tells.bits();
        planes.edge_on = 0;
        let is_steady = if ANY { u32::MAX } else { steady(groups, &seen, (&edges, &eps), one).bits() };
        planes.unsteady = all & !is_steady;
        let eps = eps[0].fast_max(eps[1]).fast_max(eps[2]);
        (-eps).store(&mut planes.outside);
        eps.store(&mut planes.inside);
        let [x, y] = [normal[0] * -rcp, normal[1] * -rcp];
        let height = [x, y, (-x).mul_add(p[0][0], (-y).mul_add(p[0][1], a))];
        let within = |k: V| nearest.fast_min(farthest.fast_max(k));
        let [e0, e1, e2] = edges;
        planes.store(groups, &[e0, e1, e2, height], eps, within) & all & reached | planes.wild
    }
}
