//! Wavefront OBJ: polygons with texture coordinates and normals, groups and material names.
//!
//! Source: Alias|Wavefront, "Object Files (.obj)", appendix B1 of the Advanced Visualizer manual, 1995. Read are
//! `v` (with an optional weight or colour, both ignored), `vt` (its first two numbers), `vn`, `f` (once called `fo`) in all four index
//! forms with positive and negative indices, `g`, `o`, `usemtl` and `mtllib`; `vp`, `s`, `l` and `p` are passed over;
//! other keywords (free-form curves among them) are passed over and counted. A face may name vertices that come later
//! in the file. Indices of `vt` and `vn` that name nothing are counted: such a corner has none.
//!
//! `looks` opens the material libraries.
//!
//! Memory stays below 64 bytes per byte of the file.

mod attribute;
mod heights;
pub mod looks;

use std::path::Path;

use glam::DVec3;

use self::attribute::{Column, NONE};
use super::mesh::{Mesh, MeshGroup};
use super::polygon::{self, Polygons};
use super::text::{self, Word, Words};
use crate::error::Result;

/// Most vertices or triangles a mesh may have: numbers are u32 and the largest is kept for "none".
const MAX_COUNT: usize = u32::MAX as usize - 1;
/// Most numbers of a `v` statement: x y z, then a colour, then a weight or opacity.
const MAX_VERTEX_NUMBERS: usize = 7;

/// What an OBJ file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjFile {
    /// The polygons as triangles, in place: fanned from the first corner, or cut where that would not be their area.
    /// Groups have the name of the last `g` or `o` and the last `usemtl` (names run to the end of their line and are cut to
    /// 255 bytes).
    pub mesh: Mesh,
    /// Material libraries in the order of their `mtllib` statements, as written. None of them is opened.
    pub material_libs: Vec<String>,
    /// Statements without effect: unknown keywords and faces with fewer than three corners.
    pub ignored: u64,
    /// The first of them for a message, and its line.
    pub first_ignored: Option<(String, u64)>,
    /// Corners whose texture coordinates or normal the file does not have.
    pub dangling: u64,
    /// Whether vertices have colours, which are not kept.
    pub has_colours: bool,
    /// Polygons that are fanned although they are not convex, because they have thousands of corners.
    pub large_polygons: u64,
}

/// Reads the bytes of an OBJ file; `file` is only for error messages.
///
/// # Errors
/// At line and column: a word that is not a number where one must be, too few or too many numbers, an index that is
/// zero or names no vertex. A file with unknown keywords and no vertex at all is refused as not being an OBJ file.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<ObjFile> {
    let mut reader = Reader {
        words: Words::new(file, bytes, 0),
        out: ObjFile::default(),
        name: String::new(),
        material: String::new(),
        uvs: Column::default(),
        normals: Column::default(),
        polygons: Polygons::default(),
        run_first: 0,
        highest: None,
        unknown: None,
    };
    while let Some(keyword) = reader.words.next() {
        reader.statement(keyword)?;
    }
    reader.finish()
}

/// Indices of a corner.
#[derive(Clone, Copy, Default)]
struct Corner {
    vertex: u32,
    uv: u32,
    normal: u32,
}

struct Reader<'a> {
    words: Words<'a>,
    out: ObjFile,
    /// Group and material of the faces that follow.
    name: String,
    material: String,
    uvs: Column<[f32; 2]>,
    normals: Column<[f32; 3]>,
    polygons: Polygons,
    /// First triangle of the current run.
    run_first: usize,
    /// The highest 0-based index used before its vertex was there, and where: checked at the end.
    highest: Option<(usize, usize)>,
    /// The first unknown keyword.
    unknown: Option<Word<'a>>,
}

impl<'a> Reader<'a> {
    /// Reads one statement up to the end of its line.
    fn statement(&mut self, keyword: Word<'a>) -> Result<()> {
        match keyword.bytes {
            b"v" => return self.vertex(),
            b"vt" => return self.coordinates(),
            b"vn" => return self.normal(),
            b"f" | b"fo" => return self.face(keyword),
            b"g" | b"o" => self.start_run(false),
            b"usemtl" => self.start_run(true),
            b"mtllib" => self.material_lib(),
            // A comment is never continued: a path in it may well end in a backslash.
            [b'#', ..] => _ = self.words.rest_of_line(),
            b"vp" | b"s" | b"l" | b"p" => self.pass_over(),
            _ => {
                self.ignore(keyword.at, keyword.shown());
                self.unknown.get_or_insert(keyword);
                self.pass_over();
            }
        }
        Ok(())
    }

