//! Levenberg and Marquardt's steps to the most probable estimates.

use nalgebra::DVector;

use super::estimates::Estimates;
use super::loss::Loss;
use super::problem::{Problem, Weighed};
use super::report::report;
use crate::error::Error;
use crate::results::{Epoch, Solved};
use crate::sparse::{Factor, Marginals, Normal, Pattern};

/// Most steps of a loss, and the decrease of the cost that ends them: far below the change of 1 that a sigma of an
/// unknown makes.
const STEPS: (usize, f64) = (30, 1e-3);
/// The least damping and the largest. Where a step can be taken there is none: the numbers of the shortest steps
/// between knots are 10¹² times those of the receiver, and a damping of 10⁻⁹ would hold the whole trajectory where it
/// is.
const DAMPING: [f64; 2] = [1e-14, 1e8];

/// Solves the problem from the first estimates on.
pub(crate) fn solve(problem: &Problem<'_>, first: Estimates) -> Result<(Vec<Epoch>, Solved), Error> {
    let sizes = first.sizes(problem.places());
    let errors = problem.errors(&first, Loss::Huber)?;
    let joined: Vec<Vec<usize>> =
        errors.iter().map(|e| e.linear.derivatives.iter().map(|(block, _)| *block).collect()).collect();
    let pattern = Pattern::new(&sizes, joined.iter().map(Vec::as_slice))?;
    let mut at = Adjustment { problem, pattern: &pattern, factor: Factor::new(&pattern)?, estimates: first, errors };
    let before = at.cost();
    let (first_steps, _) = at.descend(Loss::Huber);
    at.errors = problem.errors(&at.estimates, Loss::Bounded)?;
    let (steps, is_converged) = at.descend(Loss::Bounded);
    let normal = at.normal();
    at.factor
        .compute(&normal, 0.0)
        .ok_or_else(|| Error::failed("--solve: the measurements do not determine the flight"))?;
    let marginals = Marginals::new(&pattern, &at.factor);
    let mut solved = Solved {
        unknowns: pattern.len(),
        knots: at.estimates.knots.len(),
        factor_numbers: at.factor.len(),
        steps: first_steps + steps,
        is_converged,
        cost: [before, at.cost()],
        ..Solved::default()
    };
    let epochs = report(problem, &at.estimates, &at.errors, &marginals, &mut solved)?;
    Ok((epochs, solved))
}

/// Estimates with their errors, and the factor of their equations.
struct Adjustment<'a> {
    problem: &'a Problem<'a>,
    pattern: &'a Pattern,
    factor: Factor<'a>,
    estimates: Estimates,
    errors: Vec<Weighed>,
}

impl<'a> Adjustment<'a> {
    fn cost(&self) -> f64 {
        cost(&self.errors)
    }

    /// Descends to a minimum; returns the number of steps, and whether the last one changed nothing.
    fn descend(&mut self, loss: Loss) -> (usize, bool) {
        let [least, largest] = DAMPING;
        let mut damping = 0.0;
        for steps in 1..=STEPS.0 {
            let normal = self.normal();
            let current = self.cost();
            let gain = loop {
                match self.tried(&normal, damping, loss).filter(|(_, errors)| cost(errors) <= current) {
                    Some((estimates, errors)) => {
                        (self.estimates, self.errors) = (estimates, errors);
                        break current - self.cost();
                    }
                    // No smaller step is better: this is the minimum, up to rounding.
                    None if damping > largest => return (steps, true),
                    None => damping = (damping * 100.0).max(least),
                }
            };
            damping = if damping > least { damping * 1e-3 } else { 0.0 };
            if gain < STEPS.1 {
                return (steps, true);
            }
        }
        (STEPS.0, false)
    }

    /// Returns the estimates after a step with a damping; `None` if the equations cannot be solved.
    fn tried(&mut self, normal: &Normal<'_>, damping: f64, loss: Loss) -> Option<(Estimates, Vec<Weighed>)> {
        self.factor.compute(normal, damping)?;
        let step: DVector<f64> = self.factor.step(normal);
        let part = |block: usize| step.rows(self.pattern.start(block), self.pattern.size(block)).into_owned();
        let estimates = self.estimates.moved(self.problem.places(), part);
        let errors = self.problem.errors(&estimates, loss).ok()?;
        Some((estimates, errors))
    }

    fn normal(&self) -> Normal<'a> {
        let mut normal = Normal::new(self.pattern);
        for error in &self.errors {
            if error.weight < 1.0 {
                normal.add(&error.linear.clone().weighted(error.weight));
            } else {
                normal.add(&error.linear);
            }
        }
        normal
    }
}

fn cost(errors: &[Weighed]) -> f64 {
    let cost: f64 = errors.iter().map(|e| e.cost).sum();
    if cost.is_finite() { cost } else { f64::INFINITY }
}
