//! Triangles that enclose a solid, in databases of both versions, against the box that they are.

use std::path::Path;

use lanecast::ray::{Hits, Rays};
use lanecast::scene::brlcad::describe::{Options, describe};
use lanecast::scene::brlcad::parse;
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Scratch, engine};

/// The box from (0, 0, 0) to (2, 3, 4): corners and faces of triangles, some of them turned.
const CORNERS: [[u32; 3]; 8] = [[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0], [0, 0, 4], [2, 0, 4], [2, 3, 4], [0, 3, 4]];
const FACES: [[usize; 4]; 6] = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [7, 6, 2, 3], [3, 0, 4, 7]];

fn world(text: &str) -> World<f64> {
    let database = parse(Path::new("d.asc"), text.as_bytes()).unwrap();
    let description = describe(Path::new("d.asc"), "d", &database, &Options::default()).unwrap();
    World::compile(&description, Preset::Balanced).unwrap()
}

/// Version 5: `body` less a ball in it.
fn with_ball(body: &str) -> World<f64> {
    let ball = "put ball ell V {2 2 2} A {1.5 0 0} B {0 1.5 0} C {0 0 1.5}";
    let cut = "put r comb region yes tree {- {l body} {l ball}}";
    world(&format!("title {{t}}\nunits mm\n{body}\n{ball}\n{cut}\n"))
}

fn list<T: std::fmt::Display>(items: impl Iterator<Item = [T; 3]>) -> String {
    items.map(|[a, b, c]| format!("{{{a} {b} {c}}} ")).collect()
}

fn hits(world: &World<f64>) -> Hits<f64> {
    let mut rays = Rays::new(40 * 40);
    for i in 0..rays.len() {
        let (x, y) = ((i % 40) as f64 * 0.077 - 0.5, (i / 40) as f64 * 0.103 - 0.5);
        rays.set(i, [x, y, 9.0], [0.011, -0.017, -1.0], 0.0, f64::INFINITY);
    }
    let mut hits = Hits::new(0);
    engine::<f64>("auto").unwrap().intersect(world, &rays, &mut hits, &mut Scratch::default(), None);
    hits
}

/// That both worlds are the same to rays: hit or miss, and where to a few roundings.
fn same(a: &World<f64>, b: &World<f64>) {
    let (a, b) = (hits(a), hits(b));
    assert!(a.hit_count() > 500 && a.hit_count() < a.len() - 100);
    for i in 0..a.len() {
        assert_eq!(a.is_hit(i), b.is_hit(i), "ray {i}");
        assert!(!a.is_hit(i) || (a.t[i] - b.t[i]).abs() < 1e-12, "ray {i}: {} and {}", a.t[i], b.t[i]);
    }
}

#[test]
fn a_solid_bot_is_the_box_of_its_corners() {
    let corners = CORNERS.iter().zip(1..).map(|([x, y, z], i)| format!("V{i} {{{x} {y} {z}}} "));
    let arb = with_ball(&format!("put body arb8 {}", corners.collect::<String>()));
    let triangles = FACES
        .iter()
        .enumerate()
        .flat_map(|(i, &[a, b, c, d])| [[a, b, c], if i % 2 == 0 { [a, c, d] } else { [d, c, a] }]);
    let (vertices, faces) = (list(CORNERS.into_iter()), list(triangles));
    let bot = format!("put body bot mode volume orient no flags {{}} V {{ {vertices}}} F {{ {faces}}}");
    same(&arb, &with_ball(&bot));
}

#[test]
fn a_polysolid_is_one_too() {
    let polygons = FACES.iter().map(|face| {
        // Five places for corners, and normals that are not read.
        let places = face.map(|k| CORNERS[k].map(|x| x.to_string()).join(" ")).join(" ");
        format!("Q 4 {places} 0 0 0{}\n", " 0 0 1".repeat(5))
    });
    let polygons: String = polygons.collect();
    let region = "C Y r 1 0 1 0 0 0 0 0 0 0 0\nM u body 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 0\n";
    let old = world(&format!("I 1 v4\nt\nP body\n{polygons}{region}"));
    let new = "put body arb8 V1 {0 0 0} V2 {2 0 0} V3 {2 3 0} V4 {0 3 0} V5 {0 0 4} V6 {2 0 4} V7 {2 3 4} V8 {0 3 4}";
    same(&world(&format!("title {{t}}\nunits mm\n{new}\nput r comb region yes tree {{l body}}\n")), &old);
}

