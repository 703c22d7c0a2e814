//! Axis-aligned boxes that never lose a point to rounding.

use glam::DVec3;

use crate::lanes::Real;

/// A closed box; empty when `lo > hi` on some axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb<S> {
    /// Lower corner.
    pub lo: [S; 3],
    /// Upper corner.
    pub hi: [S; 3],
}

impl<S: Real> Aabb<S> {
    /// The empty box: contains nothing, neutral for [`Aabb::union`].
    pub const EMPTY: Self = Self { lo: [S::INFINITY; 3], hi: [S::LOWEST; 3] };

    /// All of space.
    pub const EVERYTHING: Self = Self { lo: [S::LOWEST; 3], hi: [S::INFINITY; 3] };

    /// The smallest box in `S` that contains the f64 box `lo..hi` (rounded outwards).
    pub fn enclosing(lo: DVec3, hi: DVec3) -> Self {
        let down = |x: f64| {
            let r = S::from_f64(x);
            if r.to_f64() > x { r.next_down() } else { r }
        };
        let up = |x: f64| {
            let r = S::from_f64(x);
            if r.to_f64() < x { r.next_up() } else { r }
        };
        Self { lo: lo.to_array().map(down), hi: hi.to_array().map(up) }
    }

    /// The box of some points.
    pub fn of_points(points: &[[S; 3]]) -> Self {
        points.iter().fold(Self::EMPTY, |b, p| b.union(&Self { lo: *p, hi: *p }))
    }

    /// The smallest box that contains both.
    pub fn union(&self, other: &Self) -> Self {
        let pick = |a: [S; 3], b: [S; 3], f: fn(S, S) -> S| [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])];
        Self { lo: pick(self.lo, other.lo, S::fast_min), hi: pick(self.hi, other.hi, S::fast_max) }
    }

    /// Whether there is no point in it.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|a| self.lo[a] > self.hi[a])
    }

    /// Whether all six bounds are finite.
    pub fn is_bounded(&self) -> bool {
        self.lo.iter().chain(&self.hi).all(|x| x.is_finite())
    }

    /// Whether `other` lies inside (an empty box lies in every box).
    pub fn contains(&self, other: &Self) -> bool {
        other.is_empty() || (0..3).all(|a| self.lo[a] <= other.lo[a] && other.hi[a] <= self.hi[a])
    }

    /// Half the surface area, in f64 (0 for an empty box).
    pub fn half_area(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let [x, y, z] = [0, 1, 2].map(|a| self.hi[a].to_f64() - self.lo[a].to_f64());
        x * y + y * z + z * x
    }

    /// Corners in f64.
    pub fn to_f64(&self) -> (DVec3, DVec3) {
        (DVec3::from_array(self.lo.map(Real::to_f64)), DVec3::from_array(self.hi.map(Real::to_f64)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enclosing_rounds_outwards() {
        let third = DVec3::splat(1.0 / 3.0);
        let b = Aabb::<f32>::enclosing(third, third);
        let (lo, hi) = b.to_f64();
        assert!(lo.x < third.x && third.x < hi.x);
        assert_eq!(b.lo[0].next_up(), b.hi[0]);
        assert_eq!(Aabb::<f64>::enclosing(third, third).lo, [1.0 / 3.0; 3]);
    }

    #[test]
    fn union_and_area() {
        let a = Aabb::<f64>::of_points(&[[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]);
        assert_eq!(a.half_area(), 2.0 + 6.0 + 3.0);
        assert_eq!(a.union(&Aabb::EMPTY), a);
        assert!(Aabb::<f64>::EMPTY.is_empty() && a.contains(&Aabb::EMPTY) && Aabb::EVERYTHING.contains(&a));
        assert!(a.is_bounded() && !Aabb::<f32>::EVERYTHING.is_bounded());
    }
}
