//! When the attitude of the filter is not known any more: after samples that were missing or saturated, and when what
//! is measured is refused again and again.

use hzn_nav::filter::{Filter, Step};
use hzn_nav::frames::Covariance;
use hzn_nav::layout::Layout;

/// 1-sigma of the attitude above which directions are not taken one by one, rad (15°).
const LARGE_RAD: f64 = 0.26;
/// 1-sigma about each axis of an attitude of which nothing is known, rad: π/√3.
const UNKNOWN_RAD: f64 = 1.8;
/// Fewest measurements of a kind in a row whose refusal shows that the attitude is lost.
const FEWEST_REFUSED: usize = 5;

/// Whether samples were missing or saturated for so long that the attitude is unknown until it is measured.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lost(bool);

impl Lost {
    /// Looks at the state after a sample. Returns whether the attitude is unknown and the sample does not say how the
    /// vehicle turned.
    pub(super) fn see<const N: usize>(&mut self, step: Step, filter: &Filter<N>) -> bool {
        let is_gap = step == Step::TakenWithGap;
        self.0 |= is_gap && is_large(filter);
        self.0 && is_gap
    }

    /// Returns whether the attitude is less well known than the equations of the filter can take.
    pub(super) fn is_unknown<const N: usize>(self, filter: &Filter<N>) -> bool {
        self.0 || is_large(filter)
    }

    /// Keeps an unknown attitude away from an update by position or velocity. Under thrust, the velocity says where the
    /// vehicle points, by equations that hold for small angles: with an unknown attitude they leave a wrong one with a
    /// small sigma.
    pub(super) fn keep_from_receiver<const N: usize>(self, filter: &mut Filter<N>) {
        if self.0 {
            let attitude = filter.nominal().attitude;
            filter.set_attitude(&attitude, &Covariance::isotropic(UNKNOWN_RAD * UNKNOWN_RAD));
        }
    }
}

fn is_large<const N: usize>(filter: &Filter<N>) -> bool {
    filter.sigmas(Layout::ATTITUDE).max() > LARGE_RAD
}

/// Returns how many measurements of a kind the gate has refused in a row, if these show that the attitude is lost.
/// `taken` says of each one, oldest first, whether the gate took it. The more often they confirmed the attitude, the
/// more it takes to give it up: up to `many`.
pub(super) fn refused_in_a_row(taken: impl DoubleEndedIterator<Item = bool> + Clone, many: usize) -> Option<usize> {
    let in_a_row = taken.clone().rev().take_while(|taken| !taken).count();
    let confirmed = taken.filter(|taken| *taken).count();
    (in_a_row >= confirmed.clamp(FEWEST_REFUSED, many.max(FEWEST_REFUSED))).then_some(in_a_row)
}
