//! The corners of a board in a picture.

use std::fmt;

use super::grey::Grey;
use super::grid::{Grid, GridCorner};
use super::refine::refine;
use super::ring::{Candidate, offsets as ring_offsets, test};
use super::saddle::find_saddles;
use crate::board::{Board, Corner};

/// Width or height in pixels from which the search begins with a smaller copy. Corners of a large picture are blurred
/// over several pixels, and a smaller copy is faster.
const FULL_PX: usize = 1200;
/// Number of halvings after the first copy that are tried if a picture shows no board.
const EXTRA_HALVINGS: usize = 2;
/// Maximum number of candidates from which a grid is grown.
const SEEDS: usize = 60;
/// Number of saddles that are tested first, for each corner of the board.
const STRONGEST: usize = 4;
/// Smallest part of the board that counts: three rows and columns, and a quarter of its corners.
const MIN_SIDE: usize = 3;
const MIN_SHARE: f64 = 0.25;
/// Smallest part of the corners of a grid that is another board. Glare hides a few corners of a real board.
const WHOLE: f64 = 0.9;
/// Largest way from the rough place of a corner to its sub-pixel place, in pixels of the copy.
const REACH_PX: f32 = 1.5;

/// Ratio of a corner's misfit to the median of the board above which something covers a part of the corner. Noise, blur
/// and the light change it by less than a factor of two over a board.
const MAX_MISFIT: f32 = 3.0;

/// The corners that were found in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The corners, ordered by row, then by column.
    pub corners: Vec<Corner>,
    /// Columns and rows of the part that was found; those of the board if it is whole.
    pub size: [u16; 2],
}

/// The reason why a picture shows no board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotFound {
    /// There is no chessboard.
    Nothing,
    /// There is a chessboard with more corners than the board.
    OtherSize {
        /// Inner corners along the longer and the shorter side that were found.
        found: [u16; 2],
        /// Inner corners of the board.
        board: [u16; 2],
    },
    /// Only a small part of the board is visible.
    SmallPart {
        /// Number of corners.
        corners: usize,
        /// Number of corners of the board.
        of: usize,
    },
}

impl fmt::Display for NotFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => write!(
                f,
                "no chessboard is visible; a board needs squares of at least 8 pixels, and even light without glare"
            ),
            Self::OtherSize { found: [a, b], board: [c, d] } => write!(
                f,
                "the picture shows a chessboard with {a} x {b} inner corners, but the board has {c} x {d}; \
                 check --board"
            ),
            Self::SmallPart { corners, of } => write!(
                f,
                "only {corners} of {of} corners are visible; at least a quarter of the board must be in the picture"
            ),
        }
    }
}

impl std::error::Error for NotFound {}

/// Finds the inner corners of a board, with sub-pixel places.
///
/// A board that the border of the picture cuts is found as well; its numbering then begins at the part that is visible.
/// Columns and rows are numbered such that columns × rows turns from u to v.
///
/// # Errors
/// The picture shows no chessboard, or one with other numbers of corners: see [`NotFound`].
pub fn find_corners(picture: &Grey, board: &Board) -> Result<Found, NotFound> {
    // Copy n is halved n + 1 times.
    let mut copies: Vec<Grey> = Vec::new();
    let mut first = 0;
    while (picture.width().max(picture.height()) >> first) > FULL_PX {
        copies.push(copies.last().unwrap_or(picture).halved());
        first += 1;
    }
    let mut best = Err(NotFound::Nothing);
    // The first copy that is small enough serves for most pictures. Smaller copies help with blur, larger ones with
    // small squares.
    for level in (first..=first + EXTRA_HALVINGS).chain((0..first).rev()) {
        if level > copies.len() {
            copies.push(copies.last().unwrap_or(picture).halved());
        }
        let copy = level.checked_sub(1).and_then(|n| copies.get(n)).unwrap_or(picture);
        match find_in_copy(picture, copy, level, board) {
            Ok(found) if found.corners.len() == board.corners() => return Ok(found),
            Ok(found) => {
                let is_more = |before: &Found| before.corners.len() < found.corners.len();
                if best.as_ref().map_or(true, is_more) {
                    best = Ok(found);
                }
            }
            // A smaller copy may show a part of the other board, which must not count as a part of this one.
            Err(why @ NotFound::OtherSize { .. }) => return Err(why),
            Err(why) if best == Err(NotFound::Nothing) => best = Err(why),
            Err(_) => {}
        }
    }
    best
}

