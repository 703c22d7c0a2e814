//! `lanecast compare`: two pictures, or two files of hits.

mod difference;
mod table;
mod usage;

use std::path::{Path, PathBuf};

use super::common::{OutputArgs, SceneOptions, ThreadArgs, finite, size, with_pool};
use super::output::{json_to_stdout, to_stdout};
use crate::error::{Error, Result};
use crate::film::metrics::Viewing;
use crate::film::picture::{self, Picture};
use crate::film::{check_apart, check_distinct, check_file, npy};
use crate::measure::hitfiles::{self, FileAnswers, HitReport};
use crate::measure::pictures::{self, Options, PictureReport};

const EXAMPLES: &str = "\
Examples:
  lanecast compare reference.exr render.exr
  lanecast compare old.png new.png -o heat.png --max-rmse 0.001
  lanecast compare a.exr b.exr -o difference.exr -o flip.png --map hdr-flip --json
  lanecast compare scalar.npy tile.npy --scene model.ply --rays rays.npy

Pictures: .exr (any channels), .png, .pfm, .pix, .npy (height, width[, channels]); A is the reference. Figures of \
the colours are of display values (0 to 1) if a file holds 8-bit levels, else of linear light, which a PNG of 16 bits is \
taken for. Classes count samples \
that are the same, one step apart, or farther; steps are 8-bit levels, or representable floats (ulp).
Hits: files that `trace --hits` wrote. With --scene and --rays, the f64 oracle judges both answers of every ray \
whose bits differ; a mismatch is explained if the geometry is within a few roundings of the answer.
A sample that is not finite (NaN, infinite) in one file only is beyond every limit on a figure of the colours.
Limits on single samples (ulp, beyond, different) are of all planes of both files: a plane that only one has breaks them. \
Samples that are 8-bit levels are of the colours only, not of their coverage (A); a picture without A counts as opaque.
Exit code 1: a limit given here is passed, a mismatch of hits is not explained, or sizes differ, or two EXR \
files hold different parts (data windows) of one picture (display window); other files have no windows, and pixels are \
compared in order.";

/// Arguments of `lanecast compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct CompareArgs {
    /// The reference
    a: PathBuf,
    /// What is compared with it
    b: PathBuf,
    /// Write where pictures differ: FILE.exr (signed differences and maps as planes) or FILE.png (a heat map)
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    files: Vec<PathBuf>,
    /// What the heat map shows [default: flip]
    #[arg(long, value_enum)]
    map: Option<Map>,
    /// Value of the heat map's brightest colour [default: 1 for flip and hdr-flip, else the 99.9th percentile]
    #[arg(long, value_name = "X", value_parser = positive)]
    full: Option<f32>,
    /// Stops by which linear light is brightened for 8-bit levels and LDR-FLIP [default: 0]
    #[arg(long, value_name = "STOPS", allow_hyphen_values = true, value_parser = finite)]
    exposure: Option<f32>,
    /// White of PSNR and SSIM [default: 1 for levels, else the largest value of the reference, or 1 if that is black]
    #[arg(long, value_name = "X", value_parser = positive)]
    peak: Option<f32>,
    /// Size of .pix pictures that are not square
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
    /// Pixels per degree of the visual field, for FLIP [default: 67]
    #[arg(long, value_name = "N", value_parser = density)]
    ppd: Option<f64>,
    #[command(flatten)]
    limits: Limits,
    /// Scene that the hits are of
    #[arg(long, value_name = "SCENE", requires = "rays", help_heading = "Hits")]
    scene: Option<String>,
    /// Rays that the hits are of
    #[arg(long, value_name = "FILE.npy", requires = "scene", help_heading = "Hits")]
    rays: Option<PathBuf>,
    #[command(flatten)]
    options: SceneOptions,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

/// Limits for scripts.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
#[command(next_help_heading = "Limits (exit code 1 beyond them)")]
struct Limits {
    /// Largest root mean squared error
    #[arg(long, value_name = "X", value_parser = limit)]
    max_rmse: Option<f64>,
    /// Largest mean relative squared error
    #[arg(long, value_name = "X", value_parser = limit)]
    max_relmse: Option<f64>,
    /// Smallest PSNR, decibels
    #[arg(long, value_name = "DB", value_parser = limit)]
    min_psnr: Option<f64>,
    /// Smallest SSIM
    #[arg(long, value_name = "X", value_parser = limit)]
    min_ssim: Option<f64>,
    /// Largest mean LDR-FLIP
    #[arg(long, value_name = "X", value_parser = limit)]
    max_flip: Option<f64>,
    /// Largest mean HDR-FLIP
    #[arg(long, value_name = "X", value_parser = limit)]
    max_hdr_flip: Option<f64>,
    /// Largest distance in units in the last place
    #[arg(long, value_name = "N")]
    max_ulp: Option<u64>,
    /// Most samples (of hits: rays) that are neither the same nor one step apart
    #[arg(long, value_name = "N")]
    max_beyond: Option<u64>,
    /// Most samples (of hits: rays) that are not the same
    #[arg(long, value_name = "N")]
    max_different: Option<u64>,
}

