//! Pictures: those that can be paired are compared, with a slider and a map of where they differ.
//!
//! Two pictures are a pair if they have the same name in different folders (the oldest and the newest by path), or if one is
//! called `NAME.reference.EXT` beside `NAME.EXT`.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use image::{DynamicImage, ImageFormat, RgbImage, imageops::FilterType};
use maud::{Markup, html};

use super::collect::Found;
use super::figures::{Section, table};
use crate::error::{Error, Result};
use crate::film::heat;
use crate::film::picture::{self, Picture};
use crate::measure::pictures::{Maps, Options, PictureReport, compare};

/// Most pairs, and most single pictures, on a page.
const MOST: usize = 12;
/// Largest width of a picture on the page; larger ones are scaled down (figures are of the full size).
const WIDTH: u32 = 960;

/// Pairs first, then pictures that stand alone.
///
/// # Errors
/// Pictures that cannot be written to memory.
pub fn section(found: &Found) -> Result<Option<Section>> {
    let (pairs, singles) = paired(&found.pictures);
    let (pair_count, single_count) = (pairs.len(), singles.len());
    let shown: Vec<Markup> = pairs.iter().take(MOST).map(|(a, b)| pair(a, b)).collect::<Result<_>>()?;
    let alone: Vec<Markup> = singles.iter().take(MOST).map(|path| single(path)).collect::<Result<_>>()?;
    if shown.is_empty() && alone.is_empty() {
        return Ok(None);
    }
    let left_out = pair_count.saturating_sub(MOST) + single_count.saturating_sub(MOST);
    let body = html! {
        p { "Move the slider to change from one picture to the other; the map shows FLIP, the difference a person sees." }
        @for markup in shown.iter().chain(&alone) { (markup) }
        @if left_out > 0 { p { (left_out) " more are left out." } }
    };
    Ok(Some(Section {
        id: "pictures",
        title: "Pictures",
        figures: shown.len() + alone.len(),
        pairs: shown.len(),
        body,
    }))
}

type Paired = (Vec<(PathBuf, PathBuf)>, Vec<PathBuf>);

fn paired(pictures: &[PathBuf]) -> Paired {
    let mut by_name: BTreeMap<String, Vec<&PathBuf>> = BTreeMap::new();
    for path in pictures {
        let name = path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
        let folder = path.parent().map_or(String::new(), |p| p.display().to_string());
        let stem = Path::new(&name).file_stem().map_or(String::new(), |s| s.to_string_lossy().into_owned());
        let reference = stem.strip_suffix(".reference");
        let beside = |end: &str| path.with_file_name(end);
        // A reference, or a picture that has one, pairs inside its folder.
        let end = path.extension().map_or(String::new(), |e| e.to_string_lossy().into_owned());
        let has_one = pictures.contains(&beside(&format!("{stem}.reference.{end}")));
        let key = match reference {
            Some(stem) => format!("{folder}/{stem}"),
            None if has_one => format!("{folder}/{stem}"),
            None => name,
        };
        by_name.entry(key).or_default().push(path);
    }
    let (mut pairs, mut singles) = (Vec::new(), Vec::new());
    for paths in by_name.into_values() {
        match paths[..] {
            [] => {}
            [one] => singles.push(one.clone()),
            [first, .., last] => {
                let is_reference =
                    |p: &Path| p.file_stem().is_some_and(|s| s.to_string_lossy().ends_with(".reference"));
                let (a, b) = if is_reference(last) { (last, first) } else { (first, last) };
                pairs.push((a.clone(), b.clone()));
            }
        }
    }
    (pairs, singles)
}

fn shown_path(path: &Path) -> String {
    let parts: Vec<String> = path.components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
    parts[parts.len().saturating_sub(3)..].join("/")
}

fn single(path: &Path) -> Result<Markup> {
    let name = shown_path(path);
    let read = picture::read(path, None).and_then(|picture| data_uri(&picture));
    Ok(match read {
        Ok(uri) => html! { figure.single { figcaption { (name) } img alt=(name) src=(uri); } },
        Err(e) => html! { figure { figcaption { (name) } p { "cannot be shown: " (e) } } },
    })
}

