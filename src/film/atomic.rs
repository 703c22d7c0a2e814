//! Files that appear whole or not at all.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// What [`write_atomically`] hands to its closure: buffered, `Write + Seek`.
pub type Writer<'a> = BufWriter<&'a mut File>;

/// Writes a file in one step: into a temporary file beside the target, flushed, synced, then renamed over it.
///
/// If `write` fails or panics, or the disk is full, the old file stays as it was and the temporary file is removed.
/// A killed process leaves the old file (and may leave a hidden `.NAME.*.tmp` beside it). A symbolic link is
/// followed: the file it names is replaced, or made. The new file gets the rights that any new file gets here.
///
/// # Errors
/// [`Error::Io`] with `path` for whatever `write` or the system report; also if `path` is a directory or device,
/// which a rename would replace.
pub fn write_atomically<T>(path: &Path, write: impl FnOnce(&mut Writer<'_>) -> io::Result<T>) -> Result<T> {
    replace(path, write).map_err(|e| Error::io(path, e))
}

/// Checks that [`write_atomically`] can write `path`, before work starts that would be lost: a temporary file is made
/// beside it and removed.
///
/// # Errors
/// [`Error::Io`] with `path`: no such folder, no right to write there, a directory or device of that name.
pub fn check_file(path: &Path) -> Result<()> {
    let check = || {
        let target = resolve(path)?;
        temp_file(&target, folder_of(&target)).map(drop)
    };
    check().map_err(|e| Error::io(path, e))
}

/// Checks that writing `path` replaces none of `inputs`, the files that a command reads, whatever links lead to them: what was
/// read is not to be lost.
///
/// # Errors
/// A usage error that names both.
pub fn check_apart(path: &Path, inputs: &[&Path]) -> Result<()> {
    // What has no real name yet is nobody's input.
    let Ok(target) = std::fs::canonicalize(path) else { return Ok(()) };
    let is_target = |input: &&&Path| std::fs::canonicalize(input).is_ok_and(|input| input == target);
    inputs.iter().find(is_target).map_or(Ok(()), |input| {
        let (path, input) = (path.display(), input.display());
        Err(Error::Usage(format!("{path}: expected another file to write to; this one is read ({input})")))
    })
}

/// Checks that `paths`, the files that a command writes, are as many files, whatever links lead to them: of two in one place the
/// first would be lost.
///
/// # Errors
/// A usage error that names both; [`Error::Io`] with the path that [`write_atomically`] cannot write.
pub fn check_distinct(paths: &[PathBuf]) -> Result<()> {
    let mut places = HashMap::new();
    for path in paths {
        let place = place(path).map_err(|e| Error::io(path, e))?;
        if let Some(other) = places.insert(place, path) {
            let (path, other) = (path.display(), other.display());
            return Err(Error::Usage(format!(
                "{path}: expected another file to write to; this one is written ({other})"
            )));
        }
    }
    Ok(())
}

/// Where [`write_atomically`] puts `path`, which need not be there.
fn place(path: &Path) -> io::Result<PathBuf> {
    let target = resolve(path)?;
    let name = target.file_name().unwrap_or_default();
    Ok(std::fs::canonicalize(folder_of(&target))?.join(name))
}

/// Checks that files can be written to the folder `path`, which is there or can be made; none is made.
///
/// # Errors
/// [`Error::Io`] with `path`.
pub fn check_folder(path: &Path) -> Result<()> {
    let there = path.ancestors().find(|folder| folder.exists()).unwrap_or(Path::new("."));
    temp_file(Path::new("check"), there).map(drop).map_err(|e| Error::io(path, e))
}

fn replace<T>(path: &Path, write: impl FnOnce(&mut Writer<'_>) -> io::Result<T>) -> io::Result<T> {
    let target = resolve(path)?;
    let dir = folder_of(&target);
    let mut temp = temp_file(&target, dir)?;
    let mut writer = BufWriter::new(temp.as_file_mut());
    let value = write(&mut writer)?;
    writer.flush()?;
    drop(writer);
    temp.as_file().sync_all()?;
    temp.persist(&target).map_err(|e| e.error)?;
    sync_directory(dir);
    Ok(value)
}

fn folder_of(target: &Path) -> &Path {
    match target.parent() {
        Some(dir) if !dir.as_os_str().is_empty() => dir,
        _ => Path::new("."),
    }
}

/// The file to replace: symbolic links followed, anything but a regular file or a new name refused.
fn resolve(path: &Path) -> io::Result<PathBuf> {
    match std::fs::metadata(path) {
        Ok(meta) if meta.is_file() => std::fs::canonicalize(path),
        Ok(_) => Err(io::Error::new(io::ErrorKind::InvalidInput, "expected a regular file or a new name to write to")),
        Err(e) if e.kind() == io::ErrorKind::NotFound => match std::fs::symlink_metadata(path) {
            // A link to what is not there yet, perhaps through another; the system finds links in a circle above.
            Ok(meta) if meta.is_symlink() => resolve(&folder_of(path).join(std::fs::read_link(path)?)),
            _ => Ok(path.to_path_buf()),
        },
        Err(e) => Err(e),
    }
}

fn temp_file(target: &Path, dir: &Path) -> io::Result<tempfile::NamedTempFile> {
    let name = target
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "expected a path that ends in a file name"))?;
    let prefix = format!(".{}.", name.to_string_lossy());
    // Made by hand, an ordinary file: only the umask limits its rights, and errors do not name it.
    let make = |path: &Path| File::create_new(path);
    tempfile::Builder::new().prefix(&prefix).suffix(".tmp").make_in(dir, make)
}

