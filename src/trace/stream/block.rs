//! Blocks of neighbouring rays among shapes: a block goes down the tree once, as a whole, which lists the leaves that some of
//! its rays may meet, nearest first; then its vectors are tested against the list, without a tree.
//!
//! Every ray meets each leaf that it would meet by itself, so the hits are those of packets, bit by bit. Rays of a parallel
//! camera share what follows from their direction, too.
//!
//! Sources: Reshetov, Soupikov, Hurley, "Multi-Level Ray Tracing Algorithm", 2005 (a beam of rays finds what all of them begin
//! with); Boulos, Wald, Shirley, "Geometric and Arithmetic Culling Methods for Entire Ray Packets", 2006.

use super::Job;
use super::patience::Patience;
use crate::bvh::{Bundle, Child, Tree, WIDTH};
use crate::lanes::{LaneMask, Lanes, Lanes3, Real, each, map3};
use crate::ray::slab::Interval;
use crate::ray::{HitPacket, Packet, Rays};
use crate::trace::output::Output;
use crate::trace::query::Query;
use crate::trace::traverse::{self, Leaves, ObjectLeaves, TopLeaves};
use crate::trace::{Generic, leaf};

/// Vectors of rays of a block, and of its parts where it meets too much.
pub const SIZES: [usize; 2] = [16, 4];

/// Leaves that a block may meet.
const MOST: usize = 32;

/// Most blocks that are left alone after those of their size met too much.
const PATIENCE: u32 = 16;

/// A leaf that some rays may meet.
#[derive(Clone, Copy, Debug)]
struct Listed<S> {
    /// Nobody meets it before.
    near: S,
    leaf: Child,
    /// Its box: a node and a slot.
    node: u32,
    slot: usize,
}

/// Working memory.
#[derive(Clone, Debug)]
pub struct Block<S> {
    list: Vec<Listed<S>>,
    waiting: Vec<u32>,
    /// For each size: when to try the next one.
    patience: [Patience<1, PATIENCE>; SIZES.len()],
    /// Whether the last one of the largest size looked into several octants.
    turned: bool,
}

impl<S> Default for Block<S> {
    fn default() -> Self {
        Self { list: Vec::new(), waiting: Vec::new(), patience: Default::default(), turned: false }
    }
}

impl<S> Block<S> {
    /// Forgets what earlier calls found.
    pub fn start(&mut self) {
        (self.patience, self.turned) = Default::default();
    }
}

/// Least and largest numbers of the rays of a block.
struct Bounds<V> {
    org: Lanes3<(V, V)>,
    dir: Lanes3<(V, V)>,
    /// Earliest start and latest end.
    t: (V, V),
    /// Lanes that are live in some vector.
    live: u32,
    /// By vector.
    lives: [u32; SIZES[0]],
}

impl<V: Lanes> Bounds<V> {
    /// Of the live rays of the vectors that start at `starts`.
    #[inline(always)]
    fn of(rays: &Rays<V::Scalar>, starts: &[usize]) -> Self {
        let mut lives = [0; SIZES[0]];
        for (&at, live) in starts.iter().zip(&mut lives) {
            *live = rays.live_vector::<V>(at);
        }
        let all = lives.iter().take(starts.len()).all(|&live| live == V::ALL);
        // Column by column: the numbers of all at once are more than there are registers.
        let range = |column: &[V::Scalar]| {
            let (mut low, mut high) = (V::splat(V::Scalar::INFINITY), V::splat(V::Scalar::LOWEST));
            let none = (low, high);
            for (&at, &live) in starts.iter().zip(&lives) {
                let x = V::load(&column[at..]);
                if all {
                    (low, high) = (x.fast_min(low), x.fast_max(high));
                } else {
                    let live = V::Mask::from_bits(live);
                    (low, high) = (V::select(live, x, none.0).fast_min(low), V::select(live, x, none.1).fast_max(high));
                }
            }
            (low, high)
        };
        Self {
            org: each(|axis| range(&rays.org[axis])),
            dir: each(|axis| range(&rays.dir[axis])),
            t: (range(&rays.t_min).0, range(&rays.t_max).1),
            live: lives.iter().fold(0, |any, live| any | live),
            lives,
        }
    }

    /// As one bundle of lines, and whether they all have one direction.
    #[inline(always)]
    fn bundle(&self) -> (Bundle<V::Scalar>, bool) {
        let range = |(low, high): (V, V)| (low.range(self.live).0, high.range(self.live).1);
        let dir = map3(self.dir, range);
        let (start, end) = range(self.t);
        let shared = dir.iter().all(|(low, high)| low == high);
        (Bundle::spanning(map3(self.org, range), dir, start, end), shared)
    }
}

