//! The packets of a stream in words, and as rows.

use std::collections::BTreeMap;

use hzn_core::body::Kind;
use hzn_flight::answer::Position;
use hzn_flight::assembly::{Assembled, Assembly};
use hzn_flight::bytes::Reader;
use hzn_flight::cuc::{Cuc, Epoch};
use hzn_flight::joint::{Outcome, RigAnswer};
use hzn_flight::messages::{
    Acknowledge, AttitudeState, Code, EdgePart, EdgePixel, Event, EventRecord, Function, Housekeeping, Mode,
    NavigationState, ParameterValue, Severity,
};
use hzn_flight::packet::{Apid, ApidBase, Packet};
use hzn_flight::{Parameters, parameters};
use hzn_fly::joint::joint_row;
use hzn_fly::tell::Tell;
use hzn_mcap::{Annotations, CandidateEdge, FrameRecord, LogLevel, LogLine, Row, RowMeta};
use hzn_run::disk::Checked;

use crate::error::Error;
use crate::outcome;
use crate::outputs::{Sink, write_housekeeping};
use crate::tai;

/// What the ground sees in the packets.
pub enum Seen {
    /// An answer to a picture.
    Answer(Box<Assembled>),
    /// The state of the computer.
    Housekeeping(Box<Housekeeping>),
    /// The outcome of a telecommand.
    Acknowledge(Acknowledge),
    /// The value of a parameter that a telecommand has read, in words, with the time of its packet.
    Value(String),
    /// Another message, with the time of its packet.
    Note(LogLevel, String),
}

/// Counts of a stream, and the log lines for the next answer.
#[derive(Default)]
pub struct StreamCounts {
    pub(crate) base: ApidBase,
    /// Number of packets.
    pub packets: u64,
    /// Number of answers to pictures.
    pub answers: u64,
    /// Number of broken packets.
    pub cut: u64,
    /// Number of bytes that belong to no packet.
    pub skipped: u64,
    /// Number of lost packets, from the gaps in the sequence counts.
    pub lost: u64,
    next: BTreeMap<u16, u16>,
    log: Vec<LogLine>,
    /// What was seen since somebody looked.
    pub(crate) seen: Vec<Seen>,
    /// What shows messages as they come; `None` if a screen shows them.
    pub(crate) tell: Option<Tell>,
    /// The packets of a picture whose science packet has not come.
    assembly: Assembly,
    /// Packets of the first version of telemetry.
    old: u64,
    /// Packets of computers with another base.
    other: u64,
    /// Candidates and values of pictures whose packets did not come.
    incomplete: u64,
}

/// Most log lines that wait for an answer.
const MAX_LOG: usize = 1000;

impl StreamCounts {
    /// Begins to count the packets of a computer. `tell` gets every message as it comes.
    pub fn new(base: ApidBase, tell: Option<Tell>) -> Self {
        Self { base, tell, ..Self::default() }
    }

    pub(crate) fn take(
        &mut self,
        packet: &Packet<'_>,
        sink: &mut Option<Sink>,
        housekeeping: &mut Option<csv::Writer<Checked>>,
    ) -> Result<(), Error> {
        self.packets += 1;
        self.count_lost(packet);
        let subject = self.base.subject(packet);
        let is_telemetry = subject.is_some_and(|apid| apid != Apid::Command);
        if subject.is_none() && is_of_another_base(packet) {
            self.other += 1;
            return Ok(());
        }
        let Some(time) = packet.time.filter(|_| is_telemetry) else {
            self.old += u64::from(is_telemetry);
            if !is_telemetry {
                self.not_understood(packet);
            }
            return Ok(());
        };
        let from = &mut Reader::new(packet.user);
        let is_understood = match subject {
            Some(
                apid @ (Apid::Science
                | Apid::Candidate
                | Apid::Position
                | Apid::Integrity
                | Apid::Navigation
                | Apid::Attitude),
            ) => self.part_of_picture(apid, packet.user, sink)?,
            Some(Apid::Housekeeping) => match Housekeeping::read(from) {
                Some(record) => {
                    self.seen.push(Seen::Housekeeping(Box::new(record)));
                    write_housekeeping(time, &record, housekeeping)?;
                    true
                }
                None => false,
            },
            Some(Apid::Event) => EventRecord::read(from).map(|record| self.event(time, &record)).is_some(),
            Some(Apid::Acknowledge) => Acknowledge::read(from).map(|a| self.acknowledge(time, &a)).is_some(),
            Some(Apid::Parameters) => ParameterValue::read(from).map(|value| self.parameter(time, value)).is_some(),
            Some(Apid::Edge) => EdgePart::read(from).map(|part| self.edge(time, &part, from)).is_some(),
            Some(Apid::Rig) => match RigAnswer::read(from) {
                Some(answer) => {
                    self.joint(&answer, sink)?;
                    true
                }
                None => false,
            },
            Some(Apid::Command) | None => false,
        };
        if !is_understood {
            self.not_understood(packet);
        }
        Ok(())
    }

