//! Polygons of files as triangles that cover them.
//!
//! Readers fan each polygon from its first corner as they read it. The fan is right, and stays, where all its triangles have one
//! sense about the polygon's Newell normal (M. E. Newell's, in I. E. Sutherland et al., "A Characterization of Ten Hidden-Surface
//! Algorithms", ACM Computing Surveys 6(1), 1974): so it does for convex polygons, which nearly all are. Another polygon is cut
//! into ears (G. H. Meisters, "Polygons Have Ears", American Mathematical Monthly 82(6), 1975), seen along the axis nearest to
//! that normal; which way three corners turn is decided exactly. To cut one off changes nothing for corners that are not its
//! neighbours, so the time is that of corners times notches.
//!
//! Polygons that cross themselves end too, in some triangles.

use std::cmp::Ordering;
use std::collections::VecDeque;

use glam::{DVec2, DVec3};

/// Most corners of a polygon that is cut: the time of larger ones would grow with their square.
pub(super) const MAX_CORNERS: usize = 4096;
/// How much of the square of the normal a triangle may point the other way: what the rounding of collinear corners makes.
const ROUNDING: f64 = 1e-12;

/// Polygons of a file while it is read.
#[derive(Debug, Default)]
pub(super) struct Polygons {
    /// First triangle, and the one after the last, of fans with vertices that come later in the file.
    pub later: Vec<[u32; 2]>,
    /// Polygons that stay fanned although the fan is wrong, for their many corners.
    pub large: u64,
}

impl Polygons {
    /// How to cut the polygon whose triangles from its first corner are `fan`; `None` if they are right as they are, or the best
    /// there is. [`apply`] does it.
    pub fn cut(&mut self, fan: &[[u32; 3]], positions: &[DVec3]) -> Option<Vec<[u32; 3]>> {
        if is_one_sense(fan, positions) {
            return None;
        }
        if fan.len() + 2 > MAX_CORNERS {
            self.large += 1;
            return None;
        }
        cut(fan, positions)
    }
}

/// What users are told of `large` polygons; nothing if there are none.
pub(super) fn warning(large: u64) -> Option<String> {
    let what = format!("{large} polygons of more than {MAX_CORNERS} corners are not convex, and fanned all the same");
    (large > 0).then_some(what)
}

/// Puts the triangles `cut`, of numbers of corners, in the place of `fan`: of vertices, or what else corners have.
pub(super) fn apply(cut: &[[u32; 3]], fan: &mut [[u32; 3]]) {
    let corners = corners(fan);
    for (triangle, cut) in fan.iter_mut().zip(cut) {
        *triangle = cut.map(|corner| corners[corner as usize]);
    }
}

/// The corners of the polygon whose fan is `fan`, which is not empty.
fn corners(fan: &[[u32; 3]]) -> Vec<u32> {
    [fan[0][0], fan[0][1]].into_iter().chain(fan.iter().map(|triangle| triangle[2])).collect()
}

/// Whether none of the triangles points away from the sum of their normals.
fn is_one_sense(triangles: &[[u32; 3]], positions: &[DVec3]) -> bool {
    let normal = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
        (b - a).cross(c - a)
    };
    // The usual case, without a second look.
    if let &[[a, b, c], [_, _, d]] = triangles {
        let [a, b, c, d] = [a, b, c, d].map(|vertex| positions[vertex as usize]);
        let (right, diagonal, up) = (b - a, c - a, d - a);
        if right.cross(diagonal).dot(diagonal.cross(up)) >= 0.0 {
            return true;
        }
    }
    let sum: DVec3 = triangles.iter().map(normal).sum();
    let square = sum.length_squared();
    square.is_finite() && triangles.iter().all(|triangle| normal(triangle).dot(sum) >= -ROUNDING * square)
}

