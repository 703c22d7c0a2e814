//! `linear_extrude` and `rotate_extrude`: figures that move along a line or about the z axis.

use glam::{DVec2, DVec3};

use super::cover::is_convex;
use super::flat::Flat;
use super::fragments::{Resolution, direction};
use super::sweep::Sweep;
use super::work::Work;
use crate::scene::mesh::Mesh;

/// How a figure rises.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rise {
    /// From the lower end to the upper one; z is above 0.
    pub way: DVec3,
    /// Whether the origin is half-way.
    pub is_centred: bool,
    /// Degrees by which it turns clockwise, seen from above.
    pub twist: f64,
    /// What it is scaled to, along x and y, not below 0.
    pub scale: DVec2,
    /// Number of slices, if it is given.
    pub slices: Option<usize>,
}

/// Convex parts of what a figure sweeps that is only moved and scaled.
#[derive(Clone, Debug)]
pub(super) struct Prisms {
    /// Number of corners of the figure: those of the upper end follow those of the lower one.
    pub count: u32,
    /// Triangles that cover it.
    pub cover: Vec<[u32; 3]>,
}

/// What `flat` sweeps while it rises, a closed mesh; and its convex parts, if they are known and it is not convex
/// itself.
///
/// # Errors
/// Too many slices or triangles; a figure parts of which fall together at the upper end.
pub(super) fn rise(
    flat: &Flat,
    rise: &Rise,
    resolution: &Resolution,
    work: &mut Work,
) -> Result<(Mesh, Option<Prisms>), String> {
    let Rise { way, twist, scale, .. } = *rise;
    let slices = match rise.slices {
        Some(slices) => slices.max(1),
        None => slices(flat, rise, resolution)?,
    };
    let mut sweep = Sweep::new(flat, slices + 1, true, work)?;
    let low = if rise.is_centred { way * -0.5 } else { DVec3::ZERO };
    let placed = |slice: usize, p: DVec2| {
        let t = slice as f64 / slices as f64;
        (DVec2::ONE - (DVec2::ONE - scale) * t) * direction(-twist * t).rotate(p)
    };
    for slice in 0..=slices {
        let at = low + way * (slice as f64 / slices as f64);
        sweep.ring(|p| placed(slice, p).extend(0.0) + at);
    }
    let is_flat_above = scale.min_element() == 0.0;
    for slice in 0..slices {
        let is_last = slice + 1 == slices;
        sweep.walls([slice, slice + 1], |p, q, is_hole| {
            let [rising, falling] = [(p, q), (q, p)].map(|(p, q)| (placed(slice, p) - placed(slice + 1, q)).length());
            // As OpenSCAD: the shorter way, and where both are as long one that goes with the turn.
            let is_even = (rising - falling).abs() * 2e5 <= rising + falling;
            let is_rising = if is_even { is_hole == (twist <= 0.0) } else { rising < falling };
            is_rising != (is_last && is_flat_above)
        });
    }
    let is_straight = twist == 0.0 && scale.x == scale.y && !is_flat_above && slices == 1;
    let is_whole = matches!(&flat.shapes[..], [shape] if shape.len() == 1 && is_convex(&shape[0]));
    let prisms =
        (is_straight && !is_whole).then(|| Prisms { count: sweep.points.len() as u32, cover: sweep.cover.clone() });
    if !is_flat_above {
        sweep.end(slices, true);
    }
    sweep.end(0, false);
    let mesh = sweep.finish().map_err(|what| match is_flat_above {
        true => format!("scaled to a line it does not close: {what}"),
        false => what,
    })?;
    Ok((mesh, prisms))
}

/// How many slices OpenSCAD makes.
fn slices(flat: &Flat, rise: &Rise, resolution: &Resolution) -> Result<usize, String> {
    let Rise { way, twist, scale, .. } = *rise;
    let farthest = |of: &dyn Fn(DVec2) -> DVec2| flat.points().map(|p| of(p).length_squared()).fold(0.0, f64::max);
    if twist != 0.0 {
        resolution.twisted(farthest(&|p| p), way.z, twist, scale)
    } else if scale.x != scale.y {
        resolution.slanted(farthest(&|p| p - p * scale), way.z)
    } else {
        Ok(1)
    }
}

/// What `flat`, in the plane of x and z, sweeps while it turns about z by `angle` degrees from `start`,
/// counter-clockwise seen from above: a closed mesh.
///
/// # Errors
/// A figure on both sides of the axis; too many pieces or triangles.
pub(super) fn turn(
    flat: &Flat,
    angle: f64,
    start: f64,
    resolution: &Resolution,
    work: &mut Work,
) -> Result<Mesh, String> {
    let (lo, hi) = flat.points().fold((0.0, 0.0), |(lo, hi): (f64, f64), p| (lo.min(p.x), hi.max(p.x)));
    if lo < 0.0 && hi > 0.0 {
        return Err(format!("its figure must lie on one side of the y axis, found x from {lo} to {hi}"));
    }
    let is_closed = angle == 360.0;
    let pieces = resolution.circle(hi - lo)? as f64 * angle.abs() / 360.0;
    let pieces = pieces.max(1.0) as usize;
    let rings = if is_closed { pieces } else { pieces + 1 };
    let mut sweep = Sweep::new(flat, rings, !is_closed, work)?;
    for ring in 0..rings {
        let towards = direction(start + angle * ring as f64 / pieces as f64);
        sweep.ring(|p| DVec3::new(p.x * towards.x, p.x * towards.y, p.y));
    }
    for piece in 0..pieces {
        sweep.walls([piece, (piece + 1) % rings], |_, _, _| true);
    }
    if !is_closed {
        sweep.end(pieces, true);
        sweep.end(0, false);
    }
    sweep.finish()
}
