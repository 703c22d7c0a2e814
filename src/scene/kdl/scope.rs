//! Names that expressions may use, and the evaluation of values in them.

use std::cell::Cell;
use std::collections::BTreeMap;

use super::expression::{self, Names};
use super::source::{Source, Span, near};
use super::syntax::{Entry, Value};
use crate::error::{Error, Result};
use crate::scene::parameter::Parameter;

/// Most steps (values read, characters of expressions evaluated, rounds of repeats) a document may take.
const MAX_STEPS: u64 = 1 << 28;

/// Parameters and the indices of the repeats we are in.
#[derive(Debug)]
pub struct Scope<'a> {
    /// The document, for errors.
    pub source: Source<'a>,
    /// Parameters by name.
    pub parameters: BTreeMap<String, f64>,
    /// The same in the order they were written, with their ranges; without the frame that every scene has.
    pub written: Vec<Parameter>,
    /// Indices of the repeats around the statement at hand, outermost first.
    pub indices: Vec<(String, f64)>,
    steps: Cell<u64>,
}

impl Names for Scope<'_> {
    fn value(&self, name: &str) -> Option<f64> {
        let index = self.indices.iter().rev().find(|(n, _)| n == name).map(|(_, v)| *v);
        index.or_else(|| self.parameters.get(name).copied())
    }

    fn near(&self, name: &str) -> Option<String> {
        let indices = self.indices.iter().map(|(n, _)| n.as_str());
        near(name, indices.chain(self.parameters.keys().map(String::as_str))).map(String::from)
    }
}

impl<'a> Scope<'a> {
    /// No names yet.
    pub fn new(source: Source<'a>) -> Self {
        Self { source, parameters: BTreeMap::new(), written: Vec::new(), indices: Vec::new(), steps: Cell::new(0) }
    }

    /// Counts work done for the statement at `span`.
    ///
    /// # Errors
    /// More than [`MAX_STEPS`] in all: only repeats get there.
    pub fn spend(&self, steps: u64, span: Span) -> Result<()> {
        self.steps.set(self.steps.get().saturating_add(steps));
        match self.steps.get() > MAX_STEPS {
            true => Err(self.source.error(span, format!("the scene takes more than {MAX_STEPS} steps to expand"))),
            false => Ok(()),
        }
    }

    /// The numbers of an entry: a number is one; a text is expressions separated by commas.
    ///
    /// # Errors
    /// Values that are neither, and the faults of expressions.
    pub fn numbers(&self, entry: &Entry<'_>, out: &mut Vec<f64>) -> Result<()> {
        self.spend(1, entry.span)?;
        match &entry.value {
            Value::Number(value) => out.push(*value),
            Value::Text(text) => {
                self.spend(text.len() as u64, entry.span)?;
                for (offset, part) in split_at_commas(text) {
                    let value = expression::evaluate(part, self);
                    out.push(value.map_err(|fault| self.fault(entry, text, offset, fault))?);
                }
            }
            Value::Bool(_) | Value::Null => {
                return Err(self.source.error(entry.span, "expected a number or an expression"));
            }
        }
        Ok(())
    }

    /// Points at the fault's place when the text stands in the file as it is, else at its start.
    fn fault(&self, entry: &Entry<'_>, text: &str, offset: usize, fault: expression::Fault) -> Error {
        let (start, end) = (entry.span.start as usize, entry.span.end as usize);
        let written = &self.source.text[start..end];
        let at = written.find(text).map_or(start, |i| start + i + offset + fault.at);
        let error = self.source.error(Span::new(at, end), fault.what);
        match fault.help {
            Some(help) => error.with_help(help),
            None => error,
        }
    }
}

/// The parts of `text` between commas that are outside parentheses, each with its byte offset.
fn split_at_commas(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut depth = 0_i64;
    let is_separator = move |c: char| {
        depth += match c {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        c == ',' && depth <= 0
    };
    let mut offset = 0;
    text.split(is_separator).map(move |part| {
        let start = offset;
        offset += part.len() + 1;
        (start, part)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_split_outside_parentheses_only() {
        let parts: Vec<_> = split_at_commas("1, min(2,3) ,4").collect();
        assert_eq!(parts, [(0, "1"), (2, " min(2,3) "), (13, "4")]);
    }
}
