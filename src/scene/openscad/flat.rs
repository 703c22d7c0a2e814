//! Plane figures: polygons with holes, and what is made of several.
//!
//! Booleans are those of the crate `i_overlay`, in whole numbers of 64 bits, which hold all digits of the f64 that they
//! come from but for what the size of the figure hides.

use std::panic::{UnwindSafe, catch_unwind};

use glam::{DMat3, DVec2};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::overlay::FloatOverlay;

use super::work::Work;

/// A point of a contour.
pub(super) type Point = [f64; 2];
/// A closed chain of points, without the first one again.
pub(super) type Contour = Vec<Point>;

/// Most times that the edges of figures may cross where they are combined.
const MAX_CROSSINGS: u64 = 1 << 20;

/// Largest coordinate of what is combined.
const FARTHEST: f64 = 1e60;

/// Steps that combining takes for each edge, about.
const COST: u64 = 64;

/// A figure.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Flat {
    /// Polygons that do not overlap: the outer contour, counter-clockwise, then those of holes, clockwise.
    pub shapes: Vec<Vec<Contour>>,
}

impl Flat {
    /// One contour that does not cross itself, counter-clockwise.
    pub fn simple(contour: impl Iterator<Item = DVec2>) -> Self {
        Self { shapes: vec![vec![contour.map(|p| p.to_array()).collect()]] }
    }

    /// What an odd number of `contours` are around.
    ///
    /// # Errors
    /// Too much work.
    pub fn even_odd(contours: &[Contour], work: &mut Work) -> Result<Self, String> {
        resolved(contours, FillRule::EvenOdd, work)
    }

    /// What `contours` go around counter-clockwise more often than clockwise.
    ///
    /// # Errors
    /// Too much work.
    pub fn positive(contours: &[Contour], work: &mut Work) -> Result<Self, String> {
        resolved(contours, FillRule::Positive, work)
    }

    /// Whether there is nothing of it.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// All contours.
    pub fn contours(&self) -> impl Iterator<Item = &Contour> {
        self.shapes.iter().flatten()
    }

    /// All points.
    pub fn points(&self) -> impl Iterator<Item = DVec2> {
        self.contours().flatten().map(|&p| DVec2::from(p))
    }

