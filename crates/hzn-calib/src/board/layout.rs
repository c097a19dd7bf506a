//! A chessboard, and its corners in pictures.

/// A chessboard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Number of inner corners along a row, as OpenCV counts them: one less than the squares.
    pub columns: u16,
    /// Number of inner corners along a column.
    pub rows: u16,
    /// Length of the side of a square, in millimetres.
    pub square_mm: f64,
}

/// An inner corner of a board in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Column on the board, from 0 to [`Board::columns`] − 1.
    pub column: u16,
    /// Row on the board, from 0 to [`Board::rows`] − 1.
    pub row: u16,
    /// Place in the picture: u to the right, v down, in pixels; pixel centres are at integers.
    pub at_px: [f64; 2],
}

/// The corners of a board that one picture shows.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Name of the picture.
    pub name: String,
    /// Corners in any order. A partial board has fewer than [`Board::corners`].
    pub corners: Vec<Corner>,
}

impl Board {
    /// Returns the number of inner corners.
    pub fn corners(&self) -> usize {
        usize::from(self.columns) * usize::from(self.rows)
    }

    /// Returns the place of a corner on the board, in millimetres: x along a row, y along a column. Both are 0 at the
    /// corner (0, 0). The z axis of the board points away from the camera when x points right and y down.
    pub fn place_mm(&self, column: u16, row: u16) -> [f64; 2] {
        [f64::from(column) * self.square_mm, f64::from(row) * self.square_mm]
    }
}

/// A point of a flat target in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarPoint {
    /// Place on the target (x, y), in millimetres. When x points right and y down, the target is seen from the front.
    pub place_mm: [f64; 2],
    /// Place in the picture (u, v), in pixels.
    pub at_px: [f64; 2],
}

/// The points of a flat target that one picture shows.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarView {
    /// Name of the picture.
    pub name: String,
    /// The points.
    pub points: Vec<PlanarPoint>,
}

impl View {
    /// Returns the view with the places of the corners on the board.
    pub fn to_planar(&self, board: &Board) -> PlanarView {
        let point = |c: &Corner| PlanarPoint { place_mm: board.place_mm(c.column, c.row), at_px: c.at_px };
        PlanarView { name: self.name.clone(), points: self.corners.iter().map(point).collect() }
    }
}
