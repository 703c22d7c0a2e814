//! Triangles that no ray meets, found before they are set up: those that lie between the columns or rows of a picture's rays
//! ([`super::grid`]), or beside the few rays that they might meet. Of triangles of about a pixel and smaller these are most.
//!
//! Corners are taken to the picture, in steps of columns and rows, and moved outwards by how far rays may be from their
//! places and by what rounds. So what is left out here no other test would have called a hit, and answers are the same.

use glam::DMat3;

use super::batch::{BATCH, Batch, ROOM};
use super::edges::sum;
use super::grid::Grid;
use super::groups::Groups;
use super::{HALF_ULP, Mask, Memory, V};
use crate::lanes::{LaneMask, Lanes, Lanes3, dot, each, f64x8, map3};

/// What a corner's place rounds to, in half ulps of its distance over its depth: what [`super::batch`] allows, twice.
const ROUNDING: f32 = 32.0;

/// Largest sum of a corner's coordinates for which its place is told, in depths.
const ASIDE: f32 = 4.0;

/// Least distance that is taken for one, in steps.
const LEAST: f32 = 1e-3;

/// Largest distance between rays and their places for which this is of use, in steps.
const MOST: f32 = 0.25;

/// Triangles after which it is decided whether to try.
const TRIAL: usize = 128;

/// Most pairs of a triangle and a group per triangle for which that pays: such triangles are not larger than groups.
const PAIRS: f32 = 1.25;

/// Triangles after which it is decided whether that is to go on.
const PROOF: usize = 64;

/// Least part of the triangles that has to be left out.
const LEFT_OUT: f32 = 0.5;

/// The places of a tile's rays, for corners as they wait.
#[derive(Clone, Copy, Debug)]
pub struct Gaps {
    /// Linear functions of a corner as seen from the apex: column and row, times the third; this one is a depth.
    axes: [[f32; 3]; 3],
    /// Number of the last column and row.
    last: f32,
    /// How far outwards corners are moved.
    margin: f32,
}

/// Whether a tile's triangles are looked at before they are set up: decided by those it had, again and again.
#[derive(Clone, Debug, Default)]
pub struct Trial {
    /// What tells, if they are.
    pub gaps: Option<Gaps>,
    /// Triangles lately, and their pairs, or those of them that were left out.
    seen: [usize; 2],
    /// It was tried.
    over: bool,
}

impl Trial {
    /// A batch of triangles was set up without, and `pairs` were tested.
    #[inline(always)]
    pub fn learn<const N: usize>(&mut self, pairs: usize, groups: &Groups) {
        if self.gaps.is_some() {
            return;
        }
        self.seen = [self.seen[0] + BATCH, self.seen[1] + pairs];
        if self.seen[0] >= TRIAL {
            self.decide::<N>(groups);
        }
    }

    #[cold]
    #[inline(never)]
    fn decide<const N: usize>(&mut self, groups: &Groups) {
        let [triangles, pairs] = self.seen.map(|count| count as f32);
        if !self.over && pairs < PAIRS * triangles {
            (self.gaps, self.over) = (Gaps::of_tile::<N>(groups), true);
        }
        self.seen = [0; 2];
    }

    /// Of some triangles `left` were left.
    #[inline(always)]
    pub fn thinned(&mut self, triangles: usize, left: usize) {
        self.seen = [self.seen[0] + triangles, self.seen[1] + triangles - left];
        if self.seen[0] >= PROOF {
            let [triangles, out] = self.seen.map(|count| count as f32);
            if out < LEFT_OUT * triangles {
                self.gaps = None;
            }
            self.seen = [0; 2];
        }
    }
}

impl Gaps {
    /// Those of the `N` sets of a loaded tile, if its rays are a picture's.
    pub fn of_tile<const N: usize>(groups: &Groups) -> Option<Self> {
        let grid = if groups.full { Grid::of::<N>(groups) } else { None };
        Self::of(&grid?, groups)
    }

    /// Those of a tile's grid; `None` if rays are too far from their places, or these too close to each other.
    pub fn of(grid: &Grid, groups: &Groups) -> Option<Self> {
        let frame = DMat3::from_cols_array_2d(&groups.frame.axes.map(|axis| axis.map(f64::from))).transpose();
        let to_frame = if groups.many { DMat3::IDENTITY } else { frame };
        let to_grid = DMat3::from_cols_array_2d(&grid.axes.map(|axis| axis.map(f64::from))).transpose();
        let rows = (to_grid * to_frame).transpose();
        let rows = [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row / rows.z_axis.length());
        let most = rows[0].length().max(rows[1].length()) as f32;
        let margin = grid.off + ROUNDING * HALF_ULP * ASIDE * (most + 2.0 * grid.last) + LEAST;
        let axes = rows.map(|row| row.to_array().map(|x| x as f32));
        // Also false for what is no number.
        (margin <= MOST).then_some(Self { axes, last: grid.last, margin })
    }

