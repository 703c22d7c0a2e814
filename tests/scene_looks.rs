//! Materials, lights, textures and environments of scene files: what they mean, and what is wrong with them.

use std::path::Path;

use glam::{DVec2, DVec3};
use lanecast::error::{Error, Result};
use lanecast::scene::description::{Description, Light, Material};
use lanecast::scene::kdl::{meshes::MeshFiles, parse};
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::material::{Alpha, Scattering, Wrap};
use lanecast::scene::texture::Texels;

fn read_in(folder: Option<&Path>, text: &str) -> Result<Description> {
    let read = |path: &Path| Err(Error::whole(path, "no meshes here"));
    let files = MeshFiles { folder, allow_outside: false, found: None, read: &read };
    parse(Path::new("t.kdl"), "t", text.as_bytes(), &[], &files)
}

fn scene(text: &str) -> Description {
    read_in(None, text).unwrap_or_else(|e| panic!("{e}"))
}

fn material(body: &str) -> Material {
    scene(&format!("material \"m\" {{ {body} }}")).materials[1].clone()
}

fn scattering(body: &str) -> Scattering {
    material(body).scattering
}

/// A folder with `a.png`: one row of red at half opacity and green.
fn pictures() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(&[255, 0, 0, 128, 0, 255, 0, 255]).unwrap();
    std::fs::write(folder.path().join("a.png"), &bytes).unwrap();
    std::fs::write(folder.path().join("cut.png"), &bytes[..40]).unwrap();
    folder
}

#[test]
fn mirrors_leave_the_rest_to_the_base() {
    let folder = pictures();
    let of = |text: &str| {
        let scene = read_in(Some(folder.path()), &format!("material \"m\" {{ {text} }}")).unwrap();
        (scene.materials[1].diffuse.to_array(), scene.materials[1].mirror.to_array())
    };
    assert_eq!(of("mirror 0.875"), ([0.125; 3], [0.875; 3]));
    assert_eq!(of("mirror 0 0.25 0.5"), ([0.7, 0.7, 0.5], [0.0, 0.25, 0.5]));
    assert_eq!(of("mirror 0.25; texture \"a.png\"").0, [0.75; 3]);
    assert_eq!(of("texture \"a.png\"").0, [1.0; 3]);
    assert_eq!(of("diffuse 0.7; mirror 0.3"), ([0.7; 3], [0.3; 3]));
    // What is said is taken as it is said, and warned of.
    assert_eq!(of("diffuse 0.5; mirror 0.25 0.75 0"), ([0.5; 3], [0.25, 0.75, 0.0]));
    let warnings = |text: &str| {
        let scene = read_in(Some(folder.path()), &format!("material \"m\" {{ {text} }}")).unwrap();
        scene.warnings
    };
    let bright = "material \"m\": `diffuse` and `mirror` add up to 1.25: it reflects more light than it gets";
    assert_eq!(warnings("diffuse 0.5; mirror 0.25 0.75 0"), [bright]);
    for text in ["diffuse 0.7; mirror 0.3", "mirror 0.9", "diffuse 0.9; mirror 0.9; plastic"] {
        assert!(warnings(text).is_empty(), "{text}");
    }
    // Models have no use for a mirror besides their own.
    assert_eq!(of("diffuse 0.9; mirror 0.9; plastic").0, [0.9; 3]);
    assert_eq!(of("mirror 0.9; plastic").0, [0.7; 3]);
}