    /// Counts the statement at byte `at`, which is called `what`, as without effect.
    fn ignore(&mut self, at: usize, what: String) {
        self.out.ignored += 1;
        if self.out.first_ignored.is_none() {
            self.out.first_ignored = Some((what, self.words.line(at)));
        }
    }

    fn pass_over(&mut self) {
        while self.words.next_value().is_some() {}
    }

    fn vertex(&mut self) -> Result<()> {
        let mut numbers = [0.0; MAX_VERTEX_NUMBERS];
        let mut count = 0;
        while let Some(word) = self.words.next_value() {
            if count == MAX_VERTEX_NUMBERS {
                let what = format!("expected the end of the line: a vertex has at most {MAX_VERTEX_NUMBERS} numbers");
                return Err(self.words.error(word.at, what));
            }
            numbers[count] = self.words.number(word)?;
            count += 1;
        }
        if count < 3 {
            return Err(self.words.missing(format!("expected the 3 coordinates of a vertex, found {count}")));
        }
        if self.out.mesh.positions.len() >= MAX_COUNT {
            return Err(self.words.missing("more than 2^32 - 2 vertices"));
        }
        self.out.has_colours |= count >= 6;
        self.out.mesh.positions.push(DVec3::new(numbers[0], numbers[1], numbers[2]));
        Ok(())
    }

    /// `vt u v w`: v may be absent, w is not looked at.
    fn coordinates(&mut self) -> Result<()> {
        let mut numbers = [0.0; 2];
        let mut count = 0;
        while let Some(word) = self.words.next_value() {
            let number = self.words.number(word)?;
            if let Some(slot) = numbers.get_mut(count) {
                *slot = number as f32;
            }
            count += 1;
        }
        if count == 0 {
            return Err(self.words.missing("expected the coordinates u and v, found none"));
        }
        // A picture's v points down in a mesh, a file's up.
        self.uvs.values.push([numbers[0], 1.0 - numbers[1]]);
        Ok(())
    }

    fn normal(&mut self) -> Result<()> {
        let mut numbers = [0.0; 3];
        for i in 0..3 {
            let Some(word) = self.words.next_value() else {
                return Err(self.words.missing(format!("expected the 3 numbers of a normal, found {i}")));
            };
            numbers[i] = self.words.number(word)? as f32;
        }
        self.normals.values.push(numbers);
        self.pass_over();
        Ok(())
    }

    fn face(&mut self, keyword: Word<'a>) -> Result<()> {
        let (mut first, mut last, mut corners) = (Corner::default(), Corner::default(), 0_usize);
        let (start, mut highest) = (self.out.mesh.triangles.len(), 0);
        while let Some(word) = self.words.next_value() {
            let corner = self.corner(word)?;
            if corners == 0 {
                first = corner;
            } else if corners >= 2 {
                let number = self.out.mesh.triangles.len();
                if number >= MAX_COUNT {
                    return Err(self.words.error(word.at, "more than 2^32 - 2 triangles"));
                }
                let triangle = [first, last, corner];
                self.out.mesh.triangles.push(triangle.map(|c| c.vertex));
                self.uvs.push(number, triangle.map(|c| c.uv));
                self.normals.push(number, triangle.map(|c| c.normal));
            }
            last = corner;
            corners += 1;
            highest = highest.max(corner.vertex);
        }
        if corners > 3 {
            let end = self.out.mesh.triangles.len();
            if (highest as usize) < self.out.mesh.positions.len() {
                self.cut(start, end);
            } else {
                self.polygons.later.push([start as u32, end as u32]);
            }
        }
        if corners < 3 {
            self.ignore(keyword.at, format!("{} of {corners} corners", keyword.shown()));
        }
        Ok(())
    }

    /// Cuts the polygon whose fan are the triangles from `start` to `end`, if the fan is not its area. Triangles do not pay for it.
    #[inline(never)]
    fn cut(&mut self, start: usize, end: usize) {
        let fan = &mut self.out.mesh.triangles[start..end];
        if let Some(cut) = self.polygons.cut(fan, &self.out.mesh.positions) {
            polygon::apply(&cut, fan);
            self.uvs.cut(&cut, start, end - start);
            self.normals.cut(&cut, start, end - start);
        }
    }

