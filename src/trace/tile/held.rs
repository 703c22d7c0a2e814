//! Set-up triangles against groups, in registers: most of what a tile does. Where many triangles meet few groups a group stays there
//! ([`Held`]), where few meet many a triangle does ([`Plane`]).

use super::batch::Planes;
use super::groups::{Group, Groups, NO_SLOT};
use super::own::Id;
use super::{Mask, V, select};
use crate::lanes::ahead::AHEAD;
use crate::lanes::{LaneMask, Lanes, Lanes3, dot, each};

/// A group's rays and how far they look.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    s: V,
    t: V,
    /// See [`Group::inv_lo`].
    pub best: V,
    /// See [`Group::inv_hi`].
    front: V,
    start: Lanes3<V>,
}

impl Line {
    /// Group `g`.
    #[inline(always)]
    pub fn of(groups: &Groups, g: usize) -> Self {
        let Group { s, t, inv_lo, inv_hi, start, .. } = groups.of[g];
        Self { s, t, best: inv_lo, front: inv_hi, start }
    }

    #[inline(always)]
    fn at(&self, [x, y, z]: Lanes3<V>) -> V {
        x.mul_add(self.s, y.mul_add(self.t, z))
    }
}

/// `best`, or in some lanes what they found if that is greater. Nothing is negative.
#[inline(always)]
fn raised(best: V, lanes: Mask, found: V) -> V {
    // Where a comparison is a register of its own one operation does it; else clearing costs less than choosing.
    match cfg!(target_feature = "avx512f") {
        true => select(lanes, found.fast_max(best), best),
        false => found.kept(lanes).fast_max(best),
    }
}

/// A triangle's edges against some rays.
pub struct Edges {
    /// Lanes not surely outside.
    pub possible: Mask,
    /// Lanes surely inside: possible, too.
    pub certain: Mask,
    /// Weights of the second and third corner, times 1/z.
    pub weights: [V; 2],
}

/// What a triangle and a group came to.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Lanes that hit the triangle.
    hit: Mask,
    /// Lanes that may: those that are no hits pass an edge within its rounding, or their best hit is as near.
    pub possible: Mask,
    /// New [`Line::best`].
    best: V,
    weights: [V; 2],
    ahead: V,
}

impl Met {
    /// Whether some ray hit the triangle.
    #[inline(always)]
    pub fn hit(&self) -> bool {
        self.hit.any()
    }

    /// Lanes that may have hit it and did not: for [`super::own::pair_doubtful`].
    #[inline(always)]
    pub fn doubt(&self) -> Mask {
        self.possible & !self.hit
    }

    /// A number, as bits of `old` where nothing was hit. Numbers are moved as floats: selection copies bits.
    #[inline(always)]
    fn name(&self, new: u32, old: V) -> V {
        select(self.hit, V::splat(f32::from_bits(new)), old)
    }
}

/// Linear functions of a triangle at some rays.
#[derive(Clone, Copy, Debug)]
pub struct Values {
    /// Edge functions.
    edges: [V; 3],
    /// 1/z in its plane.
    inverse: V,
    /// See [`Plane::behind`].
    behind: V,
}

/// A set-up triangle, each number in all lanes; those that are not asked for are not read. See [`Planes`].
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    linear: [Lanes3<V>; 4],
    outside: V,
    inside: V,
    nearest: V,
    farthest: V,
    corner: Lanes3<V>,
    normal: Lanes3<V>,
    rcp: V,
}

impl Plane {
    /// Triangle `i`.
    #[inline(always)]
    pub fn of(planes: &Planes, i: usize) -> Self {
        let linear = |k: usize| each(|x| V::splat(planes.linear[k][x][i]));
        Self {
            linear: [linear(0), linear(1), linear(2), linear(3)],
            outside: V::splat(planes.outside[i]),
            inside: V::splat(planes.inside[i]),
            nearest: V::splat(planes.nearest[i]),
            farthest: V::splat(planes.farthest[i]),
            corner: each(|a| V::splat(planes.side[a][i])),
            normal: each(|a| V::splat(planes.side[a + 3][i])),
            rcp: V::splat(planes.rcp[i]),
        }
    }

    /// 1/z where the triangle's plane says `inverse`: not nearer and not farther than its corners.
    #[inline(always)]
    pub fn within(&self, inverse: V) -> V {
        self.nearest.fast_min(self.farthest.fast_max(inverse))
    }

    /// 1/z where some rays meet it.
    #[inline(always)]
    pub fn depth(&self, line: &Line) -> V {
        self.within(line.at(self.linear[3]))
    }

    /// Its edge functions at some rays.
    #[inline(always)]
    fn edges_at(&self, line: &Line) -> [V; 3] {
        [line.at(self.linear[0]), line.at(self.linear[1]), line.at(self.linear[2])]
    }

    /// Its edges against some rays.
    #[inline(always)]
    pub fn edges(&self, line: &Line) -> Edges {
        self.edges_of(self.edges_at(line))
    }

    #[inline(always)]
    fn edges_of(&self, [e0, e1, e2]: [V; 3]) -> Edges {
        let least = e0.fast_min(e1).fast_min(e2);
        Edges { possible: self.outside.cmp_le(least), certain: self.inside.cmp_le(least), weights: [e1, e2] }
    }

