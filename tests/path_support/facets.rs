//! Rough surfaces by integrals over their facets, in plain f64: an independent way to what a furnace shows.
//!
//! Source: B. Walter and others, *Microfacet Models for Refraction through Rough Surfaces*, 2007. Facets of GGX have
//! tan^2 = alpha^2 u / (1 - u) for uniform u, weighted by their projected area; light that meets a facet is
//! mirrored or refracted as at a smooth boundary, and what the height-correlated masking of E. Heitz, 2014, leaves
//! of it gets away.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// Midpoints per axis of integrals.
const STEPS: u32 = 1000;

/// Share of unpolarised light that glass mirrors at cosine `cos`; `eta` is the index behind over that before it.
/// By the angles, not by the cosines' algebra.
pub fn glass(cos: f64, eta: f64) -> f64 {
    let sin_t = (1.0 - cos * cos).max(0.0).sqrt() / eta;
    if sin_t >= 1.0 {
        return 1.0;
    }
    let (i, t) = (cos.clamp(0.0, 1.0).acos(), sin_t.asin());
    if i < 1e-6 {
        return ((eta - 1.0) / (eta + 1.0)).powi(2);
    }
    let s = (i - t).sin() / (i + t).sin();
    let p = (i - t).tan() / (i + t).tan();
    0.5 * (s * s + p * p)
}

/// The same of a metal of index eta + i k, by complex arithmetic.
pub fn metal(cos: f64, eta: f64, k: f64) -> f64 {
    // n^2 - sin^2 and its root.
    let (re, im) = (eta * eta - k * k - (1.0 - cos * cos), 2.0 * eta * k);
    let size = re.hypot(im);
    let root = (((size + re) / 2.0).sqrt(), ((size - re) / 2.0).max(0.0).sqrt());
    let square_of_ratio = |a: (f64, f64), b: (f64, f64)| {
        ((a.0 - b.0).powi(2) + (a.1 - b.1).powi(2)) / ((a.0 + b.0).powi(2) + (a.1 + b.1).powi(2))
    };
    let n2 = (eta * eta - k * k, 2.0 * eta * k);
    let s = square_of_ratio((cos, 0.0), root);
    let p = square_of_ratio((n2.0 * cos, n2.1 * cos), root);
    0.5 * (s + p)
}

/// C. Schlick's approximation.
pub fn schlick(cos: f64, f0: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cos).max(0.0).powi(5)
}

fn lambda(w: DVec3, alpha: f64) -> f64 {
    let tan = w.x.hypot(w.y) / w.z.abs();
    0.5 * ((1.0 + (alpha * tan).powi(2)).sqrt() - 1.0)
}

/// Share of light seen from `out` that leaves towards facets' mirror directions (`eta` None) or is refracted into
/// the index `eta`, of which `kept` at the facet's cosine is kept.
fn by_facets(out: DVec3, alpha: f64, eta: Option<f64>, kept: &dyn Fn(f64) -> f64) -> f64 {
    let mut sum = 0.0;
    for a in 0..STEPS {
        // u = 1 - s^2 takes the grazing facets' weight of 1 / z away.
        let s = (f64::from(a) + 0.5) / f64::from(STEPS);
        let tan = alpha * (1.0 - s * s).sqrt() / s;
        let z = 1.0 / tan.hypot(1.0);
        for b in 0..STEPS {
            let (sin, cos) = (TAU * (f64::from(b) + 0.5) / f64::from(STEPS)).sin_cos();
            let facet = DVec3::new(tan * z * cos, tan * z * sin, z);
            let meets = out.dot(facet);
            if meets <= 0.0 {
                continue;
            }
            let away = match eta {
                None => facet * (2.0 * meets) - out,
                Some(eta) => {
                    let cos2 = 1.0 - (1.0 - meets * meets) / (eta * eta);
                    if cos2 <= 0.0 {
                        continue;
                    }
                    facet * (meets / eta - cos2.sqrt()) - out / eta
                }
            };
            if eta.is_none() != (away.z > 0.0) {
                continue;
            }
            let masking = 1.0 / (1.0 + lambda(out, alpha) + lambda(away, alpha));
            sum += kept(meets) * masking * meets / (out.z * z) * 2.0 * s;
        }
    }
    sum / f64::from(STEPS * STEPS)
}

/// Directional albedo of facets that mirror the share `kept` of the cosine.
pub fn mirrored(out: DVec3, alpha: f64, kept: impl Fn(f64) -> f64) -> f64 {
    by_facets(out, alpha, None, &kept)
}

/// Share of light refracted through facets into index `eta`, of which `kept` of the cosine passes.
pub fn refracted(out: DVec3, alpha: f64, eta: f64, kept: impl Fn(f64) -> f64) -> f64 {
    by_facets(out, alpha, Some(eta), &kept)
}

/// Mean of `f` over directions of the upper hemisphere, weighted by the cosine.
pub fn cosine_mean(f: impl Fn(DVec3) -> f64) -> f64 {
    let mut sum = 0.0;
    for a in 0..STEPS {
        let square = (f64::from(a) + 0.5) / f64::from(STEPS);
        for b in 0..STEPS / 4 {
            let (sin, cos) = (TAU * (f64::from(b) + 0.5) / f64::from(STEPS / 4)).sin_cos();
            let r = square.sqrt();
            sum += f(DVec3::new(r * cos, r * sin, (1.0 - square).sqrt()));
        }
    }
    sum / f64::from(STEPS * (STEPS / 4))
}

/// Mean over the hemisphere, weighted by the cosine, of [`mirrored`].
pub fn mirrored_mean(alpha: f64, kept: impl Fn(f64) -> f64) -> f64 {
    const PARTS: u32 = 24;
    let at = |i: u32| {
        let z = ((f64::from(i) + 0.5) / f64::from(PARTS)).sqrt();
        mirrored(DVec3::new((1.0 - z * z).sqrt(), 0.0, z), alpha, &kept)
    };
    (0..PARTS).map(at).sum::<f64>() / f64::from(PARTS)
}

/// Share of light lost by one facet that many give back, if they mirror the mean share `f` and perfect ones would give
/// back the mean share `once`: f^2 E / (1 - f (1 - E)).
pub fn repeated(f: f64, once: f64) -> f64 {
    f * f * once / (1.0 - f * (1.0 - once))
}

/// Light from `from` to `out` by GGX facets that mirror all of it: f times the cosine of `from`.
pub fn value(out: DVec3, from: DVec3, alpha: f64) -> f64 {
    let half = (out + from).normalize();
    let tan2 = (half.x * half.x + half.y * half.y) / (half.z * half.z);
    let density = 1.0 / (PI * (alpha * half.z * half.z * (1.0 + tan2 / (alpha * alpha))).powi(2));
    let masking = 1.0 / (1.0 + lambda(out, alpha) + lambda(from, alpha));
    density * masking / (4.0 * out.z)
}
