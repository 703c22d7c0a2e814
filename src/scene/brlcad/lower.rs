//! From a database's raw parameters to placed canonical solids, and the boxes that frame them.

use glam::{DAffine3, DMat3, DVec3};

use super::bot;
use super::pipe;
use super::solid::Solid;
use crate::scene::solids::{self, NodeId, NodeKind, Placed, Polyhedron, SolidNode, SolidTree};

/// Points and surfaces nearer than this, mm, are one for BRL-CAD.
pub(super) const TOLERANCE: f64 = 0.0005;

/// Adds `solid` under `place` to `tree`. What has a form of its own under any affine map is mapped by its parameters,
/// as BRL-CAD does; the rest is placed.
///
/// # Errors
/// In words, what is wrong with the solid's numbers or cannot be done with its kind.
pub(super) fn add(tree: &mut SolidTree, solid: &Solid, place: &DAffine3) -> Result<NodeId, String> {
    let point = |p: DVec3| place.transform_point3(p);
    let vector = |d: DVec3| place.transform_vector3(d);
    let node = match solid {
        Solid::Arb { points } => {
            let polyhedron = Polyhedron::from_arb8(&points.map(point), TOLERANCE)?;
            tree.solid(polyhedron_at(polyhedron, DAffine3::IDENTITY))
        }
        Solid::Ell { v, axes: [a, b, c] } => {
            tree.solid(solids::ellipsoid(point(*v), vector(*a), vector(*b), vector(*c))?)
        }
        Solid::Tgc { v, h, base: [a, b], top: [c, d] } => {
            tree.solid(solids::truncated_cone(point(*v), vector(*h), vector(*a), vector(*b), vector(*c), vector(*d))?)
        }
        Solid::Half { n, d } => {
            let (normal, distance) = mapped_plane(place, *n, *d)?;
            tree.solid(solids::half_space(normal, distance)?)
        }
        Solid::Tor { v, h, major, minor } => placed(tree, place, solids::torus(*v, *h, *major, *minor)?),
        Solid::Eto { v, n, c, r, rd } => {
            let up = c.dot(n.normalize_or_zero());
            let out = (c.length_squared() - up * up).max(0.0).sqrt();
            // The sense of the normal does not matter: the ellipse always rises outwards.
            placed(tree, place, solids::elliptic_torus(*v, *n, *r, [out, up.abs()], *rd)?)
        }
        Solid::Ehy { v, h, a, r1, r2, c } => {
            placed(tree, place, solids::elliptic_hyperboloid(*v, *h, *a, *r1, *r2, *c)?)
        }
        Solid::Epa { v, h, a, r1, r2 } => placed(tree, place, solids::elliptic_paraboloid(*v, *h, *a, *r1, *r2)?),
        Solid::Rpc { v, h, b, r } => placed(tree, place, solids::parabolic_cylinder(*v, *h, *b, *r)?),
        Solid::Rhc { v, h, b, r, c } => placed(tree, place, solids::hyperbolic_cylinder(*v, *h, *b, *r, *c)?),
        Solid::Hyp { v, h, a, b, neck } => placed(tree, place, solids::hyperboloid(*v, *h, *a, *b, *neck)?),
        Solid::Part { v, h, r_v, r_h } => {
            let part = tree.particle(*v, *h, *r_v, *r_h)?;
            placed_node(tree, place, part)
        }
        Solid::Pipe(points) => {
            let part = pipe::add(tree, points)?;
            placed_node(tree, place, part)
        }
        Solid::Arbn(planes) => {
            let polyhedron = Polyhedron::from_planes(planes)?;
            tree.solid(polyhedron_at(polyhedron, *place))
        }
        Solid::Bot { mode, vertices, faces } => {
            tree.solid(Placed { solid: bot::solid(*mode, vertices, faces)?, transform: *place })
        }
    };
    Ok(node)
}

fn polyhedron_at(polyhedron: Polyhedron, transform: DAffine3) -> Placed {
    Placed { solid: solids::Solid::Polyhedron(std::sync::Arc::new(polyhedron)), transform }
}

