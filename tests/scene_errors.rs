//! Every kind of error in a scene file says where and what, and no input makes the reader panic or hang.

use std::path::Path;
use std::time::{Duration, Instant};

use lanecast::error::{Error, Result};
use lanecast::scene::description::Description;
use lanecast::scene::kdl::{meshes::MeshFiles, parse};
use lanecast::scene::load::{LoadOptions, load};

fn scene(text: &[u8]) -> Result<Description> {
    let read = |path: &Path| Err(Error::whole(path, "no files here"));
    let files = MeshFiles { folder: None, allow_outside: false, found: None, read: &read };
    parse(Path::new("t.kdl"), "t", text, &[], &files)
}

/// Text, place of the error, a phrase of its message or hint.
const ERRORS: &[(&str, &str, &str)] = &[
    // Syntax.
    ("sphere {\n  radius 1\n", "1:8", "this `{` has no closing `}`"),
    ("sphere\n}", "2:1", "closes nothing"),
    ("sphere radius=", "1:15", "expected a value after `=`, found the end of the file"),
    ("sphere radius=(1+2)", "1:15", "stand in quotes"),
    ("scene \"a", "1:7", "no closing `\""),
    ("scene \"\"\"\nx\n\"\"\"", "1:7", "several lines"),
    ("sphere radius=1..2", "1:15", "expected a number, found `1..2`"),
    ("sphere radius=5mm", "1:15", "expected a number, found `5mm`"),
    ("sphere radius=.5", "1:15", "expected a digit before the point: `0.5`"),
    ("sphere radius=1e999", "1:15", "too large"),
    ("sphere radius=#inf", "1:15", "finite number"),
    ("sphere radius=#nan", "1:15", "finite number"),
    ("sphere radius=true", "1:15", "write `#true`"),
    ("a #wrong", "1:3", "expected `#true` or `#false`"),
    ("/* /* */", "1:1", "no end"),
    ("sphere {} {}", "1:11", "found a second"),
    ("sphere {} 1", "1:11", "a new line or `;`"),
    ("scene \"a\"b", "1:10", "a space between values"),
    ("scene \"\\q\"", "1:8", "unknown escape"),
    ("a\u{1}", "1:2", "U+0001"),
    // What people write who know other formats.
    ("# comment\nsphere", "1:1", "a comment begins with `//`"),
    ("#comment\nsphere", "1:1", "found `#comment`"),
    ("sphere\n-- comment", "2:1", "a comment begins with `//`"),
    ("sphere \"ball\"", "1:8", "only groups have names: group \"ball\" { sphere }"),
    ("sphere radius 2", "1:8", "write sphere radius=2"),
    ("sphere center 1 2 3", "1:8", "write sphere center=\"1, 2, 3\""),
    ("sphere 3", "1:8", "as in sphere field=value"),
    ("sphere radius=2 center=0 0 -1", "1:26", "several numbers stand in quotes: center=\"0, 0, -1\""),
    ("sphere { radius=2 }", "1:16", "in a block a field stands without `=`: radius 2"),
    ("camera { eye 0, 0, 5 }", "1:14", "numbers stand apart by spaces alone: 0 0 5"),
    ("camera { eye (0 0 5) }", "1:14", "numbers stand apart by spaces alone: 0 0 5"),
    ("camera eye=0,0,5", "1:12", "several numbers stand in quotes: \"0, 0, 5\""),
    ("camera eye=\"0 0 5\"", "1:15", "several numbers stand apart by commas: \"0, 0, 5\""),
    (
        "define \"a\" { material \"x\" { diffuse 1 }; sphere }",
        "1:14",
        "materials are defined at the top level of the file, outside of all blocks; what has one says its name: material \"x\"",
    ),
    ("a \\ b", "1:3", "end of the line"),
    ("5", "1:1", "expected a statement"),
    // Names.
    ("\n  spere radius=1", "2:3", "did you mean `sphere`?"),
    ("sphere radios=1", "1:8", "did you mean `radius`?"),
    ("sphere { radios 1 }", "1:10", "did you mean `radius`?"),
    ("sphere { transalte 1 2 3 }", "1:10", "did you mean `translate`?"),
    ("material red\nsphere material=rad", "2:17", "did you mean `red`?"),
    ("define tree { sphere }\ninstance trea", "2:10", "did you mean `tree`?"),
    ("parameter size 1\nsphere radius=\"2 * sise\"", "2:20", "did you mean `size`?"),
    ("sphere radius=\"sqr(2)\"", "1:16", "did you mean `sqrt`?"),
    ("light pont", "1:7", "did you mean `point`?"),
    ("camera { eye 0 0 1; lookat 0 0 0 }", "1:21", "did you mean `look-at`?"),
    ("unions { sphere }", "1:1", "did you mean `union`?"),
    ("difference { sphere; disc }", "1:22", "has no inside"),
    ("union { polygon { point 0 0 0 } }", "1:9", "no solid that can be combined"),
    ("union { spher }", "1:9", "did you mean `sphere`?"),
    ("complement { sphere; box }", "1:1", "takes one solid, found 2"),
    ("union { union tolerance=1 { sphere } }", "1:15", "outermost"),
    ("union tolerance=-1 { sphere }", "1:7", "must not be negative"),
    ("union { instance \"bal\" }\ndefine ball { sphere }", "1:18", "did you mean `ball`?"),
    ("define a { sphere; instance a }\nunion { instance a }", "1:29", "contains an instance of itself"),
    ("torus tube=2", "1:7", "wider than its ring"),
    ("elliptic-torus a=0.8 b=1.2 angle=60", "1:1", "wider than its ring"),
    ("elliptic-torus a=-1", "1:16", "must be above zero"),
    ("polyhedron { plane 1 0 0 }", "1:14", "takes four numbers"),
    ("polyhedron { plane 1 0 0 1; plane -1 0 0 1; plane 0 1 0 1; plane 0 -1 0 1 }", "1:1", "do not enclose"),
    ("ellipsoid radii=\"1, 0, 1\"", "1:11", "must be above zero"),
    ("hyperboloid waist=0.5 apex=1", "1:23", "not both"),
    ("hyperboloid waist=1.5", "1:1", "between 0 and 1"),
    ("parameter a. 1", "1:11", "cannot name"),
    ("translate 1 2 3", "1:1", "must come before the items"),
    ("group { sphere; scale 2 }", "1:17", "must come before the items"),
    ("group { camera }", "1:9", "top level"),
    ("group { define x {} }", "1:9", "top level"),
    // Values.
    ("sphere radius=0", "1:8", "must be above zero, found 0"),
    ("sphere { radius -1 }", "1:10", "must be above zero"),
    ("sphere radius=\"1, 2\"", "1:8", "takes one number, found 2"),
    ("sphere radius=#null", "1:15", "expected a number or an expression"),
    ("sphere radius=1 radius=2", "1:17", "given twice"),
    ("sphere radius=1 { radius 2 }", "1:19", "given twice"),
    ("sphere { center 1 2 }", "1:10", "takes three numbers, found 2"),
    ("sphere { center 1 2 3 x=4 }", "1:23", "a field has no properties"),
    ("sphere 3", "1:8", "takes no plain values"),
    ("sphere radius=\"1 / 0\"", "1:16", "not finite"),
    ("sphere radius=\"1 +\"", "1:19", "expected a number, a name or `(`"),
    ("sphere radius=\"1 ) 2\"", "1:18", "expected an operator"),
    ("box size=0", "1:5", "must be above zero"),
    ("box { min 0 0 0; max 1 0 1 }", "1:18", "must be above zero"),
    ("box { min 0 0 0 }", "1:1", "both min and max"),
    ("cylinder { from 1 1 1; to 1 1 1 }", "1:24", "must differ"),
    ("cone top=-1", "1:6", "must not be negative"),
    ("plane { normal 0 0 0 }", "1:9", "direction"),
    ("polygon { point 0 0 0; point 1 0 0 }", "1:1", "at least three points, found 2"),
    ("polygon { point 0 0 }", "1:11", "three numbers"),
    ("sphere-flake depth=7", "1:14", "from 0 to 6"),
    ("terrain size=1.5", "1:9", "whole number"),
    ("mesh", "1:1", "expected `mesh"),
    ("material m { diffuse 1.5 }", "1:14", "must not be above 1"),
    ("material m { diffuse -1 }", "1:14", "must not be negative"),
    ("material m { diffuse 1 2 }", "1:14", "found 2"),
    ("material", "1:1", "needs a name"),
    ("material a; material a", "1:22", "defined twice"),
    ("define a {}; define a {}", "1:21", "defined twice"),
    ("define", "1:1", "expected `define"),
    ("parameter a 1; parameter a 2", "1:26", "defined twice"),
    ("parameter sin 1", "1:11", "cannot name a parameter"),
    ("parameter a", "1:1", "expected `parameter name value`"),
    ("units parsec", "1:7", "expected one of m, dm"),
    ("units m; units mm", "1:10", "given twice"),
    ("precision f16", "1:11", "f32 or f64"),
    ("camera { look-at 0 0 0 }", "1:1", "needs an `eye`"),
    ("camera { eye 0 0 1; look-at 0 0 1 }", "1:21", "must differ"),
    ("camera { eye 0 1 0; up 0 1 0 }", "1:21", "along the view"),
    ("camera { eye 0 0 1; fov 180 }", "1:21", "between 0 and 180"),
    ("camera { eye 0 0 1; fov 40; parallel 2 }", "1:29", "not both"),
    ("camera a { eye 0 0 1 }; camera a { eye 0 0 2 }", "1:25", "defined twice"),
    ("light point { intensity 1 }", "1:1", "needs a `position`"),
    ("light", "1:1", "expected one of `light point`"),
    ("background 1 2", "1:1", "found 2"),
    // Transforms.
    ("sphere { scale 0 }", "1:10", "cannot be inverted"),
    ("sphere { scale 1 0 1 }", "1:10", "cannot be inverted"),
    ("sphere { scale 1e100; scale 1e100 }", "1:23", "cannot be inverted"),
    ("sphere { translate 1 2 }", "1:10", "three numbers, found 2"),
    ("sphere { scale 1 2 }", "1:10", "one number or three"),
    ("sphere { rotate w 3 }", "1:17", "axis x, y or z"),
    ("sphere { rotate 3 }", "1:10", "an axis, then degrees"),
    ("sphere { rotate 0 0 0 3 }", "1:10", "no direction"),
    ("sphere { shear xx=1 }", "1:16", "expected xy, xz"),
    ("sphere { matrix 1 2 3 }", "1:10", "12 numbers"),
    // Groups and repeats.
    ("define a { instance a }", "1:21", "`a` contains an instance of itself"),
    ("define a { instance b }\ndefine b { group { instance a } }", "2:29", "a > b > a"),
    ("instance nothing", "1:10", "no `define` is called"),
    ("instance", "1:1", "expected `instance"),
    ("material m\ndefine a { sphere }\ninstance a material=m", "3:12", "no property `material`"),
    ("repeat -1 {}", "1:1", "whole number"),
    ("repeat 1e9 { sphere }", "1:1", "from 0 to 2097152"),
    ("repeat { sphere }", "1:1", "how often"),
    ("repeat 2 { repeat 2 { sphere } }", "1:12", "already in use"),
    ("parameter i 1\nrepeat 2 { sphere }", "2:1", "already in use"),
    ("repeat 2 index=\"2x\" { sphere }", "1:16", "not a name"),
    ("choose 3 { sphere }", "1:1", "from 0 to 0, found 3"),
    // Files.
    ("mesh \"a.ply\"", "1:6", "refers to no files"),
    ("units m\nmesh \"a.ply\" units=parsec", "2:20", "unknown unit"),
    ("mesh \"a.ply\" units=mm", "1:20", "its own `units`"),
];

