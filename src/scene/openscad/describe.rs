//! A file's solids as a scene: one tree, its colours, a camera as OpenSCAD's.

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};
use sha2::{Digest, Sha256};

use super::build::{Builder, Loose, Made};
use super::extrude::{Rise, rise};
use super::facets;
use super::fragments::{GRID, Resolution};
use super::looks::looks;
use super::syntax::{Source, parse};
use super::view;
use crate::error::{Error, Result};
use crate::scene::description::{Description, Item, ItemKind, Precision};
use crate::scene::kdl::meshes::MeshFile;
use crate::scene::mesh::Mesh;
use crate::scene::reference::References;
use crate::scene::solids::flat::FlatTree;
use crate::scene::solids::{NodeId, SolidTree};

/// Height of a plane figure that is not extruded, as OpenSCAD shows it.
const PLATE: f64 = 1.0;

/// Reads the bytes of a `.csg` file as a scene called `name`; `references` is where the files are that it imports,
/// which `read` reads.
///
/// # Errors
/// At line and column: what is not in the grammar, modules that are not known or cannot be shown, arguments that make
/// no sense, files that cannot be read, models that are too large.
pub(super) fn describe(
    file: &Path,
    name: &str,
    bytes: &[u8],
    references: &References<'_>,
    read: &dyn Fn(&Path) -> Result<MeshFile>,
) -> Result<Description> {
    let source = Source { file, bytes };
    let nodes = parse(&source)?;
    let mut description = Description::new(name);
    description.precision = Some(Precision::F64);
    let mut digest = Sha256::new_with_prefix(bytes);
    let mut read_mesh = |written: &str| {
        let found = read(&references.resolve(written)?).map_err(|error| error.to_string())?;
        digest.update(found.digest);
        Ok::<Mesh, String>(found.mesh)
    };
    let looks = looks(&source, &nodes, &mut description)?;
    let mut tree = SolidTree::new(name);
    // What OpenSCAD takes for one place.
    tree.tolerance = GRID;
    let mut builder = Builder::new(&source, &nodes, &looks, tree, &mut read_mesh);
    let made = builder.all()?;
    let root = solid(&mut builder, made, looks.root as usize)?;
    description.warnings.append(&mut builder.warnings);
    description.materials.append(&mut builder.palette.materials);
    let (tree, loose) = (builder.solids.tree, builder.loose);
    description.hash = digest.finalize().iter().map(|b| format!("{b:02x}")).collect();
    place(&mut description, root.map(|root| SolidTree { root, ..tree }), loose)
        .map_err(|what| Error::whole(file, what))?;
    Ok(description)
}

/// What the file makes as a solid: figures become plates.
fn solid(builder: &mut Builder<'_, '_, '_>, made: Made, root: usize) -> Result<Option<NodeId>> {
    let figure = match made {
        Made::Solid(solid) => return Ok(solid),
        Made::Flat(figure) if !figure.is_empty() => figure,
        _ => return Ok(None),
    };
    builder.warnings.push("the model is a plane figure: shown as a plate of height 1, as OpenSCAD does".into());
    let way = Rise { way: DVec3::Z * PLATE, is_centred: true, twist: 0.0, scale: DVec2::ONE, slices: Some(1) };
    let plate = rise(&figure, &way, &Resolution::new(0.0, 12.0, 2.0), &mut builder.work);
    let (mesh, _) = plate.map_err(|what| builder.error(root, what))?;
    match builder.solid_of(root, Some(mesh))? {
        Made::Solid(solid) => Ok(solid),
        _ => Ok(None),
    }
}

/// Puts the tree and the meshes into the scene, with a camera that sees them.
fn place(description: &mut Description, tree: Option<SolidTree>, loose: Vec<Loose>) -> std::result::Result<(), String> {
    let mut bounds = None;
    if let Some(mut tree) = tree {
        facets::simplify(&mut tree);
        bounds = view::bounds(&FlatTree::new(&tree)?);
        let item = Item { transform: DAffine3::IDENTITY, material: None, kind: ItemKind::Solids(0) };
        description.solids.push(Arc::new(tree));
        description.groups[0].items.push(item);
    }
    for part in loose {
        for &p in &part.mesh.positions {
            let p = part.transform.transform_point3(p);
            bounds = Some(bounds.map_or((p, p), |(lo, hi): (DVec3, DVec3)| (lo.min(p), hi.max(p))));
        }
        let kind = ItemKind::Mesh(description.meshes.len() as u32);
        description.meshes.push(part.mesh);
        description.groups[0].items.push(Item { transform: part.transform, material: part.material, kind });
    }
    description.cameras.push(view::camera(bounds));
    Ok(())
}
