//! Judges an engine's answer for one ray: the two rules of the module's head.

use std::collections::{HashMap, HashSet};
use std::fmt;

use glam::DVec3;

use super::margin::{Id, Located, Margin};
use super::shapes::{self, Crossing};
use super::solids::verdict::Trees;
use super::{Oracle, OracleHit, OracleRay};
use crate::scene::description::Precision;

/// Sine of the angle between ray and surface below which t and the outcome count as grazing.
const GRAZING: f64 = 1e-3;
/// How far u and v may lie outside the triangle, at most.
const OUTSIDE: f64 = 1e-3;

/// An engine's closest hit, widened exactly to f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EngineHit {
    /// Ray parameter.
    pub t: f64,
    /// Triangles: weight of the second corner. Analytic shapes: number of the face.
    pub u: f64,
    /// Triangles: weight of the third corner. Analytic shapes: 0; leaves of solids: 1 where the surface was subtracted.
    pub v: f64,
    /// Primitive number in the instance's object.
    pub prim: u32,
    /// Placement number.
    pub inst: u32,
}

/// What rounding may have done to an answer that differs from the oracle's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// The ray passes an edge or border of a triangle within the margin.
    Edge,
    /// The ray passes the silhouette of an analytic shape within the margin.
    Tangent,
    /// Two surfaces are within the margin of each other where the ray meets them.
    Coincident,
    /// The hit is within the margin of an end of the segment.
    SegmentEnd,
    /// The ray runs almost along a triangle.
    Grazing,
}

impl Why {
    /// All kinds, in the order of their discriminants.
    pub const ALL: [Self; 5] = [Self::Edge, Self::Tangent, Self::Coincident, Self::SegmentEnd, Self::Grazing];
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Edge => "edge",
            Self::Tangent => "tangent",
            Self::Coincident => "coincident",
            Self::SegmentEnd => "segment end",
            Self::Grazing => "grazing",
        })
    }
}

/// The oracle's opinion of an answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// The oracle's primitive and instance; t, u and v within rounding.
    Agree,
    /// Different, within the rounding margin.
    Explained(Why),
    /// A fault, with the ray and both answers.
    Unexplained(String),
}

impl Oracle {
    /// Judges an engine's closest hit (`None`: a miss) of `ray`. `precision` is the arithmetic of the engine.
    pub fn judge(&self, ray: &OracleRay, answer: Option<EngineHit>, precision: Precision) -> Verdict {
        self.judge_within(ray, answer, precision, self.margin_factor)
    }

    /// [`Oracle::judge`] with another margin factor.
    pub fn judge_within(
        &self,
        ray: &OracleRay,
        answer: Option<EngineHit>,
        precision: Precision,
        margin_factor: f64,
    ) -> Verdict {
        let truth = self.closest_of(ray);
        if truth.is_none() && answer.is_none() {
            return Verdict::Agree;
        }
        let case = Case { oracle: self, ray, margin: Margin::new(margin_factor, precision) };
        if let (Some(hit), Some(answer)) = (truth, answer)
            && case.agrees(&hit, &answer)
        {
            return Verdict::Agree;
        }
        case.explain(truth, answer).unwrap_or_else(|fault| {
            Verdict::Unexplained(format!("{fault}; {ray:?}; engine {answer:?}; oracle {truth:?}"))
        })
    }

    /// Judges an engine's any-hit answer of `ray`: whether it is `occluded`.
    pub fn judge_occluded(&self, ray: &OracleRay, occluded: bool, precision: Precision) -> Verdict {
        self.judge_occluded_within(ray, occluded, precision, self.margin_factor)
    }

