//! Text databases of version 4: one record per line, told by its first letter.
//!
//! Source: the files themselves and BRL-CAD's description of its `g2asc` output. All numbers are millimetres.

use super::boolean::{Expression, Step};
use super::lines::{Fields, Line, Lines};
use super::matrix;
use super::model::{ColorRange, Combination, Database, Member, Object, ObjectKind, Region};
use super::old_solids;
use crate::error::{Error, Place, Result};
use crate::scene::text::shown;

/// Units by their code.
const UNITS: [&str; 10] = ["mm", "mm", "cm", "m", "in", "ft", "um", "km", "yd", "mi"];

/// Reads all records.
pub(super) fn read(mut lines: Lines<'_>, database: &mut Database) -> Result<()> {
    let mut foreign = Foreign::default();
    while let Some(line) = lines.next() {
        let Some(&letter) = line.bytes.first() else { continue };
        let fields = lines.fields(line, 1);
        match letter {
            b'I' => identity(fields, &mut lines, database)?,
            b'S' => old_solids::solid(fields, line.place(), database)?,
            b'C' => combination(fields, line, &mut lines, database)?,
            b'M' => return Err(lines.error(line.at, "a member outside a combination: expected a `C` record before")),
            b'm' => database.colors.push(color(fields)?),
            b'p' => old_solids::particle(fields, line.place(), database)?,
            b'n' => old_solids::arbn(fields, line.place(), &mut lines, database)?,
            b'w' => old_solids::pipe(fields, line.place(), &mut lines, database)?,
            b't' => old_solids::bot(fields, line.place(), &mut lines, database)?,
            b'P' => old_solids::polysolid(fields, line.place(), &mut lines, database)?,
            b'N' => nmg(fields, line.place(), &mut lines, database)?,
            b'A' => ars(fields, line.place(), &mut lines, database)?,
            b's' => string_solid(fields, line.place(), database)?,
            b'b' => {
                unsupported("spline", fields, line.place(), database)?;
                while lines.next_if(b'D').is_some() {}
            }
            b'd' => {
                unsupported("sketch", fields, line.place(), database)?;
                // Its vertices, then one line for each segment, indented.
                lines.expect("the vertices of a sketch")?;
                while lines.next_if(b' ').or_else(|| lines.next_if(b'\t')).is_some() {}
            }
            b'e' => unsupported("extrude", fields, line.place(), database)?,
            b'c' => unsupported("cline", fields, line.place(), database)?,
            b'#' => {}
            _ if line.bytes.trim_ascii().is_empty() => {}
            _ => foreign.meet(&lines, line)?,
        }
    }
    foreign.tell(database);
    Ok(())
}

/// Lines that begin with no known letter.
#[derive(Default)]
struct Foreign {
    count: u64,
    first: Option<u64>,
}

impl Foreign {
    /// Most of them: a file with more is no database.
    const MOST: u64 = 100;

    fn meet(&mut self, lines: &Lines<'_>, line: Line<'_>) -> Result<()> {
        self.count += 1;
        self.first.get_or_insert(line.number);
        if self.count > Self::MOST {
            let what = format!("expected a record such as `S`, `C` or `M`, found {}", shown(line.bytes));
            return Err(lines.error(line.at, what).with_help("more than 100 lines are no records"));
        }
        Ok(())
    }

    fn tell(&self, database: &mut Database) {
        if let Some(first) = self.first {
            let count = self.count;
            database.warn(format!("{count} lines are no records and were passed over, the first in line {first}"));
        }
    }
}

/// `I units v4`, then the title on a line of its own.
fn identity(mut fields: Fields<'_>, lines: &mut Lines<'_>, database: &mut Database) -> Result<()> {
    let code: i32 = fields.int("the code of the units")?;
    let (at, version) = fields.expect("the version, `v4`")?;
    if version != b"v4" {
        return Err(fields.error(at, format!("expected version `v4`, found {}", shown(version))));
    }
    let units = usize::try_from(code).ok().and_then(|i| UNITS.get(i)).unwrap_or(&"mm");
    database.units = (*units).into();
    database.title = lines.expect("the title")?.text();
    Ok(())
}

