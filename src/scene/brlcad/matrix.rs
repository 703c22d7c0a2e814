//! Matrices of members: 16 numbers, row by row, for column vectors; the last is a divisor of all.

use glam::{DAffine3, DMat3, DVec3};

/// A perspective row smaller than this, relative to the divisor, is what single precision left of zeros: ignored.
const PERSPECTIVE_NOISE: f64 = 1e-6;

/// The map that `m` means; `None` stands for the identity.
///
/// # Errors
/// What is wrong with it: a perspective row, a zero divisor, numbers too large.
pub(super) fn affine(m: &[f64; 16]) -> Result<Option<Box<DAffine3>>, String> {
    if m[12..15].iter().any(|&x| x.abs() > PERSPECTIVE_NOISE * m[15].abs()) {
        return Err("expected 0 0 0 in the last row of a matrix (perspective is not supported)".into());
    }
    if m[15] == 0.0 {
        return Err("the matrix divides by zero: its last number is 0".into());
    }
    let row = |r: usize| DVec3::new(m[4 * r], m[4 * r + 1], m[4 * r + 2]) / m[15];
    let matrix3 = DMat3::from_cols(row(0), row(1), row(2)).transpose();
    let map = DAffine3 { matrix3, translation: DVec3::new(m[3], m[7], m[11]) / m[15] };
    if !map.is_finite() {
        return Err("the matrix overflows".into());
    }
    Ok((map != DAffine3::IDENTITY).then(|| Box::new(map)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_rows_and_the_last_number_divides() {
        // x' = (2y + 10) / 2, y' = (-4x) / 2, z' = (z + 6) / 2.
        let m = [0.0, 2.0, 0.0, 10.0, -4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 6.0, 0.0, 0.0, 0.0, 2.0];
        let map = affine(&m).unwrap().unwrap();
        assert_eq!(map.transform_point3(DVec3::new(1.0, 2.0, 4.0)), DVec3::new(7.0, -2.0, 5.0));
        assert_eq!(map.transform_vector3(DVec3::new(1.0, 2.0, 4.0)), DVec3::new(2.0, -2.0, 2.0));
    }

    #[test]
    fn the_identity_is_none_and_impossible_ones_are_refused() {
        let mut m = [0.0; 16];
        (m[0], m[5], m[10], m[15]) = (1.0, 1.0, 1.0, 1.0);
        assert_eq!(affine(&m), Ok(None));
        m[15] = 0.0;
        assert!(affine(&m).is_err());
        (m[15], m[13]) = (1.0, 0.5);
        assert!(affine(&m).is_err());
        m[13] = 1e-9;
        assert_eq!(affine(&m), Ok(None));
        (m[13], m[0], m[15]) = (0.0, 1e300, 1e-300);
        assert!(affine(&m).is_err());
    }
}
