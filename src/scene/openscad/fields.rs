//! The arguments of a call, by name and type.

use super::fragments::Resolution;
use super::syntax::{Node, Source, Value, ValueKind};
use crate::error::{Error, Result};

/// Largest number that is a size or a place, in units of the model: far from where products overflow.
const LARGEST: f64 = 1e30;
/// Arguments that say how to draw or to cache.
const OF_NO_MATTER: [&str; 3] = ["convexity", "timestamp", "$fe"];

/// The arguments of one call.
#[derive(Clone, Copy)]
pub(super) struct Fields<'s, 'a> {
    source: &'s Source<'a>,
    /// The call.
    pub node: &'s Node<'a>,
    /// Names of arguments, those without a name in this order.
    pub known: &'static [&'static str],
}

impl<'s, 'a> Fields<'s, 'a> {
    /// Of `node`, whose arguments are called `known`.
    pub fn new(source: &'s Source<'a>, node: &'s Node<'a>, known: &'static [&'static str]) -> Self {
        Self { source, node, known }
    }

    /// The value of `name`; `None` if it is not given, or `undef`.
    pub fn get(&self, name: &str) -> Option<&'s Value> {
        let mut place = 0;
        let mut found = None;
        for argument in &self.node.arguments {
            let own = argument.name.or_else(|| {
                place += 1;
                self.known.get(place - 1).copied()
            });
            if own == Some(name) {
                found = Some(&argument.value);
            }
        }
        found.filter(|value| value.kind != ValueKind::Undef)
    }

    /// A name that is given and means nothing here.
    pub fn unknown(&self) -> Option<&'a str> {
        let mut names = self.node.arguments.iter().filter_map(|argument| argument.name);
        names.find(|name| !self.known.contains(name) && !OF_NO_MATTER.contains(name))
    }

    /// The error `what` at the call.
    pub fn error(&self, what: impl std::fmt::Display) -> Error {
        self.source.error(self.node.at, format!("`{}`: {what}", self.node.name))
    }

    /// The error that the value of `name` should be `wanted`.
    fn expected(&self, value: &Value, name: &str, wanted: &str) -> Error {
        let found = match &value.kind {
            ValueKind::Undef => "`undef`".into(),
            ValueKind::Bool(flag) => format!("`{flag}`"),
            ValueKind::Number(number) => format!("{number}"),
            ValueKind::Text(_) => "a text".into(),
            ValueKind::List(list) => format!("a list of {}", list.len()),
        };
        self.source.error(value.at, format!("`{}`: `{name}` must be {wanted}, found {found}", self.node.name))
    }

    /// A number of `wanted`.
    fn number_of(&self, value: &Value, name: &str, wanted: &str) -> Result<f64> {
        match value.kind {
            ValueKind::Number(number) if number.abs() <= LARGEST => Ok(number),
            _ => Err(self.expected(value, name, wanted)),
        }
    }

    /// The number `name`.
    ///
    /// # Errors
    /// Another value, or a number that is not finite.
    pub fn number(&self, name: &str) -> Result<Option<f64>> {
        self.get(name).map(|value| self.number_of(value, name, "a finite number")).transpose()
    }

    /// The number `name`, or else `default`.
    ///
    /// # Errors
    /// As [`Self::number`].
    pub fn number_or(&self, name: &str, default: f64) -> Result<f64> {
        Ok(self.number(name)?.unwrap_or(default))
    }

    /// Whether `name` is true; false unless it is given.
    ///
    /// # Errors
    /// What is neither true nor false.
    pub fn flag(&self, name: &str) -> Result<bool> {
        self.get(name).map_or(Ok(false), |value| match value.kind {
            ValueKind::Bool(flag) => Ok(flag),
            _ => Err(self.expected(value, name, "`true` or `false`")),
        })
    }

    /// The text `name`.
    ///
    /// # Errors
    /// Another value.
    pub fn text(&self, name: &str) -> Result<Option<&'s str>> {
        let Some(value) = self.get(name) else { return Ok(None) };
        match &value.kind {
            ValueKind::Text(text) => Ok(Some(text)),
            _ => Err(self.expected(value, name, "a text")),
        }
    }

    /// The list `name`.
    ///
    /// # Errors
    /// Another value.
    pub fn list(&self, name: &str) -> Result<Option<&'s [Value]>> {
        self.get(name).map(|value| self.list_of(value, name)).transpose()
    }

    /// `value`, which is in or is `name`, as a list.
    ///
    /// # Errors
    /// Another value.
    pub fn list_of(&self, value: &'s Value, name: &str) -> Result<&'s [Value]> {
        match &value.kind {
            ValueKind::List(list) => Ok(list),
            _ => Err(self.expected(value, name, "a list")),
        }
    }

    /// `value`, which is in or is `name`, as `N` numbers, of which those after `least` may be left out and are 0 then.
    ///
    /// # Errors
    /// Another value, or numbers that are not finite.
    pub fn vector_of<const N: usize>(&self, value: &Value, name: &str, least: usize) -> Result<[f64; N]> {
        let wanted = if least == N { format!("{N} finite numbers") } else { format!("{least} to {N} finite numbers") };
        let ValueKind::List(list) = &value.kind else { return Err(self.expected(value, name, &wanted)) };
        if !(least..=N).contains(&list.len()) {
            return Err(self.expected(value, name, &wanted));
        }
        let mut numbers = [0.0; N];
        for (number, value) in numbers.iter_mut().zip(list) {
            *number = self.number_of(value, name, &wanted)?;
        }
        Ok(numbers)
    }

    /// `N` numbers `name`, or one number for all of them.
    ///
    /// # Errors
    /// Another value, or numbers that are not finite.
    pub fn vector<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>> {
        let Some(value) = self.get(name) else { return Ok(None) };
        match value.kind {
            ValueKind::Number(_) => Ok(Some([self.number_of(value, name, "a finite number")?; N])),
            _ => self.vector_of(value, name, N).map(Some),
        }
    }

    /// `N` flags `name`, also as numbers that are 0 or not, or one for all of them; false unless it is given.
    ///
    /// # Errors
    /// Another value.
    pub fn flags<const N: usize>(&self, name: &str) -> Result<[bool; N]> {
        let Some(value) = self.get(name) else { return Ok([false; N]) };
        let flag = |value: &Value| match value.kind {
            ValueKind::Bool(flag) => Ok(flag),
            ValueKind::Number(number) => Ok(number != 0.0),
            _ => Err(self.expected(value, name, "`true` or `false`")),
        };
        let mut flags = [false; N];
        match &value.kind {
            ValueKind::List(list) => {
                for (own, value) in flags.iter_mut().zip(list) {
                    *own = flag(value)?;
                }
            }
            _ => flags = [flag(value)?; N],
        }
        Ok(flags)
    }

    /// `value`, which is in `name`, as the number of one of `count` things.
    ///
    /// # Errors
    /// Other values.
    pub fn index_of(&self, value: &Value, name: &str, count: usize) -> Result<u32> {
        match value.kind {
            ValueKind::Number(number) if number >= 0.0 && number < count as f64 => Ok(number as u32),
            _ => Err(self.expected(value, name, &format!("numbers of points, 0 to {}", count.saturating_sub(1)))),
        }
    }

    /// `$fn`, `$fa` and `$fs`.
    ///
    /// # Errors
    /// Values that are no finite numbers.
    pub fn resolution(&self) -> Result<Resolution> {
        Ok(Resolution::new(self.number_or("$fn", 0.0)?, self.number_or("$fa", 12.0)?, self.number_or("$fs", 2.0)?))
    }
}