fn placed(tree: &mut SolidTree, place: &DAffine3, solid: Placed) -> NodeId {
    tree.solid(Placed { transform: *place * solid.transform, solid: solid.solid })
}

fn placed_node(tree: &mut SolidTree, place: &DAffine3, node: NodeId) -> NodeId {
    tree.add(SolidNode { transform: *place, material: None, kind: NodeKind::Union(vec![node]) })
}

/// The plane `n . p = d` under `place`.
fn mapped_plane(place: &DAffine3, n: DVec3, d: f64) -> Result<(DVec3, f64), String> {
    let inverse: DMat3 = place.matrix3.inverse();
    let normal = inverse.transpose() * n;
    let distance = normal.dot(place.transform_point3(n * (d / n.length_squared())));
    if normal.is_finite() && distance.is_finite() {
        Ok((normal, distance))
    } else {
        Err("its map has no inverse".into())
    }
}

/// The box BRL-CAD takes for a solid under `place`, lower and upper corner; `None` for those without bounds, and for
/// those that [`add`] refuses. For cones it is that of the parallelograms around the ends.
pub(super) fn bounds(solid: &Solid, place: &DAffine3) -> Option<(DVec3, DVec3)> {
    let point = |p: DVec3| place.transform_point3(p);
    let vector = |d: DVec3| place.transform_vector3(d);
    match solid {
        Solid::Arb { points } => hull(points.iter().map(|&p| point(p))),
        Solid::Ell { v, axes } => {
            let reach = axes.iter().map(|&a| vector(a) * vector(a)).sum::<DVec3>();
            let reach = DVec3::from(reach.to_array().map(f64::sqrt));
            Some((point(*v) - reach, point(*v) + reach))
        }
        // A right cylinder, elliptic perhaps, has its true box.
        Solid::Tgc { v, h, base: [a, b], top } if is_right_cylinder(*h, [*a, *b], *top) => {
            let (a, b) = (vector(*a), vector(*b));
            let reach = DVec3::from((a * a + b * b).to_array().map(f64::sqrt));
            hull([point(*v), point(*v + *h)].into_iter().flat_map(|p| [p - reach, p + reach]))
        }
        Solid::Tgc { v, h, base, top } => {
            let ends = [(point(*v), base), (point(*v + *h), top)];
            hull(ends.into_iter().flat_map(|(centre, [a, b])| {
                let (a, b) = (vector(*a), vector(*b));
                [centre + a + b, centre + a - b, centre - a + b, centre - a - b]
            }))
        }
        Solid::Tor { v, h, major, minor } => {
            let scale = vector(*h).length();
            let axis = vector(*h) / scale;
            let along = |n: f64| scale * (major * (1.0 - n * n).max(0.0).sqrt() + minor);
            let reach = DVec3::from(axis.to_array().map(along));
            Some((point(*v) - reach, point(*v) + reach))
        }
        Solid::Half { .. } => None,
        Solid::Bot { vertices, .. } => hull(vertices.iter().map(|&p| point(p))),
        _ => {
            let mut tree = SolidTree::new("");
            add(&mut tree, solid, place).ok()?;
            let flat = solids::flat::FlatTree::new(&tree).ok()?;
            let boxes = flat.leaves.iter().filter_map(|leaf| {
                let (lo, hi) = leaf.solid.bounds();
                (lo.is_finite() && hi.is_finite()).then(|| crate::math::transformed_bounds(&leaf.to_tree, lo, hi))
            });
            boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
        }
    }
}

/// Whether both ends are alike and stand upright on the axis.
fn is_right_cylinder(h: DVec3, base: [DVec3; 2], top: [DVec3; 2]) -> bool {
    const ALIKE: f64 = 1e-6;
    let alike = |i: usize| (base[i] - top[i]).length() <= ALIKE * base[i].length();
    let upright = |d: DVec3| h.dot(d).abs() <= ALIKE * h.length() * d.length();
    alike(0) && alike(1) && upright(base[0]) && upright(base[1])
}

fn hull(points: impl Iterator<Item = DVec3>) -> Option<(DVec3, DVec3)> {
    points.map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}
