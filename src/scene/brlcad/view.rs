//! View scripts: how `rt -M` is told where to look from, and what MGED's `saveview` writes.
//!
//! Source: BRL-CAD's manual page of `rt` and the files its tools write. Commands end with `;`. MGED wraps them in a
//! shell script: `rt` with its options, the database and the objects, then the commands up to `EOF`. Scripts of several
//! frames give the first one.

use std::path::Path;

use glam::DVec3;

use super::lines::{Fields, Lines};
use crate::error::Result;
use crate::scene::description::{CameraDescription, Projection};
use crate::scene::text::shown;

/// How far from a rotation a matrix may be: scripts have ten digits, old ones six.
const ROTATION_ERROR: f64 = 1e-3;

/// Letters of `rt`'s options that take a value, in the same word or the next (its manual page; `-I` and `-v` take none, and the haze is
/// `-h` in older versions).
const WITH_VALUE: &str = "abcdefghjklmnopqsuwxzACDEFGHJKNOPQTUVX.,@+!";

/// Where to look from, the way BRL-CAD says it. Millimetres, model space.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Width of the view.
    pub size: f64,
    /// Eye: for parallel views a point of the plane where rays start.
    pub eye: DVec3,
    /// Unit directions right, up and towards the viewer.
    pub axes: [DVec3; 3],
    /// Full horizontal angle of a perspective view, radians.
    pub perspective: Option<f64>,
    /// Objects that the script names; empty if it names none.
    pub tops: Vec<String>,
}

/// A view as far as it is known.
#[derive(Default)]
struct Draft {
    size: Option<f64>,
    eye: Option<DVec3>,
    axes: Option<[DVec3; 3]>,
    look_at: Option<DVec3>,
    perspective: Option<f64>,
    tops: Vec<String>,
}

impl View {
    /// The axes of azimuth `az` and elevation `el`, radians: where the viewer stands, z up.
    pub fn axes_of(az: f64, el: f64) -> [DVec3; 3] {
        let ((sa, ca), (se, ce)) = (az.sin_cos(), el.sin_cos());
        [DVec3::new(-sa, ca, 0.0), DVec3::new(-se * ca, -se * sa, ce), DVec3::new(ce * ca, ce * sa, se)]
    }

    /// `rt`'s own view: from azimuth `az` and elevation `el`, radians, with the box `bounds` (lower and upper corner)
    /// in sight: it is rounded outwards to whole millimetres, its diagonal is the size, and the eye's plane lies
    /// outside.
    pub fn around(bounds: (DVec3, DVec3), az: f64, el: f64) -> Self {
        /// How far the eye stands off, in halves of the size.
        const BACK_OFF: f64 = std::f64::consts::SQRT_2;
        let (lo, hi) = (bounds.0.floor(), bounds.1.ceil());
        let axes = Self::axes_of(az, el);
        let size = (hi - lo).length();
        let size = if size > 0.0 && size.is_finite() { size } else { 1.0 };
        let eye = (lo + hi) * 0.5 + axes[2] * (BACK_OFF * size * 0.5);
        Self { size, eye, axes, perspective: None, tops: Vec::new() }
    }

    /// The view as a camera called `name` for pictures of `aspect` = width / height with square pixels.
    pub fn camera(&self, name: &str, aspect: f64) -> CameraDescription {
        let [_, up, n] = self.axes;
        let projection = match self.perspective {
            Some(angle) => Projection::Perspective { theta: 2.0 * ((angle * 0.5).tan() / aspect).atan() },
            None => Projection::Parallel { height: self.size / aspect },
        };
        CameraDescription { name: name.into(), eye: self.eye, look_at: self.eye - n * self.size, up, projection }
    }
}

/// Reads the bytes of a view script; `file` is only for error messages.
///
/// # Errors
/// At line and column: unknown commands, missing or non-finite numbers, a matrix that is no rotation; a script that
/// does not say size, eye and rotation.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<View> {
    let mut draft = Draft::default();
    let lines = Lines::new(file, bytes);
    let start = shell_part(lines.clone(), &mut draft)?;
    let end = end_of_script(bytes, start);
    let mut at = start;
    while at < end {
        let length = bytes[at..end].iter().position(|&b| b == b';').unwrap_or(end - at);
        let mut fields = Fields::new(file, bytes, at, at + length);
        at += length + 1;
        let Some((place, command)) = fields.next() else { continue };
        if !draft.command(place, command, fields)? {
            break;
        }
    }
    draft.finish(&lines, end)
}

