//! PNG pictures: 8-bit sRGB out of the colour planes, and any PNG back into linear planes.
//!
//! Source: W3C, "Portable Network Graphics (PNG) Specification (Third Edition)", 2025. A PNG has no data window: what
//! is written has the size of the film's data window. PNG colour is not premultiplied, the film's is.

use std::io::{self, Cursor};
use std::path::Path;

use png::{BitDepth, ColorType, Transformations};

use super::planes::{ALPHA, COLOR, Film, PlaneData};
use super::{input, srgb, write_atomically};
use crate::error::{Error, Result};

/// Most bytes of planes per byte of file. Deflate grows data at most 1032 times and a grey byte becomes three floats, 12
/// bytes; a header that claims more lies (or is a huge blank picture of fewer bits, refused with the liars).
const MAX_GROWTH: u64 = 1032 * 12 * 4 / 3;
/// Every tiny picture is fine.
const ALWAYS_ALLOWED: u64 = 1 << 16;

/// Interleaved 8-bit sRGB pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels8 {
    /// 3 (R G B) or 4 (R G B A, not premultiplied).
    pub channels: usize,
    /// Row-major over the data window, `channels` bytes per pixel.
    pub bytes: Vec<u8>,
}

/// Tone mapping for PNG and previews: linear colour times 2^`exposure`, the exact sRGB curve, 256 levels.
/// NaN becomes 0, what is brighter than 1 is clamped. With a plane `A` there are four channels, otherwise three.
///
/// # Errors
/// [`Error::Usage`] if a colour plane is missing or the film is broken.
pub fn to_srgb8(film: &Film, exposure: f32) -> Result<Pixels8> {
    film.validate()?;
    let color = film.color()?;
    let alpha = film.f32_plane(ALPHA);
    let gain = f64::from(exposure).exp2();
    let channels = if alpha.is_some() { 4 } else { 3 };
    let mut bytes = Vec::with_capacity(film.pixels() * channels);
    for i in 0..film.pixels() {
        let coverage = alpha.map_or(1.0, |a| f64::from(a[i]));
        // Light without coverage (a glow) cannot be divided; it is stored as it is.
        let straight = if coverage > 0.0 && coverage < 1.0 { gain / coverage } else { gain };
        bytes.extend(color.map(|plane| srgb::encode_level(f64::from(plane[i]) * straight)));
        if alpha.is_some() {
            bytes.push(srgb::level(coverage));
        }
    }
    Ok(Pixels8 { channels, bytes })
}

/// Writes the colour planes as an 8-bit sRGB PNG of the data window's size, see [`to_srgb8`].
///
/// # Errors
/// [`Error::Usage`] as [`to_srgb8`]; [`Error::Io`] if the file cannot be written.
pub fn write(path: &Path, film: &Film, exposure: f32) -> Result<()> {
    let pixels = to_srgb8(film, exposure)?;
    write_atomically(path, |w| {
        let mut encoder = png::Encoder::new(w, film.window.width(), film.window.height());
        encoder.set_color(if pixels.channels == 4 { ColorType::Rgba } else { ColorType::Rgb });
        encoder.set_depth(BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut body = encoder.write_header().map_err(io_error)?;
        body.write_image_data(&pixels.bytes).map_err(io_error)?;
        body.finish().map_err(io_error)
    })
}

fn io_error(e: png::EncodingError) -> io::Error {
    match e {
        png::EncodingError::IoError(e) => e,
        other => io::Error::other(other),
    }
}

/// Reads a PNG of any colour type and depth as linear planes R G B, and A if it has transparency.
/// The samples are taken as sRGB whatever the file's colour chunks say.
///
/// # Errors
/// [`Error::Io`] or, for a damaged file, [`Error::Input`].
pub fn read(path: &Path) -> Result<Film> {
    parse(path, &input::read(path)?)
}

/// [`read`], and the bits of a sample: 8 also for files of fewer, 16 for those finer than the levels of a display.
///
/// # Errors
/// As [`read`].
pub fn read_with_depth(path: &Path) -> Result<(Film, u8)> {
    decode(path, &input::read(path)?)
}

/// [`read`] of bytes in memory; `file` is only for messages.
///
/// # Errors
/// [`Error::Input`] for a damaged file or one whose header claims more pixels than its length can hold.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Film> {
    decode(file, bytes).map(|(film, _)| film)
}

