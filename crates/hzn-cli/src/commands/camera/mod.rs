//! `hzn camera`: describes a calibration, or converts it into the form of another tool.

mod convert;

use std::path::{Path, PathBuf};

use hzn_core::Config;
use hzn_core::camera::{self, Camera, Model};
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use hzn_run::engine::AnySensor;
use hzn_run::source::ending;

use crate::exit::{Exit, Outcome, Stop, usage};
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
        /// A sensor.toml, or a camera file of Kalibr, OpenCV, EuRoC or ROS (.yaml)
        file: PathBuf,
    },
    Convert(convert::Args),
}

pub(super) fn run(args: &Args) -> Outcome {
    match &args.command {
        Command::Show { file } => {
            let config = load(file)?;
            for doubt in hzn_calib::plausible::find_implausible(&config) {
                tell::warning(format_args!("{}: {}: {}", file.display(), doubt.key, doubt.what));
            }
            tell::result(describe(&config)?)?;
        }
        Command::Convert(args) => convert::run(args)?,
    }
    Ok(Exit::Done)
}

fn load(file: &Path) -> Result<Config, Stop> {
    match ending(file).as_str() {
        "yaml" | "yml" => Ok(Config::new(hzn_calib::camera_file::load(file, None)?)),
        "csv" | "jsonl" | "mcap" => {
            Err(usage(format!("{}: a sensor.toml or a camera file (.yaml) is expected", file.display())))
        }
        _ => Ok(hzn_calib::sensor::load(file)?.config),
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
    line(
        "monotone",
        match monotone_limit_deg(c) {
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

/// Slightly inside the picture's outer corner, in pixels: without an image circle the lens ends at the farthest corner.
const SIDE_PX: f64 = -0.5 + 1e-6;

/// Returns the largest angle off axis that the picture shows, in radians: the image circle, or the farthest corner.
fn end_rad(c: &camera::Config, camera: &Camera<f64>) -> f64 {
    let (right, bottom) = (f64::from(c.width) - 1.0 - SIDE_PX, f64::from(c.height) - 1.0 - SIDE_PX);
    let corners = [(SIDE_PX, SIDE_PX), (right, SIDE_PX), (SIDE_PX, bottom), (right, bottom)];
    let off_axis = |(u, v)| camera.unproject(ImagePoint { u, v }).map(|ray| ray.xyz()[2].clamp(-1.0, 1.0).acos());
    match camera.image_circle_px() {
        Some(_) => camera.theta_max_rad(),
        None => corners.into_iter().filter_map(off_axis).reduce(f64::max).unwrap_or(camera.theta_max_rad()),
    }
}

fn field_of_view(c: &camera::Config, camera: &Camera<f64>) -> String {
    let side = SIDE_PX;
    let (right, bottom) = (f64::from(c.width) - 1.0 - side, f64::from(c.height) - 1.0 - side);
    let angle = |a: (f64, f64), b: (f64, f64)| {
        let ray = |(u, v)| camera.unproject(ImagePoint { u, v });
        Some(ray(a)?.angle_rad(&ray(b)?).to_degrees())
    };
    let text = |deg: Option<f64>| deg.map_or("beyond the image circle".to_owned(), |d| format!("{d:.2} deg"));
    format!(
        "{} horizontally, {} vertically, {} from corner to corner",
        text(angle((side, c.cy_px), (right, c.cy_px))),
        text(angle((c.cx_px, side), (c.cx_px, bottom))),
        text(angle((side, side), (right, bottom)))
    )
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

/// Returns the angle off axis in degrees where the lens stops being monotone: dr/dθ = 0 for radial lenses (for
/// brown-conrady without its tangential part). Returns `None` if the lens is monotone everywhere.
fn monotone_limit_deg(c: &camera::Config) -> Option<f64> {
    let k = |i: usize| c.coefficient(i);
    let slope: Box<dyn Fn(f64) -> f64> = match c.model {
        Model::KannalaBrandt => {
            let k = [k(0), k(1), k(2), k(3)];
            Box::new(move |t| {
                let t2 = t * t;
                1.0 + t2 * (3.0 * k[0] + t2 * (5.0 * k[1] + t2 * (7.0 * k[2] + t2 * 9.0 * k[3])))
            })
        }
        Model::BrownConrady => {
            let k = [k(0), k(1), k(4)];
            Box::new(move |t| {
                let r2 = t.tan() * t.tan();
                1.0 + r2 * (3.0 * k[0] + r2 * (5.0 * k[1] + r2 * 7.0 * k[2]))
            })
        }
        _ => return None,
    };
    let end = if c.model == Model::BrownConrady { 89.9 } else { 180.0 };
    let steps = 18_000;
    (1..=steps).map(|i| end * f64::from(i) / f64::from(steps)).find(|deg| slope(deg.to_radians()) <= 0.0)
}
