//! Every model against what any model must be: densities that integrate to what is sampled, weights that are value
//! over density, reciprocity, and lanes that never look at each other.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use glam::DVec3;

use super::facets::{FacetsList, Rough};
use super::{
    Bsdf, Matte, MetalRough, RoughCoat, RoughConductor, RoughDielectric, SmoothCoat, SmoothConductor, SmoothDielectric,
    Thin, fresnel::dielectric_mean,
};
use crate::camera::sobol::PixelPoints;
use crate::lanes::{Lanes, Lanes3, MAX_LANES, Real};
use crate::shade::look_lanes::{LookLanes, look_numbers};

/// Base colour and parameters of one point.
type Params = ([f64; 3], [f64; 7]);

/// The same look in all lanes.
fn everywhere<V: Lanes>((base, param): &Params) -> LookLanes<V> {
    LookLanes::of([&[look_numbers((*base).into(), param)], &[]], V::ALL, &[0; MAX_LANES])
}

const COPPER: [f64; 6] = [0.21, 0.93, 1.1, 3.6, 2.6, 2.3];

/// Widths of facets that are tested.
const WIDTHS: [f64; 7] = [0.15, 0.3, 0.5, 0.7, 0.9, 1.0, 0.02];
/// Their indices of refraction, each after its reciprocal.
const INDICES: [f64; 4] = [1.0 / 1.5, 1.5, 0.7, 1.0 / 0.7];

fn metal_of(alpha: f64) -> Rough {
    let index = [[0, 1, 2].map(|c| COPPER[c]), [3, 4, 5].map(|c| COPPER[c])];
    Rough::Metal { alpha, index, is_multiple: true }
}

fn glass_of(alpha: f64, eta: f64) -> Rough {
    Rough::Glass { alpha, eta, is_multiple: true }
}

fn coat_of(alpha: f64) -> Rough {
    Rough::Coat { alpha, eta: 1.5 }
}

fn all_rough() -> Vec<Rough> {
    let of_width = |alpha: f64| {
        let glass = INDICES.map(|eta| glass_of(alpha, eta));
        [metal_of(alpha), coat_of(alpha)].into_iter().chain(glass)
    };
    WIDTHS.into_iter().flat_map(of_width).collect()
}

static FACETS: LazyLock<FacetsList> = LazyLock::new(|| FacetsList::new(&all_rough(), true));

/// The number of `rough` in [`FACETS`].
fn number(rough: &Rough) -> f64 {
    all_rough().iter().position(|other| other == rough).expect("a surface of the list") as f64
}

fn copper(alpha: f64) -> [f64; 7] {
    let number = number(&metal_of(alpha));
    std::array::from_fn(|i| if i < 6 { COPPER[i] } else { number })
}

fn glass(alpha: f64, eta: f64) -> [f64; 7] {
    [eta, alpha, number(&glass_of(alpha, eta)), 0.0, 0.0, 0.0, 0.0]
}

/// Smooth for a width of 0.
fn coat(alpha: f64) -> [f64; 7] {
    let number = if alpha > 0.0 { number(&coat_of(alpha)) } else { 0.0 };
    [1.5, dielectric_mean(1.0 / 1.5), alpha, number, 0.0, 0.0, 0.0]
}

const BASE_COLOR: [f64; 3] = [0.8, 0.5, 0.3];

fn unit(cos: f64, azimuth: f64) -> [f64; 3] {
    let sin = (1.0 - cos * cos).sqrt();
    [sin * azimuth.cos(), sin * azimuth.sin(), cos]
}

/// Zeroth, first and second moments of a distribution of directions.
#[derive(Clone, Copy, Default)]
struct Moments([f64; 10]);

impl Moments {
    fn add(&mut self, w: [f64; 3], share: f64) {
        let [x, y, z] = w;
        for (sum, term) in self.0.iter_mut().zip([1.0, x, y, z, x * x, y * y, z * z, x * y, y * z, z * x]) {
            *sum += share * term;
        }
    }
}

