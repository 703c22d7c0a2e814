//! Whole pictures of paths: no pixel is out of bounds, threads and tiles change no bit, planes add up.

use crate::path_support;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use lanecast::camera::{Camera, Filter, framing};
use lanecast::film::PlaneData;
use lanecast::render::{Aov, RenderOptions, RenderOutput, Silent, render};
use lanecast::scene::builtin;
use lanecast::scene::description::{Description, Light, Material, Shape};
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::material::{Alpha, Scattering, TextureRef};
use lanecast::scene::texture::{Texels, Texture};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::Shades;
use path_support::{add, dark, lamp, look, parallelogram, paths, picture, plane, scatters, shape, sphere, values};

/// One sphere of each kind of scattering on a plane, under lights of every kind, with textures and holes.
fn gallery() -> Description {
    let mut d = dark();
    let texel = |i: u32| [[0.9, 0.2, 0.1, 1.0], [0.1, 0.3, 0.8, 0.25]][((i + i / 4) % 2) as usize];
    let texels = Texels::Float((0..16).map(texel).collect());
    d.textures.push(Texture { name: "checks".into(), width: 4, height: 4, texels }.into());
    d.environment = Some(path_support::constant_environment(DVec3::new(0.2, 0.3, 0.4)));
    let (eta, k, tint) = (DVec3::new(0.21, 0.93, 1.1), DVec3::new(3.6, 2.6, 2.3), DVec3::new(0.9, 1.0, 0.8));
    let kinds = [
        Scattering::Matte,
        Scattering::Conductor { eta, k, roughness: 0.0 },
        Scattering::Conductor { eta, k, roughness: 0.4 },
        Scattering::Dielectric { ior: 1.5, roughness: 0.0, tint },
        Scattering::Dielectric { ior: 1.5, roughness: 0.4, tint },
        Scattering::ThinGlass { ior: 1.5, tint },
        Scattering::Plastic { ior: 1.5, roughness: 0.0 },
        Scattering::Plastic { ior: 1.5, roughness: 0.3 },
        Scattering::MetallicRoughness { metallic: 0.5, roughness: 0.3, ior: 1.5, transmission: 0.4 },
        Scattering::Mix { first: 1, second: 3, amount: 0.4 },
    ];
    for (i, kind) in kinds.into_iter().enumerate() {
        let material = Material { mirror: DVec3::splat(0.1), ..scatters(kind, DVec3::new(0.8, 0.6, 0.3)) };
        let id = add(&mut d, material);
        let centre = DVec3::new((i % 4) as f64 * 2.2 - 3.3, (i / 4) as f64 * 2.2 - 2.2, 1.0);
        sphere(&mut d, centre, 1.0, id);
    }
    let ground = add(&mut d, Material::default());
    plane(&mut d, 0.0, ground);
    // A sheet with holes by its texture hangs over a part of it all, and a lamp.
    let mut sheet = Material { alpha: Alpha::Blend, ..Material::default() };
    sheet.textures.base = Some(TextureRef::new(0));
    let sheet = add(&mut d, sheet);
    parallelogram(&mut d, DVec3::new(-4.0, -3.0, 2.6), DVec3::X * 3.0, DVec3::Y * 3.0, sheet);
    if let Some(mesh) = d.meshes.pop() {
        let mut mesh = (*mesh).clone();
        mesh.uvs[0].values = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].to_vec();
        d.meshes.push(mesh.into());
    }
    let shining = add(&mut d, Material { one_sided: true, ..lamp(4.0) });
    parallelogram(&mut d, DVec3::new(2.0, -1.0, 5.0), DVec3::Y * 2.0, DVec3::X * 2.0, shining);
    let map = DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(0.3)), DVec3::new(-4.0, 4.0, 3.0));
    shape(&mut d, Shape::Disc, map, shining);
    sphere(&mut d, DVec3::new(4.5, 4.0, 2.0), 0.3, shining);
    let (position, intensity) = (DVec3::new(0.0, -6.0, 5.0), DVec3::splat(20.0));
    d.lights.push(Light::Point { position, intensity });
    d.lights.push(Light::Spot { position, direction: -position, intensity, inner: 0.1, outer: 0.4 });
    d.lights.push(Light::Sun { direction: DVec3::new(1.0, 1.0, -2.0), irradiance: DVec3::ONE, radius: 0.05 });
    d.lights.push(Light::Directional { direction: DVec3::new(-1.0, 1.0, -2.0), irradiance: DVec3::splat(0.5) });
    d
}

fn camera() -> Camera {
    look(DVec3::new(1.0, -11.0, 7.0), DVec3::new(0.0, 0.0, 0.8), 0.7)
}

