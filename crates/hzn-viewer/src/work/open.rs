//! Opening of a sequence. Pictures are reported as they are found, so that a long recording is on the screen at once.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, bounded};
use hzn_files::Frames;
use hzn_files::truth::{self, Truth};
use hzn_mcap::{Index, Row};
use hzn_run::open;
use hzn_run::source::{self, Raw, Source, TimeSource};

use super::entry::entry_of;
use super::frame_joiner::FrameJoiner;
use super::frames_table::FramesTable;
use super::sensor_text::SensorText;
use super::{Computer, Wake};
use crate::model::{Entry, Place};

/// Request to open a sequence, with the files that belong to it.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// A folder, pictures, a video or a recording.
    pub inputs: Vec<PathBuf>,
    /// The sensor.toml; without it, the one in the recording or next to the pictures.
    pub sensor: Option<PathBuf>,
    /// The frames.csv; without it, the one next to the pictures.
    pub frames: Option<PathBuf>,
    /// The truth.csv; without it, the one next to the pictures.
    pub truth: Option<PathBuf>,
    /// Pictures per second, where nothing else gives the times of the pictures; with `None` their times are unknown.
    pub fps: Option<f64>,
    /// Size and format of headerless pictures.
    pub raw: Option<Raw>,
    /// The flight computer, if the input is its line.
    pub computer: Computer,
    /// Index of the picture to begin with, from 0.
    pub frame: usize,
    /// Waits for further pictures of a folder or a recording that grows.
    pub follow: bool,
}

/// Returns the first input that is not there. A pattern and the line of a flight computer are no files.
pub fn missing(inputs: &[PathBuf]) -> Option<&PathBuf> {
    inputs.iter().find(|input| !input.exists() && !input.to_string_lossy().contains(['*', '?', '[', ':']))
}

/// Everything that was opened except the pictures.
#[derive(Debug, Default)]
pub struct Opened {
    /// Title: the name of the file or folder.
    pub title: String,
    /// Folder of the opened files.
    pub folder: PathBuf,
    /// The sensor, if there is one.
    pub sensor: Option<SensorText>,
    /// The truth by name of the picture.
    pub truth: HashMap<String, Vec<Truth>>,
    /// Messages for the user.
    pub notes: Vec<String>,
}

/// An event of the opening.
#[derive(Debug)]
pub enum Event {
    /// The sequence is open.
    Opened(Box<Opened>),
    /// Further pictures, with the results from the file.
    Frames(Vec<(Entry, Vec<Row>)>),
    /// The recording, and a reader for its pictures, as far as its channels are known.
    Pictures(PathBuf, hzn_mcap::Pictures),
    /// All pictures were reported.
    End {
        /// The recording was not closed, so it can be recovered.
        cut_off: bool,
        /// Another message for the user.
        note: Option<String>,
    },
    /// The sequence cannot be opened, for this reason.
    Failed(String),
}

/// Events that wait for the window. A window that is not drawn holds up the opening, which then takes no more memory.
const WAITING: usize = 1024;
/// Time between two looks at a recording that grows.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Longest wait for the final name of a recording.
const RENAMED_WITHIN: Duration = Duration::from_secs(10);
/// Looks without news after which no further results of the last picture are expected.
const QUIET_LOOKS: u32 = 2;

/// An opening. It ends when the handle is dropped.
#[derive(Debug)]
pub struct Opening {
    /// The events.
    pub events: Receiver<Event>,
    stop: Arc<AtomicBool>,
}

impl Drop for Opening {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Starts to open a sequence.
pub fn start(request: Request, wake: Wake) -> Opening {
    let (send, events) = bounded(WAITING);
    let stop = Arc::new(AtomicBool::new(false));
    let of_thread = Arc::clone(&stop);
    std::thread::spawn(move || {
        let events = EventSender { channel: send, wake, stop: of_thread };
        if let Err(why) = run(&request, &events) {
            events.send(Event::Failed(why));
        }
    });
    Opening { events, stop }
}

struct EventSender {
    channel: Sender<Event>,
    wake: Wake,
    /// Nobody waits for further events.
    stop: Arc<AtomicBool>,
}

impl EventSender {
    /// Sends an event. Returns false if the receiver is gone.
    fn send(&self, event: Event) -> bool {
        let is_received = self.channel.send(event).is_ok();
        (self.wake)();
        is_received
    }
    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

fn run(request: &Request, events: &EventSender) -> Result<(), String> {
    match request.inputs.as_slice() {
        [one] if super::companion::kind_of(one).is_some() => {
            let what = "holds results and no pictures; open the pictures or a recording first, then this file";
            Err(format!("{}: {what}", one.display()))
        }
        [one] if one.is_file() && is_recording(one) => open_recording(one, request, events),
        // A recording has another name until it is finished.
        [one] if request.follow && is_recording(one) && hzn_mcap::part_path(one).is_file() => {
            open_recording(&hzn_mcap::part_path(one), request, events)
        }
        [one] if is_table(one) => Err(format!("{}: is neither a picture nor a recording", one.display())),
        _ => open_pictures(request, events),
    }
}

fn is_recording(path: &Path) -> bool {
    let name = path.to_string_lossy().to_lowercase();
    name.ends_with(".mcap") || name.ends_with(".mcap.part")
}

fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "csv" || e == "jsonl")
}

