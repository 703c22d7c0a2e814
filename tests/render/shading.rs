//! Rendered pixels against values worked out by hand: lighting, shadows, mirrors, occlusion, AOVs.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use lanecast::camera::Camera;
use lanecast::film::{Film, PlaneData, Window};
use lanecast::render::{Aov, RenderOptions, RenderOutput, Silent, render};
use lanecast::scene::description::{
    CameraDescription, Description, Group, Item, ItemKind, Light, Material, Projection, Shape,
};
use lanecast::scene::material::Scattering;
use lanecast::scene::mesh::{Attribute, Mesh};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::{Integrator, Shades};

/// The plane z = 0 and spheres (centre, radius, material); no ambient light.
fn scene(plane: Option<u32>, spheres: &[(DVec3, f64, u32)]) -> Description {
    let mut d = Description::new("test");
    d.ambient = DVec3::ZERO;
    let item = |transform, material, shape| Item { transform, material: Some(material), kind: ItemKind::Shape(shape) };
    let place = |c, r| DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(r)), c);
    let items = &mut d.groups[0].items;
    items.extend(plane.map(|material| item(DAffine3::IDENTITY, material, Shape::HalfSpace)));
    items.extend(spheres.iter().map(|&(c, r, material)| item(place(c, r), material, Shape::Sphere)));
    d.materials.push(Material {
        name: "mirror".into(),
        diffuse: DVec3::ZERO,
        mirror: DVec3::new(0.9, 0.8, 0.7),
        ..Material::default()
    });
    d.materials.push(Material {
        name: "lamp".into(),
        diffuse: DVec3::ZERO,
        emission: DVec3::new(3.0, 2.0, 1.0),
        ..Material::default()
    });
    d
}

fn look(eye: DVec3, look_at: DVec3, theta: f64) -> Camera {
    let up = DVec3::Y;
    let projection = Projection::Perspective { theta };
    Camera::new(&CameraDescription { name: "test".into(), eye, look_at, up, projection }, 1.0).unwrap()
}

/// Straight down onto the origin from (0, 0, 4); odd sizes put a pixel centre exactly on the axis.
fn from_above() -> Camera {
    look(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, FRAC_PI_2)
}

fn options(size: u32) -> RenderOptions {
    RenderOptions { width: size, height: size, tile: 8, engine: "scalar".into(), ..RenderOptions::default() }
}

fn picture<S: Shades>(d: &Description, camera: &Camera, options: &RenderOptions) -> RenderOutput {
    let world = World::<S>::compile(d, Preset::Balanced).unwrap();
    let output = render(&world, d, camera, options, &Silent).unwrap();
    assert!(output.is_complete());
    output
}

fn value(film: &Film, plane: &str, x: u32, y: u32) -> f64 {
    let window = film.window;
    let index = ((y - window.y0) * (window.x1 - window.x0) + x - window.x0) as usize;
    match &film.planes.iter().find(|p| p.name == plane).unwrap().data {
        PlaneData::F32(data) => f64::from(data[index]),
        PlaneData::U32(data) => f64::from(data[index]),
        PlaneData::U8(data) => f64::from(data[index]) / 255.0,
    }
}

fn color(film: &Film, x: u32, y: u32) -> DVec3 {
    DVec3::from(["R", "G", "B"].map(|plane| value(film, plane, x, y)))
}

fn close(got: DVec3, want: DVec3) {
    assert!((got - want).abs().max_element() < 2e-6, "got {got}, want {want}");
}

