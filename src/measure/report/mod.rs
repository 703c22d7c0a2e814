//! The report: everything a folder of results holds as one page that needs nothing else: no network, no other file.
//!
//! `collect` finds rows and pictures, `figures` turns rows into plots with the table behind each, `plot` draws SVG,
//! `pictures` pairs and compares pictures, `page` lays all of it out; `markdown` puts figures into a text instead.

mod collect;
mod figures;
mod history;
mod markdown;
mod page;
mod pictures;
mod plot;
mod rates;
mod scaling;

use std::path::Path;

use crate::error::{Error, Result};

/// Largest text that figures are put into, bytes.
const MAX_TEXT: u64 = 16 << 20;

/// What a report is made from, and what it says about itself.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Title of the page; `None`: the folder's name.
    pub title: Option<String>,
    /// The command that makes this page.
    pub command: String,
    /// When.
    pub date: String,
}

/// What came of a report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Summary {
    /// Runs (result files) found.
    pub runs: usize,
    /// Rows in them.
    pub rows: usize,
    /// Figures with their tables.
    pub figures: usize,
    /// Pairs of pictures.
    pub pairs: usize,
}

/// The page about `folder` as HTML, and what it holds.
///
/// # Errors
/// A folder without results; files of results that cannot be read, with line and column. Pictures that cannot be read are
/// named on the page.
pub fn html(folder: &Path, options: &Options) -> Result<(String, Summary)> {
    let found = collect::collect(folder)?;
    let mut sections = vec![rates::section(&found), scaling::section(&found), rates::limits(&found)];
    sections.extend([rates::accuracy(&found), pictures::section(&found)?, history::section(&found)]);
    let sections: Vec<_> = sections.into_iter().flatten().collect();
    let summary = Summary {
        runs: found.runs.len(),
        rows: found.rows.len(),
        figures: sections.iter().map(|s| s.figures).sum(),
        pairs: sections.iter().map(|s| s.pairs).sum(),
    };
    let name = folder.canonicalize().ok().and_then(|p| Some(p.file_name()?.to_string_lossy().into_owned()));
    let title = options.title.clone().or(name).unwrap_or_else(|| "results".into());
    Ok((page::page(&title, options, &found, sections).into_string(), summary))
}

/// The text of `file` with the figures between its marks (docs/METHODOLOGY.md) made anew from the newest rows in `folder`, and
/// the number of places.
///
/// # Errors
/// As [`html`]; a text that cannot be read, has no marks, or asks for what no run holds, with the line.
pub fn figures_in(file: &Path, folder: &Path) -> Result<(String, usize)> {
    let size = std::fs::metadata(file).map_err(|e| Error::io(file, e))?.len();
    if size > MAX_TEXT {
        return Err(Error::whole(file, format!("expected at most {MAX_TEXT} bytes of text, found {size}")));
    }
    let text = std::fs::read_to_string(file).map_err(|e| Error::io(file, e))?;
    markdown::fill(&text, file, &collect::collect(folder)?)
}

#[cfg(test)]
mod tests;
