//! Everything that the pipeline shows of its work on one picture.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use hzn_core::body::Expected;
use hzn_core::covariance::{ErrorBudget, Term};
use hzn_core::evidence::Evidence;
use hzn_core::observer::Border;
use hzn_core::pixel::{ImagePoint, Pixel};
use hzn_core::real::Real;
use hzn_core::report::Candidate;
use hzn_core::status::Stage;
use hzn_core::{Observer, Solution};
use hzn_host::Clock;

use super::widen::{widen_candidate, widen_solution};

/// One candidate edge.
#[derive(Debug, Clone, Default)]
pub struct Edge {
    /// The number of the candidate.
    pub candidate: u32,
    /// Border pixels, every `stride`-th, in order.
    pub border: Vec<Pixel>,
    /// Step between two listed border pixels along the edge, in border pixels.
    pub stride: u32,
    /// Sub-pixel points (u, v) in pixels.
    pub points: Vec<[f64; 2]>,
    /// Part of those points whose lit side is clipped at full scale, from 0 to 1.
    pub clipped: f64,
    /// Weights of those points after the fit; 0 is an outlier. Empty if there was no fit.
    pub weights: Vec<f64>,
    /// The outcome of the candidate.
    pub outcome: Option<Candidate<f64>>,
    /// The larger standard deviation (1 sigma) of the axis from each source of error, in radians. Empty if there was no
    /// fit.
    pub budget_rad: Vec<(Term, f64)>,
    /// The evidence that this candidate is the limb, if it passed every gate but `unlikely`.
    pub evidence: Option<Evidence<f64>>,
    /// The fit of this candidate, if it passed every gate.
    pub solution: Option<Solution<f64>>,
    /// The fit of this candidate and the cone that was expected, also if a gate refused the candidate.
    pub fitted: Option<Fitted>,
}

/// The fit of a candidate before the gates, and the cone that was expected.
#[derive(Debug, Clone, Copy)]
pub struct Fitted {
    /// The solution that the candidate becomes if it passes every gate.
    pub solution: Solution<f64>,
    /// Cosine of the expected half-angle.
    pub expected_cos: f64,
    /// 1-sigma of `expected_cos`, from altitude, limb height and unknown radius.
    pub expected_sigma_cos: f64,
    /// Limb height in metres with which the expected half-angle equals the one of the free fit, and its derivative by
    /// the cosine of the half-angle, m; `None` if the half-angle says nothing about the distance, or if it was not
    /// fitted.
    pub limb_height_m: Option<(f64, f64)>,
}

impl Fitted {
    /// Returns the difference of the cosines of the half-angle, fitted minus expected, and its 1-sigma; `None` if the
    /// half-angle was not fitted.
    pub fn difference(&self) -> Option<(f64, f64)> {
        let free = self.solution.free?;
        Some((free.cos - self.expected_cos, (free.var_cos + self.expected_sigma_cos.powi(2)).sqrt()))
    }
}

/// A record of the work on one body in one picture. It is filled through [`Observer`] and read after the picture.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    edges: RefCell<Vec<Edge>>,
    level: Cell<Option<(u16, f64, u32)>>,
    further_thresholds: RefCell<Vec<u16>>,
    border_px: Cell<u16>,
    times: Cell<[Duration; 8]>,
    running: Cell<Option<(Stage, Instant)>>,
}