/// Finds the corners in a copy that is halved `level` times, and refines them in the picture.
fn find_in_copy(picture: &Grey, copy: &Grey, level: usize, board: &Board) -> Result<Found, NotFound> {
    let blurred = copy.blurred();
    let (saddles, offsets) = (find_saddles(&blurred), ring_offsets());
    let mut candidates: Vec<Candidate> = Vec::new();
    let mut grid = Grid::default();
    // The corners of a board are among the strongest saddles of most pictures. All others take part only if they are
    // needed.
    let strongest = saddles.len().min(STRONGEST * board.corners());
    for part in [&saddles[..strongest], &saddles[strongest..]] {
        candidates.extend(part.iter().filter_map(|s| test(&blurred, &offsets, s)));
        grid = best_grid(&candidates, board);
        if grid.len() >= board.corners() {
            break;
        }
    }
    let (size, corners) = grid.corners();
    let board_size = [usize::from(board.columns), usize::from(board.rows)];
    let fits = |a: usize, b: usize| a <= board_size[0] && b <= board_size[1];
    let size_px = |size: [usize; 2]| size.map(|n| u16::try_from(n).unwrap_or(u16::MAX));
    if !fits(size[0], size[1]) && !fits(size[1], size[0]) {
        // A grid with gaps has grown into the background of the board.
        if (corners.len() as f64) < WHOLE * (size[0] * size[1]) as f64 {
            return Err(NotFound::Nothing);
        }
        let found = size_px([size[0].max(size[1]), size[0].min(size[1])]);
        return Err(NotFound::OtherSize { found, board: [board.columns, board.rows] });
    }
    if size[0].min(size[1]) < MIN_SIDE {
        return Err(NotFound::Nothing);
    }
    let turned = !fits(size[0], size[1]);
    let scale = (1usize << level) as f32;
    let place = |c: &GridCorner| {
        let start = c.at.map(|x| (x + 0.5) * scale - 0.5);
        let refined = refine(picture, start, c.axes, c.spacing * scale, REACH_PX * scale)?;
        // A quarter turn keeps the sense of rotation: (column, row) → (rows − 1 − row, column).
        let [column, row] = if turned { [size[1] - 1 - c.cell[1], c.cell[0]] } else { c.cell };
        let corner =
            Corner { column: u16::try_from(column).ok()?, row: u16::try_from(row).ok()?, at_px: refined.at_px };
        Some((corner, refined.misfit))
    };
    let mut corners = without_covered(corners.iter().filter_map(place).collect());
    let size = if turned { [size[1], size[0]] } else { size };
    begin_at_the_upper_left(&mut corners, size_px(size));
    corners.sort_unstable_by_key(|c| (c.row, c.column));
    if (corners.len() as f64) < MIN_SHARE * board.corners() as f64 {
        return Err(NotFound::SmallPart { corners: corners.len(), of: board.corners() });
    }
    Ok(Found { corners, size: size_px(size) })
}

/// Returns the corners that look like the others of the board. An object in front of the board or a reflection moves
/// the corners next to its outline.
fn without_covered(corners: Vec<(Corner, Option<f32>)>) -> Vec<Corner> {
    let mut misfits: Vec<f32> = corners.iter().filter_map(|(_, misfit)| *misfit).collect();
    misfits.sort_unstable_by(f32::total_cmp);
    let median = misfits.get(misfits.len() / 2).copied().unwrap_or(0.0);
    // A corner whose second step has failed stays: with much noise that happens on clear boards as well.
    let is_clear = |misfit: Option<f32>| misfit.is_none_or(|m| m <= MAX_MISFIT * median);
    corners.into_iter().filter(|(_, misfit)| is_clear(*misfit)).map(|(corner, _)| corner).collect()
}

/// Turns the numbering by half a turn, if corner (0, 0) is not the one nearer to the upper left of the picture.
fn begin_at_the_upper_left(corners: &mut [Corner], [columns, rows]: [u16; 2]) {
    // The direction from the first to the last corner is that of the sum over all corners about the middle.
    let way: f64 = corners
        .iter()
        .map(|c| {
            let from_middle =
                f64::from(c.column) + f64::from(c.row) - 0.5 * (f64::from(columns) + f64::from(rows) - 2.0);
            from_middle * (c.at_px[0] + c.at_px[1])
        })
        .sum();
    if way < 0.0 {
        for c in corners {
            (c.column, c.row) = (columns - 1 - c.column, rows - 1 - c.row);
        }
    }
}

/// Returns the largest grid, or the first one that is the whole board.
fn best_grid(candidates: &[Candidate], board: &Board) -> Grid {
    let size = [usize::from(board.columns), usize::from(board.rows)];
    let mut best = Grid::default();
    let mut seen = vec![false; candidates.len()];
    let mut seeds = 0;
    for seed in 0..candidates.len() {
        if seen[seed] || seeds == SEEDS {
            continue;
        }
        seeds += 1;
        let mut grid = Grid::grow(candidates, seed);
        grid.candidates().for_each(|n| seen[n] = true);
        grid.trim(size);
        if grid.len() > best.len() {
            best = grid;
        }
        if best.len() >= board.corners() {
            break;
        }
    }
    best
}
