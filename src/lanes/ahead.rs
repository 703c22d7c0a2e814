//! Independent parts that a core would not see next to each other: put there by hand.

/// Whether there are registers for two at once.
pub const AHEAD: bool = cfg!(target_feature = "avx512f");

/// Calls `take` for each set bit of `bits`, with what `begin` makes of its number. With AVX-512 the next one is begun before: of what one
/// takes a core keeps hardly more in sight at once, and waits for each unless there is something else to do. With sixteen registers
/// what is begun would have to wait in memory.
#[inline(always)]
pub fn one_ahead<S, T: Copy>(
    mut bits: u64,
    state: &mut S,
    begin: impl Fn(&S, usize) -> T,
    mut take: impl FnMut(&mut S, usize, T),
) {
    if !AHEAD {
        while bits != 0 {
            let now = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let known = begin(state, now);
            take(state, now, known);
        }
        return;
    }
    if bits == 0 {
        return;
    }
    let mut next = bits.trailing_zeros() as usize;
    let mut begun = begin(state, next);
    loop {
        let (now, known) = (next, begun);
        bits &= bits - 1;
        if bits != 0 {
            next = bits.trailing_zeros() as usize;
            begun = begin(state, next);
        }
        take(state, now, known);
        if bits == 0 {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_begun_before_the_one_before_it_is_taken() {
        for bits in [0, 1, 1 << 63, 0b1011_0100, u64::MAX] {
            let (mut seen, begun) = (Vec::new(), std::cell::RefCell::new(Vec::new()));
            one_ahead(
                bits,
                &mut seen,
                |_, i| {
                    begun.borrow_mut().push(i);
                    3 * i
                },
                |seen, i, made| {
                    assert_eq!(made, 3 * i);
                    seen.push((i, begun.borrow().len()));
                },
            );
            let want: Vec<usize> = (0..64).filter(|i| bits >> i & 1 != 0).collect();
            let ahead = want.iter().enumerate().map(|(k, &i)| (i, want.len().min(k + 1 + usize::from(AHEAD))));
            assert_eq!(seen, ahead.collect::<Vec<_>>());
            assert_eq!(begun.into_inner(), want);
        }
    }
}
