//! Port models: how many vector operations of a kind this core starts in a clock cycle.
//!
//! What is in print about 512-bit units disagrees: two ports for multiply-adds, maxima and comparisons, or one. So loops
//! of nothing else are timed, in vectors that fill one register of the build, beside a chain of known length that tells the
//! clock. A loop has [`CHAINS`] operations that do not wait for each other, more than two ports times a latency of four
//! cycles keep in flight.

use std::hint::black_box;
use std::time::{Duration, Instant};

use crate::lanes::{LaneMask, Lanes, compiled_isa, f32x4, f32x8, f32x16, map3};

/// Operations of one turn of a loop, none of which waits for another.
const CHAINS: usize = 12;

/// Turns between two looks at the clock: at two operations per cycle some 12 000 cycles, so that a look costs nothing.
const TURNS: usize = 2000;

/// How long each loop is repeated in a round.
const TIME: Duration = Duration::from_millis(1);

/// Rounds of all loops; of each loop the fastest repetition counts.
const ROUNDS: usize = 5;

/// Cycles from an integer product to the next that needs it: x86-64 since 2008, and most of AArch64.
const PRODUCT_CYCLES: f64 = 3.0;

/// How far from a whole number of ports a rate may be, as a part of it.
const NEAR: f64 = 0.1;

/// Whether a multiply-add is one instruction, see [`Lanes::mul_add`].
const FUSED: bool = cfg!(any(target_feature = "fma", target_feature = "neon"));

/// How often one kind of operation is started.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Rate {
    /// Instructions per clock cycle.
    pub per_cycle: f64,
    /// The port model that holds: 1 or 2 if the rate is within a tenth of it.
    pub ports: Option<u32>,
}

impl Rate {
    fn of(per_cycle: f64) -> Self {
        let ports = [1, 2].into_iter().find(|&n| (per_cycle / f64::from(n) - 1.0).abs() <= NEAR);
        Self { per_cycle, ports }
    }

    /// The model that holds and the number, or the number alone.
    fn words(&self) -> String {
        match self.ports {
            Some(1) => format!("1 per cycle (one port; measured {:.1})", self.per_cycle),
            Some(n) => format!("{n} per cycle (both ports; measured {:.1})", self.per_cycle),
            None if self.per_cycle < 1.0 => format!("{:.1} per cycle (less than a port's)", self.per_cycle),
            None if self.per_cycle < 2.0 => format!("{:.1} per cycle (between one port's and two)", self.per_cycle),
            None => format!("{:.1} per cycle (more than two ports')", self.per_cycle),
        }
    }
}

/// What a core does with vectors, see the module's head.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Ports {
    /// Bits of the vectors.
    pub bits: usize,
    /// Clock of the core while this was measured.
    pub ghz: f64,
    /// Multiply-adds; where the build has none, multiplications and additions.
    pub multiply_add: Rate,
    /// The greater of two.
    pub max: Rate,
    /// Comparisons to a mask. Each comes with an instruction that uses the mask, so this is the least the ports do.
    pub compare: Rate,
}

impl Ports {
    /// Measures the current thread's core, in some 20 milliseconds.
    pub fn measure() -> Self {
        match compiled_isa() {
            "avx512" => measured::<f32x16>(),
            "avx2" | "avx" => measured::<f32x8>(),
            "scalar" => measured::<f32>(),
            _ => measured::<f32x4>(),
        }
    }

    /// From the clock in hertz and seconds for [`TURNS`] turns of each loop.
    fn of(bits: usize, hertz: f64, [multiply_add, max, compare]: [f64; 3]) -> Self {
        let rate = |operations: usize, seconds: f64| Rate::of((operations * TURNS) as f64 / (seconds * hertz));
        Self {
            bits,
            ghz: hertz / 1e9,
            multiply_add: rate(if FUSED { CHAINS } else { 2 * CHAINS }, multiply_add),
            max: rate(CHAINS, max),
            compare: rate(CHAINS, compare),
        }
    }

    /// One line for people.
    pub fn words(&self) -> String {
        let sum = if FUSED { "multiply-add" } else { "multiply or add" };
        let [multiply_add, max, compare] = [self.multiply_add, self.max, self.compare].map(|rate| rate.words());
        let (bits, ghz) = (self.bits, self.ghz);
        format!("{bits}-bit vectors at {ghz:.2} GHz: {sum} {multiply_add}, max {max}, compare {compare}")
    }
}

fn measured<V: Lanes<Scalar = f32>>() -> Ports {
    let (mut clock, mut least) = (f64::INFINITY, [f64::INFINITY; 4]);
    for _ in 0..ROUNDS {
        clock = clock.min(fastest(products));
        let [sums, maxima] = [fastest(multiply_adds::<V>), fastest(maxima::<V>)];
        let [combined, taken_out] = [fastest(combined::<V>), fastest(taken_out::<V>)];
        let round = [sums, maxima, combined, taken_out];
        least.iter_mut().zip(round).for_each(|(least, seconds)| *least = least.min(seconds));
    }
    let hertz = (CHAINS * TURNS) as f64 * PRODUCT_CYCLES / clock;
    let [multiply_add, max, combined, taken_out] = least;
    // Something has to become of a mask, or there would be no comparison; the cheaper of two ways tells more.
    Ports::of(32 * V::N, hertz, [multiply_add, max, combined.min(taken_out)])
}

