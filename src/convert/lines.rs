//! Lines through the solids of a scene: where they are inside of any of them, with the surface at both ends.

use glam::DVec3;

use crate::lanes::Real;
use crate::ray::{INVALID_ID, Rays};
use crate::scene::world::World;
use crate::trace::{Scratch, Stretch, stretches};

/// Rays traced together.
const BATCH: usize = 2048;
/// Stretches of neighbouring solids that end and begin closer than this, relative to coordinates, are one.
const SAME: f64 = 1.0 / (1u64 << 46) as f64;

/// A line in world space; distances along it are in scene units from `org`.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Where it starts.
    pub org: DVec3,
    /// Unit direction.
    pub dir: DVec3,
    /// Where it ends.
    pub length: f64,
}

impl Line {
    /// The line through `point` along the unit vector `dir`, `reach` to both sides.
    pub fn through(point: DVec3, dir: DVec3, reach: f64) -> Self {
        Self { org: point - dir * reach, dir, length: 2.0 * reach }
    }

    /// The point at distance `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.org + self.dir * t
    }
}

/// Where a line passes through the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance along the line.
    pub t: f64,
    /// Unit normal, outward.
    pub normal: DVec3,
    /// Whether the line enters.
    pub enters: bool,
}

/// Traces lines on one thread.
#[derive(Default)]
pub struct Tracer {
    scratch: Scratch,
}

impl Tracer {
    /// Calls `found` for every line, in order, with its number and its crossings in order, inside and outside in turns.
    /// A line that starts inside has its first crossing leave.
    pub fn each(&mut self, world: &World<f64>, lines: &[Line], mut found: impl FnMut(usize, &[Crossing])) {
        let mut list = Vec::new();
        for (number, lines) in lines.chunks(BATCH).enumerate() {
            let mut rays = Rays::<f64>::new(lines.len());
            for (i, line) in lines.iter().enumerate() {
                rays.set(i, line.org.to_array(), line.dir.to_array(), 0.0, line.length);
            }
            let stretches = stretches::<<f64 as Real>::Octo>(world, &rays, &mut self.scratch);
            let mut rest = &stretches[..];
            for (i, line) in lines.iter().enumerate() {
                let (of_line, after) = rest.split_at(rest.partition_point(|s| s.ray as usize <= i));
                joined(world, line, of_line, &mut list);
                found(number * BATCH + i, &list);
                rest = after;
            }
        }
    }

    /// For every line the crossing nearest to its middle.
    pub fn nearest(&mut self, world: &World<f64>, lines: &[Line]) -> Vec<Option<Crossing>> {
        let mut list = Vec::with_capacity(lines.len());
        self.each(world, lines, |i, found| {
            let away = |c: &&Crossing| (c.t - 0.5 * lines[i].length).abs();
            list.push(found.iter().min_by(|a, b| away(a).total_cmp(&away(b))).copied());
        });
        list
    }
}

/// The union of a line's stretches, which are in order of their beginnings.
fn joined(world: &World<f64>, line: &Line, list: &[Stretch], found: &mut Vec<Crossing>) {
    let same = SAME * (line.org.abs().max_element() + line.length);
    found.clear();
    let mut rest = list;
    while let Some((first, after)) = rest.split_first() {
        let mut last = first;
        let mut end = 0;
        while let Some(next) = after.get(end).filter(|next| next.t_in <= last.t_out + same) {
            if next.t_out > last.t_out {
                last = next;
            }
            end += 1;
        }
        let mut push = |t: f64, [u, v]: [f64; 2], prim: u32, inst: u32, enters: bool| {
            if prim != INVALID_ID {
                let normal = world.surface(line.org, line.dir, t, u, v, prim, inst).ng.normalize_or_zero();
                found.push(Crossing { t, normal, enters });
            }
        };
        push(first.t_in, first.uv_in, first.prim_in, first.inst, true);
        push(last.t_out, last.uv_out, last.prim_out, last.inst, false);
        rest = &after[end..];
    }
}
