//! Damaged and malicious glTF documents: an error that says where, or a valid scene, in bounded time and memory.

mod common;
mod gltf_support;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use common::Random;
use gltf_support::{ONE_MESH, TRIANGLE, document, floats, glb, parse, refusal, scene};
use lanecast::error::{Error, Place};
use lanecast::scene::assembly::Assembly;
use lanecast::scene::load::{LoadOptions, load};

/// A part of a good document, what stands there instead, a phrase of the error.
const EDITS: &[(&str, &str, &str)] = &[
    // Indices that name nothing.
    (r#""mesh": 0"#, r#""mesh": 1"#, "nodes[1].mesh: names meshes[1], but the last one is meshes[0]"),
    (r#""camera": 0"#, r#""camera": 7"#, "nodes[1].camera: names cameras[7]"),
    (r#""children": [1]"#, r#""children": [2]"#, "nodes[0].children[0]: names nodes[2]"),
    (r#""nodes": [0]"#, r#""nodes": [9]"#, "scenes[0].nodes[0]: names nodes[9]"),
    (r#""scene": 0"#, r#""scene": 1"#, "scene: names scenes[1]"),
    (r#""POSITION": 0"#, r#""POSITION": 5"#, "meshes[0].primitives[0].attributes.POSITION: names accessors[5]"),
    (r#""indices": 1"#, r#""indices": 4000000000"#, "meshes[0].primitives[0].indices: names accessors[4000000000]"),
    (r#""material": 0"#, r#""material": 3"#, "meshes[0].primitives[0].material: names materials[3]"),
    (r#""bufferView": 0"#, r#""bufferView": 2"#, "accessors[0].bufferView: names bufferViews[2]"),
    (r#""buffer": 0, "byteLength": 36"#, r#""buffer": 1, "byteLength": 36"#, "bufferViews[0].buffer: names buffers[1]"),
    (r#""POSITION": 0"#, r#""POSITION": -1"#, "invalid value: integer `-1`"),
    (r#""POSITION": 0"#, r#""POSITION": 0.5"#, "invalid type: floating point `0.5`"),
    // Ranges.
    (r#""count": 3, "type": "VEC3""#, r#""count": 4, "type": "VEC3""#, "accessors[0]: 4 elements need 48 bytes"),
    (r#""count": 3, "type": "VEC3""#, r#""count": 4294967295, "type": "VEC3""#, "accessors[0]: count 4294967295"),
    (r#""count": 3, "type": "VEC3""#, r#""count": 18446744073709551615, "type": "VEC3""#, "is too large"),
    (r#""byteLength": 36"#, r#""byteLength": 43"#, "bufferViews[0]: expected 43 bytes from byte 0 on"),
    (r#""byteLength": 36"#, r#""byteLength": 36, "byteOffset": 18446744073709551615"#, "bufferViews[0]: expected 36"),
    (r#""byteLength": 36"#, r#""byteLength": 36, "byteStride": 4294967295"#, "accessors[0]: 3 elements need"),
    (r#""byteLength": 36"#, r#""byteLength": 36, "byteStride": 8"#, "byteStride 8 is less than the 12 bytes"),
    (
        r#""buffers": [{"byteLength": 42"#,
        r#""buffers": [{"byteLength": 1000"#,
        "buffers[0]: byteLength says 1000 bytes",
    ),
    (r#""count": 3, "type": "SCALAR""#, r#""count": 4, "type": "SCALAR""#, "accessors[1]: 4 elements need 8 bytes"),
    // Types and values.
    (r#""VEC3""#, r#""VEC2""#, "accessors[0]: expected the type `VEC3` here, found `VEC2`"),
    ("5126", "5125", "accessors[0]: expected componentType FLOAT or BYTE"),
    ("5123", "5126", "accessors[1]: expected componentType UNSIGNED_BYTE or UNSIGNED_SHORT or UNSIGNED_INT"),
    ("5123", "77", "found 77"),
    (r#""mode": 4"#, r#""mode": 7"#, "expected a mode from 0 to 6, found 7"),
    (r#""yfov": 1"#, r#""yfov": 4"#, "cameras[0].perspective.yfov: expected an angle"),
    (r#""yfov": 1"#, r#""yfov": 1e999"#, "number out of range"),
    (r#""children": [1]"#, r#""matrix": [1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]"#, "nodes[0].matrix: expected an affine map"),
    (r#""children": [1]"#, r#""matrix": [1,2,3]"#, "invalid length 3"),
    // Trees.
    (r#""mesh": 0"#, r#""children": [1], "mesh": 0"#, "nodes[1] is also below nodes[0]; a node has one parent"),
    (r#""mesh": 0"#, r#""children": [0], "mesh": 0"#, "is below itself"),
    (r#""children": [1]"#, r#""children": [1, 1]"#, "nodes[0].children[1]: nodes[1] is also below nodes[0]"),
    (r#""nodes": [0]"#, r#""nodes": [0, 0]"#, "nodes[0]: is placed twice"),
    (r#""nodes": [0]"#, r#""nodes": [0, 1]"#, "nodes[1]: is placed twice"),
    // Versions, extensions, text.
    (r#""2.0""#, r#""1.0""#, "asset.version: expected glTF 2.0, found `1.0`"),
    (r#""scene": 0"#, r#""extensionsRequired": ["KHR_draco_mesh_compression"]"#, "`KHR_draco_mesh_compression` is not"),
    (r#""scene": 0"#, r#""extensionsRequired": ["EXT_meshopt_compression"]"#, "write the file again without"),
    (r#""scene": 0"#, r#""extensionsRequired": ["KHR_texture_transform", "X_y"]"#, "extensionsRequired[1]"),
    (r#""scene": 0"#, r#""extensionsRequired": ["KHR_texture_basisu"]"#, "`KHR_texture_basisu` is not supported"),
    (r#""scene": 0"#, r#""extensionsRequired": ["EXT_texture_webp"]"#, "with its pictures as PNG or JPEG"),
    (r#""scene": 0"#, r#""scene": "#, "byte "),
    (r#""scene": 0"#, r#""scene": 0, "scene": 0"#, "duplicate field `scene`"),
];

const GOOD: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}], "materials": [{}],
    "nodes": [{"children": [1]}, {"mesh": 0, "camera": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0, "mode": 4}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
    "buffers": [{"byteLength": 42}]}"#;

fn good_bin() -> Vec<u8> {
    [floats(&TRIANGLE), [0_u16, 1, 2].iter().flat_map(|x| x.to_le_bytes()).collect()].concat()
}

#[test]
fn errors_say_where_and_what() {
    let good = parse(&glb(GOOD, &good_bin())).unwrap();
    assert_eq!((good.meshes.len(), good.warnings.len()), (1, 0));
    for (old, new, expected) in EDITS {
        assert_eq!(GOOD.matches(old).count().min(1), 1, "{old} is not in the document");
        let json = GOOD.replacen(old, new, 1);
        let error = parse(&glb(&json, &good_bin())).map(drop).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(expected) && text.starts_with("t.gltf: ") && text.len() < 500, "{new}: {text}");
        assert_eq!(error.exit_code(), 2);
    }
    let mut bin = good_bin();
    bin[38] = 3;
    let error = parse(&glb(GOOD, &bin)).unwrap_err().to_string();
    assert!(error.contains("primitives[0].indices: index 3 (number 1) names no vertex: there are 3"), "{error}");
}

#[test]
fn text_errors_have_line_and_column() {
    for (text, line, column, what) in [
        ("", 1, 1, "EOF"),
        ("{\n  \"asset\": 5}", 2, 12, "invalid type"),
        ("{\"asset\": {\"version\": \"2.0\"},\n \"é\": 1, \"nodes\": 3}", 2, 19, "expected a sequence"),
        ("{\"asset\": {\"version\": \"2.0\"}", 1, 28, "EOF"),
        ("glTE", 1, 1, "expected value"),
    ] {
        let error = parse(text.as_bytes()).unwrap_err();
        let Error::Input(input) = &error else { panic!("{error}") };
        assert!(input.what.contains(what), "{error}");
        assert_eq!(input.place, Place::LineColumn { line, column }, "{error}");
    }
    let long = format!("{{\"asset\": \"{}\"}}", "x".repeat(100_000));
    assert!(parse(long.as_bytes()).unwrap_err().to_string().len() < 500);
    let (open, close) = ("[".repeat(1_000_000), "]".repeat(1_000_000));
    for deep in [open.clone(), document(&format!("\"extras\": {open}")), document(&format!("\"nodes\": {open}{close}"))]
    {
        assert!(parse(deep.as_bytes()).is_err());
    }
    // What is passed over may nest as it likes.
    assert!(parse(document(&format!("\"extras\": {open}{close}")).as_bytes()).is_ok());
}

#[test]
fn binary_containers_that_lie() {
    let good = glb(GOOD, &good_bin());
    let with = |at: usize, bytes: &[u8]| {
        let mut file = good.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        parse(&file).unwrap_err().to_string()
    };
    assert!(with(4, &[1]).starts_with("t.gltf: byte 4: expected version 2"));
    assert!(with(8, &[0xff; 4]).starts_with("t.gltf: byte 8: the header says 4294967295 bytes"));
    assert!(with(12, &[0xff; 4]).starts_with("t.gltf: byte 12: the chunk says 4294967295 bytes"));
    assert!(with(16, b"BIN\0").starts_with("t.gltf: byte 12: expected a first chunk of type JSON"));
    assert!(with(20, b"[").starts_with("t.gltf: byte 2"));
    for length in 0..good.len() {
        assert!(parse(&good[..length]).is_err(), "{length}");
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("text.glb");
    std::fs::write(&file, GOOD).unwrap();
    let error = load(&file.to_string_lossy(), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("text.glb: byte 0: expected `glTF`"), "{error}");
}

/// `count` primitives whose attributes are `attributes`.
fn primitives(count: usize, attributes: &str) -> String {
    let all = vec![format!("{{\"attributes\": {{\"POSITION\": 0}}{attributes}}}"); count].join(",");
    format!("\"nodes\": [{{\"mesh\": 0}}], \"meshes\": [{{\"primitives\": [{all}]}}]")
}

#[test]
fn counts_without_bytes_are_bounded() {
    let zeros = |count: u64| format!("{{\"componentType\": 5126, \"count\": {count}, \"type\": \"VEC3\"}}");
    let rest = format!("{}, \"accessors\": [{}]", primitives(1, ""), zeros(4_000_000_000));
    assert!(refusal(&rest, &[]).contains("primitives[0].indices: decodes to more than 64 bytes per byte"));
    // Instances without bytes.
    let rest = format!(
        "\"nodes\": [{{\"mesh\": 0, \"extensions\": {{\"EXT_mesh_gpu_instancing\": {{\"attributes\": \
         {{\"SCALE\": 1, \"TRANSLATION\": 1}}}}}}}}], \"meshes\": [{{\"primitives\": []}}], \
         \"accessors\": [{0}, {0}]",
        zeros(4_000_000_000)
    );
    assert!(refusal(&rest, &[]).contains("EXT_mesh_gpu_instancing.attributes: decodes to more than 64 bytes"));
    // Sparse ones must at least have their indices.
    let sparse = "\"componentType\": 5126, \"count\": 9, \"type\": \"VEC3\", \"sparse\": {\"count\": 4000000000, \
                  \"indices\": {\"bufferView\": 0, \"componentType\": 5121}, \"values\": {\"bufferView\": 0}}";
    let rest = format!("{}, \"accessors\": [{{{sparse}}}]", primitives(1, ""));
    assert!(refusal(&rest, &[]).contains("accessors[0].sparse: count 4000000000 is more than the accessor's 9"));
}

#[test]
fn data_named_very_often_is_stored_once_or_refused() {
    const VERTICES: usize = 100_000;
    let length = 12 * VERTICES;
    let tail = |indices: &str| {
        format!(
            "\"accessors\": [{{\"bufferView\": 0, \"componentType\": 5126, \"count\": {VERTICES}, \"type\": \"VEC3\"}}\
             {indices}], \"bufferViews\": [{{\"buffer\": 0, \"byteLength\": {length}}}], \
             \"buffers\": [{{\"byteLength\": {length}}}]"
        )
    };
    let bin = vec![0; length];
    let start = Instant::now();
    // The same primitive: one mesh.
    let same = scene(&format!("{}, {}", primitives(2000, ""), tail("")), &bin);
    assert_eq!((same.meshes.len(), same.groups[1].items.len()), (1, 2000));
    // Few vertices each of very many: each mesh has its own ones.
    let many = |count: usize, indices: usize| {
        let all: String =
            (1..=count).map(|i| format!(",{{\"attributes\": {{\"POSITION\": 0}}, \"indices\": {i}}}")).collect();
        let accessor =
            format!(",{{\"bufferView\": 0, \"componentType\": 5121, \"count\": {indices}, \"type\": \"SCALAR\"}}");
        format!(
            "\"nodes\": [{{\"mesh\": 0}}], \"meshes\": [{{\"primitives\": [{}]}}], {}",
            &all[1..],
            tail(&accessor.repeat(count))
        )
    };
    let few = scene(&many(20_000, 3), &bin);
    assert!(few.meshes.len() == 20_000 && few.meshes.iter().all(|mesh| mesh.positions.len() == 1));
    // All bytes again and again.
    let error = refusal(&many(2000, length), &bin);
    assert!(error.contains("decodes to more than 64 bytes per byte of the files"), "{error}");
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
}

#[test]
fn references_stay_in_the_folder() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("scene");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(parent.path().join("secret.bin"), floats(&TRIANGLE)).unwrap();
    std::fs::write(folder.join("short.bin"), [0; 35]).unwrap();
    let file = folder.join("a.gltf");
    let open = |uri: &str, allow_outside: bool| {
        let nodes = r#""nodes": [{"mesh": 0}], "#.to_owned() + ONE_MESH;
        let with_uri = nodes.replace(r#""buffers": [{"#, &format!(r#""buffers": [{{"uri": "{uri}","#));
        std::fs::write(&file, document(&with_uri)).unwrap();
        let options = LoadOptions { allow_outside, ..Default::default() };
        load(&file.to_string_lossy(), &options).map(drop).map_err(|e| e.to_string())
    };
    let absolute = parent.path().join("secret.bin").to_string_lossy().into_owned();
    let mut outside =
        vec!["../secret.bin".to_owned(), "%2e%2E/secret.bin".into(), "x/../../secret.bin".into(), absolute];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.bin", folder.join("link.bin")).unwrap();
        outside.push("link.bin".into());
    }
    for uri in &outside {
        let error = open(uri, false).unwrap_err();
        assert!(
            error.contains("a.gltf: buffers[0]: ") && error.contains("leaves the scene's folder"),
            "{uri}: {error}"
        );
    }
    open("../secret.bin", true).unwrap();
    for (uri, expected) in [
        ("http://a/b.bin", "expected a relative path or a data: URI"),
        ("file:///etc/passwd", "expected a relative path or a data: URI"),
        ("c:\\\\x.bin", "expected a relative path or a data: URI"),
        ("data:text/plain,abc", "expected `;base64,`"),
        ("data:;base64,AAA*", "character 4"),
        ("data:;base64,AAAA", "byteLength says 36 bytes, but there are 3"),
        ("none.bin", "cannot open `none.bin`"),
        ("short.bin", "byteLength says 36 bytes, but there are 35"),
        (".", "not a file"),
        ("%00", "expected the name of a file"),
        ("", "expected the name of a file"),
        ("a%2", "two hexadecimal digits"),
    ] {
        let error = open(uri, false).unwrap_err();
        assert!(error.contains("a.gltf: buffers[0]: ") && error.contains(expected), "{uri}: {error}");
    }
    assert!(parse(document(&(r#""nodes": [{"mesh": 0}], "#.to_owned() + ONE_MESH)).as_bytes()).is_err(), "no chunk");
}

fn seeds() -> Vec<Vec<u8>> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/gltf");
    let Ok(entries) = std::fs::read_dir(corpus) else {
        println!("SKIPPED: no fuzz corpus for gltf (packaged sources leave it out)");
        return Vec::new();
    };
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Pieces that mean something to the importer.
const TOKENS: [&str; 14] = [
    "0",
    "1",
    "-1",
    "4294967295",
    "1e30",
    "null",
    "[]",
    "{}",
    "5120",
    "5126",
    "\"VEC3\"",
    "\"sparse\":",
    "\"nodes\":",
    "[0,0,",
];

#[test]
fn mutations_never_panic() {
    let seeds = seeds();
    let mut random = Random(2026);
    let mut read = 0;
    let rounds = if seeds.is_empty() { 0 } else { 60_000 };
    for i in 0..rounds {
        let mut bytes = seeds[i % seeds.len()].clone();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len() + 1);
            let end = (at + random.below(12)).min(bytes.len());
            match random.below(5) {
                0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
                // Numbers are what decides: change a digit into another.
                1 | 2 => {
                    if let Some(digit) = bytes[at..].iter_mut().find(|b| b.is_ascii_digit()) {
                        *digit = b'0' + random.below(10) as u8;
                    }
                }
                3 => drop(bytes.splice(at..end, TOKENS[random.below(TOKENS.len())].bytes())),
                _ => bytes.truncate(at),
            }
        }
        let start = Instant::now();
        match parse(&bytes) {
            Ok(scene) => {
                for mesh in &scene.meshes {
                    assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()));
                }
                Assembly::new(&scene).unwrap();
                read += 1;
            }
            Err(error) => assert!(error.to_string().len() < 1000, "a long message"),
        }
        assert!(start.elapsed() < Duration::from_secs(10));
    }
    println!("gltf: {read} of {rounds} mutated files were read");
    assert!(rounds == 0 || (read > rounds / 100 && read < rounds - rounds / 100), "{read}");
}
