//! The Linux computer as the board of the flight software.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crossbeam_channel::{Receiver, never, select};
use hzn_core::status::Status;
use hzn_core::{Config, Report};
use hzn_flight::Parameters;
use hzn_flight::board::{BUILD, Board, Image, Picture, RETAINED_WORDS};
use hzn_flight::bytes::Reader;
use hzn_flight::messages::{Event, EventRecord, Exposure, Severity};
use hzn_flight::packet::{self, Apid, ApidBase, Scan};
use hzn_flight::view::Viewer;
use hzn_mcap::{CandidateEdge, FrameRecord, LogLevel, LogLine, Row, RowMeta};
use hzn_run::engine::widen_report;

use crate::camera::{Capture, Ended, FromCamera, Shot};
use crate::flash::Flash;
use crate::latency::Latency;
use crate::link::Link;
use crate::log::Log;
use crate::log_clock::LogClock;
use crate::notify::Notify;
use crate::signals::Lines;
use crate::tell::{Rarely, Tell};

/// Longest sleep of the loop. The watchdog is fed and the lines of the vehicle are read this often.
const LONGEST_WAIT: Duration = Duration::from_millis(20);
/// Events that wait for the next answer in the log.
const EVENTS: usize = 64;

/// Counts of a flight.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Pictures that were processed.
    pub pictures: u64,
    /// Pictures with an answer.
    pub answers: u64,
    /// Pictures that were lost.
    pub lost: u64,
    /// Pictures that the flight software refused, such as those of a wrong size. An event says why.
    pub refused: u64,
}

/// The parts of the computer that the flight software uses.
pub(crate) struct Parts {
    pub(crate) capture: Capture,
    pub(crate) line: Option<(Link, Receiver<Vec<u8>>)>,
    pub(crate) latency: Arc<Latency>,
    pub(crate) flash: Flash,
    pub(crate) log: Log,
    pub(crate) lines: Arc<Lines>,
    pub(crate) notify: Notify,
    pub(crate) tell: Tell,
}

/// The board.
pub(crate) struct Linux {
    start: Instant,
    clock: LogClock,
    parts: Parts,
    arrived: VecDeque<u8>,
    next: Option<Shot>,
    current: Option<Shot>,
    ended: Option<Ended>,
    events: Vec<LogLine>,
    counts: Counts,
    /// Number of pictures that were handed out to be processed.
    handed_out: u64,
    /// Multiple of sigma that is the protection level.
    protection_factor: Option<f64>,
    not_stored: Rarely,
}

impl Linux {
    pub(crate) fn new(parts: Parts) -> Self {
        Self {
            start: Instant::now(),
            clock: LogClock::new(system_s(), 0),
            not_stored: Rarely::new(parts.tell.clone()),
            parts,
            arrived: VecDeque::new(),
            next: None,
            current: None,
            ended: None,
            events: Vec::new(),
            counts: Counts::default(),
            handed_out: 0,
            protection_factor: None,
        }
    }

    /// Waits until there is something to do. `takes_pictures` says whether the loop processes every picture; otherwise
    /// only the newest one is kept, so that the camera need not wait.
    pub(crate) fn wait(&mut self, takes_pictures: bool) {
        if !self.arrived.is_empty() || takes_pictures && self.next.is_some() {
            return;
        }
        let nothing = never();
        let bytes = self.parts.line.as_ref().map_or(&nothing, |(_, bytes)| bytes);
        let no_pictures = never();
        // After its end, a channel would always be ready.
        let pictures = if self.ended.is_some() { &no_pictures } else { &self.parts.capture.pictures };
        select! {
            recv(pictures) -> picture => self.take(picture.ok()),
            recv(bytes) -> bytes => self.arrived.extend(bytes.unwrap_or_default()),
            default(LONGEST_WAIT) => {}
        }
    }

    fn take(&mut self, from: Option<FromCamera>) {
        match from {
            Some(FromCamera::Shot(shot)) => {
                if let Some(older) = self.next.replace(shot) {
                    self.give_back(older);
                }
            }
            Some(FromCamera::End(why)) => self.ended = Some(why),
            None => self.ended = Some(Ended::Failed("the camera's thread has ended".into())),
        }
    }

    fn give_back(&self, shot: Shot) {
        // The channel has room for every buffer.
        let _ = self.parts.capture.spare.try_send(shot.pixels);
    }

