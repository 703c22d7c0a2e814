//! Tiles of a regular picture: rays in columns and rows, as pinhole cameras have them. Where it is known where rays are not,
//! triangles between them need no setting up ([`super::gaps`]).
//!
//! Nothing is taken for granted: four of a tile's rays say where its columns and rows would be, and how far the others are off
//! is measured.

use glam::{DMat3, DVec3};

use super::groups::Groups;
use super::{SET, V};
use crate::lanes::words::greatest;
use crate::lanes::{Lanes, Lanes3, dot};

/// Column and row of the rays of a group in Morton order.
const PLACES: [[f32; SET]; 2] = {
    let (mut places, mut i) = ([[0.0; SET]; 2], 0);
    while i < SET {
        places[0][i] = (i & 1 | i >> 1 & 2) as f32;
        places[1][i] = (i >> 1 & 1 | i >> 2 & 2) as f32;
        i += 1;
    }
    places
};

/// Where the columns and rows of a tile are.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// Linear functions of a point in the frame: its column and row, times the third. This one is about the depth.
    pub axes: [[f32; 3]; 3],
    /// Number of the last column and row.
    pub last: f32,
    /// No ray is farther from its place, in steps of columns or rows.
    pub off: f32,
}

impl Grid {
    /// That of the `N` sets of a full tile; `None` if four rays do not tell. All rays may be off their places by any amount.
    ///
    /// A pinhole's columns and rows are seen from the tile's own axes as a quadrilateral, whose corners say all of the map. (The
    /// projective map of Heckbert, Fundamentals of texture mapping and image warping, 1989.)
    pub fn of<const N: usize>(groups: &Groups) -> Option<Self> {
        let last = if N == 1 { 15 } else { 31 };
        // First and last column of the first and of the last row: sets, groups in them, and rays in these are in Morton order.
        let [o, x, y, other] = [0, 1, 2, 3].map(|corner| {
            let group = &groups.of[corner * (N * SET - 1) / 3];
            let lane = corner * (SET - 1) / 3;
            DVec3::new(group.s.lane(lane).into(), group.t.lane(lane).into(), 1.0)
        });
        let lengths = DMat3::from_cols(x, y, -o).inverse() * other;
        // Also false for what is no number.
        if !(lengths.min_element() > 0.25 && lengths.max_element() < 4.0) {
            return None;
        }
        let (x, y, o) = (x * lengths.x, y * lengths.y, o * lengths.z);
        let [x, y] = [x, y].map(|side| (side - o) / f64::from(last));
        let rows = DMat3::from_cols(x, y, o).inverse().transpose();
        let axes = [rows.x_axis, rows.y_axis, rows.z_axis].map(|axis| axis.to_array().map(|x| x as f32));
        let grid = Self { axes, last: last as f32, off: 0.0 };
        let off = grid.farthest::<N>(groups);
        off.is_finite().then_some(Self { off, ..grid })
    }

