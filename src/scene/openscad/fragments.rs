//! How many straight pieces a curve has: OpenSCAD's rules of `$fn`, `$fa` and `$fs`.
//!
//! Source: OpenSCAD's manual, and its program where that says no more.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use glam::DVec2;

/// A circle smaller than this has three pieces; OpenSCAD rounds places to multiples of it.
pub(super) const GRID: f64 = 1.0 / 1_048_576.0;
/// Most pieces of a curve.
pub(super) const MAX_PIECES: usize = 1 << 16;
/// Least `$fa` and `$fs`.
const LEAST: f64 = 0.01;

/// `$fn`, `$fa` (degrees) and `$fs` (units).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Resolution {
    count: f64,
    angle: f64,
    length: f64,
}

/// A number of pieces, refused if it is too large.
fn pieces(wanted: f64) -> Result<usize, String> {
    if wanted > MAX_PIECES as f64 {
        return Err(format!("its curves would have {wanted} pieces, at most {MAX_PIECES} are read"));
    }
    Ok(wanted as usize)
}

impl Resolution {
    /// Of `$fn`, `$fa` and `$fs`.
    pub fn new(count: f64, angle: f64, length: f64) -> Self {
        Self { count, angle: angle.max(LEAST), length: length.max(LEAST) }
    }

    /// Pieces of a whole circle of this radius.
    ///
    /// # Errors
    /// More than [`MAX_PIECES`].
    pub fn circle(&self, radius: f64) -> Result<usize, String> {
        if radius < GRID {
            return Ok(3);
        }
        if self.count > 0.0 {
            return pieces(self.count.max(3.0));
        }
        pieces((360.0 / self.angle).min(radius * 2.0 * PI / self.length).max(5.0).ceil())
    }

    /// Slices of an extrusion to `height` that is twisted by `twist` degrees and scaled to `scale`; `reach`: the square
    /// of the largest distance of a corner from the axis.
    ///
    /// # Errors
    /// More than [`MAX_PIECES`].
    pub fn twisted(&self, reach: f64, height: f64, twist: f64, scale: DVec2) -> Result<usize, String> {
        let (turn, radius) = (twist.abs(), reach.sqrt());
        // Less than half a turn a slice, or it would pass through itself.
        let least = (turn / 120.0).ceil().max(1.0);
        if radius < GRID {
            return pieces(least);
        }
        if self.count > 0.0 {
            return pieces((turn / 360.0 * self.count).ceil().max(least));
        }
        let angle = turn.to_radians();
        let length = match scale.x == scale.y && scale.x != 1.0 {
            // The arc of a helix.
            false => angle * (reach + (height / angle).powi(2)).sqrt(),
            // A part of Archimedes' spiral, as long as its corner's way seen from above, and the height.
            true => {
                let end = if scale.x > 1.0 { angle * scale.x / (scale.x - 1.0) } else { angle / (1.0 - scale.x) };
                let arc = |t: f64| 0.5 * radius / end * (t * (1.0 + t * t).sqrt() + t.asinh());
                (arc(end) - arc(end - angle)).hypot(height)
            }
        };
        pieces((turn / self.angle).ceil().min((length / self.length).ceil()).max(least))
    }

    /// Slices of an extrusion that is scaled along one axis more than along the other; `shift`: the square of the
    /// farthest way of a corner.
    ///
    /// # Errors
    /// More than [`MAX_PIECES`].
    pub fn slanted(&self, shift: f64, height: f64) -> Result<usize, String> {
        if shift.sqrt() < GRID {
            return Ok(1);
        }
        if self.count > 0.0 {
            return pieces(self.count.floor().max(1.0));
        }
        pieces((shift.sqrt().hypot(height) / self.length).ceil().max(1.0))
    }
}

/// Cosine and sine of an angle in degrees: exact where they are rational, and alike in all quadrants, so that what is
/// symmetric stays so.
pub(super) fn direction(degrees: f64) -> DVec2 {
    let angle = degrees.rem_euclid(360.0);
    let quarter = (angle / 90.0).floor();
    let (cos, sin) = first_quarter(angle - 90.0 * quarter);
    match quarter as u32 {
        0 => DVec2::new(cos, sin),
        1 => DVec2::new(-sin, cos),
        2 => DVec2::new(-cos, -sin),
        _ => DVec2::new(sin, -cos),
    }
}

/// Cosine and sine of 0 to 90 degrees.
fn first_quarter(degrees: f64) -> (f64, f64) {
    if degrees == 0.0 {
        (1.0, 0.0)
    } else if degrees == 30.0 {
        (0.75_f64.sqrt(), 0.5)
    } else if degrees == 60.0 {
        (0.5, 0.75_f64.sqrt())
    } else if degrees == 45.0 {
        (FRAC_1_SQRT_2, FRAC_1_SQRT_2)
    } else if degrees > 45.0 {
        let (sin, cos) = (90.0 - degrees).to_radians().sin_cos();
        (sin, cos)
    } else {
        let (sin, cos) = degrees.to_radians().sin_cos();
        (cos, sin)
    }
}

/// The corners of a regular polygon, the first on the x axis, counter-clockwise.
pub(super) fn circle(radius: f64, count: usize) -> impl Iterator<Item = DVec2> {
    (0..count).map(move |i| direction(360.0 * i as f64 / count as f64) * radius)
}
