//! Records what the binary was built from: git revision, dirty mark, compiler, flags. Nothing here may fail: a
//! package from a registry or a tarball has no git, and then the revision is "unknown".

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=src");
    println!("cargo:rerun-if-changed=Cargo.toml");
    let set = |name: &str, value: &str| println!("cargo:rustc-env=LANECAST_{name}={}", value.replace('\n', " "));

    // A checkout that happens to contain an unpacked package is not the package's revision.
    let own = output("git", &["ls-files", "--error-unmatch", "build.rs"]).is_some();
    let revision = own.then(|| output("git", &["rev-parse", "--short=12", "HEAD"])).flatten();
    let changed = revision.is_some() && output("git", &["status", "--porcelain", "."]).is_none_or(|s| !s.is_empty());
    set("REVISION", revision.as_deref().unwrap_or("unknown"));
    set("DIRTY", if changed { "-dirty" } else { "" });
    // Commits move HEAD's log; its absence (no git) must not make every build rebuild.
    let log = output("git", &["rev-parse", "--git-path", "logs/HEAD"]);
    if let Some(log) = log.filter(|log| own && std::path::Path::new(log).exists()) {
        println!("cargo:rerun-if-changed={log}");
    }

    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
    set("RUSTC", output(&rustc, &["--version"]).as_deref().unwrap_or("unknown"));
    let flags = std::env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    set("FLAGS", &flags.replace('\u{1f}', " "));
    set("PROFILE", &std::env::var("PROFILE").unwrap_or_default());
}

/// Trimmed stdout of a command that succeeds.
fn output(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok().filter(|o| o.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim().to_string())
}
