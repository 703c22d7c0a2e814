//! Numbers of a scene that can be changed from outside.

/// A parameter, its value, and what a slider offers of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its value; may lie outside of the range.
    pub value: f64,
    /// Range of a slider, low < high.
    pub range: (f64, f64),
    /// Distance of the values a slider offers, from the range's start on; 0 for any value.
    pub step: f64,
}

impl Parameter {
    /// Parameter `name` with the range that suits `value` where nobody has said more: from 0 to its double.
    pub fn new(name: &str, value: f64) -> Self {
        let range = match value {
            v if v > 0.0 => (0.0, 2.0 * v),
            v if v < 0.0 => (2.0 * v, 0.0),
            _ => (-1.0, 1.0),
        };
        Self { name: name.into(), value, range, step: 0.0 }
    }

    /// The value at a share of the slider's length, 0..=1, with no more digits than a thousandth of the range needs.
    pub fn at(&self, share: f64) -> f64 {
        let (low, high) = self.range;
        let value = low + (high - low) * share.clamp(0.0, 1.0);
        if self.step > 0.0 {
            let last = ((high - low) / self.step).floor();
            return low + self.step * ((value - low) / self.step).round().min(last);
        }
        let unit = 10f64.powf(((high - low) / 1000.0).log10().floor());
        // One division, so that 4.2 is 4.2.
        if unit < 1.0 { (value / unit).round() / (1.0 / unit).round() } else { (value / unit).round() * unit }
    }

    /// The share of the slider's length at which its value stands.
    pub fn share(&self) -> f64 {
        let (low, high) = self.range;
        ((self.value - low) / (high - low)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sliders_offer_short_numbers_of_their_range() {
        let hole = Parameter { name: "hole.radius".into(), value: 4.2, range: (1.0, 8.0), step: 0.0 };
        assert_eq!([-1.0, 0.0, 0.5, 1.0, 9.0].map(|share| hole.at(share)), [1.0, 1.0, 4.5, 8.0, 8.0]);
        assert_eq!(hole.at(hole.share()), 4.2);
        assert_eq!(hole.at(0.123_456), 1.864);
        let rows = Parameter { range: (2.0, 11.5), step: 2.0, value: 40.0, ..hole };
        assert_eq!([0.0, 0.3, 1.0].map(|share| rows.at(share)), [2.0, 4.0, 10.0]);
        assert_eq!(rows.share(), 1.0);
        let far = Parameter::new("far", 30_000.0);
        assert_eq!((far.range, far.at(0.333_333)), ((0.0, 60_000.0), 20_000.0));
        assert_eq!([0.0, -2.0].map(|v| Parameter::new("x", v).range), [(-1.0, 1.0), (-4.0, 0.0)]);
    }
}
