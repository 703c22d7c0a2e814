//! Scripts for views: one command per line, as a person would do it by hand.

use std::path::{Path, PathBuf};

use super::action::Action;
use crate::error::{Error, Result, nearest_name};

/// Largest script, bytes.
const MAX_BYTES: usize = 1 << 20;

/// One thing to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Change the view.
    Do(Action),
    /// Render until the picture is finished.
    Wait,
    /// Render for so many milliseconds, as while one moves.
    Frame(f64),
    /// So many frames of an orbit by degrees each, every frame of so many milliseconds at most (0: finished): how many come
    /// per second.
    Spin(u32, f64, f64),
    /// Say what lies under pixel (x, y).
    Click(u32, u32),
    /// Write the picture as it is.
    Save(PathBuf),
    /// Give a parameter of the scene another value and open the scene anew.
    Set(String, f64),
    /// Wait at most so many seconds until the scene's files change, then open it anew.
    Reload(f64),
}

/// A command and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// 1-based line.
    pub line: u64,
    /// What to do.
    pub step: Step,
}

/// Names of the commands, what follows them, for messages and docs.
const COMMANDS: [(&str, &str); 22] = [
    ("orbit", "RIGHT UP (degrees)"),
    ("turn", "RIGHT UP (degrees)"),
    ("pan", "RIGHT UP (picture heights)"),
    ("zoom", "FACTOR"),
    ("fly", "RIGHT UP FORWARD (distances)"),
    ("widen", "FACTOR"),
    ("fov", "DEGREES"),
    ("camera", "NAME"),
    ("reset", "nothing"),
    ("integrator", "NAME"),
    ("engine", "NAME"),
    ("heat", "nodes, leaves, lanes or off"),
    ("exposure", "STOPS"),
    ("spp", "N"),
    ("blocks", "PIXELS"),
    ("wait", "nothing"),
    ("frame", "MILLISECONDS"),
    ("spin", "FRAMES DEGREES MILLISECONDS"),
    ("click", "X Y"),
    ("save", "FILE"),
    ("set", "PARAMETER VALUE"),
    ("reload", "SECONDS"),
];

/// Reads a script. Empty lines and what follows a `#` do not count.
///
/// # Errors
/// The first line that is no command, with its number and column; a script of more than a MiB, or not UTF-8.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Vec<Line>> {
    if bytes.len() > MAX_BYTES {
        return Err(Error::whole(file, "larger than 1 MiB, the limit for scripts"));
    }
    let text = std::str::from_utf8(bytes);
    let text = text.map_err(|e| Error::at_byte(file, e.valid_up_to() as u64, "expected UTF-8 text"))?;
    let mut lines = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let code = line.split('#').next().unwrap_or_default();
        let mut words = Words { code, at: 0 };
        let Some((name, column)) = words.next() else { continue };
        let line_number = number as u64 + 1;
        let step = step(name, &mut words).and_then(|step| match words.next() {
            None => Ok(step),
            Some((_, column)) => Err((column, format!("expected nothing after `{name}` and its values"))),
        });
        match step {
            Ok(step) => lines.push(Line { line: line_number, step }),
            Err((at, what)) => {
                let column = if at == 0 { column } else { at };
                let error = Error::at_line(file, line_number, column, what).with_line_text(line);
                let names = COMMANDS.iter().map(|(name, _)| *name);
                return Err(match nearest_name(name, names) {
                    Some(near) if near != name => error.with_help(format!("did you mean `{near}`?")),
                    _ => error,
                });
            }
        }
    }
    Ok(lines)
}

/// Words of a line with their 1-based columns.
struct Words<'a> {
    code: &'a str,
    at: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<(&'a str, u64)> {
        let rest = &self.code[self.at..];
        let start = self.at + rest.find(|c: char| !c.is_whitespace())?;
        let word = self.code[start..].split(char::is_whitespace).next()?;
        self.at = start + word.len();
        Some((word, self.column(start)))
    }

    fn column(&self, at: usize) -> u64 {
        self.code[..at].chars().count() as u64 + 1
    }
}

/// Column (0: that of the command) and what is wrong there.
type Fault = (u64, String);