/// `C flag name regionid aircode members reference material los override r g b named parametrised inherit`: older
/// files leave out fields at the end. Names of shader and parameters follow on lines of their own, then the members.
fn combination(mut fields: Fields<'_>, line: Line<'_>, lines: &mut Lines<'_>, database: &mut Database) -> Result<()> {
    let (at, flag) = fields.expect("the region flag")?;
    let is_region = match flag {
        b"Y" | b"R" => true,
        b"P" | b"V" => {
            database.warn(format!("line {}: a FASTGEN region is shown as an ordinary one", line.number));
            true
        }
        b"N" => false,
        _ => return Err(fields.error(at, format!("expected the region flag Y, R, P, V or N, found {}", shown(flag)))),
    };
    let name = fields.name("the name of a combination")?;
    let id = fields.int_or_zero("the region number")?;
    let air = fields.int_or_zero("the air code")?;
    fields.next();
    fields.next();
    let material = fields.int_or_zero("the material number")?;
    let los = fields.int_or_zero("the line-of-sight percentage")?;
    let has_rgb = fields.int_or_zero("the colour flag")? != 0;
    let mut rgb = [0u8; 3];
    for channel in &mut rgb {
        let value = fields.int_or_zero("a colour, 0 to 255")?;
        // Some writers store signed bytes.
        *channel = value as u8;
    }
    let is_named = fields.int_or_zero("the shader flag")? != 0;
    let has_parameters = fields.int_or_zero("the shader parameter flag")? != 0;
    let inherit = fields.int_or_zero("the inheritance flag")? != 0;
    let mut shader = String::new();
    if is_named {
        shader = lines.expect("the name of a shader")?.text();
    }
    if has_parameters {
        shader = format!("{shader} {}", lines.expect("the parameters of a shader")?.text()).trim().to_owned();
    }
    let (mut members, mut operators) = (Vec::new(), Vec::new());
    while let Some(line) = lines.next_if(b'M') {
        let (operator, member) = self::member(lines.fields(line, 1))?;
        operators.push(operator);
        members.push(member);
    }
    let kind = ObjectKind::Combination(Box::new(Combination {
        expression: Expression::from_gift(&operators),
        members,
        region: is_region.then_some(Region { id, air, los, material }),
        rgb: has_rgb.then_some(rgb),
        shader: (!shader.is_empty()).then_some(shader),
        inherit,
    }));
    database.add(Object { name, place: line.place(), kind, attributes: Vec::new() });
    Ok(())
}

/// `M operator name m0 .. m15 0`.
fn member(mut fields: Fields<'_>) -> Result<(Step, Member)> {
    let (at, operator) = fields.expect("an operator")?;
    let operator = match operator {
        b"u" => Step::Union,
        b"-" => Step::Difference,
        b"+" => Step::Intersection,
        _ => return Err(fields.error(at, format!("expected the operator u, - or +, found {}", shown(operator)))),
    };
    let name = fields.name("the name of a member")?;
    let mut m = [0.0; 16];
    let mut at = None;
    for number in &mut m {
        at = at.or_else(|| fields.clone().next().map(|(at, _)| at));
        *number = fields.number("a number of the matrix (16 in all)")?;
    }
    let transform = matrix::affine(&m).map_err(|what| fields.error(at.unwrap_or(0), what))?;
    Ok((operator, Member { name, transform }))
}

/// `m flags low high r g b`.
fn color(mut fields: Fields<'_>) -> Result<ColorRange> {
    fields.expect("flags")?;
    let low = fields.int("the first region number")?;
    let high = fields.int("the last region number")?;
    let mut rgb = [0u8; 3];
    for channel in &mut rgb {
        *channel = fields.int("a colour, 0 to 255")?;
    }
    Ok(ColorRange { low, high, rgb })
}

/// Names an object of a kind that cannot be shown; its name is the next field.
fn unsupported(kind: &str, mut fields: Fields<'_>, place: Place, database: &mut Database) -> Result<()> {
    let name = fields.name("a name")?;
    database.add(Object { name, place, kind: ObjectKind::Unsupported(kind.into()), attributes: Vec::new() });
    Ok(())
}

/// `s kind name parameters`.
fn string_solid(mut fields: Fields<'_>, place: Place, database: &mut Database) -> Result<()> {
    let kind = fields.name("the kind of a solid")?;
    unsupported(&kind, fields, place, database)
}

/// `N version name granules`, a line of counts, then four lines of hexadecimal digits per granule. The digits may
/// look like records, so they are counted.
fn nmg(mut fields: Fields<'_>, place: Place, lines: &mut Lines<'_>, database: &mut Database) -> Result<()> {
    fields.expect("the version of an NMG solid")?;
    let header = fields.clone();
    fields.expect("a name")?;
    let granules: u64 = fields.int("the number of granules")?;
    unsupported("nmg", header, place, database)?;
    lines.expect("the counts of an NMG solid")?;
    for _ in 0..granules.saturating_mul(4) {
        lines.expect("the body of an NMG solid")?;
    }
    Ok(())
}

/// `A kind name curves points`, then `B` records.
fn ars(mut fields: Fields<'_>, place: Place, lines: &mut Lines<'_>, database: &mut Database) -> Result<()> {
    fields.expect("the kind of an ARS solid")?;
    unsupported("ars", fields, place, database)?;
    while lines.next_if(b'B').is_some() {}
    Ok(())
}

/// The error of a file that begins like no database.
pub(super) fn not_a_database(lines: &Lines<'_>, at: usize) -> Error {
    let what = "expected a BRL-CAD database: a line `I UNITS v4`, `title {...}` of the newer text form, or binary data";
    lines.error(at, what)
}
