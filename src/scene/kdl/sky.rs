//! A clear sky.
//!
//! Source: A. J. Preetham, P. Shirley, B. Smits, "A Practical Analytic Model for Daylight", SIGGRAPH 1999, appendix
//! A.2: luminance and chromaticities by Perez' formula with coefficients that depend on the turbidity. The sun itself
//! is not in it: a `light sun` is.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DMat3, DVec3};

use crate::scene::texture::{Texels, Texture};

/// Size of the picture.
const WIDTH: u32 = 256;
const HEIGHT: u32 = 128;
/// Luminance that is a radiance of 1, thousands of candela per square metre: a clear sky is about as bright as white
/// paper in a picture, and its sun has an irradiance of about 10.
const UNIT: f64 = 10.0;

/// CIE XYZ to linear Rec.709 (ITU-R BT.709-6, white D65), by columns.
const TO_REC709: DMat3 = DMat3::from_cols(
    DVec3::new(3.240_969_9, -0.969_243_6, 0.055_630_1),
    DVec3::new(-1.537_383_2, 1.875_967_5, -0.203_977_0),
    DVec3::new(-0.498_610_8, 0.041_555_1, 1.056_971_5),
);

/// Perez' five coefficients of one quantity.
struct Perez([f64; 5]);

impl Perez {
    /// Relative value at the angle `theta` from the zenith (below a right angle) and `gamma` from the sun.
    fn at(&self, theta: f64, gamma: f64) -> f64 {
        let [a, b, c, d, e] = self.0;
        (1.0 + a * (b / theta.cos()).exp()) * (1.0 + c * (d * gamma).exp() + e * gamma.cos().powi(2))
    }
}

/// The sky with the sun in the unit direction `to_sun`, y up and positive, at `turbidity` 2 (clear) to 10 (hazy). What
/// is below the horizon is of the radiance `ground`.
pub fn sky(to_sun: DVec3, turbidity: f64, ground: DVec3) -> Texture {
    let model = Model::new(to_sun.y.clamp(0.0, 1.0).acos(), turbidity);
    let texel = |x: u32, y: u32| {
        let longitude = ((f64::from(x) + 0.5) / f64::from(WIDTH) - 0.5) * 2.0 * PI;
        let theta = (f64::from(y) + 0.5) / f64::from(HEIGHT) * PI;
        if theta >= FRAC_PI_2 {
            return ground;
        }
        let (sin, cos) = theta.sin_cos();
        let direction = DVec3::new(sin * longitude.sin(), cos, -sin * longitude.cos());
        model.radiance(theta, direction.dot(to_sun).clamp(-1.0, 1.0).acos())
    };
    let texels = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    let texels = texels.map(|(x, y)| texel(x, y).extend(1.0).as_vec4().to_array()).collect();
    Texture { name: "sky".into(), width: WIDTH, height: HEIGHT, texels: Texels::Float(texels) }
}

struct Model {
    /// Of luminance and the chromaticities x and y.
    perez: [Perez; 3],
    /// The zenith's values over those of the formula there.
    factors: DVec3,
}

impl Model {
    fn new(sun: f64, t: f64) -> Self {
        let linear = |rows: [(f64, f64); 5]| Perez(rows.map(|(slope, at_zero)| slope * t + at_zero));
        let perez = [
            linear([(0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)]),
            linear([(-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)]),
            linear([(-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)]),
        ];
        let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * sun);
        let luminance = (4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192;
        let cubic = |rows: [[f64; 4]; 3]| {
            let row = |[a, b, c, d]: [f64; 4]| ((a * sun + b) * sun + c) * sun + d;
            row(rows[0]) * t * t + row(rows[1]) * t + row(rows[2])
        };
        let x = cubic([
            [0.00166, -0.00375, 0.00209, 0.0],
            [-0.02903, 0.06377, -0.03202, 0.00394],
            [0.11693, -0.21196, 0.06052, 0.25886],
        ]);
        let y = cubic([
            [0.00275, -0.00610, 0.00317, 0.0],
            [-0.04214, 0.08970, -0.04153, 0.00516],
            [0.15346, -0.26756, 0.06670, 0.26688],
        ]);
        let at_zenith = perez.each_ref().map(|p| p.at(0.0, sun));
        Self { perez, factors: DVec3::new(luminance, x, y) / DVec3::from_array(at_zenith) }
    }

    /// Linear Rec.709 at `theta` from the zenith, `gamma` from the sun; none of it negative.
    fn radiance(&self, theta: f64, gamma: f64) -> DVec3 {
        let relative = self.perez.each_ref().map(|p| p.at(theta, gamma));
        let [luminance, x, y] = (self.factors * DVec3::from_array(relative)).to_array();
        let (luminance, y) = (luminance.max(0.0), y.max(1e-3));
        let xyz = DVec3::new(x / y, 1.0, (1.0 - x - y) / y) * luminance;
        (TO_REC709 * xyz / UNIT).max(DVec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::material::{TextureRef, Wrap};

    fn at(sky: &Texture, direction: DVec3) -> DVec3 {
        let d = direction.normalize();
        let uv = [0.5 + d.x.atan2(-d.z) / (2.0 * PI), d.y.acos() / PI];
        let around = TextureRef { wrap: [Wrap::Repeat, Wrap::Clamp], ..TextureRef::new(0) };
        let [r, g, b, _] = sky.sample(&around, uv);
        DVec3::new(r.into(), g.into(), b.into())
    }

    #[test]
    fn a_clear_sky_is_blue_and_brightest_around_the_sun() {
        let to_sun = DVec3::new(1.0, 1.0, 0.0).normalize();
        let sky = sky(to_sun, 3.0, DVec3::splat(0.25));
        let Texels::Float(texels) = &sky.texels else { panic!("not floats") };
        assert!(texels.iter().flatten().all(|x| x.is_finite() && *x >= 0.0));
        let zenith = at(&sky, DVec3::Y);
        // The paper's zenith luminance for a turbidity of 3 and a sun at 45 degrees: 5.3 thousand candela.
        let chi: f64 = (4.0 / 9.0 - 3.0 / 120.0) * (PI / 2.0);
        let wanted = (4.0453 * 3.0 - 4.9710) * chi.tan() - 0.2155 * 3.0 + 2.4192;
        let luminance = zenith.dot(DVec3::new(0.2126, 0.7152, 0.0722)) * UNIT;
        assert!((luminance / wanted - 1.0).abs() < 0.02, "{luminance}, not {wanted}");
        assert!(zenith.z > 1.5 * zenith.x, "{zenith}");
        assert!(at(&sky, to_sun).y > 3.0 * at(&sky, DVec3::new(-1.0, 1.0, 0.0)).y);
        assert_eq!(at(&sky, DVec3::new(0.3, -0.8, 0.1)), DVec3::splat(0.25));
    }
}
