//! Mesh files that are read once while they stay as they are.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::SystemTime;

use crate::error::{Result, locked};
use crate::scene::kdl::meshes::MeshFile;
use crate::scene::load::read_mesh;
use crate::scene::reference::References;

/// Most files of a folder that are looked at.
const MAX_FILES: usize = 10_000;

/// When a file was written last, and its length.
type Stamp = (SystemTime, u64);

/// When the last of several files was written, their number, and their lengths together.
type Others = (SystemTime, u64, u64);

/// A mesh file as it was read.
#[derive(Debug)]
struct Known {
    stamp: Stamp,
    /// Of a mesh with material libraries and pictures: what the files look like that may be among them.
    others: Option<Others>,
    file: MeshFile,
}

/// The mesh files of a scene, as they were read last.
#[derive(Debug, Default)]
pub struct Meshes(Mutex<HashMap<PathBuf, Known>>);

impl Meshes {
    /// The mesh in `path`, read only if the file, or one that it may name, has changed since the last time.
    ///
    /// # Errors
    /// Those of [`read_mesh`].
    pub fn read(&self, path: &Path, references: &References<'_>) -> Result<MeshFile> {
        let meta = std::fs::metadata(path);
        let stamp = meta.and_then(|meta| Ok((meta.modified()?, meta.len()))).ok();
        let mut known = locked(&self.0);
        if let (Some(stamp), Some(then)) = (stamp, known.get(path))
            && stamp == then.stamp
            && (then.file.looks.digests.is_empty() || then.others.is_some() && then.others == others(references))
        {
            return Ok(then.file.clone());
        }
        // Looked at first: a change while the mesh is read is a change.
        let others = others(references);
        let file = read_mesh(path, references)?;
        if let Some(stamp) = stamp {
            known.insert(path.into(), Known { stamp, others, file: file.clone() });
        }
        Ok(file)
    }
}

/// Latest change, number and length of the files in the scene's folder, scene files left out; `None` if files outside of it may
/// count too, or there are too many.
fn others(references: &References<'_>) -> Option<Others> {
    let folder = references.folder.filter(|_| !references.allow_outside)?;
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let (mut latest, mut count, mut bytes) = (SystemTime::UNIX_EPOCH, 0, 0);
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).ok()?.flatten() {
            let path = entry.path();
            let meta = std::fs::metadata(&path).ok()?;
            if meta.is_dir() && !entry.file_type().ok()?.is_symlink() {
                folders.push(path);
            } else if path.extension().is_none_or(|extension| extension != "kdl") {
                latest = latest.max(meta.modified().ok()?);
                count += 1;
                // Clocks of file systems are coarse: two changes may have one time.
                bytes += meta.len();
            }
            if count > MAX_FILES as u64 || folders.len() > MAX_FILES {
                return None;
            }
        }
    }
    Some((latest, count, bytes))
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
        let references = References { folder: Some(dir.path()), allow_outside: false, found: None };
        let read = || meshes.read(&path, &references);
        let first = read().unwrap();
        assert_eq!((first.mesh.triangles.len(), read().unwrap().digest), (1, first.digest));
        std::fs::write(&path, format!("{TRIANGLE}v 1 1 0\nf 2 4 3\n")).unwrap();
        let second = read().unwrap();
        assert_eq!(second.mesh.triangles.len(), 2);
        assert_ne!(second.digest, first.digest);
        // What the file names counts too, also when it appears later.
        let library = dir.path().join("a.mtl");
        let with_library = format!("mtllib a.mtl\n{}", TRIANGLE.replace("f ", "usemtl red\nf "));
        std::fs::write(&library, "newmtl red\nKd 1 0 0\n").unwrap();
        std::fs::write(&path, with_library).unwrap();
        let red = read().unwrap().looks.digests;
        assert_eq!((red.len(), &read().unwrap().looks.digests), (1, &red));
        std::fs::write(&library, "newmtl red\nKd 0.5 0 0.25\n").unwrap();
        assert_ne!(read().unwrap().looks.digests, red);
        std::fs::remove_file(&path).unwrap();
        assert!(read().is_err());
    }
}
