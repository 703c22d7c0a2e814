//! The reports of `compare` for people.

use std::fmt::Write as _;

use crate::film::metrics::Classes;
use crate::measure::hitfiles::HitReport;
use crate::measure::pictures::{Domain, PictureReport};
use crate::measure::truth::Counts;

/// Figures of two pictures.
pub fn pictures(report: &PictureReport) -> String {
    let mut text = format!("{}x{} pixels\n", report.width, report.height);
    let mut line = |name: &str, value: String| {
        // Writing to a String cannot fail.
        let _infallible = writeln!(text, "{name:<10} {value}");
    };
    if let Some(c) = &report.colors {
        let domain = match c.domain {
            Domain::Display => "display values, 0 to 1",
            Domain::Linear => "linear light",
        };
        line("colours", format!("{domain}; white {}", c.peak));
        line("RMSE", format!("{:.6e}, largest error {:.6e}", c.rmse, c.max_error));
        line("relMSE", format!("{:.6e}", c.rel_mse));
        line("PSNR", format!("{:.3} dB", c.psnr));
        line("SSIM", c.ssim.map_or("- (smaller than 11x11)".into(), |x| format!("{x:.6}")));
        line("FLIP", format!("{:.6} mean, {:.6} largest", c.flip, c.max_flip));
        if let Some(hdr) = c.hdr_flip {
            line("HDR-FLIP", format!("{hdr:.6} mean"));
        }
        if c.not_finite > 0 {
            line("not finite", format!("{} samples in one file only", c.not_finite));
        }
    }
    line("samples", classes(report.classes, report.unit));
    if let Some(ulp) = report.max_ulp {
        line("farthest", format!("{ulp} ulp"));
    }
    if let Some(levels) = report.levels.filter(|_| report.unit != "level") {
        line("8-bit", classes(levels, "level"));
    }
    if report.planes.len() > 3 {
        let width = report.planes.iter().map(|p| p.name.len()).max().unwrap_or(0).max(5);
        let _infallible = writeln!(
            text,
            "\n{:<width$} {:>12} {:>12} {:>10} {:>10} {:>10} {:>12}",
            "plane", "RMSE", "max", "same", "1 ulp", "beyond", "farthest"
        );
        for p in &report.planes {
            let (e, c) = (p.errors, p.classes);
            let _infallible = writeln!(
                text,
                "{:<width$} {:>12.4e} {:>12.4e} {:>10} {:>10} {:>10} {:>12}",
                p.name, e.rmse, e.max, c.exact, c.within_one, c.beyond, p.max_ulp
            );
        }
    }
    if !report.unmatched.is_empty() {
        let _infallible = writeln!(text, "only in one file, or of another type: {}", report.unmatched.join(", "));
    }
    text
}

fn classes(c: Classes, unit: &str) -> String {
    let share = |n: u64| 100.0 * n as f64 / c.total().max(1) as f64;
    format!(
        "{} matching ({:.4} %), {} off by one {unit} ({:.4} %), {} off by many ({:.4} %)",
        c.exact,
        share(c.exact),
        c.within_one,
        share(c.within_one),
        c.beyond,
        share(c.beyond)
    )
}

/// Figures of two hit files.
pub fn hits(report: &HitReport) -> String {
    let mut text = format!(
        "{} rays, {}-hit\nanswers    {}\nsame t     {} on another primitive\ndifferent  {} beyond rounding\n",
        report.rays,
        report.query,
        classes(report.classes, "ulp"),
        report.ties,
        report.differences
    );
    if let Some(first) = &report.first {
        let _infallible = writeln!(text, "first      {first}");
    }
    if let Some(judged) = &report.judged {
        for (name, counts) in [("A", &judged.a), ("B", &judged.b)] {
            let _infallible = writeln!(text, "oracle on {name}: {}", opinion(counts));
            for sample in counts.samples.iter().take(3) {
                let _infallible = writeln!(text, "  UNEXPLAINED {sample}");
            }
        }
    }
    text
}

fn opinion(counts: &Counts) -> String {
    let reasons = counts.explained.iter().map(|(why, n)| format!(", {n} explained by {why}")).collect::<String>();
    format!("{} agree{reasons}, {} unexplained", counts.agree, counts.unexplained)
}
