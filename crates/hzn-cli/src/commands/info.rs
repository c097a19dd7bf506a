//! `hzn info`: describes the content of a file.

mod content;
mod facts;
mod other;
mod recording;
#[cfg_attr(not(feature = "simulator"), path = "info/no_scene.rs")]
mod scene;
mod summary;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hzn_core::Config;
use hzn_fuse::read_back;
use hzn_mcap::{Contents, Reader, Row};
use hzn_run::source::{self, decode, ending};
use hzn_run::{checked_row, explain, provenance};
use serde_json::{Value, json};

use facts::Facts;
use recording::{Writer, is_of_rig};
use summary::Summary;

use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::kind_of_file;
use crate::tell::{self, one_line};

/// Say what a file is, and what it contains
///
/// The file may be a folder of pictures, results (.mcap, .csv, .jsonl), a sensor.toml or camera file, a scene.toml,
/// rig.toml, fuse.toml, frames.csv, truth.csv, imu.csv, gnss.csv, a picture, a video, the folder of a bag of ROS 2, a
/// prepared sensor, a stream of packets, or a file of attitudes or orbits (AEM, OEM, SPICE).
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The file, or a folder of pictures
    file: PathBuf,
    /// Print the facts as one JSON object; names of keys have the unit
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    let file = &args.file;
    let (facts, lost) = match () {
        () if source::is_bag(file) => other::bag(file)?,
        () if file.is_dir() => (other::folder(file)?, None),
        () => one_file(file)?,
    };
    if args.json {
        tell::file(facts.json().map_err(failed)?)?;
    } else {
        tell::result(facts.text())?;
    }
    lost.iter().for_each(tell::warning);
    Ok(if lost.is_some() { Exit::SomeUnreadable } else { Exit::Done })
}

fn one_file(file: &Path) -> Result<Described, Stop> {
    let (kind, _) = source::check_exists(file)?;
    Ok(match kind.as_str() {
        "mcap" | "csv" if read_back::is_solution(file) => (other::solution(&read_back::read_solution(file)?), None),
        "mcap" => recording(file)?,
        "csv" | "jsonl" => (table(file, &kind)?, None),
        "toml" | "yaml" | "yml" => (sensor(file, &kind)?, None),
        // They are refused with the command that converts them.
        "db3" | "bag" => (other::bag(file)?.0, None),
        _ if source::is_video(file) => other::video(file)?,
        _ => match kind_of_file::content::of_file(file) {
            Some(kind_of_file::content::CAMERA_FILE) => (sensor(file, &kind)?, None),
            Some(kind_of_file::content::PREPARED) => {
                let (out, config) = content::prepared_sensor(file)?;
                (calibration(out, &config)?, None)
            }
            Some(known) => (content::describe(file, known)?, None),
            None => (one_picture(file)?, None),
        },
    })
}

/// The description of a file, and the parts that are missing.
type Described = (Facts, Option<String>);

fn recording(file: &Path) -> Result<Described, Stop> {
    // The pictures are read too, because the result says whether they are complete.
    let mut reader = Reader::open(file, Contents::All).map_err(failed)?;
    let (mut summary, mut pictures) = (Summary::default(), 0u64);
    for frame in reader.by_ref() {
        let frame = frame.map_err(failed)?;
        summary.add(&frame.row);
        pictures += u64::from(frame.image.is_some());
    }
    if summary.frames == 0 && reader.sensor_toml().is_none() && reader.unread_reports() == 0 {
        return foreign(file);
    }
    let metadata: BTreeMap<&str, &str> = reader.metadata().iter().map(|(k, v)| (k.as_str(), v.as_str())).collect();
    let (writer, is_rig, has_pictures) = (Writer::of(&reader), is_of_rig(&reader), pictures > 0);
    let mut out = Facts::new("recording", &writer.describe(is_rig, has_pictures));
    out.key("writer", writer.name());
    out.line("for", recording::next_steps(is_rig, has_pictures));
    out.key("recorded_pictures", pictures);
    summary.describe(&mut out);
    for (key, value) in &metadata {
        out.line(&one_line(key), value.to_string());
    }
    out.key("metadata", json!(metadata));
    out.key("is_complete", reader.is_complete());
    if !reader.is_complete() {
        out.line("unfinished", unfinished(file));
    }
    if let Some(compression) = reader.unknown_compression() {
        out.fact(
            "compression",
            format!("{compression:?}, which hzn does not read"),
            "unknown_compression",
            compression,
        );
    } else if reader.broken_chunks() > 0 {
        out.fact("damaged parts", reader.broken_chunks().to_string(), "damaged_parts", reader.broken_chunks());
    }
    if let Some(Ok(sensor)) = reader.sensor_toml().map(|t| hzn_files::sensor::parse(t, Path::new("sensor.toml"))) {
        let c = &sensor.config.camera;
        let text = format!("{} x {} px, {}", c.width, c.height, c.model.name());
        out.fact("camera", text, "camera", camera_json(&sensor.config)?);
        if let Some(hash) = provenance::hash(&sensor.config) {
            out.fact("sensor hash", hash.clone(), "sensor_hash", hash);
        }
    }
    // An unfinished file without broken parts is not damaged: its run still goes on, or --resume continues it.
    let unfinished = ending(file) == "part" && reader.broken_chunks() == 0 && reader.unread_reports() == 0;
    Ok((out, source::describe_recording_loss(&reader, file, "counted").filter(|_| !unfinished)))
}