#[test]
fn models_of_scattering() {
    assert_eq!(scattering("diffuse 0.5; mirror 0.1"), Scattering::Matte);
    let tint = DVec3::new(0.5, 1.0, 0.25);
    assert_eq!(
        scattering("dielectric ior=1.33 roughness=0.25 { tint 0.5 1 0.25 }"),
        Scattering::Dielectric { ior: 1.33, roughness: 0.25, tint }
    );
    assert_eq!(scattering("dielectric"), Scattering::Dielectric { ior: 1.5, roughness: 0.0, tint: DVec3::ONE });
    assert_eq!(scattering("thin-glass"), Scattering::ThinGlass { ior: 1.5, tint: DVec3::ONE });
    assert_eq!(scattering("plastic { roughness 0.5 }"), Scattering::Plastic { ior: 1.5, roughness: 0.5 });
    assert_eq!(
        scattering("metal-rough metallic=1 { roughness 0.3; transmission 0.1; ior 2 }"),
        Scattering::MetallicRoughness { metallic: 1.0, roughness: 0.3, ior: 2.0, transmission: 0.1 }
    );
    assert_eq!(
        scattering("conductor { eta 0.2 0.4 1; k 3; roughness 0.1 }"),
        Scattering::Conductor { eta: DVec3::new(0.2, 0.4, 1.0), k: DVec3::splat(3.0), roughness: 0.1 }
    );
    let single = |text: &str| !material(text).multiple_scattering;
    assert!(
        single("conductor gold roughness=0.2 single-scattering=#true") && single("dielectric { single-scattering }")
    );
    assert!(!single("conductor gold") && !single("plastic roughness=0.5"));
    let Scattering::Conductor { eta, k, roughness } = scattering("conductor gold roughness=0.2") else { panic!() };
    // Johnson and Christy: at 617 and 582 nm eta is 0.21 and 0.29, k 3.272 and 2.863.
    assert!((0.21..0.29).contains(&eta.x) && (2.863..3.272).contains(&k.x) && roughness == 0.2);
    let m = material("emission 4 2 1; one-sided; opacity 0.25");
    assert_eq!((m.emission, m.one_sided), (DVec3::new(4.0, 2.0, 1.0), true));
    assert_eq!((m.opacity, m.alpha), (0.25, Alpha::Blend));
    let m = scene("material \"m\" mask=0.75 one-sided=#false").materials[1].clone();
    assert_eq!((m.alpha, m.one_sided, m.diffuse), (Alpha::Mask { cutoff: 0.75 }, false, DVec3::splat(0.7)));
}

#[test]
fn mixes_name_materials_that_may_come_later() {
    let d = scene("material \"m\" { mix \"a\" \"default\" 0.25 }; material \"a\" { diffuse 1 }");
    assert_eq!(d.materials[1].scattering, Scattering::Mix { first: 2, second: 0, amount: 0.25 });
    let mut nested = String::from("material \"m0\"\n");
    for i in 1..=8 {
        nested += &format!("material \"m{i}\" {{ mix \"m{}\" \"m0\" \"1 / 4\" }}\n", i - 1);
    }
    assert_eq!(scene(&nested).materials[9].scattering, Scattering::Mix { first: 8, second: 1, amount: 0.25 });
    // One too deep, on line 10: a shallow mix after it hides nothing, nor do deeper ones, in either order.
    let too_deep = nested + "material \"m9\" { mix \"m0\" \"m8\" 0 }\n";
    let shallow = "material \"last\" { mix \"m0\" \"m0\" 0 }\n";
    let chain: Vec<String> =
        (1..60).map(|i| format!("material \"m{i}\" {{ mix \"m{}\" \"m0\" 0 }}\n", i - 1)).collect();
    let rising = format!("material \"m0\"\n{}{shallow}", chain.concat());
    let falling = chain.iter().rev().fold(String::new(), |text, line| text + line) + "material \"m0\"\n" + shallow;
    for (text, line) in [(too_deep.clone(), 10), (too_deep + shallow, 10), (rising, 10), (falling, 1)] {
        let error = read_in(None, &text).unwrap_err().to_string();
        let place = format!("t.kdl:{line}:");
        assert!(error.starts_with(&place) && error.contains("nest deeper than 8 levels"), "{error}");
    }
}

