//! The camera and the world in front of it.

use hzn_core::{body, camera};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::detector::Detector;
use crate::ellipsoid::Ellipsoid;
use crate::error::SceneError;
use crate::foreground::Foreground;
use crate::halves::Halves;
use crate::infrared::Infrared;
use crate::motion::Motion;
use crate::optics::Optics;
use crate::pose::Pose;
use crate::texture::Clouds;
use crate::visible::Visible;

/// All inputs of one picture, for the renderer and for the truth. Brightness is a fraction of full scale.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The lens and the size of the picture.
    pub camera: camera::Config,
    /// Position and attitude of the camera.
    pub pose: Pose,
    /// The body. Its `limb_height_km` is the height at which the rendered limb has half of its brightness.
    #[serde(default)]
    pub body: body::Config,
    /// Rows of (geodetic latitude in degrees, limb height in kilometres), for a limb height that depends on the
    /// latitude of the tangent point. Between rows it is linear. Without rows, `body.limb_height_km` applies
    /// everywhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limb_height_by_latitude_km: Vec<[f64; 2]>,
    /// Kind of world. `profile`, `disc`, `light` and `sky` belong to the plain world, `light` also to the visible one.
    #[serde(default)]
    pub world: World,
    /// Fall-off of the brightness outside the limb.
    #[serde(default)]
    pub profile: Profile,
    /// Brightness inside the limb.
    #[serde(default)]
    pub disc: Disc,
    /// Lit part of the body.
    #[serde(default)]
    pub light: Light,
    /// Sky outside the limb.
    #[serde(default)]
    pub sky: Sky,
    /// Position of the Moon in ECEF, metres; `None` without a Moon.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moon_ecef_m: Option<[f64; 3]>,
    /// Structure of the vehicle in front of everything.
    #[serde(default)]
    pub foreground: Vec<Foreground>,
    /// Imperfections of the lens.
    #[serde(default)]
    pub optics: Optics,
    /// Rotation during the picture; `None` for an instantaneous picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Motion>,
    /// Two half pictures that are taken one after the other; `None` for a picture that is taken at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub halves: Option<Halves>,
    /// Factor from light to fractions of full scale; light above 1 is clipped.
    #[serde(default = "one")]
    pub exposure: f64,
    /// Detector, which turns light into numbers.
    #[serde(default)]
    pub detector: Detector,
    /// Seed of the noise. The same scene and seed give the same picture on any number of threads.
    #[serde(default)]
    pub seed: u64,
}

fn one() -> f64 {
    1.0
}

/// Kind of world in front of the camera.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum World {
    /// A body of uniform brightness with clouds and a band, described by `profile`, `disc`, `light` and `sky`. It is
    /// meant for tests and tables in which only one quantity changes.
    #[default]
    Plain,
    /// The Earth in sunlight.
    Visible(Box<Visible>),
    /// The Earth in the infrared.
    Infrared(Infrared),
    /// A planet or moon as an ellipsoid in sunlight. It replaces the scene's `body`, of which only the limb height and
    /// its sigma count. The pose and the direction to the Sun are body-fixed.
    Ellipsoid(Box<Ellipsoid>),
}

/// Brightness profile outside the limb.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// A step at the limb height.
    #[default]
    Sharp,
    /// Brightness is constant up to a saturation height, above it exp(−height/scale). The saturation height is
    /// `scale` · ln 2 below the limb height, so half brightness is at the limb height.
    Exponential {
        /// Height over which the brightness falls by e, kilometres.
        scale_km: f64,
    },
}

/// Surface, clouds and band inside the limb.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Disc {
    /// Brightness of the surface.
    pub surface: f64,
    /// Clouds over the surface.
    pub clouds: Option<Clouds>,
    /// A bright band along the limb, in front of surface and clouds.
    pub band: Option<Band>,
}

impl Default for Disc {
    fn default() -> Self {
        Self { surface: 0.8, clouds: None, band: None }
    }
}

/// Light of the atmosphere along the limb.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Band {
    /// Brightness of the band.
    pub brightness: f64,
    /// Depth of the band inward from the limb, in kilometres of tangent height.
    pub depth_km: f64,
    /// Width over which the inner edge of the band fades, in kilometres of tangent height, centred on `depth_km`; 0 is
    /// a step.
    pub fade_km: f64,
}

/// Lit part of the body; the rest is as dark as the sky.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Light {
    /// The whole body is lit.
    #[default]
    Full,
    /// The side towards the Sun is lit, with a terminator.
    Sun {
        /// Direction to the Sun in ECEF; it need not have unit length.
        direction: [f64; 3],
        /// Width of the twilight zone in radians of solar elevation, centred on the terminator.
        twilight_rad: f64,
    },
    /// A range of azimuth about the limb axis is lit.
    Sector {
        /// Middle of the lit range in radians: 0 is east of the position, π/2 is the direction axis × east.
        centre_rad: f64,
        /// Half-width of the lit range in radians; π lights the whole body.
        half_width_rad: f64,
        /// Width of the transition in radians, centred on the ends of the range.
        fade_rad: f64,
    },
}

/// The sky outside the limb.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sky {
    /// Brightness of the sky.
    pub brightness: f64,
    /// Number of stars over the whole sphere.
    pub stars: u32,
    /// Light of the brightest star, in full scales of one pixel; the faintest star has a hundredth of it.
    pub star_brightness: f64,
    /// Seed of the stars; another seed gives other stars.
    pub seed: u64,
}

impl Default for Sky {
    fn default() -> Self {
        Self { brightness: 0.02, stars: 0, star_brightness: 3.0, seed: 1 }
    }
}

impl Scene {
    /// Returns the direction to the Sun (ECEF or body-fixed, unit length).
    ///
    /// # Errors
    /// Fails if the scene has no Sun, or if its direction has no length.
    pub(crate) fn sun_direction(&self) -> Result<Vector3<f64>, SceneError> {
        match self.light {
            Light::Sun { direction, .. } => Vector3::from(direction).try_normalize(1e-12).ok_or(SceneError::Sun),
            Light::Full | Light::Sector { .. } => Err(SceneError::Sun),
        }
    }

    /// Returns a uniformly bright Earth with a sharp limb at the default height, 17 km, in a dark sky. The detector has
    /// no noise.
    pub fn new(camera: camera::Config, pose: Pose) -> Self {
        Self {
            camera,
            pose,
            body: body::Config::default(),
            limb_height_by_latitude_km: Vec::new(),
            world: World::default(),
            profile: Profile::default(),
            disc: Disc::default(),
            light: Light::default(),
            sky: Sky::default(),
            moon_ecef_m: None,
            foreground: Vec::new(),
            optics: Optics::default(),
            motion: None,
            halves: None,
            exposure: 1.0,
            detector: Detector::default(),
            seed: 0,
        }
    }
}
