//! What a file may cost: no file of a few lines may ask for hours or for all memory.

/// Most steps: a pair of edges that is looked at, a point that is seen from a face.
const MAX_STEPS: u64 = 1 << 30;
/// Most triangles that are made: with all that is kept beside them until the scene stands, each takes less than 512 bytes (measured: 425 of a
/// sphere or an extrusion), so all of them 2 GiB.
const MAX_TRIANGLES: u64 = 1 << 22;

/// What is left of both.
#[derive(Clone, Copy, Debug)]
pub(super) struct Work {
    steps: u64,
    triangles: u64,
}

impl Work {
    /// All of it.
    pub fn new() -> Self {
        Self { steps: MAX_STEPS, triangles: MAX_TRIANGLES }
    }

    /// Takes `count` steps.
    ///
    /// # Errors
    /// There are not so many left.
    pub fn steps(&mut self, count: u64) -> Result<(), String> {
        self.steps = self.steps.checked_sub(count).ok_or("the file takes too much work: more than 2^30 steps")?;
        Ok(())
    }

    /// Makes `count` triangles.
    ///
    /// # Errors
    /// So many would be too many.
    pub fn triangles(&mut self, count: usize) -> Result<(), String> {
        let left = self.triangles.checked_sub(count as u64);
        self.triangles = left.ok_or_else(|| format!("the file has more than {MAX_TRIANGLES} triangles"))?;
        Ok(())
    }
}
