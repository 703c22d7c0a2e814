//! The tile's own coordinates: seen from the common point, with the mean direction as depth axis.
//!
//! A ray becomes two numbers (s, t) = (d.u, d.v) / (d.a), a point P becomes (x, y, z) = (P.u, P.v, P.a), and the ray
//! passes the point where x = s z and y = t z. Any three independent axes would do: rays and triangles go through
//! the same map, so only the rounding of the map matters, not how perpendicular its axes are. That is also how tiles go
//! through instances ([`super::place`]).

use glam::{DAffine3, DVec3};

use super::bundle::{Bundle, Source};
use super::parallel::Parallel;
use super::{Mask, SET, V, select};
use crate::lanes::{LaneMask, Lanes, Lanes3, dot, each, map3};
use crate::math::Aabb;
use crate::ray::Rays;

/// Scales of scenes the tile's arithmetic is made for: products of three coordinates, scaled, stay normal numbers.
const EXPONENTS: std::ops::RangeInclusive<i32> = -60..=60;

/// Axes u, v, a (scaled so that the scene is about unit size) around the common point.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame {
    /// Origin of the frame, in the space of the geometry.
    pub apex: [f32; 3],
    /// Right, up, depth.
    pub axes: [[f32; 3]; 3],
    /// Power of two that the axes carry (in world space).
    pub scale: f32,
    /// Largest coordinate of the scene as seen from the apex, any axis, before scaling.
    pub extent: f32,
    /// Of rays of one direction.
    pub parallel: Option<Parallel>,
}

impl Frame {
    /// The frame of some groups of a bundle that looks at geometry within `bounds`; `None` if the scale is out of
    /// range or the directions cancel.
    #[inline(always)]
    pub fn of<const N: usize>(bundle: &Bundle, groups: u64, bounds: &Aabb<f32>) -> Option<Self> {
        let apex = bundle.apex;
        let extent = reach(bounds, apex);
        let exponent = exponent(extent).filter(|exponent| EXPONENTS.contains(exponent))?;
        let scale = f32::from_bits(((127 - exponent) as u32) << 23);
        let parallel = None;
        let rays = match bundle.source {
            Source::Batch(rays) => rays,
            Source::Pencil(pencil, [s, t]) => {
                let [u, v, a] = pencil.axes;
                let axes = [each(|x| u[x] - s * a[x]), each(|x| v[x] - t * a[x]), a];
                let axes = map3(axes, |axis| axis.map(|x| x as f32 * scale));
                return Some(Self { apex, axes, scale, extent, parallel });
            }
        };
        let [sum, across, along] = Self::mean_direction::<N>(bundle, rays, groups);
        if bundle.shared.is_direction() {
            return Self::parallel(bundle, rays, bounds, (scale, extent), [across, along]);
        }
        let a = normalised(sum)?;
        let [u, v] = sides(a, across, along)?;
        let axes = [u, v, a].map(|axis| axis.map(|x| x as f32 * scale));
        Some(Self { apex, axes, scale, extent, parallel })
    }

