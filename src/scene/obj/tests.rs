//! Small files for every feature of the format.

use super::*;
use crate::scene::mesh::Attribute;

fn read(text: &str) -> ObjFile {
    parse(Path::new("m.obj"), text.as_bytes()).unwrap()
}

fn first_line_of_error(text: &str) -> String {
    let error = parse(Path::new("m.obj"), text.as_bytes()).unwrap_err();
    error.to_string().lines().next().unwrap().to_owned()
}

#[test]
fn all_index_forms_name_the_same_triangle() {
    let vertices = "v 0 0 0\nv 1 0 0 1.0\nv 0 1 0 0.5 0.5 0.5\nvt 0 0\nvn 0 0 1\n";
    for face in ["f 1 2 3", "f 1/1 2/1 3/1", "f 1//1 2//1 3//1", "f 1/1/1 2/1/1 3/1/1", "f -3 -2/-1 -1/-1/-1"] {
        let mesh = read(&format!("{vertices}{face}")).mesh;
        assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
        assert_eq!(mesh.triangles, [[0, 1, 2]], "{face}");
        assert_eq!(mesh.groups, []);
    }
}

#[test]
fn corners_have_coordinates_and_normals_of_their_own() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1/2 3/1/1 2\nvt 0 1\nvt 0.5\nvn 0 0 1\n\
                f -3/-1/-1 2/9/1 3//0\n";
    let out = read(text);
    let (uvs, normals) = (&out.mesh.uvs[0], &out.mesh.normals);
    assert_eq!((uvs.values.as_slice(), normals.values.len()), ([[0.0, 0.0], [0.5, 1.0], [0.0, 0.0]].as_slice(), 2));
    assert_eq!(uvs.indices, [[2, 2, 2], [1, 0, 2], [1, 2, 2]], "2 stands for none");
    assert_eq!(
        (normals.indices.as_slice(), normals.values[1]),
        ([[1, 1, 1], [1, 0, 1], [0, 0, 1]].as_slice(), [0.0; 3])
    );
    assert_eq!(out.dangling, 2, "9 and 0 name nothing");
    // Numbered like the vertices: no indices of their own.
    let same = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nf 1/1 3/3 2/2\n").mesh;
    assert_eq!((same.uvs[0].values.len(), same.uvs[0].indices.len()), (3, 0));
    assert_eq!(same.uvs[0].corners(0, same.triangles[0]), Some([[0.0, 1.0], [0.0, 0.0], [1.0, 1.0]]));
    assert_eq!(same.normals, Attribute::default(), "no corner has one");
}

#[test]
fn polygons_are_fanned_in_place() {
    let five = "v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\n";
    let mesh = read(&format!("{five}f 3 2 1\nf 1 2 3 4 5\nf 5 4 3\nf 1 2\n")).mesh;
    assert_eq!(mesh.triangles, [[2, 1, 0], [0, 1, 2], [0, 2, 3], [0, 3, 4], [4, 3, 2]]);
}

#[test]
fn polygons_that_a_fan_would_not_cover_are_cut() {
    // An arrow, then an L from the corner that sees least of it; their vertices once before and once behind.
    let vertices = "v 2 0 0\nv 0 2 0\nv -2 0 0\nv 0 0.5 0\nv 0 0 0\nv 2 2 0\nv 1 2 0\nv 1 1 0\nv 0 1 0\n\
                    vt 0 0\nvt 0 1\nvt 0 2\nvt 0 3\nvn 0 0 1\n";
    let faces = "f 1/4 2/3 3/2 4/1\nf 7//1 8//1 9//1 5 1//1 6//1\n";
    for text in [format!("{vertices}{faces}"), format!("{faces}{vertices}")] {
        let out = read(&text);
        let mesh = &out.mesh;
        assert_eq!(mesh.triangles[..2], [[1, 2, 3], [3, 0, 1]]);
        assert_eq!(mesh.uvs[0].indices[..2], [[2, 1, 0], [0, 3, 2]], "coordinates follow their corners");
        let z = |i: usize| {
            let [a, b, c] = mesh.corners(i);
            (b - a).cross(c - a).z / 2.0
        };
        assert_eq!(mesh.triangles.len(), 6);
        assert!((0..6).all(|i| z(i) > 0.0), "{:?}", mesh.triangles);
        assert_eq!([(0..2).map(z).sum::<f64>(), (2..6).map(z).sum()], [3.0, 3.0]);
        for (vertices, normals) in mesh.triangles[2..].iter().zip(&mesh.normals.indices[2..]) {
            assert_eq!(normals.map(|normal| normal == 1), vertices.map(|vertex| vertex == 4), "only 5 has none");
        }
        assert_eq!(out.large_polygons, 0);
    }
    let star = |i: u32| [2.0, 1.0][i as usize % 2] * glam::DVec2::from_angle(f64::from(i) * 1e-3);
    let corners: String = (0..5000).map(star).map(|p| format!("v {} {} 0\n", p.x, p.y)).collect();
    let face: String = (1..=5000).map(|i| format!(" {i}")).collect();
    let out = read(&format!("{corners}f{face}\n"));
    assert_eq!((out.large_polygons, out.mesh.triangles.last()), (1, Some(&[0, 4998, 4999])));
}

