//! All generic engines give the same bits: brute force and tree, every width, any-hit and closest-hit.

mod common;

use lanecast::ray::{Counters, Hits, INVALID_ID, PAD, Rays};
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Engines, Scratch};

fn same_bits<S: Engines>(world: &World<S>, seed: u64, n: usize) -> usize {
    same_bits_of(world, &common::rays::<S>(n, seed))
}

fn same_bits_of<S: Engines>(world: &World<S>, rays: &Rays<S>) -> usize {
    let n = rays.len();
    let mut scratch = Scratch::default();
    let (mut want, mut got) = (Hits::<S>::default(), Hits::<S>::default());
    let (mut any_want, mut any) = (Vec::new(), Vec::new());
    let engines = S::engines();
    engines[0].intersect(world, rays, &mut want, &mut scratch, None);
    engines[0].occluded(world, rays, &mut any_want, &mut scratch, None);
    for i in 0..n {
        assert_eq!(any_want[i] == 1, want.is_hit(i), "any-hit and closest-hit differ on ray {i}");
        if want.is_hit(i) {
            assert!(rays.is_live(i) && rays.t_min[i] <= want.t[i] && want.t[i] <= rays.t_max[i]);
        } else {
            assert_eq!(want.t[i].to_f64(), f64::INFINITY);
        }
    }
    for engine in engines.iter().filter(|e| e.is_exact()) {
        for count in [false, true] {
            let mut counters = Counters::default();
            // As after a call for more rays, all of which hit something.
            got.reset(n + PAD);
            got.prim.fill(0);
            got.t.fill(S::ZERO);
            engine.intersect(world, rays, &mut got, &mut scratch, count.then_some(&mut counters));
            for i in n..n.next_multiple_of(PAD) {
                let padding = (got.t[i].to_f64(), got.prim[i], got.inst[i]);
                assert_eq!(padding, (f64::INFINITY, INVALID_ID, INVALID_ID), "{} after {n} rays", engine.name());
            }
            for i in 0..n {
                let bits = |h: &Hits<S>| {
                    let exact = [h.t[i], h.u[i], h.v[i]].map(|x| x.to_f64().to_bits());
                    (exact, h.prim[i], h.inst[i])
                };
                assert_eq!(bits(&got), bits(&want), "{} ray {i} count {count}", engine.name());
            }
            assert_eq!(counters.rays, if count { rays.live_count() as u64 } else { 0 });
            engine.occluded(world, rays, &mut any, &mut scratch, None);
            assert_eq!(any, any_want, "{} any-hit", engine.name());
        }
    }
    want.hit_count()
}

fn all_worlds<S: Engines>() {
    for seed in 0..6 {
        for instances in [false, true] {
            for preset in [Preset::Fast, Preset::Balanced, Preset::Best] {
                let world = World::<S>::compile(&common::zoo(seed, instances), preset).unwrap();
                let hits = same_bits(&world, 100 + seed, 2000);
                assert!(hits > 800, "only {hits} rays hit");
            }
        }
    }
}

#[test]
fn f32_engines_agree() {
    all_worlds::<f32>();
}

#[test]
fn f64_engines_agree() {
    all_worlds::<f64>();
}

fn every_batch_length<S: Engines>() {
    for instances in [false, true] {
        let world = World::<S>::compile(&common::zoo(3, instances), Preset::Balanced).unwrap();
        for n in (0..40).chain([255, 256, 257]) {
            same_bits(&world, n as u64, n);
        }
    }
}

#[test]
fn every_batch_length_and_an_empty_world() {
    every_batch_length::<f32>();
    every_batch_length::<f64>();
    let nothing = lanecast::scene::description::Description::new("nothing");
    let world = World::<f64>::compile(&nothing, Preset::Balanced).unwrap();
    assert_eq!(same_bits(&world, 1, 50), 0);
    assert!(world.bounds().is_none());
}

/// Nodes that an engine visits.
fn nodes<S: Engines>(world: &World<S>, rays: &Rays<S>, engine: &str) -> u64 {
    let (mut hits, mut counters) = (Hits::default(), Counters::default());
    let engine = lanecast::trace::engine::<S>(engine).unwrap();
    engine.intersect(world, rays, &mut hits, &mut Scratch::default(), Some(&mut counters));
    counters.nodes
}

fn coherent_rays_among_shapes<S: Engines>() {
    let (mut in_blocks, mut hits) = (0, 0);
    for seed in 0..12 {
        // The last ones are too many for the list of a block, or of any.
        let count = [12, 40, 200, 1500][(seed / 3) as usize];
        for instances in [false, true] {
            let world = World::<S>::compile(&common::shapes(seed, count, instances), Preset::Balanced).unwrap();
            for n in [1024, 900, 17] {
                let rays = common::coherent::<S>(n, seed);
                hits += same_bits_of(&world, &rays);
                in_blocks += u64::from(nodes(&world, &rays, "packet16") > 4 * nodes(&world, &rays, "stream"));
            }
        }
    }
    assert!(hits > 8000, "only {hits} rays hit");
    // Else this tests no block: packets of sixteen visit the root once each.
    assert!(in_blocks >= 8, "{in_blocks} batches went down the tree as blocks");
}

