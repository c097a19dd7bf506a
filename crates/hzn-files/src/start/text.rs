//! The text of the sensor.toml.

use core::fmt::Write as _;

use hzn_core::body::MOON_RADIUS_KM;
use hzn_core::camera::{Config, Model};
use hzn_core::tone::Tone;

use super::body::Body;
use super::circle::{self, ImageCircle};
use super::facts::CameraFacts;
use super::focal::Focal;
use super::guess::Guess;
use crate::plausible::airless_limb;

/// 1-sigma of an altitude that is given once for all pictures, as a fraction of it. Orbits are not circular.
const ALTITUDE_FRACTION: f64 = 0.02;

/// Writes the text of the file; `comparison` is the note about the focal length that is not used.
pub(super) fn write_text(
    facts: &CameraFacts,
    guess: &Guess,
    focal: &Focal,
    fov_deg: f64,
    circle: Option<ImageCircle>,
    comparison: Option<&str>,
) -> String {
    let mut text = String::from(
        "# A sensor.toml for a camera without a calibration, by `hzn init`. Unknown properties of the lens are\n\
         # sigmas, which the covariance of the answers includes. A calibration reduces them: `hzn calibrate sky` with\n\
         # pictures of a flight, `hzn calibrate lens` with pictures of a board, `hzn camera convert` with a file.\n\
         # Try it on one picture:  hzn explain PICTURE --sensor sensor.toml --overlay out.png\n\
         # Every other key with its default:  hzn init -o all.toml\n\
         \n\
         preset = \"hzn\"\n\
         \n\
         [camera]\n",
    );
    text += &write_camera(facts, &guess.camera, focal, fov_deg, comparison);
    if !guess.camera.model.is_planar() {
        text += &write_circle(circle, fov_deg);
    }
    text += &write_covariance(guess, focal, facts.pixel_aspect);
    text += &write_body(facts.body, facts.altitude_km);
    if facts.body == Body::Earth {
        text += &write_tone(facts.tone);
    }
    text += &write_bars(facts);
    text
}

/// Writes the text of the file for a calibrated camera.
pub(super) fn write_calibrated(facts: &CameraFacts, camera: &Config, from: &str) -> Result<String, toml::ser::Error> {
    let mut text = format!(
        "# A sensor.toml by `hzn init`. The calibration comes from {from}, which does not say how sure it is:\n\
         # focal_sigma_percent and centre_sigma_px in [camera] are for that.\n\
         # Every other key with its default:  hzn init -o all.toml\n\
         \n\
         preset = \"hzn\"\n\
         \n\
         [camera]\n{}",
        toml::to_string(camera)?
    );
    text += &write_body(facts.body, facts.altitude_km);
    if facts.body == Body::Earth {
        text += &write_tone(facts.tone);
    }
    text += &write_bars(facts);
    Ok(text)
}

/// Writes the size of the pictures, the lens, the focal length with its source, and the picture's centre as the
/// principal point.
fn write_camera(facts: &CameraFacts, camera: &Config, focal: &Focal, fov_deg: f64, comparison: Option<&str>) -> String {
    let mut t = String::new();
    if let Some(camera) = &facts.exif.camera {
        let _ = writeln!(t, "# {}", camera.replace(['\n', '\r'], " "));
    }
    let _ = write!(t, "width = {}\nheight = {}\nmodel = \"{}\"\n", camera.width, camera.height, camera.model.name());
    let is_planar = camera.model.is_planar();
    let _ = writeln!(
        t,
        "# k1 = 0 is {}.\nk = [0.0]",
        if is_planar {
            "an ideal pinhole without distortion"
        } else {
            "an equidistant fisheye: the angle off axis is proportional to the radius"
        }
    );
    let _ = match comparison {
        Some(comparison) => writeln!(t, "# From {}; for comparison, {comparison}.", focal.from),
        None => writeln!(t, "# From {}; {fov_deg:.1} degrees wide.", focal.from),
    };
    if facts.pixel_aspect != 1.0 {
        let _ = writeln!(t, "# A pixel is {:.4} times as wide as high, as the video says.", facts.pixel_aspect);
    }
    let _ = write!(
        t,
        "fx_px = {:.1}\nfy_px = {:.1}\ncx_px = {:.1}                 # the picture's centre\ncy_px = {:.1}\n",
        camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
    );
    if let Some(readout_s) = facts.readout_s {
        let _ = writeln!(
            t,
            "readout_s = {readout_s:.5}           # time from the first row to the last, as the video says"
        );
    }
    t
}

/// Writes the radius of the image circle, or a comment that says what it is for.
fn write_circle(circle: Option<ImageCircle>, fov_deg: f64) -> String {
    match circle {
        Some(ImageCircle::Seen { theta_max_deg }) => format!(
            "# All pictures are dark beyond this angle off axis: this is the rim of the image circle, which must not\n\
             # pass for a limb. If it is the whole Earth in a camera that looks at the nadir, remove this line.\n\
             theta_max_deg = {theta_max_deg:.1}\n"
        ),
        Some(ImageCircle::Assumed { theta_max_deg }) => format!(
            "# The corners would be more than {:.0} degrees off axis: the image circle ends at the sides, as assumed.\n\
             theta_max_deg = {theta_max_deg:.1}\n",
            circle::MAX_DEG
        ),
        None => format!(
            "# theta_max_deg = {:.0}            # radius of the image circle in degrees off axis, if its rim is in the \
             picture\n",
            0.5 * fov_deg
        ),
    }
}

