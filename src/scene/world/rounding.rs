//! What rounding does to points on their way through instances' maps.

use glam::{DAffine3, DMat3, DVec3};

use super::Object;
use crate::lanes::Real;
use crate::scene::assembly::Placement;

/// Powers of two between which maps and coordinates are of ordinary size: products of a few of them are normal numbers
/// in f32.
const ORDINARY: (f64, f64) = (1.0 / (1u64 << 40) as f64, (1u64 << 40) as f64);

/// How much the errors of coordinates grow through the maps of a world's instances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounding {
    /// Largest factor by which the error of a coordinate grows through a map and back, the one way or the other: 1 for
    /// scales along the axes, up to 3 for rotations, the more the flatter the map. Infinite where a map's numbers are
    /// not of ordinary size.
    pub growth: f64,
    /// Largest of: the coordinates that are added up where an instance's points are mapped, times its growth; world units.
    pub reach: f64,
}

impl Rounding {
    /// Of all placements.
    pub fn of<S: Real>(placements: &[Placement], objects: &[Object<S>]) -> Self {
        let mut worst = Self { growth: 1.0, reach: 0.0 };
        for placement in placements {
            let bounds = objects[placement.object as usize].bounds();
            if bounds.is_empty() {
                continue;
            }
            let (lo, hi) = bounds.to_f64();
            let one = Self::through(&placement.to_world, lo.abs().max(hi.abs()));
            worst = Self { growth: worst.growth.max(one.growth), reach: worst.reach.max(one.reach) };
        }
        worst
    }

    /// Of one map for points with components of at most `size`.
    fn through(map: &DAffine3, size: DVec3) -> Self {
        let (m, back) = (absolute(map.matrix3), absolute(map.matrix3.inverse()));
        let norm = |m: DMat3| (m * DVec3::ONE).max_element();
        let sums = (m * size + map.translation.abs()).max_element();
        let ordinary = |x: f64| ORDINARY.0 <= x && x <= ORDINARY.1;
        if !(ordinary(norm(m)) && ordinary(norm(back)) && sums <= ORDINARY.1) {
            return Self { growth: f64::INFINITY, reach: f64::INFINITY };
        }
        let growth = norm(m * back).max(norm(back * m));
        Self { growth, reach: growth * sums }
    }
}

fn absolute(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_by_hand() {
        let through = |m: DAffine3| Rounding::through(&m, DVec3::ONE);
        let stretched = DAffine3::from_scale(DVec3::new(1.0, 100.0, 0.01));
        assert!((through(stretched).growth - 1.0).abs() < 1e-14);
        // A quarter turn moves components, an eighth mixes two of them: (c + c)^2 = 2.
        assert!((through(DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_2)).growth - 1.0).abs() < 1e-14);
        let eighth =
            DAffine3::from_translation(DVec3::X * 7.0) * DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_4);
        assert!((through(eighth).growth - 2.0).abs() < 1e-14);
        assert!((through(eighth).reach - 2.0 * (7.0 + 2f64.sqrt())).abs() < 1e-13);
        // x + 10 y and back x - 10 y: 1 + 10 (1 + ..) adds up to 1 + 20.
        let mut sheared = DAffine3::IDENTITY;
        sheared.matrix3.y_axis.x = 10.0;
        assert!((through(sheared).growth - 21.0).abs() < 1e-12);
        let tiny = DAffine3::from_scale(DVec3::splat(1e-13));
        assert_eq!(through(tiny).growth, f64::INFINITY);
        assert_eq!(through(DAffine3::from_translation(DVec3::X * 1e13)).reach, f64::INFINITY);
    }
}