    /// Which of the triangles with these corners, as seen from the apex, a ray may meet, as bits.
    #[inline(always)]
    fn kept(&self, p: &[Lanes3<V>; 3]) -> u32 {
        let (zero, one, margin) = (V::constant(0.0), V::constant(1.0), V::splat(self.margin));
        let axes: [Lanes3<V>; 3] = self.axes.map(|axis| axis.map(V::splat));
        let mut told = Mask::from_bits(V::ALL);
        let q: [[V; 2]; 3] = each(|k| {
            let [x, y, depth] = map3(axes, |axis| dot(axis, p[k]));
            let inverse = one / depth;
            // Also false for what is no number, and for the apex.
            told = told & sum(p[k]).cmp_lt(depth * V::splat(ASIDE));
            [x * inverse, y * inverse]
        });
        // From the first to the last place that is not outside of it, along an axis.
        let ends = |axis: usize| {
            let [a, b, c] = each(|k| q[k][axis]);
            let (low, high) = (a.fast_min(b).fast_min(c), a.fast_max(b).fast_max(c));
            ((low - margin).ceil(), (high + margin).floor())
        };
        let ((first_x, last_x), (first_y, last_y)) = (ends(0), ends(1));
        let last = V::splat(self.last);
        let empty =
            last_x.fast_min(last).cmp_lt(first_x.fast_max(zero)) | last_y.fast_min(last).cmp_lt(first_y.fast_max(zero));
        let (more_x, more_y) = (last_x - first_x, last_y - first_y);
        let few = more_x.cmp_le(one) & more_y.cmp_le(one);
        let mut dropped = empty;
        if (few & !empty & told).any() {
            let sides: [[V; 2]; 3] = each(|k| [0, 1].map(|a| q[(k + 1) % 3][a] - q[k][a]));
            let ([x0, y0], [x1, y1]) = (sides[0], sides[1]);
            let area = x0 * y1 - y0 * x1;
            // At the first place, and what is added to it at the next column and row.
            let edges = each(|k| {
                let [x, y] = sides[k].map(|side| side.turned_as(area));
                let slack = margin * (x.abs() + y.abs());
                let at = x.mul_add(first_y - q[k][1], slack - y * (first_x - q[k][0]));
                (at, -(y * more_x), x * more_y)
            });
            let inside = |x: bool, y: bool| {
                let [a, b, c] = map3(edges, |(at, by_x, by_y)| {
                    let at = if x { at + by_x } else { at };
                    if y { at + by_y } else { at }
                });
                a.fast_min(b).fast_min(c)
            };
            let most = inside(false, false).fast_max(inside(true, false));
            let most = most.fast_max(inside(false, true)).fast_max(inside(true, true));
            dropped = dropped | few & most.cmp_lt(zero);
        }
        !(dropped & told).bits()
    }
}

impl Memory {
    /// Leaves out of the waiting triangles those that no ray meets, unless they are the `last`, which were looked at. Whether enough
    /// are left to be set up: these are waiting then.
    #[inline(never)]
    pub fn thin(&mut self, last: bool) -> bool {
        let Self { groups, batch, kept, trial, .. } = self;
        if let (false, Some(gaps)) = (last, &trial.gaps) {
            let (waiting, before) = (batch.len(), kept.len());
            batch.thin(gaps, groups, kept);
            trial.thinned(waiting, kept.len() - before);
        }
        let enough = last || kept.len() >= BATCH;
        if enough {
            kept.give(batch);
        }
        enough
    }
}

impl Batch {
    /// Moves those of the waiting triangles that a ray may meet to `to`, which has room for sixteen.
    #[inline(always)]
    pub fn thin(&mut self, gaps: &Gaps, groups: &Groups, to: &mut Self) {
        let apex = map3(groups.frame.apex, V::splat);
        let p: [Lanes3<V>; 3] = each(|i| {
            let corner = each(|a| V::load(&self.corners[3 * i + a]));
            if groups.many { corner } else { each(|a| corner[a] - apex[a]) }
        });
        let kept = gaps.kept(&p) & self.lanes();
        self.move_to(to, kept, groups.many);
    }

