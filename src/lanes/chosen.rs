//! Some lanes of a vector: their numbers, and their values one after the other.

use super::{Lanes, Lanes3, MAX_LANES, Real, each};

/// The numbers of the set bits of `bits`, in order.
#[inline(always)]
pub fn lanes_of(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        (bits != 0).then(|| {
            bits &= bits - 1;
            lane
        })
    })
}

/// Of a list with the bits of each vector of `V`, those with any: the number of their first lane among all, and the bits.
pub fn packets<V: Lanes>(lanes: &[u32]) -> impl Iterator<Item = (usize, u32)> {
    let numbered = lanes.iter().enumerate().filter(|(_, bits)| **bits != 0);
    numbered.map(|(k, &bits)| (k * V::N, bits))
}

/// Three vectors in memory, to be read lane by lane with [`at`].
#[inline(always)]
pub fn spill<V: Lanes>(vectors: Lanes3<V>) -> [[V::Scalar; MAX_LANES]; 3] {
    let mut columns = [[V::Scalar::ZERO; MAX_LANES]; 3];
    columns.iter_mut().zip(vectors).for_each(|(column, x)| x.store(column));
    columns
}

/// Lane `lane` of what was [spilt](spill).
#[inline(always)]
pub fn at<S: Copy>(columns: &[[S; MAX_LANES]; 3], lane: usize) -> [S; 3] {
    each(|axis| columns[axis][lane])
}

/// Some lanes, listed once for many vectors.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    list: [u8; MAX_LANES],
    count: usize,
}

impl Chosen {
    /// The lanes whose bits are set.
    #[inline(always)]
    pub fn of(bits: u32) -> Self {
        let (mut list, mut count) = ([0; MAX_LANES], 0);
        for lane in lanes_of(bits) {
            list[count % MAX_LANES] = lane as u8;
            count += 1;
        }
        Self { list, count }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Their numbers.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        self.list[..self.count].iter().map(|&lane| usize::from(lane) % MAX_LANES)
    }

    /// Writes their values to the first places of `to`, which has [`Self::count`] at least.
    #[inline(always)]
    pub fn pack<V: Lanes>(&self, from: V, to: &mut [V::Scalar]) {
        if self.count == V::N {
            return from.store(to);
        }
        let mut column = [V::Scalar::ZERO; MAX_LANES];
        from.store(&mut column);
        to[..self.count].iter_mut().zip(self.iter()).for_each(|(x, lane)| *x = column[lane]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{f32x16, f64x4};

    #[test]
    fn some_lanes_come_in_order() {
        let v = f32x16::new(std::array::from_fn(|i| i as f32 * 0.5));
        for bits in [0u32, 1, 0x8000, 0b1010_0110_0001, 0xffff] {
            let want: Vec<usize> = (0..16).filter(|i| bits >> i & 1 != 0).collect();
            let chosen = Chosen::of(bits);
            assert_eq!((chosen.iter().collect::<Vec<_>>(), chosen.count()), (want.clone(), want.len()));
            let mut to = [-1.0; 17];
            chosen.pack(v, &mut to);
            assert!(want.iter().zip(to).all(|(&lane, x)| x == lane as f32 * 0.5) && to[want.len()] == -1.0);
        }
        let mut to = [0.0; 4];
        Chosen::of(0b1100).pack(f64x4::new([1.0, 2.0, 3.0, 4.0]), &mut to);
        assert_eq!(to, [3.0, 4.0, 0.0, 0.0]);
    }
}
