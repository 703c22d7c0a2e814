//! The connected pieces of a closed mesh, and which of them are voids.
//!
//! Triangles with an edge that no third one has are of one piece. Where more meet at an edge, surfaces only touch there, unless one
//! of them would not be closed without the others.

use std::collections::HashMap;

use glam::DVec3;

/// The piece of each triangle.
#[derive(Clone, Debug, Default)]
pub(super) struct Pieces {
    /// By triangle; empty if all are of one piece.
    of: Vec<u32>,
    /// By piece: whether it is wound the other way, so that it takes away from what other pieces enclose.
    is_void: Vec<bool>,
}

/// Sets of triangles, each set a tree towards its lowest, which represents it.
struct Sets(Vec<u32>);

impl Sets {
    fn find(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

impl Pieces {
    /// Of triangles by their corners; corners at one place are one.
    pub fn new(triangles: &[[DVec3; 3]]) -> Self {
        let mut sets = Sets((0..triangles.len() as u32).collect());
        let sides = sides(triangles);
        let edges = || sides.chunk_by(|a, b| a.edge == b.edge);
        for edge in edges() {
            if let [a, b] = edge {
                sets.join(a.triangle, b.triangle);
            }
        }
        // All of them are found before any is joined: what is joined must not hang on the order of the edges.
        let mut is_open = |edge: &[Side]| {
            let mut balance: Vec<(u32, i32)> = edge.iter().map(|side| (sets.find(side.triangle), side.way)).collect();
            balance.sort_unstable();
            balance.chunk_by(|a, b| a.0 == b.0).any(|set| set.iter().map(|side| side.1).sum::<i32>() != 0)
        };
        let open: Vec<&[Side]> = edges().filter(|edge| edge.len() > 2 && is_open(edge)).collect();
        for edge in open {
            edge.iter().for_each(|side| sets.join(edge[0].triangle, side.triangle));
        }
        Self::of_sets(triangles, &mut sets)
    }

    fn of_sets(triangles: &[[DVec3; 3]], sets: &mut Sets) -> Self {
        let (mut of, mut volumes, mut origins) = (Vec::with_capacity(triangles.len()), Vec::new(), Vec::new());
        for (i, corners) in (0..).zip(triangles) {
            // The lowest of a set represents it, so the others come after it.
            let representative = sets.find(i);
            let piece = if representative == i { volumes.len() } else { of[representative as usize] as usize };
            if representative == i {
                volumes.push(0.0);
                origins.push(corners[0]);
            }
            // From a point of the piece: far from the origin, products would cancel.
            let [a, b, c] = corners.map(|p| p - origins[piece]);
            volumes[piece] += a.dot(b.cross(c));
            of.push(piece as u32);
        }
        if volumes.len() == 1 {
            of.clear();
        }
        Self { of, is_void: volumes.iter().map(|volume| *volume < 0.0).collect() }
    }

    /// The piece of a triangle.
    pub fn of(&self, triangle: u32) -> u32 {
        self.of.get(triangle as usize).copied().unwrap_or(0)
    }

    /// Whether a piece takes away from what others enclose.
    pub fn is_void(&self, piece: u32) -> bool {
        self.is_void.get(piece as usize).copied().unwrap_or(false)
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.of[..]) + size_of_val(&self.is_void[..])
    }
}

/// An edge of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// The places of its ends, the lower one first.
    edge: (u32, u32),
    triangle: u32,
    /// 1 if the triangle goes along it from the lower place to the higher one, else -1.
    way: i32,
}

/// All edges of the triangles, those at the same places together. A sorted list: a map with a list for each edge takes four times as
/// long and three times the memory.
fn sides(triangles: &[[DVec3; 3]]) -> Vec<Side> {
    let places = places(triangles);
    let mut sides = Vec::with_capacity(triangles.len() * 3);
    for (triangle, [a, b, c]) in (0..).zip(places) {
        for (a, b) in [(a, b), (b, c), (c, a)].into_iter().filter(|(a, b)| a != b) {
            sides.push(Side { edge: (a.min(b), a.max(b)), triangle, way: if a < b { 1 } else { -1 } });
        }
    }
    sides.sort_unstable();
    sides
}

