//! The history of results: `ROOT/CPU-ISA/DATE-REVISION/SCENE/bench.csv` with `bench.env.txt` beside it. Nothing in it is ever
//! replaced, and rows of a build that no revision names need to be asked for.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::measure::rows::Run;

/// Most folders for one scene, revision and day.
const MOST: u32 = 1000;

/// Checks that the build's revision names its sources; `allowed` is what `--dirty` says.
///
/// # Errors
/// [`Error::Usage`] for a build of changed or unknown sources.
pub fn check_revision(revision: &str, allowed: bool) -> Result<()> {
    let named = revision != "unknown" && !revision.ends_with("-dirty");
    if named || allowed {
        return Ok(());
    }
    let what =
        format!("this binary was built from sources that no revision names ({revision}); build a clean checkout");
    Err(Error::Usage(format!("{what}, or give --dirty to keep rows that are marked so")))
}

/// The folder for the rows of `scene` in the history at `root`; it does not exist yet.
///
/// # Errors
/// [`Error::Usage`] if there are too many already.
pub fn folder(root: &Path, run: &Run, scene: &str) -> Result<PathBuf> {
    let day = run.date.get(..10).unwrap_or("undated");
    // Seven digits name a commit to people; the mark of changed sources stays.
    let (digits, mark) = run.revision.split_once('-').map_or((run.revision, ""), |(digits, _)| (digits, "-dirty"));
    let digits = digits.get(..7).unwrap_or(digits);
    let machine = root.join(slug(&format!("{} {}", run.cpu, run.isa))).join(format!("{day}-{digits}{mark}"));
    let name = slug(scene);
    let number = |n: u32| if n == 1 { name.clone() } else { format!("{name}-{n}") };
    let free = (1..=MOST).map(|n| machine.join(number(n))).find(|folder| !folder.exists());
    free.ok_or_else(|| Error::Usage(format!("{}: more than {MOST} runs of {name}", machine.display())))
}

/// Small letters, digits and single dashes.
fn slug(text: &str) -> String {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let slug = words.map(str::to_ascii_lowercase).collect::<Vec<_>>().join("-");
    if slug.is_empty() { "unnamed".into() } else { slug }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_unnamed_sources_need_to_be_asked_for() {
        assert!(check_revision("0123456789ab", false).is_ok());
        for revision in ["unknown", "0123456789ab-dirty"] {
            let fault = check_revision(revision, false).unwrap_err();
            assert!(fault.exit_code() == 2 && fault.to_string().contains(revision), "{fault}");
            assert!(check_revision(revision, true).is_ok());
        }
    }

    #[test]
    fn every_run_gets_a_folder_of_its_own() {
        let root = tempfile::tempdir().unwrap();
        let (date, cpu, command) = ["2026-01-31T00:00:00Z", "AMD EPYC(tm) 9R14", "x"].map(String::from).into();
        let run =
            Run { date, revision: "0123456789ab-dirty", isa: "avx512", flags: "", rustc: "", cpu, threads: 1, command };
        let first = folder(root.path(), &run, "Sponza: atrium").unwrap();
        let end = "amd-epyc-tm-9r14-avx512/2026-01-31-0123456-dirty/sponza-atrium";
        assert_eq!(first, root.path().join(end));
        std::fs::create_dir_all(&first).unwrap();
        assert_eq!(folder(root.path(), &run, "Sponza: atrium").unwrap(), root.path().join(format!("{end}-2")));
        assert!(folder(root.path(), &run, "../..").unwrap().ends_with("unnamed"));
    }
}
