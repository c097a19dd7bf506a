//! A window into the pipeline for clocks, counters and pictures; without one, nothing of it is compiled.

use crate::geometry::pixel::{ImagePoint, Pixel};
use crate::model::error_budget::ErrorBudget;
use crate::model::report::{Candidate, Solution};
use crate::model::status::Stage;

/// Called at stage boundaries and on pixel reads. Every method does nothing by default; implement what you need.
/// Methods take `&self`: an observer that collects uses `Cell` or `RefCell`.
pub trait Observer<T> {
    /// The search for body number `which` of several begins, from 0. Not called when there is one.
    fn body(&self, _which: u8) {}
    /// A stage begins; it may begin several times in a picture, once a candidate.
    fn enter(&self, _stage: Stage) {}
    /// The picture is through.
    fn leave(&self) {}
    /// A pixel was read.
    #[inline(always)]
    fn pixel(&self, _x: u16, _y: u16) {}
    /// The level was found: in counts, with the mean and the number of pixels of the sample.
    fn level(&self, _level: u16, _mean: T, _samples: u32) {}
    /// A dark frame of so many pixels lies around the picture, and is left out from here on.
    fn frame(&self, _px: u16) {}
    /// Another look at a picture without an answer begins: its number, 1 for the second look, and its level in counts.
    fn look(&self, _number: u32, _level: u16) {}
    /// An edge was followed and is candidate number `candidate`: every `stride`-th of its border pixels, in order.
    fn edge(&self, _candidate: u32, _border: impl Iterator<Item = Pixel>, _stride: u32) {}
    /// Whether this edge goes on through the stages. Of an observer that always says no every edge is followed, and
    /// there is no answer.
    #[inline(always)]
    fn wants(&self, _candidate: u32) -> bool {
        true
    }
    /// A sub-pixel point of a candidate; they come in order, numbered from 0.
    #[inline(always)]
    fn point(&self, _candidate: u32, _point: ImagePoint<T>) {}
    /// The weight of a candidate's point after the fit: 0 rejected, up to 1. Only when there was a fit.
    #[inline(always)]
    fn weight(&self, _candidate: u32, _point: u32, _weight: T) {}
    /// Whether [`Self::budget`] is to be called: working it out costs something.
    #[inline(always)]
    fn wants_budget(&self) -> bool {
        false
    }
    /// What each source of error adds to the covariance of a candidate's axis, in rad². Only when there was a fit,
    /// before its verdict.
    #[inline(always)]
    fn budget(&self, _candidate: u32, _budget: &ErrorBudget<T>) {}
    /// What became of a candidate, with its solution if there is one.
    fn verdict(&self, _candidate: u32, _outcome: &Candidate<T>, _solution: Option<&Solution<T>>) {}
}

/// Sees nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unobserved;
impl<T> Observer<T> for Unobserved {}
