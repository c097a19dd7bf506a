//! An infrared sensor through ten orbits without an attitude from outside: what the filter learns about the limb
//! height.

use anyhow::anyhow;
use hzn_core::{Config, config::Mount};
use hzn_files::frames;
use hzn_files::vehicle::VehicleRow;
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Body, Inputs, Recording};
use hzn_fuse::settings::Treatment;
use hzn_fuse::{Fused, Settings, fuse, sink};
use hzn_mcap::Row;
use hzn_nav::frames::{Cam, Fixed, Rotation, Vector, Vehicle};
use hzn_sim::Scenario;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::super::recordings::{self, process};
use super::super::setup::Effort;
use super::vehicle;
use crate::section::Section;

const ORBITS: usize = 10;
/// Period of the orbit, s.
const ORBIT_S: f64 = 5800.0;
/// Pictures of one orbit.
const PICTURES: usize = 190;
const SEED: u64 = 8301;
/// The limb height that the sensor is told, km.
const TOLD_KM: f64 = 22.0;
/// Error of nadir that is wanted at the end, degrees.
const GOAL_DEG: f64 = 0.01;
/// 1-sigma of the attitude at the start about each axis, degrees.
const START_DEG: f64 = 2.0;

fn scene(effort: &Effort) -> anyhow::Result<Scenario> {
    let mut scene = Scenario::builtin("leo-infrared").ok_or_else(|| anyhow!("there is no scene leo-infrared"))?;
    scene.seed = SEED;
    let orbits = if effort.frames.is_some() { 1 } else { ORBITS };
    scene.capture.to_s = ORBIT_S * orbits as f64;
    scene.capture.frames = (PICTURES * orbits) as u32;
    if let hzn_sim::trajectory::Attitude::Pointing(pointing) = &mut scene.attitude {
        // The same rates as in the scene's one orbit.
        for span in [&mut pointing.azimuth_deg, &mut pointing.roll_deg] {
            span[1] *= orbits as f64;
        }
    }
    // Axes of the vehicle are those of the camera.
    scene.mount = Some(Mount { q_vehicle_from_camera_wxyz: [1.0, 0.0, 0.0, 0.0] });
    scene.imu = Some(vehicle::imu());
    scene.gnss = Some(vehicle::gnss());
    Ok(scene)
}

/// Returns the sensor: it is told 3 km less than the mean limb height of the scene, ± 4 km, and no noise.
fn told(one: &Scenario) -> Config {
    let mut config = one.sensor();
    config.body.limb_height_by_latitude_km.clear();
    config.body.limb_height_km = TOLD_KM;
    config.body.limb_height_sigma_km = 4.0;
    config
}

/// Errors of directions to nadir.
#[derive(Default)]
struct Nadir {
    square: f64,
    count: f64,
    largest_rad: f64,
}

impl Nadir {
    fn add(&mut self, error_rad: f64) {
        self.square += error_rad.powi(2);
        self.count += 1.0;
        self.largest_rad = self.largest_rad.max(error_rad);
    }
    fn rms_rad(&self) -> f64 {
        (self.square / self.count.max(1.0)).sqrt()
    }
    fn cell(&self) -> String {
        format!("{:.4}°, {:.3}°", self.rms_rad().to_degrees(), self.largest_rad.to_degrees())
    }
}

/// Returns the errors of the pictures' axes, and their number.
fn pictures(scene: &Scenario, rows: &[Row]) -> anyhow::Result<Nadir> {
    let flight = scene.flight()?;
    let mut nadir = Nadir::default();
    for row in rows {
        let (Some(x), Some(y), Some(z)) = (row.axis_x, row.axis_y, row.axis_z) else { continue };
        let Some(frame) = flight.frames.get(row.index as usize) else { continue };
        let truth = frame.truth()?;
        nadir.add(Vector3::new(x, y, z).angle(&Vector3::new(truth.axis_x, truth.axis_y, truth.axis_z)));
    }
    Ok(nadir)
}

/// Returns the true attitude of the vehicle.
fn attitude(row: &VehicleRow) -> Rotation<Vehicle, Fixed> {
    UnitQuaternion::from_quaternion(Quaternion::new(row.qw, row.qx, row.qy, row.qz)).into()
}

