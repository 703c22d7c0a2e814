//! What a long conversion tells while it works.

use crate::error::{Error, Result};

/// Asked and told from all threads.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Whether to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// More steps are known: how many.
    pub more: &'a (dyn Fn(u64) + Sync),
    /// One step is done.
    pub step: &'a (dyn Fn() + Sync),
}

impl Watch<'_> {
    /// Nobody watches, nothing stops.
    pub const NONE: Watch<'static> = Watch { stop: &|| false, more: &|_| {}, step: &|| {} };

    /// Begins a step of the work.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    pub fn next(&self) -> Result<()> {
        (self.step)();
        if (self.stop)() { Err(Error::Interrupted) } else { Ok(()) }
    }
}
