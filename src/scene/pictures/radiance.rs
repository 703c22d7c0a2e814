//! Radiance HDR pictures: what their numbers were multiplied by is divided out again, so that texels are radiance.
//!
//! Source: G. Ward, "Radiance File Formats": `EXPOSURE` and `COLORCORR` say what the pixels were multiplied by; values
//! of several lines are multiplied with each other.

use std::io::Read;

use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

use super::header::Header;
use super::levels::clean;
use crate::scene::texture::Texels;

/// Beginnings of such files, the usual one first.
const SIGNATURES: [&[u8]; 2] = [b"#?RADIANCE", b"#?RGBE"];

/// Whether `bytes` begin as such a picture does.
pub(super) fn is_known(bytes: &[u8]) -> bool {
    SIGNATURES.iter().any(|signature| bytes.starts_with(signature))
}

/// Width and height of the picture in `bytes`.
///
/// # Errors
/// What is wrong with the header.
pub(super) fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    let decoder = open(bytes)?;
    multipliers(&decoder)?;
    Ok(decoder.dimensions())
}

/// The texels of the picture in `bytes`, whose header was found harmless.
///
/// # Errors
/// Damaged or truncated data.
pub(super) fn texels(bytes: &[u8], header: &Header) -> Result<Texels, String> {
    let decoder = open(bytes)?;
    let multipliers = multipliers(&decoder)?;
    // Three numbers of a texel as they come, not the four that it becomes.
    let mut raw = vec![0; header.width as usize * header.height as usize * size_of::<[f32; 3]>()];
    decoder.read_image(&mut raw).map_err(|e| e.to_string())?;
    let number = |p: &[u8], i: usize| f32::from_ne_bytes([p[4 * i], p[4 * i + 1], p[4 * i + 2], p[4 * i + 3]]);
    let pixels = raw.chunks_exact(size_of::<[f32; 3]>()).map(|p| [0, 1, 2].map(|i| number(p, i) / multipliers[i]));
    Ok(Texels::Float(pixels.map(|[r, g, b]| clean([r, g, b, 1.0])).collect()))
}

/// The decoder, its header read. It knows one signature only; some programs write the other, of the same format.
fn open(bytes: &[u8]) -> Result<HdrDecoder<impl Read + '_>, String> {
    let rest = SIGNATURES.iter().find_map(|signature| bytes.strip_prefix(*signature)).unwrap_or(bytes);
    HdrDecoder::new(SIGNATURES[0].chain(rest)).map_err(|e| e.to_string())
}

/// What red, green and blue were multiplied by, all lines of the header together.
///
/// # Errors
/// Products by which nothing can be divided.
fn multipliers<R: Read>(decoder: &HdrDecoder<R>) -> Result<[f32; 3], String> {
    let data = decoder.metadata();
    let exposure = data.exposure.unwrap_or(1.0);
    let (r, g, b) = data.color_correction.unwrap_or((1.0, 1.0, 1.0));
    for (name, numbers) in [("EXPOSURE", [exposure; 3]), ("COLORCORR", [r, g, b])] {
        if let Some(odd) = numbers.iter().find(|x| !(**x > 0.0 && x.is_finite())) {
            return Err(format!("expected a finite {name} above zero, found {odd}"));
        }
    }
    let all = [r, g, b].map(|c| c * exposure);
    match all.iter().all(|x| x.is_normal()) {
        true => Ok(all),
        false => Err(format!("EXPOSURE and COLORCORR multiply to {all:?}, by which nothing can be divided")),
    }
}
