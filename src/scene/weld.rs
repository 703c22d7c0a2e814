//! Welding: equal positions become one vertex, numbered in order of first appearance.
//!
//! A chained hash table over 32-bit words with vector multiply-shift hashing (Thorup, "High Speed Hashing for
//! Integers and Strings", 2015, section 3.5), keyed at random: no file can be written that makes chains long. The
//! numbering does not depend on the keys.

use std::hash::{BuildHasher, RandomState};

use glam::DVec3;

/// End of a chain.
const NONE: u32 = u32::MAX;

/// Distinct positions and the table that finds them.
#[derive(Debug)]
pub(super) struct Weld {
    positions: Vec<DVec3>,
    /// Next position in the same chain.
    next: Vec<u32>,
    /// First position of each chain; a power of two of them, at most 2^32.
    heads: Vec<u32>,
    /// Random multipliers, one per 32-bit word of a position, and an offset.
    keys: [u64; 7],
}

impl Weld {
    /// An empty table with room for about `vertices` positions; it grows when there are more.
    pub fn with_capacity(vertices: usize) -> Self {
        let random = RandomState::new();
        Self {
            positions: Vec::with_capacity(vertices),
            next: Vec::with_capacity(vertices),
            heads: vec![NONE; vertices.next_power_of_two().max(16)],
            keys: std::array::from_fn(|i| random.hash_one(i)),
        }
    }

    /// The number of the vertex at `position`, new if no earlier one has the same bits. The two zeros are the same
    /// (the first one met is kept); two NaNs are the same if their bits are.
    pub fn vertex(&mut self, position: DVec3) -> u32 {
        let key = bits(position);
        let mut found = self.heads[self.slot(key)];
        while found != NONE {
            if bits(self.positions[found as usize]) == key {
                return found;
            }
            found = self.next[found as usize];
        }
        if self.positions.len() == self.heads.len() {
            self.grow();
        }
        let new = self.positions.len() as u32;
        let slot = self.slot(key);
        self.next.push(self.heads[slot]);
        self.heads[slot] = new;
        self.positions.push(position);
        new
    }

    /// The distinct positions by number.
    pub fn into_positions(self) -> Vec<DVec3> {
        self.positions
    }

    fn slot(&self, key: [u64; 3]) -> usize {
        let mut sum = self.keys[6];
        for axis in 0..3 {
            let (low, high) = (key[axis] & 0xffff_ffff, key[axis] >> 32);
            sum = sum.wrapping_add(self.keys[2 * axis].wrapping_mul(low));
            sum = sum.wrapping_add(self.keys[2 * axis + 1].wrapping_mul(high));
        }
        (sum >> (64 - self.heads.len().trailing_zeros())) as usize
    }

    fn grow(&mut self) {
        self.heads = vec![NONE; 2 * self.heads.len()];
        for i in 0..self.positions.len() {
            let slot = self.slot(bits(self.positions[i]));
            self.next[i] = std::mem::replace(&mut self.heads[slot], i as u32);
        }
    }
}

/// Bits that are equal for positions to be welded. No arithmetic: a thread that flushes subnormals to zero must
/// not weld them.
fn bits(p: DVec3) -> [u64; 3] {
    [p.x, p.y, p.z].map(|x| match x.to_bits() {
        0x8000_0000_0000_0000 => 0,
        other => other,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_by_first_appearance_and_keeps_subnormals_apart() {
        let mut weld = Weld::with_capacity(0);
        let tiny = f64::from(f32::from_bits(1));
        let list = [DVec3::ZERO, DVec3::X, -DVec3::ZERO, DVec3::X, DVec3::new(tiny, 0.0, 0.0), DVec3::NAN, DVec3::NAN];
        assert_eq!(list.map(|p| weld.vertex(p)), [0, 1, 0, 1, 2, 3, 3]);
        let positions = weld.into_positions();
        assert_eq!(positions.len(), 4);
        assert!(positions[0].x.is_sign_positive());
    }

    #[test]
    fn agrees_with_an_ordered_map_while_it_grows() {
        let mut weld = Weld::with_capacity(0);
        let mut map = std::collections::BTreeMap::new();
        for i in 0_u64..20_000 {
            // A cheap scramble onto 27 x 27 x 27 positions, so most come again.
            let k = i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
            let p = DVec3::new((k % 27) as f64, (k / 27 % 27) as f64, (k / 729 % 27) as f64);
            let expected = map.len() as u32;
            let expected = *map.entry(bits(p)).or_insert(expected);
            assert_eq!(weld.vertex(p), expected);
        }
        assert_eq!(weld.into_positions().len(), map.len());
        assert!(map.len() > 1_000);
    }
}
