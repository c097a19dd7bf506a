//! The evidence that an edge is the limb, and the probability that follows from it.
//!
//! An edge that is no limb is of one of three kinds. The logarithm of the odds of the limb against kind k is
//! ln(prior odds) + b_k + Σ w_k x, where x are the values of the terms; the three odds together give the probability. A
//! term that the picture does not show adds nothing. The weights come from a logistic regression with four classes
//! (`tests/python/decoy_campaign.py --fit`).

use crate::base::real::Real;

/// A kind of edge that is no limb.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
// The numbers are fixed because they are the indices of the weights.
#[repr(u8)]
pub enum FalseEdge {
    /// An edge in any direction: ice, a coast, a cloud, the vehicle, or light in the lens.
    Other = 0,
    /// Light in the lens that has the form and the place of the limb.
    Ghost = 1,
    /// The edge of a layer of airglow above the night side.
    Airglow = 2,
}

/// Number of kinds.
const KINDS: usize = 3;

impl FalseEdge {
    /// All kinds in the order of their numbers.
    pub const ALL: [Self; KINDS] = [Self::Other, Self::Ghost, Self::Airglow];

    /// Returns the name of the kind.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Other => "other",
            Self::Ghost => "ghost",
            Self::Airglow => "airglow",
        }
    }
}

/// The evidence for and against an edge that has passed all other gates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
// The numbers are fixed because they are the indices of the values.
#[repr(u8)]
pub enum Term {
    /// How clearly the edge is curved: the logarithm of the cosine of its half-angle over the sigma of this cosine, 0
    /// to 5. A straight edge has the cosine 0.
    Curvature = 0,
    /// Squared difference between the fitted and the expected half-angle over its variance, at most 9.
    HalfAngle = 1,
    /// Part of the limb in view without edge points, plus the part of the edge's points that are no inliers.
    Gaps = 2,
    /// Logarithm of the RMS residual over the noise from point to point.
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
    /// Squared difference between the fitted half-angle and that of a layer of airglow over its variance, less the same
    /// for the limb, −9 to 9.
    LayerHeight = 11,
    /// 1 where no layer of airglow can be seen: the Sun is known to light all of the limb, the camera is below the layer,
    /// or the body is not seen in sunlight.
    NoLayer = 12,
    /// A given attitude: the logarithm of the likelihood ratio.
    Attitude = 13,
    /// A given Sun that lights the edge: the logarithm of the likelihood ratio.
    Sun = 14,
}

/// Number of terms.
const TERMS: usize = 15;

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
        Self::LayerHeight,
        Self::NoLayer,
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
            Self::LayerHeight => "layer-height",
            Self::NoLayer => "no-layer",
            Self::Attitude => "attitude",
            Self::Sun => "sun",
        }
    }
}

/// Weights of the terms in their order, in hundredths, against each kind of false edge. The values of attitude and Sun
/// are likelihood ratios already; edges that follow the limb agree with them as the limb does. Where no layer can be seen,
/// airglow is out of the question.
// Whole numbers: a flight computer without double precision would convert each number in software.
#[rustfmt::skip]
const WEIGHTS_PERCENT: [[i16; TERMS]; KINDS] = [
    [98, -65, -343, -149,   0, 141, -42,   0,    0,    0, 196,   0,    0, 100, 100],
    [ 0, -25,    0,    0, -37, 152,   0, 153,    0,    0, 292,   0,    0,   0,   0],
    [68,   0,    0,    0,  -8,   0,   0,   0, -200, -457,   0, 115, 3000,   0,   0],
];
/// The constants b_k, in hundredths.
const CONSTANTS_PERCENT: [i16; KINDS] = [131, 958, 23];

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

    /// Returns the logarithm of a term's likelihood ratio of the limb to a kind of false edge, except for a constant; 0
    /// without a value.
    pub fn ln_ratio(&self, term: Term, to: FalseEdge) -> T {
        let weights = WEIGHTS_PERCENT.get(to as usize);
        let percent = weights.and_then(|weights| weights.get(term as usize)).copied().unwrap_or(0);
        self.value(term).map_or(T::ZERO, |value| value * T::from_i32(percent.into()) / T::from_i32(100))
    }

    /// Returns the logarithm of the likelihood ratio of the limb to a kind of false edge, of all terms.
    pub fn ln_ratio_of_all(&self, to: FalseEdge) -> T {
        let weights = WEIGHTS_PERCENT.get(to as usize);
        let constant = CONSTANTS_PERCENT.get(to as usize).copied().unwrap_or(0);
        let shown = self.values.iter().zip(weights.into_iter().flatten());
        let percent = |percent: i16| T::from_i32(percent.into());
        let sum = shown
            .filter_map(|(value, weight)| value.filter(|_| *weight != 0).map(|x| x * percent(*weight)))
            .fold(percent(constant), |sum, x| sum + x);
        sum / T::from_i32(100)
    }

    /// Returns the probability that the edge is the limb. `prior_odds` are the odds before the evidence is weighed.
    pub fn p_limb(&self, prior_odds: T) -> T {
        // Beyond this number the probability is 0 or 1 in single precision.
        let most = T::from_f64(80.0);
        let against = FalseEdge::ALL.iter().fold(T::ZERO, |against, kind| {
            let ln_ratio = self.ln_ratio_of_all(*kind).max(-most).min(most);
            against + (-ln_ratio).exp()
        });
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
        let ln_ratios = |evidence: &Evidence<f64>| FalseEdge::ALL.map(|kind| evidence.ln_ratio_of_all(kind));
        let p_limb = |evidence: &Evidence<f64>, odds: f64| {
            odds / (odds + ln_ratios(evidence).iter().map(|ln_ratio| (-ln_ratio).exp()).sum::<f64>())
        };
        let mut evidence = Evidence::<f64>::new();
        assert_eq!(ln_ratios(&evidence), CONSTANTS_PERCENT.map(|percent| f64::from(percent) / 100.0));
        assert!((evidence.p_limb(9.0) - p_limb(&evidence, 9.0)).abs() < 1e-12);
        // An attitude is evidence against an edge in any direction only.
        let before = ln_ratios(&evidence);
        evidence.set(Term::Attitude, 5.0);
        let after = ln_ratios(&evidence);
        assert!((after[0] - before[0] - 5.0).abs() < 1e-12 && after[1..] == before[1..], "{after:?}");
        let (mut far, mut single) = (evidence, Evidence::<f32>::new());
        far.set(Term::Attitude, -1e6);
        assert!(far.p_limb(50.0) >= 0.0 && far.p_limb(50.0) < 1e-30);
        single.set(Term::Attitude, 1e6);
        single.set(Term::NoLayer, 1.0);
        assert!(single.p_limb(50.0) > 0.999_999 && single.p_limb(50.0) <= 1.0);
    }

    #[test]
    fn evidence_against_one_kind_does_not_hide_another() {
        let mut evidence = Evidence::<f64>::new();
        evidence.set(Term::Attitude, 1e6);
        evidence.set(Term::NoLayer, 1.0);
        // No air and a flat body: a ghost that matches the limb has its direction, too.
        for (term, value) in [(Term::FaintAir, -2.5), (Term::FaintHighAir, -1.9), (Term::Flat, -2.5)] {
            evidence.set(term, value);
        }
        assert!(evidence.p_limb(50.0) < 0.5, "{}", evidence.p_limb(50.0));
    }
}
