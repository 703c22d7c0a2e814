//! What shines in each material: itself, and what it mixes by their shares.

use std::collections::BTreeMap;

use crate::scene::description::Material;
use crate::scene::material::Scattering;

/// Deepest nesting of mixtures that is followed.
const DEEPEST: usize = 32;

/// The materials that shine in each material, with their shares, by its number.
#[derive(Debug)]
pub struct Glows(Vec<Vec<(u32, f64)>>);

impl Glows {
    /// Those of all `materials`.
    pub fn new(materials: &[&Material]) -> Self {
        Self((0..materials.len() as u32).map(|id| glow(materials, id)).collect())
    }

    /// Those of material `id`; a number beyond the list means the first.
    #[inline]
    pub fn of(&self, id: u32) -> &[(u32, f64)] {
        self.0.get(id as usize).or(self.0.first()).map_or(&[], Vec::as_slice)
    }
}

/// Level by level, each material once per level: a mixture may name another one many times.
fn glow(materials: &[&Material], id: u32) -> Vec<(u32, f64)> {
    let mut found: BTreeMap<u32, f64> = BTreeMap::new();
    let mut level = BTreeMap::from([(id, 1.0)]);
    for _ in 0..DEEPEST {
        if level.is_empty() {
            break;
        }
        let mut next: BTreeMap<u32, f64> = BTreeMap::new();
        for (id, share) in level {
            let Some(material) = materials.get(id as usize) else { continue };
            if material.emission != glam::DVec3::ZERO {
                *found.entry(id).or_default() += share;
            }
            if let Scattering::Mix { first, second, amount } = material.scattering {
                let amount = amount.clamp(0.0, 1.0);
                *next.entry(first).or_default() += share * (1.0 - amount);
                *next.entry(second).or_default() += share * amount;
            }
        }
        level = next;
    }
    found.into_iter().filter(|&(_, share)| share > 0.0).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn mixtures_shine_by_shares() {
        let lamp = |level| Material { emission: DVec3::splat(level), ..Material::default() };
        let mix = |first, second, amount| Material {
            scattering: Scattering::Mix { first, second, amount },
            ..Material::default()
        };
        // Numbers 3 and 4 mix 0 and 1, and 3 and 0; 5 mixes itself.
        let all = [lamp(1.0), lamp(0.0), lamp(4.0), mix(0, 1, 0.25), mix(3, 0, 0.5), mix(5, 2, 0.5)];
        let glows = Glows::new(&all.iter().collect::<Vec<_>>());
        assert_eq!(glows.of(0), [(0, 1.0)]);
        assert!(glows.of(1).is_empty());
        assert_eq!(glows.of(3), [(0, 0.75)]);
        assert_eq!(glows.of(4), [(0, 0.875)]);
        assert!((glows.of(5)[0].1 - 1.0).abs() < 1e-9);
        assert_eq!(glows.of(99), [(0, 1.0)], "as the default material");
    }
}
