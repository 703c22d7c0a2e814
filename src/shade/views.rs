//! Integrators that show one property of the first hit.

use glam::DVec3;

use super::sample::Sample;

/// Heat of a cost, from cold to hot; linear Rec.709, brighter is dearer.
const HEAT: [DVec3; 5] = [
    DVec3::new(0.0, 0.0, 0.02),
    DVec3::new(0.1, 0.0, 0.4),
    DVec3::new(0.8, 0.1, 0.1),
    DVec3::new(1.0, 0.7, 0.0),
    DVec3::new(1.0, 1.0, 1.0),
];
/// The hottest colour stands for 2^6 - 1 node visits per ray.
const HOTTEST_LOG2: f64 = 6.0;

/// Normals n as 0.5 + 0.5 n; misses black.
pub(super) fn normals(out: &mut [Sample]) {
    for sample in out.iter_mut().filter(|s| s.alpha > 0.0) {
        sample.radiance = 0.5 + 0.5 * sample.normal;
    }
}

/// Distances; misses 0.
pub(super) fn depth(out: &mut [Sample]) {
    for sample in out.iter_mut().filter(|s| s.alpha > 0.0) {
        sample.radiance = DVec3::splat(sample.distance);
    }
}

/// Node visits as heat, also of misses, on a fixed logarithmic scale so that two pictures can be compared.
pub(super) fn cost(out: &mut [Sample]) {
    for sample in out {
        sample.radiance = heat((1.0 + sample.nodes).log2() / HOTTEST_LOG2);
        sample.alpha = 1.0;
    }
}

fn heat(x: f64) -> DVec3 {
    let place = x.clamp(0.0, 1.0) * (HEAT.len() - 1) as f64;
    let below = (place as usize).min(HEAT.len() - 2);
    HEAT[below].lerp(HEAT[below + 1], place - below as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_hit_views_by_hand() {
        let hit = Sample { alpha: 1.0, distance: 2.5, normal: -DVec3::Z, ..Sample::MISS };
        let mut out = [hit, Sample::MISS];
        normals(&mut out);
        assert_eq!(out.map(|s| s.radiance), [DVec3::new(0.5, 0.5, 0.0), DVec3::ZERO]);
        depth(&mut out);
        assert_eq!(out.map(|s| s.radiance), [DVec3::splat(2.5), DVec3::ZERO]);
    }

    #[test]
    fn dearer_is_brighter() {
        let mut out: Vec<Sample> =
            [0.0, 1.0, 7.0, 30.0, 63.0, 1e9].map(|nodes| Sample { nodes, ..Sample::MISS }).to_vec();
        cost(&mut out);
        let luminance = |s: &Sample| s.radiance.dot(DVec3::new(0.2126, 0.7152, 0.0722));
        assert!(out.windows(2).all(|w| luminance(&w[0]) <= luminance(&w[1])));
        assert_eq!(out[2].radiance, HEAT[2], "log2(8) is the middle of 0 to 6");
        assert_eq!((out[4].radiance, out[5].radiance), (DVec3::ONE, DVec3::ONE));
    }
}
