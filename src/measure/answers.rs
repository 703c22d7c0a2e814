//! What an engine answered to a list of batches: compared bit for bit, counted, summed up in a checksum.

use crate::lanes::Real;
use crate::measure::raysets::Query;
use crate::ray::{Hits, Rays};

/// Answers of one pass, one entry per batch.
#[derive(Clone, Debug)]
pub enum Answers<S> {
    /// Closest hits.
    Closest(Vec<Hits<S>>),
    /// 1 where something lies in the segment, else 0.
    Any(Vec<Vec<u8>>),
}

/// The first place where two lists of answers differ, and in how many rays they do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Rays that differ.
    pub count: u64,
    /// Number of the first one, counted through the batches.
    pub first: usize,
    /// Both answers of the first one.
    pub text: String,
}

impl<S: Real> Answers<S> {
    /// Room for the answers to `batches`.
    pub fn new(query: Query, batches: &[Rays<S>]) -> Self {
        match query {
            Query::Closest => Self::Closest(batches.iter().map(|b| Hits::new(b.len())).collect()),
            Query::Any => Self::Any(batches.iter().map(|b| vec![0; b.len()]).collect()),
        }
    }

    /// Rays answered.
    pub fn ray_count(&self) -> u64 {
        match self {
            Self::Closest(batches) => batches.iter().map(|hits| hits.len() as u64).sum(),
            Self::Any(batches) => batches.iter().map(|batch| batch.len() as u64).sum(),
        }
    }

    /// Rays that hit something.
    pub fn hit_count(&self) -> u64 {
        match self {
            Self::Closest(batches) => batches.iter().map(|hits| hits.hit_count() as u64).sum(),
            Self::Any(batches) => batches.iter().flatten().filter(|&&hit| hit != 0).count() as u64,
        }
    }

    /// 64-bit FNV-1a over the answers in ray order, as they would stand in a hit file of the engine's precision:
    /// little-endian t, u, v (4 or 8 bytes each), prim, inst (4 each); for any-hit, one byte per ray.
    ///
    /// Source: G. Fowler, L. C. Noll, P. Vo, D. Eastlake, "The FNV Non-Cryptographic Hash Algorithm", 1991.
    pub fn checksum(&self) -> u64 {
        let mut hash = Fnv::default();
        match self {
            Self::Closest(batches) => {
                for hits in batches {
                    for i in 0..hits.len() {
                        [hits.t[i], hits.u[i], hits.v[i]].into_iter().for_each(|x| hash.real(x));
                        hash.bytes(&hits.prim[i].to_le_bytes());
                        hash.bytes(&hits.inst[i].to_le_bytes());
                    }
                }
            }
            Self::Any(batches) => batches.iter().for_each(|batch| hash.bytes(batch)),
        }
        hash.0
    }

    /// Compares bit for bit (-0 and 0 differ), or `None` if all answers are the same.
    ///
    /// Answers to different queries or different numbers of rays differ as a whole.
    pub fn difference(&self, other: &Self) -> Option<Difference> {
        let (count, first) = match (self, other) {
            (Self::Closest(a), Self::Closest(b)) => differing(a, b, Hits::len, |a, b, i| same_hit(a, i, b, i)),
            (Self::Any(a), Self::Any(b)) => differing(a, b, Vec::len, |a, b, i| a[i] == b[i]),
            _ => return Some(Difference { count: 0, first: 0, text: "answers to different queries".into() }),
        }?;
        let text = format!("{} against {}", self.describe(first), other.describe(first));
        Some(Difference { count, first, text })
    }

    /// Whether ray `i` of batch `b` is answered by the same bits as ray `j` of batch `c` in `other`.
    pub fn same_as(&self, b: usize, i: usize, other: &Self, c: usize, j: usize) -> bool {
        match (self, other) {
            (Self::Closest(x), Self::Closest(y)) => same_hit(&x[b], i, &y[c], j),
            (Self::Any(x), Self::Any(y)) => x[b][i] == y[c][j],
            _ => false,
        }
    }

    fn describe(&self, ray: usize) -> String {
        match self {
            Self::Closest(batches) => locate(batches, Hits::len, ray).map_or_else(
                || "no answer".into(),
                |(hits, i)| {
                    let (t, u, v) = (hits.t[i], hits.u[i], hits.v[i]);
                    format!("t {t:?} u {u:?} v {v:?} prim {} inst {}", hits.prim[i], hits.inst[i])
                },
            ),
            Self::Any(batches) => {
                locate(batches, Vec::len, ray).map_or_else(|| "no answer".into(), |(b, i)| b[i].to_string())
            }
        }
    }
}

fn same_hit<S: Real>(a: &Hits<S>, i: usize, b: &Hits<S>, j: usize) -> bool {
    let bits = |x: S| x.to_f64().to_bits();
    let reals = |h: &Hits<S>, i: usize| [bits(h.t[i]), bits(h.u[i]), bits(h.v[i])];
    a.prim[i] == b.prim[j] && a.inst[i] == b.inst[j] && reals(a, i) == reals(b, j)
}

