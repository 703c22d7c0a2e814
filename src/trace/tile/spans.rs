//! Boxes against the directions of a tile's sets: between which depths a set can be within a box along each axis of space.
//!
//! The planes of a tile's edges ([`super::node::Planes`]) do not tell a box apart that lies beside a corner, or whose own edges do:
//! a box seen over a corner, a long one seen askew. What a box and a tile's rays have in common is the interval of depths between
//! its planes, as in the test of a single ray, with the smallest and largest components of a set's directions instead of a ray's
//! own. Source of the idea: Wald, Boulos, Shirley, "Ray tracing deformable scenes using dynamic bounding volume hierarchies", 2007
//! (interval arithmetic over packets).

use glam::{DMat3, DVec3};

use super::frame::Frame;
use super::groups::Groups;
use super::{HALF_ULP, SET, SETS, V, select};
use crate::lanes::{LaneMask, Lanes, Lanes3, Real, each};

/// A vector of a node's children.
type Children = <f32 as Real>::Children;

/// Of components of directions, relative to the products they are made of.
const ROUNDING: f32 = 32.0 * HALF_ULP;

/// Which children of a node the sets meet: bit `SET` * set + child.
pub type Met = u64;

/// The directions of a tile's sets, per unit of depth.
#[derive(Clone, Copy, Debug)]
pub struct Spans {
    /// Per axis: directions are negative. Of an axis along which some are and some are not nothing is said.
    backwards: [bool; 3],
    /// How far outside of a box its contents may be met, away from where the directions go.
    margin: [f32; 3],
    /// By axis and set: depth per unit of the near plane's distance, and the far plane's.
    near: [[f32; SETS]; 4],
    far: [[f32; SETS]; 4],
    /// What is added to either: of rays of one direction where they are, else nothing; infinite where nothing is said.
    before: [[f32; SETS]; 3],
    beyond: [[f32; SETS]; 3],
}

/// Depth per unit of the near plane's distance and the far plane's, for components of directions over some rectangles; and which of
/// them are all positive, or all negative, as bits.
#[derive(Clone, Copy, Debug)]
struct Ends {
    near: V,
    far: V,
    forwards: u32,
    backwards: u32,
}

impl Ends {
    /// Of components `u * s + v * t + a`.
    #[inline(always)]
    fn of([u, v, a]: [V; 3], [[s0, s1], [t0, t1]]: [[V; 2]; 2], wide: f32) -> Self {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let (left, below) = (u.cmp_lt(zero), v.cmp_lt(zero));
        let least = u.mul_add(select(left, s1, s0), v.mul_add(select(below, t1, t0), a));
        let most = u.mul_add(select(left, s0, s1), v.mul_add(select(below, t0, t1), a));
        let size = V::splat(ROUNDING) * V::splat(wide).mul_add(u.abs() + v.abs(), a.abs());
        let (least, most) = (least - size, most + size);
        let (forwards, is_back) = (zero.cmp_lt(least).bits(), most.cmp_lt(zero));
        let (by_least, by_most) = (one / least, one / most);
        Self {
            near: select(is_back, by_least, by_most) * V::splat(1.0 - ROUNDING),
            far: select(is_back, by_most, by_least) * V::splat(1.0 + ROUNDING),
            forwards,
            backwards: is_back.bits(),
        }
    }
}

impl Spans {
    /// Those of rays of one direction, which have another place each: a point at (s, t) is, at the depth z away from where the tile is
    /// seen, `columns` times s, t and -z from the apex.
    #[inline(never)]
    fn of_direction<const N: usize>(groups: &Groups, frame: &Frame, columns: [[f32; 3]; 3], margin: f32) -> Self {
        let [u, v, a] = columns;
        let sum = |n: [f32; 3]| n[0].abs() + n[1].abs() + n[2].abs();
        let rounding = frame.axes.map(|n| 2.0 * margin * sum(n) + 2.0 * groups.slack);
        let mut spans = Self {
            backwards: each(|x| a[x] > 0.0),
            margin: each(|x| (0..3).map(|k| columns[k][x].abs() * rounding[k]).sum::<f32>() + ROUNDING * frame.extent),
            near: [[0.0; SETS]; 4],
            far: [[0.0; SETS]; 4],
            before: [[f32::NEG_INFINITY; SETS]; 3],
            beyond: [[f32::INFINITY; SETS]; 3],
        };
        let ends: [[[f32; SETS]; 2]; 2] = groups.of_sets.map(|sides| {
            sides.map(|side| {
                let side = side.to_array();
                std::array::from_fn(|q| side[q])
            })
        });
        for axis in 0..3 {
            let per_depth = -1.0 / a[axis];
            // What lies across the direction but for this says nothing that the edges' planes do not.
            if per_depth.is_nan() || per_depth.abs() > 1e4 * frame.scale {
                continue;
            }
            for q in 0..N {
                let [[s0, s1], [t0, t1]] = ends.map(|sides| sides.map(|side| side[q]));
                let along =
                    |x: f32, [low, high]: [f32; 2]| if x < 0.0 { [x * high, x * low] } else { [x * low, x * high] };
                let (of_s, of_t) = (along(u[axis], [s0, s1]), along(v[axis], [t0, t1]));
                let size = ROUNDING * groups.wide * (u[axis].abs() + v[axis].abs());
                let (least, most) = (of_s[0] + of_t[0] - size, of_s[1] + of_t[1] + size);
                // The nearer plane is the high one where directions are negative.
                let (at_near, at_far) = if spans.backwards[axis] { (least, most) } else { (most, least) };
                (spans.near[axis][q], spans.far[axis][q]) = (per_depth, per_depth);
                (spans.before[axis][q], spans.beyond[axis][q]) = (-at_near * per_depth, -at_far * per_depth);
            }
        }
        spans
    }

