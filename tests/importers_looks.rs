//! OBJ files with material libraries and textures: opened by themselves, and through scene files.

use glam::{DVec2, DVec3};
use lanecast::scene::description::{Description, Material};
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::material::{Alpha, Scattering, TextureRef, Wrap};
use lanecast::scene::texture::Texels;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n";
const FACE: &str = "f 1/1/1 2/2/1 3/3/1 4/4/1\n";

fn png(width: u32, pixels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, pixels.len() as u32 / width);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(pixels.as_flattened()).unwrap();
    bytes
}

fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    folder
}

fn open(folder: &tempfile::TempDir, name: &str) -> lanecast::error::Result<Description> {
    load(&folder.path().join(name).to_string_lossy(), &LoadOptions::default())
}

fn named<'a>(scene: &'a Description, name: &str) -> &'a Material {
    scene.materials.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no {name}"))
}

#[test]
fn an_obj_file_brings_its_materials_and_textures() {
    let red_green = png(2, &[[255, 0, 0, 255], [0, 255, 0, 255]]);
    let leaf = png(1, &[[9, 9, 9, 255], [9, 9, 9, 0]]);
    let bumps = png(2, &[[0, 0, 0, 255], [255, 255, 255, 255]]);
    let obj = format!(
        "mtllib a.mtl sub/b.mtl\n{SQUARE}usemtl floor\n{FACE}usemtl leaf\n{FACE}usemtl nowhere\n{FACE}\
         usemtl lamp\n{FACE}"
    );
    let folder = folder(&[
        ("m.obj", obj.as_bytes()),
        (
            "a.mtl",
            b"newmtl floor\nKd 0.5 0.25 1\nmap_Kd -s 2 3 -o 0.5 0.25 -clamp on maps\\tiles.png\n\
                    bump -bm 25 bumps.png\nnewmtl unused\nmap_Kd none.png\n",
        ),
        ("sub/b.mtl", b"newmtl leaf\nmap_d leaf.png\nKs 1\nnewmtl floor\nKd 0\nnewmtl lamp\nKe 5 4 3\nPr 0.5\n"),
        ("maps/tiles.png", &red_green),
        ("leaf.png", &leaf),
        ("bumps.png", &bumps),
    ]);
    let scene = open(&folder, "m.obj").unwrap();
    assert_eq!(scene.warnings, ["m.obj: no library has the materials `nowhere`; done with the default one"]);
    let floor = named(&scene, "floor");
    assert_eq!(floor.diffuse, DVec3::new(0.5, 0.25, 1.0), "the first definition counts");
    let base = floor.textures.base.unwrap();
    assert_eq!(base.wrap, [Wrap::Clamp; 2]);
    // 2 u + 0.5 to the right; 3 v + 0.25 upwards from the lower edge, which is 1 in the picture.
    for (uv, wanted) in [([0.0, 0.0], [0.5, 0.75]), ([1.0, 1.0], [2.5, -2.25])] {
        let of_mesh = DVec2::new(uv[0], 1.0 - uv[1]);
        assert_eq!(base.transform.transform_point2(of_mesh), DVec2::from(wanted));
    }
    let texture = |used: Option<TextureRef>| &scene.textures[used.unwrap().texture as usize];
    assert_eq!(texture(floor.textures.base).texels, Texels::Srgb8(vec![[255, 0, 0, 255], [0, 255, 0, 255]]));
    let leaf = named(&scene, "leaf");
    assert_eq!((leaf.alpha, leaf.opacity), (Alpha::Blend, 1.0));
    assert_eq!(texture(leaf.textures.opacity).texels, Texels::Linear8(vec![[255; 4], [0, 0, 0, 255]]), "alpha counts");
    assert!(matches!(leaf.scattering, Scattering::Plastic { ior: 1.5, .. }));
    let Texels::Linear8(normals) = &texture(floor.textures.normal).texels else { panic!("not numbers") };
    assert!(normals.iter().all(|n| n[2] > 200) && floor.textures.normal_scale == 1.0, "{normals:?}");
    let lamp = named(&scene, "lamp");
    assert_eq!((lamp.emission, named(&scene, "nowhere").diffuse), (DVec3::new(5.0, 4.0, 3.0), DVec3::splat(0.7)));
    assert!(scene.materials.iter().all(|m| m.name != "unused"));
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.triangles.len(), mesh.uvs[0].values.len(), mesh.normals.values.len()), (8, 4, 1));
    assert_eq!((mesh.uvs[0].indices.len(), mesh.normals.indices.len()), (0, 8));
}

