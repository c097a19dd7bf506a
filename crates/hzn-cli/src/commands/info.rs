//! `hzn info`: what is in a file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hzn_core::status::Status;
use hzn_mcap::{Contents, Reader, Row};

use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::input::{self, ending, picture};
use crate::tell;

/// Summarise a file: results (.mcap, .csv, .jsonl), a sensor.toml, a frames.csv, a truth.csv, a picture
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The file
    file: PathBuf,
}

pub(super) fn run(args: &Args) -> Outcome {
    let file = &args.file;
    let (kind, _) = input::existing(file)?;
    let text = match kind.as_str() {
        "mcap" => recording(file)?,
        "csv" | "jsonl" => table(file, &kind)?,
        "toml" | "yaml" | "yml" => sensor(file, &kind)?,
        _ => one_picture(file)?,
    };
    tell::result(text)?;
    Ok(Exit::Done)
}

fn recording(file: &Path) -> Result<String, Stop> {
    let mut reader = Reader::open(file, Contents::WithoutImages).map_err(failed)?;
    let mut summary = Summary::default();
    for frame in reader.by_ref() {
        summary.add(&frame.map_err(failed)?.row);
    }
    if summary.frames == 0 && reader.sensor_toml().is_none() {
        return foreign(file);
    }
    let mut out = summary.text();
    for (key, value) in reader.metadata() {
        out.push_str(&format!("{key:<16} {value}\n"));
    }
    if !reader.is_complete() {
        out.push_str(&unfinished(file));
    }
    if reader.broken_chunks() > 0 {
        out.push_str(&format!("damaged parts    {}\n", reader.broken_chunks()));
    }
    if let Some(Ok(sensor)) = reader.sensor_toml().map(|t| hzn_calib::sensor::parse(t, Path::new("sensor.toml"))) {
        let c = sensor.config.camera;
        out.push_str(&format!("camera           {} x {} px, {}\n", c.width, c.height, c.model.name()));
    }
    Ok(out)
}

fn unfinished(file: &Path) -> String {
    format!("unfinished       `hzn run --resume` continues it, `hzn recover {}` closes it\n", file.display())
}

/// A recording of another program: its pictures.
fn foreign(file: &Path) -> Result<String, Stop> {
    let mut reader = hzn_mcap::ImageReader::open(file, None).map_err(failed)?;
    let (mut count, mut span) = (0u64, None::<(f64, f64)>);
    for image in reader.by_ref() {
        let t = image.map_err(failed)?.time_s;
        count += 1;
        span = Some(span.map_or((t, t), |(a, b)| (a.min(t), b.max(t))));
    }
    let mut out = format!("no results of hzn in this recording\npictures         {count}\n");
    if let (Some(topic), Some((a, b))) = (reader.topic(), span) {
        out.push_str(&format!("topic            {topic}\ntime             {a:.3} to {b:.3} s\n"));
    }
    for topic in reader.other_topics() {
        out.push_str(&format!("other topic      {topic}\n"));
    }
    Ok(out)
}

fn table(file: &Path, kind: &str) -> Result<String, Stop> {
    let mut summary = Summary::default();
    if kind == "csv" {
        let header = csv::Reader::from_path(file).and_then(|mut r| r.headers().cloned()).map_err(failed)?;
        if header.iter().any(|column| column == "limb") {
            return truth(file);
        }
        if !header.iter().eq(Row::COLUMNS) {
            let frames = hzn_calib::frames::load(file)?;
            let with = |has: fn(&hzn_calib::FrameData) -> bool| frames.rows.iter().filter(|r| has(r)).count();
            let mut out = format!("pictures         {}\n", frames.rows.len());
            for (name, n) in [
                ("time", with(|r| r.time_s.is_some())),
                ("UTC", with(|r| r.utc_s.is_some())),
                ("altitude", with(|r| r.altitude_km.is_some())),
                ("position", with(|r| r.position_km.is_some())),
                ("attitude", with(|r| r.camera_to_ecef_wxyz.is_some())),
                ("Sun", with(|r| r.sun_camera.is_some())),
            ] {
                out.push_str(&format!("{:<16} {n}\n", format!("with {name}")));
            }
            let unused: Vec<&str> = frames.warnings.iter().filter_map(|w| w.field.as_deref()).collect();
            if !unused.is_empty() {
                out.push_str(&format!("columns not used {}\n", unused.join(", ")));
            }
            return Ok(out);
        }
    }
    for row in super::export::rows(file, kind)? {
        summary.add(&row?);
    }
    let mut out = summary.text();
    if ending(file) == "part" {
        out.push_str(&unfinished(file));
    }
    Ok(out)
}

fn truth(file: &Path) -> Result<String, Stop> {
    let rows = hzn_sim::truth::load(file).map_err(usage)?;
    let mut bodies = BTreeMap::<&str, [usize; 2]>::new();
    for row in &rows {
        let [seen, all] = bodies.entry(&row.body).or_default();
        *seen += usize::from(row.has_limb());
        *all += 1;
    }
    let mut out = "truth, for        hzn evaluate RESULTS --truth FILE\n".to_owned();
    for (body, [seen, all]) in bodies {
        out.push_str(&format!("{body:<16} limb in view in {seen} of {all} pictures\n"));
    }
    Ok(out)
}

fn sensor(file: &Path, kind: &str) -> Result<String, Stop> {
    if kind != "toml" {
        return super::camera::describe(&hzn_core::Config::new(hzn_calib::camera_file::load(file, None)?));
    }
    super::camera::describe(&hzn_calib::sensor::load(file)?.config)
}

fn one_picture(file: &Path) -> Result<String, Stop> {
    let named = |why: String| failed(format!("{}: {why}", file.display()));
    let bytes = picture::read_file(file).map_err(named)?;
    let p = picture::decode(&bytes, None).map_err(named)?;
    let format = picture::format_of(&bytes).map(|f| format!("{f:?}").to_uppercase()).unwrap_or_default();
    let l = p.layout;
    let mut out =
        format!("{format} picture of {} x {} px, {} channel(s) of {} bits\n", l.width, l.height, l.channels, l.bits);
    if let Some(t) = p.exif_time_s {
        out.push_str(&format!("EXIF time        {t:.3} s since 1970, taken as UTC\n"));
    }
    Ok(out)
}

/// Statistics of rows, with memory for four numbers a row.
#[derive(Debug, Default)]
struct Summary {
    frames: u64,
    /// Number of the frame of the last row: one of several bodies has a row a body.
    last: Option<u64>,
    time: Option<(f64, f64)>,
    /// By name, in the order in which they come.
    bodies: Vec<(String, Found)>,
}

/// How one body was found.
#[derive(Debug, Default)]
struct Found {
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
            self.bodies.push((row.body.clone(), Found::default()));
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
        let mut out = format!("frames           {}\n", self.frames);
        let mut line = |name: &str, value: String| out.push_str(&format!("{name:<16} {value}\n"));
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
                    line(name, format!("{middle} {unit} in the middle, {low} to {high} for 90 %"));
                }
            }
        }
        out
    }
}

/// A number as three digits show it, whole from 100 on: what statistics over frames can claim.
fn three_digits(x: f64) -> String {
    let before = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    format!("{x:.*}", (2 - before).clamp(0, 9) as usize)
}

fn percentiles(mut values: Vec<f64>) -> Option<[f64; 3]> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some([0.05, 0.5, 0.95].map(|p| values[(p * last as f64).round() as usize]))
}