/// Checks that the density of `eval` has the moments of the directions that `sample` finds, and that what the weights
/// add up to is the integral of the value.
fn density_is_of_samples<B: Bsdf<'static, f64>>(name: &str, params: &Params) {
    let bsdf = B::load(&everywhere(params), &FACETS);
    for wo in [unit(0.9, 0.4), unit(0.35, 2.0)] {
        const SAMPLES: u32 = 1 << 17;
        const STEPS: u32 = 1200;
        let (mut found, mut light) = (Moments::default(), DVec3::ZERO);
        let points = PixelPoints::new(1, 2, 3);
        for i in 0..SAMPLES {
            let sampled = bsdf.sample(wo, points.point(i, 0), points.point(i, 1)[0]);
            let weight = DVec3::from(sampled.weight);
            // Mirrors have no density.
            if weight != DVec3::ZERO && sampled.pdf.is_finite() {
                found.add(sampled.wi, 1.0 / f64::from(SAMPLES));
                light += weight / f64::from(SAMPLES);
            }
        }
        let (mut density, mut integral) = (Moments::default(), DVec3::ZERO);
        let cell = 2.0 * TAU / f64::from(STEPS * STEPS);
        for row in 0..STEPS {
            let cos = 2.0 * (f64::from(row) + 0.5) / f64::from(STEPS) - 1.0;
            for column in 0..STEPS {
                let wi = unit(cos, (f64::from(column) + 0.5) * TAU / f64::from(STEPS));
                let value = bsdf.eval(wo, wi);
                // A facet's mirror image below the surface has a density, and no value.
                if value.value != [0.0; 3] {
                    density.add(wi, value.pdf * cell);
                }
                integral += DVec3::from(value.value) * cell;
            }
        }
        for (k, (d, f)) in density.0.iter().zip(found.0).enumerate() {
            assert!((d - f).abs() < 3e-3, "{name}, {wo:?}, moment {k}: density {d}, samples {f}");
        }
        let error = (light - integral).abs().max_element();
        assert!(error < 3e-3, "{name}, {wo:?}: {light} by weights, {integral} by values");
    }
}

/// Checks that the value and density of a sampled direction are those that `eval` gives, and the weight their ratio.
fn weights_are_ratios<B: Bsdf<'static, f64>>(name: &str, params: &Params) {
    let bsdf = B::load(&everywhere(params), &FACETS);
    let points = PixelPoints::new(5, 6, 7);
    let mut checked = 0;
    for i in 0..4000 {
        let [a, b] = points.point(i, 2);
        let wo = unit(0.02 + 0.97 * a, b * TAU);
        let sampled = bsdf.sample(wo, points.point(i, 0), points.point(i, 1)[0]);
        let size = DVec3::from(sampled.wi).length();
        assert!(sampled.weight == [0.0; 3] || (size - 1.0).abs() < 1e-9, "{name}: direction of length {size}");
        if sampled.pdf.is_infinite() || sampled.weight == [0.0; 3] {
            continue;
        }
        let found = bsdf.eval(wo, sampled.wi);
        assert!((found.pdf / sampled.pdf - 1.0).abs() < 1e-6, "{name}: {} {}", found.pdf, sampled.pdf);
        for c in 0..3 {
            let ratio = found.value[c] / found.pdf;
            assert!((ratio - sampled.weight[c]).abs() < 1e-6 * (1.0 + ratio), "{name}: {ratio} {}", sampled.weight[c]);
        }
        checked += 1;
    }
    assert!(checked > 1000, "{name}: {checked} directions");
}

/// Checks f(a, b) = f(b, a) for directions on one side.
fn reflection_is_reciprocal<B: Bsdf<'static, f64>>(name: &str, params: &Params) {
    let bsdf = B::load(&everywhere(params), &FACETS);
    let points = PixelPoints::new(8, 9, 1);
    for i in 0..2000 {
        let ([a, b], [c, d]) = (points.point(i, 0), points.point(i, 1));
        let (wo, wi) = (unit(0.05 + 0.95 * a, b * TAU), unit(0.05 + 0.95 * c, d * TAU));
        let (there, back) = (bsdf.eval(wo, wi).value, bsdf.eval(wi, wo).value);
        for k in 0..3 {
            let (f, g) = (there[k] / wi[2], back[k] / wo[2]);
            assert!((f - g).abs() <= 1e-9 * (f + g), "{name}: {f} {g}");
        }
    }
}