/// Returns the errors of the filter's nadir in the camera within a span of time.
fn filtered(scene: &Scenario, fused: &Fused, span_s: [f64; 2]) -> anyhow::Result<Nadir> {
    let path = scene.path()?;
    let [w, x, y, z] = scene.true_q_vehicle_from_camera_wxyz();
    let mount = Rotation::<Cam, Vehicle>::from(UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)));
    let mut nadir = Nadir::default();
    for epoch in fused.epochs.iter().filter(|e| (span_s[0]..span_s[1]).contains(&e.state.time_s)) {
        let Some(camera) = epoch.cameras.first() else { continue };
        let row = path.vehicle(epoch.state.time_s);
        let truth = attitude(&row) * mount;
        let down = -Vector::<Fixed>::new(row.x_m, row.y_m, row.z_m).normalize();
        let estimate = epoch.state.attitude * camera.mount;
        nadir.add((estimate.inverse() * down).angle_rad(&(truth.inverse() * down)));
    }
    Ok(nadir)
}

/// Adds one attitude at the start, with an error of [`START_DEG`].
fn add_start(scene: &Scenario, inputs: &mut Inputs) -> anyhow::Result<()> {
    let row = scene.path()?.vehicle(1.0);
    let sigma_rad = START_DEG.to_radians();
    let error = Rotation::from_scaled_axis(Vector::new(1.0, -1.0, 1.0) * sigma_rad);
    inputs.attitudes.push(Attitude { time_s: 1.0, fixed_from_vehicle: Some(attitude(&row) * error), sigma_rad });
    Ok(())
}

fn settings(mode: Treatment, latitude_sigma_km: f64) -> Settings {
    let mut settings = vehicle::estimating();
    settings.limb_height.mode = mode;
    settings.limb_height.latitude_sigma_km = latitude_sigma_km;
    settings
}

/// Describes what the filter says about the limb height at the end.
fn heights(fused: &Fused) -> String {
    let Some(last) = fused.epochs.last() else { return String::new() };
    let [first, second] = last.corrections.limb_latitude_km;
    let [sigma_first, sigma_second] = last.limb_latitude_sigma_km;
    format!(
        "{:+.2} ± {:.2} km, {first:+.2} ± {sigma_first:.2} km, {second:+.2} ± {sigma_second:.2} km",
        last.corrections.limb_height_km, last.limb_height_sigma_km
    )
}

/// Returns the sensor with the limb heights that the filter found.
fn corrected(scene: &Scenario, fused: &Fused) -> Config {
    let mut config = told(scene);
    let Some(last) = fused.epochs.last() else { return config };
    let rows = [-90.0, -45.0, 0.0, 45.0, 90.0].map(|latitude_deg: f64| {
        [latitude_deg, TOLD_KM + last.corrections.limb_height_at_km(latitude_deg.to_radians())]
    });
    config.body.limb_height_by_latitude_km = rows.into_iter().collect();
    config.body.limb_height_sigma_km = last.limb_height_sigma_km;
    config
}

/// Runs a sensor again on the pictures with the attitude of the filter.
fn again(scene: &Scenario, inputs: &Inputs, fused: &Fused, sensor: &Config) -> anyhow::Result<Vec<Row>> {
    let recording = inputs.recordings.first().ok_or_else(|| anyhow!("there is no recording"))?;
    let mut text = Vec::new();
    sink::write_frames(fused, recording, None, &mut text)?;
    let given = frames::parse(&String::from_utf8(text)?, std::path::Path::new("frames.csv"));
    process(scene, sensor, Some(&given.map_err(|e| anyhow!("{e}"))?))
}

