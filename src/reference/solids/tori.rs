//! Where a line is inside tori: by distance functions, which no expansion into powers of t can match in digits.

use glam::{DVec2, DVec3};

use super::super::spans::Span;
use super::leaf::bisected;

/// Intervals shorter than this (units of the canonical solid) are looked through no further.
const FINEST: f64 = 1e-7;

/// The torus is where the distance to its circle is at most the tube's radius. The distance changes along the line no
/// faster than the line moves, so an interval whose middle is farther from the surface than half its length has no
/// boundary in it.
pub(super) fn torus(minor: f64, org: DVec3, dir: DVec3) -> Vec<Span> {
    let depth = |p: DVec3| {
        let depth = (p.x.hypot(p.y) - 1.0).hypot(p.z) - minor;
        (depth, depth <= 0.0)
    };
    searched(1.0 + minor, org, dir, depth)
}

/// An ellipse in a half-plane of the axis, or its continuation beyond the axis.
struct Ellipse {
    /// Directions (outwards, up) of the semi-axes.
    axes: [DVec2; 2],
    lengths: [f64; 2],
    /// 1 or, beyond the axis, -1.
    side: f64,
}

impl Ellipse {
    /// u^2 - 2 k u z + z^2 = (1 - k^2) w^2 has its axes on the diagonals.
    fn new(reach: f64, lean: f64, side: f64) -> Self {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let lengths = [1.0, -1.0].map(|sign| reach * (1.0 + sign * lean).sqrt());
        Self { axes: [DVec2::new(half, half), DVec2::new(-half, half)], lengths, side }
    }

    /// Coordinates of `p` along the semi-axes, their lengths being 1.
    fn scaled(&self, p: DVec3) -> DVec2 {
        let q = DVec2::new(self.side * p.x.hypot(p.y) - 1.0, p.z);
        DVec2::new(self.axes[0].dot(q) / self.lengths[0], self.axes[1].dot(q) / self.lengths[1])
    }

    /// Negative inside; changes no faster than `p` moves.
    fn depth(&self, p: DVec3) -> f64 {
        (self.scaled(p).length() - 1.0) * self.lengths[0].min(self.lengths[1])
    }

    /// Out of the ellipse.
    fn gradient(&self, p: DVec3) -> DVec3 {
        let scaled = self.scaled(p);
        let flat = self.axes[0] * (scaled.x / self.lengths[0]) + self.axes[1] * (scaled.y / self.lengths[1]);
        DVec3::new(p.x, p.y, 0.0).normalize_or(DVec3::X) * (self.side * flat.x) + DVec3::Z * flat.y
    }
}

/// The elliptic torus is where one of the two ellipses is and the other is not.
pub(super) fn elliptic_torus(reach: f64, lean: f64, org: DVec3, dir: DVec3) -> Vec<Span> {
    let [here, beyond] = [1.0, -1.0].map(|side| Ellipse::new(reach, lean, side));
    let depth = |p: DVec3| {
        let (a, b) = (here.depth(p), beyond.depth(p));
        (a.abs().min(b.abs()), (a <= 0.0) != (b <= 0.0))
    };
    searched((1.0 + reach).hypot(reach), org, dir, depth)
}

/// Outward normal of the elliptic torus at a point of its surface, unnormalised: of the ellipse on this side of the axis, or
/// of the one that has crossed it, whichever is there.
pub(super) fn elliptic_normal(reach: f64, lean: f64, p: DVec3) -> DVec3 {
    let [here, beyond] = [1.0, -1.0].map(|side| Ellipse::new(reach, lean, side));
    let (at_here, at_beyond) = (here.depth(p), beyond.depth(p));
    let (gradient, other) = match at_here.abs() <= at_beyond.abs() {
        true => (here.gradient(p), at_beyond),
        false => (beyond.gradient(p), at_here),
    };
    // Out of what is swept over twice is into the solid.
    if other < 0.0 { -gradient } else { gradient }
}

/// Where a line is inside what lies in the ball of radius `ball`. `depth` gives a number whose magnitude is no more than
/// the distance to the surface, and whether the point is inside.
fn searched(ball: f64, org: DVec3, dir: DVec3, depth: impl Fn(DVec3) -> (f64, bool)) -> Vec<Span> {
    let speed = dir.length();
    let middle = -org.dot(dir) / (speed * speed);
    let near = org + middle * dir;
    let reach = ball + 1e-3;
    let room = reach * reach - near.length_squared();
    if room <= 0.0 {
        return Vec::new();
    }
    let unit = dir / speed;
    let at = |s: f64| depth(near + s * unit);
    let inside = |s: f64| at(s).1;
    let mut roots = Vec::new();
    let mut open = vec![(-room.sqrt(), room.sqrt())];
    while let Some((a, b)) = open.pop() {
        let middle = 0.5 * (a + b);
        if at(middle).0.abs() > 0.5 * (b - a) * (1.0 + 1e-9) {
            continue;
        }
        if b - a > FINEST {
            // Later parts first: the earlier ones come off the stack first.
            open.extend([(middle, b), (a, middle)]);
        } else if inside(a) != inside(b) {
            roots.push(bisected(&|s| if inside(s) { -1.0 } else { 1.0 }, a, b));
        }
    }
    let at = |s: f64| middle + s / speed;
    roots.chunks_exact(2).map(|pair| Span::new(at(pair[0]), at(pair[1]), 0, 0)).collect()
}
