//! Pixels as the crate `image` decodes them, to texels.

use std::sync::LazyLock;

use image::ColorType;

use super::Curve;
use crate::scene::texture::Texels;

/// Largest number of a picture of floats: sums over all texels and products of two stay finite in f32.
const LARGEST: f32 = 1e12;

/// The texels of `raw`, whose pixels are of `kind` in the machine's byte order.
///
/// # Errors
/// A kind of pixel that the decoders here do not give.
pub(super) fn texels(raw: Vec<u8>, kind: ColorType, curve: Curve) -> Result<Texels, String> {
    let eight = |texels| match curve {
        Curve::Srgb => Texels::Srgb8(texels),
        Curve::Linear => Texels::Linear8(texels),
    };
    Ok(match kind {
        ColorType::L8 => eight(raw.iter().map(|&l| [l, l, l, u8::MAX]).collect()),
        ColorType::La8 => eight(raw.chunks_exact(2).map(|p| [p[0], p[0], p[0], p[1]]).collect()),
        ColorType::Rgb8 => eight(raw.chunks_exact(3).map(|p| [p[0], p[1], p[2], u8::MAX]).collect()),
        ColorType::Rgba8 => eight(raw.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect()),
        ColorType::L16 => sixteen::<1>(&raw, curve, |[l]| [l, l, l, u16::MAX]),
        ColorType::La16 => sixteen::<2>(&raw, curve, |[l, a]| [l, l, l, a]),
        ColorType::Rgb16 => sixteen::<3>(&raw, curve, |[r, g, b]| [r, g, b, u16::MAX]),
        ColorType::Rgba16 => sixteen::<4>(&raw, curve, |p| p),
        other => return Err(format!("pixels of the kind {other:?} are not read")),
    })
}

/// Texels of 16 bits, from pixels of `N` channels.
fn sixteen<const N: usize>(raw: &[u8], curve: Curve, spread: impl Fn([u16; N]) -> [u16; 4]) -> Texels {
    let pixel = |p: &[u8]| spread(std::array::from_fn(|i| u16::from_ne_bytes([p[2 * i], p[2 * i + 1]])));
    let linear = |[r, g, b, a]: [u16; 4]| {
        let [r, g, b] = [r, g, b].map(|level| LINEAR[usize::from(level)]);
        [r, g, b, a]
    };
    let pixels = raw.chunks_exact(2 * N).map(pixel);
    Texels::Linear16(match curve {
        Curve::Linear => pixels.collect(),
        Curve::Srgb => pixels.map(linear).collect(),
    })
}

/// A texel of numbers that light can have: not a number and what is negative are 0, what is beyond [`LARGEST`] is that.
pub(super) fn clean(texel: [f32; 4]) -> [f32; 4] {
    // The plain maximum of f32 would keep a NaN that stands second.
    texel.map(|x| if x > 0.0 { x.min(LARGEST) } else { 0.0 })
}

/// Linear light of the 16-bit levels of sRGB (IEC 61966-2-1), in 16 bits: coarser than the levels only where they are
/// a tenth of the 8-bit ones.
static LINEAR: LazyLock<Vec<u16>> = LazyLock::new(|| {
    let light = |x: f64| if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
    (0..=u16::MAX).map(|level| (light(f64::from(level) / 65535.0) * 65535.0).round() as u16).collect()
});
