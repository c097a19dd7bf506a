//! Built-in flights: sequences of scenes, and the sensor that takes them.

use core::f64::consts::{FRAC_PI_2, TAU};

use hzn_core::camera::{self, Model};
use hzn_core::{body, covariance, region};
use hzn_files::truth::Truth;
use serde::{Deserialize, Serialize};

use crate::counter::{Counter, Stream};
use crate::detector::Detector;
use crate::error::SceneError;
use crate::foreground::Foreground;
use crate::globe::Globe;
use crate::picture::Picture;
use crate::pose::{Look, Pose, position_m};
use crate::scene::{Band, Disc, Profile, Scene, Sky, World};
use crate::texture::Clouds;

/// A sequence of pictures and the sensor's configuration for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Flight {
    /// Short name, usable in file names.
    pub name: String,
    /// Configuration of the sensor.
    pub sensor: hzn_core::Config,
    /// Pictures in the order of time.
    pub frames: Vec<FlightFrame>,
}

/// One picture of a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct FlightFrame {
    /// Name of the picture's file.
    pub file: String,
    /// Time from the first picture in seconds.
    pub time_s: f64,
    /// UTC as ISO 8601; `None` if the flight has no date.
    pub utc: Option<String>,
    /// Scene of the picture.
    pub scene: Scene,
    /// Quality of the JPEG file of the picture, 1 to 100; `None` for a lossless file.
    pub jpeg_quality: Option<u8>,
    /// The time stamp of the picture; `None` if the camera's clock is right.
    pub stamp: Option<Stamp>,
}

/// A time stamp from a clock that is not right, and the position that belongs to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Stamp {
    /// Time of the stamp, seconds.
    pub time_s: f64,
    /// The same as ISO 8601 in UTC.
    pub utc: String,
    /// Position of the vehicle at the time of the stamp, ECEF, metres.
    pub position_m: [f64; 3],
}

/// A row of frames.csv: the prior of one picture. The fields are the file's columns, in this order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameRow {
    /// Name of the picture's file.
    pub file: String,
    /// Time in seconds.
    pub time_s: f64,
    /// UTC as ISO 8601.
    pub utc: Option<String>,
    /// Altitude in kilometres, geodetic for `earth`.
    pub altitude_km: f64,
    /// First component of the position in ECEF, kilometres.
    pub x_km: f64,
    /// Second component of the position.
    pub y_km: f64,
    /// Third component of the position.
    pub z_km: f64,
    /// Prior attitude as a quaternion from camera to ECEF, scalar part.
    pub qw: Option<f64>,
    /// First vector component of the prior attitude.
    pub qx: Option<f64>,
    /// Second vector component of the prior attitude.
    pub qy: Option<f64>,
    /// Third vector component of the prior attitude.
    pub qz: Option<f64>,
    /// 1-sigma of the prior attitude about each axis, degrees.
    pub attitude_sigma_deg: Option<f64>,
    /// Rate of the camera about its first axis, rad/s; only for a rolling shutter.
    pub rate_x: Option<f64>,
    /// Rate of the camera about its second axis.
    pub rate_y: Option<f64>,
    /// Rate of the camera about its third axis.
    pub rate_z: Option<f64>,
}

impl FlightFrame {
    /// Returns the rate of the camera if it has a rolling shutter.
    fn rate_rad_s(&self) -> Option<[f64; 3]> {
        self.scene.motion.filter(|motion| motion.readout_s != 0.0).map(|motion| motion.rate_radps)
    }