impl Trace {
    /// Returns the candidates in the order in which they were followed.
    pub fn edges(&self) -> std::cell::Ref<'_, Vec<Edge>> {
        self.edges.borrow()
    }
    /// Returns the threshold in counts, with the mean (counts) and the number of pixels of the sample.
    pub fn level(&self) -> Option<(u16, f64, u32)> {
        self.level.get()
    }
    /// Returns the thresholds of the further looks, in counts.
    pub fn further_thresholds(&self) -> Vec<u16> {
        self.further_thresholds.borrow().clone()
    }
    /// Returns the width of the dark border around the picture that was left out, in pixels; 0 means that there is
    /// none.
    pub fn border_px(&self) -> u16 {
        self.border_px.get()
    }
    /// Returns the time spent in every stage.
    pub fn times(&self) -> [(Stage, Duration); 8] {
        let times = self.times.get();
        std::array::from_fn(|i| (Stage::ALL[i], times[i]))
    }

    fn change_edge(&self, candidate: u32, change: impl FnOnce(&mut Edge)) {
        let mut edges = self.edges.borrow_mut();
        let index = match edges.iter().rposition(|e| e.candidate == candidate) {
            Some(index) => index,
            None => {
                edges.push(Edge { candidate, stride: 1, ..Edge::default() });
                edges.len() - 1
            }
        };
        if let Some(edge) = edges.get_mut(index) {
            change(edge);
        }
    }

    fn switch(&self, next: Option<Stage>) {
        let now = hzn_host::now();
        if let Some(((stage, since), now)) = self.running.get().zip(now) {
            let mut times = self.times.get();
            times[stage as usize] += now - since;
            self.times.set(times);
        }
        self.running.set(next.zip(now));
    }
}

/// An observer for both precisions that also measures the time.
pub trait Watch: Observer<f32> + Observer<f64> {
    /// Returns the time spent on each body, in their order.
    fn times(&self) -> Vec<Duration>;
}

impl Watch for Clock {
    fn times(&self) -> Vec<Duration> {
        Clock::times(self)
    }
}

/// Records of one picture, one for each body.
#[derive(Debug, Default)]
pub struct Traces {
    /// The records in the order of the bodies.
    pub each: Vec<Trace>,
    /// Digest of the samples: equal for pictures that are equal to the last bit; 0 if nobody asked for it.
    pub samples_digest: u64,
    clock: Clock,
    now: Cell<usize>,
}

impl Traces {
    /// Makes empty records for this number of bodies.
    pub fn new(bodies: usize) -> Self {
        Self { each: vec![Trace::default(); bodies], ..Self::default() }
    }
    /// Returns the records with the digest of the picture's samples.
    #[must_use]
    pub(super) fn with_digest(mut self, digest: u64) -> Self {
        self.samples_digest = digest;
        self
    }
    fn now(&self) -> Option<&Trace> {
        self.each.get(self.now.get())
    }
}

impl Watch for Traces {
    fn times(&self) -> Vec<Duration> {
        self.clock.times()
    }
}

impl<T: Real + Into<f64>> Observer<T> for Traces {
    fn body(&self, which: u8) {
        self.now.set(usize::from(which));
        Observer::<T>::body(&self.clock, which);
    }
    fn enter(&self, stage: Stage) {
        self.now().into_iter().for_each(|t| Observer::<T>::enter(t, stage));
    }
    fn leave(&self) {
        Observer::<T>::leave(&self.clock);
        self.now().into_iter().for_each(|t| Observer::<T>::leave(t));
    }
    fn level(&self, level: u16, mean: T, samples: u32) {
        self.now().into_iter().for_each(|t| Observer::<T>::level(t, level, mean, samples));
    }
    fn dark_frame(&self, px: u16) {
        self.now().into_iter().for_each(|t| Observer::<T>::dark_frame(t, px));
    }
    fn begin_again(&self) {
        self.now().into_iter().for_each(|t| Observer::<T>::begin_again(t));
    }
    fn look(&self, number: u32, level: u16) {
        self.now().into_iter().for_each(|t| Observer::<T>::look(t, number, level));
    }
    fn edge(&self, candidate: u32, border: Border<'_>) {
        if let Some(trace) = self.now() {
            Observer::<T>::edge(trace, candidate, border);
        }
    }
    fn point(&self, candidate: u32, point: ImagePoint<T>) {
        self.now().into_iter().for_each(|t| t.point(candidate, point));
    }
    fn points(&self, candidate: u32, count: u32, clipped: u32) {
        self.now().into_iter().for_each(|t| Observer::<T>::points(t, candidate, count, clipped));
    }
    fn weight(&self, candidate: u32, point: u32, weight: T) {
        self.now().into_iter().for_each(|t| t.weight(candidate, point, weight));
    }
    fn wants_budget(&self) -> bool {
        self.now().is_some()
    }
    fn budget(&self, candidate: u32, budget: &ErrorBudget<T>) {
        self.now().into_iter().for_each(|t| t.budget(candidate, budget));
    }
    fn wants_fit(&self) -> bool {
        self.now().is_some()
    }
    fn fit(&self, candidate: u32, fit: &Solution<T>, expected: &Expected<T>) {
        self.now().into_iter().for_each(|t| t.fit(candidate, fit, expected));
    }
    fn evidence(&self, candidate: u32, evidence: &Evidence<T>) {
        self.now().into_iter().for_each(|t| t.evidence(candidate, evidence));
    }
    fn verdict(&self, candidate: u32, outcome: &Candidate<T>, solution: Option<&Solution<T>>) {
        self.now().into_iter().for_each(|t| t.verdict(candidate, outcome, solution));
    }
}

