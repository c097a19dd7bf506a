//! The body in the pictures of a camera without a calibration.

use hzn_core::body::{self, Kind};

/// The body in the pictures of a camera without a calibration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Body {
    /// The Earth.
    #[default]
    Earth,
    /// The Moon as an orbiter or a lander sees it.
    Moon,
    /// The Sun, whose disc has a known size wherever the camera is near the Earth: it needs no altitude.
    Sun,
    /// A planet or another moon, of which the sensor has the radii; see [`Body::all`].
    Other(Kind),
}

impl Body {
    /// Returns all bodies: the Earth, the Moon, the Sun, and the planets and moons that `body.kind` names.
    pub fn all() -> impl Iterator<Item = Self> {
        let has_radii = |kind: &Kind| *kind != Kind::Ellipsoid && body::Config::of_kind(*kind, None).is_ellipsoid();
        [Self::Earth, Self::Moon, Self::Sun]
            .into_iter()
            .chain(Kind::ALL.iter().copied().filter(has_radii).map(Self::Other))
    }
    /// Returns the name, for example `mars`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Earth => Kind::Earth.name(),
            Self::Moon => Kind::Moon.name(),
            Self::Sun => Kind::Sun.name(),
            Self::Other(kind) => kind.name(),
        }
    }
    /// Returns the body with a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().find(|body| body.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_have_names() {
        assert_eq!(Body::from_name("mars"), Some(Body::Other(Kind::Mars)));
        assert_eq!([Body::from_name("earth"), Body::from_name("moon")], [Some(Body::Earth), Some(Body::Moon)]);
        assert_eq!(Body::from_name("sun"), Some(Body::Sun));
        // Their radii must be told.
        assert!(["sphere", "ellipsoid", "earth-sphere"].iter().all(|name| Body::from_name(name).is_none()));
        assert!(Body::all().count() > 30);
    }
}
