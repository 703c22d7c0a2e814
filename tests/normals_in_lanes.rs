//! Positions and normals that come in lanes are those that come hit by hit.

use std::path::Path;

use glam::DVec3;
use lanecast::camera::{Camera, PixelRect, SubPixel, Tiling, fill_tile};
use lanecast::lanes::Lanes;
use lanecast::ray::{Hits, Rays};
use lanecast::scene::brlcad::describe::{Options, describe};
use lanecast::scene::description::Description;
use lanecast::scene::world::{Met, Preset, World};
use lanecast::scene::{brlcad, builtin};
use lanecast::trace::{Engines, Scratch, engine};

const SIZE: u32 = 96;

/// What was compared of a scene.
#[derive(Default)]
struct Tally {
    hits: u32,
    /// Hits that [`World::met_facets`] knows.
    known: u32,
    worst: f64,
}

/// Compares lane `lane` of `met` with hit `i`.
fn compare<S: Engines>(
    world: &World<S>,
    rays: &Rays<S>,
    hits: &Hits<S>,
    met: &Met<S::Wide>,
    i: usize,
    lane: usize,
) -> f64 {
    let vector = |v: [S; 3]| DVec3::from(v.map(S::to_f64));
    let of_lane = |v: [S::Wide; 3]| DVec3::from(v.map(|x| x.lane(lane).to_f64()));
    let (t, u, v) = (hits.t[i].to_f64(), hits.u[i].to_f64(), hits.v[i].to_f64());
    let (org, dir) = (vector(rays.org(i)), vector(rays.dir(i)));
    let surface = world.surface(org, dir, t, u, v, hits.prim[i], hits.inst[i]);
    let scale = 1.0 + org.length() + surface.position.length();
    let at = (of_lane(met.position) - (org + dir * t)).length() / scale;
    assert_eq!(met.material[lane], surface.material);
    assert_eq!(met.part[lane], world.part(world.assembly.placements[hits.inst[i] as usize].object, hits.prim[i]));
    at.max((of_lane(met.normal) - surface.ng).length())
}

fn tally<S: Engines>(name: &str, description: &Description) -> Tally {
    let world = World::<S>::compile(description, Preset::Balanced).unwrap();
    let camera = Camera::new(&description.cameras[0], 1.0).unwrap();
    let tiling = Tiling::new(SIZE, SIZE, 32).unwrap();
    let rect = PixelRect { x0: 0, y0: 0, x1: SIZE, y1: SIZE };
    let (mut rays, mut hits, mut tally) = (Rays::new(0), Hits::new(0), Tally::default());
    for tile in tiling.tiles_in(rect) {
        fill_tile(&camera, &tiling, tile, rect, SubPixel::Anchor, &mut rays);
        engine::<S>("auto").unwrap().intersect(&world, &rays, &mut hits, &mut Scratch::default(), None);
        for first in (0..rays.padded_len()).step_by(S::Wide::N) {
            let all = world.met(&rays, &hits, first);
            let kept = world.met_facets(&rays, &hits, first, u32::MAX);
            for lane in 0..S::Wide::N {
                let i = first + lane;
                assert_eq!(all.hit >> lane & 1 != 0, hits.is_hit(i), "{name}");
                if hits.is_hit(i) {
                    tally.hits += 1;
                    tally.worst = tally.worst.max(compare(&world, &rays, &hits, &all, i, lane));
                }
                if kept.hit >> lane & 1 != 0 {
                    assert!(hits.is_hit(i), "{name}");
                    tally.known += 1;
                    tally.worst = tally.worst.max(compare(&world, &rays, &hits, &kept, i, lane));
                }
            }
        }
    }
    tally
}

fn check<S: Engines>(name: &str, least_known: f64, bound: f64) {
    check_scene::<S>(name, &builtin::load(name, &[]).unwrap(), least_known, bound);
}

fn check_scene<S: Engines>(name: &str, description: &Description, least_known: f64, bound: f64) {
    let Tally { hits, known, worst } = tally::<S>(name, description);
    println!("{name}: {hits} hits, {known} with facets, worst difference {worst:e}");
    assert!(hits > 1000, "{name}: {hits} hits");
    assert!(f64::from(known) >= least_known * f64::from(hits), "{name}: {known} of {hits}");
    assert!(worst <= bound, "{name}: {worst:e}");
}

/// Scenes of shapes and solids; of some a part is meshes, tori or stands in instances.
const SCENES: [(&str, f64); 7] = [
    ("bolt", 0.9),
    ("die", 0.9),
    ("rook", 0.8),
    ("csg-lit", 0.5),
    ("still-life", 0.8),
    ("teaching", 0.2),
    ("sponge", 0.5),
];

#[test]
fn doubles() {
    SCENES.iter().for_each(|&(name, known)| check::<f64>(name, known, 1e-9));
}

#[test]
fn singles() {
    SCENES.iter().for_each(|&(name, known)| check::<f32>(name, known, 2e-3));
}

/// Tori and tapers, whose normals are no affine functions of the point, lean and unequally scaled; what is cut by a torus
/// shows its normals turned round.
#[test]
fn curved_sides() {
    let text = "title {t}\nunits mm\n\
        put ring tor V {0 0 0} H {1 2 2} r_a 3 r_h 1\n\
        put cone tgc V {6 0 0} H {1 0 5} A {2 0 0} B {0 1 0} C {0.5 0 0} D {0 0.8 0}\n\
        put box arb8 V1 {-9 -3 -1} V2 {-5 -3 -1} V3 {-5 3 -1} V4 {-9 3 -1} V5 {-9 -3 1} V6 {-5 -3 1} V7 {-5 3 1} V8 {-9 3 1}\n\
        put groove tor V {-7 0 1} H {0 0 1} r_a 1.5 r_h 0.5\n\
        put r comb region yes tree {u {u {l ring {2 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1}} {l cone}} {- {l box} {l groove}}}\n";
    let file = Path::new("d.asc");
    let database = brlcad::parse(file, text.as_bytes()).unwrap();
    let description = describe(file, "d", &database, &Options::default()).unwrap();
    check_scene::<f64>("curved", &description, 0.1, 1e-9);
    check_scene::<f32>("curved", &description, 0.1, 2e-3);
}
