//! Rows of results: one line of CSV per engine, scene and ray class, complete enough to be read alone in a year.

use std::fmt::Write as _;

use crate::lanes::compiled_isa;
use crate::measure::env;
use crate::measure::stats::Summary;

/// What is common to all rows of a run.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Run {
    /// UTC date and time.
    pub date: String,
    /// Revision of the build, see [`env::REVISION`].
    pub revision: &'static str,
    /// Instruction set of the build.
    pub isa: &'static str,
    /// Compiler flags of the build.
    pub flags: &'static str,
    /// Its compiler: `rustc --version`.
    pub rustc: &'static str,
    /// CPU model.
    pub cpu: String,
    /// Threads that traced, at most.
    pub threads: usize,
    /// The command as typed.
    pub command: String,
}

impl Run {
    /// A run that starts now, with the process's own command line.
    pub fn now(threads: usize) -> Self {
        Self {
            date: env::now(),
            revision: env::REVISION,
            isa: compiled_isa(),
            flags: env::FLAGS,
            rustc: env::RUSTC,
            cpu: env::cpu_model(),
            threads,
            command: env::command_line(),
        }
    }
}

/// The scene a row is about.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct SceneFacts {
    /// Name as in the description.
    pub name: String,
    /// SHA-256 of the scene, hex.
    pub hash: String,
    /// Primitives stored (triangles and shapes).
    pub prims: u64,
    /// Seconds of compiling: trees and storage.
    pub build_seconds: f64,
    /// Bytes of nodes and primitives.
    pub bytes: u64,
}

/// What was measured, or why not.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Checked and timed.
    Timed {
        /// Seconds per pass.
        seconds: Summary,
        /// Passes.
        repeat: usize,
        /// Seconds of every pass in the order they ran; the i-th passes of all engines belong to one round.
        passes: Vec<f64>,
        /// Rays that hit.
        hits: u64,
        /// Checksum of the answers.
        #[serde(serialize_with = "hexadecimal")]
        checksum: u64,
        /// Speed relative to `scalar`: median over rounds of its seconds / these seconds.
        ratio: Option<f64>,
        /// Lanes active / total over node visits, if the engine counts.
        node_lane_use: Option<f64>,
        /// The same over primitive tests.
        prim_lane_use: Option<f64>,
        /// Time of the counted tests alone over the median pass, see [`crate::measure::explain::Limit`]; scenes of triangles.
        percent_of_limit: Option<f64>,
    },
    /// Not run, with the reason.
    Skipped(String),
    /// Wrong answers: no figure.
    Wrong(String),
}

/// A checksum as `bench.csv` and `trace --json` have it: readers of JSON keep 53 bits of a number.
fn hexadecimal<S: serde::Serializer>(sum: &u64, to: S) -> std::result::Result<S::Ok, S::Error> {
    to.collect_str(&format_args!("{sum:016x}"))
}

/// What is said of a peer beside its figures.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct PeerRow {
    /// How it was called; empty if there is one way only.
    pub mode: &'static str,
    /// Version, tree and settings.
    pub description: String,
    /// The fastest mode of this peer in this class: the one to compare with.
    pub quoted: bool,
    /// Times as fast as this peer our fastest engine is, pass by pass.
    pub lead: Option<f64>,
}

/// One row.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// The scene.
    pub scene: SceneFacts,
    /// Ray class.
    pub class: &'static str,
    /// `closest` or `any`.
    pub query: &'static str,
    /// Engine or peer.
    pub engine: &'static str,
    /// `f32` or `f64`.
    pub precision: &'static str,
    /// Threads that traced.
    pub threads: usize,
    /// Rays in the set, dead ones included: one for each pixel of the picture, or scattered ones.
    pub rays: u64,
    /// Rays with `scalar`'s t and another primitive: shared edges, coincident surfaces.
    pub ties: u64,
    /// Rays with another answer than `scalar`'s (few, or there would be no figure).
    pub differences: u64,
    /// Of several numbers of threads: times as fast as one thread, pass by pass, per thread.
    pub efficiency: Option<f64>,
    /// What only peers have.
    pub peer: Option<PeerRow>,
    /// The rest.
    pub outcome: Outcome,
}

impl Row {
    /// Million rays per second of a pass of `seconds`.
    pub fn mrays(&self, seconds: f64) -> f64 {
        self.rays as f64 / seconds / 1e6
    }
}

const COLUMNS: &str = "revision,date,cpu,isa,flags,threads,scene,scene_hash,prims,class,query,engine,precision,rays,\
    status,hits,repeat,best_mrays_per_s,median_mrays_per_s,spread,mad_seconds,ratio_to_scalar,node_lane_use,\
    prim_lane_use,percent_of_limit,checksum,build_seconds,bytes,peer_mode,peer_description,quoted,ties,differences,ours_over_peer,\
    efficiency,command,seconds";

/// The file: a header line and one line per row, RFC 4180 quoting, lines end in LF.
pub fn csv(run: &Run, rows: &[Row]) -> String {
    let mut text = format!("{COLUMNS}\n");
    for row in rows {
        text.push_str(&line(run, row));
        text.push('\n');
    }
    text
}

