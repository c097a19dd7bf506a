//! `hzn info`: describes the content of a file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hzn_core::status::Status;
use hzn_mcap::{Contents, Reader, Row};
use hzn_run::source::{self, decode, ending};
use hzn_run::{checked_row, explain};
use hzn_sim::Scenario;

use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::tell::{self, one_line};

/// Say what a file is, and what it contains
///
/// The file may be results (.mcap, .csv, .jsonl), a sensor.toml or camera file, a scene.toml, frames.csv, truth.csv,
/// imu.csv, gnss.csv, or a picture.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The file
    file: PathBuf,
}

pub(super) fn run(args: &Args) -> Outcome {
    let file = &args.file;
    let (kind, _) = source::check_exists(file)?;
    let (text, lost) = match kind.as_str() {
        "mcap" => recording(file)?,
        "csv" | "jsonl" => (table(file, &kind)?, None),
        "toml" | "yaml" | "yml" => (sensor(file, &kind)?, None),
        _ => (one_picture(file)?, None),
    };
    tell::result(text)?;
    lost.iter().for_each(tell::warning);
    Ok(if lost.is_some() { Exit::SomeUnreadable } else { Exit::Done })
}

/// The description of a file, and the parts that are missing.
type Described = (String, Option<String>);

fn recording(file: &Path) -> Result<Described, Stop> {
    // The pictures are read too, because the result says whether they are complete.
    let mut reader = Reader::open(file, Contents::All).map_err(failed)?;
    let mut summary = Summary::default();
    for frame in reader.by_ref() {
        summary.add(&frame.map_err(failed)?.row);
    }
    if summary.frames == 0 && reader.sensor_toml().is_none() && reader.unread_reports() == 0 {
        return foreign(file);
    }
    let mut out = kind_line("recording of hzn run") + &summary.text();
    for (key, value) in reader.metadata() {
        out.push_str(&format!("{:<16} {}\n", one_line(key), one_line(value)));
    }
    if !reader.is_complete() {
        out.push_str(&unfinished(file));
    }
    if let Some(compression) = reader.unknown_compression() {
        out.push_str(&format!("compression      {compression:?}, which hzn does not read\n"));
    } else if reader.broken_chunks() > 0 {
        out.push_str(&format!("damaged parts    {}\n", reader.broken_chunks()));
    }
    if let Some(Ok(sensor)) = reader.sensor_toml().map(|t| hzn_files::sensor::parse(t, Path::new("sensor.toml"))) {
        let c = sensor.config.camera;
        out.push_str(&format!("camera           {} x {} px, {}\n", c.width, c.height, c.model.name()));
    }
    // An unfinished file without broken parts is not damaged: its run still goes on, or --resume continues it.
    let unfinished = ending(file) == "part" && reader.broken_chunks() == 0 && reader.unread_reports() == 0;
    Ok((out, source::describe_recording_loss(&reader, file, "counted").filter(|_| !unfinished)))
}

fn unfinished(file: &Path) -> String {
    format!("unfinished       `hzn run --resume` continues it, `hzn recover {}` closes it\n", one_line(file.display()))
}

/// Describes the pictures in a recording of another program.
fn foreign(file: &Path) -> Result<Described, Stop> {
    let mut reader = hzn_mcap::ImageReader::open(file, None).map_err(failed)?;
    let (mut count, mut span) = (0u64, None::<(f64, f64)>);
    for image in reader.by_ref() {
        let t = image.map_err(failed)?.time_s;
        count += 1;
        span = Some(span.map_or((t, t), |(a, b)| (a.min(t), b.max(t))));
    }
    let mut out = kind_line("recording without results of hzn") + &format!("pictures         {count}\n");
    if let (Some(topic), Some((a, b))) = (reader.topic(), span) {
        out.push_str(&format!("topic            {}\ntime             {a:.3} to {b:.3} s\n", one_line(topic)));
    }
    for topic in reader.other_topics() {
        out.push_str(&format!("other topic      {}\n", one_line(topic)));
    }
    let lost = reader.broken().map(|why| format!("{}: {why}; the pictures before that were counted", file.display()));
    Ok((out, lost))
}

