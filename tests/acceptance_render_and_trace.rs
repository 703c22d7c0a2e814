//! `trace` on the primary rays that `rays` wrote finds what `render` saw, pixel by pixel.

mod binary;

use std::path::Path;

use binary::{lanecast, npy_parts, shared};
use lanecast::film::exr;

const SIZE: (usize, usize) = (150, 70);

/// From above at an angle, towards the built-in gallery: a parallel view, sampled at the lower left corners of pixels.
const VIEW: &str = "viewsize 14; eye_pt 10 8 20; lookat_pt 0 1.5 -2; start 0; end;";

fn run(folder: &Path, arguments: &[&str]) {
    let ended = lanecast(folder, arguments);
    assert_eq!(ended.code, Some(0), "{arguments:?}: {}{}", ended.out, ended.err);
}

/// Place of pixel (x, y) in a ray file as its description says: tiles of 32x32 row by row, Morton order inside.
fn place(x: usize, y: usize) -> usize {
    let columns = SIZE.0.div_ceil(32);
    let morton = (0..5).map(|bit| (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1)).sum::<usize>();
    (y / 32 * columns + x / 32) * 1024 + morton
}

/// t, prim, inst of every record of a hit file.
fn hits(path: &Path) -> Vec<(f32, u32, u32)> {
    let bytes = std::fs::read(path).expect("a hit file");
    let (header, data) = npy_parts(&bytes);
    assert!(header.contains("'t', '<f4'") && header.contains("'inst', '<u4'"), "{header}");
    let word = |record: &[u8], at: usize| u32::from_le_bytes(record[at..at + 4].try_into().expect("four bytes"));
    data.chunks_exact(20).map(|r| (f32::from_bits(word(r, 0)), word(r, 12), word(r, 16))).collect()
}

/// `Z` is the distance from the eye: t times the length of the ray's direction.
fn same_picture(scene: &str, camera: &str) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("view.rt"), VIEW).expect("a view script");
    let size = format!("{}x{}", SIZE.0, SIZE.1);
    let run = |line: String| run(dir.path(), &line.split_whitespace().collect::<Vec<_>>());
    run(format!("render {scene} -o seen.exr --size {size} --aov Z,id.primitive,id.instance {camera}"));
    run(format!("rays {scene} --kind primary --size {size} -o rays.npy {camera}"));
    run(format!("trace {scene} --rays rays.npy --hits hits.npy --repeat 1"));
    let film = exr::read(&dir.path().join("seen.exr")).expect("an EXR file");
    let (prims, insts) = (film.u32_plane("id.primitive").expect("ids"), film.u32_plane("id.instance").expect("ids"));
    let depth = film.f32_plane("Z").expect("Z");
    let (hits, rays) = (hits(&dir.path().join("hits.npy")), rays(&dir.path().join("rays.npy")));
    let slots = SIZE.0.div_ceil(32) * SIZE.1.div_ceil(32) * 1024;
    assert_eq!((hits.len(), rays.len()), (slots, slots));
    let mut inside = vec![false; slots];
    let mut seen = 0;
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            let (pixel, at) = (y * SIZE.0 + x, place(x, y));
            inside[at] = true;
            let (t, prim, inst) = hits[at];
            assert_eq!((prims[pixel], insts[pixel]), (prim, inst), "{scene} pixel {x},{y}");
            let want = if t.is_finite() { t * length(rays[at]) } else { t };
            let same = depth[pixel] == want || (depth[pixel] - want).abs() <= 1e-6 * want;
            assert!(same, "{scene} pixel {x},{y}: Z {} and t {want}", depth[pixel]);
            seen += usize::from(t.is_finite());
        }
    }
    // Pixels beside the picture have dead rays.
    assert!(hits.iter().zip(inside).all(|(hit, inside)| inside || hit.1 == u32::MAX), "{scene}");
    assert!(seen > SIZE.0 * SIZE.1 / 8, "{scene}: {seen} pixels show something");
}

/// Directions of the rays of a ray file.
fn rays(path: &Path) -> Vec<[f32; 3]> {
    let bytes = std::fs::read(path).expect("a ray file");
    let (header, data) = npy_parts(&bytes);
    assert!(header.contains("<f4"), "{header}");
    let number = |r: &[u8], i: usize| f32::from_le_bytes(r[4 * i..4 * i + 4].try_into().expect("four bytes"));
    data.chunks_exact(32).map(|r| [4, 5, 6].map(|i| number(r, i))).collect()
}

fn length(dir: [f32; 3]) -> f32 {
    (dir.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>().sqrt()) as f32
}

#[test]
fn gallery() {
    same_picture("builtin:gallery", "");
}

#[test]
fn forest() {
    same_picture("builtin:forest", "");
}

/// What BRL-CAD's `rt` would see; every command samples pixels where it does.
#[test]
fn views_of_rt() {
    for camera in ["--az 35", "--az 200 --el 40", "--view view.rt"] {
        same_picture("builtin:gallery", camera);
    }
}

#[test]
fn sponza() {
    let Some(path) = shared("scenes/sponza_crytek/sponza_crytek.ply") else { return };
    same_picture(path.to_str().expect("UTF-8"), "");
}
