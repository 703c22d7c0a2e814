//! When to try again what did not repay.

/// After a failure the next one is left alone, after another the next two, then twice as many each time, up to `MOST`.
#[derive(Clone, Copy, Debug)]
pub struct Patience<const MOST: u32> {
    /// Still to be left alone.
    rest: u32,
    /// How many will be if the next try fails.
    next: u32,
}

impl<const MOST: u32> Default for Patience<MOST> {
    fn default() -> Self {
        Self { rest: 0, next: 1 }
    }
}

impl<const MOST: u32> Patience<MOST> {
    /// Whether to try the next one.
    pub fn is_over(&mut self) -> bool {
        let over = self.rest == 0;
        self.rest = self.rest.saturating_sub(1);
        over
    }

    /// Remembers how a try went.
    pub fn remember(&mut self, went_well: bool) {
        (self.rest, self.next) = if went_well { (0, 1) } else { (self.next, (self.next * 2).min(MOST)) };
    }
}
