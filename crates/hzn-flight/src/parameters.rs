//! Every parameter by number. The numbers are frozen: a number is never used for another parameter.
//!
//! The value of every parameter is a double. Whole numbers and choices are refused if the value is not whole. NaN means
//! that an optional parameter is not set.

use hzn_core::Config;
use hzn_core::body::Kind;
use hzn_core::camera::{self, Camera, Model};
use hzn_core::error::ConfigError;
use hzn_core::keys::Value;
use hzn_core::region::{MAX_CORNERS, MAX_POLYGONS, Polygon};

use crate::operations::Operations;

/// The parameters of a flight computer.
///
/// ```
/// use hzn_flight::Parameters;
/// use hzn_flight::parameters::{Refused, name};
///
/// let mut parameters = Parameters::defaults();
/// assert_eq!((name(81), parameters.get(81)), (Some("consensus.threshold_px"), Some(3.0)));
/// parameters.set(81, 2.5)?;
/// assert_eq!(parameters.sensor.consensus.threshold_px, 2.5);
/// assert_eq!(parameters.set(9999, 1.0), Err(Refused::Unknown(9999)));
/// # Ok::<(), Refused>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// The sensor.
    pub sensor: Config,
    /// The flight software itself.
    pub operations: Operations,
}

/// Why a parameter was refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refused {
    /// No parameter has this number.
    Unknown(u16),
    /// This parameter cannot have this value: it is not whole, not a valid choice, or out of the range of its type.
    Value(u16, f64),
    /// The combination of the parameters is refused.
    Config(ConfigError),
}

impl Refused {
    /// Returns the number of the refused parameter; 0 if it has none. Of a parameter with several numbers, such as a
    /// corner of a mask, this is the first one.
    pub fn number(&self) -> u16 {
        match self {
            Self::Unknown(id) | Self::Value(id, _) => *id,
            Self::Config(e) => Parameters::number_of(e.field).unwrap_or(0),
        }
    }
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

/// Largest `limits.max_work` of a flight computer: four times the default. The most expensive unit found costs 81
/// instructions, so a picture ends after 80 million, which is 0.2 s on a processor with 400 million instructions a
/// second.
/// Otherwise the watchdog could reset the computer in every picture.
pub const MAX_WORK: u32 = 983_040;
const WORK: u16 = 120;
/// Number of corners of polygon 0; the polygons after it follow. Setting it adds or removes corners; new corners are at
/// the origin.
const CORNERS: u16 = 200;
/// x of corner 0 of polygon 0; its y, the next corner and the next polygon follow.
const CORNER: u16 = 1000;
const POLYGON: u16 = 2 * MAX_CORNERS as u16;

/// Returns the name of a parameter: its key in sensor.toml. One key can have several numbers.
pub fn name(id: u16) -> Option<&'static str> {
    Config::path(id).or(match id {
        200..=207 => Some("mask corners"),
        1000..=1255 => Some("mask.polygons_px"),
        _ => Operations::name(id),
    })
}

impl Parameters {
    /// Makes the default parameters for a sensor.
    pub fn new(sensor: Config) -> Self {
        Self { sensor, operations: Operations::default() }
    }

    /// Makes the default parameters before any are loaded: an ideal lens of 640×480 pixels at 230 km above the Earth.
    pub fn defaults() -> Self {
        let mut sensor = Config::new(camera::Config::ideal(Model::Pinhole, 640, 480, 600.0));
        sensor.body.altitude_km = Some(230.0);
        Self::new(sensor)
    }

    /// Returns the number of the body that a sensor looks for, as in parameter 30.
    pub fn body_number(config: &Config) -> u8 {
        config.body.kind.number(0) as u8
    }

    /// Returns the body with a number, as in parameter 30.
    pub fn body(number: u8) -> Option<Kind> {
        let mut kind = Kind::default();
        kind.set_number(0, f64::from(number))?;
        Some(kind)
    }

