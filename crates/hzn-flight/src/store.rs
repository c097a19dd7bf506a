//! Two copies of the parameters: the newer valid one counts, and only the other one is ever written, so that a power
//! cut in the middle of writing costs the change and nothing else.

use crate::board::Board;
use crate::parameters::Parameters;
use crate::table::{self, TableError};

/// What was found at the start.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// The parameters.
    pub parameters: Parameters,
    /// The copy that they come from, 1 or 2; 0 for the defaults.
    pub copy: u8,
    /// Their generation; 0 for the defaults.
    pub generation: u32,
    /// Why copies 1 and 2 cannot be used.
    pub broken: [Option<TableError>; 2],
}

/// Reads both copies; `buffer` is used to read them.
#[inline(never)]
pub fn load(board: &mut impl Board, buffer: &mut [u8]) -> Loaded {
    let mut out = Loaded { parameters: Parameters::idle(), copy: 0, generation: 0, broken: [None; 2] };
    for (copy, broken) in (1u8..).zip(&mut out.broken) {
        board.read_copy(copy, buffer);
        match table::read(buffer) {
            Ok((parameters, generation)) if out.copy == 0 || generation > out.generation => {
                (out.parameters, out.copy, out.generation) = (parameters, copy, generation);
            }
            Ok(_) => {}
            Err(e) => *broken = Some(e),
        }
    }
    out
}

/// Writes the next generation over the copy that does not count, and reads it back. Gives the copy and the generation.
///
/// # Errors
/// The copy that was not kept.
#[inline(never)]
pub fn save(
    board: &mut impl Board,
    parameters: &Parameters,
    current: u8,
    generation: u32,
    buffer: &mut [u8],
) -> Result<(u8, u32), u8> {
    let copy = if current == 1 { 2 } else { 1 };
    let generation = generation.wrapping_add(1);
    let written = table::write(parameters, generation, buffer)
        .and_then(|n| buffer.get(..n))
        .is_some_and(|bytes| board.write_copy(copy, bytes));
    board.read_copy(copy, buffer);
    if written && table::generation(buffer) == Some(generation) { Ok((copy, generation)) } else { Err(copy) }
}
