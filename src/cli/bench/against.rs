//! `bench --against`: another lanecast and this one take turns, as whole processes, and are then compared.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::cli::interrupt::stopped;
use crate::cli::output::OutputArgs;
use crate::error::{Error, Result};
use crate::measure::compare::{self, Change};

/// Runs `other` and this program in turns, each `turns` times, with the words of this command line; rows go to
/// `folder/old/NN` and `folder/new/NN`.
///
/// # Errors
/// [`Error::Io`] if a program cannot be run, [`Error::Mismatch`] if one fails; [`Error::Interrupted`].
pub fn run(other: &Path, turns: u32, folder: &Path, output: &OutputArgs) -> Result<Vec<Change>> {
    let own = std::env::current_exe().map_err(|e| Error::io("the running program", e))?;
    let words = common_words(std::env::args_os().skip(2));
    let bar = output.progress_bar(u64::from(2 * turns), "taking turns");
    for turn in 1..=turns {
        for (program, side) in [(other, "old"), (own.as_path(), "new")] {
            if stopped() {
                bar.finish_and_clear();
                return Err(Error::Interrupted);
            }
            one(program, &words, &folder.join(side).join(format!("{turn:03}")))?;
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    Ok(compare::compare(&compare::read(&folder.join("old"))?, &compare::read(&folder.join("new"))?))
}

fn one(program: &Path, words: &[OsString], folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    let mut command = Command::new(program);
    command.arg("bench").args(words).arg("-o").arg(folder).arg("--quiet").stdout(Stdio::null());
    let status = command.status().map_err(|e| Error::io(program, e))?;
    // A row with wrong hits (exit code 1) has no figure; the others still compare.
    match status.code() {
        Some(0 | 1) => Ok(()),
        Some(130) => Err(Error::Interrupted),
        _ => Err(Error::Mismatch(format!("{} bench: {status}", program.display()))),
    }
}

/// The words of a command line without those that only concern taking turns and reporting.
fn common_words(words: impl Iterator<Item = OsString>) -> Vec<OsString> {
    const WITH_VALUE: [&str; 4] = ["--against", "--turns", "-o", "--output"];
    const ALONE: [&str; 5] = ["--json", "-q", "--quiet", "-v", "--verbose"];
    let (mut kept, mut skip) = (Vec::new(), false);
    for word in words {
        let text = word.to_string_lossy();
        let value_inside = WITH_VALUE.iter().any(|name| {
            let rest = text.strip_prefix(name);
            rest.is_some_and(|rest| rest.starts_with('=') || name.len() == 2 && !rest.is_empty())
        });
        if std::mem::take(&mut skip) || value_inside || ALONE.contains(&&*text) {
            continue;
        }
        if WITH_VALUE.contains(&&*text) {
            skip = true;
            continue;
        }
        kept.push(word);
    }
    kept
}

/// A folder for rows that nobody asked to keep.
///
/// # Errors
/// [`Error::Io`].
pub fn temporary() -> Result<(tempfile::TempDir, PathBuf)> {
    let dir = tempfile::tempdir().map_err(|e| Error::io(std::env::temp_dir(), e))?;
    let path = dir.path().to_path_buf();
    Ok((dir, path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_measured_is_passed_on() {
        let line = "model.ply --against old --rays=primary -o out --turns=3 -oout --output=out --json --size 8x8 -v";
        let kept = common_words(line.split(' ').map(OsString::from));
        assert_eq!(kept, ["model.ply", "--rays=primary", "--size", "8x8"]);
    }
}