/// The first columns of results in every version of hzn; later versions only append columns.
const FIRST_COLUMNS: &[&str] = &["index", "file", "time_s", "body", "status"];

fn table(file: &Path, kind: &str) -> Result<String, Stop> {
    let mut notes = Vec::new();
    if kind == "csv" {
        let header = csv::Reader::from_path(file).and_then(|mut r| r.headers().cloned()).map_err(failed)?;
        let has = |name: &str| header.iter().any(|column| column == name);
        if header.is_empty() {
            return Err(failed(format!("{}: the table is empty", file.display())));
        }
        if !header.iter().take(FIRST_COLUMNS.len()).eq(FIRST_COLUMNS.iter().copied()) {
            return match () {
                () if has("limb") => truth(file),
                () if has("file") => priors(file),
                () => series(file, &header),
            };
        }
        notes = other_columns(&header);
    }
    let mut summary = Summary::default();
    for row in hzn_run::results::rows(file, kind)? {
        summary.add(&row.map_err(|e| Stop::from(e).with_details(notes.iter().cloned()))?);
    }
    let mut out = kind_line("results of hzn run") + &summary.text();
    notes.iter().for_each(|note| out.push_str(&format!("{note}\n")));
    if ending(file) == "part" {
        out.push_str(&unfinished(file));
    }
    Ok(out)
}

/// Returns lines about the columns in which results of another version differ; nothing for results of this version.
fn other_columns(header: &csv::StringRecord) -> Vec<String> {
    let missing: Vec<&str> = Row::COLUMNS.into_iter().filter(|name| !header.iter().any(|c| c == *name)).collect();
    let unknown: Vec<&str> =
        header.iter().filter(|column| !Row::COLUMNS.contains(column) && *column != checked_row::COLUMN).collect();
    let named = [("columns missing", missing), ("columns unknown", unknown)];
    let line = |(title, columns): (&str, Vec<&str>)| {
        one_line(format!("{title:<16} {} (the file is of another version of hzn)", columns.join(", ")))
    };
    named.into_iter().filter(|(_, columns)| !columns.is_empty()).map(line).collect()
}

/// Describes a frames.csv.
fn priors(file: &Path) -> Result<String, Stop> {
    let frames = hzn_files::frames::load(file)?;
    let with = |has: fn(&hzn_files::FrameData) -> bool| frames.rows.iter().filter(|r| has(r)).count();
    let mut out = kind_line("frames.csv, the priors of pictures");
    out.push_str(&format!("pictures         {}\n", frames.rows.len()));
    for (name, n) in [
        ("time", with(|r| r.time_s.is_some())),
        ("UTC", with(|r| r.utc_s.is_some())),
        ("altitude", with(|r| r.altitude_km.is_some())),
        ("position", with(|r| r.position_km.is_some())),
        ("attitude", with(|r| r.q_fixed_from_camera_wxyz.is_some())),
        ("Sun", with(|r| r.sun_camera.is_some())),
    ] {
        out.push_str(&format!("{:<16} {n}\n", format!("with {name}")));
    }
    let unused: Vec<&str> = frames.warnings.iter().filter_map(|w| w.field.as_deref()).collect();
    if !unused.is_empty() {
        out.push_str(&format!("columns not used {}\n", one_line(unused.join(", "))));
    }
    Ok(out)
}

fn truth(file: &Path) -> Result<String, Stop> {
    let rows = hzn_files::truth::load(file).map_err(usage)?;
    let mut bodies = BTreeMap::<&str, [usize; 2]>::new();
    for row in &rows {
        let [seen, all] = bodies.entry(&row.body).or_default();
        *seen += usize::from(row.has_limb());
        *all += 1;
    }
    let mut out = kind_line("truth of pictures, for `hzn evaluate RESULTS --truth FILE`");
    for (body, [seen, all]) in bodies {
        out.push_str(&format!("{:<16} limb in view in {seen} of {all} pictures\n", one_line(body)));
    }
    Ok(out)
}