#[test]
fn matte_is_consistent() {
    let params = (BASE_COLOR, [0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 0.0]);
    density_is_of_samples::<Matte<f64>>("matte", &params);
    weights_are_ratios::<Matte<f64>>("matte", &params);
    reflection_is_reciprocal::<Matte<f64>>("matte", &params);
}

#[test]
fn rough_metal_is_consistent() {
    for alpha in [0.15, 0.5, 1.0] {
        let params = ([0.0; 3], copper(alpha));
        density_is_of_samples::<RoughConductor<f64>>("metal", &params);
        weights_are_ratios::<RoughConductor<f64>>("metal", &params);
        reflection_is_reciprocal::<RoughConductor<f64>>("metal", &params);
    }
}

#[test]
fn coats_are_consistent() {
    let params = (BASE_COLOR, coat(0.0));
    density_is_of_samples::<SmoothCoat<f64>>("smooth coat", &params);
    weights_are_ratios::<SmoothCoat<f64>>("smooth coat", &params);
    reflection_is_reciprocal::<SmoothCoat<f64>>("smooth coat", &params);
    for alpha in [0.15, 0.7] {
        let params = (BASE_COLOR, coat(alpha));
        density_is_of_samples::<RoughCoat<f64>>("rough coat", &params);
        weights_are_ratios::<RoughCoat<f64>>("rough coat", &params);
        reflection_is_reciprocal::<RoughCoat<f64>>("rough coat", &params);
    }
}

#[test]
fn metallic_roughness_is_consistent() {
    for [metallic, alpha, transmission] in [[0.0, 0.3, 0.0], [0.6, 0.6, 0.5], [0.1, 0.2, 1.0], [1.0, 1.0, 0.0]] {
        let params = (BASE_COLOR, [metallic, alpha, 0.04, transmission, 0.0, 0.0, 0.0]);
        density_is_of_samples::<MetalRough<f64>>("metallic-roughness", &params);
        weights_are_ratios::<MetalRough<f64>>("metallic-roughness", &params);
        reflection_is_reciprocal::<MetalRough<f64>>("metallic-roughness", &params);
    }
}

#[test]
fn rough_glass_is_consistent() {
    for eta in [1.5, 1.0 / 1.5] {
        for alpha in [0.15, 0.5, 1.0] {
            let params = (BASE_COLOR, glass(alpha, eta));
            density_is_of_samples::<RoughDielectric<f64>>("glass", &params);
            weights_are_ratios::<RoughDielectric<f64>>("glass", &params);
            reflection_is_reciprocal::<RoughDielectric<f64>>("glass", &params);
        }
    }
}

/// Light through a boundary is as reciprocal as its squeeze allows: f(in to out) n_in^2 = f(out to in) n_out^2.
#[test]
fn refraction_is_reciprocal_but_for_the_squeeze() {
    let points = PixelPoints::new(3, 1, 4);
    let load =
        |eta: f64, alpha: f64| RoughDielectric::<f64>::load(&everywhere(&([1.0; 3], glass(alpha, eta))), &FACETS);
    let mut lit = 0;
    for (eta, alpha) in [(1.5, 0.3), (1.5, 0.9), (0.7, 0.5)] {
        let (front, back) = (load(eta, alpha), load(if eta == 1.5 { INDICES[0] } else { INDICES[3] }, alpha));
        for i in 0..2000 {
            let ([a, b], [c, d]) = (points.point(i, 0), points.point(i, 1));
            let (up, down) = (unit(0.05 + 0.95 * a, b * TAU), unit(-0.05 - 0.95 * c, d * TAU));
            let out = front.eval(up, down).value[0] / -down[2];
            // The same boundary from behind: all directions turned over.
            let inwards = back.eval(down.map(|x| -x), up.map(|x| -x)).value[0] / up[2];
            assert!((out * eta * eta - inwards).abs() <= 1e-9 * inwards, "{out} {inwards}");
            lit += u32::from(out > 0.0);
        }
    }
    assert!(lit > 1000, "{lit}");
}

