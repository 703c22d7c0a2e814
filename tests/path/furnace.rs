//! White furnaces: radiance 1 from everywhere. A surface then shows its directional albedo, a body that keeps all
//! light is invisible, and nothing is brighter than its surroundings.

use crate::path_support;

use glam::DVec3;
use lanecast::scene::description::{Description, Material};
use lanecast::scene::material::Scattering;
use lanecast::shade::Shades;
use path_support::{add, dark, facets, look, near, paths, picture, plane, scatters, seen, sphere, under, values};

const SPP: u32 = 4096;
/// A thousandth, as promised.
const CLOSE: f64 = 1e-3;
const BASE: DVec3 = DVec3::new(0.8, 0.5, 0.25);
const ETA: DVec3 = DVec3::new(0.21, 0.93, 1.1);
const K: DVec3 = DVec3::new(3.6, 2.6, 2.3);

fn white(mut d: Description) -> Description {
    d.background = DVec3::ONE;
    d
}

/// What the plane z = 0 of `material` shows under `degrees` from its normal.
fn albedo<S: Shades>(material: Material, degrees: f64) -> DVec3 {
    by_pixels::<S>(material, degrees, 4)
}

/// The same from many pixels, where a path's choice of a lobe makes noise.
fn many<S: Shades>(material: Material, degrees: f64) -> DVec3 {
    by_pixels::<S>(material, degrees, 16)
}

fn by_pixels<S: Shades>(material: Material, degrees: f64, size: u32) -> DVec3 {
    let mut d = white(dark());
    let id = add(&mut d, material);
    plane(&mut d, 0.0, id);
    seen::<S>(&d, &under(degrees), &paths(size, SPP, 4))
}

/// Unit direction to the viewer under `degrees`.
fn out(degrees: f64) -> DVec3 {
    let angle = degrees.to_radians();
    DVec3::new(angle.sin(), 0.0, angle.cos())
}

fn color(f: impl Fn(usize) -> f64) -> DVec3 {
    DVec3::new(f(0), f(1), f(2))
}

#[test]
fn matte_and_mirror_show_their_reflectance() {
    let mirror = DVec3::new(0.1, 0.3, 0.5);
    let material = Material { diffuse: BASE, mirror, ..Material::default() };
    near("plane", albedo::<f32>(material.clone(), 40.0), BASE + mirror, CLOSE);
    near("plane, f64", albedo::<f64>(material.clone(), 40.0), BASE + mirror, CLOSE);
    // The whole sphere with its rim: every pixel.
    let mut d = white(dark());
    let id = add(&mut d, material);
    sphere(&mut d, DVec3::ZERO, 1.0, id);
    let film = picture::<f32>(&d, &look(DVec3::Z * 4.0, DVec3::ZERO, 0.35), &paths(8, SPP, 4)).film;
    for (plane, want) in ["R", "G", "B"].into_iter().zip((BASE + mirror).to_array()) {
        assert!(values(&film, plane).iter().all(|&x| (f64::from(x) / want - 1.0).abs() < CLOSE));
    }
}

#[test]
fn metals_show_their_reflectance() {
    for degrees in [0.0, 45.0, 80.0] {
        let o = out(degrees);
        let want = color(|c| facets::metal(o.z, ETA[c], K[c]));
        let material = |roughness| scatters(Scattering::Conductor { eta: ETA, k: K, roughness }, DVec3::ONE);
        near("smooth", albedo::<f32>(material(0.0), degrees), want, 1e-5);
        near("smooth, f64", albedo::<f64>(material(0.0), degrees), want, 1e-6);
    }
    for roughness in [0.3, 0.7, 1.0f64] {
        let alpha = roughness.powi(2);
        let once = facets::mirrored_mean(alpha, |_| 1.0);
        for degrees in [0.0, 45.0, 80.0] {
            let o = out(degrees);
            let lost = 1.0 - facets::mirrored(o, alpha, |_| 1.0);
            let single = color(|c| facets::mirrored(o, alpha, |cos| facets::metal(cos, ETA[c], K[c])));
            let repeated = color(|c| {
                let mean = facets::cosine_mean(|w| facets::metal(w.z, ETA[c], K[c]));
                lost * facets::repeated(mean, once)
            });
            let mut material = scatters(Scattering::Conductor { eta: ETA, k: K, roughness }, DVec3::ONE);
            let got = many::<f32>(material.clone(), degrees);
            near(&format!("{roughness} {degrees}"), got, single + repeated, CLOSE);
            material.multiple_scattering = false;
            near(&format!("{roughness} {degrees}, single"), albedo::<f32>(material, degrees), single, CLOSE);
        }
    }
}