    /// Lower and upper corner of its box, if there is anything of it.
    pub fn bounds(&self) -> Option<(DVec2, DVec2)> {
        self.points().map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// The figure under `map`, which takes (x, y, 1) to (x, y, _). Of a map that flattens it nothing is left.
    pub fn mapped(mut self, map: &DMat3) -> Self {
        let determinant = map.x_axis.x * map.y_axis.y - map.x_axis.y * map.y_axis.x;
        if determinant == 0.0 {
            return Self::default();
        }
        for contour in self.shapes.iter_mut().flatten() {
            for point in contour.iter_mut() {
                let p = *map * DVec2::from(*point).extend(1.0);
                *point = [p.x, p.y];
            }
            if determinant < 0.0 {
                contour.reverse();
            }
        }
        self
    }
}

/// What is in any of `figures`.
///
/// # Errors
/// Too much work.
pub(super) fn union(mut figures: Vec<Flat>, work: &mut Work) -> Result<Flat, String> {
    figures.retain(|figure| !figure.is_empty());
    if figures.len() < 2 {
        return Ok(figures.pop().unwrap_or_default());
    }
    resolved(&contours(&figures), FillRule::NonZero, work)
}

/// What is in the first of `figures` and in none of the others.
///
/// # Errors
/// Too much work.
pub(super) fn difference(figures: Vec<Flat>, work: &mut Work) -> Result<Flat, String> {
    let mut figures = figures.into_iter();
    let first = figures.next().unwrap_or_default();
    let others: Vec<Flat> = figures.collect();
    combined(first, &others, OverlayRule::Difference, work)
}

/// What is in all of `figures`.
///
/// # Errors
/// Too much work.
pub(super) fn intersection(figures: Vec<Flat>, work: &mut Work) -> Result<Flat, String> {
    let mut figures = figures.into_iter();
    let first = figures.next().unwrap_or_default();
    figures.try_fold(first, |all, figure| match all.is_empty() || figure.is_empty() {
        true => Ok(Flat::default()),
        false => combined(all, &[figure], OverlayRule::Intersect, work),
    })
}

fn combined(first: Flat, others: &[Flat], rule: OverlayRule, work: &mut Work) -> Result<Flat, String> {
    if first.is_empty() || others.iter().all(Flat::is_empty) {
        return Ok(first);
    }
    let (subject, clip) = (contours(std::slice::from_ref(&first)), contours(others));
    check(subject.iter().chain(&clip), work)?;
    caught(|| FloatOverlay::<Point, i64>::from_subj_and_clip(&subject, &clip).overlay(rule, FillRule::NonZero))
}

fn contours(figures: &[Flat]) -> Vec<Contour> {
    figures.iter().flat_map(|figure| figure.contours().cloned()).collect()
}

fn resolved(contours: &[Contour], rule: FillRule, work: &mut Work) -> Result<Flat, String> {
    check(contours.iter(), work)?;
    let contours: Vec<Contour> = contours.iter().filter(|contour| contour.len() > 2).cloned().collect();
    if contours.is_empty() {
        return Ok(Flat::default());
    }
    caught(|| FloatOverlay::<Point, i64>::from_subj(&contours).overlay(OverlayRule::Subject, rule))
}

/// The figure of `shapes`; a panic of what makes them is an error. Contours that bound nothing are left out.
fn caught(shapes: impl FnOnce() -> Vec<Vec<Contour>> + UnwindSafe) -> Result<Flat, String> {
    let mut shapes = catch_unwind(shapes).map_err(|_| "its outlines cannot be combined")?;
    shapes.retain(|shape| shape.first().is_some_and(|outer| outer.len() > 2));
    shapes.iter_mut().for_each(|shape| shape.retain(|contour| contour.len() > 2));
    Ok(Flat { shapes })
}

/// Refuses contours whose edges cross too often to be combined: of a few thousand edges each may cross each.
fn check<'c>(contours: impl Iterator<Item = &'c Contour>, work: &mut Work) -> Result<(), String> {
    let mut edges: Vec<[DVec2; 2]> = Vec::new();
    for contour in contours {
        if !contour.iter().flatten().all(|x| x.abs() <= FARTHEST) {
            return Err(format!("a point of it is farther than {FARTHEST:e} from the origin"));
        }
        for (i, &p) in contour.iter().enumerate() {
            edges.push([DVec2::from(p), DVec2::from(contour[(i + 1) % contour.len()])]);
        }
    }
    work.steps(COST * edges.len() as u64)?;
    edges.sort_by(|a, b| a[0].x.min(a[1].x).total_cmp(&b[0].x.min(b[1].x)));
    let mut reached: Vec<[DVec2; 2]> = Vec::new();
    let mut crossings = 0;
    for edge in edges {
        let begin = edge[0].x.min(edge[1].x);
        work.steps(1 + reached.len() as u64)?;
        reached.retain(|other| other[0].x.max(other[1].x) >= begin);
        crossings += reached.iter().filter(|other| cross(&edge, other)).count() as u64;
        if crossings > MAX_CROSSINGS {
            return Err(format!("its outlines cross more than {MAX_CROSSINGS} times"));
        }
        reached.push(edge);
    }
    Ok(())
}

/// Whether two edges cross, but for roundings; those that only touch do not.
fn cross(a: &[DVec2; 2], b: &[DVec2; 2]) -> bool {
    let sides = |edge: &[DVec2; 2], other: &[DVec2; 2]| {
        let along = edge[1] - edge[0];
        along.perp_dot(other[0] - edge[0]) * along.perp_dot(other[1] - edge[0])
    };
    sides(a, b) < 0.0 && sides(b, a) < 0.0
}
