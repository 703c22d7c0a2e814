//! The walk over the nodes of a scene: groups, instances, cameras and lights of the
//! description.

use std::collections::HashSet;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::instances::Instances;
use super::json::{InstanceAttributes, Node};
use super::primitive::Primitives;
use super::{Document, look};
use crate::error::Result;
use crate::scene::assembly::{MAX_NESTING, MAX_PLACEMENTS};
use crate::scene::description::{Description, Group, GroupId, Item, ItemKind};
use crate::scene::text;

/// Deepest nesting of groups of nodes: the root is above them, the groups of meshes are below.
const MAX_DEPTH: usize = MAX_NESTING - 2;
/// How far the last row of a matrix may be from 0 0 0 1: exporters compute it.
const AFFINE: f64 = 1e-6;

/// Places the nodes `roots` and those below them.
///
/// # Errors
/// What is wrong with nodes, their meshes, cameras, lights and instances; a node that the scene names twice; more than
/// [`MAX_PLACEMENTS`] instances.
pub fn place(document: &Document<'_>, roots: &[u32], description: &mut Description) -> Result<()> {
    let mut walk = Walk {
        document,
        primitives: Primitives::new(document),
        mesh_groups: vec![None; document.root.meshes.len()],
        visited: vec![false; document.root.nodes.len()],
        camera_names: HashSet::new(),
        placed: 0,
        singular: 0,
        description,
    };
    // A stack of our own: documents may nest nodes a million deep.
    let mut stack = vec![(roots.iter(), Frame::ROOT)];
    while let Some((siblings, frame)) = stack.last_mut() {
        let frame = *frame;
        match siblings.next() {
            None => drop(stack.pop()),
            Some(&node) => {
                if let Some(inner) = walk.node(node, frame)? {
                    stack.push((document.root.nodes[node as usize].children.iter(), inner));
                }
            }
        }
    }
    walk.finish();
    Ok(())
}

/// Where the children of a node go.
#[derive(Clone, Copy, Debug)]
struct Frame {
    group: GroupId,
    /// The node's space to the group's; not the identity where groups cannot nest deeper.
    in_group: DAffine3,
    /// The group's space to the world.
    to_world: DAffine3,
    depth: usize,
}

impl Frame {
    const ROOT: Self = Self { group: 0, in_group: DAffine3::IDENTITY, to_world: DAffine3::IDENTITY, depth: 0 };
}

struct Walk<'w, 'a> {
    document: &'w Document<'a>,
    primitives: Primitives,
    /// The group of each mesh that was met.
    mesh_groups: Vec<Option<GroupId>>,
    visited: Vec<bool>,
    camera_names: HashSet<String>,
    placed: u64,
    /// Nodes and instances whose transform cannot be inverted.
    singular: u64,
    description: &'w mut Description,
}

impl Walk<'_, '_> {
    /// Places one node; the frame of its children, if there is something to see in it.
    fn node(&mut self, index: u32, frame: Frame) -> Result<Option<Frame>> {
        let node = &self.document.root.nodes[index as usize];
        if std::mem::replace(&mut self.visited[index as usize], true) {
            return Err(self.document.error(format_args!("nodes[{index}]"), "is placed twice by the scene"));
        }
        let mut inner = Frame { in_group: frame.in_group * local(self.document, node, index)?, ..frame };
        let to_world = frame.to_world * inner.in_group;
        if !is_invertible(&to_world) {
            // Exporters hide nodes by a scale of zero: that hides what is below them too.
            self.singular += 1;
            return Ok(None);
        }
        if let Some(camera) = node.camera
            && let Some(mut camera) = look::camera(self.document, camera, index, &to_world)?
        {
            if !self.camera_names.insert(camera.name.clone()) {
                camera.name = format!("{} (node {index})", camera.name);
            }
            self.description.cameras.push(camera);
        }
        if let Some(light) = node.extensions.as_ref().and_then(|e| e.light) {
            self.description.lights.push(look::light(self.document, light.light, index, &to_world)?);
        }
        if !node.children.is_empty() && frame.depth < MAX_DEPTH {
            let name = name(node.name.as_deref());
            let group = self.group(name, Vec::new());
            self.push(frame.group, inner.in_group, group);
            inner = Frame { group, in_group: DAffine3::IDENTITY, to_world, depth: frame.depth + 1 };
        }
        if let Some(mesh) = node.mesh {
            let group = self.mesh_group(mesh, index)?;
            match node.extensions.as_ref().and_then(|e| e.instancing.as_ref()) {
                Some(instancing) => self.instances(&inner, group, instancing.attributes, index)?,
                None => self.instance(&inner, inner.in_group, group, index)?,
            }
        }
        Ok((!node.children.is_empty()).then_some(inner))
    }

