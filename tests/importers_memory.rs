//! The memory bounds that the importers state, measured: each file is parsed in a fresh process that reads its own
//! peak before and after.

use std::path::Path;
use std::process::Command;

use lanecast::scene::reference::References;
use lanecast::scene::{gltf, mtl, obj, openscad, ply, stl};

/// Tells the process to be the measuring one; its value is the file.
const FILE: &str = "LANECAST_TEST_MEMORY_FILE";
/// Begins the line that the measuring process prints: reserved bytes, touched bytes.
const MARK: &str = "rise:";

/// A memory size of this process from the kernel's status file, bytes: `VmPeak` is the largest address space so far
/// (reserved memory counts even if never touched), `VmHWM` the most that was resident.
fn memory(field: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with(field))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? << 10)
}

/// Parses the file and prints by how much the peaks rose.
fn measure(file: &Path) {
    let bytes = std::fs::read(file).unwrap();
    let both = || [memory("VmPeak").unwrap(), memory("VmHWM").unwrap()];
    let before = both();
    let is_read = match file.extension().and_then(|e| e.to_str()) {
        Some("obj") => obj::parse(file, &bytes).map(drop),
        Some("mtl") => mtl::parse(file, &bytes).map(drop),
        Some("ply") => ply::parse(file, &bytes).map(drop),
        Some("gltf" | "glb") => {
            let references = References { folder: None, allow_outside: false, found: None };
            gltf::parse(file, "memory", &bytes, &references).map(drop)
        }
        Some("csg") => {
            let references = References { folder: None, allow_outside: false, found: None };
            let no_files = |path: &Path| Err(lanecast::error::Error::whole(path, "no files here"));
            openscad::parse(file, "memory", &bytes, &references, &no_files).map(drop)
        }
        _ => stl::parse(file, &bytes).map(drop),
    };
    let after = both();
    println!("\n{MARK} {} {} {}", after[0] - before[0], after[1] - before[1], is_read.is_ok());
}

/// Bytes reserved and bytes touched while `bytes` are parsed as `name`, and whether they could be read.
fn rise(name: &str, bytes: &[u8]) -> (u64, u64, bool) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let test = ["--exact", "memory_stays_in_proportion_to_the_file", "--nocapture"];
    let output = Command::new(std::env::current_exe().unwrap()).args(test).env(FILE, &path).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let line = text.lines().find_map(|line| line.strip_prefix(MARK)).unwrap_or_else(|| panic!("{name}: {text}"));
    let words: Vec<_> = line.split_whitespace().collect();
    (words[0].parse().unwrap(), words[1].parse().unwrap(), words[2] == "true")
}

fn ply_file(format: &str, vertices: u64, faces: u64, rows: &[u8]) -> Vec<u8> {
    let coordinates = "property uchar x\nproperty uchar y\nproperty uchar z\n";
    let head = format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\n{coordinates}element face {faces}\n\
         property list uint uchar vertex_indices\nend_header\n"
    );
    [head.as_bytes(), rows].concat()
}

