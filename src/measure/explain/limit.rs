//! The limit: the time in which this machine's lanes do an engine's counted tests, if they do nothing else.
//!
//! How long a test takes is measured in the same run, at the width of the machine's vectors, over data that stay in the first
//! cache: the tests' arithmetic alone, without trees, stacks, branches on results, memory or set-up. Every test is one that
//! misses, the cheapest kind. What an engine needs beyond that time is what the limit leaves open.

use std::hint::black_box;
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::lanes::{Lanes, Real};
use crate::ray::slab::Interval;
use crate::ray::{Counters, Packet};
use crate::scene::world::World;
use crate::shape::{BLOCK, Block, Triangle};

/// Boxes, triangles and sets of linear functions in the first cache; each is tested against [`PACKETS`] packets.
const TARGETS: usize = 32;

/// Packets they are tested against.
const PACKETS: usize = 8;

/// How long each kind of test is repeated; its fastest pass counts.
const TIME: Duration = Duration::from_millis(20);

/// What one test costs per lane, nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Costs {
    /// Lanes of the vectors they were measured with.
    pub lanes: usize,
    /// A ray against a box: [`Interval`].
    pub ns_box: f64,
    /// A ray against a triangle that it misses: [`Triangle::intersect`].
    pub ns_triangle: f64,
    /// A ray of a tile against a triangle that is set up for the tile: four linear functions of two coordinates.
    pub ns_linear: f64,
}

/// An engine's limit on some rays.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Limit {
    /// Nanoseconds per ray for nothing but the counted tests.
    pub ns_per_ray: f64,
    /// Of them, box tests.
    pub boxes: f64,
    /// Nanoseconds per ray that were measured.
    pub measured_ns_per_ray: f64,
    /// The limit over the measurement: 100 is a program that does nothing but tests.
    pub percent: f64,
}

impl Limit {
    /// The limit of an engine with these counts that took `seconds` for them; `None` without time or rays.
    pub fn of(costs: &Costs, counts: &Counters, seconds: f64) -> Option<Self> {
        if counts.rays == 0 || seconds <= 0.0 {
            return None;
        }
        let rays = counts.rays as f64;
        let per_ray = |tests: u64, ns: f64| tests as f64 * ns / rays;
        let boxes = per_ray(counts.box_lanes, costs.ns_box);
        let linear = counts.prim_lanes_linear.min(counts.prim_lanes_total);
        let prims = per_ray(counts.prim_lanes_total - linear, costs.ns_triangle) + per_ray(linear, costs.ns_linear);
        let (ns_per_ray, measured_ns_per_ray) = (boxes + prims, 1e9 * seconds / rays);
        Some(Self { ns_per_ray, boxes, measured_ns_per_ray, percent: 100.0 * ns_per_ray / measured_ns_per_ray })
    }
}

/// Whether all primitives are triangles, whose test is the one that is measured.
pub fn is_of_triangles<S: Real>(world: &World<S>) -> bool {
    world.objects.iter().all(|object| {
        let placed = object.placed.iter().map(Vec::len).sum::<usize>();
        object.spheres.len() + placed + object.unbounded.len() + object.solids.len() == 0
    })
}

/// Measures the tests in precision `S` on the current thread.
pub fn costs<S: Real>() -> Costs {
    measured::<S, S::Wide>()
}

fn measured<S: Real, V: Lanes<Scalar = S>>() -> Costs {
    let packets: Vec<Packet<V>> = (0..PACKETS).map(packet).collect();
    let boxes: Vec<[[S; 3]; 2]> = (0..TARGETS).map(|i| corners(i).map(|p| p.to_array().map(S::from_f64))).collect();
    let triangles: Vec<_> = (0..TARGETS / BLOCK).map(block::<S>).collect();
    let functions: Vec<[[S; 3]; 4]> = (0..TARGETS).map(functions).collect();
    let end = V::constant(1e30);
    let zero = V::constant(0.0);
    let tests = (TARGETS * PACKETS * V::N) as f64;
    let nanoseconds = |pass: &dyn Fn() -> V| 1e9 * fastest(pass) / tests;
    Costs {
        lanes: V::N,
        ns_box: nanoseconds(&|| {
            let mut sum = [zero; PACKETS];
            for [lo, hi] in black_box(&boxes[..]) {
                for (packet, sum) in packets.iter().zip(&mut sum) {
                    let interval = Interval::of(packet, *lo, *hi);
                    *sum = V::select(interval.meets(packet.t_min, end), interval.near, *sum);
                }
            }
            total(&sum)
        }),
        ns_triangle: nanoseconds(&|| {
            let mut sum = [zero; PACKETS];
            for block in black_box(&triangles[..]) {
                for (packet, sum) in packets.iter().zip(&mut sum) {
                    Triangle::intersect(packet, end, block, (1 << BLOCK) - 1, V::ALL, |found, _, _| {
                        *sum = V::select(found.hit, found.t, *sum);
                    });
                }
            }
            total(&sum)
        }),
        ns_linear: nanoseconds(&|| {
            let mut best = [zero; PACKETS];
            for set in black_box(&functions[..]) {
                for (packet, best) in packets.iter().zip(&mut best) {
                    let [u, v, w, depth] = set.map(|[x, y, at]| {
                        V::splat(x).mul_add(packet.dir[0], V::splat(y).mul_add(packet.dir[1], V::splat(at)))
                    });
                    let inside = zero.cmp_le(u.fast_min(v).fast_min(w)) & best.cmp_lt(depth);
                    *best = V::select(inside, depth, *best);
                }
            }
            total(&best)
        }),
    }
}