    /// Takes a packet of a picture. Returns whether it is understood.
    fn part_of_picture(&mut self, apid: Apid, user: &[u8], sink: &mut Option<Sink>) -> Result<bool, Error> {
        match self.assembly.take(apid, user) {
            Some(Some(picture)) => self.picture(&picture, sink).map(|()| true),
            part => Ok(part.is_some()),
        }
    }

    fn not_understood(&mut self, packet: &Packet<'_>) {
        let name = self.base.subject(packet).map_or(String::new(), |a| format!(" ({})", a.name()));
        let what = format!("a packet of APID {:#x}{name} with {} bytes", packet.apid, packet.user.len());
        let time = packet.time.unwrap_or(Cuc::since_start(0));
        self.note(time, LogLevel::Warning, &format!("{what} is not understood"));
    }

    /// Counts the packets that are missing before this one, from its sequence count.
    fn count_lost(&mut self, packet: &Packet<'_>) {
        if let Some(next) = self.next.insert(packet.apid, (packet.sequence + 1) & 0x3FFF) {
            let missing = packet.sequence.wrapping_sub(next) & 0x3FFF;
            // A count of 0, or one that goes back, means that the computer has restarted.
            if packet.sequence != 0 && missing < 0x2000 {
                self.lost += u64::from(missing);
            }
        }
    }

    fn event(&mut self, time: Cuc, record: &EventRecord) {
        let level = match Severity::from_number(record.severity) {
            Some(Severity::Information) => LogLevel::Info,
            Some(Severity::Warning) => LogLevel::Warning,
            Some(Severity::Error) | None => LogLevel::Error,
        };
        self.note(time, level, &describe_event(record));
    }

    fn acknowledge(&mut self, time: Cuc, a: &Acknowledge) {
        self.seen.push(Seen::Acknowledge(*a));
        let function = Function::from_number(a.function).map_or("?", Function::name);
        let level = if a.code == 0 { LogLevel::Info } else { LogLevel::Warning };
        self.note(time, level, &format!("command {} ({function}): {}", a.sequence, outcome::describe(a)));
    }

    fn parameter(&mut self, time: Cuc, ParameterValue { number, value }: ParameterValue) {
        let name = parameters::name(number).unwrap_or("?");
        let line = self.log(time, LogLevel::Info, &format!("parameter {number} {name} = {value}"));
        self.seen.push(Seen::Value(line));
    }

    fn edge(&mut self, time: Cuc, part: &EdgePart, from: &mut Reader<'_>) {
        let pixels = std::iter::from_fn(|| EdgePixel::read(from).map(|p| format!("{},{}", p.x, p.y)));
        let list: Vec<String> = pixels.take(part.count.into()).collect();
        let EdgePart { picture, candidate, first, total, stride, .. } = part;
        let what = format!("edge of picture {picture}, candidate {candidate}, stride {stride}");
        self.note(time, LogLevel::Info, &format!("{what}, {first} of {total}: {}", list.join(" ")));
    }

    fn picture(&mut self, picture: &Assembled, sink: &mut Option<Sink>) -> Result<(), Error> {
        let Assembled { exposure, answer, navigation, attitude, missing_candidates } = picture;
        let (time, time_s) = (Cuc::since_start(exposure.exposure_us), exposure.exposure_us as f64 * 1e-6);
        self.incomplete += u64::from(*missing_candidates > 0);
        let has_expired = [
            ("values from navigation", navigation.is_some_and(|n| n.state == NavigationState::EXPIRED)),
            ("attitude and the Sun", attitude.is_some_and(|a| a.state == AttitudeState::EXPIRED)),
        ];
        for (what, _) in has_expired.iter().filter(|(_, has_expired)| *has_expired) {
            let message = format!("picture {}: the {what} have expired", exposure.picture);
            self.log.push(LogLine { level: LogLevel::Warning, message });
        }
        let Some(report) = answer.to_report() else {
            self.note(time, LogLevel::Warning, &format!("picture {}: invalid numbers", exposure.picture));
            return Ok(());
        };
        self.answers += 1;
        self.seen.push(Seen::Answer(Box::new(picture.clone())));
        let Some(sink) = sink else { return Ok(()) };
        let body = Parameters::body(exposure.body);
        let altitude_km = (!exposure.altitude_m.is_nan()).then(|| f64::from(exposure.altitude_m) * 1e-3);
        let meta = RowMeta {
            index: u64::from(exposure.picture).saturating_sub(1),
            file: format!("picture-{:06}", exposure.picture),
            time_s: Some(time_s),
            body: body.map_or("?", hzn_core::body::Kind::name).to_owned(),
            altitude_km: altitude_km.filter(|_| !matches!(body, Some(Kind::Sun | Kind::Moon))),
        };
        let mut row = Row::from_report(&meta, &report, Some(f64::from(exposure.calculation_us)));
        if let Some(position) = &answer.position {
            set_position(&mut row, position);
        }
        row.protection_deg = answer.integrity.and_then(|i| i.protection_rad()).map(f64::to_degrees);
        let mut record = FrameRecord::new(row);
        record.candidates = CandidateEdge::from_report(&report);
        record.annotations = Annotations::default();
        record.log = std::mem::take(&mut self.log);
        sink.write(record)
    }