/// Describes a table of measurements over time, from the instruments of `hzn simulate` or from another program.
fn series(file: &Path, header: &csv::StringRecord) -> Result<String, Stop> {
    let has = |name: &str| header.iter().position(|column| column == name);
    let mut out = kind_line(match () {
        () if has("gyro_x_radps").is_some() => "imu.csv, rates and accelerations of a simulated vehicle",
        () if has("x_m").is_some() && has("vx_mps").is_some() => "gnss.csv, fixes of a simulated satellite receiver",
        () => "table that hzn does not know (results, frames.csv, truth.csv, imu.csv, gnss.csv)",
    });
    let number = |row: &csv::StringRecord, name: &str| has(name).and_then(|i| row.get(i)?.parse::<f64>().ok());
    let (mut rows, mut span, mut saturated) = (0u64, None::<(f64, f64)>, 0u64);
    for row in csv::Reader::from_path(file).map_err(failed)?.records() {
        let row = row.map_err(|e| failed(format!("{}: {e}", file.display())))?;
        rows += 1;
        if let Some(t) = number(&row, "time_s") {
            span = Some(span.map_or((t, t), |(a, b)| (a.min(t), b.max(t))));
        }
        saturated += u64::from(number(&row, "saturated") == Some(1.0));
    }
    out.push_str(&format!("rows             {rows}\n"));
    if let Some((a, b)) = span {
        out.push_str(&format!("time             {a:.3} to {b:.3} s\n"));
    }
    if has("saturated").is_some() {
        out.push_str(&format!("saturated        {saturated}\n"));
    }
    out.push_str(&format!("columns          {}\n", one_line(header.iter().collect::<Vec<_>>().join(", "))));
    Ok(out)
}

/// Returns the first line: the kind of the file.
fn kind_line(kind: &str) -> String {
    format!("file             {kind}\n")
}

fn sensor(file: &Path, kind: &str) -> Result<String, Stop> {
    if kind != "toml" {
        let camera = hzn_files::camera_file::load(file, None)?;
        return Ok(kind_line("camera file") + &super::camera::describe(&hzn_core::Config::new(camera))?);
    }
    let text = hzn_files::limited::read_text(file, hzn_files::limited::SETTINGS_BYTES)
        .map_err(|e| failed(format!("{}: cannot be read: {e}", file.display())))?;
    // The function that reads the text below reports its errors.
    let table = text.parse::<toml::Table>().unwrap_or_default();
    if table.contains_key("trajectory") && table.contains_key("capture") {
        return scene(&hzn_sim::scenario::parse(&text, file, None, None)?);
    }
    let sensor = hzn_files::sensor::load(file)?;
    sensor.warnings.iter().for_each(tell::warning);
    Ok(kind_line("sensor.toml") + &super::camera::describe(&sensor.config)?)
}

fn scene(scenario: &Scenario) -> Result<String, Stop> {
    let mut out = kind_line("scene, for `hzn simulate FILE`");
    let mut line = |name: &str, value: String| out.push_str(&format!("{name:<16} {}\n", one_line(value)));
    let (capture, camera) = (&scenario.capture, &scenario.camera);
    line("name", scenario.name.clone());
    line("pictures", format!("{}, at {} to {} s from {}", capture.frames, capture.from_s, capture.to_s, scenario.utc));
    line("camera", format!("{} x {} px, {}", camera.width, camera.height, camera.model.name()));
    line("bodies", scenario.body_names().join(", "));
    let instruments = [("imu.csv", scenario.imu.is_some()), ("gnss.csv", scenario.gnss.is_some())];
    let written: Vec<&str> = instruments.iter().filter(|(_, there)| *there).map(|(name, _)| *name).collect();
    line("instruments", if written.is_empty() { "none".to_owned() } else { written.join(", ") });
    Ok(out)
}

