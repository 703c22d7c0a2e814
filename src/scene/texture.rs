//! Pictures that materials and environments look up.

use super::material::{TextureRef, Wrap};
use glam::DVec2;

/// A picture in memory, the first row on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Name for messages.
    pub name: String,
    /// Width, texels; at least 1.
    pub width: u32,
    /// Height, texels; at least 1.
    pub height: u32,
    /// R, G, B, A of each texel, row by row.
    pub texels: Texels,
}

/// How texels are stored.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Levels 0..255 with the curve of sRGB; alpha is linear.
    Srgb8(Vec<[u8; 4]>),
    /// Levels 0..255 of plain numbers 0..1.
    Linear8(Vec<[u8; 4]>),
    /// Levels 0..65535 of plain numbers 0..1.
    Linear16(Vec<[u16; 4]>),
    /// Numbers.
    Float(Vec<[f32; 4]>),
}

impl Texture {
    /// Value at texture coordinates `uv` of a mesh as `r` uses it: linear R, G, B, A. Coordinates that are not
    /// finite count as 0.
    pub fn sample(&self, r: &TextureRef, uv: [f64; 2]) -> [f32; 4] {
        let at = r.transform.transform_point2(DVec2::from(uv));
        let clean = |x: f64| if x.is_finite() { x } else { 0.0 };
        let x = clean(at.x) * f64::from(self.width);
        let y = clean(at.y) * f64::from(self.height);
        let column = |x: f64| wrapped(x, self.width, r.wrap[0]);
        let row = |y: f64| wrapped(y, self.height, r.wrap[1]);
        if r.nearest {
            return self.texel(column(x.floor()), row(y.floor()));
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = ((x - x0) as f32, (y - y0) as f32);
        let (columns, rows) = ([column(x0), column(x0 + 1.0)], [row(y0), row(y0 + 1.0)]);
        let [a, b] = [0, 1].map(|i| {
            let [p, q] = [0, 1].map(|j| self.texel(columns[j], rows[i]));
            std::array::from_fn::<f32, 4, _>(|c| p[c] + (q[c] - p[c]) * fx)
        });
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * fy)
    }

    /// Linear R, G, B, A of the texel in `column` and `row`, which must exist.
    fn texel(&self, column: u32, row: u32) -> [f32; 4] {
        let at = row as usize * self.width as usize + column as usize;
        match &self.texels {
            Texels::Srgb8(t) => {
                let [r, g, b, a] = t[at];
                let linear = |level: u8| LINEAR[usize::from(level)];
                [linear(r), linear(g), linear(b), f32::from(a) / 255.0]
            }
            Texels::Linear8(t) => t[at].map(|level| f32::from(level) / 255.0),
            Texels::Linear16(t) => t[at].map(|level| f32::from(level) / 65535.0),
            Texels::Float(t) => t[at],
        }
    }

    /// The picture as opacity, in R, G and B: of one with transparent texels its alpha counts, of others what they show.
    #[must_use]
    pub fn into_opacity(mut self) -> Self {
        fn from_alpha<T: Copy + PartialEq>(texels: &mut [[T; 4]], full: T) {
            if texels.iter().any(|t| t[3] != full) {
                texels.iter_mut().for_each(|t| *t = [t[3], t[3], t[3], full]);
            }
        }
        match &mut self.texels {
            Texels::Srgb8(t) | Texels::Linear8(t) => from_alpha(t, u8::MAX),
            Texels::Linear16(t) => from_alpha(t, u16::MAX),
            Texels::Float(t) => from_alpha(t, 1.0),
        }
        self
    }

    /// Bytes of the texels.
    pub fn bytes(&self) -> u64 {
        (match &self.texels {
            Texels::Srgb8(t) | Texels::Linear8(t) => size_of_val(&t[..]),
            Texels::Linear16(t) => size_of_val(&t[..]),
            Texels::Float(t) => size_of_val(&t[..]),
        }) as u64
    }
}

/// The column (or row) that `x`, a whole number, means among `size` of them.
fn wrapped(x: f64, size: u32, wrap: Wrap) -> u32 {
    let size_f = f64::from(size);
    let inside = match wrap {
        Wrap::Clamp => x.clamp(0.0, size_f - 1.0),
        Wrap::Repeat => x - (x / size_f).floor() * size_f,
        Wrap::Mirror => {
            let period = 2.0 * size_f;
            let x = x - (x / period).floor() * period;
            if x < size_f { x } else { period - 1.0 - x }
        }
    };
    // Coordinates so large that they lose their units may round to the size itself.
    (inside as u32).min(size - 1)
}

/// Linear light of the levels of sRGB (IEC 61966-2-1).
static LINEAR: std::sync::LazyLock<[f32; 256]> = std::sync::LazyLock::new(|| {
    std::array::from_fn(|level| {
        let x = level as f64 / 255.0;
        (if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }) as f32
    })
});

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Texture {
        let texels = Texels::Float((0..4).map(|i| [i as f32, 0.0, 0.0, 1.0]).collect());
        Texture { name: "ramp".into(), width: 4, height: 1, texels }
    }

    #[test]
    fn texel_centres_are_exact_and_between_them_is_the_mean() {
        let (t, r) = (ramp(), TextureRef::new(0));
        for i in 0..4 {
            assert_eq!(t.sample(&r, [(f64::from(i) + 0.5) / 4.0, 0.3])[0], i as f32);
        }
        assert_eq!(t.sample(&r, [0.5, 0.0])[0], 1.5);
    }

    #[test]
    fn edges_repeat_mirror_or_clamp() {
        let t = ramp();
        let at =
            |wrap, u: f64| t.sample(&TextureRef { wrap: [wrap; 2], nearest: true, ..TextureRef::new(0) }, [u, 0.0])[0];
        assert_eq!([at(Wrap::Repeat, 1.1), at(Wrap::Repeat, -0.1)], [0.0, 3.0]);
        assert_eq!([at(Wrap::Mirror, 1.1), at(Wrap::Mirror, -0.1), at(Wrap::Mirror, 2.1)], [3.0, 0.0, 0.0]);
        assert_eq!([at(Wrap::Clamp, 1.1), at(Wrap::Clamp, -7.0)], [3.0, 0.0]);
        assert_eq!([at(Wrap::Repeat, f64::NAN), at(Wrap::Repeat, f64::INFINITY)], [0.0, 0.0]);
        assert!(at(Wrap::Repeat, 1e300).is_finite() && at(Wrap::Mirror, -1e300).is_finite());
    }

    #[test]
    fn levels_become_light() {
        let t = |texels| Texture { name: String::new(), width: 1, height: 1, texels };
        let r = TextureRef::new(0);
        let srgb = t(Texels::Srgb8(vec![[0, 188, 255, 51]])).sample(&r, [0.5, 0.5]);
        assert!((srgb[1] - 0.503).abs() < 1e-3 && srgb[0] == 0.0 && srgb[2] == 1.0 && (srgb[3] - 0.2).abs() < 1e-6);
        assert_eq!(t(Texels::Linear8(vec![[51; 4]])).sample(&r, [0.5, 0.5]), [0.2; 4]);
        assert_eq!(t(Texels::Linear16(vec![[65535; 4]])).sample(&r, [0.5, 0.5]), [1.0; 4]);
    }
}
