//! The whole configuration of a sensor as plain values: sensor.toml without the file.

mod numbers;
pub mod retry;
pub mod track;

pub use numbers::SECTIONS;

use crate::base::error::{ConfigError, Limit, between, require};
use crate::base::keys::{Section, choices, section};
use crate::base::parts::packed;
use crate::geometry::camera;
use crate::image::Channel;
use crate::image::region;
use crate::model::body;
use crate::model::report::MAX_BODIES;
use crate::model::tone::Tone;
use crate::model::work;
use crate::stages::consensus;
use crate::stages::contour;
use crate::stages::covariance;
use crate::stages::edge_points;
use crate::stages::fit;
use crate::stages::gates;
use crate::stages::threshold;

/// The configuration of a sensor: the camera, the body that it searches for, and the parameters of every stage.
#[derive(Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Config {
    /// The calibration.
    pub camera: camera::Config,
    /// How the camera is mounted in the vehicle.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub mount: Option<Mount>,
    /// The body.
    #[cfg_attr(feature = "serde", serde(default))]
    pub body: body::Config,
    /// Several bodies in one picture, instead of `body`, in the order of the search.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "heapless::Vec::is_empty"))]
    pub bodies: heapless::Vec<body::Config, MAX_BODIES>,
    /// Conversion of a pixel to one brightness.
    #[cfg_attr(feature = "serde", serde(default))]
    pub input: Input,
    /// Brightness gate.
    #[cfg_attr(feature = "serde", serde(default))]
    pub brightness: threshold::Brightness,
    /// Threshold between dark and lit.
    #[cfg_attr(feature = "serde", serde(default))]
    pub threshold: threshold::Config,
    /// Parts of the picture that never count.
    #[cfg_attr(feature = "serde", serde(default))]
    pub mask: region::Config,
    /// Search and border following.
    #[cfg_attr(feature = "serde", serde(default))]
    pub contour: contour::Config,
    /// Edges that are examined, and their sub-pixel points.
    #[cfg_attr(feature = "serde", serde(default))]
    pub edge_points: edge_points::Config,
    /// Consensus and outlier rejection.
    #[cfg_attr(feature = "serde", serde(default))]
    pub consensus: consensus::Config,
    /// The fit.
    #[cfg_attr(feature = "serde", serde(default))]
    pub fit: fit::Config,
    /// Noise model of the edge points.
    #[cfg_attr(feature = "serde", serde(default))]
    pub covariance: covariance::Config,
    /// Gates of an answer.
    #[cfg_attr(feature = "serde", serde(default))]
    pub gates: gates::Config,
    /// Further looks and division, for a picture without an answer.
    #[cfg_attr(feature = "serde", serde(default))]
    pub retry: retry::Config,
    /// Search of a limb where the picture before puts it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub track: track::Config,
    /// Work budget of a picture.
    #[cfg_attr(feature = "serde", serde(default))]
    pub limits: work::Config,
}

// Not derived: a derived `clone` makes all parts on the stack, 5.9 KB, and copies them then to where they stay.
impl Clone for Config {
    fn clone(&self) -> Self {
        Self {
            camera: copy(&self.camera),
            mount: copy(&self.mount),
            body: copy(&self.body),
            bodies: copy(&self.bodies),
            input: copy(&self.input),
            brightness: copy(&self.brightness),
            threshold: copy(&self.threshold),
            mask: copy(&self.mask),
            contour: copy(&self.contour),
            edge_points: copy(&self.edge_points),
            consensus: copy(&self.consensus),
            fit: copy(&self.fit),
            covariance: copy(&self.covariance),
            gates: copy(&self.gates),
            retry: copy(&self.retry),
            track: copy(&self.track),
            limits: copy(&self.limits),
        }
    }
}

// The two lists, which take most of the memory, are read when the configuration is in its place.
packed!(Config {
    camera, mount, body, input, brightness, threshold, contour, edge_points, consensus, fit, covariance, gates, retry,
    track, limits; bodies = heapless::Vec::new(), mask = region::Config::default()
});

/// Returns a copy of a part of a configuration.
#[inline(never)]
fn copy<C: Clone>(part: &C) -> C {
    part.clone()
}

section! {
    /// `[mount]` of sensor.toml: how the camera is mounted in the vehicle.
    "mount" pub struct Mount: Copy without defaults {
        /// Quaternion that converts camera coordinates to vehicle coordinates, scalar first; with it the results have
        /// roll, pitch, and the axis in the vehicle's frame.
        @20 q_vehicle_from_camera_wxyz: [f64; 4], serde(), ["unit quaternion"]
            { unset: "no mounting", example: "[1.0, 0.0, 0.0, 0.0]" };
    }
}

