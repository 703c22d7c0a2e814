//! Columns: lists of numbers that begin where a cache line does.

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use bytemuck::Pod;

use super::f32x16;

/// A list of `f32`, `f64` or `u32`, in whole lines of 64 bytes. A vector that lies across two lines takes twice as long to read
/// or write, and several times as long to write past the caches; lists from the allocator begin 16 bytes into a line.
#[derive(Clone)]
pub struct Column<T> {
    lines: Vec<f32x16>,
    of: PhantomData<T>,
}

impl<T> Default for Column<T> {
    fn default() -> Self {
        Self { lines: Vec::new(), of: PhantomData }
    }
}

impl<T> fmt::Debug for Column<T> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "Column of {} lines", self.lines.len())
    }
}

impl<T: Pod + PartialEq> PartialEq for Column<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Pod> Column<T> {
    /// Numbers in a line.
    const LINE: usize = size_of::<f32x16>() / size_of::<T>();

    /// Makes it `len` numbers long, rounded up to whole lines; new ones are zero.
    pub fn resize(&mut self, len: usize) {
        self.lines.resize(len.div_ceil(Self::LINE), f32x16::ZERO);
    }

    /// Makes it have `len` numbers or more. What is left of earlier uses is not taken back, as filling it anew when it is wanted
    /// again takes time.
    pub fn at_least(&mut self, len: usize) {
        if self.len() < len {
            self.resize(len);
        }
    }
}

impl Column<f32> {
    /// The lines, each a vector.
    #[inline(always)]
    pub fn vectors(&self) -> &[f32x16] {
        &self.lines
    }
}

impl<T: Pod> Deref for Column<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        bytemuck::cast_slice(&self.lines)
    }
}

impl<T: Pod> DerefMut for Column<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        bytemuck::cast_slice_mut(&mut self.lines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_lines_that_begin_where_lines_do() {
        for len in [0, 1, 15, 16, 17, 1000] {
            let (mut words, mut doubles) = (Column::<u32>::default(), Column::<f64>::default());
            words.resize(len);
            doubles.at_least(len);
            assert_eq!([words.len(), doubles.len()], [len.next_multiple_of(16), len.next_multiple_of(8)]);
            assert!(words.iter().all(|&x| x == 0) && doubles.iter().all(|&x| x == 0.0));
            assert!([words.as_ptr().addr(), doubles.as_ptr().addr()].iter().all(|at| len == 0 || at % 64 == 0));
        }
    }

    #[test]
    fn grows_and_keeps() {
        let mut column = Column::<u32>::default();
        column.at_least(20);
        column.iter_mut().zip(1..).for_each(|(x, i)| *x = i);
        column.at_least(3);
        assert_eq!(column.len(), 32);
        column.at_least(33);
        assert!(column[..32].iter().zip(1..).all(|(&x, i)| x == i) && column[32..] == [0; 16]);
        column.resize(16);
        assert_eq!(column.len(), 16);
    }
}
