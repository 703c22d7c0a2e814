//! Parts of a line inside something, with the faces at their ends, and the simplest things they are made of.

use glam::DVec3;

/// Where a line meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    pub t: f64,
    pub face: u32,
}

/// The part of a line inside something convex, with the faces at its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub enter: Crossing,
    pub leave: Crossing,
}

impl Span {
    pub fn new(t0: f64, t1: f64, face0: u32, face1: u32) -> Self {
        Self { enter: Crossing { t: t0, face: face0 }, leave: Crossing { t: t1, face: face1 } }
    }

    pub fn all() -> Self {
        Self::new(f64::NEG_INFINITY, f64::INFINITY, 0, 0)
    }

    /// The common part; the faces of `self` win where ends coincide.
    pub fn and(self, other: Self) -> Option<Self> {
        let enter = if other.enter.t > self.enter.t { other.enter } else { self.enter };
        let leave = if other.leave.t < self.leave.t { other.leave } else { self.leave };
        (enter.t <= leave.t).then_some(Self { enter, leave })
    }

    pub fn length(&self) -> f64 {
        self.leave.t - self.enter.t
    }

    /// The same part with a number added to both parameters.
    pub fn moved(self, by: f64) -> Self {
        let moved = |c: Crossing| Crossing { t: c.t + by, ..c };
        Self { enter: moved(self.enter), leave: moved(self.leave) }
    }
}

/// Where `lo <= org + t dir <= hi` on one axis; `low` and `high` are the faces there.
pub(super) fn slab(org: f64, dir: f64, lo: f64, hi: f64, low: u32, high: u32) -> Option<Span> {
    let (t_lo, t_hi) = ((lo - org) / dir, (hi - org) / dir);
    match dir {
        d if d > 0.0 => Some(Span::new(t_lo, t_hi, low, high)),
        d if d < 0.0 => Some(Span::new(t_hi, t_lo, high, low)),
        _ => (lo <= org && org <= hi).then(Span::all),
    }
}

/// The box [-half, half]^3 with faces 0..5 = -x, +x, -y, +y, -z, +z.
pub(super) fn cuboid(org: DVec3, dir: DVec3, half: f64) -> Option<Span> {
    let mut span = Span::all();
    for axis in 0..3 {
        let face = 2 * axis as u32;
        span = slab(org[axis], dir[axis], -half, half, face, face + 1)?.and(span)?;
    }
    Some(span)
}

/// Where `a t^2 + 2 b t + c <= 0`, face 0: one span, or two unbounded ones when a < 0.
pub(super) fn quadric(a: f64, b: f64, c: f64) -> [Option<Span>; 2] {
    let half_line = |t0, t1| Some(Span::new(t0, t1, 0, 0));
    let (inf, disc) = (f64::INFINITY, b * b - a * c);
    if a == 0.0 {
        let t = -c / (2.0 * b);
        return match b {
            b if b > 0.0 => [half_line(-inf, t), None],
            b if b < 0.0 => [half_line(t, inf), None],
            _ => [(c <= 0.0).then(Span::all), None],
        };
    }
    if disc < 0.0 {
        return [(a < 0.0).then(Span::all), None];
    }
    // One root has no cancellation, the other follows from their product c / a.
    let q = -(b + disc.sqrt().copysign(b));
    let (r, s) = (q / a, if q == 0.0 { 0.0 } else { c / q });
    let (lo, hi) = (r.min(s), r.max(s));
    if a > 0.0 { [half_line(lo, hi), None] } else { [half_line(-inf, lo), half_line(hi, inf)] }
}
