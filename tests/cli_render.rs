//! `render` through the real binary.

mod binary;

use binary::{SQUARE, files, lanecast, refused};
use lanecast::film::{Film, PlaneData, exr, npy, png};

fn square() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(dir.path().join("square.ply"), SQUARE).expect("a scene");
    dir
}

/// The unit square in z = 0, seen from z = 2 under 90 degrees: the picture is 4 wide and 4 high at its plane.
const FRONT: &str = "--eye 0.5,0.5,2 --look-at 0.5,0.5,0 --fov 90 --size 64x64";

fn run(dir: &tempfile::TempDir, line: &str) -> binary::Ended {
    let ended = lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(0), "{line}: {}{}", ended.out, ended.err);
    ended
}

#[test]
fn a_square_is_where_it_should_be_with_all_planes_in_exr() {
    let dir = square();
    let report = run(&dir, &format!("render square.ply -o out.exr {FRONT} --aov all --json --threads 2")).json();
    assert_eq!((&report["complete"], &report["rays"]["primary"]), (&true.into(), &4096.into()));
    assert_eq!((&report["written"], files(dir.path())), (&true.into(), vec!["out.exr".into(), "square.ply".into()]));
    let film = exr::read(&dir.path().join("out.exr")).expect("an EXR file");
    assert_eq!(film.planes.len(), 4 + (1 + 3 + 3 + 1 + 1 + 1) + (3 + 3 + 1 + 1 + 1));
    assert!(film.plane("direct.R").is_none() && film.plane("cost.nodes").is_some(), "only what whitted has");
    let (alpha, z) = (film.f32_plane("A").expect("A"), film.f32_plane("Z").expect("Z"));
    for (i, (&a, &z)) in alpha.iter().zip(z).enumerate() {
        // The square covers the middle quarter each way: pixels 24 to 39.
        let inside = (24..40).contains(&(i % 64)) && (24..40).contains(&(i / 64));
        assert_eq!((a, z.is_finite()), (f32::from(u8::from(inside)), inside), "pixel {i}");
        assert!(!inside || (2.0..2.15).contains(&z));
    }
    let ids = film.u32_plane("id.primitive").expect("ids");
    assert!(ids[32 * 64 + 39] != ids[32 * 64 + 24] || ids[25 * 64 + 39] != ids[38 * 64 + 24], "two triangles");
}

#[test]
fn crops_are_data_windows_and_formats_agree() {
    let dir = square();
    run(&dir, &format!("render square.ply -o whole.npy {FRONT} --integrator normals --aov id.primitive"));
    run(&dir, &format!("render square.ply -o crop.exr {FRONT} --integrator normals --crop 20,22,44,42 --engine brute"));
    run(&dir, &format!("render square.ply -o whole.png {FRONT} --integrator normals --tile 8"));
    assert_eq!(files(dir.path()), ["crop.exr", "square.ply", "whole.id.primitive.npy", "whole.npy", "whole.png"]);
    let (width, height, _) = npy::read_plane(&dir.path().join("whole.id.primitive.npy")).expect("ids");
    assert_eq!((width, height), (64, 64));
    let whole = std::fs::read(dir.path().join("whole.npy")).expect("colours");
    let header = String::from_utf8_lossy(&whole[..128]).into_owned();
    assert!(header.contains("'shape': (64, 64, 4)") && header.contains("<f4"), "{header}");
    let data = &whole[whole.len() - 64 * 64 * 16..];
    let crop = exr::read(&dir.path().join("crop.exr")).expect("an EXR file");
    assert_eq!((crop.width, crop.height), (64, 64));
    assert_eq!((crop.window.x0, crop.window.y0, crop.window.x1, crop.window.y1), (20, 22, 44, 42));
    let picture = png::read(&dir.path().join("whole.png")).expect("a PNG file");
    assert_eq!((picture.width, picture.height), (64, 64));
    let blue = crop.f32_plane("B").expect("B");
    for (i, &value) in blue.iter().enumerate() {
        let (x, y) = (20 + i % 24, 22 + i / 24);
        let at = (y * 64 + x) * 16 + 8;
        assert_eq!(value.to_le_bytes(), data[at..at + 4], "pixel {x},{y}");
        // The normal is +z, towards the eye: 0.5 + 0.5.
        let inside = (24..40).contains(&x) && (24..40).contains(&y);
        assert_eq!(value, f32::from(u8::from(inside)));
    }
}

#[test]
fn engines_threads_and_precisions_are_chosen() {
    let dir = square();
    let report = run(&dir, &format!(
        "render square.ply -o a.exr {FRONT} --precision f64 --engine scalar --threads 1 --integrator ao --ao-samples 2 --spp 2 --json"
    ))
    .json();
    for (key, value) in [("precision", "f64"), ("engine", "scalar"), ("integrator", "ao")] {
        assert_eq!(report[key], value);
    }
    assert_eq!((&report["threads"], &report["rays"]["primary"]), (&1.into(), &8192.into()));
    assert_eq!(report["rays"]["shadow"], 0);
    assert!(report["rays"]["occlusion"].as_u64() > Some(800));
}