    /// Returns the number of a parameter by its name in sensor.toml. If the name has several numbers, returns the
    /// first.
    pub fn number_of(name: &str) -> Option<u16> {
        Config::numbers().chain(Operations::NUMBERS.iter().copied()).find(|&id| self::name(id) == Some(name))
    }

    /// Returns the numbers of all parameters that have a value now, in the order in which they must be set.
    pub fn numbers(&self) -> impl Iterator<Item = u16> + '_ {
        self.sensor_numbers().chain(Operations::NUMBERS.iter().copied())
    }

    /// Returns the numbers of the parameters of the sensor, without those of the flight software.
    pub fn sensor_numbers(&self) -> impl Iterator<Item = u16> + '_ {
        let polygons = &self.sensor.mask.polygons_px;
        let corners = (CORNER..).step_by(usize::from(POLYGON)).zip(polygons);
        // Counts of corners come before corners, because `set` refuses a corner that does not exist.
        Config::numbers()
            .chain(CORNERS..CORNERS + MAX_POLYGONS as u16)
            .chain(corners.flat_map(|(first, polygon)| first..first + 2 * polygon.len() as u16))
    }

    /// Returns the value of a parameter; `None` if there is no such parameter.
    pub fn get(&self, id: u16) -> Option<f64> {
        if let Some(value) = self.operations.get(id) {
            return Some(value);
        }
        let c = &self.sensor;
        if let Some(value) = c.number(id) {
            return Some(value);
        }
        if let Some(i) = index_within(id, CORNERS, MAX_POLYGONS as u16) {
            return Some(c.mask.polygons_px.get(i).map_or(0.0, |p| p.len() as f64));
        }
        let i = index_within(id, CORNER, MAX_POLYGONS as u16 * POLYGON)?;
        let polygon = c.mask.polygons_px.get(i / usize::from(POLYGON))?;
        polygon.get(i % usize::from(POLYGON) / 2)?.get(i % 2).copied()
    }

    /// Sets a parameter. [`Self::check`] checks the combination with the others.
    ///
    /// # Errors
    /// There is no such parameter, or the value is not possible for it.
    pub fn set(&mut self, id: u16, value: f64) -> Result<(), Refused> {
        let refused = Refused::Value(id, value);
        let c = &mut self.sensor;
        if let Some(accepted) = self.operations.set(id, value) {
            return if accepted { Ok(()) } else { Err(refused) };
        }
        if let Some(accepted) = c.set_number(id, value) {
            return if accepted { Ok(()) } else { Err(refused) };
        }
        if let Some(i) = index_within(id, CORNERS, MAX_POLYGONS as u16) {
            let mut corners = 0_u16;
            // Set as a key with this type, so that numbers that are not whole are refused.
            corners.set_number(0, value).ok_or(refused)?;
            let corners = usize::from(corners);
            let polygons = &mut c.mask.polygons_px;
            if corners == 0 {
                // The later polygons go, too, because polygons have numbers without gaps.
                polygons.truncate(i);
                return Ok(());
            }
            // Polygons are numbered without gaps.
            if polygons.len() == i {
                polygons.push(Polygon::new()).map_err(|_| refused)?;
            }
            let polygon = polygons.get_mut(i).ok_or(refused)?;
            return polygon.resize(corners, [0.0; 2]).map_err(|_| refused);
        }
        if let Some(i) = index_within(id, CORNER, MAX_POLYGONS as u16 * POLYGON) {
            // A corner cannot be unset, so that NaN, which unsets other parameters, is refused.
            let value = Some(value).filter(|x| x.is_finite()).ok_or(refused)?;
            let polygon = c.mask.polygons_px.get_mut(i / usize::from(POLYGON)).ok_or(refused)?;
            let corner = polygon.get_mut(i % usize::from(POLYGON) / 2).ok_or(refused)?;
            *corner.get_mut(i % 2).ok_or(refused)? = value;
            return Ok(());
        }
        Err(Refused::Unknown(id))
    }

    /// Checks that a flight computer can take all values: each key and each choice needs a number.
    ///
    /// # Errors
    /// Returns the first key that a flight computer cannot take.
    pub fn check_flyable(&self) -> Result<(), &'static str> {
        // A second set of parameters gets the numbers alone, as in flight. A key without a number then shows as a
        // difference, so that it is refused instead of dropped.
        let sensor = Config::new(self.sensor.camera.clone());
        let mut flown = Self { sensor, operations: self.operations.clone() };
        for id in self.numbers() {
            let value = self.get(id).unwrap_or(f64::NAN);
            if flown.set(id, value).is_err() {
                return Err(name(id).unwrap_or("mask"));
            }
        }
        // Colours and orientation of pictures are handled on the ground, so `input` does not count. The mask was set by
        // its corners.
        flown.sensor.input = self.sensor.input;
        // The height of the limb is a parameter; where it comes from is not.
        flown.sensor.body.limb = self.sensor.body.limb;
        match self.sensor.differing_on_ground(&flown.sensor) {
            Some(path) => Err(path),
            None => Ok(()),
        }
    }

    /// Checks the combination of all parameters.
    ///
    /// # Errors
    /// Returns the first field that is out of its limits.
    pub fn check(&self) -> Result<(), Refused> {
        if let Some((id, value)) = self.operations.check() {
            return Err(Refused::Value(id, value));
        }
        if let Some(work) = self.sensor.limits.max_work.filter(|&work| work > MAX_WORK) {
            return Err(Refused::Value(WORK, f64::from(work)));
        }
        self.sensor.check().map_err(Refused::Config)?;
        // The lens is checked, too, because `Sensor::new` does both: what passes here makes a sensor.
        Camera::<f32>::try_new(&self.sensor.camera).map(drop).map_err(Refused::Config)
    }
}

