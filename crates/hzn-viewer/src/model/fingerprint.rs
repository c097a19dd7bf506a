//! A short value that tells whether a file still has the content that was read.

use std::hash::{DefaultHasher, Hasher};

use serde::{Deserialize, Serialize};

/// Hash of the content of a file. Another release of Rust may compute another value for the same content; a session
/// that was autosaved before then asks once more than necessary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint(u64);

impl Fingerprint {
    /// Returns the fingerprint of a content.
    pub fn of(content: impl AsRef<[u8]>) -> Self {
        let mut hasher = DefaultHasher::new();
        hasher.write(content.as_ref());
        Self(hasher.finish())
    }
}
