//! Stanford PLY: text and both binary forms.
//!
//! Source: Greg Turk, "The PLY Polygon File Format", 1994. Read are the element `vertex` (`x`, `y`, `z` of any
//! scalar type, in any order; `nx`, `ny`, `nz` as shading normals; `u`, `v` or `s`, `t` or `texture_u`, `texture_v` as
//! texture coordinates), the element `face` (the list `vertex_indices` or `vertex_index`, of any types, polygons as
//! triangles in place) and the element `tristrips` (the same list; -1 starts a new strip, every second triangle is turned so that
//! all keep the winding of the first). Other properties and elements are passed over. Values keep their declared type:
//! a text number of a `float` property is rounded to f32.
//!
//! The header's counts are compared with the length of the file before anything is allocated. Memory stays below
//! 40 bytes per byte of the file.

mod header;
mod values;

use std::path::Path;

use glam::DVec3;

use self::header::{Element, Format, Kind};
use self::values::{Binary, Text, Values};
use super::mesh::{COLOURS, Mesh};
use super::polygon::{self, Polygons};
use crate::error::Result;

/// Most triangles a mesh may have: numbers are u32 and the largest is kept for "none".
const MAX_TRIANGLES: usize = u32::MAX as usize - 1;
/// Names of the list that holds a polygon's corners.
const LISTS: [&str; 2] = ["vertex_indices", "vertex_index"];
/// Names of texture coordinates, by different writers.
const COORDINATES: [[&str; 2]; 3] = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]];
/// Where a vertex's normal and texture coordinates stand behind its position, and how many numbers there are.
const NORMAL: usize = 3;
const UV: usize = 6;
const SLOTS: usize = 8;

/// What a PLY file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlyFile {
    /// The polygons as triangles, in place: fanned from the first corner, or cut where that would not be their area.
    pub mesh: Mesh,
    /// What was passed over that people may miss.
    pub warnings: Vec<String>,
}

/// The mesh of a PLY file, without the warnings of [`read`].
///
/// # Errors
/// Those of [`read`].
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Mesh> {
    read(file, bytes).map(|read| read.mesh)
}

/// Reads the bytes of a PLY file; `file` is only for error messages.
///
/// # Errors
/// In the header and in text, at line and column; in binary data, at the byte offset: unknown types and keywords,
/// counts that do not fit the length of the file, values that are not numbers, lists of negative length, indices
/// that name no vertex, data after the last element (padding with zeros or white space is allowed).
pub fn read(file: &Path, bytes: &[u8]) -> Result<PlyFile> {
    let header = header::read(file, bytes)?;
    match header.format {
        Format::Text => read_body(&header.elements, Text::new(file, bytes, header.body)),
        Format::LittleEndian => read_body(&header.elements, Binary::<false>::new(file, bytes, header.body)),
        Format::BigEndian => read_body(&header.elements, Binary::<true>::new(file, bytes, header.body)),
    }
}

fn read_body<V: Values>(elements: &[Element], mut values: V) -> Result<PlyFile> {
    check_counts(elements, &values)?;
    let vertices = elements.iter().find(|e| e.name == "vertex");
    let Some(vertices) = vertices else {
        return Err(values.header_error(0, "expected an element `vertex` in the header".into()));
    };
    if vertices.count >= u64::from(u32::MAX) {
        return Err(values.header_error(vertices.count_at, "more than 2^32 - 2 vertices".into()));
    }
    let (mesh, polygons) = (Mesh::default(), Polygons::default());
    let mut body = Body { mesh, vertices: vertices.count as i64, polygons };
    for element in elements {
        match element.name.as_str() {
            "vertex" => body.vertices(element, &mut values)?,
            "face" => body.lists(element, &mut values, Body::polygon)?,
            "tristrips" => body.lists(element, &mut values, Body::strips)?,
            _ => pass_over(element, &mut values)?,
        }
    }
    values.finish()?;
    // Files may have their faces before their vertices.
    for [start, end] in std::mem::take(&mut body.polygons.later) {
        body.cut(start as usize, end as usize);
    }
    let is_coloured = ["red", "green", "blue"].iter().all(|name| vertices.properties.iter().any(|p| p.name == *name));
    let colours = is_coloured.then(|| COLOURS.to_owned());
    let warnings = colours.into_iter().chain(polygon::warning(body.polygons.large)).collect();
    Ok(PlyFile { mesh: body.mesh, warnings })
}

/// Refuses counts that cannot be true: every row needs a least number of bytes.
fn check_counts<V: Values>(elements: &[Element], values: &V) -> Result<()> {
    let mut left = values.capacity();
    for element in elements {
        let row: u64 = element.properties.iter().map(|p| V::least_bytes(p.first_scalar())).sum();
        match row.checked_mul(element.count).and_then(|need| left.checked_sub(need)) {
            Some(rest) => left = rest,
            None => {
                let what = format!(
                    "{} rows of `{}` need at least {row} bytes each, but the file has only {left} bytes for them",
                    element.count, element.name
                );
                return Err(values.header_error(element.count_at, what));
            }
        }
    }
    Ok(())
}

fn pass_over<V: Values>(element: &Element, values: &mut V) -> Result<()> {
    // Rows without properties take no bytes: walking over billions of them would be a hang.
    if element.properties.is_empty() {
        return Ok(());
    }
    for _ in 0..element.count {
        for property in &element.properties {
            pass_over_property(property.kind, values)?;
        }
    }
    Ok(())
}

fn pass_over_property<V: Values>(kind: Kind, values: &mut V) -> Result<()> {
    match kind {
        Kind::Scalar(scalar) => values.skip(scalar, 1),
        Kind::List { count, item } => {
            let length = values.length(count, item)?;
            values.skip(item, length)
        }
    }
}