/// Pictures of roughness and metal, each of its own: the one goes where glTF has it, and says nothing of metal.
#[test]
fn roughness_and_metal_have_pictures() {
    let grey = png(2, &[[64, 64, 64, 255], [255, 255, 255, 255]]);
    let obj = format!("mtllib a.mtl\n{SQUARE}usemtl a\n{FACE}usemtl b\n{FACE}usemtl c\n{FACE}");
    let library = "newmtl a\nmap_Pr -s 2 g.png\nmap_Pm g.png\nnewmtl b\nPr 0.5\nPm 0\nmap_Pm g.png\n\
                   newmtl c\nPr 0.5\nmap_Pr g.png\n";
    let folder = folder(&[("m.obj", obj.as_bytes()), ("a.mtl", library.as_bytes()), ("g.png", &grey)]);
    let scene = open(&folder, "m.obj").unwrap();
    assert_eq!(scene.warnings, [""; 0]);
    let of = |name: &str| {
        let material = named(&scene, name);
        let Scattering::MetallicRoughness { metallic, roughness, .. } = material.scattering else { panic!("{name}") };
        ([roughness, metallic], &material.textures)
    };
    let texels = |used: Option<TextureRef>| &scene.textures[used.unwrap().texture as usize].texels;
    let (numbers, textures) = of("a");
    assert_eq!(numbers, [1.0, 1.0], "a map alone is meant as it is");
    assert_eq!(texels(textures.metallic_roughness), &Texels::Linear8(vec![[255, 64, 255, 255], [255; 4]]));
    assert_eq!(texels(textures.metallic), &Texels::Linear8(vec![[64, 64, 64, 255], [255; 4]]));
    assert_eq!(textures.metallic_roughness.unwrap().transform.matrix2.x_axis.x, 2.0);
    let (numbers, textures) = of("b");
    assert_eq!((numbers, textures.metallic_roughness), ([0.5, 1.0], None), "a factor of zero would hide the map");
    let (numbers, textures) = of("c");
    assert_eq!((numbers, textures.metallic), ([0.5, 0.0], None));
}

#[test]
fn what_is_missing_is_a_warning_and_what_is_damaged_an_error() {
    let obj =
        format!("mtllib a.mtl gone.mtl ../up.mtl\n{SQUARE}usemtl m\n{FACE}f 1/9 2/1 3/1\ns 1\nl 1 2\nsurf 0 1\nend");
    let library = |maps: &str| format!("newmtl m\nKa 1 1 1\nKd 0.5 0.5 0.5\n{maps}");
    let with = |maps: &str, name: &str, content: &[u8]| {
        folder(&[("m.obj", obj.as_bytes()), ("a.mtl", library(maps).as_bytes()), (name, content)])
    };
    let scene = open(&with("map_Kd gone.png\nmap_Ke text.png\nmap_d ../x.png", "text.png", b"TGA?"), "m.obj").unwrap();
    assert_eq!((named(&scene, "m").diffuse, scene.textures.len()), (DVec3::splat(0.5), 0));
    assert_eq!(named(&scene, "m").emission, DVec3::ZERO, "a picture that is missing does not shine");
    let all = scene.warnings.join("\n");
    for what in [
        "m.obj: cannot open `gone.mtl`",
        "m.obj: `../up.mtl` leaves the scene's folder",
        "m.obj: cannot open `gone.png`",
        "m.obj: `text.png` is not a PNG, JPEG, Radiance HDR or EXR picture; done without",
        "m.obj: `../x.png` leaves the scene's folder; done without",
        "m.obj: 2 statements of the file are not read, the first is `surf` (line 16)",
        "m.obj: 1 corners name texture coordinates or normals that are not there",
        "m.obj: 1 statements or options of material libraries are not read",
    ] {
        assert!(all.contains(what), "{what}: {all}");
    }
    let cut = &png(2, &[[0; 4]; 4])[..45];
    let error = open(&with("map_Kd cut.png", "cut.png", cut), "m.obj").unwrap_err().to_string();
    assert!(error.contains("cut.png: not a readable PNG picture"), "{error}");
    let error = open(&with("Kd 1 2", "x", b""), "m.obj").unwrap_err().to_string();
    assert!(error.contains("a.mtl:4:7: expected one number or three, found 2"), "{error}");
}

