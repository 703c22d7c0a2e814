//! Bodies of solids: their numbers one after another.

use glam::DVec3;

use super::cursor::Cursor;
use crate::error::Result;
use crate::scene::brlcad::model::ObjectKind;
use crate::scene::brlcad::solid::{PipePoint, Solid};

/// BRL-CAD's names of the minor types, by their numbers.
const NAMES: [&str; 47] = [
    "", "tor", "tgc", "ell", "arb8", "ars", "half", "rec", "poly", "bspline", "sph", "nmg", "ebm", "vol", "arbn",
    "pipe", "part", "rpc", "rhc", "epa", "ehy", "eto", "grip", "joint", "hf", "dsp", "sketch", "extrude", "submodel",
    "cline", "bot", "comb", "", "", "", "superell", "metaball", "brep", "hyp", "constrnt", "revolve", "pnts", "annot",
    "hrt", "datum", "script", "material",
];

/// The solid of a minor type whose body `body` gives; kinds unknown here become [`ObjectKind::Unsupported`], and their
/// bodies are not asked for.
pub(super) fn solid<'a>(minor: u8, body: impl FnOnce() -> Result<Cursor<'a>>) -> Result<ObjectKind> {
    let kind = NAMES.get(usize::from(minor)).copied().filter(|name| !name.is_empty());
    let Some(kind) = kind else { return Ok(ObjectKind::Unsupported(format!("type 1.{minor}"))) };
    let solid = match kind {
        "arbn" => arbn(body()?)?,
        "pipe" => pipe(body()?)?,
        "bot" => bot(body()?)?,
        _ => match numbers_of(kind) {
            Some(count) => plain(kind, Numbers::new(kind, count, body()?)?)?,
            None => return Ok(ObjectKind::Unsupported(kind.to_owned())),
        },
    };
    Ok(ObjectKind::Solid(solid))
}

/// How many numbers a solid of that kind is; `None` for those that are something else.
fn numbers_of(kind: &str) -> Option<usize> {
    Some(match kind {
        "half" => 4,
        "tor" | "part" => 8,
        "rpc" => 10,
        "rhc" | "epa" | "eto" => 11,
        // The last one of a `hyp` means nothing.
        "ell" | "sph" | "ehy" | "hyp" => 12,
        "tgc" | "rec" => 18,
        "arb8" => 24,
        _ => return None,
    })
}

/// The numbers of a solid.
struct Numbers<'a> {
    what: String,
    body: Cursor<'a>,
}

impl<'a> Numbers<'a> {
    fn new(kind: &str, count: usize, body: Cursor<'a>) -> Result<Self> {
        if body.left() != 8 * count {
            let what = format!("expected {} bytes for the body of a `{kind}`, found {}", 8 * count, body.left());
            return Err(body.error(what));
        }
        Ok(Self { what: format!("a number of a `{kind}`"), body })
    }

    fn n(&mut self) -> Result<f64> {
        self.body.number(&self.what)
    }

    fn v(&mut self) -> Result<DVec3> {
        self.body.vector(&self.what)
    }
}

