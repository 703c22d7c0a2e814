//! A tile's answers may be written while the next block's rays are taken in: whatever that block is, they come, and are those of a call
//! of the block alone.

use crate::common::{Random, ball, soup};
use crate::tile_support::{camera, compile, find};

use lanecast::ray::{Counters, Hits, Rays};
use lanecast::trace::Scratch;

/// Rays of a block.
const BLOCK: usize = 1024;

/// t, u, v, primitive and instance of every ray, as bits.
fn answers(hits: &Hits<f32>) -> Vec<[u32; 5]> {
    let bits = |i: usize| [hits.t[i].to_bits(), hits.u[i].to_bits(), hits.v[i].to_bits(), hits.prim[i], hits.inst[i]];
    (0..hits.t.len()).map(bits).collect()
}

/// A block of some kind: a picture's rays, or these with one or all of them changed.
fn block(kind: usize, r: &mut Random) -> Rays<f32> {
    let (eye, target) = (3.0 * r.direction(), 0.3 * r.in_cube());
    let mut rays = camera(eye, target, [0.05, 0.3][r.below(2)], 32);
    let one = r.below(BLOCK);
    match kind {
        0 => rays.kill(one),
        1 => rays.t_max[one] = 3.0,
        2 => rays.t_min[one] = 2.5,
        3 => rays.org[0][one] += 0.01,
        4 => (0..BLOCK).for_each(|i| rays.kill(i)),
        5 => (0..BLOCK).for_each(|i| {
            let org = (eye + 0.5 * r.in_cube()).as_vec3().to_array();
            rays.set(i, org, rays.dir(0), 0.0, f32::INFINITY);
        }),
        6 => (0..BLOCK).for_each(|i| {
            let (org, dir) = (r.in_cube().as_vec3().to_array(), r.direction().as_vec3().to_array());
            rays.set(i, org, dir, 0.0, 10.0);
        }),
        // From a mirror: lines through a point behind them.
        7 => (0..BLOCK).for_each(|i| {
            let dir = rays.dir(i);
            let org = [0, 1, 2].map(|a| rays.org[a][i] + 0.2 * dir[a]);
            rays.set(i, org, dir, 0.0, f32::INFINITY);
        }),
        _ => {}
    }
    rays
}

#[test]
fn answers_come_whatever_comes_next() {
    let mut r = Random(41);
    let joined = compile(vec![soup(2000, &mut r), ball(60, 90)]);
    let mut hit = 0;
    for case in 0..12 {
        let mut blocks: Vec<Rays<f32>> = (0..24).map(|_| block(r.below(16), &mut r)).collect();
        if case % 2 == 0 {
            let mut short = Rays::new(400);
            let whole = block(8, &mut r);
            (0..400).for_each(|i| short.set(i, whole.org(i), whole.dir(i), 0.0, f32::INFINITY));
            blocks.push(short);
        }
        let mut all = Rays::new(blocks.iter().map(Rays::len).sum());
        for (k, block) in blocks.iter().enumerate() {
            for i in 0..block.len() {
                all.set(BLOCK * k + i, block.org(i), block.dir(i), block.t_min[i], block.t_max[i]);
            }
        }
        for name in ["tile", "tile-16x16", "tile-exact"] {
            let (mut hits, mut scratch, mut counters) = (Hits::default(), Scratch::default(), Counters::default());
            find(name).intersect(&joined, &all, &mut hits, &mut scratch, Some(&mut counters));
            let (together, counted) = (answers(&hits), counters.rays);
            let (mut apart, mut own) = (Vec::new(), Counters::default());
            for block in &blocks {
                find(name).intersect(&joined, block, &mut hits, &mut scratch, Some(&mut own));
                apart.extend(answers(&hits));
            }
            assert_eq!(together.len(), apart.len());
            let first = together.iter().zip(&apart).position(|(a, b)| a != b);
            assert_eq!(first, None, "{name}, case {case}");
            assert_eq!(counted, own.rays, "{name}, case {case}");
            hit += together.iter().filter(|hit| hit[3] != u32::MAX).count();
        }
    }
    assert!(hit > 200_000, "{hit} hits");
}
