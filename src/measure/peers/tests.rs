//! Peers against our scalar engine on a soup under two instances; what is said of peers that are not there.

use std::path::PathBuf;

use glam::{DAffine3, DVec3};

use super::*;
use crate::math::Random;
use crate::measure::agreement::compare;
use crate::measure::answers::Answers;
use crate::scene::description::{Description, Group, Item, ItemKind};
use crate::scene::mesh::Mesh;
use crate::scene::world::{Compiles, Preset, World};
use crate::trace::engine;

/// 3000 triangles, once as they are and once turned, moved and scaled.
fn soup() -> Description {
    let (mut random, mut mesh) = (Random(1), Mesh::default());
    for i in 0..3000 {
        let centre = random.cube() * 4.0;
        mesh.positions.extend([0; 3].map(|_| (centre + random.cube() * 0.4).as_vec3().as_dvec3()));
        mesh.triangles.push([0, 1, 2].map(|k| 3 * i + k));
    }
    let item = |kind, transform| Item { transform, material: None, kind };
    let mut scene = Description::new("soup");
    scene.meshes.push(Arc::new(mesh));
    let moved = DAffine3::from_rotation_y(1.0) * DAffine3::from_translation(DVec3::X * 3.0);
    scene.groups = vec![Group::default(), Group::default()];
    scene.groups[0].items =
        vec![item(ItemKind::Mesh(0), DAffine3::from_scale(DVec3::splat(0.5))), item(ItemKind::Instance(1), moved)];
    scene.groups[1].items = vec![item(ItemKind::Mesh(0), DAffine3::IDENTITY)];
    scene
}

/// The soup again, but the moved one five times: mirrored, sheared, two of them under one parent.
fn instances() -> Description {
    let mut scene = soup();
    let item = |child, transform| Item { transform, material: None, kind: ItemKind::Instance(child) };
    let mut sheared = DAffine3::from_scale_rotation_translation(DVec3::splat(0.3), Default::default(), DVec3::Y * 2.0);
    sheared.matrix3.y_axis.x = 0.2;
    let mirrored = DAffine3::from_scale(DVec3::new(-0.4, 0.7, 0.5)) * DAffine3::from_rotation_z(0.6);
    scene.groups.push(Group { items: vec![item(1, sheared), item(1, mirrored)], ..Default::default() });
    let far = DAffine3::from_translation(DVec3::new(2.0, -3.0, 1.0));
    scene.groups[0].items.extend([item(1, mirrored), item(2, far), item(2, DAffine3::from_rotation_x(2.0))]);
    scene
}

/// Rays of several lengths and batch sizes, every seventh dead.
fn rays() -> Vec<Rays<f32>> {
    let mut random = Random(2);
    let mut batch = |size: usize| {
        let mut rays = Rays::new(size);
        for i in (0..size).filter(|i| i % 7 != 3) {
            let (org, target) = (random.cube() * 9.0, random.cube() * 3.0);
            let end = if i % 3 == 0 { 0.7 } else { f32::INFINITY };
            rays.set(i, org.as_vec3().into(), (target - org).as_vec3().into(), 0.05, end);
        }
        rays
    };
    [1024, 1, 1023, 1000, 37].into_iter().map(&mut batch).collect()
}

/// Both queries of every peer against scalar; returns how many peers there were.
fn agree(scene: &Description, invitation: &Invitation, threads: usize) -> std::result::Result<usize, String> {
    let workers = Workers::new(threads).unwrap().flushing(true);
    let (world, batches) = (World::<f32>::compile(scene, Preset::Fast).unwrap(), rays());
    let scalar = engine::<f32>("scalar").unwrap();
    let mut count = 0;
    for guest in invitation.open(&world, &workers).unwrap() {
        for peer in guest.modes? {
            let what = format!("{} {}", peer.facts().name, peer.facts().mode);
            assert!(peer.facts().bytes > 100_000 && peer.facts().build_seconds > 0.0, "{what}: {:?}", peer.facts());
            for query in [Query::Closest, Query::Any] {
                let mut ours = Answers::new(query, &batches);
                workers.pass(scalar, &world, &batches, &mut ours);
                let hits = ours.hit_count();
                assert!(hits > 1000 && hits < 2600, "{hits} hits test little");
                assert!(every_instance_is_seen(&ours, world.instances.len()));
                // Twice: rays are packed anew although the first pass used them up.
                for _ in 0..2 {
                    let mut theirs = Answers::new(query, &batches);
                    workers.peer_pass(&*peer, &batches, &mut theirs);
                    let agreement = compare(&ours, &theirs);
                    assert_eq!((agreement.differences(), agreement.ties), (0, 0), "{what} {query:?}: {agreement:?}");
                    same_weights(&ours, &theirs, &what);
                }
            }
            count += 1;
        }
    }
    Ok(count)
}

