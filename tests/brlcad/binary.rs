//! Binary BRL-CAD databases of version 5 against the same models as text: objects, descriptions, hits. And what is
//! damaged or malicious.

use std::io::Write;
use std::path::Path;

use lanecast::error::{Error, Result};
use lanecast::ray::{Hits, Rays};
use lanecast::scene::brlcad::describe::{Options, describe};
use lanecast::scene::brlcad::regions::walk;
use lanecast::scene::brlcad::{Database, ObjectKind, Region, choose_tops, parse};
use lanecast::scene::description::Description;
use lanecast::scene::load::{LoadOptions, load};
use lanecast::scene::world::{Preset, World};
use lanecast::trace::{Scratch, engine};

use crate::brlcad_support;
use brlcad_support::g::{Packing, Writer, doubles};

/// Distance between two solids of the model.
const STEP: f64 = 20.0;

fn read(bytes: &[u8]) -> Result<Database> {
    parse(Path::new("d.g"), bytes)
}

fn refused(bytes: &[u8]) -> String {
    let error = read(bytes).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

/// Kinds: name, minor type, body, what the text says of it.
fn kinds() -> Vec<(&'static str, u8, Vec<u8>, String)> {
    let counted = |count: u32, values: &[f64]| [count.to_be_bytes().to_vec(), doubles(values)].concat();
    let plain = |name, minor, values: &[f64], keys: &[(&str, usize)]| {
        let mut left = values;
        let text = keys.iter().map(|&(key, count)| {
            let (now, rest) = left.split_at(count);
            left = rest;
            let list: Vec<String> = now.iter().map(f64::to_string).collect();
            format!(" {key} {{{}}}", list.join(" "))
        });
        (name, minor, doubles(values), text.collect::<String>())
    };
    let cube = [[-3., -2., 0.], [3., -2., 0.], [3., 2., 0.], [-3., 2., 0.]];
    let arb = [cube, cube.map(|[x, y, _]| [0.5 * x, 0.25 * y, 4.0])].concat().concat();
    let corners: Vec<String> = (1..=8).map(|i| format!("V{i}")).collect();
    let corners: Vec<(&str, usize)> = corners.iter().map(|key| (key.as_str(), 3)).collect();
    let planes =
        [[1., 0., 0., 3.], [-1., 0., 0., 2.], [0., 1., 0., 3.], [0., -1., 0., 4.], [0., 0., 1., 1.], [0., 0., -1., 2.]];
    let turn: [[f64; 6]; 3] = [[-6., 0., 0., 1., 2., 3.], [3., 0., 0., 1., 2., 3.], [3., 6., 0., 1., 2., 3.]];
    let points: String = (0..3)
        .map(|i| {
            let [x, y, z, inner, outer, bend] = turn[i];
            format!(" V{i} {{{x} {y} {z}}} O{i} {outer} I{i} {inner} R{i} {bend}")
        })
        .collect();
    let (vertices, faces) =
        ([[0., 0., 0.], [5., 0., 0.], [0., 5., 0.], [0.5, 0.5, 4.]], [[0u32, 1, 2], [0, 1, 3], [1, 2, 3], [0, 3, 2]]);
    let numbers = |list: [u32; 3]| list.map(u32::to_be_bytes).concat();
    let mesh = [
        [4u32, 4].map(u32::to_be_bytes).concat(),
        vec![1, 2, 0],
        doubles(vertices.as_flattened()),
        faces.iter().flat_map(|&face| numbers(face)).collect(),
    ];
    let list = |items: String| format!("{{{items}}}");
    let mesh_text = format!(
        " mode volume orient no V {} F {}",
        list(vertices.iter().map(|[x, y, z]| format!("{{{x} {y} {z}}} ")).collect()),
        list(faces.iter().map(|[a, b, c]| format!("{{{a} {b} {c}}} ")).collect()),
    );
    let paraboloid = [0., 0., 0., 0., 0., 5., 2., 0., 0., 3., 2.];
    let cylinder = [0., 0., 0., 0., 6., 0., 0., 0., -3., 2.];
    vec![
        plain("tor", 1, &[0., 0., 0., 0., 0., 2., 5., 1.5], &[("V", 3), ("H", 3), ("r_a", 1), ("r_h", 1)]),
        plain(
            "tgc",
            2,
            &[0., 0., 0., 0., 1., 6., 3., 0., 0., 0., 2., 0., 1., 0., 0., 0., 1.5, 0.],
            &[("V", 3), ("H", 3), ("A", 3), ("B", 3), ("C", 3), ("D", 3)],
        ),
        plain("ell", 3, &[0., 0., 0., 3., 0., 0., 0., 2., 0., 0., 0., 1.], &[("V", 3), ("A", 3), ("B", 3), ("C", 3)]),
        plain("sph", 10, &[1., 0., 0., 3., 0., 0., 0., 3., 0., 0., 0., 3.], &[("V", 3), ("A", 3), ("B", 3), ("C", 3)]),
        plain("arb8", 4, &arb, &corners),
        plain("half", 6, &[0., 0.6, 0.8, 0.5], &[("N", 3), ("d", 1)]),
        plain("part", 16, &[0., 0., 0., 0., 4., 0., 2., 1.], &[("V", 3), ("H", 3), ("r_V", 1), ("r_H", 1)]),
        plain("rpc", 17, &cylinder, &[("V", 3), ("H", 3), ("B", 3), ("r", 1)]),
        plain("rhc", 18, &[&cylinder[..], &[1.5]].concat(), &[("V", 3), ("H", 3), ("B", 3), ("r", 1), ("c", 1)]),
        plain("epa", 19, &paraboloid, &[("V", 3), ("H", 3), ("A", 3), ("r_1", 1), ("r_2", 1)]),
        plain(
            "ehy",
            20,
            &[&paraboloid[..], &[1.25]].concat(),
            &[("V", 3), ("H", 3), ("A", 3), ("r_1", 1), ("r_2", 1), ("c", 1)],
        ),
        plain(
            "eto",
            21,
            &[0., 0., 0., 0., 0., 2., 1., 0., 1.5, 5., 1.],
            &[("V", 3), ("N", 3), ("C", 3), ("r", 1), ("r_d", 1)],
        ),
        // The last number is what memory held.
        plain(
            "hyp",
            38,
            &[0., 0., 0., 0., 0., 6., 3., 0., 0., 2., 0.5, f64::NAN],
            &[("V", 3), ("H", 3), ("A", 3), ("b", 1), ("bnr", 1)],
        ),
        ("arbn", 14, counted(6, planes.as_flattened()), {
            let planes = planes.iter().enumerate().map(|(i, [x, y, z, d])| format!(" P{i} {{{x} {y} {z} {d}}}"));
            format!(" N 6{}", planes.collect::<String>())
        }),
        ("pipe", 15, counted(3, turn.as_flattened()), points),
        ("bot", 30, mesh.concat(), mesh_text),
    ]
}

const COLORS: [(&str, &str); 3] = [("rgb", "10/20/30"), ("shader", "plastic {sh 20 di .4}"), ("inherit", "1")];

/// A model of all kinds in a row, each in a region of its own, in both forms.
fn model(mut to: Writer) -> (Vec<u8>, String) {
    let mut text = String::from(
        "title {A model}\nunits in\ncolor 3 5 255 128 0\ncolor 7 9 1 2 3\nattr set {_GLOBAL} {author} {nobody}\n",
    );
    to.global(&[
        ("title", "A model"),
        ("units", "25.4"),
        ("regionid_colortable", "{3 5 255 128 0} {7 9 1 2 3}"),
        ("author", "nobody"),
    ]);
    let all = kinds();
    let mut above: Vec<(String, Option<[f64; 16]>)> = Vec::new();
    for (i, (name, minor, body, keys)) in all.iter().enumerate() {
        to.solid(*minor, name, body);
        to.object(2, [0, 0], "", &[], &[0; 40]);
        text += &format!("put {{{name}}} {name}{keys}\n");
        let region = format!("r {name}");
        let turned = [0.0, -1.0, 0.0, i as f64 * STEP, 1.0, 0.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let id = i.to_string();
        let mut attributes = vec![("region", "R"), ("region_id", id.as_str()), ("los", "100"), ("my key", "my value")];
        attributes.extend(&COLORS[..i % 4]);
        let matrix = turned.map(|x| x.to_string()).join(" ");
        // Half-spaces are too large to be seen beside others.
        let (members, operators, tree) = if *name == "half" {
            let tree = format!(
                "{{n {{l half {{{matrix}}}}} {{- {{^ {{l sph {{{matrix}}}}} {{l ell {{{matrix}}}}}}} {{l tgc}}}}}}"
            );
            let members = vec![("half", Some(turned)), ("sph", Some(turned)), ("ell", Some(turned)), ("tgc", None)];
            (members, vec![1, 1, 1, 5, 1, 4, 3], tree)
        } else {
            (vec![(*name, Some(turned))], vec![], format!("{{l {{{name}}} {{{matrix}}}}}"))
        };
        to.combination(&region, &attributes, &members, &operators);
        text += &format!("put {{{region}}} comb region yes tree {tree}\nattr set {{{region}}}");
        text += &attributes.iter().map(|(k, v)| format!(" {{{k}}} {{{v}}}")).collect::<String>();
        text += "\n";
        above.push((region, None));
    }
    let members: Vec<_> = above.iter().map(|(name, m)| (name.as_str(), *m)).collect();
    // A number without the flag makes no region.
    to.combination("all.g", &[("region_id", "4"), ("oshader", "mirror")], &members, &[]);
    let mut row: Vec<String> = above.iter().map(|(name, _)| format!("{{l {{{name}}}}}")).collect();
    while row.len() > 1 {
        row = row
            .chunks(2)
            .map(|p| if p.len() == 1 { p[0].clone() } else { format!("{{u {} {}}}", p[0], p[1]) })
            .collect();
    }
    text += &format!(
        "put {{all.g}} comb region no tree {}\nattr set {{all.g}} {{region_id}} {{4}} {{oshader}} {{mirror}}\n",
        row[0]
    );
    to.object(0, [1, 36], "metaball", &[("weight", "7")], b"what it holds");
    text += "put {metaball} metaball x y\nattr set {metaball} weight 7\n";
    (to.bytes, text)
}

/// That both hold the same, places apart.
fn assert_same(binary: &Database, text: &Database) {
    assert_eq!((&binary.title, &binary.units), (&text.title, &text.units));
    assert_eq!((&binary.colors, &binary.attributes), (&text.colors, &text.attributes));
    assert_eq!(binary.objects.len(), text.objects.len());
    for (a, b) in binary.objects.iter().zip(&text.objects) {
        assert_eq!((&a.name, &a.kind, &a.attributes), (&b.name, &b.kind, &b.attributes));
    }
}

fn described(database: &Database) -> Description {
    let options = Options { lenient: true, ..Options::default() };
    let mut description = describe(Path::new("d"), "d", database, &options).unwrap();
    // They name places.
    description.warnings.clear();
    description
}

fn hits(description: &Description, columns: usize) -> Hits<f64> {
    let world = World::<f64>::compile(description, Preset::Balanced).unwrap();
    let mut rays = Rays::new(columns * 24);
    for i in 0..rays.len() {
        let (x, y) = ((i % columns) as f64 * 0.437 - 10.0, (i / columns) as f64 * 0.77 - 9.0);
        rays.set(i, [x, y, 30.0], [0.011, -0.017, -1.0], 0.0, f64::INFINITY);
    }
    let mut hits = Hits::new(0);
    engine::<f64>("auto").unwrap().intersect(&world, &rays, &mut hits, &mut Scratch::default(), None);
    hits
}

#[test]
fn all_kinds_are_those_of_the_text() {
    let (bytes, text) = model(Writer::default());
    let (binary, text) = (read(&bytes).unwrap(), read(text.as_bytes()).unwrap());
    assert_same(&binary, &text);
    assert_eq!(binary.counts().unsupported, 1);
    let region = |name: &str| match &binary.objects[binary.find(name).unwrap() as usize].kind {
        ObjectKind::Combination(combination) => combination.region,
        _ => panic!("{name} is no combination"),
    };
    assert!(region("r tor").is_some() && region("all.g").is_none());
    let (a, b) = (described(&binary), described(&text));
    assert_eq!(format!("{a:?}"), format!("{b:?}"));
    let columns = (kinds().len() as f64 * STEP / 0.437) as usize;
    let (a, b) = (hits(&a, columns), hits(&b, columns));
    let mut seen = vec![0; kinds().len()];
    for i in 0..a.len() {
        assert_eq!((a.is_hit(i), a.t[i].to_bits(), a.prim[i]), (b.is_hit(i), b.t[i].to_bits(), b.prim[i]), "ray {i}");
        if a.is_hit(i) {
            let x = (i % columns) as f64 * 0.437 - 10.0;
            seen[((x + 0.5 * STEP) / STEP) as usize] += 1;
        }
    }
    println!("hits by kind: {seen:?}");
    for (count, kind) in seen.iter().zip(kinds()) {
        assert!(*count > 20, "{} is hardly seen: {count}", kind.0);
    }
}

#[test]
fn all_widths_and_packings_say_the_same() {
    let expected = read(model(Writer::default()).1.as_bytes()).unwrap();
    for code in 0..4 {
        // Lengths of a byte are too small for some parts.
        let widths = [code.max(1), code, code.max(1), code.max(1), code];
        let (bytes, _) = model(Writer { widths, ..Writer::default() });
        assert_same(&read(&bytes).unwrap(), &expected);
    }
    for packing in [Packing::Zlib, Packing::Gzip] {
        let (bytes, _) = model(Writer { attributes: packing, body: packing, ..Writer::default() });
        assert_same(&read(&bytes).unwrap(), &expected);
    }
    for (attributes, body, what) in
        [(Packing::Bzip2, Packing::Plain, "attributes"), (Packing::Plain, Packing::Bzip2, "a body")]
    {
        let mut to = Writer { attributes, body, ..Writer::default() };
        to.combination("c", &[("region", "R")], &[("b", None)], &[]);
        let error = refused(&to.bytes);
        let expected = format!(": expected {what} plain or packed by zlib: bzip2 is not supported");
        assert!(error.starts_with("d.g: byte ") && error.ends_with(&expected), "{error}");
    }
}

#[test]
fn files_are_opened_by_their_extension_packed_or_not() {
    let folder = tempfile::tempdir().unwrap();
    let (bytes, text) = model(Writer::default());
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(&bytes).unwrap();
    let zst = zstd::bulk::compress(&bytes, 3).unwrap();
    let mut all = Vec::new();
    for (name, content) in [
        ("d.asc", text.into_bytes()),
        ("d.g", bytes.clone()),
        ("d.g.gz", gzip.finish().unwrap()),
        ("d.g.zst", zst),
        ("d.G", bytes),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        let mut options = LoadOptions::default();
        options.brlcad.lenient = true;
        let mut scene = load(path.to_str().unwrap(), &options).unwrap();
        (scene.source, scene.hash, scene.warnings) = (None, String::new(), Vec::new());
        all.push(format!("{scene:?}"));
    }
    assert!(all.iter().all(|scene| *scene == all[0]));
    let error = load(folder.path().join("d.x").to_str().unwrap(), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains(".g") && !error.contains("did you mean `.g`"), "{error}");
}

/// A ball in a region below a combination, with the places of the three.
fn small() -> (Vec<u8>, [usize; 3]) {
    let mut to = Writer::default();
    let ball = to.solid(3, "ball", &doubles(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]));
    let identity = std::array::from_fn(|i| f64::from(u8::from(i % 5 == 0)));
    let region = to.combination("r", &[("region", "R"), ("rgb", "1/2/3")], &[("ball", Some(identity))], &[1]);
    let top = to.combination("top", &[], &[("r", None), ("r", None)], &[]);
    (to.bytes, [ball, region, top])
}

#[test]
fn every_truncation_is_an_error_but_between_objects() {
    let (bytes, places) = small();
    assert_eq!(read(&bytes).unwrap().objects.len(), 3);
    for length in 0..bytes.len() {
        let result = read(&bytes[..length]);
        assert_eq!(result.is_ok(), length == 8 || places.contains(&length), "{length}: {result:?}");
        if let Err(error) = result {
            assert!(matches!(error, Error::Input(_)), "{error}");
        }
    }
}

#[test]
fn every_changed_byte_is_survived() {
    let (bytes, _) = small();
    let mut good = 0;
    for at in 0..bytes.len() {
        for value in [0, 1, 2, 0x20, 0x7f, 0x80, 0xe7, 0xff, bytes[at] ^ 1, bytes[at] ^ 0x40] {
            let mut changed = bytes.clone();
            changed[at] = value;
            if let Ok(database) = read(&changed) {
                good += 1;
                if let Ok(tops) = choose_tops(&database, &[]) {
                    drop(walk(Path::new("d.g"), &database, &tops));
                }
            }
        }
    }
    println!("{good} of {} changed databases were read", 10 * bytes.len());
    assert!(good > bytes.len());
}

#[test]
fn errors_say_at_which_byte_and_what_was_expected() {
    let (bytes, [ball, region, _]) = small();
    let changed = |at: usize, value: u8| {
        let mut changed = bytes.clone();
        changed[at] = value;
        refused(&changed)
    };
    let starts = |error: String, at: usize, what: &str| {
        assert!(error.starts_with(&format!("d.g: byte {at}: expected {what}")), "{error}\nexpected: byte {at}: {what}");
    };
    starts(changed(7, 0), 0, "the header of a BRL-CAD database, 76 01 00 00 00 00 01 35");
    starts(changed(ball, 0x75), ball, "the first byte of an object, 76");
    starts(changed(region - 1, 0), region - 1, "the last byte of an object, 35");
    starts(changed(bytes.len() - 1, 0), bytes.len() - 1, "the last byte of an object, 35");
    starts(changed(ball + 1, 0x63), ball, "an object, a header or free space");
    starts(changed(ball + 1, 0x40), ball, "an object with a name");
    starts(changed(ball + 3, 0), ball, "an object with a body");
    starts(changed(ball + 7, 0), ball + 6, "the length of an object, more than 8 bytes, found 0");
    starts(changed(ball + 6, 1), ball + 8, "an object of ");
    starts(changed(ball + 8, 0xff), ball + 9, "a name of 255 bytes, found ");
    // The body of the ball: its length after the name, then its numbers.
    let body = ball + 8 + 6 + 4;
    starts(changed(body - 1, 95), body, "96 bytes for the body of a `ell`, found 95");
    let mut nan = bytes.clone();
    nan[body + 16..body + 24].copy_from_slice(&f64::NAN.to_be_bytes());
    starts(refused(&nan), body + 16, "a number of a `ell` (a finite number)");
}

#[test]
fn odd_attributes_are_warnings() {
    let mut to = Writer::default();
    let place =
        to.combination("c", &[("region", "R"), ("rgb", "1/2/300"), ("los", "100.0"), ("aircode", "")], &[], &[]);
    let database = read(&to.bytes).unwrap();
    let ObjectKind::Combination(c) = &database.objects[0].kind else { panic!("no combination") };
    assert_eq!((c.rgb, c.region), (None, Some(Region { los: 100, ..Region::default() })));
    let colour = "attribute `rgb`: expected a colour R/G/B, each 0 to 255, found `1/2/300`; done without a colour";
    let number = "attribute `los`: expected a whole number, found `100.0`, which counts as 100";
    assert_eq!(database.warnings, [colour, number].map(|what| format!("`c` (byte {place}): {what}")));
}

#[test]
fn lengths_and_counts_that_lie_are_found_before_anything_is_made() {
    let lie = |body: &[u8], minor: u8| {
        let mut to = Writer::default();
        to.solid(minor, "x", body);
        refused(&to.bytes)
    };
    let huge = u32::MAX.to_be_bytes();
    for (error, expected) in [
        (
            lie(&[huge.to_vec(), huge.to_vec(), vec![1, 2, 0]].concat(), 30),
            "expected vertices of 103079215080 bytes, found 0",
        ),
        (lie(&[[0; 4], huge].concat(), 30), "expected the orientation of a `bot` of 1 bytes, found 0"),
        (
            lie(&[[0; 4].to_vec(), huge.to_vec(), vec![1, 2, 0]].concat(), 30),
            "expected faces of 51539607540 bytes, found 0",
        ),
        (lie(&[&[0; 8][..], &[1, 5, 0]].concat(), 30), "expected the mode of a `bot`, 1 to 4, found 5"),
        (
            lie(
                &[
                    &1u32.to_be_bytes()[..],
                    &1u32.to_be_bytes(),
                    &[1, 2, 0],
                    &[0; 24],
                    &[0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0],
                ]
                .concat(),
                30,
            ),
            "expected a vertex number below 1, found 1",
        ),
        (lie(&huge, 14), "expected 4294967295 planes of an `arbn` of 32 bytes each, found 0 bytes for them"),
        (lie(&huge, 15), "expected 4294967295 points of a `pipe` of 48 bytes each, found 0 bytes for them"),
        (lie(&[4], 31), "expected the width of a combination's numbers, 0 to 3, found 4"),
        (lie(&[&[3][..], &[0xff; 40]].concat(), 31), "expected matrices of 18446744073709551615 bytes, found 0"),
        (
            lie(&[&[3][..], &[0; 8], &[0xff; 32]].concat(), 31),
            "expected members of 18446744073709551615 bytes, found 0",
        ),
        (lie(&[0, 0, 5, 3, 0, 1, b'a', 0, 255], 31), "expected 5 members, found 1"),
        (lie(&[0, 0, 1, 3, 0, 1, b'a', 0, 0], 31), "expected the number of a matrix below 0, found 0"),
        (lie(&[0, 0, 1, 3, 200, 1, b'a', 0, 255], 31), "expected an expression of 200 bytes, found 0"),
        (lie(&[0, 0, 1, 3, 2, 1, b'a', 0, 255, 1, 2], 31), "expected an expression that makes one solid of 1 members"),
        (
            lie(&[0, 0, 1, 3, 3, 1, b'a', 0, 255, 1, 1, 2], 31),
            "expected an expression that makes one solid of 1 members",
        ),
        (
            lie(&[0, 0, 1, 3, 2, 1, b'a', 0, 255, 1, 6], 31),
            "expected an operator with two operands: complements are not supported",
        ),
        (lie(&[0, 0, 1, 3, 2, 1, b'a', 0, 255, 1, 7], 31), "expected a member or an operator, 1 to 5, found 7"),
        (lie(&[0, 0, 1, 2, 0, 1, b'a', 0, 255], 31), "expected the number of a matrix of 1 bytes, found 0"),
    ] {
        assert!(error.starts_with("d.g: byte ") && error.ends_with(expected), "{error}\nexpected: {expected}");
    }
    // An object of 2^64 times 8 bytes.
    let mut bytes = Writer::default().bytes;
    bytes.extend([0x76, 0xc0 | 0x20, 0, 0x20, 1, 3]);
    bytes.extend([0xff; 8]);
    let error = refused(&bytes);
    assert!(error.starts_with("d.g: byte 22: expected an object of 18446744073709551600 bytes, found 0"), "{error}");
}

#[test]
fn what_is_no_object_is_passed_over_and_cycles_are_named() {
    let mut to = Writer::default();
    to.object(1, [0, 0], "", &[], &[]);
    to.object(2, [1, 3], "junk", &[("region", "R")], &[1, 2, 3]);
    to.object(0, [2, 0], "notes", &[("text", "any")], &[]);
    to.object(0, [9, 2], "numbers", &[], &[0; 16]);
    let a = to.combination("a", &[], &[("b", None)], &[]);
    to.combination("b", &[], &[("a", None), ("gone", None)], &[1, 1, 4]);
    to.combination("nothing", &[], &[], &[]);
    let database = read(&to.bytes).unwrap();
    let names: Vec<&str> = database.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["numbers", "a", "b", "nothing"]);
    assert_eq!(database.objects[0].kind, ObjectKind::Unsupported("binunif".into()));
    let file = Path::new("d.g");
    let error = walk(file, &database, &choose_tops(&database, &["a".into()]).unwrap()).unwrap_err().to_string();
    assert!(error.starts_with(&format!("d.g: byte {a}: `a` contains itself: a/b/a")), "{error}");
    let found = walk(file, &database, &choose_tops(&database, &["nothing".into()]).unwrap()).unwrap();
    assert!(found.regions.is_empty() && found.problems.is_empty());
}

#[test]
fn binary_databases_of_version_4_are_named() {
    let error = refused(b"I\x01v4\0\0A title");
    assert!(error.starts_with("d.g: byte 0: expected a database of version 5, or text"), "{error}");
    assert!(refused(b"\x76").starts_with("d.g:1:1: expected a BRL-CAD database"));
}