fn unfinished(file: &Path) -> String {
    format!("`hzn run --resume` continues it, `hzn recover {}` closes it", file.display())
}

/// Describes the pictures in a recording of another program.
fn foreign(file: &Path) -> Result<Described, Stop> {
    let mut reader = hzn_mcap::ImageReader::open(file, None).map_err(failed)?;
    let (mut count, mut span) = (0u64, None::<(f64, f64)>);
    for image in reader.by_ref() {
        let time_s = image.map_err(failed)?.time_s;
        count += 1;
        span = time_s.map(|t| span.map_or((t, t), |(a, b)| (a.min(t), b.max(t)))).or(span);
    }
    let mut out = Facts::new("pictures-in-mcap", "recording without results of hzn");
    let next = if count > 0 {
        "hzn init FILE writes a sensor.toml for its camera, and hzn run FILE --sensor reads its pictures"
    } else {
        "hzn export FILE --imu imu.csv --gnss gnss.csv, if it has messages of these instruments"
    };
    out.line("for", next.to_owned());
    out.fact("pictures", count.to_string(), "pictures", count);
    reader.topic().into_iter().for_each(|topic| out.fact("topic", topic.to_owned(), "topic", topic));
    span.into_iter().for_each(|(a, b)| out.time(a, b));
    source::describe_clock(&reader).into_iter().for_each(|note| out.line("note", note));
    let others: Vec<&str> = reader.other_topics().collect();
    others.iter().for_each(|topic| out.line("other topic", (*topic).to_owned()));
    out.key("other_topics", json!(others));
    let lost = reader.broken().map(|why| format!("{}: {why}; the pictures before that were counted", file.display()));
    Ok((out, lost))
}

/// The first columns of results in every version of hzn; later versions only append columns.
const FIRST_COLUMNS: &[&str] = &["index", "file", "time_s", "body", "status"];