impl<T: Real + Into<f64>> Observer<T> for Trace {
    fn enter(&self, stage: Stage) {
        self.switch(Some(stage));
    }
    fn leave(&self) {
        self.switch(None);
    }
    fn level(&self, level: u16, mean: T, samples: u32) {
        self.level.set(Some((level, mean.into(), samples)));
    }
    fn dark_frame(&self, px: u16) {
        self.border_px.set(px);
    }
    fn begin_again(&self) {
        self.edges.borrow_mut().clear();
    }
    fn look(&self, _: u32, level: u16) {
        self.further_thresholds.borrow_mut().push(level);
    }
    fn edge(&self, candidate: u32, border: Border<'_>) {
        self.change_edge(candidate, |e| {
            e.border = border.pixels().collect();
            e.stride = border.stride();
        });
    }
    fn point(&self, candidate: u32, point: ImagePoint<T>) {
        self.change_edge(candidate, |e| e.points.push([point.u.into(), point.v.into()]));
    }
    fn points(&self, candidate: u32, count: u32, clipped: u32) {
        self.change_edge(candidate, |e| e.clipped = f64::from(clipped) / f64::from(count.max(1)));
    }
    fn weight(&self, candidate: u32, point: u32, weight: T) {
        self.change_edge(candidate, |e| {
            e.weights.resize(e.points.len(), 0.0);
            if let Some(slot) = e.weights.get_mut(point as usize) {
                *slot = weight.into();
            }
        });
    }
    fn wants_budget(&self) -> bool {
        true
    }
    fn budget(&self, candidate: u32, budget: &ErrorBudget<T>) {
        self.change_edge(candidate, |e| {
            e.budget_rad = Term::ALL.map(|term| (term, budget.covariance(term).sigma_max_rad().into())).into();
        });
    }
    fn wants_fit(&self) -> bool {
        true
    }
    fn fit(&self, candidate: u32, fit: &Solution<T>, expected: &Expected<T>) {
        let (cos, sigma) = expected.cos_and_sigma();
        let limb =
            fit.free.and_then(|free| expected.limb_height_m(free.cos)).map(|(h, slope)| (h.into(), slope.into()));
        self.change_edge(candidate, |e| {
            e.fitted = Some(Fitted {
                solution: widen_solution(fit),
                expected_cos: cos.into(),
                expected_sigma_cos: sigma.into(),
                limb_height_m: limb,
            });
        });
    }
    fn evidence(&self, candidate: u32, evidence: &Evidence<T>) {
        self.change_edge(candidate, |e| e.evidence = Some(evidence.to_f64()));
    }
    fn verdict(&self, candidate: u32, outcome: &Candidate<T>, solution: Option<&Solution<T>>) {
        self.change_edge(candidate, |e| {
            e.outcome = Some(widen_candidate(outcome));
            e.solution = solution.map(widen_solution);
        });
    }
}