section! {
    /// `[input]` of sensor.toml: conversion of a pixel to one brightness.
    "input" pub struct Input: Copy {
        /// Channel that gives the brightness of a colour pixel, or their mean.
        @- channel: Channel = Channel::Mean, [choice];
        /// Significant bits of a sample, if the file's words have room for more.
        ///
        /// It is 12 for a 12-bit camera whose values are in the lower bits of 16-bit words. A wrong value makes full
        /// scale wrong, and every limit that is a fraction of full scale. Programs that read files copy it to the
        /// picture's [`Layout`](crate::image::Layout).
        @- bits: Option<u8> = None, [8.0 to 16.0]
            { unset: "from the file; for 16-bit words, determined from the pictures", example: "12" };
        /// Curve between light and counts, a word or a gamma; with it an edge is located at half of the light.
        ///
        /// Half of the counts of a photograph (sRGB) is a fifth of the light. If the curve is unknown, the limb of a
        /// photograph appears 6.4 km higher, and a blurred edge 0.8 standard deviations of the blur too far out. With
        /// `edge_points.sub_pixel = "none"` the edge is at the threshold, and the limb height follows from the tone. A
        /// file says its curve in most cases: JPEG (sRGB), video (BT.709), raw data and samples of 12 to 16 bits
        /// (linear), a PNG with the chunk sRGB, gAMA or cICP. A grey PNG of 8 bits does not: those of industrial
        /// cameras are usually linear, those of telephones are not.
        @44 tone: Option<Tone> = None, [choice]
            { unset: "from the file, else `unknown`", example: "\"linear\"" };
        /// Rotation of a picture before it is processed; the camera's size and calibration are those of the rotated
        /// picture.
        @- orient: Orient = Orient::AsStored, [choice];
        /// Whether the brightness is inverted, so that dark becomes bright: for a dark body before a bright sky.
        ///
        /// Examples are an infrared camera that shows cold as white, and a body in front of the Sun's corona. The
        /// programs that read pictures invert them, up to full scale. `hzn explain` says if an inverted picture has an
        /// answer.
        @- invert: bool = false, ["true or false"];
        /// Number of rows of a smaller copy of the picture, which is processed instead of the picture; lengths in
        /// pixels are then those of the copy.
        @- scale_to_height: Option<u16> = None, ["16 to `height`"] { needs: "horace", unset: "none", example: "540" };
    }
}

choices! {
    /// Rotation of a picture between its file and the sensor.
    pub enum Orient {
        /// The picture is not rotated: pixels stay as in the file, as the detector delivered them.
        @- AsStored = "as-stored";
        /// The picture is rotated as its EXIF orientation says; photograph viewers and OpenCV's `imread` do the same.
        @- Exif = "exif";
        /// The picture is rotated by 90 degrees clockwise.
        @- Rotate90 = "rotate-90";
        /// The picture is rotated by 180 degrees.
        @- Rotate180 = "rotate-180";
        /// The picture is rotated by 90 degrees counter-clockwise.
        @- Rotate270 = "rotate-270";
    }
}

impl Config {
    /// Makes a sensor with this camera and every other value at its default.
    pub fn new(camera: camera::Config) -> Self {
        Self {
            covariance: covariance::Config::for_focal_length(0.5 * (camera.fx_px + camera.fy_px)),
            camera,
            mount: None,
            body: body::Config::default(),
            bodies: heapless::Vec::new(),
            input: Input::default(),
            brightness: threshold::Brightness::default(),
            threshold: threshold::Config::default(),
            mask: region::Config::default(),
            contour: contour::Config::default(),
            edge_points: edge_points::Config::default(),
            consensus: consensus::Config::default(),
            fit: fit::Config::default(),
            gates: gates::Config::default(),
            retry: retry::Config::default(),
            track: track::Config::default(),
            limits: work::Config::default(),
        }
    }

