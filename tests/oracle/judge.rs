//! The judge: planted faults must be unexplained, honest rounding must be explained.

use crate::oracle_support;

use glam::{DAffine3, DVec3};
use lanecast::reference::{EngineHit, Oracle, OracleHit, OracleRay, Verdict, Why};
use lanecast::scene::description::{Item, ItemKind, Precision, Shape};
use lanecast::scene::mesh::Mesh;
use oracle_support::{Random, assembly, mesh_scene, shape};

const F32: Precision = Precision::F32;
const F64: Precision = Precision::F64;
/// Half an ulp of 1 in f32.
const EPS: f64 = 1.0 / (1u64 << 24) as f64;

fn ray(org: [f64; 3], dir: [f64; 3]) -> OracleRay {
    OracleRay { org: org.into(), dir: dir.into(), t_min: 0.0, t_max: f64::INFINITY }
}

fn as_engine(hit: OracleHit) -> EngineHit {
    EngineHit { t: hit.t, u: hit.u, v: hit.v, prim: hit.prim, inst: hit.inst }
}

fn truth(oracle: &Oracle, ray: &OracleRay) -> EngineHit {
    as_engine(oracle.closest_of(ray).expect("a hit"))
}

#[track_caller]
fn fault(verdict: Verdict) {
    assert!(matches!(verdict, Verdict::Unexplained(_)), "{verdict:?}");
}

