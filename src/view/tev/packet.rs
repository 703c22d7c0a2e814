//! Packets of tev's protocol.
//!
//! Source: Thomas Müller, *tev* (github.com/Tom94/tev), the description of its network protocol. All numbers are little
//! endian. A packet is its own length in bytes as u32 (these four included), a byte for its kind, then what the kind
//! asks for; texts end with a zero byte, flags are a byte.

use crate::film::Window;

/// Makes an image: name, size, names of its channels.
const CREATE_IMAGE: u8 = 4;
/// Changes a part of an image, several channels at a time, each with an offset and a stride (third version).
const UPDATE_IMAGE: u8 = 6;

/// A packet being put together.
struct Packet(Vec<u8>);

impl Packet {
    fn new(kind: u8) -> Self {
        Self(vec![0, 0, 0, 0, kind])
    }

    fn flag(mut self, on: bool) -> Self {
        self.0.push(u8::from(on));
        self
    }

    /// A zero byte would end the text early: it is left out.
    fn text(mut self, text: &str) -> Self {
        self.0.extend(text.bytes().filter(|&byte| byte != 0));
        self.0.push(0);
        self
    }

    fn texts(self, texts: &[&str]) -> Self {
        texts.iter().fold(self, |packet, text| packet.text(text))
    }

    fn numbers(mut self, numbers: &[u32]) -> Self {
        self.0.extend(numbers.iter().flat_map(|n| (*n as i32).to_le_bytes()));
        self
    }

    fn longs(mut self, numbers: impl Iterator<Item = i64>) -> Self {
        self.0.extend(numbers.flat_map(i64::to_le_bytes));
        self
    }

    fn finish(mut self) -> Vec<u8> {
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        self.0
    }
}

/// Asks for a black image of this size in pixels (sides below 2^31) and brings it to the front.
pub fn create_image(name: &str, width: u32, height: u32, channels: &[&str]) -> Vec<u8> {
    let packet = Packet::new(CREATE_IMAGE).flag(true).text(name).numbers(&[width, height, channels.len() as u32]);
    packet.texts(channels).finish()
}

/// Gives the pixels of `part` of an image new values: `value(channel, x, y)` for pixel (x, y) of the picture, one channel
/// after the other, each row by row.
pub fn update_image(name: &str, channels: &[&str], part: Window, value: impl Fn(usize, u32, u32) -> f32) -> Vec<u8> {
    let count = channels.len();
    let packet = Packet::new(UPDATE_IMAGE).flag(false).text(name).numbers(&[count as u32]).texts(channels);
    let packet = packet.numbers(&[part.x0, part.y0, part.width(), part.height()]);
    let offsets = (0..count as i64).map(|channel| channel * part.area() as i64);
    let mut packet = packet.longs(offsets).longs((0..count).map(|_| 1));
    packet.0.reserve(4 * count * part.area() as usize);
    for channel in 0..count {
        for y in part.y0..part.y1 {
            packet.0.extend((part.x0..part.x1).flat_map(|x| value(channel, x, y).to_le_bytes()));
        }
    }
    packet.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_by_hand() {
        let create = create_image("a\0b", 3, 258, &["R", "G"]);
        let mut want = vec![26, 0, 0, 0, 4, 1, b'a', b'b', 0, 3, 0, 0, 0, 2, 1, 0, 0, 2, 0, 0, 0];
        want.extend([b'R', 0, b'G', 0]);
        want[0] = want.len() as u8;
        assert_eq!(create, want);

        let part = Window { x0: 5, y0: 7, x1: 6, y1: 9 };
        let update = update_image("n", &["A", "Z"], part, |c, x, y| (100 * c as u32 + 10 * x + y) as f32);
        let mut want = vec![0, 0, 0, 0, 6, 0, b'n', 0, 2, 0, 0, 0, b'A', 0, b'Z', 0];
        want.extend([5, 0, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
        want.extend([0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0]);
        want.extend([1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
        want.extend([57f32, 58.0, 157.0, 158.0].iter().flat_map(|v| v.to_le_bytes()));
        want[0] = want.len() as u8;
        assert_eq!(update, want);
    }
}
