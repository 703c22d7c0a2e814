//! Some lanes of a vector: their numbers, and their values one after the other.

use super::words::{list_bits, positions};
use super::{Column, LaneMask, Lanes, Lanes3, MAX_LANES, Real, each, f32x16};
use wide::{u8x16, u32x8};

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

/// Which of the first `N` words of `list`, one for each lane of `V`, are `wanted`, as bits.
#[inline(always)]
pub fn positions_in<V: Lanes>(list: &[u32], wanted: u32) -> u32 {
    match (V::N, list.first_chunk(), list.first_chunk()) {
        (16, Some(list), _) => positions(list, wanted),
        (8, _, Some(list)) => u32x8::new(*list).simd_eq(u32x8::splat(wanted)).to_bitmask(),
        _ => list.iter().take(V::N).rev().fold(0, |bits, &word| bits << 1 | u32::from(word == wanted)),
    }
}

/// Which of the first 16 bytes, or of all, are zero.
#[inline(always)]
pub fn zeros(bytes: &[u8]) -> u32 {
    match bytes.first_chunk::<16>() {
        Some(bytes) => u8x16::new(*bytes).simd_eq(u8x16::ZERO).to_bitmask(),
        None => bytes.iter().rev().fold(0, |bits, &byte| bits << 1 | u32::from(byte == 0)),
    }
}

/// Whether each number of `list` is one more than that before it.
#[inline(always)]
pub fn is_run(list: &[u32]) -> bool {
    let first = list.first().copied().unwrap_or_default();
    // All of them, without a way out: that is one comparison of vectors.
    list.iter().enumerate().fold(true, |run, (k, &x)| run & (x == first.wrapping_add(k as u32)))
}

/// The words of `list` in `lanes`, each with those of the lanes that have it.
#[inline(always)]
pub fn groups(list: &[u32; MAX_LANES], lanes: u32) -> impl Iterator<Item = (u32, u32)> {
    let mut rest = lanes;
    std::iter::from_fn(move || {
        let lead = rest.trailing_zeros() as usize;
        (rest != 0).then(|| {
            let word = list[lead % MAX_LANES];
            let same = positions(list, word) & rest;
            rest &= !same;
            (word, same)
        })
    })
}

/// A list with `new` where the mask is set. Numbers are moved as floats: selection copies bits.
#[inline(always)]
pub fn merge(mask: <f32x16 as Lanes>::Mask, new: u32, old: [u32; MAX_LANES]) -> [u32; MAX_LANES] {
    merge_lists(mask, [new; MAX_LANES], old)
}

/// A list with the numbers of `new` where the mask is set.
#[inline(always)]
pub fn merge_lists(mask: <f32x16 as Lanes>::Mask, new: [u32; MAX_LANES], old: [u32; MAX_LANES]) -> [u32; MAX_LANES] {
    let [new, old] = [new, old].map(|list| f32x16::new(bytemuck::cast(list)));
    bytemuck::cast(<f32x16 as Lanes>::select(mask, new, old).to_array())
}

