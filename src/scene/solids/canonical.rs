//! Boxes of canonical solids.

use glam::DVec3;

use super::Solid;
use crate::scene::description::Shape;

impl Solid {
    /// Lower and upper corner of the canonical solid; infinite for a half-space.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let about_axis = |x: f64, y: f64| (DVec3::new(-x, -y, 0.0), DVec3::new(x, y, 1.0));
        match self {
            Self::Shape(Shape::HalfSpace) => (DVec3::NEG_INFINITY, DVec3::INFINITY),
            Self::Shape(Shape::Sphere | Shape::Cuboid) => (DVec3::NEG_ONE, DVec3::ONE),
            Self::Shape(Shape::Disc) => (DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0)),
            Self::Shape(Shape::Cylinder | Shape::Cone { .. }) => about_axis(1.0, 1.0),
            Self::Polyhedron(polyhedron) => polyhedron.bounds(),
            Self::Torus { minor: reach } | Self::EllipticTorus { reach, .. } => {
                let corner = DVec3::new(1.0 + reach, 1.0 + reach, *reach);
                (-corner, corner)
            }
            Self::Taper { x, y, .. } => about_axis(x.max(1.0), y.max(1.0)),
            Self::Round { profile } => {
                let reach = widest(profile);
                about_axis(reach, reach)
            }
            Self::Trough { profile } => about_axis(1.0, widest(profile)),
            Self::Mesh(mesh) => mesh.bounds().unwrap_or((DVec3::ZERO, DVec3::ZERO)),
        }
    }
}

/// Root of the largest value of a profile between 0 and 1.
fn widest([g0, g1, g2]: &[f64; 3]) -> f64 {
    let turn = if *g2 < 0.0 { (-0.5 * g1 / g2).clamp(0.0, 1.0) } else { 0.0 };
    [0.0, turn, 1.0].into_iter().map(|z| g0 + z * (g1 + z * g2)).fold(0.0, f64::max).sqrt()
}
