//! Two pictures side by side: one report of all metrics, and maps of where they differ.

use crate::error::{Error, Result};
use crate::film::metrics::{
    Classes, FlipMap, PlaneDifference, Rgb, Sums, Viewing, hdr_flip, ldr_flip, level_classes, plane_difference, psnr,
    ssim,
};
use crate::film::picture::{Encoding, Picture};
use crate::film::planes::COLOR;
use crate::film::png::Pixels8;
use crate::film::{Film, PlaneData, srgb};

/// How to look at the pictures.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Stops by which linear light is brightened before it becomes display levels.
    pub exposure: f32,
    /// The value that PSNR and SSIM take for white; `None`: 1 for display levels, else the largest of the reference, or 1
    /// if nothing of that is above 0.
    pub peak: Option<f64>,
    /// How FLIP looks at them.
    pub viewing: Viewing,
}

/// What the figures of colours are computed from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Domain {
    /// Display values from 0 to 1 in 8-bit levels, because at least one of the files holds levels.
    Display,
    /// Linear light.
    Linear,
}

/// How two pictures compare; the first is the reference.
#[derive(Clone, Debug, serde::Serialize)]
pub struct PictureReport {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Figures of the colours, if both have some.
    #[serde(flatten)]
    pub colors: Option<Colors>,
    /// Samples that are the same, one step apart, or farther: of the colours in 8-bit levels if a file has levels, else in
    /// units in the last place over all planes that both have.
    pub classes: Classes,
    /// The unit of `classes`: `level` or `ulp`.
    pub unit: &'static str,
    /// Largest distance in units in the last place over all planes that both have; `None` for levels.
    pub max_ulp: Option<u64>,
    /// The 8-bit levels of red, green and blue that a display would get (for files of levels: their own).
    pub levels: Option<Classes>,
    /// Every plane that both files have.
    pub planes: Vec<PlaneDifference>,
    /// Planes that only one file has, or that are floats in one and numbers in the other.
    pub unmatched: Vec<String>,
}

/// Figures of red, green and blue together.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Colors {
    /// What they are computed from.
    pub domain: Domain,
    /// Root mean squared error.
    pub rmse: f64,
    /// See [`crate::film::metrics::Errors::rel_mse`].
    pub rel_mse: f64,
    /// Largest error.
    pub max_error: f64,
    /// Samples with a NaN or infinity in one file only; the other figures leave them out.
    pub not_finite: u64,
    /// Decibels; infinite (in JSON: null) for equal pictures.
    pub psnr: f64,
    /// The value that counts as white.
    pub peak: f64,
    /// Structural similarity; `None` for pictures smaller than its window.
    pub ssim: Option<f64>,
    /// Mean of LDR-FLIP.
    pub flip: f64,
    /// Largest LDR-FLIP.
    pub max_flip: f64,
    /// Mean of HDR-FLIP, if both files hold linear light.
    pub hdr_flip: Option<f64>,
}

/// Where the pictures differ, row-major.
#[derive(Clone, Debug)]
pub struct Maps {
    /// Largest absolute error of the three colours, in the report's domain; NaN where one is NaN in one picture only.
    pub error: Vec<f32>,
    /// LDR-FLIP.
    pub flip: FlipMap,
    /// HDR-FLIP, if both files hold linear light.
    pub hdr_flip: Option<FlipMap>,
    /// Largest distance of the three 8-bit levels.
    pub levels: Vec<u8>,
}

