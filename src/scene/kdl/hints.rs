//! Help lines for what people write who know other formats: what to write here.

use super::number::number_from;
use super::source::{Source, quote};
use super::syntax::{Entry, Node, Value};
use super::token::{is_newline, is_space};
use super::{lower, shapes, solids};

/// What marks a comment, where `#` or `--` was meant to.
pub const COMMENT: &str = "a comment begins with `//`";

/// Most numbers that a hint repeats: as many as a matrix has.
const MOST: usize = 12;

/// The numbers that `text` begins with, up to the end of the statement, with commas or space between them.
fn numbers(text: &str) -> Vec<&str> {
    let ends = |c: char| is_newline(c) || matches!(c, ';' | '{' | '}' | '(' | ')' | '"');
    let list = text.split(ends).next().unwrap_or_default();
    let words = list.split([',', ' ', '\t']).filter(|word| !word.is_empty());
    words.take_while(|word| word.len() <= 24 && number_from(word).is_some()).take(MOST).collect()
}

/// How the numbers that `rest` begins with are written behind `before`: the field of a block, or a property; `None` if there are none.
pub fn list(before: &str, rest: &str) -> Option<String> {
    let numbers = numbers(rest);
    match numbers.len() {
        0 => None,
        _ if before.trim_end().ends_with('=') => {
            Some(format!("several numbers stand in quotes: \"{}\"", numbers.join(", ")))
        }
        _ => Some(format!("numbers stand apart by spaces alone: {}", numbers.join(" "))),
    }
}

/// Whether the parenthesis that `inner` follows holds nothing but numbers, several.
pub fn is_list(inner: &str) -> bool {
    let found = numbers(inner);
    let held = inner.split(')').next().unwrap_or_default();
    found.len() > 1 && held.split([',', ' ', '\t']).filter(|word| !word.is_empty()).count() == found.len()
}

/// How `expression`, which has no operator where one should be, is written if it is meant as several.
pub fn several(expression: &str) -> Option<String> {
    let is_one = |word: &&str| {
        let letters = |c: char| c.is_alphanumeric() || matches!(c, '.' | '_');
        word.len() <= 24 && word.strip_prefix('-').unwrap_or(word).chars().all(letters)
    };
    let words: Vec<&str> = expression.split_whitespace().take(MOST + 1).collect();
    let are_several = words.len() <= MOST && words.iter().all(is_one);
    are_several.then(|| format!("several numbers stand apart by commas: \"{}\"", words.join(", ")))
}

/// How the property `name`, whose value `rest` begins with, is written in a block.
pub fn field_in_block(name: &str, rest: &str) -> String {
    let value = rest.trim_start_matches(is_space).split(|c: char| c.is_whitespace() || c == ';' || c == '}').next();
    format!("in a block a field stands without `=`: {} {}", short(name), short(value.unwrap_or_default()))
}

/// What a field with a block should be.
pub fn field_with_block(field: &Node<'_>) -> Option<String> {
    if field.name != "material" {
        return None;
    }
    let name = field.title().map_or_else(|| "name".into(), |(name, _)| short(name));
    Some(format!(
        "materials are defined at the top level of the file, outside of all blocks; what has one says its name: material \"{name}\""
    ))
}

/// What to write in place of the plain values of `node`, which takes none.
pub fn no_plain_values(source: Source<'_>, node: &Node<'_>) -> String {
    let name = &node.name;
    let at = node.entries.iter().take_while(|entry| entry.name.is_some()).count();
    let (before, plain) = node.entries.split_at(at);
    let is_number = |entry: &&Entry<'_>| entry.name.is_none() && matches!(entry.value, Value::Number(_));
    let written = |entry: &Entry<'_>| short(&source.text[entry.span.start as usize..entry.span.end as usize]);
    let after: Vec<String> = plain.iter().skip(1).take_while(is_number).take(MOST).map(written).collect();
    match (before.last(), plain.first()) {
        // `center=0 0 0`
        (Some(first @ Entry { name: Some((field, _)), value: Value::Number(_), .. }), Some(second))
            if is_number(&second) =>
        {
            let all = [vec![written(first), written(second)], after].concat().join(", ");
            format!("several numbers stand in quotes: {}=\"{all}\"", short(field))
        }
        // `radius 2`
        (_, Some(Entry { value: Value::Text(field), .. })) if !after.is_empty() => match after.as_slice() {
            [one] => format!("write {name} {}={one}", short(field)),
            all => format!("write {name} {}=\"{}\"", short(field), all.join(", ")),
        },
        (_, Some(Entry { value: Value::Text(label), .. })) if is_item(name) => {
            format!("only groups have names: group \"{}\" {{ {name} }}", short(label))
        }
        _ => format!("a value stands behind the name of its field, as in {name} field=value"),
    }
}

fn is_item(name: &str) -> bool {
    shapes::NAMES.contains(&name) || solids::SOLIDS.contains(&name) || lower::PLACING.contains(&name)
}

/// `text` cut to a length worth reading.
fn short(text: &str) -> String {
    quote(text).trim_matches('`').into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_as_they_should_be() {
        let (field, property) = ("eye ", "eye=");
        assert_eq!(list(field, "0, 0, 5; fov 3").unwrap(), "numbers stand apart by spaces alone: 0 0 5");
        assert_eq!(list(property, "0,-1.5,1e3 }").unwrap(), "several numbers stand in quotes: \"0, -1.5, 1e3\"");
        assert_eq!((list(field, "a, b"), list(field, "")), (None, None));
        assert_eq!(several("0 i -5").unwrap(), "several numbers stand apart by commas: \"0, i, -5\"");
        assert_eq!((several("2 * 3 4"), several(&"1 ".repeat(1000))), (None, None));
    }
}