fn decode(file: &Path, bytes: &[u8]) -> Result<(Film, u8)> {
    let bad = |e: png::DecodingError| Error::whole(file, format!("not a readable PNG: {e}"));
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(bad)?;
    let (width, height) = (reader.info().width, reader.info().height);
    let planes = if has_alpha(reader.output_color_type().0) { 4 } else { 3 };
    let claimed = (u64::from(width) * u64::from(height)).saturating_mul(4 * planes);
    if claimed > MAX_GROWTH.saturating_mul(bytes.len() as u64).saturating_add(ALWAYS_ALLOWED) {
        let what = format!("claims {width}x{height} pixels, more than {} bytes of file can hold", bytes.len());
        return Err(Error::whole(file, what));
    }
    let size = reader.output_buffer_size().ok_or_else(|| Error::whole(file, "picture too large for memory"))?;
    let mut pixels = vec![0; size];
    let frame = reader.next_frame(&mut pixels).map_err(bad)?;
    pixels.truncate(frame.buffer_size());
    let film = film_of(width, height, frame.color_type, frame.bit_depth, &pixels);
    let bits = if frame.bit_depth == BitDepth::Sixteen { 16 } else { 8 };
    film.map(|film| (film, bits)).map_err(|e| Error::whole(file, e.to_string()))
}

fn has_alpha(color: ColorType) -> bool {
    matches!(color, ColorType::Rgba | ColorType::GrayscaleAlpha)
}