#[test]
fn line_ends_continuations_comments_and_blanks() {
    let text =
        "\u{feff}# C:\\models\\\r\n\r\n  v 0 0 0 # origin\r\nv\t1 0\\\r\n 0\r\nv 0 1 0\\\r\n\r\n#\r\nf 1 2 \\\r\n3";
    for text in [text.to_owned(), text.replace("\r\n", "\n"), text.replace("\r\n", "\r")] {
        let out = read(&text);
        assert_eq!(out.mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
        assert_eq!((out.mesh.triangles.as_slice(), out.ignored), ([[0, 1, 2]].as_slice(), 0));
    }
}

#[test]
fn groups_are_runs_of_name_and_material() {
    let out = read(
        "mtllib a.mtl my file.MTL rest\nv 0 0 0\nf 1 1 1\no box\nusemtl Material #25\nf 1 1 1\nf 1 1 1\n\
         g box\nf 1 1 1\nusemtl red\ng lid  top\nf 1 1 1\ng\n",
    );
    let group = |name: &str, material: &str, first, count| MeshGroup {
        name: name.into(),
        material: material.into(),
        first,
        count,
    };
    let expected = [group("", "", 0, 1), group("box", "Material #25", 1, 3), group("lid top", "red", 4, 1)];
    assert_eq!(out.mesh.groups, expected);
    assert_eq!(out.material_libs, ["a.mtl", "my file.MTL", "rest"]);
}

#[test]
fn odd_but_valid() {
    assert_eq!(read(""), ObjFile::default());
    let out = read("f 2 3 1\nv nan -inf 1e400\nv .5 +5. 1E-3\nv 0 0 0\nl 1 2\np 1\ncurv 0 1 \\\n 2\nsurf\nf 1 2\n");
    assert_eq!(out.mesh.triangles, [[1, 2, 0]], "faces may come before their vertices");
    assert!(out.mesh.positions[0].x.is_nan());
    let normal = read("v 0 0 0\nvn 0 -nan(ind) 1.#QNAN\nf 1//1 1//1 1//1\n").mesh.normals.values[0];
    assert!(normal[0] == 0.0 && normal[1].is_nan() && normal[2].is_nan());
    assert_eq!(out.mesh.positions[0].y, f64::NEG_INFINITY);
    assert_eq!(out.mesh.positions[1], DVec3::new(0.5, 5.0, 1e-3));
    assert_eq!(out.ignored, 3, "curv, surf and a face of two corners");
    assert_eq!(out.first_ignored, Some(("`curv`".into(), 7)));
    let out = read("# a\r\nv 0 0 0\r\nfo 1 1 1\r\ns 1\r\nf 1 1\r\nsurf\r\n");
    assert_eq!((out.mesh.triangles.len(), out.ignored), (1, 2), "an `fo` of old files is an `f`");
    assert_eq!(out.first_ignored, Some(("`f` of 2 corners".into(), 5)));
}

#[test]
fn errors_say_where() {
    for (text, expected) in [
        ("v 0 0 0\nv 0 x1 0", "m.obj:2:5: expected a number, found `x1`"),
        ("v 0 0\n", "m.obj:1:6: expected the 3 coordinates of a vertex, found 2"),
        ("v 0 0 0 0 0 0 0 0", "m.obj:1:17: expected the end of the line: a vertex has at most 7 numbers"),
        ("v 0 0 0\nf 1 1 0", "m.obj:2:7: vertex index 0 names no vertex: 1 are defined up to here"),
        ("v 0 0 0\nf -2 1 1", "m.obj:2:3: vertex index -2 names no vertex: 1 are defined up to here"),
        ("v 0 0 0\n\n f 1 1 2", "m.obj:3:8: vertex index 2 names no vertex: the file has 1"),
        ("f 1 1 99999999999", "m.obj:1:7: vertex index 99999999999 names no vertex: 0 are defined up to here"),
        ("f 1/2/3/4", "m.obj:1:3: expected a vertex index (v, v/vt, v//vn or v/vt/vn), found `1/2/3/4`"),
        ("f 1/x", "m.obj:1:3: expected a vertex index (v, v/vt, v//vn or v/vt/vn), found `1/x`"),
        ("vn 0 1", "m.obj:1:7: expected the 3 numbers of a normal, found 2"),
        ("vt u", "m.obj:1:4: expected a number, found `u`"),
        ("vt", "m.obj:1:3: expected the coordinates u and v, found none"),
        ("\nsolid x", "m.obj:2:1: expected an OBJ statement such as `v` or `f`, found `solid`"),
    ] {
        assert_eq!(first_line_of_error(text), expected);
    }
}
