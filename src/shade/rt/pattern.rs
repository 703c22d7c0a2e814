//! Colours as functions of a surface's parameters: cloud, testmap, checker.
//!
//! Source of the clouds: G. Y. Gardner, "Visual Simulation of Clouds", SIGGRAPH 1985, with the constants and the table
//! of sines that BRL-CAD uses.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::LazyLock;

use glam::DVec3;

use crate::lanes::Real;
use crate::scene::assembly::PartKind;
use crate::scene::brlcad::ARB_FACES;
use crate::scene::brlcad::shader::Shader;
use crate::scene::description::Shape;
use crate::scene::solids::Solid;
use crate::scene::world::World;

/// Entries of the table of sines.
const SINES: usize = 2048;
/// Period of a half-space's parameters, mm.
const HALF_SPACE_PERIOD: f64 = 10_000.0;
/// Points of an arb nearer than this are one.
const SAME_POINT: f64 = 0.0005;

static TABLE: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..SINES).map(|i| (i as f64 * TAU / SINES as f64).sin() as f32).collect());

/// A procedural colour.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Pattern {
    /// White on blue.
    Cloud,
    /// u is red, v is blue.
    Testmap,
    /// Two colours in squares.
    Checker { a: DVec3, b: DVec3, scale: f64 },
}

impl Pattern {
    /// The pattern that `shader` names, if it is one.
    pub fn of(shader: &Shader) -> Option<Self> {
        let color = |names: &[&str], default: f64| -> DVec3 {
            let text = shader.text(names).unwrap_or_default();
            let mut channels = text.split(['/', ',']).map_while(|part| part.trim().parse::<f64>().ok());
            let given = (channels.next(), channels.next(), channels.next());
            let (Some(r), Some(g), Some(b)) = given else { return DVec3::splat(default) };
            DVec3::new(r, g, b) / 255.0
        };
        match shader.name.as_str() {
            "cloud" => Some(Self::Cloud),
            "testmap" => Some(Self::Testmap),
            "checker" => {
                let scale = shader.number(&["scale", "s"]).unwrap_or(2.0);
                Some(Self::Checker { a: color(&["a"], 1.0), b: color(&["b"], 0.0), scale })
            }
            _ => None,
        }
    }

    /// The colour at parameters u, v in 0..1.
    pub fn color(&self, [u, v]: [f64; 2]) -> DVec3 {
        match self {
            Self::Cloud => cloud(u, v),
            Self::Testmap => DVec3::new(u, 0.0, v),
            Self::Checker { a, b, scale } => {
                let odd = |x: f64| (x * scale) as i64 & 1;
                if odd(u) == odd(v) { *a } else { *b }
            }
        }
    }
}

/// The sine from the table, nearest entry.
fn sine(angle: f64) -> f64 {
    let entry = |a: f64| f64::from(TABLE[(0.5 + a * (SINES as f64 / TAU)) as usize & (SINES - 1)]);
    if angle < 0.0 { -entry(-angle) } else { entry(angle) }
}

/// Sky with clouds.
fn cloud(u: f64, v: f64) -> DVec3 {
    const SKY: DVec3 = DVec3::new(0.31, 0.31, 0.78);
    const THRESHOLD: f64 = 0.35;
    const RANGE: f64 = 0.3;
    let t = texture(u, v).clamp(0.0, 1.0);
    let clear = (1.0 - (t - THRESHOLD) / RANGE).clamp(0.0, 1.0);
    DVec3::splat((1.0 - clear) * t) + SKY * clear
}

/// Gardner's texture: four octaves of shifted sines.
fn texture(x: f64, y: f64) -> f64 {
    let (mut fx, mut fy) = (TAU * 2.0, TAU);
    let mut px = FRAC_PI_2 * sine(0.5 * fy * y);
    let mut py = FRAC_PI_2 * sine(0.5 * fx * x);
    let (mut t1, mut t2, mut c) = (0.0, 0.0, 1.0);
    for _ in 0..4 {
        t1 += c * sine(fx * x + px) + 1.0;
        t2 += c * sine(fy * y + py) + 1.0;
        px = FRAC_PI_2 * sine(fy * y);
        py = FRAC_PI_2 * sine(fx * x);
        fx *= 2.0;
        fy *= 2.0;
        c *= 0.707;
    }
    t1 * t2 / 32.0
}

/// Parameters of a direction on the sphere around everything.
pub(super) fn uv_of_direction(d: DVec3) -> [f64; 2] {
    let u = d.y.atan2(d.x) / TAU;
    [if u < 0.0 { u + 1.0 } else { u }, d.z.atan2(d.x.hypot(d.y)) / PI + 0.5]
}

