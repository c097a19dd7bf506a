//! `hzn simulate`: renders pictures of a scene, with truth.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use hzn_core::status::Status;
use hzn_run::{disk, explain};
use hzn_sim::scenario::{self, BUILTIN, FIT_PICTURES, Fit};
use hzn_sim::{Flight, FlightFrame, Scenario};
use rayon::prelude::*;

use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::progress::Progress;
use crate::refusals::quoted_path;
use crate::rendered;
use crate::setup::stop_flag;
use crate::tell::{self, one_line};

/// Render a sequence of pictures with truth, and write a sensor.toml that fits it
///
/// Writes pictures, frames.csv (the prior of each picture), truth.csv, scene.toml and sensor.toml, and imu.csv and
/// gnss.csv if the scene has these instruments; vehicle.csv then has the true state of the vehicle. A scene with
/// several cameras has a folder for each of them; if they are a rig, rig.toml, frames.csv and truth.csv of the vehicle
/// are next to the folders. The limb height and noise model in sensor.toml are measured on other pictures of the scene;
/// for a planet or moon (`[world.ellipsoid]`) the limb height is the scene's own.
///
/// Built-in scenes: rocket, rocket-clean, leo-infrared, thermal-array, horace, horace-wide, full-disc, sun-moon,
/// tumble, atek, ring, pair, jupiter, enceladus, saturn, geo. `hzn simulate SCENE --show` prints one; change it and
/// give it as a file.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A built-in scene, or a scene.toml
    #[arg(value_name = "SCENE")]
    scene: Option<String>,
    /// The folder to create
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Number of pictures; replaces the scene's number
    #[arg(long, value_name = "N")]
    frames: Option<u32>,
    /// Seed of all random numbers; replaces the scene's seed
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Write into a folder that exists
    #[arg(long)]
    force: bool,
    /// Render only the pictures that are missing in the folder
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Do not measure limb height and noise, which takes 32 more pictures; sensor.toml has the defaults
    #[arg(long)]
    no_noise: bool,
    /// Print no progress on stderr
    #[arg(short, long)]
    quiet: bool,
    /// Print the scene.toml and do nothing else
    #[arg(long)]
    show: bool,
    /// List the built-in scenes
    #[arg(long)]
    list: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    if args.list {
        for (name, what, _) in BUILTIN {
            tell::result(format_args!("{name:<14} {what}\n"))?;
        }
        return Ok(Exit::Done);
    }
    let Some(name) = args.scene.as_deref() else {
        let what = "name a scene and a folder for its pictures, for example:  hzn simulate rocket -o flight";
        return Err(usage(format!("{what}  (`hzn simulate --list` describes the scenes)")));
    };
    if args.show {
        tell::file(format_args!("{}\n", scenario::source(name)?.1.trim_end()))?;
        return Ok(Exit::Done);
    }
    let Some(folder) = args.output.clone() else {
        let scene = quoted_path(Path::new(name));
        return Err(usage(format!("name a folder for the pictures with -o:  hzn simulate {scene} -o flight")));
    };
    let mut scenario = scenario::load(name, args.frames, args.seed)?;
    let from = Path::new(name).parent().unwrap_or(Path::new(""));
    let mut read = hzn_files::files_of_sensor(Path::new(name));
    read.extend(scenario.files_mut().into_iter().map(|(_, file)| from.join(file)));
    let files = files(&mut scenario, from)?;
    let text = scenario.to_text().map_err(failed)?;
    check_folder(args, &folder, &text, &files)?;
    // All errors of the scene are reported before anything is written.
    let mut cameras = Vec::new();
    for one in scenario.by_camera() {
        let flight = one.flight().map_err(|e| scenario::refused(name, &e))?;
        let folder = if scenario.cameras.is_empty() { folder.clone() } else { folder.join(&one.name) };
        cameras.push(Sequence { scenario: one, flight, folder });
    }
    disk::refuse_inputs(&read, &written(args, &folder, &cameras, &files))?;
    std::fs::create_dir_all(&folder).map_err(|e| disk::cannot_write(&folder, &e))?;
    write(&folder.join("scene.toml"), &text)?;
    for folder in cameras.iter().map(|one| &one.folder).chain([&folder]) {
        std::fs::create_dir_all(folder).map_err(|e| disk::cannot_write(folder, &e))?;
        files.iter().try_for_each(|(file, bytes)| write(&folder.join(file), bytes))?;
    }
    instruments(&scenario, &folder)?;
    let sensors_exist = cameras.iter().all(|one| one.folder.join("sensor.toml").exists());
    if !(args.resume && sensors_exist) {
        sensors(&cameras, name, args)?;
    }
    rig(&scenario, &cameras, &folder)?;
    let stop = stop_flag();
    for one in &cameras {
        if !args.resume {
            rendered::clear(&one.folder)?;
        }
        one.tables()?;
        if one.pictures(args, &stop)? == Exit::Interrupted {
            return Ok(Exit::Interrupted);
        }
    }
    cameras.iter().try_for_each(Sequence::summary)?;
    next(&cameras, scenario.rig.map(|_| folder.as_path()))?;
    Ok(Exit::Done)
}

