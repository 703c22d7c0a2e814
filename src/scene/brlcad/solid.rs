//! Solids with the parameters of the database, in millimetres.

use glam::DVec3;

/// A solid as the database gives it. Points and vectors are in the solid's own space.
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// Convex polyhedron with 4 to 8 corners: faces are four corners each (see [`ARB_FACES`]), some may coincide.
    Arb {
        /// The corners.
        points: [DVec3; 8],
    },
    /// Ellipsoid.
    Ell {
        /// Centre.
        v: DVec3,
        /// The three semi-axes.
        axes: [DVec3; 3],
    },
    /// Truncated general cone: elliptic ends, the axis may be oblique.
    Tgc {
        /// Centre of the base.
        v: DVec3,
        /// From the centre of the base to the centre of the top.
        h: DVec3,
        /// Semi-axes of the base.
        base: [DVec3; 2],
        /// Semi-axes of the top, parallel to those of the base.
        top: [DVec3; 2],
    },
    /// Torus.
    Tor {
        /// Centre.
        v: DVec3,
        /// Unit axis.
        h: DVec3,
        /// Distance of the tube's centre from the axis.
        major: f64,
        /// Radius of the tube.
        minor: f64,
    },
    /// Half-space `n . p <= d`.
    Half {
        /// Unit outward normal.
        n: DVec3,
        /// Distance of the plane from the origin along the normal.
        d: f64,
    },
    /// Elliptic hyperboloid of one sheet's cap: a bowl with a hyperbola's profile and an elliptic rim at `v`.
    Ehy {
        /// Centre of the elliptic base.
        v: DVec3,
        /// From the base to the apex.
        h: DVec3,
        /// Unit direction of the first semi-axis of the base.
        a: DVec3,
        /// First semi-axis.
        r1: f64,
        /// Second semi-axis.
        r2: f64,
        /// Distance from the apex to the vertex of the asymptotic cone.
        c: f64,
    },
    /// Elliptic paraboloid.
    Epa {
        /// Centre of the elliptic base.
        v: DVec3,
        /// From the base to the apex.
        h: DVec3,
        /// Unit direction of the first semi-axis.
        a: DVec3,
        /// First semi-axis.
        r1: f64,
        /// Second semi-axis.
        r2: f64,
    },
    /// Right parabolic cylinder.
    Rpc {
        /// Middle of the base rectangle's first edge.
        v: DVec3,
        /// Length along the cylinder.
        h: DVec3,
        /// From the base to the apex of the parabola.
        b: DVec3,
        /// Half the width of the base.
        r: f64,
    },
    /// Right hyperbolic cylinder.
    Rhc {
        /// Middle of the base rectangle's first edge.
        v: DVec3,
        /// Length along the cylinder.
        h: DVec3,
        /// From the base to the apex of the hyperbola.
        b: DVec3,
        /// Half the width of the base.
        r: f64,
        /// Distance from the apex to the vertex of the asymptotes.
        c: f64,
    },
    /// Elliptic hyperboloid of one sheet between two planes.
    Hyp {
        /// Centre of the base.
        v: DVec3,
        /// From base to top.
        h: DVec3,
        /// First semi-axis of the base.
        a: DVec3,
        /// Length of the second semi-axis of the base.
        b: f64,
        /// Neck to base ratio.
        neck: f64,
    },
    /// Elliptic torus.
    Eto {
        /// Centre.
        v: DVec3,
        /// Axis.
        n: DVec3,
        /// Major semi-axis of the tube's ellipse.
        c: DVec3,
        /// Distance of the tube's centre from the axis.
        r: f64,
        /// Minor semi-axis of the tube's ellipse.
        rd: f64,
    },
    /// Particle: the convex hull of two spheres.
    Part {
        /// Centre of the first sphere.
        v: DVec3,
        /// From there to the centre of the second.
        h: DVec3,
        /// Radius of the first sphere.
        r_v: f64,
        /// Radius of the second sphere.
        r_h: f64,
    },
    /// Pipe: straight runs and bends.
    Pipe(Vec<PipePoint>),
    /// Convex polyhedron as an intersection of half-spaces.
    Arbn(Vec<(DVec3, f64)>),
    /// Triangles.
    Bot {
        /// How they enclose: 1 surface, 2 solid, 3 plate, 4 plate without cosine.
        mode: u8,
        /// The vertices.
        vertices: Vec<DVec3>,
        /// Vertex numbers of each triangle, all in range.
        faces: Vec<[u32; 3]>,
    },
}

/// Vertex numbers of the faces of an [`Solid::Arb`], in BRL-CAD's order.
pub const ARB_FACES: [[usize; 4]; 6] =
    [[3, 2, 1, 0], [4, 5, 6, 7], [4, 7, 3, 0], [2, 6, 5, 1], [1, 5, 4, 0], [7, 6, 2, 3]];

/// A point of a [`Solid::Pipe`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PipePoint {
    /// Where the axes of two runs meet.
    pub at: DVec3,
    /// Outer diameter.
    pub outer: f64,
    /// Inner diameter.
    pub inner: f64,
    /// Radius of the bend.
    pub bend: f64,
}

impl Solid {
    /// BRL-CAD's name for the kind.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Arb { .. } => "arb8",
            Self::Ell { .. } => "ell",
            Self::Tgc { .. } => "tgc",
            Self::Tor { .. } => "tor",
            Self::Half { .. } => "half",
            Self::Ehy { .. } => "ehy",
            Self::Epa { .. } => "epa",
            Self::Rpc { .. } => "rpc",
            Self::Rhc { .. } => "rhc",
            Self::Hyp { .. } => "hyp",
            Self::Eto { .. } => "eto",
            Self::Part { .. } => "part",
            Self::Pipe(_) => "pipe",
            Self::Arbn(_) => "arbn",
            Self::Bot { .. } => "bot",
        }
    }

    /// What BRL-CAD calls the centre of the solid; `None` for a half-space and for kinds that make no lights.
    pub fn centre(&self) -> Option<DVec3> {
        match self {
            Self::Arb { points } => Some(points.iter().sum::<DVec3>() / 8.0),
            Self::Ell { v, .. } | Self::Tor { v, .. } | Self::Eto { v, .. } => Some(*v),
            Self::Tgc { v, h, .. } => Some(*v + *h * 0.5),
            Self::Part { v, h, .. } => Some(*v + *h * 0.5),
            _ => None,
        }
    }

    /// The eight corners of an arb of `count` = 4 to 8 given ones: corners beyond them coincide with others, so that
    /// [`ARB_FACES`] describes all five kinds.
    pub(super) fn arb(given: &[DVec3]) -> Option<Self> {
        const ORDER: [[usize; 8]; 5] = [
            [0, 1, 2, 0, 3, 3, 3, 3],
            [0, 1, 2, 3, 4, 4, 4, 4],
            [0, 1, 2, 3, 4, 4, 5, 5],
            [0, 1, 2, 3, 4, 5, 6, 4],
            [0, 1, 2, 3, 4, 5, 6, 7],
        ];
        let order = ORDER.get(given.len().checked_sub(4)?)?;
        Some(Self::Arb { points: order.map(|i| given[i]) })
    }
}