    /// What [`Self::meet`] asks of some rays, whatever they found.
    #[inline(always)]
    pub fn values<const ANY: bool, const BEHIND: bool, const END: bool>(&self, line: &Line) -> Values {
        let (zero, from_end) = (V::constant(0.0), ANY && END);
        Values {
            edges: self.edges_at(line),
            inverse: if from_end { zero } else { line.at(self.linear[3]) },
            behind: if from_end || BEHIND { self.behind(line) } else { zero },
        }
    }

    /// 1/z in its plane. Where there are no registers to keep it in it is asked for once edges are decided on.
    #[inline(always)]
    fn inverse(&self, line: &Line, values: &Values) -> V {
        if AHEAD { values.inverse } else { line.at(self.linear[3]) }
    }

    /// How far segments begin behind its plane as seen from their common point; in some unit.
    #[inline(always)]
    pub fn behind(&self, line: &Line) -> V {
        dot(self.normal, each(|a| line.start[a] - self.corner[a]))
    }

    /// Which part of the way from a common point behind the rays is ahead of their starts, `ahead` of the plane.
    #[inline(always)]
    pub fn share(&self, ahead: V) -> V {
        ahead * self.rcp
    }

    /// Tests some rays, at which its functions are `values`. `EARLY`: some segment ends before the common point.
    ///
    /// With a common end (`END`, any-hit) rays start on surfaces, a few roundings in front of them. Depths from the far end
    /// cannot tell which side of its own surface a ray starts on; where the start lies with respect to the triangle's plane
    /// can. So it does where the common point is `BEHIND` the rays, and there it tells how far ahead they hit, too.
    #[inline(always)]
    pub fn meet<const ANY: bool, const BEHIND: bool, const END: bool, const EARLY: bool>(
        &self,
        line: &Line,
        values: &Values,
    ) -> Met {
        let (zero, infinite) = (V::constant(0.0), V::splat(f32::INFINITY));
        let Edges { mut possible, mut certain, weights } = self.edges_of(values.edges);
        let mut ahead = zero;
        // What is certain is possible, too, so one maximum is all that the next triangle waits for.
        if ANY && END {
            let is_ahead = zero.cmp_le(values.behind);
            (possible, certain) = (possible & is_ahead, certain & is_ahead);
            if EARLY {
                let is_ahead = self.depth(line).cmp_le(line.front);
                (possible, certain) = (possible & is_ahead, certain & is_ahead);
            }
            let waiting = line.best.cmp_lt(infinite);
            let best = raised(line.best, certain, infinite);
            return Met { hit: certain & waiting, possible: possible & waiting, best, weights, ahead };
        }
        let inverse = self.within(self.inverse(line, values));
        if BEHIND {
            ahead = -values.behind;
            let is_ahead = zero.cmp_le(ahead);
            (possible, certain) = (possible & is_ahead, certain & is_ahead);
        } else if EARLY {
            let is_ahead = inverse.cmp_le(line.front);
            (possible, certain) = (possible & is_ahead, certain & is_ahead);
        }
        possible = line.best.cmp_le_in(inverse, possible);
        if ANY {
            let hit = certain & possible;
            let best = raised(line.best, hit, infinite);
            return Met { hit, possible, best, weights, ahead };
        }
        let hit = line.best.cmp_lt_in(inverse, certain);
        let best = raised(line.best, certain, inverse);
        Met { hit, possible, best, weights, ahead }
    }
}

/// A group and what it found, while triangles are tested against it.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// Its rays.
    pub line: Line,
    weights: [V; 2],
    /// See [`Groups::ahead`].
    ahead: V,
    // As floats: see [`Met::name`].
    prim: V,
    inst: V,
}

impl Held {
    /// Loads a group.
    #[inline(always)]
    pub fn of<const MANY: bool>(groups: &Groups, g: usize) -> Self {
        let Group { slot, weights, .. } = groups.of[g];
        let inst = if MANY { groups.inst[g] } else { [NO_SLOT; 16] };
        let (prim, inst) = (V::new(bytemuck::cast(slot)), V::new(bytemuck::cast(inst)));
        Self { line: Line::of(groups, g), weights, ahead: groups.ahead[g], prim, inst }
    }

    /// Takes what it found in one triangle. `MANY`: it is of an instance.
    #[inline(always)]
    pub fn take<const ANY: bool, const MANY: bool, const BEHIND: bool>(&mut self, plane: &Plane, met: &Met, id: Id) {
        let hit = met.hit;
        self.line.best = met.best;
        if ANY {
            return;
        }
        self.prim = met.name(id.prim, self.prim);
        if MANY {
            self.inst = met.name(id.inst, self.inst);
        }
        if BEHIND {
            self.ahead = select(hit, plane.share(met.ahead), self.ahead);
        }
        self.weights[0] = select(hit, met.weights[0], self.weights[0]);
        self.weights[1] = select(hit, met.weights[1], self.weights[1]);
    }

    /// Stores what was found.
    #[inline(always)]
    pub fn put<const ANY: bool, const MANY: bool, const BEHIND: bool>(self, groups: &mut Groups, g: usize) {
        let group = &mut groups.of[g];
        group.inv_lo = self.line.best;
        if ANY {
            return;
        }
        (group.weights, group.slot) = (self.weights, bytemuck::cast(self.prim.to_array()));
        if MANY {
            groups.inst[g] = bytemuck::cast(self.inst.to_array());
        }
        if BEHIND {
            groups.ahead[g] = self.ahead;
        }
    }
}
