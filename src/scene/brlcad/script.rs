//! Text databases of version 5: Tcl commands `title`, `units`, `color`, `put` and `attr set`.

use super::attributes;
use super::boolean::{Expression, Step};
use super::matrix;
use super::model::{ColorRange, Combination, Database, Member, Object, ObjectKind, short};
use super::new_solids;
use super::tcl::{Word, Words};
use crate::error::Result;
use crate::scene::text::shown;

/// Name of the object whose attributes are the database's own.
const GLOBAL: &str = "_GLOBAL";

/// Attributes of an object, where they were set.
struct Setting<'a> {
    object: String,
    at: usize,
    pairs: Vec<(String, Word<'a>)>,
}

/// Reads all commands. Attributes are applied last, so they may stand before their object.
pub(super) fn read<'a>(mut words: Words<'a>, database: &mut Database) -> Result<()> {
    let mut settings: Vec<Setting<'a>> = Vec::new();
    while words.next_command() {
        let start = words.position();
        let Some(command) = words.next_in_command()? else { continue };
        let mut arguments = Vec::new();
        while let Some(word) = words.next_in_command()? {
            arguments.push(word);
        }
        match command.bytes {
            b"title" => database.title = joined(&arguments),
            b"units" => database.units = joined(&arguments),
            b"color" => database.colors.push(color(&words, start, &arguments)?),
            b"put" => {
                let place = words.place(start);
                let [name, kind, rest @ ..] = arguments.as_slice() else {
                    return Err(words.error(start, "expected `put NAME KIND ...`"));
                };
                let kind = match kind.bytes {
                    b"comb" => ObjectKind::Combination(Box::new(combination(&words, start, rest)?)),
                    _ => new_solids::solid(&words, start, &kind.text(), rest)?,
                };
                database.add(Object { name: name.text().into_owned(), place, kind, attributes: Vec::new() });
            }
            b"attr" => settings.extend(setting(&words, start, &arguments)?),
            // Of no meaning for what is seen.
            b"find" | b"dbfind" | b"rm" => {}
            other => {
                let what = format!("expected title, units, color, put or attr, found {}", shown(other));
                return Err(words.error(start, what));
            }
        }
    }
    // Whether it is a region is told to a combination before all else.
    for regions in [true, false] {
        settings.iter().try_for_each(|setting| apply(&words, setting, regions, database))?;
    }
    Ok(())
}

fn joined(words: &[Word<'_>]) -> String {
    words.iter().map(Word::text).collect::<Vec<_>>().join(" ").trim().to_owned()
}

/// A whole number.
fn int<T: std::str::FromStr>(words: &Words<'_>, word: Word<'_>, what: &str) -> Result<T> {
    let value = std::str::from_utf8(word.bytes.trim_ascii()).ok().and_then(|text| text.parse().ok());
    value.ok_or_else(|| words.error(word.at, format!("expected {what}, found {}", shown(word.bytes))))
}

fn color(words: &Words<'_>, start: usize, arguments: &[Word<'_>]) -> Result<ColorRange> {
    let &[low, high, r, g, b, ..] = arguments else {
        return Err(words.error(start, "expected `color LOW HIGH R G B`"));
    };
    let channel = |word| int::<u8>(words, word, "a colour, 0 to 255");
    let rgb = [channel(r)?, channel(g)?, channel(b)?];
    let (low, high) = (int(words, low, "the first region number")?, int(words, high, "the last region number")?);
    Ok(ColorRange { low, high, rgb })
}

