//! Any bytes give a texture with all its texels, or an error.
#![no_main]

use lanecast::scene::pictures::{Curve, decode};
use lanecast::scene::texture::Texels;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for curve in [Curve::Srgb, Curve::Linear] {
        if let Ok(texture) = decode("fuzz", bytes, curve) {
            let count = match &texture.texels {
                Texels::Srgb8(t) | Texels::Linear8(t) => t.len(),
                Texels::Linear16(t) => t.len(),
                Texels::Float(t) => {
                    assert!(t.iter().flatten().all(|x| x.is_finite()));
                    t.len()
                }
            };
            assert_eq!(count as u64, u64::from(texture.width) * u64::from(texture.height));
        }
    }
});
