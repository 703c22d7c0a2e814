//! The colours that the rays of a batch saw, channel by channel.

use glam::DVec3;

use super::sample::Rgba;
use crate::lanes::chosen::spill;
use crate::lanes::space::choose as choose_lanes;
use crate::lanes::{Column, LaneMask, Lanes, Lanes3, MAX_LANES, Real};
use crate::ray::PAD;

/// Colours in the order of their rays, see [`Rgba`]. Columns, for most are written and read many at once.
#[derive(Clone, Debug, Default)]
pub struct Colors {
    len: usize,
    radiance: [Column<f64>; 3],
    alpha: Column<f64>,
}

impl Colors {
    /// Makes these `len` colours of rays that saw nothing yet.
    pub(super) fn open(&mut self, len: usize) {
        self.prepare(len);
        let padded = len.next_multiple_of(PAD);
        self.radiance.iter_mut().chain([&mut self.alpha]).for_each(|column| column[..padded].fill(0.0));
    }

    /// Makes these `len` unspecified colours, for who [starts](Self::start_lanes) all of them.
    pub(super) fn prepare(&mut self, len: usize) {
        self.len = len;
        let padded = len.next_multiple_of(PAD);
        self.radiance.iter_mut().chain([&mut self.alpha]).for_each(|column| column.at_least(padded));
    }

    /// Makes colours `first + lane` opaque ones in `lanes`, and of rays that saw nothing yet in the others.
    #[inline]
    pub(super) fn start_lanes<V: Lanes>(&mut self, first: usize, lanes: u32, light: Lanes3<V>) {
        let zero = V::constant(0.0);
        let [x, y, z] = choose_lanes(V::Mask::from_bits(lanes), light, [zero; 3]);
        let alpha = V::select(V::Mask::from_bits(lanes), V::constant(1.0), zero);
        for (column, values) in self.radiance.iter_mut().chain([&mut self.alpha]).zip([x, y, z, alpha]) {
            let mut spilt = [V::Scalar::ZERO; MAX_LANES];
            values.store(&mut spilt);
            // 0 + -0 is 0, as in a sum.
            column[first..][..V::N].iter_mut().zip(spilt).for_each(|(to, x)| *to = 0.0 + x.to_f64());
        }
    }

    /// Makes all of them `color`.
    pub(super) fn fill(&mut self, color: Rgba) {
        let Rgba { radiance: DVec3 { x, y, z }, alpha } = color;
        for (column, value) in self.radiance.iter_mut().chain([&mut self.alpha]).zip([x, y, z, alpha]) {
            column[..self.len].fill(value);
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Colour `i`.
    #[inline]
    pub fn get(&self, i: usize) -> Rgba {
        let [x, y, z] = &self.radiance;
        Rgba { radiance: DVec3::new(x[i], y[i], z[i]), alpha: self.alpha[i] }
    }

    /// Makes `color` colour `i`.
    #[inline]
    pub fn set(&mut self, i: usize, color: Rgba) {
        self.radiance.iter_mut().zip(color.radiance.to_array()).for_each(|(column, x)| column[i] = x);
        self.alpha[i] = color.alpha;
    }

    /// Adds light to colour `i`.
    #[inline]
    pub(super) fn add(&mut self, i: usize, light: DVec3) {
        self.radiance.iter_mut().zip(light.to_array()).for_each(|(column, x)| column[i] += x);
    }

    /// Makes colour `i` opaque.
    #[inline]
    pub(super) fn make_opaque(&mut self, i: usize) {
        self.alpha[i] = 1.0;
    }

    /// Makes colours `first + lane` of `lanes` opaque.
    #[inline]
    pub(super) fn make_lanes_opaque<V: Lanes>(&mut self, first: usize, lanes: u32) {
        choose(&mut self.alpha[first..][..V::N], lanes, |_, _| 1.0);
    }

    /// Makes colours `first + lane` of `lanes` all `color`.
    #[inline]
    pub(super) fn set_lanes<V: Lanes>(&mut self, first: usize, lanes: u32, color: Rgba) {
        let Rgba { radiance: DVec3 { x, y, z }, alpha } = color;
        for (column, value) in self.radiance.iter_mut().chain([&mut self.alpha]).zip([x, y, z, alpha]) {
            choose(&mut column[first..][..V::N], lanes, |_, _| value);
        }
    }

    /// Adds lane by lane to the colours `first + lane` of `lanes`.
    #[inline]
    pub(super) fn add_lanes<V: Lanes>(&mut self, first: usize, lanes: u32, light: Lanes3<V>) {
        for (column, light) in self.radiance.iter_mut().zip(spill(light)) {
            choose(&mut column[first..][..V::N], lanes, |lane, sum| sum + light[lane].to_f64());
        }
    }

    /// Red, green, blue and coverage of all.
    pub fn channels(&self) -> [&[f64]; 4] {
        let [x, y, z] = &self.radiance;
        [x, y, z, &self.alpha].map(|column| &column[..self.len])
    }
}

/// Makes the values of `lanes` what `value` makes of their lane and them: without a branch, so that all become vectors.
#[inline(always)]
fn choose(values: &mut [f64], lanes: u32, value: impl Fn(usize, f64) -> f64) {
    for (lane, old) in values.iter_mut().enumerate() {
        *old = if lanes >> lane & 1 != 0 { value(lane, *old) } else { *old };
    }
}

impl FromIterator<Rgba> for Colors {
    fn from_iter<I: IntoIterator<Item = Rgba>>(colors: I) -> Self {
        let list: Vec<Rgba> = colors.into_iter().collect();
        let mut colors = Self::default();
        colors.open(list.len());
        list.into_iter().enumerate().for_each(|(i, color)| colors.set(i, color));
        colors
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::f64x8;

    #[test]
    fn lanes_are_added_to_their_colours_only() {
        let mut colors: Colors = (0..20).map(|i| Rgba { radiance: DVec3::splat(f64::from(i)), alpha: 0.5 }).collect();
        assert_eq!((colors.len(), colors.is_empty()), (20, false));
        let light: [f64x8; 3] = [1.0, 2.0, 3.0].map(f64x8::splat);
        colors.add_lanes(8, 0b1000_0001, light);
        colors.add(9, DVec3::ONE);
        colors.make_lanes_opaque::<f64x8>(8, 0b10);
        colors.make_opaque(3);
        colors.set_lanes::<f64x8>(8, 0b100, Rgba { radiance: DVec3::ZERO, alpha: 2.0 });
        for i in 0..20 {
            let more = match i {
                8 | 15 => DVec3::new(1.0, 2.0, 3.0),
                9 => DVec3::ONE,
                10 => DVec3::splat(-10.0),
                _ => DVec3::ZERO,
            };
            let alpha =
                [(9, 1.0), (3, 1.0), (10, 2.0)].iter().find(|(at, _)| *at == i).map_or(0.5, |(_, alpha)| *alpha);
            assert_eq!(colors.get(i), Rgba { radiance: DVec3::splat(i as f64) + more, alpha });
        }
        let [red, .., alpha] = colors.channels();
        assert_eq!((red.len(), &red[16..], alpha[9]), (20, &[16.0, 17.0, 18.0, 19.0][..], 1.0));
        colors.open(3);
        assert_eq!((colors.len(), colors.get(0)), (3, Rgba::default()));
    }
}