/// Perfect mirrors and boundaries: no light can be aimed at, the direction is the law's, weights times chances are
/// Fresnel's shares.
#[test]
fn smooth_models_follow_the_laws() {
    let wo = unit(0.6, 1.0);
    let (tint, eta) = ([0.9, 0.8, 0.7], 1.5);
    let glass = SmoothDielectric::<f64>::load(&everywhere(&(tint, [eta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])), &FACETS);
    let pane = Thin::<f64>::load(&everywhere(&(tint, [eta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])), &FACETS);
    let metal = SmoothConductor::<f64>::load(&everywhere(&([0.0; 3], copper(0.15))), &FACETS);
    let (reflected, through) = (glass.sample(wo, [0.3; 2], 0.0), glass.sample(wo, [0.3; 2], 0.9999));
    assert_eq!((reflected.wi, reflected.weight), ([-wo[0], -wo[1], wo[2]], [1.0; 3]));
    // Snell: sines in the ratio of the indices, in one plane.
    assert!((0..2).all(|i| (through.wi[i] * eta + wo[i]).abs() < 1e-15) && through.wi[2] < 0.0);
    assert!((0..3).all(|c| (through.weight[c] * eta * eta - tint[c]).abs() < 1e-12));
    assert_eq!((through.squeeze, reflected.squeeze), (eta * eta, 1.0));
    let (cos_t, share) = ((1.0 - 0.64 / 2.25f64).sqrt(), |f: &dyn Fn(f64) -> bool| {
        (0..10_000).filter(|&i| f((f64::from(i) + 0.5) / 10_000.0)).count() as f64 / 10_000.0
    });
    let s = (0.6 - 1.5 * cos_t) / (0.6 + 1.5 * cos_t);
    let p = (0.9 - cos_t) / (0.9 + cos_t);
    let fresnel = 0.5 * (s * s + p * p);
    let mirrored = share(&|u| glass.sample(wo, [0.3; 2], u).wi[2] > 0.0);
    assert!((mirrored - fresnel).abs() < 2e-4, "{mirrored} {fresnel}");
    let mirrored = share(&|u| pane.sample(wo, [0.3; 2], u).wi[2] > 0.0);
    assert!((mirrored - 2.0 * fresnel / (1.0 + fresnel)).abs() < 2e-4, "{mirrored}");
    let straight = pane.sample(wo, [0.3; 2], 0.9999);
    assert_eq!((straight.wi, straight.weight), (wo.map(|x| -x), tint));
    assert_eq!(metal.sample(wo, [0.3; 2], 0.5).wi, reflected.wi);
    for value in [glass.eval(wo, reflected.wi), pane.eval(wo, straight.wi), metal.eval(wo, reflected.wi)] {
        assert_eq!((value.value, value.pdf), ([0.0; 3], 0.0));
    }
}

