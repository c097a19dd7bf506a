//! The Linux computer as the board of the flight software.

use std::collections::VecDeque;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crossbeam_channel::{Receiver, Select};
use hzn_core::camera::Camera;
use hzn_core::{Config, Report, Solution};
use hzn_flight::Parameters;
use hzn_flight::authentication::KEY_BYTES;
use hzn_flight::board::{BUILD, Board, Image, Picture, RETAINED_WORDS};
use hzn_flight::bytes::Reader;
use hzn_flight::flight::rig::RigBoard;
use hzn_flight::joint::{Outcome, RigAnswer};
use hzn_flight::messages::{Event, EventRecord, Exposure, Severity};
use hzn_flight::packet::{self, Apid, ApidBase, Scan};
use hzn_flight::view::Viewer;
use hzn_mcap::{CandidateEdge, FrameRecord, LogLevel, LogLine, Row, RowMeta};
use hzn_run::engine::widen_report;

use crate::camera::{Ended, Shot};
use crate::head::{Counts, Head};
use crate::joint::joint_row;
use crate::keeper::Keeper;
use crate::key_file::Keys;
use crate::latency::Latency;
use crate::link::Link;
use crate::log::Log;
use crate::log_clock::LogClock;
use crate::notify::Notify;
use crate::signals::Lines;
use crate::tell::Tell;

/// Longest sleep of the loop. The watchdog is fed and the lines of the vehicle are read this often.
const LONGEST_WAIT: Duration = Duration::from_millis(20);
/// Events that wait for the next answer in the log.
const EVENTS: usize = 64;

/// The parts of the computer that all heads share.
pub(crate) struct Parts {
    pub(crate) line: Option<(Link, Receiver<Vec<u8>>)>,
    pub(crate) latency: Arc<Latency>,
    pub(crate) log: Log,
    pub(crate) lines: Arc<Lines>,
    pub(crate) keys: Keys,
    pub(crate) notify: Notify,
    pub(crate) tell: Tell,
}

/// The board, with one head or those of a rig.
pub(crate) struct Linux {
    start: Instant,
    /// The time, if the pictures are recorded; the clock follows them then.
    recorded_us: Option<u64>,
    clock: LogClock,
    parts: Parts,
    heads: Vec<Head>,
    /// Place of the head that the functions of the camera and of the memory mean.
    selected: usize,
    arrived: VecDeque<u8>,
    events: Vec<LogLine>,
    /// Epochs of a rig, and those with a joint answer.
    epochs: (u64, u64),
}

impl Linux {
    /// Makes a board. `begin_s` is the time at which the clock begins, in seconds, if the pictures are recorded.
    pub(crate) fn new(parts: Parts, heads: Vec<Head>, begin_s: Option<f64>) -> Self {
        Self {
            start: Instant::now(),
            recorded_us: begin_s.map(|_| 0),
            clock: LogClock::new(begin_s.unwrap_or_else(system_s), 0),
            parts,
            heads,
            selected: 0,
            arrived: VecDeque::new(),
            events: Vec::new(),
            epochs: (0, 0),
        }
    }

    /// Waits until there is something to do. `takes_pictures` says whether the loop of a head processes every picture;
    /// otherwise only the newest one is kept, so that the camera need not wait.
    pub(crate) fn wait(&mut self, takes_pictures: impl Fn(usize) -> bool) {
        let has_picture = |(k, head): (usize, &Head)| takes_pictures(k) && head.next.is_some();
        if !self.arrived.is_empty() || self.heads.iter().enumerate().any(has_picture) {
            return;
        }
        if self.recorded_us.is_some() {
            let (upcoming_us, now_us) = (self.heads.iter().filter_map(Head::upcoming_us).min(), self.now_us());
            self.pass_us(upcoming_us.map_or(0, |us| us.saturating_sub(now_us)));
        } else {
            let mut select = Select::new();
            self.heads.iter().filter_map(Head::pictures).for_each(|pictures| _ = select.recv(pictures));
            if let Some((_, bytes)) = &self.parts.line {
                select.recv(bytes);
            }
            let _ = select.ready_timeout(LONGEST_WAIT);
        }
        let now_us = self.now_us();
        for (k, head) in self.heads.iter_mut().enumerate() {
            if !takes_pictures(k) || head.next.is_none() {
                head.poll(now_us);
            }
        }
    }

    /// Lets time pass: that of the recording, or real time.
    pub(crate) fn pass_us(&mut self, us: u64) {
        match &mut self.recorded_us {
            Some(now_us) => *now_us += us,
            None => thread::sleep(Duration::from_micros(us)),
        }
    }

