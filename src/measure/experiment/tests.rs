use super::*;

fn parsed(text: &str) -> Result<Experiment> {
    parse(Path::new("e.kdl"), text.as_bytes())
}

const WHOLE: &str = "experiment \"growth\" {
    question \"how?\"
    scenes \"builtin:terrain\" \"meshes/a b.ply\"
    vary size 10 20 30
    vary seed 1 2
    rays primary diffuse
    engines scalar tile
    peers obvhs
    size \"64x32\"
    threads 1 2
    repeat 3
    preset fast best
    leaf 2 8
    precision f32
}";

#[test]
fn cases_are_the_product() {
    let e = parsed(WHOLE).unwrap();
    assert_eq!((e.name.as_str(), e.question.as_str(), e.rays.len()), ("growth", "how?", 2));
    assert_eq!(e.cases.len(), 3 * 2 * 2 * 2 * 2 * 2);
    let labels: HashSet<String> = e.cases.iter().map(Case::label).collect();
    assert_eq!(labels.len(), e.cases.len(), "labels tell cases apart");
    assert!(labels.iter().all(|l| l.chars().all(|c| c.is_ascii_alphanumeric() || "-.".contains(c))), "{labels:?}");
    assert_eq!(
        e.cases[0].command(RayKind::Diffuse),
        "lanecast bench builtin:terrain --set size=10 --set seed=1 --rays diffuse --engines scalar,tile --peers obvhs \
         --size 64x32 --threads 1 --repeat 3 --seed 1 --preset fast --leaf 2 --precision f32"
    );
    // With all that another shell, in another folder, needs.
    let spaced = Case {
        peers: vec!["obvhs".into(), "embree".into()],
        ..e.cases.iter().find(|c| c.scene.contains(' ')).unwrap().clone()
    };
    let said = spaced.command_on("e/meshes/a b.ply", RayKind::Ao, Some(Path::new("lib/embree 4.so")));
    assert!(said.starts_with("lanecast bench 'e/meshes/a b.ply' --set size=10 "), "{said}");
    assert!(said.contains(" --peers obvhs,embree --embree 'lib/embree 4.so' --size 64x32 "), "{said}");
    assert!(!e.cases[0].command_on("x", RayKind::Ao, Some(Path::new("lib.so"))).contains("embree"));
    assert_eq!(e.cases[0].label(), "terrain-size-10-seed-1-64x32-t1-fast-leaf-2-f32");
    let small = parsed("experiment \"x\" { scenes \"builtin:cornell\"; }").unwrap();
    assert_eq!((small.cases.len(), small.rays), (1, vec![RayKind::Primary]));
    let twice = parsed("experiment \"x\" { scenes a; rays primary ao primary; }").unwrap();
    assert_eq!(twice.rays, [RayKind::Primary, RayKind::Ao]);
}

/// A seed is a whole number of 64 bits, as `--seed` takes it.
#[test]
fn whole_numbers_keep_all_their_digits() {
    let e =
        parsed("experiment \"x\" { scenes a; seed 9007199254740993; vary n 9_007_199_254_740_993 1e3 0.5; }").unwrap();
    assert_eq!(e.cases[0].seed, 9_007_199_254_740_993);
    let values: Vec<&str> = e.cases.iter().map(|case| case.set[0].1.as_str()).collect();
    assert_eq!(values, ["9007199254740993", "1000", "0.5"]);
}

