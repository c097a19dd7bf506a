//! `hzn demo`: processes a rendered flight with known truth, and a real photograph, from beginning to end.

use std::path::{Path, PathBuf};
use std::time::Instant;

use hzn_evaluate::{Answer, Evaluation, pair};
use hzn_files::truth::Truth;
use hzn_mcap::{Contents, Reader, Row};
use hzn_run::overlay::caption::Caption;
use hzn_run::{disk, explain, overlay, sink};
use hzn_sim::Flight;

use super::{evaluate, run as sequence};
use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::origin::Origin;
use crate::rendered;
use crate::tell::{self, one_line};

const ISS_PICTURE: &[u8] = include_bytes!("../../assets/iss-limb-2020-11-20.jpg");
const ISS_SENSOR: &str = include_str!("../../assets/iss.toml");
const ISS_CREDITS: &str = include_str!("../../assets/CREDITS.md");

/// Render a rocket flight, find its limb, compare with the truth; then find the limb in a real photograph
///
/// All files stay in the folder: pictures, sensor.toml, frames.csv and truth.csv of the flight, the results as MCAP
/// (for Foxglove) and CSV, and pictures with overlay. Use the folder as a pattern for your own data.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The folder to create
    #[arg(default_value = "hzn-demo")]
    folder: PathBuf,
    /// Write into a folder that exists
    #[arg(long)]
    force: bool,
    /// Number of rendered pictures
    #[arg(long, value_name = "N", default_value_t = 40)]
    count: u16,
}

pub(super) fn run(args: &Args) -> Outcome {
    let folder = &args.folder;
    if folder.exists() && !args.force {
        let what = "exists already; choose another folder, or --force writes into it";
        return Err(usage(format!("{}: {what}", folder.display())));
    }
    if args.count == 0 {
        return Err(usage("--count: must be 1 or more"));
    }
    let begin = Instant::now();
    let places = Places::new(folder);
    rendered::clear(&places.flight)?;
    for dir in [&places.flight, &places.iss] {
        std::fs::create_dir_all(dir).map_err(|e| disk::cannot_write(dir, &e))?;
    }
    tell::line(format_args!("rendering {} of a rocket flight ...", explain::counted(args.count.into(), "picture")));
    let flight = hzn_sim::flight::rocket(1280, 720, usize::from(args.count), 1);
    let truth = write_flight(&flight, &places.flight)?;
    tell::line(format_args!("looking for the limb ..."));
    let rows = process_flight(&places)?;
    let iss = process_photograph(&places)?;
    disk::write(&places.layout, hzn_mcap::LAYOUT)?;
    std::fs::create_dir_all(&places.overlays).map_err(|e| disk::cannot_write(&places.overlays, &e))?;
    let drawn = draw(&places.flight_mcap, &places.overlays, 5)? + draw(&places.iss_mcap, &places.overlays, 1)?;

    let mut out = format!("{}\n{}\n", flight_text(&rows, &truth)?, iss_text(iss.first()));
    out.push_str(&format!("Files, after {:.1} s:\n", begin.elapsed().as_secs_f64()));
    out.push_str(&places.text(drawn));
    tell::result(out)?;
    Ok(Exit::Done)
}

/// The files and folders of the demo.
struct Places {
    flight: PathBuf,
    flight_mcap: PathBuf,
    flight_csv: PathBuf,
    iss: PathBuf,
    iss_mcap: PathBuf,
    layout: PathBuf,
    overlays: PathBuf,
}

impl Places {
    fn new(folder: &Path) -> Self {
        Self {
            flight: folder.join("flight"),
            flight_mcap: folder.join("flight.mcap"),
            flight_csv: folder.join("flight.csv"),
            iss: folder.join("iss"),
            iss_mcap: folder.join("iss.mcap"),
            layout: folder.join("foxglove-layout.json"),
            overlays: folder.join("overlay"),
        }
    }

