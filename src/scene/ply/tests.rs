//! Hand-written files for every feature of the format.

use super::header::Scalar;
use super::*;

fn read(bytes: impl AsRef<[u8]>) -> Mesh {
    parse(Path::new("m.ply"), bytes.as_ref()).unwrap()
}

fn first_line_of_error(bytes: impl AsRef<[u8]>) -> String {
    let error = parse(Path::new("m.ply"), bytes.as_ref()).unwrap_err();
    error.to_string().lines().next().unwrap().to_owned()
}

/// A header with `vertices` and `faces` of the usual types.
fn header(format: &str, vertices: u64, faces: u64) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

fn square() -> Vec<DVec3> {
    vec![DVec3::ZERO, DVec3::X, DVec3::new(1., 1., 0.), DVec3::Y]
}

#[test]
fn text_polygons_are_fanned_in_place() {
    let mesh = read(header("ascii", 4, 5) + SQUARE + "3 2 1 0\n4 0 1 2 3\n0\n2 0 1\n3 1 2 3\n");
    assert_eq!(mesh.positions, square());
    assert_eq!(mesh.triangles, [[2, 1, 0], [0, 1, 2], [0, 2, 3], [1, 2, 3]]);
    assert_eq!(mesh.groups, []);
    assert_eq!(read(header("ascii", 0, 0)), Mesh::default());
    assert_eq!(
        read(
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\nend_header\n1 2 3"
        )
        .positions,
        [DVec3::new(1., 2., 3.)]
    );
}

#[test]
fn polygons_that_a_fan_would_not_cover_are_cut() {
    let text = header("ascii", 4, 1) + "2 0 0\n0 2 0\n-2 0 0\n0 0.5 0\n" + "4 0 1 2 3\n";
    let mesh = read(&text);
    assert_eq!((mesh.triangles.as_slice(), mesh.area()), ([[1, 2, 3], [3, 0, 1]].as_slice(), 3.0));
    // Faces before their vertices.
    let list = "property list uchar int vertex_indices\n";
    let head = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let turned = text.replace(&format!("{head}element face 1\n{list}"), &format!("element face 1\n{list}{head}"));
    let turned = turned.replace("4 0 1 2 3\n", "").replace("end_header\n", "end_header\n4 0 1 2 3\n");
    assert_ne!(turned, text);
    assert_eq!(read(turned), mesh);
}

#[test]
fn text_values_have_their_declared_type() {
    let head =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty double y\nproperty uchar z\nend_header\n";
    let mesh = read(format!("{head}0.1 0.1 7"));
    assert_eq!(mesh.positions, [DVec3::new(f64::from(0.1_f32), 0.1, 7.0)]);
    let mesh = read(format!("{head}nan -inf 7"));
    assert!(mesh.positions[0].x.is_nan() && mesh.positions[0].y == f64::NEG_INFINITY);
}

#[test]
fn header_with_any_line_end_and_comments() {
    let text = header("ascii", 4, 1) + SQUARE + "3 0 1 2\n";
    let text = text.replacen("element face", "comment a\nobj_info element\n\nelement face", 1);
    let expected = read(&text);
    assert_eq!(expected.triangles, [[0, 1, 2]]);
    assert_eq!(read(text.replace('\n', "\r\n")), expected);
    assert_eq!(read(text.replace('\n', "\r")), expected);
}

/// Bytes of the number `value` in the type `scalar`.
fn number(scalar: Scalar, big: bool, value: i8) -> Vec<u8> {
    let mut bytes = match scalar {
        Scalar::I8 => value.to_le_bytes().to_vec(),
        Scalar::U8 => (value as u8).to_le_bytes().to_vec(),
        Scalar::I16 => i16::from(value).to_le_bytes().to_vec(),
        Scalar::U16 => (value as u16).to_le_bytes().to_vec(),
        Scalar::I32 => i32::from(value).to_le_bytes().to_vec(),
        Scalar::U32 => (value as u32).to_le_bytes().to_vec(),
        Scalar::F32 => f32::from(value).to_le_bytes().to_vec(),
        Scalar::F64 => f64::from(value).to_le_bytes().to_vec(),
    };
    if big {
        bytes.reverse();
    }
    bytes
}