#[test]
fn scene_files_take_over_materials_and_have_the_last_word() {
    let picture = png(1, &[[255, 0, 0, 255]]);
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl red\n{FACE}usemtl blue\n{FACE}");
    let folder = folder(&[
        ("s.kdl", b"mesh \"one/m.obj\"\nmesh \"two/m.obj\" { translate 2 0 0 }\nmaterial \"blue\" { diffuse 0 0 0.5 }"),
        ("one/m.obj", obj.as_bytes()),
        ("one/m.mtl", b"newmtl red\nKd 1 0 0\nmap_Kd ../red.png\nnewmtl blue\nKd 1 1 1\n"),
        ("two/m.obj", obj.as_bytes()),
        ("two/m.mtl", b"newmtl red\nKd 0.5 0 0\n"),
        ("red.png", &picture),
    ]);
    let scene = open(&folder, "s.kdl").unwrap();
    assert_eq!(named(&scene, "blue").diffuse, DVec3::new(0.0, 0.0, 0.5));
    assert_eq!(named(&scene, "red").diffuse, DVec3::X);
    assert!(named(&scene, "red").textures.base.is_some() && scene.textures.len() == 1, "{:?}", scene.warnings);
    let other = named(&scene, "red (m.obj)");
    assert_eq!((other.diffuse, other.textures.base), (DVec3::new(0.5, 0.0, 0.0), None));
    let names = |i: usize| scene.meshes[i].groups.iter().map(|g| g.material.clone()).collect::<Vec<_>>();
    assert_eq!((names(0), names(1)), (vec!["red".into(), "blue".into()], vec!["red (m.obj)".into(), "blue".into()]));
    let before = scene.hash;
    std::fs::write(folder.path().join("red.png"), png(1, &[[0; 4]])).unwrap();
    assert_ne!(open(&folder, "s.kdl").unwrap().hash, before, "pictures are part of the scene");
    // Opened by itself, the file's folder is the scene's.
    let alone = open(&folder, "one/m.obj").unwrap();
    assert!(alone.warnings.join("\n").contains("`../red.png` leaves the scene's folder"), "{:?}", alone.warnings);
}

#[test]
fn materials_that_nobody_has_are_named() {
    let uses: String = (0..12).map(|i| format!("usemtl m{}\n{FACE}", i % 11)).collect();
    let obj = format!("mtllib m.mtl\n{SQUARE}{FACE}{uses}");
    let scene_file = b"mesh \"m.obj\"\nmaterial \"m1\" { diffuse 0 0 0.5 }";
    let files = [("s.kdl", &scene_file[..]), ("m.obj", obj.as_bytes()), ("m.mtl", b"newmtl m3\n"), ("n.obj", b"")];
    let folder = folder(&files);
    let scene = open(&folder, "s.kdl").unwrap();
    let names = "`m0`, `m2`, `m4`, `m5`, `m6`, `m7`, `m8`, `m9` and 1 others";
    let expected = format!("m.obj: no library has the materials {names}; done with the default one");
    assert_eq!(scene.warnings, [expected], "m1 is the scene's own, m3 the library's");
    std::fs::write(folder.path().join("s.kdl"), "material \"a\" { diffuse 1 0 0 }\nmesh \"m.obj\" material=\"a\"")
        .unwrap();
    assert_eq!(open(&folder, "s.kdl").unwrap().warnings, [""; 0], "names do not matter");
    // Who names no library wants none.
    std::fs::write(folder.path().join("n.obj"), obj.replace("mtllib m.mtl\n", "")).unwrap();
    assert_eq!(open(&folder, "n.obj").unwrap().warnings, [""; 0]);
}

