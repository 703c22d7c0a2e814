//! Some lanes of a vector: their numbers, and their values one after the other.

use super::words::{list_bits, positions};
use super::{LaneMask, Lanes, Lanes3, MAX_LANES, Real, each};

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

/// Records of lanes as columns: number `k` of the record of each of `lanes` in column `k`; zeros elsewhere.
#[inline(always)]
pub fn columns<'r, S: Real + 'r, const K: usize>(
    lanes: u32,
    record: impl Fn(usize) -> &'r [S; K],
) -> [[S; MAX_LANES]; K] {
    let mut columns = [[S::ZERO; MAX_LANES]; K];
    for lane in lanes_of(lanes) {
        let (record, lane) = (record(lane), lane % MAX_LANES);
        for (column, &x) in columns.iter_mut().zip(record) {
            column[lane] = x;
        }
    }
    columns
}

/// Records of lanes as vectors: number `k` of the record of each of `lanes` in vector `k`; unspecified elsewhere. Lanes with
/// one `key` share a record, which is read once if few keys are there.
#[inline(always)]
pub fn records<'r, V: Lanes, const K: usize>(
    lanes: u32,
    key: &[u32; MAX_LANES],
    record: impl Fn(u32) -> &'r [V::Scalar; K],
) -> [V; K]
where
    V::Scalar: 'r,
{
    let mut all = [V::constant(0.0); K];
    let mut rest = lanes;
    while rest != 0 {
        let lead = key[rest.trailing_zeros() as usize % MAX_LANES];
        let same = positions(key, lead) & rest;
        if same & (same - 1) == 0 {
            break;
        }
        let mask = V::Mask::from_bits(same);
        for (all, &x) in all.iter_mut().zip(record(lead)) {
            *all = V::select(mask, V::splat(x), *all);
        }
        rest &= !same;
    }
    if rest != 0 {
        let mask = V::Mask::from_bits(rest);
        let columns = columns(rest, |lane| record(key[lane]));
        for (all, column) in all.iter_mut().zip(&columns) {
            *all = V::select(mask, V::load(column), *all);
        }
    }
    all
}

/// Some lanes, listed once for many vectors.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    bits: u32,
    list: [u8; MAX_LANES],
    count: usize,
}

impl Chosen {
    /// The lanes whose bits are set.
    #[inline(always)]
    pub fn of(bits: u32) -> Self {
        let mut list = [0; MAX_LANES];
        let count = list_bits(bits, 0, &mut list);
        Self { bits, list, count }
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

    /// Writes their values to the first places of `to`, which has [`Self::count`] at least, and zeros after them as far as a
    /// vector reaches, if there is room for all of it.
    #[inline(always)]
    pub fn pack<V: Lanes>(&self, from: V, to: &mut [V::Scalar]) {
        let packed = from.packed(self.bits);
        if to.len() >= V::N {
            return packed.store(to);
        }
        let mut column = [V::Scalar::ZERO; MAX_LANES];
        packed.store(&mut column);
        to[..self.count].copy_from_slice(&column[..self.count]);
    }
}

/// Places in lists from which lanes take their values.
#[derive(Clone, Copy, Debug)]
pub struct Picked {
    at: [u32; MAX_LANES],
    /// Whether they follow each other, in all lanes.
    is_run: bool,
}

impl Picked {
    /// Of `list`, one place per lane of `V`; lanes beyond its end have the last one.
    #[inline(always)]
    pub fn of<V: Lanes>(list: &[u32]) -> Self {
        let mut at = [list.last().copied().unwrap_or(0); MAX_LANES];
        at.iter_mut().zip(list).for_each(|(at, &place)| *at = place);
        let follow = (0..V::N).fold(true, |follow, lane| follow & (at[lane] == at[0].wrapping_add(lane as u32)));
        Self { at, is_run: follow && list.len() >= V::N }
    }

    /// The value at each lane's place.
    #[inline(always)]
    pub fn take<V: Lanes>(&self, from: &[V::Scalar]) -> V {
        if self.is_run {
            return V::load(&from[self.at[0] as usize..]);
        }
        let mut column = [V::Scalar::ZERO; MAX_LANES];
        for (x, &at) in column.iter_mut().zip(&self.at).take(V::N) {
            *x = from[at as usize];
        }
        V::load(&column)
    }

    /// The same of three lists.
    #[inline(always)]
    pub fn take3<V: Lanes>(&self, from: [&Vec<V::Scalar>; 3]) -> Lanes3<V> {
        [self.take(from[0]), self.take(from[1]), self.take(from[2])]
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
            assert!(want.iter().zip(to).all(|(&lane, x)| x == lane as f32 * 0.5));
            assert!(to[want.len()..16].iter().all(|&x| x == 0.0) && to[16] == -1.0);
            let mut short = [-1.0; 15];
            if want.len() < 16 {
                chosen.pack(v, &mut short);
                assert!(short[..want.len()] == to[..want.len()] && short[want.len()..].iter().all(|&x| x == -1.0));
            }
        }
        let mut to = [0.0; 4];
        Chosen::of(0b1100).pack(f64x4::new([1.0, 2.0, 3.0, 4.0]), &mut to);
        assert_eq!(to, [3.0, 4.0, 0.0, 0.0]);
    }

    #[test]
    fn lanes_take_from_their_places() {
        let list: Vec<f32> = (0..40).map(|i| i as f32).collect();
        let cases: [Vec<u32>; 4] =
            [(5..21).collect(), (0..16).map(|i| (i * 7) % 40).collect(), vec![39], (30..38).collect()];
        for places in cases {
            let taken: f32x16 = Picked::of::<f32x16>(&places).take(&list);
            for lane in 0..16 {
                assert_eq!(taken.lane(lane), *places.get(lane).unwrap_or(places.last().unwrap()) as f32);
            }
        }
        assert_eq!(Picked::of::<f64x4>(&[2, 3, 4, 5]).take::<f64x4>(&[0.0, 0.5, 1.0, 1.5, 2.0, 2.5]).lane(3), 2.5);
    }

    #[test]
    fn records_are_those_of_their_keys() {
        let table: Vec<[f32; 3]> = (0..50).map(|i| [i as f32, i as f32 * 2.0, 7.0]).collect();
        let keys: [[u32; 16]; 4] = [
            [9; 16],
            std::array::from_fn(|i| (i % 3) as u32),
            std::array::from_fn(|i| 40 - i as u32),
            std::array::from_fn(|i| if i % 4 == 1 { i as u32 } else { 30 + (i % 2) as u32 }),
        ];
        for key in keys {
            for lanes in [0xffffu32, 0b1010_0110_0001, 0x8000, 0] {
                let vectors = records::<f32x16, 3>(lanes, &key, |key| &table[key as usize]);
                for lane in lanes_of(lanes) {
                    assert_eq!(vectors.map(|v| v.lane(lane)), table[key[lane] as usize], "{key:?} {lanes:x} {lane}");
                }
            }
        }
    }
}
