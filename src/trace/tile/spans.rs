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
    /// Per axis: infinite where nothing is said.
    beyond: [f32; 3],
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
    /// Those of the first `N` sets of a loaded tile. `frame` and `margin`: see [`super::node::Planes::of`].
    #[inline(always)]
    pub fn of<const N: usize>(groups: &Groups, frame: &Frame, margin: f32) -> Self {
        let axes = frame.axes.map(|axis| DVec3::from(axis.map(f64::from)));
        let to_space = DMat3::from_cols(axes[0], axes[1], axes[2]).transpose().inverse();
        let columns = [to_space.x_axis, to_space.y_axis, to_space.z_axis].map(|c| c.to_array().map(|x| x as f32));
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
        let mut spans = Self { backwards, margin, near, far, beyond: [0.0; 3] };
        let is_finite = columns.as_flattened().iter().all(|x| x.is_finite());
        for axis in (0..3).filter(|&axis| !(is_finite && (all(forwards, axis) || backwards[axis]))) {
            (spans.near[axis], spans.far[axis]) = ([0.0; SETS], [0.0; SETS]);
            spans.beyond[axis] = f32::INFINITY;
        }
        spans
    }

    /// Per axis, whether directions are negative; `None` if along some axis a part of them is.
    #[inline(always)]
    pub fn backwards(&self) -> Option<[bool; 3]> {
        self.beyond.iter().all(|beyond| *beyond == 0.0).then_some(self.backwards)
    }

    /// Which of a node's boxes, as seen from the apex, the `N` sets may meet.
    #[inline(always)]
    pub fn met<const N: usize>(&self, lo: &Lanes3<Children>, hi: &Lanes3<Children>) -> Met {
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
            let enter = |a: usize| near[a] * splat(self.near[a][q]);
            let leave = |a: usize| far[a].mul_add(splat(self.far[a][q]), splat(self.beyond[a]));
            let enter = enter(0).fast_max(enter(1)).fast_max(enter(2).fast_max(splat(0.0)));
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
