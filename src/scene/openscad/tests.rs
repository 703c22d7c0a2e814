mod hostile;

use std::f64::consts::{PI, TAU};
use std::path::Path;

use glam::{DAffine3, DVec3};

use super::parse;
use crate::error::{Error, Result};
use crate::scene::description::{Description, ItemKind, Shape};
use crate::scene::mesh::Mesh;
use crate::scene::reference::References;
use crate::scene::solids::flat::{FlatTree, closed};
use crate::scene::solids::{NodeKind, Solid};

fn read(text: &str) -> Result<Description> {
    const NO_FILES: References = References { folder: None, allow_outside: false, found: None };
    parse(Path::new("m.csg"), "m", text.as_bytes(), &NO_FILES, &|path| Err(Error::whole(path, "no files here")))
}

fn flat(text: &str) -> FlatTree {
    let description = read(text).unwrap_or_else(|error| panic!("{text}: {error}"));
    FlatTree::new(&description.solids[0]).unwrap()
}

/// The first line of an error.
fn refused(text: &str) -> String {
    read(text).expect_err(text).to_string().lines().next().unwrap_or_default().to_owned()
}

fn warnings(text: &str) -> Vec<String> {
    read(text).unwrap().warnings
}

fn is_empty(text: &str) -> bool {
    let description = read(text).unwrap();
    description.groups[0].items.is_empty()
}

/// Volume of the only leaf, a mesh, a polyhedron or a box, in place.
fn volume(text: &str) -> f64 {
    let tree = flat(text);
    let [leaf] = &tree.leaves[..] else { panic!("{text}: {} leaves", tree.leaves.len()) };
    let own = match &leaf.solid {
        Solid::Mesh(mesh) => {
            closed(mesh).unwrap();
            mesh.volume()
        }
        Solid::Shape(Shape::Cuboid) => 8.0,
        Solid::Polyhedron(polyhedron) => {
            let planes: Vec<_> = polyhedron.planes().iter().map(|p| (p.normal, p.offset)).collect();
            volume_of_planes(&planes)
        }
        other => panic!("{other:?}"),
    };
    own * leaf.to_tree.matrix3.determinant().abs()
}

/// Volume where all planes' inner sides meet: each face's polygon is cut out of a large square.
fn volume_of_planes(planes: &[(DVec3, f64)]) -> f64 {
    let pyramid = |&(normal, offset): &(DVec3, f64)| {
        let (x, y) = normal.any_orthonormal_pair();
        let mut face: Vec<DVec3> = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
            .map(|(u, v)| normal * offset + (x * u + y * v) * 1e4)
            .into();
        for &(other, distance) in planes.iter().filter(|(other, _)| other.dot(normal) < 1.0 - 1e-9) {
            let height = |p: DVec3| other.dot(p) - distance;
            let mut kept = Vec::new();
            for (i, &p) in face.iter().enumerate() {
                let q = face[(i + 1) % face.len()];
                kept.extend((height(p) <= 0.0).then_some(p));
                if (height(p) > 0.0) != (height(q) > 0.0) {
                    kept.push(p + (q - p) * (height(p) / (height(p) - height(q))));
                }
            }
            face = kept;
        }
        let area: f64 =
            (2..face.len()).map(|i| 0.5 * (face[i - 1] - face[0]).cross(face[i] - face[0]).dot(normal).abs()).sum();
        area * offset / 3.0
    };
    planes.iter().map(pyramid).sum()
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{a} is not {b}");
}

/// Area of a regular polygon.
fn polygon(radius: f64, corners: usize) -> f64 {
    0.5 * corners as f64 * radius * radius * (TAU / corners as f64).sin()
}

#[test]
fn every_form_of_the_grammar_is_read() {
    let text = "\u{feff}// a comment\n/* another\n one */\
        group() {\n\tunion();\n\tcube(size = [1, 2, 3], center = false);\n\
        }\n\
        %cube(size = 9); *sphere(r = 4, $fn = 5);;\n\
        #!render(convexity = 1) color([0.1, .5, 1e-1, +1]) cube([-1e0, 2]);";
    // The last call has two numbers.
    let error = refused(text);
    assert_eq!(error, "m.csg:8:57: `cube`: `size` must be 3 finite numbers, found a list of 2");
    let tree =
        flat("group() { multmatrix([[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1],]) cube(size=[2,2,2], center=true,); }");
    assert_eq!(tree.leaves[0].to_tree, DAffine3::from_translation(DVec3::X * 5.0));
    assert_eq!(read("").unwrap().groups[0].items.len(), 0);
    assert_eq!(read("union();").unwrap().solids.len(), 0);
}

