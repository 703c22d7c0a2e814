//! BRL-CAD's `.pix` pictures: red, green and blue bytes, the bottom row first, no header.
//!
//! Source: BRL-CAD's manual page `pix(5)`. A byte is a linear value: no gamma. The size is not in the file.

use std::io::Write;
use std::path::Path;

use super::planes::{COLOR, Film, PlaneData};
use super::{input, write_atomically};
use crate::error::{Error, Result};

/// Bytes of a pixel.
const CHANNELS: usize = 3;

/// The byte of a linear value, as `rt` makes it: 255 times the value plus one half, cut off, kept within 0 to 255.
/// NaN becomes 0.
pub fn level(value: f64) -> u8 {
    (value * 255.0 + 0.5) as u8
}

/// The [`level`]s of `values` times `gain`, one for each, as many as there are of both.
pub fn levels(values: &[f32], gain: f64, to: &mut [u8]) {
    // Whole numbers behind this have their lowest bits in its lowest bits: there are instructions for that.
    let behind = f64::from_bits(0x4330_0000_0000_0000);
    for (to, &value) in to.iter_mut().zip(values) {
        let scaled = f64::from(value) * gain * 255.0 + 0.5;
        // Nothing is below, and what is not a number.
        let scaled = if scaled > 0.0 { scaled } else { 0.0 };
        let scaled = if scaled < 255.0 { scaled } else { 255.0 };
        *to = (scaled.trunc() + behind).to_bits() as u8;
    }
}

/// The colour planes as the bytes of a `.pix` file of the data window's size: linear colour times 2^`exposure`, see
/// [`level`], or levels as they are. Coverage is not kept.
///
/// # Errors
/// [`Error::Usage`] if a colour plane is missing or the film is broken.
pub fn to_bytes(film: &Film, exposure: f32) -> Result<Vec<u8>> {
    film.validate()?;
    if let [Some(red), Some(green), Some(blue)] = COLOR.map(|name| film.u8_plane(name)) {
        return Ok(interleaved(film, [red, green, blue], |levels, to| to.copy_from_slice(levels)));
    }
    let gain = f64::from(exposure).exp2();
    Ok(interleaved(film, film.color()?, |values, to| levels(values, gain, to)))
}

/// Bytes of the pixels of `color`, the bottom row first; `bytes` makes those of a part of a plane.
fn interleaved<T>(film: &Film, color: [&[T]; CHANNELS], bytes: impl Fn(&[T], &mut [u8])) -> Vec<u8> {
    let width = film.window.width() as usize;
    let mut all = Vec::with_capacity(film.pixels() * CHANNELS);
    let mut rows = [const { Vec::new() }; CHANNELS];
    rows.iter_mut().for_each(|row| row.resize(width, 0));
    for row in (0..film.window.height() as usize).rev() {
        rows.iter_mut().zip(color).for_each(|(to, plane)| bytes(&plane[row * width..][..width], to));
        let [red, green, blue] = &rows;
        all.extend(red.iter().zip(green).zip(blue).flat_map(|((&red, &green), &blue)| [red, green, blue]));
    }
    all
}

/// Writes the colour planes as a `.pix` file, see [`to_bytes`].
///
/// # Errors
/// [`Error::Usage`] as [`to_bytes`]; [`Error::Io`] if the file cannot be written.
pub fn write(path: &Path, film: &Film, exposure: f32) -> Result<()> {
    let bytes = to_bytes(film, exposure)?;
    write_atomically(path, |w| w.write_all(&bytes))
}

/// Reads a `.pix` file of `size` pixels, or of a square if none is given, as linear planes R G B.
///
/// # Errors
/// [`Error::Io`]; [`Error::Input`] if the file's length is not that of such a picture.
pub fn read(path: &Path, size: Option<(u32, u32)>) -> Result<Film> {
    parse(path, &input::read(path)?, size)
}

/// As [`read`], of the bytes of a file; `file` is only for error messages.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &Path, bytes: &[u8], size: Option<(u32, u32)>) -> Result<Film> {
    let pixels = bytes.len() as u64 / CHANNELS as u64;
    let side = pixels.isqrt();
    let (width, height) = size.unwrap_or((side as u32, side as u32));
    let expected = (u64::from(width) * u64::from(height)).saturating_mul(CHANNELS as u64);
    if bytes.is_empty() || bytes.len() as u64 != expected {
        let length = bytes.len();
        let error = match size {
            Some(_) => format!("expected {expected} bytes (a .pix picture of {width}x{height}), found {length}"),
            None => format!("expected a square .pix picture (3 bytes per pixel), found {length} bytes"),
        };
        return Err(Error::whole(file, error).with_help("give its size with --size WxH"));
    }
    let mut film = Film::full(width, height)?;
    let (width, height) = (width as usize, height as usize);
    for (channel, name) in COLOR.iter().enumerate() {
        let pixel = |i: usize| (height - 1 - i / width) * width + i % width;
        let value = |i: usize| f32::from(bytes[CHANNELS * pixel(i) + channel]) / 255.0;
        film.push(*name, PlaneData::F32((0..width * height).map(value).collect()))?;
    }
    Ok(film)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn levels_are_cut_off_after_adding_a_half() {
        for (value, expected) in [
            (0.0, 0),
            (1.0, 255),
            (9.0, 255),
            (-1.0, 0),
            (f64::NAN, 0),
            (0.5, 128),
            (0.4999 / 255.0, 0),
            (0.5 / 255.0, 1),
        ] {
            assert_eq!(level(value), expected, "{value}");
        }
    }

    proptest! {
        #[test]
        fn many_levels_are_those_of_each(values in prop::collection::vec(prop_oneof![any::<f32>(), -0.5f32..1.5], 0..40), stops in -3f64..3.0) {
            let gain = stops.exp2();
            let mut many = vec![7; values.len()];
            levels(&values, gain, &mut many);
            let each: Vec<u8> = values.iter().map(|&value| level(f64::from(value) * gain)).collect();
            prop_assert_eq!(many, each);
        }

        #[test]
        fn bytes_survive_a_round_trip(width in 1u32..9, height in 1u32..9, seed in any::<u8>()) {
            let bytes: Vec<u8> = (0..width * height * 3).map(|i| (i as u8).wrapping_mul(37).wrapping_add(seed)).collect();
            let film = parse(Path::new("a.pix"), &bytes, Some((width, height))).unwrap();
            prop_assert_eq!(to_bytes(&film, 0.0).unwrap(), bytes);
        }
    }

    #[test]
    fn the_first_row_of_the_file_is_the_lowest() {
        let film = parse(Path::new("a.pix"), &[255, 0, 0, 0, 255, 0], Some((1, 2))).unwrap();
        assert_eq!(film.f32_plane("R"), Some(&[0.0, 1.0][..]));
        assert_eq!(film.f32_plane("G"), Some(&[1.0, 0.0][..]));
    }

    #[test]
    fn lengths_that_do_not_fit_are_refused() {
        let error = |n: usize, size| parse(Path::new("a.pix"), &vec![0; n], size).unwrap_err().to_string();
        assert!(parse(Path::new("a.pix"), &[0; 27], None).is_ok());
        assert!(error(26, None).contains("expected a square .pix picture (3 bytes per pixel), found 26 bytes"));
        assert!(error(24, None).contains("--size"));
        assert!(error(0, None).contains("found 0"));
        assert!(error(24, Some((3, 3))).contains("expected 27 bytes (a .pix picture of 3x3), found 24"));
        assert!(error(6, Some((u32::MAX, u32::MAX))).contains("found 6"));
    }
}
