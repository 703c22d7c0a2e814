//! Meshes that are traced as one look as they do apart, and have the same numbers.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use lanecast::camera::Camera;
use lanecast::film::PlaneData;
use lanecast::render::{Aov, RenderOptions, Silent, render};
use lanecast::scene::description::{
    CameraDescription, Description, Group, Item, ItemKind, Light, Material, Projection,
};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::{Integrator, Shades};

use crate::common::{Random, ball, item, soup};

const SIZE: u32 = 64;

/// Seven meshes under maps of their own, in three materials, one of which is a mirror and one of which shines.
fn described() -> Description {
    let (mut r, mut d) = (Random(4), Description::new("meshes"));
    let named = |name: &str| Material { name: name.into(), ..Material::default() };
    d.materials.push(Material { mirror: DVec3::splat(0.7), ..named("mirror") });
    d.materials.push(Material { emission: DVec3::new(3.0, 2.0, 1.0), ..named("lamp") });
    d.lights.push(Light::Point { position: DVec3::new(2.0, 9.0, 6.0), intensity: DVec3::splat(300.0) });
    for i in 0..7 {
        d.meshes.push(Arc::new(if i % 2 == 0 { ball(6, 9) } else { soup(30, &mut r) }));
        let part = Item { material: Some(i % 3), ..item(ItemKind::Mesh(i), DAffine3::IDENTITY) };
        d.groups.push(Group { name: format!("mesh {i}"), items: vec![part] });
        let mut map = r.affine(0.8);
        map.translation = r.in_cube() * 2.0;
        d.groups[0].items.push(item(ItemKind::Instance(i + 1), map));
    }
    d
}

/// Pixels whose numbers differ between the meshes joined and apart, and those with other differences above `most`; of how many
/// hits.
fn compare<S: Shades>(integrator: Integrator, most: f32) -> [usize; 3] {
    let mut d = described();
    let projection = Projection::Perspective { theta: 0.7 };
    let (eye, look_at, up) = (DVec3::new(5.0, 4.0, 6.0), DVec3::ZERO, DVec3::Y);
    let camera = Camera::new(&CameraDescription { name: "eye".into(), eye, look_at, up, projection }, 1.0).unwrap();
    let aovs = vec![Aov::Z, Aov::Normal, Aov::Albedo, Aov::Instance, Aov::Primitive, Aov::Material, Aov::Cryptomatte];
    let options = RenderOptions { width: SIZE, height: SIZE, integrator, aovs, ..RenderOptions::default() };
    let mut picture = |joins: bool| {
        d.joins = joins;
        let world = World::<S>::compile(&d, Preset::Balanced).unwrap();
        assert_eq!((world.stats().joined, world.is_single_object()), if joins { (7, true) } else { (0, false) });
        render(&world, &d, &camera, &options, &Silent).unwrap().film
    };
    let (joined, apart) = (picture(true), picture(false));
    let mut found = [vec![false; (SIZE * SIZE) as usize], vec![false; (SIZE * SIZE) as usize]];
    let mut hits = 0;
    for (one, other) in joined.planes.iter().zip(&apart.planes) {
        assert_eq!(one.name, other.name);
        match (&one.data, &other.data) {
            (PlaneData::U32(one_data), PlaneData::U32(other)) => {
                let pairs = one_data.iter().zip(other).zip(&mut found[0]);
                pairs.for_each(|((one, other), found)| *found |= one != other);
                if one.name == "id.instance" {
                    hits = one_data.iter().filter(|inst| **inst != u32::MAX).count();
                }
            }
            (PlaneData::F32(one), PlaneData::F32(other)) => {
                // Equal infinities are near, NaN is near nothing.
                let near = |a: f32, b: f32| a == b || (a - b).abs() <= most * b.abs().max(1.0);
                let pairs = one.iter().zip(other).zip(&mut found[1]);
                pairs.for_each(|((&one, &other), found)| *found |= !near(one, other));
            }
            _ => panic!("planes of other kinds"),
        }
    }
    let count = |list: &Vec<bool>| list.iter().filter(|x| **x).count();
    [count(&found[0]), count(&found[1]), hits]
}

#[test]
fn joined_meshes_look_as_they_do_apart() {
    let [ids, colours, hits] = compare::<f64>(Integrator::Whitted, 1e-5);
    assert!(ids == 0 && colours == 0 && hits > 500, "f64: {ids} ids, {colours} colours of {hits}");
    let [ids, colours, hits] = compare::<f32>(Integrator::Whitted, 1e-3);
    assert!(ids <= 4 && colours <= 12 && hits > 500, "f32: {ids} ids, {colours} colours of {hits}");
    let [ids, colours, hits] = compare::<f64>(Integrator::Path, 1e-4);
    assert!(ids == 0 && colours <= 4 && hits > 500, "f64 path: {ids} ids, {colours} colours of {hits}");
}
