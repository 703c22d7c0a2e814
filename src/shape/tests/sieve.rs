//! The sieve against the common formula, whose answers it must never contradict.

use glam::DVec3;

use super::Random;
use crate::lanes::{LaneMask, Lanes, Real, each, map3};
use crate::math::Aabb;
use crate::ray::Packet;
use crate::ray::slab::Interval;
use crate::shape::sieve::{Line, Sieve, beside, gauge};
use crate::shape::{BLOCK, Facts, Triangle, TriangleBlock, Turned};

/// A ray as the engines see it, in an instance's space if `floor` says where it enters its box.
struct Ray<S> {
    org: [S; 3],
    dir: [S; 3],
    t_min: S,
    t_max: S,
    floor: S,
}

/// What all triangles of a block came to, lane by lane.
struct Answers<S> {
    hit: u32,
    t: [S; BLOCK],
}

/// The common formula.
fn asked<S: Real>(ray: &Ray<S>, block: &TriangleBlock<S>) -> Answers<S> {
    let one = Packet::<S>::new(ray.org, ray.dir, ray.t_min);
    let axis = (0..3).find(|&axis| one.dominant[axis] != 0).unwrap();
    let (maybe, edges) = Triangle::candidates(&Turned::of(&one, axis), ray.t_min, ray.t_max, block);
    let splat = |v: [S; 3]| map3(v, S::Octo::splat);
    let mut packet = Packet::<S::Octo>::new(splat(ray.org), splat(ray.dir), S::Octo::splat(ray.t_min));
    packet.t_floor = S::Octo::splat(ray.floor);
    let found = Triangle::look_closer(&packet, block, &Facts::of_block(block), maybe, edges, true);
    let mut t = [S::ZERO; BLOCK];
    found.t.store(&mut t);
    Answers { hit: (found.hit & found.t.cmp_le(S::Octo::splat(ray.t_max))).bits(), t }
}

/// Triangles that are hard to tell from their neighbours, and ordinary ones.
fn triangles<S: Real>(r: &mut Random, kind: usize, far: f64, size: f64) -> TriangleBlock<S> {
    let mut block = TriangleBlock::empty();
    let mut slot = 0;
    while slot < BLOCK {
        let mut point = || DVec3::new(r.unit(), r.unit(), r.unit()) * 2.0 - 1.0;
        let (a, p, q) = (point() * far, point() * size, point() * size);
        let corners = match kind {
            // A needle, one that is seen edge-on, and one whose sides are nearly parallel.
            1 => [a, a + p, a + q * [1e-5, 1e-3, 1e-2, 0.1][slot % 4]],
            2 => [a.with_z(0.25), (a + p).with_z(0.25), (a + q).with_z(0.25)],
            3 => [a, a + p, a + p * 1.0001 + q * [1e-4, 1e-2][slot % 2]],
            _ => [a, a + p, a + q],
        };
        if let Ok(numbers) = Triangle::record::<S>(corners) {
            block.set(slot, numbers, slot as u32);
            slot += 1;
        }
    }
    block
}

