//! The observer that writes everything down.

use std::cell::{Cell, RefCell};
use std::fmt::Debug;

use hzn_core::Expected;
use hzn_core::error_budget::ErrorBudget;
use hzn_core::evidence::Evidence;
use hzn_core::observer::{Border, Observer};
use hzn_core::pixel::ImagePoint;
use hzn_core::real::Real;
use hzn_core::report::{Candidate, Solution};
use hzn_core::status::Stage;

/// The parts of a journal, in the order of the columns.
#[derive(Clone, Copy)]
enum Part {
    Course,
    Reads,
    Points,
    Weights,
    Fits,
    Budgets,
    Evidence,
}

/// A digest of a text (FNV-1a).
#[derive(Clone, Copy)]
struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Digest {
    fn add(&mut self, text: &str) {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Adds a text with its numbers rounded to eight digits: the last bits of a sum change with its order.
    fn add_rounded(&mut self, text: &str) {
        for word in text.split([' ', ',', '(', ')', '[', ']', '{', '}', '\n']).filter(|word| !word.is_empty()) {
            match word.parse::<f64>() {
                Ok(number) => self.add(&format!("{number:.7e} ")),
                Err(_) => self.add(word),
            }
        }
    }

    fn short(self) -> u32 {
        (self.0 ^ (self.0 >> 32)) as u32
    }
}

/// Returns the digest of a text with rounded numbers.
pub(super) fn digest_of(text: &str) -> u32 {
    let mut digest = Digest::default();
    digest.add_rounded(text);
    digest.short()
}

/// What an observer sees, as one digest for each part.
#[derive(Default)]
pub(super) struct Journal {
    parts: RefCell<[Digest; 7]>,
    reads: Cell<u32>,
}

impl Journal {
    fn note(&self, part: Part, what: &impl Debug) {
        self.parts.borrow_mut()[part as usize].add_rounded(&format!("{what:?}"));
    }

    /// Returns the columns of a table: the number of pixels that were read, and the digest of each part.
    pub(super) fn digests(&self) -> String {
        let parts = self.parts.borrow();
        let columns: String = parts.iter().map(|digest| format!(",{:08x}", digest.short())).collect();
        format!(",{}{columns}", self.reads.get())
    }
}

impl<T: Real> Observer<T> for Journal {
    fn body(&self, which: u8) {
        self.note(Part::Course, &("body", which));
    }
    fn enter(&self, stage: Stage) {
        self.note(Part::Course, &stage);
    }
    fn leave(&self) {
        self.note(Part::Course, &"leave");
    }
    fn pixel(&self, x: u16, y: u16) {
        self.reads.set(self.reads.get() + 1);
        let digest = &mut self.parts.borrow_mut()[Part::Reads as usize];
        digest.0 = (digest.0 ^ (u64::from(y) << 16 | u64::from(x))).wrapping_mul(0x0100_0000_01b3);
    }
    fn level(&self, level: u16, mean: T, samples: u32) {
        self.note(Part::Course, &("level", level, mean, samples));
    }
    fn dark_frame(&self, px: u16) {
        self.note(Part::Course, &("frame", px));
    }
    fn begin_again(&self) {
        self.note(Part::Course, &"again");
    }
    fn look(&self, number: u32, level: u16) {
        self.note(Part::Course, &("look", number, level));
    }
    fn edge(&self, candidate: u32, border: Border<'_>) {
        self.note(Part::Course, &(candidate, border.stride(), border.len()));
        border.pixels().for_each(|pixel| self.note(Part::Course, &(pixel.x, pixel.y)));
    }
    fn point(&self, candidate: u32, point: ImagePoint<T>) {
        self.note(Part::Points, &(candidate, point.u, point.v));
    }
    fn weight(&self, candidate: u32, point: u32, weight: T) {
        self.note(Part::Weights, &(candidate, point, weight));
    }
    fn wants_budget(&self) -> bool {
        true
    }
    fn budget(&self, candidate: u32, budget: &ErrorBudget<T>) {
        self.note(Part::Budgets, &(candidate, budget));
    }
    fn wants_fit(&self) -> bool {
        true
    }
    fn fit(&self, candidate: u32, fit: &Solution<T>, _expected: &Expected<T>) {
        self.note(Part::Fits, &(candidate, fit));
    }
    fn evidence(&self, candidate: u32, evidence: &Evidence<T>) {
        self.note(Part::Evidence, &(candidate, evidence));
    }
    fn verdict(&self, candidate: u32, outcome: &Candidate<T>, solution: Option<&Solution<T>>) {
        self.note(Part::Course, &(candidate, outcome, solution.is_some()));
    }
}