/// Returns every file that is written or removed.
fn written(args: &Args, folder: &Path, cameras: &[Sequence], files: &[(String, Vec<u8>)]) -> Vec<PathBuf> {
    let copies = || ["scene.toml"].into_iter().chain(files.iter().map(|(name, _)| name.as_str()));
    let of_vehicle = ["imu.csv", "gnss.csv", "vehicle.csv", "rig.toml", "frames.csv", "truth.csv"];
    let mut all: Vec<PathBuf> = of_vehicle.map(|name| folder.join(name)).into();
    for one in cameras.iter().map(|one| &one.folder).map(PathBuf::as_path).chain([folder]) {
        // To resume, these must be the files of the scene already.
        if !(args.resume && one == folder) {
            all.extend(copies().map(|name| one.join(name)));
        }
    }
    for Sequence { flight, folder, .. } in cameras {
        all.extend(["sensor.toml", "frames.csv", "truth.csv"].map(|name| folder.join(name)));
        let pictures = flight.frames.iter().flat_map(|frame| [frame.file.clone(), part_name(&frame.file)]);
        all.extend(pictures.map(|name| folder.join(name)).chain(rendered::pictures(folder)));
    }
    all
}

/// Refuses a folder that exists without `--resume` or `--force`, and a resumed one of another scene.
fn check_folder(args: &Args, folder: &Path, text: &str, files: &[(String, Vec<u8>)]) -> Result<(), Stop> {
    let scene_toml = folder.join("scene.toml");
    if args.resume {
        match hzn_files::limited::read_text(&scene_toml, hzn_files::limited::SETTINGS_BYTES) {
            Ok(before) if before == text => {}
            Ok(_) => {
                let what = "is another scene, or another number of pictures or seed; --force starts over";
                return Err(usage(format!("{}: {what}", scene_toml.display())));
            }
            Err(e) => return Err(usage(format!("{}: {e}; nothing to resume", scene_toml.display()))),
        }
        let changed =
            |(file, bytes): &&(String, Vec<u8>)| std::fs::read(folder.join(file)).ok().as_ref() != Some(bytes);
        if let Some((file, _)) = files.iter().find(changed) {
            let what = "differs from the file that the scene names; --force starts over";
            return Err(usage(format!("{}: {what}", folder.join(file).display())));
        }
    } else if folder.exists() && !args.force {
        let what = "exists already; choose another folder, --resume continues it, or --force writes into it";
        return Err(usage(format!("{}: {what}", folder.display())));
    }
    Ok(())
}

/// The pictures of one camera.
struct Sequence {
    scenario: Scenario,
    flight: Flight,
    folder: PathBuf,
}

/// Returns the files that a scene names (maps, tables), with their names in the folder. The scene is changed to these
/// names.
fn files(scenario: &mut Scenario, from: &Path) -> Result<Vec<(String, Vec<u8>)>, Stop> {
    let take = |(what, path): (&str, &mut PathBuf)| {
        let source = from.join(&*path);
        let bytes = std::fs::read(&source).map_err(|e| disk::cannot_write(&source, &e))?;
        let ending = path.extension().unwrap_or_default().to_string_lossy().into_owned();
        let name = format!("scene-{what}.{ending}");
        *path = PathBuf::from(&name);
        Ok((name, bytes))
    };
    scenario.files_mut().into_iter().map(take).collect()
}

fn write(path: &Path, text: impl AsRef<[u8]>) -> Result<(), Stop> {
    Ok(disk::write(path, text)?)
}

/// Writes the sensor.toml of every camera. All have the same lens and world, so that the noise is measured once.
fn sensors(cameras: &[Sequence], name: &str, args: &Args) -> Result<(), Stop> {
    let Some(first) = cameras.first() else { return Ok(()) };
    if first.scenario.ellipsoid().is_some() || args.no_noise {
        return cameras
            .iter()
            .try_for_each(|one| write(&one.folder.join("sensor.toml"), sensor(&one.scenario, &one.flight, None)?));
    }
    if !args.quiet {
        tell::line(format_args!("measuring limb height and noise on other pictures of the scene ..."));
    }
    let progress = Mutex::new(Progress::new(Some(FIT_PICTURES.into()), 0, args.quiet));
    let seen = |_: usize, _: usize| progress.lock().map(|mut p| p.count([Status::Ok])).unwrap_or(());
    let fits = Fit::measure(&first.scenario, FIT_PICTURES, &seen).map_err(|e| scenario::refused(name, &e))?;
    if let Ok(p) = progress.into_inner() {
        p.finish();
    }
    for one in cameras {
        write(&one.folder.join("sensor.toml"), &sensor(&one.scenario, &one.flight, Some(&fits))?)?;
    }
    Ok(())
}

