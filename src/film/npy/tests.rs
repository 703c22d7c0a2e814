//! Tests of the NumPy files against bytes worked out by hand, hostile headers, and mutated files.
//! That NumPy itself agrees is tested in tests/film_python.rs.

use std::path::Path;

use super::*;
use crate::film::PlaneData;
use crate::film::tests::{XorShift, mutate};
use crate::ray::{Hits, Rays};

/// A version 1.0 file with this dictionary and data.
fn npy(dict: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((dict.len() as u16).to_le_bytes());
    bytes.extend(dict.as_bytes());
    bytes.extend(data);
    bytes
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn two_rays() -> Rays<f32> {
    let mut rays = Rays::new(2);
    rays.set(0, [1.0, 2.0, 3.0], [0.5, -0.25, 1e-30], 0.125, f32::INFINITY);
    rays.set(1, [-1.0, f32::NAN, 0.0], [0.0, 0.0, 2.0], 1.0, 0.0);
    rays
}

#[test]
fn a_ray_file_is_these_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("rays.npy");
    assert_eq!(write_rays(&path, [two_rays()]).unwrap(), 2);
    // Dictionary of 58 characters, padded with spaces and a line feed to 128 bytes in all: 118 = 0x76 after the ten.
    let mut expected = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    expected.extend(b"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 8), }");
    expected.resize(127, b' ');
    expected.push(b'\n');
    expected.extend(floats(&[1.0, 2.0, 3.0, 0.125, 0.5, -0.25, 1e-30, f32::INFINITY]));
    expected.extend(floats(&[-1.0, f32::NAN, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0]));
    assert_eq!(std::fs::read(&path).unwrap(), expected);
}

#[test]
fn rays_survive_in_batches() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("rays.npy");
    let mut many = Rays::new(3000);
    for i in 0..3000 {
        many.set(i, [i as f32; 3], [1.0; 3], 0.0, i as f32 + 0.5);
    }
    assert_eq!(write_rays(&path, [&many, &two_rays(), &Rays::new(0)]).unwrap(), 3002);
    let back = read_rays(&path).unwrap();
    assert_eq!((back.len(), back.live_count()), (3002, 3001));
    assert_eq!((back.org(2999), back.t_max[2999]), ([2999.0; 3], 2999.5));
    assert_eq!((back.dir(3000), back.t_min[3000]), ([0.5, -0.25, 1e-30], 0.125));
    assert_eq!(write_rays(&path, Vec::<Rays<f32>>::new()).unwrap(), 0);
    assert!(read_rays(&path).unwrap().is_empty());
}

#[test]
fn double_rays_are_rounded_to_nearest() {
    let third = 1.0_f64 / 3.0;
    let row = [third, 1e300, -1e-300, 0.1, 16_777_217.0, 16_777_219.0, 0.0, f64::INFINITY];
    let data: Vec<u8> = row.iter().flat_map(|x| x.to_le_bytes()).collect();
    let rays =
        parse_rays(Path::new("r"), &npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 8)}", &data)).unwrap();
    // Nearest f32 of 1/3 is 0x3eaaaaab, of 0.1 0x3dcccccd; 2^24 + 1 and + 3 are halfway and go to the even neighbour.
    assert_eq!(rays.org(0).map(f32::to_bits), [0x3eaa_aaab, f32::INFINITY.to_bits(), (-0.0_f32).to_bits()]);
    assert_eq!(rays.t_min[0].to_bits(), 0x3dcc_cccd);
    assert_eq!(rays.dir(0), [16_777_216.0, 16_777_220.0, 0.0]);
    assert_eq!(rays.t_max[0], f32::INFINITY);
}

#[test]
fn hits_survive_and_misses_stay_misses() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("hits.npy");
    let mut hits = Hits::<f64>::new(2);
    (hits.t[1], hits.u[1], hits.v[1], hits.prim[1], hits.inst[1]) = (2.5, 0.25, 0.5, 7, 3);
    assert_eq!(write_hits(&path, [&hits]).unwrap(), 2);
    let bytes = std::fs::read(&path).unwrap();
    let miss = [&f32::INFINITY.to_le_bytes()[..], &[0; 8], &[0xff; 8]].concat();
    assert_eq!(bytes[bytes.len() - 40..bytes.len() - 20], miss);
    let dict = "{'descr': [('t', '<f4'), ('u', '<f4'), ('v', '<f4'), ('prim', '<u4'), ('inst', '<u4')], ";
    assert_eq!(&bytes[10..10 + dict.len()], dict.as_bytes());
    let back = read_hits(&path).unwrap();
    assert_eq!((back.len(), back.hit_count(), back.t[0]), (2, 1, f32::INFINITY));
    assert_eq!((back.t[1], back.u[1], back.v[1], back.prim[1], back.inst[1]), (2.5, 0.25, 0.5, 7, 3));
}

