//! The page: heading, machine, contents, sections; style and script inside.

use std::collections::BTreeMap;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::Options;
use super::collect::Found;
use super::figures::{Section, table};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Nothing may be fetched; what the page needs is in it.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// The whole page.
pub fn page(title: &str, options: &Options, found: &Found, sections: Vec<Section>) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="generator" content=(concat!("lanecast ", env!("CARGO_PKG_VERSION")));
                link rel="icon" href="data:,";
                title { (title) " - lanecast" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { (title) }
                    p { "Results of lanecast, " (options.date) ". " (found.runs.len()) " runs, " (found.rows.len()) " rows." }
                    button #theme type="button" aria-label="light or dark" { "light / dark" }
                    nav {
                        a href="#machine" { "Machine" }
                        @for section in &sections { a href={ "#" (section.id) } { (section.title) } }
                    }
                }
                main {
                    (machine(found))
                    @for section in &sections {
                        section id=(section.id) { h2 { (section.title) } (section.body) }
                    }
                }
                footer { p { "Made by" } pre { (options.command) } }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    }
}

/// Facts that are worth a row in the summary of machines.
const SHOWN: [&str; 10] = [
    "cpu",
    "cpu family",
    "cpu model number",
    "cores available",
    "isa compiled",
    "rustc",
    "rustflags",
    "profile",
    "threads",
    "governor",
];

/// Most runs whose facts are told in full.
const MOST_FACTS: usize = 12;

fn facts(facts: &[(String, String)]) -> Markup {
    table(&["fact", "value"], &facts.iter().map(|(name, value)| vec![name.clone(), value.clone()]).collect::<Vec<_>>())
}

/// Who measured: one row per run that differs from the others, and all facts on demand.
fn machine(found: &Found) -> Markup {
    let mut rows: BTreeMap<Vec<String>, Vec<String>> = BTreeMap::new();
    for (i, run) in found.runs.iter().enumerate() {
        let fact = |name: &str| run.facts.iter().find(|(n, _)| n == name).map(|(_, value)| value.clone());
        let row = found.rows.iter().find(|row| row.run == i);
        let column = |name: &str| row.map_or(String::new(), |row| row.text(name).to_string());
        // What the rows say serves where there is no file of facts.
        let spare = |name: &str| match name {
            "cpu" | "threads" => column(name),
            "isa compiled" => column("isa"),
            "rustflags" => column("flags"),
            _ => "-".into(),
        };
        let mut cells = vec![column("revision")];
        cells.extend(SHOWN.iter().map(|name| fact(name).unwrap_or_else(|| spare(name))));
        rows.entry(cells).or_default().push(run.place.clone());
    }
    let mut head = vec!["revision"];
    head.extend(SHOWN);
    head.push("runs");
    let firsts: Vec<&String> = rows.values().filter_map(|places| places.first()).collect();
    let told: Vec<_> = found
        .runs
        .iter()
        .filter(|run| firsts.contains(&&run.place) && !run.facts.is_empty())
        .take(MOST_FACTS)
        .collect();
    let body: Vec<Vec<String>> = rows
        .iter()
        .map(|(cells, places)| (cells.clone(), places))
        .map(|(mut cells, places)| {
            let shown = places.iter().take(4).cloned().collect::<Vec<_>>().join(", ");
            cells.push(if places.len() > 4 { format!("{shown} and {} more", places.len() - 4) } else { shown });
            cells
        })
        .collect();
    html! {
        section #machine {
            h2 { "Machine" }
            div.scroll { (table(&head, &body)) }
            @for run in told {
                details {
                    summary { "all facts about " (run.place) ", " (run.date) }
                    div.scroll { (facts(&run.facts)) }
                }
            }
        }
    }
}
