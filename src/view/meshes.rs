//! Mesh files that are read once while they stay as they are.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::SystemTime;

use crate::error::Result;
use crate::scene::kdl::meshes::MeshFile;
use crate::scene::load::read_mesh;

/// When a file was written last, and its length.
type Stamp = (SystemTime, u64);

/// The mesh files of a scene, as they were read last.
#[derive(Debug, Default)]
pub struct Meshes(Mutex<HashMap<PathBuf, (Stamp, MeshFile)>>);

impl Meshes {
    /// The mesh in `path`, read only if the file has changed since the last time.
    ///
    /// # Errors
    /// Those of [`read_mesh`].
    pub fn read(&self, path: &Path) -> Result<MeshFile> {
        let meta = std::fs::metadata(path);
        let stamp = meta.and_then(|meta| Ok((meta.modified()?, meta.len()))).ok();
        let mut known = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let (Some(stamp), Some((then, mesh))) = (stamp, known.get(path))
            && stamp == *then
        {
            return Ok(mesh.clone());
        }
        let mesh = read_mesh(path)?;
        if let Some(stamp) = stamp {
            known.insert(path.into(), (stamp, mesh.clone()));
        }
        Ok(mesh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    #[test]
    fn a_file_is_read_again_when_it_has_changed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.obj");
        std::fs::write(&path, TRIANGLE).unwrap();
        let meshes = Meshes::default();
        let first = meshes.read(&path).unwrap();
        assert_eq!((first.mesh.triangles.len(), meshes.read(&path).unwrap().digest), (1, first.digest));
        std::fs::write(&path, format!("{TRIANGLE}v 1 1 0\nf 2 4 3\n")).unwrap();
        let second = meshes.read(&path).unwrap();
        assert_eq!(second.mesh.triangles.len(), 2);
        assert_ne!(second.digest, first.digest);
        std::fs::remove_file(&path).unwrap();
        assert!(meshes.read(&path).is_err());
    }
}