#[test]
fn refusals_say_what_is_expected() {
    let dir = square();
    for (line, what) in [
        ("render square.ply -o a.jpg", ".exr, .png, .npy or .pix"),
        ("render square.ply", "--output"),
        ("render square.ply -o a.exr --integrator normal", "did you mean `normals`?"),
        ("render square.ply -o a.exr --aov M", "unknown AOV `M`"),
        ("render square.ply -o a.exr --aov all,direct", "--aov direct: whitted has no such plane, only path"),
        ("render square.ply -o a.exr --integrator path --aov cost.nodes", "--aov cost.nodes: path has no such plane"),
        ("render square.ply -o a.png --aov Z", "needs .exr or .npy"),
        ("render square.ply -o a.exr --engine skalar", "scalar"),
        ("render square.ply -o a.exr --tile 9", "8, 16 or 32"),
        ("render square.ply -o a.exr --spp 0", "samples per pixel"),
        ("render square.ply -o a.exr --crop 0,0,9999,5", "leaves the picture"),
        ("render square.ply -o a.exr --camera front", "no camera `front`"),
        ("render builtin:terrain -o a.exr --camera mian", "(did you mean `main`?)"),
        ("render square.ply -o a.exr --eye 1,1,1 --look-at 1,1,1", "same point"),
        ("render square.ply -o a.exr --eye 0,5,0 --look-at 0,0,0 --up 0,1,0", "--up must not point along the view"),
        ("view square.ply --eye 0,5,0 --look-at 0,0,0 --up 0,-2,0", "--up must not point along the view"),
        ("render square.ply -o a.exr --integrator ao --ao-radius -1", "radius -1: expected a positive number"),
        ("render square.ply -o no/such/folder/a.exr", "no/such/folder"),
        ("render square.ply -o a.exr --noise -1", "noise -1: expected a positive number"),
        ("render square.ply -o a.exr --time-limit -2", "time limit -2: expected a positive number"),
        ("render square.ply -o a.exr --exposure nan", "'nan' for '--exposure <STOPS>': expected a number"),
        ("render square.ply -o a.exr --exposure -inf", "'-inf' for '--exposure <STOPS>': expected a number"),
        ("view square.ply --exposure inf", "'inf' for '--exposure <STOPS>': expected a number"),
        ("render none.ply -o a.exr", "none.ply"),
        ("render none.asc -o a.exr --rt-compat --integrator path", "it cannot be path, too"),
        ("render square.ply -o a.exr --rt-compat --integrator rt", "BRL-CAD databases"),
    ] {
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), what);
    }
    assert_eq!(files(dir.path()), ["square.ply"]);
}

#[test]
fn options_without_effect_are_warned_of() {
    let dir = square();
    for (options, what) in [
        ("--ao-radius 1", "warning: --ao-radius 1: whitted has no occlusion rays, only ao"),
        ("--integrator path --ao-samples 4", "warning: --ao-samples 4: path has no occlusion rays, only ao"),
        ("--integrator ao --depth 2", "warning: --depth 2: ao has no depth that can be chosen, only whitted and path"),
        ("--integrator ao --ao-samples 2 --ao-radius 1", ""),
        ("--depth 2", ""),
    ] {
        let line = format!("render square.ply -o a.exr --size 8x8 --spp 1 --threads 1 {options}");
        let ended = lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>());
        let warned: Vec<_> = ended.err.lines().filter(|line| line.starts_with("warning: ")).collect();
        assert_eq!((ended.code, warned.join("\n").as_str()), (Some(0), what), "{options}");
    }
}

/// Nothing to look at is no error: whatever is shown, the picture is that of rays that miss.
#[test]
fn scenes_without_anything_are_pictures() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let header = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n";
    let faces = "element face 0\nproperty list uchar int vertex_indices\nend_header\n";
    let database = "title {t}\nunits mm\nput r.r comb region yes tree {}\n";
    std::fs::write(dir.path().join("empty.ply"), format!("{header}{faces}")).expect("a mesh");
    std::fs::write(dir.path().join("empty.asc"), database).expect("a database");
    for integrator in ["whitted", "path", "ao", "normals", "depth"] {
        run(&dir, &format!("render empty.ply -o {integrator}.exr --size 40x30 --integrator {integrator}"));
        let film = exr::read(&dir.path().join(format!("{integrator}.exr"))).expect("an EXR file");
        // Paths see the sky, which is opaque.
        let alpha = f32::from(u8::from(integrator == "path"));
        assert!(film.f32_plane("A").expect("A").iter().all(|&a| a == alpha), "{integrator}");
    }
    run(&dir, "render empty.asc -o empty.pix --size 40x30 --rt-compat");
    let bytes = std::fs::read(dir.path().join("empty.pix")).expect("a picture");
    assert!(bytes.len() == 40 * 30 * 3 && bytes.chunks_exact(3).all(|pixel| pixel == [0, 0, 1]));
}