#[test]
fn faults_say_where_and_what_is_near() {
    let fault = |text: &str| parsed(text).unwrap_err().to_string();
    for (text, want) in [
        ("", "expected one `experiment`, found 0"),
        ("scene \"x\"", "e.kdl:1:1: expected `experiment`"),
        ("experiment { }", "expected `experiment \"name\""),
        ("experiment \"x\" { }", "at least one scene"),
        ("experiment \"x\" {\n scenes a\n engine tile\n}", "e.kdl:3:2: unknown `engine`"),
        ("experiment \"x\" {\n scenes a\n engine tile\n}", "did you mean `engines`?"),
        ("experiment \"x\" { scenes a\n rays primery }", "e.kdl:2:7: "),
        ("experiment \"x\" { scenes a\n preset besst }", "did you mean `best`?"),
        ("experiment \"x\" { scenes a\n size 12 }", "expected a size"),
        ("experiment \"x\" { scenes a\n threads 0 }", "above 0"),
        ("experiment \"x\" { scenes a\n leaf 9 }", "e.kdl:2:7: expected a number of primitives from 1 to 8"),
        ("experiment \"x\" { scenes a\n repeat }", "1 to 100 values after `repeat`"),
        ("experiment \"x\" { scenes a\n scenes b }", "given twice"),
        ("experiment \"x\" { scenes a\n vary n }", "1 to 1000 variations"),
        ("experiment \"x\" { scenes a=1 }", "values only"),
        ("experiment \"x\" { scenes a {\n}}", "values only"),
        ("experiment \"x\" { scenes #null }", "a word or a number"),
        ("experiment \"x\" { scenes \"a/x.ply\" \"b/x.ply\" }", "two cases are called `x-"),
        ("experiment \"x\" { scenes a a }", "two cases are called `a-"),
        ("experiment \"x\" { scenes a\n threads 1 1 }", "two cases are called `a-"),
        ("experiment \"x\" { scenes a\n repeat 3 7 }", "e.kdl:2:11: expected one value after `repeat`"),
        ("experiment \"x\" { scenes a\n seed 5 6 }", "e.kdl:2:9: expected one value after `seed`"),
        ("experiment \"x\" { scenes a\n vary n 1 2\n vary m 1\n vary n 3 }", "e.kdl:4:2: `vary n` is given twice"),
        ("experiment \"x\" { scenes a\n engines scalar tiel }", "e.kdl:2:17: "),
        ("experiment \"x\" { scenes a\n engines tile\n precision f32 f64 }", "no engine `tile` in f64"),
        ("experiment \"x\" { scenes a\n peers embre }", "did you mean `embree`?"),
        ("experiment \"x\" {", "e.kdl:1:"),
    ] {
        assert!(fault(text).contains(want), "{text}: {}", fault(text));
    }
    let many = (0..100).map(|i| i.to_string()).collect::<Vec<_>>().join(" ");
    let product = format!("experiment \"x\" {{ scenes a\n vary a {many}\n vary b {many}\n vary c {many} }}");
    assert!(fault(&product).contains("1 to 1000 variations"), "{}", fault(&product));
    let lists = format!("experiment \"x\" {{ scenes {0}\n threads {0} }}", many.replace('0', "9"));
    assert!(fault(&lists).contains("at most 1000 cases"), "{}", fault(&lists));
}

/// The shipped files are experiments over things that exist.
#[test]
fn shipped_experiments_are_sound() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/experiments");
    let guide = std::fs::read_to_string(folder.join("../../docs/EXPERIMENTS.md")).unwrap();
    let mut count = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let e = parse(&path, &std::fs::read(&path).unwrap()).unwrap();
        assert_eq!(path.file_stem().unwrap().to_str(), Some(e.name.as_str()), "the file is called as the experiment");
        assert!(e.question.ends_with('?') && !e.cases.is_empty(), "{}", path.display());
        assert!(guide.contains(&format!("| `{}` | ", e.name)), "docs/EXPERIMENTS.md has no line for {}", e.name);
        for case in &e.cases {
            // Scenes with these parameters exist; the large ones are left to the experiment itself.
            if case.set.iter().all(|(_, value)| value.parse::<f64>().is_ok_and(|x| x < 300.0)) {
                crate::scene::load::load(
                    &case.scene,
                    &crate::scene::load::LoadOptions { set: case.set.clone(), ..Default::default() },
                )
                .unwrap();
            }
            let size = case.set.iter().find(|(name, _)| name == "size" && case.scene == "builtin:terrain");
            let largest = crate::scene::kdl::terrain::MAX_SIZE;
            assert!(size.is_none_or(|(_, value)| value.parse::<u32>().is_ok_and(|x| x <= largest)), "{size:?}");
            assert!(crate::scene::builtin::text(case.scene.trim_start_matches("builtin:")).is_some(), "{}", case.scene);
            for name in &case.engines {
                let known = if case.precision == "f64" {
                    crate::trace::engine::<f64>(name).is_ok()
                } else {
                    crate::trace::engine::<f32>(name).is_ok()
                };
                assert!(known, "{}: {name}", path.display());
            }
        }
        count += 1;
    }
    assert!(count >= 10, "only {count} experiments");
}
