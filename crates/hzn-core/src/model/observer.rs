//! The interface of a program that watches the pipeline, for clocks, counters and overlays. Without an observer, the
//! calls are compiled away.

use crate::geometry::pixel::ImagePoint;
use crate::model::body::Expected;
pub use crate::model::border::Border;
use crate::model::error_budget::ErrorBudget;
use crate::model::evidence::Evidence;
use crate::model::report::{Candidate, Solution};
use crate::model::status::Stage;

/// Receives calls at stage boundaries and on pixel reads. Every method does nothing by default; implement the ones that
/// you need. Methods take `&self`: an observer that collects data uses `Cell` or `RefCell`.
///
/// Each type of observer compiles the pipeline once more. A program with several of them on a workstation passes
/// `&dyn Observer`, which is an observer, too: it compiles the pipeline once, and each call costs a jump.
///
/// # Example
///
/// ```
/// use std::cell::Cell;
///
/// use hzn_core::observer::Observer;
/// use hzn_core::status::Stage;
/// # use hzn_core::camera::{self, Model};
/// # use hzn_core::image::{Grey, Layout};
/// # use hzn_core::{Config, FlightHorizon, Prior};
/// # let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
/// # config.body.altitude_km = Some(230.0);
/// # let data: Vec<u8> = (0..64 * 48).map(|i| if i / 64 < 20 { 5 } else { 200 }).collect();
/// # let picture = Grey::try_new(&data, Layout::packed(64, 48, 1, 8))?;
/// # let mut horizon = FlightHorizon::boxed(&config)?;
/// # let expected = horizon.expect(&Prior::default())?;
///
/// /// Counts the pixels that are read.
/// #[derive(Default)]
/// struct Reads(Cell<u32>);
///
/// impl<T> Observer<T> for Reads {
///     fn pixel(&self, _x: u16, _y: u16) {
///         self.0.set(self.0.get() + 1);
///     }
/// }
///
/// let reads = Reads::default();
/// horizon.process_observed(&picture, &expected, &reads);
/// assert!(reads.0.get() > 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
// The methods are called from loops over pixels; as a type parameter an observer that does nothing leaves no
// instruction there, which a list of callbacks would.
pub trait Observer<T> {
    /// The search for body number `which`, from 0, begins. This is not called when there is only one body.
    fn body(&self, _which: u8) {}
    /// A stage begins. It may begin several times in a picture, once for each candidate.
    fn enter(&self, _stage: Stage) {}
    /// The pipeline has finished the picture.
    fn leave(&self) {}
    /// A pixel was read.
    #[inline(always)]
    fn pixel(&self, _x: u16, _y: u16) {}
    /// The threshold is found. The arguments are the threshold in counts, the mean of the sample in counts, and its
    /// number of pixels.
    fn level(&self, _level: u16, _mean: T, _samples: u32) {}
    /// A dark frame of `px` pixels lies around the picture and does not count from now on.
    fn dark_frame(&self, _px: u16) {}
    /// The limb was not found where the last answer puts it, or not without a doubt: the whole picture is searched, and
    /// everything that was shown of this picture before is void.
    fn begin_again(&self) {}
    /// A further look at a picture without an answer begins: its number (1 for the second look) and its threshold in
    /// counts.
    fn look(&self, _number: u32, _level: u16) {}
    /// An edge is followed and becomes candidate number `candidate`.
    fn edge(&self, _candidate: u32, _border: Border<'_>) {}
    /// Returns whether this edge goes on through the stages. If an observer always returns false, every edge is
    /// followed and there is no answer.
    #[inline(always)]
    fn wants(&self, _candidate: u32) -> bool {
        true
    }
    /// A sub-pixel point of a candidate is found. The points come in order, numbered from 0.
    #[inline(always)]
    fn point(&self, _candidate: u32, _point: ImagePoint<T>) {}
    /// All points of a candidate are found: their number, and the number of those whose lit side is clipped at full
    /// scale.
    #[inline(always)]
    fn points(&self, _candidate: u32, _count: u32, _clipped: u32) {}
    /// The weight of a candidate's point after the fit is known: 0 (rejected) up to 1. This is called only after a fit.
    #[inline(always)]
    fn weight(&self, _candidate: u32, _point: u32, _weight: T) {}
    /// Returns whether the pipeline calls [`Self::budget`]. The default is false, because the error budget takes time
    /// to compute.
    #[inline(always)]
    fn wants_budget(&self) -> bool {
        false
    }
    /// The error budget of a candidate is computed: the covariance of its axis by source of error, in rad². This is
    /// called only after a fit, before the verdict.
    #[inline(always)]
    fn budget(&self, _candidate: u32, _budget: &ErrorBudget<T>) {}
    /// Returns whether the pipeline calls [`Self::fit`]. The default is false: without an observer, only an answer is
    /// written as a solution.
    #[inline(always)]
    fn wants_fit(&self) -> bool {
        false
    }
    /// A candidate is fitted. The call receives the solution that the candidate becomes if it passes every gate, and
    /// the cone that is expected. It comes before the gates, so a candidate that a gate refuses has a fit, too.
    #[inline(always)]
    fn fit(&self, _candidate: u32, _fit: &Solution<T>, _expected: &Expected<T>) {}
    /// The evidence that a candidate is the limb is weighed. Only candidates that pass all gates before have evidence.
    #[inline(always)]
    fn evidence(&self, _candidate: u32, _evidence: &Evidence<T>) {}
    /// A candidate has its verdict, and a solution if there is one.
    fn verdict(&self, _candidate: u32, _outcome: &Candidate<T>, _solution: Option<&Solution<T>>) {}
}

/// The observer that does nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unobserved;
impl<T> Observer<T> for Unobserved {}

impl<T> Observer<T> for &dyn Observer<T> {
    fn body(&self, which: u8) {
        (**self).body(which);
    }
    fn enter(&self, stage: Stage) {
        (**self).enter(stage);
    }
    fn leave(&self) {
        (**self).leave();
    }
    fn pixel(&self, x: u16, y: u16) {
        (**self).pixel(x, y);
    }
    fn level(&self, level: u16, mean: T, samples: u32) {
        (**self).level(level, mean, samples);
    }
    fn dark_frame(&self, px: u16) {
        (**self).dark_frame(px);
    }
    fn begin_again(&self) {
        (**self).begin_again();
    }
    fn look(&self, number: u32, level: u16) {
        (**self).look(number, level);
    }
    fn edge(&self, candidate: u32, border: Border<'_>) {
        (**self).edge(candidate, border);
    }
    fn wants(&self, candidate: u32) -> bool {
        (**self).wants(candidate)
    }
    fn point(&self, candidate: u32, point: ImagePoint<T>) {
        (**self).point(candidate, point);
    }
    fn points(&self, candidate: u32, count: u32, clipped: u32) {
        (**self).points(candidate, count, clipped);
    }
    fn weight(&self, candidate: u32, point: u32, weight: T) {
        (**self).weight(candidate, point, weight);
    }
    fn wants_budget(&self) -> bool {
        (**self).wants_budget()
    }
    fn budget(&self, candidate: u32, budget: &ErrorBudget<T>) {
        (**self).budget(candidate, budget);
    }
    fn wants_fit(&self) -> bool {
        (**self).wants_fit()
    }
    fn fit(&self, candidate: u32, fit: &Solution<T>, expected: &Expected<T>) {
        (**self).fit(candidate, fit, expected);
    }
    fn evidence(&self, candidate: u32, evidence: &Evidence<T>) {
        (**self).evidence(candidate, evidence);
    }
    fn verdict(&self, candidate: u32, outcome: &Candidate<T>, solution: Option<&Solution<T>>) {
        (**self).verdict(candidate, outcome, solution);
    }
}
