//! The files of `compare -o`: where two pictures differ.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use super::{CompareArgs, Map};
use crate::error::{Error, Result};
use crate::film::exr::{Compression, ImageInfo};
use crate::film::picture::Picture;
use crate::film::{Film, exr, heat};
use crate::measure::env::REVISION;
use crate::measure::pictures::{self, Maps};

/// Kinds of such files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Signed differences and maps as planes.
    Exr,
    /// A heat map.
    Png,
}

/// What one of them holds.
enum Content<'a> {
    Planes(Film),
    /// Values, and that of the brightest colour.
    Heat(Cow<'a, [f32]>, f32),
}

/// The kind that the name of `path` says.
///
/// # Errors
/// [`Error::Usage`] for other names.
pub(super) fn kind(path: &Path) -> Result<Kind> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("exr") => Ok(Kind::Exr),
        Some("png") => Ok(Kind::Png),
        _ => Err(Error::Usage(format!("-o {}: expected a name that ends in .exr or .png", path.display()))),
    }
}

/// Writes all files that `args` asks for. Not every pair of pictures has every map: what is refused is so before the first
/// file is written.
///
/// # Errors
/// Maps that these pictures have not; files that cannot be written.
pub(super) fn write(args: &CompareArgs, (a, b): (&Picture, &Picture), maps: Option<&Maps>) -> Result<()> {
    let content = |path: &PathBuf| match kind(path)? {
        Kind::Exr => pictures::difference_film(a, b, maps).map(Content::Planes),
        Kind::Png => heat_map(args, maps).map(|(values, full)| Content::Heat(values, full)),
    };
    let contents = args.files.iter().map(content).collect::<Result<Vec<_>>>()?;
    args.files.iter().zip(&contents).try_for_each(|(path, content)| match content {
        Content::Planes(film) => {
            let info = ImageInfo {
                software: format!("lanecast {}", env!("CARGO_PKG_VERSION")),
                revision: REVISION.into(),
                ..Default::default()
            };
            exr::write(path, film, &info, Compression::Zip)
        }
        Content::Heat(values, full) => heat::write_png(path, a.film.window, values, *full),
    })
}

/// The values of the heat map, and that of its brightest colour.
fn heat_map<'a>(args: &CompareArgs, maps: Option<&'a Maps>) -> Result<(Cow<'a, [f32]>, f32)> {
    let maps = maps.ok_or_else(|| Error::Usage("-o: the pictures have no colours to make a heat map of".into()))?;
    let (values, whole): (Cow<'a, [f32]>, _) = match args.map.unwrap_or(Map::Flip) {
        Map::Flip => (Cow::from(&maps.flip.values), Some(1.0)),
        Map::HdrFlip => {
            let missing = || Error::Usage("--map hdr-flip: both pictures must hold linear light".into());
            (Cow::from(&maps.hdr_flip.as_ref().ok_or_else(missing)?.values), Some(1.0))
        }
        Map::Error => (Cow::from(&maps.error), None),
        Map::Levels => (maps.levels.iter().map(|&level| f32::from(level)).collect(), None),
    };
    let full = args.full.or(whole).unwrap_or_else(|| heat::quantile(&values, 0.999));
    Ok((values, full))
}
