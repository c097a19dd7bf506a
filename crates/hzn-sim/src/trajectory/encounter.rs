//! A camera that meets a planet or moon, and the Sun that lights it.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::point::Point;
use crate::counter::{Counter, Stream};

/// The place of the camera in the body-fixed frame, and the side from which the Sun shines. Each pair has the values of
/// the first and the last picture. The range changes by equal factors in equal times, the angles change evenly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Encounter {
    /// Distance from the camera to the centre of the body, kilometres.
    pub range_km: [f64; 2],
    /// Planetocentric latitude of the camera, degrees.
    #[serde(default)]
    pub latitude_deg: [f64; 2],
    /// Planetocentric longitude of the camera, degrees to the east.
    #[serde(default)]
    pub longitude_deg: [f64; 2],
    /// Phase angle: the angle at the body between Sun and camera, degrees. 0 is a full disc, 180 the night side.
    #[serde(default)]
    pub phase_deg: [f64; 2],
    /// Direction of the Sun as the camera sees it: the angle about the line of sight, degrees clockwise from the body's
    /// north.
    #[serde(default)]
    pub sun_angle_deg: [f64; 2],
    /// 1-sigma of a random offset of each angle above. It is the same for all pictures; another seed gives another one.
    #[serde(default)]
    pub scatter_deg: f64,
    /// Mean radius of the body, kilometres. The scene sets it.
    #[serde(skip)]
    pub radius_km: f64,
}

/// [`Encounter`], prepared for evaluation.
#[derive(Debug, Clone, Copy)]
pub(super) struct PreparedEncounter {
    encounter: Encounter,
    span_s: [f64; 2],
    /// Offsets of latitude, longitude, phase and direction of the Sun, degrees.
    offsets_deg: [f64; 4],
}

/// The directions that a camera near a body needs, body-fixed and of unit length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    /// From the body to the camera.
    pub(super) from_body: Vector3<f64>,
    /// The body's north, perpendicular to the line of sight.
    pub(super) north: Vector3<f64>,
    /// Towards the Sun, perpendicular to the line of sight.
    pub(super) sunward: Vector3<f64>,
    /// Towards the Sun.
    pub(super) sun: Vector3<f64>,
    /// Angular radius of the body, radians.
    pub(super) radius_rad: f64,
}

impl PreparedEncounter {
    /// In case of an error, returns the key with the invalid value, and a message.
    pub(super) fn try_new(encounter: &Encounter, span_s: [f64; 2], seed: u64) -> Result<Self, (String, String)> {
        let wrong = |key: &str, rule: String| Err((format!("[trajectory] encounter.{key}"), rule));
        let ranges = [
            ("latitude_deg", encounter.latitude_deg, 90.0),
            ("longitude_deg", encounter.longitude_deg, 3.6e6),
            ("sun_angle_deg", encounter.sun_angle_deg, 3.6e6),
            ("scatter_deg", [encounter.scatter_deg; 2], 180.0),
        ];
        for (key, values, limit) in ranges {
            if let Some(x) = values.into_iter().find(|x| !(x.abs() <= limit)) {
                return wrong(key, format!("{x} is refused: must be -{limit} to {limit}"));
            }
        }
        if let Some(x) = encounter.phase_deg.into_iter().find(|x| !(0.0..=180.0).contains(x)) {
            return wrong("phase_deg", format!("{x} is refused: must be 0 (full) to 180"));
        }
        if let Some(x) = encounter.range_km.into_iter().find(|x| !(*x > encounter.radius_km && *x < 1e12)) {
            let rule = format!("{x} is refused: must be above the mean radius of the body, {}", encounter.radius_km);
            return wrong("range_km", rule);
        }
        let draws = Counter::new(seed, Stream::Encounter);
        let offsets_deg = [0, 1, 2, 3].map(|i| encounter.scatter_deg * draws.normal(i));
        Ok(Self { encounter: *encounter, span_s, offsets_deg })
    }

    /// Returns a pair's value at a time, in degrees or kilometres.
    fn fraction(&self, time_s: f64) -> f64 {
        let [from_s, to_s] = self.span_s;
        ((time_s - from_s) / (to_s - from_s).max(1e-9)).clamp(0.0, 1.0)
    }

    fn range_m(&self, time_s: f64) -> f64 {
        let [first, last] = self.encounter.range_km;
        1e3 * first * libm::pow(last / first, self.fraction(time_s))
    }

    /// Returns the directions at a time.
    pub(super) fn sight(&self, time_s: f64) -> Sight {
        let at = |[first, last]: [f64; 2], offset: f64| first + (last - first) * self.fraction(time_s) + offset;
        let [latitude, longitude, phase, turn] = self.offsets_deg;
        let e = &self.encounter;
        let angle = |deg: f64| libm::sincos(deg.to_radians());
        let (sin_lat, cos_lat) = angle(at(e.latitude_deg, latitude).clamp(-90.0, 90.0));
        let (sin_lon, cos_lon) = angle(at(e.longitude_deg, longitude));
        let from_body = Vector3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat);
        // Over a pole this is the limit along the meridian.
        let north = Vector3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat);
        let (sin_turn, cos_turn) = angle(at(e.sun_angle_deg, turn));
        let sunward = north * cos_turn + north.cross(&from_body) * sin_turn;
        // The offset of the phase is reflected at both ends.
        let phase = (180.0 - (180.0 - at(e.phase_deg, phase).abs()).abs()).abs();
        let (sin_phase, cos_phase) = angle(phase);
        let sun = from_body * cos_phase + sunward * sin_phase;
        let radius_rad = libm::asin((e.radius_km * 1e3 / self.range_m(time_s)).min(1.0));
        Sight { from_body, north, sunward, sun, radius_rad }
    }

    pub(super) fn point(&self, time_s: f64) -> Point {
        let position = |time_s: f64| self.sight(time_s).from_body * self.range_m(time_s);
        let velocity_mps = (position(time_s + 0.5) - position(time_s - 0.5)) / 1.0;
        // The path is no orbit; a scene with an encounter has no accelerometers.
        Point { position_m: position(time_s), velocity_mps, specific_force_mps2: Vector3::zeros() }
    }
}
