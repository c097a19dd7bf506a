//! Opening: what is there is told piece by piece, so that a long recording is on the screen at once.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crossbeam_channel::{Receiver, Sender, unbounded};
use hzn_calib::Frames;
use hzn_mcap::{Index, IndexEntry, Row};
use hzn_run::source::{self, Item, Payload, Raw, Source, TimeSource};
use hzn_sim::truth::{self, Truth};

use super::Wake;
use crate::model::{Entry, Place};

/// What is to be opened, and what belongs to it.
#[derive(Debug, Clone)]
pub struct Request {
    /// A folder, pictures, a video or a recording.
    pub inputs: Vec<PathBuf>,
    /// The sensor.toml; without it, the one in the recording or beside the pictures.
    pub sensor: Option<PathBuf>,
    /// frames.csv; without it, the one beside the pictures.
    pub frames: Option<PathBuf>,
    /// truth.csv; without it, the one beside the pictures.
    pub truth: Option<PathBuf>,
    /// Frames a second, where nothing else gives a time.
    pub fps: f64,
    /// Form of headerless pictures.
    pub raw: Option<Raw>,
    /// The frame to begin with, from 0.
    pub frame: usize,
}

impl Default for Request {
    fn default() -> Self {
        Self { inputs: Vec::new(), sensor: None, frames: None, truth: None, fps: 1.0, raw: None, frame: 0 }
    }
}

/// A sensor.toml.
#[derive(Debug, Clone)]
pub struct SensorText {
    /// Its text.
    pub text: String,
    /// The file it stands in; of one out of a recording, the file it would be.
    pub home: PathBuf,
    /// It stands in a file.
    pub is_file: bool,
}

/// What there is besides pictures.
#[derive(Debug, Default)]
pub struct Opened {
    /// What it is called.
    pub title: String,
    /// Folder in which it lies.
    pub folder: PathBuf,
    /// The sensor, when there is one.
    pub sensor: Option<SensorText>,
    /// The truth, by name of picture.
    pub truth: HashMap<String, Vec<Truth>>,
    /// Things to be said.
    pub notes: Vec<String>,
}

/// What opening tells.
#[derive(Debug)]
pub enum Event {
    /// It could be opened.
    Opened(Box<Opened>),
    /// Further frames, with the results that the file holds.
    Frames(Vec<(Entry, Vec<Row>)>),
    /// How pictures of the recording are read, as far as it is known by now.
    Pictures(hzn_mcap::Pictures),
    /// That was all.
    End {
        /// The recording was not closed: it can be recovered.
        cut_off: bool,
        /// Something else to be said.
        note: Option<String>,
    },
    /// It cannot be opened.
    Failed(String),
}

/// Begins to open.
pub fn start(request: Request, wake: Wake) -> Receiver<Event> {
    let (send, receive) = unbounded();
    std::thread::spawn(move || {
        let teller = Teller { send, wake };
        if let Err(why) = run(&request, &teller) {
            teller.tell(Event::Failed(why));
        }
    });
    receive
}

struct Teller {
    send: Sender<Event>,
    wake: Wake,
}

impl Teller {
    /// False when nobody listens any more.
    fn tell(&self, event: Event) -> bool {
        let heard = self.send.send(event).is_ok();
        (self.wake)();
        heard
    }
}

fn run(request: &Request, teller: &Teller) -> Result<(), String> {
    match request.inputs.as_slice() {
        [one] if one.is_file() && is_recording(one) => recording(one, request, teller),
        [one] if is_table(one) => Err(format!("{}: is no picture or recording", one.display())),
        _ => pictures(request, teller),
    }
}

fn is_recording(path: &Path) -> bool {
    let name = path.to_string_lossy().to_lowercase();
    name.ends_with(".mcap") || name.ends_with(".mcap.part")
}

fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "csv" || e == "jsonl")
}

