//! Lines through the solids of a scene: where they are inside of any of them, with the surface at both ends.

use glam::DVec3;
use rayon::prelude::*;

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

/// The crossings of each line in order, inside and outside in turns. A line that starts inside has its first crossing
/// leave.
pub fn crossings(world: &World<f64>, lines: &[Line]) -> Vec<Vec<Crossing>> {
    let batches: Vec<Vec<Vec<Crossing>>> =
        lines.par_chunks(BATCH).map_init(Scratch::default, |scratch, lines| batch(world, lines, scratch)).collect();
    batches.into_iter().flatten().collect()
}

fn batch(world: &World<f64>, lines: &[Line], scratch: &mut Scratch) -> Vec<Vec<Crossing>> {
    let mut rays = Rays::<f64>::new(lines.len());
    for (i, line) in lines.iter().enumerate() {
        rays.set(i, line.org.to_array(), line.dir.to_array(), 0.0, line.length);
    }
    let found = stretches::<<f64 as Real>::Octo>(world, &rays, scratch);
    let mut lists = vec![Vec::new(); lines.len()];
    for of_line in found.chunk_by(|a, b| a.ray == b.ray) {
        let ray = of_line[0].ray as usize;
        lists[ray] = joined(world, &lines[ray], of_line);
    }
    lists
}

/// The union of a line's stretches, which are in order of their beginnings.
fn joined(world: &World<f64>, line: &Line, list: &[Stretch]) -> Vec<Crossing> {
    let same = SAME * (line.org.abs().max_element() + line.length);
    let mut found = Vec::with_capacity(2 * list.len());
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
    found
}

/// Sets `row[i]` to 1 where the point at `(i + 1) spacing` is inside, if `found` are a line's crossings.
pub fn fill(found: &[Crossing], spacing: f64, row: &mut [u8]) {
    let (mut next, mut inside) = (0, found.first().is_some_and(|c| !c.enters));
    for (i, flag) in row.iter_mut().enumerate() {
        while let Some(crossing) = found.get(next).filter(|c| c.t <= (i + 1) as f64 * spacing) {
            inside = crossing.enters;
            next += 1;
        }
        *flag = u8::from(inside);
    }
}