struct Body {
    mesh: Mesh,
    /// Number of vertices the header declares, whether they have been read or not.
    vertices: i64,
    polygons: Polygons,
}

impl Body {
    fn vertices<V: Values>(&mut self, element: &Element, values: &mut V) -> Result<()> {
        let scalar =
            |name: &str| element.properties.iter().position(|p| p.name == name && matches!(p.kind, Kind::Scalar(_)));
        let mut slot_of = vec![None; element.properties.len()];
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let Some(found) = scalar(name) else {
                let what = format!("expected a scalar property `{name}` of the element `vertex`");
                return Err(values.header_error(element.count_at, what));
            };
            slot_of[found] = Some(axis);
        }
        // What is not there in full is not there.
        let mut optional = |first: usize, names: &[&str]| {
            let found: Option<Vec<usize>> = names.iter().map(|name| scalar(name)).collect();
            for (slot, property) in (first..).zip(found.iter().flatten()) {
                slot_of[*property] = Some(slot);
            }
            found.is_some()
        };
        let has_normals = optional(NORMAL, &["nx", "ny", "nz"]);
        let has_uvs = COORDINATES.iter().any(|names| optional(UV, names));
        let count = element.count as usize;
        self.mesh.positions.reserve_exact(count);
        self.mesh.normals.values.reserve_exact(if has_normals { count } else { 0 });
        self.mesh.uvs[0].values.reserve_exact(if has_uvs { count } else { 0 });
        for _ in 0..count {
            let mut numbers = [0.0; SLOTS];
            for (property, slot) in element.properties.iter().zip(&slot_of) {
                match (property.kind, slot) {
                    (Kind::Scalar(scalar), Some(slot)) => numbers[*slot] = values.float(scalar)?,
                    (kind, _) => pass_over_property(kind, values)?,
                }
            }
            let [x, y, z, nx, ny, nz, u, v] = numbers;
            self.mesh.positions.push(DVec3::new(x, y, z));
            if has_normals {
                self.mesh.normals.values.push([nx, ny, nz].map(|n| n as f32));
            }
            if has_uvs {
                // A picture's v points down in a mesh, a file's up.
                self.mesh.uvs[0].values.push([u as f32, 1.0 - v as f32]);
            }
        }
        Ok(())
    }

    /// Reads the rows of an element with an index list, giving each list to `read` with its length.
    fn lists<V: Values>(
        &mut self,
        element: &Element,
        values: &mut V,
        read: fn(&mut Self, header::Scalar, u64, &mut V) -> Result<()>,
    ) -> Result<()> {
        let is_list = |p: &header::Property| LISTS.contains(&p.name.as_str()) && matches!(p.kind, Kind::List { .. });
        let wanted = element.properties.iter().position(is_list);
        if wanted.is_none() && element.count > 0 {
            let what = format!("expected a list `{}` or `{}` of the element `{}`", LISTS[0], LISTS[1], element.name);
            return Err(values.header_error(element.count_at, what));
        }
        self.mesh.triangles.reserve(element.count as usize);
        for _ in 0..element.count {
            for (i, property) in element.properties.iter().enumerate() {
                match property.kind {
                    Kind::List { count, item } if wanted == Some(i) => {
                        let length = values.length(count, item)?;
                        read(self, item, length, values)?;
                    }
                    kind => pass_over_property(kind, values)?,
                }
            }
        }
        Ok(())
    }

    // Called through a pointer it would cost files of triangles a fifth more.
    #[inline(always)]
    fn polygon<V: Values>(&mut self, item: header::Scalar, length: u64, values: &mut V) -> Result<()> {
        let (mut first, mut last) = (0, 0);
        let start = self.mesh.triangles.len();
        for i in 0..length {
            let index = values.int(item)?;
            let corner = self.corner(index, values)?;
            if i == 0 {
                first = corner;
            } else if i >= 2 {
                self.push([first, last, corner], values)?;
            }
            last = corner;
        }
        if length > 3 {
            let end = self.mesh.triangles.len();
            if self.mesh.positions.is_empty() {
                self.polygons.later.push([start as u32, end as u32]);
            } else {
                self.cut(start, end);
            }
        }
        Ok(())
    }

    /// Cuts the polygon whose fan are the triangles from `start` to `end`, if the fan is not its area. Triangles do not pay for it.
    #[inline(never)]
    fn cut(&mut self, start: usize, end: usize) {
        let fan = &mut self.mesh.triangles[start..end];
        if let Some(cut) = self.polygons.cut(fan, &self.mesh.positions) {
            polygon::apply(&cut, fan);
        }
    }

    fn strips<V: Values>(&mut self, item: header::Scalar, length: u64, values: &mut V) -> Result<()> {
        let (mut a, mut b, mut position) = (0, 0, 0_u64);
        for _ in 0..length {
            let index = values.int(item)?;
            if index == -1 {
                position = 0;
                continue;
            }
            let c = self.corner(index, values)?;
            if position >= 2 {
                self.push(if position % 2 == 0 { [a, b, c] } else { [b, a, c] }, values)?;
            }
            (a, b) = (b, c);
            position += 1;
        }
        Ok(())
    }

    fn push<V: Values>(&mut self, triangle: [u32; 3], values: &V) -> Result<()> {
        if self.mesh.triangles.len() >= MAX_TRIANGLES {
            return Err(values.error("more than 2^32 - 2 triangles".into()));
        }
        self.mesh.triangles.push(triangle);
        Ok(())
    }

    fn corner<V: Values>(&self, index: i64, values: &V) -> Result<u32> {
        if (0..self.vertices).contains(&index) {
            return Ok(index as u32);
        }
        Err(values.error(format!("expected a vertex index from 0 and below {}, found {index}", self.vertices)))
    }
}

#[cfg(test)]
mod tests;
