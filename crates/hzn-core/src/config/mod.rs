//! Everything that describes a sensor, as plain values: sensor.toml without the file.

mod numbers;
pub mod retry;

pub use numbers::SECTIONS;

use crate::base::error::{ConfigError, Limit, between, require};
use crate::base::keys::{Section, choices, section};
use crate::geometry::camera;
use crate::image::Channel;
use crate::image::region;
use crate::model::body;
use crate::model::report::MAX_BODIES;
use crate::model::work;
use crate::stages::consensus;
use crate::stages::contour;
use crate::stages::covariance;
use crate::stages::edge_points;
use crate::stages::fit;
use crate::stages::gates;
use crate::stages::threshold;

/// A sensor: the camera, the body it looks for, and every stage's parameters.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Config {
    /// The calibration.
    pub camera: camera::Config,
    /// How the camera sits in the vehicle.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub mount: Option<Mount>,
    /// The body.
    #[cfg_attr(feature = "serde", serde(default))]
    pub body: body::Config,
    /// Several bodies in one picture, instead of `body`, in the order in which they are looked for.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "heapless::Vec::is_empty"))]
    pub bodies: heapless::Vec<body::Config, MAX_BODIES>,
    /// How a pixel becomes one brightness.
    #[cfg_attr(feature = "serde", serde(default))]
    pub input: Input,
    /// Brightness gate.
    #[cfg_attr(feature = "serde", serde(default))]
    pub gate: threshold::Gate,
    /// Level between dark and lit.
    #[cfg_attr(feature = "serde", serde(default))]
    pub binarize: threshold::Config,
    /// Parts of the picture that never count.
    #[cfg_attr(feature = "serde", serde(default))]
    pub mask: region::Config,
    /// Search and border following.
    #[cfg_attr(feature = "serde", serde(default))]
    pub contour: contour::Config,
    /// Edges that are looked at, and their sub-pixel points.
    #[cfg_attr(feature = "serde", serde(default))]
    pub candidates: edge_points::Config,
    /// Outlier rejection.
    #[cfg_attr(feature = "serde", serde(default))]
    pub reject: consensus::Config,
    /// The fit.
    #[cfg_attr(feature = "serde", serde(default))]
    pub estimate: fit::Config,
    /// Noise model of the edge points.
    #[cfg_attr(feature = "serde", serde(default))]
    pub covariance: covariance::Config,
    /// Gates of an answer.
    #[cfg_attr(feature = "serde", serde(default))]
    pub select: gates::Config,
    /// When the whole picture gives no answer.
    #[cfg_attr(feature = "serde", serde(default))]
    pub recover: retry::Config,
    /// What a picture may cost.
    #[cfg_attr(feature = "serde", serde(default))]
    pub limits: work::Config,
}

section! {
    /// `[mount]` of sensor.toml: how the camera sits in the vehicle.
    "mount" pub struct Mount: Copy without defaults {
        /// Quaternion that takes camera coordinates to vehicle coordinates, scalar first; it gives roll and pitch in
        /// the results.
        @20 q_body_from_camera_wxyz: [f64; 4], serde(), ["unit quaternion"]
            { unset: "no mounting", example: "[1.0, 0.0, 0.0, 0.0]" };
    }
}

section! {
    /// `[input]` of sensor.toml: how a pixel becomes one brightness.
    "input" pub struct Input: Copy {
        /// Which brightness a colour pixel has.
        @- channel: Channel = Channel::Mean, [choice];
        /// Significant bits of a sample, where the file's words have room for more.
        ///
        /// A camera of 12 bits whose values stand in the lower bits of 16-bit words has 12. Programs that read files
        /// put it into the picture's [`Layout`](crate::image::Layout).
        @- bits: Option<u8> = None, [8.0 to 16.0]
            { unset: "as the file says; for words of 16 bits found from the pictures", example: "12" };
        /// How a picture is turned before it is processed; the camera's size and calibration are those of the turned
        /// picture.
        @- orient: Orient = Orient::AsStored, [choice];
        /// Rows of a smaller copy of the picture that is processed instead; from there on, lengths are in pixels of the
        /// copy.
        @- scale_to_height: Option<u16> = None, ["16 to `height`"] { needs: "horace", unset: "none", example: "540" };
    }
}