/// Seconds of the fastest run.
fn fastest<T>(run: fn() -> T) -> f64 {
    let (begun, mut fastest) = (Instant::now(), f64::INFINITY);
    while begun.elapsed() < TIME {
        let start = Instant::now();
        black_box(run());
        fastest = fastest.min(start.elapsed().as_secs_f64());
    }
    fastest
}

/// Numbers the compiler does not know, so that no two chains are one to it. (The numbers pass the box, not the vectors: what
/// has been in the box has an address, and would be kept in memory.)
#[inline(always)]
fn unknown<V: Lanes>() -> [V; CHAINS] {
    std::array::from_fn(|i| V::constant(black_box(1.0 + 0.125 * i as f64)))
}

#[inline(always)]
fn total<V: Lanes>(chains: [V; CHAINS]) -> V {
    chains.into_iter().fold(V::constant(0.0), |sum, x| sum + x)
}

/// Squares of squares: each needs the one before, and there is no shorter way. (Additions would not do: some cores fold them
/// away before they are executed.)
fn products() -> u64 {
    let mut x: u64 = black_box(3);
    for _ in 0..TURNS {
        for _ in 0..CHAINS {
            x = x.wrapping_mul(x);
        }
    }
    x
}

fn multiply_adds<V: Lanes>() -> V {
    let mut chains = unknown::<V>();
    // They all go to 2: no denormal numbers, no infinities.
    let [a, b] = [0.5, 1.0].map(|x| V::constant(black_box(x)));
    for _ in 0..TURNS {
        chains.iter_mut().for_each(|x| *x = x.mul_add(a, b));
    }
    total(chains)
}

fn maxima<V: Lanes>() -> V {
    let mut chains = unknown::<V>();
    let memory = V::constant(2.0);
    for _ in 0..TURNS {
        // As far as the compiler knows, the memory changes every turn; it is only read.
        let x = *black_box(&memory);
        chains.iter_mut().for_each(|best| *best = best.fast_max(x));
    }
    total(chains)
}

/// Comparisons whose masks are combined, so that a turn ends with one.
fn combined<V: Lanes>() -> u32 {
    let [a, b, c, d, e, f, g, h, i, j, k, l] = unknown::<V>();
    let memory = V::constant(1.5);
    let mut seen = 0;
    for _ in 0..TURNS {
        let x = *black_box(&memory);
        let [p, q, r] = map3([[a, b, c, d], [e, f, g, h], [i, j, k, l]], |[a, b, c, d]| {
            x.cmp_lt(a) & x.cmp_lt(b) & x.cmp_lt(c) & x.cmp_lt(d)
        });
        seen ^= (p & q & r).bits();
    }
    seen
}

/// Comparisons whose masks leave the vector unit, each by itself.
fn taken_out<V: Lanes>() {
    let (edges, memory) = (unknown::<V>(), V::constant(1.5));
    for _ in 0..TURNS {
        let x = *black_box(&memory);
        edges.iter().for_each(|edge| {
            black_box(x.cmp_lt(*edge).bits());
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 3 GHz, 24 000 operations in 4 µs are 2 per cycle, in 8.4 µs 0.95, in 5.3 µs 1.5.
    #[test]
    fn the_model_by_hand() {
        let sums = if FUSED { 1.0 } else { 2.0 };
        let ports = Ports::of(512, 3e9, [sums * 4e-6, 8.4e-6, 16e-6 / 3.0]);
        assert_eq!((ports.bits, ports.ghz), (512, 3.0));
        assert_eq!((ports.multiply_add.ports, ports.max.ports, ports.compare.ports), (Some(2), Some(1), None));
        assert!((ports.multiply_add.per_cycle - 2.0).abs() < 1e-9 && (ports.compare.per_cycle - 1.5).abs() < 1e-9);
        let words = ports.words();
        assert!(words.starts_with("512-bit vectors at 3.00 GHz: multiply"), "{words}");
        for part in [
            " 2 per cycle (both ports; measured 2.0), ",
            "max 1 per cycle (one port; measured 1.0), ",
            "compare 1.5 per cycle (between one port's and two)",
        ] {
            assert!(words.contains(part), "{words}");
        }
    }

    #[test]
    fn a_model_holds_within_a_tenth() {
        for (rate, ports) in [(0.5, None), (0.89, None), (0.91, Some(1)), (1.09, Some(1)), (1.11, None)] {
            assert_eq!(Rate::of(rate).ports, ports, "{rate}");
        }
        for (rate, ports) in [(1.79, None), (1.81, Some(2)), (2.19, Some(2)), (2.21, None), (4.0, None)] {
            assert_eq!(Rate::of(rate).ports, ports, "{rate}");
        }
    }

    /// Between a slow clock and any that was ever built; between an emulator's rate and more ports than any core has.
    #[test]
    fn this_machine_is_of_this_world() {
        let ports = Ports::measure();
        println!("{}", ports.words());
        assert!(ports.ghz > 0.2 && ports.ghz < 10.0, "{ports:?}");
        for rate in [ports.multiply_add, ports.max, ports.compare] {
            assert!(rate.per_cycle > 0.2 && rate.per_cycle < 8.0, "{ports:?}");
        }
    }
}