#[test]
fn every_error_says_where_and_what() {
    let mut wrong = Vec::new();
    for (text, place, phrase) in ERRORS {
        let Err(error) = scene(text.as_bytes()) else { panic!("no error for {text:?}") };
        let shown = error.to_string();
        let fits = shown.starts_with(&format!("t.kdl:{place}: ")) && shown.contains(phrase) && shown.contains(" | ");
        if !fits {
            wrong.push(format!("{text:?} should say {phrase:?} at {place}:\n{shown}\n"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.concat());
    let shown = scene(b"sphere\n\xff").unwrap_err().to_string();
    assert!(shown.starts_with("t.kdl:2:1: expected UTF-8"), "{shown}");
}

#[test]
fn hostile_inputs_end_soon() {
    let many = 1_000_000;
    let wide = format!("sphere radius=\"{}1\"", "1+".repeat(many));
    let chain: String = (0..200_000).map(|i| format!("define g{i} {{ instance g{} }}\n", i + 1)).collect();
    let fork: String = (0..40).map(|i| format!("define g{i} {{ instance g{0}; instance g{0} }}\n", i + 1)).collect();
    let repeats = |inner: &str| {
        let open: String = (0..6).map(|i| format!("repeat 2000000 index=\"i{i}\" {{ ")).collect();
        format!("{open}{inner}{}", "}".repeat(6))
    };
    let cases: Vec<(String, &str)> = vec![
        ("a {".repeat(many), "deeper than 96"),
        ("a {\n".repeat(many), "deeper than 96"),
        ("a /-{".repeat(many), "deeper than 96"),
        ("/*".repeat(many), "no end"),
        ("(".repeat(many), "expected a statement"),
        (format!("sphere radius=\"{}", "(".repeat(many)), "no closing"),
        (format!("sphere radius=\"{}\"", "(".repeat(many)), "deeper than 64"),
        (format!("sphere radius={}", "9".repeat(many)), "too large"),
        (format!("{} 1", "x".repeat(many)), "unknown statement"),
        (format!("sphere material=\"{}\"", "x".repeat(many)), "no material"),
        ("a;".repeat(5 * many), "more than 4194304"),
        ("camera a { eye 0 0 1 }\n".repeat(2), "defined twice"),
        (repeats(""), "more than 268435456 steps"),
        (repeats("sphere"), "more than 2097152 items"),
        (repeats(&wide), "more than"),
        ("repeat 100 { terrain size=2048 seed=\"i\" }".into(), "triangles of its own"),
        ("repeat 100 { sphere-flake depth=6 }".into(), "items"),
        (format!("{chain}define g200000 {{ sphere }}"), "deeper than 64"),
    ];
    for (text, phrase) in cases {
        let start = Instant::now();
        let shown = scene(text.as_bytes()).unwrap_err().to_string();
        let head: String = text.chars().take(40).collect();
        assert!(shown.contains(phrase) && shown.len() < 1000, "{head}: {shown}");
        assert!(start.elapsed() < Duration::from_secs(20), "{head} took {:?}", start.elapsed());
    }
    // Doubling forty times is legal to describe; expanding it is refused by the assembly.
    let description = scene(format!("{fork}define g40 {{ sphere }}\ninstance g0").as_bytes()).unwrap();
    assert!(lanecast::scene::assembly::Assembly::new(&description).is_err());
    assert!(scene(&vec![b' '; (64 << 20) + 1]).unwrap_err().to_string().contains("larger than 64 MiB"));
}

#[test]
fn damaged_scenes_never_panic() {
    let mut state = 7_u64;
    let mut random = |n: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % n as u64) as usize
    };
    // The big scenes are made small: it is their text that matters.
    let small = |text: &str| {
        text.replace("rows 40", "rows 3")
            .replace("size 224", "size 8")
            .replace("depth 4", "depth 1")
            .replace("side 10", "side 2")
    };
    let scenes: Vec<String> =
        lanecast::scene::builtin::NAMES.iter().map(|n| small(lanecast::scene::builtin::text(n).unwrap())).collect();
    let pieces =
        ["{", "}", "\"", "\n", ";", "0", "-", "9", "/-", "/*", "#", "=", "\\", "é", "repeat 3 {", "1e308", "("];
    let (mut good, start) = (0, Instant::now());
    for round in 0..6000 {
        let mut bytes = scenes[round % scenes.len()].clone().into_bytes();
        for _ in 0..1 + random(4) {
            let at = random(bytes.len());
            match random(4) {
                0 => bytes[at] = random(256) as u8,
                1 => drop(bytes.splice(at..at, pieces[random(pieces.len())].bytes())),
                2 => drop(bytes.drain(at..(at + random(30)).min(bytes.len()))),
                _ => bytes.swap(at, at / 2),
            }
        }
        match scene(&bytes) {
            Ok(_) => good += 1,
            Err(error) => assert!(error.to_string().starts_with("t.kdl:"), "{error}"),
        }
    }
    assert!(good > 200 && good < 5800, "{good} of 6000 were still scenes");
    assert!(start.elapsed() < Duration::from_secs(120), "{:?}", start.elapsed());
}

#[test]
fn mesh_references_stay_in_the_folder() {
    let root = tempfile::tempdir().unwrap();
    let inside = root.path().join("scene");
    std::fs::create_dir_all(inside.join("sub")).unwrap();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(root.path().join("out.obj"), triangle).unwrap();
    std::fs::write(inside.join("sub/in.obj"), triangle).unwrap();
    let absolute = root.path().join("out.obj");
    let mut cases = vec![
        ("sub/in.obj".to_string(), Ok(())),
        ("./sub/in.obj".into(), Ok(())),
        ("../out.obj".into(), Err("leaves the scene's folder")),
        ("sub/../sub/in.obj".into(), Err("leaves the scene's folder")),
        (absolute.to_string_lossy().into_owned(), Err("leaves the scene's folder")),
        ("none.obj".into(), Err("cannot open")),
        ("sub".into(), Err("expected a mesh file")),
        ("".into(), Err("expected the name")),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&absolute, inside.join("link.obj")).unwrap();
        cases.push(("link.obj".into(), Err("leaves the scene's folder")));
    }
    let file = inside.join("s.kdl");
    for (written, wanted) in cases {
        std::fs::write(&file, format!("mesh {written:?}")).unwrap();
        let open = |allow_outside| {
            load(&file.to_string_lossy(), &LoadOptions { allow_outside, ..Default::default() })
                .map_err(|e| e.to_string())
        };
        match (open(false), wanted) {
            (Ok(d), Ok(())) => assert_eq!(d.meshes[0].triangles, [[0, 1, 2]]),
            (Err(e), Err(phrase)) => assert!(e.contains(phrase), "{written}: {e}"),
            (got, _) => panic!("{written}: {:?}", got.map(|d| d.name)),
        }
        if wanted == Err("leaves the scene's folder") {
            assert!(open(true).is_ok(), "{written}");
        }
    }
}

