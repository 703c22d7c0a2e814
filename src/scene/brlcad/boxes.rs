//! Boxes of regions, as BRL-CAD combines those of solids.

use glam::DVec3;

use super::boolean::Step;
use super::regions::PlacedRegion;

/// Lower and upper corner; infinite for what has no bounds, inside out for the empty set.
type Corners = (DVec3, DVec3);

const EMPTY: Corners = (DVec3::INFINITY, DVec3::NEG_INFINITY);
const EVERYTHING: Corners = (DVec3::NEG_INFINITY, DVec3::INFINITY);

/// The box of `region`: of a union both, of an intersection what boxes share, of a difference the first. `solid` gives
/// the box of solid number i: `None` if it is not there, `Some(None)` if it has no bounds. `None` if the region is
/// empty or without bounds.
pub(super) fn of_region(region: &PlacedRegion, solid: impl Fn(usize) -> Option<Option<Corners>>) -> Option<Corners> {
    let mut stack = Vec::new();
    for &step in region.expression.steps() {
        let value = match step {
            Step::Member(i) => solid(i as usize).map_or(EMPTY, |corners| corners.unwrap_or(EVERYTHING)),
            Step::Empty => EMPTY,
            operator => {
                let (Some(b), Some(a)) = (stack.pop(), stack.pop()) else { continue };
                apply(operator, a, b)
            }
        };
        stack.push(value);
    }
    stack.pop().filter(|(lo, hi)| lo.is_finite() && hi.is_finite())
}

fn apply(operator: Step, a: Corners, b: Corners) -> Corners {
    match operator {
        Step::Union | Step::ExclusiveOr => (a.0.min(b.0), a.1.max(b.1)),
        Step::Intersection => {
            let (lo, hi) = (a.0.max(b.0), a.1.min(b.1));
            if lo.cmple(hi).all() { (lo, hi) } else { EMPTY }
        }
        _ => a,
    }
}
