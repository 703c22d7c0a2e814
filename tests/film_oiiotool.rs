//! OpenImageIO's `oiiotool` (Debian: openimageio-tools) reads the pictures that lanecast writes: windows, layers, types,
//! attributes, and every number. Without it the test says SKIPPED.

use std::path::Path;
use std::process::Command;

use lanecast::film::{PlaneData, exr};

fn oiiotool(args: &[&str], dir: &Path) -> Option<String> {
    let out = match Command::new("oiiotool").args(args).current_dir(dir).output() {
        Ok(out) => out,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            println!("SKIPPED: oiiotool not found");
            return None;
        }
        Err(error) => panic!("{error}"),
    };
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    assert!(out.stderr.is_empty(), "{}", String::from_utf8_lossy(&out.stderr));
    Some(String::from_utf8(out.stdout).unwrap())
}

fn lanecast(args: &[&str], dir: &Path) {
    let out = Command::new(env!("CARGO_BIN_EXE_lanecast")).args(args).current_dir(dir).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
}

#[test]
fn oiiotool_reads_every_plane_and_attribute() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let window = ["--size", "160x90", "--crop", "20,10,100,50", "--seed", "77"];
    let pictures: [(&str, &[&str]); 3] = [
        ("plain.exr", &["builtin:forest"]),
        ("planes.exr", &["builtin:forest", "--aov", "all"]),
        ("paths.exr", &["builtin:cornell", "--integrator", "path", "--spp", "4", "--aov", "all,cryptomatte"]),
    ];
    for (name, args) in pictures {
        lanecast(&[&["render"], args, &window, &["-o", name]].concat(), dir);
        let Some(told) = oiiotool(&["--info", "-v", name], dir) else { return };
        let film = exr::read(&dir.join(name)).unwrap();
        let line = |start: &str| {
            let found = told.lines().map(str::trim).find_map(|line| line.strip_prefix(start));
            found.unwrap_or_else(|| panic!("no {start} in {told}")).trim()
        };
        assert_eq!(line("pixel data origin:"), "x=20, y=10");
        assert_eq!(line("full/display size:"), "160 x 90");
        assert!(told.contains("80 x   40"), "{told}");
        // Rec.709 with D65.
        let chromaticities: Vec<f64> = line("chromaticities:").split(", ").map(|x| x.parse().unwrap()).collect();
        assert_eq!(chromaticities, [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329]);
        assert_eq!((line("lanecast/seed:"), line("lanecast/engine:")), ("\"77\"", "\"tile\""));
        for attribute in ["revision", "sceneHash", "isa", "lanes", "spp", "rays", "renderSeconds"] {
            assert!(!line(&format!("lanecast/{attribute}:")).is_empty());
        }
        assert!(line("software:").contains("lanecast"));
        for matrix in ["worldToCamera:", "worldToNDC:"] {
            assert_eq!(line(matrix).split(", ").filter(|x| x.parse::<f64>().is_ok()).count(), 16, "{matrix}");
        }
        let mut listed: Vec<&str> = line("channel list:").split(", ").collect();
        // It names the types where they differ.
        let is_mixed = film.planes.iter().any(|plane| matches!(plane.data, PlaneData::U32(_)));
        let kind = |data: &PlaneData| match data {
            _ if !is_mixed => "",
            PlaneData::F32(_) | PlaneData::U8(_) => " (float)",
            PlaneData::U32(_) => " (uint)",
        };
        let mut wanted: Vec<String> =
            film.planes.iter().map(|plane| format!("{}{}", plane.name, kind(&plane.data))).collect();
        listed.sort_unstable();
        wanted.sort_unstable();
        assert_eq!(listed, wanted);
        // Written again by the other program, in its own types, every number is the same.
        oiiotool(&["--native", name, "-o", "copy.exr"], dir).unwrap();
        let copy = exr::read(&dir.join("copy.exr")).unwrap();
        assert_eq!((copy.width, copy.height, copy.window), (film.width, film.height, film.window));
        for plane in &film.planes {
            match &plane.data {
                PlaneData::F32(data) => {
                    let bits = |list: &[f32]| list.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                    assert_eq!(bits(data), bits(copy.f32_plane(&plane.name).unwrap()), "{name}: {}", plane.name);
                }
                PlaneData::U8(_) => panic!("{name}: files have no such planes"),
                PlaneData::U32(data) => {
                    // It writes floats, and to it the largest whole number is 1.
                    for (&id, &share) in data.iter().zip(copy.f32_plane(&plane.name).unwrap()) {
                        let want = f64::from(id) / f64::from(u32::MAX);
                        assert!((f64::from(share) - want).abs() <= 1e-7 * want, "{name}: {} {id} {share}", plane.name);
                    }
                }
            }
        }
    }
}
