//! A picture of any kind that can be read: to be compared, or shown beside another.

use std::borrow::Cow;
use std::path::Path;

use super::metrics::Rgb;
use super::planes::{COLOR, Film, PlaneData};
use super::{exr, npy, pfm, pix, png};
use crate::error::{Error, Result};

/// What the samples of a file mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// 8-bit levels of a display (the film holds them decoded to linear light).
    Levels,
    /// Levels that are linear light times 255, as `.pix` files hold them.
    PlainLevels,
    /// Linear light, or numbers without a meaning as light.
    Linear,
}

/// Width and height of a picture whose file does not say them.
type Size = Option<(u32, u32)>;

/// A reader of one kind of file.
type Reader = fn(&Path, Size) -> Result<Picture>;

/// Kinds of files by the end of their name. A further kind is a line here.
const KINDS: [(&str, Reader); 5] = [
    ("exr", |path, _| exr::read(path).map(Picture::linear)),
    ("png", |path, _| levels_or_light(path)),
    ("pfm", |path, _| pfm::read(path).map(Picture::linear)),
    ("npy", |path, _| npy::read_film(path).map(Picture::linear)),
    ("pix", |path, size| Ok(Picture { film: pix::read(path, size)?, encoding: Encoding::PlainLevels })),
];

/// A PNG. One of 16 bits is finer than the levels of a display: rounded to them, different files would be called the same.
fn levels_or_light(path: &Path) -> Result<Picture> {
    let (film, bits) = png::read_with_depth(path)?;
    Ok(Picture { film, encoding: if bits > 8 { Encoding::Linear } else { Encoding::Levels } })
}

/// A film with what its samples mean.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The planes.
    pub film: Film,
    /// What their samples mean.
    pub encoding: Encoding,
}

/// Whether `path` is named like a picture.
pub fn is_named(path: &Path) -> bool {
    kind(path).is_some()
}

fn kind(path: &Path) -> Option<Reader> {
    let end = path.extension()?.to_str()?.to_ascii_lowercase();
    KINDS.iter().find(|(name, _)| *name == end).map(|(_, read)| *read)
}

/// Reads a picture; `size` is that of a file that does not say its own (`.pix`; without it such a file is a square).
///
/// # Errors
/// Those of its reader; [`Error::Usage`] for a name that no reader knows.
pub fn read(path: &Path, size: Size) -> Result<Picture> {
    let Some(read) = kind(path) else {
        let names: Vec<String> = KINDS.iter().map(|(name, _)| format!(".{name}")).collect();
        let what = format!("{}: expected a picture: a file named {}", path.display(), names.join(", "));
        return Err(Error::Usage(what));
    };
    read(path, size)
}

impl Picture {
    fn linear(film: Film) -> Self {
        Self { film, encoding: Encoding::Linear }
    }

    /// Its colours in linear light: planes `R G B`, or one plane `Y` three times. `None` if it has neither as floats.
    pub fn rgb(&self) -> Option<Rgb<'_>> {
        let film = &self.film;
        let planes = match film.color() {
            Ok(planes) => planes,
            Err(_) => [film.f32_plane("Y")?; 3],
        };
        Some(Rgb { width: film.window.width() as usize, height: film.window.height() as usize, planes })
    }

    /// The film as 8-bit levels: one `R G B` (or `R G B A`) list of bytes, top row first. Files of levels give their own; linear
    /// light becomes display levels (see [`png::to_srgb8`]), or with `plain` those of a `.pix` file (see [`pix::level`]).
    ///
    /// # Errors
    /// A picture without colours.
    pub fn levels(&self, exposure: f32, plain: bool) -> Result<png::Pixels8> {
        let film = match self.film.color() {
            Ok(_) => Cow::Borrowed(&self.film),
            Err(_) => {
                let mut gray = Film::new(self.film.width, self.film.height, self.film.window)?;
                let plane = self.film.f32_plane("Y");
                let plane = plane.ok_or_else(|| Error::Usage("the picture has no colours".into()))?;
                COLOR.iter().try_for_each(|name| gray.push(*name, PlaneData::F32(plane.to_vec())))?;
                Cow::Owned(gray)
            }
        };
        if self.encoding == Encoding::PlainLevels || plain && self.encoding == Encoding::Linear {
            let (color, gain) = (film.color()?, f64::from(exposure).exp2());
            let level = |i: usize| color.map(|plane| pix::level(f64::from(plane[i]) * gain));
            return Ok(png::Pixels8 { channels: 3, bytes: (0..film.pixels()).flat_map(level).collect() });
        }
        png::to_srgb8(&film, exposure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_decides_and_unknown_names_are_refused() {
        assert!(is_named(Path::new("a/b.EXR")) && is_named(Path::new("b.pfm")) && !is_named(Path::new("b.tif")));
        let fault = read(Path::new("b.tif"), None).unwrap_err().to_string();
        assert!(fault.contains("b.tif") && fault.contains(".exr, .png, .pfm, .npy, .pix"), "{fault}");
    }

    /// A `.pix` file keeps its bytes, and linear light beside it gets plain levels: 0.5 is 128, not 188.
    #[test]
    fn plain_levels_stay_plain() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.pix");
        std::fs::write(&path, [1, 2, 3, 4, 5, 6]).unwrap();
        let picture = read(&path, Some((1, 2))).unwrap();
        assert_eq!(picture.levels(0.0, true).unwrap().bytes, [4, 5, 6, 1, 2, 3], "top row first");
        assert!(read(&path, None).is_err());
        let mut film = Film::full(1, 1).unwrap();
        film.push("Y", PlaneData::F32(vec![0.5])).unwrap();
        let linear = Picture { film, encoding: Encoding::Linear };
        assert_eq!(linear.levels(0.0, true).unwrap().bytes, [128; 3]);
        assert_eq!(linear.levels(0.0, false).unwrap().bytes, [188; 3]);
    }

    #[test]
    fn one_plane_is_gray() {
        let mut film = Film::full(2, 1).unwrap();
        film.push("Y", PlaneData::F32(vec![0.0, 1.0])).unwrap();
        let picture = Picture { film, encoding: Encoding::Linear };
        assert_eq!(picture.rgb().unwrap().planes[2], [0.0, 1.0]);
        assert_eq!(picture.levels(0.0, false).unwrap().bytes, [0, 0, 0, 255, 255, 255]);
        let ids = Picture { film: Film::full(1, 1).unwrap(), encoding: Encoding::Linear };
        assert!(ids.rgb().is_none() && ids.levels(0.0, false).is_err());
    }
}
