//! A world built upon the one before a change is the world built from nothing.

mod common;

use common::{rays, zoo};
use lanecast::ray::Hits;
use lanecast::scene::description::{Description, ItemKind};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Engines, Scratch, engine};

/// All bits of the hits of some rays.
fn hits<S: Engines>(world: &World<S>) -> Vec<(u64, u64, u64, u32, u32)> {
    let rays = rays::<S>(3000, 11);
    let mut hits = Hits::new(0);
    engine::<S>("scalar").unwrap().intersect(world, &rays, &mut hits, &mut Scratch::default(), None);
    let bits = |x: S| x.to_f64().to_bits();
    (0..hits.len()).map(|i| (bits(hits.t[i]), bits(hits.u[i]), bits(hits.v[i]), hits.prim[i], hits.inst[i])).collect()
}

fn same_as_from_nothing<S: Engines>(change: impl Fn(&mut Description), name: &str) {
    let before = zoo(3, true);
    let old = World::<S>::compile(&before, Preset::Balanced).unwrap();
    let mut after = before.clone();
    change(&mut after);
    let (from_nothing, upon) = (
        World::<S>::compile(&after, Preset::Balanced).unwrap(),
        World::<S>::compile_after(&after, Preset::Balanced, Some(&old)).unwrap(),
    );
    let want = hits(&from_nothing);
    assert!(hits(&upon) == want, "{name}");
    let (a, b) = (from_nothing.stats(), upon.stats());
    assert_eq!((a.prims, a.nodes, a.leaves, a.objects), (b.prims, b.nodes, b.leaves, b.objects), "{name}");
    assert_eq!(
        (a.dropped_nonfinite, a.dropped_degenerate, a.dropped_singular),
        (b.dropped_nonfinite, b.dropped_degenerate, b.dropped_singular),
        "{name}"
    );
    // `no change` is the only change that rays do not see.
    assert_eq!(want == hits(&old), name == "no change", "{name}");
}

fn all_changes<S: Engines>() {
    same_as_from_nothing::<S>(|_| (), "no change");
    same_as_from_nothing::<S>(
        |d| {
            // An instance moves: only the upper tree is new.
            let item = d.groups[0].items.iter_mut().rev().find(|i| matches!(i.kind, ItemKind::Instance(_))).unwrap();
            item.transform.translation += glam::DVec3::new(0.7, 0.1, -0.2);
        },
        "an instance moves",
    );
    same_as_from_nothing::<S>(
        |d| {
            let mesh = d.groups[2].items.iter_mut().find(|i| matches!(i.kind, ItemKind::Mesh(_))).unwrap();
            mesh.transform.translation.x += 0.3;
        },
        "a mesh moves in its group",
    );
    same_as_from_nothing::<S>(
        |d| {
            let mut mesh = (*d.meshes[1]).clone();
            mesh.positions[5].x = f64::NAN;
            mesh.positions.iter_mut().for_each(|p| *p *= 1.3);
            d.meshes[1] = mesh.into();
        },
        "a mesh changes",
    );
    same_as_from_nothing::<S>(
        |d| {
            d.groups[0].items.remove(0);
        },
        "numbers change",
    );
}

#[test]
fn reused_objects_change_nothing() {
    all_changes::<f32>();
    all_changes::<f64>();
}