fn bits(output: &RenderOutput) -> Vec<Vec<u32>> {
    let plane_bits = |data: &PlaneData| match data {
        PlaneData::F32(v) => v.iter().map(|x| x.to_bits()).collect(),
        PlaneData::U32(v) => v.clone(),
        PlaneData::U8(v) => v.iter().map(|&level| level.into()).collect(),
    };
    output.film.planes.iter().map(|plane| plane_bits(&plane.data)).collect()
}

fn threads_and_tiles_change_nothing<S: Shades>() {
    let d = gallery();
    let world = World::<S>::compile(&d, Preset::Balanced).unwrap();
    for (noise, spp) in [(None, 3), (Some(1e-9), 9)] {
        let mut first = None;
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            for tile in [8, 16, 32] {
                let options =
                    RenderOptions { tile, noise, aovs: Aov::ALL.to_vec(), filter: Filter::Tent, ..paths(45, spp, 6) };
                let output = pool.install(|| render(&world, &d, &camera(), &options, &Silent).unwrap());
                let got = (bits(&output), output.rays);
                let want = first.get_or_insert_with(|| got.clone());
                assert!(got == *want, "{threads} threads, tiles of {tile}");
            }
        }
    }
}

#[test]
fn threads_and_tiles_change_no_bit_in_f32() {
    threads_and_tiles_change_nothing::<f32>();
}

#[test]
fn threads_and_tiles_change_no_bit_in_f64() {
    threads_and_tiles_change_nothing::<f64>();
}

#[test]
fn precisions_and_engines_show_the_same_scene() {
    let d = gallery();
    let options = paths(24, 64, 5);
    let one = path_support::mean(&picture::<f32>(&d, &camera(), &options).film);
    let two = path_support::mean(&picture::<f64>(&d, &camera(), &options).film);
    let seeded = RenderOptions { seed: 5, engine: "auto".into(), ..options };
    let three = path_support::mean(&picture::<f32>(&d, &camera(), &seeded).film);
    path_support::near("f64", two, one, 0.02);
    path_support::near("auto, other seed", three, one, 0.05);
}

#[test]
fn planes_add_up() {
    let d = gallery();
    let options = RenderOptions { aovs: Aov::ALL.to_vec(), ..paths(32, 16, 6) };
    let film = picture::<f32>(&d, &camera(), &options).film;
    let (mut indirect, mut noisy) = (0, 0);
    for (all, direct, rest) in
        [("R", "direct.R", "indirect.R"), ("G", "direct.G", "indirect.G"), ("B", "direct.B", "indirect.B")]
    {
        for (i, &radiance) in values(&film, all).iter().enumerate() {
            let (d, r) = (values(&film, direct)[i], values(&film, rest)[i]);
            assert!(radiance.is_finite() && d >= 0.0 && r >= -1e-5 * radiance, "{radiance} {d} {r}");
            assert!((d + r - radiance).abs() <= 1e-5 * radiance.max(1.0), "{radiance} {d} {r}");
            indirect += u32::from(r > 0.0);
        }
    }
    for &variance in values(&film, "variance") {
        assert!(variance.is_finite() && variance >= 0.0);
        noisy += u32::from(variance > 0.0);
    }
    assert!(indirect > 1500 && noisy > 900, "{indirect} {noisy}");
    let samples = film.u32_plane("samples").unwrap();
    assert!(samples.iter().all(|&n| n == 16));
    // The variance says how far pictures of other seeds are away.
    let other = picture::<f32>(&d, &camera(), &RenderOptions { seed: 77, ..options }).film;
    let brightness = |film: &lanecast::film::Film, i: usize| {
        ["R", "G", "B"].iter().map(|c| f64::from(values(film, c)[i])).sum::<f64>() / 3.0
    };
    let (mut found, mut said) = (0.0, 0.0);
    for i in 0..32 * 32 {
        found += (brightness(&film, i) - brightness(&other, i)).powi(2);
        said += f64::from(values(&film, "variance")[i]) + f64::from(values(&other, "variance")[i]);
    }
    // Sobol's points are better than the chance that the estimate assumes.
    assert!((0.2..1.3).contains(&(found / said)), "{found} {said}");
    // What emits and scatters nothing is direct, at any depth.
    let mut lit = dark();
    let id = add(&mut lit, lamp(2.0));
    sphere(&mut lit, DVec3::ZERO, 1.0, id);
    let options = RenderOptions { aovs: Aov::ALL.to_vec(), ..paths(8, 4, 6) };
    let film = picture::<f32>(&lit, &look(DVec3::Z * 4.0, DVec3::ZERO, 0.1), &options).film;
    assert!(values(&film, "direct.G").iter().all(|&x| x == 2.0) && values(&film, "variance").iter().all(|&x| x == 0.0));
}

