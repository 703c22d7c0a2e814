//! Lights and boundaries against formulas.

use crate::path_support;

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use glam::{DAffine3, DMat3, DVec3};
use lanecast::scene::description::{Description, Light, Material, Shape};
use lanecast::scene::material::{Alpha, Scattering, TextureRef};
use lanecast::scene::texture::{Texels, Texture};
use lanecast::shade::Shades;
use path_support::{
    add, dark, facets, lamp, look, near, parallel, parallelogram, paths, plane, scatters, seen, shape, sphere, under,
};

/// Diffuse reflectance of receivers.
const RHO: f64 = 0.6;

/// The plane z = 0, matte, and what else `build` makes; the radiance of the plane at the origin seen under 60
/// degrees by paths of one scattering, as irradiance.
fn irradiance<S: Shades>(spp: u32, build: impl Fn(&mut Description)) -> DVec3 {
    let mut d = dark();
    let id = add(&mut d, Material { diffuse: DVec3::splat(RHO), ..Material::default() });
    plane(&mut d, 0.0, id);
    build(&mut d);
    seen::<S>(&d, &under(60.0), &paths(4, spp, 1)) * (PI / RHO)
}

#[test]
fn point_lights_fall_off_by_the_square() {
    for distance in [0.5, 1.0, 2.0, 8.0, 64.0] {
        let towards = DVec3::new(0.3, -0.4, 0.866).normalize();
        let light = Light::Point { position: towards * distance, intensity: DVec3::new(3.0, 2.0, 1.0) };
        let want = DVec3::new(3.0, 2.0, 1.0) * towards.z / (distance * distance);
        near("f32", irradiance::<f32>(1, |d| d.lights.push(light)), want, 2e-4);
        near("f64", irradiance::<f64>(1, |d| d.lights.push(light)), want, 2e-4);
    }
}

#[test]
fn spot_lights_shine_into_their_cone() {
    let at = |from_axis: f64| {
        // The origin is seen from the light under `from_axis` to its axis.
        let position = DVec3::new(0.0, 0.0, 2.0);
        let direction = DVec3::new(from_axis.sin(), 0.0, -from_axis.cos());
        let intensity = DVec3::splat(8.0);
        let (inner, outer) = (0.2, 0.5);
        let light = Light::Spot { position, direction, intensity, inner, outer };
        irradiance::<f32>(1, |d| d.lights.push(light)).x
    };
    assert!((at(0.1) / 2.0 - 1.0).abs() < 1e-4);
    let between = (f64::cos(0.35) - f64::cos(0.5)) / (f64::cos(0.2) - f64::cos(0.5));
    assert!((at(0.35) / (2.0 * between * between) - 1.0).abs() < 2e-3, "{}", at(0.35));
    assert_eq!(at(0.6), 0.0);
}

#[test]
fn directional_lights_and_suns_shine_by_the_cosine() {
    let direction = DVec3::new(0.6, 0.0, -0.8);
    let colour = DVec3::new(3.0, 2.0, 1.0);
    let light = Light::Directional { direction: direction * 7.0, irradiance: colour };
    near("directional", irradiance::<f32>(1, |d| d.lights.push(light)), colour * 0.8, 1e-4);
    for radius in [0.00465, 0.1, 0.5] {
        let light = Light::Sun { direction, irradiance: colour, radius };
        let got = irradiance::<f32>(1024, |d| d.lights.push(light));
        near(&format!("sun of {radius}"), got, colour * 0.8, 1e-3);
    }
    // Seen itself it has the radiance whose integral that is.
    let mut d = dark();
    d.lights.push(Light::Sun { direction, irradiance: colour, radius: 0.1 });
    sphere(&mut d, DVec3::splat(9.0), 1.0, 0);
    let radiance = colour / (PI * f64::sin(0.1).powi(2));
    near("in the sun", seen::<f32>(&d, &look(DVec3::ZERO, -direction, 0.1), &paths(4, 1, 1)), radiance, 1e-4);
    let beside = DVec3::new(-0.6, 0.2, 0.8);
    near("beside it", seen::<f32>(&d, &look(DVec3::ZERO, beside, 0.01), &paths(4, 1, 1)), DVec3::ZERO, 0.0);
}