/// A ray at some triangle of the block: through its inside, an edge or a corner, from far away or from its own plane.
fn aimed<S: Real>(r: &mut Random, block: &TriangleBlock<S>, reach: f64) -> Ray<S> {
    let [a, b, c] = Triangle::corners(&block.get((r.unit() * 8.0) as usize % BLOCK));
    let (mut u, mut v) = (r.unit(), r.unit());
    (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    match (r.unit() * 6.0) as usize {
        0 => u = 0.0,
        1 => (u, v) = (0.0, 0.0),
        2 => v = 1.0 - u,
        _ => {}
    }
    let at = a + (b - a) * u + (c - a) * v;
    let mut point = || DVec3::new(r.unit(), r.unit(), r.unit()) * 2.0 - 1.0;
    let (from, aside) = (at + point() * reach, point());
    let speed = [1.0, 1e-3, 1e3][(r.unit() * 3.0) as usize % 3];
    let round = |v: DVec3| v.to_array().map(S::from_f64);
    let (org, dir) = match (r.unit() * 4.0) as usize {
        // From the triangle itself, a few roundings in front of it or behind.
        0 => (round(at + aside * (at.length() + reach) * S::EPSILON.to_f64() * 4.0), round(aside * speed)),
        // In its plane.
        1 => (round(at + (b - a) * 2.0), round((at - b) * speed)),
        _ => (round(from), round((at - from) * speed)),
    };
    let mut dir = dir;
    if r.unit() < 0.05 {
        dir[(r.unit() * 3.0) as usize % 3] = S::ZERO;
    }
    let hits = |t: f64| S::from_f64(t / speed);
    let (t_min, t_max) = match (r.unit() * 5.0) as usize {
        0 => (S::ZERO, hits(1.0)),
        1 => (hits(1.0), S::INFINITY),
        2 => (S::ZERO, hits(1.0).next_down()),
        3 => (hits(-1.0), hits(3.0)),
        _ => (S::ZERO, S::INFINITY),
    };
    let (mut box_of, mut floor) = (Aabb::<S>::EMPTY, S::LOWEST);
    if r.unit() < 0.25 {
        (0..BLOCK).for_each(|slot| box_of = box_of.union(&Triangle::bounds(&block.get(slot))));
        let packet = Packet::<S>::new(org, dir, t_min);
        floor = Interval::<S>::of(&packet, box_of.lo, box_of.hi).near;
    }
    Ray { org, dir, t_min, t_max, floor }
}

/// Two rays at once against the common formula; returns how often the sieve was in doubt where it was asked for any hit, and how often
/// it was sure of one.
fn agree<S: Real>(rays: [&Ray<S>; 2], block: &TriangleBlock<S>, what: &str) -> [u32; 2] {
    type Of<S> = <S as Real>::Children;
    let pick = |of: &dyn Fn(&Ray<S>) -> S| {
        let halves = rays.map(|ray| [of(ray); BLOCK]);
        beside::<Of<S>>(&halves[0], &halves[1])
    };
    let [org, dir] = [each(|a| pick(&|ray| ray.org[a])), each(|a| pick(&|ray| ray.dir[a]))];
    let line = Line {
        org,
        dir,
        gauge: gauge(org, dir),
        t_min: pick(&|ray| ray.t_min),
        t_low: pick(&|ray| if ray.floor < ray.t_min { ray.t_min } else { S::LOWEST }),
        t_max: pick(&|ray| ray.t_max),
    };
    let sieve = Sieve::<Of<S>>::new(|f| beside(&block.fields[f], &block.fields[f]));
    let (any, closest) = (sieve.test::<true>(&line), sieve.test::<false>(&line));
    let mut counts = [0; 2];
    for (k, ray) in rays.iter().enumerate().take(Of::<S>::N / BLOCK) {
        let half = |mask: <Of<S> as Lanes>::Mask| mask.bits() >> (k * BLOCK) & 0xff;
        let want = asked(ray, block);
        for sieved in [&any, &closest] {
            assert_eq!(want.hit & !half(sieved.possible), 0, "{what}: a hit is missed");
        }
        assert_eq!(half(any.certain) & !want.hit, 0, "{what}: sure of what is no hit");
        assert_eq!(half(any.certain) & !half(any.possible), 0, "{what}: sure of what is not possible");
        let whole = Ray { t_min: -S::MAX, t_max: S::MAX, floor: S::LOWEST, ..**ray };
        let whole = asked(&whole, block);
        for slot in (0..BLOCK).filter(|slot| half(closest.certain) >> slot & 1 != 0) {
            assert!(whole.hit >> slot & 1 != 0, "{what}: sure of a triangle that the line does not meet");
            let lane = |v: Of<S>| v.lane(k * BLOCK + slot).to_f64();
            let (t, want) = (lane(closest.way) / lane(closest.speed), whole.t[slot].to_f64());
            let off = (lane(closest.off) + lane(closest.slant) * want.abs()) / lane(closest.speed);
            assert!((t - want).abs() <= 1.1 * off, "{what}: {t} {want} {off}");
        }
        counts[0] += (half(any.possible) & !half(any.certain)).count_ones();
        counts[1] += half(any.certain).count_ones();
    }
    counts
}

fn never_contradicts<S: Real>() {
    let mut r = Random(3);
    for kind in 0..4 {
        let mut counts = [0; 2];
        for round in 0..12_000 {
            let size = [1.0, 1e-3, 1e-7, 1e3][round % 4];
            let far = size * [1.0, 30.0, 1e4][round / 4 % 3];
            let block = triangles::<S>(&mut r, kind, far, size);
            let reach = size * [1.0, 0.01, 100.0, 1e5][round / 12 % 4];
            let rays = [aimed(&mut r, &block, reach), aimed(&mut r, &block, reach)];
            let [doubts, sure] = agree([&rays[0], &rays[1]], &block, &format!("kind {kind}, round {round}"));
            counts = [counts[0] + doubts, counts[1] + sure];
        }
        assert!(counts[0] > 1000 && counts[1] > 300, "kind {kind}: {counts:?} in doubt, sure");
    }
}

#[test]
fn in_f32() {
    never_contradicts::<f32>();
}

#[test]
fn in_f64() {
    never_contradicts::<f64>();
}

/// Ordinary triangles and rays that do not start on them leave next to nothing to the common formula.
#[test]
fn is_seldom_in_doubt() {
    let mut r = Random(5);
    let mut counts = [0; 2];
    for round in 0..40_000 {
        let block = triangles::<f32>(&mut r, 0, 1.0, 1.0);
        let mut point = || DVec3::new(r.unit(), r.unit(), r.unit()) * 2.0 - 1.0;
        let mut ray = || {
            let [org, dir] = [point() * 3.0, point()].map(|v| v.to_array().map(|x| x as f32));
            Ray { org, dir, t_min: 0.0, t_max: f32::INFINITY, floor: f32::NEG_INFINITY }
        };
        let [doubts, sure] = agree([&ray(), &ray()], &block, &format!("round {round}"));
        counts = [counts[0] + doubts, counts[1] + sure];
    }
    assert!(counts[1] > 1000 && counts[0] * 50 < counts[1], "{counts:?} in doubt, sure");
}

/// What the two tests' edge functions are off by at most, over `u d e (c + e)` and `u d e' (c + e)`: see the bounds in `shape/sieve.rs`.
fn worst_edges(block: &TriangleBlock<f32>, ray: &Ray<f32>) -> [f64; 2] {
    let one = Packet::<f32>::new(ray.org, ray.dir, ray.t_min);
    let axis = (0..3).find(|&axis| one.dominant[axis] != 0).unwrap();
    let (_, functions) = Triangle::candidates(&Turned::of(&one, axis), ray.t_min, ray.t_max, block);
    let splat = |v: [f32; 3]| map3(v, <f32 as Real>::Octo::splat);
    let line = Line {
        org: splat(ray.org),
        dir: splat(ray.dir),
        gauge: gauge(splat(ray.org), splat(ray.dir)),
        t_min: Lanes::splat(ray.t_min),
        t_low: Lanes::splat(ray.t_min),
        t_max: Lanes::splat(ray.t_max),
    };
    let sieve = Sieve::<<f32 as Real>::Octo>::new(|f| Lanes::load(&block.fields[f]));
    let sieved = sieve.test::<false>(&line);
    let (org, dir) = (DVec3::from(ray.org.map(f64::from)), DVec3::from(ray.dir.map(f64::from)));
    let sum = |v: DVec3| v.abs().element_sum();
    let u = f64::from(f32::EPSILON) / 2.0;
    let mut worst = [0.0f64; 2];
    for slot in 0..BLOCK {
        let [a, b, c] = Triangle::corners(&block.get(slot)).map(|corner| corner - org);
        let (p, q) = (b - a, c - a);
        let (away, reach) = (sum(a), sum(p) + sum(q));
        let exact = [a.cross(dir).dot(q), -a.cross(dir).dot(p), b.cross(dir).dot(b - c)];
        let [v, w, all] = [sieved.weights[0], sieved.weights[1], sieved.speed].map(|x| x.lane(slot));
        let off = |facing: f64| {
            let each =
                [v, w, all - v - w].into_iter().zip(exact).map(|(got, want)| (f64::from(got) - facing * want).abs());
            each.fold(0.0, f64::max) / (u * sum(dir) * reach * (away + reach))
        };
        // Seen edge-on, which side a triangle turns to the ray is lost, and no matter.
        worst[0] = worst[0].max(off(1.0).min(off(-1.0)));
        // As the common formula has it, without rounding.
        let [k, x, y] = [0, 1, 2].map(|i| (axis + i) % 3);
        let flat = [a, b, c].map(|v| [v[x] - dir[x] / dir[k] * v[k], v[y] - dir[y] / dir[k] * v[k]]);
        let near = reach + 16.0 * u * away;
        if flat.as_flattened().iter().any(|x| x.abs() > near) {
            continue;
        }
        for (i, function) in functions.iter().enumerate() {
            let [one, other] = [flat[(i + 2) % 3], flat[(i + 1) % 3]];
            let (got, want) = (f64::from(function.lane(slot)), one[0] * other[1] - one[1] * other[0]);
            let off = (got - want).abs() * dir[k].abs();
            worst[1] = worst[1].max(off / (u * sum(dir) * near * (away + reach)));
        }
    }
    worst
}

/// The two terms that the bound of edge functions is made of, against the same functions in f64.
#[test]
fn edge_functions_are_off_by_no_more_than_is_said() {
    let mut r = Random(11);
    let mut worst = [0.0f64; 2];
    for round in 0..200_000 {
        let far = [1.0, 10.0, 1e3, 1e6][round % 4];
        let block = triangles::<f32>(&mut r, round / 4 % 4, far, 1.0);
        let mut ray = aimed(&mut r, &block, [1.0, 0.1, 100.0, 1e5][round / 16 % 4]);
        if Triangle::along_a_face(ray.dir).any() {
            ray.dir = ray.dir.map(|x| if x == 0.0 { 0.01 } else { x });
        }
        let found = worst_edges(&block, &ray);
        worst = [worst[0].max(found[0]), worst[1].max(found[1])];
    }
    let [plain, common] = worst;
    assert!((0.5..10.0).contains(&plain) && (0.5..24.0).contains(&common), "{worst:?} half ulps");
}
