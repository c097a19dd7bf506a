//! The evidence that an edge is the limb, and the probability that follows from it.
//!
//! The logarithm of the odds is ln(prior odds) + b + Σ w x, where x are the values of the terms. A term that the
//! picture does not show adds nothing. The weights come from a logistic regression
//! (`tests/python/decoy_campaign.py --fit`).

use crate::base::real::Real;

/// The evidence for and against an edge that has passed all other gates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
// The numbers are fixed because they are the indices of the values.
#[repr(u8)]
pub enum Term {
    /// How clearly the edge has the curvature and the size of its cone: the logarithm of the smaller one of c and
    /// 2 (1 − c) over the sigma of c, 0 to 5; c is the cosine of the fitted half-angle α.
    ///
    /// A straight edge has c = 0, and c/σ_c is the distance from it in sigmas, which for a short arc is its sagitta
    /// over the error of the edge. A spot without a size has 1 − c = 0. For a small disc, 2 (1 − c) = α² and
    /// σ_c = α σ_α, so that the value is the radius over its error: no disc is certain because it is small. Both errors
    /// come from the residuals of the edge and their correlation. A chance edge may have any radius, evenly in its
    /// logarithm; the likelihood ratio of the expected half-angle is then this ratio times exp(−z²/2), with z of the
    /// next term. The weights that follow from this, 1 and −0.5, are close to the fitted ones.
    Curvature = 0,
    /// Squared difference between the fitted and the expected half-angle over its variance, at most 9.
    HalfAngle = 1,
    /// Part of the limb in view without edge points, plus the part of the edge's points that are no inliers.
    Gaps = 2,
    /// Logarithm of the RMS residual over that which a limb may have from the noise of the edge, the sampling, and the
    /// roughness of clouds, 0 or more; what an uncertain lens bends is taken out.
    Misfit = 3,
    /// Brightness of the sky over that of the body, 0 to 1.
    Sky = 4,
    /// Where the light 1.5 scale heights above the edge is fainter than that of air: the logarithm of this light over
    /// that of air, −2.5 to 0.
    FaintAir = 5,
    /// Where this light is brighter than that of air: the logarithm, 0 to 1.1.
    BrightAir = 6,
    /// Where the light three scale heights above the edge is fainter than that of air: the logarithm, −1.9 to 0.
    FaintHighAir = 7,
    /// How abruptly the brightness changes between 40 and 140 km below the edge, alike everywhere along the edge: 0 to
    /// 3. The ground below a layer of airglow has such a second edge.
    Layer = 8,
    /// How much the brightness falls below the edge, and how abruptly it changes at one depth between 70 and 130 km,
    /// against its bends at other depths: 0 to 3.75. A layer of airglow becomes fainter inwards, without clouds, and
    /// ends at the limb of the ground.
    SecondEdge = 9,
    /// Where the body is as bright and as even far inside as next to the edge: the logarithm of both differences
    /// together, −2.5 to 0. The air before the ground makes a limb darker inwards, and clouds make it uneven.
    Flat = 10,
    /// How uneven the sky is along the edge: the logarithm, 0 to 4. Ground next to an edge is uneven, and space is not.
    MottledSky = 11,
    /// A given attitude: the logarithm of the likelihood ratio.
    Attitude = 12,
    /// A given Sun that lights the edge: the logarithm of the likelihood ratio.
    Sun = 13,
}

/// Number of terms.
const TERMS: usize = 14;

impl Term {
    /// All terms in the order of their numbers.
    pub const ALL: [Self; TERMS] = [
        Self::Curvature,
        Self::HalfAngle,
        Self::Gaps,
        Self::Misfit,
        Self::Sky,
        Self::FaintAir,
        Self::BrightAir,
        Self::FaintHighAir,
        Self::Layer,
        Self::SecondEdge,
        Self::Flat,
        Self::MottledSky,
        Self::Attitude,
        Self::Sun,
    ];

