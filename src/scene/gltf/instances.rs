//! EXT_mesh_gpu_instancing: the placements of one node's mesh as columns of numbers.

use glam::{DAffine3, DQuat, DVec3};

use super::Document;
use super::accessor::{QUATERNIONS, VECTORS, View};
use super::json::InstanceAttributes;
use super::walk::compose;
use crate::error::Result;

/// Translations, rotations and scales of equal number.
pub struct Instances<'a> {
    count: usize,
    translation: Option<View<'a>>,
    rotation: Option<View<'a>>,
    scale: Option<View<'a>>,
}

impl<'a> Instances<'a> {
    /// The columns that `attributes`, at `path` of the document, name. Without any there is one instance.
    ///
    /// # Errors
    /// What is wrong with the accessors; different numbers of elements.
    pub fn new(document: &'a Document<'_>, attributes: InstanceAttributes, path: &str) -> Result<Self> {
        let column = |accessor: Option<u32>, expected, name: &str| {
            accessor.map(|a| document.view(a, expected, format_args!("{path}.{name}"))).transpose()
        };
        let translation = column(attributes.translation, VECTORS, "TRANSLATION")?;
        let rotation = column(attributes.rotation, QUATERNIONS, "ROTATION")?;
        let scale = column(attributes.scale, VECTORS, "SCALE")?;
        let mut counts = [&translation, &rotation, &scale].into_iter().flatten().map(|view| view.count);
        let count = counts.next().unwrap_or(1);
        if let Some(other) = counts.find(|&other| other != count) {
            return Err(document.error(path, format!("expected equal counts, found {count} and {other}")));
        }
        Ok(Self { count, translation, rotation, scale })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Mesh space to the node's space, for instance `i`.
    pub fn get(&self, i: usize) -> DAffine3 {
        let vector = |view: &Option<View<'_>>, absent| view.map_or(absent, |v| DVec3::from_array(v.numbers(i)));
        let rotation = self.rotation.map_or(DQuat::IDENTITY, |v| DQuat::from_array(v.numbers(i)));
        compose(vector(&self.translation, DVec3::ZERO), rotation, vector(&self.scale, DVec3::ONE))
    }
}