/// Parameters of the surface of leaf `prim` in region `region` at `position` with outward `normal`; `None` for solids
/// without.
pub(super) fn uv<S: Real>(
    world: &World<S>,
    region: u32,
    prim: u32,
    position: DVec3,
    normal: DVec3,
) -> Option<[f64; 2]> {
    let part = &world.assembly.objects[0].parts[region as usize];
    let PartKind::Solids(tree) = &part.kind else { return None };
    match tree.leaves[(prim - part.first_prim) as usize].solid {
        Solid::Shape(Shape::Sphere) => Some(uv_of_direction(world.local(0, prim, position))),
        Solid::Shape(Shape::HalfSpace) => Some(uv_of_plane(position, normal)),
        _ => None,
    }
}

/// Parameters of a plane: distances along two axes, there and back again every ten metres.
fn uv_of_plane(position: DVec3, n: DVec3) -> [f64; 2] {
    let from_foot = position - n * n.dot(position);
    let a = n.abs();
    let axis = if a.x <= a.y && a.x <= a.z {
        DVec3::X
    } else if a.y <= a.z {
        DVec3::Y
    } else {
        DVec3::Z
    };
    let x = axis.cross(n).normalize();
    let y = x.cross(n).normalize();
    [x, y].map(|axis| {
        let f = (from_foot.dot(axis).abs() / HALF_SPACE_PERIOD).fract();
        if f < 0.5 { 2.0 * f } else { 2.0 * (1.0 - f) }
    })
}

/// Parameters of that of an arb's `faces` that `normal` belongs to, at `position`: they run from 0 to 1 over the smallest
/// rectangle along the face's first edge.
pub(super) fn uv_of_arb(faces: &[Face], position: DVec3, normal: DVec3) -> Option<[f64; 2]> {
    let along = |face: &&Face| face.normal.dot(normal).abs() > 0.999;
    let distance = |face: &Face| (position - face.origin).dot(face.normal).abs();
    let best = faces.iter().filter(along).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let from = position - best.origin;
    Some([from.dot(best.u) / best.u_length, from.dot(best.v) / best.v_length])
}

/// A face of an arb with its axes.
#[derive(Clone, Debug)]
pub(super) struct Face {
    origin: DVec3,
    normal: DVec3,
    u: DVec3,
    v: DVec3,
    u_length: f64,
    v_length: f64,
}

impl Face {
    /// The faces of the arb with corners `points`.
    pub fn of_arb(points: &[DVec3; 8]) -> Vec<Self> {
        ARB_FACES.iter().filter_map(|face| Self::of(&face.map(|i| points[i]))).collect()
    }

    fn of(corners: &[DVec3; 4]) -> Option<Self> {
        let mut distinct: Vec<DVec3> = Vec::new();
        for &p in corners {
            if distinct.iter().all(|q| q.distance(p) > SAME_POINT) {
                distinct.push(p);
            }
        }
        let &[a, b, c, ..] = distinct.as_slice() else { return None };
        let normal = (c - a).cross(b - a).try_normalize()?;
        let u = (b - a).normalize();
        let v = normal.cross(u).normalize();
        let range = |axis: DVec3| {
            let along = distinct.iter().map(|&p| (p - a).dot(axis));
            along.fold((0.0f64, 0.0f64), |(low, high), x| (low.min(x), high.max(x)))
        };
        let ((u_low, u_high), (v_low, v_high)) = (range(u), range(v));
        let origin = a + u * u_low + v * v_low;
        Some(Self { origin, normal, u, v, u_length: u_high - u_low, v_length: v_high - v_low })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_a_sine_to_half_a_step() {
        for i in -5000..5000 {
            let angle = f64::from(i) * 0.0123;
            assert!((sine(angle) - angle.sin()).abs() < 0.5 * TAU / SINES as f64 + 1e-6, "{angle}");
        }
    }

    #[test]
    fn faces_of_a_box_have_parameters_from_corner_to_corner() {
        let points = [
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [2.0, 3.0, 0.0],
            [0.0, 3.0, 0.0],
            [0.0, 0.0, 4.0],
            [2.0, 0.0, 4.0],
            [2.0, 3.0, 4.0],
            [0.0, 3.0, 4.0],
        ]
        .map(DVec3::from);
        let faces = Face::of_arb(&points);
        let middle = uv_of_arb(&faces, DVec3::new(1.0, 1.5, 4.0), DVec3::Z).unwrap();
        assert!((middle[0] - 0.5).abs() < 1e-12 && (middle[1] - 0.5).abs() < 1e-12);
        let mut corners: Vec<[i64; 2]> =
            points[4..].iter().map(|&p| uv_of_arb(&faces, p, DVec3::Z).unwrap().map(|x| x.round() as i64)).collect();
        corners.sort_unstable();
        assert_eq!(corners, [[0, 0], [0, 1], [1, 0], [1, 1]]);
    }

    #[test]
    fn planes_repeat_there_and_back() {
        let at = |x: f64| uv_of_plane(DVec3::new(x, 0.0, 7.0), DVec3::Z);
        let along = at(2500.0);
        assert!(along.contains(&0.5) && along.contains(&0.0), "{along:?}");
        assert_eq!(at(7500.0), along);
        assert_eq!(at(12_500.0), along);
    }
}
