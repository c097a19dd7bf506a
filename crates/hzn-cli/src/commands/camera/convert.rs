//! `hzn camera convert`: converts a calibration into the form of another tool.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use hzn_calib::conversion;
use hzn_core::camera::{self, Camera, Model};
use hzn_files::camera_file::{self, Choice, Format, Loaded};
use hzn_run::disk;
use hzn_run::source::ending;

use crate::exit::{Stop, usage};
use crate::files;
use crate::tell;

/// Convert a calibration: sensor.toml, Kalibr, OpenCV, EuRoC, ROS, Foxglove, or the coefficients of Braun & Barf
///
/// Files of camodocal (VINS), ORB-SLAM3, Basalt, COLMAP (cameras.txt), Metashape (XML) and OCamCalib
/// (calib_results.txt) are read as well, but not written. --camera chooses one of several cameras: cam0 is the first,
/// and in COLMAP cam1 is the camera with number 1. In a file of OpenCV the cameras have the names that the file gives
/// them, such as 1 and 2 for M1 and M2; without --camera a message lists them.
///
/// The form of the input is detected from its text; numbers keep their last bit. --model fits another lens over the
/// picture and prints the error. Examples:
///
///   hzn camera convert camchain.yaml --camera cam1 -o sensor.toml
///
///   hzn camera convert sensor.toml --to opencv -o camera.xml
///
///   hzn camera convert omni.yaml --model kannala-brandt -o sensor.toml
///
///   hzn camera convert calib_results.txt --model kannala-brandt --end 95 -o sensor.toml
///
///   hzn camera convert intrinsics.yml --camera 1 --size 640x480 -o sensor.toml
///
///   hzn camera convert --braun-barf 1235,-67.9,13.6,-4.3,0.25 --size 1920x1080 --centre 963.2,536.7
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A sensor.toml, or a camera file of Kalibr, OpenCV, EuRoC, ROS or Foxglove (YAML, XML, JSON)
    #[arg(required_unless_present = "braun_barf")]
    file: Option<PathBuf>,
    /// Name of the camera in a file of several; without it, the first of a camchain
    #[arg(long, value_name = "NAME", requires = "file")]
    camera: Option<String>,
    /// Instead of a file: r = k1 t + k2 t^3 + k3 t^5 + k4 t^7 + k5 t^9 in pixels (Braun & Barf 2022, eq. 13)
    #[arg(long, value_name = "K1,...,K5", allow_hyphen_values = true, conflicts_with = "file")]
    #[arg(requires_all = ["size", "centre"])]
    braun_barf: Option<Numbers<5>>,
    /// Size of the picture in pixels, for --braun-barf and for a file that does not have it
    #[arg(long, value_name = "WIDTHxHEIGHT")]
    size: Option<Size>,
    /// Principal point in pixels, pixel centres at integers, for --braun-barf
    #[arg(long, value_name = "U,V", allow_hyphen_values = true, requires = "braun_barf")]
    centre: Option<Numbers<2>>,
    /// Fit a lens of this model over the picture
    #[arg(long, value_name = "MODEL", value_parser = crate::commands::lens_model::parse)]
    model: Option<Model>,
    /// The lens ends at this angle off axis in degrees, theta_max_deg, for example at the image circle; so does a fit
    #[arg(long, value_name = "DEG")]
    end: Option<f64>,
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
    /// OpenCV's FileStorage: YAML, or XML or JSON if the output ends in .xml or .json
    Opencv,
    /// A sensor.yaml of EuRoC
    Euroc,
    /// ROS's camera_info (YAML)
    Ros,
    /// Foxglove's CameraCalibration (JSON)
    Foxglove,
}