/// Lane `i` of a packet gives the bits that the same numbers give alone.
fn lanes_are_alone<S: Real, W: Bsdf<'static, S::Wide>, B: Bsdf<'static, S>>(name: &str, list: &[Params]) {
    let table: Vec<_> = list.iter().map(|(base, param)| look_numbers((*base).into(), param)).collect();
    let chances = PixelPoints::new(2, 7, 1);
    let same = |a: S, b: S| a == b || (a.to_f64().is_nan() && b.to_f64().is_nan());
    for round in 0..200 {
        let number = |lane: usize, pair: u32| chances.point(round * 16 + lane as u32, pair).map(S::from_f64);
        let direction = |lane: usize, pair: u32, low: f64| {
            let [a, b] = chances.point(round * 16 + lane as u32, pair);
            unit(low + (1.0 - low) * a, b * TAU).map(S::from_f64)
        };
        let width = <S::Wide as Lanes>::N;
        let load = |f: &dyn Fn(usize) -> S| {
            let column: Vec<S> = (0..width).map(f).collect();
            <S::Wide as Lanes>::load(&column)
        };
        let vector = |f: &dyn Fn(usize) -> [S; 3]| -> Lanes3<S::Wide> { [0, 1, 2].map(|c| load(&|lane| f(lane)[c])) };
        let (wo, wi) = (|lane| direction(lane, 0, 1e-3), |lane| direction(lane, 1, -1.0));
        let all: [u32; MAX_LANES] = std::array::from_fn(|lane| lane as u32);
        let wide = W::load(&LookLanes::of([&table[..3], &table[3..]], <S::Wide as Lanes>::ALL, &all), &FACETS);
        let place = [load(&|lane| number(lane, 2)[0]), load(&|lane| number(lane, 2)[1])];
        let value = wide.eval(vector(&wo), vector(&wi));
        let sampled = wide.sample(vector(&wo), place, load(&|lane| number(lane, 3)[0]));
        for lane in 0..width {
            let narrow = B::load(&LookLanes::of([&table[..3], &table[3..]], 1, &[lane as u32; MAX_LANES]), &FACETS);
            let (v, s) =
                (narrow.eval(wo(lane), wi(lane)), narrow.sample(wo(lane), number(lane, 2), number(lane, 3)[0]));
            let all = (0..3).all(|c| {
                same(value.value[c].lane(lane), v.value[c])
                    && same(sampled.wi[c].lane(lane), s.wi[c])
                    && same(sampled.weight[c].lane(lane), s.weight[c])
            });
            let rest = same(value.pdf.lane(lane), v.pdf)
                && same(sampled.pdf.lane(lane), s.pdf)
                && same(sampled.squeeze.lane(lane), s.squeeze);
            assert!(all && rest, "{name}, round {round}, lane {lane}: {s:?} {sampled:?}");
        }
    }
}

/// A packet of points that all differ: `params` changed a little from lane to lane.
fn spread(params: Params) -> Vec<Params> {
    let (base, param) = params;
    (0..MAX_LANES)
        .map(|lane| {
            let factor = 1.0 - 0.02 * lane as f64;
            (base.map(|c| c * factor), param.map(|p| p * factor))
        })
        .collect()
}

fn all_models_alone<S: Real>() {
    let glass = spread((BASE_COLOR, glass(0.3, 1.5)));
    let metal = spread(([0.0; 3], copper(0.3)));
    let plastic = spread((BASE_COLOR, coat(0.3)));
    let gltf = spread((BASE_COLOR, [0.4, 0.5, 0.04, 0.5, 0.0, 0.0, 0.0]));
    let matte = spread((BASE_COLOR, [0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 0.0]));
    lanes_are_alone::<S, Matte<S::Wide>, Matte<S>>("matte", &matte);
    lanes_are_alone::<S, SmoothConductor<S::Wide>, SmoothConductor<S>>("smooth metal", &metal);
    lanes_are_alone::<S, RoughConductor<S::Wide>, RoughConductor<S>>("metal", &metal);
    lanes_are_alone::<S, SmoothDielectric<S::Wide>, SmoothDielectric<S>>("smooth glass", &glass);
    lanes_are_alone::<S, RoughDielectric<S::Wide>, RoughDielectric<S>>("glass", &glass);
    lanes_are_alone::<S, Thin<S::Wide>, Thin<S>>("pane", &glass);
    lanes_are_alone::<S, SmoothCoat<S::Wide>, SmoothCoat<S>>("smooth coat", &plastic);
    lanes_are_alone::<S, RoughCoat<S::Wide>, RoughCoat<S>>("coat", &plastic);
    lanes_are_alone::<S, MetalRough<S::Wide>, MetalRough<S>>("metallic-roughness", &gltf);
}

#[test]
fn lanes_of_f32_are_alone() {
    all_models_alone::<f32>();
}

#[test]
fn lanes_of_f64_are_alone() {
    all_models_alone::<f64>();
}
