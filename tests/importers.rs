//! Importers against real files with known counts, against each other, and against the clock.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::DVec3;
use lanecast::scene::mesh::Mesh;
use lanecast::scene::{obj, ply, stl, unpack};

fn shared(path: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes").join(path);
    if !path.exists() {
        println!("SKIPPED: {} is not there", path.display());
        return None;
    }
    Some(path)
}

fn read_ply(path: &Path) -> Mesh {
    let bytes = unpack::read_file(path).unwrap();
    ply::parse(path, &bytes).unwrap()
}

#[test]
fn pathological_meshes_hold_what_their_list_says() {
    let Some(list) = shared("pathological/expect.json") else { return };
    let expected: serde_json::Value = serde_json::from_slice(&std::fs::read(&list).unwrap()).unwrap();
    let expected = expected.as_object().unwrap();
    assert!(expected.len() >= 10);
    for (name, expect) in expected {
        let mesh = read_ply(&list.with_file_name(format!("{name}.ply")));
        assert_eq!(Some(mesh.triangles.len() as u64), expect["triangles"].as_u64(), "{name}");
        assert_eq!(Some(mesh.positions.len() as u64), expect["vertices"].as_u64(), "{name}");
        let Some((lo, hi)) = mesh.bounds() else {
            assert!(expect["bbox_min"].is_null(), "{name}");
            continue;
        };
        // The files hold f32; a JSON number may be one ulp of f64 off after reading.
        let corner = |key: &str| [0, 1, 2].map(|i| expect[key][i].as_f64().unwrap() as f32);
        let found = [lo, hi].map(|p| p.to_array().map(|x| x as f32));
        assert_eq!(found, [corner("bbox_min"), corner("bbox_max")], "{name}");
        let nonfinite = mesh.positions.iter().filter(|p| !p.is_finite()).count() as u64;
        assert_eq!(Some(nonfinite), expect["nonfinite_vertices"].as_u64(), "{name}");
        let same_index = mesh.triangles.iter().filter(|[a, b, c]| a == b || b == c || c == a).count() as u64;
        assert_eq!(Some(same_index), expect["degenerate_same_index"].as_u64(), "{name}");
    }
}

#[test]
fn scenes_hold_what_their_table_says() {
    let Some(table) = shared("SOURCES.md") else { return };
    let text = std::fs::read_to_string(&table).unwrap();
    let mut read = 0;
    for line in text.lines().filter(|line| line.starts_with("| ")) {
        let cells: Vec<_> = line.split('|').map(str::trim).collect();
        let path = table.with_file_name(format!("{0}/{0}.ply", cells[1]));
        if !path.exists() {
            continue;
        }
        let mesh = read_ply(&path);
        assert_eq!(mesh.triangles.len().to_string(), cells[3], "{}", cells[1]);
        assert_eq!(mesh.positions.len().to_string(), cells[4], "{}", cells[1]);
        // The table has four digits.
        let (lo, hi) = mesh.bounds().unwrap();
        let numbers: Vec<f64> = cells[10].replace('/', " ").split_whitespace().map(|n| n.parse().unwrap()).collect();
        for (found, listed) in [lo.to_array(), hi.to_array()].concat().iter().zip(&numbers) {
            assert!((found - listed).abs() <= 5e-4 * listed.abs(), "{}: {found} is not {listed}", cells[1]);
        }
        assert_eq!(numbers.len(), 6);
        read += 1;
    }
    assert!(read >= 5, "only {read} scenes of the table were there");
}

#[test]
fn packed_scenes_have_the_length_they_declare() {
    for name in ["embree_trees", "san_miguel"] {
        let Some(path) = shared(&format!("{name}/{name}.glb.zst")) else { continue };
        assert_eq!(unpack::inner_extension(&path).as_deref(), Some("glb"));
        let bytes = unpack::read_file(&path).unwrap();
        // Binary glTF: magic, version, length of the file.
        assert_eq!(&bytes[..4], b"glTF", "{name}");
        let length = u32::from_le_bytes(bytes[8..12].try_into().unwrap());
        assert_eq!(length as usize, bytes.len(), "{name}");
    }
}

