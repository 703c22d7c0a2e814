//! What shading needs of a hit, in f64, from the description's own numbers.

use glam::{DAffine3, DMat2, DVec2, DVec3};

use super::runs::{self, Place};
use super::{World, solids, uv};
use crate::lanes::Real;
use crate::math::normal_to_world;
use crate::scene::assembly::{AssemblyObject, Part, PartKind};
use crate::scene::description::Shape;
use crate::scene::mesh::Mesh;
use crate::scene::solids::Solid;
use crate::scene::solids::flat::FlatLeaf;

/// A hit point with what shading needs, f64, world space.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Hit point.
    pub position: DVec3,
    /// Geometric normal, unit, as wound or outward (of a tree of solids, out of the whole); not turned towards the
    /// ray. Zero for degenerate geometry.
    pub ng: DVec3,
    /// Shading normal, unit, on the side of the geometric one; equal to it where the mesh has none.
    pub ns: DVec3,
    /// Bound, per axis, of the coordinates that entered the intersection test: those of the triangle's corners (of
    /// the box of a shape) taken through the maps without the cancellations that signs may bring.
    pub magnitude: DVec3,
    /// Index into the description's materials.
    pub material: u32,
    on: On<'a>,
}

/// What the point is on, for texture coordinates.
#[derive(Clone, Copy, Debug)]
enum On<'a> {
    Triangle(OnTriangle<'a>),
    /// A point of a face, in the space of the shape.
    Shape(Shape, DVec3, u32),
    /// The same of a leaf of a tree.
    Solid(&'a Solid, DVec3, u32),
}

/// See [`World::bare_triangle`].
#[derive(Clone, Copy, Debug)]
pub struct Bare {
    /// Index into the description's materials.
    pub material: u32,
    /// First corner and the edges from it to the second and the third, world space; `None` if it is no such triangle.
    pub triangle: Option<[DVec3; 3]>,
}

/// Where on which triangle.
#[derive(Clone, Copy, Debug)]
struct OnTriangle<'a> {
    mesh: &'a Mesh,
    index: usize,
    weights: [f64; 3],
    to_world: DAffine3,
    /// Whether the mesh's shading normal is on the other side than the geometric one, and was turned.
    is_turned: bool,
}

