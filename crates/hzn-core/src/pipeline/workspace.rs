//! The lists that a picture needs, in memory of fixed size.

use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::geometry::pixel::Pixel;

/// Largest number of border pixels of one edge that a workstation stores.
pub(super) const HOST_POINTS: usize = 16384;
/// Number of 32-bit words in which a workstation marks search lines.
pub(super) const HOST_WORDS: usize = 65536;

/// The lists of a workstation.
pub type HostWorkspace = Workspace<f64, HOST_POINTS, 2048, HOST_WORDS>;
/// The lists of a flight computer.
pub type FlightWorkspace = Workspace<f32, 2048, 256, 512>;
/// All lists that a picture needs, without a heap. No content is kept from one picture to the next.
///
/// `POINTS` border pixels of an edge are stored; for a longer edge the stride doubles. `BLOCKS` blocks of eight edge
/// points are fitted. Search lines are marked in `WORDS` words of 32 bits; the contour method `raster` marks every
/// pixel in them. See [`HostWorkspace`] and [`FlightWorkspace`].
///
/// A workspace is large. A new one is all zeros: as a `static` it takes no room in flash and never passes over the
/// stack.
#[derive(Debug, Clone)]
pub struct Workspace<T, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> {
    border: [Pixel; POINTS],
    blocks: [Block<T>; BLOCKS],
    marks: [u32; WORDS],
}

/// The lists of a workspace without their lengths in the type, so that the stages are compiled only once.
pub(super) struct Lists<'a, T> {
    pub(super) border: &'a mut [Pixel],
    pub(super) blocks: &'a mut [Block<T>],
    pub(super) marks: &'a mut [u32],
}

impl<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> Workspace<T, POINTS, BLOCKS, WORDS> {
    /// Makes empty lists.
    // The function is `const`, so that a static is filled at compile time. A value that was moved into a static passed
    // over the stack first, which ended in a hard fault on a board with 192 KiB of RAM.
    pub const fn new() -> Self {
        Self { border: [Pixel { x: 0, y: 0 }; POINTS], blocks: [Block::EMPTY; BLOCKS], marks: [0; WORDS] }
    }
    pub(super) fn lists(&mut self) -> Lists<'_, T> {
        Lists { border: &mut self.border, blocks: &mut self.blocks, marks: &mut self.marks }
    }
}

impl<T> Lists<'_, T> {
    /// Borrows the same lists for one of several looks.
    // A look needs the lists for itself, and the next look needs them again.
    pub(super) fn reborrow(&mut self) -> Lists<'_, T> {
        Lists { border: self.border, blocks: self.blocks, marks: self.marks }
    }
}

impl<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> Default
    for Workspace<T, POINTS, BLOCKS, WORDS>
{
    fn default() -> Self {
        Self::new()
    }
}
