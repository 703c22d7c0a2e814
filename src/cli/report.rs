//! `lanecast report`: a folder of results as one page.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::common::{OutputArgs, ThreadArgs, check_ending, with_pool};
use super::output::json_to_stdout;
use crate::error::{Error, Result};
use crate::film::{check_file, write_atomically};
use crate::measure::{env, report};

const EXAMPLES: &str = "\
Examples:
  lanecast report results -o report.html
  lanecast report out -o out/report.html --title \"Sponza, one thread\"
  lanecast report results --readme README.md

DIR is what `bench -o`, `bench --record` or `bench --experiment` wrote: every bench.csv in it and below, with the \
facts and pictures beside. The page holds all it needs: no other file, nothing from the network. Pictures of the \
same name in different folders, or NAME.reference.exr beside NAME.exr, are compared. With --readme no page is made: \
tables of rates are put between the marks of a text, `<!-- figures` and `<!-- end of figures -->` \
(docs/METHODOLOGY.md).";

/// Arguments of `lanecast report`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct ReportArgs {
    /// Folder of results
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The page
    #[arg(short = 'o', long = "output", value_name = "FILE.html", default_value = "report.html")]
    file: PathBuf,
    /// Its title [default: the folder's name]
    #[arg(long)]
    title: Option<String>,
    /// Instead of a page: make the figures between the marks of this text anew from the newest rows
    #[arg(long, value_name = "FILE.md", conflicts_with_all = ["title", "file"])]
    readme: Option<PathBuf>,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

/// The object of `--json` with `--readme`.
#[derive(serde::Serialize)]
struct Filled {
    tables: usize,
    changed: bool,
}

/// Runs `lanecast report`.
///
/// # Errors
/// Bad input; a page or text that cannot be written.
pub fn run(args: &ReportArgs) -> Result<()> {
    if let Some(file) = &args.readme {
        return readme(args, file);
    }
    check_ending("-o", &args.file, "html")?;
    check_file(&args.file)?;
    let options = report::Options { title: args.title.clone(), command: env::command_line(), date: env::now() };
    let (page, summary) = with_pool(args.threads.count(), || report::html(&args.folder, &options))?;
    write_atomically(&args.file, |file| file.write_all(page.as_bytes()))?;
    let report::Summary { runs, rows, figures, pairs } = summary;
    args.output.say(&format!(
        "{}: {runs} runs, {rows} rows, {figures} figures, {pairs} pairs of pictures",
        args.file.display()
    ));
    if args.output.json { json_to_stdout(&summary) } else { Ok(()) }
}

fn readme(args: &ReportArgs, file: &Path) -> Result<()> {
    check_file(file)?;
    let (text, tables) = report::figures_in(file, &args.folder)?;
    let changed = std::fs::read(file).map_err(|e| Error::io(file, e))? != text.as_bytes();
    if changed {
        write_atomically(file, |out| out.write_all(text.as_bytes()))?;
    }
    let what = if changed { "made anew" } else { "as they were" };
    args.output.say(&format!("{}: figures in {tables} places, {what}", file.display()));
    if args.output.json { json_to_stdout(&Filled { tables, changed }) } else { Ok(()) }
}
