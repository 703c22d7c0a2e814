//! Scenes made to break tracers (../shared/scenes/pathological): counts, limits on time and memory, known rays.

mod binary;

use std::collections::HashMap;
use std::path::Path;
use std::time::Duration;

use binary::shared;
use binary::watch::watch;
use glam::DVec3;
use lanecast::ray::{Hits, INVALID_ID, Rays};
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Engines, Scratch};

/// Scenes in two halves, so that each half stays quick.
const HALVES: [[&str; 7]; 2] = [
    ["nonfinite_sphere", "huge_range", "duplicates_x64", "same_centroid", "same_bounds", "denormal", "empty"],
    ["flat_grid", "needles", "teapot_in_stadium", "watertight_sphere", "single", "exponential", "empty"],
];

const LIMIT: Duration = Duration::from_secs(30);
const MEMORY: u64 = 2 << 30;

fn expected() -> Option<serde_json::Value> {
    let text = std::fs::read_to_string(shared("scenes/pathological/expect.json")?).expect("a text file");
    Some(serde_json::from_str(&text).expect("JSON"))
}

/// `info`, `verify` and `render` of every scene: they succeed, in time, in memory; the counts are those expected.
fn commands(names: &[&str]) {
    let Some(expected) = expected() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    for &name in names {
        let Some(scene) = shared(&format!("scenes/pathological/{name}.ply")) else { return };
        let scene = scene.to_str().expect("UTF-8");
        let run = |more: &[&str]| {
            let watched = watch(folder.path(), &[&[more[0], scene], &more[1..]].concat(), LIMIT);
            let (code, seconds) = (watched.ended.code, watched.seconds);
            assert_eq!(code, Some(0), "{name} {more:?}: {}{}", watched.ended.out, watched.ended.err);
            assert!(watched.peak.is_none_or(|peak| peak < MEMORY), "{name} {more:?}: {:?} bytes", watched.peak);
            println!("{name} {}: {seconds:.2} s, {} MiB", more[0], watched.peak.unwrap_or(0) >> 20);
            watched.ended
        };
        let counts = run(&["info", "--json"]).json()["counts"].clone();
        let want = |key: &str| expected[name][key].as_u64().unwrap_or(0);
        assert_eq!(counts["dropped_nonfinite"], want("nonfinite_triangles"), "{name}");
        assert_eq!(counts["dropped_degenerate"], want("degenerate_zero_area"), "{name}");
        let stored = want("triangles") - want("nonfinite_triangles") - want("degenerate_zero_area");
        assert_eq!(counts["primitives"], stored, "{name}");
        assert_eq!(counts["instanced_primitives"], stored, "{name} is placed once");

        let report = run(&["verify", "--rays", "100", "--json"]).json();
        let lines = report["lines"].as_array().expect("lines");
        let hits: u64 = lines.iter().filter(|l| l["class"] == "scatter").filter_map(|l| l["hits"].as_u64()).sum();
        assert!(report["pass"] == true && (hits > 0) == (stored > 0), "{name}: {hits} hits");

        let picture = folder.path().join("out.exr");
        let report = run(&["render", "-o", "out.exr", "--size", "160x96", "--aov", "Z,id.primitive", "--json"]).json();
        assert_eq!((&report["complete"], &report["rays"]["primary"]), (&true.into(), &(160 * 96).into()), "{name}");
        let film = lanecast::film::exr::read(&picture).expect("an EXR file");
        assert_eq!((film.width, film.height), (160, 96), "{name}");
        let seen = film.u32_plane("id.primitive").expect("ids").iter().filter(|&&id| id != INVALID_ID).count();
        assert!(stored > 0 || seen == 0, "{name}: {seen} pixels show something");
        std::fs::remove_file(picture).expect("the picture");
    }
}

#[test]
fn commands_survive_the_first_half() {
    commands(&HALVES[0]);
}

#[test]
fn commands_survive_the_second_half() {
    commands(&HALVES[1]);
}

/// A ray: origin, direction, segment from 0 on.
type Ray = ([f64; 3], [f64; 3]);

/// Most ray-primitive tests that brute force is given.
const BRUTE_LIMIT: usize = 1 << 27;

/// Closest hits of `rays` by every engine of both precisions as (t, prim); engines of one precision must agree.
fn traced(path: &Path, rays: &[Ray]) -> [Vec<Option<(f64, u32)>>; 2] {
    traced_at(path, rays, false)
}