/// Compares `b` with the reference `a`; maps only if both have colours.
///
/// # Errors
/// [`Error::Mismatch`] for pictures of different sizes, and for different parts of what is one picture by its size.
pub fn compare(a: &Picture, b: &Picture, options: &Options) -> Result<(PictureReport, Option<Maps>)> {
    check_aligned(a, b)?;
    let (width, height) = (a.film.window.width(), a.film.window.height());
    let (planes, unmatched) = planes(&a.film, &b.film);
    let colors = a.rgb().zip(b.rgb());
    let any = |encoding| [a, b].iter().any(|p| p.encoding == encoding);
    let plain = any(Encoding::PlainLevels);
    let domain = if plain || any(Encoding::Levels) { Domain::Display } else { Domain::Linear };
    let (mut report, mut maps, mut levels) = (None, None, None);
    if let Some((rgb_a, rgb_b)) = colors {
        let [bytes_a, bytes_b] = [a.levels(options.exposure, plain)?, b.levels(options.exposure, plain)?];
        // Levels of colours, whatever the files say of coverage: a picture without A is an opaque one.
        levels = Some(level_classes(&colors_of(&bytes_a), &colors_of(&bytes_b)));
        let far = |i: usize| {
            let level = |p: &Pixels8, c: usize| p.bytes[i * p.channels + c];
            (0..3).map(|c| level(&bytes_a, c).abs_diff(level(&bytes_b, c))).max().unwrap_or(0)
        };
        let level_map = (0..rgb_a.planes[0].len()).map(far).collect();
        let (figures, ColorMaps { error, flip, hdr_flip }) =
            colored((&rgb_a, &rgb_b), [&bytes_a, &bytes_b], domain, options)?;
        report = Some(figures);
        maps = Some(Maps { error, flip, hdr_flip, levels: level_map });
    }
    let mut classes = Classes::default();
    let by_level = levels.filter(|_| domain == Domain::Display);
    for plane in &planes {
        classes.exact += plane.classes.exact;
        classes.within_one += plane.classes.within_one;
        classes.beyond += plane.classes.beyond;
    }
    let report = PictureReport {
        width,
        height,
        colors: report,
        classes: by_level.unwrap_or(classes),
        unit: if by_level.is_some() { "level" } else { "ulp" },
        max_ulp: by_level.map_or_else(|| planes.iter().map(|p| p.max_ulp).max(), |_| None),
        levels,
        planes,
        unmatched,
    };
    Ok((report, maps))
}

/// Red, green and blue of every pixel.
fn colors_of(pixels: &Pixels8) -> Vec<u8> {
    pixels.bytes.chunks_exact(pixels.channels).flat_map(|pixel| &pixel[..3]).copied().collect()
}

/// Checks that the same sample of both pictures is the same pixel, as far as the files say.
fn check_aligned(a: &Picture, b: &Picture) -> Result<()> {
    let size = |p: &Picture| (p.film.window.width(), p.film.window.height());
    if size(a) != size(b) {
        let ((aw, ah), (bw, bh)) = (size(a), size(b));
        return Err(Error::Mismatch(format!("pictures of different sizes: {aw}x{ah} and {bw}x{bh}")));
    }
    let whole = |p: &Picture| (p.film.width, p.film.height);
    if whole(a) == whole(b) && a.film.window != b.film.window {
        let corner = |p: &Picture| format!("({}, {})", p.film.window.x0, p.film.window.y0);
        let ((width, height), [at, other]) = (whole(a), [corner(a), corner(b)]);
        let what = format!("different parts of a picture of {width}x{height}: they begin at {at} and {other}");
        return Err(Error::Mismatch(what));
    }
    Ok(())
}

/// All planes of both films: those that compare, and the names of those that do not.
fn planes(a: &Film, b: &Film) -> (Vec<PlaneDifference>, Vec<String>) {
    let (mut planes, mut unmatched) = (Vec::new(), Vec::new());
    for plane in &a.planes {
        let other = b.plane(&plane.name);
        match other.and_then(|other| plane_difference(&plane.name, &plane.data, &other.data)) {
            Some(difference) => planes.push(difference),
            None => unmatched.push(plane.name.clone()),
        }
    }
    unmatched.extend(b.planes.iter().filter(|p| a.plane(&p.name).is_none()).map(|p| p.name.clone()));
    (planes, unmatched)
}

/// Three planes of its own.
struct Planes([Vec<f32>; 3]);