/// Roughnesses and angles, in degrees, under which surfaces of facets are looked at: steeply and at a grazing angle.
fn facets_seen() -> impl Iterator<Item = (f64, f64)> {
    let all = [0.05, 0.2, 0.4, 0.6, 0.8, 1.0]
        .into_iter()
        .flat_map(|roughness| [0.0, 45.0, 70.0, 85.0, 89.0].map(|degrees| (roughness, degrees)));
    // What nearly smooth facets lose at so flat an angle comes back from directions that chance seldom finds: more noise than a
    // thousandth at these samples.
    all.filter(|&(roughness, degrees)| roughness >= 0.2 || degrees <= 85.0)
}

/// Rough surfaces of white: all light comes back, none is added.
#[test]
fn white_facets_keep_all_light() {
    for (roughness, degrees) in facets_seen() {
        let (eta, k) = (DVec3::ZERO, DVec3::ONE);
        let mut whites = vec![
            Scattering::Conductor { eta, k, roughness },
            Scattering::Plastic { ior: 1.5, roughness },
            Scattering::Plastic { ior: 2.5, roughness },
        ];
        for [metallic, transmission] in [[0.0, 0.0], [0.0, 1.0], [0.5, 0.5], [1.0, 0.0]] {
            whites.push(Scattering::MetallicRoughness { metallic, roughness, ior: 1.5, transmission });
        }
        for white in whites {
            let got = many::<f32>(scatters(white, DVec3::ONE), degrees);
            near(&format!("{white:?} under {degrees}"), got, DVec3::ONE, CLOSE);
        }
    }
}

/// The same of glass. What a boundary lets through is squeezed: it is told apart by its tint.
#[test]
fn glass_facets_keep_all_light() {
    for (roughness, degrees) in facets_seen() {
        for ior in [1.5, 0.75] {
            let glass = |tint| Scattering::Dielectric { ior, roughness, tint: DVec3::splat(tint) };
            let mirrored = many::<f64>(scatters(glass(0.0), DVec3::ONE), degrees);
            let both = many::<f64>(scatters(glass(1.0), DVec3::ONE), degrees);
            let all = mirrored + (both - mirrored) * (ior * ior);
            // Where light may be totally reflected the tables are half as good.
            let close = if ior < 1.0 { 2.0 * CLOSE } else { CLOSE };
            near(&format!("glass of {ior}, {roughness} under {degrees}"), all, DVec3::ONE, close);
        }
    }
}

/// A boundary over glass without end: what goes in sees the furnace's radiance squeezed by the square of the index.
#[test]
fn glass_boundaries_show_what_they_mirror_and_let_through() {
    let (ior, tint) = (1.5, DVec3::new(1.0, 0.8, 0.6));
    for degrees in [0.0, 45.0, 80.0] {
        let o = out(degrees);
        let material = |roughness| {
            let glass = scatters(Scattering::Dielectric { ior, roughness, tint }, DVec3::ONE);
            Material { multiple_scattering: false, ..glass }
        };
        let mirrored = facets::glass(o.z, ior);
        let want = mirrored + tint * (1.0 - mirrored) / (ior * ior);
        near("smooth", albedo::<f32>(material(0.0), degrees), want, CLOSE);
        near("smooth, f64", albedo::<f64>(material(0.0), degrees), want, CLOSE);
        for roughness in [0.3, 0.9f64] {
            let alpha = roughness.powi(2);
            let up = facets::mirrored(o, alpha, |cos| facets::glass(cos, ior));
            let down = facets::refracted(o, alpha, ior, |cos| 1.0 - facets::glass(cos, ior));
            let want = up + tint * down / (ior * ior);
            near(&format!("{roughness} {degrees}"), many::<f32>(material(roughness), degrees), want, CLOSE);
        }
    }
}

