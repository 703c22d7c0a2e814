//! Cryptomattes read back from their file by code of this test alone: attributes, hash and ranks.

use std::collections::BTreeMap;
use std::path::Path;

use lanecast::camera::Camera;
use lanecast::error::Error;
use lanecast::film::Film;
use lanecast::film::exr::{self, Compression, ImageInfo};
use lanecast::render::{Aov, RenderOptions, Silent, render};
use lanecast::scene::kdl::{meshes::MeshFiles, parse};
use lanecast::scene::world::{Preset, World};
use lanecast::shade::Integrator;

const SCENE: &str = r#"
    camera "main" { eye 0 0 8; look-at 0 0 0; fov 40 }
    material "red \"é\"" { diffuse 0.8 0.1 0.1 }
    material "blue" { diffuse 0.1 0.1 0.8; plastic roughness=0.3 }
    background 1
    ambient 0
    define "ball" { sphere radius=0.7 material="red \"é\"" }
    instance "ball" { translate -1.2 0 0 }
    instance "ball" { translate 0 0.5 -1 }
    box size=1.3 material="blue" { translate 1.1 0.4 -0.5 }
    union "lens" { sphere radius=0.5; sphere radius=0.5 { translate 0 -0.5 0 } }
"#;

/// MurmurHash3_x86_32 with seed 0, written from its description for 32-bit words at a time.
fn hash(name: &str) -> u32 {
    let bytes = name.as_bytes();
    let mut padded = bytes.to_vec();
    padded.resize(bytes.len().div_ceil(4) * 4, 0);
    let mut h = 0u64;
    let low = |x: u64| x & 0xffff_ffff;
    let turn = |x: u64, n: u32| low(x << n) | x >> (32 - n);
    for (i, word) in padded.chunks(4).enumerate() {
        let k = word.iter().rev().fold(0u64, |k, &b| k << 8 | u64::from(b));
        h ^= low(turn(low(k * 0xcc9e2d51), 15) * 0x1b873593);
        if 4 * i + 4 <= bytes.len() {
            h = low(turn(h, 13) * 5 + 0xe6546b64);
        }
    }
    h ^= bytes.len() as u64;
    for (shift, factor) in [(16, 0x85ebca6b), (13, 0xc2b2ae35)] {
        h = low((h ^ h >> shift) * factor);
    }
    let h = (h ^ h >> 16) as u32;
    let exponent = h >> 23 & 255;
    if exponent == 0 || exponent == 255 { h ^ (1 << 23) } else { h }
}

/// The attributes of type `string` of an EXR file.
fn strings(bytes: &[u8]) -> BTreeMap<String, String> {
    let (mut at, mut found) = (8, BTreeMap::new());
    let text = |at: &mut usize| {
        let end = bytes[*at..].iter().position(|&b| b == 0).unwrap();
        let s = String::from_utf8(bytes[*at..*at + end].to_vec()).unwrap();
        *at += end + 1;
        s
    };
    while bytes[at] != 0 {
        let (name, kind) = (text(&mut at), text(&mut at));
        let size = u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        at += 4;
        if kind == "string" {
            found.insert(name, String::from_utf8(bytes[at..at + size].to_vec()).unwrap());
        }
        at += size;
    }
    found
}

/// Names and ids of the layer called `layer`.
fn manifest(attributes: &BTreeMap<String, String>, layer: &str) -> BTreeMap<String, u32> {
    let entry = |field: &str| {
        let is_of = |key: &&String| attributes[*key] == layer && key.ends_with("/name");
        let key = attributes.keys().find(is_of).expect("the layer is there");
        attributes[&key.replace("/name", field)].clone()
    };
    assert_eq!((entry("/hash").as_str(), entry("/conversion").as_str()), ("MurmurHash3_32", "uint32_to_float32"));
    let json: BTreeMap<String, String> = serde_json::from_str(&entry("/manifest")).unwrap();
    json.into_iter().map(|(name, hex)| (name, u32::from_str_radix(&hex, 16).unwrap())).collect()
}

/// Of each pixel: id and coverage, rank by rank.
fn ranks(film: &Film, layer: &str) -> Vec<Vec<(u32, f64)>> {
    let plane = |rank: usize, part: usize| {
        let channel = ["R", "G", "B", "A"][rank % 2 * 2 + part];
        film.f32_plane(&format!("{layer}{:02}.{channel}", rank / 2)).unwrap()
    };
    (0..film.pixels())
        .map(|i| (0..6).map(|rank| (plane(rank, 0)[i].to_bits(), f64::from(plane(rank, 1)[i]))).collect())
        .collect()
}