/// What an environment shows is part of the picture, black as it may be: no holes in the ground below a sky.
#[test]
fn dark_parts_of_an_environment_are_opaque() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    // Texels are blended: the ground begins well below the horizon.
    let half = [[1.0; 64], [0.0; 64]].concat();
    for (name, light) in [("half.exr", half), ("black.exr", vec![0.0; 128])] {
        let mut film = Film::full(16, 8).expect("a size");
        for plane in ["R", "G", "B"] {
            film.push(plane, PlaneData::F32(light.clone())).expect("a plane");
        }
        exr::write(&dir.path().join(name), &film, &exr::ImageInfo::default(), exr::Compression::Zip).expect("written");
        let camera = "camera \"m\" { eye 0 0 6; look-at 0 0 0; fov 60 }";
        std::fs::write(dir.path().join("m.kdl"), format!("{camera}\nenvironment \"{name}\"\nsphere\n"))
            .expect("a scene");
        for integrator in ["whitted", "path --spp 2", "ao"] {
            run(&dir, &format!("render m.kdl -o out.exr --size 32x32 --integrator {integrator}"));
            let film = exr::read(&dir.path().join("out.exr")).expect("a picture");
            let (red, alpha) = (film.f32_plane("R").expect("R"), film.f32_plane("A").expect("A"));
            assert!(red[31 * 32] == 0.0, "{name} {integrator}: the ground is black");
            let holes = alpha.iter().filter(|&&a| a != 1.0).count();
            assert_eq!(holes > 0, integrator == "ao", "{name} {integrator}: {holes}");
        }
    }
}

/// Light goes through two faces of a box, however thin it is and from however far it is seen.
#[test]
fn thin_boxes_have_two_faces() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let camera = "camera \"m\" { eye 0.3 0.2 1000; look-at 0 0 0; fov 0.05 }";
    let look = "ambient 0\nmaterial \"p\" { diffuse 0; emission 1; opacity 0.5 }";
    let shape = "box material=\"p\" { size 4 4 0.001 }\n";
    std::fs::write(dir.path().join("m.kdl"), format!("{camera}\n{look}\n{shape}")).expect("a scene");
    for engine in ["scalar", "stream", "tile"] {
        let line = format!("render m.kdl -o out.exr --size 32x32 --spp 64 --engine {engine} --precision f32");
        let ended = lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(ended.code, Some(0), "{line}: {}", ended.err);
        let film = exr::read(&dir.path().join("out.exr")).expect("a picture");
        let alpha = film.f32_plane("A").expect("A");
        let mean = alpha.iter().map(|x| f64::from(*x)).sum::<f64>() / alpha.len() as f64;
        assert!((mean - 0.75).abs() < 0.01, "{engine}: {mean}");
    }
}

/// Half of what shines and half of the black behind it: by every engine, also by one whose arithmetic hangs on which rays go together, and
/// whatever planes are asked for beside.
#[test]
fn half_opaque_surfaces_are_half_seen() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let veil = "point -90 1 90; point 90 1.3 90; point 90 1.7 -90; point -90 1.4 -90";
    let wall = "point -10000 -10000 0; point 10000 -10000 0.1; point 10000 10000 0.2; point -10000 10000 0.1";
    for (name, points, camera) in
        [("veil", veil, "eye 0.3 3 8; look-at 0 0.4 0; fov 20"), ("wall", wall, "eye 0.3 0.2 3; look-at 0 0 0; fov 20")]
    {
        let scene = format!(
            "camera \"m\" {{ {camera} }}\nambient 0\nlight directional irradiance=0 {{ direction 0 -1 0 }}\n\
             material \"p\" {{ diffuse 0; emission 1; opacity 0.5 }}\npolygon material=\"p\" {{ {points} }}\n"
        );
        std::fs::write(dir.path().join("m.kdl"), scene).expect("a scene");
        for more in [
            "--engine auto",
            "--engine scalar",
            "--engine auto --aov cost.nodes",
            "--integrator path",
            "--engine tile-8x8",
        ] {
            let line = format!("render m.kdl -o out.exr --size 64x64 --spp 16 {more}");
            let ended = lanecast(dir.path(), &line.split(' ').collect::<Vec<_>>());
            assert_eq!(ended.code, Some(0), "{line}: {}", ended.err);
            let film = exr::read(&dir.path().join("out.exr")).expect("a picture");
            let red = film.f32_plane("R").expect("R");
            let mean = red.iter().map(|x| f64::from(*x)).sum::<f64>() / red.len() as f64;
            // Of 65 536 samples the mean is off by 0.002.
            assert!((mean - 0.5).abs() < 0.01, "{name} {more}: {mean}");
        }
    }
}
