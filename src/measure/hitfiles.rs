//! Two files of hits of the same rays: which answers are the same, and for the others, which file the oracle believes.

use std::borrow::Borrow;
use std::path::Path;

use crate::error::{Error, Result};
use crate::film::metrics::{Classes, ulp_distance};
use crate::film::npy::{self, Kind};
use crate::measure::agreement;
use crate::measure::answers::Answers;
use crate::measure::raysets::split;
use crate::measure::truth::{self, Counts, OWN_MARGIN_FACTOR};
use crate::ray::{Hits, Rays};
use crate::reference::Oracle;
use crate::scene::assembly::Assembly;
use crate::scene::description::Description;

/// How two hit files compare.
#[derive(Clone, Debug, serde::Serialize)]
pub struct HitReport {
    /// `closest` or `any`.
    pub query: &'static str,
    /// Rays in the longer file.
    pub rays: u64,
    /// Rays in either file: what only one answers is beyond, and different.
    pub answers: [u64; 2],
    /// Rays by the largest distance of t, u and v in units in the last place; another primitive or instance is beyond.
    pub classes: Classes,
    /// Rays with the same t (up to [`agreement::TOLERANCE`]) on another primitive.
    pub ties: u64,
    /// Rays with another answer beyond rounding.
    pub differences: u64,
    /// The first of these, with both answers.
    pub first: Option<String>,
    /// The oracle's opinion of all rays whose bits differ, if there was a scene to ask about.
    pub judged: Option<Judged>,
    #[serde(skip)]
    unlike: Vec<u64>,
}

/// The oracle's opinion of both files.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Judged {
    /// Of the first file's answers.
    pub a: Counts,
    /// Of the second file's answers.
    pub b: Counts,
    /// Rays whose mismatch no margin explains, in either file.
    pub unexplained: u64,
}

/// Answers as a file holds them.
pub type FileAnswers = Answers<f32>;

/// Reads the answers in `path`, closest hits or occlusion; `None` if it is an array of another kind.
///
/// # Errors
/// Those of the readers in [`npy`].
pub fn read(path: &Path) -> Result<Option<FileAnswers>> {
    Ok(match npy::kind(path)? {
        Kind::Hits => Some(Answers::Closest(vec![npy::read_hits(path)?])),
        Kind::Occlusion => Some(Answers::Any(vec![npy::read_occlusion(path)?])),
        Kind::Numbers => None,
    })
}

/// Compares two files' answers without a scene.
///
/// # Errors
/// [`Error::Usage`] for answers to different queries.
pub fn compare(a: &FileAnswers, b: &FileAnswers) -> Result<HitReport> {
    let (query, classes, unlike) = match (a, b) {
        (Answers::Closest(a), Answers::Closest(b)) => by_class("closest", a, b, Hits::len, hit_distance),
        (Answers::Any(a), Answers::Any(b)) => {
            by_class("any", a, b, Vec::len, |a, b, i| if a[i] == b[i] { 0 } else { u64::MAX })
        }
        _ => return Err(Error::Usage("one file answers closest-hit, the other any-hit queries".into())),
    };
    let agreement = agreement::compare(a, b);
    let answers = [a.ray_count(), b.ray_count()];
    let (rays, ties, differences) = (agreement.rays, agreement.ties, agreement.differences());
    let first = agreement.first;
    Ok(HitReport { query, rays, answers, classes, ties, differences, first, judged: None, unlike })
}

/// Counts by distance, and the numbers of all rays that are not the same to the bit.
fn by_class<B>(
    query: &'static str,
    a: &[B],
    b: &[B],
    len: impl Fn(&B) -> usize,
    distance: impl Fn(&B, &B, usize) -> u64,
) -> (&'static str, Classes, Vec<u64>) {
    // A file is one batch.
    let (mut classes, mut unlike) = (Classes::default(), Vec::new());
    for (a, b) in a.iter().zip(b) {
        for i in 0..len(a).max(len(b)) {
            let far = if i < len(a).min(len(b)) { distance(a, b, i) } else { u64::MAX };
            classes.add(far);
            if far > 0 {
                unlike.push(i as u64);
            }
        }
    }
    (query, classes, unlike)
}

fn hit_distance(a: &Hits<f32>, b: &Hits<f32>, i: usize) -> u64 {
    if (a.prim[i], a.inst[i]) != (b.prim[i], b.inst[i]) {
        return u64::MAX;
    }
    let pairs = [(a.t[i], b.t[i]), (a.u[i], b.u[i]), (a.v[i], b.v[i])];
    // Zeros of different signs are not the same bits, but next to each other.
    let far = |(x, y): (f32, f32)| ulp_distance(x, y).max(u64::from(x.to_bits() != y.to_bits()));
    pairs.into_iter().map(far).max().unwrap_or(0)
}