/// Writes the covariance of the guess, with a comment for each sigma.
fn write_covariance(guess: &Guess, focal: &Focal, pixel_aspect: f64) -> String {
    let together = if focal.is_at_edge {
        "\n# A lens of another shape and the same field of view has another focal length, so that both change together."
    } else {
        ""
    };
    let decentring = guess
        .p_sigma
        .map_or_else(String::new, |p| format!("# Decentring, p1 and p2: {p} (RMS of public calibrations: 0.0017).\n"));
    let family = match guess.camera.model {
        Model::BrownConrady => "distortion between none and that of a fisheye",
        _ => "equidistant, equisolid or stereographic",
    };
    let mut t = format!(
        "\n# 1 sigma of what is not known. Focal length: {:.1} % for {}.\n\
         # Shape of the lens: k1 {:.3} ({family}), and k2 {:.2e},\n\
         # with which k1 changes, too (public calibrations).{together}\n\
         {decentring}\
         # Principal point: {:.0} px on each axis, 1.5 % of the width. It turns all answers by the same angle. Its\n\
         # variance {:.0} px² is larger for cropped pictures.\n\
         [camera.covariance]\n",
        focal.percent,
        focal.sigma_from,
        guess.k1_sigma,
        guess.k2_sigma,
        guess.centre_sigma_px,
        guess.centre_sigma_px.powi(2),
    );
    if let Some(covariance) = &guess.camera.covariance {
        let names: Vec<String> = covariance.order.iter().map(|i| format!("\"{}\"", i.name())).collect();
        let _ = writeln!(t, "order = [{}]\nrows = [", names.join(", "));
        for row in &covariance.rows {
            // The matrix stays positive semidefinite with this number of digits. Two equal focal lengths have equal
            // numbers; others that change together must be proportional to the last digit.
            let digits = if pixel_aspect == 1.0 { 6 } else { 13 };
            let numbers: Vec<String> = row.iter().map(|x| format!("{x:.digits$e}")).collect();
            let _ = writeln!(t, "    [{}],", numbers.join(", "));
        }
        t.push_str("]\n");
    }
    t
}

/// Writes `[input]` with the tone of the pictures, or asks for it. A body without air has the same limb in any tone.
fn write_tone(tone: Option<Tone>) -> String {
    let head = "\n[input]\n# The curve between light and counts, with which an edge is located at half of the light: \
                \"linear\" as most\n# industrial cameras write it, \"srgb\" for pictures for the eye, \"bt709\" for \
                video, or a gamma.\n";
    let line = match tone {
        Some(tone) => {
            let value = tone.word().map_or_else(|| format!("{:.3}", tone.gamma()), |word| format!("{word:?}"));
            format!("tone = {value}                 # from the files\n")
        }
        None => {
            "# The files do not say it. In linear pictures the limb height has a sigma of 4.6 km, in others 7 km.\n\
                 # tone = \"linear\"\n"
                .to_owned()
        }
    };
    format!("{head}{line}")
}

/// Writes `[mask]` with the bars of the pictures.
fn write_bars(facts: &CameraFacts) -> String {
    facts.bars.map_or_else(String::new, |bars| {
        format!(
            "\n[mask]\n# All pictures have {}. Their borders must not pass for a limb.\npolygons_px = {}\n",
            bars.describe(),
            bars.polygons_px(facts.size_px)
        )
    })
}

/// Writes `[body]` with the altitude, or with a comment that says where altitudes belong.
fn write_body(body: Body, altitude_km: Option<f64>) -> String {
    let mut t = match body {
        Body::Earth => {
            "\n[body]\nkind = \"earth\"                 # earth (WGS-84) | earth-sphere | sun | moon | sphere\n"
                .to_owned()
        }
        Body::Sun => {
            return "\n[body]\nkind = \"sun\"                   # its disc has a known size: no altitude is needed\n"
                .to_owned();
        }
        Body::Other(kind) => format!(
            "\n[body]\nkind = \"{}\"                  # with its radii, and a limb height that fits it\n",
            kind.name()
        ),
        // `kind = "moon"` is the disc in the sky of the Earth.
        Body::Moon => format!(
            "\n[body]\nkind = \"sphere\"                # the Moon, from near it\nradius_km = {MOON_RADIUS_KM}\n\
             # There is no air: the limb is as high as its hills, and overexposure does not raise it.\n{}",
            airless_limb(MOON_RADIUS_KM)
        ),
    };
    let _ = match altitude_km {
        Some(km) => write!(
            t,
            "altitude_km = {km}\naltitude_sigma_km = {:.1}        # 1-sigma: 2 % of the altitude, for all pictures; \
             frames.csv can give each picture its altitude\n",
            (ALTITUDE_FRACTION * km).max(0.5)
        ),
        None => write!(
            t,
            "# Every picture needs an altitude in kilometres. The columns file, altitude_km (or x_km, y_km, z_km)\n\
             # of a frames.csv next to the pictures give it, or this key for all pictures:\n# altitude_km = 400.0\n"
        ),
    };
    t
}
