//! Sums of the samples of a tile's pixels.

use glam::DVec3;

use super::pixels::{Pixel, brightness};
use crate::camera::Passes;
use crate::lanes::f64x4;
use crate::shade::{FirstHit, Rgba, Samples};

/// Sums of the samples of pixels. What only further planes show is not kept where there are none.
#[derive(Debug)]
pub(super) struct Sums {
    colors: Vec<Color>,
    /// Sums of what else was seen; empty if it is not wanted.
    hits: Vec<FirstHit>,
    with_hits: bool,
}

/// What every picture shows of some samples.
#[derive(Clone, Copy, Debug, Default)]
struct Color {
    radiance: DVec3,
    alpha: f64,
    /// Sum of squared brightness.
    square: f64,
}

impl Sums {
    /// No room yet; for first hits too, or not.
    pub fn new(with_hits: bool) -> Self {
        Self { colors: Vec::new(), hits: Vec::new(), with_hits }
    }

    /// Room for `pixels` sums, empty where there were none.
    pub fn make_room(&mut self, pixels: usize) {
        self.colors.resize(pixels, Color::default());
        self.hits.resize(if self.with_hits { pixels } else { 0 }, FirstHit::NONE);
    }

    /// Forgets all sums, but not the memory.
    pub fn clear(&mut self) {
        self.colors.clear();
        self.hits.clear();
    }

    /// Adds what ray `ray` saw to sum number `pixel`.
    pub fn add(&mut self, pixel: usize, samples: &Samples, ray: usize) {
        add_color(&mut self.colors[pixel], &samples.colors.get(ray));
        if let Some(sum) = self.hits.get_mut(pixel) {
            add_hit(sum, &samples.hits[ray]);
        }
    }

    /// Adds what the rays of `passes` over the tile saw.
    pub fn add_passes(&mut self, passes: Passes, samples: &Samples) {
        for run in passes.runs() {
            let sums = &mut self.colors[run.pixels.clone()];
            sums.iter_mut().zip(run.rays.clone()).for_each(|(sum, ray)| add_color(sum, &samples.colors.get(ray)));
            if self.with_hits {
                let sums = &mut self.hits[run.pixels];
                sums.iter_mut().zip(&samples.hits[run.rays]).for_each(|(sum, hit)| add_hit(sum, hit));
            }
        }
    }

    /// Estimate of the relative error of the mean brightness of pixels of `count` samples: root of the mean variance over
    /// the mean.
    pub fn error(&self, count: u32) -> f64 {
        let mean: f64 = self.colors.iter().map(|sum| brightness(sum.radiance) / f64::from(count)).sum();
        let square: f64 = self.colors.iter().map(|sum| variance(sum, count)).sum();
        let pixels = self.colors.len() as f64;
        if square > 0.0 { (square / pixels).sqrt() / (mean / pixels).max(f64::MIN_POSITIVE) } else { 0.0 }
    }

    /// Gives the memory back.
    pub fn free(&mut self) {
        (self.colors, self.hits) = (Vec::new(), Vec::new());
    }
}

/// Where the pixels of a finished batch come from.
#[derive(Clone, Copy)]
pub(super) enum Finished<'a> {
    /// One sample each.
    Samples(&'a Samples),
    /// Sums of so many samples. What they do not keep reads as of a miss.
    Sums(&'a Sums, u32),
}

impl Finished<'_> {
    /// Red, green, blue and coverage of all pixels, rounded, into the first `to`, which are as long.
    pub fn colors(&self, to: &mut [Vec<f32>]) {
        match self {
            Self::Samples(samples) => {
                for (to, channel) in to.iter_mut().zip(samples.colors.channels()) {
                    // 0 + -0 is 0, as in a sum.
                    to.iter_mut().zip(channel).for_each(|(to, &value)| *to = (0.0 + value) as f32);
                }
            }
            Self::Sums(sums, count) => {
                for (i, sum) in sums.colors.iter().enumerate() {
                    let Rgba { radiance: DVec3 { x, y, z }, alpha } = mean(sum, *count);
                    // Four numbers at once.
                    let four = f64x4::new([x, y, z, alpha]) + f64x4::ZERO;
                    to.iter_mut().zip(four.to_array()).for_each(|(to, value)| to[i] = value as f32);
                }
            }
        }
    }

    /// Pixel `i`.
    pub fn pixel(&self, i: usize) -> Pixel {
        let (sum, count) = self.sum(i);
        let hit = match self {
            Self::Samples(samples) => samples.hits.get(i).map(|seen| {
                let mut hit = FirstHit::NONE;
                add_hit(&mut hit, seen);
                hit
            }),
            Self::Sums(sums, _) => sums.hits.get(i).copied(),
        };
        let (hit, n) = (hit.unwrap_or(FirstHit::NONE), f64::from(count));
        let hit = FirstHit {
            normal: hit.normal / n,
            shading_normal: hit.shading_normal / n,
            albedo: hit.albedo / n,
            direct: hit.direct / n,
            nodes: hit.nodes / n,
            ..hit
        };
        Pixel { color: mean(&sum, count), hit, variance: variance(&sum, count), samples: count }
    }

    /// Sum number `i`, of a single sample too, for -0 and 0 + -0 are different bits; and of how many.
    #[inline(always)]
    fn sum(&self, i: usize) -> (Color, u32) {
        match self {
            Self::Samples(samples) => {
                let mut sum = Color::default();
                add_color(&mut sum, &samples.colors.get(i));
                (sum, 1)
            }
            Self::Sums(sums, count) => (sums.colors[i], *count),
        }
    }
}

