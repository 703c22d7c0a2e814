//! Solids in text databases of version 5: keys and values.

use glam::DVec3;

use super::model::ObjectKind;
use super::solid::{PipePoint, Solid};
use super::tcl::{Word, Words};
use crate::error::Result;
use crate::scene::text::shown;

/// The next element of a list as a finite number.
pub(super) fn number(words: &mut Words<'_>, what: &str) -> Result<f64> {
    let word = words.expect(what)?;
    let value: Option<f64> = std::str::from_utf8(word.bytes).ok().and_then(|text| text.parse().ok());
    value
        .filter(|v| v.is_finite())
        .ok_or_else(|| words.error(word.at, format!("expected {what} (a finite number), found {}", shown(word.bytes))))
}

/// Keys and values of a solid.
struct Keys<'a, 'w> {
    words: &'w Words<'a>,
    /// Where the command begins, for what is missing.
    start: usize,
    pairs: &'w [Word<'a>],
}

impl<'a> Keys<'a, '_> {
    fn find(&self, key: &str) -> Option<Word<'a>> {
        self.pairs.chunks_exact(2).find(|pair| pair[0].bytes == key.as_bytes()).map(|pair| pair[1])
    }

    fn value(&self, key: &str) -> Result<Word<'a>> {
        self.find(key).ok_or_else(|| self.words.error(self.start, format!("expected the key `{key}`")))
    }

    fn number(&self, key: &str) -> Result<f64> {
        let word = self.value(key)?;
        number(&mut self.words.inside(word), &format!("the number `{key}`"))
    }

    fn vector(&self, key: &str) -> Result<DVec3> {
        self.vector_in(self.value(key)?, key)
    }

    fn vector_in(&self, word: Word<'a>, key: &str) -> Result<DVec3> {
        let mut list = self.words.inside(word);
        let mut next = || number(&mut list, &format!("three numbers for `{key}`"));
        Ok(DVec3::new(next()?, next()?, next()?))
    }

    /// The values of `V0`, `V1` and so on: as many as there are, in order.
    fn numbered(&self, prefix: u8) -> impl Iterator<Item = Word<'a>> {
        let mut next = 0usize;
        self.pairs.chunks_exact(2).filter_map(move |pair| {
            let [first, digits @ ..] = pair[0].bytes else { return None };
            let index: usize = std::str::from_utf8(digits).ok()?.parse().ok()?;
            (*first == prefix && index == next).then(|| {
                next += 1;
                pair[1]
            })
        })
    }
}

/// The solid of `kind` whose keys and values are `pairs`; kinds unknown here become [`ObjectKind::Unsupported`].
pub(super) fn solid<'a>(words: &Words<'a>, start: usize, kind: &str, pairs: &[Word<'a>]) -> Result<ObjectKind> {
    let keys = Keys { words, start, pairs };
    let v = |key| keys.vector(key);
    let n = |key| keys.number(key);
    let solid = match kind {
        "arb4" | "arb5" | "arb6" | "arb7" | "arb8" => arb(&keys)?,
        "ell" | "sph" => Solid::Ell { v: v("V")?, axes: [v("A")?, v("B")?, v("C")?] },
        "tgc" | "rec" => Solid::Tgc { v: v("V")?, h: v("H")?, base: [v("A")?, v("B")?], top: [v("C")?, v("D")?] },
        "tor" => {
            let (h, major, minor) = (v("H")?.normalize_or_zero(), n("r_a")?, n("r_h")?);
            Solid::Tor { v: v("V")?, h, major, minor }
        }
        "half" => Solid::Half { n: v("N")?, d: n("d")? },
        "ehy" => {
            let a = v("A")?.normalize_or_zero();
            Solid::Ehy { v: v("V")?, h: v("H")?, a, r1: n("r_1")?, r2: n("r_2")?, c: n("c")? }
        }
        "epa" => {
            let a = v("A")?.normalize_or_zero();
            Solid::Epa { v: v("V")?, h: v("H")?, a, r1: n("r_1")?, r2: n("r_2")? }
        }
        "rpc" => Solid::Rpc { v: v("V")?, h: v("H")?, b: v("B")?, r: n("r")? },
        "rhc" => Solid::Rhc { v: v("V")?, h: v("H")?, b: v("B")?, r: n("r")?, c: n("c")? },
        "eto" => Solid::Eto { v: v("V")?, n: v("N")?, c: v("C")?, r: n("r")?, rd: n("r_d")? },
        "hyp" => Solid::Hyp { v: v("V")?, h: v("H")?, a: v("A")?, b: n("b")?, neck: n("bnr")? },
        "part" => Solid::Part { v: v("V")?, h: v("H")?, r_v: n("r_V")?, r_h: n("r_H")? },
        "pipe" => pipe(&keys)?,
        "arbn" => arbn(&keys)?,
        "bot" => bot(&keys)?,
        _ => return Ok(ObjectKind::Unsupported(kind.to_owned())),
    };
    Ok(ObjectKind::Solid(solid))
}

