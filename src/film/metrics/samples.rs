//! Sample by sample: errors, distances in units in the last place, and the classes same, next and beyond.

use crate::film::PlaneData;

/// Added to the squared reference in relative errors, so that black does not divide by nothing.
const RELATIVE_FLOOR: f64 = 0.01;

/// How many samples are the same, one step apart, or farther. For 8-bit levels these are the classes of BRL-CAD's
/// pixcmp: matching, off by one, off by many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Classes {
    /// The same.
    pub exact: u64,
    /// One level, number or unit in the last place apart.
    pub within_one: u64,
    /// Farther apart, or a number against none (NaN).
    pub beyond: u64,
}

impl Classes {
    /// Counts one pair that is `distance` steps apart.
    pub fn add(&mut self, distance: u64) {
        match distance {
            0 => self.exact += 1,
            1 => self.within_one += 1,
            _ => self.beyond += 1,
        }
    }

    /// Samples counted.
    pub fn total(&self) -> u64 {
        self.exact + self.within_one + self.beyond
    }
}

/// Errors summed over pairs of samples; pairs that are not finite are counted apart.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    squared: f64,
    relative: f64,
    max: f64,
    count: u64,
    not_finite: u64,
}

/// What [`Sums`] come to.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Errors {
    /// Root mean squared error.
    pub rmse: f64,
    /// Mean of (b - a)^2 / (a^2 + 0.01) for the reference a. Source of the form: F. Rousselle, C. Knaus, M. Zwicker,
    /// "Adaptive Sampling and Reconstruction using Greedy Error Minimization", 2011.
    pub rel_mse: f64,
    /// Largest error.
    pub max: f64,
    /// Pairs with a NaN or an infinity that is not the same in both; the other figures leave them out.
    pub not_finite: u64,
}

impl Sums {
    /// Adds the pair of a reference and what is compared with it.
    pub fn add(&mut self, reference: f64, value: f64) {
        if reference == value || reference.is_nan() && value.is_nan() {
            self.count += 1;
        } else if reference.is_finite() && value.is_finite() {
            let error = (value - reference).abs();
            self.squared += error * error;
            self.relative += error * error / (reference * reference + RELATIVE_FLOOR);
            self.max = self.max.max(error);
            self.count += 1;
        } else {
            self.not_finite += 1;
        }
    }

    /// Mean squared error.
    pub fn mean_squared(&self) -> f64 {
        self.squared / self.count.max(1) as f64
    }

    /// The figures.
    pub fn errors(&self) -> Errors {
        let Self { max, not_finite, .. } = *self;
        let rel_mse = self.relative / self.count.max(1) as f64;
        Errors { rmse: self.mean_squared().sqrt(), rel_mse, max, not_finite }
    }
}

/// Two planes of one name.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PlaneDifference {
    /// Name of the plane.
    pub name: String,
    /// Errors in the plane's own unit.
    #[serde(flatten)]
    pub errors: Errors,
    /// Largest distance: representable f32 between the two, or for numbers (ids) and levels their difference.
    pub max_ulp: u64,
    /// Counts by distance.
    pub classes: Classes,
}

/// Compares two planes of the same length sample by sample; `None` if they hold different kinds, or if their lengths
/// differ.
pub fn plane_difference(name: &str, a: &PlaneData, b: &PlaneData) -> Option<PlaneDifference> {
    if a.len() != b.len() {
        return None;
    }
    let (mut sums, mut classes, mut max_ulp) = (Sums::default(), Classes::default(), 0);
    let mut add = |x: f64, y: f64, distance: u64| {
        sums.add(x, y);
        classes.add(distance);
        max_ulp = max_ulp.max(distance);
    };
    match (a, b) {
        (PlaneData::F32(a), PlaneData::F32(b)) => {
            a.iter().zip(b).for_each(|(&x, &y)| add(x.into(), y.into(), ulp_distance(x, y)));
        }
        (PlaneData::U32(a), PlaneData::U32(b)) => {
            a.iter().zip(b).for_each(|(&x, &y)| add(x.into(), y.into(), x.abs_diff(y).into()));
        }
        (PlaneData::U8(a), PlaneData::U8(b)) => {
            a.iter().zip(b).for_each(|(&x, &y)| add(x.into(), y.into(), x.abs_diff(y).into()));
        }
        _ => return None,
    }
    Some(PlaneDifference { name: name.into(), errors: sums.errors(), max_ulp, classes })
}

