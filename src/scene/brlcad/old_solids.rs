//! Solids in text databases of version 4.

use glam::DVec3;

use super::lines::{Fields, Lines};
use super::model::{Database, Object, ObjectKind};
use super::solid::{PipePoint, Solid};
use crate::error::{Place, Result};

/// Corners of a face of a polysolid: as many are always written.
const POLYGON_CORNERS: usize = 5;

fn add(database: &mut Database, name: String, place: Place, kind: ObjectKind) {
    database.add(Object { name, place, kind, attributes: Vec::new() });
}

/// `S type name decoration v0 .. v23`; numbers that a type does not use may be anything.
pub(super) fn solid(mut fields: Fields<'_>, place: Place, database: &mut Database) -> Result<()> {
    let start = fields.clone().next().map_or(0, |(at, _)| at);
    let code: i32 = fields.int("the type of a solid")?;
    let name = fields.name("the name of a solid")?;
    fields.expect("the decoration of a solid")?;
    let mut v = || fields.vector("a number of the solid");
    let solid = match code {
        16 => {
            let (v, h, a) = (v()?, v()?, v()?);
            // Rounding in the file may make the tube's radius the larger one.
            Solid::Tor { v, h: h.normalize_or_zero(), major: a.length(), minor: h.length().min(a.length()) }
        }
        18 => Solid::Tgc { v: v()?, h: v()?, base: [v()?, v()?], top: [v()?, v()?] },
        19 => Solid::Ell { v: v()?, axes: [v()?, v()?, v()?] },
        20 => {
            let first = v()?;
            let mut points = [first; 8];
            for point in &mut points[1..] {
                *point += v()?;
            }
            Solid::Arb { points }
        }
        24 => Solid::Half { n: v()?, d: fields.number("the distance of a half-space")? },
        26 => Solid::Rpc { v: v()?, h: v()?, b: v()?, r: fields.number("the half width")? },
        27 => {
            let (v, h, b) = (v()?, v()?, v()?);
            Solid::Rhc { v, h, b, r: fields.number("the half width")?, c: fields.number("the asymptote distance")? }
        }
        28 => {
            let (v, h, a) = (v()?, v()?, v()?.normalize_or_zero());
            Solid::Epa { v, h, a, r1: fields.number("the first radius")?, r2: fields.number("the second radius")? }
        }
        29 => {
            let (v, h, a) = (v()?, v()?, v()?.normalize_or_zero());
            let (r1, r2) = (fields.number("the first radius")?, fields.number("the second radius")?);
            Solid::Ehy { v, h, a, r1, r2, c: fields.number("the asymptote distance")? }
        }
        30 => {
            let (v, n, c) = (v()?, v()?, v()?);
            Solid::Eto { v, n, c, r: fields.number("the radius")?, rd: fields.number("the minor semi-axis")? }
        }
        33 => {
            let (v, h, a) = (v()?, v()?, v()?);
            Solid::Hyp { v, h, a, b: fields.number("the second semi-axis")?, neck: fields.number("the neck ratio")? }
        }
        31 => {
            add(database, name, place, ObjectKind::Unsupported("grip".into()));
            return Ok(());
        }
        _ => {
            let what = format!("expected the type of a solid (16, 18, 19, 20, 24 or 26 to 33), found {code}");
            return Err(fields.error(start, what));
        }
    };
    add(database, name, place, ObjectKind::Solid(solid));
    Ok(())
}

/// `p name v h radius radius`.
pub(super) fn particle(mut fields: Fields<'_>, place: Place, database: &mut Database) -> Result<()> {
    let name = fields.name("the name of a particle")?;
    let (v, h) = (fields.vector("the vertex")?, fields.vector("the height vector")?);
    let (r_v, r_h) = (fields.number("the first radius")?, fields.number("the second radius")?);
    add(database, name, place, ObjectKind::Solid(Solid::Part { v, h, r_v, r_h }));
    Ok(())
}