    /// Returns why no more pictures will come from any head. If the loop of a head takes every picture, the last one
    /// must have been taken.
    pub(crate) fn ended(&self, takes_pictures: impl Fn(usize) -> bool) -> Option<&Ended> {
        let mut worst: Option<&Ended> = None;
        for (k, head) in self.heads.iter().enumerate() {
            let ended = head.ended(takes_pictures(k))?;
            if worst.is_none_or(|worst| *worst == Ended::Whole) {
                worst = Some(ended);
            }
        }
        worst
    }
    pub(crate) fn counts(&self) -> Counts {
        self.heads.iter().map(Head::counts).fold(Counts::default(), Counts::plus)
    }
    /// Returns the number of epochs of a rig, and of those with a joint answer.
    pub(crate) fn epochs(&self) -> (u64, u64) {
        self.epochs
    }
    pub(crate) fn parts(&mut self) -> &mut Parts {
        &mut self.parts
    }
    pub(crate) fn heads(&self) -> &[Head] {
        &self.heads
    }

    /// Closes the files of the heads. Returns how many pictures were kept, and how many were lost.
    pub(crate) fn finish_heads(&mut self) -> (u64, u64) {
        let finish = |head: &mut Head| {
            head.flash.end();
            head.keeper.as_mut().map_or((0, 0), Keeper::finish)
        };
        self.heads.iter_mut().map(finish).fold((0, 0), |(kept, lost), (k, l)| (kept + k, lost + l))
    }

    fn head(&mut self) -> Option<&mut Head> {
        self.heads.get_mut(self.selected)
    }
    /// Returns a message that begins with the name of the selected head, if it has one.
    fn named(&self, message: &str) -> String {
        let name = self.heads.get(self.selected).and_then(|head| head.name.as_ref());
        name.map_or_else(|| message.to_owned(), |name| format!("{name}: {message}"))
    }

    /// Keeps a step of the log's clock for the log.
    fn note_step(&mut self, by: &str, step_s: Option<f64>) {
        let Some(step_s) = step_s else { return };
        let message = format!("{by} has set the clock of the log by {step_s:+.3} s");
        (self.parts.tell)(&message);
        if self.events.len() < EVENTS {
            self.events.push(LogLine { level: LogLevel::Warning, message });
        }
    }

    /// Keeps an event for the log.
    fn note_event(&mut self, record: &EventRecord) {
        let level = match Severity::from_number(record.severity) {
            Some(Severity::Information) => LogLevel::Info,
            Some(Severity::Warning) => LogLevel::Warning,
            Some(Severity::Error) | None => LogLevel::Error,
        };
        let name = Event::from_number(record.number).map_or("unknown event", Event::name);
        let message = self.named(&format!("{name} ({}, {})", record.a, record.b));
        if level != LogLevel::Info {
            (self.parts.tell)(&message);
        }
        if self.events.len() < EVENTS {
            self.events.push(LogLine { level, message });
        }
    }
}

/// Returns the clock of the system, s since 1970.
fn system_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

