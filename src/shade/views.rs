//! Integrators that show one property of the first hit.

use glam::DVec3;

use super::sample::{FirstHit, Rgba, Samples};

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
pub(super) fn normals(out: &mut Samples) {
    show(out, |hit| 0.5 + 0.5 * hit.normal);
}

/// Distances; misses 0.
pub(super) fn depth(out: &mut Samples) {
    show(out, |hit| DVec3::splat(hit.distance));
}

/// Shows `value` of what was hit.
fn show(out: &mut Samples, value: impl Fn(&FirstHit) -> DVec3) {
    for (i, hit) in out.hits.iter().enumerate() {
        let color = out.colors.get(i);
        if color.alpha > 0.0 {
            out.colors.set(i, Rgba { radiance: value(hit), ..color });
        }
    }
}

/// Node visits as heat, also of misses, on a fixed logarithmic scale so that two pictures can be compared (docs/LIGHT.md).
pub(super) fn cost(out: &mut Samples) {
    for (i, hit) in out.hits.iter().enumerate() {
        out.colors.set(i, Rgba { radiance: heat((1.0 + hit.nodes).log2() / HOTTEST_LOG2), alpha: 1.0 });
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
        let hit = FirstHit { distance: 2.5, normal: -DVec3::Z, ..FirstHit::NONE };
        let opaque = Rgba { alpha: 1.0, ..Rgba::default() };
        let mut out =
            Samples { colors: [opaque, Rgba::default()].into_iter().collect(), hits: vec![hit, FirstHit::NONE] };
        let colors = |out: &Samples| [0, 1].map(|i| out.colors.get(i).radiance);
        normals(&mut out);
        assert_eq!(colors(&out), [DVec3::new(0.5, 0.5, 0.0), DVec3::ZERO]);
        depth(&mut out);
        assert_eq!(colors(&out), [DVec3::splat(2.5), DVec3::ZERO]);
    }

    #[test]
    fn dearer_is_brighter() {
        let hits: Vec<_> = [0.0, 1.0, 7.0, 30.0, 63.0, 1e9].map(|nodes| FirstHit { nodes, ..FirstHit::NONE }).into();
        let mut out = Samples { colors: hits.iter().map(|_| Rgba::default()).collect(), hits };
        cost(&mut out);
        let out: Vec<Rgba> = (0..out.colors.len()).map(|i| out.colors.get(i)).collect();
        let luminance = |s: &Rgba| s.radiance.dot(DVec3::new(0.2126, 0.7152, 0.0722));
        assert!(out.windows(2).all(|w| luminance(&w[0]) <= luminance(&w[1])));
        assert_eq!(out[2].radiance, HEAT[2], "log2(8) is the middle of 0 to 6");
        assert_eq!((out[4].radiance, out[5].radiance), (DVec3::ONE, DVec3::ONE));
    }
}