    /// Returns the bodies that the sensor searches for, one or several.
    pub fn each_body(&self) -> &[body::Config] {
        if self.bodies.is_empty() { core::slice::from_ref(&self.body) } else { &self.bodies }
    }
    /// Sets the tone of the pictures, and the height of each visible limb that follows from it
    /// ([`body::Config::follow_tone`]).
    pub fn set_tone(&mut self, tone: Tone) {
        self.input.tone = Some(tone);
        // Only this method has no level of its own: its points are at the threshold, which is half of the counts.
        let in_counts = self.edge_points.sub_pixel == edge_points::SubPixel::None;
        let light = tone.light_at_half().filter(|_| in_counts).unwrap_or(0.5);
        self.each_body_mut().iter_mut().for_each(|body| body.follow_tone(tone, light));
    }
    /// Returns the threshold parameters of body number `which`, from 0: those of the body, or else those of the sensor.
    /// If a Sun among several bodies has no threshold parameters, it uses those of the preset `sun`, because every
    /// other body in the picture is also brighter than the sky.
    pub fn threshold_of(&self, which: u8) -> &threshold::Config {
        let body = self.each_body().get(usize::from(which));
        match body.and_then(|b| b.threshold.as_ref()) {
            Some(own) => own,
            None if !self.bodies.is_empty() && body.is_some_and(body::Config::blooms) => &threshold::SUN,
            None => &self.threshold,
        }
    }
    /// Returns the noise model of body number `which`: that of the body, or else that of the sensor.
    pub(crate) fn noise_model_of(&self, which: u8) -> &covariance::Config {
        let own = self.each_body().get(usize::from(which)).and_then(|b| b.covariance.as_ref());
        own.unwrap_or(&self.covariance)
    }
    /// Returns the protection level of answers about body number `which`, as a multiple of `sigma_max_deg`, see
    /// [`protection_probability`](covariance::Config::protection_probability); `None` for a body that shines by itself
    /// (the Sun, or a thermal camera), because the factors were measured by day.
    pub fn protection_factor(&self, which: u8) -> Option<f64> {
        let body = self.each_body().get(usize::from(which))?;
        body.is_seen_in_sunlight().then(|| self.noise_model_of(which).protection_factor())
    }
    /// Returns whether the threshold of a body, or a gate, depends on the previous picture. Pictures must then come in
    /// order.
    pub fn tracks(&self) -> bool {
        // The gate compares with the last answer. On several threads that would be the answer of another time.
        if self.gates.max_rate_deg_s.is_some() {
            return true;
        }
        (0..self.each_body().len()).any(|which| self.threshold_of(which as u8).method == threshold::Method::Track)
    }
    /// Returns whether the fit gives the position of a body of this sensor: `fit.position`, which by default is
    /// true for `ellipsoid` and the planets with a name. The Sun has no position, because its limb blooms.
    pub fn fits_position(&self, body: &body::Config) -> bool {
        cfg!(feature = "position")
            // The edge of a Sun that blooms lies outside its disc, so its radius would give a distance that is too
            // small.
            && body.kind != body::Kind::Sun
            && self.fit.position.unwrap_or_else(|| body.is_ellipsoid())
    }
    /// Refuses methods that do not work in the scaled space of a body.
    fn check_position(&self) -> Result<(), ConfigError> {
        if !self.each_body().iter().any(|body| self.fits_position(body)) {
            return Ok(());
        }
        let rule = |holds: bool, field, rule| require(holds, field, f64::NAN, Limit::Rule(rule));
        rule(
            self.fit.half_angle != fit::HalfAngle::Known,
            // The distance is the half-angle: with a known one there would be nothing left to measure.
            "fit.half_angle",
            "a position needs the half-angle: write \"fused\" or \"free\", or fit.position = false",
        )?;
        rule(
            matches!(self.fit.method, fit::Method::Sphere | fit::Method::LeastSquares | fit::Method::GeneralisedTls),
            "fit.method",
            "a position needs \"sphere\", \"least-squares\" or \"generalised-tls\", or fit.position = false",
        )?;
        rule(
            self.covariance.method == covariance::Method::Sandwich,
            "covariance.method",
            "a position needs \"sandwich\", or fit.position = false",
        )
    }
    /// Returns the same bodies as [`Self::each_body`], for changes.
    pub fn each_body_mut(&mut self) -> &mut [body::Config] {
        if self.bodies.is_empty() { core::slice::from_mut(&mut self.body) } else { &mut self.bodies }
    }

    /// Checks every field except the lens, which [`camera::Camera::try_new`] checks.
    ///
    /// # Errors
    /// Returns the first field that is out of its limits.
    ///
    /// ```
    /// use hzn_core::Config;
    /// use hzn_core::camera::{self, Model};
    ///
    /// let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 640, 480, 500.0));
    /// config.body.limb_height_km = 1700.0;
    /// assert_eq!(config.check().unwrap_err().field, "body.limb_height_km");
    /// ```
    pub fn check(&self) -> Result<(), ConfigError> {
        if let Some(mount) = &self.mount {
            let q = mount.q_vehicle_from_camera_wxyz;
            let n2: f64 = q.iter().map(|x| x * x).sum();
            require(
                // One percent allows for a quaternion that was written with three digits; it is normalised later. More
                // is a typing error.
                (n2 - 1.0).abs() < 0.01,
                "mount.q_vehicle_from_camera_wxyz",
                n2,
                Limit::Rule("the quaternion's squared length must be 1 (scalar first)"),
            )?;
        }
        for (which, body) in self.each_body().iter().enumerate() {
            // The number of the body is added here, because the check of a body does not know its place in the list.
            body.check().map_err(|e| ConfigError { body: (!self.bodies.is_empty()).then_some(which as u8), ..e })?;
        }
        self.brightness.check()?;
        self.threshold.check_keys()?;
        self.mask.check(&self.camera)?;
        self.contour.check()?;
        self.edge_points.check()?;
        self.consensus.check_keys()?;
        self.fit.check_keys()?;
        self.check_position()?;
        self.covariance.check_keys()?;
        self.retry.check_keys()?;
        // These keys have no number in flight, and any value is safe, so that an image of a flight computer does not
        // pay for their check.
        if cfg!(feature = "serde") {
            self.track.check_keys()?;
        }
        self.limits.check_keys()?;
        self.input.check_keys()?;
        if let Some(rows) = self.input.scale_to_height {
            // The upper limit is at least 16, so that the message never names a range from 16 to a smaller number.
            between("input.scale_to_height", f64::from(rows), 16.0, f64::from(self.camera.height.max(16)))?;
        }
        self.gates.check()
    }
}
