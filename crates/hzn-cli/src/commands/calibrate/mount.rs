//! `hzn calibrate mount`: the attitude of a camera on its vehicle, with its sigma.

use std::path::{Path, PathBuf};

use hzn_calib::board::{self, Board, BoardMount, Tilt};
use hzn_files::camera_file;
use hzn_fuse::{input, read_back};
use hzn_run::disk;
use hzn_run::source::ending;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::board_search;
use super::board_size::BoardSize;
use super::mount_tilts;
use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::files;
use crate::setup::stop_flag;
use crate::tell;

/// Find how a camera is mounted on its vehicle, with the sigma, for sensor.toml and fuse.toml
///
/// The vehicle's axes are those of the inertial unit. The result is the table [mount] (-o mount.toml), which belongs
/// into the sensor.toml or to --mount of hzn fuse, and the sigmas of mount and clock as settings of the camera for
/// hzn fuse (--fuse fuse.toml).
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    from: From,
}

#[derive(Debug, clap::Subcommand)]
enum From {
    /// From camchains of Kalibr with T_cam_imu and timeshift_cam_imu
    ///
    /// Kalibr states no sigma of T_cam_imu. Three or more calibrations of the same camera give it by their scatter; for
    /// fewer, --sigma-deg says it.
    Kalibr {
        /// camchain-imucam files of one camera
        #[arg(required = true, value_name = "YAML")]
        files: Vec<PathBuf>,
        /// Name of the camera in the camchain; required if there are several
        #[arg(long, value_name = "NAME")]
        camera: Option<String>,
        /// 1-sigma of the mount about each axis, in degrees
        #[arg(long, value_name = "DEG")]
        sigma_deg: Option<f64>,
        /// 1-sigma of the camera's clock, in seconds
        #[arg(long, value_name = "S")]
        clock_sigma_s: Option<f64>,
        #[command(flatten)]
        output: OutputArgs,
    },
    /// From an earlier flight: the results of hzn fuse (nav.csv or nav.mcap) and the mount that it was told
    Flight {
        /// What `hzn fuse -o` wrote
        #[arg(value_name = "NAV")]
        file: PathBuf,
        /// The mount that the flight was told: its sensor.toml, or the file of --mount
        #[arg(long, value_name = "TOML")]
        told: PathBuf,
        #[command(flatten)]
        output: OutputArgs,
    },
    /// From pictures of a chessboard that does not move, with the vehicle at rest in five or more different tilts
    ///
    /// The accelerometers tell the direction up in each tilt. Tilt the vehicle by 20 degrees or more, about two
    /// different axes; the board needs to be neither level nor upright. TILT.csv has the columns file, accel_x_mps2,
    /// accel_y_mps2, accel_z_mps2: the name of each picture, and the mean specific force along the vehicle's axes.
    /// Do not roll the camera by more than 60 degrees between two pictures: near 90 degrees and above, the numbering of
    /// the corners can turn by half a turn, and the mount is then wrong.
    Board {
        /// Pictures, a folder, a pattern in quotes, a video, or an MCAP
        #[arg(required = true, value_name = "PICTURES")]
        input: Vec<PathBuf>,
        /// Topic of the pictures in an MCAP; without it, the first topic with pictures
        #[arg(long, value_name = "TOPIC")]
        topic: Option<String>,
        /// Inner corners of the board, along its rows and its columns: one less than its squares
        #[arg(long, value_name = "COLUMNSxROWS")]
        board: BoardSize,
        /// The calibrated camera: a sensor.toml
        #[arg(long, value_name = "TOML")]
        lens: PathBuf,
        /// The direction up in each picture
        #[arg(long, value_name = "CSV")]
        tilt: PathBuf,
        /// 1-sigma of the accelerometers' bias, in mg; it turns the direction up in all pictures alike
        #[arg(long, value_name = "MG", default_value_t = 2.0)]
        accel_bias_mg: f64,
        #[command(flatten)]
        output: OutputArgs,
    },
}