/// Returns the index of a number within a range of numbers.
fn index_within(id: u16, first: u16, count: u16) -> Option<usize> {
    id.checked_sub(first).filter(|&i| i < count).map(usize::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::config::Mount;
    use std::vec::Vec;

    fn full() -> Parameters {
        let mut p = Parameters::defaults();
        p.sensor.camera.model = Model::KannalaBrandt;
        p.sensor.camera.k = [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect();
        p.sensor.camera.theta_max_deg = Some(54.0);
        p.sensor.mount = Some(Mount { q_vehicle_from_camera_wxyz: [0.6, 0.0, 0.8, 0.0] });
        p.sensor.gates.min_arc_px = Some(55.5);
        for n in [3usize, 16, 4] {
            let polygon = (0..n).map(|i| [i as f64 * 7.5, 3.0 - (i * i) as f64]).collect();
            p.sensor.mask.polygons_px.push(polygon).unwrap();
        }
        p.operations.housekeeping_every = 3;
        p.operations.shut_down_after_s = Some(590.0);
        p
    }

    #[test]
    fn every_parameter_survives_a_round_trip() {
        let from = full();
        from.check().unwrap();
        let mut to = Parameters::defaults();
        for id in from.numbers() {
            assert!(name(id).is_some(), "{id}");
            to.set(id, from.get(id).unwrap()).unwrap();
        }
        assert_eq!(to, from);
        // In the other direction, parameters that the defaults do not have are removed.
        for id in Parameters::defaults().numbers() {
            to.set(id, Parameters::defaults().get(id).unwrap()).unwrap();
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
        // A value of the right type that is out of its limits is refused by `check` only.
        let mut dear = p.clone();
        dear.set(120, 983_041.0).unwrap();
        assert_eq!(dear.check(), Err(Refused::Value(120, 983_041.0)));
        p.set(4, -5.0).unwrap();
        assert!(matches!(p.check(), Err(Refused::Config(e)) if e.field == "camera.fx_px"));
    }
}
