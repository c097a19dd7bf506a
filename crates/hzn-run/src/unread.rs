//! Why a picture is `unreadable`, in a word.

use hzn_core::body::PriorError;

/// Start of the sentence about a picture that has not the size of the camera.
const OTHER_SIZE: &str = "but the camera is ";
/// What the sentence about a channel names.
const CHANNEL: &str = "(input.channel";

/// Cause of a picture that is `unreadable`. The status is one word for all of them, and each needs another remedy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unread {
    /// The picture has not the size of the camera.
    Size,
    /// The picture does not have the channel of `input.channel`.
    Channel,
    /// A value of frames.csv is impossible.
    Values,
    /// The file cannot be decoded.
    File,
}

impl Unread {
    /// Returns the word on the screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Size => "wrong size",
            Self::Channel => "wrong channel",
            Self::Values => "wrong values",
            Self::File => "broken file",
        }
    }

    /// Returns the cause that the detail of a row tells. The sentences are those of this crate.
    pub fn of_detail(detail: &str) -> Self {
        let values = [
            PriorError::Altitude,
            PriorError::Position,
            PriorError::AttitudeSigma,
            PriorError::Rate,
            PriorError::Temperature,
            PriorError::NoBody,
            PriorError::NotConfigured,
        ];
        if detail.contains(OTHER_SIZE) {
            Self::Size
        } else if detail.contains(CHANNEL) {
            Self::Channel
        } else if values.iter().any(|error| error.to_string() == detail) {
            Self::Values
        } else {
            Self::File
        }
    }
}

/// Says that a picture has not the size of the camera, and what to do.
pub fn other_size([width, height]: [u32; 2], [w, h]: [u32; 2]) -> String {
    let turned = if [h, w] == [width, height] { "; input.orient turns pictures" } else { "" };
    format!("picture is {width}x{height} {OTHER_SIZE}{w}x{h} (camera.width, camera.height in sensor.toml){turned}")
}

/// Says that a picture does not have the channel that sensor.toml names.
pub fn other_channel(why: impl std::fmt::Display) -> String {
    format!("{why} {CHANNEL} in sensor.toml)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cause_has_its_word() {
        let word = |detail: &str| Unread::of_detail(detail).name();
        assert_eq!(word(&other_size([100, 50], [320, 240])), "wrong size");
        assert!(other_size([240, 320], [320, 240]).contains("input.orient"));
        assert_eq!(word(&other_channel("the picture is grey")), "wrong channel");
        assert_eq!(word(&PriorError::Rate.to_string()), "wrong values");
        assert_eq!(word("PNG data end before the picture is complete: the file is truncated"), "broken file");
    }
}