#[derive(Debug, clap::Args)]
struct OutputArgs {
    /// Name of the camera for hzn fuse, which is that of its recording without the ending
    #[arg(long, value_name = "NAME", default_value = "camera")]
    name: String,
    /// Write the table [mount]
    #[arg(short, long, value_name = "TOML")]
    output: Option<PathBuf>,
    /// Write the settings of the camera for hzn fuse
    #[arg(long, value_name = "TOML")]
    fuse: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// A mount with its sigma, and the clock if it is known.
struct Found {
    vehicle_from_camera: Rotation3<f64>,
    /// 1-sigma about the axes of the camera.
    sigma_deg: [f64; 3],
    clock_s: Option<f64>,
    clock_sigma_s: Option<f64>,
    /// Where it comes from, for the reader of the files.
    origin: String,
}

pub(super) fn run(args: &Args) -> Outcome {
    match &args.from {
        From::Kalibr { files, camera, sigma_deg, clock_sigma_s, output } => {
            output.check(files)?;
            output.write(&of_kalibr(files, camera.as_deref(), *sigma_deg, *clock_sigma_s)?)
        }
        From::Flight { file, told, output } => {
            output.check(&[file.clone(), told.clone()])?;
            output.write(&of_flight(file, told, &output.name)?)
        }
        From::Board { input, topic, board, lens, tilt, accel_bias_mg, output } => {
            if !(*accel_bias_mg >= 0.0 && accel_bias_mg.is_finite()) {
                return Err(usage("--accel-bias-mg: must be 0 or more"));
            }
            output.check(&[lens.clone(), tilt.clone()])?;
            match of_board(input, topic.as_deref(), *board, lens, tilt, *accel_bias_mg)? {
                Some(found) => output.write(&found),
                None => Ok(Exit::Interrupted),
            }
        }
    }
}

/// Returns the mean of several calibrations, with their scatter as the sigma of one of them.
fn of_kalibr(
    files: &[PathBuf],
    camera: Option<&str>,
    sigma_deg: Option<f64>,
    clock_sigma_s: Option<f64>,
) -> Result<Found, Stop> {
    for (name, value) in [("--sigma-deg", sigma_deg), ("--clock-sigma-s", clock_sigma_s)] {
        if value.is_some_and(|x| !(x >= 0.0 && x.is_finite())) {
            return Err(usage(format!("{name}: must be 0 or more")));
        }
    }
    let read: Vec<_> = files.iter().map(|file| camera_file::to_imu(file, camera)).collect::<Result<_, _>>()?;
    let rotation = |rows: &[[f64; 3]; 3]| {
        // Kalibr's matrix turns from the inertial unit to the camera; the mount is the inverse.
        let matrix = Matrix3::from_fn(|i, j| rows[j][i]);
        Rotation3::from_matrix_eps(&matrix, 1e-12, 100, Rotation3::identity())
    };
    let each: Vec<Rotation3<f64>> = read.iter().map(|r| rotation(&r.camera_from_imu)).collect();
    let (mean, scatter_deg) = mean(&each).ok_or_else(|| usage("no camchain is given"))?;
    let sigma_deg = match (sigma_deg, scatter_deg) {
        (Some(deg), _) => [deg; 3],
        (None, Some(scatter_deg)) => scatter_deg,
        (None, None) => {
            let what = "Kalibr states no sigma of T_cam_imu: add --sigma-deg, or give three or more calibrations of \
                        the same camera, whose scatter is the sigma";
            return Err(usage(what));
        }
    };
    let shifts: Option<Vec<f64>> = read.iter().map(|r| r.timeshift_s).collect();
    let shifts = shifts.unwrap_or_default();
    let clock_s = (!shifts.is_empty()).then(|| shifts.iter().sum::<f64>() / shifts.len() as f64);
    let spread = clock_s
        .filter(|_| shifts.len() >= MIN_REPEATED)
        .map(|mean| (shifts.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (shifts.len() - 1) as f64).sqrt());
    let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    Ok(Found {
        vehicle_from_camera: mean,
        sigma_deg,
        clock_s,
        clock_sigma_s: clock_sigma_s.or(spread),
        origin: format!("T_cam_imu of {}", names.join(", ")),
    })
}

/// Smallest number of calibrations whose scatter counts as a sigma.
const MIN_REPEATED: usize = 3;

/// Returns the mean of rotations, and their scatter about each axis in degrees if there are enough of them.
fn mean(each: &[Rotation3<f64>]) -> Option<(Rotation3<f64>, Option<[f64; 3]>)> {
    let mut mean = *each.first()?;
    let errors = |mean: &Rotation3<f64>| each.iter().map(|r| (mean.inverse() * r).scaled_axis()).collect::<Vec<_>>();
    for _ in 0..10 {
        let step = errors(&mean).iter().sum::<Vector3<f64>>() / each.len() as f64;
        mean *= Rotation3::new(step);
    }
    let scatter = |axis: usize| {
        let squares: f64 = errors(&mean).iter().map(|error| error[axis].powi(2)).sum();
        (squares / (each.len() - 1) as f64).sqrt().to_degrees()
    };
    Some((mean, (each.len() >= MIN_REPEATED).then(|| [0, 1, 2].map(scatter))))
}

/// Cosine of half the angle between two mounts that are the same: 0.005 degrees.
const SAME_MOUNT: f64 = 1.0 - 1e-9;

fn of_flight(file: &Path, told: &Path, name: &str) -> Result<Found, Stop> {
    let estimated = read_back::estimated_mount(file, name)?;
    let sigma_deg = estimated.misalignment_sigma_deg;
    if !sigma_deg.iter().chain(&estimated.misalignment_deg).all(|x| x.is_finite()) {
        let what = "the flight did not end with an estimate of the mount";
        return Err(failed(format!("{}: {name}: {what}", file.display())));
    }
    let shown = file.display();
    match estimated.verdict.as_deref() {
        Some("contradicts") => {
            let what = "the verdict of hzn fuse over this flight is `contradicts`, so its mounts can be wrong by many \
                        sigma: mend its inputs first";
            return Err(failed(format!("{shown}: {what}")));
        }
        Some("doubtful") => {
            tell::warning(format_args!("{shown}: the verdict of hzn fuse over this flight is `doubtful`"));
        }
        _ => {}
    }
    let [w, x, y, z] = input::mount(told)?.wxyz();
    let is_other = |had: [f64; 4]| (had.iter().zip([w, x, y, z]).map(|(a, b)| a * b).sum::<f64>()).abs() < SAME_MOUNT;
    if estimated.told_q_vehicle_from_camera_wxyz.is_some_and(is_other) {
        let what = "is not the mount that the flight was told for";
        return Err(usage(format!("--told {}: {what} {name} (the result says which, {shown})", told.display())));
    }
    let told_mount = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z)).to_rotation_matrix();
    let step = Vector3::from(estimated.misalignment_deg).map(f64::to_radians);
    let clock = (estimated.clock_sigma_s > 0.0).then_some((estimated.clock_s, estimated.clock_sigma_s));
    Ok(Found {
        vehicle_from_camera: told_mount * Rotation3::new(step),
        sigma_deg,
        clock_s: clock.map(|c| c.0),
        clock_sigma_s: clock.map(|c| c.1),
        origin: format!("the flight {}, which was told {}", file.display(), told.display()),
    })
}