/// `V1` to at most `V8`: fewer for arb4 to arb7.
fn arb(keys: &Keys<'_, '_>) -> Result<Solid> {
    const NAMES: [&str; 8] = ["V1", "V2", "V3", "V4", "V5", "V6", "V7", "V8"];
    let mut points = Vec::with_capacity(NAMES.len());
    for name in NAMES {
        match keys.find(name) {
            Some(word) => points.push(keys.vector_in(word, name)?),
            None => break,
        }
    }
    Solid::arb(&points).ok_or_else(|| {
        keys.words
            .error(keys.start, format!("expected the corners V1 to V4 at least, up to V8, found {}", points.len()))
    })
}

/// `V0 {x y z} O0 outer I0 inner R0 bend V1 ...`.
fn pipe(keys: &Keys<'_, '_>) -> Result<Solid> {
    let [mut outer, mut inner, mut bend] = [b'O', b'I', b'R'].map(|prefix| keys.numbered(prefix));
    let mut points = Vec::new();
    for at in keys.numbered(b'V') {
        let next = |what: &str, word: Option<Word<'_>>| match word {
            Some(word) => number(&mut keys.words.inside(word), what),
            None => Err(keys.words.error(at.at, format!("expected {what} for this point of the pipe"))),
        };
        points.push(PipePoint {
            at: keys.vector_in(at, "a point of the pipe")?,
            outer: next("an outer diameter (key O)", outer.next())?,
            inner: next("an inner diameter (key I)", inner.next())?,
            bend: next("a bend radius (key R)", bend.next())?,
        });
    }
    Ok(Solid::Pipe(points))
}

/// `N count P0 {x y z d} P1 ...`.
fn arbn(keys: &Keys<'_, '_>) -> Result<Solid> {
    let mut planes = Vec::new();
    for word in keys.numbered(b'P') {
        let mut list = keys.words.inside(word);
        let mut next = || number(&mut list, "four numbers for a plane");
        planes.push((DVec3::new(next()?, next()?, next()?), next()?));
    }
    Ok(Solid::Arbn(planes))
}

/// `mode volume|surf|plate|plate_nocos ... V {{x y z} ...} F {{a b c} ...}`.
fn bot(keys: &Keys<'_, '_>) -> Result<Solid> {
    let mode = keys.value("mode")?;
    let mode = match mode.bytes {
        b"surf" | b"surface" => 1,
        b"volume" | b"solid" => 2,
        b"plate" => 3,
        b"plate_nocos" => 4,
        other => {
            let what = format!("expected the mode surf, volume, plate or plate_nocos, found {}", shown(other));
            return Err(keys.words.error(mode.at, what));
        }
    };
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    let mut list = keys.words.inside(keys.value("V")?);
    while let Some(word) = list.next()? {
        vertices.push(keys.vector_in(word, "V")?);
    }
    let mut list = keys.words.inside(keys.value("F")?);
    while let Some(word) = list.next()? {
        let mut corners = keys.words.inside(word);
        let mut face = [0; 3];
        for corner in &mut face {
            let word = corners.expect("three vertex numbers")?;
            let value = std::str::from_utf8(word.bytes).ok().and_then(|text| text.parse::<u32>().ok());
            *corner = value.filter(|&v| (v as usize) < vertices.len()).ok_or_else(|| {
                let what = format!("expected a vertex number below {}, found {}", vertices.len(), shown(word.bytes));
                keys.words.error(word.at, what)
            })?;
        }
        faces.push(face);
    }
    Ok(Solid::Bot { mode, vertices, faces })
}
