//! Leaves that were met and are not read yet: their triangles are on their way from memory while the tile goes on.
//!
//! To ask for all leaves of a node when it is opened asks for many that are never visited, and for more lines at once than can be
//! under way: everything else waits for them, too. Each is asked for when it is met, and read when the next is.

use crate::bvh::Child;

/// Room for leaves that wait.
const ROOM: usize = 8;

/// Leaves that wait: what is found late is found by boxes that need not have been opened.
const FEW: usize = 1;

/// Leaves that wait where triangles are so small that most are left out: less is done for each of them.
const MANY: usize = 6;

/// The leaves that wait, with the groups that met them.
#[derive(Debug)]
pub struct Due {
    leaves: [(Child, u64); ROOM],
    /// Leaves that came so far; the last ones wait.
    came: usize,
    /// Of those the ones that were read.
    read: usize,
}

impl Default for Due {
    fn default() -> Self {
        Self { leaves: [(Child::ROOT, 0); ROOM], came: 0, read: 0 }
    }
}

impl Due {
    /// Puts a leaf behind those that wait; returns the first of them if there are too many. `small`: see [`MANY`].
    #[inline(always)]
    pub fn put(&mut self, leaf: Child, groups: u64, small: bool) -> Option<(Child, u64)> {
        self.leaves[self.came % ROOM] = (leaf, groups);
        self.came += 1;
        let most = if small { MANY } else { FEW };
        if self.came - self.read > most { self.take() } else { None }
    }

    /// The first of those that wait.
    #[inline(always)]
    pub fn take(&mut self) -> Option<(Child, u64)> {
        (self.read < self.came).then(|| {
            self.read += 1;
            self.leaves[(self.read - 1) % ROOM]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_are_read_in_order_and_none_is_lost() {
        let (mut due, mut read) = (Due::default(), 0);
        let leaf = |i: u32| (Child { index: i, ..Child::ROOT }, u64::from(!i));
        for came in 0..50 {
            let (child, groups) = leaf(came);
            // The number of those that may wait changes on the way.
            let (small, waiting) = (came / 10 % 2 == 1, came + 1 - read);
            let first = due.put(child, groups, small);
            assert_eq!(first, (waiting as usize > if small { MANY } else { FEW }).then(|| leaf(read)));
            read += u32::from(first.is_some());
            assert!(((came + 1 - read) as usize) < ROOM);
        }
        assert!((40..50).contains(&read));
        for i in read..50 {
            assert_eq!(due.take(), Some(leaf(i)));
        }
        assert_eq!(due.take(), None);
    }
}