#[test]
fn spot_lights_and_suns_have_degrees() {
    let d = scene(
        "light spot { position 1 2 3; direction 0 -2 0; intensity 5; inner 30; outer 60 }
         light spot position=\"0, 0, 0\" direction=\"1, 0, 0\"
         light sun { direction 0 -1 0; irradiance 3 2 1; angle 90e-1 }
         light sun direction=\"0, 0, 1\"",
    );
    let third = std::f64::consts::FRAC_PI_3;
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
    let Light::Spot { position, direction, intensity, inner, outer } = d.lights[0] else { panic!("{:?}", d.lights) };
    assert_eq!((position, direction), (DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, -2.0, 0.0)));
    assert_eq!(intensity, DVec3::splat(5.0));
    near(inner, third / 2.0);
    near(outer, third);
    assert!(matches!(d.lights[1], Light::Spot { inner, outer, .. } if inner == 0.0 && outer > 0.78 && outer < 0.79));
    let Light::Sun { irradiance, radius, .. } = d.lights[2] else { panic!("{:?}", d.lights) };
    assert_eq!(irradiance, DVec3::new(3.0, 2.0, 1.0));
    near(radius, 9.0_f64.to_radians());
    assert!(matches!(d.lights[3], Light::Sun { radius, .. } if (radius - 0.004653).abs() < 1e-5));
}

