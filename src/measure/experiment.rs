//! Experiments as files: a question, and the product of scenes, parameters and settings that answers it.
//!
//! A file is a KDL document of one `experiment` (docs/EXPERIMENTS.md is its reference). Every statement is checked for its place in the
//! file; what a case means is spelt out as a command that repeats it alone.

use std::collections::HashSet;
use std::ffi::OsString;
use std::path::Path;

use crate::error::Result;
use crate::measure::env::quoted;
use crate::measure::peers::Invitation;
use crate::measure::raysets::RayKind;
use crate::scene::kdl::source::{Source, Span, near, quote};
use crate::scene::kdl::syntax::{self, Entry, Node, Value};
use crate::trace::engine;

/// Most cases.
pub const MAX_CASES: usize = 1000;

/// Largest file.
const MAX_BYTES: usize = 1 << 20;

/// Most values in one statement.
const MAX_VALUES: usize = 100;

const STATEMENTS: [&str; 13] = [
    "question",
    "scenes",
    "vary",
    "rays",
    "engines",
    "peers",
    "size",
    "threads",
    "repeat",
    "seed",
    "preset",
    "leaf",
    "precision",
];

/// A file, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Its name.
    pub name: String,
    /// What it answers.
    pub question: String,
    /// Everything that is measured, in order.
    pub cases: Vec<Case>,
    /// Ray classes, each its own step.
    pub rays: Vec<RayKind>,
}

/// One scene under one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Scene: a file or `builtin:NAME`.
    pub scene: String,
    /// Parameters of the scene, as `--set` takes them.
    pub set: Vec<(String, String)>,
    /// Engines by name; empty means all.
    pub engines: Vec<String>,
    /// Peers by name.
    pub peers: Vec<String>,
    /// Width and height.
    pub size: (u32, u32),
    /// Threads.
    pub threads: u32,
    /// Rounds.
    pub repeat: u32,
    /// Seed of random directions.
    pub seed: u64,
    /// `fast`, `balanced` or `best`.
    pub preset: String,
    /// Most primitives in a leaf; `None` for the builder's own.
    pub leaf: Option<u8>,
    /// `f32`, `f64`, or empty for the scene's own.
    pub precision: String,
}

impl Case {
    /// The command that measures rays of `class` in this case alone.
    pub fn command(&self, class: RayKind) -> String {
        self.command_on(&self.scene, class, None)
    }

    /// The same where the scene was found as `scene`, and Embree's library is `embree`.
    pub fn command_on(&self, scene: &str, class: RayKind, embree: Option<&Path>) -> String {
        let mut words: Vec<OsString> = ["lanecast", "bench", scene].map(OsString::from).into();
        let mut say = |name: &str, value: OsString| words.extend([format!("--{name}").into(), value]);
        self.set.iter().for_each(|(name, value)| say("set", format!("{name}={value}").into()));
        say("rays", class.name().into());
        for (name, list) in [("engines", &self.engines), ("peers", &self.peers)] {
            if !list.is_empty() {
                say(name, list.join(",").into());
            }
        }
        // Without such a peer the library would be refused.
        if let Some(library) = embree.filter(|_| self.peers.iter().any(|peer| peer.starts_with("embree"))) {
            say("embree", library.into());
        }
        let (width, height) = self.size;
        say("size", format!("{width}x{height}").into());
        say("threads", self.threads.to_string().into());
        say("repeat", self.repeat.to_string().into());
        say("seed", self.seed.to_string().into());
        say("preset", self.preset.as_str().into());
        self.leaf.iter().for_each(|leaf| say("leaf", leaf.to_string().into()));
        if !self.precision.is_empty() {
            say("precision", self.precision.as_str().into());
        }
        quoted(words.into_iter())
    }

    /// What it is among the others, for people and for a folder's name: scene, parameters and settings.
    pub fn label(&self) -> String {
        let stem = self.scene.rsplit(['/', ':']).next().unwrap_or_default();
        let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
        let set = self.set.iter().map(|(name, value)| format!("-{name}-{value}")).collect::<String>();
        let (width, height) = self.size;
        let precision = if self.precision.is_empty() { String::new() } else { format!("-{}", self.precision) };
        let leaf = self.leaf.map_or(String::new(), |leaf| format!("-leaf-{leaf}"));
        let label = format!("{stem}{set}-{width}x{height}-t{}-{}{leaf}{precision}", self.threads, self.preset);
        label.chars().map(|c| if c.is_ascii_alphanumeric() || "-.".contains(c) { c } else { '-' }).collect()
    }
}