    /// Returns the row of frames.csv for the picture: time and position, no attitude.
    pub fn row(&self) -> FrameRow {
        let position_m = self.stamp.as_ref().map_or(self.scene.pose.position_m, |stamp| stamp.position_m);
        let [x_km, y_km, z_km] = position_m.map(|m| m * 1e-3);
        let altitude_km = Globe::new(&self.scene.body).altitude_m(position_m) * 1e-3;
        let rate = self.rate_rad_s();
        FrameRow {
            file: self.file.clone(),
            time_s: self.stamp.as_ref().map_or(self.time_s, |stamp| stamp.time_s),
            utc: self.stamp.as_ref().map(|stamp| stamp.utc.clone()).or_else(|| self.utc.clone()),
            altitude_km,
            x_km,
            y_km,
            z_km,
            qw: None,
            qx: None,
            qy: None,
            qz: None,
            attitude_sigma_deg: None,
            rate_x: rate.map(|[x, _, _]| x),
            rate_y: rate.map(|[_, y, _]| y),
            rate_z: rate.map(|[_, _, z]| z),
        }
    }
    /// Renders the picture as a reader of its file gets it, with the losses of JPEG if it is a JPEG file.
    ///
    /// # Errors
    /// Fails like [`Scene::render`]; also if the picture cannot be encoded as JPEG.
    pub fn render(&self) -> Result<Picture, SceneError> {
        let picture = self.scene.render()?;
        match self.jpeg_quality {
            Some(quality) => picture.with_jpeg_losses(quality).map_err(|e| SceneError::Jpeg(e.to_string())),
            None => Ok(picture),
        }
    }
    /// Returns the truth about the picture.
    ///
    /// # Errors
    /// Fails like [`Scene::truth`].
    pub fn truth(&self) -> Result<Truth, SceneError> {
        self.scene.truth(&self.file, self.time_s)
    }
    /// Returns the prior that a navigation system would give the sensor: the position, no attitude. At another body
    /// than the Earth it is the attitude and the direction to the Sun, because the position is what the sensor
    /// measures.
    pub fn prior(&self) -> hzn_core::Prior<f64> {
        if matches!(self.scene.world, World::Ellipsoid(_)) {
            return self.scene.told_prior();
        }
        hzn_core::Prior {
            altitude_m: Some(Globe::new(&self.scene.body).altitude_m(self.scene.pose.position_m)),
            position_m: Some(self.scene.pose.position_m),
            rate_rad_s: self.rate_rad_s(),
            ..hzn_core::Prior::default()
        }
    }
    /// Returns [`FlightFrame::prior`] with an attitude that has a random error of `sigma_rad` (1-sigma, about each
    /// axis).
    pub fn prior_with_attitude(&self, sigma_rad: f64) -> hzn_core::Prior<f64> {
        hzn_core::Prior {
            fixed_from_camera: self.disturbed_pose(sigma_rad).fixed_from_camera(),
            attitude_sigma_rad: Some(sigma_rad),
            ..self.prior()
        }
    }
    /// Returns the attitude that a navigation system with this error (1-sigma, about each axis) would report.
    pub(crate) fn told_q_fixed_from_camera_wxyz(&self, sigma_rad: f64) -> [f64; 4] {
        self.disturbed_pose(sigma_rad).q_fixed_from_camera_wxyz
    }
    fn disturbed_pose(&self, sigma_rad: f64) -> Pose {
        let draws = Counter::new(self.scene.seed, Stream::AttitudePrior);
        self.scene.pose.disturbed([0, 1, 2].map(|i| sigma_rad * draws.normal(i)))
    }
}

impl Flight {
    /// Returns the same flight with a limb height that depends on latitude, as rows of (geodetic latitude in degrees,
    /// height in kilometres). The sensor's configuration does not change.
    #[must_use]
    pub fn with_limb_height_by_latitude_km(mut self, rows: &[[f64; 2]]) -> Self {
        for frame in &mut self.frames {
            frame.scene.limb_height_by_latitude_km = rows.to_vec();
        }
        self
    }

    /// Returns the same flight with a part of the vehicle at the right of every picture, in front of sky and Earth. The
    /// sensor's mask covers the part.
    #[must_use]
    pub fn with_payload(mut self) -> Self {
        let (w, h) = (f64::from(self.sensor.camera.width), f64::from(self.sensor.camera.height));
        let part = |grow: f64| {
            [[0.80 * w - grow, -10.0], [w + 10.0, -10.0], [w + 10.0, h + 10.0], [0.76 * w - grow, h + 10.0]]
        };
        for frame in &mut self.frames {
            frame.scene.foreground.push(Foreground { polygon_px: part(0.0).to_vec(), brightness: 0.45 });
        }
        // The mask is four pixels wider than the part, because the edge of the part is blurred.
        let mut polygon = region::Polygon::new();
        let fits = polygon.extend_from_slice(&part(4.0)).is_ok();
        debug_assert!(fits, "four corners are fewer than sixteen");
        let added = self.sensor.mask.polygons_px.push(polygon).is_ok();
        debug_assert!(added, "built-in flights have few masks");
        self
    }
}