/// Bodies of clear glass keep all light: they cannot be seen. Long paths, and the chance that ends them, are part of
/// it.
#[test]
fn clear_glass_is_invisible() {
    for scattering in [
        Scattering::Dielectric { ior: 1.5, roughness: 0.0, tint: DVec3::ONE },
        Scattering::Dielectric { ior: 0.7, roughness: 0.0, tint: DVec3::ONE },
        Scattering::ThinGlass { ior: 1.5, tint: DVec3::ONE },
    ] {
        let mut d = white(dark());
        let id = add(&mut d, scatters(scattering, DVec3::ONE));
        sphere(&mut d, DVec3::ZERO, 1.0, id);
        let camera = look(DVec3::Z * 4.0, DVec3::ZERO, 0.35);
        near("f32", seen::<f32>(&d, &camera, &paths(8, SPP, 200)), DVec3::ONE, CLOSE);
        near("f64", seen::<f64>(&d, &camera, &paths(4, SPP, 200)), DVec3::ONE, CLOSE);
    }
}

/// The same of rough glass. Its facets' chances make noise that grows from bounce to bounce.
#[test]
fn rough_glass_is_invisible() {
    for (ior, roughness, close) in [(1.5, 0.3, 3e-3), (1.33, 0.8, 1e-2)] {
        let mut d = white(dark());
        let id = add(&mut d, scatters(Scattering::Dielectric { ior, roughness, tint: DVec3::ONE }, DVec3::ONE));
        sphere(&mut d, DVec3::ZERO, 1.0, id);
        let camera = look(DVec3::Z * 4.0, DVec3::ZERO, 0.35);
        let got = seen::<f32>(&d, &camera, &paths(16, SPP, 200));
        near(&format!("{ior} {roughness}"), got, DVec3::ONE, close);
    }
}

#[test]
fn thin_glass_tints_what_goes_through() {
    let (ior, tint) = (1.5, DVec3::new(1.0, 0.8, 0.6));
    for degrees in [0.0, 45.0, 80.0] {
        let r = facets::glass(out(degrees).z, ior);
        let mirrored = 2.0 * r / (1.0 + r);
        let want = mirrored + tint * (1.0 - mirrored);
        near("pane", albedo::<f32>(scatters(Scattering::ThinGlass { ior, tint }, DVec3::ONE), degrees), want, CLOSE);
    }
}

#[test]
fn plastic_keeps_all_light_over_a_white_base() {
    let ior = 1.5;
    let mean = |eta: f64| facets::cosine_mean(|w| facets::glass(w.z, eta));
    let (outside, inside) = (mean(ior), mean(1.0 / ior));
    for degrees in [0.0, 45.0, 80.0] {
        let o = out(degrees);
        let mirrored = facets::glass(o.z, ior);
        let base = |c: f64| (1.0 - mirrored) * (1.0 - outside) * c / ((1.0 - c * inside) * ior * ior);
        let material = |roughness, base| scatters(Scattering::Plastic { ior, roughness }, base);
        near("white", albedo::<f32>(material(0.0, DVec3::ONE), degrees), DVec3::ONE, CLOSE);
        let want = color(|c| mirrored + base(BASE[c]));
        near("colour", albedo::<f32>(material(0.0, BASE), degrees), want, CLOSE);
        near("colour, f64", albedo::<f64>(material(0.0, BASE), degrees), want, CLOSE);
        for roughness in [0.3, 0.8f64] {
            let alpha = roughness.powi(2);
            let coat = facets::mirrored(o, alpha, |cos| facets::glass(cos, ior));
            // As much light goes out through the coat as comes in, but for the square of the index.
            let inside = 1.0 - (1.0 - facets::mirrored_mean(alpha, |cos| facets::glass(cos, ior))) / (ior * ior);
            let base = |c: f64| c * (1.0 - inside) / (1.0 - c * inside);
            let want = color(|c| coat + (1.0 - coat) * base(BASE[c]));
            near(&format!("{roughness} {degrees}"), many::<f32>(material(roughness, BASE), degrees), want, CLOSE);
        }
    }
}

