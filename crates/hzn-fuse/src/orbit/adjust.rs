//! Levenberg and Marquardt's steps to the most probable orbit.

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use super::dynamics::{Carried, Motion};
use super::estimates::{Estimates, Places};
use super::problem::{Problem, Weighed};
use crate::error::Error;
use crate::solve::Loss;
use crate::sparse::{Factor, Linear, Marginals, Normal, Pattern};

/// Most steps of a loss, and the decrease of the cost that ends them: far below the change of 1 that a sigma of an
/// unknown makes.
const STEPS: (usize, f64) = (40, 1e-3);
/// The least damping and the largest.
const DAMPING: [f64; 2] = [1e-9, 1e8];

/// The most probable estimates.
pub(super) struct Adjusted {
    pub(super) estimates: Estimates,
    pub(super) errors: Vec<Weighed>,
    pub(super) steps: usize,
    pub(super) is_converged: bool,
    /// The sum of the squares at the first estimates and at the end.
    pub(super) cost: [f64; 2],
}

fn cost(errors: &[Weighed]) -> f64 {
    let cost: f64 = errors.iter().map(|e| e.cost).sum();
    if cost.is_finite() { cost } else { f64::INFINITY }
}

/// Returns which blocks the errors join.
pub(super) fn pattern(estimates: &Estimates, errors: &[Weighed]) -> Result<Pattern, Error> {
    let joined: Vec<Vec<usize>> =
        errors.iter().map(|e| e.linear.derivatives.iter().map(|(block, _)| *block).collect()).collect();
    Pattern::new(&estimates.sizes(), joined.iter().map(Vec::as_slice))
}

fn normal<'a>(pattern: &'a Pattern, errors: &[Weighed], is_weighed: bool) -> Normal<'a> {
    let mut normal = Normal::new(pattern);
    for error in errors {
        if error.weight < 1.0 && is_weighed {
            normal.add(&error.linear.clone().weighted(error.weight));
        } else {
            normal.add(&error.linear);
        }
    }
    normal
}

/// Descends from the first estimates to the most probable ones.
pub(super) fn adjust(problem: &Problem<'_>, first: Estimates) -> Result<Adjusted, Error> {
    let begin = first.knots.first().copied().unwrap_or_else(Motion::zeros);
    let left = || Error::failed("--solve: the first orbit does not see the Earth as the pictures do");
    let errors = problem.errors(&first, &begin, Loss::Huber).ok_or_else(left)?;
    let pattern = pattern(&first, &errors)?;
    let mut factor = Factor::new(&pattern)?;
    let before = cost(&errors);
    let mut at = Adjusted { estimates: first, errors, steps: 0, is_converged: false, cost: [before, before] };
    for loss in [Loss::Huber, Loss::Bounded] {
        at.errors = problem.errors(&at.estimates, &begin, loss).ok_or_else(left)?;
        descend(problem, &pattern, &mut factor, &mut at, (&begin, loss));
    }
    at.cost[1] = cost(&at.errors);
    Ok(at)
}

fn descend(
    problem: &Problem<'_>,
    pattern: &Pattern,
    factor: &mut Factor<'_>,
    at: &mut Adjusted,
    (begin, loss): (&Motion, Loss),
) {
    let mut damping = 0.0;
    at.is_converged = false;
    for _ in 0..STEPS.0 {
        let normal = normal(pattern, &at.errors, true);
        let current = cost(&at.errors);
        at.steps += 1;
        let gain = loop {
            let tried = factor.compute(&normal, damping).and_then(|()| {
                let step = factor.step(&normal);
                let part = |block: usize| step.rows(pattern.start(block), pattern.size(block)).into_owned();
                let estimates = at.estimates.moved(part);
                let errors = problem.errors(&estimates, begin, loss)?;
                (cost(&errors) <= current).then_some((estimates, errors))
            });
            match tried {
                Some((estimates, errors)) => {
                    (at.estimates, at.errors) = (estimates, errors);
                    break current - cost(&at.errors);
                }
                // No smaller step is better: this is the minimum, up to rounding.
                None if damping > DAMPING[1] => break 0.0,
                None => damping = (damping * 100.0).max(DAMPING[0]),
            }
        };
        damping = if damping > DAMPING[0] { damping * 1e-3 } else { 0.0 };
        if gain < STEPS.1 {
            at.is_converged = true;
            return;
        }
    }
}

