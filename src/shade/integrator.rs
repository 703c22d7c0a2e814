//! The integrators by name.

use crate::error::{Error, Result, by_name};

/// What a picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Recursive ray tracing: Lambert, ambient, shadows, mirrors.
    /// Source: T. Whitted, *An Improved Illumination Model for Shaded Display*, CACM 23(6), 1980.
    #[default]
    Whitted,
    /// Path tracing: all light that scatters at surfaces.
    /// Source: J. Kajiya, *The Rendering Equation*, SIGGRAPH 1986.
    Path,
    /// Ambient occlusion: the cosine-weighted share of directions that are free up to a radius.
    Ao,
    /// Geometric normals turned towards the viewer, as 0.5 + 0.5 n.
    Normals,
    /// Distance from the ray's origin to the hit, scene units.
    Depth,
    /// Tree nodes visited per primary ray, as a heat map.
    Cost,
    /// BRL-CAD's `rt`: its shaders and lights, for its databases only.
    Rt,
}

impl Integrator {
    /// All integrators.
    pub const ALL: [Self; 7] = [Self::Whitted, Self::Path, Self::Ao, Self::Normals, Self::Depth, Self::Cost, Self::Rt];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whitted => "whitted",
            Self::Path => "path",
            Self::Ao => "ao",
            Self::Normals => "normals",
            Self::Depth => "depth",
            Self::Cost => "cost",
            Self::Rt => "rt",
        }
    }

    /// Mirrors or scatterings followed unless somebody asks for more or less: a path's light keeps scattering.
    pub fn depth(self) -> u32 {
        if self == Self::Path { 16 } else { 4 }
    }

    /// Whether pictures are made of what samples say of first hits.
    pub(super) fn shows_hits(self) -> bool {
        matches!(self, Self::Normals | Self::Depth)
    }

    /// Whether points on surfaces are worked out in lanes by [`super::Shader`] itself.
    pub(super) fn works_on_vertices(self) -> bool {
        matches!(self, Self::Whitted | Self::Ao)
    }
}

impl std::str::FromStr for Integrator {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        by_name("integrator", &Self::ALL, Self::name, name)
    }
}