    /// Returns why no more pictures will come. If the loop takes every picture, the last one must have been taken.
    pub(crate) fn ended(&self, takes_pictures: bool) -> Option<&Ended> {
        self.ended.as_ref().filter(|_| !takes_pictures || self.next.is_none())
    }
    pub(crate) fn counts(&self) -> Counts {
        Counts { refused: self.handed_out.saturating_sub(self.counts.pictures), ..self.counts }
    }
    pub(crate) fn parts(&mut self) -> &mut Parts {
        &mut self.parts
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
        let message = format!("{name} ({}, {})", record.a, record.b);
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
        self.start.elapsed().as_micros() as u64
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
        let since = self.current.as_ref().filter(|_| is(Apid::Science)).map(|shot| shot.ready);
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
        self.parts.flash.was_cut_off()
    }
    fn feed_watchdog(&mut self) {
        self.parts.notify.feed();
    }
    fn camera_answers(&mut self) -> bool {
        // The program does not start without its camera.
        true
    }
    fn next_picture(&mut self) -> Option<Picture> {
        if self.next.is_none() && self.ended.is_none() {
            match self.parts.capture.pictures.try_recv() {
                Ok(from) => self.take(Some(from)),
                Err(e) if e.is_disconnected() => self.take(None),
                Err(_) => {}
            }
        }
        let shot = self.next.take()?;
        self.counts.lost += u64::from(shot.lost);
        self.handed_out += 1;
        let exposure_us = shot.ready.saturating_duration_since(self.start).as_micros() as u64;
        let picture = Picture { bytes: shot.pixels.len(), exposure_us, lost: shot.lost };
        if let Some(before) = self.current.replace(shot) {
            self.give_back(before);
        }
        Some(picture)
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        if let Some(shot) = &self.current {
            viewer.see(&shot.pixels);
        }
    }
    fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        self.parts.flash.read_copy(copy, into);
    }
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        let written = self.parts.flash.write_copy(copy, bytes);
        if let Err(e) = &written {
            let folder = self.parts.flash.folder().display();
            self.not_stored.line(&format!("{folder}: the parameters cannot be stored: {e}"));
        }
        written.is_ok()
    }
    fn note_sensor(&mut self, config: &Config) {
        self.protection_factor = config.protection_factor(0);
        self.parts.log.set_config(config);
    }
    fn stack_bytes(&mut self) -> u32 {
        0
    }
    fn image(&mut self) -> Image {
        let program = std::fs::read("/proc/self/exe").unwrap_or_default();
        Image { build: BUILD, crc: if program.is_empty() { 0 } else { crc32fast::hash(&program) } }
    }
    fn read_retained(&mut self) -> [u32; RETAINED_WORDS] {
        self.parts.flash.words()
    }
    fn write_retained(&mut self, words: [u32; RETAINED_WORDS]) {
        self.parts.flash.keep_words(words);
    }
    fn keep_answer(&mut self, exposure: &Exposure, report: &Report<f32>) -> bool {
        self.counts.pictures += 1;
        self.counts.answers += u64::from(report.status == Status::Ok);
        let number = self.current.as_ref().map_or(0, |shot| shot.number);
        let now_us = self.now_us();
        let step_s = self.clock.follow_system(system_s(), now_us);
        self.note_step("the system", step_s);
        let altitude_m = f64::from(exposure.altitude_m);
        let meta = RowMeta {
            index: u64::from(exposure.picture).saturating_sub(1),
            file: format!("frame-{number:06}"),
            time_s: Some(self.clock.utc_s(exposure.exposure_us)),
            body: Parameters::body(exposure.body).map_or("?", |body| body.name()).to_owned(),
            altitude_km: (!altitude_m.is_nan()).then_some(altitude_m * 1e-3),
        };
        // The same conversion as in `hzn run --flight`, so that the numbers have the same bits.
        let report = widen_report(report);
        let row = Row::from_report(&meta, &report, Some(f64::from(exposure.calculation_us)))
            .with_protection(self.protection_factor);
        let mut record = FrameRecord::new(row);
        record.candidates = CandidateEdge::from_report(&report);
        record.log = std::mem::take(&mut self.events);
        self.parts.log.add(record)
    }
}