/// A binary STL file of about `size` bytes in which no two corners are equal.
fn distinct_stl(size: usize) -> Vec<u8> {
    let count = size as u32 / 50;
    let mut bytes = [[0; 80].as_slice(), &count.to_le_bytes()].concat();
    for i in 0..count {
        bytes.extend([0; 12]);
        for corner in 0..3 {
            bytes.extend([(3 * i + corner) as f32, 0.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
        }
        bytes.extend([0; 2]);
    }
    bytes
}

/// A glTF document with the members `head` and a list called `name` of about `size` bytes.
fn gltf_list(size: usize, head: &str, name: &str, piece: &str) -> Vec<u8> {
    let list = vec![piece; size / (piece.len() + 1)].join(",");
    format!("{{\"asset\": {{\"version\": \"2.0\"}}, {head} \"{name}\": [{list}]}}").into_bytes()
}

/// A binary glTF file whose `size` bytes are the 8-bit indices of one strip.
fn strip_glb(size: usize) -> Vec<u8> {
    let size = size.next_multiple_of(4);
    let mut json = format!(
        "{{\"asset\": {{\"version\": \"2.0\"}}, \"nodes\": [{{\"mesh\": 0}}], \"meshes\": [{{\"primitives\": \
         [{{\"attributes\": {{\"POSITION\": 0}}, \"indices\": 1, \"mode\": 5}}]}}], \"accessors\": [\
         {{\"componentType\": 5126, \"count\": 256, \"type\": \"VEC3\"}}, \
         {{\"bufferView\": 0, \"componentType\": 5121, \"count\": {size}, \"type\": \"SCALAR\"}}], \
         \"bufferViews\": [{{\"buffer\": 0, \"byteLength\": {size}}}], \"buffers\": [{{\"byteLength\": {size}}}]}}"
    );
    json += &" ".repeat(json.len().next_multiple_of(4) - json.len());
    let word = |n: usize| (n as u32).to_le_bytes();
    let (whole, text) = (word(28 + json.len() + size), word(json.len()));
    let head: [&[u8]; 6] = [b"glTF", &word(2), &whole, &text, b"JSON", json.as_bytes()];
    [&head.concat()[..], &word(size), b"BIN\0", &vec![7; size]].concat()
}

#[test]
fn memory_stays_in_proportion_to_the_file() {
    if let Some(file) = std::env::var_os(FILE) {
        return measure(Path::new(&file));
    }
    if memory("VmPeak").and(memory("VmHWM")).is_none() {
        println!("SKIPPED: no /proc/self/status here");
        return;
    }
    lies_reserve_nothing();
    dense_files_stay_below_the_stated_bounds();
    curves_take_what_their_triangles_take();
}

/// A few words may ask for millions of triangles: for each less than the 512 bytes that the reader states, and not for more than 2^22.
fn curves_take_what_their_triangles_take() {
    for (pieces, words) in [
        (800_u64, "sphere($fn=800);".to_owned()),
        (800, "linear_extrude(height=1,twist=9,slices=400)circle($fn=800);".to_owned()),
        (
            800,
            "rotate_extrude($fn=400)multmatrix([[1,0,0,3],[0,1,0,0],[0,0,1,0],[0,0,0,1]])circle($fn=800);".to_owned(),
        ),
    ] {
        let (_, touched, is_read) = rise("curve.csg", words.as_bytes());
        let each = touched / (pieces * pieces);
        println!("{words}: {each} bytes per triangle, stated: below 512");
        assert!(is_read && (1..512).contains(&each), "{words}: {each}");
    }
    // One more piece than fits, in one mesh and in many.
    for words in ["sphere($fn=2050);".to_owned(), "sphere($fn=4000);".to_owned(), "sphere(r=1,$fn=64);".repeat(1100)] {
        let (_, touched, is_read) = rise("curve.csg", words.as_bytes());
        assert!(!is_read && touched < 16 << 20, "{}: {touched} bytes", &words[..16]);
    }
}

fn lies_reserve_nothing() {
    let mut files = vec![("lie.stl", [[0; 80].as_slice(), &[0xff; 4], &[0; 500]].concat())];
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (vertices, faces) in [(4_000_000_000, 0), (0, 4_000_000_000), (1, i64::MAX as u64)] {
            files.push(("lie.ply", ply_file(format, vertices, faces, &[b'0'; 100])));
        }
        files.push(("long_list.ply", ply_file(format, 1, 1, &[0xf0; 100])));
    }
    for (name, bytes) in files {
        let (reserved, _, is_read) = rise(name, &bytes);
        assert!(!is_read && reserved < 1 << 20, "{name}: {reserved} bytes reserved");
    }
}

fn dense_files_stay_below_the_stated_bounds() {
    const SIZE: usize = 6 << 20;
    let repeated = |head: &str, piece: &str| (head.to_owned() + &piece.repeat(SIZE / piece.len())).into_bytes();
    let long_name = format!("v 0 0 0\nusemtl {}\n", "m".repeat(255));
    let polygon = [&[0, 0, 0][..], &(SIZE as u32).to_le_bytes(), &vec![0; SIZE]].concat();
    for (bound, name, bytes) in [
        (64_u32, "vertices.obj", repeated("", "v 0 0 0\n")),
        (64, "polygon.obj", repeated("v 0 0 0\nf", " 1")),
        (64, "runs.obj", repeated(&long_name, "g a\nf 1 1 1\ng b\nf 1 1 1\n")),
        (64, "mixed.obj", repeated("v 0 0 0\nvt 0\nvn 0 0 1\nf 1/1/1 1/1/1 1/1/1\nf", " 1")),
        (128, "materials.mtl", repeated("", "newmtl a\n")),
        (64, "libraries.obj", repeated("", "mtllib a\n")),
        (40, "polygon.ply", ply_file("binary_little_endian", 1, 1, &polygon)),
        (40, "vertices.ply", ply_file("binary_little_endian", SIZE as u64 / 3, 0, &vec![1; SIZE / 3 * 3])),
        (40, "text.ply", ply_file("ascii", SIZE as u64 / 6, 0, "1 1 1 ".repeat(SIZE / 6).as_bytes())),
        (16, "distinct.stl", distinct_stl(SIZE)),
        (64, "nodes.gltf", gltf_list(SIZE, "", "nodes", "{}")),
        (64, "placed.gltf", gltf_list(SIZE, "\"meshes\": [{}],", "nodes", "{\"mesh\":0}")),
        (64, "groups.gltf", gltf_list(SIZE, "", "nodes", "{\"children\":[]}")),
        (64, "materials.gltf", gltf_list(SIZE, "", "materials", "{\"doubleSided\":true}")),
        (64, "meshes.gltf", gltf_list(SIZE, "", "meshes", "{}")),
        (64, "names.gltf", gltf_list(SIZE, "", "extensionsUsed", "\"a\"")),
        (64, "strip.glb", strip_glb(SIZE)),
        (256, "cubes.csg", repeated("", "cube();")),
        (256, "unions.csg", repeated("", "union(){}")),
        (
            256,
            "lists.csg",
            repeated("", "cube(a=[[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[],[]]);"),
        ),
    ] {
        let (_, touched, is_read) = rise(name, &bytes);
        let times = touched as f64 / bytes.len() as f64;
        println!("{name}: {times:.1} bytes per byte of the file, stated: below {bound}");
        // What a file holds is kept, so a rise below its own size would mean that nothing was measured.
        assert!(is_read && (1.0..f64::from(bound)).contains(&times), "{name}: {times} is not below {bound}");
    }
}