fn cut(fan: &[[u32; 3]], positions: &[DVec3]) -> Option<Vec<[u32; 3]>> {
    if let &[[a, b, c], [_, _, d]] = fan {
        // The other diagonal, if that one is inside.
        return is_one_sense(&[[b, c, d], [d, a, b]], positions).then(|| vec![[1, 2, 3], [3, 0, 1]]);
    }
    let points: Vec<DVec3> = corners(fan).into_iter().map(|vertex| positions[vertex as usize]).collect();
    let largest = points.iter().fold(0.0_f64, |most, p| most.max(p.abs().max_element()));
    if !points.iter().all(|p| p.is_finite()) || largest == 0.0 {
        return None;
    }
    // A power of two changes no digit, and products of what is below two are finite.
    let exponent = (largest.to_bits() >> 52).clamp(23, 2023);
    let scale = f64::from_bits((2046 - exponent) << 52);
    let points: Vec<DVec3> = points.into_iter().map(|p| p * scale).collect();
    let spans = points.windows(2).map(|pair| (pair[0] - points[0]).cross(pair[1] - points[0]));
    let normal: DVec3 = spans.sum();
    if normal == DVec3::ZERO {
        return None;
    }
    let axis = normal.abs().max_position();
    let (right, up) = ((axis + 1) % 3, (axis + 2) % 3);
    let is_front = normal[axis] > 0.0;
    let seen = |p: DVec3| if is_front { DVec2::new(p[right], p[up]) } else { DVec2::new(p[up], p[right]) };
    let seen: Vec<DVec2> = points.into_iter().map(seen).collect();
    Some(ears(&seen))
}

/// Triangles of the polygon with these corners, counter-clockwise on the whole: two fewer than there are corners, of which there
/// are three at least.
pub(super) fn ears(points: &[DVec2]) -> Vec<[u32; 3]> {
    let mut ring = Ring::new(points);
    let mut triangles = Vec::with_capacity(points.len() - 2);
    // Corners that only touch an ear let it be where nothing else is left.
    for is_strict in [true, false] {
        let mut waiting: VecDeque<usize> = (0..points.len()).filter(|&corner| ring.is_left[corner]).collect();
        while let Some(corner) = waiting.pop_front() {
            if ring.count > 3 && ring.is_left[corner] && ring.is_ear(corner, is_strict) {
                let (before, after) = (ring.before[corner], ring.after[corner]);
                triangles.push([before, corner, after].map(|i| i as u32));
                ring.remove(corner);
                waiting.extend([before, after]);
            }
        }
    }
    let first = ring.is_left.iter().position(|&is_left| is_left).unwrap_or(0);
    let mut corner = ring.after[first];
    while ring.after[corner] != first {
        triangles.push([first, corner, ring.after[corner]].map(|i| i as u32));
        corner = ring.after[corner];
    }
    triangles
}

/// The corners that are left.
struct Ring<'a> {
    points: &'a [DVec2],
    before: Vec<usize>,
    after: Vec<usize>,
    is_left: Vec<bool>,
    count: usize,
    /// Those that do not turn left: where something reaches into an ear, one of them does.
    notches: Vec<usize>,
}

impl<'a> Ring<'a> {
    fn new(points: &'a [DVec2]) -> Self {
        let count = points.len();
        let before = (0..count).map(|i| (i + count - 1) % count).collect();
        let after = (0..count).map(|i| (i + 1) % count).collect();
        let mut ring = Self { points, before, after, is_left: vec![true; count], count, notches: Vec::new() };
        ring.notches = (0..count).filter(|&corner| ring.is_notch(corner)).collect();
        ring
    }

    /// The corner with its neighbours.
    fn triangle(&self, corner: usize) -> [DVec2; 3] {
        [self.before[corner], corner, self.after[corner]].map(|i| self.points[i])
    }

    fn is_notch(&self, corner: usize) -> bool {
        let [a, b, c] = self.triangle(corner);
        turn(a, b, c) != Ordering::Greater
    }