    /// Takes the joint answer of a rig.
    fn joint(&mut self, answer: &RigAnswer, sink: &mut Option<Sink>) -> Result<(), Error> {
        self.answers += 1;
        if answer.outcome != Outcome::Answer as u8 {
            let why = Outcome::from_number(answer.outcome).map_or("?", Outcome::name);
            let time = Cuc::since_start(answer.exposure_us);
            self.note(time, LogLevel::Warning, &format!("epoch {}: {why}", answer.epoch));
        }
        let Some(sink) = sink else { return Ok(()) };
        let mut record = FrameRecord::new(joint_row(answer, |k| format!("head{k}")));
        record.log = std::mem::take(&mut self.log);
        sink.write(record)
    }

    fn note(&mut self, time: Cuc, level: LogLevel, message: &str) {
        let line = self.log(time, level, message);
        self.seen.push(Seen::Note(level, line));
    }

    /// Tells a message and keeps it for the next answer. Returns it with its time.
    fn log(&mut self, time: Cuc, level: LogLevel, message: &str) -> String {
        let line = format!("{}  {message}", describe_time(time));
        if let Some(tell) = &self.tell {
            tell(&line);
        }
        if self.log.len() < MAX_LOG {
            self.log.push(LogLine { level, message: message.to_owned() });
        }
        line
    }

    /// Returns the counts in words.
    pub(crate) fn summary(&self) -> String {
        let Self { packets, answers, lost, cut, skipped, incomplete, old, other, .. } = self;
        let mut text = format!("{packets} packets, {answers} answers");
        if *lost > 0 {
            text += &format!(", {lost} packets lost on the way");
        }
        if *cut > 0 || *skipped > 0 {
            text += &format!(", {cut} broken packets, {skipped} bytes skipped");
        }
        if *incomplete > 0 {
            text += &format!(", {incomplete} answers without some of their candidates");
        }
        if *other > 0 {
            text += &format!(", {other} packets of other computers or heads (see --apid-base)");
        }
        if *old > 0 {
            text += &format!(
                ", {old} packets of version 1 (times in microseconds), which this program does not read; use the \
                 program of the same version as the flight software"
            );
        }
        text
    }
}

/// Returns whether a packet is telemetry of a computer or a head with another base.
fn is_of_another_base(packet: &Packet<'_>) -> bool {
    let base = ApidBase::try_new(packet.apid - packet.apid % ApidBase::STEP);
    base.and_then(|base| base.subject(packet)).is_some_and(|apid| apid != Apid::Command)
}

/// Fills the columns of the position, which is no part of a report that came by telemetry.
fn set_position(row: &mut Row, position: &Position) {
    if position.position_m.iter().all(|x| x.is_finite()) {
        let body_fixed_m = position.body_fixed_m.map(f64::from);
        let body_fixed_m = body_fixed_m.iter().all(|x| x.is_finite()).then_some(body_fixed_m);
        row.set_position_m(position.position_m.map(f64::from), position.pos_cov_m2.map(f64::from), body_fixed_m);
    }
}

/// Returns a time in words: seconds since the start of the computer, or UTC.
fn describe_time(time: Cuc) -> String {
    match time.epoch {
        Epoch::Start => format!("{:12.6} s", time.us as f64 * 1e-6),
        Epoch::Tai => tai::utc_text(time.us),
    }
}

/// Returns an event in words.
fn describe_event(record: &EventRecord) -> String {
    let EventRecord { number, a, b, .. } = *record;
    let mode = |n: u32| u8::try_from(n).ok().and_then(Mode::from_number).map_or("?", Mode::name);
    match Event::from_number(number) {
        Some(Event::ModeChanged) => format!("{} to {} mode", mode(a), mode(b)),
        Some(Event::Started) => format!("started with copy {a} of the parameters, generation {b}"),
        Some(Event::CommandRejected) => {
            let code = u8::try_from(a).ok().and_then(Code::from_number).map_or("?", Code::name);
            format!("telecommand rejected: {code} (function {b})")
        }
        Some(Event::Stored) => format!("parameters stored in copy {a}, generation {b}"),
        Some(Event::ClockSet) => {
            let change = if b == u32::MAX { String::new() } else { format!(", changed by {b} ms") };
            format!("clock correlated with {}{change}", tai::utc_text(u64::from(a) * 1_000_000))
        }
        Some(Event::CameraSilent) => {
            format!("the camera sends no pictures: the last one, number {b}, came {:.1} s ago", f64::from(a) * 1e-3)
        }
        Some(Event::KnownExpired) => {
            let what = if b == 0 { "values from navigation" } else { "attitude and the Sun" };
            format!("the {what} have expired: they are {:.1} s from the exposure", f64::from(a) * 1e-3)
        }
        Some(Event::Repaired) => {
            let what = match a {
                1 => "sensor, made anew from the stored parameters",
                2 => "values from navigation",
                _ => "parameters of the flight software, read again from memory",
            };
            format!("memory error number {b} was repaired: {what}")
        }
        Some(e) => format!("{} ({a}, {b})", e.name()),
        None => format!("event {number} ({a}, {b})"),
    }
}
