//! Which objects of a scene were there before it changed.

use std::sync::Arc;

use crate::scene::assembly::{AssemblyObject, Part, PartKind};

/// The place in `before` of an object with the geometry of `object`: the same primitives with the same numbers in the same
/// places. Materials do not count. Trees of solids are taken for new: they are quickly built.
pub(super) fn find(object: &AssemblyObject, before: &[AssemblyObject]) -> Option<usize> {
    before.iter().position(|old| {
        old.parts.len() == object.parts.len() && old.parts.iter().zip(&object.parts).all(|(a, b)| is_same(a, b))
    })
}

fn is_same(a: &Part, b: &Part) -> bool {
    let is_same_kind = match (&a.kind, &b.kind) {
        (PartKind::Mesh(a), PartKind::Mesh(b)) => {
            Arc::ptr_eq(a, b) || a.triangles == b.triangles && a.positions == b.positions
        }
        (PartKind::Shape(a), PartKind::Shape(b)) => a == b,
        (PartKind::Solids(a), PartKind::Solids(b)) => Arc::ptr_eq(a, b),
        _ => false,
    };
    a.first_prim == b.first_prim && a.to_object == b.to_object && is_same_kind
}
