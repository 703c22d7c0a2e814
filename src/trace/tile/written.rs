//! Whether answers are written past the caches. They are where nobody reads them at once: in calls with more rays than the caches
//! would hold, and in those whose answers pile up, call after call in a place of their own. Who looks at answers before asking for
//! more has them written where others were written lately.

use super::BLOCK;
use crate::trace::output::Output;

/// Calls with more rays than this write past the caches in any case.
const MANY: usize = 2 * BLOCK;

/// Places of answers that are remembered: who reads them has no more in use at a time.
const LATELY: usize = 8;

/// Where the last calls wrote, by the address of their first answer.
#[derive(Clone, Debug, Default)]
pub struct Written {
    places: [usize; LATELY],
    next: usize,
}

impl Written {
    /// Whether the answers of `count` rays are to be written past the caches. Decides about time only.
    pub fn past(&mut self, count: usize, output: &Output<f32>) -> bool {
        let Output::Closest(hits, _) = output else { return false };
        let place = hits.t.as_ptr().addr();
        let known = self.places.contains(&place);
        if !known {
            self.places[self.next % LATELY] = place;
            self.next += 1;
        }
        !known || count > MANY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Hits;

    #[test]
    fn answers_that_pile_up_are_written_past_the_caches() {
        let mut all: Vec<Hits<f32>> = (0..LATELY + 1).map(|_| Hits::new(16)).collect();
        let mut written = Written::default();
        let mut past = |hits: &mut Hits<f32>, count| written.past(count, &Output::Closest(hits, None));
        for _ in 0..3 {
            assert!(all.iter_mut().all(|hits| past(hits, BLOCK)));
        }
        // As many as are remembered are read.
        for _ in 0..3 {
            assert!(!all[1..].iter_mut().any(|hits| past(hits, BLOCK)));
        }
        assert!(past(&mut all[1], MANY + 1));
        assert!(!written.past(MANY + 1, &Output::Any(&mut [])));
    }
}