    /// [`Oracle::judge_occluded`] with another margin factor.
    pub fn judge_occluded_within(
        &self,
        ray: &OracleRay,
        occluded: bool,
        precision: Precision,
        margin_factor: f64,
    ) -> Verdict {
        let truth = self.closest_of(ray);
        if truth.is_some() == occluded {
            return Verdict::Agree;
        }
        let case = Case { oracle: self, ray, margin: Margin::new(margin_factor, precision) };
        let why = if occluded { case.grazed() } else { case.skipped(None).map(|why| why.unwrap_or(Why::Edge)) };
        why.map(Verdict::Explained).unwrap_or_else(|fault| {
            Verdict::Unexplained(format!("{fault}; {ray:?}; engine occluded {occluded}; oracle {truth:?}"))
        })
    }
}

/// One ray before the judge.
struct Case<'a> {
    oracle: &'a Oracle,
    ray: &'a OracleRay,
    margin: Margin,
}

type Finding<T> = Result<T, String>;

/// Sheets that a displaced ray was seen to miss, with the margin that allowed it. The same ray serves all their
/// members with that margin or a wider one: what else their sheets hold is farther away than it was displaced.
#[derive(Default)]
struct Missed(Vec<(f64, HashSet<Id>)>);

impl Missed {
    fn holds(&self, id: Id, delta: f64) -> bool {
        self.0.iter().any(|(margin, sheet)| *margin <= delta && sheet.contains(&id))
    }
}

impl<'a> Case<'a> {
    fn delta(&self, located: &Located, t: f64) -> f64 {
        let at = if t.is_finite() { self.ray.at(t) } else { self.ray.org };
        located.delta(&self.margin, self.ray.org, at)
    }

