//! The answers on the disk: recordings that a crash cannot spoil, and that never need more than their share of it.

mod folder;
mod spare;

use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};
use hzn_core::Config;
use hzn_mcap::{FLUSH_INTERVAL, FrameRecord, Options, Writer};

use crate::tell::Tell;
use folder::Folder;
pub(crate) use spare::Spare;

/// Answers that wait for a slow disk: at 60 pictures a second, 17 s.
const WAITING: usize = 1024;
/// Pictures that wait for a slow disk. They take memory.
const WAITING_PICTURES: usize = 8;
/// Room in a file for one more answer. An answer has about 3 KB, and at most 16 candidates.
const ANSWER_BYTES: u64 = 16 << 10;
/// Smallest share of the disk. A file must hold some answers.
pub const MIN_LIMIT_BYTES: u64 = 1 << 20;
/// Time until another attempt after an error of the disk.
const AGAIN: Duration = Duration::from_secs(1);

/// What the files of a log may take.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Most bytes of all files; at least [`MIN_LIMIT_BYTES`], and [`Limits::least_bytes`].
    pub bytes: u64,
    /// Bytes of a picture that is kept with each answer; 0 without pictures.
    pub picture_bytes: u64,
}

impl Limits {
    /// Returns the smallest limit with room for a picture in each file.
    pub fn least_bytes(picture_bytes: u64) -> u64 {
        MIN_LIMIT_BYTES.max(folder::PARTS * (picture_bytes + picture_bytes / 64 + 2 * ANSWER_BYTES))
    }
}

/// The log of answers. A thread writes it, so that a slow disk never holds up the flight loop.
pub struct Log {
    sender: Option<Sender<Box<FrameRecord>>>,
    thread: Option<JoinHandle<()>>,
    lost: Arc<AtomicU64>,
    written: Arc<AtomicU64>,
    /// Whether the last answer could not be written.
    fails: Arc<AtomicBool>,
    configs: Arc<Mutex<Vec<Config>>>,
}

/// What a recording says about its sensors.
#[derive(Debug, Clone)]
pub struct Sensors {
    /// The sensors that fly: one, or those of the heads.
    pub configs: Vec<Config>,
    /// Of a rig: the names of its heads, and the text of its rig.toml.
    pub rig: Option<(Vec<String>, String)>,
}

impl Log {
    /// Opens the log in a folder, and closes the files that the last program left. The files need at most
    /// the bytes of `limits`. When the disk is full, recordings of `spare` are removed first.
    ///
    /// # Errors
    /// The folder cannot be made or read.
    pub(crate) fn open(folder: &Path, limits: Limits, sensors: Sensors, spare: Spare, tell: Tell) -> io::Result<Self> {
        let limit_bytes = limits.bytes.max(Limits::least_bytes(limits.picture_bytes));
        let mut folder = Folder::open(folder, limit_bytes)?;
        folder.recover(&tell);
        let (sender, answers) = bounded(if limits.picture_bytes == 0 { WAITING } else { WAITING_PICTURES });
        let (lost, written) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
        let Sensors { configs, rig } = sensors;
        let (configs, fails) = (Arc::new(Mutex::new(configs)), Arc::new(AtomicBool::new(false)));
        let mut writing = Writing {
            folder,
            record_bytes: limits.picture_bytes + ANSWER_BYTES,
            file: None,
            failed: None,
            lost: Arc::clone(&lost),
            written: Arc::clone(&written),
            fails: Arc::clone(&fails),
            configs: Arc::clone(&configs),
            rig,
            spare,
            tell,
        };
        let thread = thread::Builder::new().name("log".into()).spawn(move || writing.run(&answers))?;
        Ok(Self { sender: Some(sender), thread: Some(thread), lost, written, fails, configs })
    }

    /// Sets the configuration of a head that the next files name.
    pub fn set_config(&self, head: usize, config: &Config) {
        if let Some(place) = self.configs.lock().unwrap_or_else(PoisonError::into_inner).get_mut(head) {
            place.clone_from(config);
        }
    }

    /// Adds an answer, without waiting. If there is no room, the answer is lost and counted. Returns false if it is
    /// lost, or if the disk refused the last answer that was written.
    pub fn add(&self, record: FrameRecord) -> bool {
        let sent = self.sender.as_ref().map(|sender| sender.try_send(Box::new(record)));
        let is_lost = matches!(sent, Some(Err(TrySendError::Full(_))));
        self.lost.fetch_add(is_lost.into(), Ordering::Relaxed);
        !is_lost && !self.fails.load(Ordering::Relaxed)
    }