    /// Those of the first `N` sets of a loaded tile. `frame` and `margin`: see [`super::node::Planes::of`].
    #[inline(always)]
    pub fn of<const N: usize>(groups: &Groups, frame: &Frame, margin: f32) -> Self {
        let axes = frame.axes.map(|axis| DVec3::from(axis.map(f64::from)));
        let to_space = DMat3::from_cols(axes[0], axes[1], axes[2]).transpose().inverse();
        let columns = [to_space.x_axis, to_space.y_axis, to_space.z_axis].map(|c| c.to_array().map(|x| x as f32));
        if frame.parallel.is_some() {
            return Self::of_direction::<N>(groups, frame, columns, margin);
        }
        // Lane 4 * axis + set.
        let lanes = |x: [f32; 3]| V::new(std::array::from_fn(|i| if i / SETS < 3 { x[i / SETS] } else { 0.0 }));
        let Ends { near, far, forwards, backwards } = Ends::of(columns.map(lanes), groups.of_sets, groups.wide);
        let sets = (1u32 << N) - 1;
        let all = |bits: u32, axis: usize| bits >> (SETS * axis) & sets == sets;
        let sum = |n: [f32; 3]| n[0].abs() + n[1].abs() + n[2].abs();
        // What rounds in the frame, taken into space.
        let slack = 2.0 * groups.slack * (1.0 + groups.wide);
        let rounding = frame.axes.map(|n| margin * (sum(n) + groups.wide * sum(frame.axes[2])) + slack);
        let margin = each(|x| (0..3).map(|k| columns[k][x].abs() * rounding[k]).sum::<f32>());
        let (near, far) = (bytemuck::cast(near.to_array()), bytemuck::cast(far.to_array()));
        let backwards: [bool; 3] = each(|axis| all(backwards, axis));
        let mut spans = Self { backwards, margin, near, far, before: [[0.0; SETS]; 3], beyond: [[0.0; SETS]; 3] };
        let is_finite = columns.as_flattened().iter().all(|x| x.is_finite());
        for axis in (0..3).filter(|&axis| !(is_finite && (all(forwards, axis) || backwards[axis]))) {
            (spans.near[axis], spans.far[axis]) = ([0.0; SETS], [0.0; SETS]);
            spans.beyond[axis] = [f32::INFINITY; SETS];
        }
        spans
    }

    /// Per axis, whether directions are negative; `None` if along some axis a part of them is.
    #[inline(always)]
    pub fn backwards(&self) -> Option<[bool; 3]> {
        self.beyond.iter().all(|beyond| *beyond == [0.0; SETS]).then_some(self.backwards)
    }

    /// Which of a node's boxes, as seen from the apex, the `N` sets may meet. `ALONG`: of rays of one direction.
    #[inline(always)]
    pub fn met<const N: usize, const ALONG: bool>(&self, lo: &Lanes3<Children>, hi: &Lanes3<Children>) -> Met {
        let splat = <Children as Lanes>::splat;
        let near: Lanes3<Children> = each(|a| {
            let (plane, margin) = if self.backwards[a] { (hi[a], self.margin[a]) } else { (lo[a], -self.margin[a]) };
            plane + splat(margin)
        });
        let far: Lanes3<Children> = each(|a| {
            let (plane, margin) = if self.backwards[a] { (lo[a], -self.margin[a]) } else { (hi[a], self.margin[a]) };
            plane + splat(margin)
        });
        let mut met = 0;
        for q in 0..N {
            let enter = |a: usize| match ALONG {
                true => near[a].mul_add(splat(self.near[a][q]), splat(self.before[a][q])),
                false => near[a] * splat(self.near[a][q]),
            };
            let leave = |a: usize| {
                let beyond = if ALONG { self.beyond[a][q] } else { self.beyond[a][0] };
                far[a].mul_add(splat(self.far[a][q]), splat(beyond))
            };
            let first = if ALONG { f32::NEG_INFINITY } else { 0.0 };
            let enter = enter(0).fast_max(enter(1)).fast_max(enter(2).fast_max(splat(first)));
            let leave = leave(0).fast_min(leave(1)).fast_min(leave(2));
            met |= u64::from(!leave.cmp_lt(enter).bits() & 0xffff) << (SET * q);
        }
        met
    }
}