/// Tilt that the guide asks for is 20 degrees or more; half of it is far too small, in degrees.
const ADVISED_TILT_DEG: f64 = 10.0;

fn of_board(
    input: &[PathBuf],
    topic: Option<&str>,
    board: BoardSize,
    lens: &Path,
    tilt: &Path,
    bias_mg: f64,
) -> Result<Option<Found>, Stop> {
    let sensor = hzn_files::sensor::load(lens)?;
    sensor.warnings.iter().for_each(tell::warning);
    let camera = &sensor.config.camera;
    let board = Board { columns: board.0[0], rows: board.0[1], square_mm: 1.0 };
    let up = mount_tilts::read(tilt)?;
    let mut source = hzn_run::source::open(input, None, topic)?;
    source.notes().iter().for_each(|note| tell::line(format_args!("note: {note}")));
    let Some(pictures) = board_search::search(source.as_mut(), &board, None, &stop_flag(), false)? else {
        tell::line("interrupted; nothing was calibrated");
        return Ok(None);
    };
    pictures.reasons.iter().for_each(|(name, why)| tell::warning(format_args!("{name}: {why}")));
    if pictures.size_px != [camera.width, camera.height] {
        let [width, height] = pictures.size_px;
        let what = format!("the pictures have {width} x {height} px, the lens {} x {}", camera.width, camera.height);
        return Err(usage(format!("{}: {what}", lens.display())));
    }
    let mut tilts = Vec::new();
    for view in pictures.views {
        match mount_tilts::of_picture(&up, &view.name) {
            Some(up) => tilts.push(Tilt { view, up }),
            None => tell::warning(format_args!("{}: {} has no row for it", view.name, tilt.display())),
        }
    }
    let found = board::mount(camera, &board, &tilts, bias_mg * 1e-3)
        .map_err(|why| failed(format!("no mount is written: {why}")))?;
    tell::report(report(&found))?;
    let what = "compare the line `axes` with the vehicle: accelerations with two axes exchanged, or with one wrong \
                sign, leave the same residuals, and the mount is then wrong by half a turn";
    tell::line(format_args!("note: {what}"));
    let tilt_deg = found.largest_tilt_rad.to_degrees();
    if tilt_deg < ADVISED_TILT_DEG {
        let what = "tilts of 20 deg and more make the sigma of the mount far smaller";
        tell::warning(format_args!("the vehicle was tilted by {tilt_deg:.1} deg only: {what}"));
    }
    Ok(Some(Found {
        vehicle_from_camera: found.vehicle_from_camera,
        sigma_deg: [0, 1, 2].map(|i| found.covariance_rad2[(i, i)].sqrt().to_degrees()),
        clock_s: None,
        clock_sigma_s: None,
        origin: format!("{} tilts of {}", found.residuals_rad.len(), tilt.display()),
    }))
}