/// Name of a file or folder for the title.
fn title(path: &Path) -> String {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    whole.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// Reads what lies beside the pictures.
fn companions(request: &Request, folder: &Path, own: Option<SensorText>) -> (Opened, Option<Frames>) {
    let mut opened = Opened { folder: folder.to_owned(), ..Opened::default() };
    let file =
        |given: &Option<PathBuf>, name: &str| given.clone().or_else(|| Some(folder.join(name)).filter(|p| p.exists()));
    let mut sensor_file = |path: &Path| match std::fs::read_to_string(path) {
        Ok(text) => Some(SensorText { text, home: path.to_owned(), is_file: true }),
        Err(e) => {
            opened.notes.push(format!("{}: cannot be read: {e}", path.display()));
            None
        }
    };
    opened.sensor = match (&request.sensor, own) {
        (Some(path), _) => sensor_file(path),
        (None, Some(own)) => Some(own),
        (None, None) => file(&None, "sensor.toml").and_then(|path| sensor_file(&path)),
    };
    let frames = file(&request.frames, "frames.csv").and_then(|path| match hzn_calib::frames::load(&path) {
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

/// Says what looks wrong about the sensor, and puts in what the pictures tell about their samples.
fn settle(opened: &mut Opened, source: &dyn Source) {
    let Some(sensor) = &mut opened.sensor else { return };
    // What is wrong with it, the session says.
    let Ok(parsed) = hzn_calib::sensor::parse(&sensor.text, &sensor.home) else { return };
    opened.notes.extend(parsed.warnings.iter().map(ToString::to_string));
    if parsed.config.input.bits.is_some() {
        return;
    }
    if let Some(found) = source::find_bits(source) {
        sensor.text = source::with_key(&sensor.text, "bits", i64::from(found.bits));
        opened.notes.extend((found.bits < 16).then(|| found.to_string()));
    }
}

/// A recording: of our own, with results and sensor; or of another program, with pictures only.
fn recording(path: &Path, request: &Request, teller: &Teller) -> Result<(), String> {
    let mut index = Index::open(path).map_err(|e| e.to_string())?;
    let folder = path.parent().map(Path::to_owned).unwrap_or_default();
    let own = index.sensor_toml().map(|text| SensorText {
        text: text.to_owned(),
        home: folder.join("sensor.toml"),
        is_file: false,
    });
    // The truth of simulated pictures stays with the pictures: `flight.mcap` beside `flight/truth.csv`.
    let mut request = request.clone();
    let of_folder = path.with_extension("").join("truth.csv");
    if request.truth.is_none() && !folder.join("truth.csv").exists() && of_folder.exists() {
        request.truth = Some(of_folder);
    }
    let (mut opened, frames) = companions(&request, &folder, own);
    opened.title = title(path);
    if let Ok(source) = source::open(std::slice::from_ref(&path.to_owned()), None, None) {
        settle(&mut opened, source.as_ref());
    }
    teller.tell(Event::Opened(Box::new(opened)));
    let mut frames_of = Gather { name: title(path), frames, pending: HashMap::new(), pictures_only: 0, last: None };
    let mut known = 0;
    loop {
        let part = match index.next_part() {
            Ok(Some(part)) => part,
            Ok(None) => break,
            Err(e) => {
                teller.tell(Event::End { cut_off: false, note: Some(e.to_string()) });
                return Ok(());
            }
        };
        if part.is_empty() {
            continue;
        }
        if known != index.channels() {
            known = index.channels();
            teller.tell(Event::Pictures(index.pictures().map_err(|e| e.to_string())?));
        }
        let batch = frames_of.take(part, index.has_reports());
        if !batch.is_empty() && !teller.tell(Event::Frames(batch)) {
            return Ok(());
        }
    }
    if let Some(last) = frames_of.last.take() {
        teller.tell(Event::Frames(vec![last]));
    }
    let broken = index.broken_chunks();
    let note = (broken > 0).then(|| format!("{broken} parts of the recording are damaged; their frames are missing"));
    teller.tell(Event::End { cut_off: !index.is_complete(), note });
    Ok(())
}

/// Puts pictures and results together to frames.
struct Gather {
    name: String,
    frames: Option<Frames>,
    /// Pictures whose results have not come yet, by sequence number.
    pending: HashMap<u32, hzn_mcap::Place>,
    /// Frames so far of a recording without results.
    pictures_only: u64,
    /// The last frame: results of further bodies may follow.
    last: Option<(Entry, Vec<Row>)>,
}

impl Gather {
    fn take(&mut self, part: Vec<IndexEntry>, has_reports: bool) -> Vec<(Entry, Vec<Row>)> {
        let mut out = Vec::new();
        for found in part {
            match found {
                IndexEntry::Picture(place) if has_reports => {
                    self.pending.insert(place.sequence(), place);
                }
                IndexEntry::Picture(place) => {
                    let name = format!("{}#{:06}", self.name, self.pictures_only);
                    self.pictures_only += 1;
                    let data = self.frames.as_ref().and_then(|f| f.get(&name)).cloned();
                    let time_s = match &self.frames {
                        Some(frames) if frames.has_times() => data.as_ref().and_then(|d| d.time_s),
                        _ => Some(place.log_time_s()),
                    };
                    out.push((Entry { name, time_s, data, place: Place::Recorded(place) }, Vec::new()));
                }
                IndexEntry::Report(row, _, given) => {
                    if let Some((entry, rows)) = &mut self.last
                        && rows.first().is_some_and(|r| r.index == row.index)
                        && entry.name == row.file
                    {
                        rows.push(*row);
                        continue;
                    }
                    out.extend(self.last.take());
                    let data = hzn_run::source::recorded_prior(&row, &given);
                    let place = self.pending.remove(&(row.index as u32)).map_or(Place::Nowhere, Place::Recorded);
                    let entry = Entry { name: row.file.clone(), time_s: row.time_s, data: Some(data), place };
                    self.last = Some((entry, vec![*row]));
                }
            }
        }
        out
    }
}

/// Pictures that are files of their own, or a video.
fn pictures(request: &Request, teller: &Teller) -> Result<(), String> {
    let open = || source::open(&request.inputs, request.raw, None);
    let mut source = open().map_err(|e| e.to_string())?;
    let (mut opened, frames) = companions(request, &source.folder(), None);
    opened.title = match request.inputs.as_slice() {
        [one] => title(one),
        several => format!("{} pictures", several.len()),
    };
    opened.notes.extend(source.notes());
    settle(&mut opened, source.as_ref());
    teller.tell(Event::Opened(Box::new(opened)));
    let mut batch = Vec::new();
    for index in 0u64.. {
        let mut item = match source.next() {
            None => break,
            Some(Ok(item)) => item,
            Some(Err(e)) => {
                teller.tell(Event::Frames(std::mem::take(&mut batch)));
                teller.tell(Event::End { cut_off: false, note: Some(format!("{e:#}")) });
                return Ok(());
            }
        };
        let time = item.time_source(frames.as_ref());
        let data = item.take_prior(frames.as_ref());
        let Item { name, payload, .. } = item;
        let place = match payload {
            Payload::File(path) => Place::File(path),
            Payload::RawFile(path, raw) => Place::RawFile(path, raw),
            _ => Place::Video(index),
        };
        let exif = || match &place {
            Place::File(path) => source::exif_time_s(path),
            _ => None,
        };
        let time_s = time.time_s(data.as_ref(), exif, index, request.fps);
        let takes_long = time == TimeSource::Exif || matches!(place, Place::Video(_));
        batch.push((Entry { name, time_s, data, place }, Vec::new()));
        // A video is decoded, and a file opened, to know its time: what is known by now can be looked at.
        if takes_long && batch.len() >= 25 && !teller.tell(Event::Frames(std::mem::take(&mut batch))) {
            return Ok(());
        }
    }
    teller.tell(Event::Frames(batch));
    let missing = frames.as_ref().and_then(|f| missing_note(f, request, &source.folder()));
    teller.tell(Event::End { cut_off: false, note: source.describe_loss().or(missing) });
    Ok(())
}

/// Pictures that frames.csv names and the folder does not have.
fn missing_note(frames: &Frames, request: &Request, folder: &Path) -> Option<String> {
    if !request.inputs.iter().all(|p| p.is_dir()) {
        return None;
    }
    let missing: Vec<&str> =
        frames.rows.iter().map(|r| r.file.as_str()).filter(|file| !folder.join(file).exists()).collect();
    let first = missing.first()?;
    Some(format!("{} pictures that frames.csv names are not there, the first is {first}", missing.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn all(request: Request) -> Vec<Event> {
        start(request, Arc::new(|| {})).iter().collect()
    }

    fn of(path: &Path) -> Request {
        Request { inputs: vec![path.to_owned()], ..Request::default() }
    }

    #[test]
    fn what_cannot_be_opened_is_said() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str, bytes: &[u8]| {
            std::fs::write(dir.path().join(name), bytes).unwrap();
            dir.path().join(name)
        };
        let why = |path: &Path| match all(of(path)).pop() {
            Some(Event::Failed(why)) => why,
            other => panic!("{other:?}"),
        };
        assert!(why(&at("a.mcap", b"no recording")).contains("is not an MCAP file"));
        assert!(why(&at("b.csv", b"file\n")).contains("is no picture or recording"));
        assert!(why(&dir.path().join("none.png")).contains("no such file"));
    }

    #[test]
    fn a_folder_is_there_with_what_lies_beside_it() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["b.png", "a.png"] {
            image::GrayImage::new(8, 6).save(dir.path().join(name)).unwrap();
        }
        std::fs::write(dir.path().join("frames.csv"), "file,time_s,altitude_km\na.png,5.5,230\nc.png,9,1\n").unwrap();
        std::fs::write(dir.path().join("truth.csv"), "no,truth\n1,2\n").unwrap();
        let events = all(of(dir.path()));
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
        let times: Vec<_> = all(of(dir.path()))
            .iter()
            .flat_map(|event| match event {
                Event::Frames(frames) => frames.iter().map(|(e, _)| e.time_s).collect(),
                _ => Vec::new(),
            })
            .collect();
        // 2020-11-20, and a picture without a camera.
        assert!(matches!(times.as_slice(), [Some(t), None] if (t / 86400.0).floor() == 18_586.0), "{times:?}");
    }
}