/// Asks the oracle of `scene` about every ray whose answers differ in a bit; runs on the current rayon pool.
///
/// # Errors
/// Those of assembling the scene; [`Error::Usage`] if the files do not answer exactly these `rays`.
pub fn judge(
    report: &mut HitReport,
    answers: [&FileAnswers; 2],
    rays: &Rays<f32>,
    scene: impl Borrow<Description>,
) -> Result<()> {
    let counts = answers.map(Answers::ray_count);
    if counts != [rays.len() as u64; 2] {
        let [a, b] = counts;
        return Err(Error::Usage(format!("the files answer {a} and {b} rays, the ray file has {}", rays.len())));
    }
    let oracle = Oracle::new(&Assembly::new(scene.borrow())?);
    let batches = split::<f32>(rays, 1);
    let [a, b] = answers.map(|answers| {
        let batched = rebatched(answers, &batches);
        truth::judge_rays(&oracle, OWN_MARGIN_FACTOR, &batches, &batched, &report.unlike)
    });
    let unexplained = a.unexplained + b.unexplained;
    report.judged = Some(Judged { a, b, unexplained });
    Ok(())
}

/// The answers of one file cut like the rays.
fn rebatched(answers: &FileAnswers, batches: &[Rays<f32>]) -> FileAnswers {
    let mut at = 0;
    let mut range = |batch: &Rays<f32>| {
        at += batch.len();
        at - batch.len()..at
    };
    match answers {
        Answers::Closest(files) => {
            let all = &files[0];
            let cut = |batch: &Rays<f32>| {
                let mut hits = Hits::new(batch.len());
                for (to, from) in range(batch).enumerate() {
                    (hits.t[to], hits.u[to], hits.v[to]) = (all.t[from], all.u[from], all.v[from]);
                    (hits.prim[to], hits.inst[to]) = (all.prim[from], all.inst[from]);
                }
                hits
            };
            Answers::Closest(batches.iter().map(cut).collect())
        }
        Answers::Any(files) => Answers::Any(batches.iter().map(|batch| files[0][range(batch)].to_vec()).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::testing::falling_rays;
    use crate::scene::description::{Item, ItemKind, Shape};

    fn hits(t: &[f32]) -> FileAnswers {
        let mut hits = Hits::new(t.len());
        for (i, &t) in t.iter().enumerate() {
            (hits.t[i], hits.prim[i], hits.inst[i]) = (t, 0, 0);
        }
        Answers::Closest(vec![hits])
    }

    #[test]
    fn classes_of_hits_by_hand() {
        let (a, mut b) = (hits(&[1.0, 2.0, 3.0, 4.0]), hits(&[1.0, 2.0 + 2.0 * f32::EPSILON, 3.0, 5.0]));
        if let Answers::Closest(b) = &mut b {
            b[0].prim[2] = 7;
        }
        let report = compare(&a, &b).unwrap();
        assert_eq!(report.classes, Classes { exact: 1, within_one: 1, beyond: 2 });
        assert_eq!((report.rays, report.ties, report.differences), (4, 1, 1));
        assert_eq!(report.unlike, [1, 2, 3]);
        let any = Answers::Any(vec![vec![1, 0]]);
        assert!(compare(&a, &any).is_err());
        let longer = compare(&any, &Answers::Any(vec![vec![1, 1, 0]])).unwrap();
        assert_eq!((longer.classes.exact, longer.classes.beyond, longer.rays), (1, 2, 3));
        assert_eq!((report.answers, longer.answers), ([4, 4], [2, 3]));
    }

    /// The half-space below z = 0 and rays that fall from z = 1, 2, 3, ...: t is the height.
    #[test]
    fn the_oracle_says_which_file_is_wrong() {
        let mut scene = Description::new("floor");
        let kind = ItemKind::Shape(Shape::HalfSpace);
        scene.groups[0].items.push(Item { transform: glam::DAffine3::IDENTITY, material: None, kind });
        let rays = falling_rays::<f32>(&[3]).remove(0);
        let (right, wrong) = (hits(&[1.0, 2.0, 3.0]), hits(&[1.0, 2.0 + 2.0 * f32::EPSILON, 2.5]));
        let mut report = compare(&right, &wrong).unwrap();
        judge(&mut report, [&right, &wrong], &rays, &scene).unwrap();
        let judged = report.judged.unwrap();
        assert_eq!((judged.a.unexplained, judged.b.unexplained, judged.unexplained), (0, 1, 1));
        assert_eq!((judged.a.total(), judged.b.agree), (2, 1), "only the rays that differ are judged");
        assert!(judged.b.samples[0].starts_with("ray 2: "), "{judged:?}");
        let mut short = compare(&right, &right).unwrap();
        assert!(judge(&mut short, [&right, &hits(&[1.0])], &rays, &scene).is_err());
    }
}
