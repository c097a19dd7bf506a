//! The pictures of a board after the search for its corners: which of them count, and why the others do not.

use std::collections::BTreeMap;
use std::fmt;

use super::layout::{Board, View};
use crate::corners::{Found, Grey, NotFound, find_corners};

/// Smallest number of pictures that must agree on the size of a board that differs from the given one.
const MIN_WITNESSES: usize = 3;

/// A picture after the search.
#[derive(Debug, Clone)]
pub struct Searched {
    /// Name of the picture.
    pub name: String,
    /// Size in pixels and the corners; or the reason why the picture cannot be read.
    pub result: Result<([usize; 2], Result<Found, NotFound>), String>,
}

impl Searched {
    /// Searches a picture for the corners of a board. `grey` is the picture, or the reason why it cannot be read.
    pub fn new(name: String, grey: Result<Grey, String>, board: &Board) -> Self {
        let result = grey.map(|grey| ([grey.width(), grey.height()], find_corners(&grey, board)));
        Self { name, result }
    }
}

/// All pictures after the search.
#[derive(Debug, Clone)]
pub struct Pictures {
    /// Width and height of the pictures, px. Pictures of another size are left out.
    pub size_px: [u16; 2],
    /// One view for each picture, in their order. It has no corners if no board was found.
    pub views: Vec<View>,
    /// The reason for each picture without a board, by the name of the picture.
    pub reasons: BTreeMap<String, String>,
    /// Number of pictures that cannot be read.
    pub unreadable: usize,
    /// Corners along rows and columns of the largest part of the board in a picture, if no picture shows all of it: the
    /// size of the board may be wrong then.
    pub largest_part: Option<[u16; 2]>,
}

/// The reason why no picture can be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoPictures {
    /// No picture can be read; each has a line.
    Unreadable(Vec<String>),
    /// Most pictures have a width or a height, px, that no camera has.
    TooLarge([usize; 2]),
    /// Most pictures show a board of another size.
    OtherBoard {
        /// Number of pictures with this size.
        pictures: usize,
        /// Number of pictures with any board.
        all: usize,
        /// Inner corners along rows and columns of these boards.
        seen: [u16; 2],
        /// Inner corners along rows and columns that were given.
        given: [u16; 2],
    },
    /// No picture shows the board; each has a line.
    NoBoard(Vec<String>),
}

impl NoPictures {
    /// Returns a line for each picture, with the reason.
    pub fn details(&self) -> &[String] {
        match self {
            Self::Unreadable(details) | Self::NoBoard(details) => details,
            _ => &[],
        }
    }
}

impl fmt::Display for NoPictures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable(_) => write!(f, "no picture can be read"),
            Self::TooLarge([w, h]) => write!(f, "pictures of {w}x{h} px are too large; scale them down"),
            Self::OtherBoard { pictures, all, seen, given } => write!(
                f,
                "{pictures} of {all} pictures show a board with {} x {} inner corners, none shows {} x {}",
                seen[0], seen[1], given[0], given[1]
            ),
            Self::NoBoard(_) => write!(f, "no picture shows the board"),
        }
    }
}

impl Pictures {
    /// Sorts the pictures out.
    ///
    /// # Errors
    /// No picture can be used: see [`NoPictures`].
    pub fn new(searched: &[Searched], board: &Board) -> Result<Self, NoPictures> {
        let size = usual_size(searched)?;
        check_board(searched, board)?;
        let side = |px: usize| u16::try_from(px).map_err(|_| NoPictures::TooLarge(size));
        let size_px = [side(size[0])?, side(size[1])?];
        let (mut views, mut reasons, mut unreadable) = (Vec::new(), BTreeMap::new(), 0);
        for Searched { name, result } in searched {
            let mut leave_out = |why: String| {
                reasons.insert(name.clone(), why);
                Vec::new()
            };
            let corners = match result {
                Ok((other, _)) if *other != size => leave_out(format!(
                    "it has {}x{} px, but most pictures have {}x{} px; a scaled or cut picture shows another lens",
                    other[0], other[1], size[0], size[1]
                )),
                // Corners of another exposure differ at least by noise. A copy would count as independent.
                Ok((_, Ok(found))) => match views.iter().find(|view: &&View| view.corners == found.corners) {
                    Some(first) => {
                        leave_out(format!("it has the corners of {} to the last bit: it is a copy", first.name))
                    }
                    None => found.corners.clone(),
                },
                Ok((_, Err(why))) => leave_out(why.to_string()),
                Err(why) => {
                    unreadable += 1;
                    leave_out(format!("cannot be read: {why}"))
                }
            };
            views.push(View { name: name.clone(), corners });
        }
        Ok(Self { size_px, views, reasons, unreadable, largest_part: largest_part(searched, board) })
    }
}

/// Returns the size that most pictures have; of two sizes with equally many pictures, the larger one.
fn usual_size(searched: &[Searched]) -> Result<[usize; 2], NoPictures> {
    let mut sizes: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    for s in searched {
        if let Ok((size, _)) = &s.result {
            *sizes.entry(*size).or_default() += 1;
        }
    }
    let usual = sizes.into_iter().max_by_key(|(_, pictures)| *pictures).map(|(size, _)| size);
    usual.ok_or_else(|| {
        let why = |s: &Searched| format!("  {}: {}", s.name, s.result.as_ref().err().map_or("", String::as_str));
        NoPictures::Unreadable(searched.iter().map(why).collect())
    })
}

/// Refuses pictures that agree on a board of another size, and pictures without any board.
fn check_board(searched: &[Searched], board: &Board) -> Result<(), NoPictures> {
    let given = [board.columns, board.rows];
    let mut seen: BTreeMap<[u16; 2], usize> = BTreeMap::new();
    let (mut boards, mut has_whole, mut reasons) = (0, false, Vec::new());
    for Searched { name, result } in searched {
        let size = match result {
            Ok((_, Ok(found))) => {
                boards += 1;
                has_whole |= found.corners.len() == board.corners();
                found.size
            }
            Ok((_, Err(why))) => {
                reasons.push(format!("  {name}: {why}"));
                match why {
                    NotFound::OtherSize { found, .. } => *found,
                    _ => continue,
                }
            }
            Err(_) => continue,
        };
        *seen.entry(size).or_default() += 1;
    }
    let all: usize = seen.values().sum();
    if let Some((size, pictures)) = seen.iter().max_by_key(|(_, n)| **n)
        && *size != given
        && *pictures >= MIN_WITNESSES
        && 2 * pictures > all
        && !has_whole
    {
        return Err(NoPictures::OtherBoard { pictures: *pictures, all, seen: *size, given });
    }
    if boards == 0 { Err(NoPictures::NoBoard(reasons)) } else { Ok(()) }
}

/// Returns the largest part of the board that a picture shows, if none shows the whole board.
fn largest_part(searched: &[Searched], board: &Board) -> Option<[u16; 2]> {
    let sizes = searched.iter().filter_map(|s| Some(s.result.as_ref().ok()?.1.as_ref().ok()?.size));
    let largest = sizes.max_by_key(|[a, b]| u32::from(*a) * u32::from(*b))?;
    (largest != [board.columns, board.rows]).then_some(largest)
}