    /// Makes the thread write what waits and close the file, without waiting for it. Returns false if that was done
    /// before.
    pub(crate) fn close(&mut self) -> bool {
        self.sender.take().is_some()
    }

    /// Writes what waits, and closes the file. Returns how many answers are in the log, and how many were lost.
    pub fn finish(&mut self) -> (u64, u64) {
        self.sender = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        (self.written.load(Ordering::Relaxed), self.lost.load(Ordering::Relaxed))
    }
}

/// The state of the thread.
struct Writing {
    folder: Folder,
    /// Room in a file for one more answer, with its picture.
    record_bytes: u64,
    file: Option<Writer>,
    /// Time of the last error of the disk.
    failed: Option<Instant>,
    lost: Arc<AtomicU64>,
    written: Arc<AtomicU64>,
    fails: Arc<AtomicBool>,
    configs: Arc<Mutex<Vec<Config>>>,
    rig: Option<(Vec<String>, String)>,
    spare: Spare,
    tell: Tell,
}

impl Writing {
    fn run(&mut self, answers: &Receiver<Box<FrameRecord>>) {
        loop {
            let outcome = match answers.recv_timeout(FLUSH_INTERVAL) {
                Ok(record) => self.add(&record),
                Err(e) if e.is_timeout() => self.file.as_mut().map_or(Ok(()), Writer::flush_if_due),
                Err(_) => break,
            };
            self.take_outcome(outcome);
        }
        let outcome = self.close();
        self.take_outcome(outcome);
    }

    fn add(&mut self, record: &FrameRecord) -> Result<(), hzn_mcap::Error> {
        if self.failed.is_some_and(|failed| failed.elapsed() < AGAIN) {
            self.lost.fetch_add(1, Ordering::Relaxed);
            return Ok(());
        }
        let is_full = |file: &Writer| file.finished_bytes() + self.record_bytes > self.folder.file_bytes();
        if let Some(file) = self.file.as_mut().filter(|file| is_full(file)) {
            // What waits needs less room once it is compressed.
            file.flush()?;
            if is_full(file) {
                self.close()?;
            }
        }
        let written = self.open().and_then(|file| file.write(record));
        let count = if written.is_ok() { &self.written } else { &self.lost };
        count.fetch_add(1, Ordering::Relaxed);
        if written.is_ok() && self.failed.take().is_some() {
            let lost = self.lost.load(Ordering::Relaxed);
            self.fails.store(false, Ordering::Relaxed);
            (self.tell)(&format!("the log is written again; {lost} answers are not in it"));
        }
        written
    }

    /// Returns the file that is being written.
    fn open(&mut self) -> Result<&mut Writer, hzn_mcap::Error> {
        let file = match self.file.take() {
            Some(file) => file,
            None => {
                let path = self.folder.make_room();
                let configs = self.configs.lock().unwrap_or_else(PoisonError::into_inner).clone();
                Writer::create(path, &options(configs, self.rig.as_ref()))?
            }
        };
        Ok(self.file.insert(file))
    }

    fn close(&mut self) -> Result<(), hzn_mcap::Error> {
        self.file.take().map_or(Ok(()), |file| file.finish().map(drop))
    }

    /// Takes note of an error. The file that failed stays as it is; the next one is tried later.
    fn take_outcome(&mut self, outcome: Result<(), hzn_mcap::Error>) {
        let Err(e) = outcome else { return };
        self.file = None;
        let is_full = matches!(e, hzn_mcap::Error::DiskFull { .. });
        // Others may fill the disk, too. Answers are worth more than pictures, and the newest more than the oldest.
        let removed = || self.spare.remove_oldest().or_else(|| self.folder.remove_oldest());
        if let Some(oldest) = is_full.then(removed).flatten() {
            (self.tell)(&format!("the disk is full: the oldest recording {oldest} was removed"));
        } else {
            if self.failed.is_none() {
                // The error speaks of a run that can be continued, which a flight cannot.
                let why = if is_full { "the disk is full".to_owned() } else { e.to_string() };
                (self.tell)(&format!("the log cannot be written: {why}; the flight goes on without it"));
            }
            self.failed = Some(Instant::now());
            self.fails.store(true, Ordering::Relaxed);
        }
        // The part with the finished answers becomes a file, if the disk has room for it.
        self.folder.recover(&self.tell);
    }
}