fn film_of(width: u32, height: u32, color: ColorType, depth: BitDepth, pixels: &[u8]) -> Result<Film> {
    let samples = color.samples();
    let unit: Box<dyn Fn(usize) -> f64> = match depth {
        BitDepth::Sixteen => Box::new(|i| f64::from(u16::from_be_bytes([pixels[2 * i], pixels[2 * i + 1]])) / 65535.0),
        _ => Box::new(|i| f64::from(pixels[i]) / 255.0),
    };
    let has_alpha = has_alpha(color);
    let is_gray = matches!(color, ColorType::Grayscale | ColorType::GrayscaleAlpha);
    let mut film = Film::full(width, height)?;
    let count = film.pixels();
    let alpha = |p: usize| if has_alpha { unit(p * samples + samples - 1) } else { 1.0 };
    for (channel, name) in COLOR.into_iter().enumerate() {
        let source = if is_gray { 0 } else { channel };
        let plane = (0..count).map(|p| (srgb::decode(unit(p * samples + source)) * alpha(p)) as f32).collect();
        film.push(name, PlaneData::F32(plane))?;
    }
    if has_alpha {
        film.push(ALPHA, PlaneData::F32((0..count).map(|p| alpha(p) as f32).collect()))?;
    }
    Ok(film)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::film::Window;
    use crate::film::tests::{XorShift, mutate};

    fn film(width: u32, height: u32, planes: &[(&str, Vec<f32>)]) -> Film {
        let mut film = Film::full(width, height).unwrap();
        for (name, data) in planes {
            film.push(*name, PlaneData::F32(data.clone())).unwrap();
        }
        film
    }

    #[test]
    fn levels_follow_exposure_and_clamp() {
        let film = film(
            4,
            1,
            &[
                ("R", vec![0.18, 0.25, f32::NAN, 9.0]),
                ("G", vec![0.0, 0.5, -1.0, f32::INFINITY]),
                ("B", vec![1.0, 1.0, 0.001, 0.09]),
            ],
        );
        // sRGB of 0.18, 0.25, 0.5 is 0.46136, 0.53710, 0.73536: levels 118, 137, 188.
        let plain = to_srgb8(&film, 0.0).unwrap();
        assert_eq!(plain.channels, 3);
        assert_eq!(plain.bytes, [118, 0, 255, 137, 188, 255, 0, 0, 3, 255, 255, 85]);
        // One stop more doubles: 0.25 -> 0.5, 0.09 -> 0.18.
        let brighter = to_srgb8(&film, 1.0).unwrap();
        assert_eq!((brighter.bytes[3], brighter.bytes[11]), (188, 118));
    }

    #[test]
    fn alpha_is_divided_out_and_back_in() {
        let film = film(
            3,
            1,
            &[
                ("R", vec![0.25, 0.5, 0.0]),
                ("G", vec![0.25, 0.5, 0.0]),
                ("B", vec![0.0, 0.5, 0.0]),
                ("A", vec![0.5, 1.0, 0.0]),
            ],
        );
        let pixels = to_srgb8(&film, 0.0).unwrap();
        assert_eq!(pixels.bytes, [188, 188, 0, 128, 188, 188, 188, 255, 0, 0, 0, 0]);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        write(&path, &film, 0.0).unwrap();
        let back = read(&path).unwrap();
        let red = back.f32_plane("R").unwrap()[0];
        assert!((f64::from(red) - srgb::decode(188.0 / 255.0) * 128.0 / 255.0).abs() < 1e-7, "{red}");
        assert_eq!(back.f32_plane("A").unwrap()[1], 1.0);
    }

    #[test]
    fn every_level_survives_a_file() {
        let ramp: Vec<f32> = (0..256).map(|i| srgb::decode(f64::from(i) / 255.0) as f32).collect();
        let film = film(16, 16, &[("R", ramp.clone()), ("G", ramp.iter().rev().copied().collect()), ("B", ramp)]);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        write(&path, &film, 0.0).unwrap();
        let back = read(&path).unwrap();
        assert_eq!(to_srgb8(&back, 0.0).unwrap(), to_srgb8(&film, 0.0).unwrap());
        // The signature and an sRGB chunk (perceptual) right after the 25 bytes of IHDR.
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n");
        assert_eq!(bytes[33..42], *b"\0\0\0\x01sRGB\0");
    }

    #[test]
    fn a_crop_has_its_own_size() {
        let mut film = Film::new(10, 10, Window { x0: 2, y0: 3, x1: 5, y1: 4 }).unwrap();
        for name in COLOR {
            film.push(name, PlaneData::F32(vec![0.5; 3])).unwrap();
        }
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        write(&path, &film, 0.0).unwrap();
        let back = read(&path).unwrap();
        assert_eq!((back.width, back.height), (3, 1));
    }

    /// A PNG put together by hand from its chunks: checksums by flate2, no filter, `raw` rows with their filter bytes.
    fn png_bytes(width: u32, height: u32, depth: u8, color: u8, extra: &[(&[u8; 4], &[u8])], raw: &[u8]) -> Vec<u8> {
        let mut header = [width.to_be_bytes(), height.to_be_bytes()].concat();
        header.extend([depth, color, 0, 0, 0]);
        let mut z = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        z.write_all(raw).unwrap();
        let data = z.finish().unwrap();
        let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
        let chunks = [(b"IHDR", &header[..])].into_iter().chain(extra.iter().copied());
        for (kind, body) in chunks.chain([(b"IDAT", &data[..]), (b"IEND", &[][..])]) {
            let mut crc = flate2::Crc::new();
            crc.update(kind);
            crc.update(body);
            file.extend((body.len() as u32).to_be_bytes());
            file.extend(kind);
            file.extend(body);
            file.extend(crc.sum().to_be_bytes());
        }
        file
    }

    #[test]
    fn other_colour_types_are_expanded() {
        let gray16 = png_bytes(2, 1, 16, 0, &[], &[0, 0xff, 0xff, 0x80, 0x00]);
        let film = parse(Path::new("g"), &gray16).unwrap();
        assert_eq!(film.f32_plane("B").unwrap(), [1.0, srgb::decode(32768.0 / 65535.0) as f32]);
        let indexed = png_bytes(3, 1, 1, 3, &[(b"PLTE", &[0, 255, 0, 255, 0, 0])], &[0, 0b0100_0000]);
        let film = parse(Path::new("i"), &indexed).unwrap();
        assert_eq!(film.f32_plane("R").unwrap(), [0.0, 1.0, 0.0]);
        assert_eq!(film.f32_plane("G").unwrap(), [1.0, 0.0, 1.0]);
    }

    #[test]
    fn hostile_files_are_errors() {
        let bomb = png_bytes(1 << 20, 1 << 20, 16, 6, &[], &[0; 9]);
        let what = parse(Path::new("bomb.png"), &bomb).unwrap_err().to_string();
        assert!(what.starts_with("bomb.png: claims 1048576x1048576 pixels"), "{what}");
        let good = png_bytes(2, 1, 16, 0, &[], &[0, 0xff, 0xff, 0x80, 0x00]);
        for cut in 0..good.len() - 12 {
            assert!(parse(Path::new("x"), &good[..cut]).is_err(), "{cut}");
        }
        let mut film = Film::full(1, 1).unwrap();
        film.push("R", PlaneData::F32(vec![0.0])).unwrap();
        assert!(to_srgb8(&film, 0.0).is_err());
    }

    #[test]
    fn a_blank_picture_is_no_liar() {
        for (depth, color, row) in [(8, 0, 1025), (8, 2, 3073), (16, 6, 8193)] {
            let blank = png_bytes(1024, 1024, depth, color, &[], &vec![0; 1024 * row]);
            assert_eq!(parse(Path::new("b"), &blank).unwrap().f32_plane("G").unwrap(), vec![0.0; 1 << 20]);
        }
    }

    #[test]
    fn mutated_files_never_panic() {
        let palette: [(&[u8; 4], &[u8]); 2] = [(b"PLTE", &[0, 255, 0, 255, 0, 0]), (b"tRNS", &[0, 128])];
        let seeds = [
            png_bytes(2, 2, 16, 0, &[], &[0, 0xff, 0xff, 0x80, 0, 4, 1, 2, 3, 4]),
            png_bytes(3, 1, 1, 3, &palette, &[0, 0b0100_0000]),
            png_bytes(2, 1, 8, 6, &[], &[1, 1, 2, 3, 4, 5, 6, 7, 8]),
        ];
        let (mut random, mut accepted) = (XorShift(0xd1b5_4a32_d192_ed03), 0);
        for round in 0..20_000 {
            let bytes = mutate(&seeds[round % seeds.len()], &mut random);
            if let Ok(film) = parse(Path::new("m"), &bytes) {
                film.validate().unwrap();
                accepted += 1;
            }
        }
        assert!((100..19_900).contains(&accepted), "{accepted}");
    }
}
