//! What tells a picture from another one that was put in its place, without decoding it.

use std::fs::Metadata;
use std::path::Path;
use std::time::SystemTime;

use sha2::{Digest, Sha256};

use super::payload::Payload;

impl Payload {
    /// Returns what tells the picture from another one in its place: the size and the time of its file, or else a
    /// checksum of its bytes. `None` if neither is known. It is never 0.
    pub(crate) fn identity(&self) -> Option<u64> {
        match self {
            Self::File(path) | Self::RawFile(path, _) => {
                let data = std::fs::metadata(path).ok()?;
                let since = changed(&data)?.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
                Some(digest([data.len(), since.as_secs(), u64::from(since.subsec_nanos())]))
            }
            Self::Encoded(bytes) => Some(digest([bytes.len() as u64, u64::from(crc32fast::hash(bytes))])),
            Self::Decoded(picture) => Some(digest([u64::from(picture.checksum())])),
            Self::Broken(_) => None,
        }
    }

    /// Returns the file of a picture that has a file of its own.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::File(path) | Self::RawFile(path, _) => Some(path),
            Self::Encoded(_) | Self::Decoded(_) | Self::Broken(_) => None,
        }
    }
}

/// Returns a digest of numbers. It is never 0, which stands for what is not known.
pub(crate) fn digest(numbers: impl IntoIterator<Item = u64>) -> u64 {
    let mut hasher = Sha256::new();
    numbers.into_iter().for_each(|number| hasher.update(number.to_le_bytes()));
    let first = hasher.finalize().first_chunk().copied().map_or(0, u64::from_le_bytes);
    first.max(1)
}

/// Returns when a file got its contents or its place. A copy may keep the time of the original's contents, but not that
/// of its entry, which a file system without such a time does not have.
pub(crate) fn changed(data: &Metadata) -> Option<SystemTime> {
    let modified = data.modified().ok()?;
    #[cfg(unix)]
    let entered = {
        use std::os::unix::fs::MetadataExt;
        use std::time::Duration;
        let whole = u64::try_from(data.ctime()).ok().map(Duration::from_secs);
        let part = u64::try_from(data.ctime_nsec()).ok().map(Duration::from_nanos);
        whole.zip(part).map(|(whole, part)| SystemTime::UNIX_EPOCH + whole + part)
    };
    #[cfg(not(unix))]
    let entered = None;
    Some(entered.map_or(modified, |entered: SystemTime| entered.max(modified)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_picture_has_another_identity() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        let file = || Payload::File(path.clone()).identity();
        assert_eq!(file(), None);
        std::fs::write(&path, "first").unwrap();
        let first = file();
        assert!(first.is_some() && file() == first);
        let later = SystemTime::now() + std::time::Duration::from_secs(10);
        std::fs::File::options().write(true).open(&path).unwrap().set_modified(later).unwrap();
        let touched = file();
        assert!(touched.is_some() && touched != first);
        std::fs::write(&path, "longer").unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_modified(later).unwrap();
        assert!(file().is_some() && file() != touched, "the size counts, too");
        let encoded = |bytes: &[u8]| Payload::Encoded(bytes.to_vec()).identity();
        assert!(encoded(b"a").is_some() && encoded(b"a") == encoded(b"a") && encoded(b"a") != encoded(b"b"));
        assert_eq!(Payload::Broken("lost".into()).identity(), None);
    }
}
