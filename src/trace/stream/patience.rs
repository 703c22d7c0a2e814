//! When to try again what did not repay.

/// After a failure the next `FIRST` are left alone, after another twice as many, and so on up to `MOST`.
#[derive(Clone, Copy, Debug)]
pub struct Patience<const FIRST: u32, const MOST: u32> {
    /// Still to be left alone.
    rest: u32,
    /// How many will be if the next try fails.
    next: u32,
}

impl<const FIRST: u32, const MOST: u32> Default for Patience<FIRST, MOST> {
    fn default() -> Self {
        Self { rest: 0, next: FIRST }
    }
}

impl<const FIRST: u32, const MOST: u32> Patience<FIRST, MOST> {
    /// Whether to try the next one.
    pub fn is_over(&mut self) -> bool {
        let over = self.rest == 0;
        self.rest = self.rest.saturating_sub(1);
        over
    }

    /// Remembers how a try went.
    pub fn remember(&mut self, went_well: bool) {
        (self.rest, self.next) = if went_well { (0, FIRST) } else { (self.next, (self.next * 2).min(MOST)) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_longer_after_every_failure_and_not_after_a_success() {
        let mut patience = Patience::<3, 10>::default();
        // How many are left alone before the next try.
        let mut wait = |went_well| {
            patience.remember(went_well);
            (0..).take_while(|_| !patience.is_over()).count()
        };
        assert_eq!([false, false, false, false, true, false].map(&mut wait), [3, 6, 10, 10, 0, 3]);
    }
}
