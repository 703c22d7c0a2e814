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
    /// Levels of a display (the film holds them decoded to linear light).
    Levels,
    /// Linear light, or numbers without a meaning as light.
    Linear,
}

/// A reader of one kind of file.
type Reader = fn(&Path) -> Result<Film>;

/// Kinds of files by the end of their name. A further kind is a line here.
const KINDS: [(&str, Encoding, Reader); 5] = [
    ("exr", Encoding::Linear, exr::read),
    ("png", Encoding::Levels, png::read),
    ("pfm", Encoding::Linear, pfm::read),
    ("npy", Encoding::Linear, npy::read_film),
    ("pix", Encoding::Levels, pix::read_levels),
];

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

fn kind(path: &Path) -> Option<&'static (&'static str, Encoding, Reader)> {
    let end = path.extension()?.to_str()?.to_ascii_lowercase();
    KINDS.iter().find(|(name, ..)| *name == end)
}

/// Reads a picture.
///
/// # Errors
/// Those of its reader; [`Error::Usage`] for a name that no reader knows.
pub fn read(path: &Path) -> Result<Picture> {
    let Some((_, encoding, read)) = kind(path) else {
        let names: Vec<String> = KINDS.iter().map(|(name, ..)| format!(".{name}")).collect();
        let what = format!("{}: expected a picture: a file named {}", path.display(), names.join(", "));
        return Err(Error::Usage(what));
    };
    Ok(Picture { film: read(path)?, encoding: *encoding })
}

impl Picture {
    /// Its colours in linear light: planes `R G B`, or one plane `Y` three times. `None` if it has neither as floats.
    pub fn rgb(&self) -> Option<Rgb<'_>> {
        let film = &self.film;
        let planes = match film.color() {
            Ok(planes) => planes,
            Err(_) => [film.f32_plane("Y")?; 3],
        };
        Some(Rgb { width: film.window.width() as usize, height: film.window.height() as usize, planes })
    }

    /// The film as 8-bit display levels shows it: one `R G B` (or `R G B A`) list of bytes; see [`png::to_srgb8`].
    ///
    /// # Errors
    /// A picture without colours.
    pub fn levels(&self, exposure: f32) -> Result<png::Pixels8> {
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
        png::to_srgb8(&film, exposure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_decides_and_unknown_names_are_refused() {
        assert!(is_named(Path::new("a/b.EXR")) && is_named(Path::new("b.pfm")) && !is_named(Path::new("b.tif")));
        let fault = read(Path::new("b.tif")).unwrap_err().to_string();
        assert!(fault.contains("b.tif") && fault.contains(".exr, .png, .pfm, .npy"), "{fault}");
    }

    #[test]
    fn one_plane_is_gray() {
        let mut film = Film::full(2, 1).unwrap();
        film.push("Y", PlaneData::F32(vec![0.0, 1.0])).unwrap();
        let picture = Picture { film, encoding: Encoding::Linear };
        assert_eq!(picture.rgb().unwrap().planes[2], [0.0, 1.0]);
        assert_eq!(picture.levels(0.0).unwrap().bytes, [0, 0, 0, 255, 255, 255]);
        let ids = Picture { film: Film::full(1, 1).unwrap(), encoding: Encoding::Linear };
        assert!(ids.rgb().is_none() && ids.levels(0.0).is_err());
    }
}
