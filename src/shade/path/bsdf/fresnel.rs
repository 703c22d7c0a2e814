//! How much a boundary reflects.

use crate::lanes::{Lanes, Lanes3};

/// Share that a dielectric boundary reflects of unpolarised light that meets it at cosine `cos` (>= 0); `eta` is the
/// index of refraction behind the boundary over that before it. Also the cosine of the refracted light; with total
/// reflection 1 and 0.
#[inline(always)]
pub fn dielectric<V: Lanes>(cos: V, eta: V) -> (V, V) {
    let (zero, one) = (V::constant(0.0), V::constant(1.0));
    let sin2 = (one - cos * cos) / (eta * eta);
    let total = one.cmp_le(sin2);
    let cos_t = (one - sin2).fast_max(zero).sqrt();
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
    let half = V::constant(0.5) * parallel.mul_add(parallel, perpendicular * perpendicular);
    (V::select(total, one, half), V::select(total, zero, cos_t))
}

/// The same of a metal with the complex index of refraction eta + i k, one colour.
/// Source: M. Born, E. Wolf, *Principles of Optics*, section 14.2.
#[inline(always)]
pub fn conductor<V: Lanes>(cos: V, eta: V, k: V) -> V {
    let (zero, two, one) = (V::constant(0.0), V::constant(2.0), V::constant(1.0));
    let cos2 = cos * cos;
    let sin2 = one - cos2;
    let (eta2, k2) = (eta * eta, k * k);
    let t0 = eta2 - k2 - sin2;
    let a2b2 = (t0 * t0 + V::constant(4.0) * eta2 * k2).sqrt();
    let t1 = a2b2 + cos2;
    let a = (V::constant(0.5) * (a2b2 + t0)).fast_max(zero).sqrt();
    let t2 = two * cos * a;
    let rs = (t1 - t2) / (t1 + t2);
    let t3 = cos2 * a2b2 + sin2 * sin2;
    let t4 = t2 * sin2;
    let rp = rs * (t3 - t4) / (t3 + t4);
    V::constant(0.5) * (rp + rs)
}

/// C. Schlick's approximation from the reflectance `f0` at normal incidence (*An Inexpensive BRDF Model for
/// Physically-based Rendering*, 1994).
#[inline(always)]
pub fn schlick<V: Lanes>(cos: V, f0: Lanes3<V>) -> Lanes3<V> {
    let one = V::constant(1.0);
    let m = (one - cos).fast_max(V::constant(0.0));
    let m2 = m * m;
    let m5 = m2 * m2 * m;
    f0.map(|f| m5.mul_add(one - f, f))
}

/// Mean over the hemisphere, weighted by the cosine, of `f` of the cosine, by Gauss's midpoint rule in its square.
pub fn mean(f: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 4096;
    let at = |i: u32| f(((f64::from(i) + 0.5) / f64::from(STEPS)).sqrt());
    (0..STEPS).map(at).sum::<f64>() / f64::from(STEPS)
}

/// The same of what a dielectric boundary reflects (see [`dielectric`]).
pub fn dielectric_mean(eta: f64) -> f64 {
    mean(|cos| dielectric(cos, eta).0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Glass of 1.5: 4 % at 0 degrees; at 45 and 80 degrees by the formulas in sines and tangents.
    #[test]
    fn dielectrics_by_the_angles() {
        assert!((dielectric(1.0, 1.5f64).0 - 0.04).abs() < 1e-15);
        for degrees in [45f64, 80.0] {
            let i = degrees.to_radians();
            let t = (i.sin() / 1.5).asin();
            let s = ((i - t).sin() / (i + t).sin()).powi(2);
            let p = ((i - t).tan() / (i + t).tan()).powi(2);
            let (f, cos_t) = dielectric(i.cos(), 1.5);
            assert!((f - 0.5 * (s + p)).abs() < 1e-14 && (cos_t - t.cos()).abs() < 1e-14);
        }
        let (f, cos_t) = dielectric(60f64.to_radians().cos(), 1.0 / 1.5);
        assert_eq!((f, cos_t), (1.0, 0.0), "total reflection beyond 41.8 degrees");
        assert!(dielectric(0.3, 1.0f64).0 < 1e-30, "no boundary, no reflection");
    }

    #[test]
    fn conductors_at_normal_incidence_and_without_absorption() {
        let (eta, k) = (0.2f64, 3.9);
        let normal = ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        assert!((conductor(1.0, eta, k) - normal).abs() < 1e-14);
        for cos in [0.1, 0.5, 0.9] {
            assert!((conductor(cos, 1.5, 0.0f64) - dielectric(cos, 1.5).0).abs() < 1e-12);
        }
        assert!((conductor(0.0, eta, k) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn means() {
        assert!(dielectric_mean(1.0).abs() < 1e-12);
        // Tabulated: 0.0918 into glass of 1.5, 0.5963 out of it (W. Egan, T. Hilgeman, Optical Properties of
        // Inhomogeneous Materials, 1979, give 0.5963; the other follows by 1 - (1 - F_in) eta^-2).
        assert!((dielectric_mean(1.5) - 0.0918).abs() < 1e-4);
        let inside = 1.0 - (1.0 - dielectric_mean(1.5)) / 2.25;
        assert!((dielectric_mean(1.0 / 1.5) - inside).abs() < 1e-3);
    }
}
