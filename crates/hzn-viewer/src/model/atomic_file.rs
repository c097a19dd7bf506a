//! Writing of files, completely or not at all.

use std::path::{Path, PathBuf};

/// Lets `write` fill a temporary file next to `path` and then renames it to `path`. If this fails, the temporary file
/// is removed and an earlier file at `path` stays as it was. The temporary file has the same ending, because some
/// programs choose a format by it.
///
/// # Errors
/// An error of `write` is returned. If the renaming fails, the message says why and what to do.
pub fn replace<E: From<String>>(path: &Path, write: impl FnOnce(&Path) -> Result<(), E>) -> Result<(), E> {
    // The renaming would replace a symbolic link; the user means the file that it leads to.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let path = target.as_path();
    let part = part(path);
    let publish =
        || std::fs::OpenOptions::new().write(true).open(&part).and_then(|file| hzn_mcap::publish(&file, &part, path));
    let written = write(&part).and_then(|()| publish().map_err(|e| E::from(hzn_run::disk::advice(path, &e))));
    if written.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    written
}

/// Writes `bytes` to `path` in the same way as [`replace`].
///
/// # Errors
/// The file cannot be written; the message says why and what to do.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    replace(path, |part| std::fs::write(part, bytes).map_err(|e| hzn_run::disk::advice(path, &e)))
}

/// Returns `NAME.part.ENDING`.
fn part(path: &Path) -> PathBuf {
    match path.extension() {
        Some(ending) => path.with_extension(format!("part.{}", ending.to_string_lossy())),
        None => path.with_extension("part"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fails_leaves_what_was() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        write(&path, b"first").unwrap();
        let half = |part: &Path| {
            std::fs::write(part, b"ha").unwrap();
            Err("the pen broke".to_owned())
        };
        assert_eq!(replace(&path, half).unwrap_err(), "the pen broke");
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        write(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
        let nowhere = write(&dir.path().join("no").join("a.png"), b"").unwrap_err();
        assert!(nowhere.contains("the folder does not exist"), "{nowhere}");
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_stays_a_link() {
        let (dir, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let (link, file) = (dir.path().join("sensor.toml"), other.path().join("shared.toml"));
        std::fs::write(&file, b"first").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write(&link, b"second").unwrap();
        assert!(link.is_symlink());
        assert_eq!(
            (std::fs::read(&file).unwrap(), std::fs::read(&link).unwrap()),
            (b"second".into(), b"second".into())
        );
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_full_disk_is_said() {
        let dir = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink("/dev/full", dir.path().join("a.part.png")).unwrap();
        let full = write(&dir.path().join("a.png"), b"picture").unwrap_err();
        assert!(full.contains("a.png: the disk is full: free some space"), "{full}");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    }
}