/// `attr set NAME KEY VALUE ...`.
fn setting<'a>(words: &Words<'a>, start: usize, arguments: &[Word<'a>]) -> Result<Option<Setting<'a>>> {
    let [verb, object, pairs @ ..] = arguments else {
        return Err(words.error(start, "expected `attr set NAME KEY VALUE ...`"));
    };
    if verb.bytes != b"set" {
        return Err(words.error(verb.at, format!("expected `set`, found {}", shown(verb.bytes))));
    }
    if pairs.len() % 2 == 1 {
        let last = pairs[pairs.len() - 1];
        return Err(words.error(last.at, format!("the attribute {} has no value", shown(last.bytes))));
    }
    let pairs = pairs.chunks_exact(2).map(|pair| (pair[0].text().into_owned(), pair[1])).collect();
    Ok(Some(Setting { object: object.text().into_owned(), at: start, pairs }))
}

/// Applies a setting to its object: the pairs that make regions, or the others.
fn apply(words: &Words<'_>, setting: &Setting<'_>, regions: bool, database: &mut Database) -> Result<()> {
    let pairs = setting.pairs.iter().filter(|(key, _)| (key == attributes::REGION) == regions);
    if setting.object == GLOBAL {
        database.attributes.extend(pairs.map(|(key, word)| (key.clone(), word.text().into_owned())));
        return Ok(());
    }
    let Some(index) = database.find(&setting.object) else {
        let what = format!("attributes of `{}`, which is defined nowhere", short(&setting.object));
        return Err(words.error(setting.at, what));
    };
    let left = database.warnings_left();
    let Object { kind, attributes: others, .. } = &mut database.objects[index as usize];
    let mut odd = Vec::new();
    for (key, word) in pairs {
        let warn = |what| {
            if odd.len() < left {
                odd.push((word.at, format!("attribute {}: {what}", shown(key.as_bytes()))));
            }
        };
        if let ObjectKind::Combination(combination) = kind
            && attributes::set(combination, key, &word.text(), warn)
        {
            continue;
        }
        others.push((key.clone(), word.text().into_owned()));
    }
    for (at, what) in odd {
        database.warn(format!("`{}` (line {}): {what}", short(&setting.object), words.line_of(at)));
    }
    Ok(())
}

/// `r/g/b`, or three numbers with blanks between.
fn rgb(words: &Words<'_>, word: Word<'_>) -> Result<[u8; 3]> {
    attributes::rgb(&word.text()).map_err(|what| words.error(word.at, what))
}

/// The keys and values after `put NAME comb`.
fn combination(words: &Words<'_>, start: usize, pairs: &[Word<'_>]) -> Result<Combination> {
    if pairs.len() % 2 == 1 {
        let last = pairs[pairs.len() - 1];
        return Err(words.error(last.at, format!("{} has no value", shown(last.bytes))));
    }
    let mut combination = Combination::default();
    for pair in pairs.chunks_exact(2) {
        match pair[0].bytes {
            b"region" => {
                let is_region = matches!(pair[1].bytes, b"yes" | b"1" | b"true" | b"R");
                if is_region {
                    combination.region.get_or_insert_default();
                }
            }
            b"tree" => tree(words.inside(pair[1]), &mut combination)?,
            b"id" => combination.region.get_or_insert_default().id = int(words, pair[1], "a region number")?,
            b"air" => combination.region.get_or_insert_default().air = int(words, pair[1], "an air code")?,
            b"los" => combination.region.get_or_insert_default().los = int(words, pair[1], "a percentage")?,
            b"GIFTmater" => {
                combination.region.get_or_insert_default().material = int(words, pair[1], "a material number")?;
            }
            b"rgb" if matches!(pair[1].bytes, b"invalid" | b"") => {}
            b"rgb" => combination.rgb = Some(rgb(words, pair[1])?),
            b"shader" => {
                let text = pair[1].text();
                combination.shader = (!text.trim().is_empty()).then(|| text.trim().to_owned());
            }
            b"inherit" => combination.inherit = matches!(pair[1].bytes, b"yes" | b"1" | b"true"),
            b"material" | b"temp" => {}
            other => {
                return Err(words.error(pair[0].at, format!("a combination has no property {}", shown(other))));
            }
        }
    }
    if pairs.is_empty() {
        return Err(words.error(start, "expected `put NAME comb region yes|no tree {...}`"));
    }
    // Numbers without the flag do not make a region.
    let flagged =
        pairs.chunks_exact(2).any(|p| p[0].bytes == b"region" && matches!(p[1].bytes, b"yes" | b"1" | b"true" | b"R"));
    if !flagged {
        combination.region = None;
    }
    Ok(combination)
}

/// An operator that waits for its right operand, or for both.
struct Waiting {
    at: usize,
    step: Step,
    operands: u8,
}

/// `{l NAME}`, `{l NAME {16 numbers}}` or `{OPERATOR TREE TREE}`, any depth, without recursion: the braces are read as
/// they come.
fn tree(mut words: Words<'_>, combination: &mut Combination) -> Result<()> {
    // The word itself stands for the outermost pair of braces.
    let mut steps = Vec::new();
    let mut waiting: Vec<Waiting> = Vec::new();
    if words.clone().next()?.is_none() {
        return Ok(());
    }
    loop {
        // Inside a node, at its first word.
        let head = words.expect("a tree: `l NAME`, or an operator and two trees")?;
        let step = match head.bytes {
            b"l" => {
                let (step, member) = leaf(&mut words, combination.members.len())?;
                steps.push(step);
                combination.members.push(member);
                None
            }
            b"u" => Some(Step::Union),
            b"n" | b"+" => Some(Step::Intersection),
            b"-" => Some(Step::Difference),
            b"^" => Some(Step::ExclusiveOr),
            other => {
                let what = format!("expected l, u, n, - or ^ at the head of a tree, found {}", shown(other));
                return Err(words.error(head.at, what));
            }
        };
        if let Some(step) = step {
            waiting.push(Waiting { at: head.at, step, operands: 0 });
        } else {
            // A node is complete: close it, and all that it completes.
            loop {
                let Some(parent) = waiting.last_mut() else {
                    if let Some(extra) = words.next()? {
                        return Err(words.error(extra.at, "expected the end of the tree"));
                    }
                    combination.expression = Expression::new(steps).unwrap_or_default();
                    return Ok(());
                };
                close(&mut words)?;
                parent.operands += 1;
                if parent.operands < 2 {
                    break;
                }
                steps.push(parent.step);
                waiting.pop();
            }
        }
        if !words.passes(b'{') {
            let at = waiting.last().map_or(words.position(), |parent| parent.at);
            return Err(words.error(at, "this operator needs two trees in braces"));
        }
    }
}

fn close(words: &mut Words<'_>) -> Result<()> {
    if words.passes(b'}') { Ok(()) } else { Err(words.error(words.position(), "expected `}`")) }
}

/// What follows the `l` of a leaf; the cursor stays before the closing brace.
fn leaf(words: &mut Words<'_>, number: usize) -> Result<(Step, Member)> {
    let name = words.expect("the name of a member")?.text().into_owned();
    let mut transform = None;
    if words.passes(b'{') {
        let start = words.position();
        let mut m = [0.0; 16];
        for number in &mut m {
            *number = new_solids::number(words, "a number of the matrix (16 in all)")?;
        }
        close(words)?;
        transform = matrix::affine(&m).map_err(|what| words.error(start, what))?;
    }
    Ok((Step::Member(number as u32), Member { name, transform }))
}
