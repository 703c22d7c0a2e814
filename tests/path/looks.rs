//! What materials take from pictures and from each other: textures on shapes, turned normal maps, mixtures that shine.

use crate::path_support;

use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DMat2, DMat3, DVec2, DVec3};
use lanecast::camera::sampling::PixelRandom;
use lanecast::scene::description::{Description, Item, ItemKind, Material, Shape};
use lanecast::scene::kdl::{meshes::MeshFiles, parse};
use lanecast::scene::material::{Scattering, TextureRef};
use lanecast::scene::mesh::{Attribute, Mesh};
use lanecast::scene::texture::{Texels, Texture};
use lanecast::scene::world::{Preset, World};
use path_support::{add, dark, lamp, look, near, paths, plane, scatters, seen, shape, sphere};

/// A picture of 2 x 2: red, green above blue, grey.
fn four(d: &mut Description) -> TextureRef {
    let texels = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.5]];
    let texels = Texels::Float(texels.map(|[r, g, b]| [r, g, b, 1.0]).to_vec());
    d.textures.push(Texture { name: "four".into(), width: 2, height: 2, texels }.into());
    TextureRef { nearest: true, ..TextureRef::new(d.textures.len() as u32 - 1) }
}

fn pictured_lamp(d: &mut Description) -> u32 {
    let mut material = lamp(1.0);
    material.textures.emission = Some(four(d));
    add(d, material)
}

#[test]
fn pictures_stand_upright_on_shapes() {
    let mut d = dark();
    let id = pictured_lamp(&mut d);
    shape(&mut d, Shape::Disc, DAffine3::IDENTITY, id);
    sphere(&mut d, DVec3::new(4.0, 0.0, 0.0), 1.0, id);
    let at = |x: f64, y: f64, z: f64, from: DVec3| {
        let place = DVec3::new(x, y, z);
        seen::<f32>(&d, &look(place + from, place, 1e-3), &paths(2, 4, 0))
    };
    let colours = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::splat(0.5)];
    // Seen from its front, y up: the upper left quarter is red.
    for ([x, y], want) in [[-0.4, 0.4], [0.4, 0.4], [-0.4, -0.4], [0.4, -0.4]].into_iter().zip(colours) {
        near("disc", at(x, y, 0.0, DVec3::Z * 3.0), want, 1e-6);
    }
    // Longitudes from +x by way of +y, the north pole at +z: the left half of the picture is the half towards +y.
    let half = 0.5f64.sqrt();
    for ([y, z], want) in [[half, half], [-half, half], [half, -half], [-half, -half]].into_iter().zip(colours) {
        near("sphere", at(4.0, y, z, DVec3::new(0.0, y, z) * 3.0), want, 1e-6);
    }
}

/// Whichever end is the wider, and however the cone is written.
#[test]
fn pictures_stand_upright_on_cones() {
    let truncated = |c: f64, d: f64| {
        format!("truncated-cone material=\"m\" {{ base 0 0 -1; height 0 0 2; a 1 0 0; b 0 1 0; c {c} 0 0; d 0 {d} 0 }}")
    };
    let cone = |top: f64| format!("cone material=\"m\" top={top} {{ from 0 0 -1; to 0 0 1 }}");
    let half = [[-0.4, 0.4], [0.4, 0.4], [-0.4, -0.4], [0.4, -0.4]];
    for text in [
        cone(0.75),
        cone(1.5),
        format!("union {{ {} }}", cone(1.5)),
        truncated(0.75, 0.75),
        truncated(1.5, 1.5),
        truncated(1.5, 1.25),
    ] {
        let files = MeshFiles { folder: None, allow_outside: false, found: None, read: &|_| panic!("no meshes here") };
        let scene = format!("material \"m\"\n{text}");
        let mut d = parse(Path::new("t.kdl"), "t", scene.as_bytes(), &[], &files).unwrap();
        let mut material = lamp(1.0);
        material.textures.emission = Some(four(&mut d));
        d.materials[1] = material;
        let at = |place: DVec3, from: DVec3| seen::<f32>(&d, &look(place + from, place, 1e-3), &paths(2, 4, 0));
        let colours = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::splat(0.5)];
        // The left half of the picture is the half towards +y, as on spheres.
        for ([y, z], want) in [[1.0, 0.5], [-1.0, 0.5], [1.0, -0.5], [-1.0, -0.5]].into_iter().zip(colours) {
            near(&text, at(DVec3::Z * z, DVec3::Y * (4.0 * y)), want, 1e-6);
        }
        for ([x, y], want) in half.into_iter().zip(colours) {
            near(&text, at(DVec3::new(x, y, 1.0), DVec3::Z * 3.0), want, 1e-6);
            near(&text, at(DVec3::new(-x, y, -1.0), DVec3::Z * -3.0), want, 1e-6);
        }
    }
}