#[test]
fn colours_of_vertices_are_said_not_to_be_read() {
    let corners = ["0 0 0", "1 0 0", "0 1 0"];
    let [plain, coloured] =
        ["", " 1 0.5 0"].map(|colour| corners.map(|c| format!("v {c}{colour}\n")).concat() + "f 1 2 3\n");
    let ply = |names: [&str; 3]| {
        let colours = names.map(|name| format!("property uchar {name}\n")).concat();
        let rows = corners.map(|c| format!("{c} 255 0 9\n")).concat();
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{colours}\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n{rows}3 0 1 2\n"
        )
    };
    let (red, other) = (ply(["red", "green", "blue"]), ply(["a", "b", "c"]));
    let files = [("a.obj", &plain), ("b.obj", &coloured), ("a.ply", &other), ("b.ply", &red)];
    let folder = folder(&files.map(|(name, text)| (name, text.as_bytes())));
    for name in ["a.obj", "a.ply"] {
        assert_eq!(open(&folder, name).unwrap().warnings, [""; 0], "{name}");
    }
    for name in ["b.obj", "b.ply"] {
        let scene = open(&folder, name).unwrap();
        assert_eq!(scene.warnings, [format!("{name}: the colours of vertices are not read")]);
        assert_eq!(scene.meshes[0].triangles, [[0, 1, 2]]);
    }
}

#[test]
fn libraries_that_are_no_files_or_too_large() {
    let obj = format!("mtllib sub large.mtl\n{SQUARE}usemtl m\n{FACE}");
    let one = folder(&[("m.obj", obj.replace(" large.mtl", "").as_bytes()), ("sub/x", b"")]);
    assert!(open(&one, "m.obj").unwrap().warnings[0].contains("`sub` is not a file"));
    let large = folder(&[("m.obj", obj.as_bytes()), ("sub large.mtl", &vec![b'#'; (8 << 20) + 1])]);
    let error = open(&large, "m.obj").unwrap_err().to_string();
    assert!(error.ends_with("sub large.mtl: larger than 8 MiB, the limit for material libraries"), "{error}");
}

#[test]
fn info_counts_what_shines_and_what_is_painted() {
    let picture = png(2, &[[255; 4]; 4]);
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl red\n{FACE}");
    let folder = folder(&[
        ("s.kdl", b"mesh \"m.obj\"\nlight sun direction=\"0, -1, 0\"\nenvironment sky\nmaterial \"l\" emission=3\nbox"),
        ("m.obj", obj.as_bytes()),
        ("m.mtl", b"newmtl red\nmap_Kd red.png\n"),
        ("red.png", &picture),
    ]);
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .args(["info", "--json"])
        .arg(folder.path().join("s.kdl"))
        .output()
        .unwrap();
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let count = |name: &str| report["counts"][name].as_u64().unwrap();
    assert_eq!((count("textures"), count("texture_bytes")), (2, 16 + 256 * 128 * 16), "the sky is one");
    assert_eq!((count("lights"), count("emissive_materials"), count("materials")), (1, 1, 3));
    assert_eq!((count("meshes"), count("meshes_with_normals"), count("meshes_with_coordinates")), (1, 1, 1));
    assert_eq!(report["counts"]["environment"], true);
}
