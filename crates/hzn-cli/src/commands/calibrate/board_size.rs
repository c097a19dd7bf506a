//! The argument that tells the size of a chessboard.

use std::str::FromStr;

/// Columns and rows of inner corners.
#[derive(Debug, Clone, Copy)]
pub(super) struct BoardSize(pub(super) [u16; 2]);

impl FromStr for BoardSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides = text.split_once('x').and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]));
        let expected = "COLUMNSxROWS of inner corners is expected, for example 9x6";
        let sides = sides.ok_or_else(|| expected.to_owned())?;
        if sides.iter().all(|n| (3..=100).contains(n)) {
            Ok(Self(sides))
        } else {
            Err(format!("{expected}; each side has 3 to 100"))
        }
    }
}
