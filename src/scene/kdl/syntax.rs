//! Reader of KDL documents (KDL 2.0.0, kdl.dev/spec) with exact places, in linear time and bounded memory.
//!
//! Departures from the specification, both refused with a clear error because a scene has no use for them: type
//! annotations and texts over several lines. Why not the `kdl` crate: measured with 6.7.1, nested `a /-{` takes
//! time 2^depth (100 bytes: half a minute; its issue 177), a node costs 45 us, and a malformed property is
//! reported at the start of its node. The crate is the other reader that the tests compare this one with.

use std::borrow::Cow;

use super::source::{Source, Span};
use super::token::{Cursor, is_newline};
use crate::error::Result;

/// Deepest nesting of children blocks.
pub const MAX_DEPTH: usize = 96;
/// Most nodes and values in a document.
pub const MAX_NODES: usize = 1 << 22;

/// A value of a node.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<'a> {
    /// Text, bare or quoted.
    Text(Cow<'a, str>),
    /// A finite number.
    Number(f64),
    /// `#true` or `#false`.
    Bool(bool),
    /// `#null`.
    Null,
}

/// An argument or a property.
#[derive(Clone, Debug)]
pub struct Entry<'a> {
    /// Name of a property and where it stands; `None` for arguments.
    pub name: Option<(Cow<'a, str>, Span)>,
    /// The value.
    pub value: Value<'a>,
    /// Where the value stands, quotes included.
    pub span: Span,
}

/// A node: name, arguments and properties in written order, children.
#[derive(Clone, Debug)]
pub struct Node<'a> {
    /// Its name.
    pub name: Cow<'a, str>,
    /// Where the name stands.
    pub span: Span,
    /// Arguments and properties in written order.
    pub entries: Vec<Entry<'a>>,
    /// The children block, if one was written.
    pub children: Option<Vec<Node<'a>>>,
}

impl Node<'_> {
    /// The first argument that is text: the node's own name for what it makes.
    pub fn title(&self) -> Option<(&str, Span)> {
        self.entries.iter().find_map(|e| match &e.value {
            Value::Text(text) if e.name.is_none() => Some((text.as_ref(), e.span)),
            _ => None,
        })
    }
}

/// Reads all nodes of `source`.
///
/// # Errors
/// The first thing that is not KDL, blocks nested deeper than [`MAX_DEPTH`], or more than [`MAX_NODES`] nodes and
/// values.
pub fn read(source: Source<'_>) -> Result<Vec<Node<'_>>> {
    let mut reader = Reader { cursor: Cursor::new(source), count: 0 };
    let nodes = reader.nodes(0)?;
    match reader.cursor.peek() {
        None => Ok(nodes),
        Some(_) => Err(reader.cursor.error_from(reader.cursor.at, "this `}` closes nothing")),
    }
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    count: usize,
}

impl<'a> Reader<'a> {
    /// Nodes up to a `}` or the end of the text.
    fn nodes(&mut self, depth: usize) -> Result<Vec<Node<'a>>> {
        let mut nodes = Vec::new();
        loop {
            self.cursor.skip_line_space()?;
            if matches!(self.cursor.peek(), None | Some('}')) {
                return Ok(nodes);
            }
            let dropped = self.slashdash()?;
            let node = self.node(depth)?;
            if !dropped {
                nodes.push(node);
            }
        }
    }

    /// Steps over `/-`, the mark that drops what follows.
    fn slashdash(&mut self) -> Result<bool> {
        let found = self.cursor.eat("/-");
        if found {
            self.cursor.skip_line_space()?;
        }
        Ok(found)
    }

    fn node(&mut self, depth: usize) -> Result<Node<'a>> {
        self.count_one()?;
        let start = self.cursor.at;
        let name = self.cursor.name("a statement")?;
        let mut node = Node { name, span: Span::new(start, self.cursor.at), entries: Vec::new(), children: None };
        let mut block_seen = false;
        loop {
            let spaced = self.cursor.skip_node_space()?;
            let dropped = self.slashdash()?;
            match self.cursor.peek() {
                Some('{') => {
                    let open = self.cursor.at;
                    let children = self.block(depth)?;
                    if !dropped && node.children.is_some() {
                        return Err(self.cursor.error_from(open, "expected one `{ }` block, found a second"));
                    }
                    if !dropped {
                        node.children = Some(children);
                    }
                    block_seen = true;
                }
                _ if dropped => {
                    let entry = self.entry()?;
                    drop(entry);
                }
                None | Some('}') => return Ok(node),
                Some(';') => {
                    self.cursor.at += 1;
                    return Ok(node);
                }
                Some(c) if is_newline(c) => return Ok(node),
                _ if self.cursor.rest().starts_with("//") => return Ok(node),
                _ if block_seen => return Err(self.cursor.unexpected("a new line or `;` after `}`")),
                _ if !spaced => return Err(self.cursor.unexpected("a space between values")),
                _ => {
                    let entry = self.entry()?;
                    node.entries.push(entry);
                }
            }
        }
    }

    fn block(&mut self, depth: usize) -> Result<Vec<Node<'a>>> {
        let open = self.cursor.at;
        if depth >= MAX_DEPTH {
            return Err(self.cursor.error_from(open, format!("blocks nest deeper than {MAX_DEPTH} levels")));
        }
        self.cursor.at += 1;
        let children = self.nodes(depth + 1)?;
        if !self.cursor.eat("}") {
            return Err(self.cursor.error_from(open, "this `{` has no closing `}`"));
        }
        Ok(children)
    }

    fn entry(&mut self) -> Result<Entry<'a>> {
        self.count_one()?;
        let start = self.cursor.at;
        let value = self.cursor.value("a value")?;
        let span = Span::new(start, self.cursor.at);
        let Value::Text(name) = value else { return Ok(Entry { name: None, value, span }) };
        let after = self.cursor.at;
        self.cursor.skip_node_space()?;
        if !self.cursor.eat("=") {
            self.cursor.at = after;
            return Ok(Entry { name: None, value: Value::Text(name), span });
        }
        self.cursor.skip_node_space()?;
        let start = self.cursor.at;
        let value = self.cursor.value("a value after `=`")?;
        Ok(Entry { name: Some((name, span)), value, span: Span::new(start, self.cursor.at) })
    }

    fn count_one(&mut self) -> Result<()> {
        self.count += 1;
        match self.count > MAX_NODES {
            true => Err(self.cursor.error_from(self.cursor.at, format!("more than {MAX_NODES} statements and values"))),
            false => Ok(()),
        }
    }
}
