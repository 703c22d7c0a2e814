//! Fields: the named parts of a statement. `radius=2` and a child `radius 2` say the same.

use glam::DVec3;

use super::hints;
use super::scope::Scope;
use super::source::{Span, quote};
use super::syntax::{Entry, Node, Value};
use crate::error::{Error, Result};

/// The fields of one statement, and its children that are not fields.
pub struct Fields<'s, 'n, 'a> {
    scope: &'s Scope<'a>,
    /// The statement.
    pub node: &'n Node<'a>,
    found: Vec<Field<'n, 'a>>,
    /// Children that are not fields: transforms, items.
    pub rest: Vec<&'n Node<'a>>,
}

struct Field<'n, 'a> {
    name: &'n str,
    span: Span,
    values: &'n [Entry<'a>],
}

/// For statements whose children are all fields.
pub const NO_REST: &[&str] = &[];

impl<'s, 'n, 'a> Fields<'s, 'n, 'a> {
    /// Collects the fields named in `allowed`; `others` are the names children may also have, for hints only.
    ///
    /// # Errors
    /// Unknown properties, a field given twice, a field that is not just a list of values.
    pub fn collect(scope: &'s Scope<'a>, node: &'n Node<'a>, allowed: &[&str], others: &[&str]) -> Result<Self> {
        let mut fields = Self { scope, node, found: Vec::new(), rest: Vec::new() };
        let source = scope.source;
        scope.spend(1 + node.entries.len() as u64, node.span)?;
        for entry in &node.entries {
            let Some((name, span)) = &entry.name else { continue };
            if !allowed.contains(&name.as_ref()) {
                let what = format!("`{}` has no property {}: {}", node.name, quote(name), expected(allowed));
                return Err(source.error_near(*span, what, name, allowed.iter().copied()));
            }
            fields.add(name, *span, std::slice::from_ref(entry))?;
        }
        for child in node.children.as_deref().unwrap_or(&[]) {
            scope.spend(1, child.span)?;
            if !allowed.contains(&child.name.as_ref()) {
                fields.rest.push(child);
                continue;
            }
            let odd = child.entries.iter().find_map(|e| e.name.as_ref().map(|(_, span)| *span));
            if let Some(span) = odd.or(child.children.as_ref().map(|_| child.span)) {
                let what = format!("expected `{} value...`: a field has no properties and no block", child.name);
                let error = source.error(span, what);
                return Err(match hints::field_with_block(child) {
                    Some(help) => error.with_help(help),
                    None => error,
                });
            }
            fields.add(&child.name, child.span, &child.entries)?;
        }
        if others.is_empty()
            && let Some(child) = fields.rest.first()
        {
            return Err(fields.unknown_child(child, allowed));
        }
        Ok(fields)
    }