    /// Returns the list of the files, and the commands to try next. `drawn` is the number of overlays.
    fn text(&self, drawn: usize) -> String {
        let place = |p: &Path| one_line(p.display());
        let files = [
            (place(&self.flight), "rendered pictures with sensor.toml, frames.csv (positions) and truth.csv"),
            (place(&self.flight_mcap), "results with pictures, for Foxglove"),
            (place(&self.flight_csv), "the same results as a table"),
            (place(&self.iss), "a photograph from the ISS with its sensor.toml"),
            (place(&self.iss_mcap), "its result"),
            (place(&self.layout), "panels for these results, to be imported in Foxglove"),
            (place(&self.overlays), &format!("{drawn} pictures with everything drawn over them")),
        ];
        let mut out = String::new();
        let wide = files.iter().map(|(name, _)| name.len()).max().unwrap_or_default();
        for (name, what) in files {
            out.push_str(&format!("  {name:<wide$}  {what}\n"));
        }
        let picture = place(&self.iss.join("iss-limb-2020-11-20.jpg"));
        out.push_str(&format!("\nNext:  hzn explain {picture} --overlay out.png\n"));
        out.push_str(&format!("       hzn run {} -o mine.csv\n", place(&self.flight)));
        let truth = place(&self.flight.join("truth.csv"));
        out.push_str(&format!("       hzn evaluate {} --truth {truth} -o report.html\n", place(&self.flight_mcap)));
        out
    }
}

/// Processes the rendered flight. Writes its results as MCAP and as CSV, and returns them.
fn process_flight(places: &Places) -> Result<Vec<Row>, Stop> {
    process(&places.flight, &places.flight_mcap)?;
    let rows = read_rows(&places.flight_mcap)?;
    let mut table = sink::RowFile::create(&places.flight_csv, sink::Existing::Replace)?;
    for row in &rows {
        table.write(row)?;
    }
    table.finish()?;
    Ok(rows)
}

/// Writes the photograph with its sensor, processes it, and returns its result.
fn process_photograph(places: &Places) -> Result<Vec<Row>, Stop> {
    let write = |name: &str, bytes: &[u8]| disk::write(&places.iss.join(name), bytes);
    write("iss-limb-2020-11-20.jpg", ISS_PICTURE)?;
    write("sensor.toml", ISS_SENSOR.as_bytes())?;
    write("CREDITS.md", ISS_CREDITS.as_bytes())?;
    process(&places.iss, &places.iss_mcap)?;
    read_rows(&places.iss_mcap)
}

/// Writes pictures, sensor.toml, frames.csv and truth.csv of the flight. Returns the truth.
fn write_flight(flight: &Flight, folder: &Path) -> Result<Vec<Truth>, Stop> {
    let config = hzn_files::sensor::to_text(&flight.sensor).map_err(failed)?;
    let text = format!("# The camera of a rendered rocket flight.\npreset = \"hzn\"\n\n{config}");
    disk::write(&folder.join("sensor.toml"), text)?;

    // The pictures are rendered one after the other, because each already uses all cores.
    for frame in &flight.frames {
        let path = folder.join(&frame.file);
        disk::write(&path, frame.render().map_err(failed)?.encode(&path).map_err(failed)?)?;
    }
    let mut known = String::from("file,time_s,x_km,y_km,z_km\n");
    for frame in &flight.frames {
        let [x, y, z] = frame.prior().position_m.unwrap_or_default().map(|m| m / 1e3);
        known.push_str(&format!("{},{},{x},{y},{z}\n", frame.file, frame.time_s));
    }
    disk::write(&folder.join("frames.csv"), known)?;

    let truth: Vec<Truth> = flight.frames.iter().map(|f| f.truth()).collect::<Result<_, _>>().map_err(failed)?;
    let path = folder.join("truth.csv");
    let written = |e: csv::Error| match e.into_kind() {
        csv::ErrorKind::Io(e) => disk::cannot_write(&path, &e).into(),
        other => failed(format!("{}: {other:?}", path.display())),
    };
    let mut table = csv::Writer::from_writer(disk::Checked::create(&path).map_err(|e| disk::cannot_write(&path, &e))?);
    for row in &truth {
        table.serialize(row).map_err(written)?;
    }
    table.flush().map_err(|e| disk::cannot_write(&path, &e))?;
    Ok(truth)
}