/// The covariance of the estimates: what the measurements leave, and what the considered errors add.
///
/// Considered errors c with the covariance C move the estimates by K c, so they add K C Kᵀ (Schmidt 1966). They are not
/// estimated: the derivative of an axis by the limb height changes by a tenth between pictures, and an estimate would
/// take every error that changes alike for a limb height.
pub(super) struct Covariances<'a> {
    marginals: Marginals<'a>,
    pattern: &'a Pattern,
    /// Each considered error with its sigma, and by how much this moves all unknowns.
    moved: Vec<((usize, f64), DVector<f64>)>,
}

impl Covariances<'_> {
    /// Returns the covariance of the errors of the whole flight, with that of the considered ones themselves; `None` if
    /// the factor does not have it.
    pub(super) fn of_shared(&self, block: usize) -> Option<DMatrix<f64>> {
        let mut covariance = self.marginals.block(block, block)?;
        for ((which, sigma), moved) in &self.moved {
            let mut own = moved.rows(self.pattern.start(block), self.pattern.size(block)).into_owned();
            // They keep their told values but for rounding.
            for ((other, _), _) in &self.moved {
                *own.get_mut(*other)? = if other == which { *sigma } else { 0.0 };
            }
            covariance += &own * own.transpose();
        }
        Some(covariance)
    }

    /// Returns the covariance of a motion that depends on a knot and, on the way from there, on an error of the whole
    /// flight; `None` if the factor does not have it.
    pub(super) fn of_motion(&self, knot: usize, carried: &Carried, which: Option<usize>) -> Option<Matrix6<f64>> {
        let own: Matrix6<f64> = self.marginals.block(knot, knot)?.fixed_view::<6, 6>(0, 0).into_owned();
        let mut covariance = carried.by * own * carried.by.transpose();
        for ((error, sigma), moved) in &self.moved {
            let on_the_way = if which == Some(*error) { carried.by_drag * *sigma } else { Vector6::zeros() };
            let moved = carried.by * moved.fixed_rows::<6>(self.pattern.start(knot)) + on_the_way;
            covariance += moved * moved.transpose();
        }
        Some(covariance)
    }
}

/// Calls a function with the covariance of the estimates: with the weights of the loss, or with all measurements
/// whole.
pub(super) fn with_covariances<R>(
    at: &Adjusted,
    places: &Places,
    is_weighed: bool,
    call: impl FnOnce(&Covariances<'_>, &Factor<'_>, &Pattern) -> R,
) -> Result<R, Error> {
    let pattern = pattern(&at.estimates, &at.errors)?;
    let mut factor = Factor::new(&pattern)?;
    factor
        .compute(&normal(&pattern, &at.errors, is_weighed), 0.0)
        .ok_or_else(|| Error::failed("--solve: the limbs do not determine the orbit; give more of them"))?;
    let moved = places.considered().map(|(which, sigma)| {
        let by_one: Vec<Weighed> = at.errors.iter().filter_map(|e| by(e, at.estimates.shared_block(), which)).collect();
        ((which, sigma), factor.step(&normal(&pattern, &by_one, is_weighed)) * sigma)
    });
    let moved: Vec<_> = moved.collect();
    let covariances = Covariances { marginals: Marginals::new(&pattern, &factor), pattern: &pattern, moved };
    Ok(call(&covariances, &factor, &pattern))
}

/// Returns the derivatives of a sight or of the motion between knots, with that by one error of the whole flight in
/// place of the error; `None` if it does not depend on it.
fn by(error: &Weighed, shared: usize, which: usize) -> Option<Weighed> {
    // What is known before of the errors of the whole flight joins no other block.
    (error.linear.derivatives.len() > 1).then_some(())?;
    let (_, matrix) = error.linear.derivatives.iter().find(|(block, _)| *block == shared)?;
    let column = matrix.column(which);
    (column.norm_squared() > 0.0).then(|| {
        let linear = Linear { error: column.into_owned(), derivatives: error.linear.derivatives.clone() };
        Weighed { linear, ..error.clone() }
    })
}
