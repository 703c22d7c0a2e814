//! Rays inside glass: refraction, internal reflection, and the way out.

use glam::DVec3;

use super::level::{Found, Level};
use super::{AIR, Carry, Path, Within};
use crate::lanes::Real;

/// Gaps of air thinner than this, mm, do not count as air.
pub(super) const AIR_GAP: f64 = 0.01;
/// Most internal reflections; after them the ray goes straight on.
const MAX_REFLECTIONS: u32 = 5;

/// The direction of a ray along unit `dir` behind a surface with unit `normal` (either side), from refractive index
/// `from` into `to`; `Err` holds the mirrored direction where nothing passes. Source: Snell's law.
pub(super) fn refract(dir: DVec3, normal: DVec3, from: f64, to: f64) -> Result<DVec3, DVec3> {
    if from == to {
        return Ok(dir);
    }
    let n = if normal.dot(dir) > 0.0 { -normal } else { normal };
    let (cosine, ratio) = (-dir.dot(n), from / to);
    let rest = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    if rest < 0.0 {
        return Err(dir + n * (2.0 * cosine));
    }
    Ok((dir * ratio + n * (ratio * cosine - rest.sqrt())).normalize())
}

/// Path `i` of `level`, inside glass, has met something: it leaves, or is reflected and goes on inside.
pub(super) fn step<S: Real>(level: &Level<S>, i: usize, found: &Found<S>, next: &mut Level<S>) {
    let path = level.path(i);
    let Some(within) = path.carry.within else { return };
    let escape = |org: DVec3, dir: DVec3| {
        let (left, level) = (Some(within.region), path.carry.level + 1);
        Path { org, dir, carry: Carry { level, index: AIR, left, within: None, ..path.carry } }
    };
    if !found.is_hit(i) || !found.is_leaving(i) {
        // Something else is in the glass, or the ray only grazed it.
        next.push(&escape(path.org, path.dir));
        return;
    }
    let position = found.position(i);
    match refract(path.dir, found.normal(i), within.index, AIR) {
        Ok(dir) => next.push(&escape(position, dir)),
        Err(dir) if within.reflections < MAX_REFLECTIONS => {
            let within = Some(Within { reflections: within.reflections + 1, ..within });
            next.push(&Path { org: position, dir, carry: Carry { within, ..path.carry } });
        }
        Err(_) => next.push(&escape(position, path.dir)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snell_and_total_reflection() {
        let dir = DVec3::new(1.0, 0.0, -1.0).normalize();
        let inside = refract(dir, DVec3::Z, 1.0, 1.5).unwrap();
        assert!((inside.x * 1.5 - dir.x).abs() < 1e-15 && (inside.length() - 1.0).abs() < 1e-15);
        let back = refract(inside, DVec3::NEG_Z, 1.5, 1.0).unwrap();
        assert!((back - dir).length() < 1e-14, "the way back, whatever the side of the normal");
        let grazing = DVec3::new(3.0, 0.0, -1.0).normalize();
        let mirrored = refract(grazing, DVec3::Z, 1.5, 1.0).unwrap_err();
        assert!((mirrored - DVec3::new(grazing.x, 0.0, -grazing.z)).length() < 1e-15);
        assert_eq!(refract(dir, DVec3::Z, 1.3, 1.3), Ok(dir));
    }
}
