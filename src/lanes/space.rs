//! Vectors of space over lanes.

use super::{Lanes, Lanes3, dot, map3};

/// Sum.
#[inline(always)]
pub fn add<V: Lanes>(a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Difference.
#[inline(always)]
pub fn sub<V: Lanes>(a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Product component by component.
#[inline(always)]
pub fn times<V: Lanes>(a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

/// `a` times the number `s`.
#[inline(always)]
pub fn scale<V: Lanes>(a: Lanes3<V>, s: V) -> Lanes3<V> {
    map3(a, |x| x * s)
}

/// `a` where the mask is set, else `b`.
#[inline(always)]
pub fn choose<V: Lanes>(mask: V::Mask, a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    [V::select(mask, a[0], b[0]), V::select(mask, a[1], b[1]), V::select(mask, a[2], b[2])]
}

/// Cross product, unfused: exactly antisymmetric.
#[inline(always)]
pub fn cross<V: Lanes>(a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a` made unit; NaN for a zero vector.
#[inline(always)]
pub fn normalize<V: Lanes>(a: Lanes3<V>) -> Lanes3<V> {
    scale(a, V::constant(1.0) / dot(a, a).sqrt())
}

/// An orthonormal frame around a unit normal: local z is the normal.
#[derive(Clone, Copy, Debug)]
pub struct Frame<V> {
    tangent: Lanes3<V>,
    bitangent: Lanes3<V>,
    normal: Lanes3<V>,
}

impl<V: Lanes> Frame<V> {
    /// The frame around `n`.
    /// Source: Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin, *Building an Orthonormal Basis,
    /// Revisited*, JCGT 6(1), 2017.
    #[inline(always)]
    pub fn new(n: Lanes3<V>) -> Self {
        let one = V::constant(1.0);
        let sign = V::select(n[2].cmp_lt(V::constant(0.0)), -one, one);
        let a = -one / (sign + n[2]);
        let b = n[0] * n[1] * a;
        Self {
            tangent: [one + sign * n[0] * n[0] * a, sign * b, -(sign * n[0])],
            bitangent: [b, sign + n[1] * n[1] * a, -n[1]],
            normal: n,
        }
    }

    /// World to local.
    #[inline(always)]
    pub fn to_local(&self, w: Lanes3<V>) -> Lanes3<V> {
        [dot(w, self.tangent), dot(w, self.bitangent), dot(w, self.normal)]
    }

    /// Local to world.
    #[inline(always)]
    pub fn to_world(&self, l: Lanes3<V>) -> Lanes3<V> {
        let (t, b, n) = (self.tangent, self.bitangent, self.normal);
        [0, 1, 2].map(|i| l[2].mul_add(n[i], l[1].mul_add(b[i], l[0] * t[i])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::f64x4;

    #[test]
    fn frames_are_orthonormal_and_invert() {
        for n in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, -0.8, 0.0], [1e-9, 0.0, -1.0]] {
            let frame = Frame::new(n);
            let v = [0.3, -0.5, 0.7];
            let back = frame.to_world(frame.to_local(v));
            assert!((0..3).all(|i| (back[i] - v[i]).abs() < 1e-12), "{n:?}");
            assert_eq!(frame.to_world([0.0, 0.0, 1.0]), n);
        }
        let wide = Frame::<f64x4>::new([0.6, -0.8, 0.0].map(Lanes::splat));
        let one = Frame::<f64>::new([0.6, -0.8, 0.0]);
        let v = [0.1, 0.2, 0.3];
        assert_eq!(wide.to_world(v.map(Lanes::splat)).map(|x| x.lane(3)), one.to_world(v));
    }
}
