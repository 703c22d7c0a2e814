//! Samples into pixels.

use glam::DVec3;

use crate::shade::Sample;

/// Makes a sample the sum of one: the same as adding it to [`Sample::MISS`].
pub(super) fn begin(sample: &mut Sample) {
    sample.square = brightness(sample.radiance).powi(2);
}

/// Makes the sum of one sample the value of its pixel: the same as [`mean`].
pub(super) fn alone(sum: &mut Sample) {
    (sum.square, sum.samples) = (0.0, 1);
}

/// Adds what every picture shows of `sample` to the sum of a pixel's samples.
pub(super) fn add_light(sum: &mut Sample, sample: &Sample) {
    sum.radiance += sample.radiance;
    sum.square += brightness(sample.radiance).powi(2);
    sum.alpha += sample.alpha;
}

/// Adds `sample` to the sum of a pixel's samples. Colours, coverage, normals and costs add up (misses count as 0);
/// distance, position and ids come together from the nearest sample, the first of equals.
pub(super) fn add(sum: &mut Sample, sample: &Sample) {
    add_light(sum, sample);
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
        for sample in [far, Sample::MISS] {
            let (mut first, mut sum) = (sample, Sample::MISS);
            begin(&mut first);
            add(&mut sum, &sample);
            assert_eq!(first, sum);
            alone(&mut first);
            assert_eq!(first, mean(&sum, 1));
        }
    }
}