/// The options and names of an MGED script's `rt`; where its commands begin.
fn shell_part(mut lines: Lines<'_>, draft: &mut Draft) -> Result<usize> {
    let mut first = lines.clone();
    if !first.next().is_some_and(|line| line.bytes.starts_with(b"#!")) {
        return Ok(0);
    }
    let mut words: Vec<String> = Vec::new();
    let mut last = 0;
    while let Some(line) = lines.next() {
        last = line.at;
        let text = line.text();
        if text.starts_with('#') {
            continue;
        }
        let commands = ["<<EOF", "<< EOF"].into_iter().find_map(|mark| text.find(mark));
        if let Some(at) = commands {
            words.extend(shell_words(&text[..at]));
            draft.take_words(&words);
            return Ok(lines.position());
        }
        words.extend(shell_words(text.trim_end_matches('\\')));
    }
    Err(lines.error(last, "expected `<<EOF` and commands after it"))
}

/// The words of a line of a shell script; blanks inside of quotes are parts of a word.
fn shell_words(line: &str) -> Vec<String> {
    let mut quote = None;
    let words = line.split(|c: char| {
        match quote {
            Some(open) if open == c => quote = None,
            None if c == '\'' || c == '"' => quote = Some(c),
            _ => {}
        }
        quote.is_none() && c.is_whitespace()
    });
    words.filter(|word| !word.is_empty()).map(|word| word.replace(['\'', '"'], "")).collect()
}

/// Whether a word sends a stream elsewhere: `>log`, `2>>log`, `2>&1`, `&>log`, `3<file`.
fn is_redirection(word: &str) -> bool {
    word.trim_start_matches(|c: char| c.is_ascii_digit() || c == '&').starts_with(['>', '<'])
}

/// Where the commands end: at a line `EOF`, or at the end of the file.
fn end_of_script(bytes: &[u8], start: usize) -> usize {
    let ends = bytes[start..].windows(4).position(|w| w == b"\nEOF");
    ends.map_or(bytes.len(), |at| start + at)
}

impl Draft {
    /// Words of the call of `rt`: options (`-p60`, `-p 60`, `-Mp60`), the database, the objects.
    fn take_words(&mut self, words: &[String]) {
        let mut words = words.iter().skip_while(|word| *word != "rt").skip(1).map(String::as_str);
        let mut has_database = false;
        while let Some(word) = words.next() {
            if let Some(letters) = word.strip_prefix('-') {
                let Some(at) = letters.find(|letter: char| WITH_VALUE.contains(letter)) else { continue };
                let (option, value) = letters[at..].split_at(1);
                let value = if value.is_empty() { words.next().unwrap_or_default() } else { value };
                if option == "p" {
                    let angle = value.parse().ok().filter(|&p: &f64| p > 0.0 && p < 180.0);
                    self.perspective = angle.map(f64::to_radians);
                }
            } else if is_redirection(word) {
                // Its file is the next word if nothing is left of this one.
                if word.ends_with(['>', '<']) {
                    words.next();
                }
            } else if !word.starts_with('$') {
                if has_database {
                    self.tops.push(word.into());
                }
                has_database = true;
            }
        }
    }

    /// One command; false when the first frame is complete.
    fn command(&mut self, at: usize, command: &[u8], mut fields: Fields<'_>) -> Result<bool> {
        match command {
            b"viewsize" => {
                let size = fields.number("the size of the view")?;
                if size <= 0.0 {
                    return Err(fields.error(at, format!("expected a positive size, found {size}")));
                }
                self.size = Some(size);
            }
            b"eye_pt" => self.eye = Some(fields.vector("the eye point")?),
            b"lookat_pt" => self.look_at = Some(fields.vector("the point looked at")?),
            b"viewrot" => {
                let mut m = [0.0; 16];
                for number in &mut m {
                    *number = fields.number("a number of the rotation (16 in all)")?;
                }
                let row = |r: usize| DVec3::new(m[r], m[r + 1], m[r + 2]);
                self.axes = Some(rotation([row(0), row(4), row(8)]).map_err(|what| fields.error(at, what))?);
            }
            b"orientation" => {
                let mut q = [0.0; 4];
                for number in &mut q {
                    *number = fields.number("a number of the orientation (x y z w)")?;
                }
                self.axes = Some(quaternion(q).map_err(|what| fields.error(at, what))?);
            }
            b"ae" => {
                let (az, el) = (fields.number("the azimuth")?, fields.number("the elevation")?);
                self.axes = Some(View::axes_of(az.to_radians(), el.to_radians()));
            }
            b"end" => return Ok(false),
            b"start" | b"clean" | b"multiview" | b"set" | b"opt" | b"anim" | b"tree" | b"object" | b"overlaps" => {}
            other => {
                let what = format!(
                    "expected viewsize, eye_pt, viewrot, orientation, lookat_pt, ae, start, clean or end, found {}",
                    shown(other)
                );
                return Err(fields.error(at, what));
            }
        }
        Ok(true)
    }