/// Values of `--map`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Map {
    /// LDR-FLIP
    Flip,
    /// HDR-FLIP
    HdrFlip,
    /// Largest absolute error of the colours
    Error,
    /// Distance in 8-bit levels
    Levels,
}

/// The object of `--json`.
#[derive(serde::Serialize)]
struct Report<'a> {
    a: &'a Path,
    b: &'a Path,
    pass: bool,
    failures: Vec<String>,
    #[serde(flatten)]
    found: Found<'a>,
}

#[derive(serde::Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Found<'a> {
    Pictures(&'a PictureReport),
    /// Whose pixels are not the same ones: there are no figures.
    #[serde(rename = "pictures")]
    Apart {
        /// Width and height of both, and where that is in the whole pictures: x0, y0, x1, y1.
        sizes: [[u32; 2]; 2],
        windows: [[u32; 4]; 2],
    },
    Hits(&'a HitReport),
}

/// Runs `lanecast compare`.
///
/// # Errors
/// Bad input; [`Error::Mismatch`] beyond a limit.
pub fn run(args: &CompareArgs) -> Result<()> {
    with_pool(args.threads.count(), || match (answers(&args.a)?, answers(&args.b)?) {
        (Some(a), Some(b)) => hits(args, &a, &b),
        (None, None) => images(args),
        _ => Err(Error::Usage("one file holds hits, the other a picture".into())),
    })
}

/// The answers in `path` if it is a hit file.
fn answers(path: &Path) -> Result<Option<FileAnswers>> {
    let is_array = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"));
    if is_array { hitfiles::read(path) } else { Ok(None) }
}

fn images(args: &CompareArgs) -> Result<()> {
    args.check_for_pictures()?;
    args.files.iter().try_for_each(|file| check_file(file).and_then(|()| check_apart(file, &[&args.a, &args.b])))?;
    check_distinct(&args.files)?;
    let (a, b) = (picture::read(&args.a, args.size)?, picture::read(&args.b, args.size)?);
    let viewing = args.ppd.map_or_else(Viewing::default, |pixels_per_degree| Viewing { pixels_per_degree });
    let options = Options { exposure: args.exposure.unwrap_or(0.0), peak: args.peak.map(f64::from), viewing };
    let (report, maps) = match pictures::compare(&a, &b, &options) {
        Err(Error::Mismatch(what)) => return apart(args, [&a, &b], what),
        compared => compared?,
    };
    // A limit on what these pictures have not is refused: before anything is written.
    let failures = args.limits.of_pictures(&report)?;
    difference::write(args, (&a, &b), maps.as_ref())?;
    finish(args, Found::Pictures(&report), failures, || table::pictures(&report))
}

/// Says that the pixels of two pictures are not the same ones, which is a failure and no bad input.
fn apart(args: &CompareArgs, of: [&Picture; 2], what: String) -> Result<()> {
    if args.output.json {
        let windows = of.map(|p| [p.film.window.x0, p.film.window.y0, p.film.window.x1, p.film.window.y1]);
        let found = Found::Apart { sizes: of.map(|p| [p.film.window.width(), p.film.window.height()]), windows };
        json_to_stdout(&Report { a: &args.a, b: &args.b, pass: false, failures: vec![what.clone()], found })?;
    }
    Err(Error::Mismatch(what))
}

fn hits(args: &CompareArgs, a: &FileAnswers, b: &FileAnswers) -> Result<()> {
    args.check_for_hits()?;
    let mut report = hitfiles::compare(a, b)?;
    if let (Some(scene), Some(rays)) = (&args.scene, &args.rays) {
        let description = args.options.load(scene, &args.output)?;
        hitfiles::judge(&mut report, [a, b], &npy::read_rays(rays)?, &description)?;
    }
    let failures = args.limits.of_hits(&report)?;
    finish(args, Found::Hits(&report), failures, || table::hits(&report))
}

fn finish(args: &CompareArgs, found: Found<'_>, failures: Vec<String>, text: impl FnOnce() -> String) -> Result<()> {
    let failed = (!failures.is_empty()).then(|| Error::Mismatch(format!("compare: {}", failures.join("; "))));
    if args.output.json {
        json_to_stdout(&Report { a: &args.a, b: &args.b, pass: failed.is_none(), failures, found })?;
    } else {
        to_stdout(&text())?;
    }
    failed.map_or(Ok(()), Err)
}

impl Limits {
    /// What of `report` is beyond a limit.
    fn of_pictures(&self, report: &PictureReport) -> Result<Vec<String>> {
        let colors = report.colors.as_ref();
        let mut check = Check::default();
        check.most("RMSE", self.max_rmse, colors.map(|c| c.rmse));
        check.most("relative MSE", self.max_relmse, colors.map(|c| c.rel_mse));
        check.least("PSNR", self.min_psnr, colors.map(|c| c.psnr));
        check.least("SSIM", self.min_ssim, colors.and_then(|c| c.ssim));
        check.most("FLIP", self.max_flip, colors.map(|c| c.flip));
        check.most("HDR-FLIP", self.max_hdr_flip, colors.and_then(|c| c.hdr_flip));
        self.check_planes(report, &mut check)?;
        check.most("ulp", self.max_ulp.map(|n| n as f64), report.max_ulp.map(|n| n as f64));
        let classes = report.classes;
        check.most("samples beyond", self.max_beyond.map(|n| n as f64), Some(classes.beyond as f64));
        let different = classes.beyond + classes.within_one;
        check.most("different samples", self.max_different.map(|n| n as f64), Some(different as f64));
        // The errors leave such samples out, and FLIP takes them for black or white.
        if let Some(c) = colors.filter(|c| c.not_finite > 0 && self.any_of_figures()) {
            check.failures.push(format!("{} samples are finite in one file only", c.not_finite));
        }
        check.done()
    }

    /// What of `report` is beyond a limit, and mismatches that nothing explains.
    fn of_hits(&self, report: &HitReport) -> Result<Vec<String>> {
        if self.any_of_figures() || self.max_ulp.is_some() {
            return Err(Error::Usage("hits have the limits --max-beyond and --max-different only".into()));
        }
        let mut check = Check::default();
        let [a, b] = report.answers;
        if a != b {
            check.failures.push(format!("the files answer {a} and {b} rays"));
        }
        let classes = report.classes;
        check.most("rays beyond", self.max_beyond.map(|n| n as f64), Some(classes.beyond as f64));
        let different = classes.beyond + classes.within_one;
        check.most("different rays", self.max_different.map(|n| n as f64), Some(different as f64));
        if let Some(judged) = report.judged.as_ref().filter(|judged| judged.unexplained > 0) {
            check.failures.push(format!("{} answers are not explained", judged.unexplained));
        }
        check.done()
    }

    /// Limits on single samples are of all planes, so one that has nothing to be compared with breaks them. (Levels are of the
    /// colours alone, which then both files have.)
    ///
    /// # Errors
    /// A limit, and no sample to compare.
    fn check_planes(&self, report: &PictureReport, check: &mut Check) -> Result<()> {
        let limits = [self.max_ulp, self.max_beyond, self.max_different];
        if report.unit == "level" || limits.iter().all(Option::is_none) {
            return Ok(());
        }
        let lonely = report.unmatched.join(", ");
        if report.planes.is_empty() {
            let what = format!("no plane is in both files with the same type, so no sample can be compared: {lonely}");
            return Err(Error::Usage(what));
        }
        if !lonely.is_empty() {
            check.failures.push(format!("planes in one file only, or of another type: {lonely}"));
        }
        Ok(())
    }

    /// Whether a figure of the colours has a limit.
    fn any_of_figures(&self) -> bool {
        let figures = [self.max_rmse, self.max_relmse, self.min_psnr, self.min_ssim, self.max_flip, self.max_hdr_flip];
        figures.iter().any(Option::is_some)
    }
}

/// Limits that were passed, or could not be checked.
#[derive(Default)]
struct Check {
    failures: Vec<String>,
    missing: Vec<&'static str>,
}

impl Check {
    fn most(&mut self, what: &'static str, limit: Option<f64>, value: Option<f64>) {
        self.check(what, limit, value, |value, limit| value <= limit);
    }

    fn least(&mut self, what: &'static str, limit: Option<f64>, value: Option<f64>) {
        self.check(what, limit, value, |value, limit| value >= limit);
    }

    fn check(&mut self, what: &'static str, limit: Option<f64>, value: Option<f64>, fine: fn(f64, f64) -> bool) {
        match (limit, value) {
            (Some(limit), Some(value)) if !fine(value, limit) => {
                self.failures.push(format!("{what} {value} is beyond the limit {limit}"));
            }
            (Some(_), None) => self.missing.push(what),
            _ => {}
        }
    }

    /// # Errors
    /// A limit on something these files have not.
    fn done(self) -> Result<Vec<String>> {
        match self.missing.first() {
            Some(what) => Err(Error::Usage(format!("there is a limit on {what}, which these pictures have not"))),
            None => Ok(self.failures),
        }
    }
}

/// A limit: what is no number would be passed by every figure, and an infinite one by none.
fn limit(text: &str) -> std::result::Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| "expected a number".into())
}

fn positive(text: &str) -> std::result::Result<f32, String> {
    finite(text)?;
    text.parse().ok().filter(|x| *x > 0.0).ok_or_else(|| "expected a number above 0".into())
}

fn density(text: &str) -> std::result::Result<f64, String> {
    // The filters reach as far as the pixels are dense.
    let fine = text.parse().ok().filter(|x: &f64| (1.0..=1000.0).contains(x));
    fine.ok_or_else(|| "expected 1 to 1000 pixels per degree".into())
}