    /// Sum of unit directions of a sample of the rays, and the same with the left half of the picture negative, and the upper half.
    /// The order of rays in a block (Morton) says what is left and above; where it is another order, nothing but the fit of
    /// the rectangles gets worse.
    #[inline(always)]
    fn mean_direction<const N: usize>(bundle: &Bundle, rays: &Rays<f32>, groups: u64) -> [[f64; 3]; 3] {
        let mut sample: Lanes3<[f32; SET]> = Default::default();
        // One group alone is sampled whole, else one of `N` groups by its first lane.
        let single = groups.is_power_of_two().then(|| groups.trailing_zeros() as usize);
        let mut used = 0;
        for i in 0..SET {
            // Of the `N` groups here the first that is of the tile.
            let here = groups >> (N * i) & ((1 << N) - 1);
            let g = match single {
                Some(g) => g,
                None if here != 0 => N * i + here.trailing_zeros() as usize,
                None => continue,
            };
            let live = bundle.live(rays, g);
            let lane = if single.is_some() { i } else { live.trailing_zeros() as usize & (V::N - 1) };
            if live >> lane & 1 == 0 {
                continue;
            }
            used |= 1 << i;
            let way = bundle.way(rays, g, lane);
            for axis in 0..3 {
                sample[axis][i] = way[axis];
            }
        }
        let sample = map3(sample, V::new);
        let length = dot(sample, sample).sqrt();
        let used = Mask::from_bits(used) & V::constant(0.0).cmp_lt(length);
        let scale = select(used, V::constant(1.0) / length, V::constant(0.0));
        // Number i of sixteen parts of a block has its second bit of x, of a quarter its first one, at i & 4 and i & 1; the bit
        // of y comes next.
        let quarter = groups & (groups - 1) != 0 && (0..4).any(|q| groups & !(0xf << (4 * q)) == 0);
        let bit = if quarter { 1 } else { 4 };
        let unit = map3(sample, |x| select(used, x * scale, V::constant(0.0)).to_array());
        let mut sums = [[0.0f64; 3]; 3];
        for axis in 0..3 {
            for i in 0..SET {
                let x = f64::from(unit[axis][i]);
                sums[0][axis] += x;
                sums[1][axis] += if i & bit == 0 { -x } else { x };
                sums[2][axis] += if i & (2 * bit) == 0 { -x } else { x };
            }
        }
        sums
    }

    /// This frame in the space of an object that `to_world` places: coordinates of points, and so depths, are the same
    /// there. `bounds` is the object's box.
    #[inline(always)]
    pub fn through(&self, to_world: &DAffine3, bounds: &Aabb<f32>) -> Self {
        let m = to_world.matrix3;
        let apex = DVec3::from(self.apex.map(f64::from)) - to_world.translation;
        let apex = (m.inverse() * apex).to_array().map(|x| x as f32);
        let axes = map3(self.axes, |axis| {
            let axis = DVec3::from(axis.map(f64::from));
            [m.x_axis.dot(axis) as f32, m.y_axis.dot(axis) as f32, m.z_axis.dot(axis) as f32]
        });
        Self { apex, axes, scale: self.scale, extent: reach(bounds, apex), parallel: None }
    }

    /// Vectors in this frame.
    #[inline(always)]
    pub fn coordinates<L: Lanes<Scalar = f32>>(&self, d: Lanes3<L>) -> Lanes3<L> {
        map3(self.axes, |axis| dot(d, map3(axis, L::splat)))
    }
}

/// The exponent of a finite length.
fn exponent(extent: f32) -> Option<i32> {
    extent.is_finite().then(|| ((extent.to_bits() >> 23) as i32) - 127)
}

/// Whether the tile's arithmetic is made for geometry within `bounds` as seen from `apex`, whatever rays there are.
pub fn suits(bounds: &Aabb<f32>, apex: [f32; 3]) -> bool {
    exponent(reach(bounds, apex)).is_some_and(|exponent| EXPONENTS.contains(&exponent))
}

/// Largest coordinate of a box as seen from the apex.
#[inline(always)]
pub fn reach(bounds: &Aabb<f32>, apex: [f32; 3]) -> f32 {
    let [x, y, z] = each(|a| (bounds.lo[a] - apex[a]).abs().max((bounds.hi[a] - apex[a]).abs()));
    x.max(y).max(z)
}

/// Unit vectors right and up of the depth axis `a`. A light may see pixels as flat parallelograms: rectangles fit them best along
/// their longer side, of the picture's two.
pub fn sides(a: [f64; 3], across: [f64; 3], along: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    let flat = |r: [f64; 3]| sub(r, a.map(|x| x * dot(r, a)));
    let (across, along) = (flat(across), flat(along));
    let long = if dot(across, across) < dot(along, along) { along } else { across };
    // One direction, or directions on a line through the apex: any perpendicular axis does.
    let u = normalised(long).or_else(|| {
        let other = if a[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        normalised(flat(other))
    })?;
    Some([u, [a[1] * u[2] - a[2] * u[1], a[2] * u[0] - a[0] * u[2], a[0] * u[1] - a[1] * u[0]]])
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A vector of length one; `None` of next to none.
pub fn normalised(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot(v, v).sqrt();
    (length > 1e-6 && f64::MAX > length).then(|| v.map(|x| x / length))
}
