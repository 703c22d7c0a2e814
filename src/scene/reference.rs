//! References from a scene file to other files: relative to its folder, and not out of it.

use std::path::{Component, Path, PathBuf};
use std::sync::Mutex;

use super::text;

/// Where the files are that a scene refers to.
#[derive(Clone, Copy, Debug)]
pub struct References<'a> {
    /// Folder that references are relative to; `None` if the scene has no folder and refers to no files.
    pub folder: Option<&'a Path>,
    /// Whether references may leave the folder.
    pub allow_outside: bool,
    /// Who keeps which files were meant.
    pub found: Option<&'a Found>,
}

/// Files that references meant.
#[derive(Debug, Default)]
pub struct Found(Mutex<Vec<PathBuf>>);

impl Found {
    fn add(&self, file: &Path) {
        // A list that was left in the middle of a panic is still a list.
        let mut files = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if !files.iter().any(|known| known == file) {
            files.push(file.to_path_buf());
        }
    }

    /// The files, by their real names, each once.
    pub fn into_files(self) -> Vec<PathBuf> {
        self.0.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl References<'_> {
    /// The file that a scene means by `written`.
    ///
    /// # Errors
    /// References that leave the folder (absolute, through `..`, or through a symbolic link) unless that is
    /// allowed, and files that do not exist.
    pub fn resolve(&self, written: &str) -> Result<PathBuf, String> {
        self.inside(written, Path::new(written))
    }

    /// The file that another one in the folder `inner`, which the scene refers to, means by `written`: relative to
    /// `inner`, and inside the scene's folder, which `..` may lead through.
    ///
    /// # Errors
    /// As [`Self::resolve`].
    pub fn resolve_from(&self, inner: &Path, written: &str) -> Result<PathBuf, String> {
        let Some(folder) = self.folder else { return Err("a scene without a folder refers to no files".into()) };
        let cannot = |e: std::io::Error| format!("cannot open {}: {e}", text::shown(written.as_bytes()));
        let (folder, inner) = (canonical(folder).map_err(cannot)?, canonical(inner).map_err(cannot)?);
        let Some(mut relative) = inner.strip_prefix(&folder).ok().map(Path::to_path_buf) else {
            // Only a reference that was allowed to leave the folder can lead here.
            return self.inside(written, &inner.join(written));
        };
        for part in Path::new(written).components() {
            match part {
                Component::CurDir => {}
                Component::ParentDir if relative.pop() => {}
                Component::Normal(name) => relative.push(name),
                _ => return self.inside(written, &inner.join(written)),
            }
        }
        self.inside(written, &relative)
    }

    /// The file at `relative`, written as `written`.
    fn inside(&self, written: &str, relative: &Path) -> Result<PathBuf, String> {
        let Some(folder) = self.folder else { return Err("a scene without a folder refers to no files".into()) };
        let inside = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        let shown = || text::shown(written.as_bytes());
        let outside = || format!("{} leaves the scene's folder", shown());
        if written.is_empty() || written.contains('\0') {
            return Err("expected the name of a file".into());
        }
        if !inside && !self.allow_outside {
            return Err(outside());
        }
        let cannot = |e: std::io::Error| format!("cannot open {}: {e}", shown());
        let folder = canonical(folder).map_err(cannot)?;
        let file = folder.join(relative).canonicalize().map_err(cannot)?;
        if !self.allow_outside && !file.starts_with(&folder) {
            return Err(outside());
        }
        if let Some(found) = self.found {
            found.add(&file);
        }
        Ok(file)
    }
}

/// The folder's own name, whatever links lead to it; an empty one is the current folder.
fn canonical(folder: &Path) -> std::io::Result<PathBuf> {
    (if folder.as_os_str().is_empty() { Path::new(".") } else { folder }).canonicalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_inner_folders_stay_in_the_scenes() {
        let folder = tempfile::tempdir().unwrap();
        let (root, models) = (folder.path().join("scene"), folder.path().join("scene/models"));
        std::fs::create_dir_all(&models).unwrap();
        std::fs::create_dir_all(root.join("maps")).unwrap();
        for file in [root.join("maps/a.png"), models.join("b.png"), folder.path().join("c.png")] {
            std::fs::write(file, "x").unwrap();
        }
        let references = References { folder: Some(&root), allow_outside: false, found: None };
        let found = |written: &str| references.resolve_from(&models, written);
        let real = |path: &Path| path.canonicalize().unwrap();
        assert_eq!(found("b.png").unwrap(), real(&models.join("b.png")));
        assert_eq!(found("../maps/./a.png").unwrap(), real(&root.join("maps/a.png")));
        for outside in ["../../c.png", "../../../etc/passwd", "/etc/passwd"] {
            assert!(found(outside).unwrap_err().contains("leaves the scene's folder"), "{outside}");
        }
        assert!(found("none.png").unwrap_err().starts_with("cannot open `none.png`"));
        let allowed = References { allow_outside: true, ..references };
        assert_eq!(allowed.resolve_from(&models, "../../c.png").unwrap(), real(&folder.path().join("c.png")));
    }
}