    /// Moves the first sixteen to `to`, where none wait; others that wait take their place.
    fn give(&mut self, to: &mut Self) {
        self.corners.iter_mut().zip(&mut to.corners).for_each(|(from, to)| give(from, to));
        give(&mut self.id, &mut to.id);
        give(&mut self.inst, &mut to.inst);
        give(&mut self.slot, &mut to.slot);
        give(&mut self.groups, &mut to.groups);
        to.len = self.len.min(BATCH);
        self.len -= to.len;
    }

    /// Moves the first sixteen that are `kept`, as bits, behind those that wait in `to`, and forgets the others. `many`: they are of instances.
    #[inline(always)]
    fn move_to(&mut self, to: &mut Self, kept: u32, many: bool) {
        let at = to.len.min(BATCH);
        let vector = |from: &[f32; ROOM], to: &mut [f32; ROOM]| V::load(from).packed(kept).store(&mut to[at..]);
        let numbers = |from: &[u32; ROOM], to: &mut [u32; ROOM]| {
            vector(bytemuck::cast_ref(from), bytemuck::cast_mut(to));
        };
        self.corners.iter().zip(&mut to.corners).for_each(|(from, to)| vector(from, to));
        numbers(&self.id, &mut to.id);
        if many {
            numbers(&self.inst, &mut to.inst);
            numbers(&self.slot, &mut to.slot);
        }
        // As bits of doubles, which nothing is done with.
        let (from, to_groups) =
            (bytemuck::cast_ref::<_, [f64; ROOM]>(&self.groups), bytemuck::cast_mut::<_, [f64; ROOM]>(&mut to.groups));
        let (low, high) = (kept & 0xff, kept >> 8);
        f64x8::load(from).packed(low).store(&mut to_groups[at..]);
        f64x8::load(&from[8..]).packed(high).store(&mut to_groups[at + low.count_ones() as usize..]);
        to.len = at + kept.count_ones() as usize;
        self.len = 0;
    }
}

