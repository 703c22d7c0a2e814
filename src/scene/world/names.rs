//! What hits are called. Engines trace some placements as one object ([`super::joined`]) and number the others anew; hits carry
//! the numbers of the assembly all the same.

use crate::lanes::chosen::{lanes_of, merge, merge_lists};
use crate::lanes::words::{below, positions};
use crate::lanes::{LaneMask, Lanes, MAX_LANES, f32x16};
use crate::ray::INVALID_ID;

/// Cells of the table, at most, for few parts and for each of many.
const CELLS: [usize; 2] = [2048, 4];

/// The assembly's numbers of what is traced.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// Placement by traced instance; of the joined object it means nothing.
    insts: Vec<u32>,
    /// Traced instance that is the joined object.
    joined: u32,
    /// What comes from one placement, in order.
    parts: Vec<Part>,
    /// The part of primitive `k << shift`.
    cells: Vec<Part>,
    shift: u32,
}

/// Primitives of the joined object that come from one placement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Part {
    /// The first of them.
    pub first: u32,
    /// The one after the last.
    pub end: u32,
    /// Number of the placement.
    pub placement: u32,
}

impl Names {
    /// `insts`: by traced instance its placement; number `joined` of them is made of `parts`, which follow upon each other from 0
    /// on and are not empty.
    pub(super) fn new(insts: Vec<u32>, joined: u32, parts: Vec<Part>) -> Self {
        let count = parts.last().map_or(0, |part| part.end);
        let mut shift = 0;
        while (count >> shift) as usize > CELLS[0].max(CELLS[1] * parts.len()) {
            shift += 1;
        }
        let mut part = parts.iter();
        let mut now = part.next().copied().unwrap_or_default();
        let cell = |k: u32| {
            while now.end <= k << shift {
                now = part.next().copied().unwrap_or(Part { end: u32::MAX, ..now });
            }
            now
        };
        let cells = (0..=count.saturating_sub(1) >> shift).map(cell).collect();
        Self { insts, joined, parts, cells, shift }
    }

    /// Primitive and placement that primitive `prim` of traced instance `inst` is; both must be numbers of something.
    #[inline(always)]
    pub fn of(&self, prim: u32, inst: u32) -> [u32; 2] {
        if inst != self.joined {
            return [prim, self.insts[inst as usize]];
        }
        let mut part = self.guess(prim);
        if prim >= part.end {
            part = self.search(prim);
        }
        [prim - part.first, part.placement]
    }

    /// Names hits; misses stay misses.
    #[inline(always)]
    pub fn apply_each(&self, prim: &mut [u32], inst: &mut [u32]) {
        for (prim, inst) in prim.iter_mut().zip(inst) {
            if *prim != INVALID_ID {
                [*prim, *inst] = self.of(*prim, *inst);
            }
        }
    }

    /// The same of rays side by side, most of which hit one part or nothing.
    #[inline(always)]
    pub fn apply(&self, prim: &mut [u32; MAX_LANES], inst: &mut [u32; MAX_LANES]) {
        let hits = !positions(prim, INVALID_ID) & <f32x16 as Lanes>::ALL;
        if hits == 0 {
            return;
        }
        let part = self.guess(prim[hits.trailing_zeros() as usize % MAX_LANES]);
        let own = prim.map(|prim| prim.wrapping_sub(part.first));
        let others = below(part.end - part.first - 1, &own) | !positions(inst, self.joined);
        if others & hits != 0 {
            return self.apply_to_several(prim, inst, hits);
        }
        let mask = <f32x16 as Lanes>::Mask::from_bits(hits);
        (*prim, *inst) = (merge_lists(mask, own, *prim), merge(mask, part.placement, *inst));
    }

