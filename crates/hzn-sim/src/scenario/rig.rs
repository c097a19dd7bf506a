//! The cameras of a vehicle as the heads of a rig: rig.toml, and the tables of the vehicle.

use hzn_core::body::Kind;
use hzn_files::rig::{Head, HeadMount, Rig};
use hzn_files::truth::Truth;
use hzn_files::utc;

use super::{Scenario, ScenarioError};
use crate::counter::{Counter, Stream};
use crate::error::SceneError;
use crate::flight::{Flight, FlightFrame, FrameRow};
use crate::pose::Pose;
use crate::trajectory::Path;

impl Scenario {
    /// Refuses a rig without heads.
    pub(super) fn check_rig(&self) -> Result<(), ScenarioError> {
        let Some(rig) = self.rig_file() else { return Ok(()) };
        let text = toml::to_string(&rig).map_err(|e| ScenarioError::new("[rig]", e.to_string()))?;
        let checked = hzn_files::rig::parse(&text, std::path::Path::new("rig.toml"));
        checked.map(|_| ()).map_err(|e| match e.field.as_deref() {
            Some("[[head]]") => ScenarioError::new("[rig]", format!("[[cameras]]: {}", e.what)),
            field => ScenarioError::new(field.unwrap_or("[rig]"), e.what),
        })
    }

    /// Returns the content of rig.toml; `None` if the cameras are no rig. The mounts are the told ones.
    pub fn rig_file(&self) -> Option<Rig> {
        let head = |camera: &super::CameraOnVehicle| Head {
            name: camera.name.clone(),
            sensor: None,
            pictures: camera.name.clone().into(),
            mount: Some(HeadMount {
                q_rig_from_camera_wxyz: camera.mount.q_vehicle_from_camera_wxyz,
                sigma_deg: camera.mount_error_deg,
                covariance_deg2: None,
            }),
            limb_group: None,
        };
        Some(Rig { rig: self.rig?, heads: self.cameras.iter().map(head).collect() })
    }

    /// Returns what the vehicle knows and its truth, for each time at which the cameras are triggered: the rows of its
    /// frames.csv and truth.csv. `heads` are the flights of its cameras; a row has the name of the first one's picture.
    ///
    /// # Errors
    /// A value is out of its limits, or the truth of a picture cannot be found.
    pub fn vehicle_tables(&self, heads: &[Flight]) -> Result<(Vec<FrameRow>, Vec<Truth>), ScenarioError> {
        let path = self.path()?;
        let (mut known, mut truths) = (Vec::new(), Vec::new());
        let Some(first) = heads.first() else { return Ok((known, truths)) };
        for (index, (frame, time_s)) in first.frames.iter().zip(self.times_s()).enumerate() {
            let vehicle = self.vehicle_frame(&path, frame, time_s);
            known.push(self.frame_row(&vehicle));
            for &kind in &self.bodies {
                let refused = |e: SceneError| ScenarioError::new("[trajectory]", e.to_string());
                let truth = vehicle.scene.body_truth(kind, &frame.file, time_s).map_err(refused)?;
                let limb = has_limb(heads, index, kind).map_err(refused)?;
                truths.push(Truth { limb: u8::from(limb), ..truth });
            }
        }
        Ok((known, truths))
    }

    /// Returns the picture of a camera whose axes are those of the vehicle. It is only used for its tables.
    fn vehicle_frame(&self, path: &Path, frame: &FlightFrame, time_s: f64) -> FlightFrame {
        let state = path.state(time_s);
        let q = state.fixed_from_vehicle;
        let mut vehicle = frame.clone();
        (vehicle.time_s, vehicle.stamp) = (time_s, None);
        vehicle.utc = Some(utc::iso8601(path.unix_s(time_s)));
        vehicle.scene.pose =
            Pose { position_m: state.position_m.into(), q_fixed_from_camera_wxyz: [q.w, q.i, q.j, q.k] };
        if let Some(motion) = &mut vehicle.scene.motion {
            motion.rate_radps = path.vehicle_rate_radps(time_s);
        }
        // A frozen picture has the seed of another one.
        vehicle.scene.seed = Counter::new(self.seed, Stream::Gnss).bits(time_s.to_bits());
        vehicle
    }
}

/// Returns whether a camera sees the limb at the time of a picture.
fn has_limb(heads: &[Flight], index: usize, kind: Kind) -> Result<bool, SceneError> {
    for frame in heads.iter().filter_map(|flight| flight.frames.get(index)) {
        if frame.scene.has_limb(kind)? {
            return Ok(true);
        }
    }
    Ok(false)
}