fn pair(a: &Path, b: &Path) -> Result<Markup> {
    let title = format!("{} and {}", shown_path(a), shown_path(b));
    let both = picture::read(a, None).and_then(|a| Ok((a, picture::read(b, None)?)));
    let compared = both.and_then(|(a, b)| {
        let (report, maps) = compare(&a, &b, &Options::default())?;
        let maps = maps.ok_or_else(|| Error::Usage("the pictures have no colours".into()))?;
        Ok((data_uri(&a)?, data_uri(&b)?, map_uri(&a, &maps)?, report))
    });
    let (left, right, map, report) = match compared {
        Ok(all) => all,
        Err(e) => return Ok(html! { figure { figcaption { (title) } p { "cannot be compared: " (e) } } }),
    };
    let command = format!("lanecast compare {} {}", a.display(), b.display());
    Ok(html! {
        figure.pair {
            figcaption { (title) }
            div.slider {
                img.under alt=(format!("{title}: the second")) src=(right);
                img.over alt=(format!("{title}: the first")) src=(left);
                input type="range" min="0" max="100" value="50" aria-label=(format!("how much of the first of {title} is shown"));
            }
            details open { summary { "where they differ" } img.map alt=(format!("{title}: difference")) src=(map); }
            details open { summary { "figures" } div.scroll { (figures(&report)) } }
            details.commands { summary { "command" } pre { (command) } }
        }
    })
}

fn figures(report: &PictureReport) -> Markup {
    let classes = report.classes;
    let mut rows = Vec::new();
    if let Some(c) = &report.colors {
        rows.extend([
            ("RMSE", format!("{:.3e}", c.rmse)),
            ("relative MSE", format!("{:.3e}", c.rel_mse)),
            ("PSNR", format!("{:.2} dB", c.psnr)),
            ("SSIM", c.ssim.map_or("-".into(), |x| format!("{x:.5}"))),
            ("FLIP", format!("{:.5}", c.flip)),
            ("HDR-FLIP", c.hdr_flip.map_or("-".into(), |x| format!("{x:.5}"))),
        ]);
    }
    rows.push(("same", classes.exact.to_string()));
    rows.push(("off by one", format!("{} ({})", classes.within_one, report.unit)));
    rows.push(("off by more", classes.beyond.to_string()));
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(name, value)| vec![name.into(), value]).collect();
    table(&["figure", "value"], &rows)
}

fn data_uri(picture: &Picture) -> Result<String> {
    let pixels = picture.levels(0.0, false)?;
    let (width, height) = (picture.film.window.width(), picture.film.window.height());
    let rgb = pixels.bytes.chunks_exact(pixels.channels).flat_map(|p| [p[0], p[1], p[2]]).collect();
    encoded(width, height, rgb)
}

fn map_uri(picture: &Picture, maps: &Maps) -> Result<String> {
    let (width, height) = (picture.film.window.width(), picture.film.window.height());
    encoded(width, height, maps.flip.values.iter().flat_map(|&x| heat::color(x.into())).collect())
}

/// A PNG as an address that holds it.
fn encoded(width: u32, height: u32, rgb: Vec<u8>) -> Result<String> {
    let failed = |what: String| Error::Usage(format!("a picture of {width}x{height} cannot be embedded: {what}"));
    let image = RgbImage::from_raw(width, height, rgb).ok_or_else(|| failed("too few pixels".into()))?;
    let mut image = DynamicImage::from(image);
    if width > WIDTH {
        image = image.resize(WIDTH, u32::MAX, FilterType::Triangle);
    }
    let mut png = Vec::new();
    image.write_to(&mut Cursor::new(&mut png), ImageFormat::Png).map_err(|e| failed(e.to_string()))?;
    Ok(format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(png)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_found_by_name() {
        let paths = ["r/1/a.exr", "r/2/a.exr", "r/3/a.exr", "r/3/b.png", "r/3/b.reference.png", "r/3/c.png"];
        let (pairs, singles) = paired(&paths.map(PathBuf::from));
        let text = |p: &(PathBuf, PathBuf)| format!("{} {}", p.0.display(), p.1.display());
        let pairs: Vec<String> = pairs.iter().map(text).collect();
        assert_eq!(pairs, ["r/1/a.exr r/3/a.exr", "r/3/b.reference.png r/3/b.png"]);
        assert_eq!(singles, [PathBuf::from("r/3/c.png")]);
    }
}
