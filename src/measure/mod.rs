//! Measuring: ray sets, timing, statistics, checks before the clock starts, verification against the oracle, rows.

pub mod agreement;
pub mod answers;
pub mod bench;
pub mod command;
pub mod compare;
pub mod env;
pub mod experiment;
pub mod explain;
pub mod eye;
pub mod history;
pub mod hitfiles;
pub mod intervals;
pub mod peers;
pub mod pictures;
pub mod raysets;
pub mod report;
pub mod rows;
pub mod scaling;
pub(crate) mod share;
pub mod stats;
pub mod timing;
pub mod truth;
pub mod verify;

#[cfg(test)]
mod testing;
