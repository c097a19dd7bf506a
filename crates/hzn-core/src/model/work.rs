//! The work budget of a picture. All stages spend from one budget, so that the cost of the worst picture has a bound.
//!
//! The unit is a step of the border follower, about fifty instructions of a Cortex-M7; in the most expensive picture
//! found, a unit costs 81. Most stages pay their largest cost in advance, from the amount of data that they will
//! examine, so that the sum does not depend on the machine. Reads of single pixels and of the mask are counted and paid
//! for after a few of them.

use crate::base::keys::section;

section! {
    /// `[limits]` of sensor.toml: the bound on the time of the worst picture.
    "limits" pub struct Config: Copy {
        /// Work budget for one picture and one body, in steps of the border follower; when it is used up, the best
        /// answer so far counts.
        ///
        /// If there is no answer when the budget is used up, the status is `truncated`. An ordinary picture costs about
        /// 30 thousand steps. A smaller budget shortens the longest calculation; a larger one answers more pictures
        /// with much clutter or large masks. The default is 120 steps for each border pixel that the lists hold, and
        /// 2120 with `erf`.
        @120 max_work: Option<u32> = None, [10000.0 to 1e9]
            { unset: "245 760 on a flight computer, 1 966 080 on the host", example: "1000000" };
    }
}

/// Default budget for each border pixel that the lists hold.
// With the 2048 border pixels of a flight computer this gives 245 760 units. A picture may take 20 million
// instructions, so that a unit may take 81.4. The most expensive unit found takes 81.2: no room is left.
const DEFAULT_PER_PIXEL: u32 = 120;

/// Cost to begin to follow an edge.
pub(crate) const EDGE: u32 = 20;
/// Cost of a single read of a pixel.
pub(crate) const READ: u32 = 1;
/// Cost of a step of the border follower that tests all neighbours. The reads of the mask come on top.
pub(crate) const LOOK_AROUND: u32 = 5;
/// Cost to begin a run of steps that test only the threshold. The distance to the masks comes on top.
// A run of one step takes 353 instructions. When it cost one unit, and reads of the mask cost nothing, stripes of one
// pixel took 63 million instructions within a budget of 20 million.
pub(crate) const RUN: u32 = 4;
/// Returns the cost of a search line from one column to another. A pixel takes few instructions, but the search for a
/// small body has lines on every row.
pub(crate) fn line_cost(from: u16, to: u16) -> u32 {
    // Fifteen pixels of a search line cost one step, because eight bytes are compared at once.
    u32::from(to.saturating_sub(from)) / 15
}
/// Returns the cost to scan the picture's border at every `stride`-th pixel, each with a read of the mask.
pub(crate) fn ring_cost(width: u16, height: u16, stride: u16, mask: u32) -> u32 {
    2 * (u32::from(width) + u32::from(height)) / u32::from(stride.max(1)) * (READ + mask)
}
/// Cost of a further look at a picture, before anything is found.
pub(crate) const LOOK: u32 = 1000;
/// Additional cost of a search line each time that it crosses an edge.
pub(crate) const CROSSING: u32 = 4;
/// Cost to project a place of a predicted limb into the picture.
pub(crate) const PLACE: u32 = 6;
/// Cost of a sub-pixel point with its ray, by the default method. On stripes of one pixel, where every look at the
/// picture is far from the one before and every branch changes, a Cortex-M7 spends 1400 instructions on it.
pub(crate) const POINT: u32 = 19;
/// Additional cost of a point on a wide edge or next to the border: it reads up to 45 pixels.
pub(crate) const SLOW_POINT: u32 = 18;
/// Cost to check these reads against border and image circle, one by one.
// The costs of the checks were chosen on 5120 hostile pictures and tested on 1024 others; before, pictures with masks
// and an image circle took up to 29.6 million instructions.
pub(crate) const CHECKS: u32 = 20;
/// Cost to compare these reads with the bounding box of a polygon.
pub(crate) const BOXES: u32 = 7;
/// Returns the cost to compare these reads with all sides of a polygon.
pub(crate) fn sides_cost(corners: u32) -> u32 {
    7 * corners
}
/// Cost of a draw of the consensus stage, verified on one further point.
pub(crate) const DRAW: u32 = 10;
/// Cost to compare a block of eight points with a drawn cone.
pub(crate) const SCORE: u32 = 4;
/// Cost to compare a block by the likelihood of a mixture, with exponentials and logarithms.
pub(crate) const LIKELIHOOD: u32 = 80;
/// Returns the cost of a pixel's gradient: its eight neighbours are read and tested against the mask.
pub(crate) fn gradient_cost(mask: u32) -> u32 {
    4 + 9 * mask
}
/// Returns the cost to count the lit pixels of a square.
pub(crate) fn square_cost(side: u16, mask: u32) -> u32 {
    u32::from(side) * u32::from(side) * (1 + 2 * mask)
}
/// Cost to sort one pixel among those of its edge.
pub(crate) const ORDER: u32 = 20;
/// Cost of a part of a picture, before anything is found in it.
pub(crate) const PART: u32 = 1000;
/// Cost to fit a block of eight points and to compute its share of the covariance.
// The cost is charged once for all passes of the fit and the covariance, because the number of passes has a limit.
pub(crate) const FIT: u32 = 230;
/// Cost of the gates of a fit.
pub(crate) const GATES: u32 = 1000;

