//! Where the Sun and the Moon are expected in a picture.

use hzn_core::body::Kind;
use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, Fixed, Rotation, UnitVec3};
use hzn_files::FrameData;
use hzn_files::truth::Truth;
use hzn_nav::ephemeris;

use super::frame_view::BodyResult;
use crate::model::quantity::angle_deg;
use crate::model::view::Point;

/// Cameras below this altitude, in km, are nearer to the Earth than the Moon is: its perigee is 356 000 km from the
/// centre of the Earth.
const BELOW_THE_MOON_KM: f64 = 300_000.0;

/// An expected place.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyPlace {
    /// The name; behind a body also the name of the body.
    pub name: String,
    /// Its place in the picture, in pixels.
    pub at: Point,
    /// True if a body hides it.
    pub is_hidden: bool,
}

/// Returns the expected places. The Sun direction comes from frames.csv, else from the truth, else from time, position
/// and attitude. The Moon direction comes from the truth, else from time, position and attitude.
pub fn places(
    data: Option<&FrameData>,
    truth: Option<&Truth>,
    bodies: &[impl AsRef<BodyResult>],
    camera: &Camera<f64>,
) -> Vec<SkyPlace> {
    let sun = data.and_then(|d| d.sun_camera).or_else(|| Some([truth?.sun_x?, truth?.sun_y?, truth?.sun_z?]));
    let moon = truth.and_then(|t| Some([t.moon_x?, t.moon_y?, t.moon_z?]));
    let both = [
        (Kind::Sun, sun.or_else(|| from_ephemeris(data?, ephemeris::sun))),
        (Kind::Moon, moon.or_else(|| from_ephemeris(data?, ephemeris::moon))),
    ];
    let place = |(kind, direction): (Kind, Option<[f64; 3]>)| {
        let direction = UnitVec3::try_new(direction?)?;
        let p = camera.project(&direction)?;
        let behind = bodies.iter().map(AsRef::as_ref).find(|body| hides(body, kind, direction.xyz()));
        let title = if kind == Kind::Sun { "Sun" } else { "Moon" };
        let name = match behind {
            Some(body) => format!("{title}, behind the {}", body_name(body.kind)),
            None => title.to_owned(),
        };
        Some(SkyPlace { name, at: [p.u, p.v], is_hidden: behind.is_some() })
    };
    both.into_iter().filter_map(place).collect()
}

fn body_name(kind: Kind) -> String {
    match kind {
        Kind::Earth | Kind::EarthSphere => "Earth".into(),
        other => other.name().to_owned(),
    }
}

/// Returns true if a body lies between the camera and the Sun or the Moon in this direction.
fn hides(body: &BodyResult, kind: Kind, direction: [f64; 3]) -> bool {
    let is_earth = matches!(body.kind, Kind::Earth | Kind::EarthSphere);
    let is_beyond = match kind {
        Kind::Sun => body.kind != Kind::Sun,
        _ => is_earth && body.row.altitude_km.is_some_and(|km| km < BELOW_THE_MOON_KM),
    };
    let within = |s: &hzn_core::Solution<f64>| angle_deg(direction, s.axis.xyz()) < s.fused_half_angle_rad.to_degrees();
    is_beyond && body.solution().is_some_and(within)
}

/// Returns the direction to the Sun in the camera frame: the given one, or else that of time, position and attitude.
pub(super) fn sun(data: &FrameData) -> Option<[f64; 3]> {
    data.sun_camera.or_else(|| from_ephemeris(data, ephemeris::sun))
}

fn from_ephemeris(data: &FrameData, place: impl Fn(f64) -> ephemeris::Place) -> Option<[f64; 3]> {
    let turn = Rotation::<Cam, Fixed, f64>::assume_from_quaternion(data.q_fixed_from_camera_wxyz?)?.inverse();
    let seen = place(data.utc_s?).seen_from(data.position_km?.map(|km| km * 1e3).into());
    Some(turn.apply(&seen.direction.to_unit()?).xyz())
}

#[cfg(test)]
mod tests {
    use hzn_core::camera::{Config, Model};

    use super::*;
    use crate::work::answers::answer;

    /// Returns the place of a body of the sky that is 10 degrees off the axis of the Earth's cone of 60 degrees.
    fn place(kind: Kind, body: Kind, altitude_km: f64, off_deg: f64) -> SkyPlace {
        let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, 640, 480, 300.0)).unwrap();
        let towards = |deg: f64| [deg.to_radians().sin(), 0.0, deg.to_radians().cos()];
        let [x, y, z] = towards(off_deg);
        let mut truth = Truth::default();
        if kind == Kind::Sun {
            (truth.sun_x, truth.sun_y, truth.sun_z) = (Some(x), Some(y), Some(z));
        } else {
            (truth.moon_x, truth.moon_y, truth.moon_z) = (Some(x), Some(y), Some(z));
        }
        let bodies = [std::sync::Arc::new(answer(body, [0.0, 0.0, 1.0], 30f64.to_radians(), altitude_km))];
        let places = places(None, Some(&truth), &bodies, &camera);
        assert_eq!(places.len(), 1, "{places:?}");
        places[0].clone()
    }

    #[test]
    fn sun_and_moon_within_the_limb_are_behind_the_earth() {
        for (kind, title) in [(Kind::Sun, "Sun"), (Kind::Moon, "Moon")] {
            let behind = place(kind, Kind::EarthSphere, 400.0, 10.0);
            assert_eq!((behind.name, behind.is_hidden), (format!("{title}, behind the Earth"), true));
            let beside = place(kind, Kind::EarthSphere, 400.0, 35.0);
            assert_eq!((beside.name.as_str(), beside.is_hidden), (title, false));
        }
    }

    /// Beyond its own orbit, the camera may see the Moon in front of the Earth. The Sun is always behind it.
    #[test]
    fn far_away_the_moon_may_be_in_front_of_the_earth() {
        assert!(!place(Kind::Moon, Kind::Earth, 400_000.0, 10.0).is_hidden);
        assert!(place(Kind::Sun, Kind::Earth, 400_000.0, 10.0).is_hidden);
        assert!(!place(Kind::Moon, Kind::Moon, 400.0, 10.0).is_hidden, "the Moon does not hide itself");
        assert!(!place(Kind::Sun, Kind::Sun, 400.0, 10.0).is_hidden);
    }
}