#[test]
fn errors_of_solids_say_where_they_were_written() {
    let mut text = String::from("define a0 { union }\n");
    (1..=24).for_each(|i| text += &format!("define a{i} {{ instance a{0}; instance a{0} }}\n", i - 1));
    let shown = scene((text + "sphere\nunion { instance a24 }\n").as_bytes()).unwrap_err().to_string();
    let wanted = "t.kdl:27:1: `union`: it expands to more than 8388608 operations\n 27 | union { instance a24 }\n";
    assert!(shown.starts_with(wanted), "{shown}");

    let root = tempfile::tempdir().unwrap();
    std::fs::write(root.path().join("open.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let file = root.path().join("s.kdl");
    std::fs::write(&file, "sphere\nmesh \"open.obj\"\ndifference {\n  box\n  mesh \"open.obj\"\n}\n").unwrap();
    let shown = load(&file.to_string_lossy(), &LoadOptions::default()).unwrap_err().to_string();
    let what = "`open.obj`: the mesh is not closed: the edge from ";
    assert!(shown.starts_with(&format!("{}:5:3: {what}", file.display())), "{shown}");
    assert!(shown.contains("\n 5 |   mesh \"open.obj\"\n"), "{shown}");
}

#[test]
fn the_fuzz_corpus_has_known_verdicts() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/kdl");
    let Ok(entries) = std::fs::read_dir(&corpus) else {
        println!("SKIPPED: no fuzz corpus for kdl (packaged sources leave it out)");
        return;
    };
    let mut files = 0;
    for entry in entries {
        let path = entry.unwrap().path();
        let result = scene(&std::fs::read(&path).unwrap());
        // Fuzzers name what they find by its hash; only the seeds written by hand have a known verdict.
        if path.extension().is_some_and(|e| e == "kdl") {
            assert_eq!(result.is_err(), path.ends_with("deep.kdl"), "{}: {:?}", path.display(), result.err());
        }
        files += 1;
    }
    assert!(files >= 5, "the corpus has only {files} files");
}