/// Three vectors in memory, to be read lane by lane with [`at`].
#[inline(always)]
pub fn spill<V: Lanes>(vectors: Lanes3<V>) -> [[V::Scalar; MAX_LANES]; 3] {
    let mut columns = [[V::Scalar::ZERO; MAX_LANES]; 3];
    // Written out: an iterator over the vectors puts them into memory first, and waits for that.
    let [x, y, z] = vectors;
    x.store(&mut columns[0]);
    y.store(&mut columns[1]);
    z.store(&mut columns[2]);
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

    /// Their numbers, counted from `first`, before numbers without meaning.
    #[inline(always)]
    pub fn numbers(&self, first: u32) -> [u32; MAX_LANES] {
        let mut numbers = [first; MAX_LANES];
        numbers.iter_mut().zip(self.list).for_each(|(number, lane)| *number += u32::from(lane));
        numbers
    }

    /// Adds their words of `from` to a list.
    #[inline(always)]
    pub fn extend(&self, from: &[u32], to: &mut Vec<u32>) {
        let mut words = [0; MAX_LANES];
        match from.first_chunk::<MAX_LANES>() {
            // The first ones: they stay where they are.
            Some(from) if self.bits & (self.bits + 1) == 0 => words = *from,
            Some(from) => {
                words.iter_mut().zip(self.list).for_each(|(word, lane)| *word = from[usize::from(lane) % MAX_LANES])
            }
            None => words.iter_mut().zip(self.iter()).for_each(|(word, lane)| *word = from[lane]),
        }
        // All of them and some back: no call for a few words.
        to.extend_from_slice(&words);
        to.truncate(to.len() - MAX_LANES + self.count);
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
    /// Counted from `first`.
    at: [u32; MAX_LANES],
    first: usize,
    how: How,
}

/// How places lie.
#[derive(Clone, Copy, Debug, PartialEq)]
enum How {
    /// One after the other, in all lanes.
    Run,
    /// Within two vectors.
    Near,
    /// Anyhow.
    Far,
}

impl Picked {
    /// Of `list`, one ascending place per lane of `V` in lists of `len` values; lanes beyond its end have the last one.
    #[inline(always)]
    pub fn of<V: Lanes>(list: &[u32], len: usize) -> Self {
        let (lowest, last) = (list.first().map_or(0, |&place| place as usize), list.last().copied().unwrap_or(0));
        let mut at = [last; MAX_LANES];
        at.iter_mut().zip(list).for_each(|(at, &place)| *at = place);
        let first = lowest.min(len.saturating_sub(2 * V::N));
        let span = last as usize - first;
        let how = match span {
            _ if list.len() == V::N && last as usize - lowest == V::N - 1 => How::Run,
            _ if span < 2 * V::N && len >= 2 * V::N => How::Near,
            _ => How::Far,
        };
        let first = match how {
            How::Run => lowest,
            How::Near => first,
            How::Far => 0,
        };
        at.iter_mut().for_each(|at| *at -= first as u32);
        Self { at, first, how }
    }

    /// The value at each lane's place.
    #[inline(always)]
    pub fn take<V: Lanes>(&self, from: &[V::Scalar]) -> V {
        match self.how {
            How::Run => V::load(&from[self.first..]),
            How::Near => V::near(&from[self.first..], &self.at),
            How::Far => {
                let mut column = [V::Scalar::ZERO; MAX_LANES];
                for (x, &at) in column.iter_mut().zip(&self.at).take(V::N) {
                    *x = from[at as usize];
                }
                V::load(&column)
            }
        }
    }

    /// The same of three lists.
    #[inline(always)]
    pub fn take3<V: Lanes>(&self, from: [&Column<V::Scalar>; 3]) -> Lanes3<V> {
        [self.take(from[0]), self.take(from[1]), self.take(from[2])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{f32x4, f32x8, f32x16, f64x4};

    #[test]
    fn groups_are_the_lanes_of_each_word() {
        let list = std::array::from_fn(|lane| [7, 3, 7, 9][lane % 4]);
        let found: Vec<_> = groups(&list, 0b0111_0110).collect();
        assert_eq!(found, [(3, 0b10_0010), (7, 0b101_0100)]);
        assert_eq!(groups(&list, 0).next(), None);
    }

    #[test]
    fn zeros_and_runs() {
        let bytes: [u8; 20] = std::array::from_fn(|i| [0, 1, 255][i % 3]);
        assert_eq!((zeros(&bytes), zeros(&bytes[1..6]), zeros(&[])), (0b1001_0010_0100_1001, 0b100, 0));
        assert!(is_run(&[]) && is_run(&[9]) && is_run(&[4, 5, 6, 7]) && !is_run(&[4, 5, 7, 6]) && !is_run(&[4, 4]));
    }

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
            for from in [&(20..36).collect::<Vec<u32>>(), &(20..60).collect()] {
                let mut words = vec![3];
                chosen.extend(from, &mut words);
                let wanted = want.iter().map(|&lane| 20 + lane as u32);
                assert!(words.into_iter().eq([3].into_iter().chain(wanted)));
            }
            assert!(want.iter().zip(chosen.numbers(7)).all(|(&lane, number)| number == 7 + lane as u32));
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
    fn positions_of_any_width() {
        let list: Vec<u32> = (0..40).map(|i| i * i % 7).collect();
        let expected = |from: usize, n: usize| (0..n).filter(|i| list[from + i] == 2).fold(0, |bits, i| bits | 1 << i);
        for from in 0..20 {
            let rest = &list[from..];
            assert_eq!(positions_in::<f32x16>(rest, 2), expected(from, 16));
            assert_eq!(positions_in::<f32x8>(rest, 2), expected(from, 8));
            assert_eq!(positions_in::<f32x4>(rest, 2), expected(from, 4));
            assert_eq!(positions_in::<f32>(rest, 2), expected(from, 1));
        }
    }

    #[test]
    fn lanes_take_from_their_places() {
        let list: Vec<f32> = (0..100).map(|i| i as f32).collect();
        let spread = |step: u32| (0..16).map(|i| i * step / 2).collect::<Vec<u32>>();
        let cases = [
            ((5..21).collect(), How::Run),
            (spread(3), How::Near),
            (spread(9), How::Far),
            (vec![99], How::Near),
            ((90..98).collect(), How::Near),
            (vec![69, 71, 84, 99], How::Near),
            (vec![67, 71, 84, 99], How::Far),
            ((84..100).collect(), How::Run),
        ];
        for (places, how) in cases {
            let picked = Picked::of::<f32x16>(&places, list.len());
            let taken: f32x16 = picked.take(&list);
            assert_eq!(picked.how, how, "{places:?}");
            for lane in 0..16 {
                assert_eq!(taken.lane(lane), *places.get(lane).unwrap_or(places.last().unwrap()) as f32);
            }
        }
        let short: Vec<f64> = (0..6).map(|i| f64::from(i) * 0.5).collect();
        for places in [[2, 3, 4, 5], [0, 2, 3, 5]] {
            let picked = Picked::of::<f64x4>(&places, 6);
            assert_eq!(picked.take::<f64x4>(&short).to_array(), places.map(|place| f64::from(place) * 0.5));
        }
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
