//! How far an answer can be trusted, as a record: the probability that the edge is the limb, the protection level, and
//! the part of the covariance that the next picture shares.
//!
//! The record has a packet of its own, because a longer science packet would not be understood: every packet has a
//! fixed size, which receivers compare, and the science packet has neither reserved bytes nor a version. A receiver
//! without this record still reads all other packets. `telemetry.integrity` leaves it out where the line is too slow.

use hzn_core::frames::{Cam, Cov3};
use hzn_core::{Config, Solution};

use crate::record::record;

record! {
    /// How far a direction can be trusted. What is not known is NaN.
    Integrity {
        /// Probability that the edge of the answer is the limb, which `gates.min_p_limb` is compared with; NaN for
        /// bodies without air.
        p_limb: f32,
        /// Protection level: the angle that the error of the axis exceeds with the probability
        /// `covariance.protection_probability` if the edge is the limb, rad; NaN without `p_limb`.
        protection_rad: f32,
        /// The part of the covariance of the axis whose error is the same in the next picture while the geometry
        /// stays, rad².
        cov_common: [f32; 6],
    }
}

const NAN: f32 = f32::NAN;

impl Integrity {
    /// What a picture without a direction has.
    pub const NONE: Self = Self { p_limb: NAN, protection_rad: NAN, cov_common: [NAN; 6] };

    /// Returns the record of an answer about the first body of this configuration.
    // The level is not in the solution, because only the configuration has its probability.
    pub(crate) fn from_solution(s: &Solution<f32>, config: &Config) -> Self {
        let factor = s.p_limb.and_then(|_| config.protection_factor(0));
        Self {
            p_limb: s.p_limb.unwrap_or(NAN),
            protection_rad: factor.map_or(NAN, |factor| factor as f32 * s.covariance.sigma_max_rad()),
            cov_common: s.common.map_or([NAN; 6], |common| common.upper_rad2),
        }
    }

    /// Returns the probability that the edge is the limb, if it is known.
    pub fn p_limb(&self) -> Option<f64> {
        (!self.p_limb.is_nan()).then(|| self.p_limb.into())
    }

    /// Returns the protection level in radians, if it is known.
    pub fn protection_rad(&self) -> Option<f64> {
        (!self.protection_rad.is_nan()).then(|| self.protection_rad.into())
    }

    /// Returns the common part of the covariance, if it is known.
    pub(crate) fn common(&self) -> Option<Cov3<Cam, f64>> {
        let is_known = !self.cov_common.iter().any(|x| x.is_nan());
        is_known.then(|| Cov3::from_upper(self.cov_common.map(f64::from)))
    }
}
