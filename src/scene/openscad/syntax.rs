//! The grammar of `.csg` files: calls of modules, with arguments and with other calls in braces.
//!
//! Nothing recurses: open braces and brackets are on stacks.

use std::path::Path;

use super::token::Cursor;
use crate::error::{Error, Result};
use crate::scene::text;

/// Most calls of a file.
pub(super) const MAX_NODES: usize = 1 << 22;

/// The bytes of a file, for error messages.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source<'a> {
    /// Its name.
    pub file: &'a Path,
    /// All of it.
    pub bytes: &'a [u8],
}

impl Source<'_> {
    /// The error `what` at byte `at`.
    pub fn error(&self, at: u32, what: impl Into<String>) -> Error {
        text::error_at(self.file, self.bytes, at as usize, what)
    }

    /// The line of byte `at`, from 1 on.
    pub fn line(&self, at: u32) -> u64 {
        text::Words::new(self.file, self.bytes, 0).line(at as usize)
    }
}

/// A value with its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Value {
    /// Byte where it begins.
    pub at: u32,
    /// What it is.
    pub kind: ValueKind,
}

/// What a [`Value`] is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ValueKind {
    /// `undef`: as if the argument were not there.
    Undef,
    /// `true` or `false`.
    Bool(bool),
    /// A number; it may be infinite or none.
    Number(f64),
    /// A text.
    Text(Box<str>),
    /// A list.
    List(Vec<Value>),
}

/// An argument of a call.
#[derive(Clone, Debug)]
pub(super) struct Argument<'a> {
    /// Its name, if it is given by name.
    pub name: Option<&'a str>,
    /// What is given.
    pub value: Value,
}

/// Marks in front of a call.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Marks {
    /// `*`: it is not there.
    pub disabled: bool,
    /// `%`: it is shown, but is not part of the model.
    pub background: bool,
    /// `!`: nothing else is there.
    pub root: bool,
}

/// A call.
#[derive(Clone, Debug)]
pub(super) struct Node<'a> {
    /// The module's name; empty for the file as a whole.
    pub name: &'a str,
    /// Byte where it begins.
    pub at: u32,
    /// The marks before it.
    pub marks: Marks,
    /// Its arguments, in order.
    pub arguments: Vec<Argument<'a>>,
    /// Numbers of the calls in its braces, in order; larger than its own.
    pub children: Vec<u32>,
}

/// A call whose children are being read.
struct Open {
    node: u32,
    /// Byte of its brace; none if it takes the one call that follows.
    brace: Option<u32>,
}

/// Reads all calls of `source`. The first node is the file; nodes come before those in their braces.
///
/// # Errors
/// At line and column: what is no call, braces and brackets that do not close, more than [`MAX_NODES`] calls.
pub(super) fn parse<'a>(source: &Source<'a>) -> Result<Vec<Node<'a>>> {
    let whole = Node { name: "", at: 0, marks: Marks::default(), arguments: Vec::new(), children: Vec::new() };
    let mut nodes = vec![whole];
    let mut open: Vec<Open> = Vec::new();
    let mut cursor = Cursor::new(*source);
    loop {
        cursor.skip_space()?;
        let is_waiting = open.last().is_some_and(|o| o.brace.is_none());
        match cursor.peek() {
            None => break,
            Some(b';') if !is_waiting => cursor.at += 1,
            Some(b'}') if !is_waiting => {
                if open.pop().is_none() {
                    return Err(cursor.unexpected("a module such as `union()`"));
                }
                cursor.at += 1;
                end_statement(&mut open);
            }
            _ => {
                let node = cursor.call()?;
                if nodes.len() >= MAX_NODES {
                    return Err(source.error(node.at, format!("more than {MAX_NODES} modules")));
                }
                let number = nodes.len() as u32;
                let parent = open.last().map_or(0, |o| o.node);
                nodes[parent as usize].children.push(number);
                nodes.push(node);
                cursor.skip_space()?;
                let at = cursor.at as u32;
                match cursor.peek() {
                    Some(b';') => {
                        cursor.at += 1;
                        end_statement(&mut open);
                    }
                    Some(b'{') => {
                        cursor.at += 1;
                        open.push(Open { node: number, brace: Some(at) });
                    }
                    _ => open.push(Open { node: number, brace: None }),
                }
            }
        }
    }
    match open.last() {
        None => Ok(nodes),
        Some(Open { brace: Some(at), .. }) => Err(source.error(*at, "this `{` has no `}`")),
        Some(Open { brace: None, .. }) => Err(cursor.unexpected("`;`, `{` or a module")),
    }
}

/// Ends a statement, and with it those that took it as their only child.
fn end_statement(open: &mut Vec<Open>) {
    while open.last().is_some_and(|o| o.brace.is_none()) {
        open.pop();
    }
}
