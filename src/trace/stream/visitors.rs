//! Rays of another engine, as they come: those that enter an instance are put side by side, brought into its space, and go through its
//! object as a chunk.

use super::best::Best;
use super::chunk::{Chunk, RAYS, Set};
use super::leaf::Closer;
use super::sift::Sifted;
use super::walk::{Pile, Room, Walk};
use crate::lanes::{Lanes, Lanes3, MAX_LANES, Real};
use crate::ray::{Counters, HitPacket, INVALID_ID, Packet};
use crate::scene::world::{Instance, World};
use crate::trace::query::Stack;

/// A vector of rays in the world's space.
#[derive(Clone, Copy, Debug)]
pub struct Visit<V> {
    /// Origins.
    pub org: Lanes3<V>,
    /// Directions, not necessarily unit.
    pub dir: Lanes3<V>,
    /// Start of the segments.
    pub t_min: V,
    /// As far as they are traced.
    pub t_max: V,
    /// Where they enter the instance's box.
    pub near: V,
}

/// Numbers of a ray in a [`Visit`].
const NUMBERS: usize = 9;

/// Rays that another engine takes through an object, some at a time.
#[derive(Clone, Debug)]
pub struct Visitors<S> {
    /// Those that wait, number by number.
    waiting: [[S; RAYS + MAX_LANES]; NUMBERS],
    len: usize,
    chunk: Chunk<S>,
    best: Best<S>,
    /// Rays that found something.
    found: Set,
    pile: Pile<S>,
    closer: Closer<S>,
    sifted: Sifted<S>,
}

impl<S: Real> Default for Visitors<S> {
    fn default() -> Self {
        let (pile, closer, sifted) = (Pile::default(), Closer::default(), Sifted::default());
        let waiting = [[S::ZERO; RAYS + MAX_LANES]; NUMBERS];
        Self { waiting, len: 0, chunk: Chunk::default(), best: Best::default(), found: 0, pile, closer, sifted }
    }
}

impl<S: Real> Visitors<S> {
    /// Makes room for a world whose [`World::stack_bound`](crate::scene::world::World::stack_bound) is `bound`.
    pub fn reserve(&mut self, bound: usize) {
        self.pile.reserve(bound);
    }

    /// Forgets those that came.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Whether there is room for all rays of another vector.
    #[inline(always)]
    pub fn has_room<V: Lanes<Scalar = S>>(&self) -> bool {
        self.len + V::N <= RAYS
    }

    /// Takes in those of some rays that are set in `lanes`, next to those that came before.
    #[inline(always)]
    pub fn put<V: Lanes<Scalar = S>>(&mut self, visit: &Visit<V>, lanes: u32) {
        let Visit { org: [x, y, z], dir: [dx, dy, dz], t_min, t_max, near } = *visit;
        let len = self.len & (RAYS - 1);
        for (to, from) in self.waiting.iter_mut().zip([x, y, z, dx, dy, dz, t_min, t_max, near]) {
            from.packed(lanes).store(&mut to[len..]);
        }
        self.len += lanes.count_ones() as usize;
    }

    /// Traces them through the object of instance `inst`, in its space. `sheared`: see [`Packet::prepared`].
    pub fn trace<V: Lanes<Scalar = S>, const ANY: bool, const COUNT: bool>(
        &mut self,
        (world, inst, sheared): (&World<S>, u32, bool),
        stack: &mut Stack<S>,
        counters: &mut Counters,
    ) {
        let Self { waiting, len, chunk, best, found, pile, closer, sifted } = self;
        let instance = &world.instances[inst as usize];
        chunk.start(RAYS, sheared);
        (best.done, *found) = (0, 0);
        let (mut rays, mut vectors) = (0, 0);
        for at in (0..(*len).min(RAYS)).step_by(V::N) {
            let all = V::ALL >> V::N.saturating_sub(*len - at);
            let of = |k: usize| V::load(&waiting[k][at..]);
            let (packet, inside) =
                bring_in([[of(0), of(1), of(2)], [of(3), of(4), of(5)]], [of(6), of(8)], instance, sheared);
            let lanes = all & inside;
            best.clear(at, V::N);
            chunk.take(at, &packet, lanes);
            of(7).store(&mut best.t[at..]);
            rays |= Set::from(lanes) << at;
            vectors += 1;
        }
        if rays == 0 {
            return;
        }
        chunk.len = vectors * V::N;
        chunk.find_common::<V>(rays);
        let object = &world.objects[instance.object as usize];
        let room = Room { waiting: pile, closer, sifted };
        let mut walk = Walk::new(best, room, stack, counters, !world.kinds.large);
        walk.octants::<V, ANY, COUNT>(object, inst, chunk, rays);
        *found = if ANY { best.done } else { best.found(vectors * V::N) & rays };
    }

    /// Of the rays from the `first` on that are in `lanes` of a vector those that found something.
    #[inline(always)]
    pub fn found(&self, first: usize, lanes: u32) -> u32 {
        let (mut own, mut rest, mut found) = ((self.found >> (first & (RAYS - 1))) as u32, lanes, 0);
        if own & !(u32::MAX << lanes.count_ones()) == 0 {
            return 0;
        }
        while rest != 0 {
            found |= (rest & rest.wrapping_neg()) * (own & 1);
            (rest, own) = (rest & (rest - 1), own >> 1);
        }
        found
    }

