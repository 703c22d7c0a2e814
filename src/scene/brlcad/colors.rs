//! The region colour table, resolved: a colour is found by bisection, however many entries there are.

use std::collections::BinaryHeap;

use super::model::ColorRange;

/// Disjoint stretches of region numbers, each with its colour.
#[derive(Clone, Debug, Default)]
pub(super) struct ColorTable {
    /// Where each stretch begins, in order, and its colour, if it has one; it reaches to where the next one begins.
    stretches: Vec<(i64, Option<[u8; 3]>)>,
}

impl ColorTable {
    /// The table of `ranges`, of which later ones win.
    pub fn new(ranges: &[ColorRange]) -> Self {
        let ends = |range: &ColorRange| [i64::from(range.low), i64::from(range.high) + 1];
        let mut by_low: Vec<usize> = (0..ranges.len()).filter(|&i| ranges[i].low <= ranges[i].high).collect();
        by_low.sort_unstable_by_key(|&i| ranges[i].low);
        let mut borders: Vec<i64> = by_low.iter().flat_map(|&i| ends(&ranges[i])).collect();
        borders.sort_unstable();
        borders.dedup();
        // Entries that have begun, the latest of the file on top; those that have ended leave once they are there.
        let mut begun = BinaryHeap::new();
        let mut waiting = by_low.into_iter().peekable();
        let stretches = borders.into_iter().map(|border| {
            while let Some(i) = waiting.next_if(|&i| ends(&ranges[i])[0] == border) {
                begun.push(i);
            }
            while begun.peek().is_some_and(|&i| ends(&ranges[i])[1] <= border) {
                begun.pop();
            }
            (border, begun.peek().map(|&i| ranges[i].rgb))
        });
        Self { stretches: stretches.collect() }
    }

    /// Colour of region number `id`.
    pub fn color_of(&self, id: i32) -> Option<[u8; 3]> {
        let after = self.stretches.partition_point(|stretch| stretch.0 <= i64::from(id));
        self.stretches[..after].last()?.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn later_entries_win_wherever_they_overlap() {
        let mut state = 1_u32;
        let mut random = |n: i32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) as i32 % n
        };
        for count in [0, 1, 2, 5, 40] {
            // Some are empty, as their last number is below the first.
            let mut range = |i: u8| ColorRange { low: random(60) - 10, high: random(60) - 10, rgb: [i; 3] };
            let mut ranges: Vec<_> = (0..count).map(&mut range).collect();
            ranges.insert(0, ColorRange { low: i32::MIN, high: -5, rgb: [200; 3] });
            ranges.push(ColorRange { low: 45, high: i32::MAX, rgb: [201; 3] });
            let table = ColorTable::new(&ranges);
            for id in (-20..60).chain([i32::MIN, i32::MAX]) {
                let wanted = ranges.iter().rev().find(|r| (r.low..=r.high).contains(&id)).map(|r| r.rgb);
                assert_eq!(table.color_of(id), wanted, "{id} of {ranges:?}");
            }
        }
        assert_eq!(ColorTable::new(&[]).color_of(0), None);
    }
}
