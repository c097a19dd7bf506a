//! Every parameter by number. Numbers are frozen: a number is never given to another parameter.
//!
//! A value is a double, whatever the parameter: whole numbers and choices are refused when they are not whole, and a
//! parameter that may be left out is NaN when it is.

use hzn_core::body::{AltitudeReference, Kind};
use hzn_core::camera::{Camera, Model};
use hzn_core::config::Mount;
use hzn_core::covariance::Noise;
use hzn_core::edge_points::SubPixel;
use hzn_core::error::ConfigError;
use hzn_core::fit::HalfAngle;
use hzn_core::region::{MAX_CORNERS, MAX_POLYGONS, Polygon};
use hzn_core::threshold;
use hzn_core::{Config, camera, consensus};

/// What a flight computer can be told: the sensor, and how often it tells about itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// The sensor.
    pub sensor: Config,
    /// Frames between two housekeeping packets, 1 to 65535.
    pub housekeeping_every: u16,
}

/// Why a parameter was not taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refused {
    /// No parameter has this number.
    Unknown(u16),
    /// This parameter cannot have this value: not whole, no such choice, or out of its type.
    Value(u16, f64),
    /// The parameters together are refused.
    Config(ConfigError),
}

impl core::fmt::Display for Refused {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Unknown(id) => write!(f, "no parameter has the number {id}"),
            Self::Value(id, value) => write!(f, "{} cannot be {value}", name(*id).unwrap_or("?")),
            Self::Config(e) => e.fmt(f),
        }
    }
}
impl core::error::Error for Refused {}

/// A type that a parameter's value is turned to and from.
trait Value: Sized {
    fn to_f64(&self) -> f64;
    fn from_f64(x: f64) -> Option<Self>;
}
impl Value for f64 {
    fn to_f64(&self) -> f64 {
        *self
    }
    fn from_f64(x: f64) -> Option<Self> {
        x.is_finite().then_some(x)
    }
}
macro_rules! whole {
    ($($t:ty),*) => {$(
        impl Value for $t {
            fn to_f64(&self) -> f64 {
                f64::from(*self)
            }
            fn from_f64(x: f64) -> Option<Self> {
                let whole = x as $t;
                (f64::from(whole) == x).then_some(whole)
            }
        }
    )*};
}
whole!(u16, u32);
impl<T: Value> Value for Option<T> {
    fn to_f64(&self) -> f64 {
        self.as_ref().map_or(f64::NAN, T::to_f64)
    }
    fn from_f64(x: f64) -> Option<Self> {
        if x.is_nan() { Some(None) } else { T::from_f64(x).map(Some) }
    }
}
macro_rules! choice {
    ($($t:ty { $($n:literal $variant:ident),* })*) => {$(
        impl Value for $t {
            fn to_f64(&self) -> f64 {
                // The methods of published systems do not fly; on a host they may be built.
                #[allow(unreachable_patterns)]
                match self {
                    $(Self::$variant => $n as f64,)*
                    _ => f64::NAN,
                }
            }
            fn from_f64(x: f64) -> Option<Self> {
                match u8::from_f64_whole(x)? {
                    $($n => Some(Self::$variant),)*
                    _ => None,
                }
            }
        }
    )*};
}
trait FromWhole {
    fn from_f64_whole(x: f64) -> Option<u8>;
}
impl FromWhole for u8 {
    fn from_f64_whole(x: f64) -> Option<u8> {
        u16::from_f64(x).and_then(|n| u8::try_from(n).ok())
    }
}
choice! {
    Model { 0 KannalaBrandt, 1 Equidistant, 2 Pinhole, 3 BrownConrady }
    Kind { 0 Earth, 1 EarthSphere, 2 Sun, 3 Moon, 4 Sphere }
    threshold::Method { 0 Otsu, 1 Fixed, 2 Dynamic }
    SubPixel { 0 Linear, 1 None }
    consensus::Method { 0 TwoPoint, 1 None }
    HalfAngle { 0 Fused, 1 Known, 2 Free }
    AltitudeReference { 0 Ellipsoid, 1 Sphere }
    Noise { 0 Told, 1 Rms }
}