    fn add(&mut self, name: &'n str, span: Span, values: &'n [Entry<'a>]) -> Result<()> {
        if self.has(name) {
            return Err(self.scope.source.error(span, format!("`{name}` is given twice")));
        }
        self.found.push(Field { name, span, values });
        Ok(())
    }

    /// The error that `child` is not known inside this statement.
    pub fn unknown_child(&self, child: &Node<'_>, known: &[&str]) -> Error {
        let what = format!("unknown {} in `{}`: {}", quote(&child.name), self.node.name, expected(known));
        self.scope.source.error_near(child.span, what, &child.name, known.iter().copied())
    }

    /// An error at this statement's name.
    pub fn error(&self, what: impl Into<String>) -> Error {
        self.scope.source.error(self.node.span, what)
    }

    /// An error at field `name`, or at the statement if it was not written.
    pub fn error_at(&self, name: &str, what: impl Into<String>) -> Error {
        let span = self.field(name).map_or(self.node.span, |f| f.span);
        self.scope.source.error(span, what)
    }

    /// Whether field `name` was written.
    pub fn has(&self, name: &str) -> bool {
        self.field(name).is_some()
    }

    fn field(&self, name: &str) -> Option<&Field<'n, 'a>> {
        self.found.iter().find(|f| f.name == name)
    }

    /// The numbers of field `name`; how many is up to the caller.
    ///
    /// # Errors
    /// Values that are not numbers.
    pub fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>> {
        let Some(field) = self.field(name) else { return Ok(None) };
        numbers_of(self.scope, field.values).map(Some)
    }

    /// One number.
    ///
    /// # Errors
    /// None or several numbers.
    pub fn number(&self, name: &str) -> Result<Option<f64>> {
        match self.numbers(name)?.as_deref() {
            None => Ok(None),
            Some(&[x]) => Ok(Some(x)),
            Some(v) => Err(self.error_at(name, format!("`{name}` takes one number, found {}", v.len()))),
        }
    }

    /// One number above zero, `default` if the field is absent.
    ///
    /// # Errors
    /// Anything else.
    pub fn positive(&self, name: &str, default: f64) -> Result<f64> {
        match self.number(name)? {
            None => Ok(default),
            Some(x) if x > 0.0 => Ok(x),
            Some(x) => Err(self.error_at(name, format!("`{name}` must be above zero, found {x}"))),
        }
    }

    /// One number from 0 to 1, `default` if the field is absent.
    ///
    /// # Errors
    /// Anything else.
    pub fn share(&self, name: &str, default: f64) -> Result<f64> {
        match self.number(name)? {
            None => Ok(default),
            Some(x) if (0.0..=1.0).contains(&x) => Ok(x),
            Some(x) => Err(self.error_at(name, format!("`{name}` takes a number from 0 to 1, found {x}"))),
        }
    }

    /// Whether field `name` stands there, alone or as `#true`.
    ///
    /// # Errors
    /// Other values.
    pub fn flag(&self, name: &str) -> Result<bool> {
        match self.field(name).map(|field| field.values) {
            None => Ok(false),
            Some([]) => Ok(true),
            Some([Entry { value: Value::Bool(on), .. }]) => Ok(*on),
            Some(_) => Err(self.error_at(name, format!("expected `{name}` alone, or {name}=#true"))),
        }
    }

    /// A whole number in `range`, `default` if the field is absent.
    ///
    /// # Errors
    /// Anything else.
    pub fn whole(&self, name: &str, default: u32, range: std::ops::RangeInclusive<u32>) -> Result<u32> {
        let Some(x) = self.number(name)? else { return Ok(default) };
        let inside = x == x.floor() && x >= f64::from(*range.start()) && x <= f64::from(*range.end());
        let (least, most) = (range.start(), range.end());
        match inside {
            true => Ok(x as u32),
            false => {
                Err(self.error_at(name, format!("`{name}` takes a whole number from {least} to {most}, found {x}")))
            }
        }
    }

    /// Three numbers.
    ///
    /// # Errors
    /// Fewer or more.
    pub fn vector(&self, name: &str) -> Result<Option<DVec3>> {
        match self.numbers(name)?.as_deref() {
            None => Ok(None),
            Some(&[x, y, z]) => Ok(Some(DVec3::new(x, y, z))),
            Some(v) => {
                let help = format!("write `{name} 1 2 3` in the block or {name}=\"1, 2, 3\"");
                let what = format!("`{name}` takes three numbers, found {}", v.len());
                Err(self.error_at(name, what).with_help(help))
            }
        }
    }

    /// A vector that is not zero.
    ///
    /// # Errors
    /// A zero vector, fewer or more numbers.
    pub fn direction(&self, name: &str) -> Result<Option<DVec3>> {
        match self.vector(name)? {
            Some(v) if v.try_normalize().is_none() => {
                Err(self.error_at(name, format!("`{name}` must have a direction: its length is zero or out of range")))
            }
            v => Ok(v),
        }
    }

    /// A colour: one number (grey) or three, linear Rec.709, none negative, none above `most`.
    ///
    /// # Errors
    /// Anything else.
    pub fn colour(&self, name: &str, most: f64) -> Result<Option<DVec3>> {
        let Some(numbers) = self.numbers(name)? else { return Ok(None) };
        colour_from(&numbers, most).map(Some).map_err(|what| self.error_at(name, format!("`{name}` {what}")))
    }

    /// A name.
    ///
    /// # Errors
    /// Anything but one text.
    pub fn name(&self, name: &str) -> Result<Option<(&'n str, Span)>> {
        let Some(field) = self.field(name) else { return Ok(None) };
        match field.values {
            [Entry { value: Value::Text(text), span, .. }] => Ok(Some((text, *span))),
            _ => Err(self.error_at(name, format!("`{name}` takes one name"))),
        }
    }

    /// The statement's arguments.
    pub fn arguments(&self) -> impl Iterator<Item = &'n Entry<'a>> {
        self.node.entries.iter().filter(|e| e.name.is_none())
    }

    /// The one text argument, if there is one.
    ///
    /// # Errors
    /// Several arguments, or one that is not text.
    pub fn title(&self) -> Result<Option<(&'n str, Span)>> {
        let mut arguments = self.arguments();
        let first = arguments.next();
        if let Some(extra) = arguments.next() {
            let what = format!("`{}` takes one name, found a second argument", self.node.name);
            return Err(self.scope.source.error(extra.span, what));
        }
        match first {
            None => Ok(None),
            Some(Entry { value: Value::Text(text), span, .. }) => Ok(Some((text, *span))),
            Some(other) => Err(self.scope.source.error(other.span, "expected a name")),
        }
    }

    /// Refuses arguments.
    ///
    /// # Errors
    /// If there are any.
    pub fn no_arguments(&self) -> Result<()> {
        match self.arguments().next() {
            None => Ok(()),
            Some(a) => {
                let what = format!("`{}` takes no plain values", self.node.name);
                let help = hints::no_plain_values(self.scope.source, self.node);
                Err(self.scope.source.error(a.span, what).with_help(help))
            }
        }
    }
}

/// All numbers of `entries`.
///
/// # Errors
/// Values that are not numbers.
pub fn numbers_of(scope: &Scope<'_>, entries: &[Entry<'_>]) -> Result<Vec<f64>> {
    let mut numbers = Vec::new();
    for entry in entries {
        scope.numbers(entry, &mut numbers)?;
    }
    Ok(numbers)
}

/// Grey or linear red, green, blue.
///
/// # Errors
/// What is wrong, to follow the field's name.
pub fn colour_from(numbers: &[f64], most: f64) -> std::result::Result<DVec3, String> {
    let colour = match *numbers {
        [grey] => DVec3::splat(grey),
        [r, g, b] => DVec3::new(r, g, b),
        _ => return Err(format!("takes one number (grey) or three (red, green, blue), found {}", numbers.len())),
    };
    match colour.to_array().iter().find(|&&c| c < 0.0 || c > most) {
        Some(c) if *c < 0.0 => Err(format!("must not be negative, found {c}")),
        Some(c) => Err(format!("must not be above {most}, found {c}")),
        None => Ok(colour),
    }
}

/// "expected a, b or c".
fn expected(names: &[&str]) -> String {
    match names {
        [] => "it has none".into(),
        [one] => format!("expected {one}"),
        [head @ .., last] => format!("expected {} or {last}", head.join(", ")),
    }
}