choices! {
    /// How a picture is turned between its file and the sensor.
    pub enum Orient {
        /// Pixels stay where the file has them, as the detector gave them.
        @- AsStored = "as-stored";
        /// The picture is turned as its EXIF orientation says; photograph viewers and OpenCV's `imread` do the same.
        @- Exif = "exif";
        /// By 90 degrees clockwise.
        @- Rotate90 = "rotate-90";
        /// By 180 degrees.
        @- Rotate180 = "rotate-180";
        /// By 90 degrees counter-clockwise.
        @- Rotate270 = "rotate-270";
    }
}

impl Config {
    /// A sensor with this camera and every other value at its default.
    pub fn new(camera: camera::Config) -> Self {
        Self {
            camera,
            mount: None,
            body: body::Config::default(),
            bodies: heapless::Vec::new(),
            input: Input::default(),
            gate: threshold::Gate::default(),
            binarize: threshold::Config::default(),
            mask: region::Config::default(),
            contour: contour::Config::default(),
            candidates: edge_points::Config::default(),
            reject: consensus::Config::default(),
            estimate: fit::Config::default(),
            covariance: covariance::Config::default(),
            select: gates::Config::default(),
            recover: retry::Config::default(),
            limits: work::Config::default(),
        }
    }

    /// The bodies that are looked for, one or several.
    pub fn each_body(&self) -> &[body::Config] {
        if self.bodies.is_empty() { core::slice::from_ref(&self.body) } else { &self.bodies }
    }
    /// How body number `which`, from 0, is split from the dark: its own values, or those of all; of a Sun among several
    /// the level of the preset `sun`, as what is brighter than the dark beside another body is that body.
    pub fn levels_of(&self, which: u8) -> &threshold::Config {
        let body = self.each_body().get(usize::from(which));
        match body.and_then(|b| b.binarize.as_ref()) {
            Some(own) => own,
            None if !self.bodies.is_empty() && body.is_some_and(body::Config::blooms) => &threshold::SUN,
            None => &self.binarize,
        }
    }
    /// The errors of body number `which`'s edge points: its own values, or those of all.
    pub(crate) fn noise_of(&self, which: u8) -> &covariance::Config {
        let own = self.each_body().get(usize::from(which)).and_then(|b| b.covariance.as_ref());
        own.unwrap_or(&self.covariance)
    }
    /// Whether a body's level, or a gate, comes from the picture before, so that pictures must come in order.
    pub fn tracks(&self) -> bool {
        if self.select.max_rate_deg_s.is_some() {
            return true;
        }
        (0..self.each_body().len()).any(|which| self.levels_of(which as u8).method == threshold::Method::Track)
    }
    /// As [`Self::each_body`], to be changed.
    pub fn each_body_mut(&mut self) -> &mut [body::Config] {
        if self.bodies.is_empty() { core::slice::from_mut(&mut self.body) } else { &mut self.bodies }
    }

    /// Checks every field but the lens, which [`camera::Camera::try_new`] checks.
    ///
    /// # Errors
    /// The first field out of its limits.
    pub fn check(&self) -> Result<(), ConfigError> {
        if let Some(mount) = &self.mount {
            let q = mount.q_body_from_camera_wxyz;
            let n2: f64 = q.iter().map(|x| x * x).sum();
            require(
                (n2 - 1.0).abs() < 0.01,
                "mount.q_body_from_camera_wxyz",
                n2,
                Limit::Rule("the quaternion's squared length must be 1 (scalar first)"),
            )?;
        }
        for (which, body) in self.each_body().iter().enumerate() {
            body.check().map_err(|e| ConfigError { body: (!self.bodies.is_empty()).then_some(which as u8), ..e })?;
        }
        self.gate.check()?;
        self.binarize.check_keys()?;
        self.mask.check(&self.camera)?;
        self.contour.check()?;
        self.candidates.check()?;
        self.reject.check_keys()?;
        self.estimate.check_keys()?;
        self.covariance.check_keys()?;
        self.recover.check_keys()?;
        self.limits.check_keys()?;
        self.input.check_keys()?;
        if let Some(rows) = self.input.scale_to_height {
            between("input.scale_to_height", f64::from(rows), 16.0, f64::from(self.camera.height.max(16)))?;
        }
        self.select.check()
    }
}
