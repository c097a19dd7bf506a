//! From which sources of error the sigma of an answer comes.

use hzn_core::Solution;
use hzn_core::error_budget::Term;
use hzn_run::engine::trace::Edge;
use hzn_run::explain::term_text;

/// Parts of the 1-sigma of an answer, degrees, in the order of [`Term::ALL`]. Together they are the larger 1-sigma of
/// the answer; each has the share of its variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SigmaParts([f32; Term::ALL.len()]);

impl SigmaParts {
    /// Divides a sigma among the terms of an error budget. `None` if no term has an error. Each term counts with its
    /// worst direction, because the budget of an edge has no other.
    pub fn new(sigma_max_deg: f64, budget_rad: &[(Term, f64)]) -> Option<Self> {
        let total: f64 = budget_rad.iter().map(|(_, rad)| rad * rad).sum();
        if !(total > 0.0 && total.is_finite() && sigma_max_deg.is_finite()) {
            return None;
        }
        let mut parts = [0.0; Term::ALL.len()];
        for (term, rad) in budget_rad {
            if let Some(part) = parts.get_mut(*term as usize) {
                *part += (sigma_max_deg * rad * rad / total) as f32;
            }
        }
        Some(Self(parts))
    }
    /// Returns the parts of an answer, from the edges of its picture.
    pub fn of_answer(solution: &Solution<f64>, edges: &[Edge]) -> Option<Self> {
        let edge = edges.iter().find(|edge| edge.candidate == solution.candidate)?;
        Self::new(solution.covariance.sigma_max_rad().to_degrees(), &edge.budget_rad)
    }
    /// Returns the part of a term, degrees.
    pub fn of(&self, term: Term) -> f64 {
        self.0.get(term as usize).copied().unwrap_or(0.0).into()
    }
    /// Returns the sum of all parts: the larger 1-sigma of the answer, degrees.
    pub fn sum_deg(&self) -> f64 {
        self.0.iter().copied().map(f64::from).sum()
    }
    /// Describes the largest parts in words.
    pub fn text(&self) -> String {
        let sum = self.sum_deg();
        let mut all: Vec<(Term, f64)> = Term::ALL.iter().map(|term| (*term, self.of(*term) / sum)).collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        let said = all.iter().take(3).filter(|(_, part)| *part >= 0.01);
        let words = said.map(|(term, part)| format!("{} {:.0} %", term_text(*term), 100.0 * part));
        format!("σ {sum:.4}°: {}", words.collect::<Vec<_>>().join(", "))
    }
}

/// Returns the terms in falling order of their largest share of an answer, without those that are below `least` in all
/// answers.
pub fn largest_terms<'a>(all: impl Iterator<Item = &'a SigmaParts> + Clone, least: f64) -> Vec<Term> {
    let share = |term: Term| all.clone().map(|parts| parts.of(term) / parts.sum_deg()).fold(0.0, f64::max);
    let mut shares: Vec<(Term, f64)> = Term::ALL.iter().map(|term| (*term, share(*term))).collect();
    shares.retain(|(_, share)| *share >= least);
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    shares.into_iter().map(|(term, _)| term).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_the_shares_of_their_variances_and_their_sum_is_the_sigma() {
        let budget = [(Term::EdgeNoise, 3e-4), (Term::LimbHeight, 4e-4), (Term::Lens, 0.0)];
        let parts = SigmaParts::new(0.05, &budget).unwrap();
        assert!((parts.sum_deg() - 0.05).abs() < 1e-8);
        assert!((parts.of(Term::EdgeNoise) - 0.05 * 9.0 / 25.0).abs() < 1e-8);
        assert_eq!(parts.of(Term::Lens), 0.0);
        assert_eq!(parts.text(), "σ 0.0500°: the limb height 64 %, edge noise 36 %");
        assert_eq!(SigmaParts::new(0.05, &[]), None);
        assert_eq!(SigmaParts::new(f64::NAN, &budget), None);
    }

    #[test]
    fn terms_are_ordered_by_their_largest_share() {
        let early = SigmaParts::new(0.1, &[(Term::EdgeNoise, 9e-4), (Term::Lens, 1e-4)]).unwrap();
        let late = SigmaParts::new(0.1, &[(Term::EdgeNoise, 1e-4), (Term::Altitude, 9.5e-4)]).unwrap();
        let terms = largest_terms([early, late].iter(), 0.02);
        assert_eq!(terms, [Term::Altitude, Term::EdgeNoise], "the lens has 1 % at most");
    }
}
