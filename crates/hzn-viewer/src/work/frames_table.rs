//! frames.csv of a folder that grows: another program may add rows to it.

use std::path::PathBuf;
use std::time::SystemTime;

use hzn_files::Frames;

/// The table as it was read last.
pub(super) struct FramesTable {
    path: PathBuf,
    changed: Option<SystemTime>,
    pub(super) frames: Option<Frames>,
}

impl FramesTable {
    /// Takes the table that was read from `path`, if there is one.
    pub(super) fn new(path: PathBuf, frames: Option<Frames>) -> Self {
        // A change between reading and this moment is found with the next change.
        Self { changed: frames.as_ref().and_then(|_| modified(&path)), path, frames }
    }

    /// Reads the table again if it was changed. One that is being written and cannot be read is tried again later.
    pub(super) fn renew(&mut self) {
        let changed = modified(&self.path);
        if changed.is_some()
            && changed != self.changed
            && let Ok(frames) = hzn_files::frames::load(&self.path)
        {
            (self.changed, self.frames) = (changed, Some(frames));
        }
    }
}

fn modified(path: &PathBuf) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|data| data.modified()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_are_added_are_found() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("frames.csv");
        let mut table = FramesTable::new(path.clone(), None);
        table.renew();
        assert!(table.frames.is_none());
        let write = |text: &str, s: u64| {
            std::fs::write(&path, text).unwrap();
            let file = std::fs::File::options().write(true).open(&path).unwrap();
            file.set_modified(SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(s)).unwrap();
        };
        write("file,altitude_km\na.png,230\n", 1);
        table.renew();
        write("file,altitude_km\na.png,230\nb.png,2", 1);
        table.renew();
        assert!(table.frames.as_ref().unwrap().get("b.png").is_none(), "it was not changed since");
        write("file,altitude_km\na.png,230\nb.png,231\n", 2);
        table.renew();
        assert_eq!(table.frames.unwrap().get("b.png").unwrap().altitude_km, Some(231.0));
    }
}
