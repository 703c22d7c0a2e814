//! A surface that a path has arrived at, as one point in f64: where lanes do not know, and for pictures of first hits.

use glam::DVec3;

use super::Paths;
use crate::lanes::Real;
use crate::ray::Hits;
use crate::scene::world::Surface;
use crate::shade::look::Look;
use crate::shade::sample::FirstHit;

/// A surface, and whether it is seen from the side of its normal.
pub struct Seen<'w> {
    pub surface: Surface<'w>,
    pub from_front: bool,
}

/// A surface with normals towards the viewer and what it scatters with.
pub struct Arrival<'w> {
    pub surface: Surface<'w>,
    pub ng: DVec3,
    /// `ng` itself where the viewer is behind the shading normal.
    pub ns: DVec3,
    pub look: Look,
}

impl<'w> Seen<'w> {
    /// The same of material `material`, no mixture, seen along `dir`.
    pub fn resolved<S: Real>(self, paths: &Paths<'_, S>, material: u32, dir: DVec3) -> Arrival<'w> {
        let Self { surface, from_front } = self;
        let turned = |n: DVec3| if from_front { n } else { -n };
        let (ng, ns) = (turned(surface.ng), turned(paths.looks.bumped(material, &surface)));
        let ns = if -ns.dot(dir.normalize_or_zero()) > 1e-3 { ns } else { ng };
        Arrival { surface, ng, ns, look: paths.looks.look(material, &surface, from_front) }
    }
}

impl Arrival<'_> {
    /// What pictures show of the first hit, besides radiance.
    pub fn show<S: Real>(&self, i: usize, dir: DVec3, hits: &Hits<S>, seen: &mut FirstHit) {
        seen.distance = hits.t[i].to_f64() * dir.length();
        seen.position = self.surface.position;
        (seen.normal, seen.shading_normal) = (self.ng, self.ns);
        seen.albedo = self.look.base;
        (seen.inst, seen.prim, seen.material) = (hits.inst[i], hits.prim[i], self.surface.material);
    }
}