#[test]
fn lambert_ambient_and_emission_by_hand() {
    let mut d = scene(Some(0), &[]);
    d.materials[0].diffuse = DVec3::new(0.5, 0.25, 1.0);
    d.materials[0].emission = DVec3::new(0.0, 0.0, 0.125);
    d.ambient = DVec3::splat(0.2);
    // At the origin: distance 5, cosine 4/5; above it a directional light, tilted by 60 degrees.
    let intensity = DVec3::splat(25.0 * PI);
    d.lights.push(Light::Point { position: DVec3::new(3.0, 0.0, 4.0), intensity });
    let direction = DVec3::new(0.0, 3f64.sqrt(), -1.0);
    d.lights.push(Light::Directional { direction, irradiance: DVec3::splat(PI) });
    let output = picture::<f32>(&d, &from_above(), &options(3));
    // diffuse / pi (25 pi / 25 * 0.8 + pi * 0.5) + 0.2 diffuse + emission = diffuse * 1.5 + emission.
    close(color(&output.film, 1, 1), DVec3::new(0.75, 0.375, 1.5 + 0.125));
    assert_eq!((output.rays.primary, output.rays.shadow, output.rays.mirror), (9, 18, 0));
}

#[test]
fn scenes_without_light_get_one_from_the_camera_that_goes_through_walls() {
    // The headlight is tilted by (0.3, 0.4): cosine 1 / sqrt(1.25); the default material is 0.7 grey. Around camera
    // and plane lies a sphere, which no light from outside would enter.
    let room = scene(Some(0), &[(DVec3::ZERO, 9.0, 0)]);
    for d in [scene(Some(0), &[]), room] {
        let output = picture::<f64>(&d, &from_above(), &options(1));
        close(color(&output.film, 0, 0), DVec3::splat(0.7 / 1.25f64.sqrt()));
        assert_eq!(output.rays.shadow, 0);
    }
}

fn shadows<S: Shades>() {
    // A sphere of radius 1/2 floats over the origin; the light above the camera casts a round shadow on z = 0.
    let mut d = scene(Some(0), &[(DVec3::new(0.0, 0.0, 1.0), 0.5, 0)]);
    d.lights.push(Light::Directional { direction: -DVec3::Z, irradiance: DVec3::splat(PI) });
    let camera = look(DVec3::new(0.0, -6.0, 6.0), DVec3::ZERO, 0.5);
    let size = 65;
    let output = picture::<S>(&d, &camera, &RenderOptions { aovs: Aov::ALL.to_vec(), ..options(size) });
    let (mut dark, mut lit) = (0, 0);
    for y in 0..size {
        for x in 0..size {
            if value(&output.film, "N.Z", x, y) < 0.999_999 || value(&output.film, "id.primitive", x, y) != 0.0 {
                continue; // the sphere
            }
            let (org, dir) = camera.ray(size, size, f64::from(x) + 0.5, f64::from(y) + 0.5);
            let radius = (org + dir * (-org.z / dir.z)).length();
            let red = color(&output.film, x, y).x;
            if radius < 0.49 {
                assert_eq!(red, 0.0, "shadow at {x},{y}");
                dark += 1;
            } else if radius > 0.51 {
                assert!((red - 0.7).abs() < 1e-6, "light at {x},{y}: {red}");
                lit += 1;
            }
        }
    }
    assert!(dark > 50 && lit > 1000, "{dark} {lit}");
}

#[test]
fn shadows_are_where_geometry_says() {
    shadows::<f32>();
    shadows::<f64>();
}

#[test]
fn point_lights_are_not_blocked_by_what_lies_behind_them() {
    // The sphere hangs above the light: between them nothing.
    let mut d = scene(Some(0), &[(DVec3::new(0.0, 0.0, 9.0), 1.0, 0)]);
    d.lights.push(Light::Point { position: DVec3::new(0.0, 0.0, 5.0), intensity: DVec3::splat(25.0 * PI) });
    close(color(&picture::<f32>(&d, &from_above(), &options(1)).film, 0, 0), DVec3::splat(0.7));
    // Now it hangs below the light (and not before the camera's axis, which is at x = 0).
    let mut d = scene(Some(0), &[(DVec3::new(1.5, 0.0, 2.0), 0.5, 0)]);
    d.lights.push(Light::Point { position: DVec3::new(3.0, 0.0, 4.0), intensity: DVec3::splat(25.0 * PI) });
    close(color(&picture::<f32>(&d, &from_above(), &options(1)).film, 0, 0), DVec3::ZERO);
}

