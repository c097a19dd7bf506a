//! Several cameras on a vehicle, their mounts and their clocks.

use hzn_core::config::Mount;
use hzn_files::utc;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::{Part, Scenario, ScenarioError};
use crate::counter::{Counter, Stream};
use crate::flight::Stamp;
use crate::pose::Pose;
use crate::trajectory::Path;

/// `[clock]`: the clock of a camera. A picture that is taken at t gets the time stamp t + offset + latency + jitter.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Clock {
    /// Time of the camera's clock minus that of the vehicle, seconds.
    pub offset_s: f64,
    /// Time from the picture to its time stamp, seconds.
    pub latency_s: f64,
    /// 1-sigma of the random part of that time, seconds.
    pub jitter_s: f64,
}

impl Clock {
    /// Returns whether the stamps are the true times.
    pub fn is_right(&self) -> bool {
        *self == Self::default()
    }
}

/// `[fault]`: what goes wrong with a camera in flight. sensor.toml and rig.toml do not know of it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Fault {
    /// Time from which the camera repeats its last picture before it, seconds; the truth of such a picture is that of
    /// the repeated one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frozen_from_s: Option<f64>,
    /// Rotation of the mount about the camera's axes, degrees.
    pub turn_deg: [f64; 3],
    /// Time from which the mount is turned, seconds.
    pub turn_from_s: f64,
    /// Time by which the pictures are taken later than those of the other cameras, seconds; the time stamps say so.
    pub late_s: f64,
}

impl Fault {
    /// Returns whether the camera has no fault.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the pose of the camera at a time, with its turned mount.
    pub(super) fn turn(&self, pose: &Pose, time_s: f64) -> Pose {
        let is_turned = time_s >= self.turn_from_s && self.turn_deg != [0.0; 3];
        if is_turned { pose.disturbed(self.turn_deg.map(f64::to_radians)) } else { *pose }
    }
}

/// `[[cameras]]`: one of several cameras on a vehicle. Lens, bodies and times are those of the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CameraOnVehicle {
    /// Short name: that of the folder, and the beginning of the names of its pictures.
    pub name: String,
    /// The told attitude of the camera on the vehicle.
    #[cfg_attr(feature = "schema", schemars(schema_with = "crate::foreign_schema::mount"))]
    pub mount: Mount,
    /// Angle between the true mount and the told one, 1-sigma about each axis, degrees.
    #[serde(default, skip_serializing_if = "super::is_zero")]
    pub mount_error_deg: f64,
    /// The clock of the camera.
    #[serde(default, skip_serializing_if = "Clock::is_right")]
    pub clock: Clock,
    /// Faults of the camera.
    #[serde(default, skip_serializing_if = "Fault::is_none")]
    pub fault: Fault,
    /// Parts of the vehicle in the pictures of the camera.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vehicle: Vec<Part>,
}

impl Scenario {
    /// Returns the scene of each camera; of a scene with one camera, the scene itself.
    pub fn by_camera(&self) -> Vec<Self> {
        if self.cameras.is_empty() {
            return vec![self.clone()];
        }
        let one = |(number, camera): (u32, &CameraOnVehicle)| Self {
            name: camera.name.clone(),
            mount: Some(camera.mount),
            attitude_mount: self.pointed_mount(),
            mount_error_deg: camera.mount_error_deg,
            clock: camera.clock,
            fault: camera.fault,
            rig: None,
            vehicle: camera.vehicle.clone(),
            camera_number: number,
            cameras: Vec::new(),
            ..self.clone()
        };
        (0..).zip(&self.cameras).map(one).collect()
    }

    /// Returns the scene of one camera by its name.
    ///
    /// # Errors
    /// There is no camera with this name.
    pub fn with_camera(&self, name: &str) -> Result<Self, ScenarioError> {
        let found = self.by_camera().into_iter().find(|one| one.name == name && !self.cameras.is_empty());
        found.ok_or_else(|| {
            let names: Vec<&str> = self.cameras.iter().map(|c| c.name.as_str()).collect();
            let all = if names.is_empty() { "no [[cameras]]".to_owned() } else { names.join(", ") };
            ScenarioError::new("[[cameras]]", format!("there is no camera {name}; the scene has {all}"))
        })
    }

