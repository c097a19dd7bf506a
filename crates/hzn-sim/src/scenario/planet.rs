//! Scenes with an ellipsoid instead of the Earth.

use hzn_core::body::{self, Kind};
use serde::{Deserialize, Serialize};

use super::{Scenario, ScenarioError};
use crate::counter::{Counter, Stream};
use crate::ellipsoid::Ellipsoid;
use crate::flight::FlightFrame;
use crate::scene::World;
use crate::trajectory::{Attitude, Path, Trajectory};

/// A row of frames.csv for a scene with an ellipsoid: what the camera knows about one picture. The fields are the
/// file's columns, in this order; columns that the scene does not know are left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyFrameRow {
    /// Name of the picture's file.
    pub file: String,
    /// Time in seconds.
    pub time_s: f64,
    /// Prior attitude as a quaternion from camera to body-fixed axes, scalar part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub qw: Option<f64>,
    /// First vector component of the prior attitude.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub qx: Option<f64>,
    /// Second vector component of the prior attitude.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub qy: Option<f64>,
    /// Third vector component of the prior attitude.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub qz: Option<f64>,
    /// 1-sigma of the prior attitude about each axis, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude_sigma_deg: Option<f64>,
    /// Direction to the Sun in the camera frame, first component of the unit vector.
    pub sun_x: f64,
    /// Second component of the direction to the Sun.
    pub sun_y: f64,
    /// Third component of the direction to the Sun.
    pub sun_z: f64,
    /// Measured distance from the camera to the centre of the body, kilometres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_km: Option<f64>,
    /// 1-sigma of that distance, kilometres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_sigma_km: Option<f64>,
}

impl Scenario {
    /// Returns the body of a scene with an ellipsoid; `None` for a scene at the Earth.
    pub fn ellipsoid(&self) -> Option<&Ellipsoid> {
        match &self.world {
            World::Ellipsoid(body) => Some(body),
            World::Plain | World::Visible(_) | World::Infrared(_) => None,
        }
    }

    /// Returns the names of the bodies that the sensor looks for, as in truth.csv.
    pub fn body_names(&self) -> Vec<&str> {
        match self.ellipsoid() {
            Some(body) => vec![body.kind()],
            None => self.bodies.iter().map(|kind| kind.name()).collect(),
        }
    }

    /// Returns the table `[body]` of sensor.toml for a scene with an ellipsoid: its kind, its radii if it has no name,
    /// and the limb height of the scene with its sigma.
    pub fn body_table(&self) -> Option<toml::Table> {
        let body = self.ellipsoid()?;
        let mut table = toml::Table::new();
        table.insert("kind".into(), body.kind().into());
        if body.name.is_none() {
            table.insert("radii_km".into(), body.radii_km().to_vec().into());
        }
        table.insert("limb_height_km".into(), rounded(body.limb_height_km()).into());
        table.insert("limb_height_sigma_km".into(), body.limb_height_sigma_km.into());
        Some(table)
    }

    /// Returns the row of frames.csv for a picture of an ellipsoid: attitude, direction to the Sun and range, as far as
    /// `[known]` has their errors. The position is not known: the sensor measures it. `None` for a scene at the Earth.
    pub fn body_frame_row(&self, frame: &FlightFrame) -> Option<BodyFrameRow> {
        self.ellipsoid()?;
        let attitude = self.known.attitude_sigma_deg.map(|deg| frame.told_q_fixed_from_camera_wxyz(deg.to_radians()));
        let [qw, qx, qy, qz] = [0, 1, 2, 3].map(|i| attitude.map(|q| q[i]));
        let pose = &frame.scene.pose;
        let sun = frame.scene.sun_direction().ok()?;
        let [sun_x, sun_y, sun_z] = (pose.matrix().transpose() * sun).into();
        let range_km = pose.position_m.iter().map(|x| x * x).sum::<f64>().sqrt() * 1e-3;
        let draws = Counter::new(frame.scene.seed, Stream::Encounter);
        let range_sigma_km = self.known.range_sigma_km;
        Some(BodyFrameRow {
            file: frame.file.clone(),
            time_s: frame.stamp.as_ref().map_or(frame.time_s, |stamp| stamp.time_s),
            qw,
            qx,
            qy,
            qz,
            attitude_sigma_deg: self.known.attitude_sigma_deg,
            sun_x,
            sun_y,
            sun_z,
            range_km: range_sigma_km.map(|sigma| range_km + sigma * draws.normal(0)),
            range_sigma_km,
        })
    }

