//! Counts of verdicts over many rays.

use std::fmt;

use super::{Verdict, Why};

/// Unexplained answers kept in full.
const KEPT: usize = 8;

/// Verdicts over many rays, mergeable over threads. Merged in a fixed order, it is the same for any thread count.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Answers judged.
    pub rays: u64,
    /// Of these, answers that were hits (or occluded).
    pub hits: u64,
    /// Answers that agree with the oracle.
    pub agree: u64,
    /// Explained differences by kind, indexed as [`Why::ALL`].
    pub explained: [u64; Why::ALL.len()],
    /// Differences that no rounding explains.
    pub unexplained: u64,
    /// The first unexplained answers, in full.
    pub samples: Vec<String>,
}

impl Tally {
    /// Counts one answer; `hit` is what the engine said.
    pub fn add(&mut self, hit: bool, verdict: &Verdict) {
        self.rays += 1;
        self.hits += u64::from(hit);
        match verdict {
            Verdict::Agree => self.agree += 1,
            Verdict::Explained(why) => self.explained[*why as usize] += 1,
            Verdict::Unexplained(detail) => {
                self.unexplained += 1;
                if self.samples.len() < KEPT {
                    self.samples.push(detail.clone());
                }
            }
        }
    }

    /// Adds the counts of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.rays += other.rays;
        self.hits += other.hits;
        self.agree += other.agree;
        self.unexplained += other.unexplained;
        for (mine, theirs) in self.explained.iter_mut().zip(other.explained) {
            *mine += theirs;
        }
        let room = KEPT - self.samples.len();
        self.samples.extend(other.samples.iter().take(room).cloned());
    }

    /// Explained differences of all kinds.
    pub fn explained_total(&self) -> u64 {
        self.explained.iter().sum()
    }

    /// Whether nothing is unexplained.
    pub fn is_clean(&self) -> bool {
        self.unexplained == 0
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} rays, {} hits, {} agree, {} explained",
            self.rays,
            self.hits,
            self.agree,
            self.explained_total()
        )?;
        let kinds = Why::ALL.iter().zip(self.explained).filter(|(_, n)| *n > 0);
        let kinds: Vec<_> = kinds.map(|(why, n)| format!("{why} {n}")).collect();
        if !kinds.is_empty() {
            write!(f, " ({})", kinds.join(", "))?;
        }
        write!(f, ", {} unexplained", self.unexplained)?;
        for sample in &self.samples {
            write!(f, "\n  {sample}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_merge_and_print() {
        let (mut a, mut b) = (Tally::default(), Tally::default());
        a.add(true, &Verdict::Agree);
        a.add(true, &Verdict::Explained(Why::Tangent));
        b.add(false, &Verdict::Explained(Why::Edge));
        for i in 0..20 {
            b.add(false, &Verdict::Unexplained(format!("ray {i}")));
        }
        assert!(a.is_clean() && !b.is_clean());
        a.merge(&b);
        assert_eq!((a.rays, a.hits, a.agree, a.explained_total(), a.unexplained), (23, 2, 1, 2, 20));
        assert_eq!(a.samples.len(), KEPT);
        let text = a.to_string();
        assert!(
            text.starts_with("23 rays, 2 hits, 1 agree, 2 explained (edge 1, tangent 1), 20 unexplained\n  ray 0\n")
        );
    }
}
