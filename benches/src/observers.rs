//! Observers of the pipeline: a clock, and a map of the pixels that were read.

use std::cell::{Cell, RefCell};
use std::time::Instant;

use hzn_core::Observer;
use hzn_core::status::Stage;

/// Clock for the time in each stage.
pub(crate) struct Clock {
    since: Cell<Instant>,
    stage: Cell<Option<Stage>>,
    us: [Cell<f64>; Stage::ALL.len()],
}

impl Clock {
    pub(crate) fn start() -> Self {
        Self { since: Cell::new(Instant::now()), stage: Cell::new(None), us: Default::default() }
    }
    fn switch_stage(&self, next: Option<Stage>) {
        let now = Instant::now();
        if let Some(cell) = self.stage.get().and_then(|s| self.us.get(s as usize)) {
            cell.set(cell.get() + now.duration_since(self.since.get()).as_secs_f64() * 1e6);
        }
        self.since.set(now);
        self.stage.set(next);
    }
    /// Returns the time in microseconds of every stage that was entered.
    pub(crate) fn stages(&self) -> Vec<(&'static str, f64)> {
        Stage::ALL.iter().zip(&self.us).map(|(s, us)| (s.name(), us.get())).filter(|(_, us)| *us > 0.0).collect()
    }
}

impl<T> Observer<T> for Clock {
    fn enter(&self, stage: Stage) {
        self.switch_stage(Some(stage));
    }
    fn leave(&self) {
        self.switch_stage(None);
    }
}

/// Map of the pixels that were read; each counts once.
pub(crate) struct PixelMap {
    width: usize,
    bits: RefCell<Vec<u64>>,
}

impl PixelMap {
    pub(crate) fn new(width: u16, height: u16) -> Self {
        let (width, height) = (usize::from(width), usize::from(height));
        Self { width, bits: RefCell::new(vec![0; (width * height).div_ceil(64)]) }
    }
    pub(crate) fn count(&self) -> u64 {
        self.bits.borrow().iter().map(|w| u64::from(w.count_ones())).sum()
    }
}

impl<T> Observer<T> for PixelMap {
    fn pixel(&self, x: u16, y: u16) {
        let i = usize::from(y) * self.width + usize::from(x);
        if let Some(word) = self.bits.borrow_mut().get_mut(i / 64) {
            *word |= 1 << (i % 64);
        }
    }
}