/// Reads the experiment in `text`; `file` is the name errors show.
///
/// # Errors
/// The first thing that is wrong, with line and column.
pub fn parse(file: &Path, text: &[u8]) -> Result<Experiment> {
    let source = Source::new(file, text.get(..MAX_BYTES).unwrap_or(text))?;
    let nodes = syntax::read(source)?;
    let whole = Span::new(0, 0);
    let [node] = &nodes[..] else {
        let span = nodes.get(1).map_or(whole, |node| node.span);
        return Err(source.error(span, format!("expected one `experiment`, found {} statements", nodes.len())));
    };
    if node.name != "experiment" {
        return Err(source.error(node.span, format!("expected `experiment`, found {}", quote(&node.name))));
    }
    let Some((name, _)) = node.title() else {
        return Err(source.error(node.span, "expected `experiment \"name\" { ... }`"));
    };
    Reader { source, node, statements: node.children.as_deref().unwrap_or(&[]) }.experiment(name)
}

struct Reader<'a, 'n> {
    source: Source<'a>,
    node: &'n Node<'a>,
    statements: &'n [Node<'a>],
}

impl Reader<'_, '_> {
    fn experiment(&self, name: &str) -> Result<Experiment> {
        for (i, node) in self.statements.iter().enumerate() {
            let word = node.name.as_ref();
            if !STATEMENTS.contains(&word) {
                let what = format!("unknown {} in an experiment", quote(word));
                return Err(self.source.error_near(node.span, what, word, STATEMENTS));
            }
            if word != "vary" && self.statements[..i].iter().any(|other| other.name == node.name) {
                return Err(self.source.error(node.span, format!("`{word}` is given twice")));
            }
            if node.children.is_some() || node.entries.iter().any(|entry| entry.name.is_some()) {
                return Err(self.source.error(node.span, format!("`{word}` takes values only")));
            }
        }
        let question = self.texts("question")?.join(" ");
        let scenes = self.texts("scenes")?;
        if scenes.is_empty() {
            return Err(self.source.error(self.node.span, "expected `scenes` with at least one scene"));
        }
        let rays = self.each("rays", "primary", |text| text.parse::<RayKind>().map_err(|e| e.to_string()))?;
        // Each class is one step in one folder.
        let rays = RayKind::each_once(&rays);
        let number =
            |text: &str| text.parse::<u32>().ok().filter(|&n| n > 0).ok_or("expected a whole number above 0".into());
        let sizes = self.each("size", "512x288", size)?;
        let threads = self.each("threads", "1", number)?;
        let repeat = self.one("repeat", "10", number)?;
        let seed = self.one("seed", "1", |text| text.parse().map_err(|_| "expected a whole number".to_string()))?;
        let presets = self.each("preset", "balanced", |text| one_of(text, &["fast", "balanced", "best"]))?;
        let leaves = if self.find("leaf").is_none() { vec![None] } else { self.each("leaf", "8", leaf)? };
        let precisions = if self.find("precision").is_none() {
            vec![String::new()]
        } else {
            self.each("precision", "f32", |text| one_of(text, &["f32", "f64"]))?
        };
        // Whoever is misspelt must not be missed after hours of the others.
        let engines = self.names("engines", |name| precisions.iter().try_for_each(|p| known_engine(name, p)))?;
        let peers = self.names("peers", |name| Invitation { names: vec![name.into()], embree: None }.check())?;
        let variations = self.variations()?;
        let trees: Vec<_> = presets.iter().flat_map(|preset| leaves.iter().map(move |leaf| (preset, *leaf))).collect();
        let lists = [variations.len(), scenes.len(), sizes.len(), threads.len(), trees.len(), precisions.len()];
        let count = lists.iter().try_fold(1usize, |product, &list| product.checked_mul(list));
        if count.is_none_or(|count| count > MAX_CASES) {
            return Err(self.source.error(self.node.span, format!("expected at most {MAX_CASES} cases")));
        }
        let mut cases = Vec::new();
        for set in variations {
            for scene in &scenes {
                for (&size, &threads) in sizes.iter().flat_map(|size| threads.iter().map(move |t| (size, t))) {
                    for (tree, precision) in trees.iter().flat_map(|t| precisions.iter().map(move |p| (t, p))) {
                        let (scene, preset, leaf, precision) =
                            (scene.clone(), tree.0.clone(), tree.1, precision.clone());
                        let (engines, peers, set) = (engines.clone(), peers.clone(), set.clone());
                        cases.push(Case {
                            scene,
                            set,
                            engines,
                            peers,
                            size,
                            threads,
                            repeat,
                            seed,
                            preset,
                            leaf,
                            precision,
                        });
                    }
                }
            }
        }
        // A case's label names its folder.
        let mut labels = HashSet::new();
        if let Some(twice) = cases.iter().map(Case::label).find(|label| !labels.insert(label.clone())) {
            return Err(self.source.error(self.node.span, format!("two cases are called {}", quote(&twice))));
        }
        Ok(Experiment { name: name.into(), question, cases, rays })
    }