#[test]
fn spheres_shine_as_if_from_their_solid_angle() {
    for (distance, radius, z) in [(4.0, 1.0, 0.8), (2.0, 1.5, 1.0), (100.0, 0.5, 0.6)] {
        let centre = DVec3::new(0.0, -f64::sqrt(1.0 - z * z), z) * distance;
        let got = irradiance::<f32>(1024, |d| {
            let id = add(d, lamp(5.0));
            sphere(d, centre, radius, id);
        });
        let want = PI * 5.0 * (radius / distance).powi(2) * z;
        near(&format!("{distance} {radius}"), got, DVec3::splat(want), 1e-3);
    }
}

#[test]
fn discs_and_ellipses_shine_by_their_form_factor() {
    let (height, radius) = (2.0, 1.2);
    let want = DVec3::splat(PI * 5.0 * radius * radius / (radius * radius + height * height));
    // The second one mirrored and wound the other way: what it shines at must not change.
    for mirror in [1.0, -1.0] {
        for one_sided in [false, true] {
            let got = irradiance::<f32>(1024, |d| {
                let id = add(d, Material { one_sided, ..lamp(5.0) });
                let map = DMat3::from_diagonal(DVec3::new(radius * mirror, radius, -1.0));
                shape(d, Shape::Disc, DAffine3::from_mat3_translation(map, DVec3::Z * height), id);
            });
            near(&format!("{mirror} {one_sided}"), got, want, 1e-3);
        }
    }
    // A disc that looks away is dark if it has one side.
    let got = irradiance::<f32>(64, |d| {
        let id = add(d, Material { one_sided: true, ..lamp(5.0) });
        shape(d, Shape::Disc, DAffine3::from_translation(DVec3::Z * height), id);
    });
    near("looks away", got, DVec3::ZERO, 0.0);
}

/// Two equal squares that face each other: J. Howell's catalogue of configuration factors, C-11, for X = Y = side
/// over distance.
#[test]
fn parallel_squares_exchange_their_form_factor() {
    for x in [1.0, 3.0f64] {
        let root = (1.0 + x * x).sqrt();
        let logarithm = ((1.0 + x * x).powi(2) / (1.0 + 2.0 * x * x)).sqrt().ln();
        let factor = 2.0 / (PI * x * x) * (logarithm + 2.0 * x * root * (x / root).atan() - 2.0 * x * x.atan());
        for turned in [false, true] {
            let mut d = dark();
            let receiver = add(&mut d, Material { diffuse: DVec3::splat(RHO), ..Material::default() });
            let shining = add(&mut d, Material { one_sided: true, ..lamp(2.0) });
            parallelogram(&mut d, DVec3::new(-x / 2.0, -x / 2.0, 0.0), DVec3::X * x, DVec3::Y * x, receiver);
            let corner = DVec3::new(-x / 2.0, -x / 2.0, 1.0);
            parallelogram(&mut d, corner, DVec3::Y * x, DVec3::X * x, shining);
            if turned {
                // Mirrored in the plane x = 0: the same square.
                d.groups[0].items[1].transform = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
            }
            let camera = parallel(DVec3::Z * 0.5, DVec3::ZERO, x);
            let want = DVec3::splat(RHO * 2.0 * factor);
            near(&format!("{x} f32"), seen::<f32>(&d, &camera, &paths(32, 64, 1)), want, 1e-3);
            near(&format!("{x} f64"), seen::<f64>(&d, &camera, &paths(32, 64, 1)), want, 1e-3);
        }
    }
}

#[test]
fn glass_mirrors_what_fresnel_says() {
    // 0.04, 0.0502 and 0.3877 for an index of 1.5 at 0, 45 and 80 degrees.
    for (degrees, table) in [(0.0f64, 0.04), (45.0, 0.0502), (80.0, 0.3877)] {
        let exact = facets::glass(degrees.to_radians().cos(), 1.5);
        assert!((exact - table).abs() < 1e-4);
        for scattering in [
            Scattering::Dielectric { ior: 1.5, roughness: 0.0, tint: DVec3::ONE },
            Scattering::Plastic { ior: 1.5, roughness: 0.0 },
        ] {
            let mut d = dark();
            d.background = DVec3::ONE;
            let id = add(&mut d, scatters(scattering, DVec3::ZERO));
            let black = add(&mut d, lamp(0.0));
            plane(&mut d, 0.0, id);
            plane(&mut d, -1.0, black);
            let got = seen::<f32>(&d, &under(degrees), &paths(8, 4096, 2)).x;
            assert!((got - exact).abs() < 1e-4, "{degrees}: {got}, want {exact}");
        }
    }
}