    /// Returns the sensor's configuration of an ellipsoid.
    pub(super) fn ellipsoid_config(body: &Ellipsoid) -> body::Config {
        let named = body.name.as_deref().and_then(|name| Kind::ALL.iter().find(|kind| kind.name() == name));
        let config = match named {
            // A Moon by name is the one that is seen from the Earth; here it is a body to measure.
            Some(Kind::Moon) | None => body::Config::of_kind(Kind::Ellipsoid, Some(body.radii_km())),
            Some(kind) => body::Config::of_kind(*kind, None),
        };
        body::Config {
            limb_height_km: body.limb_height_km(),
            limb_height_sigma_km: body.limb_height_sigma_km,
            ..config
        }
    }

    /// Returns the trajectory with the size of the body that an encounter needs.
    pub(super) fn sized_trajectory(&self) -> Trajectory {
        let mut trajectory = self.trajectory.clone();
        if let (Trajectory::Encounter(encounter), Some(body)) = (&mut trajectory, self.ellipsoid()) {
            encounter.radius_km = body.mean_radius_km();
        }
        trajectory
    }

    /// Returns the direction to the Sun (body-fixed) for a picture of an ellipsoid. `check_ellipsoid` refuses a scene
    /// that has none.
    pub(super) fn body_sun(&self, body: &Ellipsoid, path: &Path, time_s: f64) -> [f64; 3] {
        path.sun(time_s).or(body.sun).unwrap_or_default()
    }

    /// Refuses what does not belong to a scene with an ellipsoid, or to one without.
    pub(super) fn check_ellipsoid(&self) -> Result<(), ScenarioError> {
        let Some(body) = self.ellipsoid() else {
            let at_body = matches!(self.trajectory, Trajectory::Encounter(_));
            let field = if at_body { "[trajectory] encounter" } else { "[known] range_sigma_km" };
            if at_body || self.known.range_sigma_km.is_some() {
                return Err(ScenarioError::new(field, "is allowed only with [world.ellipsoid]"));
            }
            return Ok(());
        };
        body.check().map_err(|(key, rule)| ScenarioError::new(format!("[world] ellipsoid.{key}"), rule))?;
        let refused = |field: &str, what: &str| Err(ScenarioError::new(field, what));
        match (&self.trajectory, &self.attitude, body.sun) {
            (Trajectory::Encounter(_), Attitude::Aimed(_), None) | (Trajectory::Table(_), Attitude::Table, Some(_)) => {
            }
            (Trajectory::Encounter(_), _, Some(_)) => {
                return refused(
                    "[world] ellipsoid.sun",
                    "is not allowed with [trajectory.encounter], which has phase_deg",
                );
            }
            (Trajectory::Table(_), _, None) => {
                return refused(
                    "[world] ellipsoid.sun",
                    "is missing: [trajectory.table] needs the direction to the Sun",
                );
            }
            (Trajectory::Encounter(_), ..) => {
                return refused("[attitude]", "must be aimed with [trajectory.encounter]");
            }
            (Trajectory::Table(_), ..) => {
                return refused("[attitude]", "must be \"table\" with [trajectory.table] and [world.ellipsoid]");
            }
            (Trajectory::Rocket(_) | Trajectory::Orbit(_), ..) => {
                return refused(
                    "[trajectory]",
                    "must be encounter or table with [world.ellipsoid]: the others are for the Earth",
                );
            }
        }
        if self.bodies != [Kind::Earth] {
            return refused("bodies", "is not allowed with [world.ellipsoid], which is the body");
        }
        if self.imu.is_some() || self.gnss.is_some() {
            return refused(
                "[imu], [gnss]",
                "are not allowed with [world.ellipsoid]: they are for flights at the Earth",
            );
        }
        if self.known.position_sigma_km != 0.0 {
            return refused("[known] position_sigma_km", "is not allowed with [world.ellipsoid]; use range_sigma_km");
        }
        Ok(())
    }
}

/// Returns a length in kilometres, rounded to a metre.
fn rounded(km: f64) -> f64 {
    (km * 1e3).round() / 1e3
}