fn line(run: &Run, row: &Row) -> String {
    let scene = &row.scene;
    let mut cells: Vec<String> = [run.revision, &run.date, &run.cpu, run.isa, run.flags].map(String::from).into();
    cells.extend([row.threads.to_string(), scene.name.clone(), scene.hash.clone(), scene.prims.to_string()]);
    cells.extend([row.class, row.query, row.engine, row.precision].map(String::from));
    cells.push(row.rays.to_string());
    let optional = |x: &Option<f64>| x.map_or(String::new(), |x| format!("{x:.4}"));
    match &row.outcome {
        Outcome::Timed {
            seconds,
            repeat,
            hits,
            checksum,
            ratio,
            node_lane_use,
            prim_lane_use,
            percent_of_limit,
            ..
        } => {
            cells.extend(["ok".into(), hits.to_string(), repeat.to_string()]);
            cells.extend([seconds.min, seconds.median].map(|s| format!("{:.4}", row.mrays(s))));
            cells.extend([format!("{:.4}", seconds.spread), format!("{:.9}", seconds.mad)]);
            cells.extend([ratio, node_lane_use, prim_lane_use, percent_of_limit].map(optional));
            cells.push(format!("{checksum:016x}"));
        }
        Outcome::Skipped(why) => cells.extend(without_figures(format!("skipped: {why}"))),
        Outcome::Wrong(why) => cells.extend(without_figures(format!("wrong: {why}"))),
    }
    cells.extend([format!("{:.6}", scene.build_seconds), scene.bytes.to_string()]);
    let peer = row.peer.as_ref();
    cells.extend(peer.map_or_else(Default::default, |peer| {
        [peer.mode.to_string(), peer.description.clone(), peer.quoted.to_string()]
    }));
    cells.extend([row.ties, row.differences].map(|n| n.to_string()));
    cells.push(peer.map_or(String::new(), |peer| optional(&peer.lead)));
    cells.push(optional(&row.efficiency));
    cells.push(run.command.clone());
    cells.push(match &row.outcome {
        Outcome::Timed { passes, .. } => passes.iter().map(|s| format!("{s:.9}")).collect::<Vec<_>>().join(" "),
        _ => String::new(),
    });
    cells.iter().map(|c| quoted(c)).collect::<Vec<_>>().join(",")
}

fn without_figures(status: String) -> [String; 12] {
    let mut cells: [String; 12] = Default::default();
    cells[0] = status;
    cells
}

fn quoted(cell: &str) -> String {
    if cell.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.into() }
}

/// The rows as an aligned table for people, one block per scene. Of a peer's modes only the fastest is shown.
pub fn table(rows: &[Row]) -> String {
    let shown: Vec<&Row> = rows.iter().filter(|row| row.peer.as_ref().is_none_or(|peer| peer.quoted)).collect();
    let width = shown.iter().map(|row| label(row).len()).max().unwrap_or(0).max("engine".len());
    let (mut text, mut scene) = (String::new(), None);
    for row in shown {
        if scene != Some(&row.scene.name) {
            scene = Some(&row.scene.name);
            text.push_str(&heading(&row.scene, width));
        }
        let what = format!("{:<8} {:<7} {:<width$} {}", row.class, row.query, label(row), row.precision);
        let figures = match &row.outcome {
            Outcome::Timed { seconds, hits, ratio, node_lane_use, prim_lane_use, .. } => format!(
                "{:>9.2} {:>9.2} {:>6.1}% {:>8} {:>7} {:>7} {:>10} {:>9} {:>7} {:>6}",
                row.mrays(seconds.median),
                row.mrays(seconds.min),
                100.0 * seconds.spread,
                times(*ratio),
                percent(*node_lane_use),
                percent(*prim_lane_use),
                hits,
                row.peer.as_ref().map_or("".into(), |peer| times(peer.lead)),
                row.ties,
                row.differences,
            ),
            Outcome::Skipped(why) => format!("  skipped: {why}"),
            Outcome::Wrong(why) => format!("  WRONG: {why}"),
        };
        let _infallible = writeln!(text, "  {what} {figures}");
    }
    text
}

fn label(row: &Row) -> String {
    match &row.peer {
        Some(peer) if !peer.mode.is_empty() => format!("{} [{}]", row.engine, peer.mode),
        _ => row.engine.into(),
    }
}

fn heading(scene: &SceneFacts, width: usize) -> String {
    let mib = scene.bytes as f64 / f64::from(1 << 20);
    format!(
        "{}: {} primitives, built in {:.3} s, {mib:.1} MiB\n  {:<8} {:<7} {:<width$} {:<3} {:>9} {:>9} {:>7} {:>8} {:>7} \
         {:>7} {:>10} {:>9} {:>7} {:>6}\n",
        scene.name,
        scene.prims,
        scene.build_seconds,
        "rays",
        "query",
        "engine",
        "",
        "median",
        "best",
        "spread",
        "scalar",
        "node",
        "prim",
        "hits",
        "ours/peer",
        "ties",
        "differ",
    )
}

fn times(ratio: Option<f64>) -> String {
    ratio.map_or("-".into(), |r| format!("{r:.2}x"))
}

fn percent(use_of_lanes: Option<f64>) -> String {
    use_of_lanes.map_or("-".into(), |x| format!("{:.0}%", 100.0 * x))
}

/// How to read [`table`].
pub const LEGEND: &str = "median, best: million rays per second; spread: (slowest - fastest) / median pass;\n\
    scalar: times as fast as the scalar engine, pass by pass; node, prim: lanes used in node and primitive tests;\n\
    ours/peer: times as fast as the peer (in its fastest mode) our fastest engine is, pass by pass;\n\
    ties: rays with scalar's distance and another primitive; differ: rays with another answer than scalar's.\n";

#[cfg(test)]
mod tests;