fn process(folder: &Path, out: &Path) -> Result<(), Stop> {
    match sequence::run(sequence::Args::quiet_run(folder, out))? {
        Exit::Done => Ok(()),
        Exit::Interrupted => Err(failed(format!("{}: interrupted", folder.display()))),
        _ => Err(failed(format!(
            "{}: some pictures could not be processed; `hzn run` on this folder says why",
            folder.display()
        ))),
    }
}

fn read_rows(path: &Path) -> Result<Vec<Row>, Stop> {
    let reader = Reader::open(path, Contents::WithoutImages).map_err(failed)?;
    reader.map(|frame| frame.map(|f| f.row)).collect::<Result<_, _>>().map_err(failed)
}

/// Draws `count` pictures of a recording, evenly spread. Returns how many were drawn.
fn draw(recording: &Path, folder: &Path, count: usize) -> Result<usize, Stop> {
    let total = read_rows(recording)?.len();
    let mut drawn = 0;
    let mut reader = Reader::open(recording, Contents::All).map_err(failed)?;
    let mut origin = Origin::default();
    for i in 0.. {
        let Some(frame) = reader.next().transpose().map_err(failed)? else { break };
        // The n-th of `count` pictures is the first of its share.
        if drawn >= count || (i * count) / total.max(1) < drawn {
            continue;
        }
        let Some(image) = frame.image else { continue };
        let (picture, _) = hzn_run::source::Payload::from_recorded(image).decode(None).map_err(failed)?;
        let rows = std::slice::from_ref(&frame.row);
        let caption = Caption::new(&frame.row.file, frame.row.time_s, rows, &frame.annotations);
        let caption = caption.with_provenance(origin.of(&reader, None));
        let image = overlay::draw(picture.to_rgb(), &frame.annotations, &[], &caption);
        overlay::save(&image, &folder.join(overlay::file_name(&frame.row.file)))?;
        drawn += 1;
    }
    Ok(drawn)
}

/// Compares the results with the truth, in words and numbers.
fn flight_text(rows: &[Row], truth: &[Truth]) -> Result<String, Stop> {
    let answers: Vec<_> = rows.iter().map(Answer::from).collect();
    let cases = pair(&answers, truth, None).map_err(failed)?;
    let mut out = String::from("Rendered rocket flight, against the truth\n");
    let mut line = |name: &str, value: String| out.push_str(&format!("  {name:<22} {value}\n"));
    for evaluation in Evaluation::by_body(&cases) {
        evaluate::text::lines(&evaluation).into_iter().for_each(|(name, value)| line(name, value));
    }
    let mut microseconds: Vec<f64> = rows.iter().filter_map(|r| r.elapsed_us).collect();
    microseconds.sort_by(f64::total_cmp);
    if let Some(middle) = microseconds.get(microseconds.len() / 2) {
        line("processing", format!("{middle:.0} us a picture (median), without decoding"));
    }
    Ok(out)
}

fn iss_text(row: Option<&Row>) -> String {
    let mut out = String::from("Photograph from the ISS, 20 November 2020 (NASA Johnson Space Center)\n");
    let mut line = |name: &str, value: String| out.push_str(&format!("  {name:<22} {value}\n"));
    let Some(row) = row else { return out };
    match (row.axis(), row.sigma_max_deg) {
        (Some([x, y, z]), Some(sigma)) => {
            line("axis in the camera", format!("{x:.5}, {y:.5}, {z:.5}; sigma {sigma:.4} deg"));
            let found = (row.inliers.unwrap_or(0), row.edge_points.unwrap_or(0), row.rms_px.unwrap_or(0.0));
            line("fit", format!("{} of {} edge points, rms {:.2} px", found.0, found.1, found.2));
            if let (Some(h), Some(s)) = (row.altitude_est_km, row.altitude_est_sigma_km) {
                let flown = row.altitude_km.unwrap_or(0.0);
                line("altitude from the limb", format!("{h:.0} +- {s:.0} km (the station was at about {flown} km)"));
            }
        }
        _ => line("status", format!("{}: {}", row.status.name(), row.detail)),
    }
    out
}
