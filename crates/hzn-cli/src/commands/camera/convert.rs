//! `hzn camera convert`: converts a calibration into the form of another tool.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use hzn_calib::camera_file::{self, Format};
use hzn_core::camera::{self, Camera};
use hzn_run::disk;
use hzn_run::source::ending;

use crate::exit::{Stop, usage};
use crate::tell;

/// Convert a calibration: sensor.toml, Kalibr, OpenCV, EuRoC, or the coefficients of Braun & Barf
///
/// The form of the input is detected; numbers keep their last bit. Examples:
///
///   hzn camera convert camchain.yaml --camera cam1 -o sensor.toml
///
///   hzn camera convert sensor.toml --to opencv -o fisheye.yaml
///
///   hzn camera convert --braun-barf 1235,-67.9,13.6,-4.3,0.25 --size 1920x1080 --centre 963.2,536.7
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A sensor.toml, or a camera file of Kalibr, OpenCV or EuRoC (.yaml)
    #[arg(required_unless_present = "braun_barf")]
    file: Option<PathBuf>,
    /// Name of the camera in a Kalibr camchain; without it, the first
    #[arg(long, value_name = "NAME", requires = "file")]
    camera: Option<String>,
    /// Instead of a file: r = k1 t + k2 t^3 + k3 t^5 + k4 t^7 + k5 t^9 in pixels (Braun & Barf 2022, eq. 13)
    #[arg(long, value_name = "K1,...,K5", allow_hyphen_values = true, conflicts_with = "file")]
    #[arg(requires_all = ["size", "centre"])]
    braun_barf: Option<Numbers<5>>,
    /// Size of the picture in pixels, for --braun-barf
    #[arg(long, value_name = "WIDTHxHEIGHT", requires = "braun_barf")]
    size: Option<Size>,
    /// Principal point in pixels, pixel centres at integers, for --braun-barf
    #[arg(long, value_name = "U,V", allow_hyphen_values = true, requires = "braun_barf")]
    centre: Option<Numbers<2>>,
    /// Form of the result; without it, sensor
    #[arg(long, value_name = "FORM")]
    to: Option<To>,
    /// The file to write; without it, stdout
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace an output that exists
    #[arg(long, requires = "output")]
    force: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum To {
    /// The [camera] section of a sensor.toml
    Sensor,
    /// A Kalibr camchain with one camera
    Kalibr,
    /// OpenCV's YAML
    Opencv,
    /// A sensor.yaml of EuRoC
    Euroc,
}

/// Numbers with commas between them.
#[derive(Debug, Clone, Copy)]
struct Numbers<const N: usize>([f64; N]);

impl<const N: usize> FromStr for Numbers<N> {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |t: &str| t.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
        let numbers = numbers.and_then(|n| n.try_into().ok());
        numbers.map(Self).ok_or_else(|| format!("{N} numbers with commas between them are expected"))
    }
}

#[derive(Debug, Clone, Copy)]
struct Size([u16; 2]);

impl FromStr for Size {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
        sides.map(Self).ok_or_else(|| "WIDTHxHEIGHT is expected, for example 1920x1080".to_owned())
    }
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let camera = read(args)?;
    // A lens that hzn refuses is of no use in another form either.
    Camera::<f64>::try_new(&camera).map_err(|e| usage(format!("{}: {e}", source(args))))?;
    let to = args.to.unwrap_or(To::Sensor);
    let format = match to {
        To::Sensor => Format::Sensor,
        To::Kalibr => Format::Kalibr,
        To::Opencv => Format::OpenCv,
        To::Euroc => Format::Euroc,
    };
    let mut text = camera_file::write(&camera, format).map_err(|e| usage(format!("{}: {e}", source(args))))?;
    if let (Some(deg), true) = (camera.theta_max_deg, to != To::Sensor) {
        let what = "has no place in the result; put it into the [camera] section that names this file";
        tell::warning(format_args!("theta_max_deg = {deg} {what}"));
    }
    let Some(path) = &args.output else { return Ok(tell::result(text)?) };
    check_ending(path, to)?;
    if path.exists() && !args.force {
        return Err(usage(format!("{}: exists already; choose another name, or --force replaces it", path.display())));
    }
    if to == To::Sensor {
        text = format!("# From {}. Every other key: hzn init.\npreset = \"hzn\"\n\n{text}", source(args));
    }
    std::fs::write(path, text).map_err(|e| disk::cannot_write(path, &e))?;
    tell::line(format_args!("{} written; look at it with  hzn camera show {0}", path.display()));
    Ok(())
}

fn read(args: &Args) -> Result<camera::Config, Stop> {
    if let (Some(kappa), Some(size), Some(centre)) = (args.braun_barf, args.size, args.centre) {
        return camera_file::from_braun_barf(kappa.0, size.0, centre.0).ok_or_else(|| {
            usage("--braun-barf: the first coefficient is the focal length in pixels and must be above 0")
        });
    }
    let Some(file) = &args.file else { return Err(usage("no calibration is given")) };
    match ending(file).as_str() {
        "toml" if args.camera.is_some() => {
            Err(usage(format!("--camera: {} contains one camera; leave out --camera", file.display())))
        }
        "toml" => Ok(hzn_calib::sensor::load(file)?.config.camera),
        _ => Ok(camera_file::load(file, args.camera.as_deref())?),
    }
}

/// Returns the origin of the calibration, for messages.
fn source(args: &Args) -> String {
    match &args.file {
        Some(file) => file.display().to_string(),
        None => "--braun-barf".to_owned(),
    }
}

fn check_ending(path: &Path, to: To) -> Result<(), Stop> {
    let fits = match to {
        To::Sensor => ending(path) == "toml",
        _ => matches!(ending(path).as_str(), "yaml" | "yml"),
    };
    if fits {
        return Ok(());
    }
    let what = match to {
        To::Sensor => "a sensor.toml ends in .toml; for a .yaml choose its form: --to kalibr, opencv or euroc",
        _ => "this form ends in .yaml",
    };
    Err(usage(format!("{}: {what}", path.display())))
}
