//! `hzn evaluate`: compares results with the truth.

mod page;
mod report;
pub(super) mod text;
mod worst;

use std::path::{Path, PathBuf};

use hzn_core::camera::Camera;
use hzn_evaluate::{Answer, Evaluation, describe_conventions, heads, pair};
use hzn_files::truth::Truth;
use hzn_mcap::Row;
use hzn_run::disk;
use hzn_run::results::Results;
use hzn_run::source::ending;

use crate::exit::{Exit, Outcome, Stop, failed, unreadable, usage};
use crate::files;
use crate::kind_of_file;
use crate::tell;
use report::Report;

/// Compare results with the truth: shares of answers, errors, and whether the covariance is right
///
/// Every picture counts. A picture with a limb in view but without an answer is missed; an answer without a limb in
/// view is false. The report goes to stdout; -o writes it as JSON with every picture, or as one HTML page with plots
/// and the worst pictures. Angles are in degrees.
///
/// Of the results of a rig, the joint answers are compared with the truth of the vehicle; --head compares the rows of
/// one head with the truth in its folder.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The output of `hzn run`: .mcap, .csv or .jsonl
    results: PathBuf,
    /// The truth.csv of the sequence, or its folder
    #[arg(long, value_name = "FILE")]
    truth: PathBuf,
    /// The sensor.toml, for the length of limb in view; without it, the one in the MCAP or next to the truth
    #[arg(short, long, value_name = "FILE")]
    sensor: Option<PathBuf>,
    /// Of the results of a rig, the head that is compared; without it, the joint answer
    #[arg(long, value_name = "NAME")]
    head: Option<String>,
    /// Also write the report: .json or .html; may be given twice
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Print the report as JSON with every picture, as -o FILE.json has it
    #[arg(long)]
    json: bool,
    /// Number of the worst pictures that are listed and drawn
    #[arg(long, value_name = "N", default_value_t = 6)]
    worst: usize,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// Largest difference of the times of a picture in the results and in the truth, seconds.
const SAME_TIME_S: f64 = 1e-3;

pub(super) fn run(args: &Args) -> Outcome {
    for path in &args.output {
        match ending(path).as_str() {
            "json" | "html" => {}
            _ => return Err(usage(format!("{}: a report ends in .json or .html", path.display()))),
        }
    }
    let Results { rows, sensor_toml, lost, .. } = read_results(&args.results)?;
    let truth_path = if args.truth.is_dir() { args.truth.join("truth.csv") } else { args.truth.clone() };
    let folder = truth_path.parent().unwrap_or(Path::new(""));
    let truth = load_truth(&truth_path)?;
    let sensor_path = args.sensor.clone().unwrap_or_else(|| folder.join("sensor.toml"));
    let mut read = hzn_files::files_of_sensor(&sensor_path);
    read.extend([args.results.clone(), truth_path.clone()]);
    read.extend(truth.iter().map(|t| folder.join(&t.file)));
    files::check_outputs(&read, &args.output, args.force)?;
    let mut rows = heads::select(rows, args.head.as_deref()).map_err(usage)?;
    let are_joint = heads::are_joint(&rows);
    truth_of_rig(folder, are_joint, args.head.as_deref())?;
    if are_joint {
        let removed = heads::name_by_time(&mut rows, &truth);
        let removed = removed.map_err(|why| usage(format!("{}: {why}", truth_path.display())))?;
        heads::describe_removed(removed).iter().for_each(tell::warning);
    }
    let sensor = sensor(args.sensor.as_deref(), sensor_toml.as_deref(), folder)?;
    let sensors: Vec<String> = sensor.iter().filter_map(hzn_run::provenance::hash).collect();
    let camera = sensor.and_then(|s| Camera::<f64>::try_new(&s.camera).ok()).filter(|_| !are_joint);
    if camera.is_none() && !are_joint {
        tell::line("note: no sensor.toml is available (--sensor): the length of limb in view is left out");
    }
    let answers: Vec<Answer> = rows.iter().map(Answer::from).collect();
    let cases = pair(&answers, &truth, camera.as_ref())
        .map_err(|e| usage(format!("{} does not match {}: {e}", truth_path.display(), args.results.display())))?;
    warn_of_other_times(&rows, &truth, are_joint);
    describe_conventions(&cases).iter().for_each(tell::warning);
    let report = Report {
        results: args.results.display().to_string(),
        truth: truth_path.display().to_string(),
        evaluations: Evaluation::by_body(&cases),
        frames: cases,
        sensors,
    };
    let worst = worst::select(&report.frames, args.worst);
    for path in &args.output {
        let bytes = if ending(path) == "json" {
            serde_json::to_vec_pretty(&report).map_err(failed)?
        } else {
            let drawn = worst::draw(&worst, &args.results, folder, &truth, camera.as_ref())?;
            page::html(&report, &drawn)?.into_bytes()
        };
        disk::write(path, bytes)?;
    }
    if args.json {
        tell::file(serde_json::to_string_pretty(&report).map_err(failed)? + "\n")?;
    } else {
        tell::report(text::report(&report, &worst))?;
    }
    lost.iter().for_each(tell::warning);
    Ok(if lost.is_some() { Exit::SomeUnreadable } else { Exit::Done })
}

