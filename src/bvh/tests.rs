//! Trees over awkward boxes are valid, bounded in depth, and do not depend on the number of threads.

use super::cost::Cost;
use super::refine::{Place, Refined};
use super::topdown::{self, Part, Rules, Span};
use super::*;
use crate::lanes::{Lanes, Real};
use crate::math::{Aabb, Random};

fn soup(n: usize, seed: u64) -> Vec<Aabb<f32>> {
    let mut r = Random(seed);
    (0..n)
        .map(|_| {
            let lo = [0; 3].map(|_| r.unit() as f32);
            Aabb { lo, hi: lo.map(|x| x + 0.05 * r.unit() as f32) }
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
fn crowds_of_several_classes_become_leaves_of_one_each() {
    // So small that a crowd costs least as one leaf, if it were of one class.
    let crowds: Vec<_> = soup(250, 17)
        .iter()
        .flat_map(|place| {
            soup(8, 18).into_iter().map(|b| [b.lo, b.hi].map(|p| [0, 1, 2].map(|i| place.lo[i] + 1e-3 * p[i])))
        })
        .map(|[lo, hi]| Aabb { lo, hi })
        .collect();
    let mixed: Vec<u8> = (0..crowds.len()).map(|i| (i % 3 % 2) as u8).collect();
    for preset in [Preset::Fast, Preset::Balanced, Preset::Best] {
        check(&crowds, &mixed, preset);
        let tree = check(&crowds, &vec![0; crowds.len()], preset);
        assert!((250..275).contains(&tree.quality().leaves), "{}", tree.quality().leaves);
    }
}

#[test]
fn leaves_are_as_small_as_asked_for() {
    // Nothing is gained by keeping such boxes apart.
    let boxes: Vec<_> = soup(3000, 21).iter().map(|b| Aabb { lo: b.lo, hi: b.lo.map(|x| x + 5.0) }).collect();
    let classes = vec![0; boxes.len()];
    let nodes: Vec<usize> = (1..=LEAF_PRIMS)
        .map(|leaf| {
            let settings = BuildSettings { leaf, ..Preset::Balanced.into() };
            let (tree, leaves) = build(&boxes, &classes, settings);
            tree.validate(&boxes, &classes, &leaves).unwrap();
            assert_eq!(
                leaves.iter().map(|l| usize::from(l.count)).max(),
                Some(leaf),
                "at most {leaf}, and some are full"
            );
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
    let boxes = soup(70_000, 11);
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
    assert_eq!(one.wide.len(), two.wide.len());
    for (a, b) in one.wide.iter().zip(&two.wide) {
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
    assert!(fault(&|_, l| l[0].list[0] = l[1].list[0]));
    assert!(fault(&|_, l| l.truncate(l.len() - 1)));
    assert!(fault(&|_, l| l[0].count = 9));
    assert!(fault(&|t, _| t.nodes[1].bounds[0][1][0] += 10.0));
    assert!(fault(&|t, _| t.nodes[1].bounds[0][1][0] -= 0.5));
    assert!(fault(&|t, _| t.depth -= 1));
    assert_eq!(tree.wide.is_empty(), <<f32 as Real>::Children as Lanes>::N == WIDTH);
    if !tree.wide.is_empty() {
        assert!(fault(&|t, _| t.wide_depth -= 1));
        assert!(fault(&|t, _| t.wide[0].bounds[1][1][0] = -1.0));
        assert!(fault(&|t, _| t.wide[1].child[0] += 1));
        assert!(fault(&|t, _| {
            t.wide.pop();
        }));
    }
    assert!(
        fault(&|t, _| {
            t.nodes.pop();
        }) || tree.nodes.len() == 1
    );
}

#[test]
fn what_costs_less_is_chosen() {
    // Eight boxes at one place: one leaf, which costs 1 for the root and 1 for itself.
    let heap = [Aabb { lo: [0.0f32; 3], hi: [1.0; 3] }; 8];
    let q = check(&heap, &[0; 8], Preset::Balanced).quality();
    assert_eq!((q.nodes, q.leaves, q.sah_cost), (1, 1, 2.0));
    // Eight unit cubes in a row, 100 apart: a leaf for each, 3 of the half area of 701 x 1 x 1.
    let row: Vec<_> =
        (0..8).map(|i| 100.0 * i as f32).map(|x| Aabb { lo: [x, 0.0, 0.0], hi: [x + 1.0, 1.0, 1.0] }).collect();
    let q = check(&row, &[0; 8], Preset::Balanced).quality();
    assert_eq!((q.nodes, q.leaves), (1, 8));
    assert!((q.sah_cost - (1.0 + 8.0 * 3.0 / 1403.0)).abs() < 1e-12);
}

#[test]
fn walls_are_kept_apart_from_what_is_in_the_room() {
    // Two triangles each of a low room's floor and ceiling, and some small boxes between them. Floor and ceiling have more area
    // than the room, and yet no leaf reaches from one to the other.
    let wall = |y: f32| Aabb { lo: [0.0, y, 0.0], hi: [1.0, y, 1.0] };
    let mut room = [wall(0.0), wall(0.0), wall(0.35), wall(0.35)].to_vec();
    let inside = |p: [f32; 3]| [0.3 + 0.3 * p[0], 0.1 + 0.1 * p[1], 0.3 + 0.3 * p[2]];
    room.extend(soup(12, 55).iter().map(|b| Aabb { lo: inside(b.lo), hi: inside(b.hi) }));
    for preset in [Preset::Fast, Preset::Balanced, Preset::Best] {
        let (_, leaves) = build(&room, &vec![0; room.len()], preset);
        let tallest = leaves.iter().map(|leaf| {
            let all: Vec<_> = leaf.prims().iter().map(|&p| room[p as usize]).collect();
            join(&all).hi[1] - join(&all).lo[1]
        });
        assert!(tallest.fold(0.0, f32::max) < 0.2);
    }
}

/// Primitives in a block.
const BLOCK: usize = 4;

/// Parts in their new order, nodes, parts of the leaves.
type Grown = (Vec<Part>, Vec<topdown::Node>, Vec<std::ops::Range<usize>>);

/// Builds the binary tree of some boxes and checks it: exact boxes and counts, each part in one leaf. Leaves come in order.
fn grown(boxes: &[Aabb<f32>]) -> Grown {
    grown_to(boxes, 64)
}

fn grown_to(boxes: &[Aabb<f32>], deepest: usize) -> Grown {
    let mut parts: Vec<Part> = boxes.iter().zip(0..).map(|(b, prim)| Part::new(Span::new(b.lo, b.hi), prim)).collect();
    let cost = Cost::new(join(boxes).half_area() as f32);
    let nodes = topdown::build(&mut parts, Rules { block: BLOCK, least: 1e-6, deepest, cost });
    let mut prims: Vec<u32> = parts.iter().map(Part::prim).collect();
    prims.sort_unstable();
    assert!(prims.into_iter().eq(0..boxes.len() as u32));
    let mut leaves = Vec::new();
    let mut stack = vec![0];
    while let Some(at) = stack.pop() {
        let node: &topdown::Node = &nodes[at];
        if node.leaf {
            let first = node.at as usize;
            leaves.push(first..first + node.count as usize);
        } else {
            let children = node.children(at);
            assert_eq!(node.count, children.iter().map(|&c| nodes[c].count).sum::<u32>());
            assert_eq!(node.bounds, union(children.map(|c| nodes[c].bounds)));
            stack.extend(children.into_iter().rev());
        }
    }
    assert_eq!((leaves[0].start, leaves.last().unwrap().end), (0, parts.len()));
    assert!(leaves.windows(2).all(|l| l[0].end == l[1].start));
    for leaf in &leaves {
        let all: Vec<_> = parts[leaf.clone()].iter().map(|p| boxes[p.prim() as usize]).collect();
        let least = cost.is_one_leaf(join(&all).half_area() as f32, all.len() as u32);
        assert!(leaf.len() == 1 || leaf.len() > BLOCK || least, "a leaf of {}", leaf.len());
    }
    (parts, nodes, leaves)
}

fn join(boxes: &[Aabb<f32>]) -> Aabb<f32> {
    boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b))
}

fn union([a, b]: [[[f32; 3]; 2]; 2]) -> [[f32; 3]; 2] {
    [[0, 1, 2].map(|i| a[0][i].min(b[0][i])), [0, 1, 2].map(|i| a[1][i].max(b[1][i]))]
}

fn area([lo, hi]: [[f32; 3]; 2]) -> f32 {
    Span::new(lo, hi).area()
}

#[test]
fn parts_know_their_numbers() {
    for prim in [0, 1, 0xffff, 0x1_0000, 0xdead_beef, u32::MAX] {
        let [lo, hi] = [[-1.0, 0.0, 0.25], [1.0, 0.5, 0.75]];
        let part = Part::new(Span::new(lo, hi), prim);
        assert_eq!(part.prim(), prim);
    }
}

#[test]
fn every_part_is_in_one_leaf() {
    for n in (1..60).chain([500, 9000]) {
        // Few boxes are met by many rays each; of many, some cost least together.
        let (_, _, leaves) = grown(&soup(n, n as u64));
        assert!(if n < 10 { leaves.len() == n } else { (n.div_ceil(BLOCK)..=n).contains(&leaves.len()) });
    }
}

#[test]
fn paths_end_soon_where_they_are_told_to() {
    // Crowded in a corner: halving 1000 parts takes ten nodes more and a leaf.
    let corner: Vec<_> =
        soup(1000, 3).iter().map(|b| b.lo.map(|x| x.powi(12))).map(|p| Aabb { lo: p, hi: p }).collect();
    assert!(depth(&corner, 64) > 15);
    assert!((10..=13).contains(&depth(&corner, 1)));
}

fn depth(boxes: &[Aabb<f32>], deepest: usize) -> usize {
    let (_, nodes, _) = grown_to(boxes, deepest);
    let (mut most, mut stack) = (0, vec![(0, 1)]);
    while let Some((at, depth)) = stack.pop() {
        most = most.max(depth);
        if !nodes[at].leaf {
            stack.extend(nodes[at].children(at).map(|child| (child, depth + 1)));
        }
    }
    most
}

#[test]
fn parts_with_one_centre_are_halved_or_left_together() {
    // Pairs of a square's two triangles have equal boxes.
    let pairs: Vec<_> = soup(300, 31).into_iter().flat_map(|b| [b, b]).collect();
    assert!((300..=600).contains(&grown(&pairs).2.len()));
    let unit = Aabb { lo: [0.0f32; 3], hi: [1.0; 3] };
    assert_eq!(grown(&[unit; 4]).2.len(), 4, "a block");
    assert_eq!(grown(&[unit; 5]).2.len(), 1, "more than a block");
}

#[test]
fn the_first_split_is_the_cheapest_of_all_planes() {
    for n in [3, 4, 5, 12] {
        let boxes = soup(n, 40 + n as u64);
        let (_, nodes, _) = grown(&boxes);
        let model = Cost::new(join(&boxes).half_area() as f32);
        let cost = |of: &[Aabb<f32>]| model.guess(join(of).half_area() as f32, of.len() as u32, BLOCK);
        let planes = (0..3).flat_map(|axis| {
            let mut sorted = boxes.clone();
            sorted.sort_by(|a, b| (a.lo[axis] + a.hi[axis]).total_cmp(&(b.lo[axis] + b.hi[axis])));
            (1..n).map(move |left| cost(&sorted[..left]) + cost(&sorted[left..])).collect::<Vec<_>>()
        });
        let least = planes.fold(f32::INFINITY, f32::min);
        let side = |at: usize| model.guess(area(nodes[at].bounds), nodes[at].count, BLOCK);
        let chosen = nodes[0].children(0).map(side).iter().sum::<f32>();
        assert!((chosen - least).abs() < 1e-5 * least, "{chosen} instead of {least}");
    }
}

#[test]
fn refinement_moves_subtrees_to_where_they_cost_less() {
    let mut r = Random(77);
    // Long thin boxes in all directions: what splits by planes are worst at.
    let boxes: Vec<_> = (0..4000)
        .map(|_| {
            let (lo, size) = ([0; 3].map(|_| r.unit() as f32), [0; 3].map(|_| r.unit().powi(6) as f32));
            Aabb { lo, hi: [0, 1, 2].map(|i| lo[i] + size[i]) }
        })
        .collect();
    let (_, nodes, _) = grown(&boxes);
    assert!(Refined::new(&nodes, 1, &[]).is_none());
    for whole in [1, BLOCK as u32] {
        let kept = |at: usize| nodes[at].leaf || nodes[at].count <= whole;
        let (mut before, mut clusters, mut stack) = (0.0, Vec::new(), vec![0]);
        while let Some(at) = stack.pop() {
            if kept(at) {
                clusters.push(at);
            } else {
                before += area(nodes[at].bounds);
                stack.extend(nodes[at].children(at));
            }
        }
        let refined = Refined::new(&nodes, whole, &[1.0, 0.5]).unwrap();
        let (mut after, mut found) = (0.0, Vec::new());
        refined_area(&refined, &nodes, 0, &mut after, &mut found);
        clusters.sort_unstable();
        found.sort_unstable();
        assert_eq!(clusters, found, "each cluster once");
        assert!(after < 0.95 * before, "{before} to {after}");
    }
}

/// Sums up the areas of inner nodes below a place and collects what is kept; returns the box of all.
fn refined_area(
    tree: &Refined,
    nodes: &[topdown::Node],
    at: usize,
    sum: &mut f32,
    kept: &mut Vec<usize>,
) -> [[f32; 3]; 2] {
    match tree.place(at) {
        Place::Kept(node) => {
            kept.push(node);
            nodes[node].bounds
        }
        Place::Inner(one, other) => {
            let all = union([one, other].map(|at| refined_area(tree, nodes, at, sum, kept)));
            *sum += area(all);
            all
        }
    }
}
