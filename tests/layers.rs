//! The house's floors: reads the sources and refuses an upward edge, and what else the plan forbids.
//!
//! An edge is a path `crate::module`, or as many `super::` as lead there, in a `use` or in code; comments and strings
//! do not count.

use std::path::{Path, PathBuf};

/// Modules by floor.
const FLOORS: [&[&str]; 9] = [
    &["lanes", "math", "error"],
    &["ray"],
    &["bvh", "shape", "csg"],
    &["scene", "camera"],
    &["trace"],
    &["film", "shade"],
    &["render", "convert", "reference"],
    &["measure", "view"],
    &["cli"],
];

/// Edges between two modules of one floor, each with its reason.
const SIBLINGS: [(&str, &str, &str); 4] = [
    ("math", "lanes", "maps and boxes are written for lanes"),
    ("csg", "shape", "the leaves of a solid are shapes"),
    ("csg", "bvh", "many leaves are searched by a tree over their boxes"),
    ("camera", "scene", "a camera is made from its description"),
];

/// All the oracle may see: it shares no arithmetic with the engines it judges.
const ORACLE_USES: [&str; 6] = ["error", "scene", "camera", "film", "shade", "reference"];

/// Who may ask the oracle (benches and tests may too).
const ORACLE_USERS: [&str; 3] = ["reference", "measure", "cli"];

/// Longest file.
const LINES: usize = 400;

/// A source file: path below `src`, with `/`, and its text.
struct Source<'a> {
    path: &'a str,
    text: &'a str,
}

impl Source<'_> {
    /// The top module it belongs to; `lib.rs` and `main.rs` belong to none.
    fn module(&self) -> Option<&str> {
        let first = self.path.split('/').next()?;
        let module = first.strip_suffix(".rs").unwrap_or(first);
        (module != "lib" && module != "main").then_some(module)
    }

    fn is_under(&self, folder: &str) -> bool {
        self.path.strip_prefix(folder).is_some_and(|rest| rest.starts_with('/') || rest == ".rs")
    }
}

/// Identifiers and single other characters, without comments, strings, characters and lifetimes.
fn tokens(text: &str) -> Vec<&str> {
    let bytes = text.as_bytes();
    let find = |from: usize, what: &str| text[from..].find(what).map_or(text.len(), |n| from + n + what.len());
    let (mut tokens, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        let rest = &text[at..];
        let word = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        if let Some(hashes) = raw_string(rest) {
            at = find(at + hashes + 2, &format!("\"{}", "#".repeat(hashes)));
        } else if word > 0 {
            tokens.push(&rest[..word]);
            at += word;
        } else if rest.starts_with("//") {
            at = find(at, "\n");
        } else if rest.starts_with("/*") {
            at = after_block_comment(text, at);
        } else if rest.starts_with('"') {
            at = after_quoted(bytes, at, b'"');
        } else if rest.starts_with("'\\") {
            at = after_quoted(bytes, at, b'\'');
        } else if let Some(after) = rest.strip_prefix('\'') {
            // `'x'` is a character, `'x` a lifetime.
            let width = after.chars().next().map_or(0, char::len_utf8);
            at += if after[width..].starts_with('\'') { 2 + width } else { 1 };
        } else {
            let width = rest.chars().next().map_or(1, char::len_utf8);
            if !rest.starts_with(char::is_whitespace) {
                tokens.push(&rest[..width]);
            }
            at += width;
        }
    }
    tokens
}

/// Number of `#` if a raw string starts here.
fn raw_string(rest: &str) -> Option<usize> {
    let after = rest.strip_prefix("br").or_else(|| rest.strip_prefix('r'))?;
    let hashes = after.bytes().take_while(|&b| b == b'#').count();
    after[hashes..].starts_with('"').then_some(hashes)
}

fn after_quoted(bytes: &[u8], start: usize, quote: u8) -> usize {
    let mut at = start + 1;
    while at < bytes.len() && bytes[at] != quote {
        at += if bytes[at] == b'\\' { 2 } else { 1 };
    }
    at + 1
}

/// Block comments nest.
fn after_block_comment(text: &str, start: usize) -> usize {
    let (mut depth, mut at) = (0, start);
    while at < text.len() {
        let rest = &text.as_bytes()[at..];
        if rest.starts_with(b"/*") {
            (depth, at) = (depth + 1, at + 2);
        } else if rest.starts_with(b"*/") {
            (depth, at) = (depth - 1, at + 2);
            if depth == 0 {
                return at;
            }
        } else {
            at += 1;
        }
    }
    text.len()
}