    /// Returns the told mount of the camera that `[attitude]` describes. All cameras of a vehicle have the same one, so
    /// that the vehicle has one attitude.
    pub(super) fn pointed_mount(&self) -> Option<Mount> {
        self.attitude_mount.or(self.cameras.first().map(|first| first.mount)).or(self.mount)
    }

    /// Returns the true attitude of the camera on the vehicle (rotation from the camera to the body frame). It differs
    /// from the told one by a random rotation in the camera frame.
    pub fn true_q_vehicle_from_camera_wxyz(&self) -> [f64; 4] {
        let told = self.mount.map_or([1.0, 0.0, 0.0, 0.0], |m| m.q_vehicle_from_camera_wxyz);
        if self.mount_error_deg == 0.0 {
            return told;
        }
        let draws = Counter::new(self.picture_seed(), Stream::Mount);
        let error = Vector3::from([0, 1, 2].map(|i| self.mount_error_deg.to_radians() * draws.normal(i)));
        let [w, x, y, z] = told;
        let told = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let q = told * UnitQuaternion::from_scaled_axis(error);
        [q.w, q.i, q.j, q.k]
    }

    /// Returns the seed of what differs from camera to camera.
    pub(super) fn picture_seed(&self) -> u64 {
        self.seed.wrapping_add(u64::from(self.camera_number).wrapping_mul(0x5851_F42D_4C95_7F2D))
    }

    /// Returns the time stamp of a picture; `None` if the clock is right.
    pub(super) fn stamp(&self, path: &Path, index: usize, time_s: f64) -> Option<Stamp> {
        if self.clock.is_right() {
            return None;
        }
        let Clock { offset_s, latency_s, jitter_s } = self.clock;
        let draws = Counter::new(self.picture_seed(), Stream::Clock);
        let time_s = time_s + offset_s + latency_s + jitter_s * draws.normal(index as u64);
        let utc = utc::iso8601(path.unix_s(time_s));
        Some(Stamp { time_s, utc, position_m: path.point(time_s).position_m.into() })
    }

    /// Refuses what a scene with several cameras cannot have.
    pub(super) fn check_cameras(&self) -> Result<(), ScenarioError> {
        if self.cameras.is_empty() {
            return Ok(());
        }
        let own =
            self.mount.is_some() || self.mount_error_deg != 0.0 || !self.clock.is_right() || !self.fault.is_none();
        if own || !self.vehicle.is_empty() {
            let what =
                "replaces mount, mount_error_deg, clock, fault and vehicle of the scene: give them for each camera";
            return Err(ScenarioError::new("[[cameras]]", what));
        }
        for (i, camera) in self.cameras.iter().enumerate() {
            if self.cameras.iter().take(i).any(|c| c.name == camera.name) {
                return Err(ScenarioError::new("[[cameras]] name", format!("{} stands twice", camera.name)));
            }
        }
        let in_camera =
            |name: &str, e: ScenarioError| ScenarioError::new(format!("[[cameras]] of {name}: {}", e.field), e.what);
        self.by_camera().iter().try_for_each(|one| one.check().map_err(|e| in_camera(&one.name, e)))
    }

    /// Refuses a scene with several cameras where one is expected.
    pub(super) fn check_single(&self) -> Result<(), ScenarioError> {
        match self.cameras.as_slice() {
            [] => Ok(()),
            all => {
                let names: Vec<&str> = all.iter().map(|c| c.name.as_str()).collect();
                let what = format!("the scene has the cameras {}; choose one of them", names.join(", "));
                Err(ScenarioError::new("[[cameras]]", what))
            }
        }
    }
}
