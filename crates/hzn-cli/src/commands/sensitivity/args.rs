//! The arguments of `hzn sensitivity`.

use std::path::PathBuf;

use hzn_core::body::Limb;

use super::body::Body;
use super::sweep::Values;
use crate::exit::Stop;

/// Predict the accuracy of a camera without pictures: sigma of the direction by field of view, altitude, resolution
///
/// A value may be a number (94.4), a list (60,90,120) or a range (60:150 or 60:150:10); the table has a row for every
/// combination. The limb is that of a sphere. Its points are a pixel apart, with errors that are correlated along the
/// edge. Sigmas are 1 sigma in degrees: pitch in the plane of optical axis and body, roll across it. `free` fits the
/// half-angle, `fused` also uses altitude and limb height with their sigmas (as `hzn run` does), `known` treats them as
/// exact.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Sigmas of the direction, or of the rotation about it; or the field of view that shows each kind of limb; or the
    /// error of treating the Earth as a sphere; or the error of several heads that are one sensor
    #[arg(value_enum, default_value_t = What::Sigma)]
    pub(super) what: What,
    /// Field of view across the width, degrees
    #[arg(long, value_name = "DEG", default_value = "90", conflicts_with = "sensor")]
    pub(super) fov: Values,
    /// Altitude, kilometres
    #[arg(long, value_name = "KM")]
    pub(super) altitude: Option<Values>,
    /// Width and height of the picture, pixels
    #[arg(long, value_name = "WxH", default_value = "1920x1080", conflicts_with = "sensor")]
    pub(super) size: Size,
    /// Rows of the picture; replaces the height, and the width is scaled: resolutions of one sensor area
    #[arg(long, value_name = "PX", conflicts_with = "sensor")]
    pub(super) rows: Option<Values>,
    /// The lens
    #[arg(long, value_enum, default_value_t = Lens::Pinhole, conflicts_with = "sensor")]
    pub(super) lens: Lens,
    /// Take camera, body and errors from this sensor.toml: the sigmas are then those of the sensor itself, with every
    /// term of its error budget, at a known position without an attitude
    #[arg(short, long, value_name = "FILE")]
    pub(super) sensor: Option<PathBuf>,
    /// Bodies: earth, moon, sun, a planet or moon by name, or a radius in kilometres; several with commas
    #[arg(long, value_name = "BODY", value_delimiter = ',')]
    pub(super) body: Vec<Body>,
    /// Limb of the Earth in a thermal band, as in `[body] limb` of a sensor.toml: it gives limb height and sigma
    #[arg(long, value_name = "BAND", value_parser = parse_limb, conflicts_with_all = ["sensor", "limb_height"])]
    pub(super) limb: Option<Limb>,
    /// Height of the visible limb, kilometres [default: that of a sensor.toml, 17 for the Earth]
    #[arg(long, value_name = "KM")]
    pub(super) limb_height: Option<Values>,
    /// 1-sigma of the limb height, kilometres [default: that of a sensor.toml, 7 for the Earth; 2 for a
    /// body without air]
    #[arg(long, value_name = "KM")]
    pub(super) limb_height_sigma: Option<f64>,
    /// 1-sigma of the altitude, kilometres [default: 0.5]
    #[arg(long, value_name = "KM")]
    pub(super) altitude_sigma: Option<f64>,
    /// Angle of the optical axis below the horizontal, degrees; 90 looks straight down
    #[arg(long, value_name = "DEG", default_value = "0", allow_hyphen_values = true)]
    pub(super) depression: Values,
    /// Rotation of the camera about its optical axis, degrees
    #[arg(long, value_name = "DEG", default_value = "0", allow_hyphen_values = true)]
    pub(super) roll: Values,
    /// For `yaw` and `--sensor`: latitude of the camera, degrees; for `yaw` it is the angle at the centre of the body
    #[arg(long, value_name = "DEG", default_value = "0", allow_hyphen_values = true)]
    pub(super) latitude: Values,
    /// For `yaw`: direction of view from north over east, degrees
    #[arg(long, value_name = "DEG", default_value = "0", allow_hyphen_values = true)]
    pub(super) azimuth: Values,
    /// For `yaw`: 1-sigma of the second harmonic of the limb height along the limb, kilometres [default: the 1-sigma of
    /// the limb height]
    #[arg(long, value_name = "KM")]
    pub(super) second_harmonic: Option<f64>,
    /// For `rig`: number of heads
    #[arg(long, value_name = "N", default_value = "1,2,3,4")]
    pub(super) heads: Values,
    /// For `rig`: angle between the directions in which neighbouring heads look, degrees [default: evenly around]
    #[arg(long, value_name = "DEG")]
    pub(super) between: Option<Values>,
    /// For `rig`: 1-sigma of the mount of each head about each axis, degrees
    #[arg(long, value_name = "DEG", default_value = "0")]
    pub(super) mount_sigma: Values,
    /// For `rig`: 1-sigma of the limb height that each head has for itself, kilometres [default: 1.5]
    #[arg(long, value_name = "KM")]
    pub(super) own_height_sigma: Option<f64>,
    /// For `rig`: 1-sigma of a tilt of the limb, kilometres [default: 0.05 for each degree between the limb and the
    /// point below the vehicle, over the root of two]
    #[arg(long, value_name = "KM")]
    pub(super) tilt_sigma: Option<f64>,
    /// 1-sigma of an edge point, pixels [default: 1, the same angle in pixels wider than 0.6°]; with `--sensor` and
    /// `noise = "rms"` the RMS of the residuals [default: that of the simulated scene next to the sensor.toml]
    #[arg(long, value_name = "PX")]
    pub(super) sigma_px: Option<f64>,
    /// Correlation length of the errors along the edge, pixels [default: 300, the same angle in pixels wider than
    /// 0.6°; with `--sensor` that of the sensor]
    #[arg(long, value_name = "PX")]
    pub(super) correlation_px: Option<f64>,
    /// Also write the table (.csv) or a plot over the first range (.svg); may be given twice
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Vec<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    pub(super) force: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum What {
    /// Sigma of the direction
    Sigma,
    /// Sigma of the rotation about the line to a flattened body: the third axis, from the shape of its limb
    Yaw,
    /// Smallest fields of view that show an ellipse, a hyperbola, or the whole disc, by altitude
    Visibility,
    /// Angles between centre, geodetic vertical and limb axis of WGS-84, by latitude and altitude
    SphericalEarth,
    /// Error of the direction from several heads that look at the limb all around, by the equations of `hzn run
    /// rig.toml`: by their number, the angle between them, their field of view, mounts and altitude
    Rig,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Lens {
    /// r = f tan(angle), below 180 degrees
    Pinhole,
    /// r = f angle, up to 350 degrees
    // `hzn init` calls this lens a fisheye.
    #[value(alias = "fisheye")]
    Equidistant,
}

/// Columns and rows of the picture, in pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Size {
    pub(super) width: u16,
    pub(super) height: u16,
}

impl std::str::FromStr for Size {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (w, h) = text.split_once(['x', 'X']).ok_or("expected WIDTHxHEIGHT, such as 1920x1080")?;
        match (w.parse(), h.parse()) {
            (Ok(width), Ok(height)) if width >= 2 && height >= 2 => Ok(Self { width, height }),
            _ => Err("width and height must be whole numbers from 2 to 65535".into()),
        }
    }
}

impl Args {
    /// Returns the bodies of `--body`, or else the Earth, with the limb of `--limb`.
    pub(super) fn bodies(&self) -> Result<Vec<Body>, Stop> {
        let named = if self.body.is_empty() { vec![Body::earth()] } else { self.body.clone() };
        let limb = self.limb.unwrap_or_default();
        named.into_iter().map(|body| body.with_limb(limb)).collect()
    }
}

/// Parses a limb by the names that sensor.toml has.
fn parse_limb(text: &str) -> Result<Limb, String> {
    let known = || Limb::ALL.iter().filter(|limb| **limb != Limb::Height);
    known().find(|limb| limb.name() == text).copied().ok_or_else(|| {
        let names: Vec<_> = known().map(|limb| limb.name()).collect();
        format!("expected one of {}; --limb-height gives another height", names.join(", "))
    })
}
