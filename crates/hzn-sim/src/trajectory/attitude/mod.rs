//! The rotation of the vehicle.
//!
//! The x axis of the vehicle points forward, along a rocket; y and z are lateral. The scene's `[mount]` has the
//! attitude of the camera on the vehicle.

mod aimed;
mod pointing;
mod spin;
mod steps;
mod tumble;

pub use aimed::Aimed;
pub use pointing::{Pointing, Towards};
pub use spin::Spin;
pub use tumble::Tumble;

use core::f64::consts::TAU;

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::position::PreparedTrajectory;
use crate::counter::{Counter, Stream};
use steps::AttitudeSteps;

/// The rotation of the vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Attitude {
    /// A sounding rocket: spin-up under thrust, yo-yo, then drift under rate control.
    Spin(Spin),
    /// The camera looks down at an angle that changes evenly over the pictures.
    Pointing(Pointing),
    /// The camera looks at Sun, Moon or Earth, one after the other.
    Towards(Towards),
    /// A rigid body without torque.
    Tumble(Tumble),
    /// The camera is aimed at a planet or moon; for `[trajectory.encounter]`.
    Aimed(Aimed),
    /// The attitude comes from `[trajectory] table`.
    Table,
}

/// [`Attitude`], prepared for evaluation.
#[derive(Debug, Clone)]
pub(super) enum PreparedAttitude {
    Steps(AttitudeSteps),
    Pointing { pointing: Pointing, span_s: [f64; 2] },
    Towards { towards: Towards, span_s: [f64; 2], phase: f64 },
    Aimed { aimed: Aimed, span_s: [f64; 2], phase: f64 },
    Table,
}

impl PreparedAttitude {
    /// Prepares an attitude. In case of an error, returns the key with the invalid value, and a message.
    pub(super) fn try_new(
        attitude: &Attitude,
        trajectory: &PreparedTrajectory,
        span_s: [f64; 2],
        seed: u64,
    ) -> Result<Self, (String, String)> {
        Self::prepare(attitude, trajectory, span_s, seed)
            .map_err(|(key, what)| (format!("[attitude] {key}"), what.to_owned()))
    }

    fn prepare(
        attitude: &Attitude,
        trajectory: &PreparedTrajectory,
        span_s: [f64; 2],
        seed: u64,
    ) -> Result<Self, (&'static str, &'static str)> {
        match attitude {
            Attitude::Spin(spin) => {
                let ascent = trajectory.ascent().ok_or(("spin", "is allowed only with [trajectory.rocket]"))?;
                spin.check()?;
                Ok(Self::Steps(spin.integrate(trajectory, ascent, span_s[1], seed)))
            }
            Attitude::Tumble(tumble) => {
                tumble.check()?;
                Ok(Self::Steps(tumble.integrate(span_s, seed)))
            }
            Attitude::Pointing(pointing) => {
                pointing.check()?;
                Ok(Self::Pointing { pointing: *pointing, span_s })
            }
            Attitude::Towards(towards) => {
                towards.check()?;
                let phase = Counter::new(seed, Stream::Drift).uniform(0) * TAU;
                Ok(Self::Towards { towards: towards.clone(), span_s, phase })
            }
            Attitude::Aimed(aimed) => {
                aimed.check()?;
                trajectory.sight(span_s[0]).ok_or(("aimed", "is allowed only with [trajectory.encounter]"))?;
                let phase = Counter::new(seed, Stream::Drift).uniform(0) * TAU;
                Ok(Self::Aimed { aimed: *aimed, span_s, phase })
            }
            Attitude::Table => match trajectory.rows() {
                Some(rows) if rows.has_attitudes() => Ok(Self::Table),
                Some(_) => Err(("table", "the file of [trajectory] table has no columns qw, qx, qy, qz")),
                None => Err(("table", "is allowed only with [trajectory.table]")),
            },
        }
    }

    /// Returns the attitude of the vehicle at a time.
    pub(super) fn fixed_from_vehicle(
        &self,
        trajectory: &PreparedTrajectory,
        camera_to_body: &UnitQuaternion<f64>,
        time_s: f64,
    ) -> UnitQuaternion<f64> {
        let fixed_from_camera = match self {
            Self::Steps(steps) => {
                let q = steps.interpolate(time_s);
                let earth = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), trajectory.sidereal_rad(time_s));
                return earth.inverse() * q;
            }
            Self::Pointing { pointing, span_s } => {
                pointing.fixed_from_camera(trajectory.point(time_s).position_m, *span_s, time_s)
            }
            Self::Towards { towards, span_s, phase } => {
                let times_s = [time_s, trajectory.unix_s(time_s)];
                towards.fixed_from_camera(trajectory.point(time_s).position_m, *span_s, times_s, *phase)
            }
            Self::Aimed { aimed, span_s: [from_s, to_s], phase } => {
                let fraction = ((time_s - from_s) / (to_s - from_s).max(1e-9)).clamp(0.0, 1.0);
                let aim = |sight| aimed.fixed_from_camera(&sight, fraction, *phase);
                // An aimed attitude was prepared only for an encounter.
                trajectory.sight(time_s).map_or_else(UnitQuaternion::identity, aim)
            }
            // The attitude of a table was prepared only for a table with attitudes.
            Self::Table => {
                trajectory.rows().map_or_else(UnitQuaternion::identity, |rows| rows.fixed_from_camera(time_s))
            }
        };
        fixed_from_camera * camera_to_body.inverse()
    }
}