fn report(found: &BoardMount) -> String {
    let mut out = format!(
        "tilts            {} used, RMS {:.3} deg per axis\n",
        found.residuals_rad.len(),
        found.rms_rad.to_degrees()
    );
    out.push_str(&format!("                 up to {:.1} deg from their mean\n", found.largest_tilt_rad.to_degrees()));
    out.push_str(&format!("axes             {}\n", found.axes_in_words()));
    for (name, angle) in &found.residuals_rad {
        out.push_str(&format!("  {:<40} {:.3} deg\n", tell::one_line(name), angle.to_degrees()));
    }
    for name in &found.without_pose {
        out.push_str(&format!("  {:<40} no board, or no pose\n", tell::one_line(name)));
    }
    out
}

impl OutputArgs {
    fn check(&self, read: &[PathBuf]) -> Result<(), Stop> {
        let written: Vec<PathBuf> = [&self.output, &self.fuse].into_iter().flatten().cloned().collect();
        if let Some(path) = written.iter().find(|path| ending(path) != "toml") {
            return Err(usage(format!("{}: this file ends in .toml", path.display())));
        }
        if self.output.is_some() && self.output == self.fuse {
            return Err(usage("--fuse: must be another file than --output"));
        }
        files::check_outputs(read, &written, self.force)
    }

    /// Prints the result and writes the files.
    fn write(&self, found: &Found) -> Outcome {
        let q = UnitQuaternion::from_rotation_matrix(&found.vehicle_from_camera);
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        let wxyz = [q.w, q.i, q.j, q.k].map(|x| format!("{:.9}", sign * x)).join(", ");
        let [x, y, z] = found.sigma_deg;
        let sigma = format!("1 sigma about the camera's x, y, z axes: {x:.4}, {y:.4}, {z:.4} deg");
        let mount = format!("[mount]\nq_vehicle_from_camera_wxyz = [{wxyz}]\n");
        let fuse = self.settings(found);
        tell::report(format_args!("{mount}# {sigma}\n\n{fuse}"))?;
        if let (Some(clock_s), name) = (found.clock_s, &self.name) {
            tell::line(format_args!("note: the clock goes to the command:  hzn fuse --clock {name}={clock_s:.6} ..."));
        }
        let head = format!("# From {}.\n", tell::one_line(&found.origin));
        if let Some(path) = &self.output {
            disk::write_whole(path, &format!("{head}# {sigma}\n{mount}"))?;
        }
        if let Some(path) = &self.fuse {
            disk::write_whole(path, &format!("{head}{fuse}"))?;
        }
        Ok(Exit::Done)
    }

    /// Returns the settings of the camera for hzn fuse. It has one sigma for all axes, so the largest one counts.
    fn settings(&self, found: &Found) -> String {
        let largest = found.sigma_deg.into_iter().fold(0.0, f64::max);
        let mut out = format!(
            "[cameras.{}]\nmisalignment_deg = {{ mode = \"estimated\", sigma = {} }}\n",
            toml_key(&self.name),
            rounded_up(largest)
        );
        if let Some(sigma_s) = found.clock_sigma_s {
            out.push_str(&format!("clock_s = {{ mode = \"estimated\", sigma = {} }}\n", rounded_up(sigma_s)));
        }
        if let Some(clock_s) = found.clock_s {
            out.push_str(&format!("# The clock: hzn fuse --clock {}={clock_s:.6}\n", self.name));
        }
        out
    }
}

/// Returns a sigma with three digits, never below the value.
fn rounded_up(sigma: f64) -> String {
    if !(sigma > 0.0) {
        return "0.0".to_owned();
    }
    let unit = 10f64.powi(sigma.log10().floor() as i32 - 2);
    let digits = (2 - sigma.log10().floor() as i32).max(1) as usize;
    format!("{:.digits$}", (sigma / unit).ceil() * unit)
}

/// Returns a name as a key of TOML.
fn toml_key(name: &str) -> String {
    let is_bare = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-'));
    if is_bare { name.to_owned() } else { toml::Value::String(name.to_owned()).to_string() }
}
