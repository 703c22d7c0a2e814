//! What a command says: results on stdout, everything else on stderr.

use std::io::{self, IsTerminal, Write};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use crate::error::{Error, Result};

/// How a command reports.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct OutputArgs {
    /// Print one JSON object on stdout and everything human on stderr
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Print nothing but results and errors
    #[arg(short, long, help_heading = "Output")]
    pub quiet: bool,
    /// Say more on stderr; twice says still more
    #[arg(short, long, action = clap::ArgAction::Count, help_heading = "Output")]
    pub verbose: u8,
}

impl OutputArgs {
    /// A line on stderr unless `--quiet`.
    pub fn say(&self, line: &str) {
        if !self.quiet {
            to_stderr(line);
        }
    }

    /// What a scene is shown without, or otherwise than it says, a line each.
    pub fn warn<'a>(&self, warnings: impl IntoIterator<Item = &'a String>) {
        warnings.into_iter().for_each(|warning| self.say(&format!("warning: {warning}")));
    }

    /// A line on stderr with `-v`.
    pub fn detail(&self, line: &str) {
        if self.verbose > 0 {
            self.say(line);
        }
    }

    /// A bar of `len` steps on stderr; hidden when `--quiet` or when stderr is no terminal.
    pub fn progress_bar(&self, len: u64, what: &'static str) -> ProgressBar {
        let visible = !self.quiet && io::stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(len), target).with_message(what);
        // The template is a constant; if a later indicatif refuses it, the default style serves.
        if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:32}] {pos}/{len} {eta}") {
            bar.set_style(style.progress_chars("=> "));
        }
        bar
    }
}

/// A line on stderr; a closed stderr is nobody's concern.
pub fn to_stderr(line: &str) {
    let _closed = writeln!(io::stderr().lock(), "{line}");
}

/// Writes `text` to stdout. A reader that has gone away (`| head`) ends the output quietly.
///
/// # Errors
/// [`Error::Io`] for anything else, a full disk for example.
pub fn to_stdout(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(Error::io("stdout", e)),
        _ => Ok(()),
    }
}

/// Writes `value` to stdout as one JSON object on one line. Numbers JSON cannot hold (infinities) become null.
///
/// # Errors
/// Those of [`to_stdout`].
pub fn json_to_stdout(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string(value).map_err(|e| Error::io("stdout", e.into()))?;
    to_stdout(&format!("{text}\n"))
}