    fn trees(&self) -> Trees<'_> {
        Trees { oracle: self.oracle, ray: self.ray, margin: self.margin }
    }

    fn in_segment(&self, t: f64) -> bool {
        self.ray.t_min <= t && t <= self.ray.t_max
    }

    /// The quick check that most rays pass: the same surface, not edge-on, and the engine's point within delta of
    /// the tangent plane at the oracle's.
    fn agrees(&self, truth: &OracleHit, answer: &EngineHit) -> bool {
        let id = Id { inst: answer.inst, prim: answer.prim };
        if id != (Id { inst: truth.inst, prim: truth.prim }) || !self.in_segment(answer.t) {
            return false;
        }
        if let Some(placed) = self.trees().find(id) {
            return self.trees().agrees(&placed, truth, answer);
        }
        let Some(located) = self.oracle.locate(id) else { return false };
        let delta = self.delta(&located, truth.t);
        let cosine = truth.ng.dot(self.ray.dir).abs() / (truth.ng.length() * self.ray.dir.length());
        let off = (answer.t - truth.t).abs() * self.ray.dir.length();
        let near = off <= delta || (cosine >= GRAZING && off * cosine <= delta);
        let fits = match located.triangle() {
            Some(corners) => self.weights_fit(corners, answer, delta),
            None => (answer.u, answer.v) == (truth.u, truth.v),
        };
        near && fits
    }

    fn explain(&self, truth: Option<OracleHit>, answer: Option<EngineHit>) -> Finding<Verdict> {
        if !self.ray.is_live() {
            return Err("a dead ray was hit".into());
        }
        let real = answer.map(|answer| self.real(&answer)).transpose()?.flatten();
        let skipped = self.skipped(answer)?;
        let why = match skipped {
            Some(Why::Coincident | Why::SegmentEnd) => real.or(skipped),
            _ => skipped.or(real),
        };
        // Without a reason only t or the face differ: more than the quick check allows, less than the margin.
        let same = truth.zip(answer).is_some_and(|(hit, a)| (hit.inst, hit.prim) == (a.inst, a.prim));
        Ok(Verdict::Explained(why.unwrap_or(if same { Why::Grazing } else { Why::Coincident })))
    }

    /// Rule 1: what was reported is there. The reason if the true ray does not meet it there.
    fn real(&self, answer: &EngineHit) -> Finding<Option<Why>> {
        let id = Id { inst: answer.inst, prim: answer.prim };
        if let Some(placed) = self.trees().find(id) {
            return self.trees().real(&placed, answer);
        }
        let Some(located) = self.oracle.locate(id) else {
            return Err("reported a primitive that does not exist".into());
        };
        if !self.in_segment(answer.t) {
            return Err("reported t is outside the segment".into());
        }
        let delta = self.delta(&located, answer.t);
        if !located.passes(self.ray, answer.t, None, delta) {
            return Err(format!("reported surface is not within {delta:e} of the reported point"));
        }
        let fits = match located.triangle() {
            Some(corners) => self.weights_fit(corners, answer, delta),
            None => answer.v == 0.0 && located.shows(self.ray, answer.t, answer.u, delta),
        };
        if !fits {
            return Err("reported u, v do not fit the surface".into());
        }
        let crossings = located.crossings(self.ray);
        let mut hits = crossings.iter().flatten();
        Ok(match hits.clone().next() {
            None => Some(border(&located)),
            Some(_) if hits.any(|c| self.in_segment(c.t)) => None,
            Some(_) => Some(Why::SegmentEnd),
        })
    }

    /// Rule 2: what lies before the answer (`None`: a miss) can be missed. The weightiest reason, if there is any.
    fn skipped(&self, answer: Option<EngineHit>) -> Finding<Option<Why>> {
        let mut reason = None;
        let reported = answer.map(|a| Id { inst: a.inst, prim: a.prim });
        let until = answer.map_or(f64::INFINITY, |a| a.t);
        let mut missed = Missed::default();
        for located in self.oracle.near(self.ray, &self.margin, 0.0) {
            for (order, crossing) in located.crossings(self.ray).into_iter().enumerate() {
                let Some(crossing) = crossing.filter(|c| self.in_segment(c.t)) else { continue };
                let delta = self.delta(&located, crossing.t);
                if located.passes(self.ray, until, Some(order), delta) {
                    if reported != Some(located.id) {
                        reason = reason.or(Some(Why::Coincident));
                    }
                } else if crossing.t > until {
                    continue;
                } else if self.at_an_end(&located, order, delta) {
                    reason = reason.or(Some(Why::SegmentEnd));
                } else if self.missable(&located, delta, until, &mut missed) {
                    let edge_on = located.steepness(self.ray, crossing) < GRAZING;
                    let grazing = edge_on && located.triangle().is_some();
                    reason = Some(if grazing { Why::Grazing } else { border(&located) });
                } else {
                    return Err(self.skip_fault(&located, crossing, delta));
                }
            }
        }
        Ok(self.trees().skipped(until)?.or(reason))
    }

    fn skip_fault(&self, located: &Located, crossing: Crossing, delta: f64) -> String {
        let Id { inst, prim } = located.id;
        let t = crossing.t;
        format!("skipped primitive {prim} of instance {inst} at t = {t}: no ray within {delta:e} misses it")
    }

    fn at_an_end(&self, located: &Located, order: usize, delta: f64) -> bool {
        [self.ray.t_min, self.ray.t_max].into_iter().any(|end| located.passes(self.ray, end, Some(order), delta))
    }

    /// Whether some ray displaced by at most `delta` meets nothing of the sheet around `hit` before `until`.
    fn missable(&self, hit: &Located, delta: f64, until: f64, missed: &mut Missed) -> bool {
        if missed.holds(hit.id, delta) {
            return true;
        }
        // The oracle's own rounding hides the rims of what it crosses: a ray has to be displaced by that much more.
        let near = self.oracle.near(self.ray, &self.margin, delta);
        let blur = sheet(hit, &near).iter().map(|q| q.blur(self.ray)).fold(0.0, f64::max);
        let reach = delta + blur;
        let near = self.oracle.near(self.ray, &self.margin, reach);
        let sheet = sheet(hit, &near);
        // A crossing that the answer's own t or a segment end covers does not stand in the way.
        let excused = |q: &Located, order: usize| {
            let delta = self.delta(q, until);
            q.passes(self.ray, until, Some(order), delta) || self.at_an_end(q, order, delta)
        };
        let excused: Vec<_> = sheet.iter().map(|q| [excused(q, 0), excused(q, 1)]).collect();
        let misses = hit.displaced(self.ray, reach).any(|ray| {
            sheet.iter().zip(&excused).all(|(q, excused)| {
                let crossings = q.crossings(&ray).into_iter().zip(excused);
                let mut blocking = crossings.filter(|(_, excused)| !**excused).filter_map(|(c, _)| c);
                !blocking.any(|c| self.in_segment(c.t) && c.t <= until)
            })
        });
        if misses {
            missed.0.push((delta, sheet.iter().map(|q| q.id).collect()));
        }
        misses
    }

    /// Any-hit said occluded where the oracle finds nothing: something must be within the margin.
    fn grazed(&self) -> Finding<Why> {
        if !self.ray.is_live() {
            return Err("a dead ray was occluded".into());
        }
        if let Some(why) = self.trees().grazed() {
            return Ok(why);
        }
        let near = self.oracle.near(self.ray, &self.margin, 0.0);
        let nearest = near.first().ok_or("nothing within the margin of the segment")?;
        let crosses = near.iter().any(|q| q.crossings(self.ray).iter().any(Option::is_some));
        Ok(if crosses { Why::SegmentEnd } else { border(nearest) })
    }

    /// Whether u and v are the weights of the corners there: each edge function is off by at most delta times the
    /// longest edge, relative to the triangle's area as the ray sees it.
    fn weights_fit(&self, corners: [DVec3; 3], answer: &EngineHit, delta: f64) -> bool {
        let (u, v) = (answer.u, answer.v);
        let [p0, p1, p2] = corners;
        let ng = shapes::cross(p1 - p0, p2 - p0);
        let area = ng.dot(self.ray.dir).abs() / self.ray.dir.length();
        let longest = (p1 - p0).length().max((p2 - p0).length()).max((p2 - p1).length());
        let tolerance = delta * longest / area;
        let outside = tolerance.min(OUTSIDE);
        let inside = u >= -outside && v >= -outside && u + v <= 1.0 + outside;
        let plane = shapes::triangle_plane(corners, self.ray.org, self.ray.dir);
        inside && plane.is_none_or(|p| (p.u - u).abs() <= tolerance && (p.v - v).abs() <= tolerance)
    }
}