/// One line a parameter: number, name as in sensor.toml, place.
macro_rules! parameters {
    ($($id:literal $name:literal $($place:ident).+;)*) => {
        /// The numbers of all parameters but the lens's coefficients, the mounting and the mask.
        const PLAIN: &[u16] = &[$($id),*];

        fn plain_name(id: u16) -> Option<&'static str> {
            match id {
                $($id => Some($name),)*
                _ => None,
            }
        }
        fn get_plain(p: &Parameters, id: u16) -> Option<f64> {
            match id {
                $($id => Some(p.$($place).+.to_f64()),)*
                _ => None,
            }
        }
        fn set_plain(p: &mut Parameters, id: u16, value: f64) -> Result<(), Refused> {
            match id {
                $($id => p.$($place).+ = Value::from_f64(value).ok_or(Refused::Value(id, value))?,)*
                _ => return Err(Refused::Unknown(id)),
            }
            Ok(())
        }
    };
}
parameters! {
    1 "camera.width" sensor.camera.width;
    2 "camera.height" sensor.camera.height;
    3 "camera.model" sensor.camera.model;
    4 "camera.fx_px" sensor.camera.fx_px;
    5 "camera.fy_px" sensor.camera.fy_px;
    6 "camera.cx_px" sensor.camera.cx_px;
    7 "camera.cy_px" sensor.camera.cy_px;
    13 "camera.theta_max_deg" sensor.camera.theta_max_deg;
    14 "camera.focal_sigma_percent" sensor.camera.focal_sigma_percent;
    15 "camera.centre_sigma_px" sensor.camera.centre_sigma_px;
    16 "camera.readout_s" sensor.camera.readout_s;
    30 "body.kind" sensor.body.kind;
    31 "body.radius_km" sensor.body.radius_km;
    32 "body.altitude_km" sensor.body.altitude_km;
    33 "body.altitude_sigma_km" sensor.body.altitude_sigma_km;
    34 "body.limb_height_km" sensor.body.limb_height_km;
    35 "body.limb_height_sigma_km" sensor.body.limb_height_sigma_km;
    36 "body.altitude_reference" sensor.body.altitude_reference;
    37 "body.clipped_height_km" sensor.body.clipped_height_km;
    38 "body.clipped_sigma_km" sensor.body.clipped_sigma_km;
    40 "gate.min_mean" sensor.gate.min_mean;
    41 "gate.max_mean" sensor.gate.max_mean;
    50 "binarize.method" sensor.binarize.method;
    51 "binarize.level" sensor.binarize.level;
    52 "binarize.factor" sensor.binarize.factor;
    53 "binarize.scale" sensor.binarize.scale;
    60 "contour.line_spacing_px" sensor.contour.line_spacing_px;
    70 "candidates.min_points" sensor.candidates.min_points;
    71 "candidates.keep_points" sensor.candidates.keep_points;
    72 "candidates.sub_pixel" sensor.candidates.sub_pixel;
    80 "reject.method" sensor.reject.method;
    81 "reject.threshold_px" sensor.reject.threshold_px;
    82 "reject.seed" sensor.reject.seed;
    83 "reject.max_draws" sensor.reject.max_draws;
    84 "reject.noise_sigma" sensor.reject.noise_sigma;
    90 "estimate.half_angle" sensor.estimate.half_angle;
    100 "covariance.sigma_px" sensor.covariance.sigma_px;
    101 "covariance.correlation_px" sensor.covariance.correlation_px;
    102 "covariance.noise" sensor.covariance.noise;
    103 "covariance.bias_px" sensor.covariance.bias_px;
    104 "covariance.tilt_px" sensor.covariance.tilt_px;
    110 "select.min_inliers" sensor.select.min_inliers;
    111 "select.min_arc_px" sensor.select.min_arc_px;
    112 "select.max_rms_px" sensor.select.max_rms_px;
    113 "select.max_half_angle_sigma" sensor.select.max_half_angle_sigma;
    114 "select.max_sigma_deg" sensor.select.max_sigma_deg;
    115 "select.min_support" sensor.select.min_support;
    116 "select.max_lit_sky" sensor.select.max_lit_sky;
    120 "limits.max_work" sensor.limits.max_work;
    300 "telemetry.housekeeping_every" housekeeping_every;
}

/// Coefficients of the lens: `camera.k[0]` and on.
const K: u16 = 8;
const K_COUNT: u16 = 5;
/// The mounting's quaternion: w, x, y, z; NaN without one.
const MOUNT: u16 = 20;
/// Corners of polygon 0 and on. Setting it makes so many corners, all at the origin where they are new.
const CORNERS: u16 = 200;
/// x of corner 0 of polygon 0; then its y, the next corner, the next polygon.
const CORNER: u16 = 1000;
const POLYGON: u16 = 2 * MAX_CORNERS as u16;

