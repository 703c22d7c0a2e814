//! From the unit square to directions, over lanes.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_4};

use crate::lanes::functions::sin_cos_eighth;
use crate::lanes::{Lanes, Lanes3};

/// A uniform point of the unit disc: squares around the centre become circles.
/// Source: P. Shirley, K. Chiu, *A Low Distortion Map Between Disk and Square*, 1997.
#[inline(always)]
pub fn disc<V: Lanes>(u: [V; 2]) -> [V; 2] {
    let (zero, one, two) = (V::constant(0.0), V::constant(1.0), V::constant(2.0));
    let [a, b] = u.map(|x| two.mul_add(x, -one));
    let wide = b.abs().cmp_lt(a.abs());
    let (long, short) = (V::select(wide, a, b), V::select(wide, b, a));
    let centre = long.cmp_eq(zero);
    let angle = V::constant(FRAC_PI_4) * V::select(centre, zero, short / V::select(centre, one, long));
    let (sin, cos) = sin_cos_eighth(angle);
    let (along, across) = (long * cos, long * sin);
    [V::select(wide, along, across), V::select(wide, across, along)]
}

/// A direction of the upper hemisphere, density z / pi (Malley's method).
#[inline(always)]
pub fn cosine<V: Lanes>(u: [V; 2]) -> Lanes3<V> {
    let [x, y] = disc(u);
    let rest = V::constant(1.0) - x.mul_add(x, y * y);
    [x, y, rest.fast_max(V::constant(0.0)).sqrt()]
}

/// A direction of the upper hemisphere whose cosine is about `alpha`, as that of light which facets of this width throw at
/// each other; see [`grazing_pdf`].
#[inline(always)]
pub fn grazing<V: Lanes>(u: [V; 2], alpha: V) -> Lanes3<V> {
    let one = V::constant(1.0);
    let (square, cos, sin) = polar(u);
    // The square of the cosine, from its distribution (1 + a^2) z^2 / (z^2 + a^2) by algebra.
    let width = alpha * alpha;
    let above = (one - square).fast_max(V::constant(0.0));
    let upward = (width * above / (one + width - above)).fast_min(one);
    let aside = (one - upward).sqrt();
    [aside * cos, aside * sin, upward.sqrt()]
}

/// Density of [`grazing`] where the cosine is `z`: that falls with the fourth power of what is far above `alpha`, so what
/// facets lose, which falls with the second, has weights without peaks.
#[inline(always)]
pub fn grazing_pdf<V: Lanes>(z: V, alpha: V) -> V {
    let width = alpha * alpha;
    let near = z.mul_add(z, width);
    width * (V::constant(1.0) + width) * z * V::constant(FRAC_1_PI) / (near * near)
}

/// Radius squared, and cosine and sine of the angle, of [`disc`].
#[inline(always)]
pub fn polar<V: Lanes>(u: [V; 2]) -> (V, V, V) {
    let [x, y] = disc(u);
    let square = x.mul_add(x, y * y);
    let inside = V::constant(1e-30).cmp_lt(square);
    let rcp = V::constant(1.0) / V::select(inside, square, V::constant(1.0)).sqrt();
    (square, V::select(inside, x * rcp, V::constant(1.0)), V::select(inside, y * rcp, V::constant(0.0)))
}