#[test]
fn a_mirror_shows_what_lies_in_the_mirrored_direction() {
    // Looking down onto a mirror at 45 degrees: the ray leaves along +x and finds the lamp; depth 0 sees nothing.
    let mut d = scene(Some(1), &[(DVec3::new(6.0, 0.0, 6.0), 1.0, 2)]);
    d.background = DVec3::new(0.1, 0.2, 0.4);
    let camera = look(DVec3::new(-4.0, 0.0, 4.0), DVec3::ZERO, 0.2);
    let shown = |depth| picture::<f64>(&d, &camera, &RenderOptions { depth, ..options(1) });
    close(color(&shown(1).film, 0, 0), DVec3::new(0.9 * 3.0, 0.8 * 2.0, 0.7));
    assert_eq!(shown(1).rays.mirror, 1);
    close(color(&shown(0).film, 0, 0), DVec3::ZERO);
    d.groups[0].items.truncate(1);
    let output = picture::<f64>(&d, &camera, &options(1));
    close(color(&output.film, 0, 0), DVec3::new(0.09, 0.16, 0.28));
}

#[test]
fn two_mirrors_multiply_and_depth_counts_them() {
    // Between the mirror plane and a mirror sphere above it the ray on the axis goes up and down for ever.
    let mut d = scene(Some(1), &[(DVec3::new(0.0, 0.0, 4.0), 1.0, 1)]);
    d.materials[1].emission = DVec3::ONE;
    let camera = look(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, 0.5);
    let output = picture::<f64>(&d, &camera, &RenderOptions { depth: 3, ..options(1) });
    let geometric = |m: f64| 1.0 + m + m * m + m * m * m;
    close(color(&output.film, 0, 0), DVec3::new(geometric(0.9), geometric(0.8), geometric(0.7)));
    assert_eq!(output.rays.mirror, 3);
    assert_eq!(
        output.paths.bounces.iter().map(|level| level.rays).collect::<Vec<_>>(),
        [1; 4],
        "one ray in each level"
    );
}

/// The share that glass of index 1.5 mirrors of light under `angle` to its normal.
fn fresnel(angle: f64) -> f64 {
    let inside = (angle.sin() / 1.5).asin();
    let (a, b) = (angle.cos() - 1.5 * inside.cos(), 1.5 * angle.cos() - inside.cos());
    let (over_a, over_b) = (angle.cos() + 1.5 * inside.cos(), 1.5 * angle.cos() + inside.cos());
    0.5 * ((a / over_a).powi(2) + (b / over_b).powi(2))
}

/// A square of glass whose shading normals lean to +x by 50 degrees, seen by rays that run to +x under `degrees` from
/// straight down; a lamp is where they are bent to: `bent` degrees from straight down, towards +x.
fn smooth_glass<S: Shades>(degrees: f64, bent: f64) -> DVec3 {
    let along = |degrees: f64| DVec3::new(degrees.to_radians().sin(), 0.0, -degrees.to_radians().cos());
    let mut d = scene(None, &[(along(bent) * 5.0, 0.1, 2)]);
    let glass = Scattering::Dielectric { ior: 1.5, roughness: 0.0, tint: DVec3::ONE };
    d.materials.push(Material { scattering: glass, diffuse: DVec3::ONE, ..Material::default() });
    let normal = -along(-50.0);
    let mesh = Mesh {
        positions: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        normals: Attribute { values: vec![normal.as_vec3().to_array(); 4], indices: Vec::new() },
        ..Mesh::default()
    };
    d.meshes.push(Arc::new(mesh));
    let (kind, transform) = (ItemKind::Mesh(0), DAffine3::IDENTITY);
    d.groups[0].items.push(Item { transform, material: Some(3), kind });
    color(&picture::<S>(&d, &look(along(degrees) * -4.0, DVec3::ZERO, 0.01), &options(1)).film, 0, 0)
}