const TYPES: [(&str, Scalar); 16] = [
    ("char", Scalar::I8),
    ("uchar", Scalar::U8),
    ("short", Scalar::I16),
    ("ushort", Scalar::U16),
    ("int", Scalar::I32),
    ("uint", Scalar::U32),
    ("float", Scalar::F32),
    ("double", Scalar::F64),
    ("int8", Scalar::I8),
    ("uint8", Scalar::U8),
    ("int16", Scalar::I16),
    ("uint16", Scalar::U16),
    ("int32", Scalar::I32),
    ("uint32", Scalar::U32),
    ("float32", Scalar::F32),
    ("float64", Scalar::F64),
];

#[test]
fn every_type_in_every_place_and_both_byte_orders() {
    for big in [false, true] {
        let format = if big { "binary_big_endian" } else { "binary_little_endian" };
        for (coordinate, c) in TYPES {
            for (length, l) in TYPES {
                for (item, i) in TYPES {
                    // Extra properties (a list among them) between the wanted ones, and z before x.
                    let mut bytes = format!(
                        "ply\nformat {format} 1.0\nelement vertex 3\nproperty {coordinate} z\nproperty list {length} {item} \
                         extra\nproperty {coordinate} x\nproperty {coordinate} y\nelement camera 2\nproperty {item} a\n\
                         element face 1\nproperty {item} flag\nproperty list {length} {item} vertex_index\n\
                         property {coordinate} more\nend_header\n"
                    )
                    .into_bytes();
                    for v in 0..3 {
                        let parts = [number(c, big, v), number(l, big, 2), number(i, big, 9), number(i, big, 9)];
                        bytes.extend(parts.concat());
                        bytes.extend([number(c, big, 2 * v), number(c, big, 100 + v)].concat());
                    }
                    bytes.extend([number(i, big, 5), number(i, big, 6), number(i, big, 7)].concat());
                    bytes.extend([number(l, big, 3), number(i, big, 2), number(i, big, 0), number(i, big, 1)].concat());
                    bytes.extend(number(c, big, 1));
                    let mesh = read(&bytes);
                    let expected = [0., 1., 2.].map(|v| DVec3::new(2. * v, 100. + v, v));
                    assert_eq!(mesh.positions, expected, "{format} {coordinate} {length} {item}");
                    assert_eq!(mesh.triangles, [[2, 0, 1]]);
                }
            }
        }
    }
}

#[test]
fn strips_keep_the_winding_and_restart() {
    let text = header("ascii", 6, 0).replace("face 0", "tristrips 1") + &"0 0 0\n".repeat(6);
    let mesh = read(text + "9 0 1 2 3 4 -1 3 4 5\n");
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4], [3, 4, 5]]);
}

#[test]
fn counts_that_cannot_be_true_are_refused_before_allocation() {
    let usual = "m.ply:3:16: 4000000000 rows of `vertex` need at least";
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        assert!(first_line_of_error(header(format, 4_000_000_000, 0)).starts_with(usual));
        let error = first_line_of_error(header(format, 0, 4_000_000_000));
        assert!(error.starts_with("m.ply:7:14: 4000000000 rows of `face` need at least"), "{error}");
        let error = first_line_of_error(header(format, i64::MAX as u64, 0));
        assert!(error.starts_with("m.ply:3:16: 9223372036854775807 rows"), "{error}");
    }
    // Rows of no bytes are true however many there are, and cost nothing.
    let empty_rows = header("ascii", 4, 1).replacen("end_header", "element air 9000000000000000000\nend_header", 1);
    assert_eq!(read(empty_rows + SQUARE + "3 0 1 2").triangles, [[0, 1, 2]]);
}

#[test]
fn header_errors_say_where() {
    let good = header("ascii", 4, 1) + SQUARE + "3 0 1 2\n";
    for (from, to, expected) in [
        ("ply\n", "pls\n", "1:1: expected a PLY header, which begins with the line `ply`"),
        ("ascii", "ascii2", "2:8: expected ascii, binary_little_endian or binary_big_endian, found `ascii2`"),
        ("1.0", "1.1", "2:14: expected the version 1.0, found `1.1`"),
        ("format ascii 1.0\n", "", "8:1: expected a `format` before `end_header`"),
        ("element vertex 4\n", "", "3:1: expected an `element` before its properties"),
        ("vertex 4", "vertex -4", "3:16: expected the number of rows, found `-4`"),
        ("vertex 4", "vertex", "3:15: expected the number of rows"),
        ("vertex 4", "vertex 4 4", "3:18: expected the end of the line, found `4`"),
        ("float x", "flota x", "4:10: expected a number type such as float or uchar, found `flota`"),
        ("float x", "float w", "3:16: expected a scalar property `x` of the element `vertex`"),
        ("uchar int", "uchar", "8:21: expected a number type such as float or uchar, found `vertex_indices`"),
        ("vertex_indices", "corners", "7:14: expected a list `vertex_indices` or `vertex_index` of the element `face`"),
        ("element face", "element vertex", "7:1: a second element `vertex`"),
        ("element vertex", "element point", "1:1: expected an element `vertex` in the header"),
        ("end_header", "end", "9:1: expected a header statement or `end_header`, found `end`"),
    ] {
        assert_eq!(first_line_of_error(good.replacen(from, to, 1)), format!("m.ply:{expected}"));
    }
    let error = parse(Path::new("m.ply"), good.replacen("float x", "flot x", 1).as_bytes()).unwrap_err();
    assert!(error.to_string().ends_with("help: did you mean `float`?"));
}