/// The same. `shared`: where several triangles are met in one place, engines with an arithmetic of their own may name any of them.
fn traced_at(path: &Path, rays: &[Ray], shared: bool) -> [Vec<Option<(f64, u32)>>; 2] {
    fn one<S: Engines>(path: &Path, list: &[Ray], shared: bool) -> Vec<Option<(f64, u32)>> {
        let description = load(path.to_str().expect("UTF-8"), &LoadOptions::default()).expect("a scene");
        let world = World::<S>::compile(&description, Preset::Balanced).expect("a world");
        let mut rays = Rays::new(list.len());
        for (i, (org, dir)) in list.iter().enumerate() {
            rays.set(i, org.map(S::from_f64), dir.map(S::from_f64), S::ZERO, S::INFINITY);
        }
        let mut want: Option<Vec<_>> = None;
        let affordable = list.len() * world.stats().prims as usize <= BRUTE_LIMIT;
        for engine in S::engines().iter().filter(|e| affordable || e.name() != "brute") {
            let mut hits = Hits::new(0);
            engine.intersect(&world, &rays, &mut hits, &mut Scratch::default(), None);
            let mut flags = Vec::new();
            engine.occluded(&world, &rays, &mut flags, &mut Scratch::default(), None);
            let found = |i| hits.is_hit(i).then(|| (hits.t[i].to_f64(), hits.prim[i]));
            let got: Vec<_> = (0..list.len()).map(found).collect();
            assert!(got.iter().zip(&flags).all(|(hit, &flag)| hit.is_some() == (flag != 0)), "{}", engine.name());
            let want = want.get_or_insert_with(|| got.clone());
            if engine.is_exact() {
                assert_eq!(want, &got, "{}", engine.name());
                continue;
            }
            for (want, got) in want.iter().zip(&got) {
                let same = |a: &(f64, u32), b: &(f64, u32)| (shared || a.1 == b.1) && (a.0 - b.0).abs() <= 1e-5 * a.0;
                let fits = want.as_ref().zip(got.as_ref()).map_or(want == got, |(a, b)| same(a, b));
                assert!(fits, "{}: {want:?} {got:?}", engine.name());
            }
        }
        want.expect("engines")
    }
    [one::<f32>(path, rays, shared), one::<f64>(path, rays, shared)]
}

/// 19 spheres of 528 triangles, radius 10^e at x = 3 10^e: from the origin along +x the smallest comes first, and
/// from behind each of them the next one does.
#[test]
fn of_spheres_over_eighteen_powers_of_ten_the_smallest_comes_first() {
    let Some(path) = shared("scenes/pathological/huge_range.ply") else { return };
    let starts: Vec<f64> = (-6..12).map(|e| 5.0 * 10f64.powi(e)).collect();
    let mut rays: Vec<Ray> = vec![([0.0; 3], [1.0, 0.0, 0.0])];
    rays.extend(starts.iter().map(|&x| ([x, 0.0, 0.0], [1.0, 0.0, 0.0])));
    for hits in traced(&path, &rays) {
        for (sphere, hit) in hits.iter().enumerate() {
            let (t, prim) = hit.unwrap_or_else(|| panic!("sphere {sphere} is missed"));
            let front = 2.0 * 10f64.powi(sphere as i32 - 6);
            let from = if sphere == 0 { 0.0 } else { starts[sphere - 1] };
            assert_eq!(prim as usize / 528, sphere, "t {t}");
            assert!((from + t - front).abs() < 0.02 * front, "sphere {sphere}: {t}");
        }
    }
}

#[test]
fn of_sixty_four_equal_triangles_the_first_is_hit() {
    let Some(path) = shared("scenes/pathological/duplicates_x64.ply") else { return };
    let description = load(path.to_str().expect("UTF-8"), &LoadOptions::default()).expect("a scene");
    let mesh = &description.meshes[0];
    let mut first_of = HashMap::new();
    let corners = |i: usize| mesh.triangles[i].map(|v| mesh.positions[v as usize].to_array().map(f64::to_bits));
    for i in 0..mesh.triangles.len() {
        first_of.entry(corners(i)).or_insert(i as u32);
    }
    assert_eq!(first_of.len(), 1000);
    let aimed = |i: usize| -> Ray {
        let [a, b, c] = mesh.corners(i * 64 % mesh.triangles.len());
        let target = ((a + b + c) / 3.0).as_vec3().as_dvec3();
        let org = (target + DVec3::new(9.0, 7.0 + i as f64 % 13.0, -11.0)).as_vec3().as_dvec3();
        (org.to_array(), (target - org).as_vec3().as_dvec3().to_array())
    };
    let rays: Vec<Ray> = (0..mesh.triangles.len() / 64).map(aimed).collect();
    for hits in traced(&path, &rays) {
        let found: Vec<u32> = hits.iter().flatten().map(|hit| hit.1).collect();
        assert!(found.len() > 990, "{}", found.len());
        for prim in found {
            assert_eq!(first_of[&corners(prim as usize)], prim, "a later copy won");
        }
    }
}