/// A lamp that no path aims at (a sphere that is none by a hair) over a floor that ends within the picture: tiles whose first
/// samples found no light go on, those that show nothing end at once.
#[test]
fn a_noise_limit_does_not_give_up_light_that_is_found_by_chance() {
    let (height, radius, edge) = (2.0, 0.12, 0.3);
    let mut d = dark();
    let floor = add(&mut d, Material { diffuse: DVec3::splat(0.6), ..Material::default() });
    let shining = add(&mut d, lamp(100.0));
    parallelogram(&mut d, DVec3::new(-3.0, -3.0, 0.0), DVec3::X * 6.0, DVec3::Y * (3.0 + edge), floor);
    let map = DMat3::from_diagonal(DVec3::new(radius, radius, radius * 1.0001));
    shape(&mut d, Shape::Sphere, DAffine3::from_mat3_translation(map, DVec3::Z * height), shining);
    // Seen under 60 degrees: x from -2 to 2, y from -1 to 1.
    let camera = path_support::parallel(DVec3::new(0.75f64.sqrt(), 0.0, 0.5) * 4.0, DVec3::ZERO, 2.0);
    let options = RenderOptions { noise: Some(1.4), aovs: vec![Aov::Samples], ..paths(24, 4096, 1) };
    let film = picture::<f32>(&d, &camera, &options).film;
    // A sphere above the horizon shines as if from its centre, by the square of its radius.
    const STEPS: u32 = 200;
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS) - 0.5;
    let mut want = 0.0;
    for (x, y) in (0..STEPS * STEPS).map(|i| (4.0 * middle(i % STEPS), 2.0 * middle(i / STEPS))) {
        if y < edge {
            want += 0.6 * 100.0 * radius * radius * height / (x * x + y * y + height * height).powf(1.5);
        }
    }
    want /= f64::from(STEPS * STEPS);
    // Each of the six tiles of the floor ends with at least 33 paths that found the lamp, most with many more.
    path_support::near("by chance", path_support::mean(&film), DVec3::splat(want), 0.12);
    let samples = film.u32_plane("samples").unwrap();
    let (nothing, lit) = samples.split_at(8 * 24);
    assert!(nothing.iter().all(|&n| n == 4) && lit.iter().all(|&n| n >= 64), "{nothing:?} {lit:?}");
}

#[test]
fn no_pixel_of_a_built_in_scene_is_out_of_bounds() {
    for name in builtin::NAMES {
        let d = load(&format!("builtin:{name}"), &LoadOptions::default()).unwrap();
        let options = RenderOptions { width: 48, height: 32, ..paths(1, 4, 8) };
        let mut lit = 0;
        let mut check = |output: RenderOutput| {
            for plane in ["R", "G", "B"] {
                for &x in values(&output.film, plane) {
                    assert!(x.is_finite() && x >= 0.0, "{name}: {x}");
                    lit += u32::from(x > 0.0);
                }
            }
        };
        check(seen_by_its_camera::<f32>(&d, &options));
        check(seen_by_its_camera::<f64>(&d, &options));
        assert!(lit > 1000, "{name}: {lit} lit values");
    }
}

fn seen_by_its_camera<S: Shades>(d: &Description, options: &RenderOptions) -> RenderOutput {
    let world = World::<S>::compile(d, Preset::Balanced).unwrap();
    let described = d.cameras.first().cloned().unwrap_or_else(|| framing(world.bounds(), 1.5));
    render(&world, d, &Camera::new(&described, 1.5).unwrap(), options, &Silent).unwrap()
}

/// A mixture's albedo is that of what it shows; its number is its own.
#[test]
fn mixtures_have_the_albedo_of_their_parts() {
    let mut d = dark();
    let first = add(&mut d, Material { diffuse: DVec3::new(0.2, 0.4, 0.6), ..Material::default() });
    let second = add(&mut d, Material { diffuse: DVec3::new(0.9, 0.1, 0.5), ..Material::default() });
    let mixture = add(&mut d, scatters(Scattering::Mix { first, second, amount: 0.25 }, DVec3::ZERO));
    plane(&mut d, 0.0, mixture);
    let options = RenderOptions { aovs: Aov::ALL.to_vec(), ..paths(8, 256, 2) };
    let film = picture::<f32>(&d, &look(DVec3::Z * 4.0, DVec3::ZERO, 0.1), &options).film;
    let want = d.materials[first as usize].diffuse * 0.75 + d.materials[second as usize].diffuse * 0.25;
    for (plane, want) in ["albedo.R", "albedo.G", "albedo.B"].into_iter().zip(want.to_array()) {
        let mean = values(&film, plane).iter().map(|&x| f64::from(x)).sum::<f64>() / 64.0;
        assert!((mean - want).abs() < 0.01, "{plane}: {mean}, want {want}");
    }
    assert!(film.u32_plane("id.material").unwrap().iter().all(|&id| id == mixture));
}