/// Makes the rename itself durable. The new file is already in place and whole, so a file system that cannot sync
/// directories is no reason to report a failed write.
fn sync_directory(dir: &Path) {
    #[cfg(unix)]
    if let Ok(handle) = File::open(dir) {
        handle.sync_all().ok();
    }
    #[cfg(not(unix))]
    let _ = dir;
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::io::{Seek, SeekFrom};
    use std::panic::{AssertUnwindSafe, catch_unwind};

    fn names_in(dir: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_finished_writer_replaces_the_file_and_may_seek() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        fs::write(&path, b"old and longer").unwrap();
        let value = write_atomically(&path, |w| {
            w.write_all(b"__cd")?;
            w.seek(SeekFrom::Start(0))?;
            w.write_all(b"ab")?;
            Ok(7)
        });
        assert_eq!(value.unwrap(), 7);
        assert_eq!(fs::read(&path).unwrap(), b"abcd");
        assert_eq!(names_in(dir.path()), ["a.bin"]);
    }

    #[test]
    fn a_failed_writer_leaves_the_old_file_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        fs::write(&path, b"old").unwrap();
        let failed = write_atomically(&path, |w| {
            w.write_all(&[1; 100_000])?;
            Err::<(), _>(io::Error::other("the disk is full"))
        });
        assert_eq!(failed.unwrap_err().to_string(), format!("{}: the disk is full", path.display()));
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            write_atomically(&path, |w| -> io::Result<()> {
                w.write_all(&[1; 100_000])?;
                std::panic::resume_unwind(Box::new("a writer's bug"))
            })
        }));
        assert!(panicked.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names_in(dir.path()), ["a.bin"]);
    }

    #[test]
    fn directories_and_missing_directories_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let is_dir = write_atomically(dir.path(), |_| Ok(())).unwrap_err().to_string();
        assert!(is_dir.contains("expected a regular file"), "{is_dir}");
        // The error names the file, not the temporary one.
        let missing = dir.path().join("none/a");
        let system = fs::write(&missing, "").unwrap_err();
        let error = write_atomically(&missing, |_| Ok(())).unwrap_err().to_string();
        assert_eq!(error, format!("{}: {system}", missing.display()));
        assert!(write_atomically(Path::new(""), |_| Ok(())).is_err());
        assert_eq!(names_in(dir.path()), Vec::<String>::new());
    }

    #[test]
    fn what_cannot_be_written_is_told_beforehand() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        fs::write(&file, b"old").unwrap();
        for (path, fine) in [("file", true), ("new", true), ("none/new", false), ("file/new", false), (".", false)] {
            let path = dir.path().join(path);
            assert_eq!(check_file(&path).is_ok(), fine, "{}", path.display());
            assert_eq!(write_atomically(&path, |w| w.write_all(b"old")).is_ok(), fine, "{}", path.display());
        }
        for (path, fine) in [(".", true), ("none/new", true), ("file", false), ("file/new", false)] {
            assert_eq!(check_folder(&dir.path().join(path)).is_ok(), fine, "{path}");
        }
        assert!(check_folder(Path::new("surely/not/there")).is_ok());
        assert_eq!(names_in(dir.path()), ["file", "new"]);
        assert_eq!(fs::read(&file).unwrap(), b"old");
    }

    #[test]
    fn what_is_read_is_not_written() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b, new] = ["a", "b", "new"].map(|name| dir.path().join(name));
        fs::write(&a, b"a").unwrap();
        fs::write(&b, b"b").unwrap();
        let other_name = dir.path().join(".").join("b");
        assert!(check_apart(&a, &[&b, &new]).is_ok() && check_apart(&new, &[&new, &a]).is_ok());
        assert!(check_apart(&b, &[&a, &other_name]).is_err());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&a, &new).unwrap();
            let text = check_apart(&new, &[&b, &a]).unwrap_err().to_string();
            assert!(text.contains("this one is read"), "{text}");
        }
    }

    #[test]
    fn what_is_written_is_written_once() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b, new] = ["a", "b", "new"].map(|name| dir.path().join(name));
        fs::write(&a, b"a").unwrap();
        let other_name = |name: &str| dir.path().join(".").join(name);
        assert!(check_distinct(&[]).is_ok() && check_distinct(&[a.clone(), b.clone(), new.clone()]).is_ok());
        for (first, second) in [(&a, &other_name("a")), (&b, &other_name("b")), (&new, &new)] {
            let text = check_distinct(&[first.clone(), second.clone()]).unwrap_err().to_string();
            assert!(text.starts_with(&second.display().to_string()) && text.contains("this one is written"), "{text}");
        }
        assert!(check_distinct(&[dir.path().join("none").join("a")]).is_err());
        #[cfg(unix)]
        {
            // To what is there, and to what is not there yet.
            for (file, link) in [(&a, "to_a"), (&b, "to_b")] {
                let link = dir.path().join(link);
                std::os::unix::fs::symlink(file, &link).unwrap();
                assert!(check_distinct(&[file.clone(), link.clone()]).is_err());
                assert!(check_distinct(&[new.clone(), link]).is_ok());
            }
        }
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_refused_links_followed_and_rights_ordinary() {
        use std::os::unix::fs::PermissionsExt;
        let device = write_atomically(Path::new("/dev/null"), |_| Ok(())).unwrap_err().to_string();
        assert!(device.contains("expected a regular file"), "{device}");

        let dir = tempfile::tempdir().unwrap();
        let (real, link) = (dir.path().join("real"), dir.path().join("link"));
        fs::write(&real, b"old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_atomically(&link, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&real).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        // A link to what is not there yet: that is made, through however many links.
        let (dangling, before, made) =
            (dir.path().join("dangling"), dir.path().join("before"), dir.path().join("made"));
        std::os::unix::fs::symlink("made", &dangling).unwrap();
        std::os::unix::fs::symlink(&dangling, &before).unwrap();
        check_file(&before).unwrap();
        write_atomically(&before, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&made).unwrap(), b"new");
        assert!([&before, &dangling].iter().all(|link| fs::symlink_metadata(link).unwrap().is_symlink()));
        let circle = dir.path().join("circle");
        std::os::unix::fs::symlink("circle", &circle).unwrap();
        assert!(check_file(&circle).is_err() && write_atomically(&circle, |w| w.write_all(b"new")).is_err());
        // The same rights as a file that std creates under this umask.
        let rights = |p: &Path| fs::metadata(p).unwrap().permissions().mode();
        let plain = dir.path().join("plain");
        fs::write(&plain, b"").unwrap();
        assert_eq!(rights(&real), rights(&plain));
    }
}