#[test]
fn occlusion_and_planes_survive() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.npy");
    assert_eq!(write_occlusion(&path, [vec![0, 1], vec![1]]).unwrap(), 3);
    assert_eq!(read_occlusion(&path).unwrap(), [0, 1, 1]);
    let two = npy("{'descr': '|u1', 'fortran_order': False, 'shape': (2,)}", &[1, 2]);
    let what = parse_occlusion(Path::new("o"), &two).unwrap_err().to_string();
    assert_eq!(what, format!("o: byte {}: expected 0 or 1, found 2", two.len() - 1));

    for data in [
        PlaneData::F32((0..6).map(|i| i as f32 / 4.0).collect()),
        PlaneData::U32(vec![0, 1, 2, 3, 4, !0]),
        PlaneData::U8(vec![0, 1, 2, 3, 254, 255]),
    ] {
        write_plane(&path, 3, 2, &data).unwrap();
        assert_eq!(read_plane(&path).unwrap(), (3, 2, data.clone()));
        assert!(write_plane(&path, 2, 2, &data).is_err());
    }
}

#[test]
fn other_spellings_of_the_same_header_are_read() {
    let data = floats(&[1.0; 8]);
    for dict in [
        "{\"shape\":(1,8,),\"fortran_order\":False,\"descr\":\"<f4\"}",
        "  { 'descr' : '<f4' ,\n'fortran_order': False, 'shape': ( 1 , 8 ) , }  \n",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (00001, 8), }\n",
    ] {
        assert_eq!(parse_rays(Path::new("r"), &npy(dict, &data)).unwrap().len(), 1, "{dict}");
    }
    // Version 2.0 differs in four bytes of length.
    let dict = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 8)}";
    let v2 = [b"\x93NUMPY\x02\x00", &(dict.len() as u32).to_le_bytes()[..], dict.as_bytes(), &data].concat();
    assert_eq!(parse_rays(Path::new("r"), &v2).unwrap().len(), 1);
}

/// (dictionary, byte of the message, part of the message); dictionaries start at byte 10. All with 32 bytes of data.
const BAD_RAYS: [(&str, u64, &str); 24] = [
    ("", 10, "expected `{`, found the header's end"),
    ("{", 11, "expected a quoted string"),
    ("{}", 10, "lacks 'descr'"),
    ("{'descr': '<f4', 'fortran_order': False}", 10, "lacks 'shape'"),
    ("{'descr': '<f4', 'shape': (1, 8)}", 10, "lacks 'fortran_order'"),
    ("{'descr': '>f4', 'fortran_order': False, 'shape': (1, 8)}", 20, "dtype is '>f4', expected '<f4' or '<f8'"),
    ("{'descr': '<i4', 'fortran_order': False, 'shape': (1, 8)}", 20, "dtype is '<i4'"),
    ("{'descr': [('t', '<f4')], 'fortran_order': False, 'shape': (1, 8)}", 20, "dtype is [('t', '<f4')]"),
    ("{'descr': {'names': ['t']}, 'fortran_order': False, 'shape': (1, 8)}", 20, "expected a quoted string, found `{`"),
    ("{'descr': [[[[", 21, "expected `(`, found `[`"),
    ("{'descr': [('t', [('x', '<f4')])]", 27, "expected a quoted string, found `[`"),
    ("{'descr': '<f4', 'fortran_order': True, 'shape': (1, 8)}", 44, "fortran_order is True"),
    ("{'descr': '<f4', 'fortran_order': 1, 'shape': (1, 8)}", 44, "expected `True` or `False`, found `1`"),
    ("{'descr': '<f4', 'fortran_order': False, 'shape': (8,)}", 60, "shape is (8,), expected (N, 8)"),
    ("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 4)}", 60, "shape is (2, 4), expected (N, 8)"),
    ("{'descr': '<f4', 'fortran_order': False, 'shape': (-1, 8)}", 61, "an integer that is not negative, found `-`"),
    ("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 8)}", 60, "does not match the 32 bytes of data"),
    // 2^59 rows of 32 bytes are 2^64 bytes; 2^61 rows of 8 are 2^64 elements; both must not wrap to a small number.
    ("{'descr': '<f4', 'fortran_order': False, 'shape': (576460752303423489, 8)}", 60, "does not match"),
    ("{'descr': '<f4', 'fortran_order': False, 'shape': (2305843009213693953, 8)}", 60, "does not match"),
    ("{'descr': '<f4', 'fortran_order': False, 'shape': (18446744073709551616, 8)}", 61, "an integer below 2^64"),
    ("{'descr': '<f4', 'descr': '<f4'}", 27, "key 'descr' for the second time"),
    ("{'descr': '<f4', 'evil': 1}", 27, "key 'evil', expected"),
    ("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 8)} 7", 68, "nothing but spaces"),
    ("{'descr': '<f4\\n'", 24, "plain ASCII"),
];

