//! Two copies of the parameters. The newer valid copy is in use, and only the other copy is written, unless that is the
//! only valid one. A power cut in the middle of writing therefore loses only the change.

use crate::board::Board;
use crate::parameters::Parameters;
use crate::table::{self, TableError};

/// The parameters that were found at the start.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// The parameters.
    pub parameters: Parameters,
    /// The copy of the parameters, 1 or 2; 0 for the defaults.
    pub copy: u8,
    /// Generation of the parameters; 0 for the defaults.
    pub generation: u32,
    /// Why copies 1 and 2 cannot be used; `None` for a valid copy.
    pub broken: [Option<TableError>; 2],
}

impl Loaded {
    /// Returns a checksum of the parameters; `None` for the defaults.
    pub(crate) fn digest(&self) -> Option<u32> {
        (self.copy != 0).then(|| table::digest(&self.parameters))
    }

    /// Returns why copies 1 and 2 cannot be used, as in [`crate::messages::Event::CopyBroken`]; 0 for a valid copy.
    pub fn broken_codes(&self) -> [u32; 2] {
        self.broken.each_ref().map(|broken| match broken {
            None => 0,
            Some(TableError::Header) => 1,
            Some(TableError::Checksum) => 2,
            Some(TableError::Refused(_)) => 3,
        })
    }
}

/// Which of two valid copies is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// The newer one.
    Newer,
    /// The older one, because the computer does not run with the newer one.
    Older,
    /// This one, 1 or 2. If it is not valid, the other one: its parameters were made for this computer, too, unlike the
    /// defaults. Any other number means the newer one.
    Copy(u8),
}

/// Reads both copies by way of `buffer` and returns the chosen one of those that are valid.
// Not inlined, because the parameters that it reads would otherwise stay on the stack of its caller.
#[inline(never)]
pub fn load(board: &mut impl Board, buffer: &mut [u8], choice: Choice) -> Loaded {
    let mut out = Loaded { parameters: Parameters::defaults(), copy: 0, generation: 0, broken: [None; 2] };
    for (copy, broken) in (1u8..).zip(&mut out.broken) {
        // Both copies pass through one buffer, because a second one would take 4 KB of RAM.
        board.read_copy(copy, buffer);
        match table::read(buffer) {
            Ok((parameters, generation)) => {
                let is_chosen = match choice {
                    Choice::Copy(chosen @ 1..=2) => out.copy == 0 || copy == chosen,
                    Choice::Newer | Choice::Copy(_) => out.copy == 0 || generation > out.generation,
                    Choice::Older => out.copy == 0 || generation < out.generation,
                };
                if is_chosen {
                    (out.parameters, out.copy, out.generation) = (parameters, copy, generation);
                }
            }
            Err(e) => *broken = Some(e),
        }
    }
    out
}

/// Writes the next generation over a copy, and reads it back. Returns the copy and the generation. The other copy
/// stays: the one in use, or the only valid one.
///
/// # Errors
/// Returns the copy that the memory did not keep.
#[inline(never)]
pub fn save(
    board: &mut impl Board,
    parameters: &Parameters,
    current: u8,
    generation: u32,
    buffer: &mut [u8],
) -> Result<(u8, u32), u8> {
    // The copy that stays is not touched, so that a power cut at any byte leaves it whole. The copy in use may have
    // been damaged since the start; writing the other one would then put the only parameters at risk.
    let (first, second) = if current == 1 { (1, 2) } else { (2, 1) };
    let (staying, copy) = match (generation_of(board, first, buffer), generation_of(board, second, buffer)) {
        (None, Some(kept)) => (Some(kept), first),
        (kept, _) => (kept, second),
    };
    // Above that of the copy that stays, so that the new copy is the newer one. Wrapping, because no flash lives
    // through 2^32 writes.
    let generation = staying.map_or(generation, |kept| kept.max(generation)).wrapping_add(1);
    let written = table::write(parameters, generation, buffer)
        .and_then(|n| buffer.get(..n))
        .is_some_and(|bytes| board.write_copy(copy, bytes));
    // It is read back, because a memory may report success and keep other bytes.
    if written && generation_of(board, copy, buffer) == Some(generation) { Ok((copy, generation)) } else { Err(copy) }
}

/// Reads the generation of a copy by way of `buffer`; `None` if the copy is not whole.
fn generation_of(board: &mut impl Board, copy: u8, buffer: &mut [u8]) -> Option<u32> {
    board.read_copy(copy, buffer);
    table::generation(buffer)
}