fn table(file: &Path, kind: &str) -> Result<Facts, Stop> {
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
    let mut out = Facts::new("results", "results of hzn run");
    summary.describe(&mut out);
    notes.iter().for_each(|note| out.whole_line(note));
    out.key("is_complete", ending(file) != "part");
    if ending(file) == "part" {
        out.line("unfinished", unfinished(file));
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
fn priors(file: &Path) -> Result<Facts, Stop> {
    let frames = hzn_files::frames::load(file)?;
    let with = |has: fn(&hzn_files::FrameData) -> bool| frames.rows.iter().filter(|r| has(r)).count();
    let mut out = Facts::new("frames", "frames.csv, the priors of pictures");
    out.fact("pictures", frames.rows.len().to_string(), "pictures", frames.rows.len());
    for (name, n) in [
        ("time", with(|r| r.time_s.is_some())),
        ("UTC", with(|r| r.utc_s.is_some())),
        ("altitude", with(|r| r.altitude_km.is_some())),
        ("position", with(|r| r.position_km.is_some())),
        ("attitude", with(|r| r.q_fixed_from_camera_wxyz.is_some())),
        ("Sun", with(|r| r.sun_camera.is_some())),
    ] {
        out.fact(&format!("with {name}"), n.to_string(), &format!("with_{}", name.to_lowercase()), n);
    }
    let unused: Vec<&str> = frames.warnings.iter().filter_map(|w| w.field.as_deref()).collect();
    if !unused.is_empty() {
        out.line("columns not used", unused.join(", "));
    }
    out.key("columns_not_used", json!(unused));
    Ok(out)
}

fn truth(file: &Path) -> Result<Facts, Stop> {
    let rows = hzn_files::truth::load(file).map_err(usage)?;
    let mut bodies = BTreeMap::<&str, [usize; 2]>::new();
    for row in &rows {
        let [seen, all] = bodies.entry(&row.body).or_default();
        *seen += usize::from(row.has_limb());
        *all += 1;
    }
    let mut out = Facts::new("truth", "truth of pictures, for `hzn evaluate RESULTS --truth FILE`");
    let mut each = Vec::new();
    for (body, [seen, all]) in bodies {
        out.line(&one_line(body), format!("limb in view in {seen} of {all} pictures"));
        each.push(json!({"name": body, "pictures": all, "with_limb": seen}));
    }
    out.key("bodies", each);
    Ok(out)
}

/// Describes a table of measurements over time, from the instruments of `hzn simulate` or from another program.
fn series(file: &Path, header: &csv::StringRecord) -> Result<Facts, Stop> {
    let has = |name: &str| header.iter().position(|column| column == name);
    let (kind, words) = match () {
        () if has("gyro_x_radps").is_some() => ("imu", "imu.csv, rates and accelerations of a simulated vehicle"),
        () if has("x_m").is_some() && has("vx_mps").is_some() && has("qw").is_none() => {
            ("gnss", "gnss.csv, fixes of a simulated satellite receiver")
        }
        () => ("table", "table that hzn does not know (results, frames.csv, truth.csv, imu.csv, gnss.csv)"),
    };
    let (words, command) = match kind_of_file::of_columns(header).filter(|_| kind == "table") {
        Some((what, command)) => (what, Some(command)),
        None => (words, None),
    };
    let mut out = Facts::new(kind, words);
    command.into_iter().for_each(|command| out.line("for", command.to_owned()));
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
    out.fact("rows", rows.to_string(), "rows", rows);
    if let Some((a, b)) = span {
        out.time(a, b);
    }
    if has("saturated").is_some() {
        out.fact("saturated", saturated.to_string(), "saturated", saturated);
    }
    let columns: Vec<&str> = header.iter().collect();
    out.fact("columns", columns.join(", "), "columns", columns.clone());
    Ok(out)
}

/// Returns the calibration for a program: the keys of `[camera]`, and the bodies.
fn camera_json(config: &Config) -> Result<Value, Stop> {
    serde_json::to_value(&config.camera).map_err(failed)
}

/// Describes a calibration.
fn calibration(mut out: Facts, config: &Config) -> Result<Facts, Stop> {
    out.text_block(&super::camera::describe(config)?);
    out.key("camera", camera_json(config)?);
    let body = |body: &hzn_core::body::Config| json!({"kind": body.kind.name(), "altitude_km": body.altitude_km});
    out.key("bodies", config.each_body().iter().map(body).collect::<Vec<_>>());
    Ok(out)
}

fn sensor(file: &Path, kind: &str) -> Result<Facts, Stop> {
    if kind != "toml" {
        let (camera, warnings) = hzn_files::camera_file::load_any(file, Default::default())?.exact(file)?;
        warnings.iter().for_each(tell::warning);
        return calibration(Facts::new("camera", "camera file"), &Config::new(camera));
    }
    let text = hzn_files::limited::read_text(file, hzn_files::limited::SETTINGS_BYTES)
        .map_err(|e| failed(format!("{}: cannot be read: {e}", file.display())))?;
    // The function that reads the text below reports its errors.
    let table = text.parse::<toml::Table>().unwrap_or_default();
    if table.contains_key("trajectory") && table.contains_key("capture") {
        return scene::describe(&text, file);
    }
    if table.contains_key("head") {
        return Ok(other::rig(&hzn_files::rig::parse(&text, file)?));
    }
    if let Some(facts) = other::settings(&table, file)? {
        return Ok(facts);
    }
    let sensor = hzn_files::sensor::load(file)?;
    sensor.warnings.iter().for_each(tell::warning);
    let mut out = Facts::new("sensor", "sensor.toml");
    if let Some(hash) = provenance::hash(&sensor.config) {
        out.fact("hash", format!("{hash} (overlays and reports name it)"), "hash", hash);
    }
    calibration(out, &sensor.config)
}

fn one_picture(file: &Path) -> Result<Facts, Stop> {
    let named = |why: String| failed(format!("{}: {why}", file.display()));
    let bytes = decode::read_file(file).map_err(named)?;
    let p = decode::decode(&bytes, None).map_err(named)?;
    let format = decode::guess_format(&bytes).map(|f| format!("{f:?}").to_uppercase()).unwrap_or_default();
    let l = p.layout;
    let what = format!(
        "{format} picture of {} x {} px, {} of {} bits",
        l.width,
        l.height,
        explain::counted(l.channels.into(), "channel"),
        l.bits
    );
    let mut out = Facts::new("picture", &what);
    out.key("format", format);
    out.key("width_px", l.width);
    out.key("height_px", l.height);
    out.key("channels", l.channels);
    out.key("bits", l.bits);
    out.key("pictures", p.pages);
    if p.pages > 1 {
        out.line("pictures", format!("{}; hzn processes only the first", p.pages));
    }
    if let Some(how) = p.display_turn() {
        out.fact("to be shown", format!("{how}; input.orient decides whether hzn turns it"), "to_be_shown", how);
    }
    if let Some(t) = p.exif_time_s {
        out.fact("EXIF time", format!("{t:.3} s since 1970, assumed to be UTC"), "exif_time_s", t);
    }
    Ok(out)
}
