//! Samples into pixels, pixels into planes.

use glam::DVec3;

use super::aov::{Aov, COLOR, Channel, Get};
use crate::film::{Film, Plane, PlaneData, Window};
use crate::shade::Sample;

/// Adds `sample` to the sum of a pixel's samples. Colours, coverage, normals and costs add up (misses count as 0);
/// distance, position and ids come together from the nearest sample, the first of equals.
pub(super) fn add(sum: &mut Sample, sample: &Sample) {
    sum.radiance += sample.radiance;
    sum.square += brightness(sample.radiance).powi(2);
    sum.alpha += sample.alpha;
    sum.normal += sample.normal;
    sum.shading_normal += sample.shading_normal;
    sum.albedo += sample.albedo;
    sum.direct += sample.direct;
    sum.nodes += sample.nodes;
    if sample.distance < sum.distance {
        sum.distance = sample.distance;
        sum.position = sample.position;
        (sum.inst, sum.prim, sum.material) = (sample.inst, sample.prim, sample.material);
    }
}

/// What samples of a pixel are compared by.
fn brightness(radiance: DVec3) -> f64 {
    radiance.element_sum() / 3.0
}

/// Variance of the mean brightness that the `count` samples in `sum` estimate; 0 for one sample.
pub(super) fn variance(sum: &Sample, count: u32) -> f64 {
    if count < 2 {
        return 0.0;
    }
    let n = f64::from(count);
    let mean = brightness(sum.radiance) / n;
    ((sum.square / n - mean * mean).max(0.0)) / (n - 1.0)
}

/// The pixel's value from the sum of its `spp` samples.
pub(super) fn mean(sum: &Sample, spp: u32) -> Sample {
    let (variance, samples) = (variance(sum, spp), spp);
    let spp = f64::from(spp);
    Sample {
        radiance: sum.radiance / spp,
        square: variance,
        samples,
        alpha: sum.alpha / spp,
        normal: sum.normal / spp,
        shading_normal: sum.shading_normal / spp,
        albedo: sum.albedo / spp,
        direct: sum.direct / spp,
        nodes: sum.nodes / spp,
        ..*sum
    }
}

/// A film and what its planes show.
pub(super) struct Painter {
    channels: Vec<Channel>,
    /// The planes in the order of the channels.
    pub film: Film,
}

impl Painter {
    /// A film of misses in a black world.
    pub fn new(width: u32, height: u32, window: Window, aovs: &[Aov]) -> Self {
        let area = window.area() as usize;
        let extra = Aov::ALL.into_iter().filter(|aov| aovs.contains(aov)).flat_map(Aov::channels);
        let channels: Vec<Channel> = COLOR.iter().chain(extra).copied().collect();
        let planes = channels
            .iter()
            .map(|channel| Plane {
                name: channel.name.to_string(),
                data: match channel.get {
                    Get::F32(get) => PlaneData::F32(vec![get(&Sample::MISS) as f32; area]),
                    Get::U32(get) => PlaneData::U32(vec![get(&Sample::MISS); area]),
                },
            })
            .collect();
        Self { channels, film: Film { width, height, window, planes } }
    }

    /// Sets pixel (x, y) if it lies in the film's window.
    pub fn put(&mut self, x: u32, y: u32, pixel: &Sample) {
        let Some(index) = self.film.window.index(x, y) else { return };
        for (channel, plane) in self.channels.iter().zip(&mut self.film.planes) {
            match (channel.get, &mut plane.data) {
                (Get::F32(get), PlaneData::F32(data)) => data[index] = get(pixel) as f32,
                (Get::U32(get), PlaneData::U32(data)) => data[index] = get(pixel),
                _ => unreachable!("planes are made from the channels"),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_average_and_the_nearest_gives_distance_and_ids() {
        let far = Sample { radiance: DVec3::X, alpha: 1.0, distance: 9.0, inst: 1, prim: 2, ..Sample::MISS };
        let near = Sample { distance: 3.0, prim: 5, nodes: 8.0, ..far };
        let twin = Sample { prim: 6, ..near };
        let mut sum = Sample::MISS;
        [far, Sample::MISS, near, twin].iter().for_each(|s| add(&mut sum, s));
        let pixel = mean(&sum, 4);
        assert_eq!((pixel.radiance, pixel.alpha, pixel.nodes), (DVec3::X * 0.75, 0.75, 4.0));
        assert_eq!((pixel.distance, pixel.inst, pixel.prim), (3.0, 1, 5));
    }

    #[test]
    fn planes_are_named_and_row_major_over_the_window() {
        let window = Window { x0: 4, y0: 2, x1: 7, y1: 4 };
        let mut painter = Painter::new(10, 10, window, &[Aov::Primitive, Aov::Z]);
        let pixel = Sample { radiance: DVec3::new(1.0, 2.0, 3.0), alpha: 1.0, distance: 4.0, prim: 9, ..Sample::MISS };
        painter.put(5, 3, &pixel);
        let names: Vec<&str> = painter.film.planes.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["R", "G", "B", "A", "Z", "id.primitive"]);
        let (inf, none) = (f32::INFINITY, u32::MAX);
        assert_eq!(painter.film.planes[2].data, PlaneData::F32(vec![0.0, 0.0, 0.0, 0.0, 3.0, 0.0]));
        assert_eq!(painter.film.planes[4].data, PlaneData::F32(vec![inf, inf, inf, inf, 4.0, inf]));
        assert_eq!(painter.film.planes[5].data, PlaneData::U32(vec![none, none, none, none, 9, none]));
    }
}
