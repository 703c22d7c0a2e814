//! Colours as functions of a surface's parameters: cloud, testmap, checker.
//!
//! Source of the clouds: G. Y. Gardner, "Visual Simulation of Clouds", SIGGRAPH 1985, with the constants that BRL-CAD uses,
//! and its sines, of which there are 2048.

use glam::DVec3;

use crate::lanes::functions::{fraction, sine_of_part, steps_of_part};
use crate::lanes::{Lanes, Lanes3, each, space};
use crate::scene::brlcad::shader::Shader;

/// Steps of a full turn that have a sine of their own.
const SINES: f64 = 2048.0;

/// A procedural colour.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Pattern {
    /// White on blue.
    Cloud,
    /// u is red, v is blue.
    Testmap,
    /// Two colours in squares.
    Checker { a: DVec3, b: DVec3, scale: f64 },
}

impl Pattern {
    /// The pattern that `shader` names, if it is one.
    pub fn of(shader: &Shader) -> Option<Self> {
        let color = |names: &[&str], default: f64| -> DVec3 {
            let text = shader.text(names).unwrap_or_default();
            let mut channels = text.split(['/', ',']).map_while(|part| part.trim().parse::<f64>().ok());
            let given = (channels.next(), channels.next(), channels.next());
            let (Some(r), Some(g), Some(b)) = given else { return DVec3::splat(default) };
            DVec3::new(r, g, b) / 255.0
        };
        match shader.name.as_str() {
            "cloud" => Some(Self::Cloud),
            "testmap" => Some(Self::Testmap),
            "checker" => {
                let scale = shader.number(&["scale", "s"]).unwrap_or(2.0);
                Some(Self::Checker { a: color(&["a"], 1.0), b: color(&["b"], 0.0), scale })
            }
            _ => None,
        }
    }

    /// The colour at parameters u, v in 0..1.
    #[inline]
    pub fn color<V: Lanes>(&self, [u, v]: [V; 2]) -> Lanes3<V> {
        match self {
            Self::Cloud => cloud(u, v),
            Self::Testmap => [u, V::constant(0.0), v],
            Self::Checker { a, b, scale } => {
                // Halves of the numbers of squares, which are cut off towards zero.
                let is_odd =
                    |x: V| V::constant(0.5).cmp_le(fraction((x * V::constant(*scale)).abs() * V::constant(0.5)));
                let (odd_u, odd_v) = (is_odd(u), is_odd(v));
                let is_a = (odd_u & odd_v) | (!odd_u & !odd_v);
                space::choose(is_a, a.to_array().map(V::constant), b.to_array().map(V::constant))
            }
        }
    }
}

/// The sine of the step nearest to `turns * factor` full turns, times `amplitude`.
#[inline(always)]
fn sine<V: Lanes>(turns: V, factor: f64, amplitude: f64) -> V {
    sine_of_part(steps_of_part(turns, factor, SINES), amplitude)
}

/// `x` within 0 to 1.
#[inline(always)]
fn unit<V: Lanes>(x: V) -> V {
    x.fast_max(V::constant(0.0)).fast_min(V::constant(1.0))
}

/// Sky with clouds.
#[inline(always)]
fn cloud<V: Lanes>(u: V, v: V) -> Lanes3<V> {
    const SKY: [f64; 3] = [0.31, 0.31, 0.78];
    const THRESHOLD: f64 = 0.35;
    const RANGE: f64 = 0.3;
    let one = V::constant(1.0);
    let t = unit(texture(u, v));
    let clear = unit(one - (t - V::constant(THRESHOLD)) * V::constant(1.0 / RANGE));
    let white = (one - clear) * t;
    each(|k| clear.mul_add(V::constant(SKY[k]), white))
}

/// Gardner's texture: four octaves of shifted sines.
#[inline(always)]
fn texture<V: Lanes>(x: V, y: V) -> V {
    // In full turns: what is a half of pi there is a quarter here.
    let (mut fx, mut fy) = (2.0, 1.0);
    let (mut t1, mut t2, mut c) = (V::constant(4.0), V::constant(4.0), 1.0);
    for _ in 0..4 {
        let (px, py) = (sine(y, 0.5 * fy, 0.25), sine(x, 0.5 * fx, 0.25));
        let along = |x: V, f: f64, p: V| sine(x.mul_add(V::constant(f), p), 1.0, 1.0);
        t1 = along(x, fx, px).mul_add(V::constant(c), t1);
        t2 = along(y, fy, py).mul_add(V::constant(c), t2);
        fx *= 2.0;
        fy *= 2.0;
        c *= 0.707;
    }
    t1 * t2 * V::constant(1.0 / 32.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};

    use super::*;

    #[test]
    fn sines_are_those_of_the_nearest_step() {
        for i in -5000..5000 {
            let turns = f64::from(i) * 0.00123;
            let nearest = ((turns * SINES).round() * TAU / SINES).sin();
            assert!((sine(turns, 1.0, 1.0) - nearest).abs() < 4e-9, "{turns}");
        }
    }

    #[test]
    fn checkers_alternate() {
        let (a, b) = (DVec3::X, DVec3::Y);
        let checker = Pattern::Checker { a, b, scale: 3.0 };
        for i in 0..9 {
            for j in 0..9 {
                let at = [i, j].map(|k| (f64::from(k) + 0.4) / 9.0);
                let expected = if (i / 3 + j / 3) % 2 == 0 { a } else { b };
                assert_eq!(checker.color(at), expected.to_array(), "{at:?}");
                assert_eq!(checker.color(at.map(|x| x as f32)).map(f64::from), expected.to_array());
            }
        }
    }

    #[test]
    fn clouds_are_between_sky_and_white() {
        // By the definition, with plain sines: steps are a 2048th of a turn.
        let plain = |x: f64, y: f64| {
            let (mut fx, mut fy) = (TAU * 2.0, TAU);
            let (mut px, mut py) = (FRAC_PI_2 * (0.5 * fy * y).sin(), FRAC_PI_2 * (0.5 * fx * x).sin());
            let (mut t1, mut t2, mut c) = (0.0, 0.0, 1.0);
            for _ in 0..4 {
                t1 += c * (fx * x + px).sin() + 1.0;
                t2 += c * (fy * y + py).sin() + 1.0;
                (px, py) = (FRAC_PI_2 * (fy * y).sin(), FRAC_PI_2 * (fx * x).sin());
                (fx, fy, c) = (fx * 2.0, fy * 2.0, c * 0.707);
            }
            t1 * t2 / 32.0
        };
        for i in 0..40 {
            for j in 0..40 {
                let (u, v) = (f64::from(i) / 40.0, f64::from(j) / 40.0);
                assert!((texture(u, v) - plain(u, v)).abs() < 0.02);
                let color = Pattern::Cloud.color([u, v]);
                assert!(color[0] == color[1] && color.iter().all(|x| (0.0..=1.0).contains(x)) && color[2] >= color[0]);
            }
        }
    }
}