/// `n name count`, then lines `n nx ny nz d`.
pub(super) fn arbn(mut fields: Fields<'_>, place: Place, lines: &mut Lines<'_>, database: &mut Database) -> Result<()> {
    let name = fields.name("the name of an arbn")?;
    let count: u32 = fields.int("the number of planes")?;
    let mut planes = Vec::new();
    for _ in 0..count {
        let line = lines.expect("a plane of an arbn")?;
        let mut fields = lines.fields(line, 0);
        fields.expect("the letter of a plane")?;
        planes.push((fields.vector("the normal of a plane")?, fields.number("the distance of a plane")?));
    }
    add(database, name, place, ObjectKind::Solid(Solid::Arbn(planes)));
    Ok(())
}

/// `w name`, then lines `inner outer bend x y z` up to `END_PIPE`.
pub(super) fn pipe(mut fields: Fields<'_>, place: Place, lines: &mut Lines<'_>, database: &mut Database) -> Result<()> {
    let name = fields.name("the name of a pipe")?;
    let mut points = Vec::new();
    loop {
        let line = lines.expect("a point of a pipe or END_PIPE")?;
        if line.bytes.trim_ascii().starts_with(b"END_PIPE") {
            break;
        }
        let mut fields = lines.fields(line, 0);
        let (inner, outer) = (fields.number("the inner diameter")?, fields.number("the outer diameter")?);
        let bend = fields.number("the bend radius")?;
        points.push(PipePoint { at: fields.vector("a point of a pipe")?, outer, inner, bend });
    }
    add(database, name, place, ObjectKind::Solid(Solid::Pipe(points)));
    Ok(())
}

/// `t name mode orientation error vertices faces`, then a line `number: x y z` per vertex and `number: a b c` per face;
/// plates have a line of bits at the end.
pub(super) fn bot(mut fields: Fields<'_>, place: Place, lines: &mut Lines<'_>, database: &mut Database) -> Result<()> {
    let name = fields.name("the name of a mesh")?;
    let mode: u8 = fields.int("the mode of a mesh")?;
    fields.expect("the orientation of a mesh")?;
    fields.expect("the error mode of a mesh")?;
    let vertex_count: u32 = fields.int("the number of vertices")?;
    let face_count: u32 = fields.int("the number of faces")?;
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for _ in 0..vertex_count {
        let line = lines.expect("a vertex of a mesh")?;
        let mut fields = lines.fields(line, 0);
        fields.expect("the number of a vertex")?;
        vertices.push(fields.vector("a vertex of a mesh")?);
    }
    for _ in 0..face_count {
        let line = lines.expect("a face of a mesh")?;
        let mut fields = lines.fields(line, 0);
        fields.expect("the number of a face")?;
        let mut face = [0; 3];
        for corner in &mut face {
            let at = fields.clone().next().map_or(0, |(at, _)| at);
            *corner = fields.int("a vertex number")?;
            if *corner >= vertex_count {
                return Err(fields.error(at, format!("vertex {corner} is not there: the mesh has {vertex_count}")));
            }
        }
        faces.push(face);
    }
    if mode == 3 {
        lines.expect("the face modes of a plate")?;
    }
    add(database, name, place, ObjectKind::Solid(Solid::Bot { mode, vertices, faces }));
    Ok(())
}

/// `P name`, then lines `Q corners x y z (5 times) normals`: polygons that enclose a solid.
pub(super) fn polysolid(
    mut fields: Fields<'_>,
    place: Place,
    lines: &mut Lines<'_>,
    database: &mut Database,
) -> Result<()> {
    let name = fields.name("the name of a polysolid")?;
    let (mut vertices, mut faces): (Vec<DVec3>, Vec<[u32; 3]>) = (Vec::new(), Vec::new());
    while let Some(line) = lines.next_if(b'Q') {
        let mut fields = lines.fields(line, 1);
        let at = fields.clone().next().map_or(0, |(at, _)| at);
        let corners: usize = fields.int("the number of corners")?;
        if !(3..=POLYGON_CORNERS).contains(&corners) {
            return Err(fields.error(at, format!("expected 3 to {POLYGON_CORNERS} corners, found {corners}")));
        }
        let first = vertices.len() as u32;
        for _ in 0..corners {
            vertices.push(fields.vector("a corner of a polygon")?);
        }
        faces.extend((1..corners as u32 - 1).map(|i| [first, first + i, first + i + 1]));
    }
    add(database, name, place, ObjectKind::Solid(Solid::Bot { mode: 2, vertices, faces }));
    Ok(())
}
