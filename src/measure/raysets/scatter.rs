//! Rays aimed at the scene's own primitives, whatever their size and place: a camera that frames the whole scene
//! sees next to nothing of one whose coordinates span many powers of ten.
//!
//! Each ray picks an instance, one of its primitives and a point of that, and looks at the point from 1 to 1000
//! times the primitive's size away. Some start on the surface, some run along an axis (and so meet vertices and
//! edges exactly), some end before, at or behind the point.

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

use super::{BATCH, DIMENSION, RayKind, finite};
use crate::camera::sampling::PixelRandom;
use crate::ray::Rays;
use crate::scene::assembly::{Assembly, PartKind, Placement};
use crate::scene::description::Shape;
use crate::scene::solids::Solid;
use crate::shape::Triangle;

/// Primitives tried for one ray until one is found that can be hit.
const TRIES: u32 = 64;

/// Largest coordinate of an origin or direction: sums of a few of them are finite in f32.
const LARGEST: f64 = 1e37;

/// Lengths of directions relative to the way to the point.
const LENGTHS: [f64; 3] = [1e-3, 1.0, 1e3];

/// Ends of segments in units of the way to the point; the rest has no end.
const SEGMENTS: [(f64, f64); 6] = [(0.0, 0.5), (0.0, 1.0), (0.0, 2.0), (0.5, 2.0), (1.0, 1.5), (1.5, f64::INFINITY)];

/// `count` rays of class [`RayKind::Scatter`] in batches of [`BATCH`]; the same seed gives the same rays. A scene
/// without primitives that can be hit gets dead rays.
pub fn scatter(assembly: &Assembly, count: u64, seed: u64) -> Vec<Rays<f32>> {
    let batches = count.div_ceil(BATCH as u64);
    let batch_rays = |b: u64| {
        let mut rays = Rays::new((count - b * BATCH as u64).min(BATCH as u64) as usize);
        for i in 0..rays.len() {
            let mut draw = Draw { random: PixelRandom::new(i as u32, b as u32, seed), next: 0 };
            if let Some(aimed) = target(assembly, &mut draw).and_then(|target| aim(&target, &mut draw)) {
                let (t_min, t_max) = aimed.segment;
                rays.set(i, aimed.org, aimed.dir, t_min, t_max);
            }
        }
        rays
    };
    (0..batches).into_par_iter().map(batch_rays).collect()
}

/// A sequence of random numbers.
struct Draw {
    random: PixelRandom,
    next: u32,
}

impl Draw {
    /// Uniform in [0, 1).
    fn unit(&mut self) -> f64 {
        self.next += 1;
        self.random.pair(self.next, DIMENSION + RayKind::Scatter as u32)[0]
    }

    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    /// Uniform on the unit sphere (Archimedes: the height is uniform).
    fn direction(&mut self) -> DVec3 {
        let (z, (sin, cos)) = (2.0 * self.unit() - 1.0, (std::f64::consts::TAU * self.unit()).sin_cos());
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    }
}

/// Something to look at, world space.
struct Target {
    /// A point of the primitive, or of its box.
    point: DVec3,
    /// Size of the primitive.
    size: f64,
}

/// A point of a random primitive of a random instance.
fn target(assembly: &Assembly, draw: &mut Draw) -> Option<Target> {
    if assembly.placements.is_empty() {
        return None;
    }
    (0..TRIES).find_map(|_| {
        let placement = &assembly.placements[draw.below(assembly.placements.len())];
        let prims = assembly.objects[placement.object as usize].prim_count as usize;
        let prim = draw.below(prims) as u32;
        let found = on_primitive(assembly, placement, prim, draw)?;
        (found.point.is_finite() && found.size.is_finite() && found.size > 0.0).then_some(found)
    })
}

fn on_primitive(assembly: &Assembly, placement: &Placement, prim: u32, draw: &mut Draw) -> Option<Target> {
    let part = assembly.part_of(placement.object, prim);
    let to_world = placement.to_world * part.to_object;
    match &part.kind {
        PartKind::Mesh(mesh) => {
            // An identity must not cost the file's last bits.
            let corners = mesh.corners((prim - part.first_prim) as usize);
            let exact = to_world == DAffine3::IDENTITY;
            let corners = if exact { corners } else { corners.map(|p| to_world.transform_point3(p)) };
            Triangle::record::<f32>(corners).ok()?;
            Some(on_triangle(corners, draw))
        }
        PartKind::Shape(shape) => Some(in_shape(shape, &to_world, draw)),
        PartKind::Solids(tree) => {
            let leaf = &tree.leaves[(prim - part.first_prim) as usize];
            Some(in_solid(&leaf.solid, &(to_world * leaf.to_tree), draw))
        }
    }
}

