//! Plots as SVG, by the crate `plotters`. Lines and words are drawn in one ink that becomes the page's text colour, so that
//! a plot is readable on a light and on a dark page and in print; series are told apart by colour and by their marks' place.

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::measure::intervals::{Estimate, Interval};

/// Stands for the page's text colour.
const INK: RGBColor = RGBColor(1, 2, 3);
const INK_IN_SVG: &str = "#010203";

/// Colours of series, from M. Okabe, K. Ito, "Color Universal Design", 2008, without the two that vanish on one of the
/// backgrounds.
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 160, 220),
    RGBColor(190, 140, 0),
];

const FONT: &str = "sans-serif";
const WIDTH: u32 = 760;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Failure = DrawingAreaErrorKind<std::io::Error>;

/// A bar with its interval.
pub struct Bar {
    /// What it is.
    pub label: String,
    /// Which group it belongs to: bars of a group stand together, under its name.
    pub group: String,
    /// How long it is.
    pub value: Estimate,
    /// Which colour.
    pub series: usize,
}

/// Points joined by a line.
pub struct Line {
    /// What it is.
    pub label: String,
    /// Place and value.
    pub points: Vec<(f64, Estimate)>,
}

/// How the places along x are laid out and named.
pub enum Places {
    /// By their number.
    Linear,
    /// By the logarithm of their number.
    Logarithmic,
    /// One after the other: 0, 1, 2, ... with these names.
    Named(Vec<String>),
}

/// Horizontal bars; `None` if there is none, or if one cannot be drawn.
pub fn bars(bars: &[Bar], unit: &str) -> Option<String> {
    let most = most(bars.iter().map(|bar| &bar.value))?;
    let groups = bars.chunk_by(|a, b| a.group == b.group).count();
    let height = 20 * bars.len() as u32 + 20 * groups as u32 + 56;
    drawn(height, |root| {
        let (left, right) = root.split_horizontally(190);
        let rows = (bars.len() + groups) as f64;
        let mut chart = ChartBuilder::on(&right)
            .margin_right(24)
            .x_label_area_size(44)
            .build_cartesian_2d(0.0..1.05 * most, -rows..0.0)?;
        let mut mesh = chart.configure_mesh();
        mesh.disable_y_mesh().disable_y_axis().x_desc(unit).x_labels(8).light_line_style(TRANSPARENT);
        mesh.bold_line_style(INK.mix(0.15)).axis_style(INK).label_style((FONT, 12).into_font().color(&INK));
        mesh.axis_desc_style((FONT, 12).into_font().color(&INK)).draw()?;
        let mut at = 0.0;
        for group in bars.chunk_by(|a, b| a.group == b.group) {
            let (_, y) = chart.backend_coord(&(0.0, at - 0.6));
            word(&left, &group[0].group, (4, y), HPos::Left, true)?;
            at -= 1.0;
            for bar in group {
                let Estimate { value, interval: Interval { low, high } } = bar.value;
                let color = COLORS[bar.series % COLORS.len()];
                let (_, y) = chart.backend_coord(&(0.0, at - 0.5));
                word(&left, &bar.label, (182, y), HPos::Right, false)?;
                let filled = Rectangle::new([(0.0, at - 0.15), (value, at - 0.85)], color.mix(0.75).filled());
                chart.draw_series([filled])?;
                error_bar(&mut chart, [(low, at - 0.5), (high, at - 0.5)], (0.0, 0.18))?;
                at -= 1.0;
            }
        }
        Ok(())
    })
}

