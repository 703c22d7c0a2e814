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
/// [`Error::Usage`] if `folder` holds turns already, or a program refuses the words or writes no rows; [`Error::Io`] if a program cannot be run,
/// [`Error::Mismatch`] if one fails; [`Error::Interrupted`].
pub fn run(other: &Path, turns: u32, folder: &Path, output: &OutputArgs) -> Result<Vec<Change>> {
    let own = std::env::current_exe().map_err(|e| Error::io("the running program", e))?;
    let words = common_words(std::env::args_os().skip(2));
    // Turns of an earlier run would be compared as if they were of this one.
    if let Some(side) = ["old", "new"].map(|side| folder.join(side)).iter().find(|side| side.exists()) {
        let what = format!("{} is there already, of an earlier run; give another folder with -o", side.display());
        return Err(Error::Usage(what));
    }
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
    let mut command = Command::new(program);
    // Own options first: after a `--` among the words they would be scenes.
    command.arg("bench").arg("--quiet").arg("-o").arg(folder).args(words).stdout(Stdio::null());
    let status = command.status().map_err(|e| Error::io(program, e))?;
    // A row with wrong hits (exit code 1) has no figure; the others still compare.
    match status.code() {
        Some(0 | 1) if folder.join("bench.csv").is_file() => Ok(()),
        Some(0 | 1) => {
            let what = "wrote no rows: expected a lanecast, which leaves bench.csv in the folder after -o";
            Err(Error::Usage(format!("{} bench: {what}", program.display())))
        }
        Some(2) => Err(Error::Usage(format!("{} bench: bad usage or input", program.display()))),
        Some(130) => Err(Error::Interrupted),
        _ => Err(Error::Mismatch(format!("{} bench: {status}", program.display()))),
    }
}

/// The words of a command line without those that only concern taking turns and reporting.
fn common_words(mut words: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        if word == "--" {
            // What follows are scenes, whatever they look like.
            kept.push(word);
            kept.extend(words.by_ref());
            break;
        }
        match is_about_turns(&word.to_string_lossy()) {
            None => kept.push(word),
            Some(false) => {}
            Some(true) => drop(words.next()),
        }
    }
    kept
}

/// If `word` only concerns taking turns and reporting: whether the next word is its value.
fn is_about_turns(word: &str) -> Option<bool> {
    const WITH_VALUE: [&str; 3] = ["--against", "--turns", "--output"];
    const ALONE: [&str; 3] = ["--json", "--quiet", "--verbose"];
    if let Some(letters) = word.strip_prefix('-').filter(|rest| !rest.starts_with('-')) {
        // Letters may stand together, the last with its value: -qv, -qofolder.
        let rest = letters.trim_start_matches(['q', 'v']);
        return match rest.strip_prefix('o') {
            Some(value) => Some(value.is_empty()),
            None => (rest.is_empty() && !letters.is_empty()).then_some(false),
        };
    }
    let (name, has_value) = word.split_once('=').map_or((word, false), |(name, _)| (name, true));
    if WITH_VALUE.contains(&name) { Some(!has_value) } else { ALONE.contains(&word).then_some(false) }
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
        let kept = |line: &str| common_words(line.split(' ').map(OsString::from));
        let line = "model.ply --against old --rays=primary -o out --turns=3 -oout --output=out --json --size 8x8 -v";
        assert_eq!(kept(line), ["model.ply", "--rays=primary", "--size", "8x8"]);
        let letters = "-qv --eye -1,0,0 -qo out -vqoout -vv --fov 40";
        assert_eq!(kept(letters), ["--eye", "-1,0,0", "--fov", "40"]);
        assert_eq!(kept("-q -- -q --json"), ["--", "-q", "--json"], "names of scenes");
    }
}
