//! A chunk's way through the trees.

use super::best::Best;
use super::chunk::{Chunk, RAYS, Set};
use super::due::{self, Due};
use super::inside::Inside;
use super::{leaf, mixed, node, sift};
use crate::bvh::{Child, Node, Tree, WIDE, WIDTH};
use crate::lanes::words::prefetch_either;
use crate::lanes::{LaneMask, Lanes, Real};
use crate::ray::Counters;
use crate::scene::world::{Object, World};
use crate::trace::leaf as packet_leaf;
use crate::trace::query::Stack;

/// What waits to be visited: a box and the rays that meet it.
#[derive(Clone, Copy, Debug)]
struct Waiting<S> {
    rays: Set,
    /// Order, and if `bound`, where the first ray enters.
    near: S,
    bound: bool,
    child: Child,
}

/// The boxes that wait to be visited.
#[derive(Clone, Debug)]
pub struct Pile<S> {
    entries: Vec<Waiting<S>>,
    len: usize,
}

impl<S: Real> Default for Pile<S> {
    fn default() -> Self {
        Self { entries: Vec::new(), len: 0 }
    }
}

impl<S: Real> Pile<S> {
    /// Makes room for `bound` entries.
    pub fn reserve(&mut self, bound: usize) {
        self.len = 0;
        let none = Waiting { rays: 0, near: S::ZERO, bound: false, child: Child::ROOT };
        self.entries.resize(self.entries.len().max(bound + WIDTH), none);
    }

    /// The places above the top, at least [`WIDE`].
    #[inline(always)]
    fn room(&mut self) -> &mut [Waiting<S>] {
        &mut self.entries[self.len..]
    }

    /// Takes the top entry if there are more than `base`.
    #[inline(always)]
    fn pop(&mut self, base: usize) -> Option<Waiting<S>> {
        if self.len <= base {
            return None;
        }
        self.len -= 1;
        Some(self.entries[self.len])
    }
}

/// Working memory of a chunk's query.
pub struct Room<'a, S> {
    /// Boxes to visit.
    pub waiting: &'a mut Pile<S>,
    /// Room for the closer look at a leaf.
    pub closer: &'a mut leaf::Closer<S>,
    /// Room for what a leaf's sieve does not settle.
    pub sifted: &'a mut sift::Sifted<S>,
}

/// The state of a chunk's query.
pub struct Walk<'a, S> {
    /// What was found.
    pub best: &'a mut Best<S>,
    /// Boxes to visit.
    pub waiting: &'a mut Pile<S>,
    /// Room for the closer look at a leaf.
    pub closer: &'a mut leaf::Closer<S>,
    /// Room for what a leaf's sieve does not settle.
    pub sifted: &'a mut sift::Sifted<S>,
    /// For kernels that want one.
    pub stack: &'a mut Stack<S>,
    /// Counters.
    pub counters: &'a mut Counters,
    /// Rays that wait to be tested.
    pub due: Due,
    /// Whether triangles are tested by [`sift`].
    pub sieve: bool,
    /// Tests of nodes' boxes, of rays of any octants.
    pub tests: u64,
}

impl<'a, S: Real> Walk<'a, S> {
    /// The beginning of a query.
    #[inline(always)]
    pub fn new(
        best: &'a mut Best<S>,
        room: Room<'a, S>,
        stack: &'a mut Stack<S>,
        counters: &'a mut Counters,
        sieve: bool,
    ) -> Self {
        let Room { waiting, closer, sifted } = room;
        Self { best, waiting, closer, sifted, stack, counters, due: Due::default(), sieve, tests: 0 }
    }

