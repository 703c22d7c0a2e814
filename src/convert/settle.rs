//! Where the vertex of a piece of surface goes: onto the corner, the edge or the surface itself.
//!
//! The crossings of a cell's edges give planes, and these a first guess (see [`super::qef`]). It is off where the
//! surface is curved, and where an edge of the grid does not see all faces that meet in the cell. So the crossings
//! are looked for again, nearer to the guess: rays along the same normals, from points a quarter as far away; twice.
//! At that scale curvature is gone and what still bends is an edge or a corner: Newton's iteration, with the tracer
//! as the function. A last ray tells whether the vertex is on the surface; if not, rays along the axes of the planes
//! look for the face that is missing.

use glam::DVec3;

use super::lines::{Crossing, Line, Tracer};
use super::qef::{Plane, Qef};
use crate::scene::world::World;

/// How much nearer the crossings of the next look are.
const SHRINK: f64 = 0.25;
/// Number of looks.
const LOOKS: i32 = 2;
/// Faces looked for.
const TRIES: usize = 3;
/// Shares of a cell within which a vertex is on the surface.
const ON: f64 = 1e-3;
/// The same for an edge that two of several faces make, whose tangents may have been taken a cell away.
const NEAR: f64 = 0.05;
/// Shares of a cell within which a face that was not seen may be the one that is missing.
const CLOSE: f64 = 0.5;
/// Cosine of the angle within which normals are of one face.
const SAME_FACE: f64 = 0.94;
/// Cells beyond its own that a vertex may go.
pub const REACH: f64 = 2.0;
/// Cosine beyond which a crossing is of another face than the one looked for.
const TURNED: f64 = 0.3;
/// Points this much outside of a cell, in its edges, count as inside.
const SLACK: f64 = 1e-9;

/// What the edges of a cell see of one piece of the surface.
#[derive(Debug)]
pub struct Piece {
    /// The crossings, not empty.
    pub planes: Vec<Plane>,
    /// Lower corner of the cell.
    pub lo: DVec3,
    /// Upper corner.
    pub hi: DVec3,
}

/// Where its vertex goes.
#[derive(Clone, Copy, Debug)]
pub struct Settled {
    /// In the cell.
    pub position: DVec3,
    /// Unit normal there, or nearly.
    pub normal: DVec3,
    /// 1 on a face, 2 on an edge, 3 in a corner.
    pub rank: usize,
    /// The corner or edge that the piece runs to if that is beyond the cell, and its rank.
    pub beyond: Option<(DVec3, usize)>,
}

/// A piece on its way.
struct Work<'a> {
    piece: &'a Piece,
    /// Planes known, of the cell and of faces found.
    known: Vec<Plane>,
    /// Planes of the last look.
    seen: Vec<Plane>,
    at: DVec3,
    rank: usize,
    /// Whether the last look saw all faces, and all of them meet here.
    sure: bool,
    state: State,
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    Open,
    /// On the surface.
    Found,
    Lost,
}

/// Settles pieces, all of cells of one size.
pub fn settle(world: &World<f64>, pieces: &[Piece], spacing: f64) -> Vec<Settled> {
    let mut tracer = Tracer::default();
    let start = |piece| Work {
        piece,
        known: piece.planes.clone(),
        seen: Vec::new(),
        at: DVec3::ZERO,
        rank: 1,
        sure: false,
        state: State::Open,
    };
    let mut works: Vec<Work> = pieces.iter().map(start).collect();
    for tries in 0..=TRIES {
        works.iter_mut().filter(|w| w.state == State::Open).for_each(|w| w.begin(spacing));
        for look in 1..=LOOKS {
            look_nearer(world, &mut tracer, &mut works, spacing, SHRINK.powi(look));
        }
        judge(world, &mut tracer, &mut works, spacing);
        if tries < TRIES {
            look_for_faces(world, &mut tracer, &mut works, spacing);
        }
    }
    let other = within(world, &mut tracer, &works, spacing);
    works.iter().zip(other).map(|(work, other)| work.end(other)).collect()
}