/// Every boundary along x through (0, `y`, `z`), from x = -50.
fn boundaries(world: &World<f64>, y: f64, z: f64) -> Vec<f64> {
    let (mut found, mut hits, mut from) = (Vec::new(), Hits::new(0), 0.0);
    loop {
        let mut rays = Rays::new(1);
        rays.set(0, [-50.0, y, z], [1.0, 0.0, 0.0], from, f64::INFINITY);
        engine::<f64>("auto").unwrap().intersect(world, &rays, &mut hits, &mut Scratch::default(), None);
        if !hits.is_hit(0) || found.len() > 9 {
            return found;
        }
        found.push(hits.t[0]);
        from = hits.t[0] + 0.001;
    }
}

/// Pieces may be wound as they like: one inside another is no void, and those that overlap are what is in any of them.
#[test]
fn pieces_of_a_bot_are_united() {
    type Cubes = &'static [(f64, f64)];
    let cases: [(Cubes, [f64; 2]); 4] = [
        (&[(0.0, 10.0)], [40.0, 60.0]),
        (&[(0.0, 10.0), (0.0, 4.0)], [40.0, 60.0]),
        (&[(0.0, 10.0), (0.0, -4.0)], [40.0, 60.0]),
        (&[(0.0, 10.0), (8.0, 10.0)], [40.0, 68.0]),
    ];
    for (cubes, want) in cases {
        let corner =
            |k: usize, (centre, half): (f64, f64)| CORNERS[k].map(|x| centre + if x > 0 { half } else { -half });
        let vertices = list(cubes.iter().flat_map(|&cube| (0..8).map(move |k| corner(k, cube))));
        let quads = (0..cubes.len()).flat_map(|i| FACES.map(|face| face.map(|k| k + 8 * i)));
        let faces = list(quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]));
        let bot = format!("put body bot mode volume orient no V {{ {vertices}}} F {{ {faces}}}");
        let world = world(&format!("title {{t}}\nunits mm\n{bot}\nput r comb region yes tree {{l body}}\n"));
        // Through edges of triangles, and beside them.
        for (y, z) in [(1.0, 1.0), (1.0, 2.0), (-1.5, 0.5)] {
            let got = boundaries(&world, y, z);
            let near = got.len() == 2 && got.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-9);
            assert!(near, "{cubes:?} at {y} {z}: {got:?}");
        }
    }
}

#[test]
fn surfaces_and_open_bots_are_named_and_left_out_if_asked() {
    let described = |mode: &str, faces: &str, lenient: bool| {
        let text = format!(
            "title {{t}}\nunits mm\n\
             put body bot mode {mode} orient no V {{{{0 0 0}} {{1 0 0}} {{0 1 0}} {{0 0 1}}}} F {{{faces}}}\n\
             put ball ell V {{9 9 9}} A {{1 0 0}} B {{0 1 0}} C {{0 0 1}}\n\
             put r comb region yes tree {{l body}}\nput s comb region yes tree {{l ball}}\n"
        );
        let database = parse(Path::new("d.asc"), text.as_bytes()).unwrap();
        describe(Path::new("d.asc"), "d", &database, &Options { lenient, ..Options::default() })
    };
    let closed = "{0 1 2} {0 1 3} {0 2 3} {1 2 3}";
    assert!(described("volume", closed, false).is_ok());
    for (mode, faces, what) in [("surf", closed, "surface"), ("volume", "{0 1 2} {0 1 3} {0 2 3}", "not closed")] {
        let error = described(mode, faces, false).unwrap_err().to_string();
        assert!(error.contains(what) && error.contains("body") && error.contains("d.asc:3"), "{error}");
        let left = described(mode, faces, true).unwrap();
        assert!(left.warnings.iter().any(|warning| warning.contains("body")), "{:?}", left.warnings);
        let world = World::<f64>::compile(&left, Preset::Balanced).unwrap();
        let low = world.bounds().unwrap().0;
        assert!((low - 8.0).abs().max_element() < 1e-12, "the rest is there: {low}");
    }
}
