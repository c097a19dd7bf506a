//! The position of the vehicle over time: a rocket, an orbit, an encounter, or the rows of a table.

use serde::{Deserialize, Serialize};

use hzn_nav::ephemeris;

use super::encounter::{Encounter, PreparedEncounter, Sight};
use super::orbit::{Ellipse, Orbit};
use super::point::Point;
use super::rocket::{Ascent, Rocket};
use super::table::{Table, TableRows};

/// The trajectory of the vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Trajectory {
    /// A sounding rocket; time 0 is lift-off.
    Rocket(Rocket),
    /// An orbit of the Earth.
    Orbit(Orbit),
    /// A planet or moon from a given range and side; for `[world.ellipsoid]`.
    Encounter(Encounter),
    /// Rows of a CSV file.
    Table(Table),
}

/// [`Trajectory`], prepared for evaluation.
#[derive(Debug, Clone)]
pub(super) struct PreparedTrajectory {
    curve: Curve,
    start_unix_s: f64,
}

#[derive(Debug, Clone)]
enum Curve {
    Rocket(Ascent),
    Orbit(Ellipse),
    Encounter(PreparedEncounter),
    Table(TableRows),
}

impl PreparedTrajectory {
    /// Prepares a trajectory. `start_unix_s` is the UTC of time 0, in seconds since 1970. In case of an error, returns
    /// the key with the invalid value, and a message.
    pub(super) fn try_new(
        trajectory: &Trajectory,
        [from_s, to_s]: [f64; 2],
        start_unix_s: f64,
        seed: u64,
    ) -> Result<Self, (String, String)> {
        let curve = match trajectory {
            Trajectory::Rocket(rocket) => Curve::Rocket(Ascent::try_new(rocket, to_s, start_unix_s)?),
            Trajectory::Orbit(orbit) => Curve::Orbit(Ellipse::try_new(orbit, start_unix_s)?),
            Trajectory::Encounter(encounter) => {
                Curve::Encounter(PreparedEncounter::try_new(encounter, [from_s, to_s], seed)?)
            }
            Trajectory::Table(table) => Curve::Table(table.parse_rows([from_s, to_s])?),
        };
        Ok(Self { curve, start_unix_s })
    }

    /// Returns UTC in seconds since 1970.
    pub(super) fn unix_s(&self, time_s: f64) -> f64 {
        self.start_unix_s + time_s
    }

    /// Returns Greenwich sidereal time in radians.
    pub(super) fn sidereal_rad(&self, time_s: f64) -> f64 {
        ephemeris::sidereal_rad(self.unix_s(time_s))
    }

    pub(super) fn point(&self, time_s: f64) -> Point {
        match &self.curve {
            Curve::Rocket(ascent) => ascent.point(time_s),
            Curve::Orbit(ellipse) => ellipse.point(time_s),
            Curve::Encounter(encounter) => encounter.point(time_s),
            Curve::Table(rows) => rows.point(time_s),
        }
    }

    /// Returns the ascent of a rocket; `None` for other trajectories.
    pub(super) fn ascent(&self) -> Option<&Ascent> {
        match &self.curve {
            Curve::Rocket(ascent) => Some(ascent),
            Curve::Orbit(_) | Curve::Encounter(_) | Curve::Table(_) => None,
        }
    }

    /// Returns the rows of a table; `None` for other trajectories.
    pub(super) fn rows(&self) -> Option<&TableRows> {
        match &self.curve {
            Curve::Table(rows) => Some(rows),
            Curve::Rocket(_) | Curve::Orbit(_) | Curve::Encounter(_) => None,
        }
    }

    /// Returns the directions of an encounter at a time; `None` for other trajectories.
    pub(super) fn sight(&self, time_s: f64) -> Option<Sight> {
        match &self.curve {
            Curve::Encounter(encounter) => Some(encounter.sight(time_s)),
            Curve::Rocket(_) | Curve::Orbit(_) | Curve::Table(_) => None,
        }
    }
}