impl Work<'_> {
    fn begin(&mut self, spacing: f64) {
        self.seen.clone_from(&self.known);
        self.guess(spacing);
        let is_one_face = Qef::new(&self.seen).is_flat() && self.is_on_all(spacing);
        if is_one_face && self.piece.contains(self.at, 0.0) && self.known.len() == self.piece.planes.len() {
            self.state = State::Found;
        }
    }

    /// Whether all planes seen pass through the guess.
    fn is_on_all(&self, spacing: f64) -> bool {
        self.seen.iter().all(|p| p.normal.dot(self.at - p.point).abs() <= ON * spacing)
    }

    /// The point that the planes seen fix, not too far beyond the cell.
    fn guess(&mut self, spacing: f64) {
        let beyond = REACH * spacing;
        let qef = Qef::new(&self.seen);
        self.rank = qef.rank();
        while self.rank > 1 && !self.piece.contains(qef.point(self.rank), beyond) {
            self.rank -= 1;
        }
        self.at = qef.point(self.rank).clamp(self.piece.lo - beyond, self.piece.hi + beyond);
    }

    fn normal(&self) -> DVec3 {
        mean_normal(&self.seen)
    }

    fn end(&self, other: Option<Settled>) -> Settled {
        match other {
            None => Settled { position: self.at, normal: self.normal(), rank: self.rank, beyond: None },
            Some(other) => {
                let beyond = (self.state == State::Found && self.rank > 1).then_some((self.at, self.rank));
                Settled { beyond, ..other }
            }
        }
    }
}

impl Piece {
    /// Whether the cell, wider by `more` on all sides, contains a point.
    fn contains(&self, point: DVec3, more: f64) -> bool {
        let more = DVec3::splat(more) + SLACK * (self.hi - self.lo);
        point.cmpge(self.lo - more).all() && point.cmple(self.hi + more).all()
    }
}

fn mean_normal(planes: &[Plane]) -> DVec3 {
    let first = planes.first().map_or(DVec3::Z, |p| p.normal);
    planes.iter().map(|p| p.normal).sum::<DVec3>().normalize_or(first)
}

/// Looks for the crossings again, nearer to the guesses: within the share `near` of a cell.
fn look_nearer(world: &World<f64>, tracer: &mut Tracer, works: &mut [Work], spacing: f64, near: f64) {
    let size = near * spacing;
    let open = || works.iter().filter(|w| w.state == State::Open);
    let lines: Vec<Line> = open()
        .flat_map(|w| w.seen.iter().map(|p| Line::through(w.at + SHRINK * (p.point - w.at), p.normal, 2.0 * size)))
        .collect();
    let found = tracer.nearest(world, &lines);
    let mut rest = lines.iter().zip(&found);
    for work in works.iter_mut().filter(|w| w.state == State::Open) {
        let mut again = Vec::with_capacity(work.seen.len());
        for (line, crossing) in rest.by_ref().take(work.seen.len()) {
            if let Some(c) = crossing.as_ref().filter(|c| c.normal.dot(line.dir) > TURNED) {
                again.push(Plane { point: line.at(c.t), normal: c.normal });
            }
        }
        work.sure = again.len() == work.seen.len();
        if !again.is_empty() {
            work.seen = again;
            work.guess(spacing);
        }
        work.sure &= work.is_on_all(spacing);
    }
}

/// Finds out who is on the surface.
fn judge(world: &World<f64>, tracer: &mut Tracer, works: &mut [Work], spacing: f64) {
    let lines: Vec<Line> =
        works.iter().filter(|w| w.state == State::Open).map(|w| Line::through(w.at, w.normal(), spacing)).collect();
    let found = tracer.nearest(world, &lines);
    for ((work, line), crossing) in works.iter_mut().filter(|w| w.state == State::Open).zip(&lines).zip(found) {
        let Some(c) = crossing.filter(|c| (c.t - spacing).abs() <= ON * spacing) else { continue };
        work.state = State::Found;
        if work.rank == 1 {
            work.at = line.at(c.t);
        }
    }
}