#[test]
fn errors_say_where_and_what_was_expected() {
    for (text, want) in [
        (
            "cube(",
            "m.csg:1:6: expected a number, a text, a list, `true`, `false` or `undef`, found the end of the file",
        ),
        ("cube()\n", "m.csg:2:1: expected `;`, `{` or a module, found the end of the file"),
        ("union() {\n cube();\n", "m.csg:1:9: this `{` has no `}`"),
        ("cube(); }", "m.csg:1:9: expected a module such as `union()`, found `}`"),
        ("x = 4;", "m.csg:1:3: expected `(`, found `=`"),
        ("cube(size = a);", "m.csg:1:13: expected a number, a text, a list, `true`, `false` or `undef`, found `a`"),
        ("cube(size = [1, 2 3]);", "m.csg:1:19: expected `,` or `]`, found `3`"),
        ("cube(size = 1 + 2);", "m.csg:1:15: expected `,` or `)`, found `+`"),
        ("cube(size = 1.2.3);", "m.csg:1:13: expected a number, found `1.2.3`"),
        ("cube(size = inf);", "m.csg:1:13: `cube`: `size` must be a finite number, found inf"),
        ("cube(center = 1);", "m.csg:1:15: `cube`: `center` must be `true` or `false`, found 1"),
        ("/* cube", "m.csg:1:1: this comment has no end: expected `*/`"),
        ("text(text = \"a", "m.csg:1:13: this text has no closing `\"`"),
        (
            "\n sphre(r = 1);",
            "m.csg:2:2: `sphre`: no such module: a .csg file holds what `openscad -o model.csg` writes",
        ),
        ("text(text = \"a\");", "m.csg:1:1: `text`: it is not read: what polygons it makes, only OpenSCAD knows"),
        (
            "sphere(r = 1, $fn = 1e9);",
            "m.csg:1:1: `sphere`: its curves would have 1000000000 pieces, at most 65536 are read",
        ),
        ("import(file = \"a.stl\");", "m.csg:1:1: `import`: a scene without a folder refers to no files"),
        (
            "polyhedron(points = [[0, 0, 0]], faces = [[0, 1, 2]]);",
            "m.csg:1:47: `polyhedron`: `faces` must be numbers of points, 0 to 0, found 1",
        ),
        (
            "rotate_extrude() square(size = 2, center = true);",
            "m.csg:1:1: `rotate_extrude`: its figure must lie on one side of the y axis, found x from -1 to 1",
        ),
        (
            "hull() {\n difference() { cube(); sphere(); } }",
            "m.csg:2:2: `hull` in line 1 cannot be made: what is cut here has corners that are not known",
        ),
        (
            "difference() { polyhedron(points = [[0,0,0],[1,0,0],[0,1,0]], faces = [[0,1,2]]); cube(); }",
            "m.csg:1:16: `polyhedron`: it has no inside for `difference` in line 1: the mesh is not closed: the edge \
             from [0, 0, 0] to [1, 0, 0] has triangles on one side only",
        ),
    ] {
        assert_eq!(refused(text), want, "{text}");
    }
    let deep = format!("cube(size = {});", "[".repeat(100));
    assert_eq!(refused(&deep), "m.csg:1:77: lists nest deeper than 64 levels");
    let hints = [read("x = 4;"), read("sphre();")].map(|result| result.unwrap_err().to_string());
    assert!(hints[0].contains("openscad -o model.csg model.scad") && hints[1].contains("did you mean `sphere`?"));
}

#[test]
fn curves_have_openscads_faces() {
    // $fn alone, its fraction cut off; $fa where the circle is large, $fs where it is small; never fewer than 5 then.
    for (radius, settings, corners) in [
        (1.0, "$fn = 7.9", 7),
        (1.0, "$fn = 1", 3),
        (100.0, "$fn = 0, $fa = 12, $fs = 2", 30),
        (3.0, "$fa = 12, $fs = 2", 10),
        (0.5, "", 5),
        (2.0, "$fa = 45, $fs = 0.001", 8),
    ] {
        let text = format!("cylinder(h = 2, r1 = {radius}, r2 = {radius}, {settings});").replace(", )", ")");
        near(volume(&text), 2.0 * polygon(radius, corners));
    }
    // A frustum's volume is h (A + sqrt(A a) + a) / 3, a cone's h A / 3.
    let frustum = 4.0 / 3.0 * (polygon(3.0, 40) + polygon(3f64.sqrt(), 40) + polygon(1.0, 40));
    near(volume("cylinder(h = 4, r1 = 3, r2 = 1, $fn = 40, center = true);"), frustum);
    near(volume("cylinder(h = 4, r1 = 0, r2 = 3, $fn = 40);"), 4.0 / 3.0 * polygon(3.0, 40));
    near(volume("cylinder(h = 4, r1 = 3, r2 = 0, $fn = 6);"), 4.0 / 3.0 * polygon(3.0, 6));
    for pieces in [3_usize, 4, 5, 8, 30, 31] {
        // Frusta between rings at the middles of equal parts of the half circle.
        let rings = pieces.div_ceil(2);
        let at = |ring: usize| PI * (ring as f64 + 0.5) / rings as f64;
        let slab = |ring: usize| {
            let (a, b) = (5.0 * at(ring).sin(), 5.0 * at(ring + 1).sin());
            let height = 5.0 * (at(ring).cos() - at(ring + 1).cos());
            height / 3.0 * (polygon(a, pieces) + polygon((a * b).sqrt(), pieces) + polygon(b, pieces))
        };
        near(volume(&format!("sphere(r = 5, $fn = {pieces});")), (0..rings - 1).map(slab).sum());
    }
}