    fn remove(&mut self, corner: usize) {
        let (before, after) = (self.before[corner], self.after[corner]);
        self.after[before] = after;
        self.before[after] = before;
        self.is_left[corner] = false;
        self.count -= 1;
        self.notches.retain(|notch| ![before, corner, after].contains(notch));
        for neighbour in [before, after] {
            if self.is_notch(neighbour) {
                self.notches.push(neighbour);
            }
        }
    }

    /// Whether the corner can be cut off.
    fn is_ear(&self, corner: usize, is_strict: bool) -> bool {
        let ear @ [a, b, c] = self.triangle(corner);
        // Doubled corners and spikes bound nothing.
        if a == b || b == c || a == c {
            return true;
        }
        let own = [self.before[corner], corner, self.after[corner]];
        match turn(a, b, c) {
            Ordering::Less => false,
            // On an edge, where a neighbour of the polygon may have a corner too.
            Ordering::Equal => !is_strict,
            Ordering::Greater => {
                let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                let near = |p: DVec2| p.cmpge(low).all() && p.cmple(high).all();
                let mut others = self.notches.iter().filter(|notch| near(self.points[**notch]) && !own.contains(notch));
                !others.any(|&notch| self.reaches_into(ear, notch, is_strict))
            }
        }
    }

    /// Whether the polygon reaches into `ear` at `notch`, which is no corner of it.
    fn reaches_into(&self, ear: [DVec2; 3], notch: usize, is_strict: bool) -> bool {
        let p = self.points[notch];
        if let Some(k) = ear.iter().position(|&corner| corner == p) {
            // Polygons with holes have such places: what counts is where the edges go from there.
            let (next, last) = (ear[(k + 1) % 3], ear[(k + 2) % 3]);
            let is_between = |q: DVec2| turn(p, next, q) == Ordering::Greater && turn(p, q, last) == Ordering::Greater;
            return [self.before[notch], self.after[notch]].into_iter().any(|i| is_between(self.points[i]));
        }
        let least = if is_strict { Ordering::Equal } else { Ordering::Greater };
        (0..3).all(|k| turn(ear[k], ear[(k + 1) % 3], p) >= least)
    }
}

/// Which way the path from `a` over `b` to `c` turns, `Greater` to the left, exactly: J. R. Shewchuk, "Adaptive Precision
/// Floating-Point Arithmetic and Fast Robust Geometric Predicates", Discrete & Computational Geometry 18, 1997.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> Ordering {
    /// The paper's bound of what rounding does to the difference of the two products.
    const BOUND: f64 = (3.0 + 8.0 * f64::EPSILON) * f64::EPSILON / 2.0;
    let (left, right) = ((a.x - c.x) * (b.y - c.y), (a.y - c.y) * (b.x - c.x));
    let area = left - right;
    if area.abs() >= BOUND * (left.abs() + right.abs()) {
        return sign(area);
    }
    let products = [(a.x, b.y), (-a.x, c.y), (-c.x, b.y), (-a.y, b.x), (a.y, c.x), (c.y, b.x)];
    // The sum without any rounding, as numbers whose digits do not overlap, the largest last.
    let (mut sum, mut count) = ([0.0; 12], 0);
    for (x, y) in products {
        let product = x * y;
        for mut more in [x.mul_add(y, -product), product] {
            for part in &mut sum[..count] {
                (more, *part) = two_sum(more, *part);
            }
            sum[count] = more;
            count += 1;
        }
    }
    sum.into_iter().rev().find(|&part| part != 0.0).map_or(Ordering::Equal, sign)
}

/// Of what is a number; zeros of both signs are equal.
fn sign(x: f64) -> Ordering {
    x.partial_cmp(&0.0).unwrap_or(Ordering::Equal)
}

/// The rounded sum, and what rounding took from it (D. E. Knuth, "The Art of Computer Programming", volume 2).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

#[cfg(test)]
mod tests;