/// Looks along the axes of the planes for a face that was not seen yet.
fn look_for_faces(world: &World<f64>, tracer: &mut Tracer, works: &mut [Work], spacing: f64) {
    let lines: Vec<Line> = works
        .iter()
        .filter(|w| w.state == State::Open)
        .flat_map(|w| Qef::new(&w.known).axes.map(|axis| Line::through(w.at, axis, spacing)))
        .collect();
    let found = tracer.nearest(world, &lines);
    for (i, work) in works.iter_mut().filter(|w| w.state == State::Open).enumerate() {
        let mut best: Option<(bool, f64, Plane)> = None;
        for (line, crossing) in lines[3 * i..].iter().zip(&found[3 * i..]).take(3) {
            let Some(Crossing { t, normal, .. }) = *crossing else { continue };
            let old = work.known.iter().any(|p| p.normal.dot(normal) > SAME_FACE);
            let away = (t - spacing).abs();
            if best.is_none_or(|b| (old, away) < (b.0, b.1)) {
                best = Some((old, away, Plane { point: line.at(t), normal }));
            }
        }
        match best {
            // Where two solids touch, a ray through the edge they share passes from one into the other.
            _ if work.sure && best.is_none_or(|(old, away, _)| old || away > CLOSE * spacing) => {
                work.state = State::Found;
            }
            Some((_, _, plane)) => work.known.push(plane),
            None => work.state = State::Lost,
        }
    }
}

/// For pieces whose vertex was not found in their own cell: the best place there.
fn within(world: &World<f64>, tracer: &mut Tracer, works: &[Work], spacing: f64) -> Vec<Option<Settled>> {
    let at_home = |w: &Work| w.state == State::Found && w.piece.contains(w.at, 0.0);
    let choices: Vec<Vec<Choice>> = works.iter().map(|w| if at_home(w) { Vec::new() } else { choices(w) }).collect();
    let lines: Vec<Line> = choices.iter().flatten().map(|c| Line::through(c.point, c.normal, spacing)).collect();
    let found = tracer.nearest(world, &lines);
    let mut rest = lines.iter().zip(&found);
    let settle = |(work, list): (&Work, &Vec<Choice>)| {
        let mut best = None;
        for (choice, (line, crossing)) in list.iter().zip(rest.by_ref()) {
            let Some(c) = crossing else { continue };
            let away = (c.t - spacing).abs();
            let position = if choice.is_edge { choice.point } else { line.at(c.t) };
            if best.is_none() && work.piece.contains(position, 0.0) && (!choice.is_edge || away <= NEAR * spacing) {
                let rank = 1 + usize::from(choice.is_edge);
                best = Some(Settled { position, normal: choice.normal, rank, beyond: None });
            }
        }
        let middle = || Settled {
            position: Qef::new(&work.piece.planes).middle,
            normal: mean_normal(&work.piece.planes),
            rank: 1,
            beyond: None,
        };
        (!list.is_empty()).then(|| best.unwrap_or_else(middle))
    };
    works.iter().zip(&choices).map(settle).collect()
}

/// A place in a cell that may be on the surface.
struct Choice {
    point: DVec3,
    normal: DVec3,
    /// Whether it is where two faces meet: then it stays where it is.
    is_edge: bool,
}

/// Edges that pairs of faces make in the cell, then the faces, the one seen most first.
fn choices(work: &Work) -> Vec<Choice> {
    let mut faces: Vec<Vec<Plane>> = Vec::new();
    for plane in &work.known {
        match faces.iter_mut().find(|face| face[0].normal.dot(plane.normal) > SAME_FACE) {
            Some(face) => face.push(*plane),
            None => faces.push(vec![*plane]),
        }
    }
    faces.sort_by_key(|face| std::cmp::Reverse(face.len()));
    faces.truncate(4);
    let mut list = Vec::new();
    for (i, first) in faces.iter().enumerate() {
        for second in &faces[..i] {
            let both = [&first[..], second].concat();
            let qef = Qef::new(&both);
            let point = qef.point(2);
            if qef.rank() > 1 && work.piece.contains(point, 0.0) {
                list.push(Choice { point, normal: mean_normal(&both), is_edge: true });
            }
        }
    }
    let face =
        |planes: &[Plane]| Choice { point: Qef::new(planes).point(1), normal: mean_normal(planes), is_edge: false };
    list.extend(faces.iter().map(|planes| face(planes)));
    list.push(face(&work.piece.planes));
    list
}