    fn finish(self, lines: &Lines<'_>, end: usize) -> Result<View> {
        let missing = |what: &str| lines.error(end, format!("expected `{what}` before the end of the first frame"));
        let size = self.size.ok_or_else(|| missing("viewsize SIZE;"))?;
        let eye = self.eye.ok_or_else(|| missing("eye_pt X Y Z;"))?;
        let axes = match (self.look_at, self.axes) {
            (Some(point), _) => looking_at(eye, point).ok_or_else(|| missing("lookat_pt away from the eye"))?,
            (None, Some(axes)) => axes,
            (None, None) => return Err(missing("viewrot, orientation, ae or lookat_pt")),
        };
        Ok(View { size, eye, axes, perspective: self.perspective, tops: self.tops })
    }
}

/// The rows of a matrix as unit vectors, if it is nearly a rotation.
fn rotation(rows: [DVec3; 3]) -> std::result::Result<[DVec3; 3], String> {
    let [u, v, n] = rows;
    let off =
        [u.length() - 1.0, v.length() - 1.0, n.length() - 1.0, u.dot(v), v.dot(n), n.dot(u), u.cross(v).dot(n) - 1.0];
    if off.iter().any(|x| x.is_nan() || x.abs() > ROTATION_ERROR) {
        return Err("expected a rotation: three unit rows at right angles, right-handed".into());
    }
    Ok(rows.map(DVec3::normalize))
}

/// The rows of the rotation that the quaternion x y z w is in BRL-CAD's convention: model space to view space.
fn quaternion([x, y, z, w]: [f64; 4]) -> std::result::Result<[DVec3; 3], String> {
    rotation([
        DVec3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        DVec3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        DVec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    ])
    .map_err(|_| "expected a unit quaternion x y z w".into())
}