impl<S: Real> World<S> {
    /// Position, normals and material of a hit (all f64).
    ///
    /// `org`, `dir`: the ray in world space; `t`, `u`, `v`, `prim`, `inst`: a hit of an engine of this world.
    pub fn surface(&self, org: DVec3, dir: DVec3, t: f64, u: f64, v: f64, prim: u32, inst: u32) -> Surface<'_> {
        let placement = &self.assembly.placements[inst as usize];
        let (run, kept) = self.runs[placement.object as usize].placed(prim);
        let part = &self.assembly.objects[placement.object as usize].parts[run.part as usize];
        let material = run.material;
        let stands = placement.stands();
        let is_plain = stands && part.to_object == DAffine3::IDENTITY;
        // In an instance that stays where its object is, places in the object are places in the world.
        let kept = kept.filter(|_| stands);
        let to_world = if is_plain { DAffine3::IDENTITY } else { placement.to_world * part.to_object };
        let placed = |magnitude: DVec3| if stands { magnitude } else { through(&placement.to_world, magnitude) };
        match &part.kind {
            PartKind::Mesh(mesh) => {
                let index = (prim - part.first_prim) as usize;
                let [a, b, c] = mesh.corners(index);
                let size = a.abs().max(b.abs()).max(c.abs());
                let weights = [1.0 - u - v, u, v];
                let local = a * weights[0] + b * weights[1] + c * weights[2];
                let cross = (b - a).cross(c - a);
                let (position, ng, magnitude) = if is_plain {
                    (local, cross.normalize_or_zero(), size)
                } else {
                    (
                        to_world.transform_point3(local),
                        normal_to_world(&to_world, cross),
                        placed(through(&part.to_object, size)),
                    )
                };
                let mut on = OnTriangle { mesh, index, weights, to_world, is_turned: false };
                let own = on.shading_normal().unwrap_or(ng);
                on.is_turned = own.dot(ng) < 0.0;
                let ns = if on.is_turned { -own } else { own };
                Surface { position, ng, ns, magnitude, material, on: On::Triangle(on) }
            }
            PartKind::Shape(shape) => {
                let position = org + dir * t;
                let place = kept.copied().unwrap_or_else(|| Place::new(&to_world));
                let (local, face) = (place.local(position), u as u32);
                let ng = place.normal(solids::shape_normal(shape, local, face));
                let on = On::Shape(*shape, local, face);
                Surface { position, ng, ns: ng, magnitude: placed(shape_magnitude(part)), material, on }
            }
            PartKind::Solids(tree) => {
                let leaf = &tree.leaves[(prim - part.first_prim) as usize];
                let position = org + dir * t;
                let magnitude = placed(leaf_magnitude(part, leaf));
                let place = kept.copied().unwrap_or_else(|| Place::new(&(to_world * leaf.to_tree)));
                let (local, face) = (place.local(position), u as u32);
                let outward = place.normal(solids::solid_normal(&leaf.solid, local, face));
                let ng = if v > 0.5 { -outward } else { outward };
                Surface { position, ng, ns: ng, magnitude, material, on: On::Solid(&leaf.solid, local, face) }
            }
        }
    }

    /// Unit outward normal of the shape or leaf `prim` of instance `inst`, which stays where its object is, at `position` on
    /// its face `face`; `None` of other instances and of triangles.
    pub(super) fn outward(&self, position: DVec3, face: u32, prim: u32, inst: u32) -> Option<DVec3> {
        let placement = &self.assembly.placements[inst as usize];
        let object = placement.stands().then_some(placement.object)?;
        let (run, kept) = self.runs[object as usize].placed(prim);
        let (part, place) = (&self.assembly.objects[object as usize].parts[run.part as usize], kept?);
        let local = place.local(position);
        match &part.kind {
            PartKind::Mesh(_) => None,
            PartKind::Shape(shape) => Some(place.normal(solids::shape_normal(shape, local, face))),
            PartKind::Solids(tree) => {
                let leaf = &tree.leaves[(prim - part.first_prim) as usize];
                Some(place.normal(solids::solid_normal(&leaf.solid, local, face)))
            }
        }
    }

    /// Where shape or leaf `prim` of `object` stands in the object's space; `None` for triangles.
    pub fn place(&self, object: u32, prim: u32) -> Option<Place> {
        let (run, kept) = self.runs[object as usize].placed(prim);
        kept.copied().or_else(|| runs::place(&self.assembly.objects[object as usize], &run))
    }

    /// Material of primitive `prim` of `object`: an index into the description's materials.
    pub fn material(&self, object: u32, prim: u32) -> u32 {
        self.runs[object as usize].of(prim).material
    }

    /// Number of the part of `object` that primitive `prim` belongs to.
    pub fn part(&self, object: u32, prim: u32) -> u32 {
        self.runs[object as usize].of(prim).part
    }

    /// A hit on a triangle whose mesh has no shading normals, for those who compute the rest themselves.
    #[inline]
    pub fn bare_triangle(&self, prim: u32, inst: u32) -> Bare {
        let run = self.runs[self.assembly.placements[inst as usize].object as usize].of(prim);
        let plain = |mesh: &Mesh| mesh.normals.values.is_empty();
        Bare { material: run.material, triangle: self.triangle_if(run.part, prim, inst, plain) }
    }

    /// First corner of a triangle and the edges from it to the second and the third, world space; `None` if `prim` is something
    /// else.
    pub fn triangle(&self, prim: u32, inst: u32) -> Option<[DVec3; 3]> {
        self.triangle_if(self.part(self.assembly.placements[inst as usize].object, prim), prim, inst, |_| true)
    }

    /// [`Self::triangle`] of part `part`, if its mesh is `wanted`.
    #[inline(always)]
    fn triangle_if(&self, part: u32, prim: u32, inst: u32, wanted: impl Fn(&Mesh) -> bool) -> Option<[DVec3; 3]> {
        let placement = &self.assembly.placements[inst as usize];
        let part = &self.assembly.objects[placement.object as usize].parts[part as usize];
        let PartKind::Mesh(mesh) = &part.kind else { return None };
        if !wanted(mesh) {
            return None;
        }
        let [a, b, c] = mesh.corners((prim - part.first_prim) as usize);
        let (e1, e2) = (b - a, c - a);
        if placement.stands() && part.to_object == DAffine3::IDENTITY {
            return Some([a, e1, e2]);
        }
        let m = placement.to_world * part.to_object;
        Some([m.transform_point3(a), m.transform_vector3(e1), m.transform_vector3(e2)])
    }
}

