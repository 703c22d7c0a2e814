//! Trees that mean harm: an error or an answer, no crash, no endless work.

use crate::solid_support;

use glam::{DAffine3, DVec3};
use lanecast::ray::Hits;
use lanecast::scene::solids::{NodeKind, SolidNode, SolidTree, ball};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Scratch, engine};
use solid_support::{cuboid, rays, scene};

/// Number of hits of some rays, or why there is no world.
fn hits(tree: SolidTree) -> Result<usize, String> {
    let world = World::<f64>::compile(&scene(tree), Preset::Fast).map_err(|e| e.to_string())?;
    let rays = rays::<f64>(64, 5);
    let mut hits = Hits::default();
    for name in ["scalar", "packet8"] {
        engine(name).unwrap().intersect(&world, &rays, &mut hits, &mut Scratch::default(), None);
        assert_eq!(hits.len(), 64, "{name}");
    }
    Ok(hits.hit_count())
}

#[test]
fn operations_nested_a_hundred_thousand_deep() {
    for kinds in [[NodeKind::Union, NodeKind::Intersection], [NodeKind::Difference, NodeKind::Xor]] {
        let mut tree = SolidTree::new("deep");
        let mut at = tree.solid(ball(DVec3::ZERO, 1.0).unwrap());
        for i in 0..100_000 {
            // Small balls far out, so that the deep tree holds something to see.
            let place = DVec3::new(f64::from(i % 100), f64::from(i / 100 % 100), f64::from(i / 10_000)) * 0.05;
            let other = tree.solid(ball(place, 0.02).unwrap());
            at = tree.op(kinds[i as usize % 2](vec![at, other]));
        }
        assert!(hits(tree).is_ok());
    }
}

#[test]
fn a_million_leaves() {
    let mut tree = SolidTree::new("many");
    let block = tree.solid(cuboid(DVec3::splat(-1.0), DVec3::splat(1.0)));
    let mut list = vec![block];
    for i in 0..1_000_000u32 {
        let place = DVec3::new(f64::from(i % 100), f64::from(i / 100 % 100), f64::from(i / 10_000)) * 0.02 - 1.0;
        list.push(tree.solid(ball(place, 0.004).unwrap()));
    }
    tree.op(NodeKind::Difference(list));
    assert!(hits(tree).unwrap() > 10);
}

#[test]
fn numbers_and_links_that_lead_nowhere() {
    let broken = |transform: DAffine3| {
        let mut tree = SolidTree::new("broken");
        let ball = tree.solid(ball(DVec3::ZERO, 1.0).unwrap());
        tree.add(SolidNode { transform, material: None, kind: NodeKind::Union(vec![ball]) });
        hits(tree)
    };
    assert!(broken(DAffine3::from_scale(DVec3::splat(f64::NAN))).is_err());
    assert!(broken(DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))).is_err());
    assert!(broken(DAffine3::from_translation(DVec3::splat(f64::INFINITY))).is_err());
    // Far too small and far too large for any use, but numbers.
    for scale in [1e-140, 1e140] {
        let _ = broken(DAffine3::from_scale(DVec3::splat(scale)));
    }
    let mut cycle = SolidTree::new("cycle");
    cycle.op(NodeKind::Union(vec![0]));
    assert!(hits(cycle).unwrap_err().contains("contains itself"));
    // Nothing at all, everything at all.
    let mut nothing = SolidTree::new("nothing");
    let empty = nothing.op(NodeKind::Union(Vec::new()));
    assert_eq!(hits(nothing.clone()), Ok(0));
    nothing.op(NodeKind::Complement(empty));
    assert_eq!(hits(nothing), Ok(0));
}