/// Returns the text of a sensor.toml: the values that differ from the defaults, with the noise model if it is measured.
fn sensor(scenario: &Scenario, flight: &Flight, fits: Option<&[Fit]>) -> Result<String, Stop> {
    let mut sensor = flight.sensor.clone();
    let mut how = String::new();
    if scenario.ellipsoid().is_some() {
        how += "# The limb height is that of the scene; the noise comes from the residuals of each picture.\n";
    } else if fits.is_none() {
        how += "# Limb height and noise are the defaults; without --no-noise they are measured on other pictures.\n";
    }
    for &body in scenario.bodies.iter().filter(|_| scenario.ellipsoid().is_none()) {
        let Some(fits) = fits else { continue };
        let name = body.name();
        let Some(fit) = fits.iter().find(|fit| fit.body == body) else {
            let why = "too few pictures were answered to measure limb height and noise";
            how += &format!("# The {name}: {why}: these are the defaults.\n");
            continue;
        };
        fit.apply(&mut sensor);
        let [answered, rendered] = fit.frames;
        how += &format!(
            "# The {name}: limb height and noise model are measured on {rendered} other pictures of the scene, \
             {answered} of them\n\
             # answered; squared errors there are {:.2} times their covariance on average (2 is ideal).\n",
            fit.nees
        );
    }
    let mut table = hzn_files::sensor::to_table(&sensor).map_err(failed)?;
    let defaults = hzn_files::sensor::to_table(&hzn_core::Config::new(sensor.camera.clone()));
    let defaults = defaults.map_err(failed)?;
    if let Some(body) = scenario.body_table() {
        table.insert("body".into(), body.into());
    }
    let several = table.get("bodies").is_some();
    for key in defaults.keys() {
        // The camera is always written, and so is a single body.
        if key == "camera" || (key == "body" && !several) {
            continue;
        }
        let same = match (table.get_mut(key), defaults.get(key)) {
            (Some(toml::Value::Table(own)), Some(toml::Value::Table(default))) => {
                own.retain(|k, v| default.get(k) != Some(v));
                own.is_empty()
            }
            (own, default) => own.as_deref() == default,
        };
        if same || (key == "body" && several) {
            table.remove(key);
        }
    }
    Ok(format!("# The sensor of the simulated scene {}.\n{how}preset = \"hzn\"\n\n{table}", scenario.name))
}

/// Writes rig.toml, and frames.csv and truth.csv of the vehicle, if the cameras are a rig.
fn rig(scenario: &Scenario, cameras: &[Sequence], folder: &Path) -> Result<(), Stop> {
    let Some(rig) = scenario.rig_file() else { return Ok(()) };
    let text =
        format!("# The rig of the simulated scene {}.\n{}", scenario.name, toml::to_string(&rig).map_err(failed)?);
    write(&folder.join("rig.toml"), text)?;
    let flights: Vec<Flight> = cameras.iter().map(|one| one.flight.clone()).collect();
    let (known, truth) = scenario.vehicle_tables(&flights).map_err(failed)?;
    let mut rows = table(folder, "frames.csv")?;
    known.iter().try_for_each(|row| rows.serialize(row)).map_err(failed)?;
    rows.flush()?;
    let mut rows = table(folder, "truth.csv")?;
    truth.iter().try_for_each(|row| rows.serialize(row)).map_err(failed)?;
    Ok(rows.flush()?)
}

/// Makes a table in a folder.
fn table(folder: &Path, name: &str) -> Result<csv::Writer<disk::Checked>, Stop> {
    let path = folder.join(name);
    Ok(csv::Writer::from_writer(disk::Checked::create(&path).map_err(|e| disk::cannot_write(&path, &e))?))
}

/// Writes imu.csv, gnss.csv and vehicle.csv.
fn instruments(scenario: &Scenario, folder: &Path) -> Result<(), Stop> {
    let path = scenario.path().map_err(failed)?;
    let [from_s, to_s] = scenario.span_s();
    if let Some(imu) = &scenario.imu {
        let mut rows = table(folder, "imu.csv")?;
        imu.rows(&path, [from_s, to_s], scenario.seed).try_for_each(|row| rows.serialize(row)).map_err(failed)?;
        rows.flush()?;
        let mut rows = table(folder, "vehicle.csv")?;
        let span_s = [imu.from_s.unwrap_or(from_s), to_s];
        path.vehicle_rows(span_s, imu.rate_hz).try_for_each(|row| rows.serialize(row)).map_err(failed)?;
        rows.flush()?;
    }
    if let Some(gnss) = &scenario.gnss {
        let mut rows = table(folder, "gnss.csv")?;
        gnss.rows(&path, [from_s, to_s], scenario.seed).try_for_each(|row| rows.serialize(row)).map_err(failed)?;
        rows.flush()?;
    }
    Ok(())
}