fn one_picture(file: &Path) -> Result<String, Stop> {
    let named = |why: String| failed(format!("{}: {why}", file.display()));
    let bytes = decode::read_file(file).map_err(named)?;
    let p = decode::decode(&bytes, None).map_err(named)?;
    let format = decode::guess_format(&bytes).map(|f| format!("{f:?}").to_uppercase()).unwrap_or_default();
    let l = p.layout;
    let mut out = kind_line(&format!(
        "{format} picture of {} x {} px, {} of {} bits",
        l.width,
        l.height,
        explain::counted(l.channels.into(), "channel"),
        l.bits
    ));
    if p.pages > 1 {
        out.push_str(&format!("pictures         {}; hzn processes only the first\n", p.pages));
    }
    if let Some(how) = p.display_turn() {
        out.push_str(&format!("to be shown      {how}; input.orient decides whether hzn turns it\n"));
    }
    if let Some(t) = p.exif_time_s {
        out.push_str(&format!("EXIF time        {t:.3} s since 1970, assumed to be UTC\n"));
    }
    Ok(out)
}

/// Statistics of rows. They need memory for four numbers a row.
#[derive(Debug, Default)]
struct Summary {
    frames: u64,
    /// Number of the last row's picture. A picture of several bodies has one row for each body.
    last: Option<u64>,
    time: Option<(f64, f64)>,
    /// The bodies by name, in the order of their first rows.
    bodies: Vec<(String, BodySummary)>,
}

/// Results of one body.
#[derive(Debug, Default)]
struct BodySummary {
    statuses: BTreeMap<u8, u64>,
    sigma_deg: Vec<f64>,
    rms_px: Vec<f64>,
    elapsed_us: Vec<f64>,
    altitude_km: Vec<f64>,
}

impl Summary {
    fn add(&mut self, row: &Row) {
        if self.last.replace(row.index) != Some(row.index) {
            self.frames += 1;
        }
        if let Some(t) = row.time_s {
            self.time = Some(self.time.map_or((t, t), |(a, b)| (a.min(t), b.max(t))));
        }
        let place = self.bodies.iter().position(|(name, _)| *name == row.body).unwrap_or_else(|| {
            self.bodies.push((row.body.clone(), BodySummary::default()));
            self.bodies.len() - 1
        });
        let found = &mut self.bodies[place].1;
        *found.statuses.entry(row.status as u8).or_default() += 1;
        found.sigma_deg.extend(row.sigma_max_deg);
        found.rms_px.extend(row.rms_px);
        found.elapsed_us.extend(row.elapsed_us);
        found.altitude_km.extend(row.altitude_est_km);
    }

    fn text(self) -> String {
        let mut out = format!("pictures         {}\n", self.frames);
        let mut line = |name: &str, value: String| out.push_str(&format!("{name:<16} {}\n", one_line(value)));
        if let Some((a, b)) = self.time {
            line("time", format!("{a:.3} to {b:.3} s"));
        }
        for (name, found) in self.bodies {
            line("body", name);
            let rows: u64 = found.statuses.values().sum();
            for status in Status::ALL {
                if let Some(n) = found.statuses.get(&(status as u8)) {
                    line(status.name(), format!("{n} ({:.1} %)", 100.0 * *n as f64 / rows as f64));
                }
            }
            for (name, unit, values) in [
                ("sigma", "deg", found.sigma_deg),
                ("RMS", "px", found.rms_px),
                ("altitude found", "km", found.altitude_km),
                ("processing", "us", found.elapsed_us),
            ] {
                if let Some([low, middle, high]) = percentiles(values) {
                    let [low, middle, high] = [low, middle, high].map(three_digits);
                    line(name, format!("median {middle} {unit}, 90 % from {low} to {high}"));
                }
            }
        }
        out
    }
}

/// Formats a number with three significant digits, as a whole number from 100 on. Statistics over pictures are not more
/// accurate.
fn three_digits(x: f64) -> String {
    let before = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    format!("{x:.*}", (2 - before).clamp(0, 9) as usize)
}

fn percentiles(mut values: Vec<f64>) -> Option<[f64; 3]> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some([0.05, 0.5, 0.95].map(|p| values[(p * last as f64).round() as usize]))
}