fn every_instance_is_seen(answers: &Answers<f32>, count: usize) -> bool {
    let Answers::Closest(batches) = answers else { return true };
    (0..count as u32).all(|inst| batches.iter().any(|hits| hits.inst[..hits.len()].contains(&inst)))
}

/// u and v mean the same for both.
fn same_weights(ours: &Answers<f32>, theirs: &Answers<f32>, what: &str) {
    if let (Answers::Closest(a), Answers::Closest(b)) = (ours, theirs) {
        for (a, b) in a.iter().zip(b) {
            for i in (0..a.len()).filter(|&i| a.is_hit(i)) {
                let apart = (a.u[i] - b.u[i]).abs().max((a.v[i] - b.v[i]).abs());
                assert!(apart < 2e-3, "{what}: u v {} {} against {} {}", a.u[i], a.v[i], b.u[i], b.v[i]);
            }
        }
    }
}

#[test]
fn obvhs_finds_what_scalar_finds() {
    let invitation = Invitation { names: vec!["obvhs".into()], embree: None };
    for threads in [1, 3] {
        assert_eq!(agree(&soup(), &invitation, threads), Ok(2));
    }
    assert_eq!(agree(&instances(), &invitation, 1), Ok(2));
}

#[cfg(feature = "peers")]
#[test]
fn peers_of_the_feature_find_what_scalar_finds() {
    for name in ["bvh", "parry"] {
        let invitation = Invitation { names: vec![name.into()], embree: None };
        for (scene, threads) in [(soup(), 1), (soup(), 3), (instances(), 1)] {
            assert_eq!(agree(&scene, &invitation, threads), Ok(2), "{name}");
        }
    }
}

/// The name is known, the row says what to do.
#[cfg(not(feature = "peers"))]
#[test]
fn peers_of_the_feature_are_not_in_this_build() {
    for name in ["bvh", "parry"] {
        let why = refusal::<f32>(&soup(), &[name], "");
        assert_eq!(why, "not in this build: cargo build --features peers", "{name}");
    }
}

/// The name is known, the row says why there is nothing.
#[test]
fn a_peer_that_no_build_has_says_so() {
    let why = refusal::<f32>(&soup(), &["tinybvh"], "");
    assert!(why.starts_with("not in any build: a C++ header"), "{why}");
}

#[test]
fn every_mode_of_embree_finds_what_scalar_finds() {
    let invitation = Invitation { names: vec!["embree".into(), "embree-robust".into()], embree: None };
    for (scene, threads) in [(soup(), 1), (soup(), 2), (instances(), 1), (instances(), 2)] {
        match agree(&scene, &invitation, threads) {
            Ok(count) => assert_eq!(count, 16),
            // A library that was named must work.
            Err(why) if std::env::var_os(embree::VARIABLE).is_some() => panic!("{why}"),
            Err(why) => println!("SKIPPED: {why}"),
        }
    }
}

/// Why the only guest of `names` has no mode.
fn refusal<S: Compiles>(scene: &Description, names: &[&str], library: &str) -> String {
    let invitation =
        Invitation { names: names.iter().map(|name| name.to_string()).collect(), embree: Some(PathBuf::from(library)) };
    let world = World::<S>::compile(scene, Preset::Fast).unwrap();
    let guests = invitation.open(&world, &Workers::new(1).unwrap()).unwrap();
    guests.into_iter().next().unwrap().modes.err().unwrap()
}

#[test]
fn what_is_missing_is_said() {
    let why = refusal::<f32>(&soup(), &["embree"], "/nowhere/libembree4.so");
    assert!(why.contains("--embree") && why.contains("/nowhere/libembree4.so"), "{why}");
    assert!(refusal::<f64>(&soup(), &["obvhs"], "").contains("f32 only"));
    let empty = Description::new("empty");
    assert!(refusal::<f32>(&empty, &["obvhs"], "").contains("no triangles"));
}

/// A library that loads but is something else is refused by the first name it lacks.
#[cfg(target_os = "linux")]
#[test]
fn other_libraries_are_refused() {
    let why = refusal::<f32>(&soup(), &["embree"], "libc.so.6");
    assert!(why.contains("not an Embree 4 library") && why.contains("rtcNewDevice"), "{why}");
}

#[test]
fn unknown_peers_are_refused_with_a_suggestion() {
    let invitation = Invitation { names: vec!["embre".into()], embree: None };
    let text = invitation.check().unwrap_err().to_string();
    assert!(text.contains("did you mean `embree`") && text.contains("obvhs"), "{text}");
}

#[test]
fn numbers_of_hits_are_renamed_and_misses_left() {
    let mut hits = Hits::<f32>::new(3);
    hits.prim[1] = 1;
    rename(&mut hits, |prim, _| [[7, 8], [5, 6]].get(prim as usize).copied());
    assert_eq!((hits.prim[1], hits.inst[1]), (5, 6));
    assert!(!hits.is_hit(0) && !hits.is_hit(2));
}