impl To {
    /// Returns the endings that a file of this form may have; the first one is usual.
    fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Sensor => &["toml"],
            Self::Opencv => &["yaml", "yml", "xml", "json"],
            Self::Foxglove => &["json"],
            Self::Kalibr | Self::Euroc | Self::Ros => &["yaml", "yml"],
        }
    }

    /// Returns the format for an output with this ending.
    fn format(self, ending: &str) -> Format {
        match (self, ending) {
            (Self::Sensor, _) => Format::Sensor,
            (Self::Kalibr, _) => Format::Kalibr,
            (Self::Opencv, "xml") => Format::OpenCvXml,
            (Self::Opencv, "json") => Format::OpenCvJson,
            (Self::Opencv, _) => Format::OpenCv,
            (Self::Euroc, _) => Format::Euroc,
            (Self::Ros, _) => Format::Ros,
            (Self::Foxglove, _) => Format::Foxglove,
        }
    }
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
    let (camera, comment) = read(args)?;
    // A lens that hzn refuses is of no use in another form either.
    Camera::<f64>::try_new(&camera).map_err(|e| usage(format!("{}: {e}{}", source(args), end_hint(args))))?;
    let to = args.to.unwrap_or(To::Sensor);
    if let Some(path) = &args.output {
        check_ending(path, to)?;
    }
    let format = to.format(&args.output.as_deref().map(ending).unwrap_or_default());
    let mut text = camera_file::write(&camera, format).map_err(|e| {
        let remedy = "--model fits a lens that it can express, for example --model kannala-brandt";
        usage(format!("{}: {e}; {remedy}", source(args)))
    })?;
    let lost = lost_keys(&camera);
    if to != To::Sensor && !lost.is_empty() {
        let what = "no place in the result; put it into the [camera] section that names this file";
        tell::warning(format_args!("{} has {what}", lost.join(", ")));
    }
    let Some(path) = &args.output else { return Ok(tell::file(text)?) };
    let read = args.file.as_deref().map(hzn_files::files_of_sensor).unwrap_or_default();
    files::check_outputs(&read, std::slice::from_ref(path), args.force)?;
    if to == To::Sensor {
        let comment = comment.map(|c| format!("# {c}\n")).unwrap_or_default();
        text = format!("# From {}. Every other key: hzn init.\n{comment}preset = \"hzn\"\n\n{text}", source(args));
    }
    disk::write_whole(path, &text)?;
    tell::line(format_args!("{} written; look at it with  hzn camera show {0}", path.display()));
    Ok(())
}

/// Returns how theta_max_deg is set, for a lens that is refused without it.
fn end_hint(args: &Args) -> &'static str {
    if args.end.is_none() && args.file.is_some() { "; --end DEG sets camera.theta_max_deg" } else { "" }
}

/// Returns the keys of a sensor.toml that the forms of other tools do not have.
fn lost_keys(camera: &camera::Config) -> Vec<String> {
    let mut lost = Vec::new();
    let mut add = |key: &str, value: f64| lost.push(format!("{key} = {value}"));
    camera.theta_max_deg.into_iter().for_each(|deg| add("theta_max_deg", deg));
    camera.theta_min_deg.into_iter().for_each(|deg| add("theta_min_deg", deg));
    let others = [
        ("focal_sigma_percent", camera.focal_sigma_percent),
        ("centre_sigma_px", camera.centre_sigma_px),
        ("readout_s", camera.readout_s),
    ];
    others.into_iter().filter(|(_, value)| *value != 0.0).for_each(|(key, value)| add(key, value));
    if camera.covariance.is_some() {
        lost.push("covariance".to_owned());
    }
    if camera.temperature.is_some() {
        lost.push("temperature".to_owned());
    }
    lost
}