/// The name of a parameter: as in sensor.toml, with an index where it is one of several.
pub fn name(id: u16) -> Option<&'static str> {
    plain_name(id).or(match id {
        8..=12 => Some("camera.k"),
        20..=23 => Some("mount.q_body_from_camera_wxyz"),
        200..=207 => Some("mask corners"),
        1000..=1255 => Some("mask.polygons_px"),
        _ => None,
    })
}

impl Parameters {
    /// The defaults for a sensor.
    pub fn new(sensor: Config) -> Self {
        Self { sensor, housekeeping_every: 10 }
    }

    /// The defaults before anything was loaded: an ideal lens of 640×480 at 230 km above the Earth.
    pub fn idle() -> Self {
        let mut sensor = Config::new(camera::Config::ideal(Model::Pinhole, 640, 480, 600.0));
        sensor.body.altitude_km = Some(230.0);
        Self::new(sensor)
    }

    /// The number of the body that a sensor looks for: parameter 30.
    pub fn body_number(config: &Config) -> u8 {
        config.body.kind.to_f64() as u8
    }

    /// The body of a number, as parameter 30 has it.
    pub fn body(number: u8) -> Option<Kind> {
        Kind::from_f64(f64::from(number))
    }

    /// The number of a parameter by its name in sensor.toml; of one that has several numbers, the first.
    pub fn named(name: &str) -> Option<u16> {
        PLAIN.iter().copied().chain([K, MOUNT]).find(|&id| self::name(id) == Some(name))
    }

    /// The numbers of every parameter that has a value now, in the order in which they must be set.
    pub fn numbers(&self) -> impl Iterator<Item = u16> + '_ {
        let polygons = &self.sensor.mask.polygons_px;
        let corners = (CORNER..).step_by(usize::from(POLYGON)).zip(polygons);
        PLAIN
            .iter()
            .copied()
            .chain(K..K + K_COUNT)
            .chain(MOUNT..MOUNT + 4)
            .chain(CORNERS..CORNERS + MAX_POLYGONS as u16)
            .chain(corners.flat_map(|(first, polygon)| first..first + 2 * polygon.len() as u16))
    }

    /// The value of a parameter; `None` for a number that has none.
    pub fn get(&self, id: u16) -> Option<f64> {
        if let Some(value) = get_plain(self, id) {
            return Some(value);
        }
        let c = &self.sensor;
        if let Some(i) = within(id, K, K_COUNT) {
            return Some(c.camera.coefficient(i));
        }
        if let Some(i) = within(id, MOUNT, 4) {
            return Some(c.mount.map_or(f64::NAN, |m| m.q_body_from_camera_wxyz.get(i).copied().unwrap_or(f64::NAN)));
        }
        if let Some(i) = within(id, CORNERS, MAX_POLYGONS as u16) {
            return Some(c.mask.polygons_px.get(i).map_or(0.0, |p| p.len() as f64));
        }
        let i = within(id, CORNER, MAX_POLYGONS as u16 * POLYGON)?;
        let polygon = c.mask.polygons_px.get(i / usize::from(POLYGON))?;
        polygon.get(i % usize::from(POLYGON) / 2)?.get(i % 2).copied()
    }

    /// Sets a parameter. Whether it goes together with the others is the business of [`Self::check`].
    ///
    /// # Errors
    /// No such parameter, or not a value for it.
    pub fn set(&mut self, id: u16, value: f64) -> Result<(), Refused> {
        let no = Refused::Value(id, value);
        let c = &mut self.sensor;
        if let Some(i) = within(id, K, K_COUNT) {
            let value = f64::from_f64(value).ok_or(no)?;
            while c.camera.k.len() <= i && value != 0.0 {
                c.camera.k.push(0.0).map_err(|_| no)?;
            }
            if let Some(k) = c.camera.k.get_mut(i) {
                *k = value;
            }
            return Ok(());
        }
        if let Some(i) = within(id, MOUNT, 4) {
            if value.is_nan() {
                c.mount = None;
                return Ok(());
            }
            let value = f64::from_f64(value).ok_or(no)?;
            let mount = c.mount.get_or_insert(Mount { q_body_from_camera_wxyz: [0.0; 4] });
            if let Some(q) = mount.q_body_from_camera_wxyz.get_mut(i) {
                *q = value;
            }
            return Ok(());
        }
        if let Some(i) = within(id, CORNERS, MAX_POLYGONS as u16) {
            let corners = usize::from(u16::from_f64(value).ok_or(no)?);
            let polygons = &mut c.mask.polygons_px;
            if corners == 0 {
                polygons.truncate(i);
                return Ok(());
            }
            // Polygons stand one after another.
            if polygons.len() == i {
                polygons.push(Polygon::new()).map_err(|_| no)?;
            }
            let polygon = polygons.get_mut(i).ok_or(no)?;
            return polygon.resize(corners, [0.0; 2]).map_err(|_| no);
        }
        if let Some(i) = within(id, CORNER, MAX_POLYGONS as u16 * POLYGON) {
            let value = f64::from_f64(value).ok_or(no)?;
            let polygon = c.mask.polygons_px.get_mut(i / usize::from(POLYGON)).ok_or(no)?;
            let corner = polygon.get_mut(i % usize::from(POLYGON) / 2).ok_or(no)?;
            *corner.get_mut(i % 2).ok_or(no)? = value;
            return Ok(());
        }
        set_plain(self, id, value)
    }

    /// Whether every value can be told by a number: several bodies in one picture and the methods of published systems
    /// cannot.
    ///
    /// # Errors
    /// What cannot.
    pub fn flyable(&self) -> Result<(), &'static str> {
        let c = &self.sensor;
        let mut same = Self { sensor: Config::new(c.camera.clone()), housekeeping_every: self.housekeeping_every };
        for id in self.numbers() {
            let value = self.get(id).unwrap_or(f64::NAN);
            if same.set(id, value).is_err() {
                return Err(name(id).unwrap_or("a value that does not fly"));
            }
        }
        // Colours are mixed on the ground only.
        same.sensor.input = c.input;
        if same.sensor == self.sensor {
            Ok(())
        } else {
            Err("this sensor has settings that do not fly (book/reference/telemetry.md)")
        }
    }

    /// Whether the parameters go together.
    ///
    /// # Errors
    /// The first field out of its limits.
    pub fn check(&self) -> Result<(), Refused> {
        if self.housekeeping_every == 0 {
            return Err(Refused::Value(300, 0.0));
        }
        self.sensor.check().map_err(Refused::Config)?;
        Camera::<f32>::try_new(&self.sensor.camera).map(drop).map_err(Refused::Config)
    }
}

