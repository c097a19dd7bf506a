//! `hzn camera`: describes a calibration, or converts it into the form of another tool.

mod convert;
mod field;
mod map;
mod monotone;

use std::path::{Path, PathBuf};

use hzn_core::Config;
use hzn_core::camera::{self, Camera};
use hzn_core::frames::UnitVec3;
use hzn_files::camera_file::{self, Choice};
use hzn_run::engine::AnySensor;
use hzn_run::source::ending;
use hzn_run::{overlay, provenance};

use self::field::{end_rad, field_of_view};
use crate::exit::{Exit, Outcome, Stop, usage};
use crate::files;
use crate::tell;

/// Show a camera calibration, or convert it
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Print lens table, field of view, image circle, and the expected size of the limb
    Show {
        /// A sensor.toml, or a camera file of Kalibr, OpenCV, EuRoC, ROS or Foxglove (YAML, XML, JSON)
        file: PathBuf,
        /// Name of the camera in a file of several
        #[arg(long, value_name = "NAME")]
        camera: Option<String>,
        /// Also draw a map of the picture: degrees per pixel, angles off axis, image circle, limit of the monotone lens
        #[arg(long, value_name = "PNG")]
        picture: Option<PathBuf>,
        /// Replace a map that exists
        #[arg(long, requires = "picture")]
        force: bool,
    },
    Convert(convert::Args),
}

pub(super) fn run(args: &Args) -> Outcome {
    match &args.command {
        Command::Show { file, camera, picture, force } => {
            if let Some(path) = picture {
                check_map(path)?;
                files::check_outputs(&hzn_files::files_of_sensor(file), std::slice::from_ref(path), *force)?;
            }
            let config = load(file, camera.as_deref())?;
            for doubt in hzn_files::plausible::find_implausible(&config) {
                tell::warning(format_args!("{}: {}: {}", file.display(), doubt.key, doubt.what));
            }
            tell::result(describe(&config)?)?;
            if let Some(path) = picture {
                // A camera file of another tool is no sensor.
                let sensor = if ending(file) == "toml" { provenance::hash(&config) } else { None };
                let last = provenance::line(sensor.as_deref(), &provenance::command("hzn"));
                overlay::save(&map::draw(&config.camera, &file.display().to_string(), &last)?, path)?;
            }
        }
        Command::Convert(args) => convert::run(args)?,
    }
    Ok(Exit::Done)
}

/// Refuses the map's file if it is no PNG.
fn check_map(path: &Path) -> Result<(), Stop> {
    if ending(path) == "png" { Ok(()) } else { Err(usage(format!("{}: a map ends in .png", path.display()))) }
}

fn load(file: &Path, name: Option<&str>) -> Result<Config, Stop> {
    match ending(file).as_str() {
        "toml" if name.is_some() => Err(convert::one_camera(file)),
        "toml" => Ok(hzn_files::sensor::load(file)?.config),
        "csv" | "jsonl" | "mcap" => {
            Err(usage(format!("{}: a sensor.toml or a camera file (YAML, XML, JSON) is expected", file.display())))
        }
        _ => {
            let (camera, warnings) =
                camera_file::load_any(file, Choice { camera: name, size_px: None })?.exact(file)?;
            warnings.iter().for_each(tell::warning);
            Ok(Config::new(camera))
        }
    }
}

/// Returns the calibration in words and numbers.
pub(super) fn describe(config: &Config) -> Result<String, Stop> {
    let c = &config.camera;
    let camera = Camera::<f64>::try_new(c).map_err(usage)?;
    let mut out = String::new();
    let mut line = |name: &str, value: String| out.push_str(&format!("{name:<16} {value}\n"));
    let model = c.model.name();
    line("picture", format!("{} x {} px", c.width, c.height));
    line(
        "lens",
        format!("{model}, f = {:.2} x {:.2} px, centre at ({:.2}, {:.2})", c.fx_px, c.fy_px, c.cx_px, c.cy_px),
    );
    if !c.k.is_empty() {
        line("coefficients", format!("{:?}", c.k.as_slice()));
    }
    line("field of view", field_of_view(c, &camera));
    let end = end_rad(c, &camera);
    line(
        "image circle",
        match camera.image_circle_px() {
            Some((_, a, b)) => {
                format!("{:.2} deg off axis, {a:.1} x {b:.1} px about the centre", camera.theta_max_rad().to_degrees())
            }
            None => format!("does not cut the picture (farthest corner {:.2} deg off axis)", end.to_degrees()),
        },
    );
    if let Some((_, a, b)) = camera.blind_centre_px() {
        let deg = c.theta_min_deg.unwrap_or_default();
        line("blind centre", format!("{deg:.2} deg off axis, {a:.1} x {b:.1} px about the centre"));
    }
    line(
        "monotone",
        match monotone::limit_deg(c) {
            Some(deg) => format!("up to {deg:.2} deg off axis"),
            None => "everywhere".into(),
        },
    );
    let half_angles = AnySensor::new(config, false).map(|s| s.expected_half_angles_rad(None)).unwrap_or_default();
    for (body, half_angle) in config.each_body().iter().zip(half_angles) {
        let name = body.kind.name();
        match half_angle {
            Ok(rad) => {
                line("expected body", format!("{name}, half-angle {:.3} deg", rad.to_degrees()));
                line("expected limb", limb_size(rad, &camera, c));
            }
            Err(_) => line("expected limb", format!("unknown: set altitude_km of the {name}")),
        }
    }
    out.push_str("\n off axis [deg]   distance from centre [px]   px a degree\n");
    let theta_max = end;
    let steps = 12;
    for i in 0..=steps {
        let theta = theta_max * f64::from(i) / f64::from(steps);
        let r = |theta: f64| radius_px(&camera, theta);
        let d = 1e-4f64;
        let slope = (r((theta + d).min(theta_max)) - r((theta - d).max(0.0)))
            / ((theta + d).min(theta_max) - (theta - d).max(0.0)).to_degrees();
        out.push_str(&format!("{:>15.2} {:>27.2} {slope:>13.3}\n", theta.to_degrees(), r(theta)));
    }
    Ok(out)
}

/// Returns the distance in pixels from the principal point to a ray that is `theta` radians off axis, along x.
fn radius_px(camera: &Camera<f64>, theta: f64) -> f64 {
    let (sin, cos) = theta.min(camera.theta_max_rad() * (1.0 - 1e-12)).sin_cos();
    let centre = camera.principal_point();
    let point = UnitVec3::try_new([sin, 0.0, cos]).and_then(|d| camera.project(&d));
    point.map_or(f64::NAN, |p| (p.u - centre.u).hypot(p.v - centre.v))
}

fn limb_size(half_angle: f64, camera: &Camera<f64>, c: &camera::Config) -> String {
    let (fx, fy) = camera.focal_px();
    if half_angle < camera.theta_max_rad() {
        let r = radius_px(camera, half_angle);
        let side = f64::from(c.width.min(c.height));
        let fits =
            if 2.0 * r < side { "the whole disc fits into the picture" } else { "the picture shows an arc of it" };
        return format!("{:.1} px across when it is in the middle; {fits}", 2.0 * r);
    }
    format!(
        "wider than the field of view: an arc, 1 deg at its middle is about {:.1} px",
        (fx + fy) / 2.0 * 1f64.to_radians()
    )
}