#[test]
fn metallic_roughness_shows_its_blend() {
    let ior = 1.5f64;
    for (metallic, roughness, transmission) in [(0.0, 0.5, 0.0), (1.0, 0.4, 0.0), (0.5, 1.0, 0.3), (0.0, 0.6, 1.0)] {
        let material = scatters(Scattering::MetallicRoughness { metallic, roughness, ior, transmission }, BASE);
        let mean = facets::mirrored_mean(f64::powi(roughness, 2), |_| 1.0);
        for degrees in [0.0, 60.0] {
            let (o, alpha) = (out(degrees), f64::powi(roughness, 2));
            let lost = 1.0 - facets::mirrored(o, alpha, |_| 1.0);
            // Facets of reflectance f0: what one gives back, and what many do.
            let albedo = |f0: f64| {
                let many = lost * facets::repeated(f0 + (1.0 - f0) / 21.0, mean);
                (facets::mirrored(o, alpha, |cos| facets::schlick(cos, f0)), many)
            };
            let (once, many_of_coat) = albedo(((ior - 1.0) / (ior + 1.0)).powi(2));
            let coat = once + many_of_coat;
            let want = color(|c| {
                let (metal, many_of_metal) = albedo(BASE[c]);
                let body = coat + BASE[c] * (1.0 - coat);
                (1.0 - metallic) * body + metallic * (metal + many_of_metal)
            });
            let got = many::<f32>(material.clone(), degrees);
            near(&format!("{metallic} {roughness} {transmission} {degrees}"), got, want, CLOSE);
            assert!(got.max_element() < 1.0 + CLOSE);
        }
    }
}

#[test]
fn mixtures_show_the_mean_of_both_by_their_share() {
    let mut d = white(dark());
    let first = add(&mut d, Material { diffuse: DVec3::new(0.2, 0.4, 0.6), ..Material::default() });
    let second = add(&mut d, Material { diffuse: DVec3::new(0.9, 0.1, 0.5), ..Material::default() });
    let half = add(&mut d, scatters(Scattering::Mix { first, second, amount: 0.5 }, DVec3::ZERO));
    let nested = add(&mut d, scatters(Scattering::Mix { first: half, second: first, amount: 0.25 }, DVec3::ZERO));
    plane(&mut d, 0.0, nested);
    let (a, b) = (d.materials[first as usize].diffuse, d.materials[second as usize].diffuse);
    let want = (a + b) * 0.5 * 0.75 + a * 0.25;
    // The choice is a plain random number: standard deviation of the mean of 2^18 below 0.0008 of any colour.
    near("mixture", seen::<f32>(&d, &under(30.0), &paths(8, SPP, 2)), want, 5e-3);
}

/// A furnace may also be an environment, which rays aim at, or the inside of a shining sphere.
#[test]
fn furnaces_of_other_make_show_the_same() {
    let materials = [
        Material { diffuse: BASE, ..Material::default() },
        scatters(Scattering::Conductor { eta: ETA, k: K, roughness: 0.5 }, DVec3::ONE),
        scatters(Scattering::Plastic { ior: 1.5, roughness: 0.0 }, BASE),
        scatters(Scattering::Plastic { ior: 1.5, roughness: 0.5 }, BASE),
        scatters(Scattering::Dielectric { ior: 1.5, roughness: 0.5, tint: BASE }, DVec3::ONE),
        scatters(Scattering::MetallicRoughness { metallic: 0.3, roughness: 0.5, ior: 1.5, transmission: 0.5 }, BASE),
    ];
    for material in materials {
        let want = albedo::<f32>(material.clone(), 30.0);
        let mut d = dark();
        d.environment = Some(path_support::constant_environment(DVec3::ONE));
        let id = add(&mut d, material.clone());
        plane(&mut d, 0.0, id);
        let got = seen::<f32>(&d, &under(30.0), &paths(8, SPP, 4));
        near(&format!("environment, {:?}", material.scattering), got, want, 2.0 * CLOSE);
        // A small patch of the same within a sphere that shines inwards.
        let mut d = dark();
        let (id, shining) = (add(&mut d, material.clone()), add(&mut d, path_support::lamp(1.0)));
        let disc = lanecast::scene::description::Shape::Disc;
        path_support::shape(&mut d, disc, glam::DAffine3::from_scale(DVec3::splat(0.01)), id);
        sphere(&mut d, DVec3::new(1.0, 2.0, 3.0), 9.0, shining);
        let got = seen::<f32>(&d, &under(30.0), &paths(8, SPP, 4));
        near(&format!("shining sphere, {:?}", material.scattering), got, want, 4.0 * CLOSE);
    }
}