/// 256 x 256 quads in y = 0: through every inner vertex a ray falls, along every row and column one runs in the plane.
#[test]
fn a_flat_grid_has_no_holes_and_no_thickness() {
    let Some(path) = shared("scenes/pathological/flat_grid.ply") else { return };
    let inner = || (1..256).flat_map(|x| (1..256).map(move |z| (f64::from(x), f64::from(z))));
    let falling = inner().map(|(x, z)| ([x, 7.0, z], [0.0, -1.0, 0.0]));
    // Halves and quarters are exact, so these go through the same vertices.
    let leaning = inner().map(|(x, z)| ([x - 2.0, 4.0, z + 1.0], [0.5, -1.0, -0.25]));
    let through: Vec<Ray> = falling.chain(leaning).collect();
    for (hits, ty) in traced_at(&path, &through, true).iter().zip(["f32", "f64"]) {
        for (i, hit) in hits.iter().enumerate() {
            let want = if i < 255 * 255 { 7.0 } else { 4.0 };
            assert!(hit.is_some_and(|(t, _)| t == want), "{ty} {:?}: {hit:?}", through[i]);
        }
    }
    let mut within: Vec<Ray> = Vec::new();
    for i in 0..=512 {
        let at = f64::from(i) * 0.5;
        within.extend([([at, 0.0, -3.0], [0.0, 0.0, 1.0]), ([300.0, 0.0, at], [-1.0, 0.0, 0.0])]);
        within.extend([([at, 0.0, at], [1.0, 0.0, 0.5]), ([-1.0, 0.0, at], [2.0, 0.0, -1.0])]);
    }
    for hits in traced(&path, &within) {
        assert_eq!(hits.iter().flatten().count(), 0, "a plane seen edge-on is not hit");
    }
}

#[test]
fn an_empty_scene_is_missed() {
    let Some(path) = shared("scenes/pathological/empty.ply") else { return };
    let rays = [([0.0; 3], [1.0, 0.0, 0.0]), ([1e30, -5.0, 2.0], [0.0, 1e-30, 3.0])];
    assert_eq!(traced(&path, &rays), [vec![None; 2], vec![None; 2]]);
}

/// The triangle (0, 0, 0), (1, 0, 0), (0, 1, 0): its inside, its rim, and just beside it. Rays along an axis at the
/// largest x or y of the triangle are left out: they run in the upper face of its box.
#[test]
fn a_single_triangle_is_closed_and_ends_at_its_rim() {
    let Some(path) = shared("scenes/pathological/single.ply") else { return };
    let down = |x: f64, y: f64| -> Ray { ([x, y, 2.0], [0.0, 0.0, -4.0]) };
    // Over the point with a slope whose products are exact.
    let leaning = |x: f64, y: f64| -> Ray { ([x + 0.5, y + 0.25, 2.0], [-1.0, -0.5, -4.0]) };
    let inside = [(0.25, 0.25), (0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5), (0.75, 0.25)];
    let corners = [(1.0, 0.0), (0.0, 1.0), (0.0, 0.0), (0.25, 0.75)];
    let beside = [(-0.0001, 0.5), (0.5, -0.0001), (0.5001, 0.5), (1.0001, 0.0), (0.0, 1.0001)];
    let mut rays: Vec<Ray> = inside.iter().map(|&(x, y)| down(x, y)).collect();
    rays.extend(corners.iter().map(|&(x, y)| leaning(x, y)));
    let hitting = rays.len();
    rays.extend(beside.iter().flat_map(|&(x, y)| [down(x, y), leaning(x, y)]));
    for hits in traced(&path, &rays) {
        for (i, hit) in hits.iter().enumerate() {
            assert_eq!(*hit, (i < hitting).then_some((0.5, 0)), "{:?}", rays[i]);
        }
    }
}