impl Sequence {
    /// Writes scene.toml, frames.csv and truth.csv.
    fn tables(&self) -> Result<(), Stop> {
        let Self { scenario, flight, folder } = self;
        write(&folder.join("scene.toml"), &scenario.to_text().map_err(failed)?)?;
        let mut known = table(folder, "frames.csv")?;
        let mut truth = table(folder, "truth.csv")?;
        for frame in &flight.frames {
            match scenario.body_frame_row(frame) {
                Some(row) => known.serialize(row),
                None => known.serialize(scenario.frame_row(frame)),
            }
            .map_err(failed)?;
            for &kind in &scenario.bodies {
                truth
                    .serialize(frame.scene.body_truth(kind, &frame.file, frame.time_s).map_err(failed)?)
                    .map_err(failed)?;
            }
        }
        known.flush()?;
        truth.flush()?;
        Ok(())
    }

    /// Renders the missing pictures.
    fn pictures(&self, args: &Args, stop: &AtomicBool) -> Outcome {
        let Self { flight, folder, .. } = self;
        let missing: Vec<&FlightFrame> =
            flight.frames.iter().filter(|f| !(args.resume && folder.join(&f.file).exists())).collect();
        let before = flight.frames.len() - missing.len();
        let total = flight.frames.len() as u64;
        let progress = Mutex::new(Progress::new(Some(total), before as u64, args.quiet));
        let done = AtomicUsize::new(before);
        missing.par_iter().try_for_each(|frame| {
            if stop.load(Ordering::SeqCst) {
                return Ok(());
            }
            render(frame, folder)?;
            done.fetch_add(1, Ordering::SeqCst);
            progress.lock().map(|mut p| p.count([Status::Ok])).unwrap_or(());
            Ok::<(), Stop>(())
        })?;
        if let Ok(p) = progress.into_inner() {
            p.finish();
        }
        let done = done.into_inner();
        if done < flight.frames.len() {
            tell::line(format_args!("interrupted after {done} of {total} pictures; --resume continues"));
            return Ok(Exit::Interrupted);
        }
        Ok(Exit::Done)
    }

    /// Prints how many pictures show which body.
    fn summary(&self) -> Result<(), Stop> {
        let Self { scenario, flight, folder } = self;
        let pictures = explain::counted(flight.frames.len() as u64, "picture");
        let text = one_line(format_args!("{}: {pictures} of {}", folder.display(), scenario.name));
        tell::result(format_args!("{text}\n"))?;
        for &kind in &scenario.bodies {
            let mut seen = 0;
            let mut body = String::new();
            for frame in &flight.frames {
                let truth = frame.scene.body_truth(kind, &frame.file, frame.time_s).map_err(failed)?;
                seen += usize::from(truth.has_limb());
                body = truth.body;
            }
            tell::result(format_args!("  limb of the {body} in view in {seen}\n"))?;
        }
        Ok(())
    }
}

/// Prints the commands that come next; for a rig, those for its folder.
fn next(cameras: &[Sequence], rig: Option<&Path>) -> Result<(), Stop> {
    if let Some(folder) = rig {
        return next_of_rig(folder);
    }
    tell::result("\n")?;
    for (i, one) in cameras.iter().enumerate() {
        let shown = one_line(one.folder.display());
        let begin = if i == 0 { "Next:  " } else { "       " };
        tell::result(format_args!("{begin}hzn run {shown} -o {shown}.csv\n"))?;
    }
    Ok(())
}

/// Prints the commands that come next for a rig.
fn next_of_rig(folder: &Path) -> Result<(), Stop> {
    let shown = one_line(folder.display());
    tell::result(format_args!(
        "\nNext:  hzn run {shown}/rig.toml -o {shown}.csv\n       hzn evaluate {shown}.csv --truth {shown}\n"
    ))?;
    Ok(())
}

/// Returns the name of a picture until it is complete.
fn part_name(file: &str) -> String {
    format!(".part-{file}")
}

/// Renders one picture. Its file gets its name when it is complete.
fn render(frame: &FlightFrame, folder: &Path) -> Result<(), Stop> {
    let path = folder.join(&frame.file);
    let part = folder.join(part_name(&frame.file));
    let picture = frame.scene.render().map_err(failed)?;
    let file = match frame.jpeg_quality {
        Some(quality) => picture.encode_jpeg(quality),
        None => picture.encode(&part),
    };
    disk::write(&part, file.map_err(failed)?)?;
    std::fs::rename(&part, &path).map_err(|e| disk::cannot_write(&path, &e).into())
}
