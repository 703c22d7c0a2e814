//! Albedos of facets of every width, for materials whose roughness a texture changes.

use std::sync::OnceLock;

use super::curve::{Curve, look_up, place, two_by_facets};
use crate::lanes::{Lanes, MAX_LANES, Real};

/// Rows of the table, evenly spaced in the square root of the width up to 1; the first is at one step.
const ROWS: usize = 36;

/// Facets of one width.
#[derive(Debug)]
struct Row {
    /// What perfectly mirroring facets do not give back at once.
    lost: Curve,
    /// What facets that mirror (1 - cos)^5 give back at once.
    fifth: Curve,
    means: [f64; 2],
}

static TABLE: OnceLock<Vec<Row>> = OnceLock::new();

/// Makes the table, which must be there before a packet asks. Nobody waits for another who makes it: one who waits inside
/// a pool of threads might be the one who is waited for.
pub fn prepare() {
    if TABLE.get().is_none() {
        let rows = (0..ROWS).map(row).collect();
        // Another may have been faster with the same numbers.
        let _ = TABLE.set(rows);
    }
}

fn row(i: usize) -> Row {
    let alpha = ((i + 1) as f64 / ROWS as f64).powi(2);
    let [lost, fifth] = Curve::pair(alpha, |cos| {
        let [kept, fifth] = two_by_facets(alpha, cos, |met, up| [up, (1.0 - met).max(0.0).powi(5) * up]);
        [(1.0 - kept).max(0.0), fifth]
    });
    let means = [lost.mean(), fifth.mean()];
    Row { lost, fifth, means }
}

/// Two rows and the way between them, for each lane.
pub struct PacketRows<V> {
    rows: [[&'static Row; 2]; MAX_LANES],
    rest: [f64; MAX_LANES],
    alpha: V,
    /// Widths of the two rows.
    of_rows: [V; 2],
    /// Means over the hemisphere of [`Self::lost`] and [`Self::fifth`].
    pub means: [V; 2],
}

impl<V: Lanes> PacketRows<V> {
    /// Of facets of width `alpha`.
    #[inline(always)]
    pub fn new(alpha: V) -> Self {
        let table = TABLE.get().expect("the table is prepared before paths start");
        let mut widths = [V::Scalar::ONE; MAX_LANES];
        alpha.store(&mut widths);
        let mut rows = [[&table[0]; 2]; MAX_LANES];
        let mut rest = [0.0; MAX_LANES];
        for (lane, width) in widths.iter().enumerate() {
            let width = width.to_f64();
            let row = ((width.sqrt() * ROWS as f64 - 1.0).max(0.0) as usize).min(ROWS - 2);
            let pair = [&table[row], &table[row + 1]];
            let [a, b] = pair.map(|row| row.lost.alpha());
            rows[lane] = pair;
            rest[lane] = ((width - a) / (b - a)).clamp(0.0, 1.0);
        }
        let means = [0, 1].map(|k| {
            let mean = |lane: usize| {
                let [a, b] = rows[lane].map(|row| row.means[k]);
                V::Scalar::from_f64((b - a).mul_add(rest[lane], a))
            };
            V::load(&std::array::from_fn::<_, MAX_LANES, _>(mean))
        });
        let of_rows = [0, 1].map(|k| {
            let width = |lane: usize| V::Scalar::from_f64(rows[lane][k].lost.alpha());
            V::load(&std::array::from_fn::<_, MAX_LANES, _>(width))
        });
        Self { rows, rest, alpha, of_rows, means }
    }

    /// What perfectly mirroring facets do not give back at once under cosine `cos`: a function of the cosine over the width,
    /// nearly, so both rows are asked at the same place.
    #[inline(always)]
    pub fn lost(&self, cos: V) -> V {
        look_up(place(cos, self.alpha), |lane, cell, rest| {
            let [a, b] = self.rows[lane].map(|row| row.lost.at(cell, rest));
            (b - a).mul_add(self.rest[lane], a)
        })
    }

    /// What facets that mirror (1 - cos)^5 give back at once: a function of the cosine itself, nearly.
    #[inline(always)]
    pub fn fifth(&self, cos: V) -> V {
        let [a, b] = [0, 1]
            .map(|k| look_up(place(cos, self.of_rows[k]), |lane, cell, rest| self.rows[lane][k].fifth.at(cell, rest)));
        let rest = V::load(&self.rest.map(V::Scalar::from_f64));
        (b - a).mul_add(rest, a)
    }
}

#[cfg(test)]
mod tests {
    use super::super::curve::by_facets;
    use super::*;

    /// Between the rows, where the table is furthest from what it was made of, it is right to three in a thousand, at cosines
    /// up to three widths to three in two hundred; of the narrowest facets, where the quadrature itself is off by hundredths, to
    /// five in a hundred.
    #[test]
    fn rows_between_rows() {
        prepare();
        for i in 1..ROWS {
            let alpha = ((i as f64 + 0.5) / ROWS as f64).powi(2);
            let rows = PacketRows::<f64>::new(alpha);
            for cos in [0.3 * alpha, alpha, 3.0 * alpha, 0.3, 0.7, 1.0] {
                let cos = f64::min(cos, 1.0);
                let close = match i {
                    1 | 2 => 5e-2,
                    _ if cos <= 3.001 * alpha => 1.5e-2,
                    _ => 3e-3,
                };
                let kept = by_facets(alpha, 1.5, cos, |_, up, _| up);
                let fifth = by_facets(alpha, 1.5, cos, |met, up, _| (1.0 - met).powi(5) * up);
                let (lost, found) = (rows.lost(cos), rows.fifth(cos));
                assert!((1.0 - kept - lost).abs() < close, "{alpha} {cos}: {} {lost}", 1.0 - kept);
                assert!((fifth - found).abs() < close, "{alpha} {cos}: {fifth} {found}");
            }
        }
    }
}