/// Whether the live rays of a vector look into several octants.
#[inline(always)]
fn turns<V: Lanes>(rays: &Rays<V::Scalar>, at: usize) -> bool {
    let (live, zero) = (rays.live_vector::<V>(at), V::constant(0.0));
    let some = |lanes: V::Mask| lanes.bits() & live != 0;
    let [x, y, z] = each(|axis| {
        let dir = V::load(&rays.dir[axis][at..]);
        some(dir.cmp_lt(zero)) & some(zero.cmp_lt(dir))
    });
    x | y | z
}

impl<S: Real> Job<'_, S> {
    /// Traces the vectors of rays that start at `starts` as a block of size `size`, as smaller ones, or each by itself. Returns
    /// how many rays were sorted.
    pub fn block<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        starts: &[usize],
        size: usize,
    ) -> usize {
        if starts.len() > 1 && self.memory.block.patience[size].is_over() {
            // Most that look into several octants show it within the first vector.
            let turned = starts.first().is_some_and(|&at| turns::<V>(self.rays, at));
            let done = !turned && self.whole::<V, ANY, COUNT>(starts);
            let block = &mut self.memory.block;
            block.patience[size].remember(done);
            block.turned = if size == 0 { turned } else { block.turned };
            if done {
                return 0;
            }
        }
        if ANY && self.memory.block.turned && self.packets::<V, COUNT>(starts) {
            return 0;
        }
        match SIZES.get(size + 1) {
            Some(&smaller) => starts.chunks(smaller).map(|part| self.block::<V, ANY, COUNT>(part, size + 1)).sum(),
            None => starts.iter().map(|&at| self.among_shapes::<V, ANY, COUNT>(at)).sum(),
        }
    }

    /// Any-hit: traces the vectors of rays that start at `starts` as the packet engine does; false if they do not follow each other.
    fn packets<V: Lanes<Scalar = S>, const COUNT: bool>(&mut self, starts: &[usize]) -> bool {
        let Self { world, rays, stack, counters, output, .. } = self;
        match (starts, output) {
            (&[first, .., last], Output::Any(out)) if last - first == (starts.len() - 1) * V::N => {
                let out = &mut out[first..rays.len().min(last + V::N)];
                Generic::<V, true>::any::<COUNT>(world, (rays, first), out, stack, counters);
                true
            }
            _ => false,
        }
    }

    /// Traces vectors of rays by one list of leaves; false if that is too long, or if they look into several octants.
    fn whole<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(&mut self, starts: &[usize]) -> bool {
        let bounds = Bounds::<V>::of(self.rays, starts);
        if bounds.live == 0 {
            self.miss::<V>(starts);
            return true;
        }
        let (bundle, shared) = bounds.bundle();
        let world = self.world;
        let single = world.is_single_object();
        let tree = if single { &world.first_object().tree } else { &world.top };
        if !bundle.is_uniform() || !self.list::<V, ANY, COUNT>(tree, &bundle) {
            return false;
        }
        if self.memory.block.list.is_empty() && !world.has_unbounded() {
            if COUNT {
                self.counters.rays += bounds.lives.iter().map(|live| u64::from(live.count_ones())).sum::<u64>();
            }
            self.miss::<V>(starts);
            return true;
        }
        let vectors = starts.iter().copied().zip(bounds.lives);
        if single {
            let leaves = ObjectLeaves { object: world.first_object(), inst: 0 };
            self.vectors::<V, _, ANY, COUNT>(tree, &leaves, vectors, shared, |packet, query, lanes| {
                leaf::unbounded(leaves.object, 0, packet, query, lanes);
            });
        } else {
            self.vectors::<V, _, ANY, COUNT>(tree, &TopLeaves(world), vectors, shared, |packet, query, lanes| {
                for &inst in &world.unbounded_instances {
                    traverse::instance(world, inst, packet, query, lanes);
                }
            });
        }
        true
    }

    /// The vectors of rays that start at `starts` meet nothing.
    fn miss<V: Lanes<Scalar = S>>(&mut self, starts: &[usize]) {
        let nothing = HitPacket::<V>::new(V::constant(0.0));
        starts.iter().for_each(|&at| self.output.put(at, &nothing, 0));
    }

    /// Lists the leaves of `tree` that `bundle` may meet, nearest first; false if there are too many.
    fn list<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        tree: &Tree<S>,
        bundle: &Bundle<S>,
    ) -> bool {
        let Block { list, waiting, .. } = &mut self.memory.block;
        list.clear();
        waiting.clear();
        if !tree.nodes.is_empty() {
            waiting.push(Child::ROOT.index);
        }
        let mut near = [S::ZERO; WIDTH];
        while let Some(index) = waiting.pop() {
            let node = &tree.nodes[index as usize];
            if COUNT {
                self.counters.nodes += 1;
                self.counters.node_boxes += u64::from(node.used);
                self.counters.box_lanes += WIDTH as u64;
            }
            let mut hit = bundle.children::<V>(node, &mut near) & ((1 << node.used) - 1);
            while hit != 0 {
                let slot = hit.trailing_zeros() as usize & (WIDTH - 1);
                hit &= hit - 1;
                let leaf = node.child(slot);
                if !leaf.is_leaf() {
                    waiting.push(leaf.index);
                    continue;
                }
                if list.len() == MOST {
                    return false;
                }
                list.push(Listed { near: near[slot], leaf, node: index, slot });
            }
        }
        if !ANY {
            list.sort_unstable_by(|a, b| a.near.partial_cmp(&b.near).unwrap_or(std::cmp::Ordering::Equal));
        }
        true
    }

    /// Tests vectors of rays, given by their places and live lanes, `shared` if they have one direction, against the listed
    /// leaves of `tree`; `first` has what no tree holds.
    #[inline(always)]
    fn vectors<V: Lanes<Scalar = S>, L: Leaves<V, ANY, COUNT>, const ANY: bool, const COUNT: bool>(
        &mut self,
        tree: &Tree<S>,
        leaves: &L,
        vectors: impl Iterator<Item = (usize, u32)>,
        shared: bool,
        first: impl Fn(&Packet<V>, &mut Query<V, ANY, COUNT>, u32),
    ) {
        let of_triangles = self.world.kinds.triangles;
        // One packet for all, changed in its place: it is too large to be copied.
        let nothing = [V::constant(0.0); 3];
        let mut packet = Packet::<V>::unsheared(nothing, nothing, nothing[0]);
        let mut last = 0;
        for (at, live) in vectors {
            let ([org, dir], [t_min, t_max], _) = Packet::<V>::read(self.rays, at);
            if COUNT {
                self.counters.rays += u64::from(live.count_ones());
            }
            (packet.org, packet.t_min) = (org, t_min);
            // What the shear of triangles has for a direction of -0 is not what it has for 0.
            if !shared || of_triangles || last & live != V::ALL {
                packet.turn(dir, of_triangles);
            }
            packet.dir = dir;
            last = live;
            let mut query = Query::<V, ANY, COUNT>::new(HitPacket::new(t_max), self.stack, self.counters);
            if live != 0 {
                first(&packet, &mut query, live);
                for listed in &self.memory.block.list {
                    let mut lanes = query.wanted(live, V::splat(listed.near));
                    // The others begin behind it.
                    if lanes == 0 {
                        break;
                    }
                    if listed.leaf.count > 1 {
                        let bounds = tree.nodes[listed.node as usize].child_bounds(listed.slot);
                        let interval = Interval::of(&packet, bounds.lo, bounds.hi);
                        query.count_box();
                        lanes &= interval.meets(packet.t_min, query.hit.t).bits();
                    }
                    if lanes != 0 {
                        leaves.visit(&packet, &mut query, listed.leaf, lanes);
                    }
                }
            }
            self.output.put(at, &query.hit, query.done);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Stream;
    use crate::lanes::{Lanes, Real, f32x16, f64x8};
    use crate::math::Random;
    use crate::ray::Rays;
    use crate::scene::load::{LoadOptions, load};
    use crate::scene::world::{Preset, World};
    use crate::trace::{Engine, Engines, Scratch, engine};
    use std::marker::PhantomData;

    /// Any-hit rays in all directions among shapes, in one call and behind others that point one way: how many meet something.
    fn turned<V: Lanes>(seed: u64) -> usize
    where
        V::Scalar: Engines,
    {
        let scene = load("builtin:gallery", &LoadOptions::default()).unwrap();
        let world = World::<V::Scalar>::compile(&scene, Preset::Balanced).unwrap();
        assert!(world.totals.of_shapes);
        let (mut r, mut met, mut scratch) = (Random(seed), 0, Scratch::default());
        for (n, alike) in [(1000, 0), (1000, 300), (43, 0), (777, 512), (256, 0)] {
            let mut rays = Rays::<V::Scalar>::new(n);
            for i in 0..n {
                let mut unit = || 2.0 * r.unit() - 1.0;
                let (org, dir) = ([6.0 * unit(), 1.0 + unit(), 6.0 * unit()], [unit(), unit(), unit()]);
                let dir = if i < alike { [0.3, -0.5, -1.0] } else { dir };
                let number = V::Scalar::from_f64;
                rays.set(i, org.map(number), dir.map(number), number(0.0), number(4.0));
            }
            let (mut got, mut want) = (vec![7; n], Vec::new());
            Stream::<V>(PhantomData).occluded(&world, &rays, &mut got, &mut scratch, None);
            assert!(V::Scalar::memory(&mut scratch).stream.block.turned, "{n} rays, {alike} alike");
            engine::<V::Scalar>("scalar").unwrap().occluded(&world, &rays, &mut want, &mut scratch, None);
            assert_eq!(got, want, "{n} rays, {alike} alike");
            met += want.iter().filter(|&&met| met == 1).count();
        }
        met
    }

    #[test]
    fn rays_in_all_directions_meet_what_they_meet_alone() {
        let (single, double) = (turned::<f32x16>(3), turned::<f64x8>(4));
        assert!((500..2500).contains(&single) && (500..2500).contains(&double), "{single} {double}");
    }
}