/// The sets that meet `child`, as groups.
#[inline(always)]
pub fn groups_of(met: Met, child: usize) -> u64 {
    const FIRST: u64 = 0x0001_0001_0001_0001;
    (met >> child & FIRST) * 0xffff
}

#[cfg(test)]
mod tests {
    use super::super::parallel::Parallel;
    use super::*;

    #[test]
    fn what_a_ray_meets_is_met_by_its_set() {
        let mut state = 7u64;
        let mut number = |size: f32| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            size * ((state >> 40) as f32 / 16_777_216.0 - 0.5)
        };
        let (mut met_boxes, mut missed, mut mixed) = (0, [0; 2], 0);
        for round in 0..400 {
            let axes = each(|_| each(|_| number(2.0)));
            let rows = axes.map(|axis| DVec3::from(axis.map(f64::from)));
            let matrix = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
            // Axes that hardly differ have large components of directions, which is another matter.
            if matrix.determinant().abs() < 0.05 {
                continue;
            }
            let parallel = (round % 3 == 0).then_some(Parallel::default());
            let frame = Frame { apex: [0.0; 3], axes, scale: 1.0, extent: 4.0, parallel };
            let mut groups = Box::<Groups>::default();
            let sets: [[[f32; 2]; 2]; SETS] = std::array::from_fn(|_| {
                [0, 1].map(|_| {
                    let (low, size) = (number(0.4), if round % 2 == 0 { 0.05 } else { 0.5 });
                    [low, low + size * (0.5 + number(1.0))]
                })
            });
            let side = |axis: usize, end: usize| V::new(std::array::from_fn(|i| sets[i % SETS][axis][end]));
            groups.of_sets = [0, 1].map(|axis| [side(axis, 0), side(axis, 1)]);
            groups.wide = sets.as_flattened().as_flattened().iter().fold(0.0, |wide, x| x.abs().max(wide));
            let spans = Spans::of::<SETS>(&groups, &frame, 1e-6);
            mixed += usize::from(spans.backwards().is_none() && parallel.is_none());
            let boxes: [[[f32; 3]; 2]; Children::N] = std::array::from_fn(|_| {
                let centre: [f32; 3] = each(|_| number(4.0));
                let half: [f32; 3] = each(|_| number(1.0).abs());
                [each(|a| centre[a] - half[a]), each(|a| centre[a] + half[a])]
            });
            let planes = |end: usize| {
                each(|a| Children::load(&std::array::from_fn::<_, 16, _>(|k| boxes[k % boxes.len()][end][a])))
            };
            let (lo, hi) = (planes(0), planes(1));
            let met = match parallel {
                Some(_) => spans.met::<SETS, true>(&lo, &hi),
                None => spans.met::<SETS, false>(&lo, &hi),
            };
            for (child, [lo, hi]) in boxes.iter().enumerate() {
                for (q, set) in sets.iter().enumerate() {
                    let said = groups_of(met, child) >> (SET * q) & 0xffff;
                    assert!(said == 0 || said == 0xffff);
                    let is_met = (0..200).any(|_| {
                        // Of rays of one direction a place, and where they go; else the way from the apex.
                        let [s, t] = [0, 1].map(|axis| {
                            let [low, high] = set[axis];
                            f64::from(low + (high - low) * (0.5 + number(1.0)))
                        });
                        let (from, way, first) = match parallel {
                            Some(_) => (DVec3::new(s, t, 0.0), DVec3::NEG_Z, f64::NEG_INFINITY),
                            None => (DVec3::ZERO, DVec3::new(s, t, 1.0), 0.0),
                        };
                        let (from, way) = (matrix.inverse() * from, matrix.inverse() * way);
                        let ends = |a: usize| {
                            let [x, y] = [lo[a], hi[a]].map(|plane| (f64::from(plane) - from[a]) / way[a]);
                            [x.min(y), x.max(y)]
                        };
                        let enter = (0..3).fold(first, |enter, a| ends(a)[0].max(enter));
                        (0..3).all(|a| ends(a)[1] >= enter)
                    });
                    met_boxes += usize::from(is_met);
                    missed[usize::from(parallel.is_some())] += usize::from(said == 0);
                    assert!(!is_met || said != 0, "round {round}, child {child}, set {q}");
                }
            }
        }
        let (few, many) = (25 * Children::N, 600 * Children::N);
        assert!(met_boxes > few && mixed > 60, "{met_boxes} {mixed}");
        assert!(missed[0] > many / 2 && missed[1] > many / 4, "{missed:?}");
    }

    #[test]
    fn of_flat_frames_nothing_is_said() {
        let axes = [[1.0, 0.0, 0.0]; 3];
        let frame = Frame { apex: [0.0; 3], axes, scale: 1.0, extent: 1.0, parallel: None };
        let spans = Spans::of::<SETS>(&Box::<Groups>::default(), &frame, 0.0);
        assert_eq!(spans.backwards(), None);
        let zero = each(|_| <Children as Lanes>::splat(-1.0));
        let children = (1u64 << Children::N) - 1;
        assert_eq!(spans.met::<1, false>(&zero, &zero) & children, children);
    }
}
