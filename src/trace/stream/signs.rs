//! What rays are sorted by, and whether they point nearly the same way.

use crate::lanes::{LaneMask, Lanes, Real, each, map3};
use crate::ray::Packet;

/// What rays are sorted by, a bit per lane: whether they go down along x, y, z, whether y and z are their dominant axes.
#[derive(Clone, Copy, Debug)]
pub struct Signs(pub [u32; 5]);

impl Signs {
    #[inline(always)]
    pub fn of<V: Lanes>(packet: &Packet<V>) -> Self {
        // The sign of the reciprocal, without a division.
        let [x, y, z] = map3(packet.dir, |d| d.cmp_le(V::splat(-V::Scalar::MIN_POSITIVE)).bits());
        Self([x, y, z, packet.dominant[1], packet.dominant[2]])
    }

    /// Whether all lanes of `live` have the same bits.
    #[inline(always)]
    pub fn agree(&self, live: u32) -> bool {
        self.0.into_iter().all(|bits| bits & live == 0 || bits & live == live)
    }

    /// Whether they have the same direction along two axes or all.
    #[inline(always)]
    pub fn nearly_agree(&self, live: u32) -> bool {
        let [x, y, z] = each(|axis| u32::from(self.0[axis] & live == 0 || self.0[axis] & live == live));
        x + y + z >= 2
    }
}

/// Whether the range of the `live` numbers is no wider than `most`. Mostly all are within half of it from one of them, and no minimum
/// over a vector is asked for.
#[inline(always)]
pub fn is_narrow<V: Lanes>(numbers: V, most: f64, live: u32) -> bool {
    let one = V::splat(numbers.lane(live.trailing_zeros() as usize & (V::N - 1)));
    let close = (numbers - one).abs().cmp_le(V::constant(0.5 * most)).bits() & live;
    close == live || {
        let (low, high) = numbers.range(live);
        high - low <= V::Scalar::from_f64(most)
    }
}
