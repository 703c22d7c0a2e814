//! Regions without bounds: a ray that meets nothing may be inside one for ever.

use glam::DVec3;

use crate::lanes::{LaneMask, Lanes, Lanes3, dot};
use crate::math::NormalMap;
use crate::scene::assembly::{AssemblyObject, PartKind};
use crate::scene::brlcad::describe::Looks;
use crate::scene::description::Shape;
use crate::scene::solids::Solid;
use crate::scene::solids::flat::{Operator, Step};

/// Cosines up to this are those of directions along a plane.
const ALONG: f64 = 1e-6;

/// Which regions have no bounds, and where they reach to.
pub(super) struct Endless {
    regions: Vec<bool>,
    reach: Reach,
}

/// Where they reach to.
enum Reach {
    /// To infinity in half-spaces with these outward normals, unit.
    Below(Vec<DVec3>),
    /// Anywhere.
    Everywhere,
}

impl Endless {
    /// Of the regions that look like `looks`, which are the parts of `object`.
    pub fn new(looks: &Looks, object: Option<&AssemblyObject>) -> Self {
        let regions: Vec<bool> = looks.regions.iter().map(|look| look.bounds.is_none()).collect();
        let endless = regions.iter().enumerate().filter(|(_, is_endless)| **is_endless);
        let normals: Option<Vec<Vec<DVec3>>> = endless.map(|(region, _)| normals(object?, region)).collect();
        let reach = normals.map_or(Reach::Everywhere, |normals| Reach::Below(normals.concat()));
        Self { regions, reach }
    }

    /// Whether `region` is one.
    pub fn contains(&self, region: u32) -> bool {
        self.regions[region as usize]
    }

    /// Which of `lanes` may end inside one, by their directions.
    #[inline]
    pub fn may_hold<V: Lanes>(&self, dir: Lanes3<V>, lanes: u32) -> u32 {
        let below = |n: &DVec3| dot(n.to_array().map(V::constant), dir).cmp_le(V::constant(ALONG)).bits();
        match &self.reach {
            Reach::Below(normals) if lanes != 0 => normals.iter().fold(0, |held, normal| held | below(normal)) & lanes,
            Reach::Below(_) => 0,
            Reach::Everywhere => lanes,
        }
    }
}

/// Outward normals of the half-spaces of region `region`; `None` if something else may have no bounds, or what is inside
/// need not be inside of any leaf.
fn normals(object: &AssemblyObject, region: usize) -> Option<Vec<DVec3>> {
    let part = object.parts.get(region)?;
    let PartKind::Solids(tree) = &part.kind else { return None };
    if tree.steps.iter().any(|step| matches!(step, Step::Op(Operator::Complement, _))) {
        return None;
    }
    let mut normals = Vec::new();
    for leaf in &tree.leaves {
        let (lo, hi) = leaf.solid.bounds();
        if matches!(leaf.solid, Solid::Shape(Shape::HalfSpace)) {
            normals.push(NormalMap::new(&(part.to_object * leaf.to_tree)).apply(DVec3::Z));
        } else if !(lo.is_finite() && hi.is_finite()) {
            return None;
        }
    }
    Some(normals)
}
