//! The first boundary of one operation, straight from where lines enter and leave the leaves: a block less its holes is most of
//! what models are made of.
//!
//! A union is the outside of what is outside of all operands, so one rule does for both: inside of all operands, of which
//! some count as their outside.
//!
//! Source of the intervals: Roth, "Ray casting for modeling solids", 1982.

use super::operands::Operands;
use super::solid::{Search, Solid};
use super::sweep::{Boundary, Effort};
use super::tree::{Gate, LeafPlace, Tree};
use crate::lanes::{Lanes, Real};
use crate::ray::Packet;
use crate::ray::slab::Interval;

/// A solid that is one operation. Of its leaves none is a mesh; where they are searched lines pass through them at most once.
#[derive(Clone, Debug)]
pub(super) struct Operation {
    is_union: bool,
    /// By leaf.
    pub operands: Vec<Operand>,
    /// The leaves, those that are needed first.
    pub order: Vec<u32>,
    /// How many are.
    pub needed: u32,
}

/// One of its operands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Operand {
    /// Whether the leaf's outside is meant.
    pub negated: bool,
    /// Whether lanes that miss it have nothing to look for.
    pub is_needed: bool,
    /// Whether its box is the solid's.
    pub is_bounds: bool,
}

impl Operation {
    /// The one that `tree` is, if that is a union or an intersection; `is_bounds`: whether the box of a leaf is the solid's.
    pub fn of(tree: &Tree, is_bounds: impl Fn(usize) -> bool) -> Option<Self> {
        let [only] = &tree.nodes[..] else { return None };
        let is_union = match only.gate {
            Gate::And => false,
            Gate::Or => true,
            Gate::Xor => return None,
        };
        let operand = |(leaf, place): (usize, &LeafPlace)| {
            let LeafPlace { negated, strong, .. } = *place;
            Operand { negated, is_needed: strong, is_bounds: is_bounds(leaf) }
        };
        let operands: Vec<_> = tree.leaves.iter().enumerate().map(operand).collect();
        let mut order: Vec<_> = (0..operands.len() as u32).collect();
        order.sort_by_key(|&leaf| !operands[leaf as usize].is_needed);
        // Some may have been left out.
        let needed = operands.iter().filter(|operand| operand.is_needed).count() as u32;
        (needed == only.strong_operands).then_some(Self { is_union, operands, order, needed })
    }
}

/// What a packet is asked for in a part of a solid.
#[derive(Clone, Copy)]
pub(super) struct Part<'a, V: Lanes> {
    pub packet: &'a Packet<V>,
    pub lanes: u32,
    /// Where its lines meet the solid's box.
    pub interval: &'a Interval<V>,
    /// Boundaries after it do not count; finite.
    pub limit: V,
    /// Leaves that begin behind it do not matter.
    pub reach: V,
}

impl<V: Lanes> Part<'_, V> {
    /// Where boundaries begin to count: those before the solid's box count as there.
    #[inline(always)]
    pub fn earliest(&self) -> V {
        let Packet { t_min, t_floor, .. } = *self.packet;
        let all_count = t_min.cmp_le(t_floor.fast_max(self.interval.near));
        V::select(all_count, V::splat(-V::Scalar::MAX), t_min)
    }
}

/// Reports the first boundary of a part of `solid`, which is `operation`, to `found`; see [`super::sweep`]. Returns the lanes that
/// are to be swept instead: in which boundaries of several leaves that lie together are the first, or, in a search, any near it.
/// Its leaves are searched if `search` is given, else they are few.
#[inline(always)]
pub(super) fn first<V: Lanes>(
    solid: &Solid<V::Scalar>,
    operation: &Operation,
    part: Part<'_, V>,
    search: Option<&mut Search<V::Scalar>>,
    operands: &mut Operands<V::Scalar>,
    mut found: impl FnMut(&Boundary<V>) -> u32,
) -> (Effort, u32) {
    let eps = solid.tolerance(part.packet);
    operands.count = 0;
    let is_complete = search.is_none();
    let (mut effort, lanes) = match search {
        None => operands.of_all(solid, operation, &part, eps),
        Some(search) => operands.of_met(solid, operation, &part, eps, search),
    };
    if operands.is_overfull() || lanes == 0 {
        return (effort, lanes);
    }
    let count = operands.count;
    (effort.kept, effort.events, effort.steps) = (count, 2 * count, 1);
    part.earliest().store(&mut operands.earliest);
    part.limit.store(&mut operands.limit);
    eps.store(&mut operands.eps);
    operands.find(lanes, is_complete);
    let (t, face) = (V::load(&operands.t), V::load(&operands.face));
    let enters = if operation.is_union { operands.leaving } else { !operands.leaving };
    for i in 0..count {
        let lanes = operands.of[i];
        if lanes != 0 {
            let leaf = operands.leaves[i];
            let turned = if operation.operands[leaf as usize].negated { lanes } else { 0 };
            found(&Boundary { lanes, t, face, enters: enters & lanes, turned, leaf });
        }
    }
    (effort, operands.together)
}
