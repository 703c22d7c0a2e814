//! Colour spaces of FLIP: linear RGB (Rec. 709, D65), the opponent space YCxCz, CIELAB with Hunt's adjustment.
//!
//! Source of RGB to XYZ: ITU-R BT.709-6, "Parameter values for the HDTV standards", 2015: the primaries and white point. YCxCz: T. J.
//! Flohr, B. W. Kolpatzik, R. Balasubramanian, D. A. Carrara, C. A. Bouman, J. P. Allebach, "Model Based Color Image
//! Quantization", 1993. HyAB: S. Abasi, M. Amani Tehran, M. D. Fairchild, "Distance metrics for very large color
//! differences", 2020.

/// Rows give X, Y and Z of linear red, green and blue.
const TO_XYZ: [[f32; 3]; 3] = [
    [0.412_390_8, 0.357_584_33, 0.180_480_79],
    [0.212_639, 0.715_168_65, 0.072_192_32],
    [0.019_330_82, 0.119_194_78, 0.950_532_14],
];

/// The inverse of [`TO_XYZ`].
const FROM_XYZ: [[f32; 3]; 3] = [
    [3.240_97, -1.537_383_2, -0.498_610_76],
    [-0.969_243_65, 1.875_967_5, 0.041_555_06],
    [0.055_630_08, -0.203_976_96, 1.056_971_5],
];

/// XYZ of white: the sums of the rows of [`TO_XYZ`].
const WHITE: [f32; 3] = [0.950_455_93, 1.0, 1.089_057_75];

fn times(matrix: &[[f32; 3]; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    matrix.map(|[a, b, c]| a * x + b * y + c * z)
}

/// XYZ relative to white.
fn to_relative_xyz(rgb: [f32; 3]) -> [f32; 3] {
    let xyz = times(&TO_XYZ, rgb);
    [xyz[0] / WHITE[0], xyz[1] / WHITE[1], xyz[2] / WHITE[2]]
}

/// Linear RGB to YCxCz.
pub fn linear_to_opponent(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = to_relative_xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// YCxCz to linear RGB.
pub fn opponent_to_linear([yy, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (yy + 16.0) / 116.0;
    let (x, z) = (y + cx / 500.0, y - cz / 200.0);
    times(&FROM_XYZ, [x * WHITE[0], y * WHITE[1], z * WHITE[2]])
}

/// Linear RGB to CIELAB with chroma scaled by lightness (colours look stronger when brighter, Hunt's effect).
pub fn hunt(rgb: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let curve = |t: f32| {
        if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = to_relative_xyz(rgb).map(curve);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// Distance: difference of lightness plus Euclidean distance of chroma.
pub fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_neutral_and_the_round_trip_closes() {
        let [y, cx, cz] = linear_to_opponent([1.0; 3]);
        assert!((y - 100.0).abs() < 1e-3 && cx.abs() < 1e-3 && cz.abs() < 1e-3, "{y} {cx} {cz}");
        for rgb in [[0.2, 0.7, 0.1], [1.0, 0.0, 0.0], [0.0, 0.01, 0.9]] {
            let back = opponent_to_linear(linear_to_opponent(rgb));
            assert!(rgb.iter().zip(back).all(|(a, b)| (a - b).abs() < 2e-5), "{rgb:?} {back:?}");
        }
    }

    /// CIELAB of sRGB red is published as L 53.24, a 80.09, b 67.20.
    #[test]
    fn red_has_its_published_place() {
        let [l, a, b] = hunt([1.0, 0.0, 0.0]);
        assert!((l - 53.24).abs() < 0.01, "{l}");
        assert!((a / (0.01 * l) - 80.09).abs() < 0.02 && (b / (0.01 * l) - 67.20).abs() < 0.02, "{a} {b}");
    }
}