    /// Returns the name of the term.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Curvature => "curvature",
            Self::HalfAngle => "half-angle",
            Self::Gaps => "gaps",
            Self::Misfit => "misfit",
            Self::Sky => "sky",
            Self::FaintAir => "faint-air",
            Self::BrightAir => "bright-air",
            Self::FaintHighAir => "faint-high-air",
            Self::Layer => "layer",
            Self::SecondEdge => "second-edge",
            Self::Flat => "flat",
            Self::MottledSky => "mottled-sky",
            Self::Attitude => "attitude",
            Self::Sun => "sun",
        }
    }
}

/// Weights of the terms in their order, in hundredths. The values of attitude and Sun are likelihood ratios already.
// Whole numbers: a flight computer without double precision would convert each number in software.
const WEIGHTS_PERCENT: [i16; TERMS] = [89, -57, -247, -192, -198, 143, -58, 66, -127, -268, 187, -29, 100, 100];
/// The constant b.
const CONSTANT: f64 = 0.86;

fn weight<T: Real>(percent: i16) -> T {
    T::from_i32(percent.into()) / T::from_i32(100)
}

/// The evidence that an edge is the limb.
#[derive(Debug, Clone, Copy)]
pub struct Evidence<T> {
    values: [Option<T>; TERMS],
}

impl<T: Real> Evidence<T> {
    pub(crate) fn new() -> Self {
        Self { values: [None; TERMS] }
    }

    pub(crate) fn set(&mut self, term: Term, value: T) {
        if let Some(slot) = self.values.get_mut(term as usize) {
            *slot = Some(value);
        }
    }

    /// Returns the value of a term; `None` if the picture or the prior does not show it.
    pub fn value(&self, term: Term) -> Option<T> {
        self.values.get(term as usize).copied().flatten()
    }

    /// Returns the logarithm of a term's likelihood ratio, except for a constant; 0 without a value.
    pub fn ln_ratio(&self, term: Term) -> T {
        let percent = WEIGHTS_PERCENT.get(term as usize).copied().unwrap_or(0);
        self.value(term).map_or(T::ZERO, |value| value * weight(percent))
    }

    /// Returns the logarithm of the likelihood ratio of all terms.
    pub fn ln_ratio_of_all(&self) -> T {
        self.values
            .iter()
            .zip(WEIGHTS_PERCENT)
            .filter_map(|(value, percent)| value.map(|x| x * weight(percent)))
            .fold(T::from_f64(CONSTANT), |sum, x| sum + x)
    }

    /// Returns the probability that the edge is the limb. `prior_odds` are the odds before the evidence is weighed.
    pub fn p_limb(&self, prior_odds: T) -> T {
        // Beyond this number the probability is 0 or 1 in single precision.
        let most = T::from_f64(80.0);
        let ln_ratio = self.ln_ratio_of_all().max(-most).min(most);
        let against = (-ln_ratio).exp();
        prior_odds / (prior_odds + against)
    }

    /// Converts the evidence to double precision.
    pub fn to_f64(&self) -> Evidence<f64> {
        Evidence { values: self.values.map(|value| value.map(T::to_f64)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_terms_have_the_order_of_their_numbers() {
        for (i, term) in Term::ALL.into_iter().enumerate() {
            assert_eq!(term as usize, i, "{}", term.name());
        }
    }

    #[test]
    fn probabilities_follow_odds_and_evidence() {
        let mut evidence = Evidence::<f64>::new();
        evidence.set(Term::Attitude, -CONSTANT);
        assert!((evidence.p_limb(9.0) - 0.9).abs() < 1e-12, "no evidence leaves the odds");
        evidence.set(Term::Attitude, 9f64.ln() - CONSTANT);
        assert!((evidence.p_limb(1.0) - 0.9).abs() < 1e-12);
        let (mut far, mut single) = (evidence, Evidence::<f32>::new());
        far.set(Term::Attitude, -1e6);
        single.set(Term::Attitude, 1e6);
        assert!(far.p_limb(50.0) >= 0.0 && far.p_limb(50.0) < 1e-30);
        assert_eq!(single.p_limb(50.0), 1.0);
    }
}