    /// How far from its place a ray is at most.
    fn farthest<const N: usize>(&self, groups: &Groups) -> f32 {
        let even = |i: usize| (i & 1 | i >> 1 & 2 | i >> 2 & 4) as f32;
        let axes: [Lanes3<V>; 3] = self.axes.map(|axis| axis.map(V::splat));
        // A sum shows what is no number; the greatest do not.
        let (mut off, mut total) = (V::constant(0.0), V::constant(0.0));
        for (g, group) in groups.of.iter().enumerate().take(N * SET) {
            let ray = [group.s, group.t, V::constant(1.0)];
            let [x, y, w] = axes.map(|axis| dot(axis, ray));
            let away = |x: V, axis: usize, first: f32| (x / w - (V::new(PLACES[axis]) + V::splat(first))).abs();
            let (x, y) = (away(x, 0, 4.0 * even(g)), away(y, 1, 4.0 * even(g >> 1)));
            off = off.fast_max(x.fast_max(y));
            total += x + y;
        }
        let total: f32 = total.to_array().iter().sum();
        if total.is_finite() { greatest(off) } else { f32::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::super::frame::Frame;
    use super::super::presumed::{First, Look};
    use super::*;
    use crate::math::Aabb;
    use crate::ray::Rays;

    const STEP: f64 = 0.002;
    const RIGHT: DVec3 = DVec3::new(0.8, 0.0, -0.6);
    const UP: DVec3 = DVec3::new(0.36, 0.8, 0.48);

    /// Column and row of ray `i` of a block.
    fn place(i: usize) -> [f64; 2] {
        let even = |i: usize| (0..5).map(|bit| (i >> (2 * bit) & 1) << bit).sum::<usize>();
        [even(i) as f64, even(i >> 1) as f64]
    }

    /// A block of a picture, `aside` of its middle; directions are changed by `change`.
    fn block(count: usize, aside: f64, mut change: impl FnMut(usize, DVec3) -> DVec3) -> Rays<f32> {
        let mut rays = Rays::new(count);
        for i in 0..count {
            let [x, y] = place(i).map(|x| (x - 15.5) * STEP);
            let way = change(i, RIGHT.cross(UP) + (x + aside) * RIGHT + (y - 0.3 * aside) * UP);
            rays.set(i, [0.5, -1.0, 2.0], way.as_vec3().to_array(), 0.0, f32::INFINITY);
        }
        rays
    }

    /// What a tile tells of rays.
    fn grid<const N: usize>(rays: &Rays<f32>) -> Option<(Grid, Box<Groups>)> {
        let First::Shared(bundle) = First::of(rays, 0, false) else { panic!("a common start") };
        let mut groups = Box::<Groups>::default();
        let bounds = Aabb { lo: [-3.0; 3], hi: [3.0; 3] };
        groups.frame = Frame::of::<N>(&bundle, u64::MAX >> (64 - 16 * N), &bounds).expect("a frame");
        let (mut look, mut reach) = (Look::default(), V::splat(0.0));
        assert!(groups.fill::<N, false>(&bundle, &mut look, &mut reach, None));
        Grid::of::<N>(&groups).map(|grid| (grid, groups))
    }

    #[test]
    fn pictures_are_grids_whatever_the_lengths_of_directions() {
        for aside in [0.0, 0.2, 0.7, -1.2] {
            for unit in [false, true] {
                let lengths =
                    |i: usize, way: DVec3| if unit { way.normalize() } else { way * (1.0 + 0.3 * (i % 7) as f64) };
                let (grid, groups) = grid::<4>(&block(1024, aside, lengths)).expect("a grid");
                assert!(grid.off < 2e-3 && grid.last == 31.0, "{grid:?}");
                // Also between rays: the middle of four neighbours lies between their columns and rows.
                let ways: Vec<DVec3> = (0..4)
                    .map(|i| block(4, aside, |_, way| way).dir(i))
                    .map(|d| DVec3::from(d.map(f64::from)))
                    .collect();
                let middle = ways.into_iter().sum::<DVec3>();
                let seen = groups.frame.axes.map(|axis| DVec3::from(axis.map(f64::from)).dot(middle));
                let [x, y, w] = grid.axes.map(|axis| DVec3::from(axis.map(f64::from)).dot(DVec3::from(seen)));
                assert!((x / w - 0.5).abs() < 2e-3 && (y / w - 0.5).abs() < 2e-3, "{} {}", x / w, y / w);
                let (grid, _) = self::grid::<1>(&block(256, aside, lengths)).expect("a grid");
                assert!(grid.off < 2e-3 && grid.last == 15.0, "{grid:?}");
            }
        }
    }

    #[test]
    fn how_far_a_ray_is_off_is_measured() {
        for (ray, by) in [(1, 0.3), (517, 0.1), (1022, 0.7)] {
            let rays = block(1024, 0.2, |i, way| if i == ray { way + STEP * by * RIGHT } else { way });
            let (grid, _) = grid::<4>(&rays).expect("a grid");
            assert!((f64::from(grid.off) - by).abs() < 5e-3, "{grid:?}");
        }
        let rays = block(1024, 0.2, |i, way| if i == 77 { way - STEP * 0.4 * UP } else { way });
        assert!((f64::from(grid::<4>(&rays).expect("a grid").0.off) - 0.4).abs() < 5e-3);
    }

    #[test]
    fn other_rays_are_far_from_their_places() {
        let mut state = 3u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / 16_777_216.0 - 0.5
        };
        // Somewhere in their pixels, a fisheye, all in one direction, row by row.
        let jittered = block(1024, 0.1, |_, way| way + STEP * DVec3::new(next(), next(), next()));
        let fisheye = block(1024, 0.0, |i, _| {
            let [x, y] = place(i).map(|x| (x - 15.5) * 0.05);
            DVec3::new(y.cos() * x.sin(), y.sin(), y.cos() * x.cos())
        });
        let one = block(1024, 0.0, |_, _| DVec3::Z);
        let rows = block(1024, 0.0, |i, _| DVec3::new((i % 32) as f64 - 15.5, (i / 32) as f64 - 15.5, 500.0));
        for (k, rays) in [jittered, fisheye, one, rows].iter().enumerate() {
            assert!(grid::<4>(rays).is_none_or(|(grid, _)| grid.off > 0.25), "{k}");
        }
    }
}