/// Reads the calibration, and fits the model to it that is asked for. Returns the fit in words as well.
fn read(args: &Args) -> Result<(camera::Config, Option<String>), Stop> {
    let loaded = load(args)?;
    let end_deg = args.end.unwrap_or(180.0);
    if !(end_deg > 0.0 && end_deg <= 180.0) {
        return Err(usage("--end: an angle above 0 and up to 180 degrees is expected"));
    }
    let Some(model) = args.model else {
        return match loaded {
            Loaded::Lens(config) => {
                let limit_deg = args.end.map(|end| config.theta_max_deg.map_or(end, |deg| deg.min(end)));
                Ok((camera::Config { theta_max_deg: limit_deg.or(config.theta_max_deg), ..config }, None))
            }
            Loaded::Foreign(lens) => Err(usage(format!(
                "{}: {} is a lens that hzn does not have; --model {} fits one of hzn's",
                source(args),
                lens.name(),
                lens.closest().name()
            ))),
        };
    };
    let refused = |why| usage(format!("{}: {why}; --end DEG ends the lens at an angle off axis", source(args)));
    let fitted = conversion::convert_up_to(&loaded, model, end_deg).map_err(refused)?;
    let [u, v] = fitted.max_at_px;
    let words = format!(
        "{} fitted over the picture up to {:.1}° off axis: RMS {:.4} px, maximum error {:.4} px at ({u:.0}, {v:.0})",
        fitted.camera.model.name(),
        fitted.off_axis_deg,
        fitted.rms_px,
        fitted.max_px
    );
    tell::line(format_args!("{}: {words}", source(args)));
    if fitted.max_px > 1.0 {
        tell::warning("the two lenses differ by more than a pixel; directions have this error");
    }
    if matches!(&loaded, Loaded::Lens(c) if c.covariance.is_some() && fitted.camera.covariance.is_none()) {
        tell::warning("the covariance belongs to the parameters of the other model and is left out");
    }
    Ok((fitted.camera, Some(words)))
}

/// Reads the calibration in any form.
fn load(args: &Args) -> Result<Loaded, Stop> {
    if let (Some(kappa), Some(size), Some(centre)) = (args.braun_barf, args.size, args.centre) {
        return camera_file::from_braun_barf(kappa.0, size.0, centre.0).map(Loaded::Lens).ok_or_else(|| {
            usage("--braun-barf: the first coefficient is the focal length in pixels and must be above 0")
        });
    }
    let Some(file) = &args.file else { return Err(usage("no calibration is given")) };
    match ending(file).as_str() {
        "toml" if args.camera.is_some() => Err(one_camera(file)),
        "toml" => Ok(Loaded::Lens(hzn_files::sensor::load(file)?.config.camera)),
        _ => {
            let choice = Choice { camera: args.camera.as_deref(), size_px: args.size.map(|size| size.0) };
            let read = camera_file::load_any(file, choice)?;
            read.warnings.iter().for_each(tell::warning);
            if camera_file::to_imu(file, Some(args.camera.as_deref().unwrap_or("cam0"))).is_ok() {
                let what =
                    "the pose and the clock of the camera against the inertial unit belong to [mount] and fuse.toml";
                tell::line(format_args!("note: {what}:  hzn calibrate mount kalibr {}", file.display()));
            }
            let [width, height] = match &read.lens {
                Loaded::Lens(c) => [c.width, c.height],
                Loaded::Foreign(lens) => lens.size_px(),
            };
            if choice.size_px.is_some_and(|size_px| size_px != [width, height]) {
                return Err(usage(format!("--size: {} says {width}x{height}; leave out --size", file.display())));
            }
            Ok(read.lens)
        }
    }
}

/// Refuses the name of a camera for a file that has one.
pub(super) fn one_camera(file: &Path) -> Stop {
    usage(format!("--camera: {} contains one camera; leave out --camera", file.display()))
}

/// Returns the origin of the calibration, for messages.
fn source(args: &Args) -> String {
    match &args.file {
        Some(file) => file.display().to_string(),
        None => "--braun-barf".to_owned(),
    }
}

fn check_ending(path: &Path, to: To) -> Result<(), Stop> {
    let endings = to.endings();
    if endings.contains(&ending(path).as_str()) {
        return Ok(());
    }
    let what = match to {
        To::Sensor => "a sensor.toml ends in .toml; for another file choose its form: --to kalibr, opencv, euroc, ros \
                       or foxglove"
            .to_owned(),
        _ => format!("this form ends in .{}", endings.join(" or .")),
    };
    Err(usage(format!("{}: {what}", path.display())))
}