#[test]
fn hostile_headers_name_byte_and_expectation() {
    for (dict, byte, what) in BAD_RAYS {
        let message = parse_rays(Path::new("r.npy"), &npy(dict, &[0; 32])).unwrap_err().to_string();
        assert!(message.starts_with(&format!("r.npy: byte {byte}: ")) && message.contains(what), "{dict}\n{message}");
    }
}

#[test]
fn hostile_beginnings_and_ends_are_errors() {
    let error = |bytes: &[u8]| parse_rays(Path::new("r"), bytes).unwrap_err().to_string();
    let good = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 8)}", &[0; 32]);
    for cut in 0..good.len() {
        error(&good[..cut]);
    }
    assert!(error(b"").contains("byte 0: the file ends inside the .npy signature"));
    assert!(error(&good[..9]).contains("byte 9: the file ends inside the header's length"));
    assert!(error(&good[..40]).contains("byte 40: the file ends inside the header"));
    assert!(error(&[&good[..], &[0]].concat()).contains("the 33 bytes of data"));
    assert!(error(b"PK\x03\x04........").contains("starts with \\x93NUMPY"));
    assert!(error(b"\x93NUMPY\x03\x00\xff\xff\xff\xff").contains("found 3.0"));
    assert!(error(b"\x93NUMPY\x02\x00\xff\xff\xff\xff").contains("claims 4294967295 bytes"));
    let hit_as_ray = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 8)}", &[0; 32]);
    assert!(parse_hits(Path::new("h"), &hit_as_ray).unwrap_err().to_string().contains("('inst', '<u4')]: a hit file"));
    let axes = "1, ".repeat(65);
    let deep = npy(&format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({axes})}}"), &[0; 32]);
    assert!(error(&deep).contains("at most 64 axes"));
    // A shape as large as the file says must not be believed by the other readers either.
    let huge = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (4294967295, 4294967295)}", &[0; 32]);
    assert!(parse_plane(Path::new("p"), &huge).is_err());
}

#[test]
fn mutated_files_never_panic() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.npy");
    let mut seeds = Vec::new();
    write_rays(&path, [two_rays()]).unwrap();
    seeds.push(std::fs::read(&path).unwrap());
    write_hits(&path, [Hits::<f32>::new(3)]).unwrap();
    seeds.push(std::fs::read(&path).unwrap());
    write_occlusion(&path, [[0, 1, 1, 0]]).unwrap();
    seeds.push(std::fs::read(&path).unwrap());
    write_plane(&path, 3, 2, &PlaneData::U32(vec![5; 6])).unwrap();
    seeds.push(std::fs::read(&path).unwrap());
    let (mut random, mut accepted) = (XorShift(0x9e37_79b9_7f4a_7c15), 0);
    for round in 0..40_000 {
        let bytes = mutate(&seeds[round % seeds.len()], &mut random);
        let file = Path::new("m");
        // What is accepted must account for every byte of the file: no reader may invent or lose elements.
        let sizes = [
            parse_rays(file, &bytes).ok().map(|r| r.len() * 32),
            parse_hits(file, &bytes).ok().map(|h| h.len() * 20),
            parse_occlusion(file, &bytes).ok().map(|o| o.len()),
            parse_plane(file, &bytes).ok().map(|(_, _, data)| data.len() * 4),
        ];
        for size in sizes.into_iter().flatten() {
            accepted += 1;
            assert!(size <= bytes.len());
        }
    }
    // The loop must reach beyond the header to mean anything.
    assert!((1000..39_000).contains(&accepted), "{accepted}");
}

#[test]
fn a_third_axis_is_planes() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("stack.npy");
    write_stack(&path, 2, 1, &[&[1.0, 2.0], &[3.0, 4.0], &[5.0, 6.0]]).unwrap();
    let film = read_film(&path).unwrap();
    assert_eq!((film.width, film.height, film.planes.len()), (2, 1, 3));
    assert_eq!((film.f32_plane("R").unwrap(), film.f32_plane("B").unwrap()), (&[1.0, 2.0][..], &[5.0, 6.0][..]));
    write_stack(&path, 1, 1, &[&[1.0], &[2.0]]).unwrap();
    assert_eq!(read_film(&path).unwrap().f32_plane("1").unwrap(), [2.0]);
    write_plane(&path, 1, 2, &PlaneData::U32(vec![7, 8])).unwrap();
    assert_eq!(read_film(&path).unwrap().u32_plane("Y").unwrap(), [7, 8]);
    assert_eq!(kind(&path).unwrap(), Kind::Numbers);
    let rays = write_rays(&path, [Rays::<f32>::new(3)]).and_then(|_| read_film(&path)).unwrap();
    assert_eq!((rays.width, rays.height), (8, 3), "rays are numbers, too");
    write_occlusion(&path, [[1, 0]]).unwrap();
    assert!(read_film(&path).unwrap_err().to_string().contains("(height, width)"));
    assert_eq!(kind(&path).unwrap(), Kind::Occlusion);
}