/// A closed ball of 2 * 24 * 48 triangles around `centre`: every edge is shared.
fn ball(radius: f64, centre: DVec3) -> Mesh {
    let (rows, columns) = (24u32, 48u32);
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..columns {
            let (sin, cos) = (std::f64::consts::PI * f64::from(row) / f64::from(rows)).sin_cos();
            let (s, c) = (std::f64::consts::TAU * f64::from(column) / f64::from(columns)).sin_cos();
            let sin = if row == 0 || row == rows { 0.0 } else { sin };
            let p = centre + radius * DVec3::new(sin * c, sin * s, cos);
            mesh.positions.push(p.as_vec3().as_dvec3());
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let at = |r: u32, c: u32| r * columns + c % columns;
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            mesh.triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    mesh
}

/// A unit quad of two triangles in z = 0 (0 below the diagonal x = y, 1 above) before a wall at z = -1 (2, 3).
fn quad_and_wall() -> Oracle {
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let mut positions = vec![corner(0., 0., 0.), corner(1., 0., 0.), corner(1., 1., 0.), corner(0., 1., 0.)];
    positions.extend([corner(-9., -9., -1.), corner(9., -9., -1.), corner(9., 9., -1.), corner(-9., 9., -1.)]);
    let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    Oracle::new(&mesh_scene(Mesh { positions, triangles, groups: vec![], ..Mesh::default() }))
}

#[test]
fn true_answers_agree_and_planted_faults_do_not() {
    let oracle = quad_and_wall();
    let ray = ray([0.75, 0.25, 2.0], [0.0, 0.0, -1.0]);
    let hit = truth(&oracle, &ray);
    assert_eq!((hit.t, hit.prim), (2.0, 0));
    assert_eq!(oracle.judge(&ray, Some(hit), F32), Verdict::Agree);
    let rounded = EngineHit { t: hit.t * (1.0 + 2.0 * EPS), u: hit.u + EPS, ..hit };
    assert_eq!(oracle.judge(&ray, Some(rounded), F32), Verdict::Agree);
    fault(oracle.judge(&ray, Some(rounded), F64));
    fault(oracle.judge(&ray, Some(EngineHit { t: hit.t * 1.01, ..hit }), F32));
    fault(oracle.judge(&ray, Some(EngineHit { u: hit.v, v: hit.u, ..hit }), F32));
    fault(oracle.judge(&ray, Some(EngineHit { u: f64::NAN, ..hit }), F32));
    fault(oracle.judge(&ray, Some(EngineHit { t: f64::NAN, ..hit }), F32));
    for (prim, inst) in [(1, 0), (2, 0), (77, 0), (0, 1)] {
        fault(oracle.judge(&ray, Some(EngineHit { prim, inst, ..hit }), F32));
    }
    // The wall is there, but the quad is in front of it.
    let wall = EngineHit { t: 3.0, u: 0.0, v: 0.0, prim: 2, inst: 0 };
    let wall = EngineHit { u: 9.0 / 18.0 + (0.25 / 18.0), ..wall };
    fault(oracle.judge(&ray, Some(wall), F32));
    fault(oracle.judge(&ray, None, F32));
    fault(oracle.judge_occluded(&ray, false, F32));
    assert_eq!(oracle.judge_occluded(&ray, true, F32), Verdict::Agree);
    let short = OracleRay { t_max: 1.5, ..ray };
    assert_eq!(oracle.judge(&short, None, F32), Verdict::Agree);
    fault(oracle.judge_occluded(&short, true, F32));
    fault(oracle.judge(&short, Some(hit), F32));
    fault(oracle.judge(&OracleRay { dir: DVec3::ZERO, ..ray }, Some(hit), F32));
    fault(oracle.judge_occluded(&OracleRay { t_max: -1.0, ..ray }, true, F32));
}

#[test]
fn a_leak_is_unexplained_but_the_neighbour_is_not() {
    let oracle = quad_and_wall();
    for off in [-EPS, -EPS / 3.0, 0.0, EPS / 3.0, EPS] {
        // Along the shared diagonal.
        let ray = ray([0.5 + off, 0.5, 2.0], [0.0, 0.0, -1.0]);
        fault(oracle.judge(&ray, None, F32));
        fault(oracle.judge_occluded(&ray, false, F32));
        let wall = truth(&oracle, &OracleRay { t_min: 2.5, ..ray });
        assert_eq!(wall.t, 3.0);
        fault(oracle.judge(&ray, Some(wall), F32));
        for (prim, u, v) in [(0, 0.0, 0.5), (1, 0.5, 0.0)] {
            let verdict = oracle.judge(&ray, Some(EngineHit { t: 2.0, u, v, prim, inst: 0 }), F32);
            let told = matches!(verdict, Verdict::Agree | Verdict::Explained(Why::Edge | Why::Coincident));
            assert!(told, "{prim} {verdict:?}");
        }
    }
    // Past the outer border, onto the wall: either answer will do within the margin, not beyond.
    for (off, near) in [(EPS, true), (-EPS, true), (1000.0 * EPS, false), (-1000.0 * EPS, false)] {
        let ray = ray([1.0 + off, 0.5, 2.0], [0.0, 0.0, -1.0]);
        let front = EngineHit { t: 2.0, u: 0.5, v: 0.5, prim: 0, inst: 0 };
        let wall = truth(&oracle, &OracleRay { t_min: 2.5, ..ray });
        let other = if truth(&oracle, &ray).prim == 0 { wall } else { front };
        let verdict = oracle.judge(&ray, Some(other), F32);
        assert_eq!(verdict == Verdict::Explained(Why::Edge), near, "{off} {verdict:?}");
        assert_eq!(matches!(verdict, Verdict::Unexplained(_)), !near);
    }
}

#[test]
fn leaks_through_a_closed_mesh_are_found_at_edges_and_vertices() {
    let centre = DVec3::new(0.3, -0.2, 0.1);
    let mesh = ball(1.0, centre);
    let oracle = Oracle::new(&mesh_scene(mesh.clone()));
    let mut random = Random(6);
    for round in 0..300 {
        let corners = mesh.corners(random.bits() as usize % mesh.triangles.len());
        let share = if round % 3 == 0 { 0.0 } else { 0.5 * random.number() + 0.5 };
        let target = corners[0].lerp(corners[1], share) + EPS * random.vector();
        let org = centre + 4.0 * (target - centre) + 0.5 * random.vector();
        let ray = OracleRay { org, dir: target - org, t_min: 0.0, t_max: f64::INFINITY };
        let hit = truth(&oracle, &ray);
        assert_eq!(oracle.judge(&ray, Some(hit), F32), Verdict::Agree);
        fault(oracle.judge(&ray, None, F32));
        fault(oracle.judge_occluded(&ray, false, F32));
        let far_side = oracle.closest_of(&OracleRay { t_min: hit.t + 0.1, ..ray }).map(as_engine);
        fault(oracle.judge(&ray, far_side, F32));
    }
}

#[test]
fn silhouettes_are_explained_on_both_sides() {
    let sphere = Oracle::new(&assembly(vec![], vec![vec![shape(Shape::Sphere, DAffine3::IDENTITY)]]));
    let at = |y: f64| ray([0.0, y, 3.0], [0.0, 0.0, -1.0]);
    let hit = |t: f64| EngineHit { t, u: 0.0, v: 0.0, prim: 0, inst: 0 };
    assert_eq!(sphere.judge(&at(1.0 - EPS), None, F32), Verdict::Explained(Why::Tangent));
    assert_eq!(sphere.judge(&at(1.0 + EPS), Some(hit(3.0)), F32), Verdict::Explained(Why::Tangent));
    assert_eq!(sphere.judge_occluded(&at(1.0 + EPS), true, F32), Verdict::Explained(Why::Tangent));
    assert_eq!(sphere.judge_occluded(&at(1.0 - EPS), false, F32), Verdict::Explained(Why::Tangent));
    fault(sphere.judge(&at(1.0 - 1e-4), None, F32));
    fault(sphere.judge(&at(1.0 + 1e-4), Some(hit(3.0)), F32));
    fault(sphere.judge(&at(1.0 - EPS), None, F64));
    // The second crossing instead of the first; near the silhouette only.
    fault(sphere.judge(&at(0.5), Some(hit(3.0 + 0.75f64.sqrt())), F32));
    let chord = (1.0 - (1.0 - EPS).powi(2)).sqrt();
    assert!(!matches!(sphere.judge(&at(1.0 - EPS), Some(hit(3.0 + chord)), F32), Verdict::Unexplained(_)));
    fault(sphere.judge(&at(1.0 - EPS), Some(hit(3.1)), F32));
    // A mesh: past the rim of a ball, front and back are skipped together.
    let mesh = ball(1.0, DVec3::ZERO);
    let oracle = Oracle::new(&mesh_scene(mesh));
    let rim = |off: f64| ray([1.0 + off, 0.0, 3.0], [0.0, 0.0, -1.0]);
    assert!(oracle.closest_of(&rim(-EPS)).is_some() && oracle.closest_of(&rim(EPS)).is_none());
    assert!(matches!(oracle.judge(&rim(-EPS), None, F32), Verdict::Explained(Why::Edge | Why::Grazing)));
    fault(oracle.judge(&rim(-1e-3), None, F32));
}

#[test]
fn segment_ends_coincident_surfaces_and_borders() {
    let oracle = quad_and_wall();
    let down = ray([0.75, 0.25, 2.0], [0.0, 0.0, -1.0]);
    let hit = truth(&oracle, &down);
    let end = |t_max: f64| OracleRay { t_max, ..down };
    assert_eq!(oracle.judge(&end(2.0), None, F32), Verdict::Explained(Why::SegmentEnd));
    assert_eq!(oracle.judge_occluded(&end(2.0), false, F32), Verdict::Explained(Why::SegmentEnd));
    assert_eq!(oracle.judge_occluded(&end(2.0 - EPS), true, F32), Verdict::Explained(Why::SegmentEnd));
    let early = EngineHit { t: 2.0 - EPS, ..hit };
    assert_eq!(oracle.judge(&end(2.0 - EPS), Some(early), F32), Verdict::Explained(Why::SegmentEnd));
    fault(oracle.judge(&end(2.01), None, F32));
    // A sphere left from its surface: the start is excused, the far side is not.
    let sphere = Oracle::new(&assembly(vec![], vec![vec![shape(Shape::Sphere, DAffine3::IDENTITY)]]));
    let inwards = ray([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]);
    let far = EngineHit { t: 2.0, u: 0.0, v: 0.0, prim: 0, inst: 0 };
    assert!(matches!(sphere.judge(&inwards, Some(far), F32), Verdict::Explained(Why::SegmentEnd)));
    fault(sphere.judge(&inwards, None, F32));
    fault(sphere.judge_occluded(&inwards, false, F32));
    // The same triangle twice as two instances: either is right, a third one a little behind is not.
    let mesh = Mesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
        triangles: vec![[0, 1, 2]],
        groups: vec![],
        ..Mesh::default()
    };
    let place = |z: f64| {
        let transform = DAffine3::from_translation(DVec3::Z * z);
        Item { transform, material: None, kind: ItemKind::Instance(1) }
    };
    let item = Item { transform: DAffine3::IDENTITY, material: None, kind: ItemKind::Mesh(0) };
    let doubled = assembly(vec![mesh], vec![vec![place(0.0), place(EPS), place(-1e-3)], vec![item]]);
    let oracle = Oracle::new(&doubled);
    let ray = ray([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]);
    let of = |inst: u32, t: f64| Some(EngineHit { t, u: 0.25, v: 0.25, prim: 0, inst });
    assert_eq!(oracle.judge(&ray, of(1, 1.0), F32), Verdict::Agree);
    assert_eq!(oracle.judge(&ray, of(0, 1.0), F32), Verdict::Explained(Why::Coincident));
    fault(oracle.judge(&ray, of(2, 1.001), F32));
}

#[test]
fn faces_of_shapes_are_checked() {
    let oracle = Oracle::new(&assembly(vec![], vec![vec![shape(Shape::Cuboid, DAffine3::IDENTITY)]]));
    let ray = |y: f64| ray([3.0, y, 0.0], [-1.0, 0.0, 0.0]);
    let hit = |u: f64| Some(EngineHit { t: 2.0, u, v: 0.0, prim: 0, inst: 0 });
    assert_eq!(oracle.judge(&ray(0.0), hit(1.0), F32), Verdict::Agree);
    for wrong in [0.0, 2.0, 3.0, 6.0, 0.5] {
        fault(oracle.judge(&ray(0.0), hit(wrong), F32));
    }
    // A leaning ray over the edge x = 1, y = 1 may see either face.
    let over = OracleRay { dir: DVec3::new(-1.0, -1.0, 0.0), ..ray(3.0 + EPS) };
    assert_eq!(truth(&oracle, &over).u, 3.0);
    assert!(matches!(oracle.judge(&over, hit(1.0), F32), Verdict::Explained(_)));
    fault(oracle.judge(&over, hit(0.0), F32));
}