#[test]
fn row_errors_say_where() {
    let text = |faces: &str| first_line_of_error(header("ascii", 4, 1) + SQUARE + faces);
    assert_eq!(text("3 0 1 4"), "m.ply:14:7: expected a vertex index from 0 and below 4, found 4");
    assert_eq!(text("3 0 1 -1"), "m.ply:14:7: expected a vertex index from 0 and below 4, found -1");
    assert_eq!(text("3 0 1 1.5"), "m.ply:14:7: expected an integer, found `1.5`");
    assert_eq!(text("-1 0 1 2"), "m.ply:14:1: expected the length of a list, found -1");
    assert_eq!(text("250 0 1 2"), "m.ply:14:1: a list of 250 items does not fit into the 7 bytes left");
    assert_eq!(text("3 0 1 "), "m.ply:14:7: expected a number, found the end of the file");
    assert_eq!(text("3 0 1 2\n5"), "m.ply:15:1: expected the end of the file, found `5`");
    let error = first_line_of_error(header("ascii", 1, 0) + "0 x 0\n");
    assert_eq!(error, "m.ply:10:3: expected a number of the property's type, found `x`");

    let head = header("binary_little_endian", 1, 1);
    for (row, offset, expected) in [
        (&[2, 0, 0, 0, 0, 1, 0, 0, 0][..], 5, "expected a vertex index from 0 and below 1, found 1"),
        (&[2, 0, 0, 0, 0], 0, "a list of 2 items does not fit into the 4 bytes left"),
        (&[1, 0, 0, 0, 0, 8], 5, "expected the end of the file after the last element, found 1 more bytes"),
    ] {
        let error = first_line_of_error([head.as_bytes(), &[0; 12], row].concat());
        assert_eq!(error, format!("m.ply: byte {}: {expected}", head.len() + 12 + offset));
    }
}

#[test]
fn every_truncation_is_an_error() {
    let text = header("ascii", 4, 2) + SQUARE + "3 0 1 2\n4 0 1 2 3";
    for length in 0..text.len() {
        assert!(parse(Path::new("m.ply"), &text.as_bytes()[..length]).is_err(), "{length}");
    }
    let mut binary = header("binary_big_endian", 1, 1).into_bytes();
    binary.extend([[0; 12].as_slice(), &[3], &[0; 12]].concat());
    assert_eq!(read(&binary).triangles, [[0, 0, 0]]);
    for length in 0..binary.len() {
        assert!(parse(Path::new("m.ply"), &binary[..length]).is_err(), "{length}");
    }
}

#[test]
fn normals_and_coordinates_in_any_order_and_only_in_full() {
    let head = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float nz\nproperty float x\nproperty float t\n\
                property float y\nproperty float z\nproperty uchar s\nproperty float nx\nproperty float ny\nend_header\n";
    let mesh = read(format!("{head}6 1 8 2 3 7 4 5\n0 0 0.5 0 0 1 0 0\n"));
    assert_eq!(mesh.positions, [DVec3::new(1., 2., 3.), DVec3::ZERO]);
    assert_eq!(mesh.normals.values, [[4.0, 5.0, 6.0], [0.0; 3]]);
    assert_eq!(mesh.uvs[0].values, [[7.0, -7.0], [1.0, 0.5]]);
    let half =
        read(format!("{}6 1 8 2 3 7 4 5\n0 0 0.5 0 0 1 0 0\n", head.replace(" ny", " red").replace(" s\n", " q\n")));
    assert!(half.normals.values.is_empty() && half.uvs[0].values.is_empty());
    let other = read(format!(
        "{}6 1 8 2 3 7 4 5\n0 0 0.5 0 0 1 0 0\n",
        head.replace(" t\n", " texture_v\n").replace(" s\n", " texture_u\n")
    ));
    assert_eq!(other.uvs, mesh.uvs);
}
