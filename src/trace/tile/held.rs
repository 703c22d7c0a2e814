//! One group at a time against set-up triangles, in registers: most of what a tile does.

use super::batch::Planes;
use super::groups::{Group, Groups, NO_SLOT};
use super::own::{Edges, Id, behind, edges, linear, own_depth};
use super::{Mask, V, select};
use crate::lanes::{LaneMask, Lanes, Lanes3};

/// What a pair of triangle and group came to.
#[derive(Clone, Copy, Debug)]
pub struct Verdict {
    /// Some ray hit the triangle.
    pub hit: bool,
    /// Some ray passes an edge within its rounding, or its best hit is as near: for [`super::own::pair_doubtful`].
    pub doubt: bool,
}

impl Verdict {
    /// `hit` of `possible` rays are certain.
    #[inline(always)]
    fn of(hit: Mask, possible: Mask) -> Self {
        Self { hit: hit.any(), doubt: (possible & !hit).any() }
    }
}

/// A group's rays and what they found, in registers while some triangles are tested against them.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    s: V,
    t: V,
    /// See [`Group::inv_lo`].
    pub best: V,
    /// See [`Group::inv_hi`].
    front: V,
    weights: [V; 2],
    start: Lanes3<V>,
    /// See [`Groups::ahead`].
    ahead: V,
    // Numbers are moved as floats: selection copies bits.
    prim: V,
    inst: V,
}

impl Held {
    /// Loads a group.
    #[inline(always)]
    pub fn of<const MANY: bool>(groups: &Groups, g: usize) -> Self {
        let Group { s, t, inv_lo, inv_hi, slot, weights, start, .. } = groups.of[g];
        let inst = if MANY { groups.inst[g] } else { [NO_SLOT; 16] };
        let (prim, inst) = (V::new(bytemuck::cast(slot)), V::new(bytemuck::cast(inst)));
        Self { s, t, best: inv_lo, front: inv_hi, weights, start, ahead: groups.ahead[g], prim, inst }
    }

    /// Stores what was found.
    #[inline(always)]
    pub fn put<const ANY: bool, const MANY: bool, const BEHIND: bool>(self, groups: &mut Groups, g: usize) {
        let group = &mut groups.of[g];
        group.inv_lo = self.best;
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

    /// Tests triangle `i`. `MANY`: it is of an instance. `EARLY`: some segment ends before the common point.
    ///
    /// With a common end (`END`, any-hit) rays start on surfaces, a few roundings in front of them. Depths from the far end
    /// cannot tell which side of its own surface a ray starts on; where the start lies with respect to the triangle's plane
    /// can. So it does where the common point is `BEHIND` the rays, and there it tells how far ahead they hit, too.
    #[inline(always)]
    pub fn pair<const ANY: bool, const MANY: bool, const BEHIND: bool, const END: bool, const EARLY: bool>(
        &mut self,
        planes: &Planes,
        i: usize,
        id: Id,
    ) -> Verdict {
        let (zero, infinite) = (V::constant(0.0), V::splat(f32::INFINITY));
        let Edges { mut possible, mut certain, weights } = edges([self.s, self.t], planes, i);
        let depth = || own_depth(planes, i, linear([self.s, self.t], planes, i, 3));
        // What is certain is possible, too, so one maximum is all that the next triangle waits for.
        if ANY && END {
            let is_ahead = zero.cmp_le(behind(&self.start, planes, i));
            (possible, certain) = (possible & is_ahead, certain & is_ahead);
            if EARLY {
                let is_ahead = depth().cmp_le(self.front);
                (possible, certain) = (possible & is_ahead, certain & is_ahead);
            }
            let waiting = self.best.cmp_lt(infinite);
            self.best = select(certain, infinite, zero).fast_max(self.best);
            return Verdict::of(certain & waiting, possible & waiting);
        }
        let inverse = depth();
        let mut ahead = zero;
        if BEHIND {
            ahead = -behind(&self.start, planes, i);
            let is_ahead = zero.cmp_le(ahead);
            (possible, certain) = (possible & is_ahead, certain & is_ahead);
        } else if EARLY {
            let is_ahead = inverse.cmp_le(self.front);
            (possible, certain) = (possible & is_ahead, certain & is_ahead);
        }
        possible = possible & self.best.cmp_le(inverse);
        if ANY {
            let hit = certain & possible;
            self.best = select(hit, infinite, zero).fast_max(self.best);
            return Verdict::of(hit, possible);
        }
        let hit = certain & self.best.cmp_lt(inverse);
        self.best = select(certain, inverse, zero).fast_max(self.best);
        self.prim = select(hit, V::splat(f32::from_bits(id.prim)), self.prim);
        if MANY {
            self.inst = select(hit, V::splat(f32::from_bits(id.inst)), self.inst);
        }
        if BEHIND {
            self.ahead = select(hit, ahead * V::splat(planes.rcp[i]), self.ahead);
        }
        self.weights[0] = select(hit, weights[0], self.weights[0]);
        self.weights[1] = select(hit, weights[1], self.weights[1]);
        Verdict::of(hit, possible)
    }
}
