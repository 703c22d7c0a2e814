//! How rates change with the number of threads, of primitives and of rays in the same picture, and with the size of leaves.

use std::collections::{BTreeMap, BTreeSet};

use maud::Markup;

use super::collect::{Found, Row};
use super::figures::{Section, figure, table, with_interval};
use super::plot::{Line, Places, lines};
use crate::measure::intervals::Estimate;

/// A way a scene can grow.
struct Axis {
    /// The column that grows.
    column: &'static str,
    /// Its name on the plot.
    unit: &'static str,
    /// What stays the same within a figure.
    same: &'static [&'static str],
    /// Fewest different values that make a figure.
    least: usize,
    places: Places,
}

fn axes() -> [Axis; 4] {
    [
        Axis {
            column: "threads",
            unit: "threads",
            same: &["scene", "scene_hash", "class", "precision", "rays"],
            least: 2,
            places: Places::Linear,
        },
        Axis {
            column: "prims",
            unit: "primitives",
            same: &["scene", "threads", "class", "precision", "rays"],
            least: 3,
            places: Places::Logarithmic,
        },
        Axis {
            column: "rays",
            unit: "rays",
            same: &["scene", "scene_hash", "class", "precision", "threads"],
            least: 3,
            places: Places::Logarithmic,
        },
        Axis {
            column: "leaf",
            unit: "primitives in a leaf at most",
            same: &["scene", "scene_hash", "class", "precision", "rays", "threads"],
            least: 2,
            places: Places::Linear,
        },
    ]
}

/// Scaling figures, where rows allow some.
pub fn section(found: &Found) -> Option<Section> {
    let figures = axes().iter().flat_map(|axis| of_axis(found, axis)).collect();
    let about = "Million rays per second over what grows; of several runs with the same size, the newest.";
    Section::of_figures("scaling", "Scaling", about, figures)
}

fn of_axis(found: &Found, axis: &Axis) -> Vec<Markup> {
    let mut groups: BTreeMap<Vec<&str>, Vec<&Row>> = BTreeMap::new();
    let placed = |row: &&Row| row.is_timed() && row.is_quoted() && row.number(axis.column).is_some();
    for row in found.rows.iter().filter(placed) {
        groups.entry(axis.same.iter().map(|column| row.text(column)).collect()).or_default().push(row);
    }
    let distinct = |rows: &[&Row]| rows.iter().map(|row| row.text(axis.column)).collect::<BTreeSet<_>>().len();
    groups.retain(|_, rows| distinct(rows) >= axis.least);
    groups.into_values().filter_map(|rows| one(axis, &rows)).collect()
}

fn one(axis: &Axis, rows: &[&Row]) -> Option<Markup> {
    // By engine, then by place; a later run replaces an earlier one.
    let mut series: BTreeMap<String, BTreeMap<u64, (Estimate, &Row)>> = BTreeMap::new();
    for row in rows {
        if let (Some(x), Some(rate)) = (row.number(axis.column), row.rate()) {
            series.entry(row.text("engine").into()).or_default().insert(x as u64, (rate, row));
        }
    }
    let drawn: Vec<Line> = series
        .iter()
        .map(|(engine, points)| Line {
            label: engine.clone(),
            points: points.iter().map(|(x, (rate, _))| (*x as f64, *rate)).collect(),
        })
        .collect();
    let used: Vec<&Row> = series.values().flat_map(|points| points.values().map(|(_, row)| *row)).collect();
    let body: Vec<Vec<String>> = series
        .iter()
        .flat_map(|(engine, points)| {
            let first = points.values().next().map(|(rate, _)| rate.value);
            points.iter().map(move |(x, (rate, _))| {
                let relative = first.map_or("-".into(), |first| format!("{:.2}", rate.value / first));
                vec![engine.clone(), x.to_string(), with_interval(Some(*rate), 2), relative]
            })
        })
        .collect();
    let head = ["engine", axis.unit, "Mrays/s (95 %)", "over the first"];
    let [scene, class, precision] = ["scene", "class", "precision"].map(|column| rows.first().map(|r| r.text(column)));
    let (scene, class, precision, last) = (scene?, class?, precision?, axis.same.last()?);
    let last = format!("{last}: {}", rows.first()?.text(last));
    let title = format!("{scene}, {class} rays over {} ({precision}, {last})", axis.unit);
    let plot = lines(&drawn, &axis.places, axis.unit, "million rays per second");
    Some(figure(&title, plot, &table(&head, &body), &used))
}
