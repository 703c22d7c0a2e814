//! `lanecast report`: a folder of results as one page.

use std::io::Write;
use std::path::PathBuf;

use super::common::{OutputArgs, ThreadArgs, with_pool};
use super::output::json_to_stdout;
use crate::error::Result;
use crate::film::write_atomically;
use crate::measure::{env, report};

const EXAMPLES: &str = "\
Examples:
  lanecast report results -o report.html
  lanecast report out -o out/report.html --title \"Sponza, one thread\"

DIR is what `bench -o`, `bench --record` or `bench --experiment` wrote: every bench.csv in it and below, with the facts
and pictures beside. The page holds all it needs: no other file, nothing from the network. Pictures of the same name in
different folders, or NAME.reference.exr beside NAME.exr, are compared.";

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
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

/// Runs `lanecast report`.
///
/// # Errors
/// Bad input; a page that cannot be written.
pub fn run(args: &ReportArgs) -> Result<()> {
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
