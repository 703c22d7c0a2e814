//! Pictures of scenes as textures: PNG, JPEG, Radiance HDR and OpenEXR, told apart by their first bytes.
//!
//! The crates `image` and `exr` decode; `header` decides from a picture's header whether it may be decoded, `levels`
//! turns what comes out into texels, `openexr` reads EXR, `radiance` HDR, `set` decodes many pictures on all threads.
//!
//! Numbers are taken as the use asks ([`Curve`]); colour profiles and gamma of the file are not applied, as glTF 2.0
//! (section 3.8.3) demands. Grey and palettes become R, G, B; no alpha is 1.
//!
//! Bounds, checked on the header before a pixel is decoded: [`MAX_TEXELS`] and [`MAX_BYTES`] of one picture,
//! [`MAX_TOTAL`] of all pictures of a scene, and no more texels than a file of that length can hold.

mod header;
mod levels;
mod openexr;
mod radiance;
mod set;

use std::io::Cursor;

use image::{ImageDecoder, ImageFormat, ImageReader, Limits};

use self::header::Header;
use super::texture::Texture;

pub use self::header::{MAX_BYTES, MAX_SIDE, MAX_TEXELS};
pub use self::set::{Content, MAX_TOTAL, Picture, Unreadable, decode_all, is_known};

/// What the levels of an integer picture mean. Pictures of floats hold plain numbers whatever is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Curve {
    /// Colours with the curve of sRGB (IEC 61966-2-1); alpha is linear.
    Srgb,
    /// Plain numbers 0..1: normals, roughness, opacity.
    Linear,
}

/// Formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Jpeg,
    Hdr,
    Exr,
}

impl Format {
    /// The format that the first bytes of a file show.
    fn of(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Self::Exr),
            _ => radiance::is_known(bytes).then_some(Self::Hdr),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Hdr => "Radiance HDR",
            Self::Exr => "EXR",
        }
    }
}

/// Decodes the picture in `bytes` to the texture called `name`.
///
/// # Errors
/// What is wrong with it: an unknown format, damaged or truncated data, more than the bounds above allow.
pub fn decode(name: &str, bytes: &[u8], curve: Curve) -> Result<Texture, String> {
    let header = Header::read(bytes)?;
    let broken = |what: String| format!("not a readable {} picture: {}", header.format.name(), shortened(&what));
    let texels = match header.format {
        Format::Exr => openexr::texels(bytes, &header).map_err(broken)?,
        Format::Hdr => radiance::texels(bytes, &header).map_err(broken)?,
        Format::Png | Format::Jpeg => {
            let decoder = decoder(header.format, bytes).map_err(broken)?;
            let kind = decoder.color_type();
            // The header was compared with the bounds, so this is a size that was found harmless.
            let mut raw = vec![0; usize::try_from(decoder.total_bytes()).map_err(|_| "too large".to_string())?];
            decoder.read_image(&mut raw).map_err(|e| broken(e.to_string()))?;
            levels::texels(raw, kind, curve)?
        }
    };
    Ok(Texture { name: name.to_owned(), width: header.width, height: header.height, texels })
}

/// The decoder of a PNG or JPEG picture, its header read.
fn decoder(format: Format, bytes: &[u8]) -> Result<impl ImageDecoder + '_, String> {
    let format = match format {
        Format::Png => ImageFormat::Png,
        _ => ImageFormat::Jpeg,
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::no_limits();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    // What decoders may take besides the picture: text chunks of PNG, for one.
    limits.max_alloc = Some(2 * MAX_BYTES);
    reader.limits(limits);
    reader.into_decoder().map_err(|e| e.to_string())
}

/// A decoder's message without what a hostile file made it quote.
fn shortened(what: &str) -> String {
    const CHARS: usize = 160;
    what.chars().map(|c| if c.is_control() { ' ' } else { c }).take(CHARS).collect()
}