#[test]
fn f32_blocks_of_coherent_rays_among_shapes() {
    coherent_rays_among_shapes::<f32>();
}

#[test]
fn f64_blocks_of_coherent_rays_among_shapes() {
    coherent_rays_among_shapes::<f64>();
}

/// Any-hit rays of neighbouring pixels from a surface, in all directions: `length` long, by directions of length one, tiny, huge,
/// along an axis, with segments that begin before or behind their origin.
fn short<S: Engines>(n: usize, seed: u64, length: f64) -> Rays<S> {
    let mut r = common::Random(seed);
    let mut rays = Rays::new(n);
    let (middle, across, along) = (r.in_cube() * 3.0, r.direction(), r.direction());
    for i in 0..n {
        let (x, y) = lanecast::camera::morton_decode(i as u32);
        let org = middle + (across * f64::from(x) + along * f64::from(y)) * 0.02;
        let mut dir = r.direction();
        let mut long = length;
        match i % 64 {
            9 => dir.y = 0.0,
            17 => dir = glam::DVec3::NEG_X,
            23 => dir.z = 1e-39,
            33 => (dir, long) = (dir * 1e-12, long * 1e12),
            41 => (dir, long) = (dir * 1e12, long * 1e-12),
            _ => {}
        }
        let t_min = match i % 97 {
            5 => -0.5 * long,
            29 => 0.5 * long,
            77 => 2.0 * long,
            _ => 0.0,
        };
        let exact = |v: glam::DVec3| v.as_vec3().to_array().map(|x| S::from_f64(f64::from(x)));
        rays.set(i, exact(org), exact(dir), S::from_f64(f64::from(t_min as f32)), S::from_f64(f64::from(long as f32)));
    }
    rays
}

fn short_rays_of_neighbours<S: Engines>() {
    let mut hits = 0;
    for seed in 0..24 {
        let world = World::<S>::compile(&common::zoo(seed % 6, seed % 2 == 1), Preset::Balanced).unwrap();
        hits += same_bits_of(&world, &short::<S>(1000, seed, [0.1, 0.5, 2.0][(seed % 3) as usize]));
    }
    assert!((2000..20_000).contains(&hits), "{hits} rays hit");
}

#[test]
fn f32_short_rays_of_neighbours() {
    short_rays_of_neighbours::<f32>();
}

#[test]
fn f64_short_rays_of_neighbours() {
    short_rays_of_neighbours::<f64>();
}

/// The world of a scene file and of what else it reads.
fn written<S: Engines>(files: &[(&str, &str)]) -> World<S> {
    let dir = tempfile::tempdir().expect("a folder");
    files.iter().for_each(|(name, text)| std::fs::write(dir.path().join(name), text).expect("a file"));
    let scene = load(&dir.path().join(files[0].0).to_string_lossy(), &LoadOptions::default()).expect("a scene");
    World::compile(&scene, Preset::Balanced).expect("a world")
}

/// Two solids in one place: the first has every hit, also where a hit lies at the very end of a segment, from however far it is seen.
fn twins<S: Engines>() {
    for solid in [
        "intersection { box; sphere { center 0.5 0 0; radius 1 } }",
        "union { box; sphere { center 0.5 0 0; radius 0.5 } }",
        "difference { box; sphere { center 0.5 0 0; radius 0.4 } }",
    ] {
        let world = written::<S>(&[("twins.kdl", &format!("{solid}\n{solid}\n"))]);
        let mut random = common::Random(3);
        for distance in [10.0, 1e3, 1e5] {
            let mut rays = Rays::<S>::new(4000);
            for i in 0..rays.len() {
                let (org, at) = (random.in_cube().normalize() * distance, random.in_cube());
                let exact = |v: glam::DVec3| v.as_vec3().to_array().map(|x| S::from_f64(f64::from(x)));
                rays.set(i, exact(org), exact(at - org), S::ZERO, S::INFINITY);
            }
            let hits = same_bits_of(&world, &rays);
            assert!(hits > 400, "{hits} of {solid} from {distance}");
            let (mut found, mut scratch) = (Hits::<S>::default(), Scratch::default());
            S::engines()[1].intersect(&world, &rays, &mut found, &mut scratch, None);
            for i in 0..rays.len() {
                assert!(!found.is_hit(i) || found.prim[i] < 2, "ray {i} hits the second of {solid} from {distance}");
                rays.t_max[i] = if found.is_hit(i) { found.t[i] } else { S::INFINITY };
            }
            assert_eq!(same_bits_of(&world, &rays), hits, "segments are closed: {solid} from {distance}");
        }
    }
}

#[test]
fn twins_and_ends_of_segments() {
    twins::<f32>();
    twins::<f64>();
}