/// Runs the sensor on the same pictures with what the filter found, and the filter on these answers.
fn second_run(scene: &Scenario, inputs: &Inputs, fused: &Fused, alone: &Nadir) -> anyhow::Result<String> {
    let attitude = again(scene, inputs, fused, &told(scene))?;
    let sensor = corrected(scene, fused);
    let heights = again(scene, inputs, fused, &sensor)?;
    let both = pictures(scene, &heights)?;
    let mut inputs = inputs.clone();
    inputs.recordings = vec![Recording::new(scene.name.clone(), heights, Some(&sensor))?];
    let wanted = Wanted { rate_hz: Some(0.1), ..Wanted::default() };
    let fused = fuse(&inputs, &settings(Treatment::Estimated, 1.0), wanted)?;
    let last = filtered(scene, &fused, [scene.capture.to_s - ORBIT_S, scene.capture.to_s])?;
    let is_met = last.rms_rad().to_degrees() <= GOAL_DEG;
    Ok(format!(
        "A second run of the sensor on the same pictures with the attitude of the filter (`hzn fuse --write-frames`, \
         then `hzn run --frames`): {} (RMS, largest), in place of {}. With the limb heights that the filter found in \
         `body.limb_height_by_latitude_km`: {}. The filter with these answers, last orbit: {}. Goal: {GOAL_DEG}°: {}.",
        pictures(scene, &attitude)?.cell(),
        alone.cell(),
        both.cell(),
        last.cell(),
        if is_met { "met" } else { "**not met**" },
    ))
}

const HEAD: [&str; 6] = [
    "limb height",
    "first orbit: RMS, largest",
    "third orbit",
    "last orbit",
    "3σ of the attitude at the end",
    "constant, c₁, c₂ at the end",
];

pub(super) fn study(effort: &Effort, section: &mut Section) -> anyhow::Result<()> {
    let scene = scene(effort)?;
    let mut inputs = recordings::inputs(&scene, told, effort.recordings.as_deref())?;
    add_start(&scene, &mut inputs)?;
    let rows = inputs.recordings.first().map(|r| r.rows.clone()).unwrap_or_default();
    let alone = pictures(&scene, &rows)?;
    section.text(format!(
        "**An infrared sensor in orbit ({} orbits) without an attitude from outside.** Scene `leo-infrared` with seed \
         {SEED}: {} pictures, 384×288, 92 px/rad, limb height 25 km at the equator, 4.5 km more over the north pole \
         and less over the south pole. The sensor is told 22 km ± 4 km for all latitudes; the inertial unit is that \
         above; one attitude with a sigma of {START_DEG}° is given at the start. The error is the angle between the \
         true direction of nadir in the camera and that of the filter (*estimated* settings). *by latitude*: the \
         filter also estimates how the limb height changes with the latitude (`[limb_height] latitude_sigma_km = 4`): \
         c₁ sin φ + c₂ (3 sin² φ − 1)/2.",
        scene.capture.to_s / ORBIT_S,
        rows.len(),
    ));
    section.text(format!("The pictures alone: {} answers, {} (RMS, largest).", alone.count, alone.cell()));
    let orbits = scene.capture.to_s / ORBIT_S;
    let mut table = Vec::new();
    let mut best = None;
    for (name, settings) in [
        ("considered", settings(Treatment::Considered, 0.0)),
        ("estimated", settings(Treatment::Estimated, 0.0)),
        ("estimated by latitude", settings(Treatment::Estimated, 4.0)),
    ] {
        let fused = fuse(&inputs, &settings, Wanted { rate_hz: Some(0.1), ..Wanted::default() })?;
        let orbit =
            |k: f64| Ok::<_, anyhow::Error>(filtered(&scene, &fused, [(k - 1.0) * ORBIT_S, k * ORBIT_S])?.cell());
        let sigma = fused.epochs.last().map_or(f64::NAN, |e| 3.0 * e.attitude_sigma_rad().max().to_degrees());
        table.push(vec![
            name.to_owned(),
            orbit(1.0)?,
            if orbits < 3.0 { "–".to_owned() } else { orbit(3.0)? },
            orbit(orbits)?,
            format!("{sigma:.3}°"),
            heights(&fused),
        ]);
        best = Some(fused);
    }
    section.table(HEAD, table);
    if let Some(fused) = best {
        section.text(second_run(&scene, &inputs, &fused, &alone)?);
    }
    let limbs = inputs.recordings.iter().flat_map(|r| &r.seen).filter(|s| s.body == Body::Limb).count();
    section.text(format!("The filter was given {limbs} limbs."));
    Ok(())
}