/// The reason a ray may pass a primitive by.
fn border(located: &Located) -> Why {
    if located.triangle().is_some() { Why::Edge } else { Why::Tangent }
}

/// `hit` and those of `near` that hang together with it over common edges: vertices equal in every bit.
fn sheet<'a>(hit: &Located<'a>, near: &[Located<'a>]) -> Vec<Located<'a>> {
    let Some(corners) = hit.triangle() else { return vec![*hit] };
    let key = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    let edges = |[p0, p1, p2]: [DVec3; 3]| {
        [(p0, p1), (p1, p2), (p2, p0)].map(|(a, b)| (key(a).min(key(b)), key(a).max(key(b))))
    };
    let mut of_edge: HashMap<_, Vec<usize>> = HashMap::new();
    for (i, located) in near.iter().enumerate().filter(|(_, q)| q.id.inst == hit.id.inst) {
        for edge in located.triangle().into_iter().flat_map(edges) {
            of_edge.entry(edge).or_default().push(i);
        }
    }
    let mut sheet = vec![*hit];
    let mut open: Vec<_> = edges(corners).into();
    let mut taken = vec![false; near.len()];
    while let Some(edge) = open.pop() {
        for i in of_edge.remove(&edge).unwrap_or_default() {
            if !std::mem::replace(&mut taken[i], true) && near[i].id != hit.id {
                sheet.push(near[i]);
                open.extend(near[i].triangle().into_iter().flat_map(edges));
            }
        }
    }
    sheet
}
