//! Materials, textures, lights and vertex attributes of glTF documents against values worked out by hand, and the
//! shared scene with textures against its own pictures.

mod gltf_support;

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::path::Path;

use glam::{DMat2, DVec2, DVec3};
use gltf_support::{ONE_MESH, TRIANGLE, document, floats, glb, parse, refusal, scene, shared};
use lanecast::scene::description::{Description, Light, Material};
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::material::{Alpha, Scattering, TextureRef, Wrap};
use lanecast::scene::pictures::{Curve, decode};
use lanecast::scene::texture::Texels;
use lanecast::scene::world::{Preset, World};

/// A PNG of 2 x 2 texels: red, green, blue, white at half opacity.
const PIXELS: [[u8; 4]; 4] = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 128]];

fn png(pixels: &[[u8; 4]; 4]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(pixels.as_flattened()).unwrap();
    bytes
}

fn data_uri(bytes: &[u8]) -> String {
    use base64::Engine;
    format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

/// The scene of a document with `materials`, three textures of one picture (plain, mirrored and nearest, clamped).
fn with_materials(materials: &str) -> Description {
    let uri = data_uri(&png(&PIXELS));
    let rest = format!(
        r#""nodes": [{{"mesh": 0}}], "materials": [{materials}],
        "textures": [{{"source": 0}}, {{"source": 0, "sampler": 0}}, {{"source": 0, "sampler": 1}}, {{}}],
        "samplers": [{{"magFilter": 9728, "wrapS": 33648, "wrapT": 10497}}, {{"wrapS": 33071, "wrapT": 33071}}],
        "images": [{{"uri": "{uri}", "name": "four"}}], {ONE_MESH}"#
    );
    scene(&rest, &floats(&TRIANGLE))
}

fn material(written: &str) -> Material {
    with_materials(written).materials[1].clone()
}

#[test]
fn metallic_roughness_with_all_its_textures() {
    let scene = with_materials(
        r#"{"name": "all", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25, 0.125],
            "baseColorTexture": {"index": 0}, "metallicFactor": 0.75, "roughnessFactor": 0.5,
            "metallicRoughnessTexture": {"index": 1, "texCoord": 1}}, "normalTexture": {"index": 2, "scale": 0.5},
            "occlusionTexture": {"index": 0, "strength": 0.25}, "emissiveTexture": {"index": 0},
            "emissiveFactor": [1, 0.5, 0], "alphaMode": "MASK", "alphaCutoff": 0.25, "extensions": {
                "KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_ior": {"ior": 1.25},
                "KHR_materials_transmission": {"transmissionFactor": 0.5, "transmissionTexture": {"index": 0}}}}"#,
    );
    let m = &scene.materials[1];
    assert_eq!((m.name.as_str(), m.diffuse, m.opacity), ("all", DVec3::new(1.0, 0.5, 0.25), 0.125));
    let expected = Scattering::MetallicRoughness { metallic: 0.75, roughness: 0.5, ior: 1.25, transmission: 0.5 };
    assert_eq!((m.scattering, m.alpha), (expected, Alpha::Mask { cutoff: 0.25 }));
    assert_eq!((m.emission, m.one_sided), (DVec3::new(4.0, 2.0, 0.0), true));
    // The same picture is there twice: as colours and as plain numbers.
    let [colours, numbers] = [0, 1];
    let t = &m.textures;
    assert_eq!((t.base, t.emission), (Some(TextureRef::new(colours)), Some(TextureRef::new(colours))));
    let mirrored = TextureRef { nearest: true, wrap: [Wrap::Mirror, Wrap::Repeat], ..TextureRef::new(numbers) };
    assert_eq!(t.metallic_roughness, Some(TextureRef { uv_set: 1, ..mirrored }));
    let clamped = TextureRef { wrap: [Wrap::Clamp; 2], ..TextureRef::new(numbers) };
    assert_eq!((t.normal, t.normal_scale), (Some(clamped), 0.5));
    assert_eq!((t.occlusion, t.occlusion_strength), (Some(TextureRef::new(numbers)), 0.25));
    assert_eq!(t.transmission, Some(TextureRef::new(numbers)));
    assert_eq!(scene.textures.len(), 2);
    assert_eq!((scene.textures[0].name.as_str(), &scene.textures[0].texels), ("four", &Texels::Srgb8(PIXELS.into())));
    assert_eq!(scene.textures[1].texels, Texels::Linear8(PIXELS.into()));
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn absent_members_have_the_defaults_of_the_specification() {
    let m = material("{}");
    let expected = Scattering::MetallicRoughness { metallic: 1.0, roughness: 1.0, ior: 1.5, transmission: 0.0 };
    assert_eq!((m.name.as_str(), m.diffuse, m.scattering), ("material 0", DVec3::ONE, expected));
    assert_eq!((m.alpha, m.opacity, m.one_sided, m.emission), (Alpha::Opaque, 1.0, false, DVec3::ZERO));
    assert!(m.textures.base.is_none() && m.textures.normal.is_none());
    let blend = material(r#"{"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}}"#);
    assert_eq!((blend.alpha, blend.opacity), (Alpha::Blend, 0.5));
    let both = material(r#"{"doubleSided": true, "emissiveFactor": [1, 1, 1]}"#);
    assert_eq!((both.emission, both.one_sided), (DVec3::ONE, false));
    let ior = material(r#"{"extensions": {"KHR_materials_ior": {"ior": 0}}}"#);
    let Scattering::MetallicRoughness { ior, .. } = ior.scattering else { panic!("{ior:?}") };
    assert!((((ior - 1.0) / (ior + 1.0)).powi(2) - 1.0).abs() < 1e-3, "0 stands for infinity: all is reflected");
    let unlit = material(
        r#"{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 1], "baseColorTexture": {"index": 0}},
            "extensions": {"KHR_materials_unlit": {}}}"#,
    );
    assert_eq!((unlit.emission, unlit.diffuse), (DVec3::new(0.5, 0.25, 1.0), DVec3::ZERO));
    assert_eq!((unlit.textures.emission, unlit.scattering), (unlit.textures.base, Scattering::Matte));
}

#[test]
fn texture_transforms_turn_counter_clockwise_where_v_points_down() {
    let m = material(
        r#"{"emissiveTexture": {"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform":
            {"offset": [0, 1], "rotation": 1.57079632679, "scale": [0.5, 0.5], "texCoord": 1}}}}"#,
    );
    // The example of the extension's text: the lower left quadrant of the picture, turned by a quarter.
    let r = m.textures.emission.unwrap();
    assert_eq!(r.uv_set, 1);
    for (uv, wanted) in [([0.0, 0.0], [0.0, 1.0]), ([1.0, 0.0], [0.0, 0.5]), ([0.0, 1.0], [0.5, 1.0])] {
        let at = r.transform.transform_point2(DVec2::from(uv));
        assert!(at.distance(DVec2::from(wanted)) < 1e-9, "{uv:?}: {at}, not {wanted:?}");
    }
}

