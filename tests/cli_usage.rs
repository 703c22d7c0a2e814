//! Help, versions, exit codes and refusals of the binary.

mod binary;

use binary::{lanecast, refused};

const COMMANDS: [&str; 5] = ["bench", "trace", "rays", "verify", "info"];

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn help_teaches_by_example() {
    let dir = folder();
    for command in COMMANDS {
        let ended = lanecast(dir.path(), &[command, "--help"]);
        assert_eq!(ended.code, Some(0), "{command}: {}", ended.err);
        assert!(
            ended.out.contains("Examples:") && ended.out.contains(&format!("  lanecast {command} ")),
            "{}",
            ended.out
        );
    }
    let top = lanecast(dir.path(), &["--help"]);
    assert_eq!(top.code, Some(0));
    for command in COMMANDS {
        assert!(top.out.contains(&format!("  {command} ")), "{command} in {}", top.out);
    }
    assert!(top.out.contains("Exit codes"));
}

#[test]
fn the_version_names_revision_and_instruction_set() {
    let dir = folder();
    let ended = lanecast(dir.path(), &["--version"]);
    assert_eq!(ended.code, Some(0));
    assert!(ended.out.starts_with("lanecast ") && ended.out.contains("revision ") && ended.out.contains("isa "));
}

#[test]
fn bad_usage_exits_with_2() {
    let dir = folder();
    let path = dir.path();
    assert_eq!(lanecast(path, &[]).code, Some(2));
    refused(path, &["unheard-of"], "unheard-of");
    refused(path, &["info"], "SCENE");
    refused(path, &["info", "missing.ply"], "missing.ply");
    refused(path, &["info", "builtin:sphere-flak"], "sphere-flake");
    refused(path, &["info", "scene.unknown"], "scene.unknown");
    refused(path, &["info", "builtin:sphere-flake", "--set", "depth"], "NAME=VALUE");
    refused(path, &["rays", "builtin:cornell", "--kind", "primry", "-o", "r.npy"], "primary");
    refused(path, &["rays", "builtin:cornell", "--kind", "ao", "--size", "0x4", "-o", "r.npy"], "WIDTHxHEIGHT");
    refused(path, &["rays", "builtin:cornell", "--kind", "ao", "--fov", "180", "-o", "r.npy"], "degrees");
    refused(path, &["bench", "builtin:cornell", "--engines", "scaler"], "scalar");
    refused(path, &["bench", "--threads", "0"], "threads");
    assert_eq!(binary::files(path), Vec::<String>::new(), "refusals leave no files");
}

/// `--eye -1,0,0` is a point, not an option.
#[test]
fn negative_coordinates_are_values() {
    let dir = folder();
    let arguments = "rays builtin:cornell --kind primary --size 32x32 --eye -9,1,8 --look-at -1,0,0 -o rays.npy";
    let ended = lanecast(dir.path(), &arguments.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let bytes = std::fs::read(dir.path().join("rays.npy")).expect("a ray file");
    let (header, data) = binary::npy_parts(&bytes);
    assert!(header.contains("(1024, 8)"), "{header}");
    assert_eq!(&data[..12], [-9f32, 1.0, 8.0].map(f32::to_le_bytes).concat());
}

/// `lanecast info ... | head -0` ends quietly with success.
#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_error() {
    use std::process::{Command, Stdio};
    let mut child = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .args(["info", "builtin:cornell"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("an end");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{err}");
    assert!(!err.contains("error") && !err.contains("panicked"), "{err}");
}
