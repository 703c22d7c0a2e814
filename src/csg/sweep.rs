//! The event sweep: all boundaries of the leaves that matter, nearest first, toggle bits; where the whole solid
//! changes from outside to inside or back is its boundary.
//!
//! Boundaries of a lane closer together than its tolerance are taken as one event, so that faces which touch and tangent
//! lines leave no skin. Groups form from the start of the line on, whatever the segment is, and depend on the line
//! alone. Sources: Roth, "Ray casting for modeling solids", 1982 (boundaries per line); Lefebvre, "IceSL: A GPU
//! accelerated CSG modeler and slicer", 2013 (sweep over sorted boundaries with early end).

use super::direct::{self, Part};
use super::events::Events;
use super::mesh::Crossings;
use super::operands::Operands;
use super::prune::{Met, Program, Pruner};
use super::solid::{Search, Solid};
use crate::lanes::{LaneMask, Lanes, MAX_LANES, Real};
use crate::ray::Packet;
use crate::ray::slab::Interval;

/// What a packet needs while it sweeps; grows on use, for any solid.
#[derive(Debug, Default)]
pub struct Scratch<S> {
    search: Search<S>,
    pruner: Pruner,
    program: Program,
    events: Events<S>,
    operands: Operands<S>,
    inside: Vec<u32>,
    toggled: Vec<Toggled>,
    crossings: Crossings,
}

/// An event that was taken.
#[derive(Clone, Copy, Debug)]
struct Toggled {
    event: u32,
    lanes: u32,
}

/// Where lanes cross the surface of a solid.
#[derive(Clone, Copy, Debug)]
pub struct Boundary<V> {
    /// Lanes that do.
    pub lanes: u32,
    /// Ray parameter.
    pub t: V,
    /// Face of the leaf.
    pub face: V,
    /// Lanes that enter the solid.
    pub enters: u32,
    /// Lanes where the leaf's own normal points into the solid: its surface was subtracted.
    pub turned: u32,
    /// The leaf whose surface it is.
    pub leaf: u32,
}

/// What a sweep did.
#[derive(Clone, Copy, Debug, Default)]
pub struct Effort {
    /// Leaves whose box some lane meets.
    pub met: usize,
    /// Leaves left after pruning.
    pub kept: usize,
    /// Boundaries of leaves, vectors of lanes.
    pub events: usize,
    /// Steps of the sweep.
    pub steps: usize,
}

/// How much of the lines' way through a solid is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// All of it: for who wants every boundary.
    Whole,
    /// The front part first, then more, as long as lanes need it: for who wants the first boundary that is not before the
    /// segment's start, where boundaries before the solid's box count as there. Those before may be left out; what was reported
    /// may be reported again.
    FrontFirst,
}

/// Reports the boundaries of `solid` on the packet's lines in order of t to `found`, which returns the lanes that need no
/// more. `limit` is how far lanes look at most; `lanes` are those whose line meets the solid's box, in `interval`.
#[inline(always)]
pub fn sweep<V: Lanes>(
    solid: &Solid<V::Scalar>,
    packet: &Packet<V>,
    (lanes, interval): (u32, &Interval<V>),
    limit: V,
    depth: Depth,
    scratch: &mut Scratch<V::Scalar>,
    mut found: impl FnMut(&Boundary<V>) -> u32,
) -> Effort {
    if solid.is_sole {
        return sole(solid, packet, (lanes, interval), limit, scratch, found);
    }
    let operation = solid.operation.as_ref().filter(|_| depth == Depth::FrontFirst);
    let limit = limit.fast_min(V::splat(V::Scalar::MAX));
    let everything = V::splat(V::Scalar::INFINITY);
    if solid.search.is_none() {
        let part = Part { packet, lanes, interval, limit, reach: everything };
        let Some(operation) = operation else { return pass(solid, part, scratch, found) };
        let (effort, rest) = direct::first(solid, operation, part, None, &mut scratch.operands, &mut found);
        return if rest == 0 { effort } else { effort + pass(solid, Part { lanes: rest, ..part }, scratch, found) };
    }
    let mut effort = Effort::default();
    let mut share = if depth == Depth::Whole { 1.0 } else { solid.front };
    let start = interval.near.fast_max(packet.t_min);
    let mut lanes = lanes;
    loop {
        // Parts are shares of the lane's own way, so that they are the same in a packet of any width.
        let end = (interval.far - start) * V::constant(share) + start;
        let whole = share >= 1.0;
        let reach = if whole { everything } else { end };
        let mut done = 0;
        let mut found = |boundary: &Boundary<V>| {
            let lanes = found(boundary);
            done |= lanes;
            lanes
        };
        let part = Part { packet, lanes, interval, limit: limit.fast_min(reach), reach };
        let mut rest = lanes;
        if let Some(operation) = operation {
            let Scratch { search, operands, .. } = scratch;
            let (direct, left) = direct::first(solid, operation, part, Some(search), operands, &mut found);
            (effort, rest) = (effort + direct, left);
            lanes &= !(operands.through & !rest);
        }
        if rest != 0 {
            effort = effort + pass(solid, Part { lanes: rest, ..part }, scratch, &mut found);
        }
        lanes &= !done & reach.cmp_lt(limit).bits();
        if whole || lanes == 0 {
            return effort;
        }
        share *= 4.0;
    }
}