/// Returns the settings of a recording.
fn options(configs: Vec<Config>, rig: Option<&(Vec<String>, String)>) -> Options {
    // A configuration that was accepted has a text.
    let text = |config: &Config| toml::to_string(config).unwrap_or_default();
    let metadata = [("program".to_owned(), format!("hzn fly {}", env!("CARGO_PKG_VERSION")))].into();
    let mut options = Options { metadata, force: true, durable: true, ..Options::default() };
    match rig {
        None => {
            options.sensor_toml = configs.first().map(text).unwrap_or_default();
            options.camera = configs.into_iter().next().map(|config| config.camera);
        }
        Some((names, rig_toml)) => {
            options.files.push(("rig.toml".to_owned(), rig_toml.clone()));
            for (name, config) in names.iter().zip(configs) {
                options.files.push((format!("{name}/sensor.toml"), text(&config)));
                options.heads.push((name.clone(), config.camera));
            }
        }
    }
    options
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::Mutex;

    use hzn_core::camera::{self, Model};
    use hzn_core::status::Status;
    use hzn_mcap::{Contents, Reader, Row, RowMeta};

    use super::*;

    const LIMITS: Limits = Limits { bytes: MIN_LIMIT_BYTES, picture_bytes: 0 };

    fn sensors() -> Sensors {
        Sensors { configs: vec![Config::new(camera::Config::ideal(Model::Pinhole, 640, 480, 600.0))], rig: None }
    }
    fn record(index: u64) -> FrameRecord {
        let meta = RowMeta {
            index,
            file: format!("frame-{index:06}"),
            time_s: Some(index as f64),
            body: "earth".into(),
            altitude_km: None,
        };
        // The reason does not compress well, so that few answers fill the disk.
        let noise = |i: u64| (index * 1_000_003 + i).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20;
        let reason: Vec<String> = (0..80).map(|i| format!("{:x}", noise(i))).collect();
        FrameRecord::new(Row::unprocessed(&meta, Status::Unreadable, reason.join(" ")))
    }
    fn quiet() -> Tell {
        Arc::new(|_: &str| ())
    }
    /// Returns the sizes of all files in a folder. The log may remove one of them meanwhile.
    fn used(folder: &Path) -> u64 {
        fs::read_dir(folder).unwrap().filter_map(|entry| Some(entry.ok()?.metadata().ok()?.len())).sum()
    }
    fn indexes(folder: &Path) -> Vec<u64> {
        let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        let rows = |path| Reader::open(path, Contents::WithoutImages).unwrap().map(|frame| frame.unwrap().row.index);
        paths.into_iter().flat_map(rows).collect()
    }

    #[test]
    fn the_disk_is_never_used_beyond_the_limit() {
        let dir = tempfile::tempdir().unwrap();
        let (mut most, limit) = (0, MIN_LIMIT_BYTES);
        for start in [0, 1500] {
            let mut log = Log::open(dir.path(), LIMITS, sensors(), Spare::default(), quiet()).unwrap();
            for index in start..start + 1500 {
                while log.sender.as_ref().unwrap().is_full() {
                    thread::sleep(Duration::from_millis(1));
                }
                log.add(record(index));
                if index % 20 == 0 {
                    thread::sleep(Duration::from_millis(1));
                    most = most.max(used(dir.path()));
                }
            }
            assert_eq!(log.finish(), (1500, 0));
            most = most.max(used(dir.path()));
        }
        assert!(most <= limit && most > limit * 3 / 4, "{most} of {limit}");
        // The newest answers are kept, in order.
        let kept = indexes(dir.path());
        assert_eq!(kept.last(), Some(&2999));
        assert!(kept.len() > 500 && kept.windows(2).all(|w| w[1] == w[0] + 1), "{}", kept.len());
    }

    #[test]
    fn what_a_crash_left_is_closed() {
        let dir = tempfile::tempdir().unwrap();
        let mut log = Log::open(dir.path(), LIMITS, sensors(), Spare::default(), quiet()).unwrap();
        assert!((0..40).all(|index| log.add(record(index))));
        thread::sleep(2 * FLUSH_INTERVAL);
        // A copy of the folder now is what a crash leaves.
        let after = tempfile::tempdir().unwrap();
        for entry in fs::read_dir(dir.path()).unwrap() {
            let entry = entry.unwrap();
            fs::copy(entry.path(), after.path().join(entry.file_name())).unwrap();
        }
        fs::write(after.path().join("fly-000009.mcap.part"), b"\x89MC").unwrap();
        log.finish();
        let told = Arc::new(Mutex::new(Vec::<String>::new()));
        let list = Arc::clone(&told);
        let tell: Tell = Arc::new(move |line: &str| list.lock().unwrap().push(line.to_owned()));
        let mut log = Log::open(after.path(), LIMITS, sensors(), Spare::default(), tell).unwrap();
        log.add(record(40));
        log.finish();
        assert_eq!(indexes(after.path()), (0..=40).collect::<Vec<_>>());
        assert!(told.lock().unwrap()[0].contains("answers were recovered"), "{told:?}");
        assert!(after.path().join("fly-000010.mcap").exists());
    }

    #[test]
    fn a_full_disk_costs_the_oldest_recordings_first() {
        let dir = tempfile::tempdir().unwrap();
        for start in [0, 10, 20] {
            let mut log = Log::open(dir.path(), LIMITS, sensors(), Spare::default(), quiet()).unwrap();
            (start..start + 10).for_each(|index| assert!(log.add(record(index))));
            log.finish();
        }
        let pictures = tempfile::tempdir().unwrap();
        let mut log = Log::open(pictures.path(), LIMITS, sensors(), Spare::default(), quiet()).unwrap();
        log.add(record(0));
        log.finish();
        fs::write(pictures.path().join("fly-000002.mcap.part"), b"a recording that is being written").unwrap();
        let spare = Spare::default();
        spare.add(pictures.path());
        let told = Arc::new(Mutex::new(Vec::<String>::new()));
        let list = Arc::clone(&told);
        let mut writing = Writing {
            folder: Folder::open(dir.path(), MIN_LIMIT_BYTES).unwrap(),
            record_bytes: ANSWER_BYTES,
            file: None,
            failed: None,
            lost: Arc::default(),
            written: Arc::default(),
            fails: Arc::default(),
            configs: Arc::new(Mutex::new(sensors().configs)),
            rig: None,
            spare: spare.clone(),
            tell: Arc::new(move |line: &str| list.lock().unwrap().push(line.to_owned())),
        };
        let full = || Err(hzn_mcap::Error::DiskFull { folder: dir.path().into(), part: dir.path().join("x") });
        // The pictures go first: the finished ones, then the one that could not be finished.
        for (first, count, fails) in [(0, 30, false), (0, 30, false), (10, 20, false), (20, 10, false), (20, 10, true)]
        {
            writing.take_outcome(full());
            assert!(spare.is_needed() && !pictures.path().join("fly-000001.mcap").exists());
            let kept = indexes(dir.path());
            assert_eq!((kept[0], kept.len(), writing.fails.load(Ordering::Relaxed)), (first, count, fails));
        }
        let told = told.lock().unwrap();
        assert!(
            told[0].contains("the oldest recording") && told[4].contains("the disk is full; the flight"),
            "{told:?}"
        );
    }

    #[test]
    fn a_disk_that_fails_does_not_end_the_flight() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("log");
        let told = Arc::new(Mutex::new(Vec::<String>::new()));
        let list = Arc::clone(&told);
        let tell: Tell = Arc::new(move |line: &str| list.lock().unwrap().push(line.to_owned()));
        let mut log = Log::open(&folder, LIMITS, sensors(), Spare::default(), tell).unwrap();
        fs::remove_dir(&folder).unwrap();
        // The writer has a thread of its own, so nobody knows which answer is the first that the flight software is
        // told of.
        let mut answers = 1;
        while log.add(record(answers - 1)) {
            answers += 1;
            assert!(answers < 10_000, "the flight software is never told");
            thread::sleep(FLUSH_INTERVAL / 50);
        }
        (0..4).for_each(|k| assert!(!log.add(record(answers + k)), "the flight software is told"));
        assert_eq!(log.finish(), (0, answers + 4));
        let told = told.lock().unwrap();
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(told[0].contains("the flight goes on without it"), "{told:?}");
    }
}