/// A bumpy square grid of `side` x `side` quads as triangles; positions are f32 values.
fn grid(side: u32) -> Mesh {
    let row = side + 1;
    let height = |i: u32| f64::from((f64::from(i.wrapping_mul(2_654_435_761)) * 1e-9) as f32);
    let positions = (0..row * row).map(|i| DVec3::new(f64::from(i % row), f64::from(i / row), height(i))).collect();
    let corners = (0..side * side).map(|q| q / side * row + q % side);
    let triangles = corners.flat_map(|a| [[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]).collect();
    Mesh { positions, triangles, groups: Vec::new(), ..Mesh::default() }
}

fn write_obj(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::new();
    for p in &mesh.positions {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|v| v + 1)) {
        writeln!(text, "f {a} {b} {c}").unwrap();
    }
    text.into_bytes()
}

fn ply_header(mesh: &Mesh, format: &str) -> String {
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
}

fn write_text_ply(mesh: &Mesh) -> Vec<u8> {
    let mut text = ply_header(mesh, "ascii");
    for p in &mesh.positions {
        writeln!(text, "{} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "3 {a} {b} {c}").unwrap();
    }
    text.into_bytes()
}

fn write_binary_ply(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = ply_header(mesh, "binary_big_endian").into_bytes();
    for p in &mesh.positions {
        bytes.extend(p.to_array().iter().flat_map(|&x| (x as f32).to_be_bytes()));
    }
    for t in &mesh.triangles {
        bytes.push(3);
        bytes.extend(t.iter().flat_map(|v| v.to_be_bytes()));
    }
    bytes
}

fn write_binary_stl(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = b"solid in name only".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for i in 0..mesh.triangles.len() {
        bytes.extend([0; 12]);
        bytes.extend(mesh.corners(i).iter().flat_map(|p| p.to_array()).flat_map(|x| (x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn write_text_stl(mesh: &Mesh) -> Vec<u8> {
    let mut text = "solid\n".to_owned();
    for i in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(i).map(|p| format!("vertex {} {} {}\n", p.x, p.y, p.z));
        write!(text, "facet normal 0 0 1\nouter loop\n{a}{b}{c}endloop\nendfacet\n").unwrap();
    }
    (text + "endsolid\n").into_bytes()
}

#[test]
fn every_format_gives_the_same_mesh_back() {
    let shared = shared("teapot/teapot.ply").map(|path| read_ply(&path));
    for mesh in [Some(grid(9)), shared].into_iter().flatten() {
        let file = Path::new("m");
        assert_eq!(obj::parse(file, &write_obj(&mesh)).unwrap().mesh, mesh);
        assert_eq!(ply::parse(file, &write_text_ply(&mesh)).unwrap(), mesh);
        assert_eq!(ply::parse(file, &write_binary_ply(&mesh)).unwrap(), mesh);
        for bytes in [write_binary_stl(&mesh), write_text_stl(&mesh)] {
            let welded = stl::parse(file, &bytes).unwrap();
            assert_eq!(welded.triangles.len(), mesh.triangles.len());
            assert!(welded.positions.len() <= mesh.positions.len());
            assert!((0..mesh.triangles.len()).all(|i| welded.corners(i) == mesh.corners(i)));
        }
    }
}

#[test]
fn a_million_triangles_parse_in_time() {
    let mesh = grid(708);
    let file = Path::new("m");
    // Ten times what is expected of a release build on a busy machine: this finds quadratic work, not slow days.
    let check = |name: &str, limit: f64, bytes: Vec<u8>, parse: &dyn Fn(&[u8]) -> Mesh| {
        let start = Instant::now();
        let read = parse(&bytes);
        let seconds = start.elapsed().as_secs_f64();
        println!("{name}: {} triangles, {} bytes in {seconds:.3} s", read.triangles.len(), bytes.len());
        assert_eq!(read.triangles.len(), 2 * 708 * 708);
        assert_eq!(read.positions.len(), 709 * 709);
        assert!(seconds < limit, "{name}: {seconds} s");
    };
    check("binary PLY", 2.0, write_binary_ply(&mesh), &|b| ply::parse(file, b).unwrap());
    check("text PLY", 10.0, write_text_ply(&mesh), &|b| ply::parse(file, b).unwrap());
    check("binary STL", 2.0, write_binary_stl(&mesh), &|b| stl::parse(file, b).unwrap());
    check("text STL", 10.0, write_text_stl(&mesh), &|b| stl::parse(file, b).unwrap());
    check("OBJ", 10.0, write_obj(&mesh), &|b| obj::parse(file, b).unwrap().mesh);
}
