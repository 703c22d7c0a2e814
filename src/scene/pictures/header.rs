//! A picture's header against the bounds: nothing is decoded, and no memory taken for pixels, before this.

use image::{ColorType, ImageDecoder};

use super::{Format, decoder, openexr, radiance, shortened};
use crate::scene::text;

/// Most texels along a side.
pub const MAX_SIDE: u32 = 1 << 16;
/// Most texels of one picture: 8192 x 8192.
pub const MAX_TEXELS: u64 = 1 << 26;
/// Most bytes of one picture's texels in memory: floats of 8192 x 4096.
pub const MAX_BYTES: u64 = 512 << 20;
/// Most bytes of texels per byte of a file: deflate grows data at most 1032 times, and a grey level of one bit becomes
/// four bytes. The other formats grow less.
const MAX_GROWTH: u64 = 1032 * 8 * 4;
/// Every small picture is fine.
const ALWAYS_ALLOWED: u64 = 1 << 16;

/// What a header says of a picture that may be decoded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    pub format: Format,
    pub width: u32,
    pub height: u32,
    /// Bytes of its texels in memory.
    pub bytes: u64,
}

impl Header {
    /// Reads and checks the header of the picture in `bytes`.
    ///
    /// # Errors
    /// An unknown format, a header that cannot be read, no texels or too many, a truncated JPEG.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        if bytes.is_empty() {
            return Err("the picture is empty".into());
        }
        let Some(format) = Format::of(bytes) else {
            let start = text::shown(&bytes[..bytes.len().min(8)]);
            return Err(format!("expected a PNG, JPEG, Radiance HDR or EXR picture, found a file that begins {start}"));
        };
        let broken = |what: String| format!("not a readable {} picture: {}", format.name(), shortened(&what));
        let (width, height, texel) = match format {
            Format::Exr => {
                let (width, height) = openexr::size(bytes).map_err(broken)?;
                (width, height, size_of::<[f32; 4]>())
            }
            Format::Hdr => {
                let (width, height) = radiance::size(bytes).map_err(broken)?;
                (width, height, size_of::<[f32; 4]>())
            }
            Format::Png | Format::Jpeg => {
                let decoder = decoder(format, bytes).map_err(broken)?;
                let (width, height) = decoder.dimensions();
                (width, height, texel_bytes(decoder.color_type()))
            }
        };
        let texels = u64::from(width) * u64::from(height);
        let in_memory = texels.saturating_mul(texel as u64);
        let size = format!("{width} x {height} texels");
        if texels == 0 {
            return Err(format!("has {size}: expected at least one"));
        }
        if width.max(height) > MAX_SIDE || texels > MAX_TEXELS || in_memory > MAX_BYTES {
            let most = MAX_BYTES >> 20;
            return Err(format!("is too large: {size}, at most {MAX_TEXELS} in {most} MiB are read"));
        }
        let possible = (bytes.len() as u64).saturating_mul(MAX_GROWTH).saturating_add(ALWAYS_ALLOWED);
        if in_memory > possible {
            return Err(format!("claims {size}, more than its {} bytes can hold", bytes.len()));
        }
        if format == Format::Jpeg && !jpeg_has_end(bytes) {
            return Err("not a readable JPEG picture: the data ends before the picture does".into());
        }
        Ok(Self { format, width, height, bytes: in_memory })
    }
}

/// Bytes of a texel of the kind that pixels of `kind` become.
fn texel_bytes(kind: ColorType) -> usize {
    match kind {
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => size_of::<[u16; 4]>(),
        _ => size_of::<[u8; 4]>(),
    }
}

/// Whether the marker that ends a JPEG picture (EOI) follows its first scan. Decoders fill what is missing with grey.
///
/// Source: ITU-T T.81, 1992, annex B. Segments before the first scan are passed over by their length, because a
/// preview in one of them has an end of its own; inside entropy-coded data 0xff is followed by 0 or a marker.
fn jpeg_has_end(bytes: &[u8]) -> bool {
    const SCAN: u8 = 0xda;
    const END: [u8; 2] = [0xff, 0xd9];
    let mut at = 2;
    loop {
        let Some(&[mark, code, ..]) = bytes.get(at..).filter(|rest| rest.len() >= 4) else { return false };
        if mark != 0xff {
            return false;
        }
        match code {
            // A fill byte, or a marker without a segment.
            0xff => at += 1,
            0x01 | 0xd0..=0xd8 => at += 2,
            SCAN => return bytes[at..].windows(2).any(|pair| pair == END),
            _ => at += 2 + usize::from(u16::from_be_bytes([bytes[at + 2], bytes[at + 3]])),
        }
    }
}