/// Copies the first sixteen numbers, and puts the others in their place.
#[inline(always)]
fn give<T: Copy>(from: &mut [T; ROOM], to: &mut [T; ROOM]) {
    for i in 0..BATCH {
        to[i] = from[i];
        from[i] = from[BATCH + i];
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    const STEP: [f32; 2] = [0.002, -0.0017];
    const FIRST: [f32; 2] = [-0.04, 0.03];

    fn numbers() -> impl FnMut() -> f32 {
        let mut state = 29u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / 16_777_216.0 - 0.5
        }
    }

    /// A tile that looks along the third axis, and a grid in it whose rays are `off` their places at most.
    fn gaps(step: [f32; 2], off: f32) -> Option<Gaps> {
        let mut groups = Box::<Groups>::default();
        groups.frame.axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let axes =
            [[1.0 / step[0], 0.0, -FIRST[0] / step[0]], [0.0, 1.0 / step[1], -FIRST[1] / step[1]], [0.0, 0.0, 1.0]];
        Gaps::of(&Grid { axes, last: 31.0, off }, &groups)
    }

    /// Whether a point is inside of a triangle or on its edge.
    fn contains(corners: &[DVec2; 3], point: DVec2) -> bool {
        let sides: [f64; 3] = each(|k| (corners[(k + 1) % 3] - corners[k]).perp_dot(point - corners[k]));
        sides.iter().all(|x| *x >= 0.0) || sides.iter().all(|x| *x <= 0.0)
    }

    #[test]
    fn what_is_left_out_is_met_by_no_ray_and_most_of_that_is() {
        let mut next = numbers();
        // Size of triangles in steps, how far rays are off, and which part of those that no ray meets is left out.
        for (size, off, least) in
            [(0.3, 0.0, 0.95), (0.7, 0.02, 0.8), (2.0, 0.1, 0.5), (40.0, 0.0, 0.05), (0.5, 0.2, 0.4)]
        {
            let gaps = gaps(STEP, off).expect("rays near their places");
            let (mut dropped, mut missed) = (0, 0);
            for _ in 0..400 {
                let mut corners: [Lanes3<[f32; 16]>; 3] = Default::default();
                for i in 0..16 {
                    let middle = [0, 1].map(|_| 15.5 + 36.0 * next());
                    for corner in &mut corners {
                        let z = 0.7 + next();
                        for axis in 0..2 {
                            let at = middle[axis] + size * next();
                            corner[axis][i] = (FIRST[axis] + at * STEP[axis]) * z;
                        }
                        corner[2][i] = z;
                    }
                }
                let kept = gaps.kept(&corners.map(|c| map3(c, V::new)));
                for i in 0..16 {
                    let places: [DVec2; 3] = each(|k| {
                        let [x, y] = [0, 1].map(|axis| {
                            let at = f64::from(corners[k][axis][i]) / f64::from(corners[k][2][i]);
                            (at - f64::from(FIRST[axis])) / f64::from(STEP[axis])
                        });
                        DVec2::new(x, y)
                    });
                    let met = (0..1024).any(|ray| {
                        let place = DVec2::new((ray % 32) as f64, (ray / 32) as f64);
                        let away = DVec2::new(next().into(), next().into()) * 2.0 * f64::from(off);
                        contains(&places, place + away)
                    });
                    assert!(!met || kept >> i & 1 != 0, "size {size}: {places:?}");
                    missed += usize::from(!met);
                    dropped += usize::from(kept >> i & 1 == 0);
                }
            }
            assert!(dropped as f64 >= least * missed as f64, "size {size}: {dropped} of {missed}");
        }
    }

    #[test]
    fn what_is_not_told_is_kept() {
        let tile = gaps(STEP, 0.0).expect("rays at their places");
        let kept = |corners: [[f32; 3]; 3]| tile.kept(&corners.map(|c| map3(c, V::splat))) & 1 != 0;
        // Beside the tile.
        let beside = [[0.4, 0.0, 1.0], [0.4, 0.1, 1.0]];
        assert!(!kept([[0.3, 0.0, 1.0], beside[0], beside[1]]));
        // The same with a corner behind the apex, beside it, at it, too far aside, and nowhere.
        let corners =
            [[0.3, 0.0, -1.0], [0.3, 0.0, 0.0], [0.0; 3], [5.0, 0.0, 1.0], [f32::NAN; 3], [f32::MAX, 0.0, f32::MAX]];
        for corner in corners {
            for turn in 0..3 {
                let mut all = [corner, beside[0], beside[1]];
                all.rotate_left(turn);
                assert!(kept(all), "{corner:?}");
            }
        }
        // Rays that are nowhere near their places, or so near to each other that corners are not told apart.
        for (step, off) in [(STEP, 0.3), ([1e-6; 2], 0.0), ([0.0; 2], 0.0), (STEP, f32::NAN)] {
            assert!(gaps(step, off).is_none(), "{step:?} {off}");
        }
    }

    #[test]
    fn those_that_are_kept_wait_in_order() {
        let (mut from, mut to) = (Batch::default(), Batch::default());
        let number = |i: usize, column: usize| (100 * column + i) as f32;
        let check = |batch: &Batch, want: &[usize]| {
            assert_eq!(batch.len, want.len());
            for (i, &was) in want.iter().enumerate() {
                assert!((0..9).all(|column| batch.corners[column][i] == number(was, column)));
                assert_eq!((batch.id[i], batch.inst[i], batch.slot[i]), (was as u32, 7 * was as u32, !was as u32));
                assert_eq!(batch.groups[i], u64::MAX - was as u64);
            }
        };
        let mut want: Vec<usize> = Vec::new();
        for (round, kept) in [0b101, 0xffff, 0, 0x8001, 0x0ff0, 0xf00f].into_iter().enumerate() {
            let first = 16 * round;
            for i in 0..BATCH {
                (0..9).for_each(|column| from.corners[column][i] = number(first + i, column));
                (from.id[i], from.inst[i], from.slot[i]) =
                    ((first + i) as u32, 7 * (first + i) as u32, !(first + i) as u32);
                from.groups[i] = u64::MAX - (first + i) as u64;
            }
            from.len = BATCH;
            want.extend((0..BATCH).filter(|i| kept >> i & 1 != 0).map(|i| first + i));
            from.move_to(&mut to, kept, true);
            assert_eq!(from.len, 0);
            check(&to, &want);
            if to.len >= BATCH {
                let mut given = Batch::default();
                to.give(&mut given);
                assert_eq!(given.len, BATCH);
                check(&given, &want[..BATCH]);
                want.drain(..BATCH);
                check(&to, &want);
            }
        }
        assert!(!want.is_empty());
    }
}