/// A lamp with a picture is found by chance and aimed at: both must see the same picture. On the axis of a disc every
/// quarter counts the same.
#[test]
fn pictured_lamps_light_as_they_are_seen() {
    let (radius, distance) = (0.8f64, 1.5f64);
    for depth in [1, 2] {
        let mut d = dark();
        let id = pictured_lamp(&mut d);
        let matte = add(&mut d, Material { diffuse: DVec3::splat(0.5), ..Material::default() });
        plane(&mut d, 0.0, matte);
        let map = DAffine3::from_scale_rotation_translation(
            DVec3::splat(radius),
            glam::DQuat::from_rotation_x(PI),
            DVec3::Z * distance,
        );
        shape(&mut d, Shape::Disc, map, id);
        let share = radius * radius / (radius * radius + distance * distance);
        let mean = DVec3::splat(1.5 / 4.0);
        let camera = look(DVec3::new(3.0, 0.0, 1.0), DVec3::ZERO, 1e-3);
        near("disc", seen::<f32>(&d, &camera, &paths(8, 4096, depth)), mean * 0.5 * share, 3e-3);
    }
    // A sphere whose upper half is brighter: by an aim at it, and by paths that meet it without one.
    let lit = |aimed: bool| {
        let mut d = dark();
        let id = pictured_lamp(&mut d);
        let matte = add(&mut d, Material { diffuse: DVec3::splat(0.5), ..Material::default() });
        plane(&mut d, 0.0, matte);
        // An ellipsoid that is hardly one is not aimed at.
        let flat = if aimed { 1.0 } else { 1.0 - 1e-6 };
        let map = DMat3::from_diagonal(DVec3::new(0.7, 0.7 * flat, 0.7));
        shape(&mut d, Shape::Sphere, DAffine3::from_mat3_translation(map, DVec3::new(0.3, 0.2, 1.4)), id);
        seen::<f32>(&d, &look(DVec3::new(3.0, 0.0, 1.0), DVec3::ZERO, 1e-3), &paths(16, 4096, 1))
    };
    near("sphere", lit(true), lit(false), 6e-3);
}

fn square(uvs: [[f32; 2]; 4]) -> Description {
    let mut d = dark();
    let positions = [[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 3.0]].map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec();
    let uvs = [Attribute { values: uvs.to_vec(), ..Attribute::default() }, Attribute::default()];
    d.meshes.push(Arc::new(Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], uvs, ..Mesh::default() }));
    let kind = ItemKind::Mesh(0);
    d.groups[0].items.push(Item { transform: DAffine3::IDENTITY, material: None, kind });
    d
}

/// Tangents under a map of coordinates are those of a mesh whose coordinates went through it before.
#[test]
fn tangents_turn_with_their_pictures() {
    let tangents = |d: &Description, map: &DMat2| {
        let world = World::<f64>::compile(d, Preset::Balanced).unwrap();
        let surface = world.surface(DVec3::new(0.5, 0.5, 1.0), -DVec3::Z, 1.0, 0.2, 0.1, 0, 0);
        surface.tangents(0, map).unwrap()
    };
    // u along x; v, which points down, against y.
    let corners = [[0.0, 3.0], [2.0, 3.0], [2.0, 0.0], [0.0, 0.0]];
    let plain = square(corners);
    assert_eq!(tangents(&plain, &DMat2::IDENTITY), [DVec3::X, DVec3::Y]);
    // A quarter turn of the coordinates, from right to down: right in the picture is up on the square.
    let [right, up] = tangents(&plain, &DMat2::from_angle(std::f64::consts::FRAC_PI_2));
    assert!(right.distance(DVec3::Y) < 1e-12 && up.distance(-DVec3::X) < 1e-12, "{right} {up}");
    let random = PixelRandom::new(1, 2, 3);
    for k in 0..200 {
        let ([angle, sx], [sy, flip]) = (random.spread(k, 0), random.spread(k, 1));
        let sign = if flip < 0.5 { -1.0 } else { 1.0 };
        let map = DMat2::from_angle(angle * 7.0) * DMat2::from_diagonal(DVec2::new(0.2 + sx, sign * (0.2 + sy)));
        let baked = square(corners.map(|uv| (map * DVec2::from(uv.map(f64::from))).to_array().map(|x| x as f32)));
        let (there, here) = (tangents(&baked, &DMat2::IDENTITY), tangents(&plain, &map));
        for i in 0..2 {
            assert!(there[i].distance(here[i]) < 1e-5, "{k}: {there:?} {here:?}");
        }
    }
}

/// What a mixture emits is what its materials do, by their shares, seen and as a light.
#[test]
fn mixtures_shine_by_their_shares() {
    let light = |mixed: bool| {
        let mut d = dark();
        let (bright, dim) = (add(&mut d, lamp(8.0)), add(&mut d, Material { one_sided: true, ..lamp(2.0) }));
        let black = add(&mut d, lamp(0.0));
        let half = add(&mut d, scatters(Scattering::Mix { first: bright, second: black, amount: 0.75 }, DVec3::ZERO));
        let mix = Scattering::Mix { first: half, second: dim, amount: 0.5 };
        let plain = Material { emission: DVec3::splat(2.0), ..lamp(0.0) };
        let id = if mixed { add(&mut d, scatters(mix, DVec3::ZERO)) } else { add(&mut d, plain) };
        let matte = add(&mut d, Material { diffuse: DVec3::splat(0.5), ..Material::default() });
        plane(&mut d, 0.0, matte);
        sphere(&mut d, DVec3::Z * 2.0, 0.5, id);
        d
    };
    let (mixed, plain) = (light(true), light(false));
    let on = |d: &Description, at: DVec3| seen::<f32>(d, &look(DVec3::new(3.0, 0.0, 2.0), at, 1e-3), &paths(4, 256, 2));
    near("seen", on(&mixed, DVec3::Z * 2.0), DVec3::splat(2.0), 1e-6);
    near("as a light", on(&mixed, DVec3::ZERO), on(&plain, DVec3::ZERO), 1e-6);
}