/// How many steps from one representable number to the next lead from `a` to `b`; 0 for -0 and 0 and for two NaN,
/// `u32::MAX` for a number and a NaN.
pub fn ulp_distance(a: f32, b: f32) -> u64 {
    match (a.is_nan(), b.is_nan()) {
        (true, true) => 0,
        (false, false) => place(a).abs_diff(place(b)),
        _ => u32::MAX.into(),
    }
}

/// Number of a float in the order of all floats; both zeros are 0.
fn place(x: f32) -> i64 {
    let size = i64::from(x.to_bits() & 0x7fff_ffff);
    if x.is_sign_negative() { -size } else { size }
}

/// Classes of two lists of 8-bit samples; missing ones are beyond.
pub fn level_classes(a: &[u8], b: &[u8]) -> Classes {
    let mut classes = Classes { beyond: a.len().abs_diff(b.len()) as u64, ..Default::default() };
    a.iter().zip(b).for_each(|(x, y)| classes.add(x.abs_diff(*y).into()));
    classes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_count_representable_numbers() {
        assert_eq!(ulp_distance(1.0, 1.0 + f32::EPSILON), 1);
        assert_eq!(ulp_distance(1.0, 1.0 - f32::EPSILON / 2.0), 1);
        assert_eq!(ulp_distance(0.0, -0.0), 0);
        // The smallest numbers on either side of zero.
        assert_eq!(ulp_distance(f32::from_bits(1), -f32::from_bits(1)), 2);
        assert_eq!(ulp_distance(f32::MAX, f32::INFINITY), 1);
        assert_eq!((ulp_distance(f32::NAN, f32::NAN), ulp_distance(f32::NAN, 0.0)), (0, u64::from(u32::MAX)));
        // From 1 to 2 there are 2^23 steps.
        assert_eq!(ulp_distance(-1.0, -2.0), 1 << 23);
    }

    /// Errors 0, 1, -2 and one pair without a number: MSE 5/3; relative 1/1.01 and 4/0.01 over three.
    #[test]
    fn errors_by_hand() {
        let a = PlaneData::F32(vec![3.0, 1.0, 0.0, f32::INFINITY]);
        let b = PlaneData::F32(vec![3.0, 2.0, -2.0, 4.0]);
        let d = plane_difference("Z", &a, &b).unwrap();
        assert!((d.errors.rmse - (5.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((d.errors.rel_mse - (1.0 / 1.01 + 400.0) / 3.0).abs() < 1e-9);
        assert_eq!((d.errors.max, d.errors.not_finite), (2.0, 1));
        assert_eq!(d.classes, Classes { exact: 1, within_one: 0, beyond: 3 });
        assert!(plane_difference("Z", &a, &PlaneData::U32(vec![0; 4])).is_none());
        assert!(plane_difference("Z", &a, &PlaneData::F32(vec![0.0; 3])).is_none());
    }

    #[test]
    fn numbers_and_levels_have_classes() {
        let ids = |v: &[u32]| PlaneData::U32(v.to_vec());
        let d = plane_difference("id", &ids(&[1, 5, u32::MAX]), &ids(&[1, 6, 0])).unwrap();
        assert_eq!((d.classes, d.max_ulp), (Classes { exact: 1, within_one: 1, beyond: 1 }, u64::from(u32::MAX)));
        let classes = level_classes(&[0, 10, 255, 7], &[0, 11, 253]);
        assert_eq!((classes, classes.total()), (Classes { exact: 1, within_one: 1, beyond: 2 }, 4));
    }
}