/// The same where the solid is its only leaf.
#[inline(always)]
fn sole<V: Lanes>(
    solid: &Solid<V::Scalar>,
    packet: &Packet<V>,
    (lanes, interval): (u32, &Interval<V>),
    limit: V,
    scratch: &mut Scratch<V::Scalar>,
    mut found: impl FnMut(&Boundary<V>) -> u32,
) -> Effort {
    let eps = solid.tolerance(packet);
    let limit = limit.fast_min(V::splat(V::Scalar::MAX));
    let Scratch { search, events, crossings, pruner, program, .. } = scratch;
    let met = &mut search.met;
    met.clear();
    met.push(Met { leaf: 0, lanes, at: 0, operand: Met::UNSEEN });
    events.clear();
    solid.boundaries_within(packet, &met[0], 0, (interval, eps), events, crossings);
    let count = events.count;
    if count == 0 {
        return Effort { met: 1, kept: 1, ..Effort::default() };
    }
    if count != 2 {
        pruner.prune(&solid.tree, met, program);
        let steps = walk((solid, packet), scratch, lanes, (limit, eps), found);
        return Effort { met: 1, kept: 1, events: count, steps };
    }
    let (t_in, t_out) = (events.time::<V>(0), events.time::<V>(1));
    // As in the sweep, boundaries within the tolerance are taken together: the line only touches.
    let apart = (t_in + eps).cmp_lt(t_out).bits() & lanes;
    let enters = t_in.cmp_le(limit).bits() & apart;
    let mut done = 0;
    if enters != 0 {
        done = found(&boundary(met, &[enters], events, 0, enters, enters));
    }
    let leaves = t_out.cmp_le(limit).bits() & apart & !done;
    if leaves != 0 {
        found(&boundary(met, &[0], events, 1, leaves, 0));
    }
    Effort { met: 1, kept: 1, events: 2, steps: 1 + usize::from(leaves != 0) }
}

impl std::ops::Add for Effort {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let (met, kept) = (self.met + o.met, self.kept + o.kept);
        Self { met, kept, events: self.events + o.events, steps: self.steps + o.steps }
    }
}

/// One sweep over a part of the solid.
#[inline(always)]
fn pass<V: Lanes>(
    solid: &Solid<V::Scalar>,
    part: Part<'_, V>,
    scratch: &mut Scratch<V::Scalar>,
    found: impl FnMut(&Boundary<V>) -> u32,
) -> Effort {
    let Part { packet, lanes, limit, reach, .. } = part;
    let mut effort = Effort::default();
    let eps = solid.tolerance(packet);
    let Scratch { search, pruner, program, events, crossings, .. } = scratch;
    solid.meet(packet, lanes, eps, reach, search);
    let Search { met, intervals, .. } = search;
    effort.met = met.len();
    pruner.prune(&solid.tree, met, program);
    effort.kept = met.len();
    events.clear();
    let mut pending = 0;
    for (slot, m) in met.iter().enumerate() {
        pending |= m.lanes;
        solid.boundaries(packet, (m, intervals), slot as u32, limit, eps, events, crossings);
    }
    effort.events = events.count;
    if !met.is_empty() {
        effort.steps = walk((solid, packet), scratch, pending & lanes, (limit, eps), found);
    }
    effort
}

/// Takes the events in their order, up to `limit`; how many steps that took.
#[inline(always)]
fn walk<V: Lanes>(
    (solid, packet): (&Solid<V::Scalar>, &Packet<V>),
    scratch: &mut Scratch<V::Scalar>,
    mut pending: u32,
    (limit, eps): (V, V),
    mut found: impl FnMut(&Boundary<V>) -> u32,
) -> usize {
    let Scratch { search, program, events, inside, toggled, .. } = scratch;
    let met = &search.met;
    let mut steps = 0;
    inside.clear();
    inside.resize(met.len(), 0);
    let mut state = program.run(inside);
    let never = V::splat(V::Scalar::INFINITY);
    let mut next = never;
    for event in 0..events.count {
        next = events.time::<V>(event).fast_min(next);
    }
    loop {
        pending &= next.cmp_le(limit).bits();
        if pending == 0 {
            return steps;
        }
        steps += 1;
        let until = next + eps;
        let (mut once, mut twice) = (0, 0);
        toggled.clear();
        next = never;
        for event in 0..events.count {
            let t = events.time::<V>(event);
            let now = t.cmp_le(until);
            next = V::select(now, never, t).fast_min(next);
            let lanes = now.bits() & pending;
            if lanes != 0 {
                inside[events.leaf[event] as usize] ^= lanes;
                toggled.push(Toggled { event: event as u32, lanes });
                twice |= once & lanes;
                once |= lanes;
            }
        }
        let now = program.run(inside);
        let changed = (now ^ state) & pending;
        state ^= changed;
        if changed != 0 {
            let step = Step { met, inside, events, toggled, now };
            pending &= !step.plain(changed & !twice, &mut found);
            let mut rest = changed & twice;
            while rest != 0 {
                let lane = rest & rest.wrapping_neg();
                rest &= !lane;
                if let Some(boundary) = several::<V>((solid, packet), met, inside, events, toggled, program, now, lane)
                {
                    pending &= !found(&boundary);
                }
            }
        }
        for Toggled { event, lanes } in toggled.iter() {
            let at = *event as usize * MAX_LANES;
            let taken = V::Mask::from_bits(*lanes);
            let t = V::load(&events.t[at..]);
            V::select(taken, never, t).store(&mut events.t[at..]);
        }
    }
}