#[test]
fn textures_that_are_not_read_are_left_out_and_said() {
    let scene = with_materials(
        r#"{"normalTexture": {"index": 3}, "emissiveTexture": {"index": 0, "texCoord": 2}},
           {"occlusionTexture": {"index": 3}}"#,
    );
    assert_eq!((scene.textures.len(), scene.materials[1].textures.normal), (0, None));
    let said = |what: &str| assert!(scene.warnings.iter().any(|w| w.contains(what)), "{:?}", scene.warnings);
    said("2 textures without a PNG or JPEG picture");
    said("1 textures that need TEXCOORD_2");
    let used = parse(document(r#""extensionsUsed": ["KHR_materials_clearcoat", "KHR_materials_ior"]"#).as_bytes());
    assert_eq!(used.unwrap().warnings, ["extensions that are not read: `KHR_materials_clearcoat`"]);
}

#[test]
fn lights_shine_along_minus_z_of_their_nodes() {
    let quarter = std::f64::consts::FRAC_1_SQRT_2;
    let rest = format!(
        r#""extensionsRequired": ["KHR_lights_punctual"], "extensions": {{"KHR_lights_punctual": {{"lights": [
            {{"type": "point", "color": [1, 0.5, 0.25], "intensity": 8}},
            {{"type": "directional", "intensity": 3}}, {{"type": "spot", "spot": {{"innerConeAngle": 0.25,
              "outerConeAngle": 0.5}}}}, {{"type": "spot"}}]}}}},
        "nodes": [{{"translation": [1, 2, 3], "scale": [2, 2, 2], "children": [1, 2], {}}},
            {{"translation": [1, 0, 0], "rotation": [{quarter}, 0, 0, {quarter}], {}}}, {{"children": [3], {}}},
            {{"rotation": [0, {quarter}, 0, {quarter}], {}}}]"#,
        light_of_node(0),
        light_of_node(1),
        light_of_node(2),
        light_of_node(3)
    );
    let lights = scene(&rest, &[]).lights;
    let (origin, near) = (DVec3::new(1.0, 2.0, 3.0), |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-12, "{a} {b}"));
    assert_eq!(lights.len(), 4);
    assert_eq!(lights[0], Light::Point { position: origin, intensity: DVec3::new(8.0, 4.0, 2.0) });
    // A quarter about x takes -z to y.
    let Light::Directional { direction, irradiance } = lights[1] else { panic!("{lights:?}") };
    near(direction, DVec3::Y);
    assert_eq!(irradiance, DVec3::splat(3.0));
    let Light::Spot { position, direction, intensity, inner, outer } = lights[2] else { panic!("{lights:?}") };
    near(position, origin);
    near(direction, DVec3::NEG_Z);
    assert_eq!((intensity, inner, outer), (DVec3::ONE, 0.25, 0.5));
    let Light::Spot { direction, inner, outer, .. } = lights[3] else { panic!("{lights:?}") };
    near(direction, DVec3::NEG_X);
    assert_eq!((inner, outer), (0.0, FRAC_PI_4));
    assert!(outer < FRAC_PI_2);
}

