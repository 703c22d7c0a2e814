//! Answers of a full tile that are written while the next tile's rays are taken in, group by group: writing waits for lines to leave for
//! the memory and reading for lines to come from there, which go side by side.

use super::bundle::{Bundle, Source};
use super::columns::Columns;
use super::groups::Groups;
use super::{BLOCK, GROUPS, Job, SET, V};
use crate::lanes::Lanes;
use crate::ray::Hits;
use crate::scene::world::Names;
use crate::trace::output::Output;

/// Where the answers of the last tile go that are still with its groups.
pub struct Late<'j, 'o> {
    /// Its first ray, if there are any.
    pub first: &'j mut Option<usize>,
    /// Where answers go.
    pub output: &'j mut Output<'o, f32>,
}

/// Answers that must be written before their groups are used for something else.
pub struct Answers<'a> {
    first: usize,
    hits: &'a mut Hits<f32>,
    names: Option<&'a Names>,
}

impl Late<'_, '_> {
    /// Those that are not written yet: they will be.
    #[inline(always)]
    pub fn take(&mut self) -> Option<Answers<'_>> {
        let first = self.first.take()?;
        let Output::Closest(hits, names) = self.output else { return None };
        Some(Answers { first, hits, names: *names })
    }
}

impl Groups {
    #[inline(always)]
    fn write(&self, g: usize, answers: &mut Answers) {
        let Answers { first, hits, names } = answers;
        self.store(g, *first + g * V::N, self.whole_numbers(g), (hits, *names), true);
    }

    /// Writes all of them.
    #[inline(never)]
    pub fn write_all(&self, mut answers: Answers) {
        (0..GROUPS).for_each(|g| self.write(g, &mut answers));
    }

    /// [`Self::fill`] from memory, where answers of the tile before are still to be written.
    #[inline(never)]
    pub fn fill_and_write<const N: usize>(&mut self, bundle: &Bundle, columns: &Columns, mut answers: Answers) -> bool {
        let is_full = self.fill_after::<N>(bundle, columns, |groups, g| groups.write(g, &mut answers));
        (N * SET..GROUPS).for_each(|g| self.write(g, &mut answers));
        is_full
    }
}

impl Job<'_> {
    /// Whether the answers of a tile are left to be written with the next one's rays.
    #[inline(always)]
    pub fn leave_late<const COUNT: bool>(&mut self, bundle: &Bundle) -> bool {
        let groups = &self.memory.groups;
        let is_late = groups.full && self.past && !groups.many && matches!(bundle.source, Source::Batch(_));
        if is_late {
            self.unwritten = Some(bundle.first);
            if COUNT {
                self.counters.rays += BLOCK as u64;
            }
        }
        is_late
    }

    /// Writes what was left.
    #[inline(always)]
    pub fn write_late(&mut self) {
        let Self { unwritten, output, memory, .. } = self;
        if let Some(answers) = (Late { first: unwritten, output }).take() {
            memory.groups.write_all(answers);
        }
    }
}