    /// Places `group` as often as the attributes of EXT_mesh_gpu_instancing say.
    fn instances(&mut self, frame: &Frame, group: GroupId, attributes: InstanceAttributes, node: u32) -> Result<()> {
        let path = format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes");
        let instances = Instances::new(self.document, attributes, &path)?;
        self.document.spend((instances.count() as u64).saturating_mul(size_of::<Item>() as u64), &path)?;
        for i in 0..instances.count() {
            self.instance(frame, frame.in_group * instances.get(i), group, node)?;
        }
        Ok(())
    }

    fn instance(&mut self, frame: &Frame, transform: DAffine3, group: GroupId, node: u32) -> Result<()> {
        if !is_invertible(&(frame.to_world * transform)) {
            self.singular += 1;
            return Ok(());
        }
        self.placed += 1;
        if self.placed > MAX_PLACEMENTS {
            let what = format!("more than {MAX_PLACEMENTS} instances");
            return Err(self.document.error(format_args!("nodes[{node}]"), what));
        }
        self.push(frame.group, transform, group);
        Ok(())
    }

    /// The group of mesh `index`, made when it is first needed.
    fn mesh_group(&mut self, index: u32, node: u32) -> Result<GroupId> {
        let meshes = &self.document.root.meshes;
        let mesh = self.document.get(meshes, "meshes", index, format_args!("nodes[{node}].mesh"))?;
        if let Some(group) = self.mesh_groups[index as usize] {
            return Ok(group);
        }
        let items = self.primitives.items(self.document, index, self.description)?;
        let group = self.group(name(mesh.name.as_deref()), items);
        self.mesh_groups[index as usize] = Some(group);
        Ok(group)
    }

    fn group(&mut self, name: String, items: Vec<Item>) -> GroupId {
        self.description.groups.push(Group { name, items });
        (self.description.groups.len() - 1) as GroupId
    }

    fn push(&mut self, parent: GroupId, transform: DAffine3, group: GroupId) {
        let item = Item { transform, material: None, kind: ItemKind::Instance(group) };
        self.description.groups[parent as usize].items.push(item);
    }

    fn finish(self) {
        let warnings = &mut self.description.warnings;
        warnings.extend(self.primitives.warnings());
        if self.singular > 0 {
            let count = self.singular;
            warnings.push(format!("{count} nodes or instances are left out: their transform cannot be inverted"));
        }
    }
}

/// The test that the assembly makes, on the same product.
fn is_invertible(map: &DAffine3) -> bool {
    map.matrix3.determinant() != 0.0 && map.is_finite() && map.inverse().is_finite()
}

fn name(written: Option<&str>) -> String {
    text::name(written.unwrap_or_default().as_bytes())
}

/// A node's space to its parent's.
fn local(document: &Document<'_>, node: &Node, index: u32) -> Result<DAffine3> {
    if let Some(m) = &node.matrix {
        let column = |i: usize| DVec3::new(m[i], m[i + 1], m[i + 2]);
        let last = [m[3], m[7], m[11], m[15] - 1.0];
        if last.iter().any(|x| x.abs() > AFFINE) {
            let what = "expected an affine map, column by column: 0 0 0 1 in the last row";
            return Err(document.error(format_args!("nodes[{index}].matrix"), what));
        }
        return Ok(DAffine3 { matrix3: DMat3::from_cols(column(0), column(4), column(8)), translation: column(12) });
    }
    let vector = |v: &Option<Box<[f64; 3]>>, absent: DVec3| v.as_ref().map_or(absent, |v| DVec3::from_array(**v));
    let rotation = node.rotation.as_ref().map_or(DQuat::IDENTITY, |q| DQuat::from_array(**q));
    Ok(compose(vector(&node.translation, DVec3::ZERO), rotation, vector(&node.scale, DVec3::ONE)))
}

/// Scale, then rotation, then translation. Files round quaternions to f32, so they are made unit here; a zero one
/// gives a map without an inverse.
pub fn compose(translation: DVec3, rotation: DQuat, scale: DVec3) -> DAffine3 {
    if rotation == DQuat::IDENTITY {
        return DAffine3 { matrix3: DMat3::from_diagonal(scale), translation };
    }
    let length = rotation.length();
    if !(length > 0.0 && length.is_finite()) {
        return DAffine3 { matrix3: DMat3::ZERO, translation };
    }
    DAffine3::from_scale_rotation_translation(scale, rotation / length, translation)
}
