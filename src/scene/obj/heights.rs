//! Heights (bump maps) as normals.

use crate::scene::texture::{Texels, Texture};

/// Height of a picture's white above its black, relative to its width, at a multiplier of 1. The format leaves the
/// unit open; this one does not depend on the number of texels.
const RELIEF: f64 = 0.01;

/// Whether a picture shows heights: all its texels are grey. Normals are bluish nearly everywhere.
pub(super) fn is_heights(texture: &Texture) -> bool {
    fn grey<T: PartialEq>([r, g, b, _]: &[T; 4]) -> bool {
        r == g && g == b
    }
    match &texture.texels {
        Texels::Srgb8(t) | Texels::Linear8(t) => t.iter().all(grey),
        Texels::Linear16(t) => t.iter().all(grey),
        Texels::Float(t) => t.iter().all(grey),
    }
}

/// The normals (x to the right, y up, 0.5 + 0.5 n) of the heights in `texture`, whose edges meet their opposites:
/// slopes are central differences.
pub(super) fn normals(texture: &Texture, multiplier: f64) -> Texture {
    let (width, height) = (texture.width as usize, texture.height as usize);
    let level = |x: usize, y: usize| -> f64 {
        let at = y % height * width + x % width;
        match &texture.texels {
            Texels::Srgb8(t) | Texels::Linear8(t) => f64::from(t[at][0]) / 255.0,
            Texels::Linear16(t) => f64::from(t[at][0]) / 65535.0,
            Texels::Float(t) => f64::from(t[at][0]),
        }
    };
    let scale = multiplier * RELIEF * width as f64 / 2.0;
    let normal = |x: usize, y: usize| {
        let right = level(x + 1, y) - level(x + width - 1, y);
        let up = level(x, y + height - 1) - level(x, y + 1);
        let (nx, ny) = (-right * scale, -up * scale);
        let length = (nx * nx + ny * ny + 1.0).sqrt();
        let level = |n: f64| ((0.5 + 0.5 * n / length) * 255.0).round() as u8;
        [level(nx), level(ny), level(1.0), u8::MAX]
    };
    let texels = (0..width * height).map(|i| normal(i % width, i / width)).collect();
    let name = texture.name.clone();
    Texture { name, width: texture.width, height: texture.height, texels: Texels::Linear8(texels) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(levels: [u8; 16]) -> Texture {
        let texels = Texels::Linear8(levels.map(|l| [l, l, l, 255]).into());
        Texture { name: "h".into(), width: 4, height: 4, texels }
    }

    #[test]
    fn slopes_tilt_the_normal_downhill() {
        let Texels::Linear8(flat) = normals(&picture([7; 16]), 1.0).texels else { panic!("not numbers") };
        assert!(flat.iter().all(|t| *t == [128, 128, 255, 255]));
        // Rises to the right by 51 of 255 per texel over a width of 4: a slope of 0.008 at 1, of 0.8 at 100.
        let Texels::Linear8(right) = normals(&picture(std::array::from_fn(|i| 51 * (i as u8 % 4))), 100.0).texels
        else {
            panic!("not numbers")
        };
        let length = (0.8_f64 * 0.8 + 1.0).sqrt();
        let level = |n: f64| ((0.5 + 0.5 * n / length) * 255.0).round() as u8;
        assert_eq!(right[5], [level(-0.8), 128, level(1.0), 255]);
        // Rises downwards: the normal leans up.
        let Texels::Linear8(down) = normals(&picture(std::array::from_fn(|i| 51 * (i as u8 / 4))), 100.0).texels else {
            panic!("not numbers")
        };
        assert_eq!(down[5], [128, level(0.8), level(1.0), 255]);
        assert!(is_heights(&picture([1; 16])) && !is_heights(&normals(&picture([1; 16]), 1.0)));
    }
}
