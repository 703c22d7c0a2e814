//! Files that are damaged, or written to cost much.

use super::{flat, read, refused};
use crate::error::{Error, Place};
use crate::scene::solids::flat::{FlatTree, Step};

#[test]
fn hostile_files_end_soon() {
    let start = std::time::Instant::now();
    let depth = 200_000;
    let deep = format!("{}cube();{}", "union() {".repeat(depth), "}".repeat(depth));
    assert_eq!(flat(&deep).leaves.len(), 1);
    let differences = format!("{}cube();{}", "difference() { cube(size = 2); ".repeat(depth), "}".repeat(depth));
    assert_eq!(flat(&differences).steps.iter().filter(|step| matches!(step, Step::Op(..))).count(), depth);
    let resizes = format!("{}{}{}", "resize([1,1,1]) {".repeat(depth), "cube();".repeat(depth), "}".repeat(depth));
    assert!(refused(&resizes).contains("too much work"));
    assert!(refused("sphere(r = 1, $fn = 5000);").contains("more than 4194304 triangles"));
    // Each edge crosses each other.
    let star: Vec<String> =
        (0..4001).map(|i| format!("[{},{}]", if i % 2 == 0 { 0 } else { 9999 }, i * 2003 % 4001)).collect();
    let star = format!("linear_extrude(height = 1) polygon(points = [{}]);", star.join(","));
    assert!(refused(&star).contains("cross more than"), "{}", refused(&star));
    let heavy = "minkowski() { sphere(r = 1, $fn = 300); sphere(r = 2, $fn = 300); }";
    assert!(refused(heavy).contains("too many"));
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}

#[test]
fn damaged_files_are_errors_or_scenes() {
    let text = "%cube(1); group() { color([1, 0.5, 0, 0.5]) multmatrix([[1, 0, 0, 2], [0, -1, 0, 0], [0, 0, 1, 0]]) {\n\
        difference() { hull() { sphere(r = 2, $fn = 5); cube(1); } cylinder(h = 3, r1 = 1, r2 = 0, center = true); }\n\
        minkowski(convexity = 0) { cube(size = [1, 2, 3]); sphere($fn = 4); } }\n\
        resize(newsize = [3, 0, 1], auto = [0, 1, 0]) cube(3, center = true);\n\
        linear_extrude(height = 2, twist = 40, slices = 3, scale = [0.5, 2]) offset(delta = 1, chamfer = true)\n\
        polygon(points = [[0, 0], [4, 0], [4, 1], [1, 1], [1, 4]], paths = [[0, 1, 2, 3, 4]]);\n\
        rotate_extrude(angle = 90, $fn = 8) offset(r = -0.1, $fn = 4) square(size = 2);\n\
        polyhedron(points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], \
        faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]); }";
    let whole = read(text).unwrap();
    assert_eq!(FlatTree::new(&whole.solids[0]).unwrap().leaves.len(), 7);
    let check = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes);
        match read(&text) {
            Ok(scene) => scene.solids.iter().for_each(|tree| assert!(FlatTree::new(tree).is_ok(), "{text}")),
            Err(error) => assert!(matches!(&error, Error::Input(e) if e.place != Place::Whole), "{text}: {error}"),
        }
    };
    for at in 0..text.len() {
        check(&text.as_bytes()[..at]);
        for other in [&b""[..], b"0", b"-", b"]", b"(", b"}", b"!", b",", b"9e9"] {
            check(&[&text.as_bytes()[..at], other, &text.as_bytes()[at + 1..]].concat());
        }
    }
}