/// A glass plate of thickness 1 moves what is seen through it sideways; it is white beyond an edge below the plate.
#[test]
fn a_slab_displaces_an_image() {
    let (ior, angle) = (1.5f64, FRAC_PI_4);
    let inside = (angle.sin() / ior).asin();
    // Along x at the depth of the edge, 1 below the plate.
    let exact = angle.tan() - inside.tan();
    let mut d = dark();
    let glass = add(&mut d, scatters(Scattering::Dielectric { ior, roughness: 0.0, tint: DVec3::ONE }, DVec3::ONE));
    let white = add(&mut d, lamp(1.0));
    let map = DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::new(50.0, 50.0, 0.5)), DVec3::Z * 0.5);
    shape(&mut d, Shape::Cuboid, map, glass);
    parallelogram(&mut d, DVec3::new(0.0, -50.0, -1.0), DVec3::X * 50.0, DVec3::Y * 100.0, white);
    // Without glass the axis would meet the edge; the picture is 2 wide across the axis.
    let dir = DVec3::new(angle.sin(), 0.0, -angle.cos());
    let edge = DVec3::new(0.0, 0.0, -1.0);
    let camera = parallel(edge - dir * 6.0, edge, 2.0);
    // In, and out again: what has been mirrored within is not followed.
    let got = seen::<f64>(&d, &camera, &paths(32, 256, 2));
    let passes = (1.0 - facets::glass(angle.cos(), ior)).powi(2);
    // The share of the picture that is white is half of it less the displacement, seen across the axis.
    let displacement = (0.5 - got.x / passes) * 2.0 / angle.cos();
    assert!((displacement - exact).abs() < 2e-3, "displaced by {displacement}, want {exact}");
}

#[test]
fn constant_environments_are_backgrounds() {
    let scene = || {
        let mut d = dark();
        let matte = add(&mut d, Material { diffuse: DVec3::new(0.9, 0.5, 0.2), ..Material::default() });
        let metal = Scattering::Conductor { eta: DVec3::splat(0.2), k: DVec3::splat(3.0), roughness: 0.4 };
        let metal = add(&mut d, scatters(metal, DVec3::ONE));
        plane(&mut d, 0.0, matte);
        sphere(&mut d, DVec3::new(0.0, 0.0, 1.0), 1.0, metal);
        d
    };
    let (mut plain, mut pictured) = (scene(), scene());
    let radiance = DVec3::new(0.5, 1.0, 2.0);
    plain.background = radiance;
    pictured.environment = Some(path_support::constant_environment(radiance));
    let camera = look(DVec3::new(5.0, 1.0, 3.0), DVec3::new(0.0, 0.0, 0.7), 0.6);
    let options = paths(16, 1024, 6);
    near("means", seen::<f32>(&pictured, &camera, &options), seen::<f32>(&plain, &camera, &options), 1e-3);
}

