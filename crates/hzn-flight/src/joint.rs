//! The joint answer of several heads, as a record for telemetry.

use hzn_core::rig::{Epoch, NoJoint};
use hzn_core::status::Status;

use crate::numbered::numbered_enum;
use crate::record::record;

numbered_enum! {
    /// What came of an epoch.
    pub enum Outcome: u8 {
        /// There is a joint answer.
        Answer = 0 => "answer",
        /// No head has an answer.
        NoHead = 1 => "no head has found the limb",
        /// The parts of the limb that the heads see do not determine the direction.
        Undetermined = 2 => "undetermined",
        /// The heads contradict each other, and no single head explains it.
        Inconsistent = 3 => "inconsistent",
    }
}

record! {
    /// The joint answer of the heads at one epoch. A set of heads has the bit 2^k for head k. What is not known is NaN.
    RigAnswer {
        /// Number of the epoch since the start, from 1.
        epoch: u32,
        /// Middle of the exposures that are used, µs since the start.
        exposure_us: u64,
        /// [`hzn_core::status::Status`] as a number; without a head that answers, that of the heads if they agree.
        status: u8,
        /// [`Outcome`] as a number.
        outcome: u8,
        /// Heads that should have a picture: their mode is flight, and their camera is not silent.
        heads_expected: u8,
        /// Heads that have a picture.
        heads_seen: u8,
        /// Heads that have an answer.
        heads_answered: u8,
        /// Heads that are in the joint answer.
        heads_used: u8,
        /// Heads that the check of each by the others excluded, or whose picture repeats another one.
        heads_excluded: u8,
        /// Heads whose picture repeats their last one, or that of another head.
        heads_repeated: u8,
        /// Memory errors since the start that cost an epoch.
        repairs: u16,
        /// Number of the picture of head 0; 0: it has none.
        picture_0: u32,
        /// Number of the picture of head 1; 0: it has none.
        picture_1: u32,
        /// Number of the picture of head 2; 0: it has none.
        picture_2: u32,
        /// Number of the picture of head 3; 0: it has none.
        picture_3: u32,
        /// Unit vector to the body, in the vehicle's frame.
        axis: [f32; 3],
        /// Covariance of `axis`, rad².
        cov: [f32; 6],
        /// The part of `cov` that the next epoch shares, rad²; NaN if it is not known of a head.
        cov_common: [f32; 6],
        /// Half-angle of the limb, rad.
        half_angle_rad: f32,
        /// Angle by which the axis moves without the head that agrees least, rad; NaN with one head.
        separation_rad: f32,
        /// Largest such angle that the covariance allows, rad.
        separation_limit_rad: f32,
        /// Angle that the error of `axis` exceeds with the probability of the configuration if at most one head is
        /// wrong, rad; NaN with one head.
        protection_rad: f32,
    }
}

const NAN: f32 = f32::NAN;

impl RigAnswer {
    /// Adds the outcome of an epoch.
    #[must_use]
    pub fn with(self, epoch: &Epoch<f32>) -> Self {
        let none = Self {
            axis: [NAN; 3],
            cov: [NAN; 6],
            cov_common: [NAN; 6],
            half_angle_rad: NAN,
            separation_rad: NAN,
            separation_limit_rad: NAN,
            protection_rad: NAN,
            ..self
        };
        let answer = match &epoch.answer {
            Ok(answer) => answer,
            // The status of the heads stays, because it says more.
            Err(NoJoint::NoHead) => return Self { outcome: Outcome::NoHead as u8, ..none },
            Err(NoJoint::Undetermined) => return none.rejected(Outcome::Undetermined),
            Err(NoJoint::Inconsistent) => return none.rejected(Outcome::Inconsistent),
        };
        let (separation_rad, separation_limit_rad) = answer.separation_rad.unwrap_or((NAN, NAN));
        Self {
            status: Status::Ok as u8,
            outcome: Outcome::Answer as u8,
            heads_used: answer.heads_used,
            heads_excluded: self.heads_excluded | answer.heads_excluded,
            axis: answer.axis.xyz(),
            cov: answer.covariance.upper_rad2,
            cov_common: answer.common.map_or([NAN; 6], |common| common.upper_rad2),
            half_angle_rad: answer.half_angle_rad,
            separation_rad,
            separation_limit_rad,
            protection_rad: answer.protection_rad.unwrap_or(NAN),
            ..self
        }
    }

    fn rejected(self, outcome: Outcome) -> Self {
        Self { status: Status::Rejected as u8, outcome: outcome as u8, ..self }
    }
}