/// One step of the sweep after its toggles.
struct Step<'a, S> {
    met: &'a [Met],
    inside: &'a [u32],
    events: &'a Events<S>,
    toggled: &'a [Toggled],
    now: u32,
}

impl<S: Real> Step<'_, S> {
    /// Reports lanes in which one event toggled: its leaf's surface is seen. Returns those that need no more.
    #[inline(always)]
    fn plain<V: Lanes<Scalar = S>>(&self, changed: u32, found: &mut impl FnMut(&Boundary<V>) -> u32) -> u32 {
        let mut done = 0;
        for Toggled { event, lanes } in self.toggled {
            let lanes = lanes & changed;
            if lanes != 0 {
                done |= found(&boundary(self.met, self.inside, self.events, *event, lanes, self.now));
            }
        }
        done
    }
}

fn boundary<V: Lanes>(
    met: &[Met],
    inside: &[u32],
    events: &Events<V::Scalar>,
    event: u32,
    lanes: u32,
    now: u32,
) -> Boundary<V> {
    let slot = events.leaf[event as usize] as usize;
    let at = event as usize * MAX_LANES;
    Boundary {
        lanes,
        t: V::load(&events.t[at..]),
        face: V::load(&events.face[at..]),
        enters: now & lanes,
        turned: (now ^ inside[slot]) & lanes,
        leaf: met[slot].leaf,
    }
}

/// The boundary of one lane in which several events toggled at once: at the one where the solid begins or ends, were they taken
/// one by one, or at the one of the first of the leaves whose own surface bounds the solid there as well as rounding tells.
#[cold]
#[inline(never)]
fn several<V: Lanes>(
    (solid, packet): (&Solid<V::Scalar>, &Packet<V>),
    met: &[Met],
    inside: &mut [u32],
    events: &Events<V::Scalar>,
    toggled: &[Toggled],
    program: &mut Program,
    now: u32,
    lane: u32,
) -> Option<Boundary<V>> {
    let of_lane = |numbers: &[V::Scalar]| numbers[lane.trailing_zeros() as usize].to_f64();
    let slot = |event: u32| events.leaf[event as usize] as usize;
    let leaf = |event: u32| met[slot(event)].leaf;
    let at = |event: u32| of_lane(&events.t[event as usize * MAX_LANES..]);
    let mut own: Vec<u32> = toggled.iter().filter(|t| t.lanes & lane != 0).map(|t| t.event).collect();
    // By leaf number where t is equal: `met` is in the order of a search, which packets of another width may do otherwise.
    own.sort_by(|&a, &b| at(a).total_cmp(&at(b)).then(leaf(a).cmp(&leaf(b))));
    let flip_all = |inside: &mut [u32]| own.iter().for_each(|&event| inside[slot(event)] ^= lane);
    flip_all(inside);
    // What thin gaps and thin skins there are between is filled: first way in, last way out.
    let mut state = !now & lane;
    let mut crossing = None;
    for &event in &own {
        inside[slot(event)] ^= lane;
        let value = program.run(inside) & lane;
        if value != state && (crossing.is_none() || now & lane == 0) {
            crossing = Some((event, value ^ (inside[slot(event)] & lane)));
        }
        state = value;
    }
    let (crossing, turned) = crossing?;
    let bounds = |inside: &mut [u32], program: &mut Program, s: usize, value: u32| {
        inside[s] ^= lane;
        let other = program.run(inside);
        inside[s] ^= lane;
        (other ^ value) & lane != 0
    };
    let near = |event: u32| {
        let mut untold = [V::Scalar::ZERO; MAX_LANES];
        solid.untold(packet, [leaf(event), leaf(crossing)]).store(&mut untold);
        (at(event) - at(crossing)).abs() <= of_lane(&untold)
    };
    // A leaf that was entered and left again did not change.
    let is_even = |event: u32| own.iter().filter(|&&o| slot(o) == slot(event)).count() % 2 == 0;
    let mut best = crossing;
    for &event in own.iter().filter(|&&event| near(event) && !is_even(event)) {
        if (false, leaf(event)) >= (is_even(best), leaf(best)) {
            continue;
        }
        let mut seen = bounds(inside, program, slot(event), now);
        if !seen {
            flip_all(inside);
            seen = bounds(inside, program, slot(event), !now);
            flip_all(inside);
        }
        if seen {
            best = event;
        }
    }
    let boundary = boundary(met, inside, events, best, lane, now);
    Some(if best == crossing { Boundary { turned, ..boundary } } else { boundary })
}
