//! What the message of a picture says besides the picture.

use crate::frame::EncodedImage;

/// The header of a message.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Header {
    /// Seconds and nanoseconds, if the message has a time that counts.
    pub(crate) time: Option<(i32, u32)>,
    /// Name of the frame; empty without one.
    pub(crate) frame_id: String,
}

impl Header {
    /// Returns the stamp; `None` for one of 0, by which ROS says that nobody filled it in.
    pub(crate) fn stamp(&self) -> Option<(i32, u32)> {
        self.time.filter(|time| *time != (0, 0))
    }
}

/// A decoded message of a picture. The header can be read even where the picture cannot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Decoded {
    /// The picture; or the reason why it cannot be decoded.
    pub(crate) image: Result<EncodedImage, String>,
    /// The header; `None` if it cannot be read either.
    pub(crate) header: Option<Header>,
}

impl Decoded {
    /// Creates a message that has no readable header.
    pub(crate) fn without_header(why: impl Into<String>) -> Self {
        Self { image: Err(why.into()), header: None }
    }
}