/// The place of a number within a range of them.
fn within(id: u16, first: u16, count: u16) -> Option<usize> {
    id.checked_sub(first).filter(|&i| i < count).map(usize::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn full() -> Parameters {
        let mut p = Parameters::idle();
        p.sensor.camera.model = Model::KannalaBrandt;
        p.sensor.camera.k = [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect();
        p.sensor.camera.theta_max_deg = Some(54.0);
        p.sensor.mount = Some(Mount { q_body_from_camera_wxyz: [0.6, 0.0, 0.8, 0.0] });
        p.sensor.select.min_arc_px = Some(55.5);
        for n in [3usize, 16, 4] {
            let polygon = (0..n).map(|i| [i as f64 * 7.5, 3.0 - i as f64]).collect();
            p.sensor.mask.polygons_px.push(polygon).unwrap();
        }
        p.housekeeping_every = 3;
        p
    }

    #[test]
    fn every_parameter_survives_a_round_trip() {
        let from = full();
        from.check().unwrap();
        let mut to = Parameters::idle();
        for id in from.numbers() {
            assert!(name(id).is_some(), "{id}");
            to.set(id, from.get(id).unwrap()).unwrap();
        }
        assert_eq!(to, from);
        // And back: what is not there is taken away again.
        for id in Parameters::idle().numbers() {
            to.set(id, Parameters::idle().get(id).unwrap()).unwrap();
        }
        assert_eq!(to.sensor.mask.polygons_px.len(), 0);
        assert_eq!(to.sensor.mount, None);
        to.check().unwrap();
    }

    #[test]
    fn numbers_are_unique() {
        let p = full();
        let mut ids: Vec<u16> = p.numbers().collect();
        let count = ids.len();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), count);
    }

    #[test]
    fn bad_values_are_refused_and_change_nothing() {
        let mut p = full();
        let before = p.clone();
        for (id, value) in
            [(1, 640.5), (1, -1.0), (1, 65536.0), (3, 4.0), (4, f64::NAN), (120, 5e9), (1000 + 2 * 3, 1.0)]
        {
            assert!(matches!(p.set(id, value), Err(Refused::Value(n, _)) if n == id), "{id} {value}");
        }
        assert_eq!(p.set(999, 1.0), Err(Refused::Unknown(999)));
        assert_eq!(p, before);
        // A value of the right type and beyond its limits is for `check`.
        p.set(4, -5.0).unwrap();
        assert!(matches!(p.check(), Err(Refused::Config(e)) if e.field == "camera.fx_px"));
    }
}