fn step(name: &str, words: &mut Words<'_>) -> std::result::Result<Step, Fault> {
    let known = COMMANDS.iter().find(|(known, _)| *known == name);
    let Some((_, usage)) = known else { return Err((0, format!("unknown command `{name}`"))) };
    let mut values = Values { words, usage, name };
    Ok(match name {
        "orbit" => Step::Do(Action::Orbit(values.number()?, values.number()?)),
        "turn" => Step::Do(Action::Turn(values.number()?, values.number()?)),
        "pan" => Step::Do(Action::Pan(values.number()?, values.number()?)),
        "zoom" => Step::Do(Action::Zoom(values.number()?)),
        "fly" => Step::Do(Action::Fly(values.number()?, values.number()?, values.number()?)),
        "widen" => Step::Do(Action::Widen(values.number()?)),
        "fov" => Step::Do(Action::Fov(values.number()?)),
        "camera" => Step::Do(Action::Camera(values.word()?.into())),
        "reset" => Step::Do(Action::Reset),
        "integrator" => Step::Do(Action::Integrator(values.word()?.into())),
        "engine" => Step::Do(Action::Engine(values.word()?.into())),
        "heat" => Step::Do(Action::Heat(match values.word()? {
            "off" => None,
            map => Some(map.parse().map_err(|e: Error| (0, e.to_string()))?),
        })),
        "exposure" => Step::Do(Action::Exposure(values.number()?)),
        "spp" => Step::Do(Action::Samples(values.whole()?)),
        "blocks" => Step::Do(Action::Blocks(values.whole()?)),
        "wait" => Step::Wait,
        "frame" => Step::Frame(values.time()?),
        "spin" => Step::Spin(values.whole()?, values.number()?, values.time()?),
        "click" => Step::Click(values.whole()?, values.whole()?),
        "save" => Step::Save(values.word()?.into()),
        "set" => Step::Set(values.word()?.into(), values.number()?),
        _ => Step::Reload(values.time()?),
    })
}

/// What follows a command.
struct Values<'w, 'a> {
    words: &'w mut Words<'a>,
    usage: &'w str,
    name: &'w str,
}

impl<'a> Values<'_, 'a> {
    fn expected(&self) -> String {
        format!("expected `{}` and {}", self.name, self.usage)
    }

    fn word(&mut self) -> std::result::Result<&'a str, Fault> {
        self.words.next().map(|(word, _)| word).ok_or_else(|| (0, self.expected()))
    }

    fn number(&mut self) -> std::result::Result<f64, Fault> {
        let (word, column) = self.words.next().ok_or_else(|| (0, self.expected()))?;
        let number = word.parse().ok().filter(|x: &f64| x.is_finite());
        number.ok_or_else(|| (column, self.expected()))
    }

    /// A time that a person would wait: at most a day.
    fn time(&mut self) -> std::result::Result<f64, Fault> {
        let number = self.number()?;
        if (0.0..=86_400_000.0).contains(&number) { Ok(number) } else { Err((0, self.expected())) }
    }

    fn whole(&mut self) -> std::result::Result<u32, Fault> {
        let (word, column) = self.words.next().ok_or_else(|| (0, self.expected()))?;
        word.parse().map_err(|_| (column, self.expected()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::heat::Heat;

    fn script(text: &str) -> Result<Vec<Line>> {
        parse(Path::new("s"), text.as_bytes())
    }

    #[test]
    fn commands_are_read() {
        let text = "# a comment\norbit 30 -10.5 # turn\n\n  fly 0 0 1\nheat lanes\nheat off\nclick 3 4\nsave a.png\nset hole.radius 5\nreload 2";
        let want = [
            (2, Step::Do(Action::Orbit(30.0, -10.5))),
            (4, Step::Do(Action::Fly(0.0, 0.0, 1.0))),
            (5, Step::Do(Action::Heat(Some(Heat::Lanes)))),
            (6, Step::Do(Action::Heat(None))),
            (7, Step::Click(3, 4)),
            (8, Step::Save("a.png".into())),
            (9, Step::Set("hole.radius".into(), 5.0)),
            (10, Step::Reload(2.0)),
        ];
        assert_eq!(script(text).unwrap(), want.map(|(line, step)| Line { line, step }));
        assert_eq!(script("").unwrap(), []);
    }

    #[test]
    fn every_command_can_be_given() {
        for (name, usage) in &COMMANDS {
            let values = match *usage {
                "nothing" => "",
                "NAME" | "FILE" => "word",
                "nodes, leaves, lanes or off" => "nodes",
                usage => ["1", "1 1", "1 1 1"][usage.split('(').next().unwrap().split_whitespace().count() - 1],
            };
            assert!(script(&format!("{name} {values}")).is_ok(), "{name} {values}");
            assert!(script(&format!("{name} {values} 7")).is_err(), "{name} {values} 7");
        }
    }

    #[test]
    fn faults_have_a_place() {
        for (text, want) in [
            (
                "wait\norbits 1 2",
                "s:2:1: unknown command `orbits`\n 2 | orbits 1 2\n   | ^\n help: did you mean `orbit`?",
            ),
            ("orbit 1", "s:1:1: expected `orbit` and RIGHT UP (degrees)"),
            ("  zoom nan", "s:1:8: expected `zoom` and FACTOR"),
            ("click -1 2", "s:1:7: expected `click` and X Y"),
            ("wait now", "s:1:6: expected nothing after `wait`"),
            ("frame -1", "s:1:1: expected `frame` and MILLISECONDS"),
            ("heat node", "s:1:1: unknown map `node`"),
        ] {
            let error = script(text).unwrap_err().to_string();
            assert!(error.starts_with(want), "{text}: {error}");
        }
        assert!(parse(Path::new("s"), b"wait\n\xff").unwrap_err().to_string().contains("byte 5"));
    }
}