#[test]
fn glass_bends_light_at_the_shading_normal() {
    let lamp = DVec3::new(3.0, 2.0, 1.0);
    let near = |got: DVec3, want: DVec3| assert!((got - want).abs().max_element() < 1e-4, "got {got}, want {want}");
    // Straight down is 50 degrees from the normal; within, by Snell's law, 30.7.
    let inside = (50f64.to_radians().sin() / 1.5).asin().to_degrees();
    let want = lamp * (1.0 - fresnel(50f64.to_radians()));
    near(smooth_glass::<f32>(0.0, inside - 50.0), want);
    near(smooth_glass::<f64>(0.0, inside - 50.0), want);
    // From the left the shading normal is seen from behind: the square's own decides.
    let own = (60f64.to_radians().sin() / 1.5).asin().to_degrees();
    let want = lamp * (1.0 - fresnel(60f64.to_radians()));
    near(smooth_glass::<f32>(60.0, own), want);
    near(smooth_glass::<f64>(60.0, own), want);
}

#[test]
fn ambient_occlusion_of_an_open_plane_is_one_and_of_a_closed_room_zero() {
    let ao = RenderOptions { integrator: Integrator::Ao, ao_samples: 64, ao_radius: 1.0, ..options(16) };
    let open = picture::<f32>(&scene(Some(0), &[]), &from_above(), &ao);
    let room = look(DVec3::new(0.1, 0.2, 0.0), DVec3::X, 2.0);
    let closed = picture::<f32>(&scene(None, &[(DVec3::ZERO, 3.0, 0)]), &room, &ao);
    for (x, y) in (0..16).flat_map(|y| (0..16).map(move |x| (x, y))) {
        assert_eq!(color(&open.film, x, y), DVec3::ONE, "no ray may hit the plane it left");
        assert_eq!(color(&closed.film, x, y), DVec3::ZERO, "no ray may leave the room");
    }
    assert_eq!(open.rays.occlusion, 256 * 64);
}

#[test]
fn ambient_occlusion_under_a_sphere_is_its_form_factor() {
    // A sphere of radius R whose centre is at height h straight above covers sin^2 = (R / h)^2 of the cosine-weighted
    // hemisphere (the form factor of a sphere seen from a small patch that faces it).
    let d = scene(Some(0), &[(DVec3::new(0.0, 0.0, 4.0), 2.0, 0)]);
    let camera = look(DVec3::new(0.0, -0.01, 0.5), DVec3::ZERO, 0.01);
    let ao = RenderOptions { integrator: Integrator::Ao, ao_samples: 256, ao_radius: 9.0, ..options(8) };
    let output = picture::<f32>(&d, &camera, &ao);
    let mean = (0..64).map(|i| color(&output.film, i % 8, i / 8).x).sum::<f64>() / 64.0;
    assert!((mean - 0.75).abs() < 0.005, "{mean}");
}