#[test]
fn extrusions_have_the_volumes_of_their_slices() {
    near(volume("linear_extrude(height = 3) polygon(points = [[0,0],[6,0],[6,6],[0,6]]);"), 108.0);
    let ring = "difference() { square(size = 6, center = true); square(size = [2, 3], center = true); }";
    near(volume(&format!("linear_extrude(height = 2, center = true) {ring}")), 60.0);
    near(volume(&format!("linear_extrude(height = 3, scale = 0) {ring}")), 30.0);
    near(volume(&format!("linear_extrude(height = 3, scale = [0.5, 0.5]) {ring}")), 30.0 * (1.0 + 0.5 + 0.25));
    near(volume("linear_extrude(height = 2, v = [3, 0, 4]) square(size = 1);"), 1.6);
    // Sides that are twisted are cut along the shorter diagonal, which lies outside.
    let twisted = volume("linear_extrude(height = 3, twist = 90, slices = 200) square(size = [4, 2], center = true);");
    assert!((24.0..24.1).contains(&twisted), "{twisted}");
    // Guldin: area times the way of its middle, as a polygon instead of a circle.
    let whole = 2.0 * 4.0 * 12.0 * (TAU / 12.0).sin() * 4.0;
    near(volume("rotate_extrude($fn = 12) multmatrix([[1,0,0,3],[0,1,0,0]]) square(size = [2, 4]);"), whole);
    let quarter = "rotate_extrude(angle = 90, $fn = 12) multmatrix([[1,0,0,3],[0,1,0,0]]) square(size = [2, 4]);";
    near(volume(quarter), whole / 4.0);
    near(volume(&quarter.replace("3]", "-5]").replace("90", "-90")), whole / 4.0);
    // On the axis, where quads are triangles and edges nothing.
    near(volume("rotate_extrude($fn = 6) square(size = [3, 2]);"), 2.0 * polygon(3.0, 6));
    near(volume("rotate_extrude($fn = 6) polygon(points = [[0,0],[3,0],[0,3]]);"), polygon(3.0, 6));
}

#[test]
fn figures_are_combined_offset_and_summed() {
    let area = |figure: &str| volume(&format!("linear_extrude(height = 1) {{ {figure} }}"));
    let square = "square(size = 2);";
    near(area(&format!("{square} multmatrix([[1,0,0,1],[0,1,0,1]]) {square}")), 7.0);
    near(
        area("polygon(points = [[0,0],[4,0],[4,4],[0,4],[1,1],[3,1],[3,3],[1,3]], paths = [[0,1,2,3],[4,5,6,7]]);"),
        12.0,
    );
    near(area("multmatrix([[-1,0.5,0,0],[0,3,0,0]]) square(size = 2);"), 12.0);
    let l = "polygon(points = [[0,0],[4,0],[4,1],[1,1],[1,4],[0,4]]);";
    // At the notch the edges that move out meet; arcs of eight pieces a circle in the other five corners.
    near(area(&format!("offset(r = 1, $fn = 8) {l}")), 7.0 + 16.0 - 1.0 + 5.0 / 4.0 * polygon(1.0, 8));
    near(area(&format!("offset(delta = 1) {l}")), 7.0 + 16.0 - 1.0 + 5.0);
    near(area(&format!("offset(delta = -0.25) {l}")), 7.0 - 16.0 * 0.25 + 4.0 * 0.0625);
    let cut = 1.0 - (2.0 - 2f64.sqrt()).powi(2) / 2.0;
    near(area(&format!("offset(delta = 1, chamfer = true) {l}")), 7.0 + 16.0 - 1.0 + 5.0 * cut);
    assert!(is_empty("linear_extrude(height = 1) offset(r = -1) square(size = 1);"));
    // Where roundings double a corner, it is one all the same.
    let doubled = "polygon(points = [[0,0],[2,0],[2,1.9999999999],[2.0000000001,2],[2,2],[0,2]]);";
    near(area(&format!("offset(delta = 1) {doubled}")), 16.0);
}