/// Numbers of the corners' places.
fn places(triangles: &[[DVec3; 3]]) -> Vec<[u32; 3]> {
    let mut first_at: HashMap<[u64; 3], u32> = HashMap::new();
    let mut place = |p: DVec3| {
        let next = first_at.len() as u32;
        // Zeros of both signs are one place.
        *first_at.entry((p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(next)
    };
    triangles.iter().map(|corners| corners.map(&mut place)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of the box around `centre`; turned inwards if `half` is negative.
    fn cuboid(centre: DVec3, half: f64) -> Vec<[DVec3; 3]> {
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0;
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        triangles.map(|t| t.map(|i| centre + corner(i) * half)).collect()
    }

    fn counted(triangles: &[[DVec3; 3]]) -> (usize, Vec<bool>) {
        let pieces = Pieces::new(triangles);
        let mut seen: Vec<u32> = (0..triangles.len() as u32).map(|i| pieces.of(i)).collect();
        seen.sort_unstable();
        seen.dedup();
        (seen.len(), seen.iter().map(|&piece| pieces.is_void(piece)).collect())
    }

    #[test]
    fn cubes_are_pieces_unless_they_share_faces() {
        let cube = cuboid(DVec3::ZERO, 1.0);
        assert_eq!(counted(&cube), (1, vec![false]));
        let with = |other: Vec<[DVec3; 3]>| [cube.clone(), other].concat();
        assert_eq!(counted(&with(cuboid(DVec3::ZERO, -0.5))), (2, vec![false, true]));
        // A corner in common, and an edge.
        assert_eq!(counted(&with(cuboid(DVec3::splat(2.0), 1.0))), (2, vec![false, false]));
        assert_eq!(counted(&with(cuboid(DVec3::new(2.0, 2.0, 0.0), 1.0))), (2, vec![false, false]));
        // A wall between two rooms, once for each of them or not at all: its triangles alone enclose nothing.
        let rooms = with(cuboid(DVec3::new(2.0, 0.0, 0.0), 1.0));
        let is_wall = |t: &[DVec3; 3]| t.iter().all(|p| p.x == 1.0);
        assert_eq!(counted(&rooms), (1, vec![false]));
        let open: Vec<_> = rooms.iter().copied().filter(|t| !is_wall(t)).collect();
        assert_eq!((open.len(), counted(&open)), (20, (1, vec![false])));
    }

    /// Neither the order of triangles nor what they are numbered by decides what is a piece.
    #[test]
    fn pieces_are_the_same_in_any_order_of_triangles() {
        let centres = [DVec3::ZERO, DVec3::splat(2.0), DVec3::new(4.0, 2.0, 2.0), DVec3::new(-9.0, 0.0, 0.0)];
        let mut all: Vec<_> = centres.iter().zip([1.0, 1.0, 1.0, -2.0]).flat_map(|(c, h)| cuboid(*c, h)).collect();
        let box_of: Vec<usize> = (0..all.len()).map(|i| [0, 1, 1, 3][i / 12]).collect();
        let mut order: Vec<usize> = (0..all.len()).collect();
        for _ in 0..4 {
            let pieces = Pieces::new(&all);
            for (i, j) in (0..all.len()).flat_map(|i| (0..i).map(move |j| (i, j))) {
                let same = box_of[order[i]] == box_of[order[j]];
                assert_eq!(pieces.of(i as u32) == pieces.of(j as u32), same, "{i} {j}");
            }
            (0..all.len()).for_each(|i| assert_eq!(pieces.is_void(pieces.of(i as u32)), box_of[order[i]] == 3));
            // Every seventh of 48.
            all = (0..all.len()).map(|i| all[i * 7 % 48]).collect();
            order = (0..order.len()).map(|i| order[i * 7 % 48]).collect();
        }
    }
}