impl<S: Real> World<S> {
    /// The object of the assembly's first placement, and its number: of a world that is one object, that one. It need not be the
    /// assembly's first, which may be placed nowhere.
    pub fn first_placed(&self) -> Option<(u32, &AssemblyObject)> {
        let number = self.assembly.placements.first()?.object;
        Some((number, self.assembly.objects.get(number as usize)?))
    }

    /// First primitive, and the one after the last, of each run of primitives of `object` with one material.
    pub fn material_runs(&self, object: u32) -> impl Iterator<Item = (u32, u32)> {
        let runs = self.runs[object as usize].list();
        let count = self.assembly.objects[object as usize].prim_count;
        let ends = runs.iter().skip(1).map(|run| run.first).chain([count]);
        runs.iter().map(|run| run.first).zip(ends)
    }
}

impl Surface<'_> {
    /// Texture coordinates of set 0 or 1, v down; (0, 0) where a mesh has none. Shapes and the leaves of solids have
    /// those of their form in both sets.
    pub fn uv(&self, set: u8) -> [f64; 2] {
        let down = |[u, v]: [f64; 2]| [u, 1.0 - v];
        let on = match self.on {
            On::Triangle(ref on) => on,
            On::Shape(shape, point, face) => {
                return down(uv::of_shape(&shape, point, solids::shape_normal(&shape, point, face)));
            }
            On::Solid(solid, point, face) => {
                return down(uv::of_solid(solid, point, solids::solid_normal(solid, point, face), face));
            }
        };
        on.uvs(set).map_or([0.0; 2], |uvs| {
            let [a, b, c] = on.weights;
            (uvs[0] * a + uvs[1] * b + uvs[2] * c).to_array()
        })
    }

    /// Unit directions to the right and up in a picture, perpendicular to the shading normal, as normal maps want them;
    /// `to_picture` takes the texture coordinates of set 0 or 1 to the picture's. By the mesh's tangents, or from
    /// positions and coordinates; `None` without either, as on shapes.
    pub fn tangents(&self, set: u8, to_picture: &DMat2) -> Option<[DVec3; 2]> {
        let On::Triangle(on) = &self.on else { return None };
        let (along, sign) = on.tangent().or_else(|| on.tangent_by_uv(set))?;
        let tangent = (along - self.ns * self.ns.dot(along)).try_normalize()?;
        let bitangent = self.ns.cross(tangent) * sign;
        let determinant = to_picture.determinant();
        if *to_picture == DMat2::IDENTITY || determinant == 0.0 || !determinant.is_finite() {
            return Some([tangent, bitangent]);
        }
        // What one step to the right in the picture is in coordinates, whose v points down.
        let step = DVec2::new(to_picture.y_axis.y, -to_picture.x_axis.y) * determinant.signum();
        let turned = (tangent * step.x - bitangent * step.y).try_normalize()?;
        Some([turned, self.ns.cross(turned) * (sign * determinant.signum())])
    }
}