/// Returns the name of a file or folder for the title.
pub fn title(path: &Path) -> String {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    absolute.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// Reads the files next to the pictures.
fn read_companions(request: &Request, folder: &Path, recorded_sensor: Option<SensorText>) -> (Opened, Option<Frames>) {
    let mut opened = Opened { folder: folder.to_owned(), ..Opened::default() };
    let file =
        |named: &Option<PathBuf>, name: &str| named.clone().or_else(|| Some(folder.join(name)).filter(|p| p.exists()));
    let mut sensor_file = |path: &Path| match hzn_files::limited::read_text(path, hzn_files::limited::SETTINGS_BYTES) {
        Ok(text) => Some(SensorText::new(text, path, true)),
        Err(e) => {
            opened.notes.push(format!("{}: cannot be read: {e}", path.display()));
            None
        }
    };
    opened.sensor = match (&request.sensor, recorded_sensor) {
        (Some(path), _) => sensor_file(path),
        (None, Some(recorded)) => Some(recorded),
        (None, None) => file(&None, "sensor.toml").and_then(|path| sensor_file(&path)),
    };
    let frames = file(&request.frames, "frames.csv").and_then(|path| match hzn_files::frames::load(&path) {
        Ok(frames) => Some(frames),
        Err(problem) => {
            opened.notes.push(problem.to_string());
            None
        }
    });
    if let Some(frames) = &frames {
        opened.notes.extend(frames.warnings.iter().map(ToString::to_string));
    }
    if let Some(path) = file(&request.truth, "truth.csv") {
        match truth::load(&path) {
            Ok(rows) => {
                for row in rows {
                    opened.truth.entry(row.file.clone()).or_default().push(row);
                }
            }
            Err(problem) => opened.notes.push(problem.to_string()),
        }
    }
    (opened, frames)
}

/// Adds the warnings about the sensor.toml and about its pictures, and adds `bits` if the pictures show the number of
/// bits of their samples. `hzn run` refuses some of these sequences; the window shows them, so that the sensor can be
/// mended.
fn complete_sensor(opened: &mut Opened, source: &mut dyn Source, frames: Option<&Frames>) {
    let Some(sensor) = &mut opened.sensor else { return };
    // The session reports errors of the sensor.toml.
    let Ok(mut parsed) = hzn_files::sensor::parse(&sensor.text, &sensor.home) else { return };
    let doubts = frames.map(|frames| frames.check_sensor(&parsed.config)).unwrap_or_default();
    opened.notes.extend(parsed.warnings.iter().chain(&doubts).map(ToString::to_string));
    match open::complete(source, &mut parsed) {
        Ok(notes) => opened.notes.extend(notes),
        Err(why) => opened.notes.push(why.to_string()),
    }
    sensor.text = parsed.text;
    let checks = [open::check_size(source, &parsed.config), open::check_altitude(source, &parsed.config, frames)];
    opened.notes.extend(checks.into_iter().filter_map(Result::err).map(|e| e.to_string()));
}

/// Opens a recording: one of ours with results and sensor, or one of another program with pictures only.
fn open_recording(path: &Path, request: &Request, events: &EventSender) -> Result<(), String> {
    let mut index = Index::open(path).map_err(|e| e.to_string())?;
    let folder = path.parent().map(Path::to_owned).unwrap_or_default();
    let home = folder.join("sensor.toml");
    let recorded_sensor = index.sensor_toml().map(|text| SensorText::new(text.to_owned(), &home, false));
    // The truth of simulated pictures stays with the pictures: `flight.mcap` next to `flight/truth.csv`.
    let mut request = request.clone();
    let truth_of_folder = path.with_extension("").join("truth.csv");
    if request.truth.is_none() && !folder.join("truth.csv").exists() && truth_of_folder.exists() {
        request.truth = Some(truth_of_folder);
    }
    let (mut opened, frames) = read_companions(&request, &folder, recorded_sensor);
    opened.title = title(path);
    if let Ok(mut source) = source::open(std::slice::from_ref(&path.to_owned()), None, None) {
        opened.notes.extend(source.notes());
        complete_sensor(&mut opened, source.as_mut(), frames.as_ref());
    }
    events.send(Event::Opened(Box::new(opened)));
    let joiner = FrameJoiner::new(title(path), frames);
    let Some(note) = read_parts(path, &mut index, joiner, request.follow, events)? else { return Ok(()) };
    if request.follow {
        wait_for_name(path, events);
    }
    // What comes after a part that cannot be read is unknown.
    let cut_off = !index.is_complete() && note.is_none();
    let broken = index.broken_chunks();
    let damaged = || format!("{broken} parts of the recording are damaged; their pictures are missing");
    let note = note.or_else(|| (broken > 0).then(damaged));
    events.send(Event::End { cut_off, note });
    Ok(())
}

/// Waits until a recording that is complete has its final name. Its writer gives it the name after the last byte.
fn wait_for_name(path: &Path, events: &EventSender) {
    let is_part = path.extension().is_some_and(|ending| ending == "part");
    let begin = Instant::now();
    while is_part && path.exists() && begin.elapsed() < RENAMED_WITHIN && !events.is_stopped() {
        std::thread::sleep(LOOK_EVERY);
    }
}

/// Reads all parts of a recording, and with `follow` those that are still added to it. Returns why it cannot be read
/// further; the outer `None` means that nobody waits for the pictures.
fn read_parts(
    path: &Path,
    index: &mut Index,
    mut joiner: FrameJoiner,
    follow: bool,
    events: &EventSender,
) -> Result<Option<Option<String>>, String> {
    let (mut known, mut quiet) = (0, 0);
    loop {
        let batch = match index.next_part() {
            Ok(Some(part)) if part.is_empty() => continue,
            Ok(Some(part)) => {
                quiet = 0;
                if known != index.channels() {
                    known = index.channels();
                    let pictures = index.pictures().map_err(|e| e.to_string())?;
                    events.send(Event::Pictures(path.to_owned(), pictures));
                }
                joiner.join(part, index)
            }
            Ok(None) if follow && !index.is_complete() => {
                std::thread::sleep(LOOK_EVERY);
                quiet += 1;
                // The results of further bodies come together with those of the first one.
                let last = if quiet == QUIET_LOOKS { joiner.take_last() } else { None };
                last.into_iter().collect()
            }
            Ok(None) => {
                let last: Vec<_> = joiner.take_last().into_iter().collect();
                return Ok(events.send(Event::Frames(last)).then_some(None));
            }
            Err(e) => return Ok(Some(Some(e.to_string()))),
        };
        let is_gone = !batch.is_empty() && !events.send(Event::Frames(batch));
        if is_gone || events.is_stopped() {
            return Ok(None);
        }
    }
}

/// Opens pictures in separate files, or a video.
fn open_pictures(request: &Request, events: &EventSender) -> Result<(), String> {
    let source = if request.follow {
        source::watch(&request.inputs, request.raw, Arc::clone(&events.stop))
    } else {
        source::open(&request.inputs, request.raw, None)
    };
    let mut source = source.map_err(|e| e.to_string())?;
    let (mut opened, frames) = read_companions(request, &source.folder(), None);
    opened.title = match request.inputs.as_slice() {
        [one] => title(one),
        several => format!("{} pictures", several.len()),
    };
    opened.notes.extend(source.notes());
    complete_sensor(&mut opened, source.as_mut(), frames.as_ref());
    events.send(Event::Opened(Box::new(opened)));
    let path = request.frames.clone().unwrap_or_else(|| source.folder().join("frames.csv"));
    let mut table = FramesTable::new(path, frames);
    let mut batch = Vec::new();
    for index in 0u64.. {
        let item = match source.next() {
            None => break,
            Some(Ok(item)) => item,
            Some(Err(e)) => {
                events.send(Event::Frames(std::mem::take(&mut batch)));
                events.send(Event::End { cut_off: false, note: Some(format!("{e:#}")) });
                return Ok(());
            }
        };
        if request.follow {
            table.renew();
        }
        let (entry, time) = entry_of(item, index, table.frames.as_ref(), request.fps);
        let takes_long = time == TimeSource::Exif || matches!(entry.place, Place::Video(_)) || request.follow;
        batch.push((entry, Vec::new()));
        // To know the times, a video is decoded and a file is opened. This takes long, so the pictures found so far are
        // sent. A picture that has just arrived is sent at once.
        let enough = if request.follow { 1 } else { 25 };
        if takes_long && batch.len() >= enough && !events.send(Event::Frames(std::mem::take(&mut batch))) {
            return Ok(());
        }
    }
    events.send(Event::Frames(batch));
    let missing = table.frames.as_ref().and_then(|f| missing_note(f, request, &source.folder()));
    events.send(Event::End { cut_off: false, note: source.describe_loss().or(missing) });
    Ok(())
}

/// Returns a message about pictures that frames.csv names and the folder lacks.
fn missing_note(frames: &Frames, request: &Request, folder: &Path) -> Option<String> {
    if !request.inputs.iter().all(|p| p.is_dir()) {
        return None;
    }
    let missing: Vec<&str> =
        frames.rows.iter().map(|r| r.file.as_str()).filter(|file| !folder.join(file).exists()).collect();
    let first = missing.first()?;
    Some(format!("{} pictures in frames.csv do not exist; the first one is {first}", missing.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn all_events(request: Request) -> Vec<Event> {
        start(request, Arc::new(|| {})).events.iter().collect()
    }

    fn request_for(path: &Path) -> Request {
        Request { inputs: vec![path.to_owned()], ..Request::default() }
    }

    #[test]
    fn unusable_inputs_are_reported() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str, bytes: &[u8]| {
            std::fs::write(dir.path().join(name), bytes).unwrap();
            dir.path().join(name)
        };
        let why = |path: &Path| match all_events(request_for(path)).pop() {
            Some(Event::Failed(why)) => why,
            other => panic!("{other:?}"),
        };
        assert!(why(&file("a.mcap", b"no recording")).contains("is not an MCAP file"));
        assert!(why(&file("b.csv", b"file\n")).contains("is neither a picture nor a recording"));
        assert!(why(&dir.path().join("none.png")).contains("no such file"));
    }

    #[test]
    fn a_folder_is_opened_with_the_files_next_to_it() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["b.png", "a.png"] {
            image::GrayImage::new(8, 6).save(dir.path().join(name)).unwrap();
        }
        std::fs::write(dir.path().join("frames.csv"), "file,time_s,altitude_km\na.png,5.5,230\nc.png,9,1\n").unwrap();
        std::fs::write(dir.path().join("truth.csv"), "no,truth\n1,2\n").unwrap();
        let events = all_events(request_for(dir.path()));
        let [Event::Opened(opened), Event::Frames(frames), Event::End { note, .. }] = events.as_slice() else {
            panic!("{events:?}")
        };
        assert!(opened.sensor.is_none() && opened.notes.iter().any(|n| n.contains("truth.csv")));
        let names: Vec<_> = frames.iter().map(|(e, _)| (e.name.as_str(), e.time_s)).collect();
        assert_eq!(names, [("a.png", Some(5.5)), ("b.png", None)]);
        assert_eq!(frames[0].0.data.as_ref().unwrap().altitude_km, Some(230.0));
        assert!(note.as_deref().unwrap().contains("c.png"));
    }

    #[test]
    fn pictures_have_the_time_that_the_camera_wrote() {
        let full = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/real/full");
        let dir = tempfile::tempdir().unwrap();
        std::fs::copy(full.join("iss-limb-2020-11-20.jpg"), dir.path().join("a.jpg")).unwrap();
        image::GrayImage::new(8, 6).save(dir.path().join("b.png")).unwrap();
        let times: Vec<_> = all_events(request_for(dir.path()))
            .iter()
            .flat_map(|event| match event {
                Event::Frames(frames) => frames.iter().map(|(e, _)| e.time_s).collect(),
                _ => Vec::new(),
            })
            .collect();
        // The time is on 2020-11-20. The second picture is not from a camera.
        assert!(matches!(times.as_slice(), [Some(t), None] if (t / 86400.0).floor() == 18_586.0), "{times:?}");
    }
}
