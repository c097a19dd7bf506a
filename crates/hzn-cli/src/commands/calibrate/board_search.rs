//! Searches pictures for the corners of a board.

use std::sync::atomic::{AtomicBool, Ordering};

use hzn_calib::board::{Board, NoPictures, Pictures, Searched};
use hzn_calib::corners::Grey;
use hzn_core::image::Channel;
use hzn_run::source::{Item, Payload, Source};
use rayon::prelude::*;

use crate::commands::run::cores;
use crate::exit::{Stop, failed, usage};
use crate::progress::Progress;

/// Number of pictures that a thread searches between two looks at the interruption.
const PICTURES_A_THREAD: usize = 4;
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
    Pictures::new(&searched, board).map(Some).map_err(|why| refused(&why))
}

fn search_one(name: String, payload: Payload, board: &Board) -> Searched {
    let grey = || {
        let (picture, _) = payload.decode(None)?;
        let view = picture.view(Channel::Mean).map_err(|e| e.to_string())?;
        Ok::<Grey, String>(Grey::from_pixels(&view))
    };
    Searched::new(name, grey(), board)
}

/// Returns the reason as an error of the command, with the option that is wrong.
fn refused(why: &NoPictures) -> Stop {
    match why {
        NoPictures::OtherBoard { seen: [a, b], .. } => {
            usage(format!("{why}; give --board {a}x{b}, or pictures of the right board"))
        }
        NoPictures::TooLarge(_) => usage(why),
        NoPictures::NoBoard(details) => {
            failed(format!("{why}; no camera is written:")).with_details(details.iter().cloned())
        }
        NoPictures::Unreadable(details) => failed(format!("{why}:")).with_details(details.iter().cloned()),
    }
}

/// Returns a note if no picture shows the whole board: its size may be wrong then.
pub(super) fn note_of_parts(pictures: &Pictures, board: &Board) -> Option<String> {
    let largest = pictures.largest_part?;
    Some(format!(
        "no picture shows the whole board of {} x {} inner corners; the largest part has {} x {}; check --board",
        board.columns, board.rows, largest[0], largest[1]
    ))
}