/// Often on an edge or a corner.
fn on_triangle([a, b, c]: [DVec3; 3], draw: &mut Draw) -> Target {
    let (kind, along, across) = (draw.below(8), draw.unit(), draw.unit());
    let point = match kind {
        0 => [a, b, c][(along * 3.0) as usize],
        1 => {
            let (p, q) = [(a, b), (b, c), (c, a)][(across * 3.0) as usize];
            p + (q - p) * along
        }
        _ => {
            let root = along.sqrt();
            a * (1.0 - root) + b * (root * (1.0 - across)) + c * (root * across)
        }
    };
    Target { point, size: (b - a).length().max((c - b).length()).max((a - c).length()) }
}

/// In the shape's box, often on a face of it.
fn in_shape(shape: &Shape, to_world: &DAffine3, draw: &mut Draw) -> Target {
    let mut local = DVec3::new(draw.unit(), draw.unit(), draw.unit()) * 2.0 - 1.0;
    if draw.below(4) == 0 {
        let axis = draw.below(3);
        local[axis] = 1f64.copysign(local[axis]);
    }
    match shape {
        Shape::Sphere | Shape::Cuboid => {}
        Shape::Disc | Shape::HalfSpace => local.z = 0.0,
        Shape::Cylinder | Shape::Cone { .. } => local.z = 0.5 * (local.z + 1.0),
    }
    let m = to_world.matrix3;
    let size = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
    Target { point: to_world.transform_point3(local), size }
}

/// In the solid's box, often on a face of it.
fn in_solid(solid: &Solid, to_world: &DAffine3, draw: &mut Draw) -> Target {
    if let Solid::Shape(shape) = solid {
        return in_shape(shape, to_world, draw);
    }
    let (lo, hi) = solid.bounds();
    let to_box = DAffine3::from_mat3_translation(DMat3::from_diagonal((hi - lo) * 0.5), (lo + hi) * 0.5);
    in_shape(&Shape::Cuboid, &(*to_world * to_box), draw)
}

/// A ray as it stands in a ray file.
struct Aimed {
    org: [f32; 3],
    dir: [f32; 3],
    segment: (f32, f32),
}

