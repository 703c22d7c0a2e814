//! Affine maps applied to lanes of rays: a point maps with w = 1, a direction with w = 0, so `t` is the same
//! number on both sides; normals map by the inverse transpose (Turkowski, "Properties of surface-normal
//! transformations", Graphics Gems, 1990).

use glam::{DAffine3, DMat3, DVec3};

use crate::lanes::{Lanes, Lanes3, Real, map3};

/// Three rows of four: `x' = r[0] * x + r[1] * y + r[2] * z + r[3]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine<S> {
    /// Rows.
    pub rows: [[S; 4]; 3],
}

impl<S: Real> Affine<S> {
    /// The map rounded to `S`.
    pub fn from_f64(m: &DAffine3) -> Self {
        let columns = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis, m.translation];
        Self { rows: [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| S::from_f64(columns[column][row]))) }
    }

    /// Points, `N` at a time.
    #[inline(always)]
    pub fn points<V: Lanes<Scalar = S>>(&self, p: Lanes3<V>) -> Lanes3<V> {
        map3(self.rows, |[x, y, z, w]| {
            V::splat(x).mul_add(p[0], V::splat(y).mul_add(p[1], V::splat(z).mul_add(p[2], V::splat(w))))
        })
    }

    /// Directions, `N` at a time.
    #[inline(always)]
    pub fn vectors<V: Lanes<Scalar = S>>(&self, d: Lanes3<V>) -> Lanes3<V> {
        map3(self.rows, |[x, y, z, _]| V::splat(x).mul_add(d[0], V::splat(y).mul_add(d[1], V::splat(z) * d[2])))
    }
}

/// How a map takes normals: by its inverse transpose.
#[derive(Clone, Copy, Debug)]
pub struct NormalMap {
    /// Columns of the inverse transpose times the determinant's size; it exists for singular maps too.
    cofactor: [DVec3; 3],
    /// -1 for mirroring maps, which turn the cofactor matrix inside out.
    sign: f64,
}

impl NormalMap {
    /// Of the map `to_world`.
    pub fn new(to_world: &DAffine3) -> Self {
        let m = to_world.matrix3;
        let cofactor = [m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)];
        Self { cofactor, sign: m.determinant().signum() }
    }

    /// The inverse transpose, times the determinant's size.
    pub fn matrix(&self) -> DMat3 {
        let [x, y, z] = self.cofactor;
        DMat3::from_cols(x, y, z) * self.sign
    }

    /// A normal of the local space in the world, made unit. A zero or non-finite result (degenerate input) comes back as
    /// zero.
    #[inline]
    pub fn apply(&self, local: DVec3) -> DVec3 {
        let n = self.cofactor[0] * local.x + self.cofactor[1] * local.y + self.cofactor[2] * local.z;
        (n * self.sign).normalize_or_zero()
    }
}

/// A normal of the local space in the world: [`NormalMap`] for a single one.
pub fn normal_to_world(to_world: &DAffine3, local: DVec3) -> DVec3 {
    NormalMap::new(to_world).apply(local)
}

/// The box of a box's image under `m` (Arvo, "Transforming axis-aligned bounding boxes", Graphics Gems, 1990).
/// Infinite bounds stay infinite.
pub fn transformed_bounds(m: &DAffine3, lo: DVec3, hi: DVec3) -> (DVec3, DVec3) {
    let (mut out_lo, mut out_hi) = (m.translation, m.translation);
    for (axis, column) in [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis].into_iter().enumerate() {
        // A zero entry times an infinite bound contributes nothing, not NaN.
        let scaled = |bound: f64| DVec3::from_array(column.to_array().map(|c| if c == 0.0 { 0.0 } else { c * bound }));
        let (a, b) = (scaled(lo[axis]), scaled(hi[axis]));
        out_lo += a.min(b);
        out_hi += a.max(b);
    }
    (out_lo, out_hi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DQuat};

    fn sheared() -> DAffine3 {
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.7, 1.0, 0.0), DVec3::new(-0.2, 0.4, 2.0));
        let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.8));
        DAffine3 { matrix3: turn * shear, translation: DVec3::new(3.0, -1.0, 2.0) }
    }

    #[test]
    fn normals_stay_perpendicular_under_shear() {
        let m = sheared();
        let n = DVec3::new(0.3, -0.5, 0.8).normalize();
        let (a, b) = n.any_orthonormal_pair();
        for map in [m, m * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))] {
            let world = normal_to_world(&map, n);
            assert!((world.length() - 1.0).abs() < 1e-12);
            assert!(world.dot(map.transform_vector3(a)).abs() < 1e-12);
            assert!(world.dot(map.transform_vector3(b)).abs() < 1e-12);
            // Outward stays outward, also when the map mirrors.
            assert!(world.dot(map.transform_vector3(n)) > 0.0);
        }
    }

    #[test]
    fn lanes_map_like_glam() {
        let m = sheared();
        let a = Affine::<f64>::from_f64(&m);
        let (p, want) = (DVec3::new(0.1, 0.2, -5.0), m.transform_point3(DVec3::new(0.1, 0.2, -5.0)));
        let got = a.points(p.to_array());
        assert!((DVec3::from_array(got) - want).length() < 1e-14);
        let got = a.vectors(p.to_array());
        assert!((DVec3::from_array(got) - m.transform_vector3(p)).length() < 1e-14);
    }

    #[test]
    fn transformed_bounds_contain_the_corners_and_keep_infinity() {
        let m = sheared();
        let (lo, hi) = (DVec3::new(-1.0, -2.0, 0.0), DVec3::new(1.0, 0.5, 3.0));
        let (out_lo, out_hi) = transformed_bounds(&m, lo, hi);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
            let p = m.transform_point3(DVec3::new(pick(0), pick(1), pick(2)));
            assert!(p.cmpge(out_lo - 1e-12).all() && p.cmple(out_hi + 1e-12).all());
        }
        let (lo, hi) =
            transformed_bounds(&DAffine3::from_scale(DVec3::new(2.0, 3.0, 4.0)), DVec3::NEG_INFINITY, DVec3::INFINITY);
        assert!(lo == DVec3::NEG_INFINITY && hi == DVec3::INFINITY);
    }
}