    /// The 0-based indices of `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, word: Word<'a>) -> Result<Corner> {
        let mut parts = word.bytes.split(|&b| b == b'/');
        let index = parts.next().and_then(text::int);
        // Absent, or a number.
        let mut other = || match parts.next() {
            None | Some(b"") => Some(None),
            Some(part) => text::int(part).map(Some),
        };
        let (uv, normal) = (other(), other());
        let (Some(index), Some(uv), Some(normal), None) = (index, uv, normal, parts.next()) else {
            let what = format!("expected a vertex index (v, v/vt, v//vn or v/vt/vn), found {}", word.shown());
            return Err(self.words.error(word.at, what));
        };
        let count = self.out.mesh.positions.len();
        let resolved = match index {
            0 => None,
            1.. => usize::try_from(index - 1).ok(),
            _ => usize::try_from(index.unsigned_abs()).ok().and_then(|back| count.checked_sub(back)),
        };
        let Some(resolved) = resolved.filter(|&i| i < MAX_COUNT) else {
            let what = format!("vertex index {index} names no vertex: {count} are defined up to here");
            return Err(self.words.error(word.at, what).with_help("indices count from 1, or from -1 backwards"));
        };
        if resolved >= count && self.highest.is_none_or(|(highest, _)| resolved > highest) {
            self.highest = Some((resolved, word.at));
        }
        let uv = uv.map_or(NONE, |index| self.uvs.index(index));
        let normal = normal.map_or(NONE, |index| self.normals.index(index));
        Ok(Corner { vertex: resolved as u32, uv, normal })
    }

    /// `g`, `o` or `usemtl`: faces from here on are in another run.
    fn start_run(&mut self, is_material: bool) {
        let text = self.words.rest_as_name();
        let current = if is_material { &self.material } else { &self.name };
        if *current != text {
            self.close_run();
            *(if is_material { &mut self.material } else { &mut self.name }) = text;
        }
    }

    fn close_run(&mut self) {
        let end = self.out.mesh.triangles.len();
        if end > self.run_first {
            self.out.mesh.groups.push(MeshGroup {
                name: self.name.clone(),
                material: self.material.clone(),
                first: self.run_first as u32,
                count: (end - self.run_first) as u32,
            });
            self.run_first = end;
        }
    }

    /// `mtllib a.mtl b.mtl`: blanks separate libraries, but writers also leave them in file names, so a library
    /// ends at a word that ends in `.mtl`.
    fn material_lib(&mut self) {
        let mut library = Vec::new();
        while let Some(word) = self.words.next_in_line() {
            if !library.is_empty() {
                library.push(b' ');
            }
            library.extend_from_slice(word.bytes);
            let ends = word.bytes.len() >= 4 && word.bytes[word.bytes.len() - 4..].eq_ignore_ascii_case(b".mtl");
            if ends {
                self.out.material_libs.push(String::from_utf8_lossy(&std::mem::take(&mut library)).into_owned());
            }
        }
        if !library.is_empty() {
            self.out.material_libs.push(String::from_utf8_lossy(&library).into_owned());
        }
    }

    fn finish(mut self) -> Result<ObjFile> {
        let count = self.out.mesh.positions.len();
        if let Some((highest, at)) = self.highest.filter(|&(highest, _)| highest >= count) {
            let what = format!("vertex index {} names no vertex: the file has {count}", highest + 1);
            return Err(self.words.error(at, what));
        }
        if let (0, Some(word)) = (count, self.unknown) {
            let what = format!("expected an OBJ statement such as `v` or `f`, found {}", word.shown());
            return Err(self.words.error(word.at, what).with_help("the file has no vertex: is it an OBJ file?"));
        }
        for [start, end] in std::mem::take(&mut self.polygons.later) {
            self.cut(start as usize, end as usize);
        }
        self.out.large_polygons = self.polygons.large;
        self.close_run();
        if let [only] = self.out.mesh.groups.as_slice()
            && only.name.is_empty()
            && only.material.is_empty()
        {
            self.out.mesh.groups.clear();
        }
        let (mesh, dangling) = (&mut self.out.mesh, &mut self.out.dangling);
        mesh.uvs[0] = self.uvs.finish(&mesh.triangles, dangling);
        mesh.normals = self.normals.finish(&mesh.triangles, dangling);
        Ok(self.out)
    }
}

#[cfg(test)]
mod tests;
