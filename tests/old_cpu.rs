//! A binary on a CPU that lacks what it was compiled for says so in one line and exits with 2.

use std::process::Command;

#[test]
fn an_older_cpu_gets_a_sentence() {
    // The oldest x86-64 there is, as an emulator plays it.
    let run = Command::new("qemu-x86_64").args(["-cpu", "qemu64", env!("CARGO_BIN_EXE_lanecast"), "--version"]).output();
    let Ok(output) = run else {
        println!("SKIPPED: qemu-x86_64 not found");
        return;
    };
    let message = String::from_utf8_lossy(&output.stderr);
    if cfg!(target_feature = "sse4.2") {
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.starts_with("error: this binary was compiled for") && message.lines().count() == 1, "{message}");
    } else {
        assert_eq!(output.status.code(), Some(0), "a baseline build runs everywhere: {message}");
    }
}