#[test]
fn hulls_sums_and_sizes() {
    let cubes = "cube(size = 1); multmatrix([[1,0,0,3],[0,1,0,0],[0,0,1,0]]) cube(size = 1);";
    near(volume(&format!("hull() {{ {cubes} }}")), 4.0);
    near(volume("minkowski() { cube(size = [1, 2, 3]); cube(size = [1, 1, 1], center = true); }"), 2.0 * 3.0 * 4.0);
    near(
        volume("minkowski() { cube(size = [1, 2, 3]); cylinder(h = 1, r1 = 1, r2 = 1, $fn = 4); }"),
        4.0 * (2.0 + 6.0 + 2.0),
    );
    near(volume("resize(newsize = [4, 0, 0], auto = [0, 1, 0]) cube(size = [2, 3, 5]);"), 4.0 * 6.0 * 5.0);
    let hole = "multmatrix([[1,0,0,1],[0,1,0,1],[0,0,1,-1]]) cube(size = [1,1,9]);";
    let kept = format!("resize(newsize = [8, 8, 8]) difference() {{ cube(size = 4); {hole} }}");
    assert_eq!(flat(&kept).leaves[0].to_tree.matrix3.determinant().abs(), 64.0);
    let lost = "resize(newsize = [8, 8, 8]) difference() { cube(size = 4); cube(size = [9, 9, 1]); }";
    assert!(refused(lost).contains("has a size that is not known"));
    assert!(refused("minkowski() { sphere(r = 1); intersection() { cube(); sphere(); } }").contains("convex parts"));
    // The sum of an L and a cube, of prisms over the triangles of the L.
    let sum = flat(
        "minkowski() { linear_extrude(height = 1) polygon(points = [[0,0],[4,0],[4,1],[1,1],[1,4],[0,4]]); cube(); }",
    );
    assert_eq!(sum.leaves.len(), 4);
}

#[test]
fn empty_operands_are_openscads() {
    let flat_cube = "multmatrix([[1,0,0,0],[0,1,0,0],[0,0,0,0],[0,0,0,1]]) cube();";
    for nothing in ["group();", "cube(size = 0);", "sphere(r = -1);", flat_cube] {
        assert!(is_empty(nothing), "{nothing}");
        assert!(is_empty(&format!("difference() {{ {nothing} cube(); }}")), "{nothing}");
        assert!(is_empty(&format!("intersection() {{ cube(); {nothing} }}")), "{nothing}");
        for operation in ["difference", "union", "hull", "minkowski"] {
            near(volume(&format!("{operation}() {{ cube(); {nothing} }}")), 1.0);
        }
    }
    near(volume("difference() { %sphere(); cube(); *cube(size = 9); }"), 1.0);
    near(volume("difference() { cube(); square(size = 9); }"), 1.0);
    assert!(is_empty("intersection() { cube(); square(); }"));
    assert_eq!(warnings("cube(); square();"), ["m.csg:1: `square`: a plane figure among solids is left out"]);
    assert_eq!(warnings("%cube(); cube();"), ["objects in the background (`%`) are left out: 1"]);
    let unknown = "m.csg:2: `cube`: the argument `sizes` is not known and means nothing (did you mean `size`?)";
    assert_eq!(warnings("cube();\ncube(sizes = 2);"), [unknown]);
    near(volume("square(size = 3);"), 9.0);
    assert!(warnings("square();")[0].contains("plate of height 1"));
}

#[test]
fn only_what_is_marked_is_shown() {
    let text = "multmatrix([[2,0,0,0],[0,2,0,0],[0,0,2,0]]) { color([1,0,0]) { !cube(size = 3); } sphere(); }";
    near(volume(text), 27.0);
    assert_eq!(warnings(text), ["m.csg:1: nothing is shown but what is marked with `!`"]);
    near(volume("*group() { !cube(); } cube(size = 2);"), 8.0);
}