impl Board for Linux {
    fn now_us(&mut self) -> u64 {
        self.recorded_us.unwrap_or_else(|| self.start.elapsed().as_micros() as u64)
    }
    fn receive(&mut self) -> Option<u8> {
        if self.arrived.is_empty() {
            let (_, bytes) = self.parts.line.as_ref()?;
            self.arrived.extend(bytes.try_recv().ok()?);
        }
        self.arrived.pop_front()
    }
    fn send(&mut self, bytes: &[u8]) {
        let Scan::Packet { packet, .. } = packet::scan(bytes) else { return };
        // Whatever the base of the APIDs is, their last four bits say the subject.
        let is = |apid: Apid| packet.apid & (ApidBase::STEP - 1) == apid as u16 & (ApidBase::STEP - 1);
        let current = self.heads.get(self.selected).and_then(|head| head.current.as_ref());
        let since = current.filter(|_| is(Apid::Science)).map(|shot| shot.ready);
        if let Some((link, _)) = &self.parts.line {
            link.send(bytes, since);
        } else if let Some(since) = since {
            self.parts.latency.add(since.elapsed());
        }
        if is(Apid::Event)
            && let Some(record) = EventRecord::read(&mut Reader::new(packet.user))
        {
            self.note_event(&record);
            // The packet has the time of now.
            if let Some(time) = packet.time.filter(|_| record.number == Event::ClockSet as u16) {
                let now_us = self.now_us();
                let step_s = self.clock.correlate(time.us, now_us);
                self.note_step("the telecommand time", step_s);
            }
        }
    }
    fn lift_off(&mut self) -> bool {
        self.parts.lines.lift_off()
    }
    fn power_fails(&mut self) -> bool {
        // A program that is asked to stop shuts down as if power was cut.
        self.parts.lines.power_fails() || self.parts.lines.stop()
    }
    fn was_watchdog_reset(&mut self) -> bool {
        self.head().is_some_and(|head| head.flash.was_cut_off())
    }
    fn feed_watchdog(&mut self) {
        self.parts.notify.feed();
    }
    fn camera_answers(&mut self) -> bool {
        // The program does not start without its camera.
        true
    }
    fn next_picture(&mut self) -> Option<Picture> {
        let (now_us, start) = (self.now_us(), self.start);
        let at_us = |shot: &Shot| shot.ready.saturating_duration_since(start).as_micros() as u64;
        self.head()?.next_picture(now_us, at_us)
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        let Some(head) = self.head() else { return };
        head.see_shown();
        if let Some(shot) = &head.current {
            viewer.see(&shot.pixels);
        }
    }
    fn repeats_picture(&mut self, limb: Option<&Solution<f32>>) -> bool {
        self.head().is_some_and(|head| head.repeats(limb))
    }
    fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        match self.head() {
            Some(head) => head.flash.read_copy(copy, into),
            None => into.fill(0xFF),
        }
    }
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        self.head().is_some_and(|head| head.write_copy(copy, bytes))
    }
    fn has_keys(&mut self) -> bool {
        self.parts.keys.is_used()
    }
    fn read_key(&mut self, place: u8, into: &mut [u8; KEY_BYTES]) {
        self.parts.keys.read(place, into);
    }
    fn read_counter(&mut self, place: u8) -> Option<u64> {
        self.parts.keys.counter(place)
    }
    fn write_counter(&mut self, place: u8, counter: u64) -> bool {
        self.parts.keys.write_counter(place, counter)
    }
    fn note_sensor(&mut self, config: &Config) {
        let selected = self.selected;
        if let Some(head) = self.head() {
            head.camera = Camera::try_new(&config.camera).ok();
            head.protection_factor = config.protection_factor(0);
            if let Some(keeper) = &mut head.keeper {
                keeper.set_config(config);
            }
        }
        self.parts.log.set_config(selected, config);
    }
    fn stack_bytes(&mut self) -> u32 {
        0
    }
    fn image(&mut self) -> Image {
        let program = std::fs::read("/proc/self/exe").unwrap_or_default();
        Image { build: BUILD, crc: if program.is_empty() { 0 } else { crc32fast::hash(&program) } }
    }
    fn read_retained(&mut self) -> [u32; RETAINED_WORDS] {
        self.head().map_or([0; RETAINED_WORDS], |head| head.flash.words())
    }
    fn write_retained(&mut self, words: [u32; RETAINED_WORDS]) {
        if let Some(head) = self.head() {
            head.flash.keep_words(words);
        }
    }
    fn keep_answer(&mut self, exposure: &Exposure, report: &Report<f32>) -> bool {
        let now_us = self.now_us();
        // Recorded pictures have the times of their recording.
        if self.recorded_us.is_none() {
            let step_s = self.clock.follow_system(system_s(), now_us);
            self.note_step("the system", step_s);
        }
        let time_s = self.clock.utc_s(exposure.exposure_us);
        let Some(head) = self.heads.get_mut(self.selected) else { return true };
        head.note_answer(report.status);
        let altitude_m = f64::from(exposure.altitude_m);
        let meta = RowMeta {
            index: u64::from(exposure.picture).saturating_sub(1),
            file: head.picture_name(),
            time_s: Some(time_s),
            body: Parameters::body(exposure.body).map_or("?", |body| body.name()).to_owned(),
            altitude_km: (!altitude_m.is_nan()).then_some(altitude_m * 1e-3),
        };
        // The same conversion as in `hzn run --flight`, so that the numbers have the same bits.
        let report = widen_report(report);
        let mut row = Row::from_report(&meta, &report, Some(f64::from(exposure.calculation_us)))
            .with_protection(head.protection_factor)
            .as_sent();
        row.head.clone_from(&head.name);
        head.note_meta(exposure.picture, meta);
        let mut record = FrameRecord::new(row);
        record.candidates = CandidateEdge::from_report(&report);
        record.log = std::mem::take(&mut self.events);
        if let Some((keeper, shot)) = head.keeper.as_mut().zip(head.current.as_ref()) {
            keeper.see(exposure.picture, report.status, &record, &shot.pixels);
        }
        self.parts.log.add(record)
    }
}

impl RigBoard for Linux {
    fn select_head(&mut self, head: u8) {
        self.selected = head.into();
    }
    fn picture_checksum(&mut self) -> Option<u32> {
        // A picture has few enough pixels for all of them.
        Some(crc32fast::hash(&self.head()?.current.as_ref()?.pixels))
    }
    fn keep_joint(&mut self, answer: &RigAnswer) {
        self.epochs.0 += 1;
        self.epochs.1 += u64::from(answer.outcome == Outcome::Answer as u8);
        let heads = &self.heads;
        let name = |k: u8| heads.get(usize::from(k)).and_then(|head| head.name.clone()).unwrap_or_default();
        let mut row = joint_row(answer, name);
        row.time_s = Some(self.clock.utc_s(answer.exposure_us));
        // Like the row of `hzn run`, that of the first head with a picture.
        let pictures = [answer.picture_0, answer.picture_1, answer.picture_2, answer.picture_3];
        let first = heads.iter().zip(pictures).find_map(|(head, picture)| head.meta(picture));
        if let Some(RowMeta { file, body, altitude_km, .. }) = first.cloned() {
            (row.file, row.body, row.altitude_km) = (file, body, altitude_km);
        }
        self.parts.log.add(FrameRecord::new(row));
    }
}