/// Returns the seed of a picture's noise.
fn noise_seed(seed: u64, index: usize) -> u64 {
    seed.wrapping_mul(1_000_003).wrapping_add(index as u64)
}

/// Returns each index with its position in the flight, from 0 to 1.
fn indexed_fractions(count: usize) -> impl Iterator<Item = (usize, f64)> {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count).map(move |i| (i, i as f64 / last))
}

/// Returns a wide-angle lens (94° across) for a picture of `width` by `height` pixels: the lens of a 1920×1080 camera,
/// scaled.
pub fn rocket_camera(width: u16, height: u16) -> camera::Config {
    let s = f64::from(width) / 1920.0;
    // Pixel centres are at integers, so the corner is at −½.
    let scaled = |c: f64| (c + 0.5) * s - 0.5;
    let middle = (f64::from(height) - 1080.0 * s) / 2.0;
    camera::Config {
        model: Model::KannalaBrandt,
        fx_px: 1235.0 * s,
        fy_px: 1231.0 * s,
        cx_px: scaled(963.2),
        cy_px: scaled(536.7) + middle,
        k: [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect(),
        theta_max_deg: Some(54.0),
        ..camera::Config::ideal(Model::KannalaBrandt, width, height, 1.0)
    }
}

/// Returns a flight of a sounding rocket above northern Scandinavia. It climbs from 70 km to 240 km and descends again
/// in 380 s, slowly tumbling, over clouds and dark sea. The limb is a bright band with an exponential profile. The PSF
/// is 0.9 px, the noise 2 %, with 8 bits.
pub fn rocket(width: u16, height: u16, count: usize, seed: u64) -> Flight {
    let camera = rocket_camera(width, height);
    let mut sensor = hzn_core::Config::new(camera.clone());
    sensor.body = body::Config {
        altitude_sigma_km: 0.1,
        limb_height_km: 10.0,
        limb_height_sigma_km: 1.0,
        ..body::Config::default()
    };
    // The values make the errors as large as their covariance: squared errors over their covariance are 1.5 to 2.7 (two
    // degrees of freedom) on pictures 960 to 1920 pixels wide. Clouds seen through the band correlate the errors.
    sensor.covariance = covariance::Config::given(0.1, 30.0);
    let half_s = 190.0;
    let frames = indexed_fractions(count)
        .map(|(index, fraction)| {
            let time_s = 2.0 * half_s * fraction;
            let to_apogee = (time_s - half_s) / half_s;
            let altitude_km = 240.0 - 170.0 * to_apogee * to_apogee;
            let look = Look {
                azimuth_rad: 0.6 + 1.3 * fraction * TAU,
                // The limb is 7° to 16° below the horizontal, and half the picture's height is 25°.
                depression_rad: (14.0 + 12.0 * libm::sin(1.7 * fraction * TAU)).to_radians(),
                roll_rad: 0.2 + 1.5 * fraction * TAU,
            };
            let position = position_m(67.9 + 0.8 * fraction, 21.1 - 0.3 * fraction, altitude_km);
            let scene = Scene {
                body: sensor.body.clone(),
                profile: Profile::Exponential { scale_km: 4.0 },
                disc: Disc {
                    surface: 0.12,
                    clouds: Some(Clouds { seed, ..Clouds::default() }),
                    band: Some(Band { brightness: 0.9, depth_km: 16.0, fade_km: 24.0 }),
                },
                sky: Sky { stars: 4000, seed, ..Sky::default() },
                detector: Detector { psf_sigma_px: 0.9, read_noise: 0.02, ..Detector::default() },
                seed: noise_seed(seed, index),
                ..Scene::new(camera.clone(), Pose::looking(position, look))
            };
            FlightFrame {
                file: format!("rocket-{index:04}.png"),
                time_s,
                utc: None,
                scene,
                jpeg_quality: None,
                stamp: None,
            }
        })
        .collect();
    Flight { name: "rocket".into(), sensor, frames }
}

/// Returns a flight of an infrared Earth sensor in low orbit at 600 km. The lens is equidistant with 384×288 pixels and
/// 92 px/rad, to 90° off axis. The Earth is a uniform disc with its limb at 25 km; the blur is 1 px, the noise 2 %,
/// with 16 bits. Over the flight the optical axis swings from straight down to 120° off nadir.
pub fn leo_infrared(count: usize, seed: u64) -> Flight {
    let camera =
        camera::Config { theta_max_deg: Some(90.0), ..camera::Config::ideal(Model::Equidistant, 384, 288, 92.0) };
    let mut sensor = hzn_core::Config::new(camera.clone());
    sensor.body =
        body::Config { limb_height_km: 25.0, limb_height_sigma_km: 1.0, altitude_sigma_km: 0.1, ..sensor.body };
    // Noise dominates, so errors of neighbouring points are unrelated beyond the blur.
    sensor.covariance = covariance::Config::given(0.07, 5.0);
    let frames = indexed_fractions(count)
        .map(|(index, fraction)| {
            let time_s = 5800.0 * fraction;
            // The orbit is polar and passes all latitudes twice.
            let (lat_deg, lon_deg) = (80.0 * libm::sin(TAU * fraction), 10.0 + 24.0 * fraction);
            let look =
                Look::off_nadir(120f64.to_radians() * fraction, 1.1 + 5.0 * fraction, FRAC_PI_2 * 3.0 * fraction);
            let scene = Scene {
                body: sensor.body.clone(),
                profile: Profile::Exponential { scale_km: 5.0 },
                disc: Disc { surface: 0.7, clouds: None, band: None },
                sky: Sky { brightness: 0.08, ..Sky::default() },
                detector: Detector { psf_sigma_px: 1.0, read_noise: 0.02, bits: 16, ..Detector::default() },
                seed: noise_seed(seed, index),
                ..Scene::new(camera.clone(), Pose::looking(position_m(lat_deg, lon_deg, 600.0), look))
            };
            FlightFrame {
                file: format!("leo-infrared-{index:04}.png"),
                time_s,
                utc: None,
                scene,
                jpeg_quality: None,
                stamp: None,
            }
        })
        .collect();
    Flight { name: "leo-infrared".into(), sensor, frames }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_picture_of_the_flights_shows_limb() {
        for flight in [rocket(960, 540, 24, 1), leo_infrared(13, 1), rocket(1280, 720, 12, 2).with_payload()] {
            flight.sensor.check().unwrap();
            for frame in &flight.frames {
                let truth = frame.truth().unwrap();
                let px = frame.scene.visible_limb_px().unwrap();
                assert!(truth.has_limb(), "{} {px}", frame.file);
            }
        }
    }

    #[test]
    fn rocket_goes_up_and_comes_down() {
        let flight = rocket(320, 180, 3, 1);
        let km: Vec<f64> = flight.frames.iter().map(|f| f.truth().unwrap().altitude_km).collect();
        assert!((km[0] - 70.0).abs() < 1e-6 && (km[1] - 240.0).abs() < 1e-6 && (km[2] - 70.0).abs() < 1e-6);
        assert_eq!((flight.frames[0].time_s, flight.frames[2].time_s), (0.0, 380.0));
    }

    #[test]
    fn scaled_camera_sees_the_same() {
        use hzn_core::camera::Camera;
        use hzn_core::pixel::ImagePoint;
        let (full, half) = (rocket_camera(1920, 1080), rocket_camera(960, 540));
        let (full, half) = (Camera::<f64>::try_new(&full).unwrap(), Camera::<f64>::try_new(&half).unwrap());
        let a = full.unproject(ImagePoint { u: -0.5, v: 1079.5 }).unwrap();
        let b = half.unproject(ImagePoint { u: -0.5, v: 539.5 }).unwrap();
        assert!(a.angle_rad(&b) < 1e-12);
    }

    #[test]
    fn attitude_prior_is_off_by_about_its_sigma() {
        let frame = &rocket(320, 180, 2, 1).frames[0];
        let z = hzn_core::frames::UnitVec3::try_new([0.0, 0.0, 1.0]).unwrap();
        let prior = frame.prior_with_attitude(0.05).fixed_from_camera.unwrap().apply(&z);
        let is = frame.scene.pose.fixed_from_camera().unwrap().apply(&z);
        assert!((1e-3..0.3).contains(&prior.angle_rad(&is)));
        assert!(frame.prior().fixed_from_camera.is_none());
    }
}