    /// Every choice of one value from each `vary`.
    fn variations(&self) -> Result<Vec<Vec<(String, String)>>> {
        let mut all = vec![Vec::new()];
        for node in self.statements.iter().filter(|node| node.name == "vary") {
            let words = node.entries.iter().map(|e| self.word(e)).collect::<Result<Vec<_>>>()?;
            let [name, values @ ..] = &words[..] else {
                return Err(self.source.error(node.span, "expected `vary name value...`"));
            };
            if values.is_empty() || all.len() * values.len() > MAX_CASES {
                return Err(self.source.error(node.span, format!("expected 1 to {MAX_CASES} variations")));
            }
            if self.statements.iter().take_while(|other| !std::ptr::eq(*other, node)).any(|other| varies(other, name)) {
                return Err(self.source.error(node.span, format!("`vary {name}` is given twice")));
            }
            let with =
                |set: &Vec<(String, String)>, value: &String| [&set[..], &[(name.clone(), value.clone())]].concat();
            all = all.iter().flat_map(|set| values.iter().map(|value| with(set, value)).collect::<Vec<_>>()).collect();
        }
        Ok(all)
    }

    /// The one value of statement `name`, or `default`.
    fn one<T>(&self, name: &str, default: &str, read: impl Fn(&str) -> std::result::Result<T, String>) -> Result<T> {
        if let Some(second) = self.find(name).and_then(|node| node.entries.get(1)) {
            return Err(self.source.error(second.span, format!("expected one value after `{name}`")));
        }
        let mut values = self.each(name, default, read)?;
        Ok(values.swap_remove(0))
    }

    /// The names in statement `name`, each accepted by `check`; none if it is not there.
    fn names(&self, name: &str, check: impl Fn(&str) -> Result<()>) -> Result<Vec<String>> {
        let read = |text: &str| check(text).map(|()| text.to_string()).map_err(|e| e.to_string());
        if self.find(name).is_none() { Ok(Vec::new()) } else { self.each(name, "", read) }
    }

    fn find(&self, name: &str) -> Option<&Node<'_>> {
        self.statements.iter().find(|node| node.name == name)
    }

    /// The values of statement `name`; none if it is not there.
    fn texts(&self, name: &str) -> Result<Vec<String>> {
        let Some(node) = self.find(name) else { return Ok(Vec::new()) };
        if node.entries.is_empty() || node.entries.len() > MAX_VALUES {
            let what = format!("expected 1 to {MAX_VALUES} values after `{name}`, found {}", node.entries.len());
            return Err(self.source.error(node.span, what));
        }
        node.entries.iter().map(|entry| self.word(entry)).collect()
    }

    /// The values of statement `name` (or the one `default`), each read by `read`.
    fn each<T>(
        &self,
        name: &str,
        default: &str,
        read: impl Fn(&str) -> std::result::Result<T, String>,
    ) -> Result<Vec<T>> {
        let Some(node) = self.find(name) else {
            return read(default).map(|value| vec![value]).map_err(|what| self.source.error(self.node.span, what));
        };
        let texts = self.texts(name)?;
        let at = |i: usize| node.entries.get(i).map_or(node.span, |entry| entry.span);
        texts.iter().enumerate().map(|(i, text)| read(text).map_err(|what| self.source.error(at(i), what))).collect()
    }

    fn word(&self, entry: &Entry<'_>) -> Result<String> {
        match &entry.value {
            Value::Text(text) if !text.is_empty() => Ok(text.to_string()),
            Value::Number(x) => {
                // Whole numbers as they stand there: a seed has more digits than an f64.
                let written = self.source.text.get(entry.span.start as usize..entry.span.end as usize);
                let whole = written.and_then(|text| text.replace('_', "").parse::<u64>().ok());
                Ok(whole.map_or_else(|| x.to_string(), |n| n.to_string()))
            }
            _ => Err(self.source.error(entry.span, "expected a word or a number")),
        }
    }
}

/// Whether `node` is a `vary` of `parameter`.
fn varies(node: &Node<'_>, parameter: &str) -> bool {
    let name = node.entries.first().map(|entry| &entry.value);
    node.name == "vary" && matches!(name, Some(Value::Text(text)) if text == parameter)
}

/// # Errors
/// A usage error for an engine that this precision has not; of a scene whose precision is its own, for one that none has.
fn known_engine(name: &str, precision: &str) -> Result<()> {
    let (single, double) = (engine::<f32>(name).map(drop), engine::<f64>(name).map(drop));
    match precision {
        "f32" => single,
        "f64" => double,
        _ => single.or(double),
    }
}

fn leaf(text: &str) -> std::result::Result<Option<u8>, String> {
    let leaf = text.parse().ok().filter(|leaf| (1..=8).contains(leaf));
    leaf.map(Some).ok_or_else(|| "expected a number of primitives from 1 to 8".into())
}

fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let side = |s: &str| s.parse().ok().filter(|side| (1..=1 << 14).contains(side));
    let sides = text.split_once('x').and_then(|(w, h)| Some((side(w)?, side(h)?)));
    sides.ok_or_else(|| "expected a size, for example \"512x288\"".into())
}

fn one_of(text: &str, names: &[&str]) -> std::result::Result<String, String> {
    if names.contains(&text) {
        return Ok(text.into());
    }
    let hint = near(text, names.iter().copied()).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
    Err(format!("expected {}, found {}{hint}", names.join(" or "), quote(text)))
}

#[cfg(test)]
mod tests;