/// Number of differing rays and the first of them; batches of different lengths differ in every missing ray.
fn differing<B>(
    a: &[B],
    b: &[B],
    len: impl Fn(&B) -> usize,
    same: impl Fn(&B, &B, usize) -> bool,
) -> Option<(u64, usize)> {
    let (mut count, mut first, mut base) = (0, None, 0);
    for k in 0..a.len().max(b.len()) {
        let sizes = [a.get(k).map_or(0, &len), b.get(k).map_or(0, &len)];
        let (common, longest) = (sizes[0].min(sizes[1]), sizes[0].max(sizes[1]));
        for i in (0..longest).filter(|&i| i >= common || !same(&a[k], &b[k], i)) {
            count += 1;
            first = first.or(Some(base + i));
        }
        base += longest;
    }
    first.map(|first| (count, first))
}

fn locate<B>(batches: &[B], len: impl Fn(&B) -> usize, mut ray: usize) -> Option<(&B, usize)> {
    for batch in batches {
        if ray < len(batch) {
            return Some((batch, ray));
        }
        ray -= len(batch);
    }
    None
}

/// [`Answers::checksum`] of other answers, given as the bytes of their file.
pub fn checksum(bytes: impl Iterator<Item = u8>) -> u64 {
    let mut hash = Fnv::default();
    bytes.for_each(|byte| hash.bytes(&[byte]));
    hash.0
}

struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    fn real<S: Real>(&mut self, x: S) {
        if size_of::<S>() == size_of::<f32>() {
            // Exact: the value came from an f32.
            self.bytes(&(x.to_f64() as f32).to_le_bytes());
        } else {
            self.bytes(&x.to_f64().to_le_bytes());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::INVALID_ID;

    fn fnv(bytes: &[u8]) -> u64 {
        let mut hash = Fnv::default();
        hash.bytes(bytes);
        hash.0
    }

    /// Test vectors of the FNV reference code (test_fnv.c): "", "a", "foobar".
    #[test]
    fn fnv_has_the_published_values() {
        assert_eq!(fnv(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv(b"foobar"), 0x8594_4171_f739_67e8);
    }

    fn one_hit<S: Real>(t: f64) -> Answers<S> {
        let mut hits = Hits::new(2);
        hits.t[1] = S::from_f64(t);
        hits.prim[1] = 3;
        hits.inst[1] = 1;
        Answers::Closest(vec![hits])
    }

    /// The checksum is that of the hit file's bytes: a miss, then a hit at t = 1.5 on primitive 3 of instance 1.
    #[test]
    fn checksum_covers_the_bytes_of_a_hit_file() {
        let miss = [0, 0, 0x80, 0x7f, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff];
        let hit = [0, 0, 0xc0, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 1, 0, 0, 0];
        assert_eq!(one_hit::<f32>(1.5).checksum(), fnv(&[miss, hit].concat()));
        assert_ne!(one_hit::<f64>(1.5).checksum(), one_hit::<f32>(1.5).checksum());
        let any = Answers::<f32>::Any(vec![vec![0, 1], vec![1]]);
        assert_eq!(any.checksum(), fnv(&[0, 1, 1]));
        assert_eq!((any.hit_count(), one_hit::<f32>(1.5).hit_count()), (2, 1));
    }

    #[test]
    fn one_bit_is_a_difference() {
        let (a, b) = (one_hit::<f32>(1.5), one_hit::<f32>(1.5f64 + f64::from(f32::EPSILON)));
        assert_eq!(a.difference(&a), None);
        let difference = a.difference(&b).unwrap();
        assert_eq!((difference.count, difference.first), (1, 1));
        assert!(difference.text.contains("t 1.5 ") && difference.text.contains("1.5000001"), "{}", difference.text);
        assert!(one_hit::<f32>(0.0).difference(&one_hit::<f32>(-0.0)).is_some());
        assert!(a.same_as(0, 0, &b, 0, 0) && !a.same_as(0, 1, &b, 0, 1) && !a.same_as(0, 0, &a, 0, 1));
    }

    #[test]
    fn missing_answers_differ() {
        let long = Answers::<f32>::Any(vec![vec![0, 1], vec![1, 0, 0]]);
        let short = Answers::<f32>::Any(vec![vec![0, 1], vec![1]]);
        let difference = long.difference(&short).unwrap();
        assert_eq!((difference.count, difference.first), (2, 3));
        assert!(difference.text.contains("no answer"));
        assert!(long.difference(&one_hit(1.0)).is_some());
    }

    #[test]
    fn new_answers_are_misses() {
        let batches = [Rays::<f32>::new(3)];
        let Answers::Closest(hits) = Answers::new(Query::Closest, &batches) else { panic!("closest") };
        assert_eq!((hits[0].len(), hits[0].prim[2]), (3, INVALID_ID));
        assert_eq!(Answers::new(Query::Any, &batches).hit_count(), 0);
    }
}
