//! What the filter leaves for the solve of the whole flight.

use hzn_nav::filter::{Corrections, Filter};
use hzn_nav::frames::{Cam, Rotation, Vehicle};
use hzn_nav::strapdown::Nominal;

/// What the filter leaves for the solve.
#[derive(Debug, Clone, Default)]
pub(crate) struct Track {
    /// The state at the start and after each measurement.
    pub(crate) states: Vec<Nominal>,
    /// For each new start the place of its first state, and whether the states before it are wrong: the attitude was
    /// refused, and not only unknown.
    pub(crate) restarts: Vec<(usize, bool)>,
    /// The errors of the instruments at the end.
    pub(crate) corrections: Corrections,
    /// The mounts at the end.
    pub(crate) mounts: Vec<Rotation<Cam, Vehicle>>,
    /// The clocks at the end, s.
    pub(crate) clocks_s: Vec<f64>,
}

impl Track {
    /// Keeps the errors of the instruments at the end.
    pub(crate) fn finish<const N: usize>(&mut self, filter: &Filter<N>) {
        self.corrections = *filter.corrections();
        let cameras = || (0..).map_while(|which| filter.camera(which));
        self.mounts = cameras().map(|camera| camera.mount).collect();
        self.clocks_s = cameras().map(|camera| camera.clock_s).collect();
    }
}
