//! Searches pictures for the corners of a board.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use hzn_calib::board::{Board, View};
use hzn_calib::corners::{Found, Grey, NotFound, find_corners};
use hzn_core::image::Channel;
use hzn_run::source::{Item, Payload, Source};
use rayon::prelude::*;

use super::lens_text::Reasons;
use crate::commands::run::cores;
use crate::exit::{Stop, failed, usage};
use crate::progress::Progress;

/// Number of pictures that a thread searches between two looks at the interruption.
const PICTURES_A_THREAD: usize = 4;
/// Smallest number of pictures that must agree on the size of a board that differs from the given one.
const MIN_WITNESSES: usize = 3;

/// A picture after the search.
struct Searched {
    name: String,
    /// Size in pixels and the corners; or the reason why the picture cannot be read.
    result: Result<([usize; 2], Result<Found, NotFound>), String>,
}

/// All pictures after the search.
pub(super) struct Pictures {
    /// Width and height of the pictures, px. Pictures of another size are left out.
    pub(super) size_px: [u16; 2],
    /// One view for each picture, in the order of the source. It has no corners if no board was found.
    pub(super) views: Vec<View>,
    /// The reason for each picture without a board.
    pub(super) reasons: Reasons,
    /// Number of pictures that cannot be read.
    pub(super) unreadable: usize,
    /// Doubts about all pictures together.
    pub(super) notes: Vec<String>,
}

/// Searches all pictures of a source; `None` if the user has interrupted.
///
/// # Errors
/// The source fails, most pictures are too large, no picture shows the board, or the board has another size.
pub(super) fn search(
    source: &mut dyn Source,
    board: &Board,
    jobs: Option<u16>,
    stop: &AtomicBool,
    quiet: bool,
) -> Result<Option<Pictures>, Stop> {
    let threads = jobs.map_or_else(cores, usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(failed)?;
    let mut progress = Progress::new(source.total(), 0, quiet);
    let mut searched: Vec<Searched> = Vec::new();
    loop {
        // A video hands out decoded pictures, so that not all of them are in memory at once.
        let mut batch: Vec<Item> = Vec::new();
        while batch.len() < PICTURES_A_THREAD * threads
            && let Some(item) = source.next()
        {
            batch.push(item?);
        }
        if batch.is_empty() {
            break;
        }
        let each = |item: Item| search_one(item.name, item.payload, board);
        let found: Vec<Searched> = pool.install(|| batch.into_par_iter().map(each).collect());
        found.iter().for_each(|_| progress.count([]));
        searched.extend(found);
        if stop.load(Ordering::Relaxed) {
            progress.finish();
            return Ok(None);
        }
    }
    progress.finish();
    sort_out(&searched, board).map(Some)
}

fn search_one(name: String, payload: Payload, board: &Board) -> Searched {
    let grey = || {
        let (picture, _) = payload.decode(None)?;
        let view = picture.view(Channel::Mean).map_err(|e| e.to_string())?;
        Ok::<Grey, String>(Grey::from_pixels(&view))
    };
    let result = grey().map(|grey| ([grey.width(), grey.height()], find_corners(&grey, board)));
    Searched { name, result }
}

fn sort_out(searched: &[Searched], board: &Board) -> Result<Pictures, Stop> {
    let size = usual_size(searched)?;
    check_board(searched, board)?;
    let too_large = |_| usage(format!("pictures of {}x{} px are too large; scale them down", size[0], size[1]));
    let size_px = [u16::try_from(size[0]).map_err(too_large)?, u16::try_from(size[1]).map_err(too_large)?];
    let (mut views, mut reasons, mut unreadable) = (Vec::new(), Reasons::new(), 0);
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
                Some(first) => leave_out(format!("it has the corners of {} to the last bit: it is a copy", first.name)),
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
    Ok(Pictures { size_px, views, reasons, unreadable, notes: note_of_parts(searched, board).into_iter().collect() })
}

/// Returns the size that most pictures have; of two sizes with equally many pictures, the larger one.
fn usual_size(searched: &[Searched]) -> Result<[usize; 2], Stop> {
    let mut sizes: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    for s in searched {
        if let Ok((size, _)) = &s.result {
            *sizes.entry(*size).or_default() += 1;
        }
    }
    let usual = sizes.into_iter().max_by_key(|(_, pictures)| *pictures).map(|(size, _)| size);
    usual.ok_or_else(|| {
        let why = |s: &Searched| format!("  {}: {}", s.name, s.result.as_ref().err().map_or("", String::as_str));
        failed("no picture can be read:").with_details(searched.iter().map(why))
    })
}

/// Refuses pictures that agree on a board of another size, and pictures without any board.
fn check_board(searched: &[Searched], board: &Board) -> Result<(), Stop> {
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
    if let Some(([a, b], pictures)) = seen.iter().max_by_key(|(_, n)| **n)
        && [*a, *b] != given
        && *pictures >= MIN_WITNESSES
        && 2 * pictures > all
        && !has_whole
    {
        return Err(usage(format!(
            "{pictures} of {all} pictures show a board with {a} x {b} inner corners, none shows {} x {}; give \
             --board {a}x{b}, or pictures of the right board",
            given[0], given[1]
        )));
    }
    if boards == 0 {
        return Err(failed("no picture shows the board; no camera is written:").with_details(reasons));
    }
    Ok(())
}

/// Returns a note if no picture shows the whole board: its size may be wrong then.
fn note_of_parts(searched: &[Searched], board: &Board) -> Option<String> {
    let sizes = searched.iter().filter_map(|s| Some(s.result.as_ref().ok()?.1.as_ref().ok()?.size));
    let largest = sizes.max_by_key(|[a, b]| u32::from(*a) * u32::from(*b))?;
    let given = [board.columns, board.rows];
    (largest != given).then(|| {
        format!(
            "no picture shows the whole board of {} x {} inner corners; the largest part has {} x {}; check --board",
            given[0], given[1], largest[0], largest[1]
        )
    })
}