/// The path segments that follow `root ::` at every place: one name, or the names a brace list begins with.
fn paths_from<'a>(tokens: &[&'a str], root: &str) -> Vec<Vec<&'a str>> {
    let mut found = Vec::new();
    for at in 0..tokens.len() {
        if tokens[at] == root && tokens.get(at + 1..at + 3) == Some(&[":", ":"]) {
            expand(tokens, at + 3, &mut Vec::new(), &mut found);
        }
    }
    found
}

/// Adds all paths of the use tree that starts at `at`; returns where it ends.
fn expand<'a>(tokens: &[&'a str], mut at: usize, prefix: &mut Vec<&'a str>, found: &mut Vec<Vec<&'a str>>) -> usize {
    let own = prefix.len();
    loop {
        match tokens.get(at) {
            Some(&"{") => {
                at += 1;
                while !matches!(tokens.get(at), None | Some(&"}")) {
                    let before = at;
                    at = expand(tokens, at, prefix, found);
                    at += usize::from(tokens.get(at) == Some(&",") || at == before);
                }
                prefix.truncate(own);
                return at + 1;
            }
            Some(name) => {
                prefix.push(name);
                at += 1;
                if tokens.get(at..at + 2) == Some(&[":", ":"]) {
                    at += 2;
                    continue;
                }
                found.push(prefix.clone());
                prefix.truncate(own);
                if tokens.get(at) == Some(&"as") {
                    at += 2;
                }
                return at;
            }
            None => return at,
        }
    }
}

fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|modules| modules.contains(&module))
}

/// What is wrong with one file.
fn faults(source: &Source) -> Vec<String> {
    let mut faults = Vec::new();
    let mut fault = |what: String| faults.push(format!("src/{}: {what}", source.path));
    let lines = source.text.lines().count();
    if lines > LINES {
        fault(format!("{lines} lines, at most {LINES} are allowed"));
    }
    let tokens = tokens(source.text);
    if tokens.windows(3).any(|w| w == ["wide", ":", ":"]) && !source.is_under("lanes") {
        fault("names the crate `wide`; only src/lanes may".into());
    }
    let unsafe_code = tokens.contains(&"unsafe");
    if unsafe_code && !source.is_under("lanes") && !source.is_under("measure/peers") {
        fault("has `unsafe` outside src/lanes and src/measure/peers".into());
    }
    if tokens.windows(2).any(|w| w == ["crate", "as"]) {
        fault("renames the crate, which hides edges".into());
    }
    let Some(module) = source.module() else {
        // The roots: lib.rs declares modules, main.rs calls the top floor.
        for path in paths_from(&tokens, "lanecast").iter().chain(&paths_from(&tokens, "crate")) {
            if path[0] != "cli" {
                fault(format!("uses `{}`; it may only call `cli`", path[0]));
            }
        }
        return faults;
    };
    for path in paths_from(&tokens, "crate").into_iter().chain(climbed(source, &tokens)) {
        if let Some(what) = edge_fault(module, &path) {
            fault(what);
        }
    }
    faults
}

/// Paths that reach the crate's root by `super`, seen from there.
fn climbed<'a>(source: &Source, tokens: &[&'a str]) -> Vec<Vec<&'a str>> {
    let depth = source.path.split('/').filter(|part| *part != "mod.rs").count();
    let mut found = Vec::new();
    for path in paths_from(tokens, "super") {
        let more = path.iter().take_while(|part| **part == "super").count();
        let rest = &path[more..];
        // An inline module is one deeper than its file: its `super` may stay inside, and then names no floor's module.
        if more + 1 >= depth && rest.first().is_some_and(|name| floor(name).is_some()) {
            found.push(rest.to_vec());
        }
    }
    found
}

/// What is wrong with `module` using `crate::path`.
fn edge_fault(module: &str, path: &[&str]) -> Option<String> {
    let to = path[0];
    let shown = path.join("::");
    let Some(from_floor) = floor(module) else { return Some(format!("module `{module}` is on no floor")) };
    let Some(to_floor) = floor(to) else { return Some(format!("`crate::{shown}` names no module of a floor")) };
    if to_floor > from_floor {
        return Some(format!("`{module}` (floor {from_floor}) uses `crate::{shown}` (floor {to_floor}): upward"));
    }
    if module == "reference" && (!ORACLE_USES.contains(&to) || path.starts_with(&["scene", "world"])) {
        return Some(format!("the oracle uses `crate::{shown}`, which the engines it judges compute with"));
    }
    if to == "reference" && !ORACLE_USERS.contains(&module) {
        return Some(format!("`{module}` uses the oracle; only measure, cli, benches and tests may"));
    }
    let allowed = module == to || SIBLINGS.iter().any(|(a, b, _)| (*a, *b) == (module, to));
    (to_floor == from_floor && !allowed).then(|| format!("`{module}` uses its neighbour `crate::{shown}`"))
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

#[test]
fn the_sources_keep_to_their_floors() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&root, &mut files);
    assert!(files.len() > 50, "only {} files found", files.len());
    let (mut all, mut edges) = (Vec::new(), 0);
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        let path = file.strip_prefix(&root).unwrap().to_str().unwrap().replace('\\', "/");
        edges += paths_from(&tokens(&text), "crate").len();
        all.extend(faults(&Source { path: &path, text: &text }));
    }
    // A scanner that finds nothing would find no fault either.
    assert!(edges > 100, "only {edges} edges found");
    assert!(all.is_empty(), "{}", all.join("\n"));
}