/// Kinds with a fixed number of numbers.
fn plain(kind: &str, mut from: Numbers<'_>) -> Result<Solid> {
    let (v, n) = (Numbers::v, Numbers::n);
    let from = &mut from;
    Ok(match kind {
        "half" => Solid::Half { n: v(from)?, d: n(from)? },
        "tor" => Solid::Tor { v: v(from)?, h: v(from)?.normalize_or_zero(), major: n(from)?, minor: n(from)? },
        "part" => Solid::Part { v: v(from)?, h: v(from)?, r_v: n(from)?, r_h: n(from)? },
        "rpc" => Solid::Rpc { v: v(from)?, h: v(from)?, b: v(from)?, r: n(from)? },
        "rhc" => Solid::Rhc { v: v(from)?, h: v(from)?, b: v(from)?, r: n(from)?, c: n(from)? },
        "epa" => {
            let (v, h, a) = (v(from)?, v(from)?, v(from)?.normalize_or_zero());
            Solid::Epa { v, h, a, r1: n(from)?, r2: n(from)? }
        }
        "ehy" => {
            let (v, h, a) = (v(from)?, v(from)?, v(from)?.normalize_or_zero());
            Solid::Ehy { v, h, a, r1: n(from)?, r2: n(from)?, c: n(from)? }
        }
        "eto" => Solid::Eto { v: v(from)?, n: v(from)?, c: v(from)?, r: n(from)?, rd: n(from)? },
        "hyp" => Solid::Hyp { v: v(from)?, h: v(from)?, a: v(from)?, b: n(from)?, neck: n(from)? },
        "tgc" | "rec" => Solid::Tgc { v: v(from)?, h: v(from)?, base: [v(from)?, v(from)?], top: [v(from)?, v(from)?] },
        "arb8" => {
            let mut points = [DVec3::ZERO; 8];
            for point in &mut points {
                *point = v(from)?;
            }
            Solid::Arb { points }
        }
        _ => Solid::Ell { v: v(from)?, axes: [v(from)?, v(from)?, v(from)?] },
    })
}

/// How many things of `size` bytes the rest of a body is, which must be as many as it says first.
fn counted(body: &mut Cursor<'_>, size: u64, what: &str) -> Result<()> {
    let start = body.clone();
    let count = body.u32(&format!("the number of {what}"))?;
    if u64::from(count) * size != body.left() as u64 {
        let found = body.left();
        return Err(start.error(format!("expected {count} {what} of {size} bytes each, found {found} bytes for them")));
    }
    Ok(())
}

fn arbn(mut body: Cursor<'_>) -> Result<Solid> {
    counted(&mut body, 32, "planes of an `arbn`")?;
    let mut planes = Vec::with_capacity(body.left() / 32);
    while body.left() > 0 {
        planes.push((body.vector("the normal of a plane")?, body.number("the distance of a plane")?));
    }
    Ok(Solid::Arbn(planes))
}

fn pipe(mut body: Cursor<'_>) -> Result<Solid> {
    counted(&mut body, 48, "points of a `pipe`")?;
    let mut points = Vec::with_capacity(body.left() / 48);
    while body.left() > 0 {
        let at = body.vector("a point of a `pipe`")?;
        let (inner, outer) = (body.number("an inner diameter")?, body.number("an outer diameter")?);
        points.push(PipePoint { at, outer, inner, bend: body.number("a bend radius")? });
    }
    Ok(Solid::Pipe(points))
}

/// Numbers of vertices and faces, orientation, mode, flags, the vertices, the faces. What may follow (thicknesses,
/// normals) is not of use here.
fn bot(mut body: Cursor<'_>) -> Result<Solid> {
    let vertex_count = body.u32("the number of vertices")?;
    let face_count = body.u32("the number of faces")?;
    body.byte("the orientation of a `bot`")?;
    let at = body.clone();
    let mode = body.byte("the mode of a `bot`")?;
    if !(1..=4).contains(&mode) {
        return Err(at.error(format!("expected the mode of a `bot`, 1 to 4, found {mode}")));
    }
    body.byte("the flags of a `bot`")?;
    let mut list = body.part(u64::from(vertex_count) * 24, "vertices")?;
    let mut vertices = Vec::with_capacity(list.left() / 24);
    while list.left() > 0 {
        vertices.push(list.vector("a vertex of a `bot`")?);
    }
    let mut list = body.part(u64::from(face_count) * 12, "faces")?;
    let mut faces = Vec::with_capacity(list.left() / 12);
    while list.left() > 0 {
        let mut face = [0; 3];
        for corner in &mut face {
            let at = list.clone();
            *corner = list.u32("a vertex number")?;
            if *corner >= vertex_count {
                return Err(at.error(format!("expected a vertex number below {vertex_count}, found {corner}")));
            }
        }
        faces.push(face);
    }
    Ok(Solid::Bot { mode, vertices, faces })
}