fn load_truth(path: &Path) -> Result<Vec<Truth>, Stop> {
    let refuse = |e| usage(format!("{e}{}", missing_columns(path).unwrap_or_default()));
    hzn_files::truth::load_directions(path).map_err(refuse)
}

/// Columns that a truth needs.
const NEEDED: [&str; 7] = ["file", "body", "limb", "axis_x", "axis_y", "axis_z", "half_angle_deg"];

/// Returns what a truth lacks, if it lacks more than one column: a table that somebody else wrote.
fn missing_columns(truth: &Path) -> Option<String> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(truth).ok()?;
    let header = reader.headers().ok()?;
    let missing: Vec<&str> = NEEDED.into_iter().filter(|name| !header.iter().any(|column| column == *name)).collect();
    (missing.len() > 1).then(|| {
        let (needed, missing) = (NEEDED.join(", "), missing.join(", "));
        format!("; a truth needs the columns {needed}, of which {missing} are missing")
    })
}

/// Reads the results. They come before the truth, so that a wrong file in their place is named first.
fn read_results(path: &Path) -> Result<Results, Stop> {
    kind_of_file::refuse_other_table(path)?;
    let results = hzn_run::results::read(path)?.checked()?;
    match &results.lost {
        Some(lost) if results.rows.is_empty() => Err(unreadable(lost)),
        _ => Ok(results),
    }
}

fn sensor(sensor: Option<&Path>, recorded: Option<&str>, folder: &Path) -> Result<Option<hzn_core::Config>, Stop> {
    let neighbour = folder.join("sensor.toml");
    Ok(match (sensor, recorded) {
        (Some(path), _) => Some(hzn_files::sensor::load(path)?.config),
        // A recorded sensor.toml may name a camera file that is not here.
        (None, Some(text)) => hzn_files::sensor::parse(text, Path::new("sensor.toml")).ok().map(|s| s.config),
        (None, None) if neighbour.exists() => Some(hzn_files::sensor::load(&neighbour)?.config),
        (None, None) => None,
    })
}

/// Refuses the truth of one head for the answers of a vehicle, and the reverse, if a rig.toml says whose truth it is:
/// their axes are in different frames.
fn truth_of_rig(folder: &Path, are_joint: bool, head: Option<&str>) -> Result<(), Stop> {
    if folder.join("rig.toml").is_file() {
        let advice = |name: &str| format!("give --truth {}, the folder of its pictures", folder.join(name).display());
        return match head {
            _ if are_joint => Ok(()),
            Some(name) => {
                Err(usage(format!("this is the truth of the vehicle, not of the head {name}: {}", advice(name))))
            }
            None => Err(usage(format!("this is the truth of a vehicle, not of one camera: {}", advice("HEAD")))),
        };
    }
    let Some(above) = std::path::absolute(folder).ok().and_then(|path| path.parent().map(Path::to_owned)) else {
        return Ok(());
    };
    let Ok(rig) = hzn_files::rig::load(&above.join("rig.toml")) else { return Ok(()) };
    let place = |path: &Path| std::fs::canonicalize(path).ok();
    let Some(own) = place(folder) else { return Ok(()) };
    let is_own = |one: &&hzn_files::rig::Head| place(&above.join(&one.pictures)).as_ref() == Some(&own);
    let Some(name) = rig.heads.iter().find(is_own).map(|one| one.name.as_str()) else { return Ok(()) };
    match head {
        Some(wanted) if wanted != name => {
            Err(usage(format!("this is the truth of the head {name}, not of {wanted}: give --head {name}")))
        }
        None if are_joint => Err(usage(format!(
            "this is the truth of the head {name}, and the joint answers are in the frame of the vehicle: give --head \
             {name}, or --truth {}",
            folder.join("..").display()
        ))),
        _ => Ok(()),
    }
}

/// Warns if the times differ: two sequences may have the same file names.
fn warn_of_other_times(rows: &[Row], truth: &[Truth], are_joint: bool) {
    // An epoch of a rig is not at the time of one picture; it has the name of the row within half a step.
    let steps = truth.windows(2).map(|w| w[1].time_s - w[0].time_s).filter(|step| *step > 0.0);
    let allowed_s = if are_joint { 0.5 * steps.fold(f64::INFINITY, f64::min) } else { SAME_TIME_S };
    let time = |file: &str| truth.iter().find(|t| file.ends_with(t.file.as_str())).map(|t| t.time_s);
    let other_times =
        |row: &Row| Some((row.time_s?, time(&row.file)?)).filter(|(here, there)| (here - there).abs() > allowed_s);
    let other = rows.iter().find_map(|row| other_times(row).map(|(here, there)| (row, here, there)));
    if let Some((row, here, there)) = other {
        let what = "if they are not counted from different instants, this is the truth of another sequence";
        tell::warning(format_args!("{}: at {here} s in the results, at {there} s in the truth; {what}", row.file));
    }
}
