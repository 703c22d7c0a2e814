//! References from a scene file to other files: relative to its folder, and not out of it.

use std::path::{Component, Path, PathBuf};

use super::text;

/// Where the files are that a scene refers to.
#[derive(Clone, Copy, Debug)]
pub struct References<'a> {
    /// Folder that references are relative to; `None` if the scene has no folder and refers to no files.
    pub folder: Option<&'a Path>,
    /// Whether references may leave the folder.
    pub allow_outside: bool,
}

impl References<'_> {
    /// The file that a scene means by `written`.
    ///
    /// # Errors
    /// References that leave the folder (absolute, through `..`, or through a symbolic link) unless that is
    /// allowed, and files that do not exist.
    pub fn resolve(&self, written: &str) -> Result<PathBuf, String> {
        let Some(folder) = self.folder else { return Err("a scene without a folder refers to no files".into()) };
        let relative = Path::new(written);
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
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let file = folder.join(relative).canonicalize().map_err(cannot)?;
        let folder = folder.canonicalize().map_err(cannot)?;
        if !self.allow_outside && !file.starts_with(&folder) {
            return Err(outside());
        }
        Ok(file)
    }
}