/// Seconds of the fastest pass.
fn fastest<V: Copy>(pass: &dyn Fn() -> V) -> f64 {
    let (begun, mut fastest) = (Instant::now(), f64::INFINITY);
    while begun.elapsed() < TIME {
        let start = Instant::now();
        // Several passes under one look at the clock, which takes tens of nanoseconds.
        for _ in 0..16 {
            black_box(pass());
        }
        fastest = fastest.min(start.elapsed().as_secs_f64() / 16.0);
    }
    fastest
}

fn total<V: Lanes>(parts: &[V]) -> V {
    parts.iter().fold(V::constant(0.0), |sum, part| sum + *part)
}

/// Neighbouring rays from a point on the z axis that pass the unit cube's middle.
fn packet<V: Lanes>(number: usize) -> Packet<V> {
    let lanes = |f: &dyn Fn(usize) -> f64| {
        let values: Vec<V::Scalar> = (0..V::N).map(|i| V::Scalar::from_f64(f(number * V::N + i))).collect();
        V::load(&values)
    };
    let org = [lanes(&|_| 0.1), lanes(&|_| 0.2), lanes(&|_| -3.0)];
    let dir = [lanes(&|i| 0.001 * i as f64 + 0.01), lanes(&|i| 0.02 - 0.0007 * i as f64), lanes(&|_| 1.0)];
    Packet::new(org, dir, V::constant(0.0))
}

/// Two corners of a box aside of the rays.
fn corners(number: usize) -> [DVec3; 2] {
    let low = DVec3::new(2.0 + number as f64, 2.0, 0.5);
    [low, low + DVec3::new(0.5, 0.25, 1.0)]
}

/// Triangles aside of the rays.
fn block<S: Real>(number: usize) -> Block<S, { Triangle::FIELDS }> {
    let mut block = Block::empty();
    for slot in 0..BLOCK {
        let [a, b] = corners(number * BLOCK + slot);
        if let Ok(record) = Triangle::record([a, b, DVec3::new(a.x, b.y, a.z)]) {
            block.set(slot, record, slot as u32);
        }
    }
    block
}

/// Edge functions that are negative over the rays' coordinates, and a depth.
fn functions<S: Real>(number: usize) -> [[S; 3]; 4] {
    let x = 0.01 * number as f64;
    [[0.1, x, -1.0], [x, 0.2, -1.5], [-0.1, -x, -0.5], [0.01, 0.02, 0.3]].map(|f| f.map(S::from_f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 rays, 400 box tests of 2 ns, 300 triangle tests of 3 ns, 100 of them at 1 ns: 8 + 6 + 1 = 15 ns per ray.
    #[test]
    fn the_limit_by_hand() {
        let costs = Costs { lanes: 16, ns_box: 2.0, ns_triangle: 3.0, ns_linear: 1.0 };
        let counts =
            Counters { rays: 100, box_lanes: 400, prim_lanes_total: 300, prim_lanes_linear: 100, ..Default::default() };
        let limit = Limit::of(&costs, &counts, 3e-6).unwrap();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(near(limit.ns_per_ray, 15.0) && near(limit.boxes, 8.0), "{limit:?}");
        assert!(near(limit.measured_ns_per_ray, 30.0) && near(limit.percent, 50.0), "{limit:?}");
        assert_eq!(Limit::of(&costs, &Counters::default(), 1.0), None);
        assert_eq!(Limit::of(&costs, &counts, 0.0), None);
    }

    /// The targets are missed, so no test ends early or goes on to look closer.
    #[test]
    fn targets_are_aside_of_the_rays() {
        for number in 0..PACKETS {
            let packet: Packet<f32> = packet(number);
            let end = f32::MAX;
            for target in 0..TARGETS {
                let [lo, hi] = corners(target).map(|p| p.as_vec3().to_array());
                assert!(!Interval::of(&packet, lo, hi).meets(0.0, end), "box {target}");
            }
            for target in 0..TARGETS / BLOCK {
                let block = block::<f32>(target);
                assert_eq!(block.len(), BLOCK);
                Triangle::intersect(&packet, end, &block, 0xff, 1, |found, _, _| assert!(!found.hit));
            }
        }
    }

    /// A test takes some clock cycles: between a hundredth of a nanosecond and a microsecond per lane.
    #[test]
    fn costs_are_of_a_sane_size_in_both_precisions() {
        for costs in [costs::<f32>(), costs::<f64>()] {
            for ns in [costs.ns_box, costs.ns_triangle, costs.ns_linear] {
                assert!((0.005..1000.0).contains(&ns), "{costs:?}");
            }
        }
    }
}