#[test]
fn normals_depth_and_aovs_of_a_sphere_by_hand() {
    let d = scene(None, &[(DVec3::ZERO, 1.0, 0)]);
    let aovs = Aov::ALL.to_vec();
    let camera = from_above();
    let show =
        |integrator| picture::<f32>(&d, &camera, &RenderOptions { integrator, aovs: aovs.clone(), ..options(9) });
    let normals = show(Integrator::Normals).film;
    close(color(&normals, 4, 4), DVec3::new(0.5, 0.5, 1.0));
    let depth = show(Integrator::Depth).film;
    close(color(&depth, 4, 4), DVec3::splat(3.0));
    assert_eq!(color(&depth, 0, 0), DVec3::ZERO);
    let at = |plane: &str, x, y| value(&normals, plane, x, y);
    assert_eq!((at("A", 4, 4), at("A", 0, 0)), (1.0, 0.0));
    assert!((at("Z", 4, 4) - 3.0).abs() < 1e-6 && at("Z", 0, 0) == f64::INFINITY);
    assert_eq!((at("N.X", 0, 0), at("N.Z", 0, 0)), (0.0, 0.0));
    assert!((at("albedo.G", 4, 4) - 0.7).abs() < 1e-6);
    assert_eq!((at("id.instance", 4, 4), at("id.primitive", 4, 4)), (0.0, 0.0));
    assert_eq!((at("id.instance", 0, 0), at("id.primitive", 0, 0)), (f64::from(u32::MAX), f64::from(u32::MAX)));
    // Off the axis: the distance is along the ray, not along the axis.
    let (org, dir) = camera.ray(9, 9, 3.5, 4.5);
    let unit = dir.normalize();
    let along = -org.dot(unit);
    let distance = along - (1.0 - (org.length_squared() - along * along)).sqrt();
    assert!((at("Z", 3, 4) - distance).abs() < 1e-5);
    close(DVec3::from(["N.X", "N.Y", "N.Z"].map(|plane| at(plane, 3, 4))), org + unit * distance);
}

#[test]
fn crops_are_windows_of_the_whole() {
    let d = scene(Some(0), &[(DVec3::new(0.3, 0.2, 1.0), 0.9, 0)]);
    let whole = picture::<f32>(&d, &from_above(), &options(40));
    let window = Window { x0: 11, y0: 7, x1: 38, y1: 25 };
    let crop = picture::<f32>(&d, &from_above(), &RenderOptions { crop: Some(window), ..options(40) });
    assert_eq!((crop.film.width, crop.film.height, crop.film.window), (40, 40, window));
    assert_eq!(crop.rays.primary, 27 * 18);
    for (x, y) in (7..25).flat_map(|y| (11..38).map(move |x| (x, y))) {
        assert_eq!(color(&crop.film, x, y), color(&whole.film, x, y));
    }
}

/// A square that a group places, beside groups that nothing does, with more and with fewer primitives than the square.
#[test]
fn what_nothing_places_does_not_matter() {
    let item = |kind| Item { transform: DAffine3::IDENTITY, material: None, kind };
    let square = |size: f64| {
        let positions = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0) * size);
        Arc::new(Mesh { positions: positions.into(), triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() })
    };
    let group = |items: Vec<Item>| Group { name: "some".into(), items };
    let one = |kind| group(vec![item(kind)]);
    let described = |unplaced: Vec<Group>| {
        let placed = item(ItemKind::Instance(1 + unplaced.len() as u32));
        let mut d = Description { meshes: vec![square(1.0), square(9.0)], ..Description::new("some") };
        d.groups[0].items.push(placed);
        d.lights.push(Light::Directional { direction: -DVec3::Z, irradiance: DVec3::splat(PI) });
        d.groups.extend(unplaced.into_iter().chain([one(ItemKind::Mesh(0))]));
        d
    };
    for integrator in [Integrator::Whitted, Integrator::Path, Integrator::Ao] {
        let options = RenderOptions { integrator, ..options(8) };
        let seen = |d: &Description| {
            let film = picture::<f32>(d, &from_above(), &options).film;
            let pixels: Vec<DVec3> = (0..64).map(|i| color(&film, i % 8, i / 8)).collect();
            pixels
        };
        let alone = seen(&described(Vec::new()));
        assert!(alone[27] != DVec3::ZERO && alone[0] == DVec3::ZERO, "{integrator:?}: {alone:?}");
        for unplaced in [
            vec![one(ItemKind::Shape(Shape::Sphere))],
            vec![one(ItemKind::Mesh(1))],
            vec![group((0..9).map(|_| item(ItemKind::Shape(Shape::Cuboid))).collect())],
            vec![one(ItemKind::Mesh(1)), group(vec![item(ItemKind::Instance(1)), item(ItemKind::Shape(Shape::Disc))])],
        ] {
            assert_eq!(seen(&described(unplaced.clone())), alone, "{integrator:?}: {unplaced:?}");
        }
    }
}
