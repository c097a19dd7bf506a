//! One picture from a given pose, for a simulation that moves the camera itself.

use hzn_core::camera;

use super::{Scenario, ScenarioError};
use crate::pose::Pose;
use crate::scene::Scene;

impl Scenario {
    /// Returns the scene of one picture: the world, lens errors, exposure and detector of this scenario, as `camera`
    /// sees them from `pose` at a UTC (seconds since 1970). The clouds are those of the scenario's own pictures. The
    /// scene has no motion blur and no parts of the vehicle, because these belong to the scenario's trajectory and
    /// camera. `noise_seed` draws the noise.
    ///
    /// # Errors
    /// The camera is inside the body, or the Sun of an ellipsoid is known only to the trajectory.
    pub fn view(
        &self,
        camera: &camera::Config,
        pose: Pose,
        unix_s: f64,
        noise_seed: u64,
    ) -> Result<Scene, ScenarioError> {
        let sun = self.ellipsoid().map(|body| body.sun.ok_or_else(without_sun)).transpose()?;
        let seen = Self { camera: camera.clone(), ..self.clone() };
        let mut scene = seen.world_at(pose, unix_s, sun, unix_s)?;
        scene.seed = noise_seed;
        let mut scenes = [(unix_s, scene)];
        self.exposure.set(&mut scenes).map_err(|e| ScenarioError::new("[exposure]", e.to_string()))?;
        let [(_, scene)] = scenes;
        Ok(scene)
    }
}

fn without_sun() -> ScenarioError {
    ScenarioError::new(
        "[world] ellipsoid.sun",
        "is needed for a picture from a given pose; in this scene the trajectory has the direction to the Sun",
    )
}
