//! Trees over awkward boxes are valid, bounded in depth, and do not depend on the number of threads.

use super::*;
use crate::math::Aabb;

/// A small deterministic generator (splitmix64; Steele, Lea, Flood, 2014) so that tests need no crate.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn soup(n: usize, seed: u64) -> Vec<Aabb<f32>> {
    let mut r = Random(seed);
    (0..n)
        .map(|_| {
            let lo = [0; 3].map(|_| r.next() as f32);
            Aabb { lo, hi: lo.map(|x| x + 0.05 * r.next() as f32) }
        })
        .collect()
}

fn check(boxes: &[Aabb<f32>], classes: &[u8], preset: Preset) -> Tree<f32> {
    let (tree, leaves) = build(boxes, classes, preset);
    tree.validate(boxes, classes, &leaves).unwrap();
    assert_eq!(tree.quality().prims, boxes.len());
    tree
}

#[test]
fn every_preset_and_every_small_count() {
    for preset in [Preset::Fast, Preset::Balanced, Preset::Best] {
        for n in (0..40).chain([100, 1000]) {
            let boxes = soup(n, 7 + n as u64);
            let classes: Vec<u8> = (0..n).map(|i| (i % 3) as u8).collect();
            check(&boxes, &vec![0; n], preset);
            check(&boxes, &classes, preset);
        }
    }
}

#[test]
fn leaves_are_as_small_as_asked_for() {
    let boxes = soup(3000, 21);
    let classes = vec![0; boxes.len()];
    let nodes: Vec<usize> = (1..=LEAF_PRIMS)
        .map(|leaf| {
            let settings = BuildSettings { leaf, ..Preset::Balanced.into() };
            let (tree, leaves) = build(&boxes, &classes, settings);
            tree.validate(&boxes, &classes, &leaves).unwrap();
            assert_eq!(leaves.iter().map(|l| l.prims.len()).max(), Some(leaf), "at most {leaf}, and some are full");
            tree.nodes.len()
        })
        .collect();
    assert!(nodes.windows(2).all(|n| n[0] >= n[1]) && nodes[0] > 2 * nodes[7], "{nodes:?}");
}

#[test]
fn awkward_boxes_stay_shallow() {
    let unit = Aabb { lo: [0.0f32; 3], hi: [1.0; 3] };
    let same = vec![unit; 5000];
    let nested: Vec<_> = (1..5000).map(|i| Aabb { lo: [-(i as f32); 3], hi: [i as f32; 3] }).collect();
    let points: Vec<_> = (0..5000).map(|i| Aabb { lo: [(i % 2) as f32; 3], hi: [(i % 2) as f32; 3] }).collect();
    let tiny: Vec<_> =
        soup(2000, 3).iter().map(|b| Aabb { lo: b.lo.map(|x| x * 1e-40), hi: b.hi.map(|x| x * 1e-40) }).collect();
    let huge: Vec<_> =
        soup(2000, 4).iter().map(|b| Aabb { lo: b.lo.map(|x| x * 1.5e38), hi: b.hi.map(|x| x * 3.2e38) }).collect();
    let powers: Vec<_> = (-120..120)
        .map(|e| {
            let x = 2f32.powi(e);
            Aabb { lo: [x, -x, -x], hi: [x, x, x] }
        })
        .collect();
    // A unit ball of small boxes and one that reaches to the end of f32.
    let mut far = soup(5000, 9);
    far.push(Aabb { lo: [-1.0; 3], hi: [3.4e38, 1.0, 1.0] });
    for boxes in [far, same, nested, points, tiny, huge, powers] {
        let tree = check(&boxes, &vec![0; boxes.len()], Preset::Balanced);
        assert!(tree.depth <= 64, "depth {}", tree.depth);
    }
}

#[test]
fn the_tree_does_not_depend_on_threads() {
    let boxes = soup(20_000, 11);
    let classes = vec![0; boxes.len()];
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| build(&boxes, &classes, Preset::Balanced))
    };
    let ((one, one_leaves), (two, two_leaves)) = (with(1), with(2));
    assert_eq!(one_leaves, two_leaves);
    assert_eq!(one.nodes.len(), two.nodes.len());
    for (a, b) in one.nodes.iter().zip(&two.nodes) {
        assert_eq!((a.bounds, a.child, a.count), (b.bounds, b.child, b.count));
    }
}

#[test]
fn validation_finds_planted_faults() {
    let boxes = soup(300, 5);
    let classes = vec![0; boxes.len()];
    let (tree, leaves) = build(&boxes, &classes, Preset::Fast);
    let fault = |change: &dyn Fn(&mut Tree<f32>, &mut Vec<Leaf>)| {
        let (mut t, mut l) = (tree.clone(), leaves.clone());
        change(&mut t, &mut l);
        t.validate(&boxes, &classes, &l).is_err()
    };
    assert!(fault(&|_, l| l[0].prims[0] = l[1].prims[0]));
    assert!(fault(&|_, l| drop(l.pop())));
    assert!(fault(&|t, _| t.nodes[1].bounds[0][1][0] += 10.0));
    assert!(fault(&|t, _| t.nodes[1].bounds[0][1][0] -= 0.5));
    assert!(fault(&|t, _| t.depth -= 1));
    assert!(
        fault(&|t, _| {
            t.nodes.pop();
        }) || tree.nodes.len() == 1
    );
}

#[test]
fn a_grid_costs_what_the_formula_says() {
    // Eight unit boxes in a row, 8 x 1 x 1: one node, one leaf: 1 for the root, 1 for the leaf of the same area.
    let row: Vec<_> = (0..8).map(|i| Aabb { lo: [i as f32, 0.0, 0.0], hi: [i as f32 + 1.0, 1.0, 1.0] }).collect();
    let q = check(&row, &[0; 8], Preset::Balanced).quality();
    assert_eq!((q.nodes, q.leaves, q.sah_cost), (1, 1, 2.0));
}
