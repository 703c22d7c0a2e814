//! Scenes: the description a person writes, importers that read it, the assembly that numbers it, the world that
//! engines trace.

pub mod assembly;
pub mod brlcad;
pub mod builtin;
pub mod description;
pub mod gltf;
pub mod kdl;
pub mod light;
pub mod load;
pub mod material;
pub mod mesh;
pub mod mtl;
pub mod obj;
pub mod openscad;
pub mod parameter;
pub mod pictures;
pub mod ply;
mod polygon;
pub mod reference;
pub mod solids;
pub mod stl;
mod text;
pub mod texture;
mod unmapped;
pub mod unpack;
mod weld;
pub mod world;
