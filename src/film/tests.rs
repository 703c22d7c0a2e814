//! What the tests of several file formats share: a seeded generator and a mutator.

/// Marsaglia, "Xorshift RNGs", 2003: the 64-bit generator with shifts 13, 7, 17.
pub(super) struct XorShift(pub u64);

impl XorShift {
    pub(super) fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n as u64) as usize
    }
}

/// A copy with one to four damages: a bit flipped, a byte replaced by a nasty one, a piece cut, doubled or the end lost.
pub(super) fn mutate(seed: &[u8], random: &mut XorShift) -> Vec<u8> {
    const NASTY: [u8; 12] = [0, 1, 0x7f, 0x80, 0xff, b'0', b'9', b'-', b'(', b')', b'\'', b'{'];
    let mut bytes = seed.to_vec();
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            break;
        }
        let at = random.below(bytes.len());
        let end = (at + 1 + random.below(16)).min(bytes.len());
        match random.below(8) {
            0..=2 => bytes[at] ^= 1 << random.below(8),
            3..=5 => bytes[at] = NASTY[random.below(NASTY.len())],
            6 => drop(bytes.drain(at..end)),
            _ if random.below(2) == 0 => bytes.truncate(at),
            _ => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}
