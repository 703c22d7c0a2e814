//! A figure: a plot, the table behind it, and the commands that made its rows.

use maud::{Markup, html};

use super::collect::Row;
use crate::measure::intervals::Estimate;

/// A part of the page.
pub struct Section {
    /// Anchor.
    pub id: &'static str,
    /// Heading.
    pub title: &'static str,
    /// Figures in it.
    pub figures: usize,
    /// Pairs of pictures in it.
    pub pairs: usize,
    /// Its content.
    pub body: Markup,
}

impl Section {
    /// A section of figures; `None` if there are none. `about` says how to read them.
    pub fn of_figures(id: &'static str, title: &'static str, about: &str, figures: Vec<Markup>) -> Option<Self> {
        let count = figures.len();
        let body = html! { p { (about) } @for figure in figures { (figure) } };
        (count > 0).then_some(Self { id, title, figures: count, pairs: 0, body })
    }
}

/// A figure: `plot` is SVG made here.
pub fn figure(title: &str, plot: Option<String>, table: &Markup, rows: &[&Row]) -> Markup {
    html! {
        figure {
            figcaption { (title) }
            @if let Some(svg) = plot { div.plot { (maud::PreEscaped(svg)) } }
            details open[rows.len() <= 12] { summary { "table" } div.scroll { (table) } }
            (commands(rows))
        }
    }
}

/// How the tree, the scene and the rays were made, as a part of a title: what the command of `row` says, other than of the column `but`.
pub fn made(row: &Row, but: &str) -> String {
    let said = |column: &str, before: &str| match row.text(column) {
        value if value.is_empty() || column == but => String::new(),
        value => format!("{before}{value}"),
    };
    said("preset", ", preset ") + &said("leaf", ", leaves of up to ") + &said("set", ", ") + &said("settings", ", ")
}

/// The commands that made `rows`, each once.
pub fn commands(rows: &[&Row]) -> Markup {
    let mut seen: Vec<(&str, &str)> = rows.iter().map(|row| (row.text("command"), row.text("revision"))).collect();
    seen.sort_unstable();
    seen.dedup();
    seen.retain(|(command, _)| !command.is_empty());
    html! {
        @if !seen.is_empty() {
            details.commands {
                summary { @if seen.len() == 1 { "command" } @else { (seen.len()) " commands" } }
                @for (command, revision) in seen { pre { (command) "\n# revision " (revision) } }
            }
        }
    }
}

/// A table that can be sorted by its columns; numbers are right-aligned.
pub fn table(head: &[&str], rows: &[Vec<String>]) -> Markup {
    let numeric = |i: usize| rows.iter().all(|row| row.get(i).is_none_or(|cell| is_number(cell)));
    let numeric: Vec<bool> = (0..head.len()).map(numeric).collect();
    html! {
        table {
            thead { tr { @for (i, name) in head.iter().enumerate() { th .n[numeric[i]] scope="col" { (name) } } } }
            tbody {
                @for row in rows {
                    tr { @for (i, cell) in row.iter().enumerate() { td .n[numeric.get(i) == Some(&true)] { (cell) } } }
                }
            }
        }
    }
}

fn is_number(cell: &str) -> bool {
    let first = cell.trim_start_matches(['-', '±']).chars().next();
    first.is_none_or(|c| c.is_ascii_digit())
}

/// A value with its interval.
pub fn with_interval(estimate: Option<Estimate>, digits: usize) -> String {
    estimate.map_or("-".into(), |Estimate { value, interval: i }| {
        format!("{value:.digits$} ({:.digits$} to {:.digits$})", i.low, i.high)
    })
}

/// A number, or a dash.
pub fn number(x: Option<f64>, digits: usize) -> String {
    x.map_or("-".into(), |x| format!("{x:.digits$}"))
}

/// A share in per cent, or a dash.
pub fn percent(x: Option<f64>) -> String {
    x.map_or("-".into(), |x| format!("{:.0} %", 100.0 * x))
}