/// A line in the lower face of a triangle's box, whose interval begins at 0 there and says nothing: what lies behind the start is no hit at 0.
#[test]
fn what_lies_behind_is_not_at_the_start() {
    let boat = "v 0 -1 0\nv 0 1 0\nv 1 0 5\nv -1 0 5\nf 1 2 3\nf 2 1 4\nf 1 3 4\nf 2 4 3\n\
                v -1 -1 6\nv 1 -1 6\nv -1 1 6\nv 1 1 6\nv -1 -1 7\nv 1 -1 7\nv -1 1 7\nv 1 1 7\n\
                f 5 7 8\nf 5 8 6\nf 9 10 12\nf 9 12 11\nf 5 6 10\nf 5 10 9\nf 7 11 12\nf 7 12 8\nf 5 9 11\nf 5 11 7\nf 6 8 12\nf 6 12 10\n";
    let world =
        written::<f32>(&[("m.kdl", "union { mesh \"boat.obj\"; sphere { center 50 0 0 } }"), ("boat.obj", boat)]);
    let one = written::<f32>(&[("one.obj", "v 0 -1 0\nv 0 1 0\nv 1 0 5\nf 1 2 3\n")]);
    let mut hits = Hits::default();
    for x in [-0.001, 0.0, 0.001] {
        let mut rays = Rays::<f32>::new(16);
        (0..16).for_each(|i| rays.set(i, [x, 0.5, 3.0], [0.0, 0.0, 1.0], 0.0, f32::INFINITY));
        assert_eq!(same_bits_of(&world, &rays), 16);
        f32::engines()[1].intersect(&world, &rays, &mut hits, &mut Scratch::default(), None);
        assert_eq!(hits.t[0], 3.0, "the cube, from x = {x}");
        (0..16).for_each(|i| rays.t_min[i] = -1e-3);
        assert_eq!(same_bits_of(&one, &rays), 0, "the triangle is three units behind x = {x}");
    }
}

/// Numbers beyond reason cost their neighbours nothing and come to an end.
#[test]
fn rays_beyond_reason() {
    let world = written::<f32>(&[("m.kdl", "union { half-space; sphere }")]);
    let mut rays = Rays::<f32>::new(16);
    for i in 0..16 {
        let (far, slow) = [(1e8, 1e-37), (1e30, 1e-20), (1e12, 1e-33), (3.0, 1.0)][i % 4];
        rays.set(i, [far, 0.0, -5.0], [slow, 0.0, slow], 0.0, f32::INFINITY);
    }
    same_bits_of(&world, &rays);
    let placed = "define \"d\" { sphere; box { center 3 0 0 } }\ninstance \"d\" { scale 0.001; shear zx=0.5 }";
    let world = written::<f32>(&[("m.kdl", placed)]);
    for huge in [1e20, 1e37, 3e38] {
        let (mut random, mut rays) = (common::Random(8), Rays::<f32>::new(1000));
        for i in 0..1000 {
            let (org, at) = (random.in_cube() * 0.02, random.in_cube() * 0.003);
            let dir = if i % 8 == 0 { [huge, huge, 0.0] } else { (at - org).as_vec3().to_array() };
            rays.set(i, org.as_vec3().to_array(), dir, 0.0, f32::INFINITY);
        }
        assert!(same_bits_of(&world, &rays) > 100);
    }
    let quad = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n";
    let placed = "define \"q\" { mesh \"q.obj\" }\ninstance \"q\" { scale 1e-6 }\ninstance \"q\" { scale 1e-6; translate 8e-6 0 0 }";
    let world = written::<f32>(&[("m.kdl", placed), ("q.obj", quad)]);
    let mut rays = Rays::<f32>::new(64);
    for i in 0..64 {
        let dir = if i % 16 == 0 { [0.0, -8e31, -1e33] } else { [0.0, (i % 16) as f32 * 1e-7 - 8e-7, -1e-5] };
        rays.set(i, [(i / 32) as f32 * 8e-6, 0.0, 1e-5], dir, 0.0, f32::INFINITY);
    }
    assert!(same_bits_of(&world, &rays) > 50);
}

/// A light in the plane of a wall: rays towards it that start in that plane, too, and have the wall behind them.
#[test]
fn rays_in_the_plane_of_a_wall_and_its_light() {
    let wall = written::<f32>(&[("wall.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n")]);
    let light = [5.0, 0.25, 0.0];
    let starts =
        [[2.0, 0.3125, 0.0], [2.0, 0.3125, 1.0], [4.0, -3.0, 0.5], [1.5, 1.0, 2.0], [3.0, 3.0, -1.0], [3.0, 0.5, 0.0]];
    let mut rays = Rays::<f32>::new(1024);
    for i in 0..rays.len() {
        let start = starts[i % starts.len()];
        rays.set(i, start, [0, 1, 2].map(|a| light[a] - start[a]), 0.0, 1.0);
    }
    let mut occluded = Vec::new();
    for engine in f32::engines() {
        engine.occluded(&wall, &rays, &mut occluded, &mut Scratch::default(), None);
        assert!(occluded.iter().all(|x| *x == 0), "{}", engine.name());
    }
}