/// The remaining work budget.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WorkBudget {
    total: u32,
    remaining: u32,
    truncated: bool,
}

impl WorkBudget {
    /// Makes the budget for lists that hold `pixels` border pixels, where a sub-pixel point costs `point`.
    pub(crate) fn new(config: &Config, pixels: usize, point: u32) -> Self {
        // The budget grows with the cost of a point, so that a dearer method has room for the same number of edges.
        let a_pixel = DEFAULT_PER_PIXEL - POINT + point;
        let total = config.max_work.unwrap_or(a_pixel.saturating_mul(pixels as u32));
        Self { total, remaining: total, truncated: false }
    }

    /// Makes an unlimited budget, for stages that run on their own.
    #[cfg(any(test, feature = "_edges"))]
    pub(crate) fn unlimited() -> Self {
        Self { total: u32::MAX, remaining: u32::MAX, truncated: false }
    }

    /// Spends `cost` if the budget allows it and returns true. Otherwise nothing is left from then on.
    #[inline]
    pub(crate) fn try_spend(&mut self, cost: u32) -> bool {
        let rest = self.remaining.checked_sub(cost);
        // The rest is given up together with the refusal, so that no cheaper work goes on in a picture that counts as
        // truncated.
        self.truncated |= rest.is_none();
        self.remaining = rest.unwrap_or(0);
        rest.is_some()
    }

    /// Gives `follow` a limit to count down for one edge: three quarters of the remaining budget, so that the rest can
    /// pay for the edge's own fit.
    pub(crate) fn limit_edge<R>(&mut self, follow: impl FnOnce(&mut u32) -> R) -> R {
        let mut steps = self.remaining - self.remaining / 4;
        let before = steps;
        let result = follow(&mut steps);
        self.remaining -= before - steps;
        self.truncated |= steps == 0;
        result
    }

    /// Spends `cost` for work that is done already, down to 0.
    pub(crate) fn charge(&mut self, cost: u32) {
        self.truncated |= cost > self.remaining;
        self.remaining = self.remaining.saturating_sub(cost);
    }
    /// Returns whether nothing is left.
    pub(crate) fn is_exhausted(&self) -> bool {
        self.remaining == 0
    }
    /// Ends all work on the picture.
    pub(crate) fn exhaust(&mut self) {
        (self.remaining, self.truncated) = (0, true);
    }
    /// Records that some work was omitted for lack of budget. The remaining budget can still serve other work.
    pub(crate) fn mark_truncated(&mut self) {
        self.truncated = true;
    }
    /// Returns whether some work was omitted for lack of budget.
    pub(crate) fn was_truncated(&self) -> bool {
        self.truncated
    }
    /// Returns the remaining budget.
    pub(crate) fn remaining(&self) -> u32 {
        self.remaining
    }
    /// Returns the budget that is spent.
    pub(crate) fn spent(&self) -> u32 {
        self.total - self.remaining
    }
}
