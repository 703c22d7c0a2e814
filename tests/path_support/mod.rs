//! Small scenes for the path tracer, and what their pictures hold.
#![allow(dead_code, reason = "each test file uses its own part of this module")]

pub mod facets;

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use lanecast::camera::{Camera, Filter};
use lanecast::film::{Film, PlaneData};
use lanecast::render::{RenderOptions, RenderOutput, Silent, render};
use lanecast::scene::description::{
    CameraDescription, Description, Item, ItemKind, Material, MaterialId, Projection, Shape,
};
use lanecast::scene::light::Environment;
use lanecast::scene::material::Scattering;
use lanecast::scene::mesh::Mesh;
use lanecast::scene::texture::{Texels, Texture};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::{Integrator, Shades};

/// A black scene without light: no ambient light, no background; the headlight stays out by a light of no power.
pub fn dark() -> Description {
    let mut d = Description::new("test");
    d.ambient = DVec3::ZERO;
    d
}

/// Adds `material`.
pub fn add(d: &mut Description, material: Material) -> MaterialId {
    d.materials.push(material);
    d.materials.len() as u32 - 1
}

/// A material that scatters as `scattering` says, of base colour `base`.
pub fn scatters(scattering: Scattering, base: DVec3) -> Material {
    Material { diffuse: base, scattering, ..Material::default() }
}

/// A surface that reflects nothing and emits `emission` on both sides.
pub fn lamp(emission: f64) -> Material {
    Material { diffuse: DVec3::ZERO, emission: DVec3::splat(emission), ..Material::default() }
}

/// Places `shape`.
pub fn shape(d: &mut Description, shape: Shape, transform: DAffine3, material: MaterialId) {
    d.groups[0].items.push(Item { transform, material: Some(material), kind: ItemKind::Shape(shape) });
}

/// A sphere.
pub fn sphere(d: &mut Description, centre: DVec3, radius: f64, material: MaterialId) {
    let map = DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(radius)), centre);
    shape(d, Shape::Sphere, map, material);
}

/// The plane z = `z`, which looks up.
pub fn plane(d: &mut Description, z: f64, material: MaterialId) {
    shape(d, Shape::HalfSpace, DAffine3::from_translation(DVec3::new(0.0, 0.0, z)), material);
}

/// The parallelogram at `corner` along `a` and `b`, wound so that its normal is a x b.
pub fn parallelogram(d: &mut Description, corner: DVec3, a: DVec3, b: DVec3, material: MaterialId) {
    let positions = vec![corner, corner + a, corner + a + b, corner + b];
    let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
    d.meshes.push(Arc::new(mesh));
    let kind = ItemKind::Mesh(d.meshes.len() as u32 - 1);
    d.groups[0].items.push(Item { transform: DAffine3::IDENTITY, material: Some(material), kind });
}

/// The same radiance from everywhere, as a picture.
pub fn constant_environment(radiance: DVec3) -> Environment {
    let texels = Texels::Float(vec![[1.0; 4]; 8 * 4]);
    let texture = Texture { name: "constant".into(), width: 8, height: 4, texels };
    Environment { texture: texture.into(), scale: radiance, to_world: DMat3::from_rotation_x(0.3) }
}

/// A camera at `eye` that looks at `look_at` under the small angle `theta`.
pub fn look(eye: DVec3, look_at: DVec3, theta: f64) -> Camera {
    camera(eye, look_at, Projection::Perspective { theta })
}

/// A camera with parallel rays; the picture is `height` wide and high.
pub fn parallel(eye: DVec3, look_at: DVec3, height: f64) -> Camera {
    camera(eye, look_at, Projection::Parallel { height })
}

fn camera(eye: DVec3, look_at: DVec3, projection: Projection) -> Camera {
    let up = if (look_at - eye).normalize().y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
    Camera::new(&CameraDescription { name: "test".into(), eye, look_at, up, projection }, 1.0).unwrap()
}

/// A camera that sees the origin only, under `degrees` from +z.
pub fn under(degrees: f64) -> Camera {
    let angle = degrees.to_radians();
    look(DVec3::new(angle.sin(), 0.0, angle.cos()) * 4.0, DVec3::ZERO, 1e-4)
}

/// Paths of at most `depth` scatterings, `size` pixels squared, `spp` each.
pub fn paths(size: u32, spp: u32, depth: u32) -> RenderOptions {
    RenderOptions {
        width: size,
        height: size,
        tile: 8,
        spp,
        depth,
        integrator: Integrator::Path,
        filter: Filter::Box,
        engine: "scalar".into(),
        ..RenderOptions::default()
    }
}

/// The picture.
pub fn picture<S: Shades>(d: &Description, camera: &Camera, options: &RenderOptions) -> RenderOutput {
    let world = World::<S>::compile(d, Preset::Balanced).unwrap();
    let output = render(&world, d, camera, options, &Silent).unwrap();
    assert!(output.is_complete());
    output
}

/// Values of a plane of numbers.
pub fn values<'a>(film: &'a Film, plane: &str) -> &'a [f32] {
    match &film.planes.iter().find(|p| p.name == plane).expect("the plane").data {
        PlaneData::F32(data) => data,
        PlaneData::U32(_) | PlaneData::U8(_) => panic!("{plane} holds integers"),
    }
}

/// Mean colour of all pixels.
pub fn mean(film: &Film) -> DVec3 {
    DVec3::from(["R", "G", "B"].map(|plane| {
        let all = values(film, plane);
        assert!(all.iter().all(|x| x.is_finite() && *x >= 0.0), "not a radiance");
        all.iter().map(|&x| f64::from(x)).sum::<f64>() / all.len() as f64
    }))
}

/// Mean colour that `camera` sees in `d`.
pub fn seen<S: Shades>(d: &Description, camera: &Camera, options: &RenderOptions) -> DVec3 {
    mean(&picture::<S>(d, camera, options).film)
}

/// Checks that `got` is within the share `tolerance` of `want`, in every colour.
#[track_caller]
pub fn near(what: &str, got: DVec3, want: DVec3, tolerance: f64) {
    let error = (got - want).abs();
    assert!(error.cmple(want * tolerance + 1e-12).all(), "{what}: got {got}, want {want}");
}