#[test]
fn outer_colours_count_and_holes_have_their_own() {
    let text = "color([1, 0, 0, 0.5]) color([0, 1, 0]) cube();\n\
        difference() { cube(size = 3); sphere(r = 1); color([0, 0, 1]) sphere(r = 2);\n\
        difference() { cube(size = 9); cube(size = 1); } }\ncolor([-1, -1, -1, 1]) color([0, 1, 0]) cube();";
    let description = read(text).unwrap();
    let tree = FlatTree::new(&description.solids[0]).unwrap();
    let names: Vec<_> = tree
        .leaves
        .iter()
        .map(|leaf| description.materials[leaf.material.unwrap_or(0) as usize].name.as_str())
        .collect();
    let cut = "color 157/203/81";
    assert_eq!(names, ["color 255/0/0 50%", "default", cut, "color 0/0/255", cut, "default", "color 0/255/0"]);
    let glassy = description.materials.iter().find(|material| material.name == names[0]).unwrap();
    assert_eq!((glassy.opacity, description.materials.len()), (0.5, 5));
    assert!((description.materials[0].diffuse - DVec3::new(0.947, 0.680, 0.025)).abs().max_element() < 1e-3);
}

#[test]
fn mirrored_and_inside_out_meshes_are_turned_outwards() {
    let faces = "faces = [[0,1,2],[0,3,1],[0,2,3],[1,3,2]]";
    let points = "points = [[0,0,0],[1,0,0],[0,1,0],[0,0,1]]";
    near(volume(&format!("polyhedron({points}, {faces});")), 1.0 / 6.0);
    let turned = "faces = [[0,2,1],[0,1,3],[0,3,2],[1,2,3]]";
    near(volume(&format!("polyhedron({points}, {turned});")), 1.0 / 6.0);
    assert!(warnings(&format!("polyhedron({points}, {turned});"))[0].contains("inside out"));
    near(
        volume("multmatrix([[-1,0,0,0],[0,1,0,0],[0,0,2,0]]) cylinder(h = 1, r1 = 1, r2 = 0.5, $fn = 30);"),
        2.0 * 7.0 / 12.0 * polygon(1.0, 30),
    );
    // Not closed, but outside of all operations: a surface in its place.
    let triangle = "polyhedron(points = [[0,0,0],[1,0,0],[0,1,0]], faces = [[0,1,2]]);";
    let open = read(&format!("multmatrix([[2,0,0,1],[0,1,0,0],[0,0,1,0]]) {triangle} cube();")).unwrap();
    let [solid, mesh] = &open.groups[0].items[..] else { panic!("{:?}", open.groups[0].items) };
    assert!(matches!(solid.kind, ItemKind::Solids(0)) && matches!(mesh.kind, ItemKind::Mesh(0)));
    assert_eq!(mesh.transform.transform_point3(DVec3::X), DVec3::X * 3.0);
    assert!(open.warnings[0].contains("shown as a surface"), "{:?}", open.warnings);
}

#[test]
fn faces_with_notches_are_cut_well() {
    let l = "[0,0,Z],[4,0,Z],[4,1,Z],[1,1,Z],[1,4,Z],[0,4,Z]";
    let points = format!("{},{}", l.replace('Z', "0"), l.replace('Z', "2"));
    let sides: Vec<String> = (0..6).map(|i| format!("[{},{},{},{}]", i, i + 6, (i + 1) % 6 + 6, (i + 1) % 6)).collect();
    let text = format!("polyhedron(points = [{points}], faces = [[0,1,2,3,4,5],[11,10,9,8,7,6],{}]);", sides.join(","));
    near(volume(&text), 14.0);
}

#[test]
fn what_has_few_faces_and_no_notch_is_planes() {
    let solid = |text: &str| flat(text).leaves[0].solid.clone();
    assert!(
        matches!(solid("cylinder(h = 1, r1 = 1, r2 = 1, $fn = 6);"), Solid::Polyhedron(p) if p.planes().len() == 8)
    );
    assert!(matches!(solid("sphere(r = 1, $fn = 30);"), Solid::Polyhedron(p) if p.planes().len() == 422));
    assert!(matches!(solid("sphere(r = 1, $fn = 60);"), Solid::Mesh(_)));
    let l = "linear_extrude(height = 1) polygon(points = [[0,0],[4,0],[4,1],[1,1],[1,4],[0,4]]);";
    assert!(matches!(solid(l), Solid::Mesh(_)));
    // Balls of as many faces are stored once.
    let description = read("sphere(r = 1, $fn = 60); sphere(r = 2, $fn = 60);").unwrap();
    let meshes = description.solids[0].nodes.iter().filter_map(|node| match &node.kind {
        NodeKind::Solid(Solid::Mesh(mesh)) => Some(std::sync::Arc::as_ptr(mesh)),
        _ => None,
    });
    assert_eq!(meshes.collect::<std::collections::HashSet<*const Mesh>>().len(), 1);
}