/// Lines over places; `None` if there is nothing to draw.
pub fn lines(lines: &[Line], places: &Places, x_unit: &str, y_unit: &str) -> Option<String> {
    let most = most(lines.iter().flat_map(|line| line.points.iter().map(|(_, e)| e)))?;
    let place = |x: f64| if matches!(places, Places::Logarithmic) { x.log10() } else { x };
    let xs = || lines.iter().flat_map(|line| line.points.iter().map(|(x, _)| place(*x)));
    let (low, high) = (xs().fold(f64::INFINITY, f64::min), xs().fold(f64::NEG_INFINITY, f64::max));
    if !low.is_finite() || !high.is_finite() {
        return None;
    }
    let pad = if high > low { 0.04 * (high - low) } else { 0.5 };
    let name = |x: &f64| match places {
        Places::Linear => format!("{}", (x * 100.0).round() / 100.0),
        Places::Logarithmic => short(10f64.powf(*x)),
        Places::Named(names) => {
            let whole = (x - x.round()).abs() < 1e-6 && *x > -0.5;
            names.get(x.round().max(0.0) as usize).filter(|_| whole).cloned().unwrap_or_default()
        }
    };
    let legend = 18 * lines.len() as u32 + 8;
    drawn(300 + legend, |root| {
        let (upper, lower) = root.split_vertically(300);
        let mut chart = ChartBuilder::on(&upper)
            .margin_right(24)
            .margin_top(8)
            .x_label_area_size(44)
            .y_label_area_size(56)
            .build_cartesian_2d(low - pad..high + pad, 0.0..1.05 * most)?;
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(x_unit).y_desc(y_unit).x_label_formatter(&name).light_line_style(TRANSPARENT).x_labels(8);
        mesh.bold_line_style(INK.mix(0.15)).axis_style(INK).label_style((FONT, 12).into_font().color(&INK));
        mesh.axis_desc_style((FONT, 12).into_font().color(&INK)).draw()?;
        for (i, line) in lines.iter().enumerate() {
            let color = COLORS[i % COLORS.len()];
            let mut points: Vec<(f64, f64)> = line.points.iter().map(|(x, e)| (place(*x), e.value)).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            chart.draw_series([PathElement::new(points.clone(), color.stroke_width(2))])?;
            chart.draw_series(points.iter().map(|&p| Circle::new(p, 3, color.filled())))?;
            for (x, Estimate { interval: Interval { low, high }, .. }) in &line.points {
                error_bar(&mut chart, [(place(*x), *low), (place(*x), *high)], (0.0, 0.0))?;
            }
            let y = 12 + 18 * i as i32;
            lower.draw(&PathElement::new(vec![(60, y), (84, y)], color.stroke_width(3)))?;
            word(&lower, &line.label, (92, y), HPos::Left, false)?;
        }
        Ok(())
    })
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// A line between two points with an end mark of half-size `mark`.
fn error_bar(chart: &mut Chart<'_, '_>, ends: [(f64, f64); 2], mark: (f64, f64)) -> Result<(), Failure> {
    let style = INK.stroke_width(1);
    chart.draw_series([PathElement::new(ends, style)])?;
    let across = |(x, y): (f64, f64)| PathElement::new([(x - mark.0, y - mark.1), (x + mark.0, y + mark.1)], style);
    chart.draw_series(ends.map(across))?;
    Ok(())
}

fn word(area: &Area<'_>, text: &str, at: (i32, i32), side: HPos, bold: bool) -> Result<(), Failure> {
    let style = if bold { FontStyle::Bold } else { FontStyle::Normal };
    let font = (FONT, 12).into_font().style(style).color(&INK).pos(Pos::new(side, VPos::Center));
    area.draw(&Text::new(cut(text, 34), at, font))
}

fn cut(text: &str, most: usize) -> String {
    if text.chars().count() <= most { text.into() } else { text.chars().take(most - 1).chain(['…']).collect() }
}

/// The largest value or end of an interval; `None` if there is no positive, finite one.
fn most<'a>(values: impl Iterator<Item = &'a Estimate>) -> Option<f64> {
    let most = values.fold(0.0, |most: f64, e| most.max(e.value).max(e.interval.high));
    (most > 0.0 && most.is_finite()).then_some(most)
}

/// 1000 as 1k, a million as 1M.
fn short(x: f64) -> String {
    let (x, unit) = if x >= 1e6 {
        (x / 1e6, "M")
    } else if x >= 1e3 {
        (x / 1e3, "k")
    } else {
        (x, "")
    };
    format!("{}{unit}", (x * 10.0).round() / 10.0)
}

/// Draws on a page of `height`; `None` if plotters fails (it writes to memory, so only on impossible sizes).
fn drawn(height: u32, draw: impl FnOnce(&Area<'_>) -> Result<(), Failure>) -> Option<String> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        draw(&root).ok()?;
        root.present().ok()?;
    }
    // The page scales plots; a fixed size would overflow a phone.
    let size = format!("width=\"{WIDTH}\" height=\"{height}\"");
    Some(svg.replace(INK_IN_SVG, "currentColor").replacen(&size, "role=\"img\"", 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value: f64) -> Estimate {
        Estimate { value, interval: Interval { low: 0.9 * value, high: 1.1 * value } }
    }

    #[test]
    fn bars_carry_their_names_and_the_pages_ink() {
        let bar = |label: &str, value| Bar {
            label: label.into(),
            group: "primary".into(),
            value: estimate(value),
            series: 0,
        };
        let svg = bars(&[bar("a<b", 2.0), bar("tile", 8.0)], "Mrays/s").unwrap();
        assert!(svg.contains("primary") && svg.contains("a&lt;b") && svg.contains("Mrays/s"), "{svg}");
        assert!(svg.contains("currentColor") && !svg.contains(INK_IN_SVG) && svg.contains("viewBox"), "{svg}");
        assert!(!svg.contains("width=\"760\" height"), "{svg}");
        assert!(bars(&[], "x").is_none() && bars(&[bar("a", f64::NAN)], "x").is_none());
    }

    #[test]
    fn lines_name_their_places() {
        let line = Line { label: "tile".into(), points: vec![(1e3, estimate(3.0)), (1e6, estimate(1.0))] };
        let svg = lines(&[line], &Places::Logarithmic, "triangles", "Mrays/s").unwrap();
        assert!(svg.contains("1k") && svg.contains("1M") && svg.contains("tile"), "{svg}");
        let named = Line { label: "tile".into(), points: vec![(0.0, estimate(3.0)), (1.0, estimate(1.0))] };
        let svg = lines(&[named], &Places::Named(vec!["old".into(), "new".into()]), "run", "x").unwrap();
        assert!(svg.contains("old") && svg.contains("new"), "{svg}");
        assert!(lines(&[], &Places::Linear, "x", "y").is_none());
    }
}