impl Planes {
    fn of(picture: &Rgb<'_>, value: impl Fn(f32) -> f32) -> Self {
        Self(picture.planes.map(|plane| plane.iter().map(|&x| value(x)).collect()))
    }

    /// Levels as values from 0 to 1 through `value`.
    fn of_levels(pixels: &Pixels8, value: impl Fn(f64) -> f64) -> Self {
        let table: [f32; 256] = std::array::from_fn(|level| value(level as f64 / 255.0) as f32);
        let plane = |c: usize| pixels.bytes.chunks_exact(pixels.channels).map(|p| table[usize::from(p[c])]).collect();
        Self([plane(0), plane(1), plane(2)])
    }

    fn rgb(&self, like: &Rgb<'_>) -> Rgb<'_> {
        let [r, g, b] = &self.0;
        Rgb { width: like.width, height: like.height, planes: [r, g, b] }
    }
}

fn colored(
    (a, b): (&Rgb<'_>, &Rgb<'_>),
    levels: [&Pixels8; 2],
    domain: Domain,
    options: &Options,
) -> Result<(Colors, ColorMaps)> {
    // A file of levels has nothing between them: then the other one gets levels, too.
    let shown: [Planes; 2] = match domain {
        Domain::Display => levels.map(|pixels| Planes::of_levels(pixels, srgb::decode)),
        Domain::Linear => [a, b].map(|p| Planes::of(p, |x| x * options.exposure.exp2())),
    };
    let flip = ldr_flip(&shown[0].rgb(a), &shown[1].rgb(b), options.viewing)?;
    let hdr = (domain == Domain::Linear).then(|| hdr_flip(a, b, options.viewing)).transpose()?;

    let signals = levels.map(|pixels| Planes::of_levels(pixels, |signal| signal));
    let (va, vb) = match domain {
        Domain::Display => (signals[0].rgb(a), signals[1].rgb(b)),
        Domain::Linear => (*a, *b),
    };
    let mut sums = Sums::default();
    let mut error = vec![0.0f32; va.planes[0].len()];
    for (x, y) in va.planes.into_iter().zip(vb.planes) {
        for (i, (&x, &y)) in x.iter().zip(y).enumerate() {
            sums.add(x.into(), y.into());
            error[i] = largest(error[i], distance(x, y));
        }
    }
    let greatest = || va.planes.into_iter().flatten().filter(|x| x.is_finite()).fold(0.0f32, |most, x| most.max(*x));
    // A black reference has no white of its own.
    let brightest = || Some(greatest()).filter(|&x| x > 0.0).unwrap_or(1.0);
    let peak = options.peak.unwrap_or_else(|| if domain == Domain::Display { 1.0 } else { brightest().into() });
    let errors = sums.errors();
    let colors = Colors {
        domain,
        rmse: errors.rmse,
        rel_mse: errors.rel_mse,
        max_error: errors.max,
        not_finite: errors.not_finite,
        psnr: psnr(sums.mean_squared(), peak),
        peak,
        ssim: ssim(&va, &vb, peak)?,
        flip: flip.mean(),
        max_flip: flip.max(),
        hdr_flip: hdr.as_ref().map(FlipMap::mean),
    };
    Ok((colors, ColorMaps { error, flip, hdr_flip: hdr }))
}

/// Absolute difference, 0 for two NaN and for the same infinity as the figures take them.
fn distance(x: f32, y: f32) -> f32 {
    if x == y || x.is_nan() && y.is_nan() { 0.0 } else { (y - x).abs() }
}

/// The larger one, but NaN if one is, which [`f32::max`] would hide.
fn largest(x: f32, y: f32) -> f32 {
    if x > y || x.is_nan() { x } else { y }
}

/// What [`colored`] finds per pixel.
struct ColorMaps {
    error: Vec<f32>,
    flip: FlipMap,
    hdr_flip: Option<FlipMap>,
}

/// Where the pictures differ, as planes for other programs: `R G B`, the signed differences b - a in linear light; `error`,
/// `flip`, `hdr_flip`; and `diff.NAME`, the absolute difference of every other plane of floats that both have.
///
/// # Errors
/// Films that are broken.
pub fn difference_film(a: &Picture, b: &Picture, maps: Option<&Maps>) -> Result<Film> {
    let mut film = Film::new(a.film.width, a.film.height, a.film.window)?;
    let subtract = |x: &[f32], y: &[f32]| x.iter().zip(y).map(|(x, y)| y - x).collect::<Vec<f32>>();
    if let (Some(x), Some(y), Some(maps)) = (a.rgb(), b.rgb(), maps) {
        for (c, name) in COLOR.into_iter().enumerate() {
            film.push(name, PlaneData::F32(subtract(x.planes[c], y.planes[c])))?;
        }
        film.push("error", PlaneData::F32(maps.error.clone()))?;
        film.push("flip", PlaneData::F32(maps.flip.values.clone()))?;
        if let Some(hdr) = &maps.hdr_flip {
            film.push("hdr_flip", PlaneData::F32(hdr.values.clone()))?;
        }
    }
    for plane in a.film.planes.iter().filter(|p| !COLOR.contains(&p.name.as_str())) {
        let pair = (a.film.f32_plane(&plane.name), b.film.f32_plane(&plane.name));
        if let (Some(x), Some(y)) = pair {
            let absolute = subtract(x, y).into_iter().map(f32::abs).collect();
            film.push(format!("diff.{}", plane.name), PlaneData::F32(absolute))?;
        }
    }
    Ok(film)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Window;

    fn picture(encoding: Encoding, value: f32, z: f32) -> Picture {
        let mut film = Film::full(12, 12).unwrap();
        for name in COLOR {
            film.push(name, PlaneData::F32(vec![value; 144])).unwrap();
        }
        film.push("Z", PlaneData::F32(vec![z; 144])).unwrap();
        Picture { film, encoding }
    }

    /// Linear 0.5 against 0.25: RMSE 0.25 at a peak of 0.5 is 6.02 dB; relative 0.0625 / 0.26.
    #[test]
    fn figures_of_linear_light_by_hand() {
        let (a, b) = (picture(Encoding::Linear, 0.5, 1.0), picture(Encoding::Linear, 0.25, 3.0));
        let (report, maps) = compare(&a, &b, &Options::default()).unwrap();
        let colors = report.colors.unwrap();
        assert!((colors.rmse - 0.25).abs() < 1e-12 && (colors.psnr - 6.0206).abs() < 1e-4, "{colors:?}");
        assert!((colors.rel_mse - 0.0625 / 0.26).abs() < 1e-12 && colors.peak == 0.5 && colors.hdr_flip.is_some());
        assert_eq!((report.unit, report.classes.beyond, report.planes.len()), ("ulp", 4 * 144, 4));
        // 0.5 and 0.25 are levels 188 and 137.
        assert_eq!(report.levels, Some(Classes { exact: 0, within_one: 0, beyond: 432 }));
        let maps = maps.unwrap();
        assert_eq!((maps.levels[7], maps.error[7]), (51, 0.25));
        let film = difference_film(&a, &b, Some(&maps)).unwrap();
        assert_eq!((film.f32_plane("R").unwrap()[0], film.f32_plane("diff.Z").unwrap()[0]), (-0.25, 2.0));
        assert!(film.f32_plane("hdr_flip").is_some());
    }

    /// NaN in one picture only is no small error, whichever colour it is in; in both it is none.
    #[test]
    fn the_map_of_errors_shows_what_is_no_number() {
        let [a, mut b] = [0.5, 0.25].map(|value| picture(Encoding::Linear, value, 1.0));
        for (c, i) in [(0, 7), (2, 9)] {
            let PlaneData::F32(plane) = &mut b.film.planes[c].data else { panic!("floats") };
            plane[i] = f32::NAN;
        }
        let error = |a: &Picture, b: &Picture| compare(a, b, &Options::default()).unwrap().1.unwrap().error;
        let map = error(&a, &b);
        assert!(map[7].is_nan() && map[8] == 0.25 && map[9].is_nan(), "{:?}", &map[..10]);
        assert_eq!(error(&b, &b), [0.0; 144]);
    }

    /// White is 1 where the reference is black: equal pictures are equal, and 0.5 is off by 10 log10(1 / 0.25) = 6.02 dB; SSIM of
    /// flat 0 and 0.5 is C1 / (0.25 + C1) with C1 = 1e-4.
    #[test]
    fn a_black_reference_compares() {
        let [black, gray] = [0.0, 0.5].map(|value| picture(Encoding::Linear, value, 1.0));
        let colors = |b: &Picture| compare(&black, b, &Options::default()).unwrap().0.colors.unwrap();
        let (same, other) = (colors(&black), colors(&gray));
        assert_eq!((same.psnr, same.ssim, same.peak), (f64::INFINITY, Some(1.0), 1.0));
        assert!((other.psnr - 6.0206).abs() < 1e-4, "{other:?}");
        assert!((other.ssim.unwrap() - 1e-4 / 0.2501).abs() < 1e-9, "{other:?}");
    }

    #[test]
    fn a_file_of_levels_brings_both_to_the_display() {
        let (a, b) = (picture(Encoding::Levels, 0.5, 1.0), picture(Encoding::Linear, 0.5, 1.0));
        let (report, _) = compare(&a, &b, &Options::default()).unwrap();
        let colors = report.colors.unwrap();
        assert_eq!((colors.domain, colors.peak, colors.rmse), (Domain::Display, 1.0, 0.0));
        assert_eq!((colors.psnr, report.unit), (f64::INFINITY, "level"));
        assert_eq!((report.classes.exact, report.max_ulp, colors.hdr_flip), (432, None, None));
        assert!((colors.ssim.unwrap() - 1.0).abs() < 1e-12);
        // One stop more on the linear side only shows after the display's curve on both.
        let (bright, _) = compare(&a, &a, &Options { exposure: 1.0, ..Default::default() }).unwrap();
        assert_eq!(bright.colors.unwrap().rmse, 0.0);
    }

    #[test]
    fn sizes_must_agree_and_lonely_planes_are_named() {
        let mut a = picture(Encoding::Linear, 0.5, 1.0);
        let b = picture(Encoding::Linear, 0.5, 1.0);
        a.film.push("id.instance", PlaneData::U32(vec![3; 144])).unwrap();
        assert_eq!(compare(&a, &b, &Options::default()).unwrap().0.unmatched, ["id.instance"]);
        let small = Picture { film: Film::full(3, 3).unwrap(), encoding: Encoding::Linear };
        assert_eq!(compare(&a, &small, &Options::default()).unwrap_err().exit_code(), 1);
    }

    /// Windows of 12x12 pixels of 40x30; a file that knows no windows is compared with either as it is.
    #[test]
    fn parts_of_one_picture_must_be_the_same_part() {
        let crop = |x0, y0| {
            let mut part = picture(Encoding::Linear, 0.5, 1.0);
            (part.film.width, part.film.height) = (40, 30);
            part.film.window = Window { x0, y0, x1: x0 + 12, y1: y0 + 12 };
            part
        };
        let [part, same, beside] = [crop(3, 4), crop(3, 4), crop(4, 4)];
        let compared = |a: &Picture, b: &Picture| compare(a, b, &Options::default());
        let refused = compared(&part, &beside).unwrap_err();
        assert!(refused.exit_code() == 1 && refused.to_string().contains("(3, 4) and (4, 4)"), "{refused}");
        for other in [&same, &picture(Encoding::Levels, 0.5, 1.0), &picture(Encoding::Linear, 0.5, 1.0)] {
            assert_eq!(compared(&part, other).unwrap().0.colors.unwrap().rmse, 0.0);
        }
    }
}
