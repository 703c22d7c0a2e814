//! Measuring: ray sets, timing, statistics, checks before the clock starts, verification against the oracle, rows.

pub mod answers;
pub mod env;
pub mod raysets;
pub mod rows;
pub mod stats;
pub mod timing;

#[cfg(test)]
mod testing;