    /// The same where `hits` are of several parts: without a surprise as long as all are of the joined object.
    #[inline(never)]
    fn apply_to_several(&self, prim: &mut [u32; MAX_LANES], inst: &mut [u32; MAX_LANES], hits: u32) {
        let (prims, insts) = (*prim, *inst);
        let joined = positions(&insts, self.joined) & hits;
        let (mut first, mut end, mut placement) = ([0; MAX_LANES], [0; MAX_LANES], [0; MAX_LANES]);
        for lane in 0..MAX_LANES {
            let part = self.guess(prims[lane]);
            (first[lane], end[lane], placement[lane]) = (part.first, part.end, part.placement);
        }
        let mut own: [u32; MAX_LANES] = std::array::from_fn(|lane| prims[lane].wrapping_sub(first[lane]));
        let room: [u32; MAX_LANES] = std::array::from_fn(|lane| end[lane].wrapping_sub(prims[lane]).wrapping_sub(1));
        // What is beyond the end has gone below zero there.
        for lane in lanes_of(below(u32::MAX / 2, &room) & joined) {
            let part = self.search(prims[lane]);
            (own[lane], placement[lane]) = (prims[lane] - part.first, part.placement);
        }
        let mask = <f32x16 as Lanes>::Mask::from_bits(joined);
        (*prim, *inst) = (merge_lists(mask, own, prims), merge_lists(mask, placement, insts));
        lanes_of(hits & !joined).for_each(|lane| inst[lane] = self.insts[insts[lane] as usize]);
    }

    /// The part of a primitive not far before `prim`, or of this one itself; of any for numbers that are none.
    #[inline(always)]
    fn guess(&self, prim: u32) -> Part {
        let cell = (prim >> self.shift) as usize;
        self.cells[cell.min(self.cells.len() - 1)]
    }

    /// The part of `prim`.
    #[cold]
    fn search(&self, prim: u32) -> Part {
        self.parts[self.parts.partition_point(|part| part.end <= prim)]
    }

    /// Placements that are traced as one object.
    pub fn joined(&self) -> usize {
        self.parts.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;

    /// Against a plain search, for parts of equal and of very unequal sizes, few and many; groups of hits and of misses, in every
    /// mixture.
    #[test]
    fn every_primitive_has_the_name_of_a_plain_search() {
        let mut random = Random(5);
        for (count, most) in [(1, 5.0), (3, 9000.0), (40, 3.0), (40, 900.0), (3000, 9.0), (700, 3000.0)] {
            let (mut parts, mut end) = (Vec::new(), 0);
            for i in 0..count {
                let first = end;
                // Most are small.
                end += 1 + (random.unit().powi(4) * most) as u32;
                parts.push(Part { first, end, placement: 5 + 2 * i });
            }
            let names = Names::new(vec![3, 0, 4], 1, parts.clone());
            assert_eq!(names.joined(), parts.len());
            let plain = |prim: u32, inst: u32| match (prim, inst) {
                (INVALID_ID, inst) => [INVALID_ID, inst],
                (prim, 1) => {
                    let part = parts.iter().find(|part| part.first <= prim && prim < part.end).unwrap();
                    [prim - part.first, part.placement]
                }
                (prim, inst) => [prim, inst / 2 + 3],
            };
            for _ in 0..2000 {
                let inst: [u32; MAX_LANES] = std::array::from_fn(|_| [1, 1, 1, 0, 2][(random.unit() * 5.0) as usize]);
                let prim = inst.map(|_| match random.unit() {
                    x if x < 0.1 => INVALID_ID,
                    _ => (random.unit() * f64::from(end)) as u32,
                });
                let (mut group, mut each) = ((prim, inst), (prim, inst));
                names.apply(&mut group.0, &mut group.1);
                names.apply_each(&mut each.0, &mut each.1);
                for i in 0..MAX_LANES {
                    let want = plain(prim[i], inst[i]);
                    assert_eq!(([group.0[i], group.1[i]], [each.0[i], each.1[i]]), (want, want), "{prim:?} {inst:?}");
                }
            }
        }
    }
}