    /// What they hit.
    #[inline(always)]
    pub fn hits<V: Lanes<Scalar = S>>(&self, first: usize, lanes: u32) -> HitPacket<V> {
        let mut numbers = [[S::INFINITY; MAX_LANES]; 3];
        let (mut prim, mut rest, mut i) = ([INVALID_ID; MAX_LANES], lanes, first);
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize & (V::N - 1);
            rest &= rest - 1;
            let hit = self.best.numbers(i & (RAYS - 1));
            (numbers[0][lane], numbers[1][lane], numbers[2][lane], prim[lane]) = hit;
            i += 1;
        }
        let mut hit = HitPacket::new(V::load(&numbers[0]));
        (hit.u, hit.v) = (V::load(&numbers[1]), V::load(&numbers[2]));
        hit.prim[..V::N].copy_from_slice(&prim[..V::N]);
        hit
    }
}

/// Rays in the space of `instance`, and the lanes where that can be: a direction may overflow on the way in. `near`: where they enter its
/// box; `sheared`: see [`Packet::prepared`].
#[inline(always)]
pub fn bring_in<V: Lanes>(
    [org, dir]: [Lanes3<V>; 2],
    [t_min, near]: [V; 2],
    instance: &Instance<V::Scalar>,
    sheared: bool,
) -> (Packet<V>, u32) {
    if instance.identity {
        return (Packet::prepared(org, dir, t_min, sheared), V::ALL);
    }
    let local = Packet::unsheared(org, dir, t_min).brought_in(&instance.to_local, near, sheared);
    let inside = local.finite_lanes();
    (local, inside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::f32x16;
    use crate::math::Random;
    use crate::ray::{Hits, Rays};
    use crate::scene::load::{LoadOptions, load};
    use crate::scene::world::Preset;
    use crate::trace::{Scratch, engine};

    /// Rays through a forest: those of some lanes find, side by side, what the scalar engine finds where it is this tree that they hit.
    #[test]
    fn rays_side_by_side_find_what_they_find_alone() {
        type V = f32x16;
        let scene = load("builtin:forest", &LoadOptions::default()).unwrap();
        let world = World::<f32>::compile(&scene, Preset::Balanced).unwrap();
        let scalar = engine::<f32>("scalar").unwrap();
        let (mut visitors, mut stack, mut counters) =
            (Visitors::<f32>::default(), Stack::default(), Counters::default());
        visitors.reserve(world.stack_bound());
        stack.reserve(world.stack_bound());
        let (mut r, mut compared) = (Random(9), 0);
        for inst in (0..world.instances.len()).step_by(7) {
            let (lo, hi) = world.instances[inst].bounds.to_f64();
            if !world.instances[inst].bounds.is_bounded() {
                continue;
            }
            // Towards points in its box.
            let mut rays = Rays::<f32>::new(RAYS);
            for i in 0..RAYS {
                let at = lo + (hi - lo) * (r.cube() * 0.5 + 0.5);
                let from = at + r.cube() * (hi - lo).length();
                rays.set(
                    i,
                    from.to_array().map(|x| x as f32),
                    (at - from).to_array().map(|x| x as f32),
                    0.0,
                    f32::INFINITY,
                );
            }
            let (mut hits, mut scratch) = (Hits::default(), Scratch::default());
            scalar.intersect(&world, &rays, &mut hits, &mut scratch, None);
            let (mut of, mut first) = (Vec::new(), 0);
            visitors.clear();
            while visitors.has_room::<V>() && of.len() < RAYS / V::N {
                let at = of.len() * V::N;
                let lanes = (r.unit() * 65536.0) as u32 & V::ALL;
                let ([org, dir], [t_min, t_max], _) = Packet::<V>::read(&rays, at);
                let visit = Visit { org, dir, t_min, t_max, near: V::splat(f32::MIN) };
                visitors.put(&visit, lanes);
                of.push((first, lanes));
                first += lanes.count_ones() as usize;
            }
            visitors.trace::<V, false, false>((&world, inst as u32, true), &mut stack, &mut counters);
            for (k, &(first, lanes)) in of.iter().enumerate() {
                let (found, got) = (visitors.found(first, lanes), visitors.hits::<V>(first, lanes));
                assert_eq!(found & !lanes, 0);
                let t = got.t.to_array();
                for lane in 0..V::N {
                    let ray = k * V::N + lane;
                    assert_eq!(found >> lane & 1 != 0, got.prim[lane] != INVALID_ID);
                    if lanes >> lane & 1 == 0 || hits.t[ray] == f32::INFINITY {
                        continue;
                    }
                    let own = hits.inst[ray] as usize == inst;
                    // Others' hits may hide its own, and then it is farther.
                    let nearest = hits.t[ray];
                    assert!(got.prim[lane] == INVALID_ID || t[lane] >= nearest * (1.0 - 1e-5), "{inst} {ray}");
                    if own {
                        assert_eq!(got.prim[lane], hits.prim[ray], "{inst} {ray}");
                        assert!((t[lane] - nearest).abs() <= 1e-5 * nearest, "{inst} {ray}");
                        compared += 1;
                    }
                }
            }
        }
        assert!(compared > 500, "{compared} rays hit what they were sent to");
    }
}