/// Rough metal lit by a sphere: the reflected radiance by an integral over the cone under which the sphere is seen.
#[test]
fn lights_and_facets_share_their_chances_rightly() {
    let (eta, k, distance, z) = (0.2, 3.0, 4.0f64, 0.8f64);
    let towards = DVec3::new(-(1.0 - z * z).sqrt(), 0.0, z);
    let out = DVec3::new(0.5, 0.0, 0.75f64.sqrt());
    for (roughness, radius) in [(0.15f64, 1.0f64), (0.4, 0.1), (0.4, 2.0), (1.0, 1.0)] {
        let cone = 1.0 - (1.0 - (radius / distance) * (radius / distance)).sqrt();
        let (side, other) = (towards.any_orthonormal_pair().0, towards.any_orthonormal_pair().1);
        const STEPS: u32 = 1200;
        let mut sum = 0.0;
        for a in 0..STEPS {
            let below = cone * (f64::from(a) + 0.5) / f64::from(STEPS);
            let sin = (below * (2.0 - below)).sqrt();
            for b in 0..STEPS {
                let (s, c) = (TAU * (f64::from(b) + 0.5) / f64::from(STEPS)).sin_cos();
                let from = (side * c + other * s) * sin + towards * (1.0 - below);
                let cos = out.dot((out + from).normalize());
                sum += facets::value(out, from, roughness * roughness) * facets::metal(cos, eta, k);
            }
        }
        let want = 5.0 * sum * TAU * cone / f64::from(STEPS * STEPS);
        let mut d = dark();
        let metal = Scattering::Conductor { eta: DVec3::splat(eta), k: DVec3::splat(k), roughness };
        let single = Material { multiple_scattering: false, ..scatters(metal, DVec3::ONE) };
        let (metal, shining) = (add(&mut d, single), add(&mut d, lamp(5.0)));
        plane(&mut d, 0.0, metal);
        sphere(&mut d, towards * distance, radius, shining);
        let got = seen::<f32>(&d, &under(30.0), &paths(8, 4096, 1));
        near(&format!("roughness {roughness}, radius {radius}"), got, DVec3::splat(want), 2e-3);
    }
}

#[test]
fn opacity_lets_its_share_pass() {
    let disc = |d: &mut Description, material: Material| {
        let id = add(d, material);
        shape(
            d,
            Shape::Disc,
            DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::new(1.2, 1.2, -1.0)), DVec3::Z * 2.0),
            id,
        );
    };
    let blend = |emission| Material { alpha: Alpha::Blend, opacity: 0.3, ..lamp(emission) };
    // Seen: 0.3 of what it emits and 0.7 of what is behind it.
    let mut d = dark();
    d.background = DVec3::ONE;
    disc(&mut d, blend(2.0));
    let got = seen::<f32>(&d, &under(30.0), &paths(8, 1024, 1)).x;
    assert!((got - 1.3).abs() < 0.01, "{got}");
    // A picture of opacity stands in place of the base picture's alpha: both are often one file.
    for (base, own, want) in [(true, true, 0.75), (true, false, 0.75), (false, true, 0.75), (false, false, 0.0)] {
        let mut d = dark();
        d.background = DVec3::ONE;
        let texels = Texels::Float(vec![[0.25; 4]]);
        d.textures.push(Texture { name: "quarter".into(), width: 1, height: 1, texels }.into());
        let mut material = Material { alpha: Alpha::Blend, ..lamp(0.0) };
        material.textures.base = base.then(|| TextureRef::new(0));
        material.textures.opacity = own.then(|| TextureRef::new(0));
        disc(&mut d, material);
        let got = seen::<f32>(&d, &under(30.0), &paths(8, 1024, 1)).x;
        assert!((got - want).abs() < 0.05, "{base} {own}: {got}");
    }
    // As a shade: 0.7 of a point light behind it; below its cut-off it is not there, above it is whole.
    let point = Light::Point { position: DVec3::Z * 4.0, intensity: DVec3::splat(16.0) };
    for (alpha, want) in [
        (Alpha::Blend, 0.7),
        (Alpha::Mask { cutoff: 0.5 }, 1.0),
        (Alpha::Mask { cutoff: 0.2 }, 0.0),
        (Alpha::Opaque, 0.0),
    ] {
        let got = irradiance::<f32>(1, |d| {
            disc(d, Material { alpha, ..blend(0.0) });
            d.lights.push(point);
        });
        near(&format!("{alpha:?}"), got, DVec3::splat(want), 1e-4);
    }
    // As a lamp: 0.3 of what it would be.
    let whole = PI * 5.0 * 1.44 / (1.44 + 4.0);
    for (alpha, want) in [(Alpha::Blend, 0.3), (Alpha::Mask { cutoff: 0.2 }, 1.0), (Alpha::Mask { cutoff: 0.5 }, 0.0)] {
        let got = irradiance::<f32>(4096, |d| disc(d, Material { alpha, ..blend(5.0) }));
        near(&format!("shining, {alpha:?}"), got, DVec3::splat(want * whole), 5e-3);
    }
}