#[test]
fn textures_of_every_number_with_coordinates_that_point_up() {
    let folder = pictures();
    let text = "material \"m\" {
            texture \"a.png\" { scale 2 4; offset 0.5 0.25; wrap clamp; nearest }
            texture \"a.png\" of=opacity wrap=mirror
            texture \"./a.png\" { of normal; strength 0.5 }
            texture \"a.png\" { of emission; rotate 90 }
            texture \"a.png\" { of metal-rough }
            texture \"a.png\" { of transmission; scale 3 }
        }
        polygon material=\"m\" { point 0 0 0 0 0; point 1 0 0 1 0; point 0 1 0 0 1 }";
    let d = read_in(Some(folder.path()), text).unwrap();
    assert_eq!(d.textures.len(), 3, "one of colours, one of opacity, one of numbers");
    assert!(matches!(&d.textures[0].texels, Texels::Srgb8(t) if t[0] == [255, 0, 0, 128]));
    assert_eq!(d.textures[1].texels, Texels::Linear8(vec![[128, 128, 128, 255], [255; 4]]), "its alpha counts");
    assert_eq!(d.textures[2].texels, Texels::Linear8(vec![[255, 0, 0, 128], [0, 255, 0, 255]]));
    let m = &d.materials[1];
    assert_eq!((m.diffuse, m.emission, m.alpha), (DVec3::ONE, DVec3::ONE, Alpha::Blend), "a texture is seen as it is");
    let t = &m.textures;
    let base = t.base.unwrap();
    assert_eq!((base.wrap, base.nearest, base.texture), ([Wrap::Clamp; 2], true, 0));
    // Coordinates of the file, and where in the picture they are (its v points down).
    let at =
        |r: lanecast::scene::material::TextureRef, u: f64, v: f64| r.transform.transform_point2(DVec2::new(u, 1.0 - v));
    assert_eq!(at(base, 0.0, 0.0), DVec2::new(0.5, 0.75));
    assert_eq!(at(base, 1.0, 0.5), DVec2::new(2.5, 1.0 - 2.25));
    let turned = t.emission.unwrap();
    assert!(at(turned, 1.0, 0.0).distance(DVec2::new(0.0, 0.0)) < 1e-12, "(1, 0) is turned to (0, 1): the upper edge");
    assert_eq!((t.opacity.unwrap().wrap, t.normal_scale), ([Wrap::Mirror; 2], 0.5));
    assert!(t.normal.is_some() && t.metallic_roughness.is_some());
    assert_eq!(at(t.transmission.unwrap(), 0.5, 0.0), DVec2::new(1.5, 1.0));
    assert_eq!(d.meshes[0].uvs[0].values, [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
    let other = std::fs::read(folder.path().join("a.png")).unwrap();
    std::fs::write(folder.path().join("a.png"), [other, vec![0]].concat()).unwrap();
    assert_ne!(read_in(Some(folder.path()), text).unwrap().hash, d.hash, "pictures are part of the scene");
}

#[test]
fn textures_without_coordinates_are_a_warning() {
    let folder = pictures();
    std::fs::write(folder.path().join("m.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl b\nf 1 2 3\n").unwrap();
    let warnings = |items: &str| {
        let file = folder.path().join("t.kdl");
        let materials = ["a", "b", "c"].map(|name| format!("material {name} {{ texture \"a.png\" }}\n")).concat();
        std::fs::write(&file, format!("material plain\n{materials}{items}")).unwrap();
        load(&file.to_string_lossy(), &LoadOptions::default()).unwrap().warnings
    };
    let bare = |name: &str| format!("polygon material={name} {{ point 0 0 0; point 1 0 0; point 0 1 0 }}\n");
    let mapped = "polygon material=a { point 0 0 0 0 0; point 1 0 0 1 0; point 0 1 0 0 1 }\n";
    // Shapes have coordinates; of a mesh with materials of its own the item's one counts.
    let fine = bare("plain") + mapped + "sphere material=c\nmesh \"m.obj\" material=plain\n";
    assert_eq!(warnings(&fine), Vec::<String>::new());
    let both = warnings(&(fine + &bare("a") + &bare("a") + "mesh \"m.obj\"\n"));
    let what = "stands on a mesh without the texture coordinates that its textures need: one texel colours all of it";
    assert_eq!(both, ["a", "b"].map(|name| format!("the material `{name}` {what}")));
}

#[test]
fn environments_from_files_and_by_code() {
    let folder = pictures();
    let d = read_in(Some(folder.path()), "environment \"a.png\" { scale 2 1 1; rotate 90; rotate x 90 }").unwrap();
    let e = d.environment.unwrap();
    assert_eq!((e.scale, e.texture.width), (DVec3::new(2.0, 1.0, 1.0), 2));
    let Texels::Float(texels) = &e.texture.texels else { panic!("not floats") };
    assert_eq!((texels[0][0], texels[1][1], texels[0][1]), (1.0, 1.0, 0.0));
    // A quarter about y takes z to x, one about x leaves it there.
    assert!((e.to_world * DVec3::Z).distance(DVec3::X) < 1e-12 && (e.to_world * DVec3::Y).distance(DVec3::Z) < 1e-12);
    let sky = scene("environment sky { direction 0 -1 1; turbidity 4; ground 0.5 0.25 0 }").environment.unwrap();
    let Texels::Float(texels) = &sky.texture.texels else { panic!("not floats") };
    let width = sky.texture.width as usize;
    assert_eq!(texels[texels.len() - 1], [0.5, 0.25, 0.0, 1.0]);
    // The light travels towards +z: the sun stands over -z, in the middle of the picture, halfway up.
    let row = &texels[texels.len() / 4..][..width];
    let brightest = (0..width).max_by(|&a, &b| row[a][1].total_cmp(&row[b][1])).unwrap();
    assert!(brightest.abs_diff(width / 2) <= 1, "{brightest}");
    assert!(scene("sphere").environment.is_none());
}

#[test]
fn what_is_wrong_is_said_where_it_stands() {
    let folder = pictures();
    for (text, place, phrase) in [
        ("material \"a\" { conductor golt }", "1:26", "unknown metal `golt`"),
        ("material \"a\" { conductor golt }", "1:26", "did you mean `gold`?"),
        ("material \"a\" { conductor }", "1:16", "expected a metal (`conductor gold`), or both `eta` and `k`"),
        ("material \"a\" { conductor gold k=1 }", "1:16", "or both `eta` and `k`"),
        ("material \"a\" { conductor eta=0 k=1 }", "1:26", "`eta` must be above zero"),
        ("material \"a\" { plastic; dielectric }", "1:25", "this one has `plastic`"),
        ("material \"a\" { plastik }", "1:16", "did you mean `plastic`?"),
        ("material \"a\" { plastic roughness=2 }", "1:24", "`roughness` takes a number from 0 to 1, found 2"),
        ("material \"a\" { dielectric ior=0 }", "1:27", "`ior` must be above zero"),
        ("material \"a\" { thin-glass roughness=1 }", "1:27", "has no property `roughness`"),
        ("material \"a\" { one-sided 3 }", "1:16", "expected `one-sided` alone, or one-sided=#true"),
        ("material \"a\" { opacity 1.5 }", "1:16", "from 0 to 1"),
        ("material \"a\" { mix \"a\" }", "1:16", "two materials, and how much of the second"),
        ("material \"a\" { mix \"a\" \"default\" 2 }", "1:34", "expected a number from 0 to 1"),
        ("material \"a\" { mix \"b\" \"default\" 0 }; material \"bb\"", "1:20", "no material is called `b`"),
        ("material \"a\" { mix \"a\" \"default\" 0 }", "1:20", "mixes contain themselves"),
        ("material \"a\" { texture }", "1:16", "expected `texture \"file.png\"`"),
        ("material \"a\" { texture \"b.png\" }", "1:24", "cannot open `b.png`"),
        ("material \"a\" { texture \"../b.png\" }", "1:24", "leaves the scene's folder"),
        ("material \"a\" { texture \"cut.png\" }", "1:24", "`cut.png`: not a readable PNG picture"),
        ("material \"a\" { texture \"a.png\" of=colour }", "1:35", "unknown use `colour` of a texture"),
        ("material \"a\" { texture \"a.png\" wrap=over }", "1:37", "expected repeat, mirror or clamp"),
        ("material \"a\" { texture \"a.png\" strength=2 }", "1:32", "it goes with `of normal`"),
        ("material \"a\" { texture \"a.png\"; texture \"a.png\" }", "1:33", "a texture of base is given twice"),
        ("material \"a\" { texture \"a.png\" scale=\"1,2,3\" }", "1:32", "`scale` takes two numbers, found 3"),
        ("light spot position=\"0,0,0\"", "1:1", "a spot light needs a `direction`"),
        ("light spot position=\"0,0,0\" direction=\"0,0,1\" inner=50", "1:1", "expected 0 <= `inner` < `outer` < 180"),
        ("light sun", "1:1", "a sun light needs a `direction`"),
        ("light sun direction=\"0,0,1\" angle=90", "1:29", "below 90 degrees"),
        ("light spit", "1:7", "did you mean `spot`?"),
        ("environment", "1:1", "expected `environment \"file.exr\"` or `environment sky`"),
        ("environment \"b.exr\"", "1:13", "cannot open `b.exr`"),
        ("environment \"a.png\" { turn 3 }", "1:23", "unknown `turn`"),
        ("environment sky { direction 0 1 0 }", "1:19", "above the horizon"),
        ("environment sky turbidity=1", "1:17", "`turbidity` lies between 2 and 10"),
        ("environment sky; environment sky", "1:18", "`environment` is given twice"),
        ("group { environment sky }", "1:9", "`environment` belongs to the top level"),
        ("polygon { point 0 0 0; point 1 0 0 1 1; point 0 1 0 }", "1:1", "at all points of the polygon, or at none"),
        ("polygon { point 0 0 0 1 }", "1:11", "three numbers, or five"),
    ] {
        let error = read_in(Some(folder.path()), text).unwrap_err().to_string();
        assert!(error.starts_with(&format!("t.kdl:{place}: ")) && error.contains(phrase), "{text}\n{error}");
    }
    let many: String = (0..=1 << 18).map(|i| format!("material \"{i}\"\n")).collect();
    let error = read_in(None, &many).unwrap_err().to_string();
    assert!(error.starts_with("t.kdl:262145:1: more than 262144 materials"), "{error}");
    let none = read_in(None, "material \"a\" { texture \"a.png\" }").unwrap_err().to_string();
    assert!(none.contains("a scene without a folder refers to no files"), "{none}");
}
