//! Columns of numbers turned into rows and back: what is taken in another order is moved as a row.

use super::{Lanes, MAX_LANES, Real, f32x8};

/// Numbers in a row.
pub const ROW: usize = 8;

/// Eight numbers of one thing; in f32 never across two lines of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Row<S>(pub [S; ROW]);

impl<S: Real> Row<S> {
    /// Zeros.
    pub const ZERO: Self = Self([S::ZERO; ROW]);
}

/// Eight numbers of each lane's thing as rows, one after the other; `to` has one per lane.
#[inline(always)]
pub fn to_rows<V: Lanes>(columns: [V; ROW], to: &mut [Row<V::Scalar>]) {
    let mut numbers = [[V::Scalar::ZERO; MAX_LANES]; ROW];
    for (column, numbers) in columns.into_iter().zip(&mut numbers) {
        column.store(numbers);
    }
    for at in (0..V::N).step_by(ROW) {
        let mut block = [[V::Scalar::ZERO; ROW]; ROW];
        for (eight, numbers) in block.iter_mut().zip(&numbers) {
            eight.copy_from_slice(&numbers[at..at + ROW]);
        }
        let rows = V::Scalar::transposed(&block);
        for (to, row) in to[at..].iter_mut().zip(rows) {
            *to = Row(row);
        }
    }
}

/// The columns of some rows, one per lane.
#[inline(always)]
pub fn from_rows<V: Lanes>(row: impl Fn(usize) -> Row<V::Scalar>) -> [V; ROW] {
    let mut numbers = [[V::Scalar::ZERO; MAX_LANES]; ROW];
    for at in (0..V::N).step_by(ROW) {
        let mut block = [[V::Scalar::ZERO; ROW]; ROW];
        for (i, to) in block.iter_mut().enumerate().take(V::N) {
            *to = row(at + i).0;
        }
        let columns = V::Scalar::transposed(&block);
        for (numbers, column) in numbers.iter_mut().zip(columns) {
            numbers[at..at + ROW].copy_from_slice(&column);
        }
    }
    let [a, b, c, d, e, f, g, h] = &numbers;
    [V::load(a), V::load(b), V::load(c), V::load(d), V::load(e), V::load(f), V::load(g), V::load(h)]
}

/// Rows and columns swapped.
#[inline(always)]
pub fn transposed<S: Real>(block: &[[S; ROW]; ROW]) -> [[S; ROW]; ROW] {
    let mut to = [[S::ZERO; ROW]; ROW];
    for (i, row) in block.iter().enumerate() {
        for (to, x) in to.iter_mut().zip(row) {
            to[i] = *x;
        }
    }
    to
}

/// [`transposed`], by shuffles.
#[inline(always)]
pub fn transposed_floats(block: &[[f32; ROW]; ROW]) -> [[f32; ROW]; ROW] {
    let [a, b, c, d, e, f, g, h] = *block;
    let rows = f32x8::transpose([
        f32x8::new(a),
        f32x8::new(b),
        f32x8::new(c),
        f32x8::new(d),
        f32x8::new(e),
        f32x8::new(f),
        f32x8::new(g),
        f32x8::new(h),
    ]);
    let [a, b, c, d, e, f, g, h] = rows;
    [a.to_array(), b.to_array(), c.to_array(), d.to_array(), e.to_array(), f.to_array(), g.to_array(), h.to_array()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{f32x4, f32x16, f64x2, f64x8};

    /// Number `k` of the thing in lane `i`.
    fn number<S: Real>(i: usize, k: usize) -> S {
        S::from_f64((10 * i + k) as f64)
    }

    fn there_and_back<V: Lanes>() {
        let column = |k: usize| {
            let mut lanes = [V::Scalar::ZERO; MAX_LANES];
            lanes.iter_mut().enumerate().for_each(|(i, x)| *x = number(i, k));
            V::load(&lanes)
        };
        let mut rows = vec![Row::ZERO; V::N];
        to_rows::<V>(std::array::from_fn(column), &mut rows);
        for (i, row) in rows.iter().enumerate() {
            assert_eq!(row.0.map(Real::to_f64), std::array::from_fn(|k| (10 * i + k) as f64), "{} lanes", V::N);
        }
        // The other way round: lane i takes the last row but i.
        let columns = from_rows::<V>(|i| rows[V::N - 1 - i]);
        for (k, column) in columns.into_iter().enumerate() {
            (0..V::N).for_each(|i| assert_eq!(column.lane(i).to_f64(), (10 * (V::N - 1 - i) + k) as f64));
        }
    }

    #[test]
    fn every_width_there_and_back() {
        there_and_back::<f32>();
        there_and_back::<f32x4>();
        there_and_back::<f32x8>();
        there_and_back::<f32x16>();
        there_and_back::<f64>();
        there_and_back::<f64x2>();
        there_and_back::<f64x8>();
    }

    #[test]
    fn floats_are_moved_as_they_are() {
        let block = std::array::from_fn(|i| {
            std::array::from_fn(|k| if (i + k) % 5 == 0 { f32::NAN } else { -number::<f32>(i, k) })
        });
        let bits = |rows: [[f32; ROW]; ROW]| rows.map(|row| row.map(f32::to_bits));
        assert_eq!(bits(transposed_floats(&block)), bits(transposed(&block)));
    }
}