/// The axes of someone at `eye` who looks at `point`, z up (y up when looking along z).
fn looking_at(eye: DVec3, point: DVec3) -> Option<[DVec3; 3]> {
    let n = (eye - point).try_normalize()?;
    let up = if n.x.hypot(n.y) < 1e-9 { DVec3::Y } else { DVec3::Z };
    let u = up.cross(n).try_normalize()?;
    Some([u, n.cross(u), n])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<View> {
        parse(Path::new("v.rt"), text.as_bytes())
    }

    const PLAIN: &str =
        "viewsize 1.5e2;\neye_pt 1 2\n 3;\nviewrot 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1;\nstart 0;\nend;\nviewsize 9;";

    #[test]
    fn commands_end_at_semicolons_and_the_first_frame_counts() {
        let view = read(PLAIN).unwrap();
        assert_eq!((view.size, view.eye), (150.0, DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!(view.axes, [DVec3::X, DVec3::Y, DVec3::Z]);
        assert_eq!((view.perspective, view.tops.len()), (None, 0));
    }

    /// A script as `saveview` writes it, with the options `options` and what follows them.
    fn saved(options: &str) -> View {
        read(&format!("#!/bin/sh\nrt -M {options} 2>> v.log\\\n <<EOF\n{PLAIN}\n\nEOF\nconvert\n")).unwrap()
    }

    #[test]
    fn mged_scripts_name_options_database_and_objects() {
        let view = saved("-p60 \\\n $*\\\n 'moss.g'\\\n 'all.g' 'b' \\\n");
        assert_eq!(view.tops, ["all.g", "b"]);
        assert_eq!(view.perspective, Some(60f64.to_radians()));
        assert_eq!(view.size, 150.0);
    }

    /// What follows an option is neither the database nor an object, wherever it stands.
    #[test]
    fn values_of_options_are_no_names() {
        let names = "\\\n $*\\\n '2moss.g'\\\n 'tor.r' '2light.r' \\\n";
        for (options, angle) in [
            ("\\\n -o tor.rt.pix", None),
            ("\\\n -otor.rt.pix -w 512 -n512 -V 1.5", None),
            ("-o tor.pix -p 35 -J 0 -A 0.9 -C255/0/0 -B -r", Some(35.0)),
            ("-BP 2 -Wp60 -c 'set ambSamples=8'", Some(60.0)),
            ("-q 512 -h 0.1,0.8,0.9,0.99 -. 0.5 -p 35", Some(35.0)),
        ] {
            let view = saved(&format!("{options}{names}"));
            assert_eq!(view.tops, ["tor.r", "2light.r"], "{options}");
            assert_eq!(view.perspective, angle.map(f64::to_radians), "{options}");
        }
    }

    /// MGED breaks the line before `<<EOF`; people do not.
    #[test]
    fn words_before_the_commands_on_their_line_count() {
        for line in ["rt -M -p 60 moss.g all.g b <<EOF", "rt -M \\\n -p60 moss.g \\\n all.g 'b' 2>log << EOF"] {
            let view = read(&format!("#!/bin/sh\n{line}\n{PLAIN}\nEOF\n")).unwrap();
            assert_eq!(view.tops, ["all.g", "b"], "{line}");
            assert_eq!(view.perspective, Some(60f64.to_radians()), "{line}");
        }
    }

    #[test]
    fn redirections_are_no_names() {
        for to in ["1>log", "2>&1", ">log 2>&1", "> log", "1>> log", "&>log", "&> log", "3<f", "0< f", "2>> log", "$*"]
        {
            let view = read(&format!("#!/bin/sh\nrt -M {to} moss.g all.g {to} 2b <<EOF\n{PLAIN}\nEOF\n")).unwrap();
            assert_eq!(view.tops, ["all.g", "2b"], "{to}");
        }
    }

    /// The same view in three notations: azimuth 35 and elevation 25 degrees.
    #[test]
    fn rotations_in_every_notation_agree() {
        let head = "viewsize 1; eye_pt 0 0 0; ";
        let by_angles = read(&format!("{head} ae 35 25; end;")).unwrap().axes;
        let by_matrix = read(&format!(
            "{head} viewrot -5.735764364e-01 8.191520443e-01 0 0 -3.461886131e-01 -2.424038765e-01 9.063077870e-01 0 \
             7.424038765e-01 5.198367907e-01 4.226182617e-01 0 0 0 0 1;"
        ));
        // The quaternion of that rotation: half angles of 115 degrees about z and 65 degrees about x.
        let by_quaternion = read(&format!(
            "{head} orientation 2.480973490459e-01 4.765905732660e-01 7.480973490459e-01 3.894348305184e-01;"
        ));
        for other in [by_matrix.unwrap().axes, by_quaternion.unwrap().axes] {
            for (a, b) in by_angles.iter().zip(&other) {
                assert!((*a - *b).length() < 1e-9, "{a} {b}");
            }
        }
        let looking = read("viewsize 1; eye_pt 10 0 0; lookat_pt 0 0 0;").unwrap().axes;
        assert_eq!(looking, [DVec3::Y, DVec3::Z, DVec3::X]);
    }

    #[test]
    fn errors_say_where_and_what() {
        for (text, expected) in [
            ("viewsize x;", "v.rt:1:10: expected the size of the view (a finite number), found `x`"),
            ("viewsize -1;", "v.rt:1:1: expected a positive size"),
            ("\neyept 1;", "v.rt:2:1: expected viewsize, eye_pt"),
            ("viewrot 1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1;", "v.rt:1:1: expected a rotation"),
            ("orientation 1 1 1 1;", "v.rt:1:1: expected a unit quaternion"),
            ("viewsize 1; eye_pt 0 0 0;", "v.rt:1:26: expected `viewrot, orientation, ae or lookat_pt`"),
            ("", "v.rt:1:1: expected `viewsize SIZE;`"),
            ("#!/bin/sh\nrt\n", "v.rt:2:1: expected `<<EOF`"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }

    #[test]
    fn the_default_view_is_centred_on_the_rounded_box() {
        let view = View::around((DVec3::new(-0.5, 0.2, 0.0), DVec3::new(2.5, 3.9, 0.0)), 0.0, 0.0);
        assert_eq!(view.size, (16.0f64 + 16.0).sqrt());
        // The viewer stands on the x axis; the box becomes -1..3, 0..4, 0..0.
        assert!((view.eye - DVec3::new(1.0 + 4.0, 2.0, 0.0)).length() < 1e-12, "{}", view.eye);
        assert_eq!(View::around((DVec3::ZERO, DVec3::ZERO), 0.0, 0.0).size, 1.0);
    }
}