impl OnTriangle<'_> {
    fn vertices(&self) -> [u32; 3] {
        self.mesh.triangles[self.index]
    }

    fn shading_normal(&self) -> Option<DVec3> {
        let corners = self.mesh.normals.corners(self.index, self.vertices())?;
        let local = self.mean(corners.map(|n| DVec3::from(n.map(f64::from))));
        let world = normal_to_world(&self.to_world, local);
        (world != DVec3::ZERO).then_some(world)
    }

    fn mean(&self, corners: [DVec3; 3]) -> DVec3 {
        let [a, b, c] = self.weights;
        corners[0] * a + corners[1] * b + corners[2] * c
    }

    fn uvs(&self, set: u8) -> Option<[DVec2; 3]> {
        let corners = self.mesh.uvs[usize::from(set.min(1))].corners(self.index, self.vertices())?;
        Some(corners.map(|uv| DVec2::from(uv.map(f64::from))))
    }

    /// The mesh's own tangent and the sign of its bitangent, which belongs to the mesh's own normal, turned or not.
    fn tangent(&self) -> Option<(DVec3, f64)> {
        let corners = self.mesh.tangents.corners(self.index, self.vertices())?;
        let local = self.mean(corners.map(|[x, y, z, _]| DVec3::new(x.into(), y.into(), z.into())));
        let turned = if self.is_turned { -1.0 } else { 1.0 };
        Some((self.to_world.transform_vector3(local), f64::from(corners[0][3]) * self.mirrored() * turned))
    }

    /// -1 where the map to the world mirrors, so that it takes products of vectors to the other side; else 1.
    fn mirrored(&self) -> f64 {
        self.to_world.matrix3.determinant().signum()
    }

    /// The direction in which u grows, and on which side of it v grows, seen against the geometric normal.
    fn tangent_by_uv(&self, set: u8) -> Option<(DVec3, f64)> {
        let [a, b, c] = self.uvs(set)?;
        let [p, q, r] = self.mesh.corners(self.index).map(|v| self.to_world.transform_point3(v));
        let (e1, e2, d1, d2) = (q - p, r - p, b - a, c - a);
        let determinant = d1.perp_dot(d2);
        let along = (e1 * d2.y - e2 * d1.y) * determinant.signum();
        // glTF's v points down, its bitangent up: coordinates that run against each other.
        (determinant != 0.0).then(|| {
            let down = (e2 * d1.x - e1 * d2.x) * determinant.signum();
            let side = e1.cross(e2).cross(along).dot(down) * self.mirrored();
            (along, if side > 0.0 { -1.0 } else { 1.0 })
        })
    }
}

/// Bound of the coordinates of the shape that `part` is, in the object's space.
pub(super) fn shape_magnitude(part: &Part) -> DVec3 {
    through(&part.to_object, DVec3::ONE)
}

/// The same of a leaf of the solids that `part` is.
pub(super) fn leaf_magnitude(part: &Part, leaf: &FlatLeaf) -> DVec3 {
    let (lo, hi) = leaf.solid.bounds();
    let size = lo.abs().max(hi.abs());
    through(&part.to_object, through(&leaf.to_tree, if size.is_finite() { size } else { DVec3::ONE }))
}

/// Largest coordinates of the images under `map` of points with coordinates up to `magnitude`.
fn through(map: &DAffine3, magnitude: DVec3) -> DVec3 {
    let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(DVec3::abs);
    x * magnitude.x + y * magnitude.y + z * magnitude.z + map.translation.abs()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::assembly::{Assembly, Placement};
    use crate::scene::description::Description;
    use crate::scene::world::Preset;

    /// Engines and shading must not rely on the assembly's order.
    #[test]
    fn the_object_placed_first_need_not_be_the_first() {
        let mut world = World::<f32>::compile(&Description::new("nothing"), Preset::Fast).unwrap();
        assert!(world.first_placed().is_none());
        let object = |prim_count| AssemblyObject { prim_count, ..AssemblyObject::default() };
        let placements = vec![Placement { object: 1, to_world: DAffine3::IDENTITY }];
        world.assembly = Arc::new(Assembly { objects: vec![object(5), object(7)], placements });
        assert_eq!(world.first_placed().map(|(number, object)| (number, object.prim_count)), Some((1, 7)));
    }
}