/// Materials and lights at the ends of their ranges, one after the other.
#[test]
fn extremes_give_finite_pictures() {
    let far = DVec3::splat(1e9);
    let scatterings = [
        Scattering::Dielectric { ior: 1.0, roughness: 0.5, tint: DVec3::ONE },
        Scattering::Dielectric { ior: 1e-3, roughness: 1.0, tint: DVec3::ONE },
        Scattering::Dielectric { ior: 100.0, roughness: 0.033, tint: DVec3::ONE },
        Scattering::ThinGlass { ior: 1.0, tint: DVec3::ZERO },
        Scattering::Plastic { ior: 1.0, roughness: 0.0 },
        Scattering::Plastic { ior: 3.0, roughness: 1.0 },
        Scattering::Conductor { eta: DVec3::ZERO, k: DVec3::ZERO, roughness: 0.5 },
        Scattering::Conductor { eta: DVec3::splat(1e-6), k: DVec3::splat(1e6), roughness: 1.0 },
        Scattering::MetallicRoughness { metallic: 0.0, roughness: 0.0, ior: 1.0, transmission: 0.0 },
        Scattering::MetallicRoughness { metallic: 1.0, roughness: 1.0, ior: 2.0, transmission: 1.0 },
        Scattering::Mix { first: 1, second: 1, amount: 1.0 },
    ];
    for scattering in scatterings {
        for base in [DVec3::ZERO, DVec3::ONE] {
            let mut d = dark();
            let id = add(&mut d, scatters(scattering, base));
            sphere(&mut d, DVec3::ZERO, 1.0, id);
            let tiny = add(&mut d, lamp(1e6));
            sphere(&mut d, DVec3::new(1.5, 0.0, 1.0), 1e-4, tiny);
            plane(&mut d, -1.0, 0);
            d.lights.push(Light::Point { position: far, intensity: far });
            d.lights.push(Light::Sun { direction: DVec3::NEG_Z, irradiance: DVec3::ONE, radius: 1e-6 });
            for film in [
                picture::<f32>(&d, &look(DVec3::new(0.0, -4.0, 1.0), DVec3::ZERO, 0.7), &paths(16, 16, 20)).film,
                picture::<f64>(&d, &look(DVec3::new(0.0, -4.0, 1.0), DVec3::ZERO, 0.7), &paths(8, 16, 20)).film,
            ] {
                for plane in ["R", "G", "B"] {
                    let bad = values(&film, plane).iter().find(|x| !x.is_finite() || **x < 0.0);
                    assert!(bad.is_none(), "{scattering:?} of {base}: {bad:?}");
                }
            }
        }
    }
}

/// Pictures that arrive: texture coordinates choose texels of base colour, and of an emission that rays aim at.
#[test]
fn textures_are_where_their_coordinates_say() {
    let mut d = dark();
    let texel = |i: u32| [if i.is_multiple_of(2) { 0.25 } else { 0.75 }, if i < 2 { 0.5 } else { 1.0 }, 0.0, 1.0];
    let texels = Texels::Float((0..4).map(texel).collect());
    d.textures.push(Texture { name: "four".into(), width: 2, height: 2, texels }.into());
    let mut material = Material { diffuse: DVec3::ONE, ..Material::default() };
    material.textures.base = Some(TextureRef { nearest: true, ..TextureRef::new(0) });
    let id = add(&mut d, material);
    parallelogram(&mut d, DVec3::new(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0, id);
    let mut mesh = (*d.meshes[0]).clone();
    mesh.uvs[0].values = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y].map(|v| v.as_vec2().to_array()).to_vec();
    d.meshes[0] = mesh.into();
    d.background = DVec3::ONE;
    for (x, y, want) in
        [(-0.5, -0.5, [0.25, 0.5]), (0.5, -0.5, [0.75, 0.5]), (-0.5, 0.5, [0.25, 1.0]), (0.5, 0.5, [0.75, 1.0])]
    {
        let camera = look(DVec3::new(x, y, 3.0), DVec3::new(x, y, 0.0), 0.1);
        let got = path_support::seen::<f32>(&d, &camera, &paths(4, 16, 2));
        path_support::near("texel", got, DVec3::new(want[0], want[1], 0.0), 1e-5);
    }
}