fn faults_of(path: &str, text: &str) -> Vec<String> {
    faults(&Source { path, text })
}

#[test]
fn planted_faults_are_found() {
    let long = "//\n".repeat(LINES + 1);
    for (path, text, want) in [
        ("bvh/build.rs", "use crate::scene::world::World;", "upward"),
        ("ray/packet.rs", "use crate::{math::{Aabb, Affine}, shape::{Triangle}};", "upward"),
        ("lanes/mod.rs", "fn f() -> crate::ray::Packet { todo() }", "upward"),
        ("math/aabb.rs", "#[cfg(test)] mod tests { use crate::\n    trace\n  ::Engine; }", "upward"),
        ("shape/block.rs", "use crate::bvh::Node;", "neighbour"),
        ("bvh/node.rs", "use crate::shape::Block;", "neighbour"),
        ("scene/load.rs", "use crate::camera::Camera;", "neighbour"),
        ("film/png.rs", "pub use crate::shade::*;", "neighbour"),
        ("error.rs", "use crate::lanes::Real;", "neighbour"),
        ("reference/mod.rs", "use crate::lanes::Lanes;", "judges"),
        ("reference/ray.rs", "use crate::math::Affine;", "judges"),
        ("reference/ray.rs", "use crate::scene::{assembly, world::World};", "judges"),
        ("render/mod.rs", "use crate::reference::Oracle;", "oracle"),
        ("view/mod.rs", "use crate::measure::rows::Row;", "neighbour"),
        ("trace/mod.rs", "use crate::reference::Oracle;", "upward"),
        ("shape/cone.rs", "let x = wide::f32x8::ZERO;", "wide"),
        ("film/npy.rs", "let x = unsafe { y() };", "unsafe"),
        ("measure/run.rs", "unsafe fn f() {}", "unsafe"),
        ("film/planes.rs", long.as_str(), "lines"),
        ("film/planes.rs", "use crate as lanecast;", "renames"),
        ("bvh/a/b.rs", "use super::super::super::{trace::Engine};", "upward"),
        ("bvh/mod.rs", "use super::shape::Block;", "neighbour"),
        ("main.rs", "fn main() { lanecast::trace::run() }", "only call"),
        ("novelty/mod.rs", "use crate::error::Error;", "no floor"),
        ("trace/mod.rs", "use crate::novelty::X;", "no module"),
    ] {
        let faults = faults_of(path, text);
        assert!(faults.len() == 1 && faults[0].contains(want), "{path}: {text:.60}: {faults:?}");
    }
}

#[test]
fn what_is_allowed_passes() {
    for (path, text) in [
        (
            "bvh/build.rs",
            "// use crate::scene::World;\n/* crate::cli /* crate::cli */ crate::cli */ use crate::math::Aabb;",
        ),
        (
            "bvh/build.rs",
            "/// See [`crate::scene`].\nlet s = \"crate::scene \\\" crate::cli\"; let r = r#\"\"crate::cli\"#;",
        ),
        ("bvh/node.rs", "fn f<'a>(x: &'a str) -> char { '\"' } use crate::lanes::Real; let q = '\\''; // crate::cli"),
        ("camera/mod.rs", "use crate::scene::description::CameraDescription;"),
        ("math/affine.rs", "use crate::lanes::{Lanes, Real};"),
        ("reference/mod.rs", "use crate::scene::{assembly::Assembly, mesh}; use crate::error::Result;"),
        ("measure/verify.rs", "use crate::reference::Oracle;"),
        ("measure/peers/embree.rs", "unsafe { call() }"),
        ("film/exr/read.rs", "use super::super::input; mod tests { use super::super::exr; }"),
        ("lanes/isa.rs", "use wide::f32x8; unsafe { load() }"),
        ("shape/mod.rs", "pub(crate) fn f() {} let wide = 3; // unsafe"),
        ("main.rs", "fn main() -> ExitCode { lanecast::cli::main() }"),
    ] {
        assert_eq!(faults_of(path, text), Vec::<String>::new(), "{path}: {text}");
    }
}
