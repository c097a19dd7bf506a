//! What a file is, and which command reads it: for the messages of commands that got another file than they read.

pub(crate) mod content;

use std::path::Path;

use hzn_run::source::ending;

use crate::exit::{Stop, usage};

/// The tables of hzn, by some of their columns, with their name and the command that reads them. The first one that has
/// all columns is right.
const TABLES: [(&[&str], &str, &str); 14] = [
    (
        &["index", "body", "status"],
        "results of hzn run",
        "hzn info describes them, hzn view shows them, hzn evaluate compares them with a truth",
    ),
    (
        &["limb", "axis_x", "half_angle_deg"],
        "the truth of pictures (truth.csv)",
        "hzn evaluate RESULTS --truth reads it",
    ),
    (
        &["source", "nis", "taken"],
        "the innovations of hzn fuse",
        "hzn view shows them with the results beside them, FILE.csv of FILE.innovations.csv",
    ),
    (
        &["self_check", "parameter_generation"],
        "the housekeeping of a flight computer",
        "hzn telemetry --housekeeping writes it for other programs",
    ),
    (&["depression_deg", "sigma_max_deg"], "a study of hzn sensitivity", "other programs draw it"),
    (&["file", "u_px", "v_px", "error_u_px"], "residuals of a lens calibration", "hzn view shows them"),
    (&["u_px", "v_px"], "a table of points", "hzn calibrate points reads it"),
    (&["file", "accel_x_mps2"], "a table of the tilts of a board", "hzn calibrate mount reads it"),
    (&["ref_x", "ref_y", "ref_z"], "a table of directions of a sensor", "hzn fuse --direction reads it"),
    (&["gyro_x_radps"], "a table of an inertial unit (imu.csv)", "hzn fuse --imu reads it"),
    (&["x_m", "vx_mps", "qw"], "the truth of a vehicle (vehicle.csv)", "hzn fuse --truth reads it"),
    (&["x_m", "vx_mps"], "a table of a receiver (gnss.csv)", "hzn fuse --gnss reads it"),
    (
        &["file", "altitude_km"],
        "a table of the pictures (frames.csv)",
        "hzn run reads it beside the pictures, or with --frames",
    ),
    (
        &["file", "time_s"],
        "a table of the pictures (frames.csv)",
        "hzn run reads it beside the pictures, or with --frames",
    ),
];

/// Returns what the table with these columns is, and which command reads it; `None` for a table that is not of hzn.
pub(crate) fn of_columns<'a>(header: impl IntoIterator<Item = &'a str>) -> Option<(&'static str, &'static str)> {
    let header: Vec<&str> = header.into_iter().collect();
    let fits = |columns: &[&str]| columns.iter().all(|column| header.contains(column));
    TABLES.iter().find(|(columns, ..)| fits(columns)).map(|(_, what, command)| (*what, *command))
}

/// Returns what a file has, and which command reads it, if it has results of hzn or is one of its tables.
fn of_file(path: &Path) -> Option<(&'static str, &'static str)> {
    match ending(path).as_str() {
        "csv" | "mcap" if hzn_fuse::read_back::is_solution(path) => {
            Some(("results of hzn fuse", "hzn view shows them"))
        }
        "csv" => {
            let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_path(path).ok()?;
            of_columns(reader.headers().ok()?)
        }
        "jsonl" => hzn_run::results::rows(path, "jsonl")
            .ok()?
            .next()?
            .ok()
            .and_then(|_| TABLES.first().map(|(_, what, command)| (*what, *command))),
        _ => None,
    }
}

/// Refuses a table of hzn where something else is needed, for example `a picture`.
fn refuse_table(path: &Path, needed: &str) -> Result<(), Stop> {
    let Some((what, command)) = of_file(path) else { return Ok(()) };
    Err(usage(format!("{}: has {what}, and {needed} is needed here; {command}", path.display())))
}

/// Refuses a file that hzn knows, and that has no pictures.
pub(crate) fn refuse_without_pictures(path: &Path) -> Result<(), Stop> {
    const NEEDED: &str = "a picture, a folder or a video";
    refuse_table(path, NEEDED)?;
    let Some(content) = content::of_file(path) else { return Ok(()) };
    let content::Content { what, command, .. } = content;
    Err(usage(format!("{}: is {what}, and {NEEDED} is needed here; {command}", path.display())))
}

/// Refuses a file that hzn knows where a sensor.toml is needed.
pub(crate) fn refuse_no_sensor(path: &Path) -> Result<(), Stop> {
    const NEEDED: &str = "a sensor.toml";
    refuse_table(path, NEEDED)?;
    let Some(content) = content::of_file_or_picture(path).filter(|content| content.kind != "sensor") else {
        return Ok(());
    };
    let content::Content { what, command, .. } = content;
    let init = if content.kind == "picture" { ", and hzn init FILE writes a sensor.toml for its camera" } else { "" };
    Err(usage(format!("{}: is {what}, and {NEEDED} is needed here; {command}{init}", path.display())))
}

/// Refuses a table of hzn that has other rows than results of `hzn run`.
pub(crate) fn refuse_other_table(path: &Path) -> Result<(), Stop> {
    let results = TABLES.first().map(|(_, what, _)| *what);
    match of_file(path) {
        Some((what, _)) if Some(what) != results => refuse_table(path, "a file of results of hzn run"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_known_by_their_columns() {
        let what = |header: &str| of_columns(header.split(',')).map(|(what, _)| what);
        let row = hzn_mcap::Row::COLUMNS.join(",");
        assert_eq!(what(&row), Some("results of hzn run"));
        assert_eq!(
            what("file,body,limb,axis_x,axis_y,axis_z,half_angle_deg"),
            Some("the truth of pictures (truth.csv)")
        );
        assert_eq!(what("time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps"), Some("a table of a receiver (gnss.csv)"));
        assert_eq!(what("file,x_km,altitude_km"), Some("a table of the pictures (frames.csv)"));
        assert_eq!(what("20.1,20.3"), None);
    }
}
