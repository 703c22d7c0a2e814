//! Options that mean nothing to what is compared: whoever gives them expects what will not be done.

use std::path::Path;

use super::CompareArgs;
use super::difference::{Kind, kind};
use crate::error::{Error, Result};

impl CompareArgs {
    /// # Errors
    /// [`Error::Usage`] for options that mean nothing to these two pictures and to the files that are made of them.
    pub(super) fn check_for_pictures(&self) -> Result<()> {
        if self.scene.is_some() {
            return Err(Error::Usage("--scene and --rays are for files of hits".into()));
        }
        if let Some(name) = self.options.first_given() {
            return Err(Error::Usage(format!("{name} is for the scene of files of hits; these are pictures")));
        }
        let kinds = self.files.iter().map(|file| kind(file)).collect::<Result<Vec<_>>>()?;
        let of_heat_maps = [(self.map.is_some(), "--map"), (self.full.is_some(), "--full")];
        if let (Some(name), false) = (first(&of_heat_maps), kinds.contains(&Kind::Png)) {
            return Err(Error::Usage(format!("{name} is for heat maps: expected -o FILE.png")));
        }
        let is_pix = |file: &Path| file.extension().is_some_and(|e| e.eq_ignore_ascii_case("pix"));
        if self.size.is_some() && !is_pix(&self.a) && !is_pix(&self.b) {
            return Err(Error::Usage("--size is for .pix pictures; these files say their own".into()));
        }
        Ok(())
    }

    /// # Errors
    /// [`Error::Usage`] for options that mean nothing to files of hits, and for those of a scene where none is given.
    pub(super) fn check_for_hits(&self) -> Result<()> {
        if !self.files.is_empty() {
            return Err(Error::Usage("-o: hits have no pixels; only pictures make difference images".into()));
        }
        let of_pictures = [
            (self.map.is_some(), "--map"),
            (self.full.is_some(), "--full"),
            (self.exposure.is_some(), "--exposure"),
            (self.peak.is_some(), "--peak"),
            (self.size.is_some(), "--size"),
            (self.ppd.is_some(), "--ppd"),
        ];
        if let Some(name) = first(&of_pictures) {
            return Err(Error::Usage(format!("{name} is for pictures; these are files of hits")));
        }
        match self.options.first_given() {
            Some(name) if self.scene.is_none() => {
                Err(Error::Usage(format!("{name} says how to open a scene: expected --scene and --rays")))
            }
            _ => Ok(()),
        }
    }
}

/// The first option that is given.
fn first(options: &[(bool, &'static str)]) -> Option<&'static str> {
    options.iter().find(|(is_given, _)| *is_given).map(|(_, name)| *name)
}