    /// Traces a chunk of one octant, or a mixed one, through the whole world. `inside` is room for rays in an instance's space.
    pub fn world<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        world: &World<S>,
        chunk: &Chunk<S>,
        inside: &mut Inside<S>,
        octant: usize,
    ) {
        let all = Set::MAX >> (RAYS - chunk.len) & if ANY { !self.best.done } else { Set::MAX };
        if world.is_single_object() {
            let object = &world.objects[world.instances[0].object as usize];
            self.object::<V, ANY, COUNT>(object, 0, chunk, all, octant);
            return;
        }
        let leaf = |walk: &mut Self, leaf: Child, rays: Set| {
            let inst = world.top_leaves[leaf.index as usize];
            walk.instance::<V, ANY, COUNT>(world, inst, (chunk, octant), inside, rays);
        };
        let at = |child: Child| {
            let (at, is_leaf) = (child.index as usize, child.is_leaf());
            let inst = world.top_leaves[if is_leaf { at } else { 0 }] as usize;
            if is_leaf { inst } else { at }
        };
        match chunk.mixed {
            true => self.tree::<V, _, ANY, COUNT, true>(&world.top, chunk, (all, octant), (&world.instances, at), leaf),
            false => {
                self.tree::<V, _, ANY, COUNT, false>(&world.top, chunk, (all, octant), (&world.instances, at), leaf)
            }
        }
        for &inst in &world.unbounded_instances {
            self.instance::<V, ANY, COUNT>(world, inst, (chunk, octant), inside, all);
        }
    }

    /// Takes some rays into an instance.
    fn instance<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        world: &World<S>,
        inst: u32,
        (chunk, octant): (&Chunk<S>, usize),
        inside: &mut Inside<S>,
        rays: Set,
    ) {
        let instance = &world.instances[inst as usize];
        let object = &world.objects[instance.object as usize];
        if instance.identity {
            self.object::<V, ANY, COUNT>(object, inst, chunk, rays, octant);
            return;
        }
        let rays = inside.enter::<V>((chunk, self.best), instance, rays);
        if rays == 0 {
            return;
        }
        let Self { waiting, closer, sifted, stack, counters, .. } = self;
        let mut walk = Walk::new(&mut inside.best, Room { waiting, closer, sifted }, stack, counters, self.sieve);
        walk.octants::<V, ANY, COUNT>(object, inst, &inside.chunk, rays);
        self.tests += walk.tests;
        inside.leave::<ANY>(self.best, inst);
    }

    /// Takes some rays of any octants through an object, in its space.
    pub fn octants<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        object: &Object<S>,
        inst: u32,
        local: &Chunk<S>,
        rays: Set,
    ) {
        if local.mixed {
            if rays != 0 {
                self.object::<V, ANY, COUNT>(object, inst, local, rays, 0);
            }
            return;
        }
        let mut rest = rays;
        while rest != 0 {
            let (octant, alike) = local.first_octant::<V>(rest);
            rest &= !alike;
            self.object::<V, ANY, COUNT>(object, inst, local, alike, octant);
        }
    }

    /// Takes rays of one octant, or of any if the chunk is mixed, through an object.
    #[inline(always)]
    fn object<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        object: &Object<S>,
        inst: u32,
        chunk: &Chunk<S>,
        rays: Set,
        octant: usize,
    ) {
        let through = |walk: &mut Self, rays: Set| match chunk.mixed {
            true => walk.within::<V, ANY, COUNT, true>(object, inst, chunk, rays, octant),
            false => walk.within::<V, ANY, COUNT, false>(object, inst, chunk, rays, octant),
        };
        let common = rays & chunk.common;
        if common == 0 || !self.sieve {
            return through(self, rays);
        }
        // By themselves, so that no leaf of other rays has to ask for them.
        self.sieve = false;
        through(self, common);
        self.sieve = true;
        let rest = rays & !common & if ANY { !self.best.done } else { Set::MAX };
        if rest != 0 {
            through(self, rest);
        }
    }

    /// See [`Walk::object`]; `MIXED`: of any octants.
    #[inline(never)]
    fn within<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool, const MIXED: bool>(
        &mut self,
        object: &Object<S>,
        inst: u32,
        chunk: &Chunk<S>,
        rays: Set,
        octant: usize,
    ) {
        if object.has_unbounded() {
            leaf::vectors::<V, ANY, COUNT>(chunk, self, rays, |packet, query, lanes| {
                packet_leaf::unbounded(object, inst, packet, query, lanes);
            });
        }
        let at = |child: Child| child.index as usize;
        self.tree::<V, _, ANY, COUNT, MIXED>(
            &object.tree,
            chunk,
            (rays, octant),
            (&object.triangles, at),
            |walk, child, rays| {
                leaf::block::<V, ANY, COUNT>(object, inst, chunk, walk, child, rays);
            },
        );
        if !self.due.is_empty() {
            due::test::<S, ANY, COUNT>(object, inst, chunk, self);
        }
    }

    /// Traverses `tree` with some rays of one octant. `leaves`: what leaves refer to, and at which place of it or of the nodes what a
    /// child refers to lies, so that the memory is asked for it in time.
    #[inline(always)]
    fn tree<V: Lanes<Scalar = S>, T, const ANY: bool, const COUNT: bool, const MIXED: bool>(
        &mut self,
        tree: &Tree<S>,
        chunk: &Chunk<S>,
        of: (Set, usize),
        leaves: (&[T], impl Fn(Child) -> usize),
        leaf: impl FnMut(&mut Self, Child, Set),
    ) {
        if const { S::Children::N == WIDE } {
            self.nodes::<V, S::Children, T, WIDE, ANY, COUNT, MIXED>(&tree.wide, chunk, of, leaves, leaf);
        } else {
            self.nodes::<V, S::Octo, T, WIDTH, ANY, COUNT, MIXED>(&tree.nodes, chunk, of, leaves, leaf);
        }
    }

    /// See [`Walk::tree`]; `E`: vectors of the `W` children of `nodes`.
    #[inline(always)]
    fn nodes<
        V: Lanes<Scalar = S>,
        E: Lanes<Scalar = S>,
        T,
        const W: usize,
        const ANY: bool,
        const COUNT: bool,
        const MIXED: bool,
    >(
        &mut self,
        nodes: &[Node<S, W>],
        chunk: &Chunk<S>,
        (rays, octant): (Set, usize),
        (leaves, at): (&[T], impl Fn(Child) -> usize),
        mut leaf: impl FnMut(&mut Self, Child, Set),
    ) {
        if nodes.is_empty() {
            return;
        }
        let fetch = |child: Child| prefetch_either(nodes, leaves, child.is_leaf(), at(child));
        let base = self.waiting.len;
        let (mut child, mut rays) = (Child::ROOT, rays);
        loop {
            if ANY {
                rays &= !self.best.done;
            }
            if rays != 0 && !child.is_leaf() {
                let node = &nodes[child.index as usize];
                if COUNT {
                    self.counters.nodes += 1;
                    self.counters.node_boxes += u64::from(node.used);
                    self.counters.wide_nodes += u64::from(W == WIDE);
                    self.counters.box_lanes += W as u64 * u64::from(rays.count_ones());
                    self.counters.node_lanes_active += u64::from(rays.count_ones());
                    self.counters.node_lanes_total += RAYS as u64;
                }
                let t = &self.best.t;
                let met = match &chunk.region {
                    Some(region) if MIXED && ANY => {
                        mixed::meet::<V, E, W>(node, chunk, region, t, rays, &mut self.tests)
                    }
                    _ if MIXED => mixed::sparse::<E, W, ANY>(node, chunk, t, rays),
                    _ => node::meet::<V, E, W, ANY>(node, chunk, t, rays, octant),
                };
                if met.children != 0 {
                    (child, rays) = self.choose::<E, W, ANY>(node, &met, &fetch);
                    continue;
                }
            } else if rays != 0 {
                leaf(self, child, rays);
            }
            let Some(next) = self.waiting.pop(base) else { return };
            (child, rays) = (next.child, next.rays);
            if !ANY && next.bound {
                rays &= self.best.reaching::<V>(next.near, chunk.len);
            }
        }
    }

    /// The child to visit next with its rays; the others that are met go to the stack, nearest on top. Every child's
    /// place comes from counting those that are farther: sorting them would mean a surprise per comparison.
    #[inline(always)]
    fn choose<E: Lanes<Scalar = S>, const W: usize, const ANY: bool>(
        &mut self,
        node: &Node<S, W>,
        met: &node::Met<S, W>,
        fetch: &impl Fn(Child),
    ) -> (Child, Set) {
        let last = met.children.count_ones() as usize - 1;
        let places = &mut self.waiting.room()[..W];
        let mut rest = met.children;
        if ANY {
            // In the node's own order, large children first.
            for place in places.iter_mut().take(last) {
                let slot = rest.ilog2() as usize & (W - 1);
                rest &= !(1 << slot);
                let child = node.child(slot);
                fetch(child);
                *place = Waiting { rays: met.rays(slot), near: S::ZERO, bound: false, child };
            }
            self.waiting.len += last;
            let slot = rest.trailing_zeros() as usize & (W - 1);
            fetch(node.child(slot));
            return (node.child(slot), met.rays(slot));
        }
        // No NaNs, so that no two children get one place.
        let near = E::load(&met.near).fast_max(E::splat(S::LOWEST));
        let mut next = 0;
        while rest != 0 {
            let slot = rest.trailing_zeros() as usize & (W - 1);
            rest &= rest - 1;
            let child = node.child(slot);
            fetch(child);
            let before = (1 << slot) - 1;
            let own = E::splat(met.near[slot]).fast_max(E::splat(S::LOWEST));
            let farther = own.cmp_lt(near).bits() & !before | own.cmp_le(near).bits() & before;
            let place = (farther & met.children).count_ones() as usize & (W - 1);
            next = if place == last { slot } else { next };
            places[place] = Waiting { rays: met.rays(slot), near: met.near[slot], bound: met.bound, child };
        }
        self.waiting.len += last;
        (node.child(next), met.rays(next))
    }
}