/// A ray that meets the target at `t = 1 / length`, as far as f32 can say.
fn aim(target: &Target, draw: &mut Draw) -> Option<Aimed> {
    let representable = |p: DVec3| p.clamp(DVec3::splat(-LARGEST), DVec3::splat(LARGEST)).as_vec3().as_dvec3();
    let away = target.size * 10f64.powf(3.0 * draw.unit());
    let (kind, towards) = (draw.below(8), draw.direction());
    let axis = DVec3::AXES[draw.below(3)] * if towards.x < 0.0 { -1.0 } else { 1.0 };
    let point = representable(target.point);
    let (org, way) = match kind {
        0 => (point, towards * target.size),
        1 => {
            // Exactly along the axis: the other coordinates are the point's.
            let org = representable(point + axis * away);
            (org, point - org)
        }
        _ => {
            let org = representable(target.point + towards * away);
            (org, target.point - org)
        }
    };
    let length = LENGTHS[draw.below(LENGTHS.len())];
    // Where it does not fit, the longest that does.
    let length = length.min(LARGEST / way.abs().max_element().max(f64::MIN_POSITIVE));
    let (t_min, t_max) = SEGMENTS.get(draw.below(16)).copied().unwrap_or((0.0, f64::INFINITY));
    let segment = ((t_min / length) as f32, (t_max / length) as f32);
    let (org, dir, _) = finite(org.as_vec3().to_array(), way * length, segment.1)?;
    Some(Aimed { org, dir, segment })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::testing::scene_of;
    use crate::scene::description::ItemKind;
    use crate::scene::mesh::Mesh;

    /// One triangle of edge `size` at 10 times its size, and a degenerate one.
    fn triangle(size: f64) -> Assembly {
        let corner = DVec3::splat(10.0 * size);
        let positions = vec![corner, corner + DVec3::X * size, corner + DVec3::Y * size].into_iter();
        let positions = positions.map(|p| p.as_vec3().as_dvec3()).collect();
        scene_of(
            ItemKind::Mesh(0),
            Some(Mesh { positions, triangles: vec![[0, 1, 2], [0, 1, 1]], groups: Vec::new(), ..Mesh::default() }),
        )
    }

    fn wide(v: [f32; 3]) -> DVec3 {
        DVec3::from_array(v.map(f64::from))
    }

    /// Whatever the size, rays that are not cut short come as near to the triangle as f32 allows: its corners and
    /// the origin are off by half an ulp, 2^-24 of at most 1011 sizes, and the direction by as much.
    #[test]
    fn rays_meet_the_primitive_at_any_scale() {
        for size in [1e-30, 1e-6, 1.0, 1e6, 1e30] {
            let rays = &scatter(&triangle(size), 1000, 7)[0];
            assert_eq!((rays.len(), rays.live_count()), (1000, 1000), "{size:e}");
            let (mut plain, mut off) = (0, 0.0f64);
            for i in 0..rays.len() {
                let (org, dir) = (wide(rays.org(i)) / size, wide(rays.dir(i)).normalize());
                let nearest = org + dir * (DVec3::new(10.3, 10.3, 10.0) - org).dot(dir);
                plain += usize::from(rays.t_min[i] == 0.0 && rays.t_max[i] == f32::INFINITY);
                off = off.max((nearest - DVec3::new(10.3, 10.3, 10.0)).length());
            }
            // A corner is at most 0.77 sizes away from (0.3, 0.3).
            assert!(off < 0.77 + 1e-3, "{size:e}: {off}");
            assert!((500..800).contains(&plain), "10 of 16 segments have no end: {plain}");
        }
    }

    #[test]
    fn kinds_lengths_and_distances_occur() {
        let rays = scatter(&triangle(1.0), 4000, 1);
        assert_eq!(rays.iter().map(Rays::len).collect::<Vec<_>>(), [1024, 1024, 1024, 928]);
        let (mut along_axis, mut near, mut far) = (0, 0, 0);
        let mut lengths = [0; 3];
        for batch in &rays {
            for i in 0..batch.len() {
                let (org, dir) = (wide(batch.org(i)), wide(batch.dir(i)));
                along_axis += u32::from(dir.to_array().iter().filter(|x| **x == 0.0).count() == 2);
                let distance = (org - DVec3::new(10.3, 10.3, 10.0)).length();
                near += u32::from(distance < 1.0);
                far += u32::from(distance > 100.0);
                let relative = (dir.length() / distance.max(1.0)).log10();
                lengths[usize::from(relative > -1.5) + usize::from(relative > 1.5)] += 1;
            }
        }
        // An eighth of 4000 each along an axis and on the surface, a third of the others beyond 100 sizes.
        assert!((400..600).contains(&along_axis) && near > 400 && far > 1000, "{along_axis} {near} {far}");
        assert!(lengths.iter().all(|n| (1100..1600).contains(n)), "{lengths:?}");
    }

    #[test]
    fn the_seed_decides_and_nothing_else() {
        let bits = |seed| {
            let rays = scatter(&triangle(1.0), 3000, seed);
            rays.iter().flat_map(|b| b.org[0].iter().chain(b.dir[1].iter()).map(|x| x.to_bits())).collect::<Vec<_>>()
        };
        assert_eq!(bits(3), bits(3));
        assert_ne!(bits(3), bits(4));
    }

    #[test]
    fn what_cannot_be_hit_gets_dead_rays() {
        for mesh in [
            Mesh::default(),
            Mesh { positions: vec![DVec3::NAN], triangles: vec![[0; 3]], groups: vec![], ..Mesh::default() },
        ] {
            let rays = scatter(&scene_of(ItemKind::Mesh(0), Some(mesh)), 100, 1);
            assert_eq!((rays[0].len(), rays[0].live_count()), (100, 0));
        }
        assert!(scatter(&Assembly::default(), 0, 1).is_empty());
    }

    #[test]
    fn shapes_of_any_size_are_met() {
        for shape in [Shape::Sphere, Shape::Disc, Shape::Cuboid, Shape::cone(0.2), Shape::HalfSpace] {
            let rays = &scatter(&scene_of(ItemKind::Shape(shape), None), 500, 2)[0];
            assert_eq!(rays.live_count(), 500, "{shape:?}");
            for i in 0..500 {
                let (org, dir) = (wide(rays.org(i)), wide(rays.dir(i)).normalize());
                // The box's corners are sqrt 3 away from its centre.
                assert!((org - dir * org.dot(dir)).length() < 1.74, "{shape:?}");
            }
        }
    }
}
