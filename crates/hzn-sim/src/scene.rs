//! What is in front of the camera, and the camera itself.

use hzn_core::{body, camera};
use serde::{Deserialize, Serialize};

use crate::detector::Detector;
use crate::foreground::Foreground;
use crate::infrared::Infrared;
use crate::motion::Motion;
use crate::optics::Optics;
use crate::pose::Pose;
use crate::texture::Clouds;
use crate::visible::Visible;

/// One picture's worth of world: everything the renderer and the truth need. Brightness is a fraction of full scale.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The lens and the size of the picture.
    pub camera: camera::Config,
    /// Where the camera is.
    pub pose: Pose,
    /// The body. Its `limb_height_km` is where the rendered edge stands at half brightness.
    #[serde(default)]
    pub body: body::Config,
    /// Rows of (geodetic latitude in degrees, limb height in kilometres) where the limb height depends on the latitude
    /// of the tangent point; in between it is linear. Empty: `body.limb_height_km` everywhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limb_height_by_latitude_km: Vec<[f64; 2]>,
    /// What kind of world it is; the next four belong to the plain one, `light` to the visible one too.
    #[serde(default)]
    pub world: World,
    /// How brightness falls off outside the limb.
    #[serde(default)]
    pub profile: Profile,
    /// What is seen inside the limb.
    #[serde(default)]
    pub disc: Disc,
    /// Which part of the body is lit.
    #[serde(default)]
    pub light: Light,
    /// What is seen outside.
    #[serde(default)]
    pub sky: Sky,
    /// Position of the Moon in ECEF, metres, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moon_ecef_m: Option<[f64; 3]>,
    /// Structure of the vehicle in front of everything.
    #[serde(default)]
    pub foreground: Vec<Foreground>,
    /// Imperfections of the lens.
    #[serde(default)]
    pub optics: Optics,
    /// Rotation during the picture; none: it is taken at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Motion>,
    /// What light is multiplied by to become fractions of full scale; what exceeds 1 is lost.
    #[serde(default = "one")]
    pub exposure: f64,
    /// From light to numbers.
    #[serde(default)]
    pub detector: Detector,
    /// Seed of the noise. The same scene and seed give the same picture on any number of threads.
    #[serde(default)]
    pub seed: u64,
}

fn one() -> f64 {
    1.0
}

/// What kind of world is in front of the camera.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum World {
    /// A body of uniform brightness under clouds and a band, as `profile`, `disc`, `light` and `sky` say: for tests and
    /// tables, where everything but one thing should stay the same.
    #[default]
    Plain,
    /// The Earth in sunlight.
    Visible(Box<Visible>),
    /// The Earth in the infrared.
    Infrared(Infrared),
}

/// The limb's profile, outward.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// A step at the limb height.
    #[default]
    Sharp,
    /// Constant up to a saturation height, above it exp(−height/scale). The saturation height is `scale` · ln 2 below
    /// the limb height, so that half brightness is at the limb height.
    Exponential {
        /// Height over which brightness falls by e, kilometres.
        scale_km: f64,
    },
}

/// What is seen inside the limb.
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
    /// How far the band reaches inward from the limb, in kilometres of tangent height.
    pub depth_km: f64,
    /// Over how many kilometres of tangent height its inner edge fades, centred on `depth_km`; 0 is a step.
    pub fade_km: f64,
}

/// Which part of the body is lit; the rest is as dark as the sky.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Light {
    /// All of it.
    #[default]
    Full,
    /// The side towards the Sun, with a terminator.
    Sun {
        /// Direction to the Sun in ECEF; need not have unit length.
        direction: [f64; 3],
        /// Width of the twilight zone in radians of solar elevation, centred on the terminator.
        twilight_rad: f64,
    },
    /// A range of azimuth about the limb axis.
    Sector {
        /// Middle of the lit range in radians: 0 = east of the position, π/2 = the direction axis × east.
        centre_rad: f64,
        /// Half the lit range in radians; π lights all.
        half_width_rad: f64,
        /// Width of the transition in radians, centred on the ends of the range.
        fade_rad: f64,
    },
}

/// What is seen outside the limb.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sky {
    /// Brightness.
    pub brightness: f64,
    /// Number of stars over the whole sphere.
    pub stars: u32,
    /// Light of the brightest star, in full scales of one pixel; the faintest has a hundredth of it.
    pub star_brightness: f64,
    /// Which stars.
    pub seed: u64,
}

impl Default for Sky {
    fn default() -> Self {
        Self { brightness: 0.02, stars: 0, star_brightness: 3.0, seed: 1 }
    }
}

impl Scene {
    /// A uniformly bright Earth with a sharp limb at the default height, 17 km, in a dark sky, seen by a detector
    /// without noise.
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
            exposure: 1.0,
            detector: Detector::default(),
            seed: 0,
        }
    }
}
