//! The node hierarchy: every node has at most one parent and none is below itself.

use super::Document;
use crate::error::Result;

/// No parent.
const NONE: u32 = u32::MAX;

/// The nodes that the scene to be shown begins with, after all nodes were checked.
///
/// # Errors
/// Indices that name nothing, a node with two parents, a cycle.
pub fn roots(document: &Document<'_>) -> Result<Vec<u32>> {
    let parents = parents(document)?;
    let all: Vec<u32> = (0..parents.len() as u32).filter(|&n| parents[n as usize] == NONE).collect();
    refuse_cycles(document, &parents, &all)?;
    let root = document.root;
    let scene = match root.scene {
        Some(index) => Some((index, document.get(&root.scenes, "scenes", index, "scene")?)),
        None => root.scenes.first().map(|first| (0, first)),
    };
    let Some((index, scene)) = scene else { return Ok(all) };
    for (i, &node) in scene.nodes.iter().enumerate() {
        document.get(&root.nodes, "nodes", node, format_args!("scenes[{index}].nodes[{i}]"))?;
    }
    Ok(scene.nodes.to_vec())
}

fn parents(document: &Document<'_>) -> Result<Vec<u32>> {
    let nodes = &document.root.nodes;
    let mut parents = vec![NONE; nodes.len()];
    for (n, node) in nodes.iter().enumerate() {
        for (c, &child) in node.children.iter().enumerate() {
            let path = format_args!("nodes[{n}].children[{c}]");
            document.get(nodes, "nodes", child, path)?;
            let parent = &mut parents[child as usize];
            if *parent != NONE {
                let what = format!("nodes[{child}] is also below nodes[{parent}]; a node has one parent");
                return Err(document.error(path, what));
            }
            *parent = n as u32;
        }
    }
    Ok(parents)
}

/// With one parent each, what cannot be reached from `roots` is below a cycle.
fn refuse_cycles(document: &Document<'_>, parents: &[u32], roots: &[u32]) -> Result<()> {
    let mut reached = vec![false; parents.len()];
    let mut waiting = roots.to_vec();
    while let Some(node) = waiting.pop() {
        reached[node as usize] = true;
        waiting.extend_from_slice(&document.root.nodes[node as usize].children);
    }
    let Some(mut node) = reached.iter().position(|reached| !reached) else { return Ok(()) };
    // From below a cycle the way up ends in it.
    for _ in 0..parents.len() {
        node = parents[node] as usize;
    }
    Err(document.error(format_args!("nodes[{node}]"), "is below itself"))
}
