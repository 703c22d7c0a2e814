//! Pictures as files: the extension chooses the format.

use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::film::exr::{Compression, ImageInfo};
use crate::film::{Film, exr, npy, pix, png};

/// Output formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Exr,
    Png,
    Npy,
    Pix,
}

/// A file to write and its format.
#[derive(Clone, Debug)]
pub(super) struct Target {
    pub path: PathBuf,
    pub format: Format,
}

/// Writes `film` in the target's format; `exposure` is for those of 8 bits.
///
/// # Errors
/// Those of the format's writer.
pub(super) fn write(target: &Target, film: &Film, info: &ImageInfo, exposure: f32) -> Result<()> {
    match target.format {
        Format::Exr => exr::write(&target.path, film, info, Compression::default()),
        Format::Png => png::write(&target.path, film, exposure),
        Format::Npy => write_npy(&target.path, film),
        Format::Pix => pix::write(&target.path, film, exposure),
    }
}

/// Writes `film` to every target, also when another one cannot be written.
///
/// # Errors
/// The first of those of [`write`].
pub(super) fn write_each(targets: &[Target], film: &Film, info: &ImageInfo, exposure: f32) -> Result<()> {
    targets.iter().map(|target| write(target, film, info, exposure)).fold(Ok(()), Result::and)
}

/// All files that a picture with the planes `planes` besides the colours is written to, the target's own last.
pub(super) fn files(target: &Target, planes: &[String]) -> Vec<PathBuf> {
    let beside = if target.format == Format::Npy { planes } else { &[] };
    beside.iter().map(|plane| plane_path(&target.path, plane)).chain([target.path.clone()]).collect()
}

/// R, G, B and A as one array, every other plane as one of its own. The named file comes last: where it is, all are.
fn write_npy(path: &Path, film: &Film) -> Result<()> {
    let (width, height) = (film.window.width(), film.window.height());
    let colors: Vec<&[f32]> = ["R", "G", "B", "A"].iter().filter_map(|name| film.f32_plane(name)).collect();
    film.planes
        .iter()
        .skip(colors.len())
        .try_for_each(|plane| npy::write_plane(&plane_path(path, &plane.name), width, height, &plane.data))?;
    npy::write_stack(path, width, height, &colors)
}

/// `out.npy` and plane `id.instance` give `out.id.instance.npy`.
fn plane_path(path: &Path, plane: &str) -> PathBuf {
    path.with_extension(format!("{plane}.npy"))
}

/// The format that a file's extension names.
pub(super) fn target(text: &str) -> std::result::Result<Target, String> {
    let path = PathBuf::from(text);
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let format = match extension.as_deref() {
        Some("exr") => Format::Exr,
        Some("png") => Format::Png,
        Some("npy") => Format::Npy,
        Some("pix") => Format::Pix,
        _ => return Err("expected a file name that ends in .exr, .png, .npy or .pix".into()),
    };
    Ok(Target { path, format })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PlaneData;

    /// Whoever finds the named file finds the others too; they are told beforehand.
    #[test]
    fn planes_are_written_before_the_named_file() {
        let dir = tempfile::tempdir().unwrap();
        let mut film = Film::full(1, 1).unwrap();
        for name in ["R", "G", "B", "A", "Z", "N.X"] {
            film.push(name, PlaneData::F32(vec![0.5])).unwrap();
        }
        let npy = target(&dir.path().join("a.npy").to_string_lossy()).unwrap();
        let expected = files(&npy, &["Z".into(), "N.X".into()]);
        assert_eq!(expected, ["a.Z.npy", "a.N.X.npy", "a.npy"].map(|name| dir.path().join(name)));
        // A folder is in the way of the last plane.
        std::fs::create_dir(&expected[1]).unwrap();
        assert!(write(&npy, &film, &ImageInfo::default(), 0.0).is_err());
        assert!(expected[0].exists() && !expected[2].exists());
        std::fs::remove_dir(&expected[1]).unwrap();
        write(&npy, &film, &ImageInfo::default(), 0.0).unwrap();
        assert!(expected.iter().all(|file| file.is_file()));
        let png = target("a.png").unwrap();
        assert_eq!(files(&png, &["Z".into()]), [Path::new("a.png")]);
    }

    #[test]
    fn a_target_that_cannot_be_written_leaves_the_others() {
        let dir = tempfile::tempdir().unwrap();
        let mut film = Film::full(1, 1).unwrap();
        for name in ["R", "G", "B", "A"] {
            film.push(name, PlaneData::F32(vec![0.5])).unwrap();
        }
        let targets = ["none/a.exr", "ok.exr", "none/b.png", "ok.png"];
        let targets = targets.map(|name| target(&dir.path().join(name).to_string_lossy()).unwrap());
        let error = write_each(&targets, &film, &ImageInfo::default(), 0.0).unwrap_err().to_string();
        assert!(error.starts_with(&targets[0].path.display().to_string()), "{error}");
        assert!(targets[1].path.is_file() && targets[3].path.is_file());
    }

    #[test]
    fn targets_parse_or_say_what_is_expected() {
        assert_eq!(target("a/b.EXR").unwrap().format, Format::Exr);
        assert_eq!(target("a.pix").unwrap().format, Format::Pix);
        assert!(target("a.jpg").is_err() && target("png").is_err());
        assert_eq!(plane_path(Path::new("d/out.npy"), "N.X"), Path::new("d/out.N.X.npy"));
    }
}
