//! Instances that a tile sees so small that their triangles have few rays in common: the tile finds them, and the stream kernel
//! takes those of its rays through that meet them, by the common formula.

use super::exact::Exact;
use super::groups::Groups;
use super::own::occlude;
use super::shapes::{reach, take};
use super::{GROUPS, HALF_ULP, Mask, V};
use crate::lanes::LaneMask;
use crate::ray::Counters;
use crate::trace::query::Stack;
use crate::trace::stream::{Visit, Visitors};

/// Traces `wanted` groups of `N` sets through instance `inst`.
#[inline(never)]
pub fn visit<const N: usize, const ANY: bool, const COUNT: bool>(
    groups: &mut Groups,
    exact: &Exact,
    inst: u32,
    wanted: u64,
    (visitors, stack): (&mut Visitors<f32>, &mut Stack<f32>),
    counters: &mut Counters,
) {
    let sheared = exact.world.kinds.ask_for_shear();
    let instance = &exact.world.instances[inst as usize];
    let (mut rest, mut touched) = (wanted, 0);
    while rest != 0 {
        let (mut of, mut count) = ([(0u8, 0u32); GROUPS], 0);
        visitors.clear();
        while rest != 0 && visitors.has_room::<V>() {
            let g = rest.trailing_zeros() as usize & (GROUPS - 1);
            rest &= rest - 1;
            let limit = match ANY {
                true => V::splat(f32::INFINITY),
                // A little more than the best hit's parameter: ties are told by depths.
                false => groups.of[g].slowness / groups.of[g].inv_lo * V::splat(1.0 + 16.0 * HALF_ULP),
            };
            let tame = exact.bundle.tame[g];
            let lanes = tame & !groups.done(g, tame);
            let segments = groups.segments(exact.bundle, g);
            let (t_max, near, lanes) = reach(instance, &segments, limit, lanes);
            visitors.put(&Visit { org: segments.org, dir: segments.dir, t_min: segments.t_min, t_max, near }, lanes);
            of[count & (GROUPS - 1)] = (g as u8, lanes);
            count += usize::from(lanes != 0);
        }
        if count == 0 {
            continue;
        }
        visitors.trace::<V, ANY, COUNT>((exact.world, inst, sheared), stack, counters);
        let mut first = 0;
        for &(g, lanes) in of.iter().take(count) {
            let (g, found) = (usize::from(g) & (GROUPS - 1), visitors.found(first, lanes));
            if found != 0 {
                let found = match ANY {
                    true => occlude(groups, g, Mask::from_bits(found)),
                    false => take(groups, g, &visitors.hits(first, lanes), inst),
                };
                touched |= u64::from(found) << g;
            }
            first += lanes.count_ones() as usize;
        }
    }
    if touched != 0 {
        groups.refresh::<N>(touched);
    }
}
