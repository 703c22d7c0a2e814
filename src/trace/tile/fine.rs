//! Instances that a tile sees so small that their triangles have few rays in common: the tile finds them, and the stream kernel
//! takes those groups through that meet them, by the common formula.

use super::exact::Exact;
use super::groups::Groups;
use super::own::occlude;
use super::shapes::{enter, take};
use super::{GROUPS, HALF_ULP, Mask, V};
use crate::lanes::{LaneMask, Lanes};
use crate::ray::Counters;
use crate::trace::query::Stack;
use crate::trace::stream::{MOST, Visitors};

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
    let (mut rest, mut touched) = (wanted, 0);
    while rest != 0 {
        let (mut of, mut count) = ([0; MOST / V::N], 0);
        while rest != 0 && count < of.len() {
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
            if let Some((packet, t_max, lanes)) = enter(exact, inst, &segments, limit, (lanes, sheared)) {
                visitors.put(count, (&packet, sheared), t_max, lanes);
                of[count] = g;
                count += 1;
            }
        }
        if count == 0 {
            continue;
        }
        visitors.trace::<V, ANY, COUNT>(count, (exact.world, inst), stack, counters);
        for (k, &g) in of.iter().enumerate().take(count) {
            let found = match ANY {
                true => occlude(groups, g, Mask::from_bits(visitors.done::<V>(k))),
                false => take(groups, g, &visitors.hits(k), inst),
            };
            touched |= u64::from(found) << g;
        }
    }
    if touched != 0 {
        groups.refresh::<N>(touched);
    }
}
