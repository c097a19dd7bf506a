//! What a picture may cost: one account that every stage draws on, so that the worst picture has a bound.
//!
//! The unit is a step of the border follower, some fifty instructions of a Cortex-M7. Stages pay beforehand what they
//! cost at most, by what they are about to look at, so that the sum does not depend on the machine. The sample for the
//! level is free, and so is the border, but for looks at the mask.

use crate::base::keys::section;

section! {
    /// `[limits]` of sensor.toml: the bound on the time of the worst picture.
    "limits" pub struct Config: Copy {
        /// Largest cost of one picture and body, in steps of the border follower; when it is used up, the best answer
        /// so far counts.
        ///
        /// An ordinary picture costs about 30 thousand. Without an answer the status is `truncated`. The default is 120
        /// for each border pixel that the lists hold, and 2120 with `erf`.
        @120 max_work: Option<u32> = None, [10000.0 to 1e9]
            { unset: "245 760 in flight lists, 1 966 080 in the host's", example: "1000000" };
    }
}

/// Work for each border pixel that the lists hold, where the configuration does not say.
const A_PIXEL: u32 = 120;

/// Beginning to follow an edge.
pub(crate) const EDGE: u32 = 20;
/// A step with a look at everything around, the mask too.
pub(crate) fn look(mask: u32) -> u32 {
    5 + mask * 5 / 2
}
/// A search line from one column to another: few instructions a pixel, but they are many where a small body is looked
/// for, with lines on every row.
pub(crate) fn line(from: u16, to: u16) -> u32 {
    u32::from(to.saturating_sub(from)) / 15
}
/// The picture's border pixel by pixel, beyond the few that are looked at for nothing.
pub(crate) fn ring(width: u16, height: u16) -> u32 {
    (u32::from(width) + u32::from(height)) / 2
}
/// A further look at a picture, before anything is found.
pub(crate) const LOOK: u32 = 1000;
/// What a search line costs more each time that it crosses an edge.
pub(crate) const CROSSING: u32 = 4;
/// A sub-pixel point with its ray, by the default's method.
pub(crate) const POINT: u32 = 16;
/// What such a point costs more where reads are checked one by one: beside a mask or the border, or on a wide edge.
pub(crate) fn slow_point(mask: u32) -> u32 {
    18 + 12 * mask
}
/// A draw of the rejection, verified on one further point.
pub(crate) const DRAW: u32 = 10;
/// A block of eight points compared with a drawn cone.
pub(crate) const SCORE: u32 = 4;
/// Such a block by the likelihood of a mixture, with exponentials and logarithms.
#[cfg(feature = "zju")]
pub(crate) const LIKELIHOOD: u32 = 80;
/// A pixel's gradient: its eight neighbours read, and looked up in the mask.
#[cfg(feature = "zju")]
pub(crate) fn gradient(mask: u32) -> u32 {
    4 + 9 * mask
}
/// The pixels of a square counted.
#[cfg(feature = "horace")]
pub(crate) fn square(side: u16, mask: u32) -> u32 {
    u32::from(side) * u32::from(side) * (1 + 2 * mask)
}
/// A pixel put in order among those of its edge.
#[cfg(any(feature = "horace", feature = "zju"))]
pub(crate) const ORDER: u32 = 20;
/// A part of a picture, before anything is found in it.
#[cfg(feature = "horace")]
pub(crate) const PART: u32 = 1000;
/// A block of eight points fitted, and weighed by its covariance.
pub(crate) const FIT: u32 = 230;
/// The gates of a fit.
pub(crate) const GATES: u32 = 1000;

/// What is left.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WorkBudget {
    all: u32,
    left: u32,
    cut: bool,
}

impl WorkBudget {
    /// For lists that hold so many border pixels, of which a sub-pixel point costs this.
    pub(crate) fn new(config: &Config, pixels: usize, point: u32) -> Self {
        let a_pixel = A_PIXEL - POINT + point;
        let all = config.max_work.unwrap_or(a_pixel.saturating_mul(pixels as u32));
        Self { all, left: all, cut: false }
    }

    /// For stages on their own.
    #[cfg(any(test, feature = "_edges"))]
    pub(crate) fn unlimited() -> Self {
        Self { all: u32::MAX, left: u32::MAX, cut: false }
    }

    /// Pays `cost`, if that much is left; otherwise nothing is left from here on.
    #[inline]
    pub(crate) fn try_spend(&mut self, cost: u32) -> bool {
        let rest = self.left.checked_sub(cost);
        self.cut |= rest.is_none();
        self.left = rest.unwrap_or(0);
        rest.is_some()
    }

    /// Lets `follow` count down what one edge may cost: three quarters of what is left, so that the edge can be tried.
    pub(crate) fn on_edge<R>(&mut self, follow: impl FnOnce(&mut u32) -> R) -> R {
        let mut steps = self.left - self.left / 4;
        let before = steps;
        let result = follow(&mut steps);
        self.left -= before - steps;
        self.cut |= steps == 0;
        result
    }

    /// Pays for what was done already, as far as it goes.
    pub(crate) fn charge(&mut self, cost: u32) {
        self.left = self.left.saturating_sub(cost);
    }
    /// Whether nothing can be done any more.
    pub(crate) fn is_exhausted(&self) -> bool {
        self.left == 0
    }
    /// Nothing more is done.
    pub(crate) fn exhaust(&mut self) {
        (self.left, self.cut) = (0, true);
    }
    /// Something was not done for lack of room; what is left may serve others.
    #[cfg(feature = "horace")]
    pub(crate) fn mark_truncated(&mut self) {
        self.cut = true;
    }
    /// Whether something was not done for lack of it.
    pub(crate) fn was_truncated(&self) -> bool {
        self.cut
    }
    /// What is left.
    pub(crate) fn remaining(&self) -> u32 {
        self.left
    }
    /// What was done.
    pub(crate) fn spent(&self) -> u32 {
        self.all - self.left
    }
}
