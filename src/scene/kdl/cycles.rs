//! Refuses groups that contain an instance of themselves, directly or through others.

use super::source::{Source, Span, quote};
use crate::error::Result;
use crate::scene::assembly::MAX_NESTING;
use crate::scene::description::GroupId;

/// An instance: in which group, of which group, where it is written.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// The group that holds the instance.
    pub parent: GroupId,
    /// The group that is placed.
    pub child: GroupId,
    /// The name in the instance statement.
    pub span: Span,
}

/// Checks that the instances `links` of `groups` (their names by id) form no cycle and do not nest too deeply.
///
/// # Errors
/// Points at the instance that closes a cycle, or at one that makes a chain longer than [`MAX_NESTING`].
pub fn check(source: Source<'_>, groups: &[&str], links: &[Link]) -> Result<()> {
    let mut links = links.to_vec();
    links.sort_by_key(|l| (l.parent, l.child));
    links.dedup_by_key(|l| (l.parent, l.child));
    let mut walk = Walk { source, groups, links: &links, heights: vec![None; groups.len()], path: Vec::new() };
    for group in 0..groups.len() as GroupId {
        walk.height(group, Span::new(0, 0))?;
    }
    Ok(())
}

struct Walk<'a> {
    source: Source<'a>,
    groups: &'a [&'a str],
    links: &'a [Link],
    /// Levels of groups below and including each group, once known.
    heights: Vec<Option<usize>>,
    path: Vec<GroupId>,
}

impl Walk<'_> {
    fn height(&mut self, group: GroupId, span: Span) -> Result<usize> {
        if let Some(height) = self.heights[group as usize] {
            return Ok(height);
        }
        if let Some(start) = self.path.iter().position(|&g| g == group) {
            let mut chain: Vec<&str> = self.path[start..].iter().map(|&g| self.groups[g as usize]).collect();
            chain.push(self.groups[group as usize]);
            let name = quote(self.groups[group as usize]);
            let what = format!("{name} contains an instance of itself");
            return Err(self.source.error(span, what).with_help(format!("the chain is {}", quote(&chain.join(" > ")))));
        }
        if self.path.len() >= MAX_NESTING {
            return Err(self.too_deep(span));
        }
        self.path.push(group);
        let first = self.links.partition_point(|l| l.parent < group);
        let mut height = 1;
        for i in first..self.links.len() {
            let link = self.links[i];
            if link.parent != group {
                break;
            }
            height = height.max(1 + self.height(link.child, link.span)?);
            if height > MAX_NESTING {
                return Err(self.too_deep(link.span));
            }
        }
        self.path.pop();
        self.heights[group as usize] = Some(height);
        Ok(height)
    }

    fn too_deep(&self, span: Span) -> crate::error::Error {
        self.source.error(span, format!("instances nest deeper than {MAX_NESTING} levels"))
    }
}
