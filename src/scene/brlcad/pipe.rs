//! Pipes as solids of straight runs and bends.
//!
//! A bend of radius R at a point where two runs meet at an angle is a part of a torus: it touches both runs at
//! R tan(a/2) from the point, a being how far the direction turns, and its centre lies on the inner bisector.

use glam::DVec3;

use super::solid::PipePoint;
use crate::scene::solids::{NodeId, NodeKind, Placed, SolidTree, cone, half_space, torus};

/// Runs that turn by less than this, radians, are straight.
const STRAIGHT: f64 = 1e-6;

/// Adds the pipe through `points` to `tree`: what its outer surface encloses without what its inner one does.
///
/// # Errors
/// In words, what about the points makes no pipe.
pub(super) fn add(tree: &mut SolidTree, points: &[PipePoint]) -> Result<NodeId, String> {
    if points.len() < 2 {
        return Err(format!("a pipe needs two points at least, it has {}", points.len()));
    }
    let outer = hull(tree, points, |point| point.outer * 0.5)?;
    if points.iter().all(|point| point.inner <= 0.0) {
        return Ok(outer);
    }
    let inner = hull(tree, points, |point| point.inner * 0.5)?;
    Ok(tree.op(NodeKind::Difference(vec![outer, inner])))
}

/// The union of runs and bends with the radii that `radius` gives.
fn hull(tree: &mut SolidTree, points: &[PipePoint], radius: impl Fn(&PipePoint) -> f64) -> Result<NodeId, String> {
    let mut parts = Vec::new();
    let mut from = points[0].at;
    for (i, pair) in points.windows(2).enumerate() {
        let [here, next] = pair else { continue };
        let radii = [radius(here), radius(next)];
        let bend = points.get(i + 2).and_then(|after| Bend::at(here.at, next, after.at));
        let to = bend.as_ref().map_or(next.at, |bend| bend.start);
        // A run may be nothing but the two bends at its ends.
        if (to - from).length() > 1e-9 * (next.at - here.at).length() && radii != [0.0; 2] {
            let part = cone(from, to, radii[0], radii[1]).map_err(|what| format!("a run of the pipe: {what}"))?;
            parts.push(tree.solid(part));
        }
        from = to;
        if let Some(bend) = bend {
            if radii[1] > 0.0 {
                parts.push(bend.add(tree, radii[1])?);
            }
            from = bend.end;
        }
    }
    Ok(tree.op(NodeKind::Union(parts)))
}

/// A turn of the pipe's axis.
struct Bend {
    centre: DVec3,
    axis: DVec3,
    radius: f64,
    start: DVec3,
    end: DVec3,
    /// Unit directions from the turning point back and on.
    back: DVec3,
    on: DVec3,
}

impl Bend {
    /// The bend at `point` between its neighbours; `None` where the pipe goes straight on.
    fn at(before: DVec3, point: &PipePoint, after: DVec3) -> Option<Self> {
        let back = (before - point.at).try_normalize()?;
        let on = (after - point.at).try_normalize()?;
        let turn = std::f64::consts::PI - back.dot(on).clamp(-1.0, 1.0).acos();
        let axis = back.cross(on).try_normalize()?;
        let inwards = (back + on).try_normalize()?;
        if turn < STRAIGHT || point.bend <= 0.0 {
            return None;
        }
        let reach = point.bend * (turn * 0.5).tan();
        let centre = point.at + inwards * (point.bend / (turn * 0.5).cos());
        let (start, end) = (point.at + back * reach, point.at + on * reach);
        Some(Self { centre, axis, radius: point.bend, start, end, back, on })
    }

    /// The torus between the planes where the runs begin.
    fn add(&self, tree: &mut SolidTree, radius: f64) -> Result<NodeId, String> {
        let named = |result: Result<Placed, String>| result.map_err(|what| format!("a bend of the pipe: {what}"));
        let ring = tree.solid(named(torus(self.centre, self.axis, self.radius, radius))?);
        let sides = [(self.back, self.start), (self.on, self.end)];
        let [first, last] = sides.map(|(n, p)| half_space(n, n.dot(p)));
        let (first, last) = (tree.solid(named(first)?), tree.solid(named(last)?));
        Ok(tree.op(NodeKind::Intersection(vec![ring, first, last])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_right_angle_touches_both_runs_at_the_bend_radius() {
        let point = PipePoint { at: DVec3::new(10.0, 0.0, 0.0), outer: 2.0, inner: 1.0, bend: 3.0 };
        let bend = Bend::at(DVec3::ZERO, &point, DVec3::new(10.0, 10.0, 0.0)).unwrap();
        let close = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-12, "{a} {b}");
        close(bend.start, DVec3::new(7.0, 0.0, 0.0));
        close(bend.end, DVec3::new(10.0, 3.0, 0.0));
        close(bend.centre, DVec3::new(7.0, 3.0, 0.0));
        assert!(Bend::at(DVec3::ZERO, &point, DVec3::new(20.0, 0.0, 0.0)).is_none(), "straight on");
    }

    #[test]
    fn hollow_pipes_are_differences_and_one_point_is_none() {
        let point = |x: f64| PipePoint { at: DVec3::X * x, outer: 2.0, inner: 1.0, bend: 2.0 };
        let mut tree = SolidTree::new("p");
        let root = add(&mut tree, &[point(0.0), point(5.0)]).unwrap();
        assert!(matches!(&tree.nodes[root as usize].kind, NodeKind::Difference(list) if list.len() == 2));
        assert!(add(&mut tree, &[point(0.0)]).unwrap_err().contains("two points"));
    }
}