/// Mean of the `count` samples in `sum`.
#[inline(always)]
fn mean(sum: &Color, count: u32) -> Rgba {
    let n = f64::from(count);
    Rgba { radiance: sum.radiance / n, alpha: sum.alpha / n }
}

#[inline]
fn add_color(sum: &mut Color, color: &Rgba) {
    sum.radiance += color.radiance;
    sum.square += brightness(color.radiance).powi(2);
    sum.alpha += color.alpha;
}

/// Normals, colours and costs add up (misses count as 0); distance, position and ids come together from the nearest
/// sample, the first of equals.
#[inline]
fn add_hit(sum: &mut FirstHit, hit: &FirstHit) {
    sum.normal += hit.normal;
    sum.shading_normal += hit.shading_normal;
    sum.albedo += hit.albedo;
    sum.direct += hit.direct;
    sum.nodes += hit.nodes;
    if hit.distance < sum.distance {
        sum.distance = hit.distance;
        sum.position = hit.position;
        (sum.inst, sum.prim, sum.material) = (hit.inst, hit.prim, hit.material);
    }
}

/// Variance of the mean brightness that the `count` samples in `sum` estimate; 0 for one sample.
fn variance(sum: &Color, count: u32) -> f64 {
    if count < 2 {
        return 0.0;
    }
    let n = f64::from(count);
    let mean = brightness(sum.radiance) / n;
    ((sum.square / n - mean * mean).max(0.0)) / (n - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Tiling;

    #[test]
    fn samples_average_and_the_nearest_gives_distance_and_ids() {
        let red = Rgba { radiance: DVec3::X, alpha: 1.0 };
        let far = FirstHit { distance: 9.0, inst: 1, prim: 2, ..FirstHit::NONE };
        let near = FirstHit { distance: 3.0, prim: 5, nodes: 8.0, ..far };
        let twin = FirstHit { prim: 6, ..near };
        let colors = [red, Rgba::default(), red, red].into_iter().collect();
        let samples = Samples { colors, hits: vec![far, FirstHit::NONE, near, twin] };
        let mut sums = Sums::new(true);
        sums.make_room(1);
        (0..4).for_each(|ray| sums.add(0, &samples, ray));
        let pixel = Finished::Sums(&sums, 4).pixel(0);
        assert_eq!((pixel.color.radiance, pixel.color.alpha, pixel.hit.nodes), (DVec3::X * 0.75, 0.75, 4.0));
        assert_eq!((pixel.hit.distance, pixel.hit.inst, pixel.hit.prim), (3.0, 1, 5));
        // Brightness 1/3, 0, 1/3, 1/3: 1/48 around the mean, over n - 1.
        assert!((pixel.variance - 1.0 / 144.0).abs() < 1e-15 && pixel.samples == 4);
        let mut sums_of_one = Sums::new(true);
        sums_of_one.make_room(2);
        let turned = FirstHit { normal: -DVec3::Z, ..near };
        let two = Samples { colors: [red, Rgba::default()].into_iter().collect(), hits: vec![turned, FirstHit::NONE] };
        (0..2).for_each(|ray| sums_of_one.add(ray, &two, ray));
        for ray in 0..2 {
            let (same, pixel) = (Finished::Samples(&two).pixel(ray), Finished::Sums(&sums_of_one, 1).pixel(ray));
            let colors = [Finished::Samples(&two), Finished::Sums(&sums_of_one, 1)].map(|finished| {
                let mut all = [const { Vec::new() }; 4];
                all.iter_mut().for_each(|channel| channel.resize(2, 0.0));
                finished.colors(&mut all);
                all.map(|channel| channel[ray])
            });
            let Rgba { radiance: DVec3 { x, y, z }, alpha } = same.color;
            let color = [x, y, z, alpha].map(|value| value as f32);
            assert_eq!((same, colors), (pixel, [color; 2]));
            assert_eq!(same.hit.normal.x.to_bits(), 0);
        }
        assert!((sums.error(4) - (1.0_f64 / 144.0).sqrt() / 0.25).abs() < 1e-12);
    }

    #[test]
    fn passes_add_up_pixel_by_pixel() {
        let passes = Passes::new(&Tiling::new(64, 64, 32).unwrap(), 3);
        let mut colors = vec![Rgba::default(); passes.rays()];
        for run in passes.runs() {
            for (ray, pixel) in run.rays.zip(run.pixels) {
                colors[ray].radiance = DVec3::new(pixel as f64, f64::from(run.pass), 0.0);
            }
        }
        let samples = Samples { colors: colors.into_iter().collect(), hits: Vec::new() };
        let mut sums = Sums::new(false);
        sums.make_room(1024);
        sums.add_passes(passes, &samples);
        for i in 0..1024 {
            let pixel = Finished::Sums(&sums, 3).pixel(i);
            assert_eq!((pixel.color.radiance, pixel.hit), (DVec3::new(i as f64, 1.0, 0.0), FirstHit::NONE));
        }
    }
}