fn light_of_node(i: u32) -> String {
    format!(r#""extensions": {{"KHR_lights_punctual": {{"light": {i}}}}}"#)
}

/// Right and up in the picture on a triangle: the same whether normals go along with the winding (`z` is 1) or against it, with
/// tangents or without, and mirrored with the node.
#[test]
fn normal_maps_stand_upright_whichever_way_normals_point() {
    let uri = data_uri(&png(&PIXELS));
    for (z, with_tangents, scale) in
        [1.0, -1.0].into_iter().flat_map(|z| [(z, false, 1), (z, true, 1), (z, false, -1), (z, true, -1)])
    {
        let mut bin = floats(&[-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0]);
        bin.extend(floats(&[[0.0, 0.0, z]; 3].concat()));
        bin.extend(floats(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0]));
        // The bitangent, normal x tangent times w, is y.
        bin.extend(floats(&[[1.0, 0.0, 0.0, z]; 3].concat()));
        let tangents = if with_tangents { r#", "TANGENT": 3"# } else { "" };
        let rest = format!(
            r#""nodes": [{{"mesh": 0, "scale": [{scale}, 1, 1]}}], "buffers": [{{"byteLength": 144}}],
            "materials": [{{"normalTexture": {{"index": 0}}}}], "textures": [{{"source": 0}}],
            "images": [{{"uri": "{uri}"}}], "meshes": [{{"primitives": [{{"material": 0,
                "attributes": {{"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2{tangents}}}}}]}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
                {{"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"}},
                {{"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC2"}},
                {{"bufferView": 3, "componentType": 5126, "count": 3, "type": "VEC4"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 36}},
                {{"buffer": 0, "byteOffset": 72, "byteLength": 24}}, {{"buffer": 0, "byteOffset": 96, "byteLength": 48}}]"#
        );
        let world = World::<f64>::compile(&scene(&rest, &bin), Preset::Balanced).unwrap();
        let inst = world.assembly.placements.len() as u32 - 1;
        let surface = world.surface(DVec3::Z, DVec3::NEG_Z, 1.0, 0.25, 0.25, 0, inst);
        let [right, up] = surface.tangents(0, &DMat2::IDENTITY).unwrap();
        let what = format!("{z} {with_tangents} {scale}: {right} {up}");
        assert!(surface.ns.distance(DVec3::Z) < 1e-6, "{what}, {}", surface.ns);
        assert!(right.distance(DVec3::X * f64::from(scale)) < 1e-6 && up.distance(DVec3::Y) < 1e-6, "{what}");
    }
}

/// Four vertices: positions, then bytes of normals, tangents and two sets of coordinates; two primitives share them.
fn attributes() -> (String, Vec<u8>) {
    let mut bin = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    for normal in [[0_i8, 0, 127, 0], [0, 0, -127, 0], [127, 0, 0, 0], [-128, 0, 0, 0]] {
        bin.extend(normal.map(|x| x as u8));
    }
    for tangent in [[32767_i16, 0, 0, 32767], [0, 32767, 0, -32767], [0, 0, 32767, 32767], [0, 0, 0, 32767]] {
        bin.extend(tangent.iter().flat_map(|x| x.to_le_bytes()));
    }
    for uv in [[0_u16, 65535], [65535, 0], [13107, 0], [0, 13107]] {
        bin.extend(uv.iter().flat_map(|x| x.to_le_bytes()));
    }
    bin.extend([0_u8, 2, 0, 0, 4, 6, 0, 0, 8, 10, 0, 0, 250, 251, 0, 0]);
    bin.extend([1_u8, 2, 3]);
    let uri = data_uri(&png(&PIXELS));
    let attributes = r#""POSITION": 0, "NORMAL": 1, "TANGENT": 2, "TEXCOORD_0": 3, "TEXCOORD_1": 4, "COLOR_0": 9"#;
    let rest = format!(
        r#""extensionsRequired": ["KHR_mesh_quantization"], "nodes": [{{"mesh": 0}}],
        "meshes": [{{"primitives": [{{"attributes": {{{attributes}}}, "mode": 5}},
            {{"attributes": {{{attributes}}}, "indices": 5, "material": 0}}]}}],
        "materials": [{{"normalTexture": {{"index": 0}}}}], "textures": [{{"source": 0}}],
        "images": [{{"uri": "{uri}"}}], "accessors": [
            {{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5120, "normalized": true, "count": 4, "type": "VEC3"}},
            {{"bufferView": 2, "componentType": 5122, "normalized": true, "count": 4, "type": "VEC4"}},
            {{"bufferView": 3, "componentType": 5123, "normalized": true, "count": 4, "type": "VEC2"}},
            {{"bufferView": 4, "componentType": 5121, "count": 4, "type": "VEC2"}},
            {{"bufferView": 5, "componentType": 5121, "count": 3, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}},
            {{"buffer": 0, "byteOffset": 48, "byteLength": 16, "byteStride": 4}},
            {{"buffer": 0, "byteOffset": 64, "byteLength": 32}}, {{"buffer": 0, "byteOffset": 96, "byteLength": 16}},
            {{"buffer": 0, "byteOffset": 112, "byteLength": 16, "byteStride": 4}},
            {{"buffer": 0, "byteOffset": 128, "byteLength": 3}}], "buffers": [{{"byteLength": 131}}]"#
    );
    (rest, bin)
}

#[test]
fn attributes_of_integers_follow_their_vertices() {
    let (rest, bin) = attributes();
    let scene = scene(&rest, &bin);
    let whole = &scene.meshes[0];
    assert_eq!(whole.normals.values, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]);
    assert_eq!(whole.tangents.values[1], [0.0, 1.0, 0.0, -1.0]);
    assert_eq!(whole.uvs[0].values, [[0.0, 1.0], [1.0, 0.0], [0.2, 0.0], [0.0, 0.2]]);
    assert_eq!(whole.uvs[1].values[3], [250.0, 251.0]);
    // The second primitive uses the last three vertices only, and has only those.
    let part = &scene.meshes[1];
    assert_eq!((part.positions.len(), part.triangles.as_slice()), (3, [[0, 1, 2]].as_slice()));
    assert_eq!(
        part.normals.corners(0, part.triangles[0]).unwrap(),
        [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]
    );
    assert_eq!(part.uvs[0].values, whole.uvs[0].values[1..]);
    assert_eq!(part.tangents.values, whole.tangents.values[1..]);
    // Without textures nobody asks for coordinates; normals still count.
    let plain = rest.replace(r#""normalTexture": {"index": 0}"#, "").replace(r#""textures": [{"source": 0}],"#, "");
    let plain = gltf_support::scene(&plain, &bin);
    assert_eq!((plain.meshes[0].normals.values.len(), plain.meshes[0].uvs[0].values.len()), (4, 0));
}

#[test]
fn what_is_wrong_with_looks_is_said_with_its_path() {
    let (rest, bin) = attributes();
    let uri = data_uri(&png(&PIXELS));
    for (from, to, expected) in [
        (
            r#""normalTexture": {"index": 0}"#,
            r#""normalTexture": {"index": 1}"#,
            "materials[0].normalTexture.index: names textures[1]",
        ),
        (r#"[{"source": 0}]"#, r#"[{"source": 7}]"#, "textures[0].source: names images[7], but the last one is"),
        (r#"[{"source": 0}]"#, r#"[{"source": 0, "sampler": 2}]"#, "textures[0].sampler: names samplers[2]"),
        (
            r#"[{"source": 0}]"#,
            r#"[{"source": 0, "sampler": 0}], "samplers": [{"wrapT": 5}]"#,
            "textures[0]: its sampler wraps by 5",
        ),
        (r#""images": [{"#, r#""images": [{}, {"#, "images[0]: expected a `uri` or a `bufferView`"),
        (&uri, "http://x/y.png", "images[0]: expected a relative path or a data: URI"),
        (&uri, "data:image/png;base64,iVBORw0KGgo=", "images[0]: not a readable PNG picture"),
        (&uri, "data:image/png;base64,AAAA", "images[0]: expected a PNG, JPEG"),
        (&uri, "data:image/png;base64,", "images[0]: the picture is empty"),
        (
            r#""normalTexture""#,
            r#""alphaMode": "GLASS", "normalTexture""#,
            "materials[0].alphaMode: expected OPAQUE, MASK or BLEND, found `GLASS`",
        ),
        (
            r#""normalTexture""#,
            r#""extensions": {"KHR_materials_ior": {"ior": 0.5}}, "normalTexture""#,
            "materials[0].extensions.KHR_materials_ior: ",
        ),
        (r#""NORMAL": 1"#, r#""NORMAL": 5"#, "accessors[5]: expected the type `VEC3`"),
        (r#""TANGENT": 2"#, r#""TANGENT": 1"#, "accessors[1]: expected the type `VEC4`"),
        (
            r#""componentType": 5123, "normalized": true, "count": 4"#,
            r#""componentType": 5123, "normalized": true, "count": 3"#,
            "attributes.TEXCOORD_0: expected as many as of POSITION, 4, found 3",
        ),
    ] {
        assert!(rest.contains(from), "{from}");
        let text = refusal(&rest.replacen(from, to, 1), &bin);
        assert!(text.contains(expected), "{to}: {text}");
    }
    for (light, expected) in [
        (r#"{"type": "area"}"#, "lights[0].type: expected point, spot or directional, found `area`"),
        (r#"{"type": "point", "intensity": -1}"#, "lights[0]: expected a color and an intensity of 0 or more"),
        (r#"{"type": "spot", "spot": {"innerConeAngle": 1}}"#, "lights[0].spot: expected 0 <= innerConeAngle <"),
        (r#"{"type": "spot", "spot": {"outerConeAngle": 2}}"#, "lights[0].spot: expected 0 <= innerConeAngle <"),
    ] {
        let lights = format!(r#""extensions": {{"KHR_lights_punctual": {{"lights": [{light}]}}}}"#);
        let text = refusal(&format!(r#"{lights}, "nodes": [{{{}}}]"#, light_of_node(0)), &[]);
        assert!(text.contains(expected), "{text}");
    }
    let none = refusal(&format!(r#""nodes": [{{{}}}]"#, light_of_node(0)), &[]);
    assert!(none.contains("names lights[0], but there are no lights"), "{none}");
}

#[test]
fn pictures_come_from_texts_files_and_views_alike() {
    let folder = tempfile::tempdir().unwrap();
    let picture = png(&PIXELS);
    std::fs::write(folder.path().join("four of them.png"), &picture).unwrap();
    let bin = [floats(&TRIANGLE), picture.clone()].concat();
    let look = r#""materials": [{"emissiveTexture": {"index": 0}}], "textures": [{"source": 0}]"#;
    let views = format!(
        r#""bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": {}}}],
        "buffers": [{{"byteLength": {}}}]"#,
        picture.len(),
        bin.len()
    );
    let mut hashes = Vec::new();
    for image in [r#"{"uri": "four%20of%20them.png"}"#, r#"{"bufferView": 1, "mimeType": "image/png"}"#] {
        let file = folder.path().join("t.glb");
        std::fs::write(&file, glb(&document(&format!(r#"{look}, "images": [{image}], {views}"#)), &bin)).unwrap();
        let scene = load(&file.to_string_lossy(), &LoadOptions::default()).unwrap();
        assert_eq!(scene.textures[0].texels, Texels::Srgb8(PIXELS.into()), "{image}");
        hashes.push(scene.hash);
    }
    let file = folder.path().join("t.gltf");
    let open = |uri: &str| {
        let text = document(&format!(r#"{look}, "images": [{{"uri": "{uri}"}}]"#));
        std::fs::write(&file, text).unwrap();
        load(&file.to_string_lossy(), &LoadOptions::default())
    };
    let before = open("four of them.png").unwrap().hash;
    std::fs::write(folder.path().join("four of them.png"), png(&[[0; 4]; 4])).unwrap();
    assert_ne!(open("four of them.png").unwrap().hash, before, "the picture is part of the scene");
    let missing = open("none.png").unwrap_err().to_string();
    assert!(missing.contains("t.gltf: images[0]: cannot open `none.png`"), "{missing}");
    let outside = open("../x.png").unwrap_err().to_string();
    assert!(outside.contains("`../x.png` leaves the scene's folder"), "{outside}");
    std::fs::write(folder.path().join("cut.png"), &picture[..40]).unwrap();
    let cut = open("cut.png").unwrap_err().to_string();
    assert!(cut.contains("images[0]: `cut.png`: not a readable PNG picture"), "{cut}");
}

#[test]
fn the_balloon_has_its_textures() {
    let Some(file) = shared("gltf_balloon/scene.gltf") else { return };
    let scene = load(&file.to_string_lossy(), &LoadOptions::default()).unwrap();
    assert_eq!((scene.materials.len(), scene.textures.len(), scene.warnings.as_slice()), (38, 17, &[][..]));
    let steel = scene.materials.iter().find(|m| m.name == "RedBurnerSteel").unwrap();
    assert!(
        matches!(steel.scattering, Scattering::MetallicRoughness { metallic: 0.0, roughness: 0.6, .. }),
        "{steel:?}"
    );
    let texture = &scene.textures[steel.textures.base.unwrap().texture as usize];
    let folder: &Path = file.parent().unwrap();
    let bytes = std::fs::read(folder.join("textures/RedBurnerSteel_baseColor.jpeg")).unwrap();
    assert_eq!(texture.texels, decode("x", &bytes, Curve::Srgb).unwrap().texels);
    assert!(scene.meshes.iter().all(|m| {
        let unit = |n: &[f32; 3]| (n.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-3;
        m.normals.values.len() == m.positions.len()
            && m.uvs[0].values.len() == m.positions.len()
            && m.normals.values.iter().filter(|n| unit(n)).count() * 10 > m.normals.values.len() * 9
    }));
}
