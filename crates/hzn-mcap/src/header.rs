//! What the message of a picture says besides the picture.

use crate::frame::EncodedImage;

/// The header of a picture's message.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Header {
    /// Seconds and nanoseconds, if the message has a time that counts.
    pub(crate) time: Option<(i32, u32)>,
    /// Name of the frame; empty without one.
    pub(crate) frame_id: String,
}

/// A decoded picture with its header; or the reason why it cannot be decoded.
pub(crate) type Decoded = Result<(EncodedImage, Header), String>;