fn picture(integrator: Integrator, threads: usize) -> Film {
    let read = |path: &Path| Err(Error::whole(path, "no meshes here"));
    let files = MeshFiles { folder: None, allow_outside: false, found: None, read: &read };
    let d = parse(Path::new("t.kdl"), "t", SCENE.as_bytes(), &[], &files).unwrap();
    let world = World::<f32>::compile(&d, Preset::Balanced).unwrap();
    let camera = Camera::new(&d.cameras[0], 1.5).unwrap();
    let aovs = vec![Aov::Instance, Aov::Material, Aov::Cryptomatte];
    let options =
        RenderOptions { width: 48, height: 32, tile: 8, spp: 24, integrator, aovs, ..RenderOptions::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| render(&world, &d, &camera, &options, &Silent)).unwrap().film
}

#[test]
fn files_say_what_covers_each_pixel() {
    for integrator in [Integrator::Path, Integrator::Whitted] {
        let film = picture(integrator, 2);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.exr");
        exr::write(&file, &film, &ImageInfo::default(), Compression::Zip).unwrap();
        let attributes = strings(&std::fs::read(&file).unwrap());
        let read = exr::read(&file).unwrap();
        for (layer, count) in [("cryptoObject", 4), ("cryptoMaterial", 3)] {
            let names = manifest(&attributes, layer);
            assert_eq!(names.len(), count, "{names:?}");
            assert!(names.iter().all(|(name, &id)| hash(name) == id && f32::from_bits(id).is_normal()));
            let mut seen = BTreeMap::new();
            let alpha = film.f32_plane("A").unwrap();
            let hit = film.u32_plane("id.instance").unwrap();
            for (i, ranks) in ranks(&read, layer).iter().enumerate() {
                let sum: f64 = ranks.iter().map(|rank| rank.1).sum();
                assert!(ranks.windows(2).all(|pair| pair[0].1 >= pair[1].1), "most first");
                assert!(ranks.iter().all(|&(id, share)| (share == 0.0) == (id == 0)));
                assert_eq!(sum > 0.0, hit[i] != u32::MAX);
                // The background shines: alpha is 1 there, coverage 0. Within the objects nothing is missing.
                assert!(sum <= f64::from(alpha[i]) + 1e-6);
                for &(id, share) in ranks.iter().filter(|rank| rank.1 > 0.0) {
                    assert!(names.values().any(|known| *known == id), "an id of the manifest");
                    *seen.entry(id).or_insert(0.0) += share;
                }
            }
            assert_eq!(seen.len(), count);
        }
        let names = manifest(&attributes, "cryptoMaterial");
        assert!(names.contains_key("red \"é\"") && names.contains_key("blue") && names.contains_key("default"));
        // A pixel well inside a ball is wholly that ball.
        let inside = 16 * 48 + 17;
        let objects = ranks(&read, "cryptoObject");
        assert!((objects[inside][0].1 - 1.0).abs() < 1e-6, "{:?}", objects[inside]);
    }
}

/// Shares add up to one where all samples met something.
#[test]
fn coverages_add_up() {
    let film = picture(Integrator::Path, 2);
    let (mut full, mut mixed) = (0, 0);
    for (objects, materials) in ranks(&film, "cryptoObject").iter().zip(ranks(&film, "cryptoMaterial")) {
        let sum = |ranks: &[(u32, f64)]| ranks.iter().map(|rank| rank.1).sum::<f64>();
        assert!((sum(objects) - sum(&materials)).abs() < 1e-6);
        full += u32::from((sum(objects) - 1.0).abs() < 1e-6);
        mixed += u32::from(objects[1].1 > 0.0);
        // Whole numbers of samples.
        assert!(objects.iter().all(|rank| ((rank.1 * 24.0).round() - rank.1 * 24.0).abs() < 1e-4));
    }
    assert!(full > 100 && mixed > 3, "{full} {mixed}");
}

#[test]
fn threads_change_no_bit() {
    let (one, three) = (picture(Integrator::Path, 1), picture(Integrator::Path, 3));
    assert_eq!(one.texts, three.texts);
    for (a, b) in one.planes.iter().zip(&three.planes) {
        assert_eq!(a.name, b.name);
        if let (Some(a), Some(b)) = (one.f32_plane(&a.name), three.f32_plane(&b.name)) {
            assert!(a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits()));
        }
    }
}
